//! `Naive`: how tightly triangles are packed in their box; K. V. Garanzha's thesis of 2014, chapter 3.5.
//!
//! `Naive = sum of SA(triangle) / SA(box)`: a triangle's surface has two sides.

use super::acc::weighted_normal;
use super::measure::Measure;
use crate::wide::MeshView;
use vastlight_math::Aabb;

/// The heuristic over a mesh.
pub(super) struct Naive<'a> {
    pub(super) mesh: MeshView<'a>,
}

/// What is kept of a cluster.
#[derive(Clone, Copy, Debug)]
pub(super) struct NaiveKept {
    /// Of the triangles, one side.
    area: f32,
    bounds: Aabb,
}

impl NaiveKept {
    fn with(self, other: Self) -> Self {
        Self { area: self.area + other.area, bounds: self.bounds.union(other.bounds) }
    }

    pub(super) fn naive(&self) -> f32 {
        let of_box = self.bounds.half_area();
        if of_box > 0.0 { self.area / of_box } else { 0.0 }
    }
}

impl Measure for Naive<'_> {
    type Kept = NaiveKept;
    type Room = ();

    fn single(&self, triangle: u32) -> NaiveKept {
        let corners = self.mesh.corners(triangle);
        NaiveKept { area: weighted_normal(corners).length(), bounds: Aabb::from_points(corners) }
    }

    fn value(&self, [a, b]: [&NaiveKept; 2], _shared: f32, (): &mut ()) -> f32 {
        a.with(*b).naive().clamp(0.0, 2.0)
    }

    fn join(&self, [a, b]: [NaiveKept; 2], _shared: f32) -> NaiveKept {
        a.with(b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Vec3;

    #[test]
    fn it_is_as_on_paper() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::ONE, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)];
        let triangles = [[0, 1, 4], [0, 4, 3], [0, 1, 2], [0, 0, 0]];
        let naive = Naive { mesh: MeshView { positions: &positions, triangles: &triangles } };
        let [a, b, c, point] = [0, 1, 2, 3].map(|t| naive.single(t));
        assert_eq!((a.naive(), point.naive()), (0.5, 0.0), "half a square: 2 * 0.5 / 2");
        assert_eq!(naive.value([&a, &b], 0.0, &mut ()), 1.0, "a square fills its box");
        let half = 2.0_f32.sqrt() / 2.0;
        let found = naive.value([&naive.join([a, b], 0.0), &c], 0.0, &mut ());
        assert!((found - (1.0 + half) / 3.0).abs() < 1e-6, "three triangles in a cube: {found}");
    }
}
