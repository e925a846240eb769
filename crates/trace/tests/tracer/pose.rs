//! Tracers that follow a scene through time against tracers that are built for each moment.

use crate::common::shapes::{closed_surface, random_soup, soup};
use crate::common::{ACCELS, Random, closest, occluded, rays_at, tracer_over};
use std::sync::Arc;
use vastlight_accel::ClusterConfig;
use vastlight_accel::cluster::Heuristic;
use vastlight_math::glam::Quat;
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::{Instance, Mesh, MeshPose, Motion, Pose, Scene, SceneDesc, SceneError};
use vastlight_simd::Level;
use vastlight_trace::{Hit, Tracer, TracerConfig, UpdateMethod};

/// A ball that pulsates and grows very large, a soup that stands still, walls, and instances that turn, vanish and come again.
#[derive(Debug)]
struct Mixed {
    ball: Vec<Vec3>,
}

pub(crate) const BALL: u32 = 1;

fn parts() -> [Mesh; 3] {
    let still = random_soup(&mut Random(3), 200, 0.2, 1.0, Vec3::ZERO);
    let wall = soup([[Vec3::new(-9.0, -9.0, -3.0), Vec3::new(9.0, -9.0, -3.0), Vec3::new(0.0, 9.0, -3.0)]]);
    [still, closed_surface(9, 12, |_| 0.7), wall]
}

pub(crate) fn mixed() -> SceneDesc {
    let meshes = parts().to_vec();
    let place = |mesh, at: Vec3| Instance { world_from_object: Affine3::from_translation(at), mesh, name: 0 };
    let instances =
        [(2, Vec3::ZERO), (0, Vec3::X), (1, Vec3::Y), (0, Vec3::NEG_X), (1, Vec3::ZERO), (0, Vec3::Z)];
    SceneDesc {
        instances: instances.map(|(mesh, at)| place(mesh, at)).to_vec(),
        motion: Some(Arc::new(Mixed { ball: meshes[BALL as usize].positions.clone() })),
        meshes,
        ..SceneDesc::default()
    }
}

impl Motion for Mixed {
    fn duration(&self) -> f32 {
        10.0
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        // From 8 on it is so large that its coordinates are scaled.
        let size = if time >= 8.0 { 3e7 } else { 1.0 + 0.5 * (time * 0.7).sin() };
        let positions = self.ball.iter().map(|p| *p * size * (1.0 + 0.3 * (time * p.x).cos())).collect();
        let turned = Affine3::from_rotation_translation(Quat::from_rotation_z(time), Vec3::Y * time);
        let seen = if time.fract() == 0.5 { 0.0 } else { 1.0 };
        let scaled = Affine3::from_scale(Vec3::splat(seen));
        Ok(Pose {
            meshes: vec![MeshPose { mesh: BALL, positions, ..MeshPose::default() }],
            instances: vec![(3, turned), (5, scaled)],
            ..Pose::default()
        })
    }
}

fn rays(time: f32) -> Vec<Ray> {
    let size = if time >= 8.0 { 4e7 } else { 3.0 };
    let mut rays = rays_at(&mut Random(9), 1500, Vec3::ZERO, size);
    rays.extend(rays_at(&mut Random(10), 500, Vec3::ZERO, 2.0));
    rays
}

fn answers(tracer: &Tracer, time: f32) -> (Vec<Hit>, Vec<bool>) {
    let rays = rays(time);
    (closest(tracer, &rays), occluded(tracer, &rays))
}

fn fresh(time: f32) -> Tracer {
    let scene = Scene::new(mixed().at(time).expect("a moment")).expect("valid");
    Tracer::new(&scene, &TracerConfig::default()).expect("built")
}

