//! Meshes: accessors of every kind, topologies, defaults of missing attributes.

use super::builder::{Builder, bytes_of};
use serde_json::json;
use vastlight_math::{Vec2, Vec3, Vec4};

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];

/// A square of four vertices with the given extra properties of its primitive.
fn square(more: impl FnOnce(&mut Builder) -> serde_json::Value) -> Builder {
    let mut builder = Builder::new();
    let positions = builder.positions(&CORNERS);
    let mut primitive = more(&mut builder);
    primitive["attributes"]["POSITION"] = json!(positions);
    builder.mesh(json!([primitive]));
    builder.node(json!({"mesh": 0}));
    builder
}

#[test]
fn indices_of_every_type_give_the_same_triangles() {
    let indices = [0_u32, 1, 2, 2, 1, 3];
    let narrow: Vec<u8> = indices.iter().map(|&i| i as u8).collect();
    let middle: Vec<u8> = indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect();
    let wide: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
    for (component, bytes) in [(5121, narrow), (5123, middle), (5125, wide)] {
        let mesh = square(|b| json!({"indices": b.accessor(&bytes, component, "SCALAR", 6)})).only_mesh();
        assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(mesh.positions, CORNERS.map(Vec3::from));
        assert!(mesh.normals.is_empty());
    }
}

#[test]
fn strips_and_fans_make_triangles_and_lines_are_named() {
    let mesh = square(|_| json!({"mode": 5})).only_mesh();
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    let mesh = square(|_| json!({"mode": 6})).only_mesh();
    assert_eq!(mesh.triangles, [[1, 2, 0], [2, 3, 0]]);
    for (mode, name) in [(0, "points"), (1, "lines"), (2, "line loops"), (3, "line strips")] {
        let builder = square(|_| json!({"mode": mode}));
        assert!(builder.load_clean().meshes[0].triangles.is_empty());
        assert!(builder.warnings().iter().any(|w| w.contains(name)), "{name}");
    }
}

#[test]
fn strided_and_normalised_attributes_are_read() {
    let mut builder = square(|b| {
        let uvs = b.accessor(
            &[0_u16, 0, 65535, 0, 0, 65535, 65535, 65535].map(u16::to_le_bytes).concat(),
            5123,
            "VEC2",
            4,
        );
        let colors = b.accessor(&[255, 0, 51, 0, 0, 255, 51, 0, 0, 0, 51, 0, 1, 2, 51, 0], 5121, "VEC3", 4);
        json!({"mode": 5, "attributes": {"TEXCOORD_0": uvs, "COLOR_0": colors}})
    });
    builder.json["accessors"][1]["normalized"] = json!(true);
    builder.json["accessors"][2]["normalized"] = json!(true);
    builder.json["bufferViews"][2]["byteStride"] = json!(4);
    let mesh = builder.only_mesh();
    assert_eq!(mesh.uvs, [[Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE]]);
    assert_eq!(mesh.colors[0], Vec4::new(1.0, 0.0, 0.2, 1.0));
    assert_eq!(mesh.colors[3], Vec4::new(1.0 / 255.0, 2.0 / 255.0, 0.2, 1.0));
}

#[test]
fn sparse_values_replace_those_of_the_base_and_of_nothing() {
    for with_base in [true, false] {
        let mut builder = Builder::new();
        let base = builder.positions(&CORNERS[..3]);
        let indices = builder.view(&1_u16.to_le_bytes(), 0);
        let values = builder.view(&bytes_of(&[[5.0, 6.0, 7.0]]), 0);
        builder.json["accessors"][base]["sparse"] = json!({
            "count": 1,
            "indices": {"bufferView": indices, "componentType": 5123},
            "values": {"bufferView": values}
        });
        builder.json["accessors"][base]["max"] = json!([5.0, 6.0, 7.0]);
        if !with_base {
            let accessor = builder.json["accessors"][base].as_object_mut().expect("an object");
            accessor.remove("bufferView");
        }
        builder.mesh(json!([{"attributes": {"POSITION": base}}]));
        builder.node(json!({"mesh": 0}));
        let third = if with_base { Vec3::Y } else { Vec3::ZERO };
        assert_eq!(builder.only_mesh().positions, [Vec3::ZERO, Vec3::new(5.0, 6.0, 7.0), third]);
    }
}

