//! Rays that go the same way have the same hits in bundles as alone, also where a bundle gives up on its way.

use crate::common::shapes::{random_soup, soup};
use crate::common::{Random, closest, occluded, scene};
use vastlight_math::glam::Quat;
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::Scene;
use vastlight_simd::Level;
use vastlight_trace::{Hit, HitFilter, Tracer, TracerConfig};

/// Many small triangles, twice: a walk past all of them is long.
fn crowd() -> Scene {
    let mut random = Random(5);
    let turned = Affine3::from_rotation_translation(Quat::from_rotation_y(0.4), Vec3::new(0.2, 0.1, 0.0));
    scene(vec![(random_soup(&mut random, 20_000, 0.02, 1.0, Vec3::ZERO), vec![Affine3::IDENTITY, turned])])
}

/// Rays in one direction of the given length from places up to `spread` apart, of several reaches; every seventh goes
/// nowhere, every fifth begins in the crowd.
fn parallel(random: &mut Random, spread: f32, length: f32) -> Vec<Ray> {
    let center = Vec3::new(0.0, 0.0, 3.0) + random.point() * 0.3;
    let ray = |i: usize| Ray {
        t_min: if i % 5 == 2 { (2.2 + random.unit()) / length } else { 0.0 },
        t_max: if i % 7 == 3 { -1.0 } else { (2.5 + 2.0 * random.unit()) / length },
        ..Ray::new(center + random.point() * spread, Vec3::new(0.05, -0.1, -1.0) * length)
    };
    (0..500).map(ray).collect()
}

/// Tracers with and without bundles.
fn tracers(scene: &Scene, level: Level) -> (Tracer, Tracer) {
    let tracer = |single_rays| {
        let config = TracerConfig { level: Some(level), single_rays, ..TracerConfig::default() };
        Tracer::new(scene, &config).expect("built")
    };
    (tracer(false), tracer(true))
}

#[test]
fn bundles_and_single_rays_have_the_same_hits() {
    let scene = crowd();
    for level in Level::available() {
        let (together, alone) = tracers(&scene, level);
        let mut random = Random(9);
        // From one place and side by side bundles stay together; from all over the scene they give up.
        for (spread, length) in [
            (0.0, 1.0),
            (0.01, 1.0),
            (0.1, 1.0),
            (1.0, 1.0),
            (0.1, 1e-30),
            (0.1, 1e30),
            (0.1, 1e-42),
            (0.1, 2e38),
        ] {
            let name = format!("{spread}, {length}, {}", level.name());
            let rays = parallel(&mut random, spread, length);
            let expected = closest(&alone, &rays);
            assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 50, "{name}");
            assert_eq!(closest(&together, &rays), expected, "{name}");
            assert_eq!(occluded(&together, &rays), occluded(&alone, &rays), "{name}");
        }
    }
}

/// Where boxes are flat, only margins keep a hit in the part of its ray that counts.
#[test]
fn rays_that_begin_or_end_where_they_hit_do_so_in_bundles() {
    let mut random = Random(12);
    let mut found = 0;
    for round in 0..60 {
        // Squares in a plane, and the same again far behind, so that the way among instances is tested as well.
        let height = random.point().x;
        let at = |i: u32| Vec3::new((i % 21) as f32 * 0.1 - 1.0, (i / 21) as f32 * 0.1 - 1.0, height);
        let squares = (0..420).filter(|i| i % 21 < 20);
        let plane =
            soup(squares.flat_map(|i| [[at(i), at(i + 1), at(i + 21)], [at(i + 22), at(i + 21), at(i + 1)]]));
        let mut places = vec![Affine3::IDENTITY];
        places.extend((round % 2 == 1).then(|| Affine3::from_translation(Vec3::new(0.0, 0.0, -50.0))));
        let (together, alone) = tracers(&scene(vec![(plane, places)]), Level::default());
        let (above, direction) = (Vec3::Z * (height + 1.0 + random.unit()), random.point() * 0.2 - Vec3::Z);
        let ray = |random: &mut Random| {
            let side = random.point() * 0.05;
            Ray::new(above + Vec3::new(side.x, side.y, 0.0), direction)
        };
        let mut rays: Vec<Ray> = (0..64).map(|_| ray(&mut random)).collect();
        let hits = closest(&alone, &rays);
        for (ray, hit) in rays.iter_mut().zip(&hits).filter(|(_, hit)| hit.is_hit()) {
            (ray.t_min, ray.t_max) = if round % 4 < 2 { (hit.t, 1e30) } else { (0.0, hit.t) };
            found += 1;
        }
        assert_eq!(closest(&alone, &rays), hits, "{round}");
        assert_eq!(closest(&together, &rays), hits, "{round}");
        assert_eq!(occluded(&together, &rays), occluded(&alone, &rays), "{round}");
    }
    assert!(found > 2000, "{found} hits");
}

/// Refuses some hits by the number of the ray and the triangle.
struct Sieve;

impl HitFilter for Sieve {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        !(ray + hit.prim as usize).is_multiple_of(3)
    }
}

#[test]
fn rows_of_a_picture_have_the_hits_of_single_rays() {
    let scene = crowd();
    let (together, alone) = tracers(&scene, Level::default());
    // Whole rows and broken ones, and rows so far apart that they do not go together.
    for (width, rows, first, aspect) in
        [(300, 20, 0, 1.0), (300, 20, 123, 1.0), (90, 41, 30, 1.0), (300, 6, 0, 60.0)]
    {
        let pixel = |i: usize| {
            let [x, y] = [(i % width) as f32, (i / width) as f32 * aspect].map(|x| x / 300.0);
            Ray::new(Vec3::new(0.0, 0.0, 3.0), Vec3::new(x - 0.5, y - 0.1, -1.0))
        };
        let mut rays: Vec<Ray> = (first..width * rows).map(pixel).collect();
        for i in (0..rays.len()).step_by(97) {
            rays[i].t_max = 2.5;
        }
        let expected = closest(&alone, &rays);
        assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 200, "{width} {rows} {first}");
        assert_eq!(closest(&together, &rays), expected, "{width} {rows} {first}");
        assert_eq!(occluded(&together, &rays), occluded(&alone, &rays), "{width} {rows} {first}");
        let sieved = |tracer: &Tracer| {
            let mut hits = vec![Hit::MISS; rays.len()];
            tracer.closest(&rays, &Sieve, &mut hits);
            hits
        };
        assert_ne!(sieved(&alone), expected, "{width} {rows} {first}");
        assert_eq!(sieved(&together), sieved(&alone), "{width} {rows} {first}");
        let mut hits = vec![Hit::MISS; rays.len()];
        together.closest_parallel(&rays, &mut hits);
        assert_eq!(hits, expected, "{width} {rows} {first}");
    }
}
