//! Pictures of an open shutter: against closed forms, and against the mean of many moments.

mod common;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use vastlight::math::{Affine3, Quat, Rng, Vec3};
use vastlight::scene::{
    Camera, Environment, ImplicitShape, Instance, Material, Mesh, MeshPose, Metaball, Metaballs, Motion,
    Part, Pose, Projection, Scene, SceneDesc, SceneError,
};
use vastlight::trace::TracerConfig;
use vastlight::transport::photon::PhotonSettings;
use vastlight::transport::{Integrator, PixelFilter, RenderSettings};
use vastlight::{
    CameraChoice, Control, Device, Error, Exposure, LoadOptions, RenderRequest, Rendered, Session, open,
};

/// Upright, and seen from where z grows.
fn square(name: &str, material: u32, cells: u32) -> Mesh {
    common::square(name, material, cells, |x, y| Vec3::new(x, y, 0.0))
}

fn place(mesh: u32, world_from_object: Affine3) -> Instance {
    Instance { world_from_object, mesh, name: 0 }
}

fn planes(rendered: &Rendered) -> Vec<Vec<f32>> {
    assert_eq!(rendered.stats.non_finite, 0);
    let picture = rendered.develop();
    picture.rgb().expect("colours").iter().map(|plane| plane.to_vec()).collect()
}

fn session(desc: SceneDesc) -> Session {
    Session::new(Scene::new(desc).expect("valid").into(), "a scene", &LoadOptions::default())
}

/// The request of a picture of what a session has open.
fn request(session: &Session, size: [u32; 2], spp: u32, seed: u32) -> RenderRequest {
    let (scene, choice) = (&session.open().scene, CameraChoice::default());
    let camera = choice.resolve(scene).expect("a camera");
    let camera_keys = choice.resolve_keys(scene).expect("cameras");
    let filter = PixelFilter::Box;
    let settings = RenderSettings::new(camera, size[0], size[1]);
    RenderRequest::new(RenderSettings { camera_keys, seed, filter, ..settings }, spp)
}

fn render(session: &mut Session, request: &RenderRequest) -> Result<Rendered, Error> {
    session.render(request, &Control::new(&AtomicBool::new(false), &|_| {}))
}

/// What goes to the right by 2 a second: a shining square by its instance or by its vertices, or the camera to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mover {
    Instance,
    Vertices,
    Camera,
}

#[derive(Debug)]
struct Sliding(Mover);

const LEFT: f32 = -3.0;

fn camera(x: f32) -> Camera {
    let look = Camera::look_at("eye", Vec3::new(x, 0.0, 5.0), Vec3::new(x, 0.0, 0.0), 0.7);
    Camera { projection: Projection::Orthographic { half_height: 0.5 }, ..look }
}

fn sliding(mover: Mover) -> SceneDesc {
    SceneDesc {
        meshes: vec![square("square", 0, 2)],
        instances: vec![place(0, Affine3::from_translation(Vec3::X * LEFT))],
        materials: vec![Material::emitter("light", Vec3::ONE, true)],
        // Without one, so small a lamp would get a sky.
        environment: Some(Environment::Constant(Vec3::ZERO)),
        cameras: vec![camera(0.0)],
        motion: Some(Arc::new(Sliding(mover))),
        ..SceneDesc::default()
    }
}

impl Motion for Sliding {
    fn duration(&self) -> f32 {
        1.0
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let x = 2.0 * time;
        let mut pose = Pose::default();
        match self.0 {
            Mover::Instance => pose.instances.push((0, Affine3::from_translation(Vec3::X * (LEFT + x)))),
            Mover::Vertices => {
                let moved = square("", 0, 2).positions.iter().map(|p| *p + Vec3::X * x).collect();
                pose.meshes.push(MeshPose { positions: moved, ..MeshPose::default() });
            }
            Mover::Camera => pose.cameras.push((0, camera(-x))),
        }
        Ok(pose)
    }
}

/// How much of the time a column of 64 from x = -4 to 4 is covered, the square moving by `way` while the shutter is open.
fn ramp(column: usize, way: f32) -> f32 {
    let steps = 64;
    let covered = |i: i32| {
        let x = -4.0 + (column as f32 + (i as f32 + 0.5) / steps as f32) / 8.0;
        // The square covers x from LEFT - 1 + s to LEFT + 1 + s at s from 0 to the whole way.
        ((x - LEFT + 1.0).min(way) - (x - LEFT - 1.0).max(0.0)).max(0.0) / way
    };
    (0..steps).map(covered).sum::<f32>() / steps as f32
}

