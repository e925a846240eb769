//! Boxes of parts of primitives, for builders that split: Sutherland, Hodgman 1974, "Reentrant polygon clipping".
//!
//! Clipping is conservative: nothing of the triangle inside the bounds is lost to rounding. It works in f64 on bounds grown
//! by a slack that is far more than its own rounding, gives the result the same slack, and rounds outward.

use vastlight_math::glam::DVec3;
use vastlight_math::{Aabb, Vec3};

/// What builders that split know of a primitive besides its box.
pub trait Clip: Sync {
    /// The box of the part of primitive `prim` inside `bounds`: contains all of that part, reaches nowhere beyond
    /// `bounds`, and is empty only if there is no such part.
    fn clip(&self, prim: u32, bounds: &Aabb) -> Aabb;

    /// The boxes of the parts of primitive `prim` inside `bounds` between planes, which rise along `axis` within the bounds:
    /// one more than there are planes. They serve to compare planes and may be a little off.
    fn slabs(&self, prim: u32, bounds: &Aabb, axis: usize, planes: &[f32], parts: &mut [Aabb]) {
        for (i, part) in parts.iter_mut().enumerate().take(planes.len() + 1) {
            let mut slab = *bounds;
            if i > 0 {
                slab.min[axis] = planes[i - 1];
            }
            if let Some(&plane) = planes.get(i) {
                slab.max[axis] = plane;
            }
            *part = self.clip(prim, &slab);
        }
    }
}

/// The boxes that [`Clip::slabs`] gives of a triangle: each holds the corners between its planes and the triangle's cross
/// sections with both, as far as they are inside the bounds.
pub(crate) fn triangle_slabs(
    corners: [Vec3; 3],
    bounds: &Aabb,
    axis: usize,
    planes: &[f32],
    parts: &mut [Aabb],
) {
    let parts = &mut parts[..=planes.len()];
    parts.fill(Aabb::EMPTY);
    let slab_of = |corner: Vec3| planes.iter().map(|&plane| usize::from(plane < corner[axis])).sum::<usize>();
    let slabs = corners.map(slab_of);
    for (corner, slab) in corners.into_iter().zip(slabs) {
        parts[slab] = parts[slab].grow(corner);
    }
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (i, j) = if slabs[i] < slabs[j] { (i, j) } else { (j, i) };
        let (from, to) = (corners[i], corners[j]);
        let along = (to - from) / (to[axis] - from[axis]);
        for slab in slabs[i]..slabs[j] {
            let point = from + along * (planes[slab] - from[axis]);
            (parts[slab], parts[slab + 1]) = (parts[slab].grow(point), parts[slab + 1].grow(point));
        }
    }
    parts.iter_mut().for_each(|part| *part = part.intersection(*bounds));
}

/// Slack in units of the largest coordinate, 2^-44.
const SLACK: f64 = 1.0 / 17_592_186_044_416.0;
/// A triangle has three corners, and each of six planes adds at most one.
const MAX_CORNERS: usize = 9;

/// A convex polygon.
struct Polygon {
    corners: [DVec3; MAX_CORNERS],
    count: usize,
}

impl Polygon {
    fn push(&mut self, corner: DVec3) {
        // Rounding cannot make a convex polygon gain more than one corner a plane.
        if let Some(slot) = self.corners.get_mut(self.count) {
            *slot = corner;
            self.count += 1;
        }
    }

    /// The part where `sign * (coordinate - plane) >= 0`.
    fn cut(&self, axis: usize, plane: f64, sign: f64) -> Self {
        let mut part = Self { corners: [DVec3::ZERO; MAX_CORNERS], count: 0 };
        let height = |p: DVec3| (p[axis] - plane) * sign;
        for i in 0..self.count {
            let (p, q) = (self.corners[i], self.corners[if i + 1 == self.count { 0 } else { i + 1 }]);
            let (above, next_above) = (height(p), height(q));
            if above >= 0.0 {
                part.push(p);
            }
            if (above < 0.0) != (next_above < 0.0) {
                part.push(p + (q - p) * (above / (above - next_above)));
            }
        }
        part
    }
}

/// The box of the part of a triangle inside `bounds`, as [`Clip::clip`] gives it. Corners and bounds are finite.
#[must_use]
pub fn clip_triangle(corners: [Vec3; 3], bounds: &Aabb) -> Aabb {
    let whole = Aabb::from_points(corners);
    if bounds.contains(&whole) {
        return whole;
    }
    let largest = whole.min.abs().max(whole.max.abs()).max_element();
    let slack = f64::from(largest) * SLACK;
    let mut polygon = Polygon { corners: [DVec3::ZERO; MAX_CORNERS], count: 3 };
    for (slot, corner) in polygon.corners.iter_mut().zip(corners) {
        *slot = corner.as_dvec3();
    }
    for axis in 0..3 {
        if whole.min[axis] < bounds.min[axis] {
            polygon = polygon.cut(axis, f64::from(bounds.min[axis]) - slack, 1.0);
        }
        if whole.max[axis] > bounds.max[axis] {
            polygon = polygon.cut(axis, f64::from(bounds.max[axis]) + slack, -1.0);
        }
    }
    let found = &polygon.corners[..polygon.count];
    let least = found.iter().fold(DVec3::INFINITY, |a, &b| a.min(b)) - slack;
    let most = found.iter().fold(DVec3::NEG_INFINITY, |a, &b| a.max(b)) + slack;
    let around = Aabb {
        min: least.to_array().map(round_down).into(),
        max: (-most).to_array().map(|x| -round_down(x)).into(),
    };
    around.intersection(*bounds).intersection(whole)
}

