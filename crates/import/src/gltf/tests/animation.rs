//! Animations: closed forms, and files whose rest is the moment in question as oracle.

use super::builder::{Builder, load_bytes};
use crate::LoadOptions;
use serde_json::{Value, json};
use vastlight_math::glam::Quat;
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{Pose, Scene, SceneDesc, Severity};

impl Builder {
    /// Times of keys, with the bounds that they need.
    fn times(&mut self, times: &[f32]) -> usize {
        let list: Vec<[f32; 1]> = times.iter().map(|&time| [time]).collect();
        let index = self.floats(&list, "SCALAR");
        self.json["accessors"][index]["min"] = json!([times[0]]);
        self.json["accessors"][index]["max"] = json!([times[times.len() - 1]]);
        index
    }

    /// Adds a channel with a sampler of its own to the only animation.
    pub(super) fn channel(
        &mut self,
        node: usize,
        path: &str,
        interpolation: &str,
        times: &[f32],
        output: usize,
    ) {
        let input = self.times(times);
        if self.json["animations"].is_null() {
            self.json["animations"] = json!([{"channels": [], "samplers": []}]);
        }
        let animation = &mut self.json["animations"][0];
        let list = |value: &mut Value, key: &str, entry| {
            value[key].as_array_mut().expect("a list").push(entry);
            value[key].as_array().map_or(0, Vec::len) - 1
        };
        let sampler = json!({"input": input, "output": output, "interpolation": interpolation});
        let sampler = list(animation, "samplers", sampler);
        list(animation, "channels", json!({"sampler": sampler, "target": {"node": node, "path": path}}));
    }
}

fn pose(desc: &SceneDesc, time: f32) -> Pose {
    desc.motion.as_ref().expect("something moves").pose(time).expect("a pose")
}

fn at(desc: &SceneDesc, time: f32) -> SceneDesc {
    desc.clone().at(time).expect("a moment")
}

fn assert_near(a: &Affine3, b: &Affine3) {
    assert!(a.abs_diff_eq(*b, 2e-6), "{a:?} {b:?}");
}

/// A quarter turn about z in a second, and back by twice the time; written with the other sign at the end.
const TURNS: [[f32; 4]; 3] = [
    [0.0, 0.0, 0.0, 1.0],
    [0.0, 0.0, -std::f32::consts::FRAC_1_SQRT_2, -std::f32::consts::FRAC_1_SQRT_2],
    [0.0, 0.0, 0.0, 1.0],
];

#[test]
fn whatever_hangs_on_a_node_moves_with_it() {
    let mut file = Builder::triangle();
    let copies = file.floats(&[[1.0_f32, 0.0, 0.0], [2.0, 0.0, 0.0]], "VEC3");
    let turns = file.floats(&TURNS, "VEC4");
    file.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing", "KHR_lights_punctual"]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    file.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]);
    file.json["nodes"] = json!([
        {"mesh": 0, "translation": [9, 0, 0]},
        {"translation": [0, 0, 5], "scale": [2, 2, 2], "children": [2, 3]},
        {"camera": 0, "translation": [1, 0, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 3, 0, 1],
         "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": copies}}}},
    ]);
    file.channel(1, "rotation", "LINEAR", &[1.0, 2.0, 4.0], turns);
    let desc = file.load_clean();
    assert_eq!(desc.motion.as_ref().map(|m| m.duration()), Some(4.0));
    for (time, degrees) in
        [(0.0, 0.0), (1.0, 0.0), (4.0 / 3.0, 30.0), (5.0 / 3.0, 60.0), (2.0, 90.0), (3.0, 45.0), (9.0, 0.0)]
    {
        let found = pose(&desc, time);
        let turn = Quat::from_rotation_z(f32::to_radians(degrees));
        let node = Affine3::from_scale_rotation_translation(Vec3::splat(2.0), turn, Vec3::Z * 5.0);
        let numbers: Vec<u32> = found.instances.iter().map(|(instance, _)| *instance).collect();
        assert_eq!(numbers, [1, 2], "the first stands still");
        for (copy, (_, map)) in found.instances.iter().enumerate() {
            assert_near(map, &(node * Affine3::from_translation(Vec3::new(copy as f32 + 1.0, 3.0, 0.0))));
        }
        // Without scale, but where the scale puts them.
        let expected = Affine3::from_rotation_translation(turn, node.transform_point3(Vec3::X));
        let [(0, camera)] = &found.cameras[..] else { panic!("one camera") };
        assert_near(&camera.world_from_camera, &expected);
        assert_eq!(camera.projection, desc.cameras[0].projection);
        let [(0, light)] = &found.lights[..] else { panic!("one light") };
        assert_near(light, &expected);
        assert!(found.meshes.is_empty());
        assert_eq!(at(&desc, time).instances[2].world_from_object, found.instances[1].1);
    }
    assert!(pose(&desc, f32::NAN) == pose(&desc, 0.0));
}

