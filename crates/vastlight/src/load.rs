//! From a file name or `demo:NAME` to a scene.

use crate::budget::{check_import, held_bytes};
use crate::manifest::{self, is_manifest};
use crate::memory::default_budget_bytes;
use crate::merge::Merged;
use crate::open::is_store;
use crate::overrides::{Files, Overrides};
use crate::{Error, PackInput, environment};
use std::path::{Path, PathBuf};
use vastlight_import::{FileSize, LoadOptions as ImportOptions, Streamed};
use vastlight_math::Affine3;
use vastlight_paging::{is_address, shown};
use vastlight_scene::generate::{self, DemoSize, GenerateOptions};
use vastlight_scene::{Scene, SceneDesc, SceneStream};
use vastlight_store::SourceFile;

/// How a scene is opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Bounds on files, and which of a file's scenes to take.
    pub import: ImportOptions,
    /// Size and chance of a demo scene; its moment is that of [`time`](Self::time).
    pub generate: GenerateOptions,
    /// The moment in seconds of a scene that moves; none for a file's scene at rest, and for 0 of a demo.
    pub time: Option<f32>,
    /// A latitude-longitude map (.exr, .hdr) that replaces the environment.
    pub environment: Option<PathBuf>,
    /// Azimuth from north (-z) towards east (+x) and elevation of the sun, degrees; replaces the environment by a sky.
    pub sun: Option<[f32; 2]>,
    /// Read a store past the kernel's page cache, where the system can.
    pub bypass_kernel_cache: bool,
    /// Changes to materials, lights and environment, applied last, one after the other.
    pub overrides: Vec<Overrides>,
}

impl LoadOptions {
    /// For scenes whose images fit into so many bytes, or none for the machine's.
    #[must_use]
    pub fn within(memory: Option<u64>) -> Self {
        let mut options = Self::default();
        let images = &mut options.import.limits.all_images_bytes;
        let machine = default_budget_bytes().unwrap_or(u64::MAX);
        *images = memory.unwrap_or_else(|| machine.min(*images));
        options
    }

    /// How a demo scene is made.
    fn demo(&self) -> GenerateOptions {
        GenerateOptions { time: self.time.unwrap_or(0.0), ..self.generate }
    }
}

/// Opens a scene in memory: a file, or `demo:NAME`.
///
/// # Errors
/// If the file cannot be read or is wrong, the demo is unknown, or an override names what is not there.
pub fn load(source: &str, options: &LoadOptions) -> Result<Scene, Error> {
    if is_store(source) {
        let hint = "`render` takes stores; this takes files and demo:NAME";
        return Err(Error::usage("this needs the scene in memory", source, hint));
    }
    let mut desc = describe(source, options)?;
    adapt(&mut desc, options)?;
    posed(desc, source, options)
}

/// The scene of a description at the moment of the options. What a scene gets of its own, such as a camera, it gets at rest.
pub(crate) fn posed(desc: SceneDesc, source: &str, options: &LoadOptions) -> Result<Scene, Error> {
    let mut scene = Scene::new(desc)?;
    bring_to(&mut scene, options.time.filter(|_| !is_made_for_its_moment(source)), source)?;
    Ok(scene)
}

/// Brings a scene at rest to a moment, if there is one.
pub(crate) fn bring_to(scene: &mut Scene, time: Option<f32>, source: &str) -> Result<(), Error> {
    let Some(time) = time else { return Ok(()) };
    let motion = scene.motion().cloned().ok_or_else(|| nothing_moves(source))?;
    scene.pose(motion.pose(time)?)?;
    Ok(())
}

/// A scene mesh by mesh: a file, or `demo:NAME`.
///
/// # Errors
/// Those of [`load`] that do not concern a mesh.
pub fn stream(source: &str, options: &LoadOptions) -> Result<SceneStream, Error> {
    let mut stream = match source.strip_prefix("demo:") {
        Some(name) => generate::stream(name, &options.demo())?,
        None => {
            let desc = describe(source, options)?;
            match options.time.filter(|_| !is_made_for_its_moment(source)) {
                Some(time) => desc.at(time)?.into(),
                None => desc.into(),
            }
        }
    };
    adapt(&mut stream.desc, options)?;
    Ok(stream)
}

/// Bytes that a demo scene holds on its way: pieces that are made ahead.
const DEMO_BYTES: u64 = 64 << 20;

/// A file of a scene, and where it stands.
struct Placed {
    source: String,
    transforms: Vec<Affine3>,
}

