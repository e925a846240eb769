//! `Acc`: how well connected triangles make a disc or a ball; K. V. Garanzha's thesis of 2014, chapter 3.1.
//!
//! `Acc = reg - sizeBound * regBound` (3.8) of a cluster in a sphere of radius `R`:
//! `reg` is the area of its triangles, projected along the mean of their unit normals, over `pi R^2` (3.1 to 3.4);
//! `regBound = vertices / MaxCount` (3.5); `sizeBound = max(1, 4 pi R^2 / (MaxSize * AvgSA))` (3.7), where `AvgSA` is
//! the mean area of the sphere around one triangle of the mesh. A cluster is acceptable while `Acc > 0`.

use super::ClusterConfig;
use super::measure::{Measure, unite};
use super::sphere::Sphere;
use crate::wide::MeshView;
use rayon::prelude::*;
use vastlight_math::{Aabb, Vec3};

/// Normals cancel out where their sum is shorter than so much of their number.
const CANCELLED: f32 = 1e-4;
/// Triangles over whose spheres one thread sums.
const CHUNK: usize = 1 << 12;

/// The heuristic over a mesh.
pub(super) struct Acc<'a> {
    mesh: MeshView<'a>,
    /// By triangle: its unit normal times its area.
    weighted: Vec<Vec3>,
    max_count: f32,
    /// `MaxSize * AvgSA`.
    max_area: f32,
}

/// What is kept of a cluster.
#[derive(Clone, Debug)]
pub(super) struct AccKept {
    /// Sorted, without repetition.
    pub(super) vertices: Vec<u32>,
    pub(super) triangles: Vec<u32>,
    /// Sum of the unit normals.
    normals: Vec3,
    /// Around the vertices.
    bounds: Aabb,
}

/// Terms of the heuristic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Terms {
    pub(super) reg: f32,
    pub(super) reg_bound: f32,
    pub(super) size_bound: f32,
}

impl Terms {
    /// The heuristic's value.
    pub(super) fn acc(&self) -> f32 {
        self.reg - self.size_bound * self.reg_bound
    }
}

impl<'a> Acc<'a> {
    /// Gathers what is needed of a mesh.
    pub(super) fn new(mesh: MeshView<'a>, config: &ClusterConfig) -> Self {
        let weighted =
            (0..mesh.triangles.len() as u32).into_par_iter().map(|t| weighted_normal(mesh.corners(t)));
        let weighted = weighted.collect();
        let area_of = |&[a, b, c]: &[u32; 3]| {
            let corners = [a, b, c].map(|i| mesh.positions[i as usize]);
            f64::from(Sphere::around(&corners).area())
        };
        // Sums of chunks, so that rounding does not depend on threads.
        let sums: Vec<f64> =
            mesh.triangles.par_chunks(CHUNK).map(|chunk| chunk.iter().map(area_of).sum()).collect();
        let mean = sums.iter().sum::<f64>() / mesh.triangles.len().max(1) as f64;
        let max_area = f64::from(config.max_size.max(1)) * mean;
        Self { mesh, weighted, max_count: config.max_count.max(1) as f32, max_area: max_area as f32 }
    }