/// Where the only instance's origin is.
fn origin(desc: &SceneDesc, time: f32) -> Vec3 {
    pose(desc, time).instances[0].1.translation
}

#[test]
fn values_may_be_sparse_and_of_small_types() {
    // A quarter turn about z in 16 bits; the node at (0, 0, 0), but at its second key.
    let mut file = Builder::triangle();
    let half = (32767.0 * std::f32::consts::FRAC_1_SQRT_2).round() as i16;
    let turns: Vec<u8> =
        [0, 0, 0, 32767, 0, 0, half, half].iter().flat_map(|x: &i16| x.to_le_bytes()).collect();
    let turns = file.accessor(&turns, 5122, "VEC4", 2);
    file.json["accessors"][turns]["normalized"] = json!(true);
    file.channel(0, "rotation", "LINEAR", &[0.0, 1.0], turns);
    let (number, values) = (file.view(&1_u32.to_le_bytes(), 0), [[3.0_f32, 6.0, 9.0]]);
    let values = file.view(&super::builder::bytes_of(&values), 0);
    let moved = file.push(
        "accessors",
        json!({"componentType": 5126, "type": "VEC3", "count": 3, "sparse": {"count": 1,
        "indices": {"bufferView": number, "componentType": 5125}, "values": {"bufferView": values}}}),
    );
    file.channel(0, "translation", "LINEAR", &[0.0, 3.0, 6.0], moved);
    let ones = file.floats(&[[1.0_f32; 3]; 2], "VEC3");
    file.channel(0, "scale", "STEP", &[0.0, 1.0], ones);
    let desc = file.load_clean();
    assert_eq!(desc.motion.as_ref().map(|m| m.duration()), Some(6.0), "the longest");
    for (time, expected) in [(0.0, 0.0), (1.0, 1.0), (3.0, 3.0), (4.0, 2.0), (6.0, 0.0)] {
        let found = origin(&desc, time);
        assert!((found - Vec3::new(1.0, 2.0, 3.0) * expected).length() < 1e-6, "{found} at {time}");
    }
    let x = pose(&desc, 1.0 / 3.0).instances[0].1.transform_vector3(Vec3::X);
    assert!((x - Vec3::new(3.0_f32.sqrt() / 2.0, 0.5, 0.0)).length() < 1e-4, "{x}");
}

#[test]
fn steps_and_splines_of_a_node() {
    let mut file = Builder::triangle();
    let sizes = file.floats(&[[1.0_f32; 3], [2.0; 3], [3.0; 3]], "VEC3");
    file.channel(0, "scale", "STEP", &[0.0, 1.0, 2.0], sizes);
    // x is t^2, the others stand still.
    let spline: Vec<[f32; 3]> = [0.0_f32, 2.0]
        .iter()
        .flat_map(|t| [[2.0 * t, 0.0, 0.0], [t * t, 1.0, 0.0], [2.0 * t, 0.0, 0.0]])
        .collect();
    let spline = file.floats(&spline, "VEC3");
    file.channel(0, "translation", "CUBICSPLINE", &[0.0, 2.0], spline);
    let desc = file.load_clean();
    for (time, size) in [(0.0, 1.0), (0.99, 1.0), (1.0, 2.0), (1.5, 2.0), (2.5, 3.0)] {
        let (_, map) = pose(&desc, time).instances[0];
        assert_eq!(map.transform_vector3(Vec3::X), Vec3::X * size);
        let held = f32::min(time, 2.0);
        assert!((map.translation - Vec3::new(held * held, 1.0, 0.0)).length() < 1e-6);
    }
}

