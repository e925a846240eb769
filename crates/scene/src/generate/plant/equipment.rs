//! Tanks, a walkway with grating and railings, pumps.

use super::{FAR, Finishes, NEAR};
use crate::generate::builder::Builder;
use crate::generate::shape::{Assembly, Shape, turn};
use crate::generate::{lathe, solids, tube};
use std::f32::consts::{FRAC_PI_2, TAU};
use vastlight_math::{Affine3, Vec2, Vec3, real::sin_cos};

/// Height of the walkway and half its width.
const DECK: f32 = 2.4;
const HALF_DECK: f32 = 0.7;

pub(super) fn equipment(b: &mut Builder, f: &Finishes) {
    tanks(b, f);
    walkway(b, f);
    pumps(b, f);
}

/// Two rows of upright vessels with dished ends on legs.
fn tanks(b: &mut Builder, f: &Finishes) {
    let mut tank = Assembly::default();
    let (radius, low, high) = (1.25, 1.1, 5.4);
    let mut profile = Vec::new();
    for i in 0..=12 {
        let (s, c) = sin_cos(FRAC_PI_2 * i as f32 / 12.0);
        profile.push(Vec2::new(radius * s, low - 0.45 * c));
    }
    for y in [2.3, 3.9] {
        profile.extend(
            [[radius, y], [radius + 0.05, y + 0.02], [radius + 0.05, y + 0.1], [radius, y + 0.12]]
                .map(Vec2::from_array),
        );
    }
    for i in 0..=12 {
        let (s, c) = sin_cos(FRAC_PI_2 * i as f32 / 12.0);
        profile.push(Vec2::new(radius * c, high + 0.45 * s));
    }
    tank.add(f.tank, &lathe::lathe(&profile, 72));
    let mut legs = Shape::default();
    for i in 0..4 {
        let (s, c) = sin_cos(TAU * (i as f32 + 0.5) / 4.0);
        legs.merge(&tube::rod(Vec3::new(1.0 * c, 0.0, 1.0 * s), Vec3::new(1.0 * c, 1.3, 1.0 * s), 0.09, 10));
    }
    tank.add(f.steel, &legs);
    tank.add(f.galvanised, &flange(0.34, 0.2).at(0.0, high + 0.42, 0.0));
    let tank = b.mesh("tank", tank);
    for i in 0..7 {
        for side in [-1.0, 1.0] {
            let z = 4.0 - 7.2 * i as f32 + if side > 0.0 { -2.0 } else { 0.0 };
            let scale = Vec3::new(1.0, if (i + usize::from(side > 0.0)) % 3 == 0 { 1.25 } else { 1.0 }, 1.0);
            let place = Affine3::from_translation(Vec3::new(side * 5.6, 0.0, z))
                * turn(0.7 * i as f32)
                * Affine3::from_scale(scale);
            b.place(tank, place);
        }
    }
}

/// A bolted flange around +y.
fn flange(radius: f32, height: f32) -> Shape {
    let profile = [
        [0.0, 0.0],
        [radius, 0.0],
        [radius, height * 0.4],
        [radius * 0.7, height * 0.4],
        [radius * 0.7, height],
        [0.0, height],
    ];
    let mut shape = lathe::lathe(&profile.map(Vec2::from_array), 32);
    for i in 0..12 {
        let (s, c) = sin_cos(TAU * i as f32 / 12.0);
        shape.merge(&lathe::cylinder(radius * 0.07, height * 0.55, 6).at(
            radius * 0.86 * c,
            0.0,
            radius * 0.86 * s,
        ));
    }
    shape
}

/// A grating on beams along the hall's middle, with railings on both sides.
fn walkway(b: &mut Builder, f: &Finishes) {
    let piece = 3.0;
    let mut deck = Shape::default();
    for i in 0..38 {
        let x = HALF_DECK * (2.0 * i as f32 / 37.0 - 1.0);
        deck.merge(&solids::cuboid(Vec3::new(0.005, 0.035, piece)).at(x, DECK, 0.0));
    }
    for i in 0..30 {
        let z = piece * ((i as f32 + 0.5) / 30.0 - 0.5);
        deck.merge(&tube::rod(Vec3::new(-HALF_DECK, DECK, z), Vec3::new(HALF_DECK, DECK, z), 0.004, 4));
    }
    let mut frame = Shape::default();
    for side in [-1.0, 1.0] {
        let x = side * (HALF_DECK + 0.04);
        frame.merge(&solids::cuboid(Vec3::new(0.06, 0.2, piece)).at(x, DECK - 0.09, 0.0));
        for y in [0.55, 1.1] {
            let (p, q) = (Vec3::new(x, DECK + y, -piece * 0.5), Vec3::new(x, DECK + y, piece * 0.5));
            frame.merge(&tube::rod(p, q, 0.021, 12));
        }
        frame.merge(&tube::rod(Vec3::new(x, DECK - 0.1, 0.0), Vec3::new(x, DECK + 1.1, 0.0), 0.021, 12));
        frame.merge(&tube::rod(Vec3::new(x, 0.0, 0.0), Vec3::new(x, DECK - 0.1, 0.0), 0.05, 12));
    }
    let mut walkway = Assembly::default();
    walkway.add(f.galvanised, &deck).add(f.walkway, &frame);
    let walkway = b.mesh("walkway", walkway);
    let count = ((NEAR - FAR) / piece) as u32 - 2;
    for i in 0..count {
        b.place_at(walkway, Vec3::new(0.0, 0.0, NEAR - piece * (i as f32 + 1.5)));
    }
}

/// Motor pumps on blocks of concrete.
fn pumps(b: &mut Builder, f: &Finishes) {
    let lying =
        |shape: Shape| shape.transformed(&Affine3::from_cols(Vec3::Y, Vec3::X, Vec3::NEG_Z, Vec3::ZERO));
    let mut pump = Assembly::default();
    pump.add(f.concrete, &solids::beveled_box(Vec3::new(1.5, 0.3, 0.8), 0.03).at(0.0, 0.15, 0.0));
    let mut motor = lathe::cylinder(0.24, 0.7, 32);
    for i in 0..20 {
        let (s, c) = sin_cos(TAU * i as f32 / 20.0);
        motor.merge(
            &solids::cuboid(Vec3::new(0.05, 0.62, 0.012)).transformed(&turn(-TAU * i as f32 / 20.0)).at(
                0.25 * c,
                0.35,
                0.25 * s,
            ),
        );
    }
    pump.add(f.pipes[3], &lying(motor).at(-0.65, 0.6, 0.0));
    pump.add(
        f.pipes[1],
        &lying(lathe::lathe(
            &[[0.0, 0.0], [0.16, 0.0], [0.3, 0.08], [0.3, 0.22], [0.14, 0.3], [0.14, 0.42], [0.0, 0.42]]
                .map(Vec2::from_array),
            40,
        ))
        .at(0.15, 0.6, 0.0),
    );
    pump.add(f.copper, &lying(lathe::cylinder(0.05, 0.3, 20)).at(0.0, 0.6, 0.0));
    let pump = b.mesh("pump", pump);
    for i in 0..6 {
        for side in [-1.0, 1.0] {
            let place = Affine3::from_translation(Vec3::new(side * 2.6, 0.0, 2.0 - 7.0 * i as f32))
                * turn(side * FRAC_PI_2);
            b.place(pump, place);
        }
    }
}
