//! Sorting rays changes no answer, bit by bit, and happens where the rule says.

use crate::common::shapes::random_soup;
use crate::common::{ACCELS, Random, closest, occluded, rays_at, scene, tracer_over};
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::Scene;
use vastlight_simd::Level;
use vastlight_trace::sort::{RaySorter, SortRays};
use vastlight_trace::{Hit, Tracer};

fn crowd(triangles: usize) -> Scene {
    let moved = Affine3::from_translation(Vec3::new(1.0, 0.5, 0.0));
    let soup = random_soup(&mut Random(3), triangles, 0.05, 1.0, Vec3::ZERO);
    scene(vec![(soup, vec![Affine3::IDENTITY, moved])])
}

/// Rays from all over, some of them broken.
fn rays(count: usize) -> Vec<Ray> {
    let mut rays = rays_at(&mut Random(4), count, Vec3::ZERO, 1.0);
    for (i, ray) in rays.iter_mut().enumerate() {
        match i % 1000 {
            5 => ray.origin.y = f32::NAN,
            6 => ray.origin.x = f32::INFINITY,
            7 => ray.direction = Vec3::ZERO,
            8 => ray.direction.z = f32::NEG_INFINITY,
            9 => ray.direction *= 1e-30,
            10 => ray.t_max = 0.5,
            _ => {}
        }
    }
    rays
}

fn check(tracer: &Tracer, when: SortRays, rays: &[Ray], sorted: bool, name: &str) {
    let mut sorter = RaySorter::default();
    let mut hits = vec![Hit::MISS; rays.len()];
    let report = sorter.closest(tracer, when, rays, &mut hits);
    let expected = closest(tracer, rays);
    assert_eq!((report.sorted, hits == expected), (sorted, true), "{name}");
    let mut blocked = vec![false; rays.len()];
    let report = sorter.occluded(tracer, when, rays, &mut blocked);
    assert_eq!((report.sorted, blocked == occluded(tracer, rays)), (sorted, true), "{name}");
    let found = expected.iter().filter(|hit| hit.is_hit()).count();
    assert!(found > rays.len() / 50, "{name}: {found} hits");
    // The comparison sees a single answer in a wrong place.
    if let Some(i) = hits.windows(2).position(|pair| pair[0] != pair[1]) {
        hits.swap(i, i + 1);
    }
    assert_ne!(hits, expected, "{name}");
}

#[test]
fn sorted_rays_have_the_hits_of_unsorted_ones() {
    let (scene, rays) = (crowd(2000), rays(20_000));
    for (accel, level) in ACCELS.into_iter().zip(Level::available().into_iter().cycle()) {
        let tracer = tracer_over(accel, &scene, level);
        check(&tracer, SortRays::On, &rays, true, accel);
        check(&tracer, SortRays::Off, &rays, false, accel);
        // Too few to be sorted by themselves.
        check(&tracer, SortRays::Auto, &rays, false, accel);
        check(&tracer, SortRays::On, &rays[..2], true, accel);
    }
}

#[test]
fn many_rays_in_no_order_are_sorted_by_themselves_over_several_blocks() {
    let scene = crowd(200);
    let tracer = tracer_over("", &scene, Level::default());
    let rays = rays((1 << 20) + 5000);
    check(&tracer, SortRays::Auto, &rays, true, "no order");
    let mut sorted = rays;
    sorted.sort_by(|a, b| a.origin.x.total_cmp(&b.origin.x).then(a.origin.y.total_cmp(&b.origin.y)));
    let in_one_place: Vec<Ray> =
        sorted[..100_000].iter().map(|ray| Ray { origin: Vec3::Z, ..*ray }).collect();
    check(&tracer, SortRays::Auto, &in_one_place, true, "one place");
}
