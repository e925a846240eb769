//! What sits on pipes: flanges with bolts, valves, welds, shoes. Every piece has measures of its own.

use super::Finishes;
use super::pile::{Pile, vary};
use crate::generate::chance::Chance;
use crate::generate::shape::{Shape, stand, turn};
use crate::generate::{lathe, solids, tube};
use std::f32::consts::TAU;
use vastlight_math::{Affine3, Vec2, Vec3, real::sin_cos};

/// A pair of flanges around a pipe of this radius, with bolts.
pub(super) fn flanges(pile: &mut Pile, f: &Finishes, place: &Affine3, radius: f32, chance: &mut Chance) {
    let (rim, thick) = (radius * chance.range(1.5, 1.68), (0.012 + radius * 0.22) * chance.range(0.85, 1.2));
    let hub = radius * chance.range(1.12, 1.2);
    let half = [
        [radius * 0.99, -2.2 * thick],
        [hub, -thick],
        [rim, -thick],
        [rim, -0.07 * thick],
        [radius * 1.25, 0.0],
    ];
    let mirrored = half.iter().rev().skip(1).map(|[r, y]| [*r, -y]);
    let profile: Vec<Vec2> = half.into_iter().chain(mirrored).map(Vec2::from_array).collect();
    let sides = if radius > 0.1 { 36 } else { 24 };
    pile.add(f.galvanised, &lathe::lathe(&profile, sides).transformed(place));
    let bolts = match radius {
        r if r > 0.4 => 28,
        r if r > 0.15 => 12,
        r if r > 0.06 => 8,
        _ => 4,
    };
    let circle = 0.5 * (rim + hub);
    let size = (0.25 * (rim - hub)).min(0.4 * circle * TAU / bolts as f32);
    let offset = chance.unit();
    for i in 0..bolts {
        let (s, c) = sin_cos(TAU * (i as f32 + offset) / bolts as f32);
        let at = Affine3::from_translation(Vec3::new(circle * c, 0.0, circle * s));
        let spin = turn(chance.range(0.0, TAU));
        pile.add(f.steel, &bolt(size, thick, chance).transformed(&(*place * at * spin)));
    }
}

/// A bolt with two nuts through a pair of flanges of this thickness each.
fn bolt(size: f32, thick: f32, chance: &mut Chance) -> Shape {
    let (above, below) = (nut(size, chance), nut(size, chance));
    let mut shape = above.at(0.0, thick, 0.0);
    let upside_down = Affine3::from_cols(Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z, Vec3::NEG_Y * thick);
    shape.merge(&below.transformed(&upside_down));
    let (end, out) = (vary(0.52 * size, chance), chance.range(1.15, 2.0) * size);
    let tip = [[end, 0.7 * size], [end * chance.range(0.8, 0.95), out], [0.0, out]].map(Vec2::from_array);
    shape.merge(&lathe::lathe(&tip, 8).at(0.0, thick, 0.0));
    shape
}

/// A chamfered nut on y = 0.
fn nut(size: f32, chance: &mut Chance) -> Shape {
    let (radius, high) = (vary(size, chance), vary(0.85 * size, chance));
    let (edge, face) = (high * chance.range(0.72, 0.9), radius * chance.range(0.82, 0.95));
    lathe::lathe(&[[radius, 0.0], [radius, edge], [face, high], [0.0, high]].map(Vec2::from_array), 6)
}

