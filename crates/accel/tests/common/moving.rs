//! Meshes that move: triangles stay, positions change from frame to frame.
#![allow(dead_code, reason = "each file uses a part")]

use crate::common::{noise, point};
use vastlight_accel::wide::MeshView;
use vastlight_math::Vec3;
use vastlight_math::glam::Quat;

/// Where a vertex is in a frame, from its place at rest and the number of its part.
type Motion = Box<dyn Fn(f32, Vec3, usize) -> Vec3 + Sync>;

/// A moving mesh.
pub(crate) struct Moving {
    pub(crate) name: &'static str,
    pub(crate) triangles: Vec<[u32; 3]>,
    rest: Vec<Vec3>,
    /// Which part a vertex belongs to.
    parts: Vec<usize>,
    motion: Motion,
    /// As they are now.
    pub(crate) positions: Vec<Vec3>,
}

impl Moving {
    /// Without triangles yet.
    pub(crate) fn new(
        name: &'static str,
        motion: impl Fn(f32, Vec3, usize) -> Vec3 + Sync + 'static,
    ) -> Self {
        let (triangles, rest, parts, positions) = Default::default();
        Self { name, triangles, rest, parts, motion: Box::new(motion), positions }
    }

    /// Positions in a frame.
    pub(crate) fn at(&self, frame: f32) -> Vec<Vec3> {
        let place = |(&rest, &part): (&Vec3, &usize)| (self.motion)(frame, rest, part);
        self.rest.iter().zip(&self.parts).map(place).collect()
    }

    /// Goes to a frame.
    pub(crate) fn go_to(&mut self, frame: f32) {
        self.positions = self.at(frame);
    }

    pub(crate) fn view(&self) -> MeshView<'_> {
        MeshView { positions: &self.positions, triangles: &self.triangles }
    }

    /// Adds a grid of `columns` x `rows` cells of two triangles.
    pub(crate) fn add_grid(
        &mut self,
        [columns, rows]: [usize; 2],
        part: usize,
        place: impl Fn(f32, f32) -> Vec3,
    ) {
        let first = self.rest.len() as u32;
        for j in 0..=rows {
            for i in 0..=columns {
                self.rest.push(place(i as f32 / columns as f32, j as f32 / rows as f32));
                self.parts.push(part);
            }
        }
        let stride = columns as u32 + 1;
        for cell in 0..(columns * rows) as u32 {
            let a = first + cell / columns as u32 * stride + cell % columns as u32;
            self.triangles.push([a, a + 1, a + stride]);
            self.triangles.push([a + 1, a + stride + 1, a + stride]);
        }
    }

    /// Adds a bumpy ball.
    fn add_ball(&mut self, cells: [usize; 2], part: usize, radius: f32) {
        self.add_grid(cells, part, |u, v| {
            let (theta, phi) = (v * std::f32::consts::PI, u * std::f32::consts::TAU);
            on_sphere(u, v) * radius * (1.0 + 0.15 * (5.0 * theta).sin() * (3.0 * phi + part as f32).cos())
        });
    }
}

/// A point of a sphere, by its place from 0 to 1 around it and down; columns meet where they end.
pub(crate) fn on_sphere(u: f32, v: f32) -> Vec3 {
    let (su, cu) = (u * std::f32::consts::TAU).sin_cos();
    let (sv, cv) = (v * std::f32::consts::PI).sin_cos();
    Vec3::new(sv * cu, cv, sv * su)
}

/// From 0 to 1 and back, over and over.
fn bounce(x: f32) -> f32 {
    let x = x.rem_euclid(2.0);
    if x > 1.0 { 2.0 - x } else { x }
}

/// Turning bodies that fly through a box and each other, by up to a hundredth of its side a frame: `count` of them with
/// `cells` x `cells` x 4 triangles. At first all are in a heap.
pub(crate) fn bodies(count: usize, cells: usize) -> Moving {
    let mut moving = Moving::new("bodies", |frame, rest, part| {
        let velocity = point(part, 1) * 0.01;
        let start = point(part, 4) * 0.15 + 0.5;
        let way = start + velocity * frame;
        let place = Vec3::new(bounce(way.x), bounce(way.y), bounce(way.z)) * 10.0;
        let axis = (point(part, 7) + Vec3::splat(1e-3)).normalize();
        Quat::from_axis_angle(axis, 0.05 * frame * noise(part, 11)) * rest + place
    });
    (0..count).for_each(|part| moving.add_ball([2 * cells, cells], part, 0.3 + 0.5 * noise(part, 12)));
    moving.go_to(0.0);
    moving
}

