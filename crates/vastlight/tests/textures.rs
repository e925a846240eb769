//! Textures in tiles: the picture of a store is that of the scene in memory, whatever part of the tiles fits into memory.

mod common;

use common::{differing, opened, request};
use vastlight::film::Picture;
use vastlight::store::PackConfig;
use vastlight::{Error, LoadOptions, OpenScene, Overrides, PackInput, describe, load, pack, pack_input};

const HALL: &str = "demo:textured-hall";

fn options() -> LoadOptions {
    let mut options = LoadOptions::default();
    options.generate.texture_bytes = Some(4 << 20);
    options
}

fn packed(tile_bytes: usize) -> Vec<u8> {
    let config = PackConfig { tile_bytes, ..PackConfig::default() };
    let (bytes, size) = common::packed(HALL, &options(), &config);
    assert!(size.tiles > 5 << 20, "with its pyramids");
    assert!(size.resident < 1 << 20, "{}", size.resident);
    bytes
}

fn picture(open: &OpenScene, fraction: Option<f32>, tile_memory: Option<u64>) -> Result<Picture, Error> {
    let mut request = request(&open.scene);
    request.paging.cache_fraction = fraction;
    request.paging.tile_memory = tile_memory;
    common::picture(open, &request)
}

#[test]
fn pictures_do_not_depend_on_the_tiles_in_memory() {
    let expected = picture(&load(HALL, &options()).expect("a demo").into(), None, None).expect("renders");
    for tile_bytes in [256, 4096, 16_000] {
        let stored = opened(packed(tile_bytes), &options()).expect("opens");
        assert!(stored.scene.images().iter().all(|image| image.texels.is_empty()));
        for (fraction, memory) in [(1.0, None), (0.2, None), (0.0, None), (1.0, Some(0))] {
            let found = picture(&stored, Some(fraction), memory).expect("renders");
            let differing = differing(&found, &expected);
            assert_eq!(differing, 0, "tiles of {tile_bytes} bytes, {fraction} in memory, {memory:?}");
        }
    }
}

/// The check above would find another texture.
#[test]
fn another_texture_is_another_picture() {
    let mut other = options();
    other.generate.seed = 1;
    let pictures = [options(), other]
        .map(|options| picture(&load(HALL, &options).expect("a demo").into(), None, None).expect("renders"));
    assert!(differing(&pictures[0], &pictures[1]) > 1000);
}

#[test]
fn a_damaged_tile_ends_the_render_with_its_number() {
    let mut bytes = packed(4096);
    // All tiles of the first images, but not the directories behind them.
    bytes[5000..4 << 20].iter_mut().step_by(512).for_each(|byte| *byte ^= 1);
    let stored = opened(bytes, &options()).expect("what is resident is sound");
    let error = picture(&stored, Some(0.5), None).expect_err("damaged").to_string();
    assert!(error.contains("page") && error.contains("a store") && error.contains("crc32"), "{error}");
}

/// An override that makes hits depend on a texture in tiles is refused when the store is opened.
#[test]
fn overrides_that_tiles_do_not_serve_are_refused() {
    let overrides = "[materials.\"mosaic 3\"]\ntransmission = 1.0\nroughness = 0.0";
    let overrides = Overrides::parse(overrides, "a test").expect("reads");
    let options = LoadOptions { overrides: vec![overrides], ..options() };
    let error = opened(packed(4096), &options).expect_err("a pane with a texture").to_string();
    assert!(error.contains("mosaic 3"), "{error}");
}

