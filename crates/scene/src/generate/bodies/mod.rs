//! Balls, rings, cubes and knots that fly against each other and gather in a bowl: all of them are one mesh that deforms.
//! A function of time.

mod bowl;
mod dynamics;
mod kinds;
#[cfg(test)]
mod tests;

use super::caustic_sphere::square_lamps;
use super::chance::Chance;
use super::palette::{gold, lacquer, srgb, stone};
use super::record::{Recorded, are_near};
use super::rigid::{Place, Turn, carry};
use super::shape::{Assembly, Shape};
use super::{GenerateOptions, builder::Builder, solids, textures};
use crate::{
    Camera, ColorInput, Encoding, Environment, Material, MeshPose, Motion, MotionRecord, Pose, Projection,
    SceneDesc, SceneError,
};
use bowl::Bowl;
use dynamics::Flight;
use kinds::Kind;
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;
use std::sync::Arc;
use vastlight_math::{Affine3, Vec2, Vec3};

/// Seconds.
const DURATION: f32 = 6.0;
const BOWL: Bowl = Bowl { radius: 1.75, lift: 0.12, thickness: 0.06, rim: 0.95 };
/// Bodies in each of the two swarms, metres between them, and where the swarm on the right has its middle.
const SWARM: usize = 140;
const SPACING: f32 = 0.33;
const MIDDLE: Vec3 = Vec3::new(1.75, 2.35, 0.0);
/// Triangles of the mesh unless other numbers are asked for.
const USUAL: u64 = 150_000;

/// The scene.
pub(super) fn bodies(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    stage(&mut b, options.seed as u32);
    let paints = paints(&mut b);
    let chance = Chance::new(options.seed, 0x626f_6469);
    let things = things(&chance, &paints);
    let left = options.triangles.map_or(USUAL, |t| t.saturating_sub(b.instanced_triangles()));
    let (assembly, local, counts) = meshed(&things, left);
    let mesh = b.mesh("bodies", assembly);
    b.place(mesh, Affine3::IDENTITY);
    b.desc.motion = Some(Arc::new(Swarm { mesh, flight: Flight::new(things), local, counts }));
    b.desc
}

/// One body at the first moment.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Thing {
    kind: Kind,
    material: u32,
    /// Half its width, metres.
    size: f32,
    place: Place,
    velocity: Vec3,
    spin: Vec3,
}

/// Two swarms on their way to meet above the bowl, sorted by material.
fn things(chance: &Chance, paints: &[u32]) -> Vec<Thing> {
    let mut things = Vec::new();
    // No rows are seen from the front.
    let askew = Turn::about(Vec3::new(0.48, 0.6, 0.64), 0.9);
    for (side, swarm) in [(-1.0, 0), (1.0, 1)] {
        for (i, cell) in (0..).zip(swarm_cells()) {
            let mut chance = chance.part(swarm << 32 | i);
            let mirror = Vec3::new(side, 1.0, 1.0);
            let at = mirror * (MIDDLE + askew.apply(cell) * SPACING) + chance.direction() * 0.012;
            let turn = Turn::about(chance.direction(), chance.range(0.0, TAU));
            things.push(Thing {
                kind: Kind::ALL[chance.below(4) as usize],
                material: paints[chance.below(paints.len() as u32) as usize],
                size: chance.range(0.09, 0.128),
                place: Place { turn, at },
                velocity: Vec3::new(-side * chance.range(2.9, 3.3), chance.range(1.0, 1.5), 0.0),
                spin: chance.direction() * chance.range(0.0, 5.0),
            });
        }
    }
    things.sort_by_key(|thing| thing.material);
    things
}

/// Points of a staggered lattice, one apart along each axis at least, nearest to the middle.
fn swarm_cells() -> Vec<Vec3> {
    let mut cells: Vec<Vec3> = (0..9 * 9 * 9)
        .map(|i| {
            let [x, y, z] = [i % 9 - 4, i / 9 % 9 - 4, i / 81 - 4].map(|c| c as f32);
            let shift = if (i / 9 % 9 + i / 81) % 2 == 0 { 0.25 } else { -0.25 };
            Vec3::new(x + shift, y, z)
        })
        .collect();
    cells.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    cells.truncate(SWARM);
    cells
}

/// One mesh of all things where they are, of so many triangles; vertices around their things' middles, and how many each has.
fn meshed(things: &[Thing], triangles: u64) -> (Assembly, Shape, Vec<usize>) {
    let (mut assembly, mut local, mut counts) = (Assembly::default(), Shape::default(), Vec::new());
    for (i, thing) in things.iter().enumerate() {
        let left = triangles.saturating_sub(assembly.triangles() as u64);
        let mut shape = thing.kind.surface(left / (things.len() - i) as u64);
        shape.positions.iter_mut().for_each(|p| *p *= thing.size);
        counts.push(shape.positions.len());
        local.positions.extend(&shape.positions);
        local.normals.extend(&shape.normals);
        shape.positions.iter_mut().for_each(|p| *p = thing.place.point(*p));
        shape.normals.iter_mut().for_each(|n| *n = thing.place.turn.apply(*n));
        assembly.add(thing.material, &shape);
    }
    (assembly, local, counts)
}

