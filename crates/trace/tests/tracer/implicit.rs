//! Implicit surfaces beside triangles, through every structure.

use crate::common::shapes::soup;
use crate::common::{ACCELS, Random, closest, occluded, rays_at, scene, tracer_over};
use std::sync::Arc;
use vastlight_math::glam::{DAffine3, Quat};
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::{ImplicitShape, Julia, Mesh, Metaball, Metaballs, Scene};
use vastlight_simd::Level;
use vastlight_trace::stream::StreamRay;
use vastlight_trace::{Hit, HitFilter, Tracer};

pub(crate) fn implicit(shape: ImplicitShape) -> Mesh {
    Mesh { name: "implicit".into(), implicit: Some(Arc::new(shape)), ..Mesh::default() }
}

pub(crate) fn balls() -> ImplicitShape {
    let ball = |x: f32, y: f32| Metaball { center: Vec3::new(x, y, 0.1 * x), radius: 0.8, strength: 1.0 };
    ImplicitShape::Metaballs(Metaballs {
        balls: vec![ball(-0.5, 0.0), ball(0.3, 0.2), ball(0.2, -0.6)],
        threshold: 0.2,
    })
}

pub(crate) fn julia() -> ImplicitShape {
    ImplicitShape::Julia(Julia { c: [-0.2, 0.6, 0.2, 0.2], slice: 0.0, iterations: 7 })
}

/// Both shapes, turned, mirrored and stretched, and two walls.
fn mixed() -> Scene {
    let turned = Affine3::from_rotation_translation(Quat::from_rotation_y(0.7), Vec3::new(2.5, 0.0, 0.0));
    let mirrored = Affine3::from_scale(Vec3::new(-1.5, 0.5, 1.0));
    let walls = soup([
        [Vec3::new(-9.0, -9.0, -1.5), Vec3::new(9.0, -9.0, -1.5), Vec3::new(0.0, 9.0, -1.5)],
        [Vec3::new(-9.0, -9.0, 0.1), Vec3::new(0.2, -9.0, 0.1), Vec3::new(0.2, 9.0, 0.1)],
    ]);
    scene(vec![
        (implicit(balls()), vec![mirrored, turned]),
        (walls, vec![Affine3::IDENTITY]),
        (implicit(julia()), vec![Affine3::from_translation(Vec3::new(0.0, 1.5, 0.0))]),
    ])
}

fn rays() -> Vec<Ray> {
    rays_at(&mut Random(5), 2000, Vec3::new(0.8, 0.4, 0.0), 2.0)
}

/// Whether a point is inside an instance's shape.
fn field(scene: &Scene, instance: u32, ray: &Ray, t: f32) -> Option<f64> {
    let shape = scene.meshes()[scene.instances().mesh(instance as usize) as usize].implicit.as_ref()?;
    let map = scene.instances().map(instance as usize);
    let wide = DAffine3 { matrix3: map.matrix3.as_dmat3(), translation: map.translation.as_dvec3() };
    let point = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(t);
    Some(shape.field(wide.inverse().transform_point3(point)).0)
}

fn structures() -> impl Iterator<Item = (&'static str, Level)> {
    ACCELS.into_iter().flat_map(|accel| Level::available().into_iter().map(move |level| (accel, level)))
}

#[test]
fn every_structure_gives_the_same_hits_alone_and_in_batches() {
    let (scene, rays) = (mixed(), rays());
    let expected = closest(&tracer_over("", &scene, Level::default()), &rays);
    let implicit = expected.iter().filter(|hit| hit.is_hit() && hit.instance != 2).count();
    let triangles = expected.iter().filter(|hit| hit.instance == 2).count();
    assert!(implicit > 200 && triangles > 100, "{implicit} {triangles}");
    for (accel, level) in structures() {
        let tracer = tracer_over(accel, &scene, level);
        assert_eq!(closest(&tracer, &rays), expected, "{accel}");
        let alone: Vec<Hit> = rays.iter().map(|ray| closest(&tracer, &[*ray])[0]).collect();
        assert_eq!(alone, expected, "{accel}, alone");
        let occluded = occluded(&tracer, &rays);
        assert!(occluded.iter().zip(&expected).all(|(&any, hit)| any == hit.is_hit()), "{accel}");
        assert_eq!(streamed(&tracer, &rays), expected, "{accel}, queues");
    }
}

/// Closest hits as the stream tracer asks for them.
fn streamed(tracer: &Tracer, rays: &[Ray]) -> Vec<Hit> {
    assert!(!tracer.has_stream_kernels());
    let mut stream: Vec<StreamRay> = rays.iter().map(|ray| StreamRay::new(ray, false)).collect();
    let queue: Vec<u32> = (0..rays.len() as u32).collect();
    let mut ended = Vec::new();
    tracer.trace_whole(&mut stream, &queue, &vastlight_trace::AcceptAll, &mut ended);
    assert_eq!(ended, queue);
    stream.iter().map(StreamRay::hit).collect()
}

