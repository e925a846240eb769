//! Hits do not change where triangles are cut into parts: grazing rays, for which `t` is hard to tell, against brute
//! force and against a tree of whole triangles.
//!
//! A hundred thousand rays in a test run; ten million with `VASTLIGHT_SOAK` in the environment.

use crate::common::shapes::{closed_surface, soup, thin_soup};
use crate::common::{BruteForce, Random, beams, closest, occluded, scene};
use vastlight_accel::build::NAMES;
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::{Mesh, Scene};
use vastlight_simd::Level;
use vastlight_trace::{Tracer, TracerConfig};

fn rays_in_total() -> usize {
    if std::env::var_os("VASTLIGHT_SOAK").is_some() { 10_000_000 } else { 100_000 }
}

fn one(mesh: Mesh) -> Scene {
    scene(vec![(mesh, vec![Affine3::IDENTITY])])
}

fn cut(scene: &Scene, accel: &str, budget: f32, level: Level) -> Tracer {
    let config = TracerConfig {
        accel: accel.into(),
        split_budget: Some(budget),
        level: Some(level),
        ..TracerConfig::default()
    };
    Tracer::new(scene, &config).expect("built")
}

/// Rays that run in the plane of a triangle, up to a little.
fn grazing(random: &mut Random, mesh: &Mesh, count: usize) -> Vec<Ray> {
    let ray = |i: usize| {
        let [a, b, c] = mesh.corners(random.below(mesh.triangles.len()) as u32);
        let mut place = |spread: f32| {
            a + (b - a) * (random.unit() * spread - 1.0) + (c - a) * (random.unit() * spread - 1.0)
        };
        let (origin, target) = (place(4.0), place(3.0));
        let off = [0.0, 1e-8, 1e-7, 1e-6, 1e-5][i % 5];
        let origin = origin + random.point() * off;
        Ray::new(origin, target + random.point() * off - origin)
    };
    (0..count).map(ray).collect()
}

fn meshes() -> Vec<(&'static str, Mesh)> {
    let mut random = Random(3);
    let large = soup((0..60).map(|_| [random.point(), random.point(), random.point()]));
    let flat = soup((0..60).map(|_| [(); 3].map(|()| random.point() * Vec3::new(1.0, 1.0, 0.0))));
    let far = soup((0..60).map(|_| [(); 3].map(|()| random.point() + Vec3::new(300.0, 0.0, -20.0))));
    vec![
        ("large", large),
        ("flat", flat),
        ("far", far),
        ("thin", thin_soup(&mut random, 100, 1e-3)),
        ("slivers", thin_soup(&mut random, 100, 1e-6)),
        ("ball", closed_surface(40, 3, |_| 1.0)),
    ]
}

#[test]
fn grazing_rays_hit_parts_as_brute_force_does() {
    for (name, mesh) in meshes() {
        let mut random = Random(5);
        let alone = grazing(&mut random, &mesh, 300);
        let rays = [beams(&mut random, &alone[..10]), alone].concat();
        let scene = one(mesh);
        let oracle = BruteForce::new(&scene);
        let expected: Vec<_> = rays.iter().map(|ray| oracle.closest(ray)).collect();
        let hits = expected.iter().filter(|h| h.is_hit()).count();
        assert!(hits >= 5, "{name}: {hits}");
        for accel in NAMES {
            for level in Level::available() {
                let tracer = cut(&scene, accel, 8.0, level);
                for ((found, expected), ray) in closest(&tracer, &rays).iter().zip(&expected).zip(&rays) {
                    assert_eq!(found, expected, "{name}, {accel}, {}: {ray:?}", level.name());
                }
                for (found, expected) in occluded(&tracer, &rays).iter().zip(&expected) {
                    assert_eq!(*found, expected.is_hit(), "{name}, {accel}");
                }
            }
        }
    }
}

#[test]
fn grazing_rays_hit_the_same_in_every_tree() {
    let meshes = meshes();
    let each = rays_in_total() / meshes.len();
    for (name, mesh) in meshes {
        let mut random = Random(7);
        let rays = grazing(&mut random, &mesh, each);
        let scene = one(mesh);
        let expected = closest(&cut(&scene, "", 1.0, Level::detect()), &rays);
        for accel in NAMES {
            for budget in [1.3, 3.0, 20.0] {
                let tracer = cut(&scene, accel, budget, Level::detect());
                let found = closest(&tracer, &rays);
                let different = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
                assert_eq!(different, 0, "{name}, {accel}, {budget}: of {}", rays.len());
            }
        }
    }
}

#[test]
fn trees_are_cut_at_all() {
    for (name, mesh) in meshes() {
        let scene = one(mesh);
        let report = cut(&scene, "", 3.0, Level::detect()).report().clone();
        assert!(report.references > report.triangles, "{name}: {report:?}");
        assert!(report.references <= 3 * report.triangles, "{name}: {report:?}");
        let whole = cut(&scene, "", 1.0, Level::detect()).report().clone();
        assert_eq!(whole.references, whole.triangles, "{name}");
    }
}
