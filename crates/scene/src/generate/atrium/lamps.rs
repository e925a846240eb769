//! Lamps: a wave of glowing globes on cables above the pool, and lights under the gallery ceilings.

use super::{BAYS, FIRST, GALLERY, SECOND, SPRING, bay_place, materials::Finishes, roof::vault_height};
use crate::generate::builder::Builder;
use crate::generate::chance::Chance;
use crate::generate::shape::Assembly;
use crate::generate::{lathe, solids, tube};
use std::f32::consts::PI;
use vastlight_math::{Affine3, Vec2, Vec3, real::sin_cos};

/// Globes in the wave.
const GLOBES: u32 = 54;

/// All lamps.
pub(super) fn lamps(b: &mut Builder, finishes: &Finishes, seed: u64) {
    globes(b, finishes, seed);
    gallery_lights(b, finishes);
}

fn globes(b: &mut Builder, finishes: &Finishes, seed: u64) {
    let mut globe = Assembly::default();
    globe.add(finishes.globe, &solids::sphere(1.0, 10));
    let globe = b.mesh("globe", globe);
    let mut cap = Assembly::default();
    let profile =
        [[0.0, 0.9], [0.42, 0.9], [0.42, 1.04], [0.16, 1.14], [0.1, 1.4], [0.0, 1.4]].map(Vec2::from_array);
    cap.add(finishes.bronze, &lathe::lathe(&profile, 20));
    let cap = b.mesh("globe cap", cap);
    let mut cables = Assembly::default();
    let mut chance = Chance::new(seed, 300);
    for i in 0..GLOBES {
        let t = i as f32 / (GLOBES - 1) as f32;
        let (s, c) = sin_cos(i as f32 * 0.72);
        let (swell, _) = sin_cos(t * 2.0 * PI + 0.6);
        let z = 1.5 - 22.0 * t + chance.range(-0.3, 0.3);
        let at = Vec3::new(1.75 * c, 9.4 + 1.5 * swell + 1.2 * s + chance.range(-0.25, 0.25), z);
        let radius = chance.range(0.12, 0.24);
        let place = Affine3::from_translation(at) * Affine3::from_scale(Vec3::splat(radius));
        b.place(globe, place);
        b.place(cap, place);
        let hook = Vec3::new(at.x, vault_height(at.x) - 0.02, z);
        cables.add(finishes.steel, &tube::rod(at + Vec3::Y * (radius * 1.35), hook, 0.006, 5));
    }
    b.assembled("lamp cables", cables);
}

/// A round lamp under each gallery ceiling.
fn gallery_lights(b: &mut Builder, finishes: &Finishes) {
    let mut lamp = Assembly::default();
    let ring = [[0.26, 0.0], [0.3, -0.06], [0.34, 0.0], [0.26, 0.0]].map(Vec2::from_array);
    lamp.add(finishes.bronze, &lathe::lathe(&ring, 24));
    lamp.add(finishes.ceiling_lamp, &lathe::cylinder(0.25, 0.03, 16).at(0.0, -0.035, 0.0));
    let lamp = b.mesh("gallery lamp", lamp);
    for side in [-1.0, 1.0] {
        for bay in 0..BAYS {
            for ceiling in [FIRST - 0.5, SECOND - 0.4, SPRING - 0.4] {
                let local = Vec3::new(0.0, ceiling, -GALLERY * 0.55);
                b.place(lamp, bay_place(side, bay) * Affine3::from_translation(local));
            }
        }
    }
}
