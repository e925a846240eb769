//! Columns, drums and tanks: dented cladding in sheets, nozzles, ladders, saddles.

use super::Finishes;
use super::fittings::flanges;
use super::pile::{Pile, vary};
use super::unit::{Hole, Kind, Plan};
use crate::generate::chance::Chance;
use crate::generate::noise::fbm;
use crate::generate::shape::{Shape, stand, turn};
use crate::generate::{lathe, solids, tube};
use std::f32::consts::{FRAC_PI_2, TAU};
use vastlight_math::{Affine3, Vec2, Vec3, real::sin_cos};

/// Distance between the rings of cladding in metres.
const RING: f32 = 0.08;

/// What the unit's kind has.
pub(super) fn vessels(pile: &mut Pile, f: &Finishes, plan: &Plan, chance: &mut Chance) {
    let top = plan.floors.last().copied().unwrap_or(0.0);
    for hole in &plan.holes {
        let height = match plan.kind {
            Kind::Tower => chance.range(18.0, 34.0),
            Kind::Tank => chance.range(6.0, 11.0),
            _ => top + chance.range(0.8, 5.0),
        };
        if plan.kind == Kind::Tank {
            tank(pile, f, hole, height, chance);
        } else {
            column(pile, f, hole, height, chance);
        }
    }
    if plan.kind == Kind::Drums {
        let decks: Vec<f32> = std::iter::once(0.0).chain(plan.floors.iter().copied()).collect();
        for deck in decks {
            for x in [-0.5, 0.5] {
                let at = Vec3::new(x * plan.half.x, deck, chance.range(-0.6, 0.6));
                drum(pile, f, at, chance.range(2.6, 4.2), chance.range(0.55, 1.0), chance);
            }
        }
    }
}

/// The outline of a vessel with dished ends, from the bottom to the top.
fn dished(radius: f32, low: f32, high: f32) -> Vec<Vec2> {
    let dish = |i: u32| sin_cos(FRAC_PI_2 * i as f32 / 14.0);
    let bottom = (0..14)
        .map(|i| (dish(i), low, -1.0))
        .map(|((s, c), y, sign)| [radius * s, y + sign * 0.5 * radius * c]);
    let rings = ((high - low) / RING).max(1.0) as u32;
    let side = (0..=rings).map(|i| [radius, low + (high - low) * i as f32 / rings as f32]);
    let lid = (1..=14).map(|i| {
        let (s, c) = dish(i);
        [if i == 14 { 0.0 } else { radius * c }, high + 0.5 * radius * s]
    });
    bottom.chain(side).chain(lid).map(Vec2::from_array).collect()
}

/// How cladding of sheets about `sheet` metres high differs from the drawing: bands over its joints, dents.
fn cladding(sheet: f32, dents: f32, seed: u32) -> impl Fn(Vec3) -> f32 {
    move |p| {
        let row = p.y / sheet;
        let in_sheet = row - row.floor();
        let band = if in_sheet < 0.09 { 0.006 } else { 0.0 };
        band + dents * fbm(p * 1.7, 3, 0.6, seed)
    }
}

/// A surface of revolution about +y, moved outwards by `bump`.
fn skin(profile: &[Vec2], sectors: u32, bump: impl Fn(Vec3) -> f32) -> Shape {
    let rows = profile.len() as u32;
    let angles: Vec<(f32, f32)> = (0..sectors).map(|i| sin_cos(TAU * i as f32 / sectors as f32)).collect();
    let point = |row: u32, sector: u32| {
        let (before, after) =
            (profile[row.saturating_sub(1) as usize], profile[(row + 1).min(rows - 1) as usize]);
        let (along, p, (s, c)) =
            ((after - before).normalize_or(Vec2::Y), profile[row as usize], angles[sector as usize]);
        let at = Vec3::new(p.x * s, p.y, p.x * c);
        if p.x == 0.0 { at } else { at + Vec3::new(along.y * s, -along.x, along.y * c) * bump(at) }
    };
    let mut shape = Shape::default();
    for row in 0..rows {
        let ring: Vec<Vec3> = (0..sectors).map(|sector| point(row, sector)).collect();
        for sector in 0..=sectors {
            let uv = Vec2::new(
                TAU * profile[row as usize].x * sector as f32 / sectors as f32,
                profile[row as usize].y,
            );
            shape.vertex(ring[(sector % sectors) as usize], Vec3::ZERO, uv);
        }
    }
    let index = |row: u32, sector: u32| row * (sectors + 1) + sector % (sectors + 1);
    for row in 0..rows {
        for sector in 0..=sectors {
            let at = |row: u32, sector: u32| shape.positions[index(row, sector) as usize];
            let around = at(row, (sector + 1) % sectors) - at(row, (sector + sectors - 1) % sectors);
            let up = at((row + 1).min(rows - 1), sector) - at(row.saturating_sub(1), sector);
            let pole = if row == 0 { Vec3::NEG_Y } else { Vec3::Y };
            shape.normals[index(row, sector) as usize] = around.cross(up).normalize_or(pole);
        }
    }
    for row in 0..rows - 1 {
        for sector in 0..sectors {
            let (a, b) = (index(row, sector), index(row, sector + 1));
            let (c, d) = (index(row + 1, sector + 1), index(row + 1, sector));
            if profile[row as usize].x > 0.0 {
                shape.triangle(a, b, c);
            }
            if profile[row as usize + 1].x > 0.0 {
                shape.triangle(a, c, d);
            }
        }
    }
    shape
}

