//! Rays that are not finite, have no direction, odd lengths or odd ranges; filters; batches.

use crate::common::shapes::{closed_surface, random_soup};
use crate::common::{
    ACCELS, BruteForce, Random, closest, occluded, rays_at, scene, streamed, tracer, tracer_over,
};
use vastlight_math::{Affine3, FAR, Mat3, Ray, Vec3};
use vastlight_scene::{Scene, SceneDesc};
use vastlight_simd::Level;
use vastlight_trace::{Hit, HitFilter, Layout, TopLevel, TraceError, Tracer, TracerConfig};

fn ball_and_others() -> Scene {
    let maps =
        (0..9).map(|i| Affine3::from_translation(Vec3::new((i % 3) as f32, 0.0, (i / 3) as f32) * 5.0));
    scene(vec![(closed_surface(8, 12, |_| 1.0), maps.collect())])
}

#[test]
fn rays_that_are_not_finite_miss() {
    let good = Ray::new(Vec3::new(0.1, 0.2, -3.0), Vec3::Z);
    for scene in [ball_and_others(), scene(vec![(closed_surface(8, 12, |_| 1.0), vec![Affine3::IDENTITY])])] {
        for (accel, level) in ACCELS.into_iter().zip(Level::available().into_iter().cycle()) {
            let tracer = tracer_over(accel, &scene, level);
            assert!(closest(&tracer, &[good])[0].is_hit());
            let mut bad = vec![
                Ray { direction: Vec3::ZERO, ..good },
                Ray { t_min: f32::NAN, ..good },
                Ray { t_max: f32::NAN, ..good },
                Ray { t_min: 5.0, t_max: 1.0, ..good },
                Ray { t_max: -1.0, ..good },
                Ray { t_min: f32::INFINITY, t_max: f32::INFINITY, ..good },
            ];
            for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                for k in 0..3 {
                    let mut ray = good;
                    ray.origin[k] = value;
                    bad.push(ray);
                    let mut ray = good;
                    ray.direction[k] = value;
                    bad.push(ray);
                }
            }
            assert!(closest(&tracer, &bad).iter().all(|h| *h == Hit::MISS));
            assert!(occluded(&tracer, &bad).iter().all(|o| !o));
            if tracer.has_stream_kernels() {
                assert!(streamed(&tracer, &bad, false).iter().all(|h| *h == Hit::MISS));
            }
        }
    }
}

#[test]
fn the_length_of_a_direction_scales_t() {
    let scene = ball_and_others();
    let tracer = tracer(&scene, Level::detect());
    let ray = Ray::new(Vec3::new(0.1, 0.2, -3.0), Vec3::new(0.01, 0.02, 1.0));
    let expected = closest(&tracer, &[ray])[0];
    for exponent in [-115, -60, -21, -1, 1, 21, 60, 100] {
        let factor = 2.0_f32.powi(exponent);
        let scaled = Ray { direction: ray.direction * factor, t_max: f32::INFINITY, ..ray };
        let found = closest(&tracer, &[scaled])[0];
        // A power of two changes nothing but the scale of t.
        assert_eq!(found, Hit { t: expected.t / factor, ..expected }, "2^{exponent}");
    }
}

#[test]
fn hits_lie_in_the_range_of_the_ray() {
    ACCELS.iter().for_each(|accel| check_range(accel));
}

fn check_range(accel: &str) {
    let tracer = tracer_over(accel, &ball_and_others(), Level::detect());
    let ray = Ray::new(Vec3::new(0.1, 0.2, -3.0), Vec3::Z);
    let first = closest(&tracer, &[ray])[0];
    // The ends belong to the range.
    for (t_min, t_max, is_first) in [
        (0.0, first.t, true),
        (first.t, FAR, true),
        (first.t, first.t, true),
        (f32::NEG_INFINITY, f32::INFINITY, true),
        (0.0, first.t.next_down(), false),
        (first.t.next_up(), FAR, false),
    ] {
        let found = closest(&tracer, &[Ray { t_min, t_max, ..ray }])[0];
        assert_eq!(found == first, is_first, "{t_min} {t_max} {found:?}");
    }
    // Behind the origin is no hit, whatever t_min says.
    let beyond = Ray { origin: Vec3::new(0.1, 0.2, 500.0), t_min: -1000.0, ..ray };
    assert!(!closest(&tracer, &[beyond])[0].is_hit());
}

/// Accepts triangles whose number and ray allow it.
struct Sieve;

impl HitFilter for Sieve {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        (hit.prim as usize + ray).is_multiple_of(3)
    }
}

