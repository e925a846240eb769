//! A density over directions, proportional to the luminance of a latitude-longitude grid.
//!
//! A cell is found by inverting cumulative sums, first of rows, then within the row, which keeps the stratification of
//! the random numbers; the point is then spread around the cell's centre like a tent that reaches the neighbours'
//! centres. The density is therefore exactly the *bilinear* interpolant of the cells' weights: wherever a bilinear
//! lookup of the same image is not black, the density is not zero.
//!
//! The upper and lower half are weighted by how much of each a surface sees, so that the ground, say, does not spend
//! samples on the sky's dark half.

use crate::words::Words;
use std::f32::consts::{PI, TAU};
use vastlight_math::real::{acos, atan2, sin_cos};
use vastlight_math::{Vec2, Vec3, warp};

/// Direction of a point of the map, with v downwards from +y and u = 0.5 towards -z, growing towards +x; and the sine
/// of its polar angle.
#[inline]
pub(super) fn direction_of(uv: Vec2) -> (Vec3, f32) {
    let (sin_theta, cos_theta) = sin_cos(uv.y * PI);
    let (sin_phi, cos_phi) = sin_cos((uv.x - 0.5) * TAU);
    (Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi), sin_theta.max(0.0))
}

/// The point of the map that shows a unit direction.
#[inline]
pub(super) fn uv_of(direction: Vec3) -> Vec2 {
    Vec2::new(0.5 + atan2(direction.x, -direction.z) / TAU, acos(direction.y) / PI)
}

/// The four cells around a point of the map and their weights; columns wrap, rows end at the poles.
#[inline]
pub(super) fn footprint(uv: Vec2, width: usize, height: usize) -> [(usize, usize, f32); 4] {
    let x = uv.x * width as f32 - 0.5;
    let y = (uv.y * height as f32 - 0.5).clamp(0.0, (height - 1) as f32);
    let (x0, y0) = (x.floor(), y.floor());
    let (s, t) = (x - x0, y - y0);
    let left = (x0 as i64).rem_euclid(width as i64) as usize;
    let right = if left + 1 == width { 0 } else { left + 1 };
    let top = (y0 as usize).min(height - 1);
    let bottom = (top + 1).min(height - 1);
    [
        (left, top, (1.0 - s) * (1.0 - t)),
        (right, top, s * (1.0 - t)),
        (left, bottom, (1.0 - s) * t),
        (right, bottom, s * t),
    ]
}

/// A density over the sphere on a latitude-longitude grid.
#[derive(Clone, Debug)]
pub(super) struct DirectionGrid {
    width: usize,
    height: usize,
    /// Luminance times the sine of the polar angle, rows from the top.
    weights: Vec<f32>,
    /// Running sums within each row, the last of a row is 1 (0 for a black row).
    columns: Vec<f32>,
    /// Running sums over rows, starting anew at the middle; the last of each half is 1 (0 for a black half).
    rows: Vec<f32>,
    /// Sum of the weights of the upper and the lower half.
    sums: [f32; 2],
}

/// The share of samples for the upper half, and what a weight is worth in either half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Halves {
    upper: f32,
    scale: [f32; 2],
}

impl DirectionGrid {
    /// A grid of `width` x `height` cells with the given luminance at each cell's centre.
    pub(super) fn new(width: usize, height: usize, luminance: impl Fn(usize, usize) -> f32) -> Self {
        let mut weights = Vec::with_capacity(width * height);
        for y in 0..height {
            let sin_theta = sin_cos((y as f32 + 0.5) / height as f32 * PI).0;
            weights.extend((0..width).map(|x| luminance(x, y).max(0.0) * sin_theta));
        }
        let mut grid = Self { width, height, weights, columns: Vec::new(), rows: Vec::new(), sums: [0.0; 2] };
        let row_sums = grid.accumulate_columns();
        let (upper, lower) = row_sums.split_at(height / 2);
        for (half, sums) in [upper, lower].into_iter().enumerate() {
            grid.sums[half] = append_running_sums(sums, &mut grid.rows) as f32;
        }
        grid
    }

