//! Surfaces of revolution about +y.

use super::shape::Shape;
use std::f32::consts::TAU;
use vastlight_math::{Vec2, Vec3, real::sin_cos};

/// Corners of the profile sharper than this (as a cosine) stay sharp.
const CREASE: f32 = 0.8;

/// Turns a profile of (radius, height) points around +y. The outside is on the right hand of someone who walks along
/// the profile upwards (so walk up the outside, then down the inside). A radius of 0 closes the surface; a profile
/// whose last point is its first is a ring.
pub(super) fn lathe(profile: &[Vec2], sectors: u32) -> Shape {
    let sectors = sectors.max(3);
    let normals = profile_normals(profile);
    let mut shape = Shape::default();
    let mut along = 0.0;
    for (i, segment) in profile.windows(2).enumerate() {
        let length = (segment[1] - segment[0]).length();
        if length > 0.0 {
            band(&mut shape, [segment[0], segment[1]], normals[i], [along, along + length], sectors);
        }
        along += length;
    }
    shape
}

/// One band between two profile points. Bands share no vertices: their normals may differ.
fn band(shape: &mut Shape, points: [Vec2; 2], normals: [Vec2; 2], along: [f32; 2], sectors: u32) {
    let first = shape.positions.len() as u32;
    let widest = points[0].x.max(points[1].x);
    for sector in 0..=sectors {
        let (s, c) = sin_cos(TAU * (sector % sectors) as f32 / sectors as f32);
        let around = |p: Vec2| Vec3::new(p.x * s, p.y, p.x * c);
        for end in 0..2 {
            let uv = Vec2::new(TAU * widest * sector as f32 / sectors as f32, along[end]);
            shape.vertex(around(points[end]), around(normals[end]).normalize_or(Vec3::Y), uv);
        }
    }
    for sector in 0..sectors {
        let low = first + 2 * sector;
        if points[0].x > 0.0 {
            shape.triangle(low, low + 2, low + 1);
        }
        if points[1].x > 0.0 {
            shape.triangle(low + 2, low + 3, low + 1);
        }
    }
}

/// Normals in the profile's plane at both ends of each segment, averaged with the neighbour's over gentle corners.
fn profile_normals(profile: &[Vec2]) -> Vec<[Vec2; 2]> {
    let faces: Vec<Vec2> = profile
        .windows(2)
        .map(|w| {
            let d = (w[1] - w[0]).normalize_or_zero();
            Vec2::new(d.y, -d.x)
        })
        .collect();
    let closed = profile.len() > 3 && profile.first() == profile.last();
    let neighbour = |i: usize, step: isize| -> Option<Vec2> {
        let n = faces.len() as isize;
        let j = i as isize + step;
        if closed {
            Some(faces[j.rem_euclid(n) as usize])
        } else {
            faces.get(usize::try_from(j).ok()?).copied()
        }
    };
    let smooth = |face: Vec2, other: Option<Vec2>| match other {
        Some(other) if face.dot(other) > CREASE => (face + other).normalize(),
        _ => face,
    };
    (0..faces.len())
        .map(|i| [smooth(faces[i], neighbour(i, -1)), smooth(faces[i], neighbour(i, 1))])
        .collect()
}

/// A smooth curve through `points` (Catmull and Rom), `steps` pieces between two of them.
pub(super) fn smooth_profile(points: &[Vec2], steps: u32) -> Vec<Vec2> {
    let n = points.len();
    let mut curve = Vec::with_capacity(n * steps as usize);
    for i in 0..n.saturating_sub(1) {
        let (p1, p2) = (points[i], points[i + 1]);
        let p0 = if i > 0 { points[i - 1] } else { p1 };
        let p3 = if i + 2 < n { points[i + 2] } else { p2 };
        for step in 0..steps {
            let t = step as f32 / steps as f32;
            let (t2, t3) = (t * t, t * t * t);
            let p = (p1 * 2.0
                + (p2 - p0) * t
                + (p0 * 2.0 - p1 * 5.0 + p2 * 4.0 - p3) * t2
                + (p1 * 3.0 - p0 - p2 * 3.0 + p3) * t3)
                * 0.5;
            curve.push(Vec2::new(p.x.max(0.0), p.y));
        }
    }
    curve.extend(points.last());
    curve
}

/// A closed cylinder of this radius from y = 0 to `height`.
pub(super) fn cylinder(radius: f32, height: f32, sectors: u32) -> Shape {
    let profile = [Vec2::ZERO, Vec2::new(radius, 0.0), Vec2::new(radius, height), Vec2::new(0.0, height)];
    lathe(&profile, sectors)
}
