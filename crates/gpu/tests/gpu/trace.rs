//! Hits on the software adapter against the CPU's: 12,000 rays a scene in a test run, a million with `VASTLIGHT_SOAK` in the
//! environment.

use crate::common::software;
use vastlight_gpu::trace::{
    DeviceTracer, MAX_RAYS, hits_of_words, ray_words, record_closest, record_occluded,
};
use vastlight_gpu::{DeviceChoice, Executor, GpuError, Recording};
use vastlight_math::rng::{hash_words, unit_f32};
use vastlight_math::{Affine3, Mat3, Quat, Ray, Vec3};
use vastlight_scene::{Instance, Mesh, Scene, SceneDesc};
use vastlight_trace::{AcceptAll, Hit, Layout, Tracer, TracerConfig};

/// Numbers in [0, 1).
pub(crate) fn noise(i: usize, salt: u32) -> f32 {
    unit_f32((hash_words(&[i as u32, salt]) >> 32) as u32)
}

/// A point in the cube from -1 to 1, on a lattice.
fn point(i: usize, salt: u32) -> Vec3 {
    let axis = |k| (noise(i, salt + k) * 1_048_576.0).floor() / 524_288.0 - 1.0;
    Vec3::new(axis(0), axis(1), axis(2))
}

/// Separate triangles of this size, a power of two, by axis.
pub(crate) fn soup(count: usize, size: Vec3) -> Mesh {
    let corner = |i: usize| point(i / 3, 1) + point(i, 10) * size;
    let triangle = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
    Mesh {
        positions: (0..3 * count).map(corner).collect(),
        triangles: (0..count as u32).map(triangle).collect(),
        ..Mesh::default()
    }
}

/// A bumpy sheet between -1 and 1 whose triangles share vertices; its rays go through edges and corners too.
pub(crate) fn sheet(side: usize) -> Mesh {
    let at = |i: usize| i as f32 / 32.0 - 1.0;
    let height = |i: usize| ((i % side * 7 + i / side * 13) % 32) as f32 / 256.0;
    let quad = |i: usize| {
        let a = (i / (side - 1) * side + i % (side - 1)) as u32;
        let (b, c) = (a + 1, a + side as u32);
        [[a, b, c], [b, c + 1, c]]
    };
    Mesh {
        positions: (0..side * side).map(|i| Vec3::new(at(i % side), height(i), at(i / side))).collect(),
        triangles: (0..(side - 1) * (side - 1)).flat_map(quad).collect(),
        ..Mesh::default()
    }
}

fn scene(meshes: Vec<Mesh>, places: &[(u32, Affine3)]) -> Scene {
    let instance =
        |&(mesh, world_from_object): &(u32, Affine3)| Instance { world_from_object, mesh, name: 0 };
    let instances = places.iter().map(instance).collect();
    Scene::new(SceneDesc { meshes, instances, names: vec![String::new()], ..SceneDesc::default() })
        .expect("a scene")
}

pub(crate) fn alone(mesh: Mesh) -> Scene {
    scene(vec![mesh], &[(0, Affine3::IDENTITY)])
}

/// Many instances: turned, stretched, mirrored, and some in the same place.
pub(crate) fn crowd() -> Scene {
    let place = |i: usize| {
        let turn = Quat::from_axis_angle(point(i, 30).normalize(), noise(i, 31) * 6.0);
        let size = Vec3::new(0.1 + noise(i, 32), 0.3, if i.is_multiple_of(3) { -0.4 } else { 0.4 });
        let linear = Mat3::from_quat(turn) * Mat3::from_diagonal(size * 0.5);
        let at = point(i - i % 7 / 6, 40) * 2.0;
        ((i % 2) as u32, Affine3::from_mat3_translation(linear, at))
    };
    let mut places: Vec<_> = (0..80).map(place).collect();
    places.extend([(0, Affine3::IDENTITY), (0, Affine3::IDENTITY), (1, Affine3::IDENTITY)]);
    scene(vec![sheet(65), soup(300, Vec3::splat(0.25))], &places)
}

pub(crate) fn tracer(scene: &Scene, layout: Layout) -> Tracer {
    Tracer::new(scene, &TracerConfig { layout, ..TracerConfig::default() }).expect("built")
}

fn on_device(executor: &mut Executor, scene: &Scene) -> DeviceTracer {
    DeviceTracer::new(executor, &tracer(scene, Layout::Compact)).expect("fits")
}

pub(crate) fn closest(executor: &mut Executor, tracer: &DeviceTracer, rays: &[Ray]) -> Vec<Hit> {
    let mut recording = Recording::new();
    let count = rays.len() as u32;
    let input = recording.upload("rays", &rays.iter().map(ray_words).collect::<Vec<_>>());
    let hits = record_closest(&mut recording, tracer, input, count).expect("few");
    let hits = recording.download(hits, 5 * u64::from(count));
    hits_of_words(&executor.run(&recording).expect("runs").words(hits))
}

