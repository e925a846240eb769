//! A ray prepared for the tests of one space.
//!
//! Margins. With `m` = (largest coordinate of the ray's origin and of the geometry) and `e` = 2^-24, the triangle test
//! works on corners that are off by less than 8 `e m`, and accepts a hit if the place that its weights name in the
//! triangle is off the ray by at most 8 `e m`. Together with the rounding of the weighted sums, the point at `t` on the
//! ray is less than 40 `e m` away from a point of the triangle, along each axis. Box tests grow boxes by 64 `e m`, the
//! difference being more than their own rounding. So whatever boxes a tree has over the parts of a triangle, as long
//! as the parts cover it, one of them contains the hit's `t` between where the ray enters and where it leaves.

use vastlight_math::{Aabb, Vec3};
use vastlight_simd::Simd8;

/// Half a unit in the last place of 1.
const EPSILON: f32 = 1.0 / 16_777_216.0;
/// How far off the ray the place of a hit may be, in units of the largest coordinate.
const TOLERANCE: f32 = 8.0 * EPSILON;
/// Margin of boxes on the way down, in units of the largest coordinate.
const NODE_MARGIN: f32 = 64.0 * EPSILON;
/// Directions are brought into this range by a power of two.
const DIRECTION_RANGE: std::ops::RangeInclusive<f32> = 1.0 / 1_048_576.0..=1_048_576.0;
/// Components smaller than this part of the largest are taken for this part in box tests: within the geometry
/// the ray moves by less than the margin, and reciprocals stay finite.
const SMALLEST_COMPONENT: f32 = 1.0 / 67_108_864.0;
/// Origins beyond this (2^80) miss everything.
const FARTHEST_ORIGIN: f32 = 1.208_925_8e24;
/// Origins beyond this (2^40) in the space of a mesh miss it: products of three coordinates stay finite. Meshes are
/// scaled to at most 2^20.
const FARTHEST_FROM_MESH: f32 = 1_099_511_627_776.0;

/// A ray prepared for box tests.
#[derive(Clone, Copy, Debug, Default)]
pub struct BoxRay {
    /// Where the ray starts.
    pub origin: [f32; 3],
    /// Reciprocal of the direction, finite and not zero.
    pub reciprocal: [f32; 3],
    /// `plane * reciprocal - near_offset` is where the ray enters a slab, margin included.
    pub near_offset: [f32; 3],
    /// `plane * reciprocal - far_offset` is where the ray leaves a slab, margin included.
    pub far_offset: [f32; 3],
    /// 1 where the ray enters a slab by the upper plane, 0 by the lower.
    pub enters_by_upper: [usize; 3],
    /// How much wider than they are boxes are taken, on each side.
    pub margin: f32,
}

impl BoxRay {
    /// Where the ray enters a box, margin included.
    #[must_use]
    pub fn enter(&self, bounds: &Aabb) -> f32 {
        let near =
            |axis: usize| if self.enters_by_upper[axis] == 1 { bounds.max[axis] } else { bounds.min[axis] };
        let slab = |axis: usize| near(axis) * self.reciprocal[axis] - self.near_offset[axis];
        slab(0).max(slab(1)).max(slab(2))
    }

    /// Whether the ray meets a box between two parameters, margin included.
    #[must_use]
    pub fn meets(&self, bounds: &Aabb, t_min: f32, t_max: f32) -> bool {
        let far =
            |axis: usize| if self.enters_by_upper[axis] == 1 { bounds.min[axis] } else { bounds.max[axis] };
        let slab = |axis: usize| far(axis) * self.reciprocal[axis] - self.far_offset[axis];
        self.enter(bounds).max(t_min) <= slab(0).min(slab(1)).min(slab(2)).min(t_max)
    }
}

/// How much wider than they are boxes are taken, on each side, for rays whose origin and geometry have coordinates that
/// add up to `reach`, `factor` times what meshes need.
#[inline(always)]
#[must_use]
pub fn box_margin(reach: f32, factor: f32) -> f32 {
    reach * (NODE_MARGIN * factor)
}

/// A ray in a space, its direction scaled by a power of two so that no product under- or overflows.
#[derive(Clone, Copy, Debug)]
pub struct ScaledRay {
    origin: Vec3,
    direction: Vec3,
    /// Parameters along the scaled direction times this are parameters along the given one; a power of two.
    pub t_scale: f32,
}

