//! The great stair to the first gallery and the bridge it arrives on.

use super::{FAR, FIRST, HALF_WIDTH, materials::Finishes};
use crate::generate::builder::Builder;
use crate::generate::shape::{Assembly, Shape};
use crate::generate::{extrude::extrude, solids, tube};
use std::f32::consts::FRAC_PI_2;
use vastlight_math::{Vec2, Vec3};

/// Steps in each of the two flights, and their measures.
const STEPS: u32 = 21;
const RISER: f32 = FIRST / (2 * STEPS) as f32;
const TREAD: f32 = 0.3;
/// Length of the landing between the flights.
const LANDING: f32 = 1.6;
const WIDTH: f32 = 4.6;
/// Depth of the bridge at the top.
const BRIDGE: f32 = 2.6;

/// Where step `i` begins (its riser) along z.
fn step_front(i: u32) -> f32 {
    let top = FAR + BRIDGE;
    let rest = (2 * STEPS - i) as f32 * TREAD + if i < STEPS { LANDING } else { 0.0 };
    top + rest
}

/// Stair, bridge and railings.
pub(super) fn stairs(b: &mut Builder, finishes: &Finishes) {
    let mut stair = Assembly::default();
    stair.add(finishes.steps, &treads());
    stair.add(finishes.limestone, &flight_body());
    b.assembled("great stair", stair);
    let bridge = Vec3::new(2.0 * HALF_WIDTH, 0.5, BRIDGE);
    let shape = solids::beveled_box(bridge, 0.03).at(0.0, FIRST - 0.25, FAR + BRIDGE * 0.5);
    b.object("bridge", finishes.limestone, &shape);
    let mut rail = Assembly::default();
    for side in [-1.0, 1.0] {
        railing(&mut rail, finishes, side);
    }
    b.assembled("stair railing", rail);
}

fn treads() -> Shape {
    let mut shape = Shape::default();
    for i in 0..2 * STEPS {
        let y = RISER * (i + 1) as f32;
        let depth = step_front(i) - if i + 1 < 2 * STEPS { step_front(i + 1) } else { FAR + BRIDGE };
        let (low, high) = (y - 0.05, y);
        let front = step_front(i) + 0.03;
        shape.merge(&solids::block(
            Vec3::new(-WIDTH * 0.5, low, front - depth - 0.03),
            Vec3::new(WIDTH * 0.5, high, front),
            0.008,
        ));
    }
    shape
}

/// The masonry under the treads: a saw-toothed side view, pushed across the stair's width.
fn flight_body() -> Shape {
    // In (x, y) with x = -z, so that the outline runs counter-clockwise.
    let mut outline = vec![Vec2::new(-step_front(0), 0.0), Vec2::new(-(FAR + BRIDGE), 0.0)];
    for i in (0..2 * STEPS).rev() {
        let y = RISER * (i + 1) as f32 - 0.04;
        let back = if i + 1 < 2 * STEPS { step_front(i + 1) } else { FAR + BRIDGE };
        outline.push(Vec2::new(-back, y));
        outline.push(Vec2::new(-step_front(i), y));
    }
    extrude(&outline, WIDTH - 0.16).turned(FRAC_PI_2)
}

fn railing(rail: &mut Assembly, finishes: &Finishes, side: f32) {
    let x = side * (WIDTH * 0.5 - 0.12);
    let mut bars = Shape::default();
    for i in 0..2 * STEPS {
        let y = RISER * (i + 1) as f32;
        for part in [0.25, 0.75] {
            let z = step_front(i) - TREAD * part;
            let lift = RISER * (part - 0.5);
            bars.merge(&tube::rod(Vec3::new(x, y, z), Vec3::new(x, y + 0.93 + lift, z), 0.01, 6));
        }
    }
    let corner = |i: u32| Vec3::new(x, RISER * i as f32 + 0.95, step_front(i.min(2 * STEPS - 1)));
    let landing = Vec3::new(x, corner(STEPS).y, step_front(STEPS));
    let landing_start = Vec3::new(x, corner(STEPS).y, landing.z + LANDING);
    let top = Vec3::new(x, FIRST + 0.98, FAR + BRIDGE);
    let path = [corner(0), landing_start, landing, top, top - Vec3::Z * 0.5];
    rail.add(finishes.bronze, &bars);
    rail.add(finishes.wood, &tube::tube(&tube::rounded_path(&path, 0.25, 6), 0.035, 12));
    let newel = Vec3::new(0.16, 1.15, 0.16);
    rail.add(finishes.bronze, &solids::beveled_box(newel, 0.02).at(x, 0.57, step_front(0) + 0.02));
    bridge_rail(rail, finishes, side);
}

/// The railing along the bridge beside the stair's arrival.
fn bridge_rail(rail: &mut Assembly, finishes: &Finishes, side: f32) {
    let (from, to) = (side * (WIDTH * 0.5 - 0.12), side * (HALF_WIDTH - 0.5));
    let z = FAR + BRIDGE - 0.12;
    let count = ((to - from).abs() / 0.136) as u32;
    let mut bars = Shape::default();
    for i in 0..=count {
        let x = from + (to - from) * i as f32 / count as f32;
        bars.merge(&tube::rod(Vec3::new(x, FIRST, z), Vec3::new(x, FIRST + 1.0, z), 0.011, 6));
    }
    rail.add(finishes.bronze, &bars);
    let size = Vec3::new((to - from).abs(), 0.06, 0.11);
    rail.add(finishes.wood, &solids::beveled_box(size, 0.02).at((from + to) * 0.5, FIRST + 1.03, z));
}
