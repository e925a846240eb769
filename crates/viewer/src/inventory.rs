//! What is in a scene, for the page.

use crate::objects::rows;
use crate::stage::Objects;
use crate::view::CameraView;
use serde_json::{Value, json};
use vastlight::math::{Aabb, Vec3};
use vastlight::scene::{Environment, LightKind, Material, Scene};
use vastlight::{Picked, SceneCounts};

/// Most entries of a list.
const MOST: usize = 500;
/// Most warnings.
const MOST_WARNINGS: usize = 20;

/// All of it.
pub(crate) fn of_scene(scene: &Scene) -> Value {
    let cameras: Vec<Value> =
        scene.cameras().iter().take(MOST).map(|camera| json!(CameraView::of(camera, scene))).collect();
    let materials: Vec<Value> = scene.materials().iter().take(MOST).map(material).collect();
    let lights: Vec<Value> = scene
        .lights()
        .iter()
        .take(MOST)
        .map(|light| {
            let kind = match light.kind {
                LightKind::Point => "point",
                LightKind::Spot { .. } => "spot",
                LightKind::Directional => "directional",
            };
            json!({"name": light.name, "type": kind, "intensity": light.intensity.to_array()})
        })
        .collect();
    let warnings: Vec<String> =
        scene.diagnostics().items().iter().take(MOST_WARNINGS).map(ToString::to_string).collect();
    json!({
        "counts": SceneCounts::new(scene),
        "cameras": cameras,
        "materials": materials,
        "lights": lights,
        "environment": environment(scene),
        "bounds": bounds(&scene.bounds()),
        "warnings": warnings,
    })
}

/// What light from infinity is, where the scene says so itself: then it can be turned.
fn environment(scene: &Scene) -> Option<&'static str> {
    scene.desc().environment.as_ref().map(|environment| match environment {
        Environment::Constant(_) => "constant",
        Environment::Map { .. } => "map",
        Environment::Sky(_) => "sky",
    })
}

fn material(material: &Material) -> Value {
    json!({
        "name": material.name,
        "base_color": material.base_color.factor.to_array(),
        "roughness": material.roughness.factor,
        "metallic": material.metallic.factor,
        "textured": material.base_color.texture.is_some()
            || material.roughness.texture.is_some()
            || material.metallic.texture.is_some(),
    })
}

fn bounds(bounds: &Aabb) -> Value {
    if bounds.is_empty() {
        return json!({"min": [-1.0, -1.0, -1.0], "max": [1.0, 1.0, 1.0]});
    }
    json!({"min": bounds.min.to_array(), "max": bounds.max.to_array()})
}

/// What was picked.
pub(crate) fn of_pick(picked: Option<&Picked>, scene: &Scene, objects: &Objects) -> Value {
    let Some(picked) = picked else { return json!({"kind": "picked", "object": null}) };
    let vector = |v: Vec3| v.to_array();
    let opened = objects.opened(scene, picked.instance);
    let at_rest = scene.extents()[picked.mesh as usize].bounds.transformed(&opened);
    json!({
        "kind": "picked",
        "object": picked.object,
        "instance": picked.instance,
        "mesh": picked.mesh_name,
        "triangles": picked.triangles,
        "primitive": picked.primitive,
        "material": scene.materials().get(picked.material as usize).map(material),
        "position": vector(picked.position),
        "normal": vector(picked.normal),
        "depth": picked.depth,
        "bounds": bounds(&picked.bounds),
        "opened": {"place": rows(&opened), "bounds": bounds(&at_rest)},
        "held": objects.held(scene, picked.instance),
    })
}
