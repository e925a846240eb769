use super::*;
use crate::generate::tests::pose;
use vastlight_math::Aabb;

fn scene() -> SceneDesc {
    let options = GenerateOptions { triangles: Some(40_000), seed: 2, ..GenerateOptions::default() };
    super::bodies(&options)
}

#[test]
fn the_first_moment_is_the_mesh_and_the_last_one_holds() {
    let desc = scene();
    let start = pose(&desc, 0.0);
    assert_eq!(start.positions, desc.meshes[start.mesh as usize].positions);
    assert_eq!(start.normals, desc.meshes[start.mesh as usize].normals);
    assert_eq!(pose(&desc, -3.0), start);
    assert_eq!(pose(&desc, DURATION + 1.0), pose(&desc, DURATION));
    assert_ne!(pose(&desc, 1.0).positions, start.positions);
}

#[test]
fn bodies_stay_in_the_room_and_most_gather_in_the_bowl() {
    let desc = scene();
    for step in 0..=12 {
        let moment = pose(&desc, DURATION * step as f32 / 12.0);
        let bounds = Aabb::from_points(moment.positions.iter().copied());
        assert!(bounds.min.y > -0.03 && bounds.max.y < 5.6, "{step}: {bounds:?}");
        assert!(
            bounds.min.z > -6.0 && bounds.max.max(-bounds.min).max_element() < 10.0,
            "{step}: {bounds:?}"
        );
    }
    let end = pose(&desc, DURATION);
    let inside = end.positions.iter().filter(|p| p.with_y(0.0).length() < 1.6).count();
    assert!(inside * 10 > end.positions.len() * 7, "{inside} of {}", end.positions.len());
    let speed = |a: &MeshPose, b: &MeshPose| {
        let moved: f32 = a.positions.iter().zip(&b.positions).map(|(a, b)| (*a - *b).length()).sum();
        moved / a.positions.len() as f32 / 0.1
    };
    let slow = speed(&pose(&desc, DURATION - 0.1), &end);
    assert!(slow < 0.25, "{slow} m/s in the end");
}

#[test]
fn bodies_do_not_go_through_each_other() {
    let things = things(&Chance::new(2, 0x626f_6469), &[0]);
    let flight = Flight::new(things.clone());
    for step in 0..=30 {
        let places = flight.at(DURATION * step as f32 / 30.0);
        let mut worst = 0.0_f32;
        for i in (0..things.len()).filter(|&i| things[i].kind == Kind::Ball) {
            for j in (0..i).filter(|&j| things[j].kind == Kind::Ball) {
                let touch = things[i].size + things[j].size;
                worst = worst.max((touch - (places[i].at - places[j].at).length()) / touch);
            }
        }
        assert!(worst < 0.15, "{step}: {worst} of their radii");
    }
}
