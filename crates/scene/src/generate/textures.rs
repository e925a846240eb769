//! Small textures made in memory: stone, wood, tiles, weave. All repeat without a seam.

use super::chance::Chance;
use super::noise::{fbm, noise, smoothstep};
use crate::{Image, Texels};
use rayon::prelude::*;
use vastlight_math::{Vec2, Vec3, real::pow, real::sin_cos};

/// An sRGB image from a function of the unit square to linear colours.
pub(super) fn paint(name: &str, size: u32, color: impl Fn(Vec2) -> Vec3 + Copy + Sync + Send) -> Image {
    let row = |y: u32| {
        (0..size).flat_map(move |x| {
            let uv = (Vec2::new(x as f32, y as f32) + 0.5) / size as f32;
            color(uv).to_array().map(encode)
        })
    };
    let texels = (0..size).into_par_iter().flat_map_iter(row).collect();
    Image { name: name.into(), width: size, height: size, channels: 3, texels: Texels::U8(texels) }
}

/// Linear to an sRGB byte.
fn encode(x: f32) -> u8 {
    let x = x.clamp(0.0, 1.0);
    let y = if x <= 0.003_130_8 { x * 12.92 } else { 1.055 * pow(x, 1.0 / 2.4) - 0.055 };
    (y * 255.0 + 0.5) as u8
}

/// Noise over the unit square that repeats: a torus in space, `scale` features around.
fn tiled(uv: Vec2, scale: f32, octaves: u32, seed: u32) -> f32 {
    let (su, cu) = sin_cos(uv.x * std::f32::consts::TAU);
    let (sv, cv) = sin_cos(uv.y * std::f32::consts::TAU);
    let ring = 1.0 + 0.45 * cv;
    fbm(Vec3::new(ring * cu, ring * su, 0.45 * sv) * scale, octaves, 0.55, seed)
}

/// Veined marble.
pub(super) fn marble(name: &str, base: Vec3, vein: Vec3, seed: u32) -> Image {
    paint(name, 512, |uv| {
        let warp = tiled(uv, 1.3, 5, seed);
        let line = tiled(uv + Vec2::splat(0.22 * warp), 1.7, 5, seed + 40);
        let fine = tiled(uv + Vec2::splat(0.1 * warp), 4.0, 4, seed + 80);
        let veins = smoothstep(0.09, 0.0, line.abs()) * 0.75 + smoothstep(0.04, 0.0, fine.abs()) * 0.3;
        let cloud = 1.0 + 0.22 * warp;
        base.lerp(vein, veins.min(1.0) * smoothstep(-0.4, 0.3, warp)) * cloud
    })
}

/// Boards of wood along u, `boards` across v.
pub(super) fn planks(name: &str, light: Vec3, dark: Vec3, boards: u32, seed: u32) -> Image {
    paint(name, 512, |uv| {
        let across = uv.y * boards as f32;
        let board = across as u32;
        let mut chance = Chance::new(u64::from(seed), u64::from(board));
        let (tone, shift) = (chance.range(0.8, 1.1), chance.range(0.0, 50.0));
        let (s, c) = sin_cos(uv.x * std::f32::consts::TAU);
        let within = across - board as f32;
        let grain = noise(Vec3::new(c * 1.2, s * 1.2, within * 14.0 + shift), seed)
            + 0.5 * noise(Vec3::new(c * 4.0, s * 4.0, within * 60.0 + shift), seed + 1);
        let rings = 0.5 + 0.5 * sin_cos(within * 26.0 + 5.0 * grain + shift).0;
        let joint = smoothstep(0.0, 0.02, within.min(1.0 - within));
        light.lerp(dark, (0.55 * rings + 0.3 * grain.abs()).clamp(0.0, 1.0)) * (tone * (0.35 + 0.65 * joint))
    })
}

/// Stone slabs in a running bond of `columns` x `rows` with narrow joints.
pub(super) fn slabs(
    name: &str,
    size: u32,
    base: Vec3,
    joint: Vec3,
    columns: u32,
    rows: u32,
    seed: u32,
) -> Image {
    paint(name, size, |uv| {
        let row = (uv.y * rows as f32) as u32;
        let shifted = uv.x * columns as f32 + 0.5 * (row % 2) as f32;
        let column = shifted as u32 % columns;
        let mut chance = Chance::new(u64::from(seed), u64::from(row * 64 + column));
        let tone = chance.range(0.88, 1.08);
        let warm = Vec3::new(1.0, chance.range(0.96, 1.0), chance.range(0.9, 1.0));
        let (x, y) = (shifted.fract(), (uv.y * rows as f32).fract());
        let edge = (x.min(1.0 - x) / columns as f32).min(y.min(1.0 - y) / rows as f32);
        let grain = 1.0 + 0.13 * tiled(uv, 3.0, 4, seed) + 0.1 * tiled(uv, 17.0, 3, seed + 9);
        joint.lerp(base * warm * (tone * grain), smoothstep(0.0008, 0.0022, edge))
    })
}

/// Cloth of crossing threads.
pub(super) fn weave(name: &str, warp: Vec3, weft: Vec3, threads: u32, seed: u32) -> Image {
    paint(name, 256, |uv| {
        let (x, y) = (uv.x * threads as f32, uv.y * threads as f32);
        let over = (x as u32 + y as u32).is_multiple_of(2);
        let (across, along) = if over { (x.fract(), y) } else { (y.fract(), x) };
        let round = 1.0 - (2.0 * across - 1.0) * (2.0 * across - 1.0) * 0.6;
        let slub = 1.0 + 0.15 * noise(Vec3::new(along.floor() * 7.3, across, 0.5), seed);
        (if over { warp } else { weft }) * (round * slub)
    })
}

/// One colour, clouded by `strength`.
pub(super) fn mottled(uv: Vec2, color: Vec3, strength: f32, seed: u32) -> Vec3 {
    color * (1.0 + strength * (tiled(uv, 1.5, 6, seed) + 0.5 * tiled(uv, 7.0, 3, seed + 3))).max(0.0)
}
