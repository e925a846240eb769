//! A pool of clear water under a small lamp: caustics that run over a tiled floor. A function of time.
//!
//! Waves are those of deep water: small sines, each with the speed that its length has.

use super::caustic_sphere::square_lamp;
use super::chance::Chance;
use super::shape::{Assembly, Shape};
use super::{GenerateOptions, builder::Builder, palette::srgb, solids, textures};
use crate::{Camera, ColorInput, Encoding, Environment, Material, ScalarInput, SceneDesc};
use std::f32::consts::TAU;
use vastlight_math::{Vec2, Vec3, real};

/// Half the pool's width and length, and its depth below the still water.
const HALF: Vec2 = Vec2::new(2.5, 3.5);
const DEPTH: f32 = 1.2;
/// From the water to the rim.
const RIM: f32 = 0.18;
/// The water reaches so far into walls and floor, whose sides it does not touch.
const OVERLAP: f32 = 0.05;
/// Cells of the water's surface along each axis.
const CELLS: u32 = 320;
const WAVES: u32 = 14;
const GRAVITY: f32 = 9.81;

/// A pool of 5 x 7 x 1.2 metres with a lamp of 0.4 x 0.4 eight metres above.
pub(super) fn water(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    pool(&mut b, options.seed as u32);
    let water = b.material(Material {
        attenuation_color: Vec3::new(0.62, 0.9, 0.95),
        attenuation_distance: 4.0,
        ..Material::glass("water", 1.33, 0.0)
    });
    b.object("water", water, &volume(&waves(options.seed), options.time));
    let lamp = b.material(Material::emitter("lamp", Vec3::new(2200.0, 2080.0, 1880.0), false));
    b.object("lamp", lamp, &square_lamp(Vec3::new(2.0, 8.0, -3.0), Vec3::new(0.0, -DEPTH, 0.0), 0.4));
    b.desc.environment = Some(Environment::Constant(Vec3::new(0.16, 0.21, 0.28)));
    b.desc.cameras.push(Camera::look_at(
        "rim",
        Vec3::new(-0.7, 2.7, 4.9),
        Vec3::new(0.1, -0.9, 0.2),
        42_f32.to_radians(),
    ));
    b.desc
}

/// Tiled floor and walls, and the rim around.
fn pool(b: &mut Builder, seed: u32) {
    let tiles = textures::slabs("tiles", 1024, srgb(0xcfe4e6), srgb(0x5f8f9c), 8, 8, seed);
    let tiles = b.texture(tiles, Encoding::Srgb, Vec2::splat(2.0));
    let tiled = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(tiles) },
        ..Material::diffuse("tiles", Vec3::ONE)
    });
    let stone =
        b.material(Material { roughness: ScalarInput::new(0.6), ..Material::diffuse("rim", srgb(0xc9bda6)) });
    let (x, z, low, high) = (HALF.x, HALF.y, -DEPTH, RIM);
    let (edge, thick) = (0.7, 0.4);
    let mut inside = Assembly::default();
    let mut rim = Assembly::default();
    inside.add(tiled, &solids::floor(2.0 * x, 2.0 * z).at(0.0, low, 0.0));
    let corners = [[-x, -z], [-x, z], [x, z], [x, -z]];
    for i in 0..4 {
        let ([ax, az], [bx, bz]) = (corners[i], corners[(i + 1) % 4]);
        let point = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let mut wall = Shape::default();
        wall.flat_quad([point(bx, low, bz), point(ax, low, az), point(ax, high, az), point(bx, high, bz)]);
        inside.add(tiled, &wall);
    }
    for (low_x, high_x, low_z, high_z) in [
        (-x - edge, x + edge, -z - edge, -z),
        (-x - edge, x + edge, z, z + edge),
        (-x - edge, -x, -z, z),
        (x, x + edge, -z, z),
    ] {
        let (low, high) = (Vec3::new(low_x, high - thick, low_z), Vec3::new(high_x, high, high_z));
        rim.add(stone, &solids::block(low, high, 0.03));
    }
    b.assembled("pool", inside);
    b.assembled("rim", rim);
}

/// A sine that runs over the water.
#[derive(Clone, Copy, Debug)]
struct Wave {
    /// Radians a metre, along both axes.
    number: Vec2,
    /// Metres.
    height: f32,
    phase: f32,
}

/// The waves of a seed: short ones are low, all go about the same way.
fn waves(seed: u64) -> Vec<Wave> {
    let mut chance = Chance::new(seed, 0x7761_7465);
    let wave = |i: u32| {
        let length = 1.9 * real::pow(0.83, i as f32) * chance.range(0.9, 1.1);
        let (sin, cos) = real::sin_cos(chance.range(-1.5, 1.5) + if i.is_multiple_of(3) { 2.1 } else { 0.4 });
        Wave {
            number: Vec2::new(cos, sin) * (TAU / length),
            height: 0.0078 * real::pow(length, 1.15),
            phase: chance.range(0.0, TAU),
        }
    };
    (0..WAVES).map(wave).collect()
}

/// Height and slopes of the water at a place and a moment.
fn surface(waves: &[Wave], p: Vec2, time: f32) -> (f32, Vec2) {
    waves.iter().fold((0.0, Vec2::ZERO), |(height, slope), wave| {
        let speed = (GRAVITY * wave.number.length()).sqrt();
        let turns = (wave.number.dot(p) + wave.phase) / TAU - (speed * time / TAU).fract();
        let (sin, cos) = real::sin_cos(TAU * turns);
        (height + wave.height * sin, slope + wave.number * (wave.height * cos))
    })
}

/// The water as a closed volume.
fn volume(waves: &[Wave], time: f32) -> Shape {
    let reach = HALF + OVERLAP;
    let place = |u: f32, v: f32| Vec2::new(2.0 * u - 1.0, 2.0 * v - 1.0) * reach;
    let mut shape = solids::grid(CELLS, CELLS, |u, v| {
        let p = place(u, v);
        let (height, slope) = surface(waves, p, time);
        (Vec3::new(p.x, height, p.y), Vec3::new(-slope.x, 1.0, -slope.y).normalize())
    });
    let top = shape.positions.clone();
    let bottom = |p: Vec3| p.with_y(-DEPTH - OVERLAP);
    let at = |column: u32, row: u32| top[(row * (CELLS + 1) + column) as usize];
    // The same corners as the surface's, to the bit, so that the volume is closed.
    let cell = |x: f32| (x * CELLS as f32).round() as u32;
    shape.merge(&solids::grid(CELLS, CELLS, |u, v| (bottom(at(cell(u), CELLS - cell(v))), Vec3::NEG_Y)));
    for i in 0..CELLS {
        let sides = [
            [at(i, CELLS), at(i + 1, CELLS)],
            [at(i + 1, 0), at(i, 0)],
            [at(0, i), at(0, i + 1)],
            [at(CELLS, i + 1), at(CELLS, i)],
        ];
        for [a, b] in sides {
            shape.flat_quad([bottom(a), bottom(b), b, a]);
        }
    }
    shape
}
