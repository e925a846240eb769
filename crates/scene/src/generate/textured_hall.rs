//! A hall whose walls, floor and vault are mosaics, each with a texture of its own: as many bytes of texture as are asked for. Texels
//! come row by row and are a function of their place, so that they need not fit into memory.

use super::chance::Chance;
use super::noise::{PRIMES, mixed};
use super::shape::Shape;
use super::solids::sphere;
use super::{GenerateOptions, Sizes, builder::Builder};
use crate::{
    Camera, Encoding, Environment, Image, ImageRows, Material, NextRow, SceneError, SceneStream, Texels, Wrap,
};
use vastlight_math::{Vec2, Vec3};

/// Panels along the hall, and on each of its four sides.
const ALONG: u32 = 12;
const SIDES: u32 = 4;
/// Edge of a panel in metres.
const PANEL: f32 = 5.0;
/// Bytes of texture unless another number is asked for.
const BYTES: u64 = 48 << 20;
/// Edge of a mosaic's stone in texels.
const STONE: u32 = 48;
/// Largest edge of an image.
const LARGEST: u32 = 60_000;
/// What can be asked for.
pub(super) const TEXTURE_BYTES: Sizes =
    Sizes { least: 1, most: 3 * (ALONG * SIDES) as u64 * LARGEST as u64 * LARGEST as u64 };

/// The scene.
pub(super) fn textured_hall(options: &GenerateOptions) -> SceneStream {
    let mut b = Builder::default();
    let texels = options.texture_bytes.unwrap_or(BYTES) as f64 / f64::from(3 * ALONG * SIDES);
    let edge = texels.sqrt().ceil() as u32;
    let rows =
        (0..ALONG * SIDES).map(|panel| mosaic_panel(&mut b, panel, edge, options.seed as u32)).collect();
    let half = PANEL * 0.5;
    let far = -PANEL * ALONG as f32;
    let plain = b.material(Material::diffuse("plaster", Vec3::splat(0.6)));
    let wall = |z: f32, x: f32| {
        let at = |x: f32, y: f32| Vec3::new(x, y, z);
        quad([at(-x, 0.0), at(x, 0.0), at(x, PANEL), at(-x, PANEL)])
    };
    b.object("far wall", plain, &wall(far, half));
    b.object("near wall", plain, &wall(0.0, -half));
    let lamp = b.material(Material::emitter("lamp", Vec3::new(14.0, 12.5, 10.0), true));
    for i in 0..ALONG / 2 {
        let at = |x: f32, z: f32| Vec3::new(x, PANEL - 0.3, -PANEL * (2 * i) as f32 - half + z);
        b.object("lamp", lamp, &quad([at(-0.3, -0.6), at(0.3, -0.6), at(0.3, 0.6), at(-0.3, 0.6)]));
    }
    let steel = b.material(Material::metal("steel", Vec3::new(0.78, 0.77, 0.75), 0.15));
    for i in 0..3 {
        let mut chance = Chance::new(options.seed, i);
        let (x, z) = (chance.range(-1.5, 1.5), chance.range(-8.0, -6.0) - 9.0 * i as f32);
        b.object("ball", steel, &sphere(0.7, 48).at(x, 0.7, z));
    }
    b.desc.environment = Some(Environment::Constant(Vec3::ZERO));
    let eye = Vec3::new(0.4, 1.7, -0.4);
    b.desc.cameras.push(Camera::look_at("entrance", eye, Vec3::new(0.0, 2.1, far), 68_f32.to_radians()));
    SceneStream { rows, ..b.desc.into() }
}