#[test]
fn a_square_that_slides_covers_a_ramp() {
    for mover in [Mover::Instance, Mover::Vertices, Mover::Camera] {
        let mut session = session(sliding(mover));
        session.expose(0.0, &Exposure { seconds: 1.5, keys: 4 }).expect("it moves");
        let mut request = request(&session, [64, 8], 256, 0);
        request.settings.max_depth = 1;
        let picture = planes(&render(&mut session, &request).expect("rendered"));
        let worst = |way: f32| {
            let column = |x: usize| (0..8).map(|y| picture[0][y * 64 + x]).sum::<f32>() / 8.0;
            (0..64).map(|x| (column(x) - ramp(x, way)).abs()).fold(0.0, f32::max)
        };
        // Two thousand samples a column: a deviation of at most 0.011 each.
        assert!(worst(3.0) < 0.04, "{mover:?}: {}", worst(3.0));
        assert!(worst(2.7) > 0.08, "{mover:?}, negative control: {}", worst(2.7));
    }
}

/// A floor that waves, a lamp and a vane that turn, and a camera that comes nearer: every kind of path.
#[derive(Debug)]
struct Stage;

fn stage() -> SceneDesc {
    let mut desc = SceneDesc {
        meshes: vec![square("floor", 0, 16), square("lamp", 1, 1), square("vane", 2, 1)],
        instances: vec![
            place(0, Affine3::IDENTITY),
            place(1, Affine3::IDENTITY),
            place(2, Affine3::IDENTITY),
        ],
        materials: vec![
            Material::diffuse("floor", Vec3::splat(0.7)),
            Material::emitter("lamp", Vec3::splat(6.0), true),
            Material::diffuse("vane", Vec3::new(0.8, 0.3, 0.1)),
        ],
        cameras: vec![camera(0.0)],
        motion: Some(Arc::new(Stage)),
        ..SceneDesc::default()
    };
    desc.apply(Stage.pose(0.0).expect("a moment")).expect("fits");
    desc
}

impl Motion for Stage {
    fn duration(&self) -> f32 {
        10.0
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let wave = |p: &Vec3| Vec3::new(p.x, 0.2 * (3.0 * p.x + 2.0 * time).sin(), p.y) * 1.5;
        let floor = MeshPose {
            positions: square("", 0, 16).positions.iter().map(wave).collect(),
            ..MeshPose::default()
        };
        let place = |size: f32, turn: f32, at: Vec3| {
            Affine3::from_scale_rotation_translation(Vec3::splat(size), Quat::from_rotation_x(turn), at)
        };
        let lamp = place(0.5, 1.5, Vec3::new(0.8 * time - 0.8, 1.6, 0.0));
        let vane = place(0.4, 1.5 * time, Vec3::new(0.3, 0.7, 0.4));
        let eye = Camera::look_at("eye", Vec3::new(0.3 * time, 2.0, 4.0 - 0.5 * time), Vec3::ZERO, 0.7);
        Ok(Pose {
            meshes: vec![floor],
            instances: vec![(1, lamp), (2, vane)],
            cameras: vec![(0, eye)],
            ..Pose::default()
        })
    }
}

/// A floor, a vane and a ball that all go along with the camera, unless that stays.
#[derive(Debug)]
struct Convoy {
    camera_goes: bool,
}

fn convoy(camera_goes: bool) -> SceneDesc {
    let ball = Metaball { center: Vec3::ZERO, radius: 0.9, strength: 1.0 };
    let shape = ImplicitShape::Metaballs(Metaballs { balls: vec![ball], threshold: 0.2 });
    let parts = vec![Part { first_triangle: 0, material: 0 }];
    let ball = Mesh { implicit: Some(Arc::new(shape)), parts, ..Mesh::default() };
    let mut desc = SceneDesc {
        meshes: vec![square("floor", 0, 4), square("vane", 1, 1), ball],
        instances: [0, 1, 2].map(|mesh| place(mesh, Affine3::IDENTITY)).to_vec(),
        materials: vec![
            Material::diffuse("grey", Vec3::splat(0.7)),
            Material::diffuse("red", Vec3::new(0.8, 0.3, 0.1)),
        ],
        environment: Some(Environment::Constant(Vec3::ONE)),
        cameras: vec![camera(0.0)],
        motion: Some(Arc::new(Convoy { camera_goes })),
        ..SceneDesc::default()
    };
    desc.apply(Convoy { camera_goes }.pose(0.0).expect("a moment")).expect("fits");
    desc
}

