//! Scenes packed, opened and rendered in memory.
#![allow(dead_code, reason = "each test file uses a part")]

pub(crate) mod animated;
pub(crate) mod random;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use vastlight::film::Picture;
use vastlight::math::Vec3;
use vastlight::paging::MemorySource;
use vastlight::scene::{Mesh, Part, Scene};
use vastlight::store::{PackConfig, StoreSize};
use vastlight::transport::RenderSettings;
use vastlight::{
    CameraChoice, Control, Error, LoadOptions, OpenScene, RenderRequest, open_store, pack, render, stream,
};

/// Lamps, glass and normals; textures in tiles; one mesh in many pages.
pub(crate) const SCENES: [&str; 3] = ["demo:still-life", "demo:textured-hall", "demo:statue"];

/// How one of them is made, with so many bytes of texture where it has any.
pub(crate) fn options(scene: &str, texture_bytes: u64) -> LoadOptions {
    let mut options = LoadOptions::default();
    options.generate.triangles = (scene == "demo:statue").then_some(20_000);
    options.generate.texture_bytes = (scene == "demo:textured-hall").then_some(texture_bytes);
    options
}

/// A square in cells, whose points of two numbers from -1 to 1 stand where `place` says. Its front is where the second number grows
/// to the left of the first.
pub(crate) fn square(name: &str, material: u32, cells: u32, place: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let at = |i: u32| i as f32 / cells as f32 * 2.0 - 1.0;
    let row = |y: u32| (0..=cells).map(move |x| [x, y]);
    let corner = |x: u32, y: u32| y * (cells + 1) + x;
    let cell = |i: u32| {
        let (x, y) = (i % cells, i / cells);
        let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
        [[a, b, c], [a, c, d]]
    };
    Mesh {
        name: name.into(),
        positions: (0..=cells).flat_map(row).map(|[x, y]| place(at(x), at(y))).collect(),
        triangles: (0..cells * cells).flat_map(cell).collect(),
        parts: vec![Part { first_triangle: 0, material }],
        ..Mesh::default()
    }
}

/// Whether proofs may take their time.
pub(crate) fn is_soak() -> bool {
    std::env::var_os("VASTLIGHT_SOAK").is_some()
}

/// The bytes of a scene's store, and what they are.
pub(crate) fn packed(name: &str, options: &LoadOptions, config: &PackConfig) -> (Vec<u8>, StoreSize) {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("scene.vls");
    let size = pack(stream(name, options).expect("a demo"), &path, config, |_| {}).expect("packs");
    (std::fs::read(path).expect("reads"), size)
}

/// Opens the bytes of a store, which messages call "a store".
pub(crate) fn opened(bytes: Vec<u8>, options: &LoadOptions) -> Result<OpenScene, Error> {
    open_store(Arc::new(MemorySource::new("a store", bytes)), options)
}

/// Two samples for each pixel of a small picture from the first camera.
pub(crate) fn request(scene: &Scene) -> RenderRequest {
    let camera = CameraChoice::default().resolve(scene).expect("a camera");
    RenderRequest::new(RenderSettings::new(camera, 64, 36), 2)
}

/// The picture of a request.
pub(crate) fn picture(open: &OpenScene, request: &RenderRequest) -> Result<Picture, Error> {
    Ok(render(open, request, &Control::new(&AtomicBool::new(false), &|_| {}))?.develop())
}

/// How many values of two pictures of the same size differ.
pub(crate) fn differing(a: &Picture, b: &Picture) -> usize {
    let pixels = |p: &Picture| p.planes.iter().flat_map(|plane| plane.values.clone()).collect::<Vec<f32>>();
    let (a, b) = (pixels(a), pixels(b));
    assert_eq!(a.len(), b.len());
    a.iter().zip(&b).filter(|(a, b)| a.to_bits() != b.to_bits()).count()
}
