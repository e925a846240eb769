use super::*;
use crate::single::Blocks;
use proptest::prelude::*;
use vastlight_math::{Vec3, Vec4};

fn parse(bytes: &[u8]) -> Result<Mesh, ImportError> {
    let mut mesh = Mesh::default();
    parse_into(bytes, &mut mesh).map_err(Stopped::into_import)?;
    Ok(mesh)
}

fn parse_into(bytes: &[u8], sink: &mut dyn MeshSink) -> Result<(), Stopped> {
    let (limits, file_bytes) = (Limits::default(), bytes.len() as u64);
    let source = || Source::new(bytes, "test.stl".into(), &limits);
    let reader = || Reader { source: source(), file_bytes, limits: &limits };
    let colored = reader().survey()?.is_some_and(|(_, colored)| colored);
    reader().read(colored, sink)
}

const ASCII: &str = "solid a name with words\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  \
    vertex 1 1 0\n endloop\nendfacet\nfacet normal 0 0 1\n outer loop\n  vertex 0 -0.0 0\n  vertex 1 1 0\n  \
    vertex 0 1e0 0\n endloop\nendfacet\nendsolid a name with words\n";

fn binary(header: &[u8], facets: &[([[f32; 3]; 3], u16)]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(HEADER_BYTES, 0);
    bytes.extend((facets.len() as u32).to_le_bytes());
    for (corners, attribute) in facets {
        bytes.extend([0; 12]);
        bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(attribute.to_le_bytes());
    }
    bytes
}

