//! The camera as words.

use super::Words;
use crate::camera::CameraRays;
use vastlight_scene::Projection;

/// Columns of the map from the camera to the world.
pub const MAP: usize = 0;
/// Steps of a pixel on the camera's plane, and where its corner lies: two numbers each.
pub const SCALE: usize = 12;
/// The viewing axis.
pub const AXIS: usize = 16;
/// Radius of the lens and distance at which it is sharp.
pub const LENS: usize = 19;
/// 1 where rays are parallel.
pub const ORTHOGRAPHIC: usize = 21;
/// Width and spread of the cones around rays.
pub const CONE: usize = 22;
/// Offsets in pixels at equal steps of the filter's probability, and how many steps there are before them.
pub const FILTER: usize = 24;

/// Appends a camera.
pub(crate) fn put(words: &mut Words, camera: &CameraRays) {
    let map = camera.world_from_camera;
    for column in [map.x_axis, map.y_axis, map.z_axis, map.translation] {
        words.vec3(column);
    }
    words.vec2(camera.scale);
    words.vec2(camera.offset);
    words.vec3(camera.axis);
    let (lens, orthographic) = match camera.projection {
        Projection::Perspective { lens_radius, focus_distance, .. } => ([lens_radius, focus_distance], 0),
        Projection::Orthographic { .. } => ([0.0; 2], 1),
    };
    words.f32s(&lens);
    words.u32(orthographic);
    let cone = camera.cone();
    words.f32s(&[cone.width, cone.spread]);
    let offsets = camera.filter.offsets();
    words.u32(offsets.len() as u32 - 1);
    words.f32s(offsets);
}