impl Motion for Convoy {
    fn duration(&self) -> f32 {
        1.0
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let way = Vec3::new(0.8, 0.1, -0.3) * time;
        let lie = |p: &Vec3| Vec3::new(p.x, 0.0, -p.y) * 1.5 + way;
        let floor = MeshPose {
            positions: square("", 0, 4).positions.iter().map(lie).collect(),
            ..MeshPose::default()
        };
        let mirrored = Affine3::from_scale(Vec3::new(-0.4, 0.5, 0.4));
        let vane = Affine3::from_translation(way + Vec3::new(0.6, 0.5, 0.3)) * mirrored;
        let ball = Affine3::from_translation(way + Vec3::new(-0.4, 0.4, 0.0));
        let eye = Vec3::new(0.2, 2.0, 4.0) + if self.camera_goes { way } else { Vec3::ZERO };
        let camera = Camera::look_at("eye", eye, eye - Vec3::new(0.2, 2.0, 4.0), 0.7);
        let (meshes, cameras) = (vec![floor], vec![(0, camera)]);
        Ok(Pose { meshes, instances: vec![(1, vane), (2, ball)], cameras, ..Pose::default() })
    }
}

#[test]
fn what_goes_along_with_its_camera_is_sharp() {
    let picture = |camera_goes: bool, integrator: Integrator, seconds: f32| {
        let mut session = session(convoy(camera_goes));
        session.expose(0.2, &Exposure { seconds, keys: 3 }).expect("it moves");
        let mut request = request(&session, SIZE, 16, 7);
        request.settings.integrator = integrator;
        planes(&render(&mut session, &request).expect("rendered")).concat()
    };
    for integrator in [Integrator::Path, Integrator::Direct, Integrator::Ao, Integrator::Primary] {
        let still = picture(true, integrator, 0.0);
        // Rounding sends few paths another way.
        let apart = |other: &[f32]| {
            let differences = still.iter().zip(other).map(|(a, b)| (a - b).abs());
            differences.sum::<f32>() / still.iter().sum::<f32>()
        };
        let (along, past) = (apart(&picture(true, integrator, 0.5)), apart(&picture(false, integrator, 0.5)));
        assert!(along < 1e-3, "{integrator:?}: {along}");
        assert!(past > 0.01, "{integrator:?}, negative control: {past}");
    }
}

const SIZE: [u32; 2] = [24, 16];
const FROM: f32 = 0.5;
const OPEN: f32 = 0.8;

fn blurred(session: &mut Session, seconds: f32, spp: u32, seed: u32) -> Vec<f32> {
    session.expose(FROM, &Exposure { seconds, keys: 17 }).expect("it moves");
    let request = request(session, SIZE, spp, seed);
    planes(&render(session, &request).expect("rendered")).concat()
}

/// The mean of pictures at moments spread over the shutter's time, one in each part.
fn mean_of_moments(session: &mut Session, moments: u32, spp: u32, seed: u32) -> Vec<f32> {
    let mut rng = Rng::new(u64::from(seed));
    let mut mean = vec![0.0; (3 * SIZE[0] * SIZE[1]) as usize];
    for moment in 0..moments {
        let part = (moment as f32 + rng.next_1d()) / moments as f32;
        session.pose(FROM + OPEN * part).expect("it moves");
        let request = request(session, SIZE, spp, seed * moments + moment);
        let picture = planes(&render(session, &request).expect("rendered")).concat();
        mean.iter_mut().zip(picture).for_each(|(mean, value)| *mean += value / moments as f32);
    }
    mean
}

/// Mean and variance of the mean, by value.
fn statistics(pictures: &[Vec<f32>]) -> Vec<[f64; 2]> {
    let n = pictures.len() as f64;
    (0..pictures[0].len())
        .map(|i| {
            let values = || pictures.iter().map(|picture| f64::from(picture[i]));
            let mean = values().sum::<f64>() / n;
            [mean, values().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))]
        })
        .collect()
}

/// Mean square of the differences in units of their deviation; about 1 for pictures of the same.
fn mean_square_z(a: &[Vec<f32>], b: &[Vec<f32>]) -> f64 {
    let squares = statistics(a).into_iter().zip(statistics(b)).filter_map(|([a, va], [b, vb])| {
        let variance = va + vb;
        (variance > 1e-12).then(|| (a - b).powi(2) / variance)
    });
    let squares: Vec<f64> = squares.collect();
    assert!(squares.len() > 500, "{}", squares.len());
    squares.iter().sum::<f64>() / squares.len() as f64
}