/// A ball of `cells` x `cells` x 4 triangles that breaks into `shards` after frame 10.
pub(crate) fn explosion(cells: usize, shards: usize) -> Moving {
    let mut moving = Moving::new("explosion", |frame, rest, part| {
        let time = (frame - 10.0).max(0.0);
        let seed = seed_of(part);
        let slowed = 30.0 * (1.0 - (-time / 30.0).exp());
        let away = (seed * (0.05 + 0.1 * noise(part, 21)) + point(part, 22) * 0.05) * slowed;
        let axis = (point(part, 25) + Vec3::splat(1e-3)).normalize();
        let turn = Quat::from_axis_angle(axis, 0.1 * time * noise(part, 28));
        seed + turn * (rest - seed) + away - Vec3::Y * 0.0004 * time * time
    });
    moving.add_ball([2 * cells, cells], 0, 1.0);
    let nearest = |p: Vec3| {
        let distance = |part: &usize| (seed_of(*part) - p).length_squared();
        (0..shards).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    };
    // Each triangle goes with the shard of its middle, so shards share no vertices.
    let triangles = std::mem::take(&mut moving.triangles);
    let rest = std::mem::take(&mut moving.rest);
    moving.parts.clear();
    let mut numbers = std::collections::BTreeMap::new();
    for triangle in triangles {
        let part = nearest(triangle.iter().map(|&i| rest[i as usize]).sum::<Vec3>() / 3.0);
        let corner = |i: u32| {
            *numbers.entry((part, i)).or_insert_with(|| {
                moving.rest.push(rest[i as usize]);
                moving.parts.push(part);
                moving.rest.len() as u32 - 1
            })
        };
        moving.triangles.push(triangle.map(corner));
    }
    moving.go_to(0.0);
    moving
}

/// Where a shard's middle is at rest.
fn seed_of(part: usize) -> Vec3 {
    (point(part, 30) + Vec3::splat(1e-4)).normalize()
}

/// A sheet of `cells` x `cells` x 2 triangles with waves that run over it.
pub(crate) fn waves(cells: usize) -> Moving {
    let mut moving = Moving::new("waves", |frame, rest, _| {
        let x = 9.0 * rest.x + 0.15 * frame;
        let z = 7.0 * rest.z - 0.1 * frame;
        let way = Vec3::new(0.06 * (2.0 * x).sin(), 0.15 * (x.sin() + z.cos()), 0.05 * (1.5 * z).sin());
        rest + way * (0.02 * frame).min(1.0)
    });
    moving.add_grid([cells, cells], 0, |u, v| Vec3::new(u, 0.0, v) * 2.0 - 1.0);
    moving.go_to(0.0);
    moving
}

/// A tower of boards, `cells` x `cells` x 2 triangles each, that is twisted to and fro.
pub(crate) fn twist(boards: usize, cells: usize) -> Moving {
    let mut moving = Moving::new("twist", |frame, rest, _| {
        let angle = (0.05 * frame).sin() * 3.0 * rest.y;
        Quat::from_rotation_y(angle) * rest
    });
    for part in 0..boards {
        let x = part as f32 / boards as f32 - 0.5;
        moving.add_grid([cells, cells], part, |u, v| Vec3::new(x, 2.0 * v - 1.0, u - 0.5));
    }
    moving.go_to(0.0);
    moving
}

/// Triangles that all fly on their own.
pub(crate) fn dust(count: usize) -> Moving {
    let mut moving = Moving::new("dust", |frame, rest, part| {
        let way = point(part, 50) * 0.5 + 0.5 + point(part, 53) * (0.004 * frame);
        rest + Vec3::new(bounce(way.x), bounce(way.y), bounce(way.z))
    });
    for part in 0..count {
        let first = moving.rest.len() as u32;
        moving.rest.extend([40, 43, 46].map(|salt| point(part, salt) * 0.01));
        moving.parts.extend([part; 3]);
        moving.triangles.push([first, first + 1, first + 2]);
    }
    moving.go_to(0.0);
    moving
}