fn occluded(executor: &mut Executor, tracer: &DeviceTracer, rays: &[Ray]) -> Vec<bool> {
    let mut recording = Recording::new();
    let count = rays.len() as u32;
    let input = recording.upload("rays", &rays.iter().map(ray_words).collect::<Vec<_>>());
    let blocked = record_occluded(&mut recording, tracer, input, count).expect("few");
    let blocked = recording.download(blocked, u64::from(count));
    executor.run(&recording).expect("runs").words(blocked).iter().map(|&word| word == 1).collect()
}

pub(crate) fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, t_min: 0.0, direction, t_max: f32::INFINITY, time: 0.0 }
}

/// Rays from all over, into all directions, some along axes through lattice points, some short.
pub(crate) fn rays(count: usize) -> Vec<Ray> {
    let ray = |i: usize| match i % 8 {
        0 => ray(Vec3::new(point(i, 3).x, 3.0, point(i, 3).z), -Vec3::Y),
        1 => ray(Vec3::new((i % 64) as f32 / 32.0 - 1.0, 2.0, (i % 61) as f32 / 32.0 - 1.0), -Vec3::Y),
        2 => ray(point(i, 5) * 50.0, -point(i, 5)),
        3 => Ray { t_min: 0.5, t_max: 1.0 + noise(i, 6), ..ray(point(i, 7), point(i, 9)) },
        _ => ray(point(i, 7) * 2.0, point(i, 9)),
    };
    (0..count).map(ray).collect()
}

/// Whether two hits are the same, up to rounding.
pub(crate) fn same(expected: &Hit, found: &Hit) -> bool {
    let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * a.abs().max(1e-2);
    (expected.instance, expected.prim) == (found.instance, found.prim)
        && (!expected.is_hit() || near(expected.t, found.t) && (expected.u - found.u).abs() < 1e-3)
}

/// How many answers differ, closest or occlusion, and how many rays hit.
fn differences(executor: &mut Executor, scene: &Scene, seen: &Scene, rays: &[Ray]) -> (usize, usize) {
    let device = on_device(executor, scene);
    let found = closest(executor, &device, rays);
    let blocked = occluded(executor, &device, rays);
    device.release(executor);
    let mut expected = vec![Hit::MISS; rays.len()];
    tracer(seen, Layout::Wide).closest(rays, &AcceptAll, &mut expected);
    let (mut differ, mut met) = (0, 0);
    for ((expected, found), &blocked) in expected.iter().zip(&found).zip(&blocked) {
        differ += usize::from(!same(expected, found)) + usize::from(blocked != expected.is_hit());
        met += usize::from(expected.is_hit());
    }
    (differ, met)
}

fn count() -> usize {
    if std::env::var_os("VASTLIGHT_SOAK").is_some() { 1_000_000 } else { 12_000 }
}

#[test]
fn hits_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (scene, least) in [
        (alone(soup(1, Vec3::ONE)), 20),
        (alone(soup(9, Vec3::ONE)), 100),
        (alone(soup(3000, Vec3::splat(0.0625))), 500),
        (alone(sheet(65)), 1500),
        (crowd(), 4000),
    ] {
        let (differ, met) = differences(&mut executor, &scene, &scene, &rays(count()));
        assert!(met >= least, "{met} hits");
        assert_eq!(differ, 0, "{} instances", scene.instances().len());
    }
}

/// Rays almost in the planes of the triangles at which they aim.
pub(crate) fn edge_on(scene: &Scene) -> Vec<Ray> {
    let mesh = &scene.meshes()[0];
    let aimed = |i: usize| {
        let [a, b, c] = mesh.corners((i % 400) as u32);
        let (along, normal) = ((b - a).normalize(), (b - a).cross(c - a).normalize());
        let target = a + (b - a) * 0.5 * noise(i, 3) + (c - a) * 0.5 * noise(i, 4);
        let direction = along + normal * [1e-3, 1e-4, 1e-5, 1e-6][i / 400 % 4];
        ray(target - direction * noise(i, 5), direction)
    };
    (0..count()).map(aimed).collect()
}

#[test]
fn triangles_seen_edge_on_are_settled_as_on_the_cpu() {
    let Some(mut executor) = software() else { return };
    let scene = alone(soup(400, Vec3::ONE));
    let rays = edge_on(&scene);
    let (differ, met) = differences(&mut executor, &scene, &scene, &rays);
    assert!(met > 10_000, "{met}");
    assert_eq!(differ, 0);
}

