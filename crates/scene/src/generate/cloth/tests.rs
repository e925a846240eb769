use super::*;
use crate::generate::tests::pose;

fn scene() -> SceneDesc {
    let options = GenerateOptions { triangles: Some(40_000), seed: 3, ..GenerateOptions::default() };
    super::cloth(&options)
}

#[test]
fn the_first_moment_is_the_mesh_and_the_last_one_holds() {
    let desc = scene();
    let start = pose(&desc, 0.0);
    assert_eq!(start.positions, desc.meshes[start.mesh as usize].positions);
    assert_eq!(start.normals, desc.meshes[start.mesh as usize].normals);
    assert_eq!(pose(&desc, DURATION + 3.0), pose(&desc, DURATION));
    let moved = |a: f32, b: f32| {
        let (a, b) = (pose(&desc, a), pose(&desc, b));
        let far = a.positions.iter().zip(&b.positions).map(|(a, b)| (*a - *b).length());
        far.sum::<f32>() / a.positions.len() as f32
    };
    assert!(moved(0.2, 0.3) > 0.1, "{}", moved(0.2, 0.3));
    assert!(moved(DURATION - 0.1, DURATION) < 0.01, "{}", moved(DURATION - 0.1, DURATION));
}

#[test]
fn the_cloth_stays_outside_of_ball_and_floor() {
    let desc = scene();
    let (center, radius) = BALL;
    let mesh = &desc.meshes[pose(&desc, 0.0).mesh as usize];
    for step in 0..=24 {
        let moment = pose(&desc, DURATION * step as f32 / 24.0 + 0.01);
        let p = &moment.positions;
        for t in &mesh.triangles {
            // Where a triangle is deepest: near enough at its middle.
            let middle = t.iter().map(|&i| p[i as usize]).sum::<Vec3>() / 3.0;
            assert!((middle - center).length() > radius && middle.y > 0.0, "{step}: {middle}");
        }
        assert!(p.iter().all(|p| p.y < HEIGHT + 0.1 && p.with_y(0.0).length() < EDGE), "{step}");
        assert!(moment.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "{step}");
    }
}

#[test]
fn the_cloth_drapes_over_the_ball() {
    let desc = scene();
    let end = pose(&desc, DURATION);
    let (center, radius) = BALL;
    let on_ball = end.positions.iter().filter(|p| (**p - center).length() < radius + 0.03).count();
    let on_floor = end.positions.iter().filter(|p| p.y < 0.05).count();
    let count = end.positions.len();
    assert!(
        on_ball * 10 > count && on_floor * 20 > count,
        "{on_ball} on the ball, {on_floor} on the floor of {count}"
    );
}
