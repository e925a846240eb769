//! How long the ways of rays are said to be.

use crate::common::shapes::{random_soup, soup};
use crate::common::{Random, scene, tracer, tracer_over};
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_simd::Level;
use vastlight_trace::Tracer;

fn steps(tracer: &Tracer, rays: &[Ray]) -> Vec<u32> {
    let mut steps = vec![9999; rays.len()];
    tracer.steps(rays, &mut steps);
    steps
}

#[test]
fn a_triangle_takes_the_way_into_its_instance_and_its_block() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let scene = scene(vec![(soup([corners]), vec![Affine3::IDENTITY])]);
    for level in Level::available() {
        let towards = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
        let nowhere = Ray { t_max: -1.0, ..towards };
        let found = steps(&tracer(&scene, level), &[towards, nowhere, towards]);
        assert!((1..=3).contains(&found[0]), "{found:?}");
        assert_eq!((found[1], found[2]), (0, found[0]));
    }
}

#[test]
fn ways_through_crowds_are_long_and_the_same_at_every_level() {
    let mut random = Random(3);
    let crowd =
        scene(vec![(random_soup(&mut random, 20_000, 0.02, 1.0, Vec3::ZERO), vec![Affine3::IDENTITY])]);
    let through = Ray::new(Vec3::new(0.01, 0.02, 3.0), Vec3::new(0.01, 0.0, -1.0));
    let past = Ray::new(Vec3::new(5.0, 5.0, 3.0), Vec3::NEG_Z);
    let mut seen = Vec::new();
    for level in Level::available() {
        let found = steps(&tracer(&crowd, level), &[through, past]);
        assert!(found[0] > 10 && found[1] < found[0] / 3, "{found:?}");
        seen.push(found);
    }
    assert!(seen.iter().all(|found| found == &seen[0]), "{seen:?}");
    let threaded = tracer_over("kd-threaded", &crowd, Level::PORTABLE);
    assert_eq!(steps(&threaded, &[through]), [0]);
    let mut short = [0];
    tracer(&crowd, Level::PORTABLE).steps(&[through, past], &mut short);
    assert_eq!(short[0], seen[0][0]);
}
