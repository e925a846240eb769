//! The Julia set of `q -> q^2 + c` over quaternions, cut by a three-dimensional slice (A. Norton 1982, "Generation and
//! display of geometric fractals in 3-D").
//!
//! The surface is a level of finitely many steps: points whose iterate stays within [`Julia::BAILOUT`]. With
//! `|c| <= 2` what has left that ball never comes back, so the levels lie inside each other and close in on the set as
//! the number of steps grows; each is a smooth algebraic surface with an exact normal.

use vastlight_math::glam::{DVec3, DVec4};

/// A quaternion, real part first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion(pub DVec4);

impl Quaternion {
    /// `q * q`.
    #[inline(always)]
    #[must_use]
    pub fn squared(self) -> Self {
        self.anticommutator(Self(self.0 * 0.5))
    }

    /// `q * r + r * q`: what `q * q` changes by along `r`.
    #[inline(always)]
    #[must_use]
    pub fn anticommutator(self, r: Self) -> Self {
        let (q, r) = (self.0, r.0);
        let mut product = r * (2.0 * q.x) + q * (2.0 * r.x);
        product.x -= 2.0 * q.dot(r);
        Self(product)
    }
}

/// A quaternion Julia set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Julia {
    /// The constant that is added in each step, real part first; at most 2 long.
    pub c: [f32; 4],
    /// The last component of the quaternions that object space shows: (x, y, z) stands for x + y i + z j + slice k.
    pub slice: f32,
    /// Steps, 1 to [`Julia::MOST_STEPS`]: one more doubles the detail.
    pub iterations: u32,
}

impl Julia {
    /// What is longer than this after the last step is outside.
    pub const BAILOUT: f64 = 2.0;
    /// Most steps. More resolve what is finer than the precision of hits.
    pub const MOST_STEPS: u32 = 24;

    /// See [`crate::ImplicitShape::check`].
    pub(super) fn check(&self) -> Result<(), String> {
        let length = self.constant().0.length();
        let is_short = length <= 2.0;
        if !is_short {
            return Err(format!("the constant of a Julia set is {length} long, at most 2 can be had"));
        }
        if !(1..=Self::MOST_STEPS).contains(&self.iterations) {
            return Err(format!(
                "a Julia set has 1 to {} iterations, not {}",
                Self::MOST_STEPS,
                self.iterations
            ));
        }
        if self.radius() > 0.0 { Ok(()) } else { Err("the slice misses the Julia set".into()) }
    }

    /// The constant.
    #[must_use]
    pub fn constant(&self) -> Quaternion {
        Quaternion(DVec4::from_array(self.c.map(f64::from)))
    }

    /// The quaternion that a point of object space stands for.
    #[inline]
    #[must_use]
    pub fn quaternion(&self, p: DVec3) -> Quaternion {
        Quaternion(p.extend(f64::from(self.slice)))
    }

    /// The surface is no further from the origin: `|q^2 + c| <= b` asks for `|q|^2 <= b + |c|`. Zero if there is none.
    #[must_use]
    pub fn radius(&self) -> f64 {
        let c = self.constant().0.length();
        let reach = (0..self.iterations).fold(Self::BAILOUT, |reach, _| (reach + c).sqrt());
        let slice = f64::from(self.slice);
        let square = reach * reach - slice * slice;
        if square > 0.0 { square.sqrt() * (1.0 + 1e-12) } else { 0.0 }
    }

    /// See [`crate::ImplicitShape::field`]: what the last iterate's squared length is below the bailout's. What leaves
    /// early is told by the iterate with which it left: the sign is the same.
    pub(super) fn field(&self, p: DVec3) -> (f64, DVec3) {
        let (c, mut q) = (self.constant(), self.quaternion(p));
        let mut slopes = [DVec4::X, DVec4::Y, DVec4::Z].map(Quaternion);
        for _ in 0..self.iterations {
            slopes = slopes.map(|slope| q.anticommutator(slope));
            q = Quaternion(q.squared().0 + c.0);
            if q.0.length_squared() > 1e30 {
                break;
            }
        }
        let gradient = DVec3::from_array(slopes.map(|slope| -2.0 * q.0.dot(slope.0)));
        (Self::BAILOUT * Self::BAILOUT - q.0.length_squared(), gradient)
    }
}
