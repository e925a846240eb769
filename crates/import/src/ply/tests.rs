use super::*;
use crate::single::Blocks;
use proptest::prelude::*;
use vastlight_math::{Vec2, Vec4};

fn parse(bytes: &[u8]) -> Result<(Mesh, Diagnostics), ImportError> {
    let limits = Limits::default();
    let mut diagnostics = Diagnostics::default();
    let source = Source::new(bytes, "test.ply".into(), &limits);
    let mesh = read(source, bytes.len() as u64, &limits, &mut Triangulator::default(), &mut diagnostics)?;
    Ok((mesh, diagnostics))
}

fn mesh(bytes: &[u8]) -> Mesh {
    parse(bytes).expect("well formed").0
}

const ASCII: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 5\nproperty double y\n\
    property float x\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float s\n\
    property float t\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n\
    element camera 1\nproperty float view_px\nproperty list uchar float k\nelement face 2\nproperty uchar flags\n\
    property list uchar int vertex_indices\nend_header\n\
    0 0 0 0 0 2 0 0 255 0 0 255\n0 1 0 0 0 1 1 0 0 255 0 127\n1 1 0 0 0 1 1 1 0 0 255 255\n\
    1 0 0 0 0 1 0 1 255 255 255 255\n0.5 2 0 0 0 1 0 1 128 128 128 255\n\
    7 3 1 2 3\n9 4 0 1 2 3\n9 3 1 4 2\n";

#[test]
fn text_with_everything() {
    let (mesh, diagnostics) = parse(ASCII.as_bytes()).expect("well formed");
    assert_eq!(mesh.positions[1], Vec3::new(1.0, 0.0, 0.0));
    assert_eq!(mesh.positions[4], Vec3::new(2.0, 0.5, 0.0));
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 2]]);
    assert_eq!(mesh.normals[0], Vec3::Z);
    assert_eq!(mesh.uvs[0][2], Vec2::new(1.0, 0.0));
    assert_eq!(mesh.colors[0], Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert!((mesh.colors[4].x - 0.2158).abs() < 1e-3, "sRGB 128 is linear 0.2158");
    assert!((mesh.colors[1].w - 127.0 / 255.0).abs() < 1e-6);
    assert!(diagnostics.items().is_empty());
}

/// The same content in a binary order.
fn binary(big: bool) -> Vec<u8> {
    let order = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = format!(
        "ply\nformat {order} 1.0\nelement vertex 4\nproperty short id\nproperty float x\nproperty double y\n\
         property int z\nproperty ushort red\nproperty ushort green\nproperty ushort blue\n\
         element other 2\nproperty list uint double q\nelement face 2\nproperty list ushort uint vertex_index\n\
         property list uchar float texcoord\nproperty char last\nend_header\n"
    )
    .into_bytes();
    let mut put = |le: &[u8]| {
        if big {
            bytes.extend(le.iter().rev());
        } else {
            bytes.extend(le);
        }
    };
    for (x, y) in [(0.0_f32, 0.0_f64), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
        put(&5_i16.to_le_bytes());
        put(&x.to_le_bytes());
        put(&y.to_le_bytes());
        put(&(-3_i32).to_le_bytes());
        for channel in [65535_u16, 0, 32768] {
            put(&channel.to_le_bytes());
        }
    }
    for count in [2_u32, 0] {
        put(&count.to_le_bytes());
        (0..count).for_each(|_| put(&1.5_f64.to_le_bytes()));
    }
    for corners in [&[0_u32, 1, 2][..], &[3, 2, 1, 0]] {
        put(&(corners.len() as u16).to_le_bytes());
        corners.iter().for_each(|c| put(&c.to_le_bytes()));
        put(&[1]);
        put(&0.5_f32.to_le_bytes());
        put(&[0xff]);
    }
    bytes
}

#[test]
fn both_byte_orders_give_the_same_mesh() {
    let little = mesh(&binary(false));
    assert_eq!(little, mesh(&binary(true)));
    assert_eq!(little.positions[2], Vec3::new(1.0, 1.0, -3.0));
    assert_eq!(little.triangles, [[0, 1, 2], [3, 2, 1], [3, 1, 0]]);
    assert_eq!(little.colors[0].x, 1.0);
    assert!((little.colors[0].z - 0.2140).abs() < 1e-3);
}

