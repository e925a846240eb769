//! Polygons to triangles: a fan where the polygon is convex, ear clipping where it is not.
//!
//! Ear clipping after Meisters, "Polygons have ears" (1975), on the plane of Newell's normal.

use std::sync::Arc;
use vastlight_math::{Vec2, Vec3};

/// Beyond this many corners a concave polygon would take too long; it becomes a fan.
const MAX_EAR_CORNERS: usize = 4096;

/// Scratch memory that is reused from polygon to polygon.
#[derive(Debug, Default)]
pub(crate) struct Triangulator {
    points: Vec<Vec2>,
    next: Vec<u32>,
    cuts: Cuts,
}

/// Where polygons of more than three corners are cut.
#[derive(Debug, Default)]
enum Cuts {
    /// Where their own corners say.
    #[default]
    Own,
    /// There too, and the triangles are kept.
    Kept(Vec<[u32; 3]>),
    /// Where those of another file were cut, of which so many triangles are used.
    Other(Arc<[[u32; 3]]>, usize),
}

impl Triangulator {
    /// For the first of several files of the same polygons in several shapes.
    pub(crate) fn first_of_many() -> Self {
        Self { cuts: Cuts::Kept(Vec::new()), ..Self::default() }
    }

    /// For the others: polygons are cut as in the first file, if they have as many corners.
    pub(crate) fn like(cuts: &Arc<[[u32; 3]]>) -> Self {
        Self { cuts: Cuts::Other(Arc::clone(cuts), 0), ..Self::default() }
    }

    /// Whether files of several shapes must have the same triangles.
    pub(crate) fn is_of_many(&self) -> bool {
        !matches!(self.cuts, Cuts::Own)
    }

    /// How the polygons of the first file were cut.
    pub(crate) fn into_cuts(self) -> Arc<[[u32; 3]]> {
        if let Cuts::Kept(triangles) = self.cuts { triangles.into() } else { Arc::default() }
    }

    /// Cuts a polygon as that of another file; whether there is one with so many corners.
    fn repeat(&mut self, corners: usize, emit: &mut impl FnMut([u32; 3])) -> bool {
        let Cuts::Other(triangles, used) = &mut self.cuts else { return false };
        let Some(cut) = triangles.get(*used..*used + corners - 2) else { return false };
        *used += cut.len();
        let fits = cut.iter().flatten().all(|&corner| (corner as usize) < corners);
        if fits {
            cut.iter().for_each(|&triangle| emit(triangle));
        }
        fits
    }

    /// Calls `emit` with the corners (numbers in `0..corners.len()`) of each triangle; the winding stays. Always emits
    /// `corners.len() - 2` triangles (none for fewer than 3 corners), degenerate ones where the polygon is degenerate.
    pub(crate) fn triangulate(&mut self, corners: &[Vec3], mut emit: impl FnMut([u32; 3])) {
        if corners.len() < 4 {
            if corners.len() == 3 {
                emit([0, 1, 2]);
            }
            return;
        }
        if self.repeat(corners.len(), &mut emit) {
            return;
        }
        let mut kept = if let Cuts::Kept(kept) = &mut self.cuts { Some(std::mem::take(kept)) } else { None };
        self.cut(corners, |triangle| {
            kept.iter_mut().for_each(|kept| kept.push(triangle));
            emit(triangle);
        });
        if let Some(kept) = kept {
            self.cuts = Cuts::Kept(kept);
        }
    }

    /// Cuts a polygon of more than three corners.
    fn cut(&mut self, corners: &[Vec3], mut emit: impl FnMut([u32; 3])) {
        match corners.len() {
            4 => quad(corners, emit),
            n => {
                self.project(corners);
                if n > MAX_EAR_CORNERS || is_convex(&self.points) {
                    fan(n, emit);
                } else {
                    self.clip_ears(&mut emit);
                }
            }
        }
    }

    /// Drops the axis along which the polygon is thinnest, so that a counter-clockwise polygon stays so.
    fn project(&mut self, corners: &[Vec3]) {
        let n = newell_normal(corners);
        let a = n.abs();
        let pick = |p: &Vec3| {
            if a.x >= a.y && a.x >= a.z {
                Vec2::new(p.y, p.z * n.x.signum())
            } else if a.y >= a.z {
                Vec2::new(p.z, p.x * n.y.signum())
            } else {
                Vec2::new(p.x, p.y * n.z.signum())
            }
        };
        self.points.clear();
        self.points.extend(corners.iter().map(pick));
    }

