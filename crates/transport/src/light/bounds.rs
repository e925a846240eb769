//! Bounds of lights: place, directions and strength, and how much they may matter to a point.
//!
//! A. Conty Estevez and C. Kulla 2018, "Importance sampling of many lights with adaptive tree splitting"; the
//! importance without trigonometric functions follows Pharr, Jakob and Humphreys 2023, "Physically based rendering",
//! 4th edition, 12.6.3. Deviation: a triangle's own plane is tested exactly.

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

    /// The narrowest cone around two, up to rounding.
    pub(super) fn union(self, other: Self) -> Self {
        let (wide, narrow) = if self.cos <= other.cos { (self, other) } else { (other, self) };
        let (angle_wide, angle_narrow) = (acos(wide.cos), acos(narrow.cos));
        let between = acos(wide.axis.dot(narrow.axis));
        if between + angle_narrow <= angle_wide {
            return wide;
        }
        let angle = 0.5 * (angle_wide + between + angle_narrow);
        let turn_axis = wide.axis.cross(narrow.axis);
        let length = turn_axis.length();
        if angle >= std::f32::consts::PI || length < 1e-6 {
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
    /// Light leaves along the normals' opposites as well.
    pub(super) two_sided: bool,
}

impl LightBounds {
    pub(super) fn union(&self, other: &Self) -> Self {
        Self {
            aabb: self.aabb.union(other.aabb),
            cone: self.cone.union(other.cone),
            cos_emission: self.cos_emission.min(other.cos_emission),
            intensity: self.intensity + other.intensity,
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
        link: 0,
        flags: LEAF,
    };

    /// A node over what `bounds` encloses, within `radius` of the box's centre.
    pub(super) fn new(bounds: &LightBounds, center: Vec3, radius: f32, link: u32) -> Self {
        Self {
            center,
            radius,
            axis: bounds.cone.axis,
            cos_cone: bounds.cone.cos,
            cos_emission: bounds.cos_emission,
            intensity: bounds.intensity,
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

    /// An estimate of the irradiance at `from` on a surface facing `normal` (zero: facing any way); positive wherever
    /// some light of the node can reach the front of that surface, and mostly zero elsewhere.
    #[inline]
    pub(super) fn importance(&self, from: Vec3, normal: Vec3, directions: bool) -> f32 {
        let to_point = from - self.center;
        let distance_squared = to_point.length_squared();
        let radius_squared = self.radius * self.radius;
        let falloff = self.intensity / distance_squared.max(radius_squared).max(1e-20);
        if self.flags & FRONT_OF_PLANE != 0 && directions && to_point.dot(self.axis) <= 0.0 {
            return 0.0;
        }
        if distance_squared <= radius_squared * 1.000_01 {
            return falloff.min(1e30);
        }
        let w = to_point / distance_squared.sqrt();
        // The angle under which the sphere is seen.
        let sin_b = self.radius / distance_squared.sqrt();
        let cos_b = (1.0 - sin_b * sin_b).max(0.0).sqrt();
        let emitted = if directions { self.emitted_cosine(w, sin_b, cos_b) } else { 1.0 };
        let received =
            if normal == Vec3::ZERO { 1.0 } else { cos_of_difference(-w.dot(normal), sin_b, cos_b) };
        (falloff * emitted.max(0.0) * received.max(0.0)).min(1e30)
    }

    /// Cosine between the nearest normal and the direction `w` to the point; 0 where no light goes.
    #[inline]
    fn emitted_cosine(&self, w: Vec3, sin_b: f32, cos_b: f32) -> f32 {
        let mut cos_w = self.axis.dot(w);
        if self.flags & TWO_SIDED != 0 {
            cos_w = cos_w.abs();
        }
        let sin_o = (1.0 - self.cos_cone * self.cos_cone).max(0.0).sqrt();
        let cos_x = cos_of_difference(cos_w, sin_o, self.cos_cone);
        let cos_nearest = cos_of_difference(cos_x, sin_b, cos_b);
        if cos_nearest < self.cos_emission { 0.0 } else { cos_nearest }
    }
}

/// cos(max(0, a - b)) from cos a and b's sine and cosine, for angles in [0, pi].
#[inline]
fn cos_of_difference(cos_a: f32, sin_b: f32, cos_b: f32) -> f32 {
    if cos_a >= cos_b {
        1.0
    } else {
        let sin_a = (1.0 - cos_a * cos_a).max(0.0).sqrt();
        cos_a * cos_b + sin_a * sin_b
    }
}
