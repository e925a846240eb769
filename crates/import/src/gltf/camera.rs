//! Cameras.

use super::json::Json;
use vastlight_math::glam::{DAffine3, DVec3};
use vastlight_scene::{Camera, Projection};

/// A camera at a node. The node's scale does not count.
pub(super) fn read(json: &Json<'_>, name: String, world_from_node: &DAffine3) -> Option<Camera> {
    let (projection, aspect) = match json.at("type").text()? {
        "perspective" => {
            let perspective = json.at("perspective");
            let projection = Projection::Perspective {
                vertical_fov: perspective.at("yfov").number()? as f32,
                lens_radius: 0.0,
                focus_distance: 1.0,
            };
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

/// The transform with axes of unit length; an axis of no length becomes that of the world.
pub(super) fn without_scale(transform: &DAffine3) -> DAffine3 {
    let unit = |axis: DVec3, fallback: DVec3| axis.try_normalize().unwrap_or(fallback);
    let axes = transform.matrix3;
    DAffine3::from_cols(
        unit(axes.x_axis, DVec3::X),
        unit(axes.y_axis, DVec3::Y),
        unit(axes.z_axis, DVec3::Z),
        transform.translation,
    )
}
