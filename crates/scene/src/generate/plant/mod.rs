//! A plant full of pipes: long thin triangles in every direction, as many as are asked for.
//!
//! Up to [`HALL`] triangles it is one hall: its tanks and its walkways are always there; pipes are laid until the
//! triangles are used up, cables fill the rest. More triangles are a site of process units under the sky (`site`),
//! which come mesh by mesh: steelwork, vessels, banks of pipes with flanges and valves, cables (`unit`).

mod cables;
mod equipment;
mod fittings;
mod frame;
mod hall;
mod pile;
mod pipes;
mod piping;
mod site;
mod unit;
mod vessels;

use super::builder::Builder;
use super::chance::Chance;
use super::palette::{brushed, lacquer, srgb, stone};
use super::{GenerateOptions, textures};
use crate::{Camera, ColorInput, Encoding, Environment, Material, SceneDesc, SceneStream, Sky};
use vastlight_math::{Vec2, Vec3};

/// Half the hall's width, its height under the trusses, and where it begins and ends.
const HALF_WIDTH: f32 = 11.0;
const EAVES: f32 = 12.0;
const NEAR: f32 = 14.0;
const FAR: f32 = -46.0;

/// Indices of the plant's materials.
#[derive(Clone, Copy, Debug)]
struct Finishes {
    concrete: u32,
    brick: u32,
    steel: u32,
    galvanised: u32,
    walkway: u32,
    tank: u32,
    copper: u32,
    pipes: [u32; 6],
    rubber: u32,
    lamp: u32,
}

/// Triangles of the fullest hall.
const HALL: u64 = 6_000_000;

/// The scene.
pub(super) fn plant(options: &GenerateOptions) -> SceneStream {
    match options.triangles.unwrap_or(1_500_000) {
        triangles if triangles > HALL => site::site(triangles, options),
        triangles => one_hall(triangles, options).into(),
    }
}

fn one_hall(wanted: u64, options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let finishes = finishes(&mut b, options.seed);
    hall::hall(&mut b, &finishes);
    equipment::equipment(&mut b, &finishes);
    let used: u64 = b.instanced_triangles();
    pipes::pipes(&mut b, &finishes, wanted.saturating_sub(used), &Chance::new(options.seed, 500));
    b.desc.environment = Some(sky(-0.75, 0.85, 6.0));
    let (eye, target) = (Vec3::new(-0.25, 4.25, 12.6), Vec3::new(0.6, 5.2, -16.0));
    b.desc.cameras.push(Camera::look_at("walkway", eye, target, 55_f32.to_radians()));
    b.desc
}

/// A sky whose sun stands at this azimuth and elevation in radians.
fn sky(sun_azimuth: f32, sun_elevation: f32, strength: f32) -> Environment {
    Environment::Sky(Sky { sun_azimuth, sun_elevation, turbidity: 4.0, strength, ..Sky::default() })
}

fn finishes(b: &mut Builder, seed: u64) -> Finishes {
    let seed = seed as u32;
    let concrete =
        textures::paint("concrete", 256, move |uv| textures::mottled(uv, srgb(0x8c8a84), 0.3, seed ^ 41));
    let concrete = b.texture(concrete, Encoding::Srgb, Vec2::splat(5.0));
    let brick = textures::slabs("brick", 512, srgb(0x9a5a44), srgb(0xb5aa9c), 8, 24, seed ^ 42);
    let brick = b.texture(brick, Encoding::Srgb, Vec2::new(2.0, 1.8));
    let textured = |name: &str, texture: u32, roughness: f32| Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(texture) },
        ..stone(name, Vec3::ONE, roughness)
    };
    let paint = |name: &str, hex: u32| lacquer(name, srgb(hex), 0.4);
    let red = b.material(paint("red pipe", 0xa5281e));
    let green = b.material(paint("green pipe", 0x2f6b45));
    let yellow = b.material(paint("yellow pipe", 0xd8a41c));
    let blue = b.material(paint("blue pipe", 0x2a5c8c));
    let jacket = b.material(brushed("insulation jacket", Vec3::splat(0.72), 0.34));
    let steel = b.material(Material::metal("bare pipe", Vec3::new(0.50, 0.48, 0.46), 0.38));
    Finishes {
        concrete: b.material(textured("concrete", concrete, 0.45)),
        brick: b.material(textured("brick", brick, 0.8)),
        steel: b.material(paint("steelwork", 0x5d6a6b)),
        galvanised: b.material(Material::metal("galvanised", Vec3::splat(0.55), 0.45)),
        walkway: b.material(paint("walkway", 0xc98f1d)),
        tank: b.material(brushed("tank", Vec3::new(0.66, 0.67, 0.69), 0.28)),
        copper: b.material(Material::metal("copper", Vec3::new(0.86, 0.50, 0.34), 0.22)),
        pipes: [red, green, yellow, blue, jacket, steel],
        rubber: b.material(stone("cable", srgb(0x1c1c1e), 0.6)),
        lamp: b.material(Material::emitter("lamp", Vec3::new(1.0, 0.86, 0.66) * 70.0, false)),
    }
}
