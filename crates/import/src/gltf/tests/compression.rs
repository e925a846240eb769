//! Compressed meshes.

use super::builder::Builder;
use serde_json::{Value, json};
use vastlight_math::Vec3;

/// Encodes elements as a meshopt attribute stream of version 0: one block, every byte plane stored raw.
fn meshopt_stream(elements: &[[u8; 12]]) -> Vec<u8> {
    let mut stream = vec![0xa0];
    for plane in 0..12 {
        stream.push(0b11);
        let mut previous = elements[0][plane];
        let mut deltas = [0_u8; 16];
        for (delta, element) in deltas.iter_mut().zip(elements) {
            let step = element[plane].wrapping_sub(previous) as i8;
            *delta = ((step << 1) ^ (step >> 7)) as u8;
            previous = element[plane];
        }
        stream.extend(deltas);
    }
    stream.extend([0; 20]);
    stream.extend(elements[0]);
    stream
}

/// A triangle whose positions stand compressed behind the rest of the data.
fn compressed(extension: &str) -> Builder {
    let mut builder = Builder::triangle();
    let positions: Vec<u8> = builder.bin[..36].to_vec();
    let stream = meshopt_stream(positions.as_chunks::<12>().0);
    builder.bin.fill(0);
    let offset = builder.bin.len();
    builder.bin.extend(&stream);
    builder.json["bufferViews"][0] = json!({"buffer": 1, "byteLength": 36, "extensions": {extension: {
        "buffer": 0, "byteOffset": offset, "byteLength": stream.len(), "byteStride": 12, "count": 3,
        "mode": "ATTRIBUTES"}}});
    builder.json["buffers"] = json!([{"byteLength": 36, "extensions": {extension: {"fallback": true}}}]);
    builder.json["extensionsUsed"] = json!([extension]);
    builder.json["extensionsRequired"] = json!([extension]);
    builder
}

#[test]
fn meshopt_views_are_decompressed() {
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        assert_eq!(compressed(extension).only_mesh().positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    }
    let mut broken = compressed("EXT_meshopt_compression");
    let header = broken.bin.len() - 32 - 12 * 17 - 1;
    broken.bin[header] = 0;
    let error = broken.error();
    assert!(error.contains("#/bufferViews/0/extensions/EXT_meshopt_compression"), "{error}");
    let mut greedy = compressed("EXT_meshopt_compression");
    greedy.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = json!(1_u64 << 40);
    assert!(greedy.error().contains("beyond the limit of memory"));
}

/// A grid of 4 x 4 vertices with positions, colours, texture coordinates and normals, from the reference encoder.
#[rustfmt::skip]
const DRACO_GRID: &str = "RFJBQ08CAgEBAAAAEBIDEgMABt/Tp1p9Cv8BEf8Ca0H/AmtB/wJrQQQAAAABAAACAAD/AAABAgIDAQABAQMJAgEBAAEBCQMAAgABAAkDAAMCAQEBAAkDATQXAQwEAL6/gb++Dp+gAIB/AAAAAAAAAAAAAP8AAACrqio/q6oqP6uqqj6rqqo+q6oqP6uqqj6rqqo+AAAAAAAAAAAAAAAAAAAAAKuqqj6rqqo+q6oqP6uqKj8AAIA/AACAPwAAgD8AAIA/q6oqPwAAgD+rqqo+q6oqPwAAAAAAAIA/AAAAAKuqqj4AAIA/AAAAAKuqKj8AAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwEBAQAPAwEQJwEUARABDAYAk1PTvrarqqqqqqSqUxUAoKoCAKwKAAgAVRUAAACpCgABwKoAQABUVQAAAKQqAADAqgKAAFBVAQAAsKoAAABUVQAAAAAA/z8AAAAAAAAAAAAAAAAAAAAAwD8O";

/// A file that shows [`DRACO_GRID`], which is its view of number 0.
pub(super) fn draco_grid() -> Builder {
    use base64::Engine as _;
    let stream = base64::engine::general_purpose::STANDARD.decode(DRACO_GRID).expect("base64");
    let mut builder = Builder::new();
    let view = builder.view(&stream, 0);
    let vector = |shape: &str| json!({"componentType": 5126, "type": shape, "count": 16});
    let mut positions = vector("VEC3");
    positions["min"] = json!([0, 0, 0]);
    positions["max"] = json!([1.5, 0.75, 0.25]);
    builder.push("accessors", positions);
    builder.push("accessors", vector("VEC2"));
    builder.push("accessors", vector("VEC3"));
    builder.push("accessors", json!({"componentType": 5123, "type": "SCALAR", "count": 54}));
    let extension: Value =
        json!({"bufferView": view, "attributes": {"POSITION": 3, "TEXCOORD_0": 1, "NORMAL": 2}});
    builder.mesh(json!([{"indices": 3, "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "NORMAL": 2},
        "extensions": {"KHR_draco_mesh_compression": extension}}]));
    builder.node(json!({"mesh": 0}));
    builder.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    builder
}

#[test]
fn draco_primitives_are_decompressed() {
    let mut builder = draco_grid();
    let mesh = builder.only_mesh();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (16, 18));
    assert!((mesh.bounds().max - Vec3::new(1.5, 0.75, 0.25)).length() < 1e-3, "{:?}", mesh.bounds());
    assert!(mesh.normals.iter().all(|n| (*n - Vec3::Z).length() < 0.1), "{:?}", mesh.normals);
    assert_eq!(mesh.uvs[0].len(), 16);
    let last = builder.bin.len() - 30;
    builder.bin.truncate(last);
    builder.json["bufferViews"][0]["byteLength"] = json!(last);
    assert!(builder.error().contains("#/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression"));
}
