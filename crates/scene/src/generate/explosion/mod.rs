//! A clay head on a plinth that bursts: shards fly off, fall, bounce and come to rest. A function of time.
//!
//! The statue's form as a shell, cut into shards that deform one mesh: each flies by itself as a rigid body.

mod flight;
mod shards;
#[cfg(test)]
mod tests;

use super::caustic_sphere::square_lamps;
use super::chance::Chance;
use super::palette::{lacquer, srgb, stone};
use super::record::{Recorded, are_near};
use super::rigid::{Keys, between_keys, carry};
use super::shape::{Assembly, Shape, turn};
use super::{GenerateOptions, builder::Builder, solids, statue, textures};
use crate::{
    Camera, ColorInput, Encoding, Environment, Material, Mesh, MeshPose, Motion, MotionRecord, Pose,
    SceneDesc, SceneError,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shards::{Grid, Pattern, Shard};
use std::sync::{Arc, OnceLock};
use vastlight_math::{Affine3, Vec2, Vec3};

/// Seconds, and the moment of the burst.
const DURATION: f32 = 4.0;
const BURST: f32 = 0.25;
/// Half the plinth's width and depth, and its height.
const PLINTH: Vec3 = Vec3::new(0.56, 0.5, 0.56);
/// The head is so much larger than the statue's.
const SCALE: f32 = 2.2;
/// Where the wall behind stands, along z.
const WALL: f32 = -5.5;
/// Triangles of a head from which the length of all borders is foreseen.
const SAMPLE: u64 = 60_000;

/// The scene.
pub(super) fn explosion(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let glaze = b.material(lacquer("glaze", srgb(0xf1ece1), 0.3));
    let clay = b.material(stone("fired clay", srgb(0xb5613a), 0.85));
    let seed = options.seed as u32;
    stage(&mut b, seed);
    let left = options.triangles.unwrap_or(200_000).saturating_sub(b.instanced_triangles());
    let (mut mesh, shards) = shell(left, seed, [glaze, clay]);
    let stand = Affine3::from_translation(Vec3::Y * PLINTH.y) * turn(0.42);
    let place = stand * Affine3::from_scale(Vec3::splat(SCALE));
    let shards = put(&mut mesh, shards, &place);
    let burst = Burst {
        mesh: b.desc.meshes.len() as u32,
        positions: mesh.positions.clone(),
        normals: mesh.normals.clone(),
        shards,
        chance: Chance::new(options.seed, 0x6275_7273),
        keys: OnceLock::new(),
    };
    b.desc.meshes.push(mesh);
    b.place(burst.mesh, Affine3::IDENTITY);
    b.desc.motion = Some(Arc::new(burst));
    b.desc
}

/// The shell in shards, of about so many triangles.
fn shell(triangles: u64, seed: u32, materials: [u32; 2]) -> (Mesh, Vec<Shard>) {
    let made = |outer: u64| {
        let (rows, columns) = statue::rows_and_columns(outer);
        let grid = Grid { rings: rows as usize - 1, columns: columns as usize };
        let mesh = statue::head(outer, materials[0], seed);
        let pattern = Pattern::new(&mesh, grid, seed);
        (mesh, grid, pattern)
    };
    let (_, grid, pattern) = made(outer_triangles(triangles, 2.0).min(SAMPLE));
    let border = pattern.border_sides(grid) as f64 / (grid.triangles() as f64).sqrt();
    let (mesh, grid, pattern) = made(outer_triangles(triangles, border));
    shards::cut(&mesh, grid, &pattern, materials)
}

/// The triangles of a closed surface whose double, with rims of `border` sides for the root of a triangle, has so many
/// triangles: t = 2 o + 2 border sqrt(o).
fn outer_triangles(triangles: u64, border: f64) -> u64 {
    let root = 0.5 * ((border * border + 2.0 * triangles as f64).sqrt() - border);
    (root * root).round() as u64
}

/// Moves the cut mesh to its place in the world.
fn put(mesh: &mut Mesh, shards: Vec<Shard>, place: &Affine3) -> Vec<Shard> {
    mesh.positions.par_iter_mut().for_each(|p| *p = place.transform_point3(*p));
    mesh.normals.par_iter_mut().for_each(|n| *n = place.transform_vector3(*n).normalize_or(Vec3::Y));
    shards.into_iter().map(|s| Shard { center: place.transform_point3(s.center), ..s }).collect()
}

/// Shards on their way.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Burst {
    mesh: u32,
    /// The mesh at rest.
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    shards: Vec<Shard>,
    chance: Chance,
    /// Places of all shards from the burst on, found when they are needed first.
    #[serde(skip)]
    keys: OnceLock<Keys>,
}