    fn clip_ears(&mut self, emit: &mut impl FnMut([u32; 3])) {
        let count = self.points.len() as u32;
        self.next.clear();
        self.next.extend((1..count).chain([0]));
        let (mut previous, mut left, mut tries) = (count - 1, count, 0);
        while left > 3 {
            let ear = self.next[previous as usize];
            let after = self.next[ear as usize];
            // When no ear is left (the polygon crosses itself), corners are cut as they come.
            if tries > left || self.is_ear(previous, ear, after) {
                emit([previous, ear, after]);
                self.next[previous as usize] = after;
                left -= 1;
                tries = 0;
            } else {
                previous = ear;
                tries += 1;
            }
        }
        let second = self.next[previous as usize];
        emit([previous, second, self.next[second as usize]]);
    }

    fn is_ear(&self, a: u32, b: u32, c: u32) -> bool {
        let [pa, pb, pc] = [a, b, c].map(|i| self.points[i as usize]);
        if turn(pa, pb, pc) <= 0.0 {
            return false;
        }
        let mut other = self.next[c as usize];
        while other != a {
            let p = self.points[other as usize];
            let inside = turn(pa, pb, p) >= 0.0 && turn(pb, pc, p) >= 0.0 && turn(pc, pa, p) >= 0.0;
            if inside && p != pa && p != pb && p != pc {
                return false;
            }
            other = self.next[other as usize];
        }
        true
    }
}

/// Twice the signed area of a triangle; f64, so that f32 input makes no wrong signs.
fn turn(a: Vec2, b: Vec2, c: Vec2) -> f64 {
    let (a, b, c) = (a.as_dvec2(), b.as_dvec2(), c.as_dvec2());
    (b - a).perp_dot(c - a)
}

fn is_convex(points: &[Vec2]) -> bool {
    let n = points.len();
    let turns_left = |i: usize| turn(points[i], points[(i + 1) % n], points[(i + 2) % n]) >= 0.0;
    // A star polygon turns left everywhere too, but goes around more than once: its fan has clockwise triangles.
    (0..n).all(turns_left) && (1..n - 1).all(|i| turn(points[0], points[i], points[i + 1]) >= 0.0)
}

fn fan(corners: usize, mut emit: impl FnMut([u32; 3])) {
    for i in 1..corners as u32 - 1 {
        emit([0, i, i + 1]);
    }
}

/// Splits at the diagonal 0-2 unless only 1-3 lies inside.
fn quad(p: &[Vec3], mut emit: impl FnMut([u32; 3])) {
    let half = |a: usize, b: usize, c: usize| (p[b] - p[a]).cross(p[c] - p[a]);
    let folded = |first: Vec3, second: Vec3| first.dot(second) < 0.0;
    if folded(half(0, 1, 2), half(0, 2, 3)) && !folded(half(1, 2, 3), half(1, 3, 0)) {
        emit([1, 2, 3]);
        emit([1, 3, 0]);
    } else {
        emit([0, 1, 2]);
        emit([0, 2, 3]);
    }
}

