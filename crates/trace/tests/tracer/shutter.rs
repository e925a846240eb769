//! Rays of an open shutter against brute force: every triangle at the place that it has at the ray's time, tested alone.

use crate::common::shapes::{closed_surface, random_soup, soup};
use crate::common::{Random, beams, closest, occluded, rays_at, tracer};
use crate::implicit::{balls, implicit, julia};
use crate::pose::{BALL, mixed};
use std::sync::Arc;
use vastlight_accel::ray::ScaledRay;
use vastlight_accel::triangle::intersect;
use vastlight_accel::wide::Block8;
use vastlight_math::glam::{DAffine3, Quat};
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::{Instance, MeshPose, Motion, Pose, Scene, SceneDesc, SceneError};
use vastlight_simd::{Kernel, Level, Simd8};
use vastlight_trace::{Hit, Layout, PoseError, TraceError, Tracer, TracerConfig, UpdateMethod};

/// The scene at each key, opened there anew.
struct Oracle {
    keys: Vec<Scene>,
}

impl Oracle {
    fn new(desc: impl Fn() -> SceneDesc, times: &[f32]) -> Self {
        let key = |time: &f32| Scene::new(desc().at(*time).expect("a moment")).expect("valid");
        Self { keys: times.iter().map(key).collect() }
    }

    /// Two keys and the later one's part.
    fn ends(&self, time: f32) -> (&Scene, &Scene, f32) {
        let along = time * (self.keys.len() - 1) as f32;
        let key = (along as usize).min(self.keys.len() - 2);
        (&self.keys[key], &self.keys[key + 1], along - key as f32)
    }

    /// Largest coordinate of a mesh at all keys, and the power of two that brings it near 1.
    fn extent(&self, mesh: usize) -> (f32, f32) {
        let all = self.keys.iter().flat_map(|scene| &scene.meshes()[mesh].positions);
        let extent = all.map(|p| p.abs().max_element()).fold(0.0, f32::max);
        let comfortable = (2.0_f32.powi(-20)..=2.0_f32.powi(20)).contains(&extent);
        let scale = if comfortable { 1.0 } else { 0.5_f32.powi(extent.log2().floor() as i32) };
        (extent * scale, scale)
    }

    fn closest(&self, ray: &Ray) -> Hit {
        Level::PORTABLE.dispatch(One { oracle: self, ray })
    }
}

/// All triangles, one after the other.
struct One<'a> {
    oracle: &'a Oracle,
    ray: &'a Ray,
}

impl Kernel for One<'_> {
    type Output = Hit;

    fn run<S: Simd8>(self, simd: S) -> Hit {
        let Self { oracle, ray } = self;
        let (a, b, part) = oracle.ends(ray.time);
        let between = |a: Vec3, b: Vec3| a * (1.0 - part) + b * part;
        let mut best = Hit::MISS;
        for instance in 0..a.instances().len() {
            let mesh = a.instances().mesh(instance) as usize;
            let maps = [a, b].map(|scene| scene.instances().map(instance));
            let is_placed = |map: &&Affine3| map.matrix3.determinant() != 0.0;
            if !maps.iter().all(is_placed) {
                continue;
            }
            let (extent, scale) = oracle.extent(mesh);
            // A map that stays is not blended.
            let map = if oracle.keys.iter().all(|scene| scene.instances().map(instance) == maps[0]) {
                *maps[0]
            } else {
                Affine3 {
                    matrix3: maps[0].matrix3 * (1.0 - part) + maps[1].matrix3 * part,
                    translation: between(maps[0].translation, maps[1].translation),
                }
            };
            let Some((origin, direction)) = to_mesh(&map, scale, ray) else { continue };
            let Some(scaled) = ScaledRay::new(origin, direction) else { continue };
            let Some((_, triangle_ray)) = scaled.for_triangles(extent) else { continue };
            let moves = oracle.keys.iter().any(|k| k.meshes()[mesh].positions != a.meshes()[mesh].positions);
            for prim in 0..a.meshes()[mesh].triangles.len() as u32 {
                let [p, q] = [a, b].map(|scene| scene.meshes()[mesh].corners(prim));
                let corners = std::array::from_fn(|i| if moves { between(p[i], q[i]) } else { p[i] });
                let block = Block8::new([(prim, corners.map(|p: Vec3| p * scale))]);
                let hits = intersect(simd, &block, &triangle_ray);
                let t = hits.t[0] * scaled.t_scale;
                let hit = Hit { t, u: hits.u[0], v: hits.v[0], instance: instance as u32, prim };
                let in_reach = t >= ray.t_min.max(0.0) && t <= ray.t_max;
                let is_first = (t, hit.instance, prim) < (best.t, best.instance, best.prim);
                if hits.lanes & 1 == 1 && in_reach && is_first {
                    best = hit;
                }
            }
        }
        best
    }
}