    /// The terms of a cluster with these triangles, which have these vertices and this sum of normals.
    #[cfg(test)]
    pub(super) fn terms<'t>(
        &self,
        triangles: impl Iterator<Item = &'t u32> + Clone,
        vertices: &[u32],
        normals: Vec3,
        room: &mut Vec<Vec3>,
    ) -> Terms {
        let projected = self.projected(triangles, normals);
        self.terms_of(projected, vertices, room)
    }

    fn terms_of(&self, projected: f32, vertices: &[u32], room: &mut Vec<Vec3>) -> Terms {
        room.clear();
        room.extend(vertices.iter().map(|&v| self.mesh.positions[v as usize]));
        let sphere = Sphere::around(room);
        let disc = std::f32::consts::PI * sphere.radius * sphere.radius;
        Terms {
            reg: if disc > 0.0 { projected / disc } else { 0.0 },
            reg_bound: vertices.len() as f32 / self.max_count,
            size_bound: if self.max_area > 0.0 { (sphere.area() / self.max_area).max(1.0) } else { 1.0 },
        }
    }

    /// The projected area (3.3) of triangles with this sum of normals.
    fn projected<'t>(&self, triangles: impl Iterator<Item = &'t u32> + Clone, normals: Vec3) -> f32 {
        let weighted = |t: &u32| self.weighted[*t as usize];
        let count = triangles.clone().count() as f32;
        let direction = if normals.length() > CANCELLED * count {
            normals.normalize()
        } else {
            let largest = triangles.clone().map(weighted).fold(Vec3::ZERO, |best, w| {
                if w.length_squared() > best.length_squared() { w } else { best }
            });
            largest.normalize_or_zero()
        };
        triangles.map(|t| direction.dot(weighted(t)).abs()).sum()
    }
}

/// The unit normal of a triangle times its area; zero for a degenerate one.
pub(super) fn weighted_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a) * 0.5
}

/// Room for the vertices of two clusters.
#[derive(Default)]
pub(super) struct AccRoom {
    vertices: Vec<u32>,
    points: Vec<Vec3>,
}

