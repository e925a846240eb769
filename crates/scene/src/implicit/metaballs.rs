//! Metaballs: the surface where the sum of balls' fields reaches a threshold (J. Blinn 1982, "A generalization of
//! algebraic surface drawing").
//!
//! A ball's field is `strength * (1 - r^2 / radius^2)^3` within its radius and nothing beyond: twice continuously
//! differentiable, so that normals, and with them caustics and mirror images, have no creases where a ball begins; and along a
//! ray a polynomial of degree 6 (after G. Wyvill, C. McPheeters, B. Wyvill 1986, "Data structure for soft objects", whose field has
//! the same degree).

use vastlight_math::glam::DVec3;
use vastlight_math::{Aabb, Vec3};

/// A ball's field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metaball {
    /// Centre in object space.
    pub center: Vec3,
    /// Distance from the centre beyond which there is no field.
    pub radius: f32,
    /// The field in the centre; negative for a ball that takes away.
    pub strength: f32,
}

/// Balls that melt into each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Metaballs {
    /// The balls.
    pub balls: Vec<Metaball>,
    /// The sum of fields on the surface, above 0; more is inside.
    pub threshold: f32,
}

/// Largest coordinate and radius of a ball.
const LARGEST: f32 = 1e15;

impl Metaball {
    fn is_usable(&self) -> bool {
        crate::is_usable(self.center)
            && self.radius > 0.0
            && self.radius < LARGEST
            && self.strength.is_finite()
    }
}

impl Metaballs {
    /// See [`crate::ImplicitShape::check`].
    pub(super) fn check(&self) -> Result<(), String> {
        if let Some(i) = self.balls.iter().position(|ball| !ball.is_usable()) {
            return Err(format!("metaball {i} has no size, or a number that is not finite or beyond 1e15"));
        }
        if !(self.threshold > 0.0 && self.threshold.is_finite()) {
            return Err("the threshold of metaballs is not above 0".into());
        }
        let most: f32 = self.balls.iter().map(|ball| ball.strength.max(0.0)).sum();
        if most > self.threshold { Ok(()) } else { Err("no metaball reaches the threshold".into()) }
    }

    /// See [`crate::ImplicitShape::bounds`]: around the balls that add.
    pub(super) fn bounds(&self) -> Aabb {
        let adding = self.balls.iter().filter(|ball| ball.strength > 0.0);
        adding.fold(Aabb::EMPTY, |all, ball| {
            let reach = Vec3::splat(ball.radius);
            all.union(Aabb { min: ball.center - reach, max: ball.center + reach })
        })
    }

    /// See [`crate::ImplicitShape::field`]: the sum of fields above the threshold.
    pub(super) fn field(&self, p: DVec3) -> (f64, DVec3) {
        let (mut value, mut gradient) = (-f64::from(self.threshold), DVec3::ZERO);
        for ball in &self.balls {
            let to_p = p - ball.center.as_dvec3();
            let square = f64::from(ball.radius) * f64::from(ball.radius);
            let rest = 1.0 - to_p.length_squared() / square;
            if rest > 0.0 {
                let strength = f64::from(ball.strength);
                value += strength * rest * rest * rest;
                gradient -= to_p * (6.0 * strength * rest * rest / square);
            }
        }
        (value, gradient)
    }
}
