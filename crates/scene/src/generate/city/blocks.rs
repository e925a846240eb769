//! Streets and blocks, from the middle outwards.

use super::Site;
use super::modules::{DEPTH, Facade, STOREY, WIDTH};
use crate::generate::chance::Chance;
use crate::generate::shape::turn;
use std::f32::consts::{FRAC_PI_2, TAU};
use vastlight_math::{Affine3, Vec3};

/// From block to block along x and z; the rest of it beside the block is street.
const PITCH_X: f32 = 62.0;
const PITCH_Z: f32 = 78.0;
const STREET: f32 = 14.0;
/// Width of the pavement around the buildings.
const WALK: f32 = 3.4;

/// Fills ring after ring of blocks until the triangles are used up.
pub(super) fn blocks(site: &mut Site, seed: u64) {
    let root = Chance::new(seed, 800);
    for ring in 0_i32.. {
        for z in -ring..=ring {
            for x in -ring..=ring {
                if x.abs().max(z.abs()) == ring {
                    let mut chance = root.part((x as u32 as u64) << 32 | z as u32 as u64);
                    if !block(site, x, z, &mut chance) {
                        return;
                    }
                }
            }
        }
    }
}

/// One block around its middle; false once the triangles are used up.
fn block(site: &mut Site, x: i32, z: i32, chance: &mut Chance) -> bool {
    let center = Vec3::new(x as f32 * PITCH_X, 0.0, z as f32 * PITCH_Z);
    let half = Vec3::new((PITCH_X - STREET) * 0.5, 0.0, (PITCH_Z - STREET) * 0.5);
    let pavement = site.kit.pavement;
    site.slab(pavement, center - half, center + half + Vec3::Y * 0.15)
        && buildings(site, center, half, chance)
        && street(site, center, half, chance)
}

/// Two columns of three houses.
fn buildings(site: &mut Site, center: Vec3, half: Vec3, chance: &mut Chance) -> bool {
    let (across, along) = (6, 5);
    let lot = Vec3::new(half.x - WALK, 0.0, (2.0 * (half.z - WALK)) / 3.0);
    for column in [-0.5, 0.5] {
        for row in [-1.0, 0.0, 1.0] {
            let at = center + Vec3::new(column * lot.x, 0.15, row * lot.z);
            if chance.happens(0.06) {
                if !park(site, at, chance) {
                    return false;
                }
            } else if !building(site, at, [across, along], chance) {
                return false;
            }
        }
    }
    true
}

/// A house of modules on four sides with shops below and a cornice above.
fn building(site: &mut Site, at: Vec3, modules: [u32; 2], chance: &mut Chance) -> bool {
    let storeys = 3 + chance.below(5) + if chance.happens(0.2) { chance.below(9) } else { 0 };
    let kind = chance.below(site.kit.facades.len() as u32) as usize;
    let facade = site.kit.facades[kind];
    let (half_x, half_z) = (WIDTH * modules[0] as f32 * 0.5, WIDTH * modules[1] as f32 * 0.5);
    let height = STOREY * storeys as f32;
    let balconies = chance.below(4);
    let core = Vec3::new(half_x - DEPTH, 0.0, half_z - DEPTH);
    let roof = site.kit.roof;
    if !site.slab(roof, at - core, at + core + Vec3::Y * (height + 0.3)) {
        return false;
    }
    for side in 0..4 {
        let (count, reach) = if side % 2 == 0 { (modules[0], half_z) } else { (modules[1], half_x) };
        let face = Affine3::from_translation(at) * turn(side as f32 * FRAC_PI_2);
        for storey in 0..=storeys {
            for i in 0..count {
                let x = WIDTH * (i as f32 + 0.5 - count as f32 * 0.5);
                let mesh = module(&facade, storey, storeys, i, balconies);
                let place = face * Affine3::from_translation(Vec3::new(x, STOREY * storey as f32, reach));
                if !site.place(mesh, place) {
                    return false;
                }
            }
        }
    }
    on_the_roof(site, at + Vec3::Y * (height + 0.3), core, chance)
}

fn module(facade: &Facade, storey: u32, storeys: u32, i: u32, balconies: u32) -> u32 {
    if storey == 0 {
        facade.shop
    } else if storey == storeys {
        facade.cornice
    } else if balconies > 0 && (i + storey * (balconies - 1)).is_multiple_of(balconies + 1) {
        facade.balcony
    } else {
        facade.window
    }
}