    fn accumulate_columns(&mut self) -> Vec<f64> {
        let mut columns = Vec::with_capacity(self.weights.len());
        let sums = self
            .weights
            .chunks(self.width)
            .map(|row| {
                let row: Vec<f64> = row.iter().map(|&w| f64::from(w)).collect();
                append_running_sums(&row, &mut columns)
            })
            .collect();
        self.columns = columns;
        sums
    }

    /// The integral of the luminance over the upper and the lower half of the sphere.
    pub(super) fn integrals(&self) -> [f32; 2] {
        let cell = TAU * PI / (self.width * self.height) as f32;
        self.sums.map(|s| s * cell)
    }

    /// Appends the grid: width, height, sums of the halves, weights, running sums within rows, and over rows. Gives its
    /// word.
    pub(super) fn pack(&self, words: &mut Words) -> u32 {
        let start = words.offset();
        words.u32s(&[self.width as u32, self.height as u32]);
        [&self.sums[..], &self.weights, &self.columns, &self.rows]
            .into_iter()
            .for_each(|part| words.f32s(part));
        start
    }

    pub(super) fn bytes(&self) -> usize {
        (self.weights.len() + self.columns.len() + self.rows.len()) * 4
    }

    /// How the halves are weighted for a surface with this normal (zero: facing any way).
    #[inline]
    pub(super) fn halves(&self, normal: Vec3) -> Halves {
        let lift = if normal == Vec3::ZERO { 0.0 } else { normal.y.clamp(-1.0, 1.0) };
        let (up, down) = (self.sums[0] * (1.0 + lift), self.sums[1] * (1.0 - lift));
        let upper = if up + down > 0.0 { up / (up + down) } else { 0.0 };
        let share = |p: f32, sum: f32| if sum > 0.0 { p / sum } else { 0.0 };
        let lower = if down > 0.0 { 1.0 - upper } else { 0.0 };
        Halves { upper, scale: [share(upper, self.sums[0]), share(lower, self.sums[1])] }
    }

    /// A point of the map; `None` if all is black.
    #[inline]
    pub(super) fn sample(&self, halves: &Halves, u: Vec2) -> Option<Vec2> {
        let middle = self.height / 2;
        let (rows, first, uy) = if u.y < halves.upper {
            (&self.rows[..middle], 0, u.y / halves.upper)
        } else {
            (&self.rows[middle..], middle, (u.y - halves.upper) / (1.0 - halves.upper))
        };
        let (row, v) = invert(rows, uy)?;
        let y = first + row;
        let (x, s) = invert(&self.columns[y * self.width..(y + 1) * self.width], u.x)?;
        let u = (x as f32 + 0.5 + warp::tent(s)) / self.width as f32;
        let v = (y as f32 + 0.5 + warp::tent(v)) / self.height as f32;
        // Over the pole means back on the same side: the lookup clamps there, and so does the density.
        let v = if v > 1.0 { 2.0 - v } else { v.abs() };
        Some(Vec2::new(u.rem_euclid(1.0), v))
    }

    /// Density over the unit square of the map.
    #[inline]
    pub(super) fn density(&self, halves: &Halves, uv: Vec2) -> f32 {
        let middle = self.height / 2;
        let sum: f32 = footprint(uv, self.width, self.height)
            .iter()
            .map(|&(x, y, weight)| {
                weight * self.weights[y * self.width + x] * halves.scale[usize::from(y >= middle)]
            })
            .sum();
        sum * (self.width * self.height) as f32
    }
}

/// Appends the running sums of `values`, scaled so that the last is 1; returns the unscaled total.
fn append_running_sums(values: &[f64], sums: &mut Vec<f32>) -> f64 {
    let total: f64 = values.iter().sum();
    let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
    let mut running = 0.0;
    sums.extend(values.iter().map(|v| {
        running += v;
        (running * scale) as f32
    }));
    total
}

