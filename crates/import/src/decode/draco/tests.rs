use super::*;
use base64::Engine as _;
use proptest::prelude::*;

/// A grid of 4 x 4 vertices with colours, texture coordinates and normals, as the reference encoder wrote it: sequential
/// (compression level 0) and EdgeBreaker with valence (level 7). Positions have 14 bits.
#[rustfmt::skip]
const STREAMS: [&str; 2] = [
    "RFJBQ08CAgEAAAASEAEABAUABQEBBQYBBgICBgcCBwMECAkECQUFCQoFCgYGCgsGCwcIDA0IDQkJDQ4JDgoKDg8KDwsBBAICAwEAAwkCAQEBCQMAAgAJAwADAQAAAgABAQEBIVkVVQEvVQE/ARQBFA26Goyn5HozmlfILSSeAAAAAP8AAAAAAAAAAAAAAAAAAACrqqo+AAAAAKuqKj8AAAAAAACAP6uqqj4AAAAAq6qqPquqqj6rqqo+q6oqP6uqqj4AAIA/q6oqPwAAAACrqio/q6qqPquqKj+rqio/q6oqPwAAgD8AAIA/AAAAAAAAgD+rqqo+AACAP6uqKj8AAIA/AACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwABAQAPAwEEKwEwAQwEAHyRQAAAVhUAAACqCgAAgFUFAKrq/w8AAACrqqoAAFVlVQDAqlZVVfX/BwAAgFW1qgCAqq4qAGBVU5Wq+v8DAADAqgIAAEBVAQAAsKoAAAAAAAD/PwAAAAAAAAAAAAAAAAAAAADAPw4=",
    "RFJBQ08CAgEBAAAAEBIDEgMABt/Tp1p9Cv8BEf8Ca0H/AmtB/wJrQQQAAAABAAACAAD/AAABAgIDAQABAQMJAgEBAAEBCQMAAgABAAkDAAMCAQEBAAkDATQXAQwEAL6/gb++Dp+gAIB/AAAAAAAAAAAAAP8AAACrqio/q6oqP6uqqj6rqqo+q6oqP6uqqj6rqqo+AAAAAAAAAAAAAAAAAAAAAKuqqj6rqqo+q6oqP6uqKj8AAIA/AACAPwAAgD8AAIA/q6oqPwAAgD+rqqo+q6oqPwAAAAAAAIA/AAAAAKuqqj4AAIA/AAAAAKuqKj8AAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwEBAQAPAwEQJwEUARABDAYAk1PTvrarqqqqqqSqUxUAoKoCAKwKAAgAVRUAAACpCgABwKoAQABUVQAAAKQqAADAqgKAAFBVAQAAsKoAAABUVQAAAAAA/z8AAAAAAAAAAAAAAAAAAAAAwD8O",
];

const COLOR: u32 = 0;
const UV: u32 = 1;
const NORMAL: u32 = 2;
const POSITION: u32 = 3;

fn stream(text: &str) -> Vec<u8> {
    base64::engine::general_purpose::STANDARD.decode(text).expect("base64")
}

fn decode_ok(text: &str) -> DracoMesh {
    draco(&stream(text), &Limits::default(), "test").expect("well formed")
}

fn floats(mesh: &DracoMesh, unique_id: u32) -> Vec<f32> {
    let attribute = mesh.attribute(unique_id).expect("an attribute");
    assert_eq!(attribute.component_type, 5126);
    attribute.bytes.as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect()
}

/// The grid's number of each decoded vertex.
fn grid_numbers(mesh: &DracoMesh) -> Vec<u32> {
    let positions = floats(mesh, POSITION);
    let number = |p: &[f32; 3]| {
        let (i, j) = ((p[0] / 0.5).round(), (p[1] / 0.25).round());
        let height = ((i * j) as u32 % 3) as f32 * 0.125;
        assert!(
            (p[0] - i * 0.5).abs() < 2e-4 && (p[1] - j * 0.25).abs() < 2e-4 && (p[2] - height).abs() < 2e-4
        );
        i as u32 * 4 + j as u32
    };
    positions.as_chunks::<3>().0.iter().map(number).collect()
}

#[test]
fn the_mesh_is_the_one_that_was_encoded() {
    let expected: Vec<[u32; 3]> = (0..3_u32)
        .flat_map(|i| (0..3).map(move |j| i * 4 + j))
        .flat_map(|a| [[a, a + 4, a + 5], [a, a + 5, a + 1]])
        .collect();
    let mut expected: Vec<[u32; 3]> = expected.into_iter().map(smallest_first).collect();
    expected.sort_unstable();
    for text in STREAMS {
        let mesh = decode_ok(text);
        let numbers = grid_numbers(&mesh);
        let mut found: Vec<[u32; 3]> =
            mesh.triangles.iter().map(|t| smallest_first(t.map(|v| numbers[v as usize]))).collect();
        found.sort_unstable();
        assert_eq!(found, expected);
    }
}

/// The same triangle with the same winding.
fn smallest_first(mut triangle: [u32; 3]) -> [u32; 3] {
    let smallest = (0..3).min_by_key(|&k| triangle[k]).unwrap_or(0);
    triangle.rotate_left(smallest);
    triangle
}

#[test]
fn attributes_belong_to_their_vertices() {
    for text in STREAMS {
        let mesh = decode_ok(text);
        let numbers = grid_numbers(&mesh);
        let colors = mesh.attribute(COLOR).expect("colours");
        assert_eq!((colors.components, colors.component_type), (3, 5121));
        let (uvs, normals) = (floats(&mesh, UV), floats(&mesh, NORMAL));
        for (v, &n) in numbers.iter().enumerate() {
            assert_eq!(colors.bytes[3 * v..3 * v + 3], [n as u8 * 16, 255 - n as u8 * 16, 7]);
            assert!((uvs[2 * v] - (n / 4) as f32 / 3.0).abs() < 1e-3);
            assert!((uvs[2 * v + 1] - (n % 4) as f32 / 3.0).abs() < 1e-3);
            assert!((normals[3 * v + 2] - 1.0).abs() < 1e-2);
        }
    }
}

#[test]
fn limits_hold() {
    let few = Limits { vertices: 3, ..Limits::default() };
    assert!(draco(&stream(STREAMS[0]), &few, "test").is_err());
}

#[test]
fn truncations_are_errors() {
    for text in STREAMS {
        let stream = stream(text);
        let errors =
            (0..stream.len()).filter(|&n| draco(&stream[..n], &Limits::default(), "test").is_err()).count();
        assert!(errors + 2 >= stream.len(), "{errors} of {}", stream.len());
    }
}

proptest! {
    #[test]
    fn garbage_never_panics(
        which in 0_usize..2,
        at in any::<proptest::sample::Index>(),
        garbage in proptest::collection::vec(any::<u8>(), 1..8),
    ) {
        let mut bytes = stream(STREAMS[which]);
        let first = at.index(bytes.len());
        for (byte, &new) in bytes[first..].iter_mut().zip(&garbage) {
            *byte = new;
        }
        let limits = Limits { vertices: 1 << 16, triangles: 1 << 16, decoded_bytes: 1 << 24, ..Limits::default() };
        let _ = draco(&bytes, &limits, "test");
    }
}