/// Stair heads, ducts and now and then a water tank.
fn on_the_roof(site: &mut Site, top: Vec3, half: Vec3, chance: &mut Chance) -> bool {
    let roof = site.kit.roof;
    for _ in 0..2 + chance.below(3) {
        let size = Vec3::new(chance.range(0.5, 1.6), chance.range(0.8, 2.6), chance.range(0.5, 1.6));
        let spot = top + Vec3::new(chance.range(-0.7, 0.7) * half.x, 0.0, chance.range(-0.7, 0.7) * half.z);
        let (low, high) = (spot - Vec3::new(size.x, 0.0, size.z), spot + size);
        if !site.slab(roof, low, high) {
            return false;
        }
    }
    if chance.happens(0.4) {
        let spot = Vec3::new(chance.range(-0.6, 0.6) * half.x, 0.0, chance.range(-0.6, 0.6) * half.z);
        let tank = site.kit.tank;
        return site.place(tank, Affine3::from_translation(top + spot));
    }
    true
}

/// Trees on a small green.
fn park(site: &mut Site, at: Vec3, chance: &mut Chance) -> bool {
    (0..7).all(|_| {
        let spot = Vec3::new(chance.range(-7.0, 7.0), 0.0, chance.range(-7.0, 7.0));
        tree(site, at + spot, chance)
    })
}

fn tree(site: &mut Site, at: Vec3, chance: &mut Chance) -> bool {
    let mesh = site.kit.trees[chance.below(site.kit.trees.len() as u32) as usize];
    let scale = Affine3::from_scale(Vec3::splat(chance.range(0.7, 1.15)));
    site.place(mesh, Affine3::from_translation(at) * turn(chance.range(0.0, TAU)) * scale)
}

/// Trees and lamps along the kerbs, cars beside them, stripes on the road.
fn street(site: &mut Site, center: Vec3, half: Vec3, chance: &mut Chance) -> bool {
    for side in [-1.0, 1.0] {
        let kerb = center + Vec3::new(side * (half.x - 1.0), 0.15, 0.0);
        for i in 0..7 {
            let z = half.z * (2.0 * (i as f32 + 0.5) / 7.0 - 1.0);
            let lamp = site.kit.lamp;
            let fits = if i % 3 == 1 {
                let place = Affine3::from_translation(kerb + Vec3::Z * z) * turn(side * FRAC_PI_2);
                site.place(lamp, place)
            } else {
                tree(site, kerb + Vec3::Z * z, chance)
            };
            if !fits {
                return false;
            }
        }
        for i in 0..10 {
            if chance.happens(0.62) {
                let z = half.z * (2.0 * (i as f32 + 0.5) / 10.0 - 1.0) + chance.range(-0.3, 0.3);
                let at = center + Vec3::new(side * (half.x + 1.25), 0.0, z);
                let car = site.kit.cars[chance.below(site.kit.cars.len() as u32) as usize];
                if !site.place(
                    car,
                    Affine3::from_translation(at) * turn(-side * FRAC_PI_2 + chance.range(-0.03, 0.03)),
                ) {
                    return false;
                }
            }
        }
    }
    markings(site, center, half) && traffic(site, center, half, chance)
}

/// Broken lines in the middle of the streets to the right and in front.
fn markings(site: &mut Site, center: Vec3, half: Vec3) -> bool {
    let stripe = site.kit.stripe;
    let (right, front) = (half.x + STREET * 0.5, half.z + STREET * 0.5);
    let lines = (0..10).all(|i| {
        let z = half.z * (2.0 * (i as f32 + 0.5) / 10.0 - 1.0);
        let at = center + Vec3::new(right, 0.0, z);
        site.slab(stripe, at - Vec3::new(0.07, 0.01, 1.5), at + Vec3::new(0.07, 0.012, 1.5))
    });
    lines
        && (0..8).all(|i| {
            let x = half.x * (2.0 * (i as f32 + 0.5) / 8.0 - 1.0);
            let at = center + Vec3::new(x, 0.0, front);
            site.slab(stripe, at - Vec3::new(1.5, 0.01, 0.07), at + Vec3::new(1.5, 0.012, 0.07))
        })
}

/// Cars on the move to the right of the block.
fn traffic(site: &mut Site, center: Vec3, half: Vec3, chance: &mut Chance) -> bool {
    (0..3).all(|_| {
        let lane = if chance.happens(0.5) { -1.0 } else { 1.0 };
        let at =
            center + Vec3::new(half.x + STREET * 0.5 + lane * 2.0, 0.0, chance.range(-1.0, 1.0) * half.z);
        let car = site.kit.cars[chance.below(site.kit.cars.len() as u32) as usize];
        site.place(car, Affine3::from_translation(at) * turn(lane * FRAC_PI_2))
    })
}

/// The last triangles become bollards on the kerbs of the middle.
pub(super) fn bollards(site: &mut Site) {
    let mesh = site.kit.pavement;
    for i in 0_u32.. {
        let (row, side) = (i / 2, if i % 2 == 0 { -1.0 } else { 1.0 });
        let x = (PITCH_X * 0.5) + side * (STREET * 0.5 + 0.4);
        let at = Vec3::new(x, 0.0, 1.3 * row as f32 - 39.0);
        if !site.slab(mesh, at - Vec3::new(0.1, 0.0, 0.1), at + Vec3::new(0.1, 1.0, 0.1)) {
            return;
        }
    }
}
