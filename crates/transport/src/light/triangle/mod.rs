//! Sampling a triangle light: by solid angle where it is near or large, by area elsewhere.
//!
//! J. Arvo 1995, "Stratified sampling of spherical triangles", in a form without inverse trigonometric functions: the
//! point X on the arc AC for which the triangle ABX has solid angle S satisfies
//! X . [(A x B) cos(S/2) - (A + B) sin(S/2)] = (1 + A . B) sin(S/2), which is solved with the half-angle tangent.

mod lanes;

pub(super) use lanes::TriangleLanes;

use crate::words::Words;
use vastlight_math::real::{atan2, sin_cos};
use vastlight_math::{Affine3, Vec2, Vec3, warp};

/// A triangle in world space as seen as a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleLight {
    a: Vec3,
    edge_b: Vec3,
    edge_c: Vec3,
    /// Twice the area long; points to the front.
    normal: Vec3,
}

/// A point on a triangle light.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrianglePoint {
    pub(super) wi: Vec3,
    pub(super) distance: f32,
    /// Weights of the second and third corner.
    pub(super) barycentric: Vec2,
    /// Over solid angle; 0 where there is no point.
    pub(super) pdf: f32,
}

/// Triangles whose area divided by the squared distance is less are sampled by area: nothing is gained there.
const FAR_RATIO: f32 = 0.1;
/// Solid angles outside are sampled by area, because the construction on the sphere loses its digits.
const SOLID_ANGLES: std::ops::Range<f32> = 3e-4..6.2;

impl TriangleLight {
    /// From world-space corners; `front` is -1 where the front lies on the clockwise side.
    pub(super) fn new([a, b, c]: [Vec3; 3], front: f32) -> Self {
        let (edge_b, edge_c) = (b - a, c - a);
        Self { a, edge_b, edge_c, normal: edge_b.cross(edge_c) * front }
    }

    /// From object-space corners; a mirrored instance keeps its front.
    pub(super) fn placed(corners: [Vec3; 3], world_from_object: &Affine3) -> Self {
        let front = 1.0_f32.copysign(world_from_object.matrix3.determinant());
        Self::new(corners.map(|p| world_from_object.transform_point3(p)), front)
    }

    pub(super) fn pack(&self, words: &mut Words) {
        [self.a, self.edge_b, self.edge_c, self.normal].into_iter().for_each(|v| words.vec3(v));
    }

    pub(super) fn area(&self) -> f32 {
        0.5 * self.normal.length()
    }

    /// Whether `from` lies in front.
    #[inline(always)]
    pub(super) fn faces(&self, from: Vec3) -> bool {
        (from - self.a).dot(self.normal) > 0.0
    }

    /// A point of the triangle as seen from `from`; `None` where it is seen from the edge.
    #[inline(always)]
    pub(super) fn sample(&self, from: Vec3, u: Vec2) -> Option<TrianglePoint> {
        let spherical = self.spherical(from);
        let point = if spherical.is_usable() {
            self.point_towards(from, &spherical, spherical.sample(u))
        } else {
            self.point_by_area(from, u)
        };
        (point.pdf > 0.0).then_some(point)
    }

    /// Density over solid angle with which [`TriangleLight::sample`] finds `position`.
    pub(super) fn pdf(&self, from: Vec3, position: Vec3) -> f32 {
        let spherical = self.spherical(from);
        if spherical.is_usable() { 1.0 / spherical.solid_angle } else { self.area_pdf(position - from) }
    }

    #[inline(always)]
    fn point_by_area(&self, from: Vec3, u: Vec2) -> TrianglePoint {
        let barycentric = warp::uniform_triangle(u);
        let to_light = self.a + self.edge_b * barycentric.x + self.edge_c * barycentric.y - from;
        let distance = to_light.length();
        TrianglePoint { wi: to_light / distance, distance, barycentric, pdf: self.area_pdf(to_light) }
    }

