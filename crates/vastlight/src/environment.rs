//! Replacing a scene's light from infinity.

use crate::Error;
use std::path::Path;
use vastlight_import::{Limits, load_environment};
use vastlight_scene::{Environment, SceneDesc, Sky};

/// Light from a latitude-longitude map.
///
/// # Errors
/// If the map cannot be read.
pub(crate) fn use_map(desc: &mut SceneDesc, path: &Path, limits: &Limits) -> Result<(), Error> {
    let image = load_environment(path, limits, &mut desc.diagnostics)?;
    desc.images.push(image);
    let image = (desc.images.len() - 1) as u32;
    desc.environment = Some(Environment::Map { image, rotation: 0.0, strength: 1.0 });
    Ok(())
}

/// The scene's sky, or a new one, with the sun at `[azimuth, elevation]` in degrees.
pub(crate) fn use_sun(desc: &mut SceneDesc, sun: [f32; 2]) {
    let [sun_azimuth, sun_elevation] = sun.map(f32::to_radians);
    desc.environment = Some(Environment::Sky(Sky { sun_azimuth, sun_elevation, ..sky_of(desc) }));
}

/// The scene's own sky, or the default one.
pub(crate) fn sky_of(desc: &SceneDesc) -> Sky {
    match desc.environment {
        Some(Environment::Sky(sky)) => sky,
        _ => Sky::default(),
    }
}
