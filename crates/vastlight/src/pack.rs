//! From a scene, mesh by mesh, to a store, within a memory budget.
//!
//! Meshes that fit are packed in memory, several side by side; one that does not goes through the disk and is packed
//! bucket by bucket. What is done is noted beside the store, so that a pack that was stopped goes on from there.

use crate::budget::PackBudget;
use crate::memory::mesh_bytes;
use crate::{Error, ErrorClass, PackInput, textures};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use vastlight_accel::Scratch;
use vastlight_scene::{
    Diagnostic, Instances, LargeMesh, Material, Mesh, MeshExtent, MeshPreparation, Piece, PieceInstance,
    Scene, SceneDesc, SceneError, SceneStream,
};
use vastlight_store::{
    MOST_PAGE_BYTES, PackConfig, PackedMesh, SourceFile, Spool, SpooledMesh, StoreSize, StoreWriter,
};

/// How far a pack is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PackProgress {
    /// Triangles that are in the store.
    pub triangles: u64,
    /// Of how many, as far as that is known.
    pub total: Option<u64>,
    /// Triangles that an earlier run had packed already.
    pub resumed: u64,
}

/// What a pack is told, and tells.
pub struct PackControl<'a> {
    /// Most bytes of the process; none for the default.
    pub memory: Option<u64>,
    /// Set to stop: what is done stays for the next time.
    pub cancel: &'a AtomicBool,
    /// Told after each step.
    pub progress: &'a dyn Fn(&PackProgress),
}

impl PackControl<'_> {
    /// Stops what was cancelled.
    fn check_cancel(&self) -> Result<(), Error> {
        if !self.cancel.load(Ordering::Relaxed) {
            return Ok(());
        }
        let hint = "the same command goes on where it stopped";
        Err(Error::new(ErrorClass::Interrupted, "interrupted", "pack", hint))
    }
}

impl std::fmt::Debug for PackControl<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PackControl").field("memory", &self.memory).finish_non_exhaustive()
    }
}

/// Packs a scene to a store at `target` within the default budget; `progress` is told the triangles so far. The same
/// scene gives the same bytes.
///
/// # Errors
/// Those of [`pack_within`].
pub fn pack(
    input: impl Into<PackInput>,
    target: &Path,
    config: &PackConfig,
    progress: impl Fn(u64),
) -> Result<StoreSize, Error> {
    let progress = |p: &PackProgress| progress(p.triangles);
    let control = PackControl { memory: None, cancel: &AtomicBool::new(false), progress: &progress };
    pack_within(input.into(), target, config, control)
}

/// Packs a scene to a store at `target`. A pack that was stopped before, of the same scene in the same way, goes on where
/// it was; the store is the same, byte for byte.
///
/// # Errors
/// If the budget is too small, the scene is wrong, the store cannot be written, or the pack was cancelled: the target is then left as it was.
/// Where the disk failed or the pack was cancelled, what is done is kept beside it.
pub fn pack_within(
    input: PackInput,
    target: &Path,
    config: &PackConfig,
    control: PackControl<'_>,
) -> Result<StoreSize, Error> {
    check_config(config)?;
    let budget = PackBudget::new(control.memory, &input, config.tile_bytes)?;
    let identity = identity(&input.sources, &input.settings, config, Some(budget.most))?;
    let mut packing = Packing::new(&input, target, config, control, budget, &identity)?;
    let PackInput { stream, large, sources, .. } = input;
    let packed = packing.all(stream, large);
    let Packing { writer, .. } = packing;
    match packed {
        Ok(scene) => Ok(writer.finish(scene, &sources)?),
        Err(error) => {
            if !matches!(error.class, ErrorClass::Output | ErrorClass::Interrupted) {
                writer.discard();
            }
            Err(error)
        }
    }
}

/// Refuses what has no triangles to put into pages.
fn refuse_implicit(piece: &Piece) -> Result<(), Error> {
    if piece.mesh.implicit.is_none() {
        return Ok(());
    }
    let place = format!("mesh \"{}\"", piece.mesh.name);
    Err(Error::scene("a store holds no implicit surfaces", place, "render the scene itself, in memory"))
}

/// Refuses pages that no reader would believe.
fn check_config(config: &PackConfig) -> Result<(), Error> {
    let PackConfig { page_bytes, tile_bytes, .. } = config;
    for (bytes, flag) in [(page_bytes, "--page-bytes"), (tile_bytes, "--tile-bytes")] {
        if *bytes > MOST_PAGE_BYTES as usize {
            let what = format!("a page has at most {MOST_PAGE_BYTES} bytes, not {bytes}");
            return Err(Error::usage(what, flag, ""));
        }
    }
    Ok(())
}