impl Measure for Acc<'_> {
    type Kept = AccKept;
    type Room = AccRoom;

    fn single(&self, triangle: u32) -> AccKept {
        let mut vertices = self.mesh.triangles[triangle as usize].to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let bounds = Aabb::from_points(self.mesh.corners(triangle));
        let normals = self.weighted[triangle as usize].normalize_or_zero();
        AccKept { vertices, triangles: vec![triangle], normals, bounds }
    }

    fn value(&self, [a, b]: [&AccKept; 2], _shared: f32, room: &mut AccRoom) -> f32 {
        unite(&a.vertices, &b.vertices, &mut room.vertices);
        let projected = self.projected(a.triangles.iter().chain(&b.triangles), a.normals + b.normals);
        // The sphere is at least as large as the box: where that is too large already, it need not be found.
        let radius = 0.5 * a.bounds.union(b.bounds).size().max_element();
        let least = std::f32::consts::PI * radius * radius;
        let reg_bound = room.vertices.len() as f32 / self.max_count;
        let most = projected / least - reg_bound * (4.0 * least / self.max_area).max(1.0);
        if most < 0.0 {
            return most.max(-2.0);
        }
        self.terms_of(projected, &room.vertices, &mut room.points).acc().clamp(-2.0, 2.0)
    }

    fn join(&self, [a, b]: [AccKept; 2], _shared: f32) -> AccKept {
        let mut vertices = Vec::with_capacity(a.vertices.len() + b.vertices.len());
        unite(&a.vertices, &b.vertices, &mut vertices);
        let (mut triangles, bounds) = (a.triangles, a.bounds.union(b.bounds));
        triangles.extend_from_slice(&b.triangles);
        AccKept { vertices, triangles, normals: a.normals + b.normals, bounds }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: ClusterConfig = ClusterConfig::DEFAULT;

    fn terms(positions: &[Vec3], triangles: &[[u32; 3]], config: &ClusterConfig) -> Terms {
        let mesh = MeshView { positions, triangles };
        let acc = Acc::new(mesh, config);
        let kept =
            (1..triangles.len() as u32).fold(acc.single(0), |kept, t| acc.join([kept, acc.single(t)], 0.0));
        acc.terms(kept.triangles.iter(), &kept.vertices, kept.normals, &mut Vec::new())
    }

    fn close(found: f32, expected: f32) {
        assert!((found - expected).abs() <= 3e-3 * expected.abs(), "{found} {expected}");
    }

    #[test]
    fn a_square_is_as_on_paper() {
        // Area 1 in a disc of radius sqrt(1/2); each half has the same sphere.
        let square = [Vec3::ZERO, Vec3::X, Vec3::ONE - Vec3::Z, Vec3::Y];
        let found = terms(&square, &[[0, 1, 2], [0, 2, 3]], &CONFIG);
        close(found.reg, 2.0 / std::f32::consts::PI);
        close(found.reg_bound, 4.0 / 50.0);
        assert_eq!(found.size_bound, 1.0);
        close(found.acc(), 2.0 / std::f32::consts::PI - 0.08);
        // Sphere and mean sphere are the same: the bound is 1 / MaxSize, never below 1.
        let small = ClusterConfig { max_size: 1, max_count: 10, ..CONFIG };
        close(terms(&square, &[[0, 1, 2], [0, 2, 3]], &small).acc(), 2.0 / std::f32::consts::PI - 0.4);
    }

    #[test]
    fn a_long_strip_is_too_large() {
        // 16 right triangles with legs of 1: mean sphere area 2 pi, the strip of 8 x 1 has radius sqrt(65) / 2.
        let positions: Vec<Vec3> =
            (0..18_u8).map(|i| Vec3::new(f32::from(i / 2), f32::from(i % 2), 0.0)).collect();
        let triangles: Vec<[u32; 3]> = (0..16).map(|i| [i, i + 1, i + 2]).collect();
        let found = terms(&positions, &triangles, &ClusterConfig { max_size: 10, ..CONFIG });
        close(found.reg, 8.0 * 4.0 / (65.0 * std::f32::consts::PI));
        close(found.reg_bound, 18.0 / 50.0);
        close(found.size_bound, 65.0 / 20.0);
        assert!(found.acc() < 0.0);
    }

    #[test]
    fn normals_that_cancel_out_leave_the_largest_triangles() {
        // Two sides of a leaf, one of them with a small triangle more.
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let found = terms(&positions, &[[0, 1, 2], [2, 1, 0]], &CONFIG);
        close(found.reg, 1.0 / (0.5 * std::f32::consts::PI));
        // A regular tetrahedron: one face in full, three to a third.
        let corners =
            [Vec3::ONE, Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0)];
        let found = terms(&corners, &[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], &CONFIG);
        let face = 3.0_f32.sqrt() / 4.0 * 8.0;
        close(found.reg, 2.0 * face / (3.0 * std::f32::consts::PI));
    }

    #[test]
    fn values_of_pairs_are_those_of_the_whole() {
        let positions: Vec<Vec3> = (0..60_u32)
            .map(|i| Vec3::from([0, 1, 2].map(|k| vastlight_math::rng::hash_to_unit(&[7, i, k]))))
            .collect();
        let triangles: Vec<[u32; 3]> = (0..50).map(|i| [i, i + 1, i + 5]).collect();
        let mesh = MeshView { positions: &positions, triangles: &triangles };
        let acc = Acc::new(mesh, &ClusterConfig { max_count: 500, max_size: 500, ..CONFIG });
        let (mut kept, mut room, mut exact) = (acc.single(0), AccRoom::default(), 0);
        for next in 1..50 {
            let single = acc.single(next);
            let value = acc.value([&kept, &single], 0.0, &mut room);
            kept = acc.join([kept, single], 0.0);
            let whole = acc
                .terms(kept.triangles.iter(), &kept.vertices, kept.normals, &mut Vec::new())
                .acc()
                .clamp(-2.0, 2.0);
            assert!((value - whole).abs() < 1e-5 || value < 0.0 && whole < 0.0, "{value} {whole}");
            exact += u32::from(value > 0.0);
        }
        assert!(exact > 5, "{exact} are acceptable");
    }

    #[test]
    fn degenerate_triangles_are_never_accepted() {
        let found = terms(&[Vec3::ONE], &[[0, 0, 0]], &CONFIG);
        assert!(found.acc() < 0.0 && found.acc().is_finite(), "{found:?}");
        let line = [Vec3::ZERO, Vec3::X, Vec3::X * 3.0];
        let found = terms(&line, &[[0, 1, 2], [2, 1, 0]], &CONFIG);
        assert!(found.acc() < 0.0 && found.acc().is_finite(), "{found:?}");
    }
}