/// An upright vessel on a skirt with nozzles, platforms and a ladder.
fn column(pile: &mut Pile, f: &Finishes, hole: &Hole, height: f32, chance: &mut Chance) {
    let at = Affine3::from_translation(Vec3::new(hole.center.x, 0.0, hole.center.y));
    let (radius, low) = (hole.radius, chance.range(1.2, 2.2));
    let material = [f.tank, f.pipes[4], f.tank, f.pipes[5]][chance.below(4) as usize];
    let profile = dished(radius, low, height - 0.5 * radius);
    let bump = cladding(chance.range(0.8, 1.3), chance.range(0.004, 0.012), chance.bits() as u32);
    pile.add(material, &skin(&profile, (radius * 70.0) as u32 + 12, bump).transformed(&at));
    let skirt = [[radius * 1.15, 0.3], [radius * 0.97, low + 0.2]].map(Vec2::from_array);
    pile.add(f.concrete, &lathe::lathe(&skirt, 64).transformed(&at));
    let foot = lathe::cylinder(radius * chance.range(1.3, 1.45), 0.3, 48);
    pile.add(f.concrete, &foot.transformed(&at));
    for _ in 0..3 + (height * 0.5) as u32 {
        nozzle(pile, f, &at, radius, chance.range(low, height - radius), chance);
    }
    let turned = at * turn(chance.range(0.0, TAU));
    ladder(pile, f, &turned, radius + 0.25, height, chance);
    let mut level = chance.range(7.0, 9.0);
    while height > 14.0 && level < height - 1.0 {
        platform(pile, f, &turned, radius, level, chance);
        level += chance.range(4.5, 7.0);
    }
}

/// A short flanged pipe out of a vessel's side.
fn nozzle(pile: &mut Pile, f: &Finishes, at: &Affine3, radius: f32, y: f32, chance: &mut Chance) {
    let (s, c) = sin_cos(chance.range(0.0, TAU));
    let out = Vec3::new(s, 0.0, c);
    let (bore, reach) = (chance.range(0.05, 0.26), chance.range(0.18, 0.35));
    let root = out * (radius - 0.05) + Vec3::Y * y;
    let end = out * (radius + reach) + Vec3::Y * y;
    pile.add(f.pipes[5], &tube::rod(root, end, bore, 32).transformed(at));
    flanges(pile, f, &(*at * stand(end, out)), bore, chance);
}

/// Rails and rungs up the side that faces +z.
fn ladder(pile: &mut Pile, f: &Finishes, at: &Affine3, reach: f32, height: f32, chance: &mut Chance) {
    for side in [-0.22, 0.22] {
        let foot = Vec3::new(side, 0.2, reach);
        let rail = tube::rod(foot, foot + Vec3::Y * (height - 0.2), vary(0.022, chance), 12);
        pile.add(f.walkway, &rail.transformed(at));
    }
    for i in 1..(height / 0.28) as u32 {
        let y = 0.28 * i as f32 + 0.2;
        let (p, q) = (Vec3::new(-0.22, y, reach), Vec3::new(0.22, y, reach));
        pile.add(f.walkway, &tube::rod(p, q, vary(0.011, chance), 10).transformed(at));
    }
}

