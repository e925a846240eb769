//! Broken and hostile files: cut off anywhere, with any byte or value changed, or asking for too much.

use super::builder::{Builder, load_bytes};
use crate::LoadOptions;
use proptest::prelude::*;
use serde_json::{Value, json};

/// A file with most features in it.
fn rich() -> Builder {
    let mut builder = Builder::triangle();
    let normals = builder.floats(&[[0.0_f32, 0.0, 1.0]; 3], "VEC3");
    let uvs = builder.floats(&[[0.0_f32, 0.0], [1.0, 0.0], [0.0, 1.0]], "VEC2");
    let joints = builder.accessor(&[0; 12], 5121, "VEC4", 3);
    let weights = builder.floats(&[[1.0_f32, 0.0, 0.0, 0.0]; 3], "VEC4");
    let deltas = builder.positions(&[[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 4.0]]);
    let indices = builder.indices(&[0, 1, 2]);
    let morphs = builder.floats(&[[0.0_f32], [1.0], [0.5]], "SCALAR");
    let turns =
        builder.floats(&[[0.0_f32, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0]], "VEC4");
    let moved = builder.floats(&[[1.0_f32, 0.0, 0.0]; 9], "VEC3");
    builder.channel(1, "rotation", "LINEAR", &[0.0, 0.5, 1.0], turns);
    builder.channel(2, "translation", "CUBICSPLINE", &[0.0, 0.5, 1.0], moved);
    builder.channel(0, "weights", "STEP", &[0.0, 0.5, 1.0], morphs);
    let changed = builder.view(&2_u32.to_le_bytes(), 0);
    builder.json["accessors"][normals]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": changed, "componentType": 5125}, "values": {"bufferView": 0, "byteOffset": 12}});
    builder.json["meshes"][0] = json!({"weights": [0.5], "primitives": [{"indices": indices, "material": 0,
        "attributes": {"POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs, "JOINTS_0": joints, "WEIGHTS_0": weights},
        "targets": [{"POSITION": deltas}]}]});
    builder.json["nodes"] = json!([{"mesh": 0, "skin": 0}, {"camera": 0, "children": [2]},
        {"mesh": 0, "scale": [1, 2, 3], "rotation": [0, 0, 0, 1],
         "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}}]);
    builder
        .with("extensionsUsed", json!(["EXT_mesh_gpu_instancing"]))
        .with("skins", json!([{"joints": [1]}]))
        .with("cameras", json!([{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]))
        .with("materials", json!([{"normalTexture": {"index": 0}}]))
        .with("textures", json!([{"source": 0}]))
        .with("images", json!([{"uri": "data:image/png;base64,iVBORw0KGgo="}]))
        .with("scenes", json!([{"nodes": [0, 1]}]))
}

fn load(bytes: &[u8]) -> vastlight_scene::SceneDesc {
    load_bytes(bytes, &LoadOptions::default())
}

/// Whatever was let through makes a scene, or is refused by it, and so it is at a moment.
fn use_scene(desc: vastlight_scene::SceneDesc) {
    let motion = desc.motion.clone();
    if motion.is_some()
        && let Ok(moved) = desc.clone().at(0.3)
    {
        drop(vastlight_scene::Scene::new(moved));
    }
    let mut scene = vastlight_scene::Scene::new(desc).ok();
    for time in motion.iter().flat_map(|motion| [f32::NAN, 0.7, motion.duration()]) {
        let pose = motion.as_ref().map(|motion| motion.pose(time));
        if let (Some(scene), Some(Ok(pose))) = (&mut scene, pose) {
            drop(scene.pose(pose));
        }
    }
}

#[test]
fn the_rich_file_moves() {
    let desc = load(&rich().glb());
    let pose = desc.motion.unwrap_or_else(|| panic!("{:?}", desc.diagnostics)).pose(0.7).expect("a pose");
    let counts = [pose.meshes.len(), pose.instances.len(), pose.cameras.len(), pose.lights.len()];
    assert_eq!(counts, [1, 3, 1, 0]);
}

#[test]
fn a_file_cut_off_anywhere_is_an_error() {
    let glb = Builder::triangle().glb();
    assert!(load(&glb).diagnostics.items().is_empty());
    for length in 0..glb.len() {
        assert!(load(&glb[..length]).diagnostics.first_error().is_some(), "{length} bytes");
    }
}

#[test]
fn long_chains_are_checked_in_no_time() {
    // Every node is a joint, has a skin, and refers back to the first node.
    let mut builder = rich();
    let count = 30_000;
    let node =
        |i: usize| json!({"mesh": 0, "skin": 0, "translation": [0, 0, 0], "children": [(i + 1) % count, 0]});
    builder.json["nodes"] = json!((0..count).map(node).collect::<Vec<_>>());
    builder.json["skins"] = json!([{"joints": (0..count).collect::<Vec<_>>(), "skeleton": 7}]);
    assert!(builder.error().contains("/nodes/"));
}

/// All places of a document.
fn places(json: &Value, place: &str, all: &mut Vec<String>) {
    all.push(place.to_owned());
    match json {
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, v)| places(v, &format!("{place}/{i}"), all))
        }
        Value::Object(map) => map.iter().for_each(|(k, v)| places(v, &format!("{place}/{k}"), all)),
        _ => {}
    }
}

#[test]
fn any_value_may_be_any_other_value() {
    let builder = rich();
    let mut all = Vec::new();
    places(&builder.json, "", &mut all);
    let values = [
        json!(null),
        json!(-1),
        json!(0),
        json!(1),
        json!(2.5),
        json!(1e300),
        json!(4_294_967_295_u32),
        json!("x"),
        json!([]),
        json!({}),
        json!([0]),
        json!([[]]),
        json!(true),
    ];
    for place in all.iter().filter(|place| !place.is_empty()) {
        for value in &values {
            let mut changed = Builder { json: builder.json.clone(), bin: builder.bin.clone() };
            *changed.json.pointer_mut(place).expect("a place") = value.clone();
            let desc = load(&changed.glb());
            use_scene(desc);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_byte_may_be_any_other_byte(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut glb = rich().glb();
        for (index, byte) in changes {
            let at = index.index(glb.len());
            glb[at] = byte;
        }
        use_scene(load(&glb));
    }
}

#[test]
fn small_files_cannot_ask_for_much_memory() {
    // Zeros by the billion.
    let mut builder = Builder::triangle();
    let accessor = builder.json["accessors"][0].as_object_mut().expect("an object");
    accessor.remove("bufferView");
    accessor.insert("count".into(), json!(2_000_000_000_u32));
    assert!(builder.error().contains("beyond the limit of memory"));
    // A million primitives that share a few million zeros.
    builder.json["accessors"][0]["count"] = json!(3_000_000);
    builder.json["accessors"][0]["max"] = json!([0, 0, 0]);
    builder.json["meshes"][0]["primitives"] = json!(vec![json!({"attributes": {"POSITION": 0}}); 1000]);
    assert!(builder.error().contains("beyond the limit of memory"));
    // A million instances through a handful of nodes.
    let mut builder = Builder::triangle();
    builder.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 4_000_000}));
    let node =
        json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}});
    builder.json["nodes"] = json!(vec![node; 1000]);
    builder.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    assert!(builder.error().contains("instances"), "{}", builder.error());
    // A mesh that fits once, but not with what poses it.
    let mut builder = Builder::triangle();
    let zeros = json!({"componentType": 5126, "type": "VEC3", "count": 3_900_000, "min": [0, 0, 0], "max": [0, 0, 0]});
    builder.json["accessors"][0] = zeros;
    let target = json!({"POSITION": 0});
    builder.json["meshes"][0]["primitives"] = json!([{"attributes": {"POSITION": 0}, "targets": [target]}]);
    builder.load_clean();
    let weights = builder.floats(&[[0.0_f32], [1.0]], "SCALAR");
    builder.channel(0, "weights", "LINEAR", &[0.0, 1.0], weights);
    assert!(builder.error().contains("beyond the limit of memory"), "{}", builder.error());
    // Targets of many zeros for the few vertices of a compressed primitive.
    let mut builder = super::compression::draco_grid();
    let zeros = json!({"componentType": 5126, "type": "VEC3", "count": 1_000_000, "min": [0, 0, 0], "max": [0, 0, 0]});
    let zeros = builder.push("accessors", zeros);
    let primitive = &mut builder.json["meshes"][0]["primitives"][0];
    primitive["attributes"] = json!({"POSITION": zeros});
    primitive["targets"] = json!(vec![json!({"POSITION": zeros}); 60]);
    let weights = builder.floats(&[[0.0_f32]; 120], "SCALAR");
    builder.channel(0, "weights", "LINEAR", &[0.0, 1.0], weights);
    assert!(builder.error().contains("beyond the limit of memory"), "{}", builder.error());
    // Thousands of samplers that share a few million zeros.
    let mut builder = Builder::triangle();
    let zeros = builder.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 4_000_000}));
    let times = builder.push(
        "accessors",
        json!({"componentType": 5126, "type": "SCALAR", "count": 4_000_000, "min": [0], "max": [0]}),
    );
    builder.json["nodes"] = json!(vec![json!({"mesh": 0}); 1000]);
    let channel = |i: usize| json!({"sampler": i, "target": {"node": i, "path": "scale"}});
    builder.json["animations"] = json!([{"samplers": vec![json!({"input": times, "output": zeros}); 1000],
        "channels": (0..1000).map(channel).collect::<Vec<_>>()}]);
    assert!(builder.error().contains("beyond the limit of memory"), "{}", builder.error());
}