#[test]
fn an_open_shutter_is_the_mean_of_its_moments() {
    let mut session = session(stage());
    let seeds = 1..25;
    let start = std::time::Instant::now();
    let of = |seconds: f32, session: &mut Session| -> Vec<Vec<f32>> {
        seeds.clone().map(|seed| blurred(session, seconds, 64, seed)).collect()
    };
    let open = of(OPEN, &mut session);
    eprintln!("open {:?}", start.elapsed());
    let t0 = std::time::Instant::now();
    for _ in 0..24 {
        session.expose(FROM, &Exposure { seconds: OPEN, keys: 17 }).expect("it moves");
    }
    eprintln!("24 exposes {:?}", t0.elapsed());
    let shorter = of(0.7 * OPEN, &mut session);
    eprintln!("shorter {:?}", start.elapsed());
    let moments: Vec<_> = seeds.clone().map(|seed| mean_of_moments(&mut session, 16, 8, seed)).collect();
    eprintln!("moments {:?}", start.elapsed());
    let t0 = std::time::Instant::now();
    for i in 0..100 {
        session.pose(FROM + i as f32 * 0.003).expect("it moves");
    }
    eprintln!("100 poses {:?}", t0.elapsed());
    let t0 = std::time::Instant::now();
    let r = request(&session, SIZE, 1, 0);
    for _ in 0..100 {
        render(&mut session, &r).unwrap();
    }
    eprintln!("100 renders of 1 spp {:?}", t0.elapsed());
    let t0 = std::time::Instant::now();
    let r = request(&session, SIZE, 64, 0);
    for _ in 0..10 {
        render(&mut session, &r).unwrap();
    }
    eprintln!("10 renders of 64 spp {:?}", t0.elapsed());
    let z = mean_square_z(&open, &moments);
    assert!((0.8..1.25).contains(&z), "{z}");
    let other = mean_square_z(&shorter, &moments);
    assert!(other > 2.0 * z, "negative control: {other} against {z}");
}

#[test]
fn threads_do_not_change_bits_and_a_closed_shutter_is_a_moment() {
    let mut session = session(stage());
    let with_threads = |threads: usize, session: &mut Session| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| blurred(session, OPEN, 4, 3))
    };
    let once = with_threads(1, &mut session);
    assert!(with_threads(3, &mut session) == once);
    session.expose(FROM, &Exposure { seconds: 0.0, keys: 5 }).expect("it moves");
    assert!(session.open().scene.shutter().is_none());
    let request = request(&session, SIZE, 4, 3);
    let closed = planes(&render(&mut session, &request).expect("rendered")).concat();
    session.pose(FROM).expect("it moves");
    assert!(closed == planes(&render(&mut session, &request).expect("rendered")).concat());
    assert!(closed != once);
}

/// Moves, and is always in the same place.
#[derive(Debug)]
struct Resting;

impl Motion for Resting {
    fn duration(&self) -> f32 {
        1.0
    }

    fn pose(&self, _time: f32) -> Result<Pose, SceneError> {
        Stage.pose(0.3)
    }
}

#[test]
fn what_rests_has_the_bits_of_a_moment() {
    let mut session = session(SceneDesc { motion: Some(Arc::new(Resting)), ..stage() });
    session.pose(0.0).expect("a moment");
    let request = request(&session, SIZE, 4, 3);
    let still = planes(&render(&mut session, &request).expect("rendered"));
    session.expose(0.0, &Exposure { seconds: 1.0, keys: 3 }).expect("a shutter");
    assert!(session.open().scene.shutter().is_some_and(|shutter| shutter.is_still()));
    assert!(planes(&render(&mut session, &request).expect("rendered")) == still);
}

#[test]
fn what_knows_no_shutter_refuses() {
    let exposure = Exposure { seconds: 0.1, keys: 2 };
    let mut session = session(stage());
    session.expose(0.0, &exposure).expect("it moves");
    let fine = request(&session, SIZE, 1, 0);
    let with = |change: &dyn Fn(&mut RenderRequest)| {
        let mut request = fine.clone();
        change(&mut request);
        request
    };
    let photons = PhotonSettings::default();
    let wrong = [
        with(&|r| r.settings.integrator = Integrator::Whitted),
        with(&|r| r.settings.integrator = Integrator::PhotonCaustics),
        with(&|r| r.settings.caustics = Some(photons)),
        with(&|r| r.device.device = Device::Gpu(None)),
        with(&|r| r.tracer = TracerConfig { accel: "kd-threaded".into(), ..TracerConfig::default() }),
    ];
    for request in wrong {
        let error = render(&mut session, &request).expect_err("refused").to_string();
        assert!(error.contains("shutter"), "{error}");
    }
    let stream = with(&|r| r.settings.integrator = Integrator::Whitted);
    let begun = session.live(&fine, |live| live.begin(stream).map(drop));
    assert!(begun.expect("live").expect_err("refused").to_string().contains("shutter"));
    // Made anew for each moment.
    let options = LoadOptions::default();
    let metaballs = "demo:metaballs";
    let mut moments = Session::new(open(metaballs, &options).expect("opens"), metaballs, &options);
    let refused = moments.expose(0.0, &exposure);
    assert!(refused.expect_err("refused").to_string().contains("shutter"));
    moments.expose(0.5, &Exposure { seconds: 0.0, keys: 2 }).expect("a moment");
}