/// The first entry whose running sum exceeds `u`, and where in its step `u` lies, in [0, 1).
#[inline]
fn invert(sums: &[f32], u: f32) -> Option<(usize, f32)> {
    let last = *sums.last()?;
    if last <= 0.0 {
        return None;
    }
    let index = sums.partition_point(|&s| s <= u.min(last * 0.999_999_9)).min(sums.len() - 1);
    let below = if index == 0 { 0.0 } else { sums[index - 1] };
    let width = sums[index] - below;
    let rest = if width > 0.0 { ((u - below) / width).clamp(0.0, 0.999_999_9) } else { 0.5 };
    Some((index, rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Rng;
    use vastlight_math::stats::{SphereGrid, sphere_chi_square_with};

    /// Luminance with black regions, a peak, and different halves.
    fn spotted(x: usize, y: usize) -> f32 {
        match (x, y) {
            (5, 3) => 40.0,
            (x, y) if (x + y) % 5 == 0 => 0.0,
            (_, y) if y >= 8 => 0.3,
            (x, y) => 1.0 + ((x * 7 + y * 3) % 4) as f32,
        }
    }

    fn probability(grid: &DirectionGrid, normal: Vec3, tilt: f32) -> f64 {
        let halves = grid.halves(normal);
        let mut rng = Rng::new(9);
        // The test's grid around z must not share edges with the map's around y.
        let turn = vastlight_math::Quat::from_rotation_x(1.1);
        let density = |d: Vec3| {
            let uv = uv_of(turn.inverse() * d);
            let sin_theta = direction_of(uv).1.max(1e-6);
            grid.density(&halves, uv) / (2.0 * PI * PI * sin_theta) * (1.0 + tilt * d.y)
        };
        let sample = |_| Some(turn * direction_of(grid.sample(&halves, rng.next_2d())?).0);
        let cells = SphereGrid { quadrature: 40, ..SphereGrid::default() };
        let test = sphere_chi_square_with(cells, 60_000, sample, density);
        assert!(tilt != 0.0 || (test.density_integral - 1.0).abs() < 5e-3, "{test:?}");
        test.p
    }

    #[test]
    fn samples_follow_the_density() {
        let grid = DirectionGrid::new(32, 16, spotted);
        for normal in [Vec3::ZERO, Vec3::Y, Vec3::NEG_Y, Vec3::new(0.6, 0.8, 0.0)] {
            let p = probability(&grid, normal, 0.0);
            assert!(p > 1e-3, "{normal}: {p}");
        }
        let odd = DirectionGrid::new(7, 5, spotted);
        assert!(probability(&odd, Vec3::Y, 0.0) > 1e-3);
        assert!(probability(&grid, Vec3::ZERO, 0.2) < 1e-6, "negative control");
    }

    #[test]
    fn tiny_and_black_grids_are_survived() {
        let halves = |g: &DirectionGrid| g.halves(Vec3::Y);
        let black = DirectionGrid::new(4, 4, |_, _| 0.0);
        assert!(black.sample(&halves(&black), Vec2::splat(0.5)).is_none());
        let one = DirectionGrid::new(1, 2, |_, _| 2.0);
        let uv = one.sample(&halves(&one), Vec2::new(0.2, 0.5)).expect("not black");
        assert!((one.density(&halves(&one), uv) - 2.0).abs() < 1e-6, "only the upper half");
    }

    #[test]
    fn directions_and_map_points_are_inverse() {
        for (direction, uv) in [
            (Vec3::NEG_Z, Vec2::new(0.5, 0.5)),
            (Vec3::X, Vec2::new(0.75, 0.5)),
            (Vec3::NEG_X, Vec2::new(0.25, 0.5)),
            (Vec3::new(0.0, 0.6, -0.8), Vec2::new(0.5, 0.295_167_23)),
        ] {
            assert!(uv_of(direction).distance(uv) < 1e-6, "{direction}");
            assert!(direction_of(uv).0.distance(direction) < 1e-6, "{direction}");
        }
    }
}