/// A direction that no turn about z keeps.
const SLANTED: Vec3 = Vec3::new(0.6, 0.0, 0.8);

/// A strip of a smooth and a flat primitive with two joints off its plane, of which the upper one, node 2, is to bend.
fn skinned() -> Builder {
    let mut file = Builder::new();
    let positions: Vec<[f32; 3]> = (0..6).map(|i| [(i % 2) as f32, (i / 2) as f32, 0.0]).collect();
    let positions = file.positions(&positions);
    let normals = file.floats(&[SLANTED.to_array(); 6], "VEC3");
    let tangents = file.floats(&[[1.0_f32, 0.0, 0.0, 1.0]; 6], "VEC4");
    let joints: Vec<u8> = (0..6).flat_map(|_| [0, 1, 0, 0]).collect();
    let joints = file.accessor(&joints, 5121, "VEC4", 6);
    let upper = [0.0_f32, 0.0, 0.5, 0.5, 1.0, 1.0].map(|w| [1.0 - w, w, 0.0, 0.0]);
    let weights = file.floats(&upper, "VEC4");
    let mut matrices = [Affine3::IDENTITY, Affine3::from_translation(Vec3::NEG_Y)]
        .map(|m| vastlight_math::Mat4::from(m).to_cols_array());
    matrices[0][13] = 0.0;
    let inverse_binds = file.floats(&matrices, "MAT4");
    let indices = file.indices(&[0, 1, 3, 0, 3, 2, 2, 3, 5, 2, 5, 4]);
    let few = file.indices(&[2, 3, 5]);
    let smooth = json!({"POSITION": positions, "NORMAL": normals, "TANGENT": tangents, "JOINTS_0": joints, "WEIGHTS_0": weights});
    let flat = json!({"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights});
    file.mesh(json!([{"indices": indices, "attributes": smooth}, {"indices": few, "attributes": flat}]));
    file.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": inverse_binds}]);
    file.json["nodes"] = json!([{"mesh": 0, "skin": 0}, {"translation": [0, 0, 1], "children": [2]}, {"translation": [0, 1, 0]}]);
    file
}

/// Posed and loaded vertices are the same.
fn assert_same_vertices(posed: &SceneDesc, at_rest: &SceneDesc) {
    assert_eq!(posed.meshes.len(), at_rest.meshes.len());
    for (a, b) in posed.meshes.iter().zip(&at_rest.meshes) {
        assert_eq!((&a.triangles, a.positions.len()), (&b.triangles, b.positions.len()));
        assert_eq!((a.normals.len(), a.tangents.len()), (b.normals.len(), b.tangents.len()));
        let near = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).all(|(a, b)| a.abs_diff_eq(*b, 1e-6));
        assert!(near(&a.positions, &b.positions), "{:?} {:?}", a.positions, b.positions);
        assert!(near(&a.normals, &b.normals), "{:?} {:?}", a.normals, b.normals);
        assert!(a.tangents.iter().zip(&b.tangents).all(|(a, b)| a.abs_diff_eq(*b, 1e-6)));
    }
}

#[test]
fn a_skin_bends_with_its_joints() {
    let mut file = skinned();
    let turns = file.floats(&TURNS, "VEC4");
    file.channel(2, "rotation", "LINEAR", &[0.0, 1.0, 2.0], turns);
    let away = file.floats(&[[5.0_f32; 3]; 2], "VEC3");
    file.channel(0, "translation", "LINEAR", &[0.0, 1.0], away);
    let desc = file.load_clean();
    assert_same_vertices(&desc, &at(&desc, 0.0));
    for (time, degrees) in [(1.0 / 3.0, 30.0_f32), (1.0, 90.0), (1.5, 45.0)] {
        let found = at(&desc, time);
        let turn = Quat::from_rotation_z(degrees.to_radians());
        let bent = |p: Vec3, weight: f32| p.lerp(Vec3::Y + turn * (p - Vec3::Y), weight);
        for v in 0..6 {
            let (p, weight) = (Vec3::new((v % 2) as f32, (v / 2) as f32, 0.0), (v / 2) as f32 * 0.5);
            let place = bent(p, weight) + Vec3::Z;
            assert!(found.meshes[0].positions[v].abs_diff_eq(place, 1e-6), "{v} at {time}");
        }
        assert!(found.meshes[0].normals[5].abs_diff_eq(turn * SLANTED, 1e-6));
        assert!(found.meshes[0].tangents[5].abs_diff_eq((turn * Vec3::X).extend(1.0), 1e-6));
        // The same as a file at rest with the joint where it is.
        let mut still = skinned();
        still.json["nodes"][2]["rotation"] = json!(turn.to_array());
        assert_same_vertices(&found, &still.load_clean());
        assert!(found.instances == desc.instances, "the node of a skinned mesh does not count");
    }
    // Negative control.
    let moved = at(&desc, 1.0).meshes[0].positions[4] - desc.meshes[0].positions[4];
    assert!(moved.length() > 1.0, "{moved}");
}

/// A triangle with two targets, the second of which bends its normals, and a flat triangle without normals.
fn morphed() -> Builder {
    let mut file = Builder::triangle();
    let normals = file.floats(&[[0.0_f32, 0.0, 1.0]; 3], "VEC3");
    let first = file.positions(&[[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 4.0]]);
    let second = file.positions(&[[0.0, 1.0, 0.0], [0.0; 3], [0.0; 3]]);
    let turned = file.floats(&[[1.0_f32, 0.0, 0.0]; 3], "VEC3");
    file.json["meshes"][0]["primitives"] = json!([
        {"attributes": {"POSITION": 0, "NORMAL": normals},
         "targets": [{"POSITION": first}, {"POSITION": second, "NORMAL": turned}]},
        {"attributes": {"POSITION": 0}, "targets": [{"POSITION": first}, {"POSITION": second}]},
    ]);
    file.json["meshes"][0]["weights"] = json!([0.25, 0.0]);
    file
}

#[test]
fn morph_weights_move_and_other_nodes_keep_theirs() {
    let mut file = morphed();
    let weights = file.floats(&[[0.0_f32], [0.0], [1.0], [2.0]], "SCALAR");
    // Two nodes of one sampler, one of another, and one at rest.
    file.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0}, {"mesh": 0}, {"mesh": 0}]);
    file.channel(1, "weights", "LINEAR", &[0.0, 2.0], weights);
    file.channel(2, "weights", "STEP", &[0.0, 2.0], weights);
    file.channel(3, "weights", "LINEAR", &[0.0, 1.0], weights);
    file.json["animations"][0]["channels"][2]["sampler"] = json!(0);
    let desc = file.load_clean();
    let shown: Vec<u32> = desc.instances.iter().map(|i| i.mesh).collect();
    assert_eq!(shown, [0, 1, 2, 1]);
    assert!(
        desc.meshes.iter().all(|mesh| mesh.positions == desc.meshes[0].positions),
        "at rest all are alike"
    );
    for (time, weights) in [(0.0, [0.0, 0.0]), (0.5, [0.25, 0.5]), (1.5, [0.75, 1.5]), (2.0, [1.0, 2.0])] {
        let found = at(&desc, time);
        let mut still = morphed();
        let steps = if time < 2.0 { [0.0; 2] } else { weights };
        still.json["nodes"] =
            json!([{"mesh": 0}, {"mesh": 0, "weights": weights}, {"mesh": 0, "weights": [0.0, steps[1]]}]);
        let mut still = still.load_clean();
        // A file at rest has one mesh for equal weights.
        let of_node = |i: usize| still.meshes[still.instances[i].mesh as usize].clone();
        let mut expected: Vec<_> = (0..3).map(of_node).collect();
        if time == 2.0 {
            expected[2] = expected[1].clone();
        }
        still.meshes = expected;
        assert_same_vertices(&found, &still);
        let lifted = [0.0, 1.0, 2.0, 4.0].map(|z| z * weights[0]);
        let heights: Vec<f32> = found.meshes[1].positions.iter().take(3).map(|p| p.z).collect();
        assert_eq!(heights, lifted[1..], "the closed form at {time}");
        let normal = Vec3::new(weights[1], 0.0, 1.0).normalize();
        assert!(found.meshes[1].normals[0].abs_diff_eq(normal, 1e-6), "at {time}");
    }
}

