use super::*;
use crate::generate::by_name;

fn scene() -> SceneDesc {
    let options = GenerateOptions { triangles: Some(1_500_000), seed: 5, ..GenerateOptions::default() };
    by_name("traffic", &options).expect("a demo")
}

fn pose(desc: &SceneDesc, time: f32) -> Pose {
    desc.motion.as_ref().expect("moves").pose(time).expect("a moment")
}

fn name(desc: &SceneDesc, instance: u32) -> &str {
    &desc.meshes[desc.instances[instance as usize].mesh as usize].name
}

#[test]
fn only_cars_and_lamps_move() {
    let desc = scene();
    let (first, later) = (pose(&desc, 0.0), pose(&desc, 7.3));
    assert!(first.meshes.is_empty() && first.cameras.is_empty() && first.lights.is_empty());
    let indices = |pose: &Pose| pose.instances.iter().map(|i| i.0).collect::<Vec<_>>();
    assert_eq!(indices(&first), indices(&later));
    let cars = first.instances.iter().filter(|i| name(&desc, i.0) == "car").count();
    assert!(cars >= 36, "{cars} cars");
    assert!(first.instances.iter().all(|i| ["car", "red lamp", "green lamp"].contains(&name(&desc, i.0))));
    let moved = first.instances.iter().zip(&later.instances).filter(|(a, b)| a.1 != b.1).count();
    assert!(moved * 2 > cars, "{moved} of {cars}");
    let mut distinct = indices(&first);
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), first.instances.len());
}

#[test]
fn cars_never_touch_each_other() {
    let desc = scene();
    for step in 0..=48 {
        let time = DURATION * step as f32 / 48.0;
        let cars: Vec<Affine3> =
            pose(&desc, time).instances.iter().filter(|i| name(&desc, i.0) == "car").map(|i| i.1).collect();
        for (i, a) in cars.iter().enumerate() {
            for b in &cars[..i] {
                // Cars stand along the axes: compare boxes.
                let half = |m: &Affine3| m.transform_vector3(Vec3::new(2.25, 0.0, 0.9)).abs();
                let apart = (a.translation - b.translation).abs();
                let reach = half(a) + half(b);
                assert!(apart.x > reach.x || apart.z > reach.z, "{time} s: {apart} {reach}");
            }
        }
    }
}

#[test]
fn cars_go_forward_and_some_wait() {
    let desc = scene();
    let (a, b) = (pose(&desc, 3.0), pose(&desc, 3.5));
    let (mut waiting, mut driving) = (0, 0);
    for (a, b) in a.instances.iter().zip(&b.instances).filter(|(a, _)| name(&desc, a.0) == "car") {
        let way = b.1.translation - a.1.translation;
        let ahead = a.1.transform_vector3(Vec3::X);
        // Whoever reaches the end of a lane begins again.
        if way.length() < 50.0 {
            assert!(way.dot(ahead) > -1e-3 && way.length() < 7.0, "{way}");
            waiting += usize::from(way.length() < 0.05);
            driving += usize::from(way.length() > 2.0);
        }
    }
    assert!(waiting > 2 && driving > 10, "{waiting} wait, {driving} drive");
}