#[test]
fn a_scene_that_differs_is_found() {
    let Some(mut executor) = software() else { return };
    let mut other = sheet(65);
    other.positions[1000].y += 1.0 / 256.0;
    let (differ, _) = differences(&mut executor, &alone(sheet(65)), &alone(other), &rays(3000));
    assert!(differ > 0);
}

#[test]
fn rays_that_cannot_hit_and_scenes_of_nothing_are_misses() {
    let Some(mut executor) = software() else { return };
    let nothing = on_device(&mut executor, &alone(Mesh::default()));
    let down = ray(Vec3::Y * 2.0, -Vec3::Y);
    assert_eq!(closest(&mut executor, &nothing, &[down]), [Hit::MISS]);
    let sheet = on_device(&mut executor, &alone(sheet(65)));
    let odd = [Vec3::NAN, Vec3::INFINITY, Vec3::ZERO, Vec3::splat(f32::NEG_INFINITY)];
    let odd: Vec<Ray> = odd.iter().map(|&direction| ray(Vec3::Y * 2.0, direction)).collect();
    assert_eq!(closest(&mut executor, &sheet, &odd), [Hit::MISS; 4]);
    assert_eq!(occluded(&mut executor, &sheet, &odd), [false; 4]);
    // The sheet is nearer than 2 and further away than 1.
    let near = [1.0, 2.5].map(|t_max| Ray { t_max, ..ray(Vec3::new(0.1, 2.0, 0.1), -Vec3::Y) });
    let hits = closest(&mut executor, &sheet, &near);
    assert!(!hits[0].is_hit() && hits[1].is_hit());
    assert_eq!(closest(&mut executor, &sheet, &[]), []);
}

/// Of directions whose other components are as long, shorter or all but nothing, through turned and stretched instances.
#[test]
fn directions_of_any_length_hit_at_the_same_place() {
    let Some(mut executor) = software() else { return };
    let scene = crowd();
    let device = on_device(&mut executor, &scene);
    let flatter =
        [Vec3::ONE, Vec3::new(1.0, 1e-3, 1.0), Vec3::new(1e-9, 1.0, 1e-20), Vec3::new(1.0, 0.0, 1e-5)];
    let direction = |i: usize| point(i, 9) * flatter[i % 4];
    let plain: Vec<Ray> = (0..1000).map(|i| ray(point(i, 7) * 2.0, direction(i))).collect();
    let mut expected = vec![Hit::MISS; plain.len()];
    tracer(&scene, Layout::Wide).closest(&plain, &AcceptAll, &mut expected);
    assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 200);
    for exponent in [-100, -60, -21, -1, 1, 21, 60, 100] {
        let length = 2.0_f32.powi(exponent);
        let rays: Vec<Ray> =
            plain.iter().map(|given| Ray { direction: given.direction * length, ..*given }).collect();
        let found = closest(&mut executor, &device, &rays);
        let rescaled = found.iter().map(|hit| Hit { t: hit.t * length, ..*hit });
        let differ = expected.iter().zip(rescaled).filter(|(a, b)| !same(a, b)).count();
        assert_eq!(differ, 0, "2^{exponent}");
    }
    device.release(&mut executor);
}

#[test]
fn what_does_not_fit_is_an_error_and_leaves_nothing() {
    let Some(shared) = software() else { return };
    drop(shared);
    let scene = alone(sheet(65));
    let compact = tracer(&scene, Layout::Compact);
    let mut small = Executor::open(DeviceChoice::Software, Some(40_960)).expect("as before");
    let binding = small.adapter().limits.binding_bytes;
    let full = DeviceTracer::new(&mut small, &compact).expect_err("more than the budget");
    assert!(matches!(full, GpuError::OutOfMemory { .. }), "{full}");
    let all_of_it = small.allocate("all of the budget", 40_960).expect("nothing else stays");
    small.release(all_of_it);

    let other = DeviceTracer::new(&mut small, &tracer(&scene, Layout::Wide)).expect_err("no pages");
    assert!(matches!(other, GpuError::Scene { .. }), "{other}");
    let words = vec![0; binding as usize / 4 + 1];
    let wide = small.keep_all([("tree", &words[..])]).expect_err("more than a binding");
    assert!(matches!(wide, GpuError::Limit { limit, .. } if limit == binding), "{wide}");
}

#[test]
fn batches_beyond_one_dispatch_are_refused() {
    let Some(mut executor) = software() else { return };
    let tracer = on_device(&mut executor, &alone(soup(1, Vec3::ONE)));
    let mut recording = Recording::new();
    let rays = recording.buffer("rays", 8);
    let error = record_closest(&mut recording, &tracer, rays, MAX_RAYS + 1).expect_err("too many");
    assert!(matches!(error, GpuError::Limit { .. }), "{error}");
}
