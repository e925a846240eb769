//! Bounds of lights: place, directions and strength, and how much they may matter to a point.
//!
//! A. Conty Estevez and C. Kulla 2018, "Importance sampling of many lights with adaptive tree splitting"; the
//! importance without trigonometric functions follows Pharr, Jakob and Humphreys 2023, "Physically based rendering",
//! 4th edition, 12.6.3. Deviation: a triangle's own plane is tested exactly.

use crate::words::Words;
use vastlight_math::lanes::{LANES, Lanes, Lanes3};
use vastlight_math::real::{acos, sin_cos};
use vastlight_math::{Aabb, Vec3};

/// Directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    pub(super) axis: Vec3,
    /// Cosine of the half angle; -1 for all directions.
    pub(super) cos: f32,
}

impl Cone {
    pub(super) const ALL: Self = Self { axis: Vec3::Z, cos: -1.0 };

    /// Whether a cone that is not wider lies within this one.
    fn contains(&self, narrow: &Self) -> bool {
        let sines = ((1.0 - self.cos * self.cos) * (1.0 - narrow.cos * narrow.cos)).max(0.0).sqrt();
        // The angle between the axes is at most the difference of the half angles.
        self.cos <= -1.0 || self.axis.dot(narrow.axis) >= self.cos * narrow.cos + sines - 1e-6
    }

    /// The narrowest cone around two, up to rounding.
    pub(super) fn union(self, other: Self) -> Self {
        let (wide, narrow) = if self.cos <= other.cos { (self, other) } else { (other, self) };
        if wide.contains(&narrow) {
            return wide;
        }
        let (angle_wide, angle_narrow) = (acos(wide.cos), acos(narrow.cos));
        let between = acos(wide.axis.dot(narrow.axis));
        let angle = 0.5 * (angle_wide + between + angle_narrow);
        let turn_axis = wide.axis.cross(narrow.axis);
        let length = turn_axis.length();
        if angle >= std::f32::consts::PI || length < 1e-6 {
            // All around, or two axes that are opposite.
            return Self::ALL;
        }
        let (s, c) = sin_cos(angle - angle_wide);
        let side = (turn_axis / length).cross(wide.axis);
        let axis = (wide.axis * c + side * s).normalize_or(Vec3::Z);
        // A little wider, because a light must never be left out for a rounding error.
        Self { axis, cos: sin_cos((angle + 1e-3).min(std::f32::consts::PI)).1 }
    }
}

/// What is known of a set of lights when the tree is built.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightBounds {
    pub(super) aabb: Aabb,
    /// Directions of the normals (of the axes, for spot lights).
    pub(super) cone: Cone,
    /// Cosine of the angle from the normal within which light leaves: 0 for surfaces.
    pub(super) cos_emission: f32,
    /// Sum of radiance times area, or of radiant intensity.
    pub(super) intensity: f32,
    /// Sum of the normals, weighted by intensity.
    pub(super) moment: Vec3,
    /// Light leaves along the normals' opposites as well.
    pub(super) two_sided: bool,
}

impl LightBounds {
    pub(super) fn union(&self, other: &Self) -> Self {
        // The normals of two-sided lights have no sign.
        let opposite = other.two_sided && self.moment.dot(other.moment) < 0.0;
        Self {
            aabb: self.aabb.union(other.aabb),
            cone: self.cone.union(other.cone),
            cos_emission: self.cos_emission.min(other.cos_emission),
            intensity: self.intensity + other.intensity,
            moment: self.moment + other.moment * if opposite { -1.0 } else { 1.0 },
            two_sided: self.two_sided | other.two_sided,
        }
    }

    /// The cost measure of the surface area orientation heuristic: strength, size and spread of directions.
    pub(super) fn cost(&self) -> f32 {
        let diagonal_squared = self.aabb.size().length_squared();
        self.intensity * self.direction_measure() * (self.aabb.half_area() + 0.01 * diagonal_squared)
    }

    /// Solid angle into which light leaves, weighted by the cosine beyond the cone.
    fn direction_measure(&self) -> f32 {
        use std::f32::consts::{FRAC_PI_2, PI, TAU};
        let angle = acos(self.cone.cos);
        let (sin_o, cos_o) = sin_cos(angle);
        let reach = (angle + acos(self.cos_emission)).min(PI);
        let measure = TAU * (1.0 - cos_o)
            + FRAC_PI_2
                * (2.0 * reach * sin_o - sin_cos(angle - 2.0 * reach).1 - 2.0 * angle * sin_o + cos_o);
        if self.two_sided { (2.0 * measure).min(2.0 * TAU) } else { measure }
    }
}