/// A world ray in the scaled space of a mesh, by the rule that tracers have.
fn to_mesh(map: &Affine3, scale: f32, ray: &Ray) -> Option<(Vec3, Vec3)> {
    if !(ray.origin.is_finite() && ray.direction.is_finite()) {
        return None;
    }
    let wide = DAffine3 { matrix3: map.matrix3.as_dmat3(), translation: map.translation.as_dvec3() };
    let inverse = wide.inverse();
    let row = |r: usize| {
        let row = inverse.matrix3.row(r);
        [row.x, row.y, row.z, inverse.translation[r]].map(|x| (x * f64::from(scale)) as f32)
    };
    let rows = [row(0), row(1), row(2)];
    if rows == [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]] {
        return Some((ray.origin, ray.direction));
    }
    let linear = |v: Vec3, [x, y, z, _]: [f32; 4]| x * v.x + y * v.y + z * v.z;
    let origin = rows.map(|row| linear(ray.origin, row) + row[3]);
    Some((origin.into(), rows.map(|row| linear(ray.direction, row)).into()))
}

fn poses(scene: &Scene, times: &[f32]) -> Vec<Pose> {
    let motion = scene.motion().expect("it moves").clone();
    times.iter().map(|&time| motion.pose(time).expect("a moment")).collect()
}

/// Rays alone and in beams, each with a time of its own.
fn rays(size: f32) -> Vec<Ray> {
    let mut random = Random(21);
    let mut rays = rays_at(&mut random, 600, Vec3::ZERO, size);
    rays.extend(rays_at(&mut random, 300, Vec3::ZERO, 2.0));
    rays.extend(beams(&mut random, &rays_at(&mut Random(5), 12, Vec3::ZERO, 1.5)));
    rays.iter_mut().enumerate().for_each(|(i, ray)| ray.time = if i % 50 == 0 { 0.0 } else { random.unit() });
    rays
}

fn check(name: &str, desc: impl Fn() -> SceneDesc, times: &[f32], size: f32) {
    let rays = rays(size);
    let oracle = Oracle::new(&desc, times);
    let expected: Vec<Hit> = rays.iter().map(|ray| oracle.closest(ray)).collect();
    let hits = expected.iter().filter(|hit| hit.is_hit()).count();
    assert!(hits > 200, "{name}: {hits} hits");
    let compare = |how: &str, tracer: &Tracer| {
        for (i, (found, expected)) in closest(tracer, &rays).iter().zip(&expected).enumerate() {
            assert_eq!(found, expected, "{name}, {how}, ray {i}: {:?}", rays[i]);
        }
        let free: Vec<bool> = expected.iter().map(Hit::is_hit).collect();
        assert!(occluded(tracer, &rays) == free, "{name}, {how}");
    };
    // Structures for a shutter that is open, at every level, with bundles and without.
    let mut open = Scene::new(desc()).expect("valid");
    let opening = poses(&open, times);
    open.open_shutter(opening).expect("fits");
    for (level, single_rays) in Level::available().into_iter().flat_map(|l| [(l, false), (l, true)]) {
        let config = TracerConfig { level: Some(level), single_rays, ..TracerConfig::default() };
        let tracer = Tracer::new(&open, &config).expect("built");
        compare(&format!("{}, single {single_rays}", level.name()), &tracer);
        let opened: Vec<Ray> = rays.iter().map(|ray| Ray { time: 0.0, ..*ray }).collect();
        assert!(closest(&tracer, &opened) != expected, "negative control: times matter");
    }
    // Structures that follow: after other moments, and back to a moment.
    for update in UpdateMethod::ALL {
        let mut scene = Scene::new(desc()).expect("valid");
        let config = TracerConfig { update, ..TracerConfig::default() };
        let mut tracer = Tracer::new(&scene, &config).expect("built");
        for moments in [&[0.3][..], times, &[1.0, 1.1], times] {
            let poses = poses(&scene, moments);
            tracer.open_shutter(&mut scene, poses).expect("fits");
            if moments.len() == times.len() && moments[0] == times[0] {
                compare(update.name(), &tracer);
            }
        }
        let pose = poses(&scene, &[2.0]).remove(0);
        tracer.pose(&mut scene, pose).expect("fits");
        let fresh = Scene::new(desc().at(2.0).expect("a moment")).expect("valid");
        let still = Tracer::new(&fresh, &TracerConfig::default()).expect("built");
        assert!(
            closest(&tracer, &rays) == closest(&still, &rays),
            "{name}, {update:?}: the shutter is closed"
        );
    }
}