const A: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
const B: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn text_and_binary_give_the_same_welded_mesh() {
    let text = parse(ASCII.as_bytes()).expect("well formed");
    assert_eq!(text.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(text.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(parse(&binary(b"made by hand", &[(A, 0), (B, 0)])).expect("well formed"), text);
    assert_eq!(parse(ASCII.to_uppercase().as_bytes()).expect("upper case").triangles, text.triangles);
}

#[test]
fn binary_files_that_start_with_solid() {
    let mesh = parse(&binary(b"solid part exported by CAD", &[(A, 0)])).expect("binary");
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    let mut trailing = binary(b"solid", &[(A, 0)]);
    trailing.extend(b"trailing bytes");
    assert_eq!(parse(&trailing).expect("binary").triangles.len(), 1);
}

#[test]
fn colors_of_both_conventions() {
    let viscam = parse(&binary(b"", &[(A, 0x8000 | 31 << 10), (B, 0)])).expect("well formed");
    assert_eq!(viscam.colors[0], Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(viscam.colors[3], Vec4::ONE);
    assert_eq!(viscam.positions.len(), 6, "corners of different colours stay apart");
    let magics = parse(&binary(b"x COLOR=\x00\x00\xff\xff", &[(A, 31), (B, 0x8000)])).expect("well formed");
    assert_eq!(magics.colors[0], Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(magics.colors[3], Vec4::new(0.0, 0.0, 1.0, 1.0));
    assert!(parse(&binary(b"", &[(A, 0)])).expect("well formed").colors.is_empty());
}

#[test]
fn errors_say_what_and_where() {
    let message = |bytes: &[u8]| parse(bytes).expect_err("malformed").to_string();
    assert!(message(ASCII.replace("vertex 1 1 0\n endloop", "endloop").as_bytes()).contains("2 vertices"));
    assert!(message(ASCII.replace("1e0", "x").as_bytes()).starts_with("test.stl:13: a vertex needs"));
    let mut short = binary(b"", &[(A, 0)]);
    short[HEADER_BYTES] = 200;
    assert!(message(&short).contains("promises 200 triangles, the file has room for 1"));
}

#[test]
fn every_truncation_is_an_error_not_a_panic() {
    let binary = binary(b"", &[(A, 0), (B, 7)]);
    for bytes in [ASCII.as_bytes(), &binary] {
        let last_word = if bytes[0] == b's' { "id a name with words\n".len() } else { 0 };
        for length in 0..bytes.len() - last_word {
            assert!(parse(&bytes[..length]).is_err(), "{length} of {}", bytes.len());
        }
    }
}

#[test]
fn many_vertices_are_welded() {
    let grid = |i: u32, j: u32| [i as f32, j as f32, 0.5];
    let mut facets = Vec::new();
    for i in 0..60 {
        for j in 0..60 {
            facets.push(([grid(i, j), grid(i + 1, j), grid(i + 1, j + 1)], 0));
            facets.push(([grid(i, j), grid(i + 1, j + 1), grid(i, j + 1)], 0));
        }
    }
    let mesh = parse(&binary(b"", &facets)).expect("well formed");
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (7200, 61 * 61));
    for (t, (corners, _)) in facets.iter().enumerate() {
        assert_eq!(mesh.corners(t as u32).map(|p| p.to_array()), *corners);
    }
}

/// Found by fuzzing: a default colour without facets made another material where the file was streamed.
#[test]
fn a_default_colour_of_nothing_is_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("empty.stl");
    std::fs::write(&path, binary(b"x COLOR=\x00\x00\xff\xff", &[])).expect("written");
    let whole = crate::load(&path, &crate::LoadOptions::default()).expect("a scene");
    let streamed = crate::stream(&path, &crate::LoadOptions::default()).expect("a scene").stream;
    assert_eq!(streamed.desc.materials, whole.materials);
}

/// Facets without a corner in common, and once more the first.
fn apart(count: u32) -> Vec<([[f32; 3]; 3], u16)> {
    let corner = |i: u32, c: u32| [i as f32, c as f32, 1.0];
    let facet = |i: u32| ([corner(i, 0), corner(i, 1), corner(i, 2)], 0);
    (0..count).chain([0]).map(facet).collect()
}

#[test]
fn blocks_are_small_and_are_the_mesh() {
    let facets = apart(weld::WINDOW as u32 / 3 + 40_000);
    let mut blocks = Blocks { room: usize::MAX, ..Blocks::default() };
    assert!(parse_into(&binary(b"", &facets), &mut blocks).is_ok());
    assert!(blocks.most_vertices < weld::WINDOW + 3 && blocks.most_triangles <= 1 << 14);
    for (t, (corners, _)) in facets.iter().enumerate() {
        assert_eq!(blocks.mesh.corners(t as u32).map(|p| p.to_array()), *corners);
    }
    // The last facet is too far from the first to share its corners.
    assert_eq!(blocks.mesh.positions.len(), 3 * facets.len());
    let near = parse(&binary(b"", &apart(1000))).expect("well formed");
    assert_eq!(near.positions.len(), 3000);
}

#[test]
fn a_sink_without_room_ends_it_with_its_own_error() {
    let mut blocks = Blocks { room: 20_000, ..Blocks::default() };
    let stopped = parse_into(&binary(b"", &apart(50_000)), &mut blocks).expect_err("no room");
    assert!(matches!(stopped, Stopped::Sink(error) if error.what == "there is no room"));
    assert_eq!(blocks.mesh.triangles.len(), 1 << 14);
}

fn text(facets: &[([[f32; 3]; 3], u16)]) -> Vec<u8> {
    let mut text = "solid a\n".to_owned();
    for (corners, _) in facets {
        text += "facet normal 0.0000000 0.0000000 1.0000000\n outer loop\n";
        for [x, y, z] in corners {
            text += &format!("  vertex {x} {y} {z}\n");
        }
        text += " endloop\nendfacet\n";
    }
    (text + "endsolid a\n").into_bytes()
}

#[test]
fn a_streamed_file_is_the_loaded_one() {
    let options = LoadOptions::default();
    let colored = [(A, 0x8000 | 31 << 10), (B, 0)];
    let long = text(&apart(130_000));
    assert!(long.len() as u64 > MOST_TEXT_AT_ONCE);
    let files = [
        (binary(b"", &apart(500)), true, Some(501)),
        (binary(b"", &colored), true, Some(2)),
        (binary(b"", &[]), true, Some(0)),
        (ASCII.as_bytes().to_vec(), false, None),
        (long, true, None),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    for (bytes, by_blocks, triangles) in files {
        let path = folder.path().join("part.stl");
        std::fs::write(&path, bytes).expect("written");
        let loaded = load(&path, &options).expect("reads");
        let Streamed { stream, mut large, .. } = stream(&path, &options).expect("reads");
        assert_eq!((large.len(), stream.desc.materials.clone()), (usize::from(by_blocks), loaded.materials));
        let mesh = match large.pop() {
            Some(mesh) => {
                assert_eq!(mesh.triangles, triangles);
                mesh.collect().expect("reads")
            }
            None => stream.collect().expect("reads").meshes.remove(0),
        };
        assert_eq!(mesh, loaded.meshes[0]);
    }
}

proptest! {
    #[test]
    fn garbage_never_panics(
        at in any::<proptest::sample::Index>(),
        garbage in proptest::collection::vec(any::<u8>(), 1..8),
        text in any::<bool>(),
    ) {
        let mut bytes = if text { ASCII.as_bytes().to_vec() } else { binary(b"", &[(A, 0), (B, 7)]) };
        let first = at.index(bytes.len());
        for (byte, &new) in bytes[first..].iter_mut().zip(&garbage) {
            *byte = new;
        }
        let _ = parse(&bytes);
    }
}
