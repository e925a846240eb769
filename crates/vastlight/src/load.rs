//! From a file name or `demo:NAME` to a scene.

use crate::open::is_store;
use crate::overrides::Overrides;
use crate::{Error, environment};
use std::path::{Path, PathBuf};
use vastlight_import::LoadOptions as ImportOptions;
use vastlight_scene::generate::{self, GenerateOptions};
use vastlight_scene::{Scene, SceneDesc, SceneStream};

/// How a scene is opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Bounds on files, and which of a file's scenes to take.
    pub import: ImportOptions,
    /// Size and chance of a demo scene.
    pub generate: GenerateOptions,
    /// A latitude-longitude map (.exr, .hdr) that replaces the environment.
    pub environment: Option<PathBuf>,
    /// Azimuth from north (-z) towards east (+x) and elevation of the sun, degrees; replaces the environment by a sky.
    pub sun: Option<[f32; 2]>,
    /// Read a store past the kernel's page cache, where the system can.
    pub bypass_kernel_cache: bool,
    /// Changes to materials, lights and environment, applied last.
    pub overrides: Option<Overrides>,
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
    Ok(Scene::new(desc)?)
}

/// A scene mesh by mesh: a file, or `demo:NAME`.
///
/// # Errors
/// Those of [`load`] that do not concern a mesh.
pub fn stream(source: &str, options: &LoadOptions) -> Result<SceneStream, Error> {
    let mut stream = match source.strip_prefix("demo:") {
        Some(name) => generate::stream(name, &options.generate)?,
        None => describe(source, options)?.into(),
    };
    adapt(&mut stream.desc, options)?;
    Ok(stream)
}

/// Changes a description as the options say.
pub(crate) fn adapt(desc: &mut SceneDesc, options: &LoadOptions) -> Result<(), Error> {
    if let Some(path) = &options.environment {
        environment::use_map(desc, path, &options.import.limits)?;
    }
    if let Some(sun) = options.sun {
        environment::use_sun(desc, sun);
    }
    if let Some(overrides) = &options.overrides {
        overrides.apply(desc, &options.import.limits)?;
    }
    Ok(())
}

/// The description of a scene as its file or generator gives it, unchecked and unchanged.
///
/// # Errors
/// If the file cannot be read or is wrong, or the demo is unknown.
pub fn describe(source: &str, options: &LoadOptions) -> Result<SceneDesc, Error> {
    match source.strip_prefix("demo:") {
        Some(name) => Ok(generate::by_name(name, &options.generate)?),
        None => Ok(vastlight_import::load(Path::new(source), &options.import)?),
    }
}