#[test]
fn hits_are_those_of_brute_force_at_each_ray_s_time() {
    check("small steps", mixed, &[0.0, 0.1, 0.2, 0.3, 0.4], 3.0);
    // At 0.5 and 1.5 an instance is not to be seen.
    check("large steps", mixed, &[0.25, 0.5, 0.75], 3.0);
    // The instance turns by 2.5 between two keys, the ball changes by far.
    check("a turn", mixed, &[0.0, 2.5], 4.0);
    // Coordinates grow until they are scaled.
    check("growth", mixed, &[7.0, 8.0], 4e7);
}

/// A soup that spins, and balls that breathe: one stands, and others go on, mirrored or until they are.
#[derive(Debug)]
struct Spinning;

fn spinning() -> SceneDesc {
    let soup = random_soup(&mut Random(31), 60, 0.4, 1.0, Vec3::ZERO);
    let instance = |mesh| Instance { world_from_object: Affine3::IDENTITY, mesh, name: 0 };
    SceneDesc {
        meshes: vec![soup, closed_surface(6, 8, |_| 1.0)],
        instances: [0, 1, 0, 1, 1, 1].map(instance).to_vec(),
        motion: Some(Arc::new(Spinning)),
        ..SceneDesc::default()
    }
}

impl Motion for Spinning {
    fn duration(&self) -> f32 {
        1.0
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let spin = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 3.0 * time);
        let size = Vec3::new(1.0, 0.02, 1.0 + time);
        let squeezed = Affine3::from_scale_rotation_translation(size, spin, Vec3::new(0.3 * time, 0.0, 0.0));
        let scaled = |x: f32, at: Vec3| {
            Affine3::from_scale_rotation_translation(Vec3::new(x, 0.5, 0.7), spin.inverse(), at)
        };
        let ball = spinning_ball().iter().map(|p| *p * (0.5 + time * (1.0 + p.x))).collect();
        Ok(Pose {
            meshes: vec![MeshPose { mesh: 1, positions: ball, ..MeshPose::default() }],
            instances: vec![
                (0, squeezed),
                (1, Affine3::from_translation(Vec3::X * time)),
                (3, scaled(-0.4, Vec3::new(-0.8, 0.9 * time, 0.5))),
                (4, scaled(0.4 - time, Vec3::new(0.2, -1.0, time))),
            ],
            ..Pose::default()
        })
    }
}

fn spinning_ball() -> Vec<Vec3> {
    closed_surface(6, 8, |_| 1.0).positions
}

#[test]
fn squeezed_instances_turn_and_meshes_move_where_they_are_placed() {
    check("spinning", spinning, &[0.0, 0.25, 0.5, 0.75, 1.0], 1.5);
    check("half a turn", spinning, &[0.0, 1.04], 1.5);
}

/// Two implicit surfaces: one turns and is away for a while, one is mirrored and goes on.
#[derive(Debug)]
struct Rolling;

impl Rolling {
    const KEYS: usize = 6;

    fn maps(time: f32) -> [Affine3; 2] {
        let turned = Affine3::from_rotation_translation(Quat::from_rotation_y(2.0 * time), Vec3::X * time);
        let seen = if time == 0.6 { 0.0 } else { 1.0 };
        let mirrored = Affine3::from_scale(Vec3::new(-1.5, 0.5, 1.0));
        [
            turned * Affine3::from_scale(Vec3::splat(seen)),
            Affine3::from_translation(Vec3::new(0.0, 1.0 - time, 0.5 * time)) * mirrored,
        ]
    }

