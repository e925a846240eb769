//! A figure that walks along a wall, the camera beside it. A function of time.
//!
//! One skin over a skeleton of 21 bones, moved by blended dual quaternions (Kavan et al., "Geometric skinning with
//! approximate dual quaternion blending", 2008).

mod flesh;
mod gait;
mod skeleton;
#[cfg(test)]
mod tests;

use super::chance::Chance;
use super::noise::smoothstep;
use super::palette::{lacquer, srgb, stone};
use super::record::Recorded;
use super::rigid::{Place, Turn};
use super::shape::{Assembly, Shape};
use super::{GenerateOptions, builder::Builder, solids, textures};
use crate::{
    Camera, ColorInput, Encoding, Environment, Material, Mesh, MeshPose, Motion, MotionRecord, Part, Pose,
    SceneDesc, SceneError, Sky,
};
use flesh::{Form, Weights};
use gait::Gait;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use skeleton::{BONES, bones};
use std::sync::Arc;
use vastlight_math::{Affine3, Vec2, Vec3};

/// Seconds.
const DURATION: f32 = 4.0;

/// The scene.
pub(super) fn walker(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    street(&mut b, options.seed as u32);
    let mut chance = Chance::new(options.seed, 0x7761_6c6b);
    let skin = Form::new(chance.range(-0.003, 0.004)).skin();
    let all = bones();
    let weights: Vec<Weights> = skin.positions.par_iter().map(|&p| flesh::weights(&all, p)).collect();
    let paint = b.material(Material { name: "figure".into(), ..lacquer("figure", Vec3::ONE, 0.4) });
    let gait = Gait::new(chance.range(1.08, 1.2), chance.range(0.34, 0.46), chance.range(0.045, 0.06));
    let walk = Walk {
        mesh: b.desc.meshes.len() as u32,
        gait,
        positions: skin.positions.clone(),
        normals: skin.normals.clone(),
        weights,
    };
    b.desc.meshes.push(Mesh {
        name: "figure".into(),
        colors: walk.weights.iter().map(|w| tint(w).extend(1.0)).collect(),
        positions: skin.positions,
        normals: skin.normals,
        triangles: skin.triangles,
        parts: vec![Part { first_triangle: 0, material: paint }],
        ..Mesh::default()
    });
    b.place(walk.mesh, Affine3::IDENTITY);
    b.desc.cameras.push(walk.camera(0.0));
    b.desc.motion = Some(Arc::new(walk));
    b.desc
}

/// Limbs are light, joints between them dark.
fn tint(weights: &Weights) -> Vec3 {
    let largest = weights.iter().map(|w| w.1).fold(0.0, f32::max);
    let joint = smoothstep(0.66, 0.56, largest);
    srgb(0xe8dcc8).lerp(srgb(0xb0552e), joint)
}

/// The figure on its way.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Walk {
    mesh: u32,
    gait: Gait,
    /// The skin at rest.
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    weights: Vec<Weights>,
}

impl Walk {
    fn camera(&self, time: f32) -> Camera {
        let z = self.gait.stride * time;
        let (eye, target) = (Vec3::new(3.4, 1.4, z + 2.3), Vec3::new(0.0, 0.9, z + 0.05));
        Camera::look_at("beside", eye, target, 30_f32.to_radians())
    }
}

impl Motion for Walk {
    fn duration(&self) -> f32 {
        DURATION
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let time = time.clamp(0.0, DURATION);
        let moved: Vec<Dual> = self.gait.at(time).iter().map(Dual::new).collect();
        let vertices = self.positions.par_iter().zip(&self.normals).zip(&self.weights);
        let (positions, normals) = vertices
            .map(|((&p, &n), weights)| {
                let place = blended(&moved, weights);
                (place.point(p), place.turn.apply(n))
            })
            .unzip();
        let mesh = MeshPose { mesh: self.mesh, positions, normals, ..MeshPose::default() };
        Ok(Pose { meshes: vec![mesh], cameras: vec![(0, self.camera(time))], ..Pose::default() })
    }

