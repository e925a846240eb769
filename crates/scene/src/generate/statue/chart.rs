//! The head's surface as radii over height and angle, found once by marching and read smoothly.

use super::form::{distance, hairline, nape};
use crate::generate::noise::{fbm, noise, smoothstep};
use rayon::prelude::*;
use std::f32::consts::TAU;
use std::sync::OnceLock;
use vastlight_math::{Vec2, Vec3, real::sin_cos};

const COLUMNS: usize = 640;
const ROWS: usize = 512;
/// Beyond every radius.
const OUTSIDE: f32 = 0.36;

/// Points (radius, height) by row (from the crown down, then in along the cut) and angle.
#[derive(Debug)]
pub(super) struct Chart {
    radii: Vec<f32>,
    /// Height of the crown; the cut is at 0.
    top: f32,
}

/// Part of the rows that run down the surface; the rest closes the cut below.
const SIDE: f32 = 0.94;

impl Chart {
    /// The chart; it is the same for every statue and made once.
    pub(super) fn shared() -> &'static Self {
        static CHART: OnceLock<Chart> = OnceLock::new();
        if let Some(chart) = CHART.get() {
            return chart;
        }
        // Not inside of the lock: a thread that waits for others may take up work that waits for the chart.
        let chart = Self::new();
        CHART.get_or_init(|| chart)
    }

    fn new() -> Self {
        let top = crown();
        let mut radii = vec![0.0; ROWS * COLUMNS];
        radii.par_chunks_mut(COLUMNS).enumerate().for_each(|(row, radii)| {
            let y = top * (1.0 - depth(row as f32 / (ROWS - 1) as f32));
            march_around(y, radii);
        });
        Self { radii, top }
    }

    /// The point where all angles meet: the crown at 0, the middle of the cut at 1.
    pub(super) fn pole(&self, v: f32) -> Vec3 {
        Vec3::new(0.0, if v < 0.5 { self.top } else { 0.0 }, AXIS_Z)
    }

    /// Position and normal at u (around) and v (crown to cut), the chisel's marks included.
    pub(super) fn vertex(&self, at: Vec2, seed: u32) -> (Vec3, Vec3) {
        let e = 0.35 / COLUMNS as f32;
        let p = self.marked(at, seed);
        let du = self.marked(at + Vec2::new(e, 0.0), seed) - self.marked(at - Vec2::new(e, 0.0), seed);
        let (low, high) = ((at.y - e).max(0.0), (at.y + e).min(1.0));
        let dv = self.marked(Vec2::new(at.x, high), seed) - self.marked(Vec2::new(at.x, low), seed);
        (p, dv.cross(du).normalize_or(Vec3::Y))
    }

    fn marked(&self, at: Vec2, seed: u32) -> Vec3 {
        let p = self.point(at);
        let out = (p - Vec3::new(0.0, p.y.clamp(0.1, 0.4), AXIS_Z)).normalize_or(Vec3::Y);
        p + out * marks(p, seed)
    }

    /// The smooth surface.
    fn point(&self, at: Vec2) -> Vec3 {
        let (s, c) = sin_cos(TAU * (at.x - at.x.floor()));
        let side = (at.y / SIDE).min(1.0);
        let inward = ((1.0 - at.y) / (1.0 - SIDE)).clamp(0.0, 1.0);
        let r = self.radius(at.x, side) * inward;
        Vec3::new(r * s, self.top * (1.0 - depth(side)), AXIS_Z + r * c)
    }

    /// Bicubic (Catmull and Rom) look-up.
    fn radius(&self, u: f32, v: f32) -> f32 {
        let (x, y) = ((u - u.floor()) * COLUMNS as f32, v.clamp(0.0, 1.0) * (ROWS - 1) as f32);
        let (cx, cy) = (x.floor(), y.floor());
        let (wx, wy) = (weights(x - cx), weights(y - cy));
        let mut sum = 0.0;
        for (j, &wy) in wy.iter().enumerate() {
            let row = (cy as usize + j).saturating_sub(1).min(ROWS - 1);
            for (i, &wx) in wx.iter().enumerate() {
                let column = (cx as usize + COLUMNS + i - 1) % COLUMNS;
                sum += wx * wy * self.radii[row * COLUMNS + column];
            }
        }
        sum.max(0.0)
    }
}

/// The axis stands behind the face's middle.
const AXIS_Z: f32 = -0.02;

fn weights(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

/// How far down a row is, from 0 (crown) to 1 (cut): rows crowd at the crown, where the surface lies flat.
fn depth(v: f32) -> f32 {
    0.45 * v + 0.55 * (1.0 - (1.0 - v * v).max(0.0).sqrt())
}

/// The crown: where the axis leaves the form.
fn crown() -> f32 {
    let (mut low, mut high) = (0.3, 0.8);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if distance(Vec3::new(0.0, middle, AXIS_Z)) < 0.0 { low = middle } else { high = middle }
    }
    low
}

/// Radii of the outermost surface at this height, angle by angle.
fn march_around(y: f32, radii: &mut [f32]) {
    let mut start = OUTSIDE;
    for (column, radius) in radii.iter_mut().enumerate() {
        let (s, c) = sin_cos(TAU * column as f32 / COLUMNS as f32);
        let gap = |r: f32| distance(Vec3::new(r * s, y, AXIS_Z + r * c));
        // The neighbour's radius is near, unless the surface has come out by more than the margin.
        if gap(start) <= 0.0 {
            start = OUTSIDE;
        }
        *radius = march(gap, start);
        start = (*radius + 0.03).min(OUTSIDE);
    }
}

/// From `start` towards the axis until the surface is met; 0 if it is not.
fn march(gap: impl Fn(f32) -> f32, start: f32) -> f32 {
    let mut r = start;
    for _ in 0..90 {
        let d = gap(r);
        if d < 2e-5 {
            break;
        }
        r -= d * 0.7;
        if r <= 0.0 {
            return 0.0;
        }
    }
    r
}

/// Curls in the hair, pits and chisel marks elsewhere; metres along the normal.
fn marks(p: Vec3, seed: u32) -> f32 {
    let (line, nape) = (hairline(p), nape(p));
    let hair = smoothstep(0.004, 0.02, line)
        * smoothstep(0.0, -0.015, nape)
        * smoothstep(0.006, 0.012, (line * 0.72 - 0.050).abs());
    let swirl = Vec3::new(p.x, p.y, p.z) * 26.0 + Vec3::splat(0.9 * noise(p * 22.0, seed));
    let strands =
        sin_cos(swirl.y * 3.4 + 2.6 * noise(swirl, seed + 1) + 1.8 * sin_cos(swirl.x * 1.3 + swirl.z).0).0;
    let curls = 0.0032 * strands + 0.0009 * sin_cos(strands * 3.0 + swirl.y * 14.0).0;
    let chisel = 0.00016 * fbm(p * 210.0, 4, 0.6, seed + 2);
    let worn = 0.0008 * fbm(p * 19.0, 3, 0.5, seed + 3);
    let pits = -0.0005 * smoothstep(0.42, 0.7, noise(p * 95.0, seed + 4));
    hair * curls + chisel + worn + pits
}
