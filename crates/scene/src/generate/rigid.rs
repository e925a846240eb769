//! Rigid bodies for demos that move: sequential impulses (Catto, "Iterative dynamics with temporal coherence", 2005,
//! without its memory of earlier steps) on bodies whose inertia is that of a ball, stepped at a fixed rate.
//!
//! Plain arithmetic and square roots alone: the same bits on every machine.

use super::moments;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Mul;
use vastlight_math::{Vec3, real::sin_cos};

/// Metres a second squared.
pub(super) const GRAVITY: Vec3 = Vec3::new(0.0, -9.81, 0.0);
/// Kept moments a second, and steps from one to the next.
pub(super) const KEYS_A_SECOND: u32 = 60;
pub(super) const STEPS_A_KEY: u32 = 4;
/// Seconds a step.
pub(super) const STEP: f32 = 1.0 / (KEYS_A_SECOND * STEPS_A_KEY) as f32;

/// A unit quaternion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Turn {
    pub(super) w: f32,
    pub(super) v: Vec3,
}

impl Turn {
    /// No turn.
    pub(super) const NONE: Self = Self { w: 1.0, v: Vec3::ZERO };

    /// A turn about a unit axis, radians.
    pub(super) fn about(axis: Vec3, angle: f32) -> Self {
        let (s, c) = sin_cos(0.5 * angle);
        Self { w: c, v: axis * s }
    }

    /// A vector, turned.
    pub(super) fn apply(self, p: Vec3) -> Vec3 {
        let t = self.v.cross(p) * 2.0;
        p + t * self.w + self.v.cross(t)
    }

    /// The cosine of half the angle between two turns; negative where one of them is better negated.
    pub(super) fn dot(self, other: Self) -> f32 {
        self.w * other.w + self.v.dot(other.v)
    }

    /// A sum of turns as a turn.
    pub(super) fn normalized(self) -> Self {
        let length = self.dot(self).sqrt();
        if length > 0.0 { Self { w: self.w / length, v: self.v / length } } else { Self::NONE }
    }

    /// This turn after it went on with `spin` radians a second for a short while.
    fn spun(self, spin: Vec3, seconds: f32) -> Self {
        let change = Self { w: 0.0, v: spin * (0.5 * seconds) } * self;
        Self { w: self.w + change.w, v: self.v + change.v }.normalized()
    }

    /// On the short way from this to `other`.
    pub(super) fn towards(self, other: Self, t: f32) -> Self {
        let far = if self.dot(other) < 0.0 { -t } else { t };
        Self { w: self.w * (1.0 - t) + other.w * far, v: self.v * (1.0 - t) + other.v * far }.normalized()
    }
}

impl Mul for Turn {
    type Output = Self;

    /// First `other`, then this.
    fn mul(self, other: Self) -> Self {
        Self {
            w: self.w * other.w - self.v.dot(other.v),
            v: other.v * self.w + self.v * other.w + self.v.cross(other.v),
        }
    }
}

/// Where a body is: a turn about its own origin, then a move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Place {
    pub(super) turn: Turn,
    pub(super) at: Vec3,
}

impl Place {
    /// A point of the body in the world.
    pub(super) fn point(&self, p: Vec3) -> Vec3 {
        self.turn.apply(p) + self.at
    }

    fn towards(&self, other: &Self, t: f32) -> Self {
        Self { turn: self.turn.towards(other.turn, t), at: self.at.lerp(other.at, t) }
    }
}

/// Kept moments of many bodies, [`KEYS_A_SECOND`] apart.
pub(super) type Keys = Vec<Vec<Place>>;

/// All bodies at a time in seconds; the ends hold. Without keys there are no bodies.
pub(super) fn between_keys(keys: &Keys, time: f32) -> Vec<Place> {
    moments::between(keys, KEYS_A_SECOND, time, Place::towards)
}

/// Puts bodies, whose vertices follow each other, at their places: of each the number of vertices, the middle that they are
/// around, and the place.
pub(super) fn carry(
    bodies: impl Iterator<Item = (usize, Vec3, Place)>,
    mut positions: &mut [Vec3],
    mut normals: &mut [Vec3],
) {
    let mut parts = Vec::new();
    for (count, middle, place) in bodies {
        let (p, n);
        (p, positions) = positions.split_at_mut(count);
        (n, normals) = normals.split_at_mut(count);
        parts.push((middle, place, p, n));
    }
    parts.into_par_iter().for_each(|(middle, place, positions, normals)| {
        positions.iter_mut().for_each(|p| *p = place.point(*p - middle));
        normals.iter_mut().for_each(|n| *n = place.turn.apply(*n));
    });
}