#[test]
fn a_tracer_that_follows_gives_the_hits_of_one_built_anew() {
    let by_method = |update| TracerConfig { update, ..TracerConfig::default() };
    let over_clusters = |heuristic| {
        let config = ClusterConfig { heuristic, max_count: 20, max_size: 20, ..ClusterConfig::DEFAULT };
        TracerConfig { clusters: Some(config), ..by_method(UpdateMethod::Rebuild) }
    };
    let configs = UpdateMethod::ALL.map(by_method).into_iter().chain(Heuristic::ALL.map(over_clusters));
    let configured = |config: TracerConfig| {
        let what = format!("{config:?}");
        let make = move |scene: &Scene| Tracer::new(scene, &config).expect("built");
        (what, Box::new(make) as Box<dyn Fn(&Scene) -> Tracer>)
    };
    let over = |accel: &&'static str| {
        let accel = *accel;
        let make = move |scene: &Scene| tracer_over(accel, scene, Level::detect());
        (accel.to_owned(), Box::new(make) as Box<dyn Fn(&Scene) -> Tracer>)
    };
    for (what, make) in configs.map(configured).chain(ACCELS[1..].iter().map(over)) {
        let mut scene = Scene::new(mixed()).expect("valid");
        let mut tracer = make(&scene);
        let motion = Arc::clone(scene.motion().expect("it moves"));
        for time in [0.25, 1.0, 1.5, 7.75, 8.0, 8.5, 3.25, 2.5, 2.0, 0.75, 0.1, 0.2, 0.3, 0.4, 0.6, 0.0] {
            let pose = motion.pose(time).expect("a moment");
            let report = tracer.pose(&mut scene, pose).expect("fits");
            assert_eq!(report.change.meshes, [BALL]);
            let expected = answers(&fresh(time), time);
            assert_eq!(answers(&tracer, time), expected, "{what} at {time}");
            let hits = expected.0.iter().filter(|hit| hit.is_hit()).count();
            assert!((50..2000).contains(&hits), "{hits} hits at {time}");
        }
        assert_eq!(tracer.clusters(BALL).is_some(), what.contains("heuristic"), "{what}");
        assert_ne!(answers(&tracer, 0.25), answers(&fresh(0.25), 0.25), "another moment has other hits");
    }
}

#[test]
fn a_pose_that_does_not_fit_leaves_scene_and_tracer_as_they_were() {
    let mut scene = Scene::new(mixed()).expect("valid");
    let mut tracer = tracer_over("", &scene, Level::detect());
    let before = answers(&tracer, 0.0);
    let wrong = Pose { instances: vec![(0, Affine3::IDENTITY), (6, Affine3::IDENTITY)], ..Pose::default() };
    let error = tracer.pose(&mut scene, wrong).expect_err("does not fit");
    assert!(error.to_string().contains("instance 6"), "{error}");
    assert_eq!(answers(&tracer, 0.0), before);
    let nothing = tracer.pose(&mut scene, Pose::default()).expect("fits");
    assert_eq!(nothing.change, Default::default());
    assert_eq!(answers(&tracer, 0.0), before);
}

/// A row of triangles of which some go up, each in a part of its own of what is kept together.
#[test]
fn movers_among_many_that_stand_still_are_found() {
    let movers = [3_u32, 700, 1500, 1999];
    let row = || {
        let triangle = soup([[Vec3::ZERO, Vec3::X * 0.9, Vec3::Y]]);
        let places = (0..2000).map(|i| Affine3::from_translation(Vec3::X * i as f32)).collect();
        crate::common::scene(vec![(triangle, places)])
    };
    let pose = |movers: [u32; 4], height: f32| Pose {
        instances: movers.map(|i| (i, Affine3::from_translation(Vec3::new(i as f32, height, 0.0)))).to_vec(),
        ..Pose::default()
    };
    let above = |height: f32| -> Vec<Ray> {
        let at = |i: u32| Ray::new(Vec3::new(i as f32 + 0.2, height + 0.2, 5.0), Vec3::NEG_Z);
        (0..2000).map(at).collect()
    };
    let mut scene = row();
    let mut tracer = tracer_over("", &scene, Level::detect());
    for height in [10.0, 300.0, -7.0] {
        tracer.pose(&mut scene, pose(movers, height)).expect("fits");
        let hit: Vec<u32> =
            closest(&tracer, &above(height)).iter().filter(|h| h.is_hit()).map(|h| h.instance).collect();
        assert_eq!(hit, movers, "{height}");
        let left = closest(&tracer, &above(0.0)).iter().filter(|h| h.is_hit()).count();
        assert_eq!(left, 2000 - movers.len(), "{height}");
        let mut fresh = row();
        fresh.pose(pose(movers, height)).expect("fits");
        let fresh = tracer_over("", &fresh, Level::detect());
        assert_eq!(tracer.world(), fresh.world());
    }
    // Others move, and those that did stand where they are.
    let others = [4, 701, 1501, 1998];
    tracer.pose(&mut scene, pose(others, 20.0)).expect("fits");
    for (height, expected) in [(20.0, others), (-7.0, movers)] {
        let hits = closest(&tracer, &above(height));
        let hit: Vec<u32> = hits.iter().filter(|h| h.is_hit()).map(|h| h.instance).collect();
        assert_eq!(hit, expected, "{height}");
    }
}
