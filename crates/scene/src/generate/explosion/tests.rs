use super::*;
use crate::generate::by_name;
use vastlight_math::Aabb;

fn scene() -> SceneDesc {
    let options = GenerateOptions { triangles: Some(60_000), seed: 4, ..GenerateOptions::default() };
    by_name("explosion", &options).expect("a demo")
}

fn pose(desc: &SceneDesc, time: f32) -> MeshPose {
    let pose = desc.motion.as_ref().expect("moves").pose(time).expect("a moment");
    pose.meshes.into_iter().next().expect("a mesh")
}

#[test]
fn nothing_moves_before_the_burst_and_all_rests_in_the_end() {
    let desc = scene();
    let mesh = pose(&desc, 0.0).mesh as usize;
    assert_eq!(pose(&desc, BURST).positions, desc.meshes[mesh].positions);
    assert_ne!(pose(&desc, BURST + 0.05).positions, desc.meshes[mesh].positions);
    let (late, end) = (pose(&desc, DURATION - 0.1), pose(&desc, DURATION));
    assert_eq!(pose(&desc, 100.0), end);
    let moved = late.positions.iter().zip(&end.positions).filter(|(a, b)| (**a - **b).length() > 2e-3);
    let moved = moved.count();
    assert!(moved * 50 < end.positions.len(), "{moved} of {} still move", end.positions.len());
}

#[test]
fn shards_stay_above_the_floor_and_in_the_studio() {
    let desc = scene();
    for step in 0..=20 {
        let moment = pose(&desc, DURATION * step as f32 / 20.0);
        let bounds = Aabb::from_points(moment.positions.iter().copied());
        assert!(bounds.min.y > -0.035 && bounds.max.y < 6.0, "{step}: {bounds:?}");
        assert!(
            bounds.min.z > WALL - 0.02 && bounds.max.abs().max(bounds.min.abs()).max_element() < 12.0,
            "{bounds:?}"
        );
    }
    let end = pose(&desc, DURATION);
    let highest = end.positions.iter().filter(|p| p.y > PLINTH.y - 0.05).count();
    assert!(highest * 3 < end.positions.len(), "{highest} vertices have not come down");
}

#[test]
fn shards_are_rigid() {
    let desc = scene();
    let (start, late) = (pose(&desc, 0.0), pose(&desc, 1.7));
    let mesh = &desc.meshes[start.mesh as usize];
    for t in mesh.triangles.iter().step_by(37) {
        let length = |p: &[Vec3]| (p[t[0] as usize] - p[t[1] as usize]).length();
        let (before, after) = (length(&start.positions), length(&late.positions));
        assert!((before - after).abs() < 1e-5, "{before} {after}");
    }
    assert!(late.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
}