/// Sum of the edges' cross products: twice the area along the normal, also for concave and bent polygons.
fn newell_normal(corners: &[Vec3]) -> Vec3 {
    let origin = corners[0];
    corners.windows(2).fold(Vec3::ZERO, |sum, w| sum + (w[0] - origin).cross(w[1] - origin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn triangles(corners: &[Vec3]) -> Vec<[u32; 3]> {
        let mut out = Vec::new();
        Triangulator::default().triangulate(corners, |t| out.push(t));
        out
    }

    fn flat(points: &[[f32; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect()
    }

    /// Signed areas along +z.
    fn areas(corners: &[Vec3], triangles: &[[u32; 3]]) -> Vec<f32> {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            (b - a).cross(c - a).z * 0.5
        };
        triangles.iter().map(area).collect()
    }

    #[test]
    fn concave_quads_split_inside() {
        let arrow = [[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]];
        for turn in 0..4 {
            let mut points = arrow;
            points.rotate_left(turn);
            let corners = flat(&points);
            let areas = areas(&corners, &triangles(&corners));
            assert!(areas.iter().all(|&a| a * areas[0] > 0.0), "{areas:?}");
        }
    }

    #[test]
    fn stars_and_combs_are_covered_once() {
        let star: Vec<Vec3> = (0..40)
            .map(|i| {
                let (s, c) = (i as f32 * std::f32::consts::TAU / 40.0).sin_cos();
                let radius = if i % 2 == 0 { 2.0 } else { 0.5 };
                Vec3::new(c * radius, s * radius, 0.0)
            })
            .collect();
        let expected = 0.5 * newell_normal(&star).z;
        let found = areas(&star, &triangles(&star));
        assert_eq!(found.len(), 38);
        assert!(found.iter().all(|&a| a >= 0.0));
        assert!((found.iter().sum::<f32>() - expected).abs() < 1e-4);
        // Negative control: a fan of the same star covers points outside of it.
        let mut fanned = Vec::new();
        fan(star.len(), |t| fanned.push(t));
        assert!(areas(&star, &fanned).iter().any(|&a| a < -1e-3));
    }

    #[test]
    fn winding_stays_on_every_plane() {
        let l_shape = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        for axis in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            let (u, v) = axis.any_orthonormal_pair();
            let v = if u.cross(v).dot(axis) > 0.0 { v } else { -v };
            let corners: Vec<Vec3> = l_shape.iter().map(|p| u * p[0] + v * p[1]).collect();
            let total: f32 = triangles(&corners)
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| corners[i as usize]);
                    let area = (b - a).cross(c - a).dot(axis);
                    assert!(area > 0.0);
                    area * 0.5
                })
                .sum();
            assert!((total - 3.0).abs() < 1e-5);
        }
    }

    #[test]
    fn polygons_of_other_shapes_are_cut_like_the_first() {
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        // Only the other diagonal lies inside.
        let arrow = flat(&[[2.0, -1.0], [0.5, 0.0], [2.0, 1.0], [0.0, 0.0]]);
        let pentagon = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [1.0, 2.0], [0.0, 1.0]]);
        let cut = |triangulator: &mut Triangulator, polygons: &[&Vec<Vec3>]| {
            let mut out = Vec::new();
            for polygon in polygons {
                triangulator.triangulate(polygon, |triangle| {
                    assert!(triangle.iter().all(|&corner| (corner as usize) < polygon.len()));
                    out.push(triangle);
                });
            }
            out
        };
        let mut first = Triangulator::first_of_many();
        let expected = cut(&mut first, &[&square, &pentagon, &arrow]);
        assert_eq!(expected, [triangles(&square), triangles(&pentagon), triangles(&arrow)].concat());
        let cuts = first.into_cuts();
        assert_eq!(cut(&mut Triangulator::like(&cuts), &[&arrow, &pentagon, &square]), expected);
        // Negative control: left to themselves they are cut otherwise.
        assert_ne!(triangles(&square), triangles(&arrow));
        // Other polygons are cut by themselves, and more of them too.
        let other = cut(&mut Triangulator::like(&cuts), &[&pentagon, &square, &arrow, &pentagon]);
        assert_eq!(other.len(), 3 + 2 + 2 + 3);
    }

    #[test]
    fn huge_polygons_do_not_hang() {
        let corners: Vec<Vec3> = (0..200_000).map(|i| Vec3::new(i as f32, (i % 7) as f32, 0.0)).collect();
        assert_eq!(triangles(&corners).len(), corners.len() - 2);
    }

    proptest! {
        #[test]
        fn always_n_minus_2_triangles(
            points in proptest::collection::vec(proptest::array::uniform3(proptest::num::f32::ANY), 0..40),
        ) {
            let corners: Vec<Vec3> = points.into_iter().map(Vec3::from_array).collect();
            let found = triangles(&corners);
            prop_assert_eq!(found.len(), corners.len().saturating_sub(2));
            prop_assert!(found.iter().flatten().all(|&i| (i as usize) < corners.len()));
        }
    }
}
