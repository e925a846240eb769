//! A scene made traceable.

use crate::follow::UpdateMethod;
use crate::grid::GridTop;
use crate::implicit::Implicits;
use crate::instance::{MeshSpace, Places};
use crate::judge::Filtered;
use crate::kd::{KdBatch, KdScene};
use crate::mesh::{Layout, MeshTree};
use crate::paged::Found;
use crate::patch::{ROWS, rows};
use crate::pose::Movers;
use crate::walk::{Answers, Batch};
use crate::{AcceptAll, Hit, HitFilter};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};
use vastlight_accel::build::resolve;
use vastlight_accel::compact::{CompactError, CompactMesh, PackedPage, SLACK};
use vastlight_accel::kdtree::{KdKind, KdMesh};
use vastlight_accel::wide::traverse::stack_entries;
use vastlight_accel::wide::{InstanceBvh, MeshBuild, MeshBvh, MeshView};
use vastlight_accel::{BuildConfig, BuildError, ClusterConfig, Scratch};
use vastlight_math::{Aabb, Ray};
use vastlight_paging::Table;
use vastlight_scene::{Mesh, Scene};
use vastlight_simd::Level;

/// How a [`Tracer`] is built and runs. Nothing here changes a hit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TracerConfig {
    /// Name of the builder; empty for the default.
    pub accel: String,
    /// Most references to triangles, as a multiple of the triangles (see `BuildConfig::split_budget`).
    pub split_budget: Option<f32>,
    /// Rounds of reinsertion after the build, see [`BuildConfig::optimize`].
    pub optimize: u32,
    /// Measure trees over meshes: [`BuildReport::cost`] and what follows it.
    pub measure: bool,
    /// Instructions to use; none for the best of the machine.
    pub level: Option<Level>,
    /// How meshes lie in memory.
    pub layout: Layout,
    /// What is above the meshes.
    pub top: TopLevel,
    /// Trace every ray by itself, also those that go the same way: to measure what bundles are worth.
    pub single_rays: bool,
    /// How structures of meshes follow poses with other vertices.
    pub update: UpdateMethod,
    /// Name of the builder of meshes that move; empty for `accel`.
    pub rebuild: String,
    /// Meshes that are rebuilt ([`UpdateMethod::Rebuild`]) get trees over such clusters, made when a mesh moves for the first time:
    /// builds are some 3 to 10 times faster, rays up to 11 % slower (`docs/algorithms/moving-scenes.md`).
    pub clusters: Option<ClusterConfig>,
}

/// What is above the meshes of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TopLevel {
    /// A tree over instances, below each the tree of its mesh.
    #[default]
    Tree,
    /// As published: a grid of so many cells along each axis, at most 256, in each a tree over the
    /// subtrees in pages of all instances. For meshes in pages; rays are not bundled.
    Grid(u32),
}

