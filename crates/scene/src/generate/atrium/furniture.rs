//! Pool, planters with trees, benches, banners.

use super::{BAYS, SECOND, bay_place, materials::Finishes};
use crate::generate::builder::Builder;
use crate::generate::chance::Chance;
use crate::generate::noise::noise;
use crate::generate::shape::{Assembly, Shape, turn};
use crate::generate::tree::{Growth, tree};
use crate::generate::{lathe, solids, tube};
use std::f32::consts::TAU;
use vastlight_math::{Affine3, Vec2, Vec3, real::sin_cos};

/// The pool's edges along z, and half its width.
const POOL_NEAR: f32 = 3.0;
const POOL_FAR: f32 = -17.0;
const POOL_HALF: f32 = 2.0;

/// A raised basin of dark stone, full of still water.
pub(super) fn pool(b: &mut Builder, finishes: &Finishes, seed: u64) {
    let (width, height) = (0.4, 0.42);
    let (outer, near, far) = (POOL_HALF + width, POOL_NEAR + width, POOL_FAR - width);
    let mut rim = Shape::default();
    for side in [-1.0, 1.0] {
        let (a, c) = (side * POOL_HALF, side * outer);
        let (low, high) = (Vec3::new(a.min(c), 0.0, far), Vec3::new(a.max(c), height, near));
        rim.merge(&solids::block(low, high, 0.025));
    }
    for (z0, z1) in [(POOL_NEAR, near), (far, POOL_FAR)] {
        let (low, high) = (Vec3::new(-POOL_HALF, 0.0, z0), Vec3::new(POOL_HALF, height, z1));
        rim.merge(&solids::block(low, high, 0.025));
    }
    b.object("pool rim", finishes.granite, &rim);
    let seed = seed as u32;
    let wave = |x: f32, z: f32| {
        0.004 * noise(Vec3::new(x * 1.1, 0.0, z * 1.1), seed)
            + 0.0012 * noise(Vec3::new(x * 4.0, 3.0, z * 4.0), seed)
    };
    let surface = solids::grid(48, 240, |u, v| {
        let (x, z) = (POOL_HALF * (2.0 * u - 1.0), POOL_FAR + (POOL_NEAR - POOL_FAR) * v);
        let e = 0.02;
        let slope_x = (wave(x + e, z) - wave(x - e, z)) / (2.0 * e);
        let slope_z = (wave(x, z + e) - wave(x, z - e)) / (2.0 * e);
        (Vec3::new(x, height - 0.05 + wave(x, z), z), Vec3::new(-slope_x, 1.0, -slope_z).normalize())
    });
    b.object("water", finishes.water, &surface);
}

/// Trees in bronze planters along the pool.
pub(super) fn planters(b: &mut Builder, finishes: &Finishes, seed: u64) {
    let mut box_mesh = Assembly::default();
    box_mesh.add(finishes.bronze, &planter_box());
    box_mesh.add(finishes.soil, &lathe::cylinder(0.62, 0.72, 24));
    let planter = b.mesh("planter", box_mesh);
    let trees: Vec<u32> = (0..3)
        .map(|kind| {
            let mut chance = Chance::new(seed, 100 + kind);
            let growth = Growth { height: 4.6, forks: 6, leaves: 14, leaf: 0.19, sides: 10 };
            let [wood, leaves] = tree(&growth, &mut chance);
            let mut assembly = Assembly::default();
            assembly.add(finishes.bark, &wood).add(finishes.leaves, &leaves);
            b.mesh("tree", assembly)
        })
        .collect();
    let mut chance = Chance::new(seed, 99);
    for (i, z) in [0.0, -6.0, -12.0, -17.5].into_iter().enumerate() {
        for (k, side) in [-1.0, 1.0].into_iter().enumerate() {
            let at = Vec3::new(side * 4.5, 0.0, z);
            b.place_at(planter, at);
            let scale = chance.range(0.85, 1.1);
            let place = Affine3::from_translation(at + Vec3::Y * 0.68)
                * turn(chance.range(0.0, TAU))
                * Affine3::from_scale(Vec3::splat(scale));
            b.place(trees[(i + k) % trees.len()], place);
        }
    }
}

/// A round, slightly tapered tub, open at the top.
fn planter_box() -> Shape {
    let profile = [
        [0.0, 0.0],
        [0.56, 0.0],
        [0.58, 0.02],
        [0.7, 0.76],
        [0.72, 0.8],
        [0.66, 0.8],
        [0.64, 0.78],
        [0.62, 0.6],
        [0.0, 0.6],
    ]
    .map(Vec2::from_array);
    lathe::lathe(&profile, 48)
}

/// Slatted benches between the planters.
pub(super) fn benches(b: &mut Builder, finishes: &Finishes) {
    let mut slats = Shape::default();
    for i in 0..6 {
        slats.merge(&solids::beveled_box(Vec3::new(0.075, 0.04, 2.2), 0.008).at(
            0.09 * i as f32 - 0.225,
            0.45,
            0.0,
        ));
    }
    let mut legs = Shape::default();
    for z in [-0.8, 0.8] {
        let corners =
            [[-0.22, 0.0], [-0.22, 0.41], [0.22, 0.41], [0.22, 0.0]].map(|[x, y]| Vec3::new(x, y, z));
        legs.merge(&tube::tube(&tube::rounded_path(&corners, 0.06, 5), 0.018, 10));
    }
    let mut bench = Assembly::default();
    bench.add(finishes.wood, &slats).add(finishes.steel, &legs);
    let bench = b.mesh("bench", bench);
    for z in [-3.0, -9.0, -14.8] {
        for side in [-1.0, 1.0] {
            b.place_at(bench, Vec3::new(side * 4.5, 0.0, z));
        }
    }
}

/// Long cloths that hang from the second gallery between the columns.
pub(super) fn banners(b: &mut Builder, finishes: &Finishes, seed: u64) {
    let meshes: Vec<u32> = finishes
        .banners
        .iter()
        .zip(0..)
        .map(|(&material, kind)| {
            let mut banner = Assembly::default();
            banner.add(material, &cloth(1.5, 4.4, Chance::new(seed, 200 + kind).range(0.0, TAU)));
            banner.add(
                finishes.bronze,
                &tube::rod(Vec3::new(-0.85, 0.0, 0.0), Vec3::new(0.85, 0.0, 0.0), 0.022, 10),
            );
            b.mesh("banner", banner)
        })
        .collect();
    for side in [-1.0, 1.0] {
        for bay in 1..BAYS {
            let kind = (bay as usize + usize::from(side > 0.0)) % meshes.len();
            let local = Affine3::from_translation(Vec3::new(0.0, SECOND - 0.5, 0.62));
            b.place(meshes[kind], bay_place(side, bay) * local);
        }
    }
}

/// A hanging cloth with folds that deepen downwards, seen from +z.
fn cloth(width: f32, length: f32, phase: f32) -> Shape {
    let depth = |u: f32, v: f32| {
        let (a, _) = sin_cos(u * 13.0 + phase + 0.6 * v);
        let (c, _) = sin_cos(u * 5.0 - phase);
        (0.012 + 0.05 * v) * a + 0.04 * v * c
    };
    solids::grid(48, 40, |u, v| {
        let e = 1e-3;
        let du = (depth(u + e, v) - depth(u - e, v)) / (2.0 * e) / width;
        let dv = (depth(u, v + e) - depth(u, v - e)) / (2.0 * e) / length;
        let p = Vec3::new((u - 0.5) * width, -v * length, depth(u, v));
        (p, Vec3::new(-du, dv, 1.0).normalize())
    })
}
