//! From a file name or `demo:NAME` to a scene.

use crate::overrides::Overrides;
use crate::{Error, environment};
use std::path::{Path, PathBuf};
use vastlight_import::LoadOptions as ImportOptions;
use vastlight_scene::generate::{self, GenerateOptions};
use vastlight_scene::{Scene, SceneDesc};

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
    /// Changes to materials, lights and environment, applied last.
    pub overrides: Option<Overrides>,
}

/// Opens a scene: a file, or `demo:NAME`.
///
/// # Errors
/// If the file cannot be read or is wrong, the demo is unknown, or an override names what is not there.
pub fn load(source: &str, options: &LoadOptions) -> Result<Scene, Error> {
    let mut desc = describe(source, options)?;
    if let Some(path) = &options.environment {
        environment::use_map(&mut desc, path, &options.import.limits)?;
    }
    if let Some(sun) = options.sun {
        environment::use_sun(&mut desc, sun);
    }
    if let Some(overrides) = &options.overrides {
        overrides.apply(&mut desc, &options.import.limits)?;
    }
    Ok(Scene::new(desc)?)
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
