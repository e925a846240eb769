//! The fine grid over the coarse one: bicubic uniform B-splines, so that a few thousand points bear any number of triangles, and
//! normals from the fine grid itself.

use super::BALL;
use super::drape::{Key, POINTS, THICKNESS};
use rayon::prelude::*;
use vastlight_math::Vec3;

/// A fine vertex stays this far from ball and floor.
const GAP: f32 = 0.5 * THICKNESS;

/// Positions and normals of `columns + 1` by `rows + 1` vertices over the points.
pub(super) fn surface(points: &Key, columns: usize, rows: usize) -> (Vec<Vec3>, Vec<Vec3>) {
    // Rows of points, each at all fine columns; then those at all fine rows.
    let across: Vec<Vec<Vec3>> = points
        .par_chunks(POINTS)
        .map(|row| (0..=columns).map(|i| spline(|j| row[j], i as f32 / columns as f32)).collect())
        .collect();
    let mut positions = vec![Vec3::ZERO; (columns + 1) * (rows + 1)];
    positions.par_chunks_mut(columns + 1).enumerate().for_each(|(row, positions)| {
        let v = row as f32 / rows as f32;
        for (column, p) in positions.iter_mut().enumerate() {
            *p = outside(spline(|j| across[j][column], v));
        }
    });
    let normals = normals(&positions, columns, rows);
    (positions, normals)
}

/// The curve over evenly spaced points at `t` from 0 to 1; it goes through both ends.
fn spline(point: impl Fn(usize) -> Vec3, t: f32) -> Vec3 {
    let x = t * (POINTS - 1) as f32;
    let cell = (x as usize).min(POINTS - 2);
    let t = x - cell as f32;
    let (b, c) = (point(cell), point(cell + 1));
    let a = if cell > 0 { point(cell - 1) } else { b * 2.0 - c };
    let d = if cell + 2 < POINTS { point(cell + 2) } else { c * 2.0 - b };
    let s = 1.0 - t;
    let (t2, t3) = (t * t, t * t * t);
    let weights = [s * s * s, 3.0 * t3 - 6.0 * t2 + 4.0, -3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0, t3];
    (a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3]) / 6.0
}

/// Out of ball and floor.
fn outside(p: Vec3) -> Vec3 {
    let (center, radius) = BALL;
    let from_ball = p - center;
    let distance = from_ball.length();
    let p =
        if distance < radius + GAP { center + from_ball.normalize_or(Vec3::Y) * (radius + GAP) } else { p };
    p.with_y(p.y.max(GAP))
}

/// Normals from the neighbours in the grid.
fn normals(positions: &[Vec3], columns: usize, rows: usize) -> Vec<Vec3> {
    let width = columns + 1;
    let mut normals = vec![Vec3::Y; positions.len()];
    normals.par_chunks_mut(width).enumerate().for_each(|(row, normals)| {
        let (above, below) = (row.saturating_sub(1) * width, (row + 1).min(rows) * width);
        for (column, normal) in normals.iter_mut().enumerate() {
            let (left, right) = (column.saturating_sub(1), (column + 1).min(columns));
            let du = positions[row * width + right] - positions[row * width + left];
            let dv = positions[below + column] - positions[above + column];
            *normal = dv.cross(du).normalize_or(Vec3::Y);
        }
    });
    normals
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_keeps_planes_and_its_ends() {
        let line = |i: usize| Vec3::new(i as f32, 2.0 - i as f32 * 0.5, 0.25 * i as f32);
        for i in 0..=100 {
            let t = i as f32 / 100.0;
            let expected = Vec3::new(1.0, -0.5, 0.25) * t * (POINTS - 1) as f32 + Vec3::Y * 2.0;
            assert!((spline(line, t) - expected).length() < 1e-3, "{t}");
        }
        let bumpy = |i: usize| Vec3::Y * (i * i % 7) as f32;
        assert!((spline(bumpy, 0.0) - bumpy(0)).length() < 1e-6);
        assert!((spline(bumpy, 1.0) - bumpy(POINTS - 1)).length() < 1e-4);
    }
}
