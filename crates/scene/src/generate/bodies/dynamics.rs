//! Bodies that fly, meet each other, and gather in a bowl.
//!
//! Bodies are compounds of balls. Pairs are found by sweep and prune along x, contacts between their balls once a step,
//! and resolved by `rigid`. All sums run in one order: the same bits for any number of threads.

use super::super::rigid::{
    Body, Contact, KEYS_A_SECOND, Keys, Place, STEP, STEPS_A_KEY, Surface, between_keys, resolve,
};
use super::kinds::Kind;
use super::{BOWL, DURATION, Thing};
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;
use vastlight_math::Vec3;

const SURFACE: Surface = Surface { bounce: 0.35, friction: 0.4 };
/// Part of the spin that a body in touch with something loses in a second.
const ROLLING: f32 = 1.2;

/// The movement of all bodies, found when it is needed first.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Flight {
    pub(super) things: Vec<Thing>,
    #[serde(skip)]
    keys: OnceLock<Keys>,
}

impl Flight {
    pub(super) fn new(things: Vec<Thing>) -> Self {
        Self { things, keys: OnceLock::new() }
    }

    /// Places of all bodies.
    pub(super) fn at(&self, time: f32) -> Vec<Place> {
        if time <= 0.0 {
            return self.things.iter().map(|thing| thing.place).collect();
        }
        between_keys(self.keys.get_or_init(|| keys(&self.things)), time)
    }
}

fn keys(things: &[Thing]) -> Keys {
    let mut world = World::new(things);
    let mut keys = vec![world.places()];
    for _ in 0..(DURATION * KEYS_A_SECOND as f32) as u32 {
        for _ in 0..STEPS_A_KEY {
            world.step();
        }
        keys.push(world.places());
    }
    keys
}

struct World {
    bodies: Vec<Body>,
    /// Balls of each body around its own origin, and their common reach.
    balls: Vec<Vec<(Vec3, f32)>>,
    reaches: Vec<f32>,
    /// Bodies by their least x, nearly sorted from the step before.
    order: Vec<usize>,
    /// Middles of all balls in the world in this step, from the bodies' middles.
    arms: Vec<Vec<Vec3>>,
}

impl World {
    fn new(things: &[Thing]) -> Self {
        let scaled = |thing: &Thing| {
            let balls = thing.kind.balls();
            balls.into_iter().map(|(c, r)| (c * thing.size, r * thing.size)).collect::<Vec<_>>()
        };
        let balls: Vec<Vec<(Vec3, f32)>> = things.iter().map(scaled).collect();
        Self {
            bodies: things.iter().map(body).collect(),
            reaches: things.iter().map(|t| t.size * Kind::REACH).collect(),
            order: (0..things.len()).collect(),
            arms: balls.iter().map(|b| vec![Vec3::ZERO; b.len()]).collect(),
            balls,
        }
    }

    fn places(&self) -> Vec<Place> {
        self.bodies.iter().map(|body| body.place).collect()
    }

    fn step(&mut self) {
        for ((body, arms), balls) in self.bodies.iter_mut().zip(&mut self.arms).zip(&self.balls) {
            body.fall();
            for (arm, (center, _)) in arms.iter_mut().zip(balls) {
                *arm = body.place.turn.apply(*center);
            }
        }
        let mut contacts = Vec::new();
        self.meet_each_other(&mut contacts);
        self.meet_the_bowl(&mut contacts);
        resolve(&mut self.bodies, &contacts, &SURFACE);
        for contact in &contacts {
            self.bodies[contact.body].spin *= 1.0 - ROLLING * STEP / self.balls[contact.body].len() as f32;
        }
        self.bodies.iter_mut().for_each(Body::advance);
    }

    /// Contacts of bodies whose spans along x overlap.
    fn meet_each_other(&mut self, contacts: &mut Vec<Contact>) {
        let low = |body: usize| self.bodies[body].place.at.x - self.reaches[body];
        self.order.sort_by(|&a, &b| low(a).total_cmp(&low(b)));
        for (i, &a) in self.order.iter().enumerate() {
            let end = self.bodies[a].place.at.x + self.reaches[a];
            for &b in self.order[i + 1..].iter().take_while(|&&b| low(b) < end) {
                let apart = self.bodies[a].place.at - self.bodies[b].place.at;
                let reach = self.reaches[a] + self.reaches[b];
                if apart.length_squared() < reach * reach {
                    self.meet_pair(a, b, contacts);
                }
            }
        }
    }

    fn meet_pair(&self, a: usize, b: usize, contacts: &mut Vec<Contact>) {
        let between = self.bodies[a].place.at - self.bodies[b].place.at;
        for (arm_a, (_, radius_a)) in self.arms[a].iter().zip(&self.balls[a]) {
            let from_b = between + *arm_a;
            let reach = self.reaches[b] + radius_a;
            if from_b.length_squared() > reach * reach {
                continue;
            }
            for (arm_b, (_, radius_b)) in self.arms[b].iter().zip(&self.balls[b]) {
                let apart = from_b - *arm_b;
                let (distance_squared, touch) = (apart.length_squared(), radius_a + radius_b);
                if distance_squared >= touch * touch || distance_squared == 0.0 {
                    continue;
                }
                let distance = distance_squared.sqrt();
                let normal = apart / distance;
                contacts.push(Contact {
                    body: a,
                    other: Some((b, *arm_b + normal * *radius_b)),
                    arm: *arm_a - normal * *radius_a,
                    normal,
                    depth: touch - distance,
                });
            }
        }
    }

    /// Contacts with bowl and floor.
    fn meet_the_bowl(&self, contacts: &mut Vec<Contact>) {
        for (body, arms) in self.arms.iter().enumerate() {
            for (arm, (_, radius)) in arms.iter().zip(&self.balls[body]) {
                for (normal, depth) in
                    BOWL.touched(self.bodies[body].place.at + *arm, *radius).into_iter().flatten()
                {
                    let arm = *arm - normal * *radius;
                    contacts.push(Contact { body, other: None, arm, normal, depth });
                }
            }
        }
    }
}

fn body(thing: &Thing) -> Body {
    let mass = thing.size * thing.size * thing.size * 1000.0;
    Body {
        place: thing.place,
        velocity: thing.velocity,
        spin: thing.spin,
        inverse_mass: 1.0 / mass,
        inverse_inertia: 1.0 / (mass * thing.size * thing.size * thing.kind.inertia()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::rigid::Turn;
    use super::*;

    #[test]
    fn both_bodies_of_a_contact_have_it_at_one_place() {
        let thing = |kind: Kind, at: Vec3| Thing {
            kind,
            material: 0,
            size: 0.1,
            place: Place { turn: Turn::about(Vec3::Z, 0.4), at },
            velocity: Vec3::ZERO,
            spin: Vec3::ZERO,
        };
        let apart = Vec3::new(0.1, 0.1, 0.03);
        let mut world = World::new(&[thing(Kind::Knot, Vec3::Y), thing(Kind::Cube, Vec3::Y + apart)]);
        world.step();
        let mut contacts = Vec::new();
        world.meet_each_other(&mut contacts);
        assert!(!contacts.is_empty());
        for Contact { body, other, arm, normal, depth } in contacts {
            let (other, other_arm) = other.expect("another body");
            let point = |body: usize, arm: Vec3| world.bodies[body].place.at + arm;
            let into = point(other, other_arm) - point(body, arm);
            assert!((into - normal * depth).length() < 1e-5 && depth > 0.0, "{into} {normal} {depth}");
        }
    }
}
