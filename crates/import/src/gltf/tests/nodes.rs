//! Nodes, instances, scenes, cameras, lights.

use super::builder::{Builder, load_bytes};
use crate::{LoadOptions, gltf};
use serde_json::json;
use vastlight_math::Vec3;
use vastlight_scene::{Environment, LightKind, Projection, Sky};

fn origin(desc: &vastlight_scene::SceneDesc, instance: usize) -> Vec3 {
    desc.instances[instance].world_from_object.translation
}

#[test]
fn transforms_multiply_down_the_hierarchy() {
    let mut builder = Builder::triangle();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // A quarter turn about z, then twice the size.
    builder.node(json!({"children": [2], "translation": [10, 0, 0], "rotation": [0, 0, half, half], "scale": [2, 2, 2]}));
    builder.node(json!({"mesh": 0, "name": "leaf",
        "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1]}));
    let desc = builder.load_clean();
    assert_eq!((desc.meshes.len(), desc.instances.len()), (1, 2));
    assert!((origin(&desc, 1) - Vec3::new(10.0, 6.0, 0.0)).length() < 1e-5, "{}", origin(&desc, 1));
    let x = desc.instances[1].world_from_object.transform_vector3(Vec3::X);
    assert!((x - Vec3::new(0.0, 2.0, 0.0)).length() < 1e-5);
    let names: Vec<&str> = desc.instances.iter().map(|i| desc.names[i.name as usize].as_str()).collect();
    assert_eq!(names, ["mesh 0", "leaf"]);
}

#[test]
fn loops_second_parents_and_hidden_nodes() {
    let mut builder = Builder::triangle();
    builder.json["nodes"] = json!([{"mesh": 0, "children": [1]}, {"children": [0]}]);
    assert!(builder.error().contains("#/nodes/0: the node is its own ancestor"));
    builder.json["nodes"] = json!([{"mesh": 0}, {"children": [0]}, {"children": [0]}]);
    assert!(builder.error().contains("#/nodes/2/children/0: node 0 has another parent already"));
    builder.json["nodes"] = json!([{"mesh": 0}, {"children": [2], "extensions": {"KHR_node_visibility": {"visible": false}}},
        {"mesh": 0}]);
    builder.json["extensionsUsed"] = json!(["KHR_node_visibility"]);
    assert_eq!(builder.load_clean().instances.len(), 1);
}

#[test]
fn a_deep_hierarchy_is_no_recursion() {
    let mut builder = Builder::triangle();
    let depth = 100_000;
    let mut nodes: Vec<_> =
        (0..depth).map(|i| json!({"children": [i + 1], "translation": [1, 0, 0]})).collect();
    nodes.push(json!({"mesh": 0}));
    builder.json["nodes"] = json!(nodes);
    assert_eq!(origin(&builder.load_clean(), 0).x, depth as f32);
}

#[test]
fn gpu_instances_stand_relative_to_their_node() {
    let mut builder = Builder::triangle();
    let translations = builder.floats(&[[1.0_f32, 0.0, 0.0], [2.0, 0.0, 0.0]], "VEC3");
    let scales = builder.floats(&[[1.0_f32, 1.0, 1.0], [3.0, 3.0, 3.0]], "VEC3");
    builder.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    builder.json["nodes"] = json!([{"mesh": 0, "translation": [0, 5, 0], "extensions": {"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": translations, "SCALE": scales}}}}]);
    let desc = builder.load_clean();
    assert_eq!((desc.meshes.len(), desc.instances.len()), (1, 2));
    assert_eq!((origin(&desc, 0), origin(&desc, 1)), (Vec3::new(1.0, 5.0, 0.0), Vec3::new(2.0, 5.0, 0.0)));
    assert_eq!(desc.instances[1].world_from_object.transform_vector3(Vec3::X), Vec3::new(3.0, 0.0, 0.0));
    let file = tempfile::NamedTempFile::with_suffix(".glb").expect("a file");
    std::fs::write(&file, builder.glb()).expect("written");
    let size = gltf::file_size(file.path(), &LoadOptions::default()).expect("read");
    assert_eq!(size.instances, 2, "known before they are read");
    builder.json["accessors"][scales]["count"] = json!(1);
    assert!(builder.error().contains("different counts"));
}

#[test]
fn one_scene_is_shown_and_others_are_named() {
    let mut builder = Builder::triangle();
    builder.node(json!({"mesh": 0, "translation": [7, 0, 0]}));
    builder.json["scenes"] = json!([{"name": "first", "nodes": [0]}, {"name": "second", "nodes": [1]}]);
    assert_eq!(origin(&builder.load_clean(), 0).x, 0.0);
    assert!(builder.warnings().iter().any(|w| w.contains("\"second\"")));
    builder.json["scene"] = json!(1);
    assert_eq!(origin(&builder.load_clean(), 0).x, 7.0);
    for (wanted, x) in [("first", 0.0), ("0", 0.0), ("1", 7.0)] {
        let options = LoadOptions { scene: Some(wanted.into()), ..LoadOptions::default() };
        assert_eq!(origin(&load_bytes(&builder.glb(), &options), 0).x, x);
    }
    let options = LoadOptions { scene: Some("third".into()), ..LoadOptions::default() };
    let error = load_bytes(&builder.glb(), &options).diagnostics.first_error().expect("an error").to_string();
    assert!(error.contains("third") && error.contains("\"first\", \"second\""), "{error}");
}

#[test]
fn cameras_stand_at_their_nodes_without_scale() {
    let mut builder = Builder::triangle();
    builder.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 2.0}},
        {"name": "flat", "type": "orthographic", "orthographic": {"xmag": 4, "ymag": 2, "znear": 0, "zfar": 9}},
    ]);
    builder.node(json!({"camera": 0, "name": "eye", "translation": [1, 2, 3], "scale": [5, 5, 5]}));
    builder.node(json!({"camera": 1}));
    let desc = builder.load_clean();
    let [eye, flat] = &desc.cameras[..] else { panic!("two cameras") };
    assert_eq!((eye.name.as_str(), eye.aspect), ("eye", Some(2.0)));
    assert!(matches!(eye.projection, Projection::Perspective { vertical_fov: 0.5, lens_radius: 0.0, .. }));
    assert_eq!(eye.world_from_camera.transform_vector3(Vec3::X), Vec3::X);
    assert_eq!(eye.world_from_camera.transform_point3(Vec3::ZERO), Vec3::new(1.0, 2.0, 3.0));
    assert_eq!((flat.name.as_str(), flat.aspect), ("flat", Some(2.0)));
    assert_eq!(flat.projection, Projection::Orthographic { half_height: 2.0 });
}

