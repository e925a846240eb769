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

/// Parts along each axis of the balls' box that are looked at for its bounds.
const PARTS: u32 = 24;
/// More than what single precision may lose there.
const ROUNDING: f32 = 1e-4;

impl Metaball {
    /// The field where it is strongest in a box.
    fn most_within(&self, part: &Aabb) -> f32 {
        let nearest = self.center.clamp(part.min, part.max);
        let rest = (1.0 - (nearest - self.center).length_squared() / (self.radius * self.radius)).max(0.0);
        self.strength * rest * rest * rest
    }

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

    /// See [`crate::ImplicitShape::bounds`]: around those parts of the space where the fields of the balls that add may reach the
    /// threshold. So much tighter than the balls themselves that it is worth the time.
    pub(super) fn bounds(&self) -> Aabb {
        let adding: Vec<&Metaball> = self.balls.iter().filter(|ball| ball.strength > 0.0).collect();
        let all = adding.iter().fold(Aabb::EMPTY, |all, ball| {
            let reach = Vec3::splat(ball.radius);
            all.union(Aabb { min: ball.center - reach, max: ball.center + reach })
        });
        let step = all.size() / PARTS as f32;
        let at = |i: u32, j: u32, k: u32| all.min + step * Vec3::new(i as f32, j as f32, k as f32);
        let parts = (0..PARTS.pow(3)).map(|n| {
            let (i, j, k) = (n % PARTS, n / PARTS % PARTS, n / (PARTS * PARTS));
            Aabb { min: at(i, j, k), max: at(i + 1, j + 1, k + 1) }
        });
        let reached = |part: &Aabb| {
            let most: f32 = adding.iter().map(|ball| ball.most_within(part)).sum();
            most >= self.threshold * (1.0 - ROUNDING)
        };
        let found = parts.filter(reached).fold(Aabb::EMPTY, Aabb::union);
        let margin = Vec3::splat(ROUNDING * all.size().max_element());
        Aabb { min: found.min - margin, max: found.max + margin }.intersection(all)
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