/// A gate valve with a bonnet, a spindle and a handwheel that points to `up` in the pipe's frame.
pub(super) fn valve(pile: &mut Pile, f: &Finishes, place: &Affine3, radius: f32, chance: &mut Chance) {
    let body = f.pipes[chance.below(4) as usize];
    let long = radius * chance.range(2.0, 2.6);
    let bulge = [[radius * 1.02, -long], [radius * 1.15, -long * 0.7], [radius * 1.5, -long * 0.3]];
    let back = bulge.iter().rev().map(|[r, y]| [*r, -y]);
    let profile: Vec<Vec2> = bulge.into_iter().chain(back).map(Vec2::from_array).collect();
    pile.add(body, &lathe::lathe(&lathe::smooth_profile(&profile, 4), 32).transformed(place));
    for side in [-1.0, 1.0] {
        let end = *place * Affine3::from_translation(Vec3::Y * (side * long * 1.1));
        flanges(pile, f, &end, radius, chance);
    }
    let neck = *place * stand(Vec3::ZERO, Vec3::X) * turn(chance.range(0.0, TAU));
    let (height, stem) = (radius * chance.range(2.6, 3.4) + 0.05, vary(0.012 + radius * 0.1, chance));
    let bonnet = [[radius * 0.9, 0.0], [radius * 0.8, 0.55], [radius * 1.2, 0.55], [radius * 1.2, 0.68]];
    let top = [[stem * 2.0, 0.72], [stem * 1.5, 0.98], [stem, 1.0], [stem, 1.5], [0.0, 1.5]];
    let profile: Vec<Vec2> = bonnet.iter().chain(&top).map(|[r, y]| Vec2::new(*r, y * height)).collect();
    pile.add(body, &lathe::lathe(&profile, 24).transformed(&neck));
    let wheel = radius * chance.range(1.2, 1.7) + 0.05;
    let at = neck * Affine3::from_translation(Vec3::Y * (1.42 * height));
    pile.add(f.pipes[0], &handwheel(wheel, stem * 1.2, chance).transformed(&at));
}

/// A wheel around +y with spokes.
fn handwheel(radius: f32, rim: f32, chance: &mut Chance) -> Shape {
    let around = |angle: f32, r: f32| {
        let (s, c) = sin_cos(angle);
        Vec3::new(r * c, 0.0, r * s)
    };
    let ring: Vec<Vec3> = (0..=24).map(|i| around(TAU * (i % 24) as f32 / 24.0, radius)).collect();
    let mut shape = tube::tube(&ring, rim, 8);
    let spokes = 3 + chance.below(3);
    for i in 0..spokes {
        let out = around(TAU * i as f32 / spokes as f32, radius);
        shape.merge(&tube::rod(Vec3::Y * (rim * 0.5), out, vary(rim * 0.6, chance), 6));
    }
    shape
}

/// A weld bead around a pipe.
pub(super) fn weld(pile: &mut Pile, material: u32, place: &Affine3, radius: f32, chance: &mut Chance) {
    let (wide, high) = (chance.range(0.006, 0.011), chance.range(0.002, 0.004));
    let rings = [-1.0_f32, -0.5, 0.5, 1.0];
    let (sides, start) = (32, chance.unit());
    let mut shape = Shape::default();
    for (i, t) in rings.iter().enumerate() {
        for side in 0..=sides {
            let (s, c) = sin_cos(TAU * ((side % sides) as f32 + start) / sides as f32);
            let ripple = 1.0 + 0.35 * (sin_cos((side % sides) as f32 * 2.6 + start).0);
            let r = radius + if i % 3 == 0 { -0.001 } else { high * ripple };
            let normal = Vec3::new(c, 0.5 * t, s).normalize();
            shape.vertex(Vec3::new(c * r, t * wide, s * r), normal, Vec2::new(side as f32 * 0.01, *t));
        }
    }
    for ring in 0..3 {
        for side in 0..sides {
            let a = ring * (sides + 1) + side;
            shape.quad(a, a + sides + 1, a + sides + 2, a + 1);
        }
    }
    pile.add(material, &shape.transformed(place));
}

/// A shoe between a level pipe and the beam below it.
pub(super) fn shoe(pile: &mut Pile, f: &Finishes, at: Vec3, along: Vec3, radius: f32, chance: &mut Chance) {
    let (height, length) = (0.12, chance.range(0.2, 0.4));
    let across = Vec3::Y.cross(along);
    let frame = Affine3::from_cols(across, Vec3::Y, along, at - Vec3::Y * (radius + height * 0.5));
    let web = solids::cuboid(Vec3::new(vary(0.012, chance), height, length));
    let foot = solids::beveled_box(Vec3::new(vary(0.5 * radius + 0.06, chance), 0.012, length * 1.1), 0.003);
    pile.add(f.galvanised, &web.transformed(&frame));
    pile.add(f.galvanised, &foot.at(0.0, -height * 0.5, 0.0).transformed(&frame));
}
