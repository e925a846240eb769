//! Pictures of a scene that moves: those of a session, and those of scenes that are opened at each moment.

mod common;

use common::square;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use vastlight::math::{Affine3, Vec3};
use vastlight::scene::{
    Camera, Instance, Light, LightKind, Material, Mesh, MeshPose, Motion, Pose, Scene, SceneDesc, SceneError,
};
use vastlight::trace::{TracerConfig, UpdateMethod};
use vastlight::transport::RenderSettings;
use vastlight::{CameraChoice, Control, LoadOptions, RenderRequest, Rendered, Session, render};

const FLOOR: u32 = 0;
const LAMP: u32 = 1;
/// Places of the lamp and of a lamp that is there at odd moments alone, and of the point light.
const PLACES: [u32; 2] = [1, 2];

fn quad(name: &str, material: u32, cells: u32) -> Mesh {
    square(name, material, cells, |x, z| Vec3::new(x, 0.0, -z))
}

/// A floor that waves, lamps that come, go and wander, a light and a camera that move.
#[derive(Debug)]
struct Stage {
    floor: Vec<Vec3>,
    camera: Camera,
}

fn stage() -> SceneDesc {
    let meshes = vec![quad("floor", 0, 24), quad("lamp", 1, 1)];
    let camera = Camera::look_at("eye", Vec3::new(0.0, 2.0, 4.0), Vec3::ZERO, 0.7);
    let lamp = |x: f32| {
        Affine3::from_translation(Vec3::new(x, 1.5, 0.0)) * Affine3::from_scale(Vec3::new(0.3, -0.3, 0.3))
    };
    let place = |mesh, world_from_object| Instance { world_from_object, mesh, name: 0 };
    SceneDesc {
        instances: vec![place(FLOOR, Affine3::IDENTITY), place(LAMP, lamp(-0.5)), place(LAMP, lamp(0.5))],
        materials: vec![
            Material::diffuse("floor", Vec3::splat(0.7)),
            Material::emitter("lamp", Vec3::splat(6.0), true),
        ],
        lights: vec![Light {
            name: "bulb".into(),
            kind: LightKind::Point,
            world_from_light: Affine3::from_translation(Vec3::Y),
            intensity: Vec3::splat(0.5),
            range: f32::INFINITY,
            profile: None,
        }],
        motion: Some(Arc::new(Stage { floor: meshes[0].positions.clone(), camera: camera.clone() })),
        cameras: vec![camera],
        meshes,
        ..SceneDesc::default()
    }
}

impl Motion for Stage {
    fn duration(&self) -> f32 {
        10.0
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let wave = |p: &Vec3| *p + Vec3::Y * (0.2 * (3.0 * p.x + time).sin());
        let floor =
            MeshPose { mesh: FLOOR, positions: self.floor.iter().map(wave).collect(), ..MeshPose::default() };
        let shift = Affine3::from_translation(Vec3::X * (0.1 * time));
        let at = |x: f32, size: f32| {
            Affine3::from_translation(Vec3::new(x, 1.5, 0.0))
                * Affine3::from_scale(Vec3::new(size, -size, size))
        };
        let seen = if time as u32 % 2 == 1 { 0.3 } else { 0.0 };
        let world_from_camera = shift * self.camera.world_from_camera;
        Ok(Pose {
            meshes: vec![floor],
            instances: vec![(PLACES[0], shift * at(-0.5, 0.3)), (PLACES[1], at(0.5, seen))],
            cameras: vec![(0, Camera { world_from_camera, ..self.camera.clone() })],
            lights: vec![(0, shift)],
        })
    }
}

fn request(scene: &Scene, update: UpdateMethod) -> RenderRequest {
    let camera = CameraChoice::default().resolve(scene).expect("a camera");
    let tracer = TracerConfig { update, ..TracerConfig::default() };
    RenderRequest { tracer, ..RenderRequest::new(RenderSettings::new(camera, 48, 32), 4) }
}

fn control(cancel: &AtomicBool) -> Control<'_> {
    Control::new(cancel, &|_| {})
}

fn planes(rendered: &Rendered) -> Vec<u32> {
    assert_eq!(rendered.stats.non_finite, 0);
    let picture = rendered.develop();
    picture.rgb().expect("colours").iter().flat_map(|plane| plane.iter().map(|x| x.to_bits())).collect()
}

#[test]
fn frames_of_a_session_are_the_pictures_of_their_moments() {
    let cancel = AtomicBool::new(false);
    for method in UpdateMethod::ALL {
        let scene = Scene::new(stage()).expect("valid");
        let mut session = Session::new(scene.into(), "stage", &LoadOptions::default());
        let mut seen = Vec::new();
        for time in [0.0, 1.0, 2.5, 4.0, 3.0, 0.0] {
            let report = session.pose(time).expect("it moves");
            assert_eq!((report.change.meshes, session.moving_triangles()), (vec![FLOOR], 2 * 24 * 24));
            let request = request(&session.open().scene, method);
            let frame = planes(&session.render(&request, &control(&cancel)).expect("rendered"));
            let fresh = Scene::new(stage().at(time).expect("a moment")).expect("valid");
            let alone = render(&fresh.into(), &request, &control(&cancel)).expect("rendered");
            assert!(frame == planes(&alone), "{method:?} at {time}");
            seen.push(frame);
        }
        assert!(seen[0] == seen[5] && seen[0] != seen[1], "moments differ, and come again");
    }
}

#[test]
fn a_lamp_that_is_not_to_be_seen_sheds_no_light() {
    let cancel = AtomicBool::new(false);
    let picture = |desc: SceneDesc| {
        let scene = Scene::new(desc).expect("valid");
        let request = RenderRequest { spp: 64, ..request(&scene, UpdateMethod::Auto) };
        let rendered = render(&scene.into(), &request, &control(&cancel)).expect("rendered");
        let sum = planes(&rendered).into_iter().map(|bits| f64::from(f32::from_bits(bits))).sum::<f64>();
        sum / (3.0 * 48.0 * 32.0)
    };
    let hidden = picture(stage().at(2.0).expect("a moment"));
    let mut without = stage().at(2.0).expect("a moment");
    without.instances.truncate(2);
    without.motion = None;
    let without = picture(without);
    assert!((hidden / without - 1.0).abs() < 0.01, "{hidden} against {without}");
    assert!(picture(stage().at(1.0).expect("a moment")) > 1.2 * without, "seen, it shines");
}

#[test]
fn a_scene_that_stands_still_cannot_be_posed() {
    let still = SceneDesc { motion: None, ..stage() };
    let scene = Scene::new(still).expect("valid");
    let mut session = Session::new(scene.into(), "stage", &LoadOptions::default());
    assert!(session.pose(1.0).expect_err("still").to_string().contains("nothing moves"));
}
