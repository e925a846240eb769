//! Hits against brute force, bit by bit, on geometry that is easy and nasty; and against double precision.

use crate::common::shapes::{closed_surface, random_soup, soup, thin_soup};
use crate::common::{
    ACCELS, BruteForce, Random, beams, closest, occluded, rays_at, scene, streamed, tracer, tracer_over,
};
use vastlight_math::glam::{DVec3, Quat};
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::{Mesh, Scene};
use vastlight_simd::Level;

/// Compares hits and occlusion with brute force at every level; at least `least_hits` rays must hit.
fn check(name: &str, scene: &Scene, rays: &[Ray], least_hits: usize) {
    let oracle = BruteForce::new(scene);
    let mut random = Random(3);
    // Alone, and in bundles.
    let rays = &[rays, &beams(&mut random, &rays[..rays.len().min(8)])].concat();
    let expected: Vec<_> = rays.iter().map(|r| oracle.closest(r)).collect();
    let hits = expected.iter().filter(|h| h.is_hit()).count();
    assert!(hits >= least_hits, "{name}: only {hits} of {} rays hit", rays.len());
    for (accel, level) in structures() {
        let tracer = tracer_over(accel, scene, level);
        for (i, (found, expected)) in closest(&tracer, rays).iter().zip(&expected).enumerate() {
            assert_eq!(found, expected, "{name}, {accel}, {}, ray {i}: {:?}", level.name(), rays[i]);
        }
        for (found, expected) in occluded(&tracer, rays).iter().zip(&expected) {
            assert_eq!(*found, expected.is_hit(), "{name}, {accel}, {}", level.name());
        }
        if tracer.has_stream_kernels() {
            assert_eq!(streamed(&tracer, rays, false), expected, "{name}, {accel}, kernels");
            for (found, expected) in streamed(&tracer, rays, true).iter().zip(&expected) {
                assert_eq!(found.is_hit(), expected.is_hit(), "{name}, {accel}, kernels, occlusion");
            }
        }
    }
}

/// Every structure at every level.
fn structures() -> impl Iterator<Item = (&'static str, Level)> {
    ACCELS.into_iter().flat_map(|accel| Level::available().into_iter().map(move |level| (accel, level)))
}

fn check_mesh(name: &str, mesh: Mesh, rays: &[Ray], least_hits: usize) {
    check(name, &scene(vec![(mesh, vec![Affine3::IDENTITY])]), rays, least_hits);
}

#[test]
fn random_triangles() {
    let mut random = Random(7);
    let mesh = random_soup(&mut random, 300, 0.3, 1.0, Vec3::ZERO);
    check_mesh("random", mesh, &rays_at(&mut random, 500, Vec3::ZERO, 1.0), 100);
}

#[test]
fn thin_triangles() {
    for (seed, width) in [(1, 1e-2), (2, 1e-4), (3, 1e-6)] {
        let mut random = Random(seed);
        let mesh = thin_soup(&mut random, 200, width);
        let mut rays = rays_at(&mut random, 200, Vec3::ZERO, 1.0);
        // Random rays miss thin triangles: aim at points of them, and along them.
        for i in 0..200 {
            let [a, b, c] = mesh.corners(random.below(200) as u32);
            let target = a + (b - a) * random.unit() + (c - a) * (random.unit() * 0.5);
            let origin = if i % 2 == 0 { random.point() * 2.0 } else { target + (b - a) * 3.0 };
            rays.push(Ray::new(origin, target - origin));
        }
        check_mesh("thin", mesh, &rays, 20);
    }
}

#[test]
fn tiny_and_huge_meshes() {
    for scale in [1e-30, 1e-20, 1e-10, 1e-4, 1e4, 1e10, 5e14] {
        let mut random = Random(11);
        let mesh = random_soup(&mut random, 100, 0.4, scale, Vec3::ZERO);
        let rays = rays_at(&mut random, 200, Vec3::ZERO, scale);
        check_mesh(&format!("scale {scale}"), mesh, &rays, 40);
    }
}

#[test]
fn tiny_triangles_in_a_large_mesh() {
    let mut random = Random(13);
    let mut triangles: Vec<[Vec3; 3]> = (0..200)
        .map(|i| {
            let center = random.point();
            let size = 2.0_f32.powi(-(i % 24));
            [(); 3].map(|()| center + random.point() * size)
        })
        .collect();
    triangles.push([Vec3::new(-1.0, -1.0, 0.9), Vec3::new(1.0, -1.0, 0.9), Vec3::new(0.0, 1.0, 0.9)]);
    let mut rays = rays_at(&mut random, 200, Vec3::ZERO, 1.0);
    for t in &triangles {
        let origin = random.point() * 3.0;
        rays.push(Ray::new(origin, (t[0] + t[1] + t[2]) / 3.0 - origin));
    }
    check_mesh("tiny in large", soup(triangles), &rays, 100);
}

