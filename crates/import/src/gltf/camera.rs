//! Cameras.

use super::extras;
use super::findings::Findings;
use super::json::Json;
use vastlight_math::glam::{DAffine3, DVec3};
use vastlight_scene::{Camera, Projection};

/// The camera of number `index` at a node. The node's scale does not count.
pub(super) fn read(
    json: &Json<'_>,
    index: usize,
    name: String,
    world_from_node: &DAffine3,
    findings: &mut Findings,
) -> Option<Camera> {
    let (projection, aspect) = match json.at("type").text()? {
        "perspective" => {
            let perspective = json.at("perspective");
            let vertical_fov = perspective.at("yfov").number()? as f32;
            let place = format!("/cameras/{index}");
            let (lens_radius, focus_distance) = extras::lens(json, &place, findings).unwrap_or((0.0, 1.0));
            let projection = Projection::Perspective { vertical_fov, lens_radius, focus_distance };
            (projection, perspective.at("aspectRatio").number().map(|x| x as f32))
        }
        "orthographic" => {
            let (xmag, ymag) =
                (json.at("orthographic").float("xmag", 1.0), json.at("orthographic").float("ymag", 1.0));
            (Projection::Orthographic { half_height: ymag.abs() }, Some((xmag / ymag).abs()))
        }
        _ => return None,
    };
    Some(Camera {
        name,
        world_from_camera: super::node::to_f32(&without_scale(world_from_node)),
        projection,
        aspect,
    })
}

/// The transform with axes of unit length; an axis of no length becomes that of the world. An axis that has unit length
/// in single precision is kept as it is, so that what was written is read again.
pub(super) fn without_scale(transform: &DAffine3) -> DAffine3 {
    let is_unit = |axis: DVec3| (axis.length_squared() - 1.0).abs() < 1e-6;
    let unit = |axis: DVec3, fallback: DVec3| {
        if is_unit(axis) { axis } else { axis.try_normalize().unwrap_or(fallback) }
    };
    let axes = transform.matrix3;
    DAffine3::from_cols(
        unit(axes.x_axis, DVec3::X),
        unit(axes.y_axis, DVec3::Y),
        unit(axes.z_axis, DVec3::Z),
        transform.translation,
    )
}
