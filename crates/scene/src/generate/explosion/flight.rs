//! Shards that are thrown from a point, fall, bounce on the floor and on the plinth, and come to rest.

use super::super::chance::Chance;
use super::super::rigid::{
    Body, Contact, KEYS_A_SECOND, Keys, Place, STEP, STEPS_A_KEY, Surface, Turn, resolve,
};
use super::shards::Shard;
use super::{BURST, DURATION, PLINTH, WALL};
use rayon::prelude::*;
use vastlight_math::Vec3;

const SURFACE: Surface = Surface { bounce: 0.32, friction: 0.55 };
/// Where the charge lies.
const CHARGE: Vec3 = Vec3::new(0.03, 0.98, -0.1);
/// A shard that moves less than this for so many steps stays: metres a second.
const STILL: f32 = 0.06;
const STEPS_TO_REST: u32 = 24;

/// Places of all shards from the burst to the end.
pub(super) fn keys(shards: &[Shard], positions: &[Vec3], chance: &Chance) -> Keys {
    let flights: Vec<Vec<Place>> = (0..shards.len())
        .into_par_iter()
        .map(|i| fly(&shards[i], &positions[shards[i].vertices.clone()], chance.part(i as u64)))
        .collect();
    let keys = flights.first().map_or(0, Vec::len);
    (0..keys).map(|key| flights.iter().map(|flight| flight[key]).collect()).collect()
}

/// The places of one shard.
fn fly(shard: &Shard, positions: &[Vec3], mut chance: Chance) -> Vec<Place> {
    let hull = hull(positions, shard.center);
    let reach = hull.iter().fold(1e-3_f32, |reach, p| reach.max(p.length()));
    let mut bodies = [thrown(shard.center, reach, &mut chance)];
    let keys = ((DURATION - BURST) * KEYS_A_SECOND as f32) as u32;
    let mut places = vec![bodies[0].place];
    let mut rest = 0;
    for _ in 0..keys {
        for _ in 0..STEPS_A_KEY {
            if rest < STEPS_TO_REST {
                let slow = step(&mut bodies, &hull, reach);
                rest = if slow { rest + 1 } else { 0 };
            }
        }
        places.push(bodies[0].place);
    }
    places
}

/// A body at the moment of the burst.
fn thrown(center: Vec3, reach: f32, chance: &mut Chance) -> Body {
    let away = center - CHARGE;
    let distance = away.length();
    let direction = (away.normalize_or(Vec3::Y) + chance.direction() * 0.28).normalize_or(Vec3::Y);
    let speed = 3.4 * chance.range(0.6, 1.25) * (0.36 / (distance + 0.13)).min(1.25);
    Body {
        place: Place { turn: Turn::NONE, at: center },
        velocity: direction * speed + Vec3::Y * chance.range(0.3, 1.4),
        spin: chance.direction() * chance.range(1.0, 11.0),
        inverse_mass: 1.0,
        inverse_inertia: 1.0 / (0.35 * reach * reach),
    }
}

/// Falls, touches, goes on; true if it hardly moved and lies on something.
fn step(bodies: &mut [Body; 1], hull: &[Vec3], reach: f32) -> bool {
    bodies[0].fall();
    let place = bodies[0].place;
    let mut contacts = Vec::new();
    for &p in hull {
        let arm = place.turn.apply(p);
        if let Some((normal, depth)) = touched(place.at + arm) {
            contacts.push(Contact { body: 0, other: None, arm, normal, depth });
        }
    }
    resolve(bodies, &contacts, &SURFACE);
    let body = &mut bodies[0];
    if !contacts.is_empty() {
        // What lies rolls badly: shards are not round.
        body.spin *= 1.0 - 1.5 * STEP;
    }
    body.advance();
    contacts.len() > 1 && body.velocity.length() + body.spin.length() * reach < STILL
}

/// The way out of floor, wall or plinth for a point in them, and how far.
fn touched(p: Vec3) -> Option<(Vec3, f32)> {
    if p.y < 0.0 {
        return Some((Vec3::Y, -p.y));
    }
    if p.z < WALL {
        return Some((Vec3::Z, WALL - p.z));
    }
    let (out_x, out_z, up) = (PLINTH.x - p.x.abs(), PLINTH.z - p.z.abs(), PLINTH.y - p.y);
    if out_x <= 0.0 || out_z <= 0.0 || up <= 0.0 {
        return None;
    }
    Some(if up < out_x.min(out_z) {
        (Vec3::Y, up)
    } else if out_x < out_z {
        (Vec3::X * 1.0_f32.copysign(p.x), out_x)
    } else {
        (Vec3::Z * 1.0_f32.copysign(p.z), out_z)
    })
}

/// The outermost points in 26 directions, from the centre.
fn hull(positions: &[Vec3], center: Vec3) -> Vec<Vec3> {
    let mut found = Vec::new();
    for i in (0..27).filter(|&i| i != 13) {
        let direction = Vec3::new((i % 3 - 1) as f32, (i / 3 % 3 - 1) as f32, (i / 9 - 1) as f32).normalize();
        let outermost = positions.iter().fold((f32::MIN, Vec3::ZERO), |best, &p| {
            let reach = p.dot(direction);
            if reach > best.0 { (reach, p) } else { best }
        });
        let point = outermost.1 - center;
        if !found.contains(&point) {
            found.push(point);
        }
    }
    found
}