/// What a point asks of a node: everything within a sphere, with a cone of directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) center: Vec3,
    pub(super) radius: f32,
    pub(super) axis: Vec3,
    pub(super) cos_cone: f32,
    pub(super) cos_emission: f32,
    pub(super) intensity: f32,
    /// Mean cosine between the normals and the axis.
    alignment: f32,
    /// First of the two children, or the light of a leaf.
    pub(super) link: u32,
    pub(super) flags: u32,
}

/// The node is a leaf.
pub(super) const LEAF: u32 = 1;
/// Light leaves on both sides.
const TWO_SIDED: u32 = 2;
/// All light leaves from one plane through `center`, in front of it.
const FRONT_OF_PLANE: u32 = 4;

impl Node {
    pub(super) const NOTHING: Self = Self {
        center: Vec3::ZERO,
        radius: 0.0,
        axis: Vec3::Z,
        cos_cone: 1.0,
        cos_emission: 0.0,
        intensity: 0.0,
        alignment: 1.0,
        link: 0,
        flags: LEAF,
    };

    /// A node over what `bounds` encloses, within `radius` of `center`.
    pub(super) fn new(bounds: &LightBounds, center: Vec3, radius: f32, link: u32) -> Self {
        let cone = bounds.cone;
        // A cone of all directions has no axis of its own.
        let axis = if cone.cos <= -1.0 { bounds.moment.normalize_or(Vec3::Z) } else { cone.axis };
        let mean = bounds.moment.dot(axis) / bounds.intensity;
        Self {
            center,
            radius,
            axis,
            cos_cone: cone.cos,
            cos_emission: bounds.cos_emission,
            intensity: bounds.intensity,
            alignment: if bounds.two_sided { mean.abs() } else { mean }.clamp(0.0, 1.0),
            link,
            flags: if bounds.two_sided { TWO_SIDED } else { 0 },
        }
    }

    /// Marks a leaf; `planar`: a triangle whose plane holds `center`.
    pub(super) fn into_leaf(mut self, planar: bool) -> Self {
        self.flags |= LEAF;
        if planar && self.flags & TWO_SIDED == 0 {
            self.flags |= FRONT_OF_PLANE;
        }
        self
    }

    pub(super) fn is_leaf(&self) -> bool {
        self.flags & LEAF != 0
    }

    pub(super) fn pack(&self, words: &mut Words) {
        words.vec3(self.center);
        words.f32(self.radius);
        words.vec3(self.axis);
        words.f32s(&[self.cos_cone, self.cos_emission, self.intensity, self.alignment]);
        words.u32s(&[self.link, self.flags]);
    }

    /// An estimate of the irradiance at `from` on a surface facing `normal` (zero: facing any way); positive wherever
    /// some light of the node can reach the front of that surface, and mostly zero elsewhere. Without `directions` the
    /// lights' normals are not looked at.
    #[inline(always)]
    pub(super) fn importance(&self, from: Vec3, normal: Vec3, directions: bool) -> f32 {
        let to_point = from - self.center;
        let distance_squared = to_point.length_squared();
        let falloff = self.intensity / (distance_squared + 0.3 * self.radius * self.radius).max(1e-20);
        let inverse = 1.0 / distance_squared.max(1e-30).sqrt();
        let w = to_point * inverse;
        // The sine of the angle under which the sphere is seen. Inside it the light comes from all around, and the
        // nearer the centre the less its direction means.
        let sine = self.radius * inverse;
        let (sin_b, w) = if sine > 1.0 { (1.0, w / sine) } else { (sine, w) };
        let received = if normal == Vec3::ZERO { 1.0 } else { clipped_mean(-w.dot(normal), sin_b) };
        if received <= 0.0 {
            return 0.0;
        }
        let emitted = if directions { self.emitted_cosine(w, sin_b) } else { 1.0 };
        (falloff * emitted * received).min(1e30)
    }

    /// [`Node::importance`] by lane, with `directions`.
    #[inline(always)]
    pub(super) fn importance_lanes(&self, from: &Lanes3, normal: &Lanes3) -> Lanes {
        let (node, mut importance) = (*self, [0.0; LANES]);
        for (lane, value) in importance.iter_mut().enumerate() {
            *value = node.importance(from.get(lane), normal.get(lane), true);
        }
        importance
    }

    /// Mean cosine between the normals and the direction `w` to the point, clipped at zero; 0 where no light goes.
    #[inline(always)]
    fn emitted_cosine(&self, w: Vec3, sin_b: f32) -> f32 {
        let cos_axis = self.axis.dot(w);
        if self.flags & FRONT_OF_PLANE != 0 {
            return cos_axis.max(0.0);
        }
        let two_sided = self.flags & TWO_SIDED != 0;
        let cos_w = if two_sided { cos_axis.abs() } else { cos_axis };
        let nearest = self.nearest_cosine(cos_w, sin_b);
        if nearest < self.cos_emission || nearest <= 0.0 {
            return 0.0;
        }
        // Between normals all along the axis and normals all around.
        let around = if two_sided { 0.5 } else { 0.25 };
        let mean = around + self.alignment * (clipped_mean(cos_w, sin_b) - around);
        mean.max(0.1 * nearest)
    }

