//! Textures in tiles: the picture of a store is that of the scene in memory, whatever part of the tiles fits into memory.

mod common;

use common::{differing, opened, request};
use vastlight::film::Picture;
use vastlight::store::PackConfig;
use vastlight::{Error, LoadOptions, OpenScene, Overrides, load};

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
    let options = LoadOptions { overrides: Some(overrides), ..options() };
    let error = opened(packed(4096), &options).expect_err("a pane with a texture").to_string();
    assert!(error.contains("mosaic 3"), "{error}");
}