/// The largest f32 not above `x`.
fn round_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x { nearest.next_down() } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vec3> {
        // Coordinates on a coarse lattice often coincide with planes.
        let coordinate = prop_oneof![-1.0_f32..1.0, (-4_i8..5).prop_map(|i| f32::from(i) * 0.25)];
        [coordinate.clone(), coordinate.clone(), coordinate].prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn parts_hold_every_point_inside_and_nothing_outside(
            corners in [point(), point(), point()], p in point(), q in point(), weights in [0.0_f64..1.0, 0.0..1.0],
        ) {
            let bounds = Aabb::from_points([p, q]);
            let part = clip_triangle(corners, &bounds);
            prop_assert!(bounds.contains(&part));
            prop_assert!(Aabb::from_points(corners).contains(&part));
            let [u, v] = if weights[0] + weights[1] > 1.0 { weights.map(|w| 1.0 - w) } else { weights };
            let [a, b, c] = corners.map(Vec3::as_dvec3);
            let place = a + (b - a) * u + (c - a) * v;
            let inside = |b: &Aabb, slack: f64| {
                (place - b.min.as_dvec3()).min_element() >= -slack
                    && (b.max.as_dvec3() - place).min_element() >= -slack
            };
            // The place is rounded itself, by less than the slack below.
            prop_assert!(!inside(&bounds, 0.0) || inside(&part, 1e-15), "{place} {part:?}");
        }

        #[test]
        fn two_parts_meet_in_the_plane_that_parts_them(corners in [point(), point(), point()], at in -1.0_f32..1.0) {
            let whole = Aabb::from_points(corners);
            let (mut left, mut right) = (whole, whole);
            prop_assume!(at > whole.min.x && at < whole.max.x);
            (left.max.x, right.min.x) = (at, at);
            let (left, right) = (clip_triangle(corners, &left), clip_triangle(corners, &right));
            prop_assert_eq!((left.max.x, right.min.x), (at, at));
            prop_assert_eq!(left.union(right), whole);
        }
    }

    #[test]
    fn slabs_are_the_parts_between_planes_but_for_rounding() {
        let mut compared = 0;
        let number = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / 8_388_608.0 - 1.0;
        for i in 0..3000 {
            let corner = |k: u32| Vec3::new(number(9 * i + k), number(9 * i + k + 3), number(9 * i + k + 6));
            let corners = [corner(0), corner(1), corner(2)];
            let bounds = Aabb::from_points(corners);
            let axis = i as usize % 3;
            let planes = [0.2, 0.5, 0.7].map(|t| bounds.min[axis] + t * bounds.size()[axis]);
            let mut parts = [Aabb::EMPTY; 5];
            triangle_slabs(corners, &bounds, axis, &planes, &mut parts);
            for (k, part) in parts.iter().enumerate().take(4) {
                let mut slab = bounds;
                slab.min[axis] = if k > 0 { planes[k - 1] } else { bounds.min[axis] };
                slab.max[axis] = if k < 3 { planes[k] } else { bounds.max[axis] };
                let exact = clip_triangle(corners, &slab);
                let off = (part.min - exact.min).abs().max((part.max - exact.max).abs()).max_element();
                assert!(off < 1e-5, "{corners:?} {axis} {k}: {part:?} {exact:?}");
                compared += 1;
            }
        }
        assert_eq!(compared, 12_000);
    }

    #[test]
    fn parts_are_tight() {
        let corners = [Vec3::ZERO, Vec3::new(4.0, 4.0, 0.0), Vec3::new(4.0, 0.0, 0.0)];
        let bounds = Aabb { min: Vec3::new(1.0, -9.0, -9.0), max: Vec3::new(2.0, 9.0, 9.0) };
        let part = clip_triangle(corners, &bounds);
        assert!((part.max - Vec3::new(2.0, 2.0, 0.0)).abs().max_element() < 1e-6, "{part:?}");
        assert!((part.min - Vec3::new(1.0, 0.0, 0.0)).abs().max_element() < 1e-6, "{part:?}");
        let beside = Aabb { min: Vec3::new(0.0, 1.0, -1.0), max: Vec3::new(0.5, 2.0, 1.0) };
        assert!(clip_triangle(corners, &beside).is_empty());
    }
}
