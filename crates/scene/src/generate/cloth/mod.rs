//! A cloth that falls on a ball and drapes over it down to the floor. A function of time.

mod drape;
mod fine;
#[cfg(test)]
mod tests;

use super::caustic_sphere::square_lamps;
use super::chance::Chance;
use super::moments::moment_at;
use super::noise::{noise, smoothstep};
use super::palette::{fabric, srgb, stone};
use super::record::{Recorded, are_near};
use super::shape::Shape;
use super::{GenerateOptions, builder::Builder, solids, textures};
use crate::{
    Camera, ColorInput, Encoding, Environment, Image, Material, MeshPose, Motion, MotionRecord, Pose,
    SceneDesc, SceneError,
};
use drape::{KEYS_A_SECOND, Key, POINTS, SPACING};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};
use vastlight_math::{Vec2, Vec3, real::sin_cos};

/// Seconds.
const DURATION: f32 = 4.0;
/// Edge of the cloth, metres, and the height that it falls from.
const EDGE: f32 = 2.0;
const HEIGHT: f32 = 1.42;
/// Middle and radius of the ball.
const BALL: (Vec3, f32) = (Vec3::new(0.0, 0.45, 0.0), 0.45);

/// The scene.
pub(super) fn cloth(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    stage(&mut b, options.seed as u32);
    let left = options.triangles.unwrap_or(131_072 + b.instanced_triangles());
    let cells = left.saturating_sub(b.instanced_triangles()) / 2;
    let columns = ((cells as f64).sqrt().round() as u64).max(2);
    let [columns, rows] = [columns, ((cells + columns / 2) / columns).max(2)].map(|n| n as usize);
    let silk = silk(&mut b, options.seed as u32);
    let start = start(options.seed);
    let (positions, normals) = fine::surface(&start, columns, rows);
    let mut shape = solids::grid(columns as u32, rows as u32, |_, _| (Vec3::ZERO, Vec3::Y));
    (shape.positions, shape.normals) = (positions, normals);
    shape.uvs.iter_mut().for_each(|uv| *uv *= EDGE);
    b.object("cloth", silk, &shape);
    let mesh = (b.desc.meshes.len() - 1) as u32;
    b.desc.motion = Some(Arc::new(Falling { mesh, columns, rows, start, keys: OnceLock::new() }));
    b.desc
}

/// The cloth before it falls: level, a little uneven, turned by chance.
fn start(seed: u64) -> Key {
    let mut chance = Chance::new(seed, 0x636c_6f74);
    let (sin, cos) = sin_cos(chance.range(0.25, 0.65));
    let shift = Vec3::new(chance.range(-0.06, 0.06), HEIGHT, chance.range(-0.06, 0.06));
    let seed = seed as u32;
    let place = |i: usize| {
        let at = |i: usize| (i as f32 - 0.5 * (POINTS - 1) as f32) * SPACING;
        let (x, z) = (at(i % POINTS), at(i / POINTS));
        let lift = 0.02 * noise(Vec3::new(x * 2.1, 0.5, z * 2.1), seed) - 0.05 * (x * x + z * z);
        Vec3::new(x * cos + z * sin, lift, z * cos - x * sin) + shift
    };
    (0..POINTS * POINTS).map(place).collect()
}

/// The cloth on its way.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Falling {
    mesh: u32,
    columns: usize,
    rows: usize,
    start: Key,
    /// Found when they are needed first.
    #[serde(skip)]
    keys: OnceLock<Vec<Key>>,
}

impl Falling {
    /// All points at a moment: Catmull and Rom's curve through the kept ones.
    fn points(&self, time: f32) -> Key {
        if time <= 0.0 {
            return self.start.clone();
        }
        let keys = self.keys.get_or_init(|| drape::keys(self.start.clone()));
        let last = keys.len() - 1;
        let (key, t) = moment_at(keys.len(), KEYS_A_SECOND, time);
        let [a, b, c, d] =
            [key.saturating_sub(1), key, (key + 1).min(last), (key + 2).min(last)].map(|i| &keys[i]);
        let (t2, t3) = (t * t, t * t * t);
        let weights = [-t3 + 2.0 * t2 - t, 3.0 * t3 - 5.0 * t2 + 2.0, -3.0 * t3 + 4.0 * t2 + t, t3 - t2]
            .map(|w| 0.5 * w);
        (0..self.start.len())
            .map(|i| a[i] * weights[0] + b[i] * weights[1] + c[i] * weights[2] + d[i] * weights[3])
            .collect()
    }
}