/// What says which scene is packed, and how; `most` is the largest mesh that is packed at once.
pub(crate) fn identity(
    sources: &[SourceFile],
    settings: &str,
    config: &PackConfig,
    most: Option<usize>,
) -> Result<Vec<u8>, Error> {
    if sources.is_empty() {
        // Nothing says whether it is the same scene the next time.
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        return postcard_bytes(&(std::process::id(), now.as_nanos() as u64));
    }
    let version = (vastlight_store::format::VERSION, env!("CARGO_PKG_VERSION"));
    let settings = format!("{config:?} {settings}");
    postcard_bytes(&(version, sources, settings, most.map(|most| most as u64)))
}

fn postcard_bytes<T: Serialize>(value: &T) -> Result<Vec<u8>, Error> {
    postcard::to_stdvec(value).map_err(|error| Error::scene(error.to_string(), "journal", ""))
}

/// What stays in memory of a mesh that is in the store.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    mesh: Mesh,
    instances: Vec<PieceInstance>,
    found: Vec<Diagnostic>,
    triangles: u64,
    /// Whether it came block by block.
    large: bool,
}

/// A step, as the journal has it.
#[derive(Debug, Serialize, Deserialize)]
enum Step {
    /// Meshes were added, or one was put together from its parts.
    Meshes(Vec<Kept>),
    /// A part of so many triangles was added.
    Part(u64),
}

/// Findings of the same words that are kept, so that a scene of many meshes is not one of many findings.
const FINDINGS: u32 = 8;

/// Placements that wait with the meshes that are packed side by side, unless those of one mesh are more.
const PLACED: usize = 1 << 18;

struct Packing<'c> {
    /// All that is known so far, geometry only of meshes that shine.
    desc: SceneDesc,
    instances: Instances,
    preparation: MeshPreparation,
    config: &'c PackConfig,
    writer: StoreWriter,
    budget: PackBudget,
    folder: &'c Path,
    /// How often each finding came.
    found: BTreeMap<String, u32>,
    control: PackControl<'c>,
    done: PackProgress,
    /// Whether the pieces are done, and it is the turn of large meshes.
    large: bool,
    /// Of those whose turn it is, how many are done.
    meshes_done: usize,
    /// Meshes whose vertices move, ascending: they stay in memory, and have no pages.
    deforming: Vec<u32>,
}