#[test]
fn morphs_of_some_of_the_vertices_move_these() {
    let mut file = Builder::new();
    let places: Vec<[f32; 3]> = (0..5).map(|i| [(i % 2) as f32, (i * i) as f32, 0.0]).collect();
    let lifts: Vec<[f32; 3]> = (0..5).map(|i| [0.0, 0.0, i as f32]).collect();
    let (positions, up) = (file.positions(&places), file.positions(&lifts));
    let indices = file.indices(&[4, 1, 2]);
    file.mesh(
        json!([{"attributes": {"POSITION": positions}, "indices": indices, "targets": [{"POSITION": up}]}]),
    );
    file.node(json!({"mesh": 0}));
    let weights = file.floats(&[[0.0_f32], [1.0]], "SCALAR");
    file.channel(0, "weights", "LINEAR", &[0.0, 1.0], weights);
    let found = at(&file.load_clean(), 0.5);
    assert_eq!(found.meshes[0].corners(0).map(|corner| corner.z), [2.0, 0.5, 1.0]);
}

#[test]
fn looks_that_would_move_are_warned_of() {
    let mut file = Builder::triangle();
    let (up, colors) = (file.positions(&[[0.0, 0.0, 1.0]; 3]), file.floats(&[[0.5_f32; 4]; 3], "VEC4"));
    file.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0, "COLOR_0": colors},
        "targets": [{"POSITION": up, "COLOR_0": colors}]});
    let warned = |file: &Builder| file.warnings().iter().any(|warning| warning.contains("do not move"));
    assert!(!warned(&file), "nothing moves");
    let weights = file.floats(&[[0.0_f32], [1.0]], "SCALAR");
    file.channel(0, "weights", "LINEAR", &[0.0, 1.0], weights);
    assert!(warned(&file));
    let target = &mut file.json["meshes"][0]["primitives"][0]["targets"][0];
    target.as_object_mut().expect("an object").remove("COLOR_0");
    assert!(!warned(&file), "only places move");
}