/// An OBJ and a glTF file that name images of several formats and uses, large enough to come row by row.
fn scene_with_images(folder: &std::path::Path) -> [std::path::PathBuf; 2] {
    let noise = |x: u32, y: u32| ((x / 3 * 7919 + y / 5 * 104_729).wrapping_mul(2_654_435_761) >> 24) as u8;
    let rgb = image::RgbImage::from_fn(700, 620, |x, y| image::Rgb([noise(x, y), x as u8, y as u8]));
    let encoder = jpeg_encoder::Encoder::new_file(folder.join("shine.jpg"), 85).expect("a file");
    encoder.encode(&rgb, 700, 620, jpeg_encoder::ColorType::Rgb).expect("written");
    let rgb = image::DynamicImage::from(rgb);
    let names = ["colour.png", "glow.png", "bump.png", "cut.png"];
    names.iter().for_each(|name| rgb.save(folder.join(name)).expect("written"));
    let deep = rgb.to_rgb16();
    deep.save(folder.join("deep.png")).expect("written");
    let mtl = "newmtl a\nmap_Kd colour.png\nmap_Pr shine.jpg\nmap_bump bump.png\nnewmtl b\nmap_Kd deep.png\nmap_Ke glow.png\n\
        newmtl c\nmap_Kd colour.png\nmap_d cut.png\n";
    std::fs::write(folder.join("m.mtl"), mtl).expect("written");
    let quad = |material: &str, z: i32| {
        let corners = format!("v -1 -1 {z}\nv 1 -1 {z}\nv 1 1 {z}\nv -1 1 {z}\n");
        format!("usemtl {material}\n{corners}f -4/1 -3/2 -2/3 -1/4\n")
    };
    let uvs = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    let obj = format!("mtllib m.mtl\n{uvs}{}{}{}", quad("a", 0), quad("b", -1), quad("c", -2));
    std::fs::write(folder.join("scene.obj"), obj).expect("written");
    let floats: [f32; 20] =
        [-1., -1., 0., 1., -1., 0., 1., 1., 0., -1., 1., 0., 0., 0., 1., 0., 1., 1., 0., 1.];
    let mut bin: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    bin.extend([0_u8, 1, 2, 0, 2, 3, 0, 0]);
    let embedded = std::fs::read(folder.join("deep.png")).expect("read");
    let (first, length) = (bin.len(), embedded.len());
    bin.extend(embedded);
    std::fs::write(folder.join("scene.bin"), &bin).expect("written");
    let gltf = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
        "buffers": [{{"uri": "scene.bin", "byteLength": {}}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 32}},
            {{"buffer": 0, "byteOffset": 80, "byteLength": 6}}, {{"buffer": 0, "byteOffset": {first}, "byteLength": {length}}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]}},
            {{"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"}},
            {{"bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR"}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1}}, "indices": 2, "material": 0}}]}}],
        "images": [{{"uri": "colour.png"}}, {{"bufferView": 3, "mimeType": "image/png"}}],
        "textures": [{{"source": 0}}, {{"source": 1}}],
        "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}}}}, "normalTexture": {{"index": 1}}}}]}}"#,
        bin.len()
    );
    std::fs::write(folder.join("scene.gltf"), gltf).expect("written");
    [folder.join("scene.obj"), folder.join("scene.gltf")]
}

#[test]
fn images_of_files_come_row_by_row_and_give_the_same_store() {
    let folder = tempfile::tempdir().expect("a folder");
    for (path, deferred) in scene_with_images(folder.path()).iter().zip([4, 2]) {
        let name = path.display().to_string();
        let bytes = |input: PackInput| {
            let target = folder.path().join("scene.vls");
            pack(input, &target, &PackConfig::default(), |_| {}).expect("packs");
            std::fs::read(target).expect("reads")
        };
        let options = LoadOptions::default();
        let rows = pack_input(std::slice::from_ref(&name), &options, None).expect("reads");
        assert_eq!(rows.stream.rows.len(), deferred, "{name}");
        let whole = |seen: Vec<_>| {
            let input = PackInput::from(describe(&name, &options).expect("reads"));
            PackInput { sources: seen, ..input }
        };
        let sources = rows.sources.clone();
        let (rows, whole) = (bytes(rows), bytes(whole(sources)));
        assert!(rows == whole, "{name}");
        // What is seen is what is in memory.
        let stored = opened(rows, &options).expect("opens");
        assert!(stored.stored.as_ref().is_some_and(|stored| stored.tiles.pages() > 100));
        let in_memory = load(&name, &options).expect("loads").into();
        let expected = picture(&in_memory, None, None).expect("renders");
        assert_eq!(differing(&picture(&stored, Some(0.2), None).expect("renders"), &expected), 0);
    }
}

#[test]
fn a_broken_image_is_an_error_before_a_store_is_begun() {
    let folder = tempfile::tempdir().expect("a folder");
    let [_, gltf] = scene_with_images(folder.path());
    let image = folder.path().join("colour.png");
    let whole = std::fs::read(&image).expect("reads");
    std::fs::write(&image, &whole[..whole.len() / 2]).expect("writes");
    let name = gltf.display().to_string();
    let refused = load(&name, &LoadOptions::default()).expect_err("broken");
    let input = pack_input(&[name], &LoadOptions::default(), None).expect("is noted in the scene");
    let target = folder.path().join("scene.vls");
    let error = pack(input, &target, &PackConfig::default(), |_| {}).expect_err("broken");
    assert_eq!((error.class, error.to_string()), (refused.class, refused.to_string()));
    let left = std::fs::read_dir(folder.path()).expect("lists").map(|e| e.expect("an entry").path());
    assert_eq!(left.filter(|path| path.to_string_lossy().contains(".vls")).count(), 0);
}
