//! Steelwork of a process unit: columns, beams, gratings, railings, stairs.

use super::Finishes;
use super::hall::i_beam;
use super::pile::{Pile, vary};
use super::unit::Plan;
use crate::generate::chance::Chance;
use crate::generate::{solids, tube};
use vastlight_math::{Affine3, Vec2, Vec3};

/// Distance between the bars of a grating.
const BAR_PITCH: f32 = 0.034;

/// Columns to the top floor, beams and gratings of every floor.
pub(super) fn frame(pile: &mut Pile, f: &Finishes, plan: &Plan, chance: &mut Chance) {
    let Some(&top) = plan.floors.last() else { return };
    for x in plan.lines(0) {
        for z in plan.lines(1) {
            column(pile, f, Vec3::new(x, 0.0, z), top + if plan.decked { 0.0 } else { 0.6 }, chance);
        }
    }
    for (i, &floor) in plan.floors.iter().enumerate() {
        beams(pile, f, plan, floor, chance);
        if plan.decked {
            grating(pile, f, plan, floor, chance);
            railing(pile, f, plan, floor, chance);
            let below = if i == 0 { 0.0 } else { plan.floors[i - 1] };
            stairs(pile, f, plan, [below, floor], i % 2 == 1, chance);
        } else {
            braces(pile, f, plan, floor, chance);
        }
    }
}

/// A beam between two points; its web stands along `up`.
fn beam(pile: &mut Pile, material: u32, ends: [Vec3; 2], up: Vec3, depth: f32, chance: &mut Chance) {
    let along = ends[1] - ends[0];
    let z = along.normalize();
    let x = up.cross(z).normalize();
    let place = Affine3::from_cols(x, z.cross(x), z, (ends[0] + ends[1]) * 0.5);
    let shape = i_beam(vary(depth, chance), vary(depth * 0.6, chance), along.length());
    pile.add(material, &shape.transformed(&place));
}

/// A column with a foot plate, its lower part in concrete against fire.
fn column(pile: &mut Pile, f: &Finishes, foot: Vec3, height: f32, chance: &mut Chance) {
    beam(pile, f.steel, [foot, foot + Vec3::Y * height], Vec3::X, 0.36, chance);
    let (wide, tall) = (vary(0.56, chance), chance.range(1.2, 2.4));
    let coat = solids::beveled_box(Vec3::new(wide, tall, vary(0.56, chance)), 0.03);
    pile.add(f.concrete, &coat.at(foot.x, tall * 0.5, foot.z));
    let block = solids::beveled_box(Vec3::new(vary(1.1, chance), 0.3, vary(1.1, chance)), 0.02);
    pile.add(f.concrete, &block.at(foot.x, 0.15, foot.z));
}

/// Main beams on the lines of columns, joists between them.
fn beams(pile: &mut Pile, f: &Finishes, plan: &Plan, floor: f32, chance: &mut Chance) {
    let (half, y) = (plan.half, floor - 0.2);
    for z in plan.lines(1) {
        beam(pile, f.steel, [Vec3::new(-half.x, y, z), Vec3::new(half.x, y, z)], Vec3::Y, 0.34, chance);
    }
    for x in plan.lines(0) {
        beam(pile, f.steel, [Vec3::new(x, y, -half.y), Vec3::new(x, y, half.y)], Vec3::Y, 0.3, chance);
    }
    let joists = (2.0 * half.x / 1.5) as u32;
    for i in 1..joists {
        let x = half.x * (2.0 * i as f32 / joists as f32 - 1.0);
        if plan.decked && !plan.is_hole(Vec2::new(x, 0.0), half.y) {
            let ends = [Vec3::new(x, y + 0.09, -half.y), Vec3::new(x, y + 0.09, half.y)];
            beam(pile, f.steel, ends, Vec3::Y, 0.16, chance);
        }
    }
}