/// A body in motion around its centre of mass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    pub(super) place: Place,
    /// Metres a second.
    pub(super) velocity: Vec3,
    /// Radians a second, about the world's axes.
    pub(super) spin: Vec3,
    /// One over kilograms, and one over their moment of inertia about any axis.
    pub(super) inverse_mass: f32,
    pub(super) inverse_inertia: f32,
}

impl Body {
    /// Velocity of the point at `arm` from the centre.
    fn velocity_at(&self, arm: Vec3) -> Vec3 {
        self.velocity + self.spin.cross(arm)
    }

    fn push(&mut self, arm: Vec3, impulse: Vec3) {
        self.velocity += impulse * self.inverse_mass;
        self.spin += arm.cross(impulse) * self.inverse_inertia;
    }

    /// Change of velocity along `direction` at `arm` for a unit impulse.
    fn yielding(&self, arm: Vec3, direction: Vec3) -> f32 {
        self.inverse_mass + arm.cross(direction).length_squared() * self.inverse_inertia
    }

    /// Falls for a step.
    pub(super) fn fall(&mut self) {
        self.velocity += GRAVITY * STEP;
    }

    /// Goes on for a step.
    pub(super) fn advance(&mut self) {
        self.place.at += self.velocity * STEP;
        self.place.turn = self.place.turn.spun(self.spin, STEP);
    }
}

/// How surfaces meet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Part of the speed that is left after a bounce.
    pub(super) bounce: f32,
    /// Coulomb's coefficient.
    pub(super) friction: f32,
}

/// Two bodies that touch, or a body and what stands still.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    pub(super) body: usize,
    /// The other body and the contact's place from its centre.
    pub(super) other: Option<(usize, Vec3)>,
    /// The contact's place from the body's centre.
    pub(super) arm: Vec3,
    /// Towards the body.
    pub(super) normal: Vec3,
    /// Metres that they are inside of each other.
    pub(super) depth: f32,
}

/// Speeds below this do not bounce, metres a second.
const SLOW: f32 = 0.25;
/// Depth that is let be, metres, and the part of the rest that is undone in a step.
const SLOP: f32 = 5e-4;
const UNDONE: f32 = 0.2;
/// The fastest that bodies are taken apart, metres a second.
const APART: f32 = 1.0;
const ROUNDS: u32 = 4;

/// Changes velocities until no contact goes deeper, nearly.
pub(super) fn resolve(bodies: &mut [Body], contacts: &[Contact], surface: &Surface) {
    for round in 0..ROUNDS {
        let bounce = if round == 0 { surface.bounce } else { 0.0 };
        for contact in contacts {
            meet(bodies, contact, bounce, surface.friction);
        }
    }
}