    fn key(key: usize) -> f32 {
        key as f32 / (Self::KEYS - 1) as f32
    }
}

fn rolling(maps: [Affine3; 2]) -> SceneDesc {
    let wall = soup([[Vec3::new(-9.0, -9.0, -1.5), Vec3::new(9.0, -9.0, -1.5), Vec3::new(0.0, 9.0, -1.5)]]);
    let places = [maps[0], maps[1], Affine3::from_translation(Vec3::Y * 1.5), Affine3::IDENTITY];
    let instance = |(world_from_object, mesh)| Instance { world_from_object, mesh, name: 0 };
    SceneDesc {
        meshes: vec![implicit(balls()), implicit(julia()), wall],
        instances: places.into_iter().zip([0, 0, 1, 2]).map(instance).collect(),
        ..SceneDesc::default()
    }
}

impl Motion for Rolling {
    fn duration(&self) -> f32 {
        1.0
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        Ok(Pose { instances: (0..).zip(Self::maps(time)).collect(), ..Pose::default() })
    }
}

#[test]
fn implicit_surfaces_are_where_they_are_at_each_ray_s_time() {
    let desc = || SceneDesc { motion: Some(Arc::new(Rolling)), ..rolling(Rolling::maps(0.0)) };
    let mut scene = Scene::new(desc()).expect("valid");
    let mut following = Tracer::new(&scene, &TracerConfig::default()).expect("built");
    let times: Vec<f32> = (0..Rolling::KEYS).map(Rolling::key).collect();
    let opening = poses(&scene, &times);
    following.open_shutter(&mut scene, opening).expect("fits");
    let anew = Tracer::new(&scene, &TracerConfig::default()).expect("built");
    let mut counts = [0; 4];
    for time in [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0] {
        let along = time * (Rolling::KEYS - 1) as f32;
        let key = (along as usize).min(Rolling::KEYS - 2);
        let part = along - key as f32;
        let [a, b] = [key, key + 1].map(|key| Rolling::maps(Rolling::key(key)));
        let at = |i: usize| {
            let [a, b] = [&a[i], &b[i]];
            if a.matrix3.determinant() == 0.0 || b.matrix3.determinant() == 0.0 {
                // Far away.
                return Affine3::from_translation(Vec3::splat(1e5));
            }
            Affine3 {
                matrix3: a.matrix3 * (1.0 - part) + b.matrix3 * part,
                translation: a.translation * (1.0 - part) + b.translation * part,
            }
        };
        let still = Scene::new(rolling([at(0), at(1)])).expect("valid");
        let still = Tracer::new(&still, &TracerConfig::default()).expect("built");
        let mut rays = rays_at(&mut Random(5), 500, Vec3::ZERO, 2.0);
        rays.iter_mut().for_each(|ray| ray.time = time);
        let expected = closest(&still, &rays);
        for tracer in [&following, &anew] {
            assert_eq!(closest(tracer, &rays), expected, "{time}");
            assert_eq!(occluded(tracer, &rays), occluded(&still, &rays), "{time}");
        }
        for (hit, ray) in expected.iter().zip(&rays).filter(|(hit, _)| hit.is_hit()) {
            let (point, world) = (ray.origin + ray.direction * hit.t, anew.world());
            assert!(point.cmpge(world.min - 1e-3).all() && point.cmple(world.max + 1e-3).all());
            counts[hit.instance as usize] += 1;
        }
        assert_eq!(expected.iter().any(|hit| hit.instance == 0), !(key == 2 || key == 3), "{time}");
    }
    assert!(counts.iter().all(|&count| count > 50), "{counts:?}");
}

