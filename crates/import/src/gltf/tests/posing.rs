//! Morph targets and skins at rest.

use super::builder::Builder;
use serde_json::json;
use vastlight_math::Vec3;

fn morphed() -> Builder {
    let mut builder = Builder::triangle();
    let deltas = builder.positions(&[[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 4.0]]);
    builder.json["meshes"][0]["primitives"][0]["targets"] =
        json!([{"POSITION": deltas}, {"POSITION": deltas}]);
    builder
}

fn heights(builder: &Builder) -> Vec<Vec<f32>> {
    builder.load_clean().meshes.iter().map(|m| m.positions.iter().map(|p| p.z).collect()).collect()
}

#[test]
fn morph_weights_come_from_the_node_else_from_the_mesh() {
    let mut builder = morphed();
    assert_eq!(heights(&builder), [[0.0, 0.0, 0.0]]);
    builder.json["meshes"][0]["weights"] = json!([0.5, 0.0]);
    assert_eq!(heights(&builder), [[0.5, 1.0, 2.0]]);
    builder.node(json!({"mesh": 0, "weights": [1, 1]}));
    builder.node(json!({"mesh": 0, "weights": [0, 0]}));
    builder.node(json!({"mesh": 0, "weights": [1, 1]}));
    // The first node, the second and fourth, the third.
    assert_eq!(heights(&builder), [[0.5, 1.0, 2.0], [2.0, 4.0, 8.0], [0.0, 0.0, 0.0]]);
    let instances: Vec<u32> = builder.load_clean().instances.iter().map(|i| i.mesh).collect();
    assert_eq!(instances, [0, 1, 2, 1]);
}

#[test]
fn skinned_vertices_follow_their_joints_in_the_world() {
    let mut builder = Builder::triangle();
    let joints = builder.accessor(&[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0], 5121, "VEC4", 3);
    let weights =
        builder.floats(&[[1.0_f32, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]], "VEC4");
    let mut matrices = [[0.0_f32; 16]; 2];
    for matrix in &mut matrices {
        for i in 0..4 {
            matrix[5 * i] = 1.0;
        }
    }
    matrices[1][12] = -1.0;
    let inverse_binds = builder.floats(&matrices, "MAT4");
    let attributes = &mut builder.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    builder.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": inverse_binds}]);
    // The skinned node's own place does not count; the joints' does.
    builder.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"children": [2], "translation": [0, 0, 10]},
        {"translation": [1, 0, 0], "scale": [2, 2, 2]},
    ]);
    let desc = builder.load_clean();
    assert!(builder.warnings().iter().any(|w| w.contains("/nodes/0") && w.contains("does not count")));
    let placed: Vec<Vec3> = desc.meshes[0]
        .positions
        .iter()
        .map(|&p| desc.instances[0].world_from_object.transform_point3(p))
        .collect();
    // Vertex 1 at (1,0,0): relative to joint 1 at the origin, so it stays at the joint's place (1, 0, 10).
    // Vertex 2 at (0,1,0): half (0,1,10), half (1,0,10) + 2 * ((0,1,0) - (1,0,0)) = (-1, 2, 10).
    assert_eq!(placed, [Vec3::new(0.0, 0.0, 10.0), Vec3::new(1.0, 0.0, 10.0), Vec3::new(-0.5, 1.5, 10.0)]);
}
