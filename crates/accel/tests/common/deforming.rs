//! Meshes that move: their triangles stay, their positions depend on time.

use vastlight_math::Vec3;
use vastlight_math::rng::hash_to_unit;

/// A mesh that moves, from time 0 to 1.
pub(crate) struct Moving {
    pub(crate) triangles: Vec<[u32; 3]>,
    rest: Vec<Vec3>,
    motion: Box<dyn Fn(f32, usize, Vec3) -> Vec3 + Sync>,
}

impl Moving {
    /// Positions at a time.
    pub(crate) fn at(&self, time: f32) -> Vec<Vec3> {
        self.rest.iter().enumerate().map(|(i, &p)| (self.motion)(time, i, p)).collect()
    }
}

/// A mesh of about so many triangles; `statue` for names that are not known.
pub(crate) fn by_name(name: &str, triangles: usize) -> Moving {
    match name {
        "cloth" => cloth(triangles),
        "bodies" => bodies(triangles),
        _ => statue(triangles),
    }
}

/// A grid of `[columns, rows]` cells of two triangles; the vertex of column `i` in row `j` is number `j * (columns + 1) + i`.
fn grid([columns, rows]: [usize; 2], first: u32, triangles: &mut Vec<[u32; 3]>) {
    for j in 0..rows as u32 {
        for i in 0..columns as u32 {
            let a = first + j * (columns as u32 + 1) + i;
            let b = a + columns as u32 + 1;
            triangles.extend([[a, a + 1, b], [a + 1, b + 1, b]]);
        }
    }
}

/// Points of a sphere, by column and row; they meet where its columns do.
fn sphere([columns, rows]: [usize; 2]) -> impl Iterator<Item = Vec3> {
    (0..=rows).flat_map(move |j| {
        (0..=columns).map(move |i| {
            let (u, v) = (i as f32 / columns as f32, j as f32 / rows as f32);
            let (su, cu) = (u * std::f32::consts::TAU).sin_cos();
            let (sv, cv) = (v * std::f32::consts::PI).sin_cos();
            Vec3::new(sv * cu, cv, sv * su)
        })
    })
}

/// A bumpy ball that is twisted.
fn statue(triangles: usize) -> Moving {
    let rows = ((triangles as f32 / 4.0).sqrt() as usize).max(2);
    let mut own = Vec::new();
    grid([2 * rows, rows], 0, &mut own);
    let bumps = |p: Vec3| {
        let coarse = (9.0 * p.x).sin() * (11.0 * p.y + 1.0).sin() * (8.0 * p.z).cos();
        p * (1.0 + 0.15 * coarse + 0.015 * (70.0 * p.x).sin() * (63.0 * p.y).cos() * (58.0 * p.z).sin())
    };
    let rest = sphere([2 * rows, rows]).map(bumps).collect();
    let twist = |time: f32, _: usize, p: Vec3| {
        let (s, c) = (1.5 * time * p.y).sin_cos();
        Vec3::new(c * p.x - s * p.z, p.y * (1.0 + 0.3 * time), s * p.x + c * p.z)
    };
    Moving { triangles: own, rest, motion: Box::new(twist) }
}

/// A cloth that falls into folds.
fn cloth(triangles: usize) -> Moving {
    let side = ((triangles as f32 / 2.0).sqrt() as usize).max(1);
    let mut own = Vec::new();
    grid([side; 2], 0, &mut own);
    let at = |i: usize| (i % (side + 1)) as f32 / side as f32 * 2.0 - 1.0;
    let rest = (0..(side + 1) * (side + 1)).map(|i| Vec3::new(at(i), 0.0, at(i / (side + 1)))).collect();
    let fold = |time: f32, _: usize, p: Vec3| {
        let height =
            (9.0 * p.x + 3.0 * time).sin() * (7.0 * p.z).cos() + 0.3 * (31.0 * p.x * p.z + 5.0 * time).sin();
        let edge = p.x.abs().max(p.z.abs());
        Vec3::new(p.x * (1.0 - 0.3 * time * p.z * p.z), 0.2 * time * height - 0.8 * time * edge * edge, p.z)
    };
    Moving { triangles: own, rest, motion: Box::new(fold) }
}

/// Balls that fly apart and turn.
fn bodies(triangles: usize) -> Moving {
    const CELLS: [usize; 2] = [24, 12];
    let vertices = (CELLS[0] + 1) * (CELLS[1] + 1);
    let count = (triangles / (2 * CELLS[0] * CELLS[1])).max(1);
    let unit = |body: usize, k: u32| {
        Vec3::from([0, 1, 2].map(|axis| hash_to_unit(&[body as u32, k, axis]) * 2.0 - 1.0))
    };
    let (mut own, mut rest) = (Vec::new(), Vec::new());
    for _ in 0..count {
        grid(CELLS, rest.len() as u32, &mut own);
        rest.extend(sphere(CELLS));
    }
    let radius = 0.5 / (count as f32).cbrt();
    let fly = move |time: f32, i: usize, p: Vec3| {
        let body = i / vertices;
        let (s, c) = (3.0 * time * hash_to_unit(&[body as u32])).sin_cos();
        let turned = Vec3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
        unit(body, 1) + time * unit(body, 2) + turned * radius
    };
    Moving { triangles: own, rest, motion: Box::new(fly) }
}
