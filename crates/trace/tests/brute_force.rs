//! Hits against brute force.

mod common;

use common::{BruteForce, Random, closest, occluded, scene, soup, tracer};
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::Scene;
use vastlight_simd::Level;

/// Compares hits, bit by bit, at every level, and occlusion with them.
fn check(name: &str, scene: &Scene, rays: &[Ray], least_hits: usize) {
    let oracle = BruteForce::new(scene);
    let expected: Vec<_> = rays.iter().map(|r| oracle.closest(r)).collect();
    let hits = expected.iter().filter(|h| h.is_hit()).count();
    assert!(hits >= least_hits, "{name}: only {hits} of {} rays hit", rays.len());
    for level in Level::available() {
        let tracer = tracer(scene, level);
        for (i, (found, expected)) in closest(&tracer, rays).iter().zip(&expected).enumerate() {
            assert_eq!(found, expected, "{name}, {}, ray {i}: {:?}", level.name(), rays[i]);
        }
        for (found, expected) in occluded(&tracer, rays).iter().zip(&expected) {
            assert_eq!(*found, expected.is_hit(), "{name}, {}", level.name());
        }
    }
}

fn rays(random: &mut Random, count: usize, center: Vec3, size: f32) -> Vec<Ray> {
    let ray = |_| {
        let origin = center + random.point() * (size * 2.0);
        Ray::new(origin, center + random.point() * size - origin)
    };
    (0..count).map(ray).collect()
}

#[test]
fn random_triangles() {
    let mut random = Random(7);
    let triangle = |r: &mut Random| {
        let center = r.point();
        [(); 3].map(|()| center + r.point() * 0.3)
    };
    let mesh = soup((0..300).map(|_| triangle(&mut random)));
    let rays = rays(&mut random, 500, Vec3::ZERO, 1.0);
    check("random", &scene(vec![(mesh, vec![Affine3::IDENTITY])]), &rays, 100);
}
