//! KHR_lights_punctual. Intensities are taken as radiant ones: candela as W/sr, lux as W/m^2 (no factor 683).

use super::camera::without_scale;
use super::json::Json;
use super::node::to_f32;
use vastlight_math::Vec3;
use vastlight_math::glam::DAffine3;
use vastlight_scene::{Light, LightKind};

/// The extension's name.
pub(super) const EXTENSION: &str = "KHR_lights_punctual";

/// A light at a node.
pub(super) fn read(json: &Json<'_>, name: String, world_from_node: &DAffine3) -> Option<Light> {
    let kind = match json.at("type").text()? {
        "point" => LightKind::Point,
        "directional" => LightKind::Directional,
        "spot" => {
            let spot = json.at("spot");
            LightKind::Spot {
                inner: spot.float("innerConeAngle", 0.0),
                outer: spot.float("outerConeAngle", std::f32::consts::FRAC_PI_4),
            }
        }
        _ => return None,
    };
    let color = json.floats("color").map_or(Vec3::ONE, Vec3::from_array);
    Some(Light {
        name,
        kind,
        world_from_light: to_f32(&without_scale(world_from_node)),
        intensity: color * json.float("intensity", 1.0),
        range: json.float("range", f32::INFINITY),
        profile: None,
    })
}
