//! Rays that go the same way have the same hits in bundles as alone, also where a bundle gives up on its way.

mod common;

use common::shapes::random_soup;
use common::{Random, closest, occluded, scene};
use vastlight_math::glam::Quat;
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::Scene;
use vastlight_simd::Level;
use vastlight_trace::{Tracer, TracerConfig};

/// Many small triangles, twice: a walk past all of them is long.
fn crowd() -> Scene {
    let mut random = Random(5);
    let turned = Affine3::from_rotation_translation(Quat::from_rotation_y(0.4), Vec3::new(0.2, 0.1, 0.0));
    scene(vec![(random_soup(&mut random, 20_000, 0.02, 1.0, Vec3::ZERO), vec![Affine3::IDENTITY, turned])])
}

/// Rays in one direction of the given length from places up to `spread` apart, of several reaches; every seventh goes
/// nowhere.
fn parallel(random: &mut Random, spread: f32, length: f32) -> Vec<Ray> {
    let center = Vec3::new(0.0, 0.0, 3.0) + random.point() * 0.3;
    let ray = |i: usize| Ray {
        t_max: if i % 7 == 3 { -1.0 } else { (2.5 + 2.0 * random.unit()) / length },
        ..Ray::new(center + random.point() * spread, Vec3::new(0.05, -0.1, -1.0) * length)
    };
    (0..500).map(ray).collect()
}

#[test]
fn bundles_and_single_rays_have_the_same_hits() {
    let scene = crowd();
    for level in Level::available() {
        let tracer = |single_rays| {
            let config = TracerConfig { level: Some(level), single_rays, ..TracerConfig::default() };
            Tracer::new(&scene, &config).expect("built")
        };
        let (together, alone) = (tracer(false), tracer(true));
        let mut random = Random(9);
        // From one place and side by side bundles stay together; from all over the scene they give up.
        for (spread, length) in [(0.0, 1.0), (0.01, 1.0), (0.1, 1.0), (1.0, 1.0), (0.1, 1e-30), (0.1, 1e30)] {
            let name = format!("{spread}, {length}, {}", level.name());
            let rays = parallel(&mut random, spread, length);
            let expected = closest(&alone, &rays);
            assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 50, "{name}");
            assert_eq!(closest(&together, &rays), expected, "{name}");
            assert_eq!(occluded(&together, &rays), occluded(&alone, &rays), "{name}");
        }
    }
}
