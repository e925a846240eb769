//! Light from infinity.

use serde::{Deserialize, Serialize};
use vastlight_math::Vec3;

/// A clear sky with a sun.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sky {
    /// Sun's azimuth, radians, from -z (north) towards +x (east).
    pub sun_azimuth: f32,
    /// Sun's elevation above the horizon, radians.
    pub sun_elevation: f32,
    /// Haze, 1 (none) to 10.
    pub turbidity: f32,
    /// Albedo of the ground, which fills the lower half.
    pub ground_albedo: Vec3,
    /// Scale of the whole sky's radiance.
    pub strength: f32,
    /// Whether the sun's disc shines; without it only the sky does.
    pub sun_disc: bool,
}

impl Default for Sky {
    /// A late morning over dark ground, with the sun to the left of the default camera.
    fn default() -> Self {
        Self {
            sun_azimuth: -2.5,
            sun_elevation: 0.8,
            turbidity: 3.0,
            ground_albedo: Vec3::splat(0.12),
            strength: 1.0,
            sun_disc: true,
        }
    }
}

/// Light from infinity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Environment {
    /// The same radiance from everywhere.
    Constant(Vec3),
    /// A latitude-longitude map. The image's centre is seen along -z at rotation 0, its top row is +y, and u grows
    /// to the right as seen from inside.
    Map {
        /// Index into [`crate::SceneDesc::images`]; must hold floats with at least 3 channels.
        image: u32,
        /// Rotation about +y, radians.
        rotation: f32,
        /// Scale of the radiance.
        strength: f32,
    },
    /// A procedural sky.
    Sky(Sky),
}