#[test]
fn what_a_shutter_left_is_found_where_it_was_when_other_things_move() {
    let rays = rays(3.0);
    let place = |x: f32| Pose {
        instances: vec![(1, Affine3::from_translation(Vec3::new(x, 0.3, 0.0)))],
        ..Pose::default()
    };
    for update in UpdateMethod::ALL {
        for next in [vec![Pose::default()], vec![place(0.5)], vec![place(0.5), place(0.9)]] {
            let mut scene = Scene::new(mixed()).expect("valid");
            let config = TracerConfig { update, ..TracerConfig::default() };
            let mut tracer = Tracer::new(&scene, &config).expect("built");
            let opening = poses(&scene, &[0.1, 0.4]);
            tracer.open_shutter(&mut scene, opening).expect("fits");
            let open = closest(&tracer, &rays);
            let moments = next.len();
            tracer.open_shutter(&mut scene, next).expect("fits");
            let anew = Tracer::new(&scene, &TracerConfig::default()).expect("built");
            let expected = closest(&anew, &rays);
            assert!(expected == closest(&tracer, &rays), "{update:?}, {moments} moments");
            assert!(expected != open, "negative control");
        }
    }
}

#[derive(Debug)]
struct Breathing;

impl Motion for Breathing {
    fn duration(&self) -> f32 {
        1.0
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let radius = |p: &Vec3| 1.0 + 0.3 * (p.x * 9.0 + 5.0 * time).sin() * (p.y * 7.0).cos();
        let positions = closed_surface(24, 48, |_| 1.0).positions.iter().map(|p| *p * radius(p)).collect();
        let turned = Affine3::from_rotation_y(0.4 * time) * Affine3::from_scale(Vec3::new(3.0, 0.4, 1.0));
        let mesh = MeshPose { positions, ..MeshPose::default() };
        Ok(Pose { meshes: vec![mesh], instances: vec![(0, turned)], ..Pose::default() })
    }
}

#[test]
fn no_ray_gets_through_a_closed_mesh_that_moves() {
    let desc = SceneDesc {
        meshes: vec![closed_surface(24, 48, |_| 1.0)],
        instances: vec![Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 }],
        motion: Some(Arc::new(Breathing)),
        ..SceneDesc::default()
    };
    let mut scene = Scene::new(desc).expect("valid");
    let opening = poses(&scene, &[0.0, 0.5, 1.0]);
    scene.open_shutter(opening).expect("fits");
    let shutter = Arc::clone(scene.shutter().expect("open"));
    let keys = shutter.mesh(0).expect("it moves");
    let mut random = Random(2);
    let ray = |i: usize| {
        let time = random.unit();
        let between = shutter.between(time);
        let [a, b] = between.ends(keys).expect("keys");
        let map = shutter.instance(0).and_then(|keys| keys.at(&between)).expect("seen");
        let corners = scene.meshes()[0].triangles[random.below(1000)];
        let [p, q, _] = corners.map(|v| between.blend(a.positions[v as usize], b.positions[v as usize]));
        let target = if i.is_multiple_of(2) { p } else { p + (q - p) * random.unit() };
        let (origin, target) = (map.transform_point3(random.point() * 0.1), map.transform_point3(target));
        Ray { time, ..Ray::new(origin, target - origin) }
    };
    let rays: Vec<Ray> = (0..200_000).map(ray).collect();
    for level in Level::available() {
        let hits = closest(&tracer(&scene, level), &rays);
        assert_eq!(hits.iter().filter(|hit| !hit.is_hit()).count(), 0, "{}", level.name());
    }
}

#[test]
fn structures_that_know_but_one_moment_refuse_an_open_shutter() {
    let mut open = Scene::new(mixed()).expect("valid");
    let opening = poses(&open, &[0.0, 0.1]);
    open.open_shutter(opening).expect("fits");
    assert!(open.shutter().expect("open").mesh(BALL).is_some());
    let kd = TracerConfig { accel: "kd-threaded".into(), ..TracerConfig::default() };
    let compact = TracerConfig { layout: Layout::Compact, ..TracerConfig::default() };
    for config in [kd, compact] {
        assert!(matches!(Tracer::new(&open, &config), Err(TraceError::Shutter(_))), "{config:?}");
        let mut scene = Scene::new(mixed()).expect("valid");
        let mut tracer = Tracer::new(&scene, &config).expect("built");
        let poses = poses(&scene, &[0.0, 0.1]);
        let opened = tracer.open_shutter(&mut scene, poses);
        assert!(matches!(opened, Err(PoseError::Trace(TraceError::Shutter(_)))));
    }
    let mut other = poses(&open, &[0.0, 0.1]);
    other[1].instances.pop();
    assert!(open.open_shutter(other).expect_err("other things").to_string().contains("different"));
}