#[test]
fn a_skin_that_stands_still_keeps_morphs_where_it_puts_them() {
    let mut file = skinned();
    let up = file.positions(&[[0.0, 0.0, 2.0]; 6]);
    for primitive in 0..2 {
        file.json["meshes"][0]["primitives"][primitive]["targets"] = json!([{"POSITION": up}]);
    }
    file.json["nodes"][2]["rotation"] = json!(TURNS[1]);
    let weights = file.floats(&[[0.0_f32], [1.0]], "SCALAR");
    file.channel(0, "weights", "LINEAR", &[0.0, 1.0], weights);
    let desc = file.load_clean();
    let mut still = skinned();
    for primitive in 0..2 {
        still.json["meshes"][0]["primitives"][primitive]["targets"] = json!([{"POSITION": up}]);
    }
    (still.bin, still.json["bufferViews"], still.json["accessors"]) =
        (file.bin.clone(), file.json["bufferViews"].clone(), file.json["accessors"].clone());
    still.json["nodes"][2]["rotation"] = json!(TURNS[1]);
    still.json["nodes"][0]["weights"] = json!([0.5]);
    assert_same_vertices(&at(&desc, 0.5), &still.load_clean());
}

#[test]
fn one_of_several_animations_is_played() {
    let mut file = Builder::triangle();
    let moved = file.floats(&[[1.0_f32, 0.0, 0.0], [2.0, 0.0, 0.0]], "VEC3");
    file.channel(0, "translation", "LINEAR", &[0.0, 1.0], moved);
    let mut second = file.json["animations"][0].clone();
    second["name"] = json!("Run");
    second["samplers"][0]["interpolation"] = json!("STEP");
    file.json["animations"].as_array_mut().expect("a list").push(second);
    let chosen = |name: Option<&str>| {
        let animation = name.map(str::to_owned);
        load_bytes(&file.glb(), &LoadOptions { animation, ..LoadOptions::default() })
    };
    for (name, x) in [(None, 1.5), (Some("0"), 1.5), (Some("1"), 1.0), (Some("Run"), 1.0)] {
        let desc = chosen(name);
        assert_eq!(origin(&desc, 0.5).x, x, "{name:?}");
        let named = desc.diagnostics.items().iter().any(|d| d.what.contains("\"Run\""));
        assert_eq!(named, name.is_none(), "others are named where nobody chose");
    }
    let error = chosen(Some("Walk")).diagnostics.first_error().expect("an error").clone();
    assert!(error.what.contains("\"Walk\"") && error.hint.contains("0, \"Run\""), "{error}");
}