impl<'c> Packing<'c> {
    fn new(
        input: &PackInput,
        target: &'c Path,
        config: &'c PackConfig,
        control: PackControl<'c>,
        budget: PackBudget,
        identity: &[u8],
    ) -> Result<Self, Error> {
        if let Some(error) = input.stream.desc.diagnostics.first_error() {
            return Err(SceneError::from(error.clone()).into());
        }
        let desc = SceneDesc::default();
        Ok(Self {
            preparation: MeshPreparation::new(&desc),
            desc,
            instances: Instances::default(),
            config,
            writer: StoreWriter::create(target, identity)?,
            budget,
            folder: target.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new(".")),
            found: BTreeMap::new(),
            control,
            done: PackProgress { triangles: 0, total: input.triangles(), resumed: 0 },
            large: false,
            meshes_done: 0,
            deforming: Vec::new(),
        })
    }

    /// Packs everything; gives the scene without what is in the store.
    fn all(&mut self, stream: SceneStream, large: Vec<LargeMesh>) -> Result<Scene, Error> {
        self.desc = stream.desc;
        if self.desc.materials.is_empty() {
            self.desc.materials.push(Material::new("neutral"));
        }
        self.preparation = MeshPreparation::new(&self.desc);
        self.keep_motion()?;
        // Tiles stand before all meshes, and are made again when a pack goes on: the same bytes at the same place.
        let check = || self.control.check_cancel();
        textures::pack(&mut self.desc, stream.rows, self.config.tile_bytes, &mut self.writer, &check)?;
        self.run(stream.pieces, large)?;
        let (desc, instances) = (std::mem::take(&mut self.desc), std::mem::take(&mut self.instances));
        Ok(Scene::with_meshes_elsewhere(desc, instances, self.writer.extents(), &self.deforming)?)
    }

    /// Notes which meshes deform. A movement that cannot be kept is left out with a warning.
    fn keep_motion(&mut self) -> Result<(), Error> {
        let Some(motion) = self.desc.motion.clone() else { return Ok(()) };
        let Some(record) = motion.record() else {
            self.desc.motion = None;
            let what = "what moves stands still: a store cannot keep this movement";
            self.desc.diagnostics.warn(what, "motion", "--time S takes another moment than the first");
            return Ok(());
        };
        self.budget.hold(record.bytes.len() as u64);
        self.deforming = motion.pose(0.0)?.meshes.iter().map(|posed| posed.mesh).collect();
        self.deforming.sort_unstable();
        Ok(())
    }

    fn run(&mut self, mut pieces: vastlight_scene::Pieces, large: Vec<LargeMesh>) -> Result<(), Error> {
        self.resume()?;
        // Large meshes stand behind all pieces.
        let mut next = if self.large { None } else { pieces.nth(self.meshes_done) };
        let mut batch = Vec::new();
        while let Some(piece) = next {
            let piece = piece?;
            refuse_implicit(&piece)?;
            self.add_piece(piece, &mut batch)?;
            next = pieces.next();
        }
        self.add(&mut batch)?;
        let done = if self.large { self.meshes_done } else { 0 };
        self.large = true;
        large.into_iter().skip(done).try_for_each(|mesh| self.add_large(mesh))
    }

    /// Takes over what an earlier run has done.
    fn resume(&mut self) -> Result<(), Error> {
        let mut steps = Vec::new();
        self.writer.resume(|note| {
            let step = postcard::from_bytes::<Step>(note);
            step.map(|step| steps.push(step)).is_ok()
        })?;
        for step in steps {
            match step {
                Step::Meshes(kept) => kept.into_iter().for_each(|kept| self.keep(kept)),
                Step::Part(triangles) => self.done.triangles += triangles,
            }
        }
        self.done.resumed = self.done.triangles;
        Ok(())
    }

    /// Adds a piece to those that are packed side by side, and packs them when there are enough.
    fn add_piece(&mut self, piece: Piece, batch: &mut Vec<Piece>) -> Result<(), Error> {
        let number = self.desc.meshes.len() + batch.len();
        if self.deforming.binary_search(&(number as u32)).is_ok() {
            self.add(batch)?;
            return self.add_deforming(piece);
        }
        let waiting: usize = batch.iter().map(|piece| piece.mesh.triangles.len()).sum();
        let placed: usize = batch.iter().map(|piece| piece.instances.len()).sum();
        let triangles = piece.mesh.triangles.len();
        let too_many = waiting + triangles > self.budget.most || placed + piece.instances.len() > PLACED;
        if !batch.is_empty() && too_many {
            self.add(batch)?;
        }
        if triangles > self.budget.most {
            return self.add_through_disk(piece);
        }
        batch.push(piece);
        if waiting + triangles >= self.budget.together { self.add(batch) } else { Ok(()) }
    }

    /// Packs pieces side by side and adds them in their order.
    fn add(&mut self, pieces: &mut Vec<Piece>) -> Result<(), Error> {
        if pieces.is_empty() {
            return Ok(());
        }
        let (preparation, config) = (&self.preparation, self.config);
        let prepare = |scratch: &mut Scratch, piece: &mut Piece| {
            let found = preparation.prepare(&mut piece.mesh)?;
            Ok::<_, Error>((found, PackedMesh::new(&piece.mesh, config, scratch)?))
        };
        let packed: Vec<_> = pieces.par_iter_mut().map_init(Scratch::default, prepare).collect();
        let mut kept = Vec::with_capacity(pieces.len());
        for (piece, packed) in pieces.drain(..).zip(packed) {
            let (found, mesh) = packed?;
            self.writer.add(&mesh)?;
            kept.push(self.kept(piece, found));
        }
        self.note(Step::Meshes(kept))
    }

    /// Adds a mesh whose vertices move, as it was described: it is prepared at each moment.
    fn add_deforming(&mut self, mut piece: Piece) -> Result<(), Error> {
        let triangles = piece.mesh.triangles.len() as u64;
        self.budget.check_whole(triangles, &piece.mesh.name)?;
        let mesh = piece.mesh.clone();
        let found = self.preparation.prepare(&mut piece.mesh)?;
        self.writer.add_deforming(MeshExtent { bounds: piece.mesh.bounds(), triangles });
        let kept = Kept { mesh, ..self.kept(piece, found) };
        self.note(Step::Meshes(vec![kept]))
    }

    /// What stays in memory of a piece.
    fn kept(&self, piece: Piece, found: Vec<Diagnostic>) -> Kept {
        let Piece { mesh, instances, mut diagnostics } = piece;
        diagnostics.extend(found);
        let triangles = mesh.triangles.len() as u64;
        let mesh = if self.shines(&mesh) {
            mesh
        } else {
            Mesh { name: mesh.name, parts: mesh.parts, ..Mesh::default() }
        };
        Kept { mesh, instances, found: diagnostics, triangles, large: self.large }
    }

    fn shines(&self, mesh: &Mesh) -> bool {
        let shines =
            |material: u32| self.desc.materials.get(material as usize).is_some_and(Material::is_emissive);
        materials_of(mesh).any(shines)
    }

    /// Packs a mesh in memory bucket by bucket.
    fn add_through_disk(&mut self, mut piece: Piece) -> Result<(), Error> {
        let found = self.preparation.prepare(&mut piece.mesh)?;
        let name = piece.mesh.name.clone();
        let mut spool = Spool::of_prepared(self.folder, self.budget.cache)?;
        let read = piece.mesh.stream(&mut spool);
        let spooled = spool.finish::<Error>(read)?;
        // Triangles are counted part by part.
        let kept = Kept { triangles: 0, ..self.kept(piece, found) };
        self.add_buckets(&name, spooled)?;
        self.note(Step::Meshes(vec![kept]))
    }

    /// Adds a mesh that comes block by block: through memory if it fits, else through the disk.
    fn add_large(&mut self, large: LargeMesh) -> Result<(), Error> {
        self.control.check_cancel()?;
        let mesh = Mesh { name: large.name.clone(), parts: large.parts.clone(), ..Mesh::default() };
        let needs_all = self.shines(&mesh) || materials_of(&mesh).any(|m| self.preparation.needs_tangents(m));
        let fits = large.triangles.is_some_and(|n| n <= self.budget.most as u64);
        if needs_all || fits {
            if let Some(n) = large.triangles.filter(|_| !fits) {
                self.budget.check_whole(n, &large.name)?;
            }
            let instances = large.instances.clone();
            let piece = Piece { mesh: large.collect()?, instances, ..Piece::default() };
            if piece.mesh.triangles.len() > self.budget.most {
                return self.add_through_disk(piece);
            }
            return self.add(&mut vec![piece]);
        }
        let mut spool = Spool::new(self.folder, self.budget.cache)?;
        let read = (large.read)(&mut spool);
        let spooled = spool.finish::<Error>(read)?;
        if spooled.triangles() == 0 {
            return self.add(&mut vec![Piece { mesh, instances: large.instances, ..Piece::default() }]);
        }
        let found = self.add_buckets(&large.name, spooled)?;
        self.note(Step::Meshes(vec![Kept {
            mesh,
            instances: large.instances,
            found,
            triangles: 0,
            large: true,
        }]))
    }

    /// Packs a mesh on disk bucket by bucket, and puts the tree above them. What was found about its triangles.
    fn add_buckets(&mut self, name: &str, spooled: SpooledMesh) -> Result<Vec<Diagnostic>, Error> {
        let mut buckets = spooled.cut(name, self.budget.most)?;
        let mut number = self.writer.waiting_parts();
        let mut bucket = (number < buckets.len()).then(|| buckets.load(number)).transpose()?;
        while let Some(current) = bucket.take() {
            self.control.check_cancel()?;
            let more = number + 1 < buckets.len();
            let config = self.config;
            let (packed, next) = rayon::join(
                || PackedMesh::part(&current, config, &mut Scratch::default()),
                || more.then(|| buckets.load(number + 1)).transpose(),
            );
            self.writer.add_part(&packed?)?;
            self.note(Step::Part(current.numbers.len() as u64))?;
            bucket = next?;
            number += 1;
        }
        self.writer.join_parts(name, &self.config.accel)?;
        Ok(buckets.findings().of_mesh(name))
    }

    /// Notes that a step is done, and takes over what stays of it.
    fn note(&mut self, step: Step) -> Result<(), Error> {
        self.writer.note(&postcard_bytes(&step)?)?;
        match step {
            Step::Meshes(kept) => kept.into_iter().for_each(|kept| self.keep(kept)),
            Step::Part(triangles) => self.done.triangles += triangles,
        }
        (self.control.progress)(&self.done);
        self.control.check_cancel()
    }

    fn keep(&mut self, kept: Kept) {
        self.done.triangles += kept.triangles;
        self.budget.hold(mesh_bytes(&kept.mesh));
        self.meshes_done = if kept.large == self.large { self.meshes_done + 1 } else { 1 };
        self.large = kept.large;
        for diagnostic in kept.found {
            let times = self.found.entry(diagnostic.what.clone()).or_default();
            *times += 1;
            if *times <= FINDINGS {
                self.desc.diagnostics.push(diagnostic);
            }
        }
        self.desc.meshes.push(kept.mesh);
        self.instances.add_mesh(&kept.instances);
    }
}

/// The materials of a mesh.
pub(crate) fn materials_of(mesh: &Mesh) -> impl Iterator<Item = u32> {
    let default = mesh.parts.is_empty().then_some(0);
    default.into_iter().chain(mesh.parts.iter().map(|part| part.material))
}