impl Motion for Falling {
    fn duration(&self) -> f32 {
        DURATION
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let (positions, normals) = fine::surface(&self.points(time), self.columns, self.rows);
        let mesh = MeshPose { mesh: self.mesh, positions, normals, ..MeshPose::default() };
        Ok(Pose { meshes: vec![mesh], ..Pose::default() })
    }

    fn record(&self) -> Option<MotionRecord> {
        MotionRecord::new(Self::KIND, self)
    }
}

impl Recorded for Falling {
    const KIND: &'static str = "demo:cloth";

    fn is_sound(&self, desc: &SceneDesc) -> bool {
        let Self { columns, rows, start, .. } = self;
        let vertices = desc.meshes.get(self.mesh as usize).map(|mesh| mesh.positions.len());
        let fitting = columns.checked_add(1).and_then(|n| n.checked_mul(rows.checked_add(1)?));
        *columns > 0
            && *rows > 0
            && fitting.is_some()
            && fitting == vertices
            && start.len() == POINTS * POINTS
            && are_near(start)
    }
}

/// Silk with a printed border and diamonds.
fn silk(b: &mut Builder, seed: u32) -> u32 {
    let print = b.texture(print(seed), Encoding::Srgb, Vec2::splat(EDGE));
    b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(print) },
        sheen_color: ColorInput::new(Vec3::splat(0.25)),
        roughness: crate::ScalarInput::new(0.5),
        ..fabric("silk", Vec3::ONE)
    })
}

fn print(seed: u32) -> Image {
    let (ground, line, deep) = (srgb(0xb3262e), srgb(0xe8c878), srgb(0x5f1220));
    textures::paint("silk print", 1024, move |uv| {
        let edge = uv.x.min(1.0 - uv.x).min(uv.y.min(1.0 - uv.y));
        let band = |at: f32, half: f32| smoothstep(half + 0.0015, half, (edge - at).abs());
        let cell = (uv * 14.0) - (uv * 14.0).floor() - 0.5;
        let diamond = cell.x.abs() + cell.y.abs();
        let inner = smoothstep(0.13, 0.14, edge);
        let lattice = smoothstep(0.035, 0.02, (diamond - 0.5).abs()) * inner;
        let dot = smoothstep(0.14, 0.12, diamond) * inner;
        let color = ground.lerp(deep, smoothstep(0.105, 0.1, edge));
        let color = color.lerp(line, (lattice + dot + band(0.115, 0.006) + band(0.03, 0.004)).min(1.0));
        color * (1.0 + 0.06 * noise(Vec3::new(uv.x * 300.0, uv.y * 40.0, 0.5), seed))
    })
}

/// A floor of boards, the ball, a dark wall, a large window-like lamp and a warm one.
fn stage(b: &mut Builder, seed: u32) {
    let oak = textures::planks("floor boards", srgb(0x9a7650), srgb(0x6d4d30), 6, seed ^ 22);
    let oak = b.texture(oak, Encoding::Srgb, Vec2::new(2.4, 0.9));
    let oak = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(oak) },
        ..stone("floor boards", Vec3::ONE, 0.32)
    });
    b.object("floor", oak, &solids::floor(14.0, 14.0));
    let wall = b.material(stone("wall", srgb(0x4c5a5e), 0.9));
    let mut shape = Shape::default();
    let corner = |x: f32, y: f32| Vec3::new(x, y, -3.2);
    shape.flat_quad([corner(-7.0, 0.0), corner(7.0, 0.0), corner(7.0, 5.0), corner(-7.0, 5.0)]);
    b.object("wall", wall, &shape);
    let brass = b.material(Material::metal("brass", Vec3::new(0.85, 0.63, 0.32), 0.18));
    let (center, radius) = BALL;
    b.object("ball", brass, &solids::sphere(radius, 40).at(center.x, center.y, center.z));
    let lamps = [
        ("window", Vec3::new(0.95, 0.98, 1.0) * 34.0, Vec3::new(-3.0, 3.0, 1.4), 1.7),
        ("warm lamp", Vec3::new(1.0, 0.72, 0.45) * 24.0, Vec3::new(2.8, 2.6, -1.8), 0.8),
    ];
    square_lamps(b, Vec3::new(0.0, 0.5, 0.0), &lamps);
    b.desc.environment = Some(Environment::Constant(Vec3::new(0.16, 0.17, 0.19)));
    let (eye, target) = (Vec3::new(0.9, 1.9, 4.1), Vec3::new(0.0, 0.68, 0.0));
    b.desc.cameras.push(Camera::look_at("room", eye, target, 29_f32.to_radians()));
}
