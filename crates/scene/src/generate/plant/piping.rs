//! Pipes of a process unit: banks of parallel runs that turn together, step, drop, or bulge against expansion.

use super::Finishes;
use super::fittings::{flanges, shoe, valve, weld};
use super::pile::Pile;
use super::unit::{PITCH, Plan};
use crate::generate::chance::Chance;
use crate::generate::shape::stand;
use crate::generate::tube;
use vastlight_math::{Vec2, Vec3};

/// Banks that are tried before a unit is left with fewer pipes.
const TRIES: u64 = 4000;

/// Lays banks of pipes until the unit has `triangles` triangles.
pub(super) fn piping(pile: &mut Pile, f: &Finishes, plan: &Plan, triangles: usize, chance: &Chance) {
    for number in 0..TRIES {
        let mut chance = chance.part(number);
        let bank = Bank::new(plan, &mut chance);
        let mut offset = 0.0;
        for _ in 0..2 + chance.below(7) {
            if pile.triangles() >= triangles {
                return;
            }
            let radius = chance.range(0.03, 0.11) * if chance.happens(0.2) { 2.0 } else { 1.0 };
            let insulated = chance.happens(0.25);
            let outer = radius + if insulated { 0.05 } else { 0.0 };
            offset += outer + 0.06;
            let corners = bank.corners(offset, outer, &mut chance);
            offset += outer + 0.06;
            if is_free(plan, &corners, outer) {
                pipe(pile, f, plan, &corners, [radius, outer], &mut chance);
            }
        }
    }
}

/// What the pipes of a bank do half-way.
#[derive(Clone, Copy, Debug)]
enum Course {
    Straight,
    Turn,
    Drop,
    Step,
    Loop,
}

/// Parallel runs at one level.
struct Bank {
    course: Course,
    /// Along x (0) or z (1).
    axis: usize,
    level: f32,
    below: f32,
    reach: [f32; 2],
    first: f32,
    half_way: f32,
    side: f32,
    rise: f32,
}

impl Bank {
    fn new(plan: &Plan, chance: &mut Chance) -> Self {
        let floor = chance.below(plan.floors.len() as u32 + 1) as usize;
        let level = match plan.floors.get(floor) {
            Some(&floor) if plan.decked => floor - chance.range(0.5, 1.3),
            Some(&floor) => floor + 0.02,
            None => chance.range(0.35, 1.3),
        };
        let below = if floor == 0 || floor >= plan.floors.len() { 0.0 } else { plan.floors[floor - 1] };
        let axis = chance.below(2) as usize;
        // Pipes on racks go on to the next unit.
        let far =
            if level > 3.0 && !plan.decked { PITCH * 0.5 } else { plan.half[axis] + chance.range(0.1, 0.9) };
        let side = if chance.happens(0.5) { 1.0 } else { -1.0 };
        let course = match chance.below(8) {
            0 | 1 => Course::Straight,
            2 | 3 => Course::Turn,
            4 | 5 => Course::Drop,
            6 => Course::Step,
            _ => Course::Loop,
        };
        Self {
            course,
            axis,
            level,
            below,
            reach: [-far * side, far * side],
            first: chance.range(-0.95, 0.7) * plan.half[1 - axis],
            half_way: chance.range(-0.5, 0.5) * plan.half[axis],
            side,
            rise: chance.range(0.5, 1.4),
        }
    }

    /// Corners of the pipe at `offset` from the bank's first.
    fn corners(&self, offset: f32, radius: f32, chance: &mut Chance) -> Vec<Vec3> {
        let (y, t) = (self.level + radius, self.first + offset);
        let at = |s: f32, y: f32, t: f32| {
            if self.axis == 0 { Vec3::new(s, y, t) } else { Vec3::new(t, y, s) }
        };
        let [from, to] = self.reach;
        let nested = self.half_way - self.side * offset;
        let start = at(from, y, t);
        match self.course {
            Course::Straight => vec![start, at(to, y, t)],
            Course::Turn => vec![start, at(nested, y, t), at(nested, y, self.reach[1].abs())],
            Course::Drop => {
                let s = chance.range(-0.8, 0.8) * to.abs();
                let low = self.below + 0.02;
                if chance.happens(0.5) {
                    vec![start, at(s, y, t), at(s, low, t)]
                } else {
                    let knee = (self.below + chance.range(0.5, 1.2)).min(y - 0.8);
                    vec![start, at(s, y, t), at(s, knee, t), at(to, knee, t)]
                }
            }
            Course::Step => {
                vec![start, at(nested, y, t), at(nested, y + self.rise, t), at(to, y + self.rise, t)]
            }
            Course::Loop => {
                let (near, back, out) =
                    (self.half_way - offset, self.half_way + 1.0 + offset, t + self.rise + 1.0);
                let (near, back) = if self.side > 0.0 { (near, back) } else { (back, near) };
                vec![start, at(near, y, t), at(near, y, out), at(back, y, out), at(back, y, t), at(to, y, t)]
            }
        }
    }
}