impl Burst {
    /// Found outside of the lock: who waits for the shards' flights may take up another pose meanwhile.
    fn keys(&self) -> &Keys {
        if let Some(keys) = self.keys.get() {
            return keys;
        }
        let found = flight::keys(&self.shards, &self.positions, &self.chance);
        self.keys.get_or_init(|| found)
    }
}

impl Motion for Burst {
    fn duration(&self) -> f32 {
        DURATION
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let (mut positions, mut normals) = (self.positions.clone(), self.normals.clone());
        if time > BURST {
            let places = between_keys(self.keys(), time - BURST);
            let shards = self.shards.iter().zip(places);
            let shards = shards.map(|(shard, place)| (shard.vertices.len(), shard.center, place));
            carry(shards, &mut positions, &mut normals);
        }
        let mesh = MeshPose { mesh: self.mesh, positions, normals, ..MeshPose::default() };
        Ok(Pose { meshes: vec![mesh], ..Pose::default() })
    }

    fn record(&self) -> Option<MotionRecord> {
        MotionRecord::new(Self::KIND, self)
    }
}

impl Recorded for Burst {
    const KIND: &'static str = "demo:explosion";

    fn is_sound(&self, _desc: &SceneDesc) -> bool {
        let Self { positions, normals, shards, .. } = self;
        let inside = |s: &Shard| s.vertices.start < s.vertices.end && s.vertices.end <= positions.len();
        let vertices: usize = shards.iter().filter(|s| inside(s)).map(|s| s.vertices.len()).sum();
        shards.iter().all(|s| inside(s) && are_near(&[s.center]))
            && vertices <= positions.len()
            && normals.len() == positions.len()
            && are_near(positions)
    }
}

/// A studio: floor that runs up into the wall behind, a plinth of dark stone, a large soft lamp, a warm rim, a fill.
fn stage(b: &mut Builder, seed: u32) {
    let dark = statue::dark_marble(b, seed);
    let mut plinth = Assembly::default();
    let size = PLINTH * Vec3::new(2.0, 1.0, 2.0);
    plinth.add(dark, &solids::beveled_box(size, 0.008).at(0.0, 0.5 * PLINTH.y, 0.0));
    b.assembled("plinth", plinth);
    let concrete =
        textures::paint("concrete", 512, |uv| textures::mottled(uv, srgb(0x8f8d89), 0.3, seed ^ 23));
    let concrete = b.texture(concrete, Encoding::Srgb, Vec2::splat(3.1));
    let floor = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(concrete) },
        ..stone("polished concrete", Vec3::ONE, 0.35)
    });
    b.object("floor", floor, &solids::floor(24.0, 24.0));
    let wall = b.material(stone("wall", srgb(0x55707c), 0.9));
    let mut shape = Shape::default();
    let corner = |x: f32, y: f32| Vec3::new(x, y, WALL);
    shape.flat_quad([corner(-12.0, 0.0), corner(12.0, 0.0), corner(12.0, 7.0), corner(-12.0, 7.0)]);
    b.object("wall", wall, &shape);
    let lamps = [
        ("soft box", Vec3::new(1.0, 0.96, 0.9) * 34.0, Vec3::new(-2.9, 4.0, 2.4), 1.6),
        ("rim light", Vec3::new(1.0, 0.76, 0.5) * 46.0, Vec3::new(3.0, 3.2, -2.4), 0.9),
    ];
    square_lamps(b, Vec3::new(0.0, 1.1, 0.0), &lamps);
    b.desc.environment = Some(Environment::Constant(Vec3::new(0.2, 0.22, 0.25)));
    let (eye, target) = (Vec3::new(0.9, 1.55, 4.7), Vec3::new(0.0, 0.98, 0.0));
    b.desc.cameras.push(Camera::look_at("studio", eye, target, 32_f32.to_radians()));
}