/// Panels of flat bars with rods across, cut out around vessels.
fn grating(pile: &mut Pile, f: &Finishes, plan: &Plan, floor: f32, chance: &mut Chance) {
    let half = plan.half;
    let mut x = -half.x;
    while x < half.x - 0.4 {
        let panel = chance.range(0.85, 1.25).min(half.x - x);
        let end = half.y - chance.range(0.0, 0.02);
        let bars = (panel / BAR_PITCH) as u32;
        for i in 0..=bars {
            let at = x + 0.004 + (panel - 0.012) * i as f32 / bars as f32;
            for [low, high] in plan.spans(at, end) {
                let (thick, tall) = (chance.range(0.0036, 0.0056), chance.range(0.028, 0.036));
                let bar = solids::cuboid(Vec3::new(thick, tall, high - low - chance.range(0.0, 0.012)));
                pile.add(f.galvanised, &bar.at(at, floor - 0.016, (low + high) * 0.5));
            }
        }
        for i in 0..(end / 0.06) as u32 {
            let z = -end + 0.12 * (i as f32 + 0.5);
            if !plan.is_hole(Vec2::new(x + panel * 0.5, z), panel * 0.5) {
                let (p, q) = (
                    Vec3::new(x + chance.range(0.0, 0.004), floor, z),
                    Vec3::new(x + panel - chance.range(0.005, 0.011), floor, z),
                );
                pile.add(f.galvanised, &tube::rod(p, q, chance.range(0.003, 0.0042), 4));
            }
        }
        x += panel;
    }
}

/// Posts, two rails and a toe board on all sides.
fn railing(pile: &mut Pile, f: &Finishes, plan: &Plan, floor: f32, chance: &mut Chance) {
    let (x, z) = (plan.half.x - 0.04, plan.half.y - 0.04);
    let corners = [[-x, -z], [x, -z], [x, z], [-x, z], [-x, -z]].map(|[x, z]| Vec3::new(x, floor, z));
    for side in corners.windows(2) {
        for height in [0.55, 1.1] {
            let lift = Vec3::Y * vary(height, chance);
            pile.add(f.walkway, &tube::rod(side[0] + lift, side[1] + lift, vary(0.021, chance), 14));
        }
        let board = (side[1] - side[0]).abs() + Vec3::new(0.008, 0.12, 0.008);
        let middle = (side[0] + side[1]) * 0.5 + Vec3::Y * 0.06;
        let board = board * Vec3::new(1.0, chance.range(0.9, 1.1), 1.0);
        pile.add(f.walkway, &solids::cuboid(board).at(middle.x, middle.y, middle.z));
        let posts = ((side[1] - side[0]).length() / chance.range(1.2, 1.5)) as u32;
        for i in 0..posts {
            let foot = side[0].lerp(side[1], i as f32 / posts as f32);
            let post = tube::rod(foot, foot + Vec3::Y * vary(1.1, chance), vary(0.021, chance), 14);
            pile.add(f.walkway, &post);
        }
    }
}

/// A flight of steps along the unit's side, from floor to floor.
fn stairs(pile: &mut Pile, f: &Finishes, plan: &Plan, heights: [f32; 2], back: bool, chance: &mut Chance) {
    let [low, high] = heights;
    let run = (high - low) * 1.15;
    let x = plan.half.x + 0.5;
    let (from, to) = if back { (run * 0.5, -run * 0.5) } else { (-run * 0.5, run * 0.5) };
    let (foot, head) = (Vec3::new(x, low, from), Vec3::new(x, high, to));
    let up = Vec3::new(0.0, 1.0, 0.0);
    for side in [-0.42, 0.42] {
        let aside = Vec3::X * side;
        beam(pile, f.walkway, [foot + aside, head + aside], up, 0.2, chance);
        let rail = aside + Vec3::Y * 1.0;
        pile.add(f.walkway, &tube::rod(foot + rail, head + rail, vary(0.021, chance), 14));
        for i in 0..5 {
            let at = foot.lerp(head, (i as f32 + 0.5) / 5.0) + aside;
            pile.add(f.walkway, &tube::rod(at, at + Vec3::Y * vary(1.0, chance), vary(0.02, chance), 12));
        }
    }
    let steps = ((high - low) / 0.2) as u32;
    for i in 0..steps {
        let at = foot.lerp(head, (i as f32 + 0.7) / steps as f32);
        for bar in 0..9 {
            let z = at.z + 0.03 * (bar as f32 - 4.0);
            let size = Vec3::new(0.8, vary(0.03, chance), vary(0.005, chance));
            pile.add(f.galvanised, &solids::cuboid(size).at(x, at.y, z));
        }
    }
}

/// Diagonals in the sides of a rack.
fn braces(pile: &mut Pile, f: &Finishes, plan: &Plan, floor: f32, chance: &mut Chance) {
    for z in plan.lines(1) {
        for side in [-1.0, 1.0] {
            let (p, q) = (Vec3::new(side * plan.half.x, floor - 2.2, z), Vec3::new(0.0, floor - 0.3, z));
            pile.add(f.steel, &tube::rod(p, q, vary(0.05, chance), 12));
        }
    }
}
