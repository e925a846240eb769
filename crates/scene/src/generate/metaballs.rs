//! Metaballs of glass and of gold that melt into each other and part again in a box under a small lamp: what
//! refracts, what reflects, and the caustics of both. A function of time.

use super::caustic_sphere::square_lamp;
use super::chance::Chance;
use super::{GenerateOptions, builder::Builder, palette::srgb, shape::Shape, textures};
use crate::{
    Camera, ColorInput, Conductor, Encoding, Environment, ImplicitShape, Material, Metaball, Metaballs,
    ScalarInput, SceneDesc,
};
use std::f32::consts::TAU;
use vastlight_math::{Vec2, Vec3, real::sin};

/// Half the box's width and depth, and its height.
const HALF: f32 = 5.0;
const HEIGHT: f32 = 6.0;

/// A box of 10 x 10 x 6 without front and lid, balls of the seed in it, a lamp of 0.4 x 0.4 at (-2.6, 5.7, 1.6).
pub(super) fn metaballs(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    stage(&mut b, options.seed as u32);
    let glass = b.material(Material {
        attenuation_color: Vec3::new(0.72, 0.93, 0.98),
        attenuation_distance: 3.0,
        ..Material::glass("glass", 1.5, 0.0)
    });
    let gold = b.material(Material {
        conductor: Conductor::named("gold"),
        ..Material::metal("gold", Vec3::ONE, 0.12)
    });
    let chance = Chance::new(options.seed, 0x6d65_7461);
    let cloud = |part, count, middle, spread, size| {
        let balls = balls(chance.part(part), count, (middle, spread), size, options.time);
        ImplicitShape::Metaballs(Metaballs { balls, threshold: 0.2 })
    };
    let (left, right) = (Vec3::new(-0.8, 2.3, 0.2), Vec3::new(2.5, 1.5, -0.9));
    b.implicit("glass", glass, cloud(1, 8, left, Vec3::new(2.3, 1.4, 1.5), 1.65));
    b.implicit("gold", gold, cloud(2, 6, right, Vec3::new(1.2, 0.9, 1.1), 1.2));
    b.desc.cameras.push(Camera::look_at(
        "front",
        Vec3::new(0.9, 3.7, 10.6),
        Vec3::new(0.15, 1.75, -0.4),
        36_f32.to_radians(),
    ));
    b.desc
}

/// Floor, walls and lamp.
fn stage(b: &mut Builder, seed: u32) {
    let tiles = textures::slabs("tiles", 1024, srgb(0xe6e2d8), srgb(0x6d6a66), 5, 5, seed);
    let tiles = b.texture(tiles, Encoding::Srgb, Vec2::splat(5.0));
    let floor = Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(tiles) },
        roughness: ScalarInput::new(0.35),
        ..Material::new("floor")
    };
    let floor = b.material(floor);
    let back = b.material(Material::diffuse("back", srgb(0xd8d4cc)));
    let teal = b.material(Material::diffuse("teal", srgb(0x2f8f94)));
    let coral = b.material(Material::diffuse("coral", srgb(0xd9694a)));
    let lamp = b.material(Material::emitter("lamp", Vec3::new(900.0, 855.0, 765.0), false));
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x * HALF, y * HEIGHT, z * HALF);
    let mut wall = |name: &str, material: u32, corners: [Vec3; 4]| {
        let mut shape = Shape::default();
        shape.flat_quad(corners);
        b.object(name, material, &shape);
    };
    let (low, high) = ([(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)], [0.0, 1.0]);
    wall("floor", floor, low.map(|(x, z)| corner(x, 0.0, z)));
    let upright = |(ax, az): (f32, f32), (bx, bz): (f32, f32)| {
        [corner(ax, high[0], az), corner(bx, high[0], bz), corner(bx, high[1], bz), corner(ax, high[1], az)]
    };
    wall("back", back, upright(low[3], low[2]));
    wall("left", teal, upright(low[0], low[3]));
    wall("right", coral, upright(low[2], low[1]));
    b.object("lamp", lamp, &square_lamp(Vec3::new(-2.6, 5.7, 1.6), Vec3::new(0.4, 0.0, -0.3), 0.4));
    b.desc.environment = Some(Environment::Constant(Vec3::new(0.4, 0.45, 0.55)));
}

/// Balls of about `size` that swing about `middle` as far as `spread`, each in its own time.
fn balls(
    mut chance: Chance,
    count: u32,
    (middle, spread): (Vec3, Vec3),
    size: f32,
    time: f32,
) -> Vec<Metaball> {
    let mut swing = |_| {
        let mut axis = || {
            let (phase, speed) = (chance.unit(), chance.range(0.05, 0.14));
            // The phase alone stays exact over long times.
            sin(TAU * (phase + speed * time).fract())
        };
        let offset = Vec3::new(axis(), axis(), axis());
        let radius = size * chance.range(0.75, 1.15);
        Metaball { center: middle + offset * spread, radius, strength: 1.0 }
    };
    (0..count).map(&mut swing).collect()
}
