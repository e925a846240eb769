//! Files under the names that the documents use.

use super::animated;
use std::path::Path;

/// Scenes: a floor, moving sheets, a lamp and a camera, in [`animated`].
const SCENES: [&str; 4] = ["house.glb", "ring.glb", "walk.glb", "scenes/house.glb"];

/// What `vastlight` itself makes, in this order.
pub(crate) const MADE: [&str; 6] = [
    "generate statue --triangles 20000 -o mesh.ply",
    "render demo:cornell -r 32x16 --spp 1 -o studio.exr",
    "render demo:cornell -r 32x16 --spp 2 -o a.exr",
    "render demo:cornell -r 32x16 --spp 3 -o b.exr",
    "render house.glb -r 32x24 --spp 2 --passes 2-2 -o b.vlc",
    "pack demo:plant --triangles 400000 -o plant.vls",
];

const OBJ: &str = "mtllib engine.mtl
v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1.5 0
o block\nusemtl steel
f 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5
";
const MTL: &str = "newmtl steel\nKd 0.6 0.6 0.65\nKs 0.5 0.5 0.5\nNs 80\n";

/// Writes what no command makes.
pub(crate) fn write(folder: &Path) {
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("written");
    std::fs::create_dir(folder.join("scenes")).expect("a folder");
    let scene = animated::write(folder);
    for name in SCENES {
        std::fs::copy(&scene, folder.join(name)).expect("copied");
    }
    put("engine.obj", OBJ.as_bytes());
    put("engine.mtl", MTL.as_bytes());
    put("studio.hdr", &even_map());
    put("primary.rays", &rays());
    for (number, height) in [(1, 0.5), (2, 0.8), (3, 0.6)] {
        put(&format!("cloth.{number:04}.ply"), triangle(height).as_bytes());
    }
}

/// An environment map of one colour in Radiance's format.
fn even_map() -> Vec<u8> {
    const WIDTH: usize = 4;
    const HEIGHT: usize = 2;
    let head = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n");
    let grey = [128, 128, 128, 129];
    [head.into_bytes(), grey.repeat(WIDTH * HEIGHT)].concat()
}

/// Rays down onto a square: origin, least distance, direction, largest distance.
fn rays() -> Vec<u8> {
    let down =
        |i: u16| [f32::from(i % 16) / 16.0, 9.0, f32::from(i / 16) / 16.0, 0.0, 0.0, -1.0, 0.0, f32::MAX];
    (0..256).flat_map(down).flat_map(f32::to_le_bytes).collect()
}

/// A file of a sequence.
fn triangle(height: f32) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 {height} 1\n3 0 1 2\n"
    )
}