#[test]
fn hits_are_the_first_change_of_sign_before_the_triangles() {
    let (scene, rays) = (mixed(), rays());
    let tracer = tracer_over("", &scene, Level::default());
    let mut missed = 0;
    for (ray, hit) in rays.iter().zip(closest(&tracer, &rays)) {
        let end = if hit.is_hit() { hit.t } else { 3.0 };
        for instance in [0, 1, 3] {
            let start = field(&scene, instance, ray, 0.0).expect("implicit") >= 0.0;
            let before = end * (1.0 - 1e-4);
            let changes = (0..400).any(|i| {
                let there = field(&scene, instance, ray, before * i as f32 / 399.0).expect("implicit");
                (there >= 0.0) != start
            });
            missed += usize::from(changes);
            if instance == hit.instance {
                let (a, b) = (hit.t * (1.0 - 1e-5), hit.t * (1.0 + 1e-5));
                let [a, b] = [a, b].map(|t| field(&scene, instance, ray, t).expect("implicit") >= 0.0);
                assert!(a == start, "{ray:?} {hit:?}");
                // A grazing ray may cross twice at once.
                missed += usize::from(a == b);
            }
        }
    }
    assert!(missed <= 4, "{missed} of {}", rays.len());
}

#[test]
fn the_front_one_hides_the_other() {
    let wall = |z: f32| soup([[Vec3::new(-9.0, -9.0, z), Vec3::new(9.0, -9.0, z), Vec3::new(0.0, 9.0, z)]]);
    let ray = Ray::new(Vec3::new(0.1, 0.0, 5.0), Vec3::NEG_Z);
    for (z, instance) in [(2.0, 1), (-2.0, 0)] {
        let scene =
            scene(vec![(implicit(balls()), vec![Affine3::IDENTITY]), (wall(z), vec![Affine3::IDENTITY])]);
        for (accel, level) in structures() {
            let hit = closest(&tracer_over(accel, &scene, level), &[ray])[0];
            assert_eq!((hit.instance, hit.prim), (instance, 0), "{accel}");
        }
    }
}

#[test]
fn limits_of_rays_hold() {
    let scene = scene(vec![(implicit(balls()), vec![Affine3::from_scale(Vec3::splat(2.0))])]);
    let tracer = tracer_over("", &scene, Level::default());
    let ray = Ray::new(Vec3::new(0.1, 0.0, 5.0), Vec3::NEG_Z * 0.5);
    let first = closest(&tracer, &[ray])[0];
    assert!(first.is_hit() && first.t > 6.0 && first.t < 10.0);
    let short = Ray { t_max: first.t.next_down(), ..ray };
    let exact = Ray { t_max: first.t, ..ray };
    let behind = Ray { t_min: first.t * 1.001, ..ray };
    let reversed = Ray { t_min: 9.0, t_max: 3.0, ..ray };
    let nowhere = Ray { direction: Vec3::ZERO, ..ray };
    let broken = Ray { direction: Vec3::new(f32::NAN, 0.0, -1.0), ..ray };
    let found = closest(&tracer, &[short, exact, behind, reversed, nowhere, broken]);
    assert_eq!((found[0], found[1]), (Hit::MISS, first));
    assert!(found[2].t > first.t * 1.01, "the way out");
    assert!(found[3..].iter().all(|hit| !hit.is_hit()));
}

/// Refuses hits before a distance.
struct Behind(f32);

impl HitFilter for Behind {
    fn accepts(&self, _ray: usize, hit: &Hit) -> bool {
        hit.t > self.0
    }
}

#[test]
fn filters_are_asked() {
    let scene = scene(vec![(implicit(balls()), vec![Affine3::IDENTITY])]);
    let ray = Ray::new(Vec3::new(0.1, 0.0, 5.0), Vec3::NEG_Z);
    for accel in ACCELS {
        let tracer = tracer_over(accel, &scene, Level::default());
        let first = closest(&tracer, &[ray])[0];
        let (mut hits, mut occluded) = ([Hit::MISS], [false]);
        tracer.closest(&[ray], &Behind(first.t), &mut hits);
        assert!(hits[0].t > first.t && hits[0].is_hit(), "the way out is the next");
        tracer.occluded(&[ray], &Behind(hits[0].t), &mut occluded);
        assert!(!occluded[0]);
        tracer.occluded(&[ray], &Behind(first.t), &mut occluded);
        assert!(occluded[0]);
    }
}