#[test]
fn extras_of_our_own_hold_the_sky_and_the_lens() {
    let mut builder = Builder::triangle();
    let perspective = json!({"yfov": 0.5, "znear": 0.1});
    let lens = json!({"lensRadius": 0.25, "focusDistance": 3});
    builder.json["cameras"] =
        json!([{"type": "perspective", "perspective": perspective, "extras": {"vastlight": lens}}]);
    builder.node(json!({"camera": 0}));
    let own = |environment| json!({"vastlight": {"environment": environment}});
    builder.json["extras"] = own(json!({"sky": {"sunElevation": 0.3, "turbidity": 5}}));
    let desc = builder.load_clean();
    let sky = Sky { sun_elevation: 0.3, turbidity: 5.0, sun_disc: false, ..Sky::default() };
    assert_eq!(desc.environment, Some(Environment::Sky(sky)));
    let expected = Projection::Perspective { vertical_fov: 0.5, lens_radius: 0.25, focus_distance: 3.0 };
    assert_eq!(desc.cameras[0].projection, expected);

    builder.json["extras"] = own(json!({"constant": [0, 0.5, 1]}));
    assert_eq!(builder.load_clean().environment, Some(Environment::Constant(Vec3::new(0.0, 0.5, 1.0))));
    builder.json["extras"] = json!({"vastlight": 3, "another": {"environment": 1}});
    assert_eq!((builder.load_clean().environment, builder.warnings().len()), (None, 0));
}

#[test]
fn extras_that_make_no_sense_are_warnings() {
    let mut builder = Builder::triangle();
    let wrong = [
        json!({"sky": {"strength": 1e300}}),
        json!({"sky": {"groundAlbedo": [1e200, 0, 0]}}),
        json!({"constant": [1, 1]}),
        json!([1]),
    ];
    for environment in wrong {
        builder.json["extras"] = json!({"vastlight": {"environment": environment}});
        assert_eq!(builder.load_clean().environment, None);
        assert!(builder.warnings()[0].contains("/extras/vastlight/environment"));
    }
    builder.json["extras"] = json!({});
    builder.json["cameras"] = json!([{
        "type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1},
        "extras": {"vastlight": {"lensRadius": 0.1, "focusDistance": -3}},
    }]);
    builder.node(json!({"camera": 0}));
    assert!(builder.warnings()[0].contains("/cameras/0/extras/vastlight"));
    let camera = builder.load_clean().cameras.remove(0);
    assert!(matches!(camera.projection, Projection::Perspective { lens_radius: 0.0, .. }));
}

#[test]
fn punctual_lights_stand_at_their_nodes() {
    let mut builder = Builder::triangle();
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    builder.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "color": [1, 0.5, 0], "intensity": 10, "range": 3},
        {"type": "spot", "name": "lamp", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
        {"type": "directional"},
    ]}});
    for light in 0..3 {
        builder.node(
            json!({"translation": [light, 0, 0], "extensions": {"KHR_lights_punctual": {"light": light}}}),
        );
    }
    let lights = builder.load_clean().lights;
    assert_eq!(lights[0].intensity, Vec3::new(10.0, 5.0, 0.0));
    assert_eq!((lights[0].range, lights[0].kind.clone()), (3.0, LightKind::Point));
    assert_eq!(
        (lights[1].name.as_str(), lights[1].kind.clone()),
        ("lamp", LightKind::Spot { inner: 0.1, outer: 0.2 })
    );
    assert_eq!((lights[2].range, lights[2].kind.clone()), (f32::INFINITY, LightKind::Directional));
    assert_eq!(lights[2].world_from_light.transform_point3(Vec3::ZERO).x, 2.0);
}

#[test]
fn extensions_are_named_once_or_refused() {
    let builder = Builder::triangle().with("extensionsUsed", json!(["EXT_unheard_of", "KHR_materials_ior"]));
    let warnings = builder.warnings();
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("EXT_unheard_of"));
    let builder = builder.with("extensionsRequired", json!(["EXT_unheard_of"]));
    assert!(builder.error().contains("requires the extension EXT_unheard_of"));
    let builder = Builder::triangle().with(
        "animations",
        json!([{"channels": [{"sampler": 0, "target":
        {"path": "scale"}}], "samplers": [{"input": 1, "output": 0}]}]),
    );
    let mut builder = builder;
    builder.floats(&[[0.0_f32], [1.0], [2.0]], "SCALAR");
    builder.json["accessors"][1]["min"] = json!([0]);
    builder.json["accessors"][1]["max"] = json!([2]);
    builder.json["accessors"][0].as_object_mut().expect("an object").remove("x");
    assert!(
        builder.load().diagnostics.items().iter().any(|d| d.what.contains("used for")),
        "shared accessor"
    );
}
