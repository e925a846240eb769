//! `Error`: how far triangles are from a flat disc; M. Garland, A. Willmott, P. Heckbert 2001, "Hierarchical face
//! clustering on polygonal surfaces".
//!
//! `Error = Efit + a1 Edir + a2 Eshape`, the less the better: `Efit` is the mean square distance of the corners from the plane
//! that fits them best; `Edir` the mean over the area of `(1 - n . ni)^2`, with `n` the plane's and `ni` the
//! triangles' normals; `Eshape = (g - max(ga, gb)) / g`, by how much the irregularity `g = perimeter^2 / (4 pi area)` of two
//! clusters together is above that of each.
//!
//! Deviation: lengths are relative to the longest side of the mesh's box, so that units do not matter.

use super::acc::weighted_normal;
use super::measure::Measure;
use crate::wide::MeshView;
use vastlight_math::Vec3;
use vastlight_math::glam::{DMat3, DVec3};

/// Weight of the spread of normals, as the thesis has it.
const A1: f64 = 0.2;
/// Weight of the shape.
const A2: f64 = 2.0;
/// Rotations after which a symmetric matrix is diagonal.
const SWEEPS: usize = 8;

/// The heuristic over a mesh.
pub(super) struct Error<'a> {
    mesh: MeshView<'a>,
    /// Relative to the longest side of the mesh's box.
    unit: f64,
    /// Positions are counted from here.
    origin: Vec3,
}

/// What is kept of a cluster: sums over its triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct ErrorKept {
    /// Number of corners, their sum and that of their outer products.
    corners: f64,
    sum: DVec3,
    products: DMat3,
    area: f64,
    /// Unit normals times areas, and their outer products times areas.
    normals: DVec3,
    normal_products: DMat3,
    perimeter: f64,
}

/// The terms of a cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ErrorTerms {
    pub(super) fit: f64,
    pub(super) direction: f64,
    pub(super) irregularity: f64,
}

impl<'a> Error<'a> {
    /// Over a mesh.
    pub(super) fn new(mesh: MeshView<'a>) -> Self {
        let bounds = mesh.bounds();
        let side = f64::from(bounds.size().max_element());
        let origin = if bounds.is_empty() { Vec3::ZERO } else { bounds.center() };
        Self { mesh, unit: if side > 0.0 { 1.0 / side } else { 1.0 }, origin }
    }

    /// The error of two clusters together.
    fn error(&self, a: &ErrorKept, b: &ErrorKept, shared: f32) -> f64 {
        let whole = self.united(a, b, shared).terms();
        let before = a.irregularity().max(b.irregularity());
        let shape = if whole.irregularity > 0.0 { 1.0 - before / whole.irregularity } else { 0.0 };
        whole.fit + A1 * whole.direction + A2 * shape
    }

    fn united(&self, a: &ErrorKept, b: &ErrorKept, shared: f32) -> ErrorKept {
        ErrorKept {
            corners: a.corners + b.corners,
            sum: a.sum + b.sum,
            products: a.products + b.products,
            area: a.area + b.area,
            normals: a.normals + b.normals,
            normal_products: a.normal_products + b.normal_products,
            perimeter: (a.perimeter + b.perimeter - 2.0 * f64::from(shared) * self.unit).max(0.0),
        }
    }
}

impl ErrorKept {
    fn irregularity(&self) -> f64 {
        let g = self.perimeter * self.perimeter / (4.0 * std::f64::consts::PI * self.area);
        if g.is_finite() { g } else { 0.0 }
    }

    pub(super) fn terms(&self) -> ErrorTerms {
        let mean = self.sum / self.corners;
        let spread = self.products * (1.0 / self.corners) - outer(mean, mean);
        let (fit, axis) = least_eigen(spread);
        let n = if axis.dot(self.normals) < 0.0 { -axis } else { axis };
        let sum = self.area - 2.0 * n.dot(self.normals) + n.dot(self.normal_products * n);
        let direction = if self.area > 0.0 { (sum / self.area).max(0.0) } else { 0.0 };
        ErrorTerms { fit: fit.max(0.0), direction, irregularity: self.irregularity() }
    }
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The least eigenvalue of a symmetric matrix and its unit vector, by Jacobi's rotations.
fn least_eigen(matrix: DMat3) -> (f64, DVec3) {
    let (mut a, mut v) = (matrix.to_cols_array_2d(), DMat3::IDENTITY.to_cols_array_2d());
    let tiny = 1e-30 * (a[0][0] + a[1][1] + a[2][2]).abs();
    for _ in 0..SWEEPS {
        if a[0][1].abs() + a[0][2].abs() + a[1][2].abs() <= tiny {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    let least = (0..3).fold(0, |best, i| if a[i][i] < a[best][best] { i } else { best });
    (a[least][least], DVec3::from(v[least]))
}

/// Makes an element of a symmetric matrix zero; `v` holds the vectors so far.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    for k in 0..3 {
        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
        (v[p][k], v[q][k]) = (c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]);
    }
}

