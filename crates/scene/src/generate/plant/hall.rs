//! The building: floor, brick walls with high windows, columns, roof trusses with a skylight, lamps.

use super::{EAVES, FAR, Finishes, HALF_WIDTH, NEAR};
use crate::generate::builder::Builder;
use crate::generate::shape::{Assembly, Shape};
use crate::generate::{extrude::extrude, lathe, solids, tube};
use std::f32::consts::FRAC_PI_2;
use vastlight_math::{Vec2, Vec3};

/// Distance between trusses, and height of the ridge.
const BAY: f32 = 6.0;
const RIDGE: f32 = 15.6;

pub(super) fn hall(b: &mut Builder, f: &Finishes) {
    let (middle, length) = ((NEAR + FAR) * 0.5, NEAR - FAR);
    b.object("floor", f.concrete, &solids::floor(2.0 * HALF_WIDTH + 1.0, length).at(0.0, 0.0, middle));
    walls(b, f);
    let mut truss = Assembly::default();
    truss.add(f.steel, &truss_shape());
    let truss = b.mesh("truss", truss);
    let mut column = Assembly::default();
    column.add(f.steel, &upright_beam());
    let column = b.mesh("column", column);
    let mut lamp = Assembly::default();
    lamp.add(
        f.steel,
        &lathe::lathe(
            &[[0.0, 0.34], [0.06, 0.33], [0.08, 0.2], [0.32, 0.0], [0.31, 0.0], [0.07, 0.19], [0.0, 0.2]]
                .map(Vec2::from_array),
            32,
        ),
    );
    lamp.add(f.steel, &tube::rod(Vec3::Y * 0.33, Vec3::Y * 3.2, 0.012, 6));
    lamp.add(f.lamp, &solids::sphere(0.11, 8).at(0.0, 0.06, 0.0));
    let lamp = b.mesh("lamp", lamp);
    for i in 0..=((NEAR - FAR) / BAY) as u32 {
        let z = NEAR - BAY * i as f32;
        b.place_at(truss, Vec3::new(0.0, 0.0, z));
        for side in [-1.0, 1.0] {
            b.place_at(column, Vec3::new(side * (HALF_WIDTH - 0.3), 0.0, z));
            b.place_at(lamp, Vec3::new(side * 4.2, 9.0, z - BAY * 0.5));
        }
    }
    roof(b, f);
}

/// Brick below and above a band of windows on the long sides; closed ends.
fn walls(b: &mut Builder, f: &Finishes) {
    let (middle, length) = ((NEAR + FAR) * 0.5, NEAR - FAR);
    for side in [-1.0, 1.0] {
        let x = side * (HALF_WIDTH + 0.2);
        let mut wall = Shape::default();
        for (low, high) in [(0.0, 6.8), (10.4, EAVES)] {
            wall.merge(&solids::cuboid(Vec3::new(0.4, high - low, length)).at(x, (low + high) * 0.5, middle));
        }
        b.object("wall", f.brick, &wall);
        let mut bars = Shape::default();
        for i in 0..=40 {
            let z = NEAR - length * i as f32 / 40.0;
            bars.merge(
                &solids::cuboid(Vec3::new(0.06, 3.6, if i % 4 == 0 { 0.5 } else { 0.05 })).at(x, 8.6, z),
            );
        }
        for y in [7.7, 8.6, 9.5] {
            bars.merge(&solids::cuboid(Vec3::new(0.05, 0.05, length)).at(x, y, middle));
        }
        b.object("window bars", f.steel, &bars);
    }
    for z in [NEAR + 0.2, FAR - 0.2] {
        let end = solids::cuboid(Vec3::new(2.0 * HALF_WIDTH + 0.8, RIDGE + 0.4, 0.4)).at(
            0.0,
            (RIDGE + 0.4) * 0.5,
            z,
        );
        b.object("end wall", f.brick, &end);
    }
}

