use super::*;
use crate::generate::tests::pose;
use vastlight_math::Aabb;

fn scene() -> SceneDesc {
    let options = GenerateOptions { triangles: Some(60_000), seed: 4, ..GenerateOptions::default() };
    super::explosion(&options)
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
    let still = late.positions.iter().zip(&end.positions).filter(|(a, b)| a == b).count();
    assert!(still * 2 > end.positions.len(), "{still} of {} lie still", end.positions.len());
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
        let inside = PLINTH - Vec3::splat(0.04);
        let sunk = moment.positions.iter().filter(|p| p.abs().cmplt(inside).all()).count();
        assert!(sunk * 200 <= moment.positions.len(), "{step}: {sunk} vertices in the plinth");
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

#[test]
fn normals_stand_on_the_faces_outside() {
    let desc = scene();
    let mesh = &desc.meshes[pose(&desc, 0.0).mesh as usize];
    let outside = mesh.parts[1].first_triangle;
    let steep = (0..outside).filter(|&t| {
        let [a, b, c] = mesh.corners(t);
        let normal: Vec3 = mesh.triangles[t as usize].iter().map(|&i| mesh.normals[i as usize]).sum();
        (b - a).cross(c - a).normalize_or_zero().dot(normal / 3.0) < 0.95
    });
    let steep = steep.count();
    assert!(steep * 4 < outside as usize, "{steep} of {outside}");
}

#[test]
fn first_poses_may_be_asked_for_at_once() {
    // Who waits for the shards' flights takes up other work of its pool, which may be a pose as well.
    let (mesh, shards) = shell(20_000, 4, [0, 1]);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().expect("a pool");
    for _ in 0..30 {
        let burst = Burst {
            mesh: 0,
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            shards: shards.clone(),
            chance: Chance::new(4, 0),
            keys: OnceLock::new(),
        };
        let pose = || burst.pose(1.0).expect("a moment");
        let two = || rayon::join(pose, pose);
        let (left, right) = pool.install(|| rayon::join(two, two));
        assert_eq!(left, right);
    }
}