    fn record(&self) -> Option<MotionRecord> {
        MotionRecord::new(Self::KIND, self)
    }
}

impl Recorded for Walk {
    const KIND: &'static str = "demo:walker";

    fn is_sound(&self, _desc: &SceneDesc) -> bool {
        self.weights.iter().flatten().all(|&(bone, _)| usize::from(bone) < BONES)
    }
}

/// A turn and a move as a unit dual quaternion.
#[derive(Clone, Copy, Debug)]
struct Dual {
    real: Turn,
    dual: Turn,
}

impl Dual {
    fn new(place: &Place) -> Self {
        let moved = Turn { w: 0.0, v: place.at * 0.5 };
        Self { real: place.turn, dual: moved * place.turn }
    }
}

/// The weighted mean of some bones' places.
fn blended(bones: &[Dual], weights: &Weights) -> Place {
    let first = bones[weights[0].0 as usize].real;
    let mut real = Turn { w: 0.0, v: Vec3::ZERO };
    let mut dual = real;
    for &(bone, weight) in weights {
        let bone = &bones[bone as usize];
        let weight = if first.dot(bone.real) < 0.0 { -weight } else { weight };
        (real.w, real.v) = (real.w + bone.real.w * weight, real.v + bone.real.v * weight);
        (dual.w, dual.v) = (dual.w + bone.dual.w * weight, dual.v + bone.dual.v * weight);
    }
    let scale = real.dot(real).sqrt().max(1e-6).recip();
    let (real, dual) =
        (Turn { w: real.w * scale, v: real.v * scale }, Turn { w: dual.w * scale, v: dual.v * scale });
    let at = (dual.v * real.w - real.v * dual.w + real.v.cross(dual.v)) * 2.0;
    Place { turn: real, at }
}

/// Slabs, a wall with pilasters behind, a low sun.
fn street(b: &mut Builder, seed: u32) {
    let slabs = textures::slabs("slabs", 1024, srgb(0xb7aea0), srgb(0x5f5a54), 4, 4, seed);
    let slabs = b.texture(slabs, Encoding::Srgb, Vec2::splat(2.8));
    let pavement = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(slabs) },
        ..stone("pavement", Vec3::ONE, 0.6)
    });
    b.object("pavement", pavement, &solids::floor(60.0, 60.0));
    let plaster =
        textures::paint("plaster", 512, move |uv| textures::mottled(uv, srgb(0x5f7f86), 0.3, seed ^ 5));
    let plaster = b.texture(plaster, Encoding::Srgb, Vec2::splat(3.3));
    let plaster = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(plaster) },
        ..stone("plaster", Vec3::ONE, 0.9)
    });
    let x = -2.2;
    let mut wall = Shape::default();
    let corner = |y: f32, z: f32| Vec3::new(x, y, z);
    wall.flat_quad([corner(0.0, 30.0), corner(0.0, -30.0), corner(5.0, -30.0), corner(5.0, 30.0)]);
    b.object("wall", plaster, &wall);
    let trim = b.material(stone("limestone", srgb(0xd8cfbd), 0.7));
    let mut trims = Assembly::default();
    for i in -12..=14 {
        let z = 1.6 * i as f32;
        trims.add(
            trim,
            &solids::block(Vec3::new(x - 0.1, 0.0, z - 0.16), Vec3::new(x + 0.14, 5.0, z + 0.16), 0.015),
        );
        trims.add(
            trim,
            &solids::block(Vec3::new(x - 0.1, 0.0, z - 0.22), Vec3::new(x + 0.2, 0.35, z + 0.22), 0.015),
        );
    }
    trims.add(trim, &solids::block(Vec3::new(x - 0.1, 0.0, -30.0), Vec3::new(x + 0.06, 0.25, 30.0), 0.01));
    b.assembled("pilasters", trims);
    b.desc.environment = Some(Environment::Sky(Sky {
        sun_azimuth: 2.3,
        sun_elevation: 0.62,
        turbidity: 3.0,
        ground_albedo: Vec3::splat(0.25),
        strength: 1.05,
        sun_disc: true,
    }));
}