fn meet(bodies: &mut [Body], contact: &Contact, bounce: f32, friction: f32) {
    let Contact { body, other, arm, normal, depth } = *contact;
    let relative = |bodies: &[Body]| {
        let theirs = other.map_or(Vec3::ZERO, |(other, arm)| bodies[other].velocity_at(arm));
        bodies[body].velocity_at(arm) - theirs
    };
    let yielding = |bodies: &[Body], direction: Vec3| {
        let theirs = other.map_or(0.0, |(other, arm)| bodies[other].yielding(arm, direction));
        bodies[body].yielding(arm, direction) + theirs
    };
    let push = |bodies: &mut [Body], impulse: Vec3| {
        bodies[body].push(arm, impulse);
        if let Some((other, arm)) = other {
            bodies[other].push(arm, -impulse);
        }
    };
    let closing = relative(bodies).dot(normal);
    let bounced = if closing < -SLOW { -bounce * closing } else { 0.0 };
    let apart = ((depth - SLOP).max(0.0) * UNDONE / STEP).min(APART);
    let impulse = (bounced.max(apart) - closing) / yielding(bodies, normal);
    if impulse <= 0.0 {
        return;
    }
    push(bodies, normal * impulse);
    let velocity = relative(bodies);
    let sliding = velocity - normal * velocity.dot(normal);
    let speed = sliding.length();
    if speed > 1e-6 {
        let direction = sliding / speed;
        let stop = speed / yielding(bodies, direction);
        push(bodies, direction * -stop.min(friction * impulse));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(at: Vec3, velocity: Vec3) -> Body {
        let place = Place { turn: Turn::NONE, at };
        Body { place, velocity, spin: Vec3::ZERO, inverse_mass: 1.0, inverse_inertia: 2.5 }
    }

    #[test]
    fn turns_compose_and_invert() {
        let a = Turn::about(Vec3::X, 0.7) * Turn::about(Vec3::Y, -1.2);
        let p = Vec3::new(0.3, -2.0, 1.1);
        let by_hand = Turn::about(Vec3::X, 0.7).apply(Turn::about(Vec3::Y, -1.2).apply(p));
        assert!((a.apply(p) - by_hand).length() < 1e-5);
        let back = Turn { w: a.w, v: -a.v };
        assert!((back.apply(a.apply(p)) - p).length() < 1e-5);
        assert!((Turn::about(Vec3::Z, std::f32::consts::FRAC_PI_2).apply(Vec3::X) - Vec3::Y).length() < 1e-6);
        let half = Turn::NONE.towards(Turn::about(Vec3::Y, 1.0), 0.5);
        assert!((half.apply(p) - Turn::about(Vec3::Y, 0.5).apply(p)).length() < 1e-5);
        let negated = Turn { w: -a.w, v: -a.v };
        assert!((a.towards(negated, 0.5).apply(p) - a.apply(p)).length() < 1e-5);
    }

    #[test]
    fn a_free_body_goes_straight_and_turns_about_its_axis() {
        let start = Turn::about(Vec3::X, 0.7);
        let mut body = ball(Vec3::Y, Vec3::new(2.0, 0.0, -1.0));
        (body.place.turn, body.spin) = (start, Vec3::Y * 3.0);
        let mut keys = vec![vec![body.place]];
        for _ in 0..KEYS_A_SECOND {
            (0..STEPS_A_KEY).for_each(|_| body.advance());
            keys.push(vec![body.place]);
        }
        let p = Vec3::new(0.3, -2.0, 1.1);
        // Within keys and between them; the ends hold.
        for (time, then) in [(0.0, 0.0), (0.5, 0.5), (0.7583, 0.7583), (1.0, 1.0), (7.0, 1.0)] {
            let expected = Turn::about(Vec3::Y, 3.0 * then) * start;
            let at = Vec3::new(2.0 * then, 1.0, -then);
            let found = between_keys(&keys, time)[0].point(p);
            assert!((found - expected.apply(p) - at).length() < 1e-3, "{time}: {found}");
        }
    }

    #[test]
    fn a_blow_keeps_momentum_and_loses_no_more_energy_than_asked() {
        for bounce in [0.0, 0.5, 1.0] {
            let mut bodies = [ball(Vec3::ZERO, Vec3::X * 3.0), ball(Vec3::X * 2.0, -Vec3::X)];
            let contact =
                Contact { body: 1, other: Some((0, Vec3::X)), arm: -Vec3::X, normal: Vec3::X, depth: 0.0 };
            resolve(&mut bodies, &[contact], &Surface { bounce, friction: 0.0 });
            let [a, b] = bodies.map(|b| b.velocity.x);
            assert!((a + b - 2.0).abs() < 1e-5, "{a} {b}");
            assert!((b - a - 4.0 * bounce).abs() < 1e-5, "{a} {b}");
        }
    }

    #[test]
    fn friction_makes_a_sliding_ball_roll() {
        // Until it rolls, friction's part of gravity slows it.
        // A solid ball that slides at 1 m/s rolls at 5/7 m/s in the end, whatever the friction.
        let mut bodies = [ball(Vec3::ZERO, Vec3::X)];
        for step in 0..480 {
            let sliding = 1.0 - 0.2 * 9.81 * STEP * step as f32;
            assert!(step > 24 || (bodies[0].velocity.x - sliding).abs() < 1e-3, "{step}: {:?}", bodies[0]);
            bodies[0].fall();
            let contact = Contact { body: 0, other: None, arm: -Vec3::Y, normal: Vec3::Y, depth: 0.0 };
            resolve(&mut bodies, &[contact], &Surface { bounce: 0.3, friction: 0.2 });
        }
        assert!((bodies[0].velocity.x - 5.0 / 7.0).abs() < 1e-3, "{:?}", bodies[0]);
        assert!((bodies[0].spin.z + 5.0 / 7.0).abs() < 1e-3, "{:?}", bodies[0]);
        assert!(bodies[0].velocity.y.abs() < 1e-4);
    }
}