/// Whether a pipe passes all upright vessels.
fn is_free(plan: &Plan, corners: &[Vec3], radius: f32) -> bool {
    corners.windows(2).all(|pair| {
        let pieces = ((pair[1] - pair[0]).length() / 0.3).ceil() as u32;
        (0..=pieces).all(|i| {
            let p = pair[0].lerp(pair[1], i as f32 / pieces.max(1) as f32);
            !plan.is_hole(Vec2::new(p.x, p.z), radius + 0.05) && p.y > radius
        })
    })
}

/// The pipe with what sits on it.
fn pipe(
    pile: &mut Pile,
    f: &Finishes,
    plan: &Plan,
    corners: &[Vec3],
    [radius, outer]: [f32; 2],
    chance: &mut Chance,
) {
    let insulated = outer > radius;
    let kind = if insulated { 4 } else { [0, 1, 2, 3, 5, 5, 5, 4][chance.below(8) as usize] };
    let material = f.pipes[kind];
    let path = tube::rounded_path(corners, 2.6 * outer + 0.05, 10);
    if insulated {
        pile.add(material, &jacket(&path, outer, chance));
    } else {
        let sides = if radius > 0.06 { 36 } else { 24 };
        pile.add(material, &tube::tube(&path, radius, sides));
    }
    for (end, before) in [(0, 1), (corners.len() - 1, corners.len() - 2)] {
        if corners[end].y == corners[before].y {
            flanges(pile, f, &stand(corners[end], corners[end] - corners[before]), outer, chance);
        }
    }
    for pair in corners.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let (length, along) = ((to - from).length(), (to - from).normalize_or(Vec3::X));
        let clear = 4.0 * outer + 0.15;
        if length < 2.0 * clear + 0.4 {
            continue;
        }
        let place = |s: f32| stand(from + along * s, along);
        if !insulated {
            for s in [clear * 0.8, length - clear * 0.8] {
                weld(pile, material, &place(s), radius, chance);
            }
        }
        let mut s = clear + chance.range(0.1, 0.5) * (length - 2.0 * clear);
        while s < length - clear {
            if chance.happens(0.2) && length > 12.0 * radius + 1.0 {
                valve(pile, f, &place(s), outer, chance);
            } else {
                flanges(pile, f, &place(s), outer, chance);
            }
            s += chance.range(3.5, 8.0) + 6.0 * radius;
        }
        if along.y.abs() < 0.1 && !plan.decked {
            for s in 1..(length / 3.0) as u32 {
                shoe(
                    pile,
                    f,
                    from + along * (3.0 * s as f32 + chance.range(-0.1, 0.1)),
                    along,
                    outer,
                    chance,
                );
            }
        }
    }
}

/// Sheet metal around insulation: rings close to each other, bands over the joints.
fn jacket(path: &[Vec3], radius: f32, chance: &mut Chance) -> crate::generate::shape::Shape {
    const STEP: f32 = 0.1;
    let mut fine: Vec<Vec3> = Vec::new();
    for pair in path.windows(2) {
        let pieces = ((pair[1] - pair[0]).length() / STEP).ceil().max(1.0) as u32;
        fine.extend((0..pieces).map(|i| pair[0].lerp(pair[1], i as f32 / pieces as f32)));
    }
    fine.extend(path.last());
    let joint = 9 + chance.below(4) as usize;
    let radii: Vec<f32> = (0..fine.len())
        .map(|i| radius + if i % joint == 0 { 0.005 } else { chance.range(-0.0015, 0.0015) })
        .collect();
    tube::tube_with_radii(&fine, &radii, 32)
}
