use super::*;
use crate::ErrorKind;
use proptest::prelude::*;
use std::fs;
use vastlight_math::{Vec2, Vec3};
use vastlight_scene::{AlphaMode, Channel, Part, Texels};

/// Loads `obj` from a folder that also holds `files`.
fn load_limited(obj: &str, files: &[(&str, &[u8])], options: &LoadOptions) -> Result<SceneDesc, ImportError> {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("test.obj");
    fs::write(&path, obj).expect("written");
    for (name, content) in files {
        fs::write(folder.path().join(name), content).expect("written");
    }
    read(&path, options, &mut Deferral::never()).map(|(desc, _)| desc)
}

fn load_with(obj: &str, files: &[(&str, &[u8])]) -> Result<SceneDesc, ImportError> {
    load_limited(obj, files, &LoadOptions::default())
}

fn load_ok(obj: &str) -> SceneDesc {
    load_with(obj, &[]).expect("well formed")
}

fn warnings(desc: &SceneDesc) -> Vec<String> {
    desc.diagnostics.items().iter().map(|d| d.what.clone()).collect()
}

const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn polygons_and_negative_indices() {
    let desc = load_ok(&format!("{QUAD}f 1 2 3 4\nf -4 -3 -2\nv 5 5 5\nf -2 -1 1 \\\n 2\n"));
    let mesh = &desc.meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2], [3, 4, 0], [3, 0, 1]]);
    assert_eq!(mesh.positions.len(), 5);
    assert!(mesh.normals.is_empty(), "flat without normals and smoothing groups");
    assert_eq!(mesh.name, "test");
}

#[test]
fn uvs_are_flipped_and_split_vertices() {
    let desc = load_ok(&format!("{QUAD}vt 0 0.25\nvt 1 0\nvt 0.5\nf 1/1 2/2 3/3\nf 1/2 3/3 4/1\n"));
    let mesh = &desc.meshes[0];
    assert_eq!(mesh.positions.len(), 5, "the first corner has two texture coordinates");
    assert_eq!(mesh.uvs[0][0], Vec2::new(0.0, 0.75));
    assert_eq!(mesh.uvs[0][2], Vec2::new(0.5, 1.0));
}

#[test]
fn given_normals_win() {
    let desc = load_ok(&format!("{QUAD}vn 0 0 5\nvn 0 0 0\ns 1\nf 1//1 2//1 3//2\n"));
    assert_eq!(desc.meshes[0].normals, [Vec3::Z; 3], "unit length, and a zero normal is replaced");
}

/// Two faces of a roof with a right angle at the ridge.
const ROOF: &str = "v 0 0 0\nv 0 0 1\nv 1 1 0\nv 1 1 1\nv 2 0 0\nv 2 0 1\nvt 0 0\nvt 1 0\n";

#[test]
fn smoothing_groups() {
    let smooth = load_ok(&format!("{ROOF}s 1\nf 1 2 4 3\nf 3 4 6 5\n"));
    let mesh = &smooth.meshes[0];
    assert_eq!(mesh.positions.len(), 6);
    let ridge = mesh.positions.iter().position(|p| p.x == 1.0).expect("a ridge");
    assert!((mesh.normals[ridge] - Vec3::Y).length() < 1e-6, "{}", mesh.normals[ridge]);

    let other_group = load_ok(&format!("{ROOF}s 1\nf 1 2 4 3\ns 2\nf 3 4 6 5\n"));
    assert_eq!(other_group.meshes[0].positions.len(), 8, "the ridge is sharp between groups");

    let seam = load_ok(&format!("{ROOF}s 1\nf 1/1 2/1 4/1 3/1\nf 3/2 4/2 6/2 5/2\n"));
    let mesh = &seam.meshes[0];
    assert_eq!(mesh.positions.len(), 8, "split by texture coordinates");
    let ridge: Vec<Vec3> =
        mesh.positions.iter().zip(&mesh.normals).filter(|(p, _)| p.x == 1.0).map(|(_, n)| *n).collect();
    assert!(ridge.iter().all(|n| (*n - Vec3::Y).length() < 1e-6), "but smooth across the seam: {ridge:?}");
}

#[test]
fn flat_faces_beside_smooth_ones() {
    let desc = load_ok(&format!("{ROOF}s off\nf 1 2 4 3\ns 1\nf 3 4 6 5\n"));
    let mesh = &desc.meshes[0];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t as u32);
        let normal = (b - a).cross(c - a).normalize();
        assert!(triangle.iter().all(|&v| (mesh.normals[v as usize] - normal).length() < 1e-6));
    }
}

