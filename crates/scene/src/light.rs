//! Lights without surface: point, spot, directional; with measured distributions.

use serde::{Deserialize, Serialize};
use std::sync::Arc;
use vastlight_math::{Affine3, Vec3};

/// What a light is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// Equal radiant intensity in all directions, or an IES profile.
    Point,
    /// Intensity within a cone around -z, falling to zero between the two half angles (radians).
    Spot {
        /// Half angle of full intensity.
        inner: f32,
        /// Half angle of zero intensity.
        outer: f32,
    },
    /// Parallel light along -z from infinity.
    Directional,
}

/// A light without surface. It shines along its own -z axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name, for messages and overrides.
    pub name: String,
    /// What it is.
    pub kind: LightKind,
    /// Place and direction; scale is ignored.
    pub world_from_light: Affine3,
    /// Radiant intensity (point, spot: W/sr) or irradiance on a facing plane (directional: W/m^2), per RGB channel.
    pub intensity: Vec3,
    /// Distance at which the light ends (KHR_lights_punctual); infinity for none.
    pub range: f32,
    /// Measured distribution of a point or spot light; multiplies `intensity`.
    pub profile: Option<Arc<IesProfile>>,
}

/// A luminaire's measured far-field distribution (IES LM-63), normalised so that the largest value is 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IesProfile {
    /// Vertical angles in degrees, ascending, 0 is straight along the light's -z.
    pub vertical: Vec<f32>,
    /// Horizontal angles in degrees, ascending, 0..360 after unfolding symmetries, or a single 0.
    pub horizontal: Vec<f32>,
    /// `horizontal.len() * vertical.len()` values, the vertical angle fastest.
    pub candela: Vec<f32>,
    /// Largest candela value of the file.
    pub peak_candela: f32,
}