/// All bodies on their way.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Swarm {
    mesh: u32,
    flight: Flight,
    /// Vertices of all bodies around their own middles, and how many each has.
    local: Shape,
    counts: Vec<usize>,
}

impl Motion for Swarm {
    fn duration(&self) -> f32 {
        DURATION
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let (mut positions, mut normals) = (self.local.positions.clone(), self.local.normals.clone());
        let bodies = self.counts.iter().zip(self.flight.at(time));
        carry(bodies.map(|(&count, place)| (count, Vec3::ZERO, place)), &mut positions, &mut normals);
        let mesh = MeshPose { mesh: self.mesh, positions, normals, ..MeshPose::default() };
        Ok(Pose { meshes: vec![mesh], ..Pose::default() })
    }

    fn record(&self) -> Option<MotionRecord> {
        MotionRecord::new(Self::KIND, self)
    }
}

impl Recorded for Swarm {
    const KIND: &'static str = "demo:bodies";

    fn is_sound(&self, _desc: &SceneDesc) -> bool {
        let Self { flight, local, counts, .. } = self;
        let vertices = counts.iter().fold(0_usize, |sum, count| sum.saturating_add(*count));
        let near = |thing: &Thing| are_near(&[thing.place.at, thing.velocity, thing.spin]);
        vertices == local.positions.len()
            && vertices == local.normals.len()
            && flight.things.len() <= 2 * SWARM
            && flight.things.iter().all(near)
    }
}

/// Lacquers, rubber, gold and chrome.
fn paints(b: &mut Builder) -> Vec<u32> {
    let mut paints: Vec<u32> = [0xc8321f, 0xe9a21b, 0x1d6f8c, 0xf0ece2, 0x2f8f5b]
        .iter()
        .map(|&hex| b.material(lacquer("lacquer", srgb(hex), 0.35)))
        .collect();
    paints.push(b.material(gold("gold", 0.14)));
    paints.push(b.material(Material::metal("chrome", Vec3::new(0.72, 0.73, 0.74), 0.06)));
    paints.push(b.material(stone("rubber", srgb(0x2b2d33), 0.7)));
    paints
}

/// A floor of slabs, the bowl, a wall, and a large lamp above with two smaller ones.
fn stage(b: &mut Builder, seed: u32) {
    let slabs = textures::slabs("slabs", 512, srgb(0xb9b2a6), srgb(0x5c5852), 4, 4, seed);
    let slabs = b.texture(slabs, Encoding::Srgb, Vec2::splat(4.0));
    let floor = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(slabs) },
        ..stone("floor", Vec3::ONE, 0.4)
    });
    b.object("floor", floor, &solids::floor(24.0, 24.0));
    let wall = b.material(stone("wall", srgb(0x6f7f7a), 0.9));
    let mut shape = Shape::default();
    let corner = |x: f32, y: f32| Vec3::new(x, y, -6.0);
    shape.flat_quad([corner(-12.0, 0.0), corner(12.0, 0.0), corner(12.0, 8.0), corner(-12.0, 8.0)]);
    b.object("wall", wall, &shape);
    let china = b.material(Material {
        roughness: crate::ScalarInput::new(0.25),
        ..lacquer("china", srgb(0xdfe5e6), 0.3)
    });
    b.object("bowl", china, &BOWL.surface(96));
    let lamps = [
        ("lamp above", Vec3::new(1.0, 0.97, 0.92) * 30.0, Vec3::new(-1.6, 5.6, 1.4), 2.0),
        ("warm lamp", Vec3::new(1.0, 0.72, 0.45) * 26.0, Vec3::new(4.6, 4.6, -3.4), 1.6),
        ("cool lamp", Vec3::new(0.55, 0.75, 1.0) * 14.0, Vec3::new(-4.6, 2.4, 3.4), 1.2),
    ];
    square_lamps(b, Vec3::new(0.0, 1.0, 0.0), &lamps);
    b.desc.environment = Some(Environment::Constant(Vec3::new(0.17, 0.18, 0.2)));
    let (eye, target) = (Vec3::new(0.9, 4.0, 5.6), Vec3::new(0.0, 1.55, 0.0));
    let fov = 40_f32.to_radians();
    let projection = Projection::Perspective {
        vertical_fov: fov,
        lens_radius: 0.01,
        focus_distance: (target - eye).length() - 0.4,
    };
    b.desc.cameras.push(Camera { projection, ..Camera::look_at("above the bowl", eye, target, fov) });
}
