//! A linen runner that lies across the table and falls over its front edge.

use crate::generate::noise::noise;
use crate::generate::shape::Shape;
use crate::generate::solids;
use vastlight_math::{Vec2, Vec3, real::sin_cos};

/// Length along the runner and its width.
const LENGTH: f32 = 1.25;
const WIDTH: f32 = 0.36;
/// Where along the runner the table's edge is.
const EDGE: f32 = 0.90;
/// Radius of the bend over the edge.
const BEND: f32 = 0.012;

/// The cloth, a little turned, on the left half of the table.
pub(super) fn runner(seed: u64) -> Shape {
    let seed = seed as u32;
    let point = |u: f32, v: f32| -> Vec3 {
        let (across, along) = ((u - 0.5) * WIDTH, v * LENGTH);
        let wave = noise(Vec3::new(across * 9.0 + along * 2.0, along * 5.0, 0.3), seed);
        let crease = noise(Vec3::new(across * 26.0, along * 11.0, 7.3), seed);
        let lift = 0.0015 + 0.006 * wave.max(0.0) * wave.max(0.0) + 0.0009 * (crease + 1.0).max(0.0);
        let (center, normal, hang) = bent(along);
        let ripple = sin_cos(across * 34.0 + 1.4 * wave).0 * 0.012 * hang;
        let sway = 0.012 * noise(Vec3::new(along * 3.0, 0.7, 0.0), seed + 5);
        center + normal * (lift + ripple) + Vec3::X * (across + sway)
    };
    let e = 1e-3;
    let mut shape = solids::grid(160, 420, |u, v| {
        let du = point(u + e, v) - point(u - e, v);
        let dv = point(u, v + e) - point(u, v - e);
        (point(u, v), dv.cross(du).normalize_or(Vec3::Y))
    });
    for uv in &mut shape.uvs {
        *uv *= Vec2::new(WIDTH, LENGTH);
    }
    shape.turned(-0.16).at(-0.30, 0.0, -0.49)
}

/// Centre line, outward normal and how much the cloth hangs, at a distance along the runner.
fn bent(along: f32) -> (Vec3, Vec3, f32) {
    let quarter = BEND * std::f32::consts::FRAC_PI_2;
    if along < EDGE {
        (Vec3::new(0.0, 0.0, along), Vec3::Y, 0.0)
    } else if along < EDGE + quarter {
        let (s, c) = sin_cos((along - EDGE) / BEND);
        (Vec3::new(0.0, BEND * (c - 1.0), EDGE + BEND * s), Vec3::new(0.0, c, s), 0.0)
    } else {
        let down = along - EDGE - quarter;
        (Vec3::new(0.0, -BEND - down, EDGE + BEND), Vec3::Z, (down * 8.0).min(1.0))
    }
}