    /// Cosine of the smallest angle between a normal in the cone and a direction to the point from within the sphere.
    #[inline(always)]
    fn nearest_cosine(&self, cos_w: f32, sin_b: f32) -> f32 {
        if sin_b >= 1.0 || self.cos_cone <= -1.0 {
            return 1.0;
        }
        let sin_o = (1.0 - self.cos_cone * self.cos_cone).max(0.0).sqrt();
        let cos_b = (1.0 - sin_b * sin_b).max(0.0).sqrt();
        cos_of_difference(cos_of_difference(cos_w, sin_o, self.cos_cone), sin_b, cos_b)
    }
}

/// Mean of max(x, 0) for x uniform within `spread` of `center`, both at most 1.
#[inline(always)]
fn clipped_mean(center: f32, spread: f32) -> f32 {
    if center >= spread {
        center
    } else if center <= -spread {
        0.0
    } else {
        let above = center + spread;
        above * above / (4.0 * spread)
    }
}

/// cos(max(0, a - b)) from cos a and b's sine and cosine, for angles in [0, pi].
#[inline(always)]
fn cos_of_difference(cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a >= cos_b {
        1.0
    } else {
        let sin_a = (1.0 - cos_a * cos_a).max(0.0).sqrt();
        cos_a * cos_b + sin_a * sin_b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::{Rng, warp};

    #[test]
    fn unions_contain_both_cones_and_stay_narrow() {
        let mut rng = Rng::new(12);
        for _ in 0..2000 {
            let mut cone =
                || Cone { axis: warp::uniform_sphere(rng.next_2d()), cos: 1.0 - 1.5 * rng.next_1d() };
            let (a, b) = (cone(), cone());
            let both = a.union(b);
            for part in [a, b] {
                let reach = acos(part.axis.dot(both.axis)) + acos(part.cos);
                assert!(both.cos <= -1.0 || reach <= acos(both.cos) + 1e-3, "{a:?} {b:?} {both:?}");
            }
            let needed = 0.5 * (acos(a.cos) + acos(b.cos) + acos(a.axis.dot(b.axis)));
            let largest = needed.max(acos(a.cos)).max(acos(b.cos));
            assert!(largest > 3.1 || acos(both.cos) <= largest + 3e-3, "{a:?} {b:?} {both:?}");
        }
        // The same normal, up to rounding.
        let axis = Vec3::new(0.3, -0.7, 0.2).normalize();
        let nearly = (axis + Vec3::splat(3e-8)).normalize();
        let flat = Cone { axis, cos: 1.0 }.union(Cone { axis: nearly, cos: 1.0 });
        assert!(flat.cos > 0.999_99, "{flat:?}");
    }

    #[test]
    fn importance_is_zero_only_where_no_light_goes() {
        let mut rng = Rng::new(13);
        for _ in 0..2000 {
            let mut place =
                |scale: f32| (Vec3::new(rng.next_1d(), rng.next_1d(), rng.next_1d()) - 0.5) * scale;
            let corner = [place(2.0), place(2.0)];
            let from = place(6.0);
            let normal = warp::uniform_sphere(rng.next_2d());
            let axis = warp::uniform_sphere(rng.next_2d());
            let bounds = LightBounds {
                aabb: Aabb::from_points(corner),
                cone: Cone { axis, cos: 1.0 - rng.next_1d() },
                cos_emission: 0.0,
                intensity: 1.0,
                moment: axis * 0.8,
                two_sided: false,
            };
            let radius = 0.5 * bounds.aabb.size().length();
            let node = Node::new(&bounds, bounds.aabb.center(), radius, 0);
            // A light somewhere in the box with a normal somewhere in the cone.
            let mix = Vec3::new(rng.next_1d(), rng.next_1d(), rng.next_1d());
            let place = bounds.aabb.min + bounds.aabb.size() * mix;
            let frame = vastlight_math::Frame::from_z(axis);
            let own = frame.to_outer(warp::uniform_cone(rng.next_2d(), 1.0 - bounds.cone.cos));
            let w = (from - place).normalize();
            if w.dot(own) > 1e-3 && -w.dot(normal) > 1e-3 {
                assert!(node.importance(from, normal, true) > 0.0, "{bounds:?} {from} {normal}");
            }
        }
    }
}
