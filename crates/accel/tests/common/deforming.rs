//! Meshes that deform, or fly apart, from time 0 to 1.

use crate::moving::{Moving, on_sphere};
use vastlight_math::Vec3;
use vastlight_math::rng::hash_to_unit;

/// A mesh of about so many triangles; `statue` for names that are not known.
pub(crate) fn by_name(name: &str, triangles: usize) -> Moving {
    match name {
        "cloth" => cloth(triangles),
        "bodies" => bodies(triangles),
        _ => statue(triangles),
    }
}

/// A bumpy ball that is twisted.
fn statue(triangles: usize) -> Moving {
    let rows = ((triangles as f32 / 4.0).sqrt() as usize).max(2);
    let bumps = |p: Vec3| {
        let coarse = (9.0 * p.x).sin() * (11.0 * p.y + 1.0).sin() * (8.0 * p.z).cos();
        p * (1.0 + 0.15 * coarse + 0.015 * (70.0 * p.x).sin() * (63.0 * p.y).cos() * (58.0 * p.z).sin())
    };
    let mut moving = Moving::new("statue", |time, p, _| {
        let (s, c) = (1.5 * time * p.y).sin_cos();
        Vec3::new(c * p.x - s * p.z, p.y * (1.0 + 0.3 * time), s * p.x + c * p.z)
    });
    moving.add_grid([2 * rows, rows], 0, |u, v| bumps(on_sphere(u, v)));
    moving
}

/// A cloth that falls into folds.
fn cloth(triangles: usize) -> Moving {
    let side = ((triangles as f32 / 2.0).sqrt() as usize).max(1);
    let mut moving = Moving::new("cloth", |time, p, _| {
        let height =
            (9.0 * p.x + 3.0 * time).sin() * (7.0 * p.z).cos() + 0.3 * (31.0 * p.x * p.z + 5.0 * time).sin();
        let edge = p.x.abs().max(p.z.abs());
        Vec3::new(p.x * (1.0 - 0.3 * time * p.z * p.z), 0.2 * time * height - 0.8 * time * edge * edge, p.z)
    });
    moving.add_grid([side; 2], 0, |u, v| Vec3::new(u * 2.0 - 1.0, 0.0, v * 2.0 - 1.0));
    moving
}

/// Balls that fly apart and turn.
fn bodies(triangles: usize) -> Moving {
    const CELLS: [usize; 2] = [24, 12];
    let count = (triangles / (2 * CELLS[0] * CELLS[1])).max(1);
    let radius = 0.5 / (count as f32).cbrt();
    let mut moving = Moving::new("bodies", move |time, p, body| {
        let unit =
            |k: u32| Vec3::from([0, 1, 2].map(|axis| hash_to_unit(&[body as u32, k, axis]) * 2.0 - 1.0));
        let (s, c) = (3.0 * time * hash_to_unit(&[body as u32])).sin_cos();
        let turned = Vec3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
        unit(1) + time * unit(2) + turned * radius
    });
    (0..count).for_each(|body| moving.add_grid(CELLS, body, on_sphere));
    moving
}
