//! The glass vault with its ribs, purlins and tie cables, and the glazed end wall.

use super::{FAR, FIRST, HALF_WIDTH, NEAR, RISE, SPRING, materials::Finishes};
use crate::generate::builder::Builder;
use crate::generate::shape::{Assembly, Shape};
use crate::generate::{extrude::extrude, solids, tube};
use std::f32::consts::PI;
use vastlight_math::{Vec2, Vec3, real::sin_cos};

/// Panes across the vault.
const PANES: u32 = 14;
/// Distance between ribs.
const RIB: f32 = 3.0;

/// Height of the vault's axis line above the floor at `x`.
pub(super) fn vault_height(x: f32) -> f32 {
    SPRING + RISE * (1.0 - (x / HALF_WIDTH) * (x / HALF_WIDTH)).max(0.0).sqrt()
}

fn vault_point(t: f32, grow: f32) -> Vec2 {
    let (s, c) = sin_cos(PI * t);
    Vec2::new(-(HALF_WIDTH + grow) * c, SPRING + (RISE + grow) * s)
}

/// Ribs, purlins, glass, ties.
pub(super) fn roof(b: &mut Builder, finishes: &Finishes) {
    let rib = {
        let mut rib = Assembly::default();
        rib.add(finishes.steel, &rib_shape());
        b.mesh("rib", rib)
    };
    let tie = {
        let mut tie = Assembly::default();
        tie.add(finishes.steel, &tie_shape());
        b.mesh("tie cables", tie)
    };
    let count = ((NEAR - FAR) / RIB) as u32;
    for i in 0..=count {
        let at = Vec3::new(0.0, 0.0, NEAR - RIB * i as f32);
        b.place_at(rib, at);
        if i % 2 == 1 {
            b.place_at(tie, at);
        }
    }
    let mut purlins = Shape::default();
    let mut panes = Shape::default();
    let (near, far) = (NEAR, FAR);
    for i in 0..=PANES {
        let p = vault_point(i as f32 / PANES as f32, 0.0);
        purlins.merge(&tube::rod(p.extend(near), p.extend(far), 0.04, 6));
        if i < PANES {
            let (p, q) = (
                vault_point(i as f32 / PANES as f32, 0.09),
                vault_point((i + 1) as f32 / PANES as f32, 0.09),
            );
            for k in 0..count {
                let (z0, z1) = (near - RIB * k as f32, near - RIB * (k + 1) as f32);
                panes.flat_quad([p.extend(z0), p.extend(z1), q.extend(z1), q.extend(z0)]);
            }
        }
    }
    b.object("purlins", finishes.steel, &purlins);
    b.object("roof panes", finishes.glass, &panes);
}

/// One arched rib around the origin's plane.
fn rib_shape() -> Shape {
    let pieces = 42;
    let line = |grow: f32, i: u32| vault_point(i as f32 / pieces as f32, grow);
    let mut outline: Vec<Vec2> = (0..=pieces).map(|i| line(-0.2, i)).collect();
    outline.extend((0..=pieces).rev().map(|i| line(0.06, i)));
    extrude(&outline, 0.1)
}

/// A tie cable from springing to springing with its hangers: what keeps the rib from spreading.
fn tie_shape() -> Shape {
    let mut tie = Shape::default();
    let y = SPRING + 0.2;
    let knots = [-0.5, 0.0, 0.5]
        .map(|t| Vec3::new(t * HALF_WIDTH, y + 0.35 * (1.0 - (2.0 * t) * (2.0 * t) * 0.9), 0.0));
    let ends = [-1.0, 1.0].map(|s| Vec3::new(s * (HALF_WIDTH - 0.15), y, 0.0));
    for (from, to) in [(ends[0], knots[0]), (knots[0], knots[1]), (knots[1], knots[2]), (knots[2], ends[1])] {
        tie.merge(&tube::rod(from, to, 0.016, 8));
    }
    for knot in knots {
        tie.merge(&solids::sphere(0.055, 8).at(knot.x, knot.y, 0.0));
        for lean in [-1.2, 1.2] {
            let x = knot.x + lean;
            tie.merge(&tube::rod(knot, Vec3::new(x, vault_height(x) - 0.15, 0.0), 0.011, 6));
        }
    }
    tie
}

/// The far wall: mullions and glass under the last rib, above a stone base.
pub(super) fn end_window(b: &mut Builder, finishes: &Finishes) {
    let mut frame = Shape::default();
    let bays = 10;
    let width = 2.0 * HALF_WIDTH / bays as f32;
    for i in 1..bays {
        let x = width * i as f32 - HALF_WIDTH;
        let strong = i % 5 == 0;
        let (low, high) = (FIRST, vault_height(x));
        let size = Vec3::new(if strong { 0.14 } else { 0.07 }, high - low, if strong { 0.3 } else { 0.16 });
        frame.merge(&solids::beveled_box(size, 0.01).at(x, (low + high) * 0.5, FAR));
    }
    for (y, height) in
        [(FIRST + 0.1, 0.2), (9.6, 0.08), (12.2, 0.16), (14.4, 0.08), (SPRING, 0.2), (18.6, 0.08)]
    {
        let reach = if y > SPRING {
            HALF_WIDTH * (1.0 - ((y - SPRING) / RISE) * ((y - SPRING) / RISE)).sqrt()
        } else {
            HALF_WIDTH
        };
        frame.merge(&solids::beveled_box(Vec3::new(2.0 * reach, height, 0.14), 0.01).at(0.0, y, FAR));
    }
    b.object("end window frame", finishes.steel, &frame);
    b.object("end window", finishes.glass, &lunette());
    let base = solids::cuboid(Vec3::new(2.0 * HALF_WIDTH, FIRST, 0.4)).at(0.0, FIRST * 0.5, FAR - 0.2);
    b.object("end wall", finishes.limestone, &base);
}

/// The pane of the end wall, a fan around the vault's axis.
fn lunette() -> Shape {
    let mut outline = vec![Vec2::new(HALF_WIDTH, SPRING), Vec2::new(HALF_WIDTH, FIRST)];
    outline.extend([Vec2::new(-HALF_WIDTH, FIRST)]);
    outline.extend((0..=32).map(|i| vault_point(i as f32 / 32.0, 0.0)));
    let mut shape = Shape::default();
    let mut vertex = |p: Vec2| shape.vertex(p.extend(FAR - 0.02), Vec3::NEG_Z, p);
    let hub = vertex(Vec2::new(0.0, SPRING));
    let rim: Vec<u32> = outline.into_iter().map(&mut vertex).collect();
    rim.windows(2).for_each(|w| shape.triangle(hub, w[0], w[1]));
    shape
}
