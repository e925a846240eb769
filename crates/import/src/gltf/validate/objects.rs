//! Checks of cameras, lights, images and materials.

use crate::gltf::accessor::Data;
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;

/// Checks them all.
pub(super) fn check(root: &Json<'_>, data: &Data, findings: &mut Findings) {
    for (i, camera) in root.list("cameras").iter().enumerate() {
        check_camera(camera, &format!("/cameras/{i}"), findings);
    }
    for (i, image) in root.list("images").iter().enumerate() {
        check_image(image, data, &format!("/images/{i}"), findings);
    }
    for (i, material) in root.list("materials").iter().enumerate() {
        let mode = material.at("alphaMode").text().unwrap_or("OPAQUE");
        if material.get("alphaCutoff").is_some() && mode != "MASK" {
            let what = "alphaCutoff has a meaning only in the mode MASK";
            let place = format!("/materials/{i}/alphaCutoff");
            findings.warn("MATERIAL_ALPHA_CUTOFF_INVALID_MODE", what, &place, "it is ignored");
        }
        check_ior(material, &format!("/materials/{i}/extensions/KHR_materials_ior/ior"), findings);
    }
    let lights = root.extension("KHR_lights_punctual").map_or(&[][..], |e| e.list("lights"));
    for (i, light) in lights.iter().enumerate() {
        check_light(light, &format!("/extensions/KHR_lights_punctual/lights/{i}"), findings);
    }
}

fn check_camera(camera: &Json<'_>, place: &str, findings: &mut Findings) {
    let has = |key: &str| camera.get(key).is_some();
    if has("perspective") && has("orthographic") {
        let what = "a camera is either perspective or orthographic";
        findings.error("ONE_OF_MISMATCH", what, place, "");
    }
    let Some(kind) = camera.at("type").text().filter(|t| ["perspective", "orthographic"].contains(t)) else {
        return;
    };
    if !has(kind) {
        findings.error("UNDEFINED_PROPERTY", format!("the property \"{kind}\" is missing"), place, "");
    }
    let (lens, place) = (camera.at(kind), format!("{place}/{kind}"));
    if let (Some(near), Some(far)) = (lens.at("znear").number(), lens.at("zfar").number())
        && far <= near
    {
        findings.error("CAMERA_ZFAR_LEQUAL_ZNEAR", "zfar is not greater than znear", &place, "");
    }
    for key in ["xmag", "ymag"] {
        let (size, place) = (lens.at(key).number().unwrap_or(1.0), format!("{place}/{key}"));
        if size == 0.0 {
            findings.error("CAMERA_XMAG_YMAG_ZERO", format!("{key} is 0"), &place, "");
        } else if size < 0.0 {
            let hint = "its sign is ignored";
            findings.warn("CAMERA_XMAG_YMAG_NEGATIVE", format!("{key} is negative"), &place, hint);
        }
    }
    if lens.at("yfov").number().is_some_and(|fov| fov >= std::f64::consts::PI) {
        let what = "yfov is not less than pi, half a turn";
        findings.warn("CAMERA_YFOV_GEQUAL_PI", what, &place, "it is narrowed");
    }
}

fn check_image(image: &Json<'_>, data: &Data, place: &str, findings: &mut Findings) {
    if !matches!(image, Json::Object(_)) {
        return;
    }
    let view = image.index("bufferView");
    if image.get("bufferView").is_some() == image.get("uri").is_some() {
        let what = "an image has either a bufferView or a uri";
        findings.error("ONE_OF_MISMATCH", what, place, "");
    }
    if view.and_then(|v| data.view(v)).is_some_and(|v| v.stride.is_some()) {
        let what = "the view of an image must not have a byteStride";
        findings.error("IMAGE_BUFFER_VIEW_WITH_BYTESTRIDE", what, &format!("{place}/bufferView"), "");
    }
}

/// 0 stands for "infinite"; nothing real lies below 1.
fn check_ior(material: &Json<'_>, place: &str, findings: &mut Findings) {
    let ior = material.extension("KHR_materials_ior").and_then(|e| e.at("ior").number());
    if let Some(ior) = ior.filter(|&ior| ior > 0.0 && ior < 1.0) {
        let what = format!("the index of refraction {ior} is below 1");
        findings.error("VALUE_NOT_IN_RANGE", what, place, "0 stands for infinite");
    }
}

fn check_light(light: &Json<'_>, place: &str, findings: &mut Findings) {
    let spot = light.at("spot");
    let (inner, outer) =
        (spot.float("innerConeAngle", 0.0), spot.float("outerConeAngle", std::f32::consts::FRAC_PI_4));
    if light.at("type").text() == Some("spot") && inner >= outer {
        let what = "the outer angle of the spot is not greater than the inner";
        findings.error("KHR_LIGHTS_PUNCTUAL_LIGHT_SPOT_ANGLES", what, &format!("{place}/spot"), "");
    }
}