/// Scenes for [`pack_within`](crate::pack_within): files, manifests or `demo:NAME`, all in one store. What of them must
/// be read as a whole is compared with `memory` (none for the default budget) before.
///
/// # Errors
/// If a file cannot be read or is wrong, does not fit, the demo is unknown, or an override names what is not there.
pub fn pack_input(
    sources: &[String],
    options: &LoadOptions,
    memory: Option<u64>,
) -> Result<PackInput, Error> {
    let placed = placed(sources)?;
    let size = size_of(&placed, options)?;
    let held_bytes = held_bytes(&size);
    check_import(memory, held_bytes.saturating_add(size.image_working_bytes))?;
    let streamed = streamed(&placed, options)?;
    let mut input = PackInput {
        large: streamed.large,
        sources: [given_files(sources, &placed, options)?, existing(&streamed.files)].concat(),
        settings: settings(options),
        held_bytes,
        ..streamed.stream.into()
    };
    adapt(&mut input.stream.desc, options)?;
    Ok(input)
}

/// What is known of a scene's size before it is read.
pub(crate) fn file_size(source: &str, options: &LoadOptions) -> Result<FileSize, Error> {
    size_of(&placed(&[source.to_owned()])?, options)
}

fn size_of(placed: &[Placed], options: &LoadOptions) -> Result<FileSize, Error> {
    let mut sum = FileSize::default();
    for Placed { source, transforms } in placed {
        let size = match source.strip_prefix("demo:") {
            Some(name) => demo_size(name, &options.demo())?,
            None => vastlight_import::file_size(Path::new(source), &options.import)?,
        };
        let instances = size.instances.saturating_mul(transforms.len() as u64);
        sum.streaming_bytes = sum.streaming_bytes.saturating_add(size.streaming_bytes);
        // Files are opened one after the other.
        sum.image_working_bytes = sum.image_working_bytes.max(size.image_working_bytes);
        sum.triangles = sum.triangles.saturating_add(size.triangles);
        sum.instances = sum.instances.saturating_add(instances);
        sum.image_bytes = sum.image_bytes.saturating_add(size.image_bytes);
    }
    Ok(sum)
}

fn demo_size(name: &str, options: &GenerateOptions) -> Result<FileSize, Error> {
    let DemoSize { triangles, instances } = generate::size(name, options)?;
    let image_bytes = options.texture_bytes.unwrap_or(0);
    Ok(FileSize { streaming_bytes: DEMO_BYTES, triangles, instances, image_bytes, ..FileSize::default() })
}

/// Refuses what only a store may be.
fn refuse_remote(source: &str) -> Result<(), Error> {
    if is_address(source) {
        let hint = "download the file, or pack it (`vastlight pack`) and put the store (.vls) on the server";
        return Err(Error::usage("of a server's files only stores are read", shown(source), hint));
    }
    Ok(())
}

/// The files behind sources, with the places of those in manifests.
fn placed(sources: &[String]) -> Result<Vec<Placed>, Error> {
    let mut files = Vec::new();
    for source in sources {
        if is_store(source) {
            return Err(Error::usage(
                "this is a store already",
                source,
                "name the files that it was packed from",
            ));
        }
        refuse_remote(source)?;
        if is_manifest(source) {
            let listed = manifest::read(Path::new(source))?.into_iter();
            let file =
                |(path, transforms): (PathBuf, _)| Placed { source: path.display().to_string(), transforms };
            files.extend(listed.map(file));
        } else {
            files.push(Placed { source: source.clone(), transforms: vec![Affine3::IDENTITY] });
        }
    }
    Ok(files)
}

/// All files together, at the moment of the options, which one of them must have. Without one, a single file keeps what moves it.
fn streamed(placed: &[Placed], options: &LoadOptions) -> Result<Streamed, Error> {
    let mut merged = Merged::default();
    let (mut moves, mut still, mut motion) = (false, Vec::new(), None);
    for Placed { source, transforms } in placed {
        let path = Path::new(source);
        let mut scene: Streamed = match (source.strip_prefix("demo:"), options.time) {
            (Some(name), _) => {
                moves |= generate::moves(name);
                generate::stream(name, &options.demo())?.into()
            }
            (None, Some(time)) => {
                let (desc, files) = vastlight_import::load_with_files(path, &options.import)?;
                moves |= desc.motion.is_some();
                let desc = if desc.motion.is_some() { desc.at(time)? } else { desc };
                Streamed { files, ..SceneStream::from(desc).into() }
            }
            (None, None) => vastlight_import::stream(path, &options.import)?,
        };
        let own = scene.stream.desc.motion.take();
        let is_alone = placed.len() == 1 && transforms[..] == [Affine3::IDENTITY];
        if options.time.is_none() && stands_still(source, options, own.is_some(), is_alone)? {
            still.push(source);
        }
        motion = own.filter(|_| is_alone && options.time.is_none());
        merged.add(scene, transforms.clone());
    }
    let mut all = match placed {
        [first, ..] if options.time.is_some() && !moves => return Err(nothing_moves(&first.source)),
        _ => merged.finish(),
    };
    all.stream.desc.motion = motion;
    for source in still {
        let what = "what moves here stands still: a store, a manifest and several scenes together keep the movement of a single \
                    glTF file or demo alone";
        all.stream.desc.diagnostics.warn(what, source, "--time S takes another moment than the first");
    }
    Ok(all)
}