#[test]
fn concave_polygons_are_not_fans() {
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 0\n4 0 0\n4 4 0\n2 1 0\n0 4 0\n5 0 1 2 3 4\n";
    let mesh = mesh(text.as_bytes());
    assert_eq!(mesh.triangles.len(), 3);
    for t in 0..3 {
        let [a, b, c] = mesh.corners(t);
        assert!((b - a).cross(c - a).z > 0.0);
    }
}

#[test]
fn triangle_strips() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
                0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 3 2 1\n";
    assert_eq!(mesh(text.as_bytes()).triangles, [[0, 1, 2], [2, 1, 3], [3, 2, 1]]);
}

/// A file often has one list of all strips.
#[test]
fn a_long_list_of_strips_comes_in_blocks() {
    let count = 3 * BLOCK_TRIANGLES;
    let mut text =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                    element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
                    0 0 0\n1 0 0\n0 1 0\n"
            .to_owned();
    text += &(count + 2).to_string();
    (0..count + 2).for_each(|i| text += [" 0", " 1", " 2"][i % 3]);
    let (mut blocks, limits) = (Blocks { room: usize::MAX, ..Blocks::default() }, Limits::default());
    let source = Source::new(text.as_bytes(), "test.ply".into(), &limits);
    assert!(read_into(source, text.len() as u64, &limits, &mut Triangulator::default(), &mut blocks).is_ok());
    assert_eq!((blocks.mesh.triangles.len(), blocks.most_triangles), (count, BLOCK_TRIANGLES));
    let few = Limits { triangles: count as u64 - 1, ..limits };
    let source = Source::new(text.as_bytes(), "test.ply".into(), &few);
    assert!(read_into(source, text.len() as u64, &few, &mut Triangulator::default(), &mut blocks).is_err());
}

#[test]
fn line_ends_of_other_systems() {
    let expected = mesh(ASCII.as_bytes());
    assert_eq!(mesh(ASCII.replace('\n', "\r\n").as_bytes()), expected);
    assert_eq!(mesh(ASCII.replace('\n', "\r").as_bytes()), expected);
}

#[test]
fn point_clouds_are_named() {
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                end_header\n0 0 0\n";
    let (mesh, diagnostics) = parse(text.as_bytes()).expect("well formed");
    assert!(mesh.triangles.is_empty());
    assert!(diagnostics.items()[0].what.contains("no faces"));
}

#[test]
fn errors_say_what_and_where() {
    let message = |text: &str| parse(text.as_bytes()).expect_err("malformed").to_string();
    let wrong_index = message(&ASCII.replace("3 1 4 2", "3 1 5 2"));
    assert_eq!(wrong_index, "test.ply:31: face 1: vertex 5 does not exist, there are 5");
    assert!(message(&ASCII.replace("0.5 2", "0.5x 2")).starts_with("test.ply:28: this is not a number"));
    let cut = message(&ASCII[..ASCII.len() - 8]);
    assert!(cut.contains("the file ends within the element \"face\""), "{cut}");
    assert!(message("plx\n").contains("test.ply:1"));
    assert!(message(&ASCII.replace("ascii", "morse")).contains("unknown format \"morse\""));
    assert!(message(&ASCII.replace("property double y\n", "")).contains("no x, y and z"));
}

#[test]
fn absurd_counts_take_no_memory() {
    let text = ASCII.replace("element face 2", "element face 4000000000");
    assert!(parse(text.as_bytes()).is_err());
    let empty_rows = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n\
                      property float z\nelement face 9000000000\nend_header\n";
    assert!(parse(empty_rows.as_bytes()).is_ok());
}

#[test]
fn every_truncation_is_an_error_not_a_panic() {
    for bytes in [ASCII.as_bytes().to_vec(), binary(false), binary(true)] {
        for length in 0..bytes.len() - 3 {
            assert!(parse(&bytes[..length]).is_err(), "{length} of {}", bytes.len());
        }
        assert!(parse(&bytes).is_ok());
    }
}

proptest! {
    #[test]
    fn garbage_never_panics(
        at in any::<proptest::sample::Index>(),
        garbage in proptest::collection::vec(any::<u8>(), 1..8),
        big in any::<bool>(),
        text in any::<bool>(),
    ) {
        let mut bytes = if text { ASCII.as_bytes().to_vec() } else { binary(big) };
        let first = at.index(bytes.len());
        for (byte, &new) in bytes[first..].iter_mut().zip(&garbage) {
            *byte = new;
        }
        let _ = parse(&bytes);
    }
}
