//! What glTF has no place for and vastlight's own writer puts into `extras.vastlight`: the light from infinity at the
//! root, the lens at a camera, the measured metal at a material.

use super::findings::Findings;
use super::json::Json;
use vastlight_math::Vec3;
use vastlight_scene::{Conductor, Environment, Sky};

const HINT: &str = "it is ignored";

/// The light from infinity at the document's root.
pub(super) fn environment(root: &Json<'_>, findings: &mut Findings) -> Option<Environment> {
    let json = root.at("extras").at("vastlight").get("environment")?;
    let found = constant(json).or_else(|| sky(json.get("sky")?));
    if found.is_none() {
        let what = "this is neither a constant nor a sky of finite numbers";
        findings.warn("EXTRAS_ENVIRONMENT", what, "/extras/vastlight/environment", HINT);
    }
    found
}

fn constant(json: &Json<'_>) -> Option<Environment> {
    let radiance = json.floats("constant").map(Vec3::from_array)?;
    radiance.is_finite().then(|| Environment::Constant(radiance.max(Vec3::ZERO)))
}

/// A sky; what it does not say is that of the default one.
fn sky(json: &Json<'_>) -> Option<Environment> {
    let usual = Sky::default();
    let sky = Sky {
        sun_azimuth: json.float("sunAzimuth", usual.sun_azimuth),
        sun_elevation: json.float("sunElevation", usual.sun_elevation),
        turbidity: json.float("turbidity", usual.turbidity),
        ground_albedo: json.floats("groundAlbedo").map_or(usual.ground_albedo, Vec3::from_array),
        strength: json.float("strength", usual.strength),
        sun_disc: json.flag("sunDisc"),
    };
    let numbers = [sky.sun_azimuth, sky.sun_elevation, sky.turbidity, sky.strength];
    let is_usable = numbers.iter().all(|x| x.is_finite()) && sky.ground_albedo.is_finite();
    is_usable.then_some(Environment::Sky(sky))
}

/// Radius and focus distance of a camera's lens in the scene's units; `place` points at the camera.
pub(super) fn lens(camera: &Json<'_>, place: &str, findings: &mut Findings) -> Option<(f32, f32)> {
    let json = camera.at("extras").get("vastlight")?;
    let radius = json.float("lensRadius", 0.0);
    let focus = json.float("focusDistance", 1.0);
    let is_usable = radius.is_finite() && radius >= 0.0 && focus.is_finite() && focus > 0.0;
    if !is_usable {
        let what = "a lens has a finite radius and a finite distance above zero";
        findings.warn("EXTRAS_LENS", what, &format!("{place}/extras/vastlight"), HINT);
    }
    is_usable.then_some((radius, focus))
}

/// The complex index of refraction of a material's metal.
pub(super) fn conductor(material: &Json<'_>) -> Option<Conductor> {
    let json = material.at("extras").at("vastlight").at("conductor");
    let vector = |key: &str| json.floats(key).map(Vec3::from_array).filter(|v| v.is_finite());
    let (eta, k) = (vector("eta")?, vector("k")?);
    (eta.min_element() > 0.0 && k.min_element() >= 0.0).then_some(Conductor { eta, k })
}
