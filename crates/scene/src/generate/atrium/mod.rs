//! An atrium: three storeys of galleries around a long hall under a glass vault, in late afternoon light.

mod arcade;
mod furniture;
mod lamps;
mod materials;
mod roof;
mod stairs;

use super::{GenerateOptions, builder::Builder, shape::turn, solids};
use crate::{Camera, Environment, SceneDesc, Sky};
use materials::Finishes;
use std::f32::consts::FRAC_PI_2;
use vastlight_math::{Affine3, Vec3};

/// Length of a bay along the hall, metres.
const BAY: f32 = 6.0;
/// Bays on each side.
const BAYS: u32 = 8;
/// Where the hall begins (behind the camera) and ends, along z.
const NEAR: f32 = 12.0;
const FAR: f32 = NEAR - BAY * BAYS as f32;
/// From the hall's axis to the arcades.
const HALF_WIDTH: f32 = 7.0;
/// Depth of the galleries behind the arcades.
const GALLERY: f32 = 4.5;
/// Heights of the gallery floors and of the vault's springing.
const FIRST: f32 = 7.0;
const SECOND: f32 = 12.2;
const SPRING: f32 = 16.6;
/// Rise of the elliptical vault above its springing.
const RISE: f32 = 4.6;

/// The scene.
pub(super) fn atrium(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let finishes = Finishes::new(&mut b, options.seed);
    shell(&mut b, &finishes);
    arcade::arcades(&mut b, &finishes);
    roof::roof(&mut b, &finishes);
    roof::end_window(&mut b, &finishes);
    stairs::stairs(&mut b, &finishes);
    furniture::pool(&mut b, &finishes, options.seed);
    furniture::planters(&mut b, &finishes, options.seed);
    furniture::benches(&mut b, &finishes);
    furniture::banners(&mut b, &finishes, options.seed);
    lamps::lamps(&mut b, &finishes, options.seed);
    b.desc.environment = Some(Environment::Sky(Sky {
        sun_azimuth: -0.95,
        sun_elevation: 0.72,
        turbidity: 3.0,
        strength: 4.5,
        ground_albedo: Vec3::new(0.28, 0.25, 0.21),
        ..Sky::default()
    }));
    let (eye, target) = (Vec3::new(-2.3, 2.3, 10.6), Vec3::new(0.9, 6.9, -20.0));
    b.desc.cameras.push(Camera::look_at("hall", eye, target, 58_f32.to_radians()));
    b.desc
}

/// Floor, outer walls and the flat roofs of the galleries.
fn shell(b: &mut Builder, finishes: &Finishes) {
    let (middle, length) = ((NEAR + FAR) * 0.5, NEAR - FAR);
    let outer = HALF_WIDTH + GALLERY;
    b.object("floor", finishes.floor, &solids::floor(2.0 * outer, length).at(0.0, 0.0, middle));
    let wall = 0.4;
    for side in [-1.0, 1.0] {
        let x = side * (outer + wall * 0.5);
        let long = solids::cuboid(Vec3::new(wall, SPRING, length)).at(x, SPRING * 0.5, middle);
        b.object("gallery wall", finishes.plaster, &long);
        let size = Vec3::new(GALLERY + 0.9, 0.4, length);
        let cover = solids::cuboid(size).at(side * (HALF_WIDTH + size.x * 0.5 - 0.45), SPRING - 0.2, middle);
        b.object("gallery roof", finishes.plaster, &cover);
        let size = Vec3::new(GALLERY, SPRING, wall);
        let end = solids::cuboid(size).at(side * (HALF_WIDTH + GALLERY * 0.5), SPRING * 0.5, FAR - 0.2);
        b.object("gallery end", finishes.plaster, &end);
    }
    let height = SPRING + RISE + 0.5;
    let front = solids::cuboid(Vec3::new(2.0 * outer, height, wall)).at(0.0, height * 0.5, NEAR + 0.2);
    b.object("entrance wall", finishes.limestone, &front);
}

/// Where a bay of the left (-1) or right (+1) arcade stands: local +z faces the hall, x runs along it.
fn bay_place(side: f32, bay: u32) -> Affine3 {
    let z = NEAR - BAY * (bay as f32 + 0.5);
    Affine3::from_translation(Vec3::new(side * HALF_WIDTH, 0.0, z)) * turn(-side * FRAC_PI_2)
}