/// A number from -2 to 2 that is the larger the less `error` is: nearly its logarithm, as the bits of floating-point
/// numbers are.
pub(super) fn rank(error: f64) -> f32 {
    let bits = (error as f32).max(0.0).to_bits();
    2.0 - bits as f32 * (4.0 / (1_u32 << 31) as f32)
}

impl Measure for Error<'_> {
    type Kept = ErrorKept;
    type Room = ();

    fn single(&self, triangle: u32) -> ErrorKept {
        let corners = self.mesh.corners(triangle).map(|p| (p - self.origin).as_dvec3() * self.unit);
        let weighted = weighted_normal(self.mesh.corners(triangle)).as_dvec3() * (self.unit * self.unit);
        let normal = weighted.normalize_or_zero();
        let [a, b, c] = corners;
        ErrorKept {
            corners: 3.0,
            sum: a + b + c,
            products: outer(a, a) + outer(b, b) + outer(c, c),
            area: weighted.length(),
            normals: weighted,
            normal_products: outer(weighted, normal),
            perimeter: a.distance(b) + b.distance(c) + c.distance(a),
        }
    }

    fn value(&self, [a, b]: [&ErrorKept; 2], shared: f32, (): &mut ()) -> f32 {
        rank(self.error(a, b, shared))
    }

    fn join(&self, [a, b]: [ErrorKept; 2], shared: f32) -> ErrorKept {
        self.united(&a, &b, shared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }

    #[test]
    fn a_square_is_as_on_paper() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let error = Error::new(MeshView { positions: &positions, triangles: &[[0, 1, 2], [0, 2, 3]] });
        let halves = [error.single(0), error.single(1)];
        let diagonal = 2.0_f32.sqrt();
        let whole = error.join(halves, diagonal);
        let terms = whole.terms();
        close(terms.fit, 0.0);
        close(terms.direction, 0.0);
        close(terms.irregularity, 16.0 / (4.0 * std::f64::consts::PI));
        // Halves are less regular than the square: the shape gains.
        let half = (2.0 + 2.0_f64.sqrt()).powi(2) / (2.0 * std::f64::consts::PI);
        close(halves[0].terms().irregularity, half);
        let shape = 1.0 - half / terms.irregularity;
        close(error.error(&halves[0], &halves[1], diagonal), A2 * shape);
    }

    #[test]
    fn a_fold_is_as_on_paper() {
        // Two triangles at a right angle: the corners' least spread is that along the sum of the normals.
        let positions = [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1.0, 0.0), Vec3::new(0.5, 0.0, 1.0)];
        let error = Error::new(MeshView { positions: &positions, triangles: &[[0, 1, 2], [0, 3, 1]] });
        let whole = error.join([error.single(0), error.single(1)], 1.0).terms();
        // Normals y and z beside a plane whose normal is (0, 1, 1) / sqrt 2.
        let expected = (1.0 - 0.5_f64.sqrt()).powi(2);
        close(whole.direction, expected);
        // Along it the six corners stand at 0 four times and at sqrt(1/2) twice.
        let (mean, square) = (2.0 * 0.5_f64.sqrt() / 6.0, 2.0 * 0.5 / 6.0);
        close(whole.fit, square - mean * mean);
    }

    #[test]
    fn least_eigenvalues_are_those_of_the_matrix() {
        let axes = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(0.4);
        let matrix = axes * DMat3::from_diagonal(DVec3::new(3.0, 0.5, 2.0)) * axes.transpose();
        let (value, vector) = least_eigen(matrix);
        close(value, 0.5);
        close((matrix * vector).distance(vector * 0.5), 0.0);
    }

    #[test]
    fn ranks_follow_errors() {
        let errors = [0.0, 1e-12, 1e-6, 0.3, 1.0, 4.0, 1e9];
        assert!(errors.windows(2).all(|w| rank(w[0]) > rank(w[1])));
        assert!(errors.iter().all(|&e| (-2.0..=2.0).contains(&rank(e))));
    }
}
