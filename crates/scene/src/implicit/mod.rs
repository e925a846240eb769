//! Implicit surfaces: shapes that are where a function of space is zero, met by rays directly, without triangles.
//!
//! A shape is data and its function ([`ImplicitShape::field`]): positive inside, negative outside. How rays find its
//! zeros is the tracer's business. A mesh carries a shape in the place of triangles, so that instances, materials and
//! names are those of any mesh.

mod julia;
mod metaballs;

pub use julia::{Julia, Quaternion};
pub use metaballs::{Metaball, Metaballs};

use vastlight_math::glam::DVec3;
use vastlight_math::{Aabb, Vec3};

/// A surface given by a function.
#[derive(Clone, Debug, PartialEq)]
pub enum ImplicitShape {
    /// Balls that melt into each other.
    Metaballs(Metaballs),
    /// A quaternion Julia set.
    Julia(Julia),
}

/// A point of an implicit surface in its object's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImplicitPoint {
    /// Position.
    pub position: DVec3,
    /// Outward normal of any length; zero where the function has no slope.
    pub normal: DVec3,
}

/// Steps after which a point that converges to the surface is there.
const PROJECTION_STEPS: usize = 6;

impl ImplicitShape {
    /// What is wrong with the shape, if anything is.
    ///
    /// # Errors
    /// In words: a number that is not finite or out of range, or nothing there at all.
    pub fn check(&self) -> Result<(), String> {
        match self {
            Self::Metaballs(shape) => shape.check(),
            Self::Julia(shape) => shape.check(),
        }
    }

    /// A box around the surface in object space.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Metaballs(shape) => shape.bounds(),
            Self::Julia(shape) => {
                let radius = Vec3::splat((shape.radius() as f32).next_up());
                Aabb { min: -radius, max: radius }
            }
        }
    }

    /// The function, positive inside and negative outside, and its gradient.
    #[must_use]
    pub fn field(&self, p: DVec3) -> (f64, DVec3) {
        match self {
            Self::Metaballs(shape) => shape.field(p),
            Self::Julia(shape) => shape.field(p),
        }
    }

    /// The point of the surface beside a point that is within a rounding of a ray's hit, by Newton's steps along the
    /// gradient. A point without such a neighbour stays where it is.
    #[must_use]
    pub fn project(&self, near: DVec3) -> ImplicitPoint {
        let (mut position, (mut value, mut gradient)) = (near, self.field(near));
        for _ in 0..PROJECTION_STEPS {
            let next = position - gradient * (value / gradient.length_squared());
            let there = self.field(next);
            let is_closer = there.0.abs() < value.abs();
            if !is_closer {
                break;
            }
            (position, (value, gradient)) = (next, there);
        }
        ImplicitPoint { position, normal: -gradient }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> [ImplicitShape; 3] {
        let ball = |x: f32, radius: f32, strength: f32| Metaball {
            center: Vec3::new(x, 0.3 * x * x, -0.2 * x),
            radius,
            strength,
        };
        let balls = vec![ball(-0.7, 1.1, 1.0), ball(0.1, 0.8, -0.4), ball(0.6, 1.0, 1.2)];
        let julia = |c, slice, iterations| ImplicitShape::Julia(Julia { c, slice, iterations });
        [
            ImplicitShape::Metaballs(Metaballs { balls, threshold: 0.25 }),
            julia([-0.2, 0.8, 0.0, 0.0], 0.0, 7),
            julia([-0.291, -0.399, 0.339, 0.437], 0.1, 5),
        ]
    }

    /// Points around a shape, the same each time.
    fn points(count: usize) -> impl Iterator<Item = DVec3> {
        let at = |i: usize, step: f64| (i as f64 * step).fract() * 3.0 - 1.5;
        (1..=count).map(move |i| DVec3::new(at(i, 0.819_172_5), at(i, 0.671_043_6), at(i, 0.549_700_5)))
    }

    #[test]
    fn gradients_are_those_of_finite_differences() {
        for shape in shapes() {
            let mut wrong = 0;
            for p in points(2_000) {
                let (value, gradient) = shape.field(p);
                if value.abs() > 50.0 {
                    continue;
                }
                let slope = |axis: DVec3| {
                    let h = 1e-6;
                    (shape.field(p + axis * h).0 - shape.field(p - axis * h).0) / (2.0 * h)
                };
                let found = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
                assert!((found - gradient).length() <= 1e-4 * (1.0 + gradient.length()), "{shape:?} {p}");
                // The negative control: a gradient of the neighbourhood is not this one.
                let beside = shape.field(p + DVec3::splat(0.02)).1;
                wrong += usize::from((found - beside).length() > 1e-4 * (1.0 + gradient.length()));
            }
            assert!(wrong > 20);
        }
    }

    #[test]
    fn the_bounds_hold_all_that_is_inside() {
        for shape in shapes() {
            let bounds = shape.bounds();
            let inside = points(20_000).filter(|&p| shape.field(p).0 > 0.0);
            let count = inside
                .inspect(|p| assert!(bounds.contains(&Aabb::point(p.as_vec3())), "{shape:?} {p}"))
                .count();
            assert!(count > 100);
        }
    }

    #[test]
    fn projections_lie_on_the_surface() {
        for shape in shapes() {
            let mut count = 0;
            for p in points(80_000) {
                let (value, gradient) = shape.field(p);
                let is_near = value.abs() / gradient.length() < 2e-4;
                if !is_near {
                    continue;
                }
                let there = shape.project(p);
                assert!(shape.field(there.position).0.abs() <= 1e-11 * (1.0 + gradient.length()));
                assert!(there.position.distance(p) < 1e-3);
                assert!(there.normal.dot(gradient) < 0.0);
                count += 1;
            }
            assert!(count > 0);
        }
        let far = shapes()[0].project(DVec3::splat(9.0));
        assert_eq!((far.position, far.normal), (DVec3::splat(9.0), DVec3::ZERO), "nothing is near");
    }

    #[test]
    fn shapes_that_cannot_be_are_refused() {
        let ball = Metaball { center: Vec3::ZERO, radius: 1.0, strength: 1.0 };
        let balls = |balls: Vec<Metaball>, threshold| {
            ImplicitShape::Metaballs(Metaballs { balls, threshold }).check()
        };
        assert!(balls(vec![ball], 0.5).is_ok());
        assert!(balls(vec![], 0.5).is_err());
        assert!(balls(vec![ball], 0.0).is_err() && balls(vec![ball], f32::NAN).is_err());
        assert!(balls(vec![Metaball { radius: 0.0, ..ball }], 0.5).is_err());
        assert!(balls(vec![Metaball { strength: f32::INFINITY, ..ball }], 0.5).is_err());
        assert!(balls(vec![Metaball { strength: -1.0, ..ball }], 0.5).is_err(), "nothing is inside");
        assert!(balls(vec![Metaball { center: Vec3::splat(1e20), ..ball }], 0.5).is_err());
        let julia = |c, slice, iterations| ImplicitShape::Julia(Julia { c, slice, iterations }).check();
        assert!(julia([-0.2, 0.8, 0.0, 0.0], 0.0, 9).is_ok());
        assert!(julia([f32::NAN, 0.0, 0.0, 0.0], 0.0, 9).is_err());
        assert!(julia([2.0, 1.0, 0.0, 0.0], 0.0, 9).is_err());
        assert!(julia([0.0; 4], 5.0, 9).is_err(), "the slice misses the set");
        assert!(julia([0.0; 4], 0.0, 0).is_err() && julia([0.0; 4], 0.0, 99).is_err());
    }
}