impl ScaledRay {
    /// The ray; none where it is not finite, has no direction or starts beyond 2^80.
    #[inline(always)]
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Option<Self> {
        let largest = direction.abs().max_element();
        let origin_fits = origin.abs().cmple(Vec3::splat(FARTHEST_ORIGIN)).all();
        // Comparisons without branches; a NaN component fails the second one.
        let direction_fits = direction.abs().cmple(Vec3::splat(*DIRECTION_RANGE.end())).all();
        if origin_fits & direction_fits & (largest >= *DIRECTION_RANGE.start()) {
            return Some(Self { origin, direction, t_scale: 1.0 });
        }
        Self::rescaled(origin, direction, origin_fits)
    }

    #[cold]
    #[inline(never)]
    fn rescaled(origin: Vec3, direction: Vec3, origin_fits: bool) -> Option<Self> {
        let largest = direction.abs().max_element();
        if !origin_fits || !direction.is_finite() || largest == 0.0 {
            return None;
        }
        // 2^-e of the largest component; two steps, so that subnormal directions stay in the range of f32.
        let exponent = (largest.to_bits() >> 23) as i32 - 127;
        let (first, second) = (-exponent / 2, -exponent - -exponent / 2);
        let power = |e: i32| f32::from_bits(((e + 127) as u32) << 23);
        let direction = direction * power(first) * power(second);
        let t_scale = power(first) * power(second);
        (direction.abs().max_element() > 0.0).then_some(Self { origin, direction, t_scale })
    }

    /// Prepares for box tests against geometry with coordinates up to `extent`, with a margin `margin_factor` times
    /// as wide as that which meshes need.
    #[inline(always)]
    #[must_use]
    pub fn for_boxes(&self, extent: f32, margin_factor: f32) -> BoxRay {
        let (o, d) = (self.origin.to_array(), self.direction.to_array());
        let margin = box_margin(self.origin.abs().max_element() + extent, margin_factor);
        let smallest = self.direction.abs().max_element() * SMALLEST_COMPONENT;
        let reciprocal = d.map(|d| 1.0 / if d.abs() < smallest { smallest.copysign(d) } else { d });
        BoxRay {
            origin: o,
            reciprocal,
            near_offset: std::array::from_fn(|k| o[k] * reciprocal[k] + margin * reciprocal[k].abs()),
            far_offset: std::array::from_fn(|k| o[k] * reciprocal[k] - margin * reciprocal[k].abs()),
            enters_by_upper: reciprocal.map(|r| usize::from(r < 0.0)),
            margin,
        }
    }

    /// Prepares for triangle tests against a mesh with coordinates up to `extent`; none where the ray starts beyond 2^40.
    #[inline(always)]
    #[must_use]
    pub fn for_triangles(&self, extent: f32) -> Option<(BoxRay, TriangleRay)> {
        if self.origin.abs().max_element() > FARTHEST_FROM_MESH {
            return None;
        }
        let boxes = self.for_boxes(extent, 1.0);
        let triangles = TriangleRay::new(boxes.origin, self.direction.to_array(), boxes.reciprocal, extent);
        Some((boxes, triangles))
    }

    /// The scaled direction.
    #[inline(always)]
    #[must_use]
    pub fn direction(&self) -> Vec3 {
        self.direction
    }
}

/// A ray prepared for triangle tests.
#[derive(Clone, Copy, Debug, Default)]
pub struct TriangleRay {
    /// Where the ray starts.
    pub origin: [f32; 3],
    /// The axes that become x, y and z after the shear; z is the longest of the direction.
    pub axes: [usize; 3],
    /// `x' = x - shear[0] z`, `y' = y - shear[1] z`, `t = shear[2] z`.
    pub shear: [f32; 3],
    /// How far off the ray the place of a hit may be.
    pub tolerance: f32,
}

