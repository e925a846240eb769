//! Tight spheres around few points: the smallest one, found as B. Gärtner 1999, "Fast and robust smallest enclosing
//! balls", does, by taking in the farthest point outside.
//!
//! A sphere is held by at most four points. The farthest point outside is on the next sphere, together with some of those
//! that held the last one; of all spheres that these allow the smallest that contains them is the next. Deviation: it
//! ends where no point is more than [`SLACK`] outside, and the radius is then that of the farthest point, so that
//! the sphere contains all points and is at most so much too large.

use vastlight_math::Vec3;

/// How much larger than the smallest a radius may be, relative to it.
pub(super) const SLACK: f32 = 1e-3;
/// Rounds after which a sphere is taken as it is; a handful is usual.
const ROUNDS: usize = 24;
/// Points on a sphere may stand out by this much of its radius, for rounding's sake.
const ROUNDING: f32 = 1e-4;

/// A sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sphere {
    pub(super) center: Vec3,
    pub(super) radius: f32,
}

impl Sphere {
    /// Its surface.
    pub(super) fn area(&self) -> f32 {
        4.0 * std::f32::consts::PI * self.radius * self.radius
    }

    /// The smallest sphere around `points`, up to [`SLACK`]; a point of radius 0 without any.
    pub(super) fn around(points: &[Vec3]) -> Self {
        let Some(&start) = points.first() else { return Self::default() };
        let (a, _) = farthest(points, start);
        let (b, _) = farthest(points, a);
        let mut held = Held::by(&[a, b]).unwrap_or(Held { center: a, square: 0.0, by: [a; 4], len: 1 });
        let limit = (1.0 + SLACK) * (1.0 + SLACK);
        for _ in 0..ROUNDS {
            let (point, square) = farthest(points, held.center);
            let inside = square <= held.square * limit;
            match if inside { None } else { held.take_in(point) } {
                Some(next) => held = next,
                None => return Self { center: held.center, radius: square.sqrt() },
            }
        }
        Self { center: held.center, radius: farthest(points, held.center).1.sqrt() }
    }
}

/// The point farthest from `from`, and the square of its distance.
#[inline]
fn farthest(points: &[Vec3], from: Vec3) -> (Vec3, f32) {
    let mut best = (from, 0.0);
    for &point in points {
        let square = point.distance_squared(from);
        if square > best.1 {
            best = (point, square);
        }
    }
    best
}

/// A sphere, and the points that hold it.
#[derive(Clone, Copy)]
struct Held {
    center: Vec3,
    /// Of the radius.
    square: f32,
    by: [Vec3; 4],
    len: usize,
}

impl Held {
    /// The smallest sphere with two, three or four points on it; none where they leave more than one point free.
    #[inline]
    fn by(points: &[Vec3]) -> Option<Self> {
        let origin = points[0];
        let edge = |i: usize| points[i] - origin;
        let offset = match points.len() {
            2 => edge(1) * 0.5,
            3 => {
                let (u, v) = (edge(1), edge(2));
                let w = u.cross(v);
                (v.cross(w) * u.length_squared() + w.cross(u) * v.length_squared())
                    / (2.0 * w.length_squared())
            }
            _ => {
                let (u, v, w) = (edge(1), edge(2), edge(3));
                let sum = v.cross(w) * u.length_squared()
                    + w.cross(u) * v.length_squared()
                    + u.cross(v) * w.length_squared();
                sum / (2.0 * u.dot(v.cross(w)))
            }
        };
        let mut by = [origin; 4];
        by[..points.len()].copy_from_slice(points);
        let square = offset.length_squared();
        square.is_finite().then_some(Self { center: origin + offset, square, by, len: points.len() })
    }

