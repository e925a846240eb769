//! Pipes with bends and flanges, laid until the triangles are used up; cables take the rest.

use super::{EAVES, FAR, Finishes, HALF_WIDTH, NEAR};
use crate::generate::builder::Builder;
use crate::generate::chance::Chance;
use crate::generate::shape::{Assembly, Shape, stand};
use crate::generate::{lathe, tube};
use vastlight_math::{Vec2, Vec3};

/// Sides of a cable and pieces along it; 2 * sides * pieces + 2 * (sides - 2) triangles.
const CABLE_SIDES: u32 = 4;
const CABLE_PIECES: u32 = 12;

/// Lays pipes and cables of about `triangles` triangles in total.
pub(super) fn pipes(b: &mut Builder, f: &Finishes, triangles: u64, chance: &Chance) {
    let for_pipes = triangles - triangles / 8;
    let mut used = 0;
    let mut runs: Vec<Assembly> = (0..f.pipes.len()).map(|_| Assembly::default()).collect();
    let mut number = 0;
    // More pipes are thinner pipes.
    let crowd = (triangles as f32 / 1_500_000.0).max(0.2).sqrt();
    loop {
        let mut chance = chance.part(number);
        number += 1;
        let kind = chance.below(f.pipes.len() as u32) as usize;
        let pipe = pipe(&mut chance, crowd);
        let count = pipe.triangles.len() as u64;
        if used + count > for_pipes {
            break;
        }
        used += count;
        runs[kind].add(f.pipes[kind], &pipe);
    }
    for run in runs {
        if run.triangles() > 0 {
            b.assembled("pipes", run);
        }
    }
    let mut cables = Assembly::default();
    let mut chance = chance.part(u64::MAX);
    let each = u64::from(2 * CABLE_SIDES * CABLE_PIECES + 2 * (CABLE_SIDES - 2));
    for _ in 0..(triangles - used) / each {
        cables.add(f.rubber, &cable(&mut chance));
    }
    b.assembled("cables", cables);
}

/// A place for a pipe: beside the walls, under the roof, over the floor; the middle stays free for the walkway.
fn slot(chance: &mut Chance) -> Vec2 {
    let side = if chance.happens(0.5) { -1.0 } else { 1.0 };
    match chance.below(5) {
        0 | 1 => Vec2::new(side * chance.range(8.2, HALF_WIDTH - 0.7), chance.range(0.4, 7.0)),
        2 => Vec2::new(side * chance.range(1.6, HALF_WIDTH - 1.2), chance.range(EAVES - 2.6, EAVES - 0.7)),
        3 => Vec2::new(side * chance.range(1.4, 3.6), chance.range(5.8, 8.2)),
        _ => Vec2::new(side * chance.range(1.3, 8.0), chance.range(0.12, 0.5)),
    }
}

/// A pipe that runs along the hall, changes its place now and then, and ends at a wall or in the floor.
fn pipe(chance: &mut Chance, crowd: f32) -> Shape {
    let radius = chance.range(0.03, 0.17) * chance.range(0.5, 1.0) / crowd;
    let sides = if radius > 0.06 { 28 } else { 16 };
    let start = chance.range(FAR + 6.0, NEAR - 1.0);
    let end = (start - chance.range(8.0, 40.0)).max(FAR + 0.1);
    let mut at = slot(chance);
    let mut corners = vec![at.extend(start)];
    if chance.happens(0.6) {
        corners.insert(0, Vec3::new(at.x, 0.0, start));
    }
    let mut z = start;
    for _ in 0..1 + chance.below(3) {
        z -= (start - end) * chance.range(0.15, 0.4);
        if z <= end + 1.0 {
            break;
        }
        let mut next = slot(chance);
        if next.y.min(at.y) < 5.4 {
            // Nothing crosses the walkway below a man's head.
            next.x = next.x.abs().copysign(at.x);
        }
        corners.extend([at.extend(z), Vec3::new(at.x, next.y, z), next.extend(z)]);
        at = next;
    }
    corners.push(at.extend(end));
    if chance.happens(0.5) {
        corners.push(Vec3::new(at.x, 0.0, end));
    }
    corners.dedup_by(|a, b| (*a - *b).length() < 8.0 * radius);
    if corners.len() < 2 {
        corners.push(corners[0] - Vec3::Z * 3.0);
    }
    let mut shape = tube::tube(&tube::rounded_path(&corners, 3.2 * radius, 8), radius, sides);
    flanges(&mut shape, &corners, radius, sides);
    shape
}

/// Pairs of flanges along the straight pieces.
fn flanges(shape: &mut Shape, corners: &[Vec3], radius: f32, sides: u32) {
    for pair in corners.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let length = (to - from).length();
        let count = (length / 4.5) as u32;
        for i in 0..count {
            let t = (i as f32 + 0.5) / count as f32;
            let place = stand(from.lerp(to, t), to - from);
            let (r, w) = (radius * 1.55, radius * 0.3);
            let profile = [
                [radius * 0.98, -w],
                [r, -w],
                [r, -0.06 * w],
                [radius * 1.2, 0.0],
                [r, 0.06 * w],
                [r, w],
                [radius * 0.98, w],
            ];
            shape.merge(&lathe::lathe(&profile.map(Vec2::from_array), sides).transformed(&place));
            for bolt in 0..8 {
                let (s, c) = vastlight_math::real::sin_cos(std::f32::consts::TAU * bolt as f32 / 8.0);
                let nut = lathe::cylinder(radius * 0.11, 2.7 * w, 6).at(
                    radius * 1.38 * c,
                    -1.35 * w,
                    radius * 1.38 * s,
                );
                shape.merge(&nut.transformed(&place));
            }
        }
    }
}

/// A cable that hangs between two places under the roof or along a wall.
fn cable(chance: &mut Chance) -> Shape {
    let side = if chance.happens(0.5) { -1.0 } else { 1.0 };
    let height = chance.range(7.2, EAVES - 0.4);
    let x = side * chance.range(2.0, HALF_WIDTH - 0.5);
    let z = chance.range(FAR + 7.0, NEAR - 0.5);
    let reach = if chance.happens(0.7) { Vec3::new(0.0, 0.0, -6.0) } else { Vec3::new(-2.0 * x, 0.0, 0.0) };
    let from = Vec3::new(x, height, z);
    let path = tube::hanging(from, from + reach, chance.range(0.05, 0.5), CABLE_PIECES);
    tube::tube(&path, chance.range(0.006, 0.016), CABLE_SIDES)
}