#[test]
fn what_is_no_movement_of_a_node_is_ignored() {
    let mut file = Builder::triangle().with("extensionsUsed", json!(["KHR_animation_pointer"]));
    let moved = file.floats(&[[1.0_f32, 0.0, 0.0], [2.0, 0.0, 0.0]], "VEC3");
    file.channel(0, "translation", "LINEAR", &[0.0, 1.0], moved);
    file.json["animations"][0]["channels"][0]["target"] = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/0/translation"}}});
    assert!(file.load_clean().motion.is_none());
    assert!(file.warnings().iter().any(|w| w.contains("KHR_animation_pointer is not supported")));
    file.json["animations"][0]["channels"][0]["target"] = json!({"path": "translation"});
    assert!(file.load_clean().motion.is_none());
    // A node that is not shown.
    file.json["animations"][0]["channels"][0]["target"] = json!({"path": "translation", "node": 1});
    file.json["nodes"] = json!([{"mesh": 0}, {}]);
    file.json["scenes"] = json!([{"nodes": [0]}]);
    assert!(file.load_clean().motion.is_none());
    file.json["scenes"] = json!([{"nodes": [0, 1]}]);
    assert!(file.load_clean().motion.is_none(), "nothing hangs on it");
}

#[test]
fn places_beyond_all_numbers_are_errors() {
    let mut file = Builder::triangle();
    let moved = file.floats(&[[1.0_f32; 3], [3e38; 3]], "VEC3");
    file.channel(0, "scale", "LINEAR", &[0.0, 1.0], moved);
    file.channel(1, "scale", "LINEAR", &[0.0, 1.0], moved);
    file.json["nodes"] = json!([{"mesh": 0}, {"children": [0]}]);
    let motion = file.load_clean().motion.expect("moves");
    assert!(motion.pose(0.0).is_ok());
    assert!(motion.pose(1.0).expect_err("too far").to_string().contains("no finite place"));
}

#[test]
fn keys_that_do_not_ascend_are_errors() {
    for times in [[0.0, 2.0, 1.0], [0.0, 1.0, 1.0], [0.0, f32::NAN, 1.0]] {
        let mut file = Builder::triangle();
        let moved = file.floats(&[[1.0_f32; 3]; 3], "VEC3");
        file.channel(0, "translation", "LINEAR", &[0.0, 0.5, 2.0], moved);
        let input = file.json["animations"][0]["samplers"][0]["input"].as_u64().expect("a number") as usize;
        let view = file.json["accessors"][input]["bufferView"].as_u64().expect("a number") as usize;
        let offset = file.json["bufferViews"][view]["byteOffset"].as_u64().expect("a number") as usize;
        let bytes: Vec<u8> = times.iter().flat_map(|t: &f32| t.to_le_bytes()).collect();
        file.bin[offset..offset + 12].copy_from_slice(&bytes);
        let desc = file.load();
        assert!(desc.diagnostics.items().iter().any(|d| d.severity == Severity::Error), "{times:?}");
        // Nobody may pose it, but nothing happens.
        let _ = desc.motion.as_ref().map(|motion| motion.pose(0.7));
        assert!(Scene::new(desc).is_err());
    }
}
