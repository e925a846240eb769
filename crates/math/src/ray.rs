//! Rays.

use glam::Vec3;

/// A ray segment `origin + t * direction`, `t_min <= t <= t_max`, at a point in time.
///
/// `t` is measured in units of the direction's length; directions need not be normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where `t = 0`.
    pub origin: Vec3,
    /// Smallest accepted `t`.
    pub t_min: f32,
    /// Direction of any length but zero.
    pub direction: Vec3,
    /// Largest accepted `t`; at most [`crate::FAR`].
    pub t_max: f32,
    /// Time in the shutter interval, 0 at its opening and 1 at its closing.
    pub time: f32,
}

impl Ray {
    /// An unbounded ray at shutter opening.
    #[inline]
    #[must_use]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, t_min: 0.0, direction, t_max: crate::FAR, time: 0.0 }
    }

    /// The point at parameter `t`.
    #[inline]
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}