#[test]
fn objects_become_meshes_with_material_parts() {
    let desc = load_ok(&format!(
        "{QUAD}o Left part\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl a\nf 2 3 4\no Right\nf 1 2 4\n"
    ));
    let names: Vec<&str> = desc.meshes.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["Left part", "Right"]);
    assert_eq!(desc.instances.len(), 2);
    let left = &desc.meshes[0];
    let part = |first_triangle, material| Part { first_triangle, material };
    assert_eq!(left.parts, [part(0, 0), part(2, 1)], "triangles are sorted by material");
    assert_eq!(left.triangles[1], [1, 2, 3]);
    assert_eq!(desc.meshes[1].parts, [part(0, 0)]);
    assert_eq!(desc.meshes[1].positions.len(), 3, "only the vertices it uses");
}

#[test]
fn groups_become_meshes_only_when_they_are_large() {
    let face = "f 1 2 3\n".repeat(100);
    let large = load_ok(&format!("{QUAD}g a\n{face}g b\n{face}g a\n{face}"));
    let sizes: Vec<usize> = large.meshes.iter().map(|m| m.triangles.len()).collect();
    assert_eq!(sizes, [200, 100]);
    let small = load_ok(&format!("{QUAD}g a\nf 1 2 3\ng b\nf 1 2 3\n"));
    assert_eq!(small.meshes.len(), 1);
    assert_eq!(small.meshes[0].triangles.len(), 2);
}

#[test]
fn vertex_colors() {
    let desc = load_ok("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0.5 0.5 0.5 0.25\nf 1 2 3\n");
    let colors = &desc.meshes[0].colors;
    assert_eq!(colors[0].to_array(), [1.0, 0.0, 0.0, 1.0]);
    assert!((colors[2].x - 0.2140).abs() < 1e-3 && colors[2].w == 0.25);
    assert!(load_ok("v 0 0 0 2\nv 1 0 0 2\nv 0 1 0 2\nf 1 2 3\n").meshes[0].colors.is_empty());
}

#[test]
fn what_is_left_out_is_named_once() {
    let desc = load_ok(&format!(
        "{QUAD}p 1\nl 1 2\nl 2 3\nsurf x\nfoo 1\nfoo 2\nf 1\nf 1 2 3\nusemtl nowhere\nf 1 2 4\n"
    ));
    let found = warnings(&desc);
    let expected = ["points", "lines", "surfaces", "\"foo\"", "1 faces", "\"nowhere\" does not exist"];
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (warning, words) in found.iter().zip(expected) {
        assert!(warning.contains(words), "{warning}");
    }
}

#[test]
fn errors_say_what_and_where() {
    let fails = |obj: &str| load_with(obj, &[]).expect_err("malformed");
    let wrong_index = fails(&format!("{QUAD}f 1 2 9\n"));
    assert!(wrong_index.place.ends_with("test.obj:5"), "{wrong_index}");
    assert!(wrong_index.what.contains("\"9\" does not exist, there are 4"));
    assert!(fails(&format!("{QUAD}f 0 1 2\n")).what.contains("\"0\""));
    assert!(fails(&format!("{QUAD}f 1/1 2/1 3/1\n")).what.contains("texture coordinate"));
    assert!(fails("v 1 x 2\n").what.contains("\"x\" is not a number"));
    assert!(fails("v 1 2\n").what.contains("fewer than three"));
    assert_eq!(fails("\u{1}\u{2}\u{3} what is this\n").kind, ErrorKind::Malformed);
}

