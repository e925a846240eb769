//! Axis-aligned boxes.

use glam::{Affine3, Vec3};

/// An axis-aligned box in f32. An empty box has `min > max` on every axis.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Aabb {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Aabb {
    /// The box that contains nothing: the neutral element of [`Aabb::union`].
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box of one point.
    #[inline]
    #[must_use]
    pub const fn point(p: Vec3) -> Self {
        Self { min: p, max: p }
    }

    /// The smallest box around `points`; empty without points.
    #[must_use]
    pub fn from_points<I: IntoIterator<Item = Vec3>>(points: I) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::grow)
    }

    /// This box, grown to contain `p`.
    #[inline]
    #[must_use]
    pub fn grow(self, p: Vec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// The smallest box that contains both.
    #[inline]
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The part that both share; empty (see [`Aabb::is_empty`]) if they are disjoint.
    #[inline]
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether the box contains no point.
    #[inline]
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether `other` lies inside this box (touching counts). An empty box lies inside every box.
    #[inline]
    #[must_use]
    pub fn contains(&self, other: &Self) -> bool {
        other.is_empty() || (self.min.cmple(other.min).all() && self.max.cmpge(other.max).all())
    }

    /// Edge lengths; zero for an empty box.
    #[inline]
    #[must_use]
    pub fn size(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// The middle of the box; meaningless for an empty one.
    #[inline]
    #[must_use]
    pub fn center(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// Half the surface area (`xy + yz + zx`), the measure of the surface-area heuristic. Zero for an empty box.
    #[inline]
    #[must_use]
    pub fn half_area(&self) -> f32 {
        let d = self.size();
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// The axis (0, 1, 2) along which the box is longest; the lowest on a tie.
    #[inline]
    #[must_use]
    pub fn longest_axis(&self) -> usize {
        let d = self.size();
        if d.x >= d.y && d.x >= d.z {
            0
        } else if d.y >= d.z {
            1
        } else {
            2
        }
    }

    /// The box around this box after an affine map. An empty box stays empty.
    #[must_use]
    pub fn transformed(&self, map: &Affine3) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        let corner = |i: u32| {
            let pick = |bit: u32, lo: f32, hi: f32| if i >> bit & 1 == 0 { lo } else { hi };
            Vec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        };
        Self::from_points((0..8).map(|i| map.transform_point3(corner(i))))
    }
}

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}