#[test]
fn far_from_the_origin() {
    for distance in [1e3, 1e5, 1e6] {
        let mut random = Random(17);
        let center = Vec3::new(distance, -distance, distance * 0.5);
        let mesh = random_soup(&mut random, 100, 0.4, 1.0, center);
        check_mesh(&format!("far {distance}"), mesh, &rays_at(&mut random, 200, center, 1.0), 40);
        // The same rays from as far away as the origin.
        let mesh = random_soup(&mut random, 100, 0.4, 1.0, center);
        let mut ray = || {
            let origin = random.point();
            Ray::new(origin, center + random.point() - origin)
        };
        let rays: Vec<Ray> = (0..200).map(|_| ray()).collect();
        check_mesh(&format!("far, from the origin, {distance}"), mesh, &rays, 20);
    }
}

#[test]
fn coincident_triangles_are_hit_by_the_lowest_number() {
    let mut random = Random(19);
    let one = [random.point(), random.point(), random.point()];
    let mesh = soup((0..100).map(|_| one));
    let target = (one[0] + one[1] + one[2]) / 3.0;
    let rays: Vec<Ray> = (0..50).map(|_| random.point() * 2.0).map(|o| Ray::new(o, target - o)).collect();
    let turned = vec![Affine3::IDENTITY; 3];
    let scene = scene(vec![(mesh, turned)]);
    check("coincident", &scene, &rays, 50);
    let hits = closest(&tracer(&scene, Level::detect()), &rays);
    assert!(hits.iter().all(|h| (h.instance, h.prim) == (0, 0)));
}

#[test]
fn flat_and_degenerate_meshes() {
    let mut random = Random(23);
    let flat = |p: Vec3| Vec3::new(p.x, 0.0, p.z);
    let triangles = (0..200).map(|i| match i % 4 {
        // A point, a line, and two triangles in the plane y = 0.
        0 => [flat(random.point()); 3],
        1 => {
            let (a, d) = (flat(random.point()), flat(random.point()));
            [a, a + d, a + d * 2.0]
        }
        _ => [(); 3].map(|()| flat(random.point())),
    });
    let mesh = soup(triangles.collect::<Vec<_>>());
    let mut rays = rays_at(&mut random, 200, Vec3::ZERO, 1.0);
    // In the plane, and straight through it.
    for _ in 0..100 {
        let o = flat(random.point() * 2.0);
        rays.push(Ray::new(o, flat(random.point()) - o));
        rays.push(Ray::new(o * 0.5 + Vec3::Y, Vec3::NEG_Y));
    }
    check_mesh("flat", mesh, &rays, 50);
}

#[test]
fn axis_parallel_rays_on_a_grid_of_boxes() {
    // Every ray runs in planes of faces, along edges or through corners.
    let corner = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let boxes: Vec<Vec3> =
        (0..27).map(|i| Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32)).collect();
    let triangles = boxes.iter().flat_map(|&offset| {
        faces.iter().flat_map(move |f| {
            let p = f.map(|i| offset + corner(i) * 0.5);
            [[p[0], p[1], p[2]], [p[0], p[2], p[3]]]
        })
    });
    let mesh = soup(triangles.collect::<Vec<_>>());
    let mut rays = Vec::new();
    for direction in
        [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z, Vec3::new(1.0, 1.0, 0.0), Vec3::ONE]
    {
        for i in 0..64 {
            let place = Vec3::new((i % 4) as f32, (i / 4 % 4) as f32, (i / 16) as f32) * 0.5;
            rays.push(Ray::new(place - direction * 5.0, direction));
        }
    }
    check_mesh("boxes", mesh, &rays, 200);
}

#[test]
fn placed_scaled_and_mirrored_instances() {
    let mut random = Random(29);
    let maps = |random: &mut Random, count: usize| -> Vec<Affine3> {
        let map = |i: usize| {
            let scale = match i % 4 {
                0 => Vec3::ONE,
                1 => Vec3::splat(0.1 + random.unit()),
                2 => Vec3::new(-0.5, 1.5, 0.7),
                _ => Vec3::new(0.01, 2.0, 1.0),
            };
            let axis = (random.point() + Vec3::splat(1e-3)).normalize();
            let rotation = Quat::from_axis_angle(axis, random.unit() * 6.0);
            Affine3::from_scale_rotation_translation(scale, rotation, random.point() * 3.0)
        };
        (0..count).map(map).collect()
    };
    let ball = closed_surface(5, 6, |_| 1.0);
    let soup = random_soup(&mut random, 20, 0.5, 1.0, Vec3::ONE);
    let (a, b) = (maps(&mut random, 12), maps(&mut random, 12));
    let scene = scene(vec![(ball, a), (soup, b)]);
    check("instances", &scene, &rays_at(&mut random, 300, Vec3::ZERO, 3.0), 100);
}