/// Roof slopes with an open strip along the ridge.
fn roof(b: &mut Builder, f: &Finishes) {
    let mut slopes = Shape::default();
    let (outer, open) = (HALF_WIDTH + 0.5, 2.4);
    let height = |x: f32| RIDGE + 0.25 - (RIDGE - EAVES) * x / HALF_WIDTH;
    for side in [-1.0, 1.0] {
        let at = |x: f32, lift: f32| Vec2::new(side * x, height(x) + lift);
        let mut outline = vec![at(open, 0.0), at(outer, 0.0), at(outer, 0.12), at(open, 0.12)];
        if signed_area(&outline) < 0.0 {
            outline.reverse();
        }
        slopes.merge(&extrude(&outline, NEAR - FAR).at(0.0, 0.0, (NEAR + FAR) * 0.5));
    }
    b.object("roof", f.galvanised, &slopes);
    let mut bars = Shape::default();
    for i in 0..=60 {
        let z = NEAR - (NEAR - FAR) * i as f32 / 60.0;
        for side in [-1.0, 1.0] {
            let (p, q) = (Vec3::new(side * open, height(open), z), Vec3::new(0.0, height(0.0), z));
            bars.merge(&tube::rod(p, q, 0.025, 4));
        }
    }
    b.object("skylight bars", f.steel, &bars);
}

fn signed_area(polygon: &[Vec2]) -> f32 {
    let n = polygon.len();
    (0..n).map(|i| polygon[i].perp_dot(polygon[(i + 1) % n])).sum()
}

/// A roof truss of pairs of angles and thin ties.
fn truss_shape() -> Shape {
    let mut truss = Shape::default();
    let top = |x: f32| Vec3::new(x, RIDGE - (RIDGE - EAVES) * x.abs() / HALF_WIDTH, 0.0);
    let bottom = |x: f32| Vec3::new(x, EAVES - 0.4 + 0.8 * (1.0 - x.abs() / HALF_WIDTH), 0.0);
    let member = |truss: &mut Shape, a: Vec3, b: Vec3, radius: f32| truss.merge(&tube::rod(a, b, radius, 4));
    for side in [-1.0, 1.0] {
        let count = 6;
        let x = |i: usize| side * HALF_WIDTH * i as f32 / count as f32;
        member(&mut truss, top(x(count)), top(0.0), 0.11);
        member(&mut truss, bottom(x(count)), bottom(0.0), 0.08);
        for i in 0..count {
            member(&mut truss, bottom(x(i)), top(x(i)), 0.045);
            member(&mut truss, bottom(x(i)), top(x(i + 1)), 0.04);
        }
    }
    truss
}

/// An I-shaped beam of this depth and flange along z, standing on nothing: centred.
pub(super) fn i_beam(depth: f32, flange: f32, length: f32) -> Shape {
    let (h, w, t) = (depth * 0.5, flange * 0.5, 0.025);
    let outline = [
        [-w, -h],
        [w, -h],
        [w, -h + t],
        [t * 0.5, -h + t],
        [t * 0.5, h - t],
        [w, h - t],
        [w, h],
        [-w, h],
        [-w, h - t],
        [-t * 0.5, h - t],
        [-t * 0.5, -h + t],
        [-w, -h + t],
    ]
    .map(Vec2::from_array);
    extrude(&outline, length)
}

/// The same, upright from the floor to the eaves.
fn upright_beam() -> Shape {
    let up = vastlight_math::Affine3::from_cols(Vec3::X, Vec3::Z, Vec3::NEG_Y, Vec3::ZERO);
    let mut beam = i_beam(0.36, 0.4, EAVES).transformed(&up).turned(FRAC_PI_2).at(0.0, EAVES * 0.5, 0.0);
    beam.merge(&solids::beveled_box(Vec3::new(0.7, 0.06, 0.7), 0.01).at(0.0, 0.03, 0.0));
    beam
}