    /// The smallest sphere around `point`, which is outside, and all that hold this one; none where rounding leaves none
    /// that is larger.
    fn take_in(&self, point: Vec3) -> Option<Self> {
        let mut best: Option<Self> = None;
        for others in 1_u32..1 << self.len {
            if others.count_ones() == 4 {
                continue;
            }
            let (mut points, mut len) = ([point; 4], 1);
            for i in (0..self.len).filter(|i| others >> i & 1 == 1) {
                points[len] = self.by[i];
                len += 1;
            }
            let Some(held) = Self::by(&points[..len]) else { continue };
            let limit = held.square * (1.0 + 2.0 * ROUNDING);
            let better = held.square > self.square && best.is_none_or(|best| held.square < best.square);
            if better && self.by[..self.len].iter().all(|p| p.distance_squared(held.center) <= limit) {
                best = Some(held);
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::rng::hash_to_unit;

    fn point(i: u32, seed: u32) -> Vec3 {
        Vec3::from([0, 1, 2].map(|k| hash_to_unit(&[seed, i, k]) * 2.0 - 1.0))
    }

    /// The smallest radius of a sphere through up to four points that contains all, in double precision by trying all.
    fn brute_force(points: &[Vec3]) -> f32 {
        let mut best = f32::INFINITY;
        let n = points.len();
        let mut consider = |chosen: &[Vec3]| {
            if let Some(held) = Held::by(chosen) {
                let radius = held.square.sqrt();
                let inside = points.iter().all(|p| p.distance(held.center) <= radius * 1.00005);
                best = if inside { best.min(radius) } else { best };
            }
        };
        for (i, &a) in points.iter().enumerate() {
            for (j, &b) in points.iter().enumerate().skip(i + 1) {
                consider(&[a, b]);
                for k in j + 1..n {
                    consider(&[a, b, points[k]]);
                    (k + 1..n).for_each(|l| consider(&[a, b, points[k], points[l]]));
                }
            }
        }
        best
    }

    fn assert_contains(sphere: &Sphere, points: &[Vec3]) {
        for p in points {
            assert!(p.distance(sphere.center) <= sphere.radius * 1.000_001, "{p} {sphere:?}");
        }
    }

    #[test]
    fn spheres_are_the_smallest() {
        for seed in 0..200 {
            let flat = if seed % 3 == 0 { Vec3::new(1.0, 1.0, 0.0) } else { Vec3::ONE };
            let points: Vec<Vec3> = (0..2 + seed % 11).map(|i| point(i, seed) * flat).collect();
            let sphere = Sphere::around(&points);
            assert_contains(&sphere, &points);
            let least = brute_force(&points);
            assert!(sphere.radius <= least * (1.0 + SLACK + 1e-4), "{seed}: {} {least}", sphere.radius);
            assert!(sphere.radius >= least * (1.0 - 1e-3), "{seed}: {} {least}", sphere.radius);
        }
    }

    #[test]
    fn many_points_of_a_ball_have_nearly_its_sphere() {
        for seed in 0..20 {
            let points: Vec<Vec3> =
                (0..300).map(|i| point(i, seed).normalize() * 3.0 + Vec3::X * 9.0).collect();
            let sphere = Sphere::around(&points);
            assert_contains(&sphere, &points);
            assert!((2.9..3.003).contains(&sphere.radius), "{sphere:?}");
        }
    }

    #[test]
    fn degenerate_points_have_spheres_too() {
        assert_eq!(Sphere::around(&[]), Sphere::default());
        assert_eq!(Sphere::around(&[Vec3::ONE; 7]), Sphere { center: Vec3::ONE, radius: 0.0 });
        let line: Vec<Vec3> = (0..9_u8).map(|i| Vec3::splat(f32::from(i * i))).collect();
        let sphere = Sphere::around(&line);
        assert_contains(&sphere, &line);
        assert!((sphere.radius / (32.0 * 3.0_f32.sqrt()) - 1.0).abs() < 1e-6, "{sphere:?}");
        let grid: Vec<Vec3> =
            (0..27_u8).map(|i| Vec3::from([i % 3, i / 3 % 3, i / 9].map(f32::from))).collect();
        assert!((Sphere::around(&grid).radius - 3.0_f32.sqrt()).abs() < 2e-3);
        let circle: Vec<Vec3> = (0..64_u8)
            .map(|i| (f32::from(i) / 64.0 * std::f32::consts::TAU).sin_cos())
            .map(|(s, c)| Vec3::new(s, 0.0, c))
            .collect();
        assert!((Sphere::around(&circle).radius - 1.0).abs() < 2e-3);
    }
}