#[test]
fn filters_see_every_hit_that_matters() {
    let mut random = Random(3);
    let scene = scene(vec![(random_soup(&mut random, 150, 0.6, 1.0, Vec3::ZERO), vec![Affine3::IDENTITY])]);
    let rays = rays_at(&mut random, 300, Vec3::ZERO, 1.0);
    // For each rest by three, a scene in which the refused triangles are points.
    let oracles: Vec<BruteForce> = (0..3)
        .map(|rest| {
            let mut mesh = scene.meshes()[0].clone();
            let refused = |prim: usize| !(prim + rest).is_multiple_of(3);
            mesh.triangles
                .iter_mut()
                .enumerate()
                .filter(|(i, _)| refused(*i))
                .for_each(|(_, t)| *t = [t[0]; 3]);
            BruteForce::new(&crate::common::scene(vec![(mesh, vec![Affine3::IDENTITY])]))
        })
        .collect();
    for (accel, level) in ACCELS.into_iter().zip(Level::available().into_iter().cycle()) {
        let tracer = tracer_over(accel, &scene, level);
        let (mut hits, mut shadows) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        tracer.closest(&rays, &Sieve, &mut hits);
        tracer.occluded(&rays, &Sieve, &mut shadows);
        assert!(hits.iter().filter(|h| h.is_hit()).count() > 50);
        for (i, ray) in rays.iter().enumerate() {
            let expected = oracles[i % 3].closest(ray);
            assert_eq!((hits[i], shadows[i]), (expected, expected.is_hit()), "ray {i}");
        }
    }
}

#[test]
fn parallel_answers_are_the_serial_ones() {
    let mut random = Random(4);
    let scene = ball_and_others();
    let rays = rays_at(&mut random, 20_000, Vec3::splat(5.0), 6.0);
    let tracer = tracer(&scene, Level::detect());
    let (mut hits, mut shadows) = (vec![Hit::MISS; rays.len()], vec![true; rays.len()]);
    tracer.closest_parallel(&rays, &mut hits);
    tracer.occluded_parallel(&rays, &mut shadows);
    assert_eq!(hits, closest(&tracer, &rays));
    assert_eq!(shadows, occluded(&tracer, &rays));
    assert!(hits.iter().any(Hit::is_hit) && !hits.iter().all(Hit::is_hit));
}

#[test]
fn empty_scenes_and_unknown_builders() {
    let scene = Scene::new(SceneDesc::default()).expect("valid");
    let tracer = tracer(&scene, Level::detect());
    assert_eq!(closest(&tracer, &[Ray::new(Vec3::ZERO, Vec3::Z)])[0], Hit::MISS);
    assert_eq!(tracer.report().triangles, 0);
    for accel in ACCELS {
        let ray = Ray::new(Vec3::ZERO, Vec3::Z);
        assert_eq!(closest(&tracer_over(accel, &scene, Level::detect()), &[ray])[0], Hit::MISS);
    }
    let config = TracerConfig { accel: "quantum".into(), ..TracerConfig::default() };
    assert!(matches!(Tracer::new(&scene, &config), Err(TraceError::Build(_))));
    let config =
        TracerConfig { accel: "kd-threaded".into(), layout: Layout::Compact, ..TracerConfig::default() };
    assert!(matches!(Tracer::new(&scene, &config), Err(TraceError::Layout { .. })));
}

#[test]
fn instances_share_the_structure_of_their_mesh() {
    let ball = closed_surface(20, 40, |_| 1.0);
    let maps = |n: usize| (0..n).map(|i| Affine3::from_translation(Vec3::X * (i as f32 * 3.0))).collect();
    let bytes = |n: usize| {
        let scene = scene(vec![(ball.clone(), maps(n))]);
        tracer(&scene, Level::detect()).report().bytes
    };
    let (one, many) = (bytes(1), bytes(20_001));
    let each = (many - one) as f64 / 20_000.0;
    // The scene's matrix, what is at hand for rays, and full nodes.
    assert!(each < 48.0 + 56.0 + 60.0, "{each} bytes an instance");
}

#[test]
fn places_beyond_the_range_of_numbers_do_no_harm() {
    let mut random = Random(23);
    let ball = random_soup(&mut random, 40, 0.4, 1.0, Vec3::ZERO);
    let far = |scale: f32, x: f32| Affine3 {
        matrix3: Mat3::from_diagonal(Vec3::splat(scale)),
        translation: Vec3::X * x,
    };
    let rays = rays_at(&mut random, 300, Vec3::ZERO, 1.0);
    let alone = scene(vec![(ball.clone(), vec![Affine3::IDENTITY])]);
    let expected = closest(&tracer(&alone, Level::detect()), &rays);
    assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 50);
    for (scale, x) in [(1e38, 0.0), (3e38, 3e38), (1.0, 3e38), (1e-38, -3e38)] {
        let maps = vec![Affine3::IDENTITY, far(scale, x), far(-scale, -x)];
        let scene = scene(vec![(ball.clone(), maps)]);
        let check = |tracer: &Tracer, what: &str| {
            for (found, expected) in closest(tracer, &rays).iter().zip(&expected) {
                // The others may be in the way, or nowhere.
                let same = found == expected || found.instance != 0 && found.t <= expected.t;
                assert!(same, "{what}, {scale} {x}: {found:?} {expected:?}");
            }
        };
        for accel in ACCELS {
            check(&tracer_over(accel, &scene, Level::detect()), accel);
        }
        let (layout, top) = (Layout::Compact, TopLevel::Grid(64));
        let config = TracerConfig { layout, top, ..TracerConfig::default() };
        check(&Tracer::new(&scene, &config).expect("built"), "grid");
    }
}