#[test]
fn instances_far_apart_and_of_extreme_scale() {
    let mut random = Random(31);
    let ball = closed_surface(5, 6, |_| 1.0);
    for scale in [1e-12, 1e-6, 1e6, 1e12] {
        let maps: Vec<Affine3> = (0..20)
            .map(|_| {
                let rotation = Quat::from_rotation_y(random.unit());
                Affine3::from_scale_rotation_translation(
                    Vec3::splat(scale),
                    rotation,
                    random.point() * scale * 9.0,
                )
            })
            .collect();
        let rays = rays_at(&mut random, 100, Vec3::ZERO, scale * 9.0);
        check(&format!("instances at {scale}"), &scene(vec![(ball.clone(), maps)]), &rays, 5);
    }
}

#[test]
fn broken_coordinates_leave_the_rest_alone() {
    let mut random = Random(37);
    let mut mesh = random_soup(&mut random, 100, 0.4, 1.0, Vec3::ZERO);
    for (i, bad) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30].into_iter().enumerate() {
        mesh.positions[i * 30].x = bad;
        mesh.positions[i * 30 + 4].z = bad;
    }
    check_mesh("broken", mesh, &rays_at(&mut random, 300, Vec3::ZERO, 1.0), 50);
}

#[test]
fn hits_agree_with_double_precision() {
    let mut random = Random(41);
    let mesh = random_soup(&mut random, 60, 0.5, 1.0, Vec3::ZERO);
    let scene = scene(vec![(mesh, vec![Affine3::IDENTITY])]);
    let rays = rays_at(&mut random, 3000, Vec3::ZERO, 1.0);
    let mesh = &scene.meshes()[0];
    let (mut compared, mut hit) = (0, 0);
    for (ray, found) in rays.iter().zip(closest(&tracer(&scene, Level::detect()), &rays)) {
        let all: Vec<_> = (0..60).map(|prim| (prim, double_precision(ray, mesh.corners(prim)))).collect();
        // Near an edge, and edge-on, single precision may decide otherwise.
        if all.iter().any(|(_, m)| m.unsure) {
            continue;
        }
        compared += 1;
        let best = all.iter().filter(|(_, m)| m.inside).min_by(|a, b| a.1.t.total_cmp(&b.1.t));
        assert_eq!(found.is_hit(), best.is_some(), "{ray:?}");
        if let Some((prim, meeting)) = best {
            hit += 1;
            assert_eq!(found.prim, *prim);
            for (found, exact) in [(found.t, meeting.t), (found.u, meeting.u), (found.v, meeting.v)] {
                assert!((f64::from(found) - exact).abs() < 1e-3 * exact.abs().max(0.1), "{found} {exact}");
            }
        }
    }
    assert!(compared > 2000 && hit > 500, "{compared} {hit}");
}

/// Where a line meets a triangle, after Moeller and Trumbore, in f64.
struct Meeting {
    t: f64,
    u: f64,
    v: f64,
    inside: bool,
    unsure: bool,
}

fn double_precision(ray: &Ray, corners: [Vec3; 3]) -> Meeting {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let (origin, direction): (DVec3, DVec3) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    let s = origin - a;
    let q = s.cross(ab);
    let (u, v) = (s.dot(p) / determinant, direction.dot(q) / determinant);
    let t = ac.dot(q) / determinant;
    let least = u.min(v).min(1.0 - u - v);
    let edge_on = determinant.abs() < 1e-3 * direction.length() * ab.length() * ac.length();
    let unsure = least.abs() < 1e-4 || t.abs() < 1e-4 || edge_on && least > -0.1;
    Meeting { t, u, v, inside: least >= 0.0 && t >= 0.0, unsure }
}

#[test]
#[should_panic(expected = "control")]
fn a_moved_triangle_would_be_found() {
    let mut random = Random(43);
    let mesh = random_soup(&mut random, 50, 0.5, 1.0, Vec3::ZERO);
    let rays = rays_at(&mut random, 200, Vec3::ZERO, 1.0);
    let expected = BruteForce::new(&scene(vec![(mesh.clone(), vec![Affine3::IDENTITY])]));
    let mut moved = mesh;
    moved.positions[7] += Vec3::splat(1e-3);
    let found = closest(&tracer(&scene(vec![(moved, vec![Affine3::IDENTITY])]), Level::detect()), &rays);
    for (ray, found) in rays.iter().zip(found) {
        assert_eq!(found, expected.closest(ray), "control");
    }
}
