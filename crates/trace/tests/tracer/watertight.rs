//! No ray gets through a closed mesh.
//!
//! A million rays in a test run; ten million with `VASTLIGHT_SOAK` in the environment.

use crate::common::shapes::closed_surface;
use crate::common::{Random, closest, scene, tracer};
use vastlight_math::glam::Quat;
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::{Mesh, Scene};
use vastlight_simd::Level;

fn rays_in_total() -> usize {
    if std::env::var_os("VASTLIGHT_SOAK").is_some() { 10_000_000 } else { 1_000_000 }
}

/// A point of the mesh: a corner, a point of an edge, or one near an edge, in turn.
fn target(random: &mut Random, mesh: &Mesh, kind: usize) -> Vec3 {
    let [a, b, _] = mesh.corners(random.below(mesh.triangles.len()) as u32);
    match kind % 4 {
        0 => a,
        1 => a + (b - a) * random.unit(),
        2 => (a + b) * 0.5,
        _ => a + (b - a) * random.unit() + random.point() * 1e-7,
    }
}

/// How many of `count` rays from inside to targets miss.
fn escaped(scene: &Scene, count: usize, inside: f32, seed: u64) -> usize {
    let mut random = Random(seed);
    let (mesh, map) = (&scene.meshes()[0], *scene.instances().map(0));
    let rays: Vec<Ray> = (0..count)
        .map(|i| {
            let target = map.transform_point3(target(&mut random, mesh, i));
            let origin = map.transform_point3(random.point() * inside);
            Ray::new(origin, target - origin)
        })
        .collect();
    let levels = Level::available();
    let hits: Vec<_> = levels.iter().map(|&level| closest(&tracer(scene, level), &rays)).collect();
    assert!(hits.windows(2).all(|pair| pair[0] == pair[1]), "levels differ");
    hits[0].iter().filter(|h| !h.is_hit()).count()
}

fn scenes() -> Vec<(&'static str, Scene)> {
    let bumpy = |p: Vec3| 1.0 + 0.2 * (p.x * 9.0).sin() * (p.y * 7.0).cos();
    let one = |mesh: Mesh, map: Affine3| scene(vec![(mesh, vec![map])]);
    let turned = Affine3::from_scale_rotation_translation(
        Vec3::new(3.0, -0.2, 1.1),
        Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 1.0),
        Vec3::new(10.0, -20.0, 5.0),
    );
    vec![
        ("ball", one(closed_surface(64, 128, |_| 1.0), Affine3::IDENTITY)),
        ("bumpy", one(closed_surface(40, 90, bumpy), Affine3::IDENTITY)),
        ("slivers", one(closed_surface(400, 5, |_| 1.0), Affine3::IDENTITY)),
        ("coarse", one(closed_surface(3, 4, |_| 1.0), Affine3::IDENTITY)),
        ("placed", one(closed_surface(30, 60, bumpy), turned)),
        ("far", one(closed_surface(30, 60, bumpy), Affine3::from_translation(Vec3::splat(1000.0)))),
    ]
}

#[test]
fn no_ray_gets_out() {
    let scenes = scenes();
    let each = rays_in_total() / scenes.len();
    for (name, scene) in &scenes {
        assert_eq!(escaped(scene, each, 0.05, 5), 0, "{name}");
    }
}

#[test]
fn tiny_and_huge_closed_meshes_hold() {
    for scale in [1e-20, 1e-8, 1e8, 5e14] {
        let mut mesh = closed_surface(20, 30, |_| 1.0);
        mesh.positions.iter_mut().for_each(|p| *p *= scale);
        let scene = scene(vec![(mesh, vec![Affine3::IDENTITY])]);
        assert_eq!(escaped(&scene, 20_000, 0.05 * scale, 3), 0, "{scale}");
    }
}

#[test]
fn a_missing_triangle_is_found() {
    let mut mesh = closed_surface(20, 30, |_| 1.0);
    mesh.triangles.remove(100);
    let holed = scene(vec![(mesh, vec![Affine3::IDENTITY])]);
    assert!(escaped(&holed, 20_000, 0.05, 3) > 0);
}