fn png(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
    let image = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(texel(x, y)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("encoded");
    bytes.into_inner()
}

fn with_material(mtl: &str, files: &[(&str, &[u8])]) -> SceneDesc {
    let obj = format!("mtllib my lib.mtl\n{QUAD}usemtl m\nf 1 2 3\n");
    let mut all = vec![("my lib.mtl", mtl.as_bytes())];
    all.extend_from_slice(files);
    load_with(&obj, &all).expect("well formed")
}

#[test]
fn plain_materials() {
    let desc = with_material("newmtl m\nKd 0.1 0.2 0.3\nKs 0.25 0.25 0.125\nNs 98\nKe 1 2 3\nillum 2\n", &[]);
    let m = &desc.materials[0];
    assert_eq!(m.base_color.factor, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!(m.specular.factor, 0.5);
    assert_eq!(m.specular_color.factor, Vec3::new(1.0, 1.0, 0.5));
    assert!((m.roughness.factor - 0.02_f32.sqrt().sqrt()).abs() < 1e-6);
    assert_eq!(m.emission.factor, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(m.alpha_mode, AlphaMode::Opaque);
}

#[test]
fn mirrors_and_pbr_statements() {
    let mirror = with_material("newmtl m\nKd 0 0 0\nKs 0.9 0.8 0.7\nillum 3\nNs 1000\n", &[]);
    assert_eq!(mirror.materials[0].metallic.factor, 1.0);
    assert_eq!(mirror.materials[0].base_color.factor, Vec3::new(0.9, 0.8, 0.7));
    let pbr = with_material(
        "newmtl m\nKd 1 0 0\nPr 0.3\nPm 0.7\nPc 0.5\nPcr 0.1\nPs 0.2\naniso 0.4\nanisor 0.5\n",
        &[],
    );
    let m = &pbr.materials[0];
    assert_eq!((m.roughness.factor, m.metallic.factor, m.specular.factor), (0.3, 0.7, 1.0));
    assert_eq!((m.clearcoat.factor, m.clearcoat_roughness.factor, m.anisotropy), (0.5, 0.1, 0.4));
    assert_eq!(m.sheen_color.factor, Vec3::splat(0.2));
}

#[test]
fn glass_and_alpha() {
    let glass =
        with_material("newmtl m\nKd 0.5 0.5 0.5\nKs 0.5 0.5 0.5\nNs 96\nd 0.25\nNi 1\nillum 2\n", &[]);
    let m = &glass.materials[0];
    assert_eq!((m.transmission.factor, m.thickness, m.ior), (1.0, 0.0, 1.5));
    assert_eq!(m.base_color.factor, Vec3::splat(0.875));
    assert_eq!(m.alpha_mode, AlphaMode::Opaque);

    let veil = with_material("newmtl m\nKd 0.5 0.5 0.5\nTr 0.75\n", &[]);
    assert_eq!(veil.materials[0].transmission.factor, 0.0);
    assert_eq!((veil.materials[0].alpha.factor, veil.materials[0].alpha_mode), (0.25, AlphaMode::Blend));

    let both = with_material("newmtl m\nTr 1\nd 1\n", &[]);
    assert_eq!(both.materials[0].alpha_mode, AlphaMode::Opaque, "d wins over Tr");
}

#[test]
fn closed_glass_refracts() {
    let obj =
        "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl m\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    let mtl = b"newmtl m\nNi 1.33\nd 0.1\nTf 1 0.9 0.8\nillum 7\n";
    let desc = load_with(obj, &[("t.mtl", mtl)]).expect("well formed");
    let m = &desc.materials[0];
    assert_eq!((m.transmission.factor, m.thickness, m.ior), (1.0, 1.0, 1.33));
    assert_eq!(m.base_color.factor, Vec3::new(1.0, 0.9, 0.8));
    let open = load_with(&obj.replace("f 1 4 3\n", ""), &[("t.mtl", mtl)]).expect("well formed");
    assert_eq!(open.materials[0].thickness, 0.0);
}

#[test]
fn textures_with_options() {
    let color = png(2, 1, |x, _| [255 * x as u8, 0, 0, 255]);
    let alpha = png(2, 2, |x, _| [255, 255, 255, 255 * x as u8]);
    let mtl = "newmtl m\nKd 0 0 0\nmap_Kd -s 2 3 -o 0.5 0.25 1 -clamp on My Color.PNG\nmap_d textures\\alpha.png\n\
               map_Pr my color.png\n";
    let desc = with_material(mtl, &[("my color.png", &color), ("alpha.png", &alpha)]);
    assert!(warnings(&desc).is_empty(), "{:?}", warnings(&desc));
    assert_eq!(desc.images.len(), 2, "an image is decoded once");
    let m = &desc.materials[0];
    assert_eq!(m.base_color.factor, Vec3::ONE);
    let texture = &desc.textures[m.base_color.texture.expect("textured") as usize];
    assert_eq!(texture.transform.scale, Vec2::new(2.0, 3.0));
    assert_eq!(texture.transform.offset, Vec2::new(0.5, 1.0 - 3.0 - 0.25));
    assert_eq!(m.alpha.texture.map(|t| t.1), Some(Channel::A));
    assert_eq!(m.alpha_mode, AlphaMode::Blend);
    assert_eq!(m.roughness.texture.map(|t| t.1), Some(Channel::R));
}

#[test]
fn bump_maps_of_heights_and_of_normals() {
    let heights = png(4, 4, |x, _| if x == 2 { [255; 4] } else { [0, 0, 0, 255] });
    let desc = with_material("newmtl m\nbump -bm 1 h.png\n", &[("h.png", &heights)]);
    let map = desc.materials[0].normal_map.expect("a normal map");
    let image = &desc.images[desc.textures[map.texture as usize].image as usize];
    let Texels::U8(texels) = &image.texels else { panic!("8 bits") };
    assert!(texels[3] < 64, "the slope up to the ridge leans back to the left: {texels:?}");
    assert!(texels[9] > 192, "and down to the right");
    let normals = png(4, 4, |_, _| [128, 128, 255, 255]);
    let desc = with_material("newmtl m\nmap_Bump -bm 0.5 n.png\n", &[("n.png", &normals)]);
    assert_eq!(desc.images.len(), 1);
    assert_eq!(desc.materials[0].normal_map.map(|n| n.scale), Some(0.5));
}

#[test]
fn images_are_made_once_and_within_the_limits() {
    let mtl = "newmtl a\nbump h.png\nnewmtl b\nbump h.png\nnewmtl c\nbump -bm 2 h.png\n";
    let obj = format!("mtllib t.mtl\n{QUAD}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl c\nf 1 2 4\n");
    let heights = png(4, 4, |x, _| if x == 2 { [255; 4] } else { [0, 0, 0, 255] });
    let files = [("t.mtl", mtl.as_bytes()), ("h.png", &heights[..])];
    let load = |all_images_bytes: u64| {
        let limits = crate::Limits { all_images_bytes, ..crate::Limits::default() };
        load_limited(&obj, &files, &LoadOptions { limits, ..LoadOptions::default() }).expect("well formed")
    };
    // The heights take 64 bytes, each normal map 48; two materials share one.
    for (limit, images) in [(1000, 3), (64 + 2 * 48, 3), (64 + 2 * 48 - 1, 2), (64, 1)] {
        let desc = load(limit);
        assert_eq!((desc.images.len(), desc.diagnostics.first_error()), (images, None), "{limit}");
    }
    let desc = load(63);
    let error = desc.diagnostics.first_error().expect("too large").to_string();
    assert!(desc.images.is_empty() && error.contains("64 bytes"), "{error}");
}

#[test]
fn missing_files_are_warnings() {
    let desc =
        load_with(&format!("mtllib nowhere.mtl\n{QUAD}usemtl m\nf 1 2 3\n"), &[]).expect("well formed");
    assert_eq!(warnings(&desc).len(), 2);
    assert!(warnings(&desc)[0].contains("nowhere.mtl"));
    let desc = with_material(
        "newmtl m\nmap_Kd none.png\nmap_Ke broken.png\nrefl x\n",
        &[("broken.png", b"no image")],
    );
    let found = warnings(&desc);
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(found[0].contains("\"refl\""));
    assert!(found[1].contains("broken.png") && found[2].contains("none.png"));
    assert!(desc.materials[0].base_color.texture.is_none());
}

/// Everything in one file, to be cut and broken.
const ALL: &str = "mtllib t.mtl\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0 0 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ng b\ns 1\nusemtl m\n\
                   f 1/1/1 2//1 3 \\\n4\ns off\nf -1 -2 -3\nl 1 2\n";

fn parse_bytes(bytes: &[u8]) {
    let limits = crate::Limits::default();
    let source = crate::scan::Source::new(bytes, "t".into(), &limits);
    if let Ok(parsed) = parse::parse(source, &limits, Triangulator::default(), &mut Diagnostics::default()) {
        closed::closed_materials(&parsed, &vec![true; parsed.materials.len()]);
        let meshes = split::into_meshes(parsed.mesh, &parsed.runs, &parsed.names, "t");
        assert!(!meshes.is_empty());
    }
}

#[test]
fn truncations_never_panic() {
    (0..=ALL.len()).for_each(|length| parse_bytes(&ALL.as_bytes()[..length]));
}

proptest! {
    #[test]
    fn garbage_never_panics(
        at in any::<proptest::sample::Index>(),
        garbage in proptest::collection::vec(any::<u8>(), 1..8),
    ) {
        let mut bytes = ALL.as_bytes().to_vec();
        let first = at.index(bytes.len());
        for (byte, &new) in bytes[first..].iter_mut().zip(&garbage) {
            *byte = new;
        }
        parse_bytes(&bytes);
    }

    #[test]
    fn garbage_libraries_never_panic(text in "(newmtl m\n)?((Kd|Ks|Ns|d|Tr|map_Kd|bump|illum|Tf)( -?[a-z0-9. -]{0,6}){0,4}\n){0,8}") {
        let limits = crate::Limits::default();
        let source = crate::scan::Source::new(text.as_bytes(), "t".into(), &limits);
        let _ = mtl::parse(source, &limits, &mut Diagnostics::default());
    }
}