#[test]
fn quantised_attributes_need_their_extension() {
    let positions: Vec<u8> = [0_i16, 0, 0, 0, 2, 0, 0, 0, -32767, 32767, 3, 0].map(i16::to_le_bytes).concat();
    let mut builder = Builder::new();
    let view = builder.view(&positions, 8);
    builder.push(
        "accessors",
        json!({"bufferView": view, "componentType": 5122, "type": "VEC3", "count": 3,
               "min": [-32767, 0, 0], "max": [2, 32767, 3]}),
    );
    let normals = [0_i8, 0, 127, 0, 0, 0, -127, 0, 127, 0, 0, 0].map(|x| x as u8);
    let view = builder.view(&normals, 4);
    builder.push(
        "accessors",
        json!({"bufferView": view, "componentType": 5120, "type": "VEC3", "count": 3, "normalized": true}),
    );
    builder.mesh(json!([{"attributes": {"POSITION": 0, "NORMAL": 1}}]));
    builder.node(json!({"mesh": 0}));
    assert!(builder.error().contains("is not allowed here"));
    let builder = builder.with("extensionsUsed", json!(["KHR_mesh_quantization"]));
    let mesh = builder.only_mesh();
    assert_eq!(mesh.positions[2], Vec3::new(-32767.0, 32767.0, 3.0));
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::NEG_Z, Vec3::X]);
    let mut normalised = builder;
    normalised.json["accessors"][0]["normalized"] = json!(true);
    assert_eq!(normalised.only_mesh().positions[2].truncate(), Vec2::new(-1.0, 1.0));
}

#[test]
fn primitives_become_parts_and_missing_attributes_get_defaults() {
    let mut builder = Builder::new();
    let positions = builder.positions(&CORNERS);
    let normals = builder.floats(&[[0.0_f32, 0.0, -1.0]; 4], "VEC3");
    let uvs = builder.floats(&[[0.5_f32, 0.25]; 4], "VEC2");
    let indices = builder.indices(&[0, 1, 2, 2, 1, 3]);
    builder.mesh(json!([
        {"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": indices, "material": 1},
        {"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices": indices},
        {"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": indices, "material": 0},
    ]));
    builder.node(json!({"mesh": 0}));
    let desc = builder.with("materials", json!([{"name": "a"}, {"name": "b"}])).load_clean();
    let mesh = &desc.meshes[0];
    assert_eq!(
        mesh.parts.iter().map(|p| (p.first_triangle, p.material)).collect::<Vec<_>>(),
        [(0, 1), (2, 2), (4, 0)]
    );
    assert_eq!(desc.materials[2].name, "default");
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (6, 4 + 6 + 4));
    assert_eq!((mesh.normals[0], mesh.normals[4], mesh.normals[13]), (Vec3::NEG_Z, Vec3::Z, Vec3::NEG_Z));
    assert_eq!((mesh.uvs[0][0], mesh.uvs[0][4]), (Vec2::ZERO, Vec2::new(0.5, 0.25)));
    assert_eq!(mesh.triangles[4], [10, 11, 12]);
}

#[test]
fn a_primitive_keeps_only_the_vertices_that_it_uses() {
    let mut builder = Builder::new();
    let points: Vec<[f32; 3]> = (0..100).map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
    let positions = builder.positions(&points);
    let indices = builder.indices(&[90, 5, 17]);
    builder.mesh(json!([{"attributes": {"POSITION": positions}, "indices": indices}]));
    builder.node(json!({"mesh": 0}));
    let mesh = builder.only_mesh();
    assert_eq!(mesh.positions, [points[5], points[17], points[90]].map(Vec3::from));
    assert_eq!(mesh.triangles, [[2, 0, 1]]);
}

#[test]
fn data_outside_the_file_is_an_error_or_a_warning() {
    let mut builder = Builder::triangle();
    builder.json["bufferViews"][0]["byteLength"] = json!(1000);
    assert!(builder.error().contains("#/bufferViews/0/byteLength"));
    let mut builder = Builder::triangle();
    builder.json["bufferViews"][0]["buffer"] = json!(1);
    assert!(builder.error().contains("refers to nothing"));
    let mut builder = Builder::triangle();
    builder.json["accessors"][0]["count"] = json!(4);
    assert!(builder.error().contains("#/accessors/0: 4 elements"));
    let mut builder = Builder::triangle();
    builder.json["accessors"][0]["count"] = json!(9_000_000_000_000_000_u64);
    assert!(builder.error().contains("#/accessors/0"));
}
