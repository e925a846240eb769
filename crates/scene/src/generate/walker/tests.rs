use super::*;
use crate::generate::by_name;
use vastlight_math::Aabb;

fn scene() -> SceneDesc {
    by_name("walker", &GenerateOptions::default()).expect("a demo")
}

fn pose(desc: &SceneDesc, time: f32) -> Pose {
    desc.motion.as_ref().expect("moves").pose(time).expect("a moment")
}

#[test]
fn feet_hardly_go_through_the_ground_and_the_figure_stays_whole() {
    let desc = scene();
    for step in 0..=40 {
        let time = DURATION * step as f32 / 40.0;
        let moment = pose(&desc, time);
        let mesh = &moment.meshes[0];
        let bounds = Aabb::from_points(mesh.positions.iter().copied());
        assert!(bounds.min.y > -0.025 && bounds.min.y < 0.02, "{time}: {bounds:?}");
        assert!(bounds.max.y > 1.7 && bounds.max.y < 1.85, "{time}: {bounds:?}");
        let size = bounds.max - bounds.min;
        assert!(size.x < 0.9 && size.z < 1.4, "{time}: {size}");
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
    }
}

#[test]
fn the_skin_is_not_torn() {
    let desc = scene();
    let first = pose(&desc, 0.0);
    let triangles = &desc.meshes[first.meshes[0].mesh as usize].triangles;
    for step in 0..10 {
        let p = &pose(&desc, step as f32 / 10.0).meshes[0].positions;
        let length = |t: &[u32; 3]| (p[t[0] as usize] - p[t[1] as usize]).length();
        let worst = triangles.iter().map(length).fold(0.0, f32::max);
        assert!(worst < 0.06, "{step}: an edge of {worst} m");
    }
}

#[test]
fn blending_one_place_with_itself_keeps_it() {
    let place = Place { turn: Turn::about(Vec3::new(0.6, 0.0, 0.8), 2.1), at: Vec3::new(3.0, -1.0, 0.5) };
    let bones = [Dual::new(&place), Dual::new(&Place { turn: Turn::about(Vec3::Y, 0.5), ..place })];
    let p = Vec3::new(0.2, 1.4, -0.3);
    let same = blended(&bones, &[(0, 0.7), (0, 0.3), (0, 0.0), (0, 0.0)]);
    assert!((same.point(p) - place.point(p)).length() < 1e-5);
    let other = blended(&bones, &[(0, 0.7), (1, 0.3), (0, 0.0), (0, 0.0)]);
    assert!((other.point(p) - place.point(p)).length() > 1e-2);
}

#[test]
fn the_camera_goes_along() {
    let desc = scene();
    let camera = |time: f32| pose(&desc, time).cameras[0].1.world_from_camera.translation;
    let way = camera(2.0) - camera(1.0);
    assert!(way.x.abs() < 1e-5 && way.z > 1.0, "{way}");
}
