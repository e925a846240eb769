//! The kinds of bodies: their surfaces at any fineness, and the balls that stand for them when they meet.

use super::super::shape::Shape;
use super::super::solids;
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;
use vastlight_math::{Frame, Vec2, Vec3, real::sin_cos};

/// A form of about unit size around the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Kind {
    Ball,
    Ring,
    Cube,
    Knot,
}

/// Radii of the ring's middle line and of its tube; half the cube's edge and the radius of its rounding; the knot's size and its
/// tube's radius.
const RING: (f32, f32) = (0.84, 0.3);
const CUBE: (f32, f32) = (0.78, 0.2);
const KNOT: (f32, f32) = (0.31, 0.2);

impl Kind {
    pub(super) const ALL: [Self; 4] = [Self::Ball, Self::Ring, Self::Cube, Self::Knot];

    /// The distance from the middle that nothing is beyond.
    pub(super) const REACH: f32 = 1.21;

    /// Moment of inertia of a unit of mass.
    pub(super) const fn inertia(self) -> f32 {
        match self {
            Self::Ball => 0.4,
            Self::Ring => 0.6,
            Self::Cube | Self::Knot => 0.45,
        }
    }

    /// The surface with about so many triangles, closed.
    pub(super) fn surface(self, triangles: u64) -> Shape {
        let half = |around: u64| (triangles + around) / (2 * around);
        let root = |share: f64| (triangles as f64 * share).sqrt().round() as u64;
        match self {
            Self::Ball => {
                let rings = root(0.25).max(3);
                let sectors = ((triangles + rings - 1) / (2 * (rings - 1))).max(3);
                solids::ellipsoid(Vec3::ONE, rings as u32, sectors as u32)
            }
            Self::Ring => {
                let around = root(0.19).max(3);
                hose(half(around).max(3) as u32, around as u32, RING.1, ring)
            }
            Self::Cube => rounded_cube(((triangles as f64 / 12.0).sqrt().round() as u32).max(1)),
            Self::Knot => {
                let around = root(0.055).max(3);
                hose(half(around).max(12) as u32, around as u32, KNOT.1, knot)
            }
        }
    }

    /// Middles and radii of balls that fill the form nearly.
    pub(super) fn balls(self) -> Vec<(Vec3, f32)> {
        let along = |count: u32, radius: f32, line: fn(f32) -> Vec3| {
            (0..count).map(|i| (line(i as f32 / count as f32), radius)).collect()
        };
        match self {
            Self::Ball => vec![(Vec3::ZERO, 1.0)],
            Self::Ring => along(12, RING.1, ring),
            Self::Knot => along(22, KNOT.1, knot),
            Self::Cube => {
                let inner = CUBE.0 - CUBE.1;
                let mut balls = vec![(Vec3::ZERO, CUBE.0)];
                for i in 0..27 {
                    let p = Vec3::new((i % 3 - 1) as f32, (i / 3 % 3 - 1) as f32, (i / 9 - 1) as f32);
                    // Corners and the middles of edges.
                    if p.length_squared() > 1.5 {
                        balls.push((p * inner, CUBE.1));
                    }
                }
                balls
            }
        }
    }
}

/// The ring's middle line.
fn ring(t: f32) -> Vec3 {
    let (s, c) = sin_cos(TAU * t);
    Vec3::new(c, 0.0, s) * RING.0
}

/// The knot's middle line: a trefoil.
fn knot(t: f32) -> Vec3 {
    let ((s1, c1), (s2, c2), (s3, _)) = (sin_cos(TAU * t), sin_cos(2.0 * TAU * t), sin_cos(3.0 * TAU * t));
    Vec3::new(s1 + 2.0 * s2, c1 - 2.0 * c2, -s3) * KNOT.0
}

/// A tube around a closed line.
fn hose(pieces: u32, sides: u32, radius: f32, line: fn(f32) -> Vec3) -> Shape {
    let mut shape = Shape::default();
    for piece in 0..=pieces {
        let t = (piece % pieces) as f32 / pieces as f32;
        let tangent = (line(t + 1e-3) - line(t - 1e-3)).normalize_or(Vec3::X);
        // Away from the axis: it comes back after a turn, as a frame carried along would not.
        let frame = Frame::from_z_and_tangent(tangent, line(t) + Vec3::Y * 1e-3);
        for side in 0..=sides {
            let (s, c) = sin_cos(TAU * (side % sides) as f32 / sides as f32);
            let normal = frame.x * c + frame.y * s;
            let uv = Vec2::new(piece as f32 / pieces as f32, side as f32 / sides as f32);
            shape.vertex(line(t) + normal * radius, normal, uv);
        }
    }
    for piece in 0..pieces {
        for side in 0..sides {
            let a = piece * (sides + 1) + side;
            shape.quad(a, a + 1, a + sides + 2, a + sides + 1);
        }
    }
    shape
}

/// A cube with round edges: `cells` x `cells` cells on each side, half of them in the rounding.
fn rounded_cube(cells: u32) -> Shape {
    let (half, round) = CUBE;
    let inner = (half - round) / half;
    let along = |i: u32| {
        let x = 2.0 * i as f32 / cells as f32 - 1.0;
        if x.abs() < 0.5 {
            2.0 * x * inner
        } else {
            x.signum() * (inner + (2.0 * x.abs() - 1.0) * (1.0 - inner))
        }
    };
    let mut shape = Shape::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let face = solids::grid(cells, cells, |u, v| {
                let index = |x: f32| (x * cells as f32).round() as u32;
                let mut p = Vec3::ZERO;
                p[axis] = side;
                p[(axis + 1) % 3] = along(index(v));
                p[(axis + 2) % 3] = along(index(u)) * side;
                let core = p.clamp(Vec3::splat(-inner), Vec3::splat(inner));
                let normal = (p - core).normalize_or(Vec3::Y);
                (core * half + normal * round, normal)
            });
            shape.merge(&face);
        }
    }
    shape
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_have_their_size_and_face_outwards() {
        for kind in Kind::ALL {
            for triangles in [100, 500, 5000] {
                let shape = kind.surface(triangles);
                let made = shape.triangles.len() as u64;
                assert!(made.abs_diff(triangles) * 4 <= triangles, "{kind:?}: {made} for {triangles}");
                assert!(shape.positions.iter().all(|p| p.length() <= Kind::REACH), "{kind:?}");
                for t in &shape.triangles {
                    let [a, b, c] = t.map(|i| shape.positions[i as usize]);
                    let face = (b - a).cross(c - a);
                    let normal: Vec3 = t.iter().map(|&i| shape.normals[i as usize]).sum();
                    assert!(face.dot(normal) > 0.0, "{kind:?} of {triangles}: {t:?}");
                }
            }
        }
    }

    #[test]
    fn balls_fill_the_form() {
        for kind in Kind::ALL {
            let balls = kind.balls();
            let gap = |p: Vec3| balls.iter().map(|(c, r)| (p - *c).length() - r).fold(f32::MAX, f32::min);
            let shape = kind.surface(5000);
            let worst = shape.positions.iter().map(|&p| gap(p)).fold(0.0, f32::max);
            assert!(worst < 0.2, "{kind:?}: {worst}");
            let furthest = balls.iter().map(|(c, r)| c.length() + r).fold(0.0, f32::max);
            assert!(furthest <= Kind::REACH, "{kind:?}: {furthest}");
        }
    }
}
