//! The animated files of the collection against vertices that another program computed (`oracle/poses.py`).

#![expect(clippy::print_stdout, reason = "a test says what it skips")]

mod common;

use common::models;
use std::collections::BTreeMap;
use vastlight_import::{LoadOptions, load};
use vastlight_math::{Aabb, Vec3};
use vastlight_scene::{Scene, SceneDesc};

/// Largest distance from an expected place, in sizes of the model.
const TOLERANCE: f32 = 1e-5;

/// A vertex in the world.
struct Expected {
    instance: usize,
    vertex: usize,
    place: Vec3,
}

/// By file, animation and moment.
fn fixture() -> BTreeMap<(&'static str, &'static str, &'static str), Vec<Expected>> {
    let mut cases = BTreeMap::<_, Vec<Expected>>::new();
    for line in include_str!("oracle/poses.tsv").lines().skip(1) {
        let fields: Vec<&str> = line.split('\t').collect();
        let [file, animation, time, instance, vertex, x, y, z] = fields[..] else { panic!("{line}") };
        let place = Vec3::from([x, y, z].map(|x| x.parse().expect("a number")));
        let number = |text: &str| text.parse().expect("a number");
        let expected = Expected { instance: number(instance), vertex: number(vertex), place };
        cases.entry((file, animation, time)).or_default().push(expected);
    }
    cases
}

/// The vertices of a scene, and its size.
fn size(desc: &SceneDesc) -> f32 {
    let points = desc.instances.iter().flat_map(|instance| {
        let mesh = &desc.meshes[instance.mesh as usize];
        mesh.positions.iter().map(|&p| instance.world_from_object.transform_point3(p))
    });
    Aabb::from_points(points).size().length()
}

/// Largest distance of a scene's vertices from the expected ones, in sizes of the scene.
fn deviation(desc: &SceneDesc, expected: &[Expected]) -> f32 {
    let distance = |e: &Expected| {
        let instance = &desc.instances[e.instance];
        let vertex = desc.meshes[instance.mesh as usize].positions[e.vertex];
        instance.world_from_object.transform_point3(vertex).distance(e.place)
    };
    expected.iter().map(distance).fold(0.0, f32::max) / size(desc)
}

#[test]
fn vertices_are_where_the_oracle_has_them() {
    let Some(folder) = models("gltf") else { return };
    let cases = fixture();
    let mut elsewhere_at_rest = 0;
    for ((file, animation, time), expected) in &cases {
        let options = LoadOptions { animation: Some((*animation).to_owned()), ..LoadOptions::default() };
        let desc = load(&folder.join(file), &options).expect("readable");
        let moved = desc.clone().at(time.parse().expect("a number")).expect("a moment");
        let found = deviation(&moved, expected);
        assert!(found < TOLERANCE, "{file}, animation {animation} at {time} s: off by {found} of its size");
        elsewhere_at_rest += usize::from(deviation(&desc, expected) > 10.0 * TOLERANCE);
    }
    // Negative control: at rest nearly all are elsewhere; some animations start at rest.
    assert!(
        cases.len() > 60 && elsewhere_at_rest * 10 > cases.len() * 7,
        "{elsewhere_at_rest} of {}",
        cases.len()
    );
}

#[test]
fn every_animated_file_is_a_scene_at_every_moment() {
    let Some(folder) = models("gltf") else { return };
    let files: std::collections::BTreeSet<&str> = fixture().keys().map(|(file, ..)| *file).collect();
    for file in files {
        let desc = load(&folder.join(file), &LoadOptions::default()).expect("readable");
        let duration = desc.motion.as_ref().expect("moves").duration();
        assert!(duration > 0.1, "{file}: {duration} s");
        for part in [-0.5, 0.0, 0.3, 0.77, 1.5] {
            let moved = desc.clone().at(part * duration).expect("a moment");
            let scene = Scene::new(moved).unwrap_or_else(|e| panic!("{file}: {e}"));
            assert!(scene.instanced_triangles() > 0, "{file}");
        }
    }
}
