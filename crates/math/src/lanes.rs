//! Figures of many points side by side, so that loops over them become vector instructions.
//!
//! The compiler does that to a loop over all lanes whose body makes no calls, has no way out and writes to its own lanes
//! alone. Bodies are the scalar functions (`#[inline(always)]`) that single points use as well: lanes and points have the
//! same bits. Lanes that stand for nothing are computed too, whatever they hold.

use glam::{Vec2, Vec3};

/// How many points stand side by side: enough for several vectors, so that the compiler keeps the loop.
pub const LANES: usize = 32;

/// A number of each point.
pub type Lanes = [f32; LANES];

/// A [`Vec2`] of each point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes2 {
    x: Lanes,
    y: Lanes,
}

/// A [`Vec3`] of each point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes3 {
    x: Lanes,
    y: Lanes,
    z: Lanes,
}

impl Lanes2 {
    /// Zeros.
    pub const ZERO: Self = Self { x: [0.0; LANES], y: [0.0; LANES] };

    /// The value of a lane.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, lane: usize) -> Vec2 {
        Vec2::new(self.x[lane], self.y[lane])
    }

    /// Replaces the value of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec2) {
        (self.x[lane], self.y[lane]) = (v.x, v.y);
    }
}

impl Lanes3 {
    /// Zeros.
    pub const ZERO: Self = Self { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };

    /// The value of a lane.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Replaces the value of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }
}
