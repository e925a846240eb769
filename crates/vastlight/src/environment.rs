//! Replacing a scene's light from infinity.

use vastlight_scene::{Environment, SceneDesc, Sky};

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