/// A ring of plate around a column, with a railing.
fn platform(pile: &mut Pile, f: &Finishes, at: &Affine3, radius: f32, y: f32, chance: &mut Chance) {
    let (inner, outer) = (radius + 0.05, radius + chance.range(0.9, 1.2));
    let deck = [[inner, y - 0.08], [outer, y - 0.08], [outer, y], [inner, y], [inner, y - 0.08]];
    pile.add(f.galvanised, &lathe::lathe(&deck.map(Vec2::from_array), 72).transformed(at));
    let around = |i: u32, n: u32, y: f32| {
        let (s, c) = sin_cos(TAU * (i % n) as f32 / n as f32);
        Vec3::new(s * (outer - 0.03), y, c * (outer - 0.03))
    };
    for rise in [0.55, 1.1] {
        let rise = vary(rise, chance);
        let ring: Vec<Vec3> = (0..=64).map(|i| around(i, 64, y + rise)).collect();
        pile.add(f.walkway, &tube::tube(&ring, vary(0.02, chance), 12).transformed(at));
    }
    let posts = 10 + chance.below(6);
    for i in 0..posts {
        let (foot, high) = (around(i, posts, y), vary(1.1, chance));
        let post = tube::rod(foot, foot + Vec3::Y * high, vary(0.02, chance), 12);
        pile.add(f.walkway, &post.transformed(at));
    }
}

/// A lying vessel on two saddles, with a channel head.
fn drum(pile: &mut Pile, f: &Finishes, at: Vec3, half: f32, radius: f32, chance: &mut Chance) {
    let y = radius + 0.5;
    let lying = stand(at + Vec3::Y * y, Vec3::Z);
    let profile = dished(radius, -half, half - 0.3);
    let bump = cladding(chance.range(0.8, 1.2), chance.range(0.003, 0.01), chance.bits() as u32);
    let material = [f.tank, f.pipes[4], f.pipes[1], f.pipes[3]][chance.below(4) as usize];
    pile.add(material, &skin(&profile, (radius * 80.0) as u32 + 12, bump).transformed(&lying));
    let joint = lying * Affine3::from_translation(Vec3::Y * (half * chance.range(0.6, 0.8)));
    flanges(pile, f, &joint, radius * 0.98, chance);
    for z in [-0.55, 0.5] {
        let size = Vec3::new(vary(radius * 1.5, chance), 0.5 + radius * 0.35, vary(0.22, chance));
        pile.add(f.concrete, &solids::beveled_box(size, 0.02).at(at.x, at.y + size.y * 0.5, at.z + z * half));
    }
    for _ in 0..4 {
        nozzle(pile, f, &lying, radius, chance.range(-0.8, 0.5) * half, chance);
    }
}

/// A storage tank with a shallow roof, a rail around it and steps that wind up its side.
fn tank(pile: &mut Pile, f: &Finishes, hole: &Hole, height: f32, chance: &mut Chance) {
    let radius = hole.radius;
    let rings = (height / RING) as u32;
    let shell = (0..=rings).map(|i| Vec2::new(radius, 0.15 + (height - 0.15) * i as f32 / rings as f32));
    let roof = (1..=40).map(|i| {
        let t = i as f32 / 40.0;
        Vec2::new(if i == 40 { 0.0 } else { radius * (1.0 - t) }, height + 0.16 * radius * t * (2.0 - t))
    });
    let profile: Vec<Vec2> = shell.chain(roof).collect();
    let bump = cladding(chance.range(1.6, 2.2), chance.range(0.008, 0.02), chance.bits() as u32);
    pile.add([f.tank, f.pipes[4]][chance.below(2) as usize], &skin(&profile, (radius * 56.0) as u32, bump));
    pile.add(f.concrete, &lathe::cylinder(radius + chance.range(0.3, 0.5), 0.15, 96));
    let start = chance.range(0.0, TAU);
    let (steps, mut rail) = ((height / 0.2) as u32, Vec::new());
    for i in 0..=steps {
        let angle = start + 0.24 * i as f32 / radius;
        let (place, y) = (turn(angle), 0.15 + 0.2 * i as f32);
        let size = Vec3::new(vary(0.26, chance), vary(0.03, chance), 0.75);
        pile.add(f.galvanised, &solids::cuboid(size).at(0.0, y, radius + 0.42).transformed(&place));
        let post = place.transform_point3(Vec3::new(0.0, y, radius + 0.8));
        rail.push(post + Vec3::Y * 1.05);
        if i % 5 == 0 {
            pile.add(f.walkway, &tube::rod(post, post + Vec3::Y * vary(1.05, chance), 0.02, 12));
        }
    }
    pile.add(f.walkway, &tube::tube(&rail, 0.022, 12));
    let middle = Affine3::IDENTITY;
    for _ in 0..6 {
        nozzle(pile, f, &middle, radius, chance.range(0.5, 1.4), chance);
    }
}