/// Why a scene cannot be traced.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    /// A structure could not be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A mesh has no compact layout.
    #[error(transparent)]
    Compact(#[from] CompactError),
    /// A grid over meshes that are not in pages.
    #[error("a grid needs meshes in pages: the compact layout, or a store")]
    Grid,
    /// A shutter is open, and the structures know but one moment.
    #[error("{0} know but one moment, and a shutter is open")]
    Shutter(&'static str),
    /// The structures cannot be handed to a device.
    #[error("the structures cannot be had as words: {0}")]
    Words(&'static str),
    /// A structure that has but one layout was asked for another.
    #[error("{accel} has no {layout} layout")]
    Layout {
        /// Name of the structure.
        accel: &'static str,
        /// Name of the layout.
        layout: &'static str,
    },
}

/// What building took and gave.
#[derive(Clone, Debug, Default)]
pub struct BuildReport {
    /// Full name of the builder.
    pub accel: &'static str,
    /// Triangles in meshes that instances use, each mesh counted once.
    pub triangles: u64,
    /// Wall time in milliseconds.
    pub build_ms: f64,
    /// Nodes of the binary trees, over meshes and over instances.
    pub nodes: u64,
    /// References to triangles in leaves.
    pub references: u64,
    /// Memory of all structures, with the triangles' positions and instances.
    pub bytes: u64,
    /// The part of `bytes` that tells the triangles' numbers in their meshes; zero for kd-trees, which do not count it.
    pub number_bytes: u64,
    /// `C(root)`, see `vastlight_accel::Quality`; an instance costs what its mesh's tree costs. This and the next two are
    /// zero where the trees were not measured, and the last two where they are kd-trees.
    pub cost: f64,
    /// Nodes on the longest way from the root through an instance to a leaf.
    pub depth: u64,
    /// Overlap of siblings, see `vastlight_accel::Quality`; the mean over meshes, weighted by nodes.
    pub overlap: f64,
    /// Milliseconds by stage; where meshes are built side by side, their sum.
    pub stages: Vec<(&'static str, f64)>,
}

/// Finds hits in a scene. Meshes are shared by their instances; the tracer keeps its own copy of their positions.
#[derive(Debug)]
pub struct Tracer {
    pub(crate) meshes: Vec<MeshTree>,
    /// The pages of all meshes, where they are in memory for good.
    pub(crate) pages: Table,
    pub(crate) places: Places,
    /// Over instances, or in the cells of the grid.
    pub(crate) top: InstanceBvh,
    pub(crate) grid: Option<GridTop>,
    /// In the place of `meshes` and `top`.
    pub(crate) kd: Option<KdScene>,
    /// Beside the triangles.
    pub(crate) implicits: Option<Implicits>,
    /// Room that a ray needs for children that wait.
    pub(crate) stack_entries: usize,
    pub(crate) bundles: bool,
    /// Whether a shutter is open in which meshes get other vertices.
    pub(crate) vertices_move: bool,
    /// Once the scene was posed: what moves, in the top level.
    pub(crate) movers: Option<Movers>,
    pub(crate) config: TracerConfig,
    /// Whether pages come from elsewhere.
    pub(crate) over_pages: bool,
    /// Memory for building what moves.
    pub(crate) scratch: Scratch,
    /// What tracing takes between poses; 0 where nobody said.
    pub(crate) trace_ms: f64,
    level: Level,
    pub(crate) report: BuildReport,
}

impl Tracer {
    /// Builds the structures for `scene` with all threads of the current pool.
    ///
    /// # Errors
    /// [`TraceError::Build`] for an unknown builder, or a mesh that is too large; [`TraceError::Layout`] for a kd-tree in
    /// another layout than its own.
    pub fn new(scene: &Scene, config: &TracerConfig) -> Result<Self, TraceError> {
        if let Some(kind) = KdKind::from_name(&config.accel) {
            if config.layout != Layout::default() {
                return Err(TraceError::Layout { accel: kind.name, layout: config.layout.name() });
            }
            refuse_shutter(scene, "kd-trees")?;
            let tracer = Self::over_kd_trees(scene, kind, config.level.unwrap_or_default())?;
            return Ok(Self { config: config.clone(), ..tracer });
        }
        let start = Instant::now();
        let accel = resolve(&config.accel)?;
        let level = config.level.unwrap_or_default();
        let (split_budget, optimize) = (config.split_budget, config.optimize);
        let measure = config.measure;
        let build = BuildConfig { level, split_budget, optimize, measure, ..BuildConfig::default() };
        let built = build_meshes(scene, accel, &build, config.layout)?;
        Self::over_built(scene, (accel, &build), built, config, start)
    }

    /// A tracer of `scene` whose meshes' trees were built elsewhere, in the order of the scene's.
    ///
    /// # Errors
    /// Those of [`Tracer::new`].
    pub fn over_meshes(
        scene: &Scene,
        meshes: Vec<MeshBvh>,
        config: &TracerConfig,
    ) -> Result<Self, TraceError> {
        let start = Instant::now();
        let accel = resolve(&config.accel)?;
        let build = BuildConfig { level: config.level.unwrap_or_default(), ..BuildConfig::default() };
        let laid_out = |(wide, mesh): (MeshBvh, &Mesh)| {
            let counted = MeshBuild { triangles: mesh.triangles.len(), ..MeshBuild::default() };
            laid_out(wide, counted, config.layout)
        };
        let built = meshes.into_iter().zip(scene.meshes()).map(laid_out).collect::<Result<_, _>>()?;
        Self::over_built(scene, (accel, &build), built, config, start)
    }

    /// Puts meshes with their trees together; the build began at `start`.
    fn over_built(
        scene: &Scene,
        (accel, build): (&'static str, &BuildConfig),
        built: Vec<BuiltMesh>,
        config: &TracerConfig,
        start: Instant,
    ) -> Result<Self, TraceError> {
        let (mut meshes, mut builds) = (Vec::new(), Vec::new());
        let mut packed = Vec::new();
        for (mut mesh, build, pages) in built {
            if let MeshTree::Compact(mesh) = &mut mesh {
                Arc::make_mut(mesh).renumber(packed.len() as u32);
            }
            packed.extend(pages);
            meshes.push(mesh);
            builds.push(build);
        }
        let vertices_move = open_keys(scene, &mut meshes)?;
        let pages = Table::resident(packed.iter().map(|page: &PackedPage| &page.bytes[..]), SLACK);
        drop(packed);
        let meshes_done = Instant::now();

        let costs = |mesh: u32| builds[mesh as usize].quality.cost;
        let mut tracer = Self::place(scene, (accel, config.top), meshes, costs, build)?;
        tracer.bundles &= !config.single_rays;
        let top = &tracer.top;
        tracer.report = BuildReport {
            accel,
            triangles: builds.iter().map(|b| b.triangles as u64).sum(),
            build_ms: milliseconds(start.elapsed()),
            nodes: builds.iter().map(|b| b.quality.nodes).sum::<usize>() as u64 + top.quality.nodes as u64,
            references: builds.iter().map(|b| b.quality.references as u64).sum(),
            bytes: tracer.report.bytes + pages.bytes() as u64,
            number_bytes: tracer.meshes.iter().map(MeshTree::number_bytes).sum::<usize>() as u64,
            cost: top.quality.cost,
            depth: if config.measure { depth(&builds, top) } else { 0 },
            overlap: overlap(&builds),
            stages: sum_stages(&builds, meshes_done.elapsed()),
        };
        tracer.pages = pages;
        (tracer.config, tracer.vertices_move) = (config.clone(), vertices_move);
        Ok(tracer)
    }

    /// A tracer of `scene` whose meshes are given as what is above their pages, in the order of the scene's; those without
    /// pages are built of the scene's. The pages come from elsewhere: see [`crate::paged`].
    ///
    /// # Errors
    /// [`TraceError::Build`] for an unknown builder.
    pub fn over_pages(
        scene: &Scene,
        meshes: Vec<Option<Arc<CompactMesh>>>,
        config: &TracerConfig,
    ) -> Result<Self, TraceError> {
        let start = Instant::now();
        let accel = resolve(&config.accel)?;
        let build = BuildConfig { level: config.level.unwrap_or_default(), ..BuildConfig::default() };
        refuse_shutter(scene, "stores")?;
        let mut scratch = Scratch::default();
        let used = used_meshes(scene).into_iter().zip(meshes);
        let tree = |(mesh, above): (Option<&Mesh>, Option<Arc<CompactMesh>>)| match above {
            Some(above) => Ok(MeshTree::Compact(above)),
            None => Ok(MeshTree::Wide(MeshBvh::build(accel, &view(mesh), &build, &mut scratch)?.0)),
        };
        let meshes = used.map(tree).collect::<Result<_, BuildError>>()?;
        let mut tracer = Self::place(scene, (accel, config.top), meshes, |_| 1.0, &build)?;
        tracer.bundles &= !config.single_rays;
        (tracer.config, tracer.over_pages) = (config.clone(), true);
        tracer.report.build_ms = milliseconds(start.elapsed());
        Ok(tracer)
    }

    /// Builds what is above the meshes; `costs` says what rays through a mesh cost.
    pub(crate) fn place(
        scene: &Scene,
        (accel, level): (&'static str, TopLevel),
        meshes: Vec<MeshTree>,
        costs: impl Fn(u32) -> f64 + Sync,
        build: &BuildConfig,
    ) -> Result<Self, TraceError> {
        let places = Places::new(scene, meshes.iter().map(MeshTree::space).collect());
        let costs = |i: u32| costs(places.mesh(i as usize));
        let (grid, top) = match level {
            TopLevel::Tree => {
                (None, InstanceBvh::build(accel, places.len(), |i| places.bounds(i), costs, build)?)
            }
            TopLevel::Grid(per_axis) => {
                let grid = GridTop::build(accel, (&places, &meshes), per_axis, build)?;
                let (grid, trees) = grid.ok_or(TraceError::Grid)?;
                (Some(grid), trees)
            }
        };
        let bytes = meshes.iter().map(MeshTree::bytes).sum::<usize>()
            + top.bytes()
            + grid.as_ref().map_or(0, GridTop::bytes)
            + places.bytes();
        let report = BuildReport { accel, bytes: bytes as u64, ..BuildReport::default() };
        let stack_entries =
            stack_entries(top.levels + meshes.iter().map(MeshTree::levels).max().unwrap_or(0));
        Ok(Self {
            meshes,
            pages: Table::default(),
            bundles: grid.is_none(),
            places,
            top,
            grid,
            kd: None,
            implicits: Implicits::new(scene),
            stack_entries,
            vertices_move: false,
            movers: None,
            config: TracerConfig::default(),
            over_pages: false,
            scratch: Scratch::default(),
            trace_ms: 0.0,
            level: build.level,
            report,
        })
    }

    /// Builds kd-trees instead.
    fn over_kd_trees(scene: &Scene, kind: KdKind, level: Level) -> Result<Self, TraceError> {
        let start = Instant::now();
        let used = used_meshes(scene);
        let triangles = used.iter().map(|mesh| mesh.map_or(0, |m| m.triangles.len() as u64)).sum();
        let meshes = KdScene::meshes(&used, &kind)?;
        let meshes_done = Instant::now();
        let space = |m: &KdMesh| MeshSpace { bounds: m.bounds, extent: m.extent, scale: m.scale };
        let places = Places::new(scene, meshes.iter().map(space).collect());
        let kd = KdScene::new(meshes, &places, &kind)?;
        let stages = vec![
            ("meshes", milliseconds(meshes_done - start)),
            ("instances", milliseconds(meshes_done.elapsed())),
        ];
        let report = BuildReport {
            accel: kind.name,
            triangles,
            build_ms: milliseconds(start.elapsed()),
            nodes: kd.nodes(),
            references: kd.references(),
            bytes: (kd.bytes() + places.bytes()) as u64,
            number_bytes: 0,
            cost: kd.cost(),
            depth: 0,
            overlap: 0.0,
            stages,
        };
        Ok(Self {
            meshes: Vec::new(),
            pages: Table::default(),
            places,
            top: InstanceBvh::default(),
            grid: None,
            kd: Some(kd),
            implicits: Implicits::new(scene),
            stack_entries: 0,
            bundles: false,
            vertices_move: false,
            movers: None,
            config: TracerConfig::default(),
            over_pages: false,
            scratch: Scratch::default(),
            trace_ms: 0.0,
            level,
            report,
        })
    }

    /// The closest hit of each ray that `filter` accepts, on the calling thread; the filter is told the ray's index in `rays`.
    ///
    /// Only `t >= 0` counts, whatever a ray's `t_min`. A ray that is not finite or has no direction hits nothing. Rays
    /// without a place in `hits` are not traced.
    pub fn closest(&self, rays: &[Ray], filter: &dyn HitFilter, hits: &mut [Hit]) {
        let rays = &rays[..rays.len().min(hits.len())];
        self.trace::<_, false>(rays, filter, &mut *hits);
        if let Some(implicits) = &self.implicits {
            implicits.closest(rays, filter, hits);
        }
    }

    /// Whether each ray has a hit that `filter` accepts; otherwise as [`Tracer::closest`].
    pub fn occluded(&self, rays: &[Ray], filter: &dyn HitFilter, occluded: &mut [bool]) {
        let rays = &rays[..rays.len().min(occluded.len())];
        self.trace::<_, true>(rays, filter, &mut *occluded);
        if let Some(implicits) = &self.implicits {
            implicits.occluded(rays, filter, occluded);
        }
    }

    fn trace<A: Answers, const ANY: bool>(&self, rays: &[Ray], filter: &dyn HitFilter, answers: A) {
        let (tracer, pages, filtered) = (self, &self.pages, Filtered(filter));
        match &self.kd {
            Some(kd) => {
                self.level.dispatch(KdBatch::<_, ANY> { tracer, kd, rays, filter: filtered, answers });
            }
            None if filter.accepts_all() => {
                self.level.dispatch(Batch::<_, _, ANY> { tracer, pages, rays, filter: &AcceptAll, answers });
            }
            None => {
                self.level.dispatch(Batch::<_, _, ANY> { tracer, pages, rays, filter: &filtered, answers });
            }
        }
    }

    /// [`Tracer::closest`] without filter, with all threads of the current pool.
    pub fn closest_parallel(&self, rays: &[Ray], hits: &mut [Hit]) {
        in_parallel(rays, hits, |rays, hits| self.closest(rays, &AcceptAll, hits));
    }

    /// [`Tracer::occluded`] without filter, with all threads of the current pool.
    pub fn occluded_parallel(&self, rays: &[Ray], occluded: &mut [bool]) {
        in_parallel(rays, occluded, |rays, occluded| self.occluded(rays, &AcceptAll, occluded));
    }

    /// The place of a hit with its corners as they are in the mesh.
    pub(crate) fn unscaled(&self, hit: &Hit, found: Found) -> Found {
        if !hit.is_hit() {
            return found;
        }
        let mesh = self.places.mesh(hit.instance as usize);
        let scale = 1.0 / self.meshes[mesh as usize].space().scale;
        Found { corners: found.corners.map(|corner| corner * scale), ..found }
    }

    /// What the leaves of the top level are rows of: where the table begins, and the bytes of a row.
    #[inline(always)]
    pub(crate) fn leaf_table(&self) -> (*const u8, usize) {
        match &self.grid {
            None => self.places.table(),
            Some(grid) => (grid.entries.as_ptr().cast(), size_of::<[u32; 2]>()),
        }
    }

    /// Around all that rays can hit.
    #[must_use]
    pub fn world(&self) -> Aabb {
        let implicits = self.implicits.as_ref().map_or(Aabb::EMPTY, |implicits| implicits.world);
        self.places.world.union(implicits)
    }

    /// Whether rays go through kd-trees, not through pages or blocks below a BVH.
    #[must_use]
    pub fn has_kd_trees(&self) -> bool {
        self.kd.is_some()
    }

    /// What building took and gave.
    #[must_use]
    pub fn report(&self) -> &BuildReport {
        &self.report
    }

    /// Whether the scene has surfaces without triangles.
    #[must_use]
    pub fn has_implicit_surfaces(&self) -> bool {
        self.implicits.is_some()
    }

    /// An error for a scene with surfaces that words cannot tell.
    pub(crate) fn refuse_implicit_surfaces(&self) -> Result<(), TraceError> {
        if self.has_implicit_surfaces() {
            return Err(TraceError::Words("implicit surfaces are met by the CPU alone"));
        }
        Ok(())
    }

    /// The instructions in use.
    #[must_use]
    pub fn level(&self) -> Level {
        self.level
    }
}

/// Rays that one thread takes at a time, where they stand in no rows.
const PARALLEL_CHUNK: usize = 4096;
/// Most rays of rows that one thread takes at a time: no more are looked at to find rows.
pub const LARGEST_CHUNK: usize = 1 << 16;

/// Answers rays with all threads of the current pool.
pub(crate) fn in_parallel<A: Send>(rays: &[Ray], answers: &mut [A], trace: impl Fn(&[Ray], &mut [A]) + Sync) {
    let chunk = parallel_chunk(rays);
    let chunks = rays.par_chunks(chunk).zip(answers.par_chunks_mut(chunk));
    chunks.for_each(|(rays, answers)| trace(rays, answers));
}

/// How many rays of an array one thread should take at a time: whole patches of rows, where there are rows. The first
/// [`LARGEST_CHUNK`] tell.
#[must_use]
pub fn parallel_chunk(rays: &[Ray]) -> usize {
    match rows(&rays[..rays.len().min(LARGEST_CHUNK)]) {
        Some((0, length)) if length * ROWS <= LARGEST_CHUNK => length * ROWS,
        _ => PARALLEL_CHUNK,
    }
}

/// A mesh, how it was built, and its pages.
type BuiltMesh = (MeshTree, MeshBuild, Vec<PackedPage>);

/// The structures of all meshes; those that no instance uses stay empty.
fn build_meshes(
    scene: &Scene,
    accel: &str,
    config: &BuildConfig,
    layout: Layout,
) -> Result<Vec<BuiltMesh>, TraceError> {
    let build = |scratch: &mut Scratch, mesh: &Option<&Mesh>| {
        let (wide, build) = MeshBvh::build(accel, &view(*mesh), config, scratch)?;
        laid_out(wide, build, layout)
    };
    used_meshes(scene).par_iter().map_init(Scratch::default, build).collect()
}

fn laid_out(wide: MeshBvh, mut build: MeshBuild, layout: Layout) -> Result<BuiltMesh, TraceError> {
    if layout == Layout::Wide {
        return Ok((MeshTree::Wide(wide), build, Vec::new()));
    }
    let start = Instant::now();
    let (compact, pages) = CompactMesh::pack(&wide, CompactMesh::SLOT)?;
    build.stages.push(("pack", start.elapsed()));
    Ok((MeshTree::Compact(Arc::new(compact)), build, pages))
}

/// Refuses structures that know but one moment where a shutter is open and something moves.
fn refuse_shutter(scene: &Scene, structures: &'static str) -> Result<(), TraceError> {
    match scene.shutter() {
        Some(shutter) if !shutter.is_still() => Err(TraceError::Shutter(structures)),
        _ => Ok(()),
    }
}

/// Lets rays of an open shutter see meshes whose vertices move; says whether there are any.
pub(crate) fn open_keys(scene: &Scene, meshes: &mut [MeshTree]) -> Result<bool, TraceError> {
    let Some(shutter) = scene.shutter() else { return Ok(false) };
    if meshes.iter().any(|mesh| matches!(mesh, MeshTree::Compact(_))) {
        refuse_shutter(scene, "compact meshes")?;
    }
    let used = shutter.meshes().filter(|(number, _)| !scene.instances().of_mesh(*number).is_empty());
    let mut moves = false;
    for (number, keys) in used {
        let triangles = &scene.meshes()[number as usize].triangles;
        let views: Vec<MeshView<'_>> =
            keys.iter().map(|key| MeshView { positions: &key.positions, triangles }).collect();
        meshes[number as usize].open(&views);
        moves = true;
    }
    Ok(moves)
}

/// The meshes of a scene, none in the place of those that no instance uses.
fn used_meshes(scene: &Scene) -> Vec<Option<&Mesh>> {
    let has_instances = |number: u32| !scene.instances().of_mesh(number).is_empty();
    (0..).zip(scene.meshes()).map(|(number, mesh)| has_instances(number).then_some(mesh)).collect()
}

/// What a builder sees of a mesh.
pub(crate) fn view(mesh: Option<&Mesh>) -> MeshView<'_> {
    mesh.map_or(MeshView { positions: &[], triangles: &[] }, |m| MeshView {
        positions: &m.positions,
        triangles: &m.triangles,
    })
}

/// Nodes on the longest way down, through both levels.
fn depth(builds: &[MeshBuild], top: &InstanceBvh) -> u64 {
    let deepest = builds.iter().map(|b| b.quality.depth).max().unwrap_or(0);
    (top.quality.depth + deepest) as u64
}

/// The overlap of siblings over all meshes.
fn overlap(builds: &[MeshBuild]) -> f64 {
    let nodes: usize = builds.iter().map(|b| b.quality.nodes).sum();
    let sum: f64 = builds.iter().map(|b| b.quality.overlap * b.quality.nodes as f64).sum();
    sum / nodes.max(1) as f64
}

fn sum_stages(builds: &[MeshBuild], top: Duration) -> Vec<(&'static str, f64)> {
    let mut sums: Vec<(&'static str, f64)> = Vec::new();
    for &(name, time) in builds.iter().flat_map(|b| &b.stages) {
        match sums.iter_mut().find(|s| s.0 == name) {
            Some(sum) => sum.1 += milliseconds(time),
            None => sums.push((name, milliseconds(time))),
        }
    }
    sums.push(("instances", milliseconds(top)));
    sums
}

pub(crate) fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