/// Adds a panel with an image without texels; gives their rows.
fn mosaic_panel(b: &mut Builder, panel: u32, edge: u32, seed: u32) -> ImageRows {
    let name = format!("mosaic {panel}");
    let image =
        Image { name: name.clone(), width: edge, height: edge, channels: 3, texels: Texels::U8(Vec::new()) };
    let texture = b.texture(image, Encoding::Srgb, Vec2::ONE);
    b.desc.textures[texture as usize].wrap = [Wrap::Clamp; 2];
    let mut material = Material::new(name);
    material.base_color.factor = Vec3::ONE;
    material.base_color.texture = Some(texture);
    material.roughness.factor = 0.35;
    let material = b.material(material);
    let number = b.desc.textures[texture as usize].image;
    let (half, near) = (PANEL * 0.5, -PANEL * (panel / SIDES) as f32);
    let far = near - PANEL;
    let corners = match panel % SIDES {
        0 => [[-half, 0.0, near], [half, 0.0, near], [half, 0.0, far], [-half, 0.0, far]],
        1 => [[-half, 0.0, near], [-half, 0.0, far], [-half, PANEL, far], [-half, PANEL, near]],
        2 => [[half, 0.0, far], [half, 0.0, near], [half, PANEL, near], [half, PANEL, far]],
        _ => [[-half, PANEL, far], [half, PANEL, far], [half, PANEL, near], [-half, PANEL, near]],
    };
    b.object("panel", material, &quad(corners.map(Vec3::from)));
    let open = move || -> Result<NextRow, SceneError> {
        let mut y = 0;
        Ok(Box::new(move |out: &mut Texels| {
            if let Texels::U8(out) = out {
                mosaic_row(panel.wrapping_add(seed.wrapping_mul(1009)), edge, y, out);
            }
            y += 1;
            Ok(())
        }))
    };
    ImageRows { image: number, working_bytes: 0, open: Box::new(open) }
}

/// Corners run counter-clockwise as seen from the front; the texture covers the whole.
fn quad(corners: [Vec3; 4]) -> Shape {
    let [a, b, c, _] = corners;
    let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
    let uvs = [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO];
    let mut shape = Shape::default();
    let [a, b, c, d] = std::array::from_fn(|i| shape.vertex(corners[i], normal, uvs[i]));
    shape.quad(a, b, c, d);
    shape
}

/// A row of stones of many colours, each with its grain, and joints between them.
fn mosaic_row(panel: u32, edge: u32, y: u32, out: &mut Vec<u8>) {
    let hash = |x: u32, y: u32, which: u32| {
        let [px, py, pz, pw] = PRIMES;
        mixed(x.wrapping_mul(px) ^ y.wrapping_mul(py) ^ which.wrapping_mul(pz) ^ panel.wrapping_mul(pw))
    };
    let tone = hash(0, 0, 7).to_le_bytes().map(|byte| 90 + u32::from(byte) / 3);
    for x in 0..edge {
        let joint = x % STONE < 3 || y % STONE < 3;
        let grain = hash(x, y, 1) & 15;
        if joint {
            out.extend([40 + grain as u8; 3]);
            continue;
        }
        // A picture of larger fields, so that something is to be seen from afar.
        let field = hash(x / (11 * STONE), y / (11 * STONE), 2).to_le_bytes();
        let stone = hash(x / STONE, y / STONE, 3).to_le_bytes();
        out.extend([0, 1, 2].map(|c| {
            let mean = (tone[c] + u32::from(field[c])) / 2;
            (mean * 3 / 4 + u32::from(stone[c]) / 5 + grain).min(255) as u8
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_come_row_by_row_and_are_as_many_as_were_asked_for() {
        let options = GenerateOptions { texture_bytes: Some(3 << 20), ..GenerateOptions::default() };
        let stream = textured_hall(&options);
        assert!(stream.desc.images.iter().all(|image| image.texels.is_empty()));
        let desc = stream.collect().expect("whole");
        let bytes: usize = desc.images.iter().map(|image| image.texels.len()).sum();
        assert!((3 << 20..4 << 20).contains(&bytes), "{bytes}");
        let whole = |i: &Image| i.texels.len() == 3 * i.width as usize * i.height as usize;
        assert!(desc.images.iter().all(whole));
        let images = &desc.images;
        assert!((1..images.len()).all(|i| images[i].texels != images[i - 1].texels), "no two are equal");
    }
}