    /// 1 / area as a density over solid angle, for the point at `to_light`.
    #[inline(always)]
    fn area_pdf(&self, to_light: Vec3) -> f32 {
        let distance_squared = to_light.length_squared();
        let pdf = 2.0 * distance_squared * distance_squared.sqrt() / self.normal.dot(to_light).abs();
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// The spherical triangle; without solid angle if it is not worth being sampled by it.
    #[inline(always)]
    fn spherical(&self, from: Vec3) -> Spherical {
        let a = self.a - from;
        let far = FAR_RATIO * a.length_squared();
        let near = self.normal.length_squared() >= 4.0 * (far * far);
        let (b, c) = (a + self.edge_b, a + self.edge_c);
        let scale = (a.length_squared() * b.length_squared() * c.length_squared()).sqrt();
        let (a, b, c) = (a.normalize_or_zero(), b.normalize_or_zero(), c.normalize_or_zero());
        // Van Oosterom and Strackee 1983; the determinant from the edges, which keep the digits of a small triangle.
        let determinant = (self.a - from).dot(self.normal).abs() / scale;
        let solid_angle = 2.0 * atan2(determinant, 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        Spherical { a, b, c, solid_angle: if near { solid_angle } else { 0.0 } }
    }

    /// The point in a direction that was drawn by solid angle.
    #[inline(always)]
    fn point_towards(&self, from: Vec3, spherical: &Spherical, wi: Vec3) -> TrianglePoint {
        let to_plane = (self.a - from).dot(self.normal);
        let distance = to_plane / wi.dot(self.normal);
        let exists = (distance > 0.0) & distance.is_finite();
        let p = wi * distance - (self.a - from);
        let inverse = 1.0 / self.normal.length_squared();
        let face = self.edge_b.cross(self.edge_c) * inverse;
        let v = part_of(1.0, p.cross(self.edge_c).dot(face));
        let w = part_of(1.0 - v, self.edge_b.cross(p).dot(face));
        let pdf = if exists { 1.0 / spherical.solid_angle } else { 0.0 };
        TrianglePoint { wi, distance, barycentric: Vec2::new(v, w), pdf }
    }
}

/// `x` brought between 0 and `whole`; 0 where it is not a number.
#[inline(always)]
fn part_of(whole: f32, x: f32) -> f32 {
    if x > 0.0 { x.min(whole) } else { 0.0 }
}

/// A triangle on the unit sphere.
#[derive(Clone, Copy, Debug)]
struct Spherical {
    a: Vec3,
    b: Vec3,
    c: Vec3,
    solid_angle: f32,
}

impl Spherical {
    /// Whether the solid angle is neither too small nor too large for f32.
    #[inline(always)]
    fn is_usable(&self) -> bool {
        (self.solid_angle >= SOLID_ANGLES.start) & (self.solid_angle < SOLID_ANGLES.end)
    }

    /// A direction inside, uniformly over solid angle; zero where rounding leaves none.
    #[inline(always)]
    fn sample(&self, u: Vec2) -> Vec3 {
        let Self { a, b, c, solid_angle } = *self;
        let (sin, cos) = sin_cos(0.5 * solid_angle * u.x);
        // The determinant's sign says on which side of AB the corner C lies.
        let ab = a.cross(b) * 1.0_f32.copysign(a.cross(b).dot(c));
        let tangent = (c - a * a.dot(c)).normalize_or_zero();
        let k = (1.0 + a.dot(b)) * sin;
        let p = (ab * cos - (a + b) * sin).dot(tangent);
        let x = (a * (p * p - k * k) + tangent * (2.0 * p * k)) / (p * p + k * k);
        let x = if x.is_finite() { x } else { a };
        // Along the arc from B to X, uniformly in 1 - cos.
        let height = u.y * 0.5 * (x - b).length_squared();
        let away = (x - b * b.dot(x)).normalize_or_zero();
        let wi = b * (1.0 - height) + away * (height * (2.0 - height)).max(0.0).sqrt();
        wi.normalize_or_zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Rng;
    use vastlight_math::glam::DVec3;
    use vastlight_math::stats::chi_square;

    /// Solid angle of a triangle seen from the origin, in double precision.
    fn exact_solid_angle(corners: [DVec3; 3]) -> f64 {
        let [a, b, c] = corners.map(DVec3::normalize);
        2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    }

    const SIDE: usize = 8;

    /// The parts of a triangle, SIDE in each direction and two in each cell of barycentric coordinates; `None` beyond
    /// the diagonal.
    fn part(corners: [Vec3; 3], i: usize) -> Option<[DVec3; 3]> {
        let (x, y, upper) = (i / 2 % SIDE, i / 2 / SIDE, i % 2);
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let at = |x: usize, y: usize| a + ((b - a) * x as f64 + (c - a) * y as f64) / SIDE as f64;
        let own = [at(x + upper, y + upper), at(x + 1, y), at(x, y + 1)];
        (x + y + upper < SIDE).then_some(own)
    }

    /// Probability of the samples' parts, by the solid angles of the parts (or by a wrong measure of them).
    fn test(corners: [Vec3; 3], measure: fn([DVec3; 3]) -> f64) -> f64 {
        const N: u32 = 50_000;
        let light = TriangleLight::new(corners, 1.0);
        let mut rng = Rng::new(2);
        let mut observed = vec![0.0; 2 * SIDE * SIDE];
        for _ in 0..N {
            let s = light.sample(Vec3::ZERO, rng.next_2d()).expect("not on edge");
            let [a, b, c] = corners;
            let (v, w) = (s.barycentric.x, s.barycentric.y);
            let p = a * (1.0 - v - w) + b * v + c * w;
            assert!((s.wi * s.distance).distance(p) < 1e-3 * s.distance, "{p} {}", s.wi * s.distance);
            assert!((light.pdf(Vec3::ZERO, p) / s.pdf - 1.0).abs() < 2e-3);
            let exact = exact_solid_angle(corners.map(Vec3::as_dvec3));
            assert!((f64::from(s.pdf) * exact - 1.0).abs() < 1e-3, "{} {exact}", s.pdf);
            let cell = |x: f32| ((x * SIDE as f32) as usize).min(SIDE - 1);
            let upper = (v * SIDE as f32).fract() + (w * SIDE as f32).fract() > 1.0;
            observed[2 * (cell(v) + SIDE * cell(w)) + usize::from(upper)] += 1.0;
        }
        let whole = measure(corners.map(Vec3::as_dvec3));
        let expected: Vec<f64> = (0..2 * SIDE * SIDE)
            .map(|i| part(corners, i).map_or(0.0, |p| f64::from(N) * measure(p) / whole))
            .collect();
        assert!((expected.iter().sum::<f64>() / f64::from(N) - 1.0).abs() < 1e-9, "the parts fill the whole");
        chi_square(&observed, &expected).p
    }

    #[test]
    fn samples_are_uniform_over_solid_angle() {
        let near = [Vec3::new(-2.0, -2.0, 0.5), Vec3::new(3.0, -1.0, 0.7), Vec3::new(0.3, 2.0, 0.4)];
        let huge = [Vec3::new(-60.0, -40.0, 1.0), Vec3::new(70.0, -40.0, 1.0), Vec3::new(0.0, 90.0, 1.0)];
        let small = [Vec3::new(0.9, 0.1, 0.3), Vec3::new(1.1, 0.7, 0.3), Vec3::new(0.9, 0.2, 0.9)];
        let [a, b, c] = near;
        for corners in [near, [b, c, a], [c, b, a], huge, small] {
            let p = test(corners, exact_solid_angle);
            assert!(p > 1e-3, "{corners:?}: {p}");
        }
        let by_area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
        assert!(test(near, by_area) < 1e-6, "negative control");
    }

    #[test]
    fn solid_angle_of_an_octant_and_of_a_distant_triangle() {
        let octant = TriangleLight::new([Vec3::X, Vec3::Y, Vec3::Z], 1.0).spherical(Vec3::ZERO);
        assert!((octant.solid_angle - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        let far = TriangleLight::new([Vec3::X, Vec3::Y, Vec3::Z], 1.0);
        let from = Vec3::splat(200.0);
        assert!(!far.spherical(from).is_usable());
        let s = far.sample(from, Vec2::new(0.3, 0.6)).expect("seen");
        assert!(
            (1.0 / s.pdf / (far.area() / from.distance_squared(s.wi * s.distance + from)) - 1.0).abs() < 1e-2
        );
    }

    #[test]
    fn degenerate_triangles_give_nothing_or_finite_numbers() {
        let line = TriangleLight::new([Vec3::X, Vec3::X * 2.0, Vec3::X * 3.0], 1.0);
        assert!(line.sample(Vec3::Y, Vec2::splat(0.5)).is_none());
        let light = TriangleLight::new([Vec3::ZERO, Vec3::X, Vec3::Y], 1.0);
        for from in [Vec3::ZERO, Vec3::new(0.2, 0.2, 0.0), Vec3::new(0.2, 0.2, 1e-7), Vec3::splat(1e18)] {
            if let Some(s) = light.sample(from, Vec2::new(0.1, 0.9)) {
                assert!(s.pdf.is_finite() && s.wi.is_finite() && s.distance > 0.0, "{from} {s:?}");
            }
        }
    }
}