/// Whether a source moves, and that is not kept.
fn stands_still(source: &str, options: &LoadOptions, moves: bool, is_alone: bool) -> Result<bool, Error> {
    if moves {
        return Ok(!is_alone);
    }
    match source.strip_prefix("demo:") {
        Some(name) => Ok(generate::moves(name)),
        None => is_sequence(source, options),
    }
}

/// Whether a source is a sequence of files.
fn is_sequence(source: &str, options: &LoadOptions) -> Result<bool, Error> {
    Ok(vastlight_import::files_of(Path::new(source), &options.import.limits)?.len() > 1)
}

/// Whether a store of a source at rest has all moments, as far as its name says.
pub(crate) fn keeps_motion(source: &str, options: &LoadOptions) -> Result<bool, Error> {
    match source.strip_prefix("demo:") {
        Some(name) => Ok(generate::has_motion(name)),
        None => Ok(!is_manifest(source) && !is_sequence(source, options)?),
    }
}

/// Whether [`describe`] gives the moment of the options, not the scene at rest.
fn is_made_for_its_moment(source: &str) -> bool {
    source.starts_with("demo:") || is_manifest(source)
}

fn nothing_moves(source: &str) -> Error {
    Error::scene("nothing moves in this scene", source, "leave the time out")
}

/// What says which scene the options make of a source, known without reading it: version, files as they are, settings.
pub(crate) fn request_of(source: &str, options: &LoadOptions) -> Result<(Vec<SourceFile>, String), Error> {
    let given = [source.to_owned()];
    Ok((given_files(&given, &placed(&given)?, options)?, settings(options)))
}

/// The files that the user names, as they are now: of a sequence all, since a change of any makes another scene.
fn given_files(given: &[String], placed: &[Placed], options: &LoadOptions) -> Result<Vec<SourceFile>, Error> {
    let manifests = given.iter().filter(|source| is_manifest(source));
    let names = manifests.chain(placed.iter().map(|file| &file.source));
    let GenerateOptions { triangles, seed, time, .. } = options.demo();
    let file = |name: &String| {
        if name.starts_with("demo:") {
            let size = triangles.map_or(String::new(), |n| format!(", {n} triangles"));
            let moment = if time == 0.0 { String::new() } else { format!(", at {time} s") };
            let name = format!("{name} (seed {seed}{size}{moment})");
            return Ok(vec![SourceFile { name, ..SourceFile::default() }]);
        }
        let there = |path: PathBuf| {
            let file = SourceFile::of_path(&path);
            file.map_err(|e| Error::scene(e.to_string(), path.display().to_string(), ""))
        };
        let files = vastlight_import::files_of(Path::new(name), &options.import.limits)?;
        files.into_iter().map(there).collect::<Result<Vec<_>, Error>>()
    };
    let files = names.map(file).collect::<Result<Vec<_>, Error>>()?.concat();
    let changes = options.overrides.iter().flat_map(Overrides::files);
    let others: Vec<PathBuf> = options.environment.iter().cloned().chain(changes).collect();
    Ok([files, existing(&others)].concat())
}

/// Files as they are now, but for those that are not there, which was a warning or will be an error.
fn existing(paths: &[PathBuf]) -> Vec<SourceFile> {
    paths.iter().filter_map(|path| SourceFile::of_path(path).ok()).collect()
}

/// What of the options changes a store; files among them are sources.
fn settings(options: &LoadOptions) -> String {
    let LoadOptions { import, time, generate, sun, overrides, .. } = options;
    format!(
        "{:?} {:?} {} {time:?} {sun:?} {generate:?} {overrides:?}",
        import.scene, import.animation, import.sequence_fps
    )
}

/// Changes a description as the options say.
pub(crate) fn adapt(desc: &mut SceneDesc, options: &LoadOptions) -> Result<(), Error> {
    let mut files = Files::new(options.import.limits);
    if let Some(path) = &options.environment {
        files.use_map(desc, path)?;
    }
    if let Some(sun) = options.sun {
        environment::use_sun(desc, sun);
    }
    options.overrides.iter().try_for_each(|overrides| overrides.apply(desc, &mut files))
}

/// The description of a scene as its file or generator gives it, unchecked and unchanged: of a file at rest, of a demo or a
/// manifest at the moment of the options.
///
/// # Errors
/// If the file cannot be read or is wrong, or the demo is unknown.
pub fn describe(source: &str, options: &LoadOptions) -> Result<SceneDesc, Error> {
    if let Some(name) = source.strip_prefix("demo:") {
        return Ok(generate::by_name(name, &options.demo())?);
    }
    refuse_remote(source)?;
    if !is_manifest(source) {
        return Ok(vastlight_import::load(Path::new(source), &options.import)?);
    }
    Ok(streamed(&placed(&[source.to_owned()])?, options)?.collect()?)
}