impl TriangleRay {
    /// From a ray's figures in the space of a mesh with coordinates up to `extent`.
    #[inline(always)]
    #[must_use]
    pub fn new(origin: [f32; 3], d: [f32; 3], reciprocal: [f32; 3], extent: f32) -> Self {
        let a = d.map(f32::abs);
        let z = if a[0] >= a[1] && a[0] >= a[2] {
            0
        } else if a[1] >= a[2] {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        // The largest component is never replaced in its reciprocal.
        let scale = reciprocal[z];
        let largest_origin = Vec3::from(origin).abs().max_element();
        Self {
            origin,
            axes: [x, y, z],
            shear: [d[x] * scale, d[y] * scale, scale],
            tolerance: (largest_origin + extent) * TOLERANCE,
        }
    }
}

/// Eight rays in lanes, as [`ScaledRay`] and [`BoxRay`] have one.
#[derive(Clone, Copy, Debug)]
pub struct EightRays<S: Simd8> {
    /// Origins, by axis.
    pub origin: [S::F; 3],
    /// Directions, by axis.
    pub direction: [S::F; 3],
}

impl<S: Simd8> EightRays<S> {
    /// The lanes that [`ScaledRay::new`] and [`ScaledRay::for_triangles`] would take as they are, as bits.
    #[inline(always)]
    #[must_use]
    pub fn comfortable(&self, s: S) -> u32 {
        let largest = largest(s, &self.direction);
        let [x, y, z] = self.origin;
        let limit = s.splat(FARTHEST_FROM_MESH);
        let near = s.and(s.and(s.le(s.abs(x), limit), s.le(s.abs(y), limit)), s.le(s.abs(z), limit));
        let [x, y, z] = self.direction;
        let limit = s.splat(*DIRECTION_RANGE.end());
        let short = s.and(s.and(s.le(s.abs(x), limit), s.le(s.abs(y), limit)), s.le(s.abs(z), limit));
        s.bits(s.and(s.and(near, short), s.le(s.splat(*DIRECTION_RANGE.start()), largest)))
    }

    /// Reciprocals of the directions, and the margins of boxes: see [`ScaledRay::for_boxes`], whose bits these are.
    #[inline(always)]
    #[must_use]
    pub fn for_boxes(&self, s: S, extent: f32, margin_factor: f32) -> ([S::F; 3], S::F) {
        let smallest = s.mul(largest(s, &self.direction), s.splat(SMALLEST_COMPONENT));
        let [x, y, z] = self.direction;
        let reciprocal = [reciprocal(s, x, smallest), reciprocal(s, y, smallest), reciprocal(s, z, smallest)];
        let reach = s.add(largest(s, &self.origin), s.splat(extent));
        (reciprocal, s.mul(reach, s.splat(NODE_MARGIN * margin_factor)))
    }
}

#[inline(always)]
fn largest<S: Simd8>(s: S, [x, y, z]: &[S::F; 3]) -> S::F {
    s.max(s.max(s.abs(*x), s.abs(*y)), s.abs(*z))
}

#[inline(always)]
fn reciprocal<S: Simd8>(s: S, direction: S::F, smallest: S::F) -> S::F {
    s.div(s.splat(1.0), s.copysign(s.max(s.abs(direction), smallest), direction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_rays_are_refused() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for k in 0..3 {
                let mut v = [0.5; 3];
                v[k] = bad;
                assert!(ScaledRay::new(Vec3::from(v), Vec3::ONE).is_none());
                assert!(ScaledRay::new(Vec3::ONE, Vec3::from(v)).is_none());
            }
        }
        assert!(ScaledRay::new(Vec3::ZERO, Vec3::ZERO).is_none());
        assert!(ScaledRay::new(Vec3::splat(1e25), Vec3::ONE).is_none());
        let far = ScaledRay::new(Vec3::splat(1e15), Vec3::ONE).expect("usable");
        assert!(far.for_triangles(1.0).is_none());
    }

    #[test]
    fn directions_of_any_length_are_scaled_exactly() {
        for length in [1e-44_f32, 1e-38, 3e-20, 1e-6, 1.0, 1e6, 1e19, 3e38] {
            let ray = ScaledRay::new(Vec3::ONE, Vec3::new(length, length * 0.5, 0.0)).expect("usable");
            let largest = ray.direction.abs().max_element();
            assert!(DIRECTION_RANGE.contains(&largest), "{length}: {largest}");
            assert_eq!(f64::from(ray.direction.x), f64::from(length) * f64::from(ray.t_scale));
            let (boxes, _) = ray.for_triangles(1.0).expect("near");
            for values in [boxes.reciprocal, boxes.near_offset, boxes.far_offset] {
                assert!(values.iter().all(|v| v.is_finite()));
            }
            assert!(boxes.reciprocal.iter().all(|&r| r != 0.0));
        }
    }
}
