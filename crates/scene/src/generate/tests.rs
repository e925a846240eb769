//! Tests over all demos.

use super::*;
use crate::{Mesh, Motion, MotionRecord, Scene};
use std::sync::{Arc, OnceLock};

/// A small version of every demo under seed 7, made once.
fn all() -> &'static [(&'static str, SceneDesc)] {
    static ALL: OnceLock<Vec<(&'static str, SceneDesc)>> = OnceLock::new();
    ALL.get_or_init(|| names().into_iter().map(|name| (name, small(name, 7))).collect())
}

fn small(name: &str, seed: u64) -> SceneDesc {
    let triangles = DEMOS
        .iter()
        .find(|d| d.name == name)
        .and_then(|d| d.sizes.as_ref())
        .map(|s| s.least.max(20_000).min(s.most));
    by_name(name, &GenerateOptions { triangles, seed, ..GenerateOptions::default() }).expect("a demo")
}

/// The first mesh that moves, at a moment.
pub(super) fn pose(desc: &SceneDesc, time: f32) -> crate::MeshPose {
    let pose = desc.motion.as_ref().expect("moves").pose(time).expect("a moment");
    pose.meshes.into_iter().next().expect("a mesh")
}

fn instanced_triangles(desc: &SceneDesc) -> u64 {
    desc.instances.iter().map(|i| desc.meshes[i.mesh as usize].triangles.len() as u64).sum()
}

/// A hash of everything that geometry is made of.
fn fingerprint(desc: &SceneDesc) -> u64 {
    let mut hash = 0_u64;
    let mut eat = |bits: u32| hash = chance::mix(hash ^ u64::from(bits)).wrapping_add(0x51);
    for mesh in &desc.meshes {
        mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|x| eat(x.to_bits()));
        mesh.normals.iter().flat_map(|p| p.to_array()).for_each(|x| eat(x.to_bits()));
        mesh.colors.iter().flat_map(|p| p.to_array()).for_each(|x| eat(x.to_bits()));
        mesh.triangles.iter().flatten().for_each(|&i| eat(i));
        format!("{:?}", mesh.implicit).bytes().for_each(|byte| eat(byte.into()));
    }
    for instance in &desc.instances {
        instance.world_from_object.to_cols_array().iter().for_each(|x| eat(x.to_bits()));
        eat(instance.mesh);
    }
    hash
}

#[test]
fn every_demo_is_a_sound_scene() {
    for (name, desc) in all() {
        let desc = desc.clone();
        assert!(!desc.cameras.is_empty() && desc.environment.is_some(), "{name}");
        let scene = Scene::new(desc).expect(name);
        let found: Vec<_> = scene.diagnostics().items().iter().map(ToString::to_string).collect();
        assert!(found.is_empty(), "{name}: {found:?}");
        for mesh in scene.meshes() {
            check_normals(name, mesh);
        }
    }
}

/// Shading normals are unit vectors on the side that the winding faces.
fn check_normals(name: &str, mesh: &Mesh) {
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "{name}/{}: length", mesh.name);
    if mesh.normals.is_empty() {
        return;
    }
    let against = (0..mesh.triangles.len() as u32).filter(|&t| {
        let [a, b, c] = mesh.corners(t);
        let face = (b - a).cross(c - a);
        mesh.triangles[t as usize].iter().any(|&i| mesh.normals[i as usize].dot(face) < 0.0)
    });
    let against = against.count();
    assert!(against * 100 <= mesh.triangles.len(), "{name}/{}: {against} normals point inwards", mesh.name);
}

#[test]
fn normals_go_with_what_moves() {
    for (name, desc) in all() {
        let Some(motion) = &desc.motion else { continue };
        let moved = desc.clone().at(0.5 * motion.duration()).expect(name);
        moved.meshes.iter().for_each(|mesh| check_normals(name, mesh));
    }
}

#[test]
fn a_demo_that_moves_is_made_for_its_moment() {
    for (name, desc) in all() {
        let Some(motion) = &desc.motion else { continue };
        let time = 0.5 * motion.duration();
        let triangles =
            DEMOS.iter().find(|d| d.name == *name).and_then(|d| d.sizes.as_ref()).map(|s| s.least);
        let options = GenerateOptions { triangles, seed: 7, time, ..GenerateOptions::default() };
        let made = by_name(name, &options).expect("a demo");
        let rest = by_name(name, &GenerateOptions { time: 0.0, ..options }).expect("a demo");
        assert_ne!(fingerprint(&made), fingerprint(&rest), "{name}");
        assert_eq!(fingerprint(&made), fingerprint(&rest.at(time).expect("a moment")), "{name}");
    }
}

#[test]
fn the_seed_decides_and_nothing_else() {
    let fixed = ["caustic-sphere", "cornell", "julia", "prism"];
    for (name, desc) in all() {
        let print = fingerprint(desc);
        assert_eq!(print, fingerprint(&small(name, 7)), "{name}");
        if !fixed.contains(name) {
            assert_ne!(print, fingerprint(&small(name, 8)), "{name}");
        }
    }
}

#[test]
fn the_triangle_count_is_met() {
    for demo in DEMOS {
        let Some(sizes) = &demo.sizes else { continue };
        for wanted in
            [sizes.least, sizes.least * 3 / 2 + 123, 300_001].into_iter().filter(|&n| n >= sizes.least)
        {
            let options = GenerateOptions { triangles: Some(wanted), seed: 0, ..GenerateOptions::default() };
            let made = instanced_triangles(&by_name(demo.name, &options).expect("in range"));
            assert!(made.abs_diff(wanted) * 100 <= wanted, "{}: {made} for {wanted}", demo.name);
        }
    }
}

#[test]
fn moments_follow_from_their_time_alone() {
    let moving = || all().iter().filter_map(|(name, desc)| Some((name, desc.motion.as_ref()?)));
    assert!(moving().count() >= 5);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for (name, motion) in moving() {
        let times = [0.0, 0.31, 1.07, 0.7, 2.9].map(|t| t * motion.duration() / 4.0);
        let pose = |motion: &Arc<dyn Motion>, time: f32| motion.pose(time).expect(name);
        let forward = times.map(|time| pose(motion, time));
        assert!(forward[1..].iter().all(|moment| *moment != forward[0]), "{name} stands still");
        // Another maker, one thread, and the last moment first.
        let other = pool.install(|| {
            let other = small(name, 7).motion.expect("moves");
            let mut moments: Vec<_> = times.iter().rev().map(|&time| pose(&other, time)).collect();
            moments.reverse();
            moments
        });
        assert!(forward.iter().eq(&other), "{name}");
    }
}

#[test]
fn unknown_names_and_sizes_are_refused_clearly() {
    let error = by_name("nonsense", &GenerateOptions::default()).expect_err("no such demo");
    assert!(error.to_string().contains("cornell"), "{error}");
    let options = GenerateOptions { triangles: Some(5), seed: 0, ..GenerateOptions::default() };
    assert!(by_name("cornell", &options).expect_err("fixed").to_string().contains("fixed"));
    assert!(by_name("caustic-sphere", &options).expect_err("range").to_string().contains("1000"));
}

/// Edges that are not shared by exactly two triangles in opposite directions, vertices welded by position.
fn open_edges(mesh: &Mesh) -> usize {
    use std::collections::BTreeMap;
    let key = |i: u32| mesh.positions[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut edges: BTreeMap<_, i32> = BTreeMap::new();
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (a, b) = (key(a), key(b));
            let (edge, direction) = if a < b { ((a, b), 1) } else { ((b, a), -1) };
            let entry = edges.entry(edge).or_insert(0);
            // Counts uses in the high part, their balance in the low part.
            *entry += 1000 + direction;
        }
    }
    edges.values().filter(|&&count| count != 2000).count()
}

#[test]
fn glass_volumes_are_closed() {
    let mut found = 0;
    for (name, desc) in all() {
        let is_volume = |m: u32| {
            let material = &desc.materials[m as usize];
            material.transmission.factor > 0.0 && material.thickness > 0.0
        };
        for mesh in desc.meshes.iter().filter(|m| m.parts.iter().any(|p| is_volume(p.material))) {
            found += 1;
            assert_eq!(open_edges(mesh), 0, "{name}/{}", mesh.name);
        }
    }
    assert!(found > 0);
    let mut open = solids::floor(1.0, 1.0);
    open.triangles.pop();
    let mut assembly = shape::Assembly::default();
    assembly.add(0, &open);
    assert_ne!(open_edges(&assembly.into_mesh("control")), 0);
}

#[test]
fn a_beveled_box_is_closed_and_faces_outwards() {
    let shape = solids::beveled_box(vastlight_math::Vec3::new(1.0, 2.0, 3.0), 0.1);
    assert_eq!(shape.triangles.len(), 44);
    let mut assembly = shape::Assembly::default();
    assembly.add(0, &shape);
    let mesh = assembly.into_mesh("box");
    assert_eq!(open_edges(&mesh), 0);
    for t in 0..44 {
        let [a, b, c] = mesh.corners(t);
        assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "triangle {t}");
    }
}

#[test]
fn movements_come_back_from_their_records() {
    let mut found = 0;
    for (name, desc) in all() {
        let Some(motion) = &desc.motion else { continue };
        let record = motion.record().expect("every demo's movement can be kept");
        let read = super::motion(&record, desc).expect(name).expect("a demo's");
        assert_eq!(read.duration(), motion.duration());
        for time in [0.0, 0.4, 0.9].map(|part| part * motion.duration()) {
            assert_eq!(read.pose(time), motion.pose(time), "{name} at {time}");
        }
        assert_eq!(read.record().as_ref(), Some(&record));
        found += 1;
    }
    assert_eq!(found, 5);
    let other = MotionRecord { kind: "gltf".into(), ..MotionRecord::default() };
    assert!(super::motion(&other, &SceneDesc::default()).expect("not damaged").is_none());
}

#[test]
fn damaged_records_are_errors_or_movements_that_can_be_asked() {
    for (name, desc) in all() {
        let Some(motion) = &desc.motion else { continue };
        let record = motion.record().expect("kept");
        let (mut refused, mut survived) = (0, 0);
        let last = record.bytes.len() - 1;
        // More at both ends, where counts and indices stand; a cut; a foreign scene.
        let places = (0..6).chain(last - 6..=last).chain((1..8).map(|i| i * last / 8));
        for place in places {
            for bit in [0, 7] {
                let mut damaged = record.clone();
                damaged.bytes[place] ^= 1 << bit;
                match super::motion(&damaged, desc) {
                    Ok(read) => {
                        // What is found by simulation takes its time.
                        let time = if survived < 3 { 0.4 } else { 0.0 };
                        let _ = read.expect("a demo's").pose(time);
                        survived += 1;
                    }
                    Err(error) => {
                        assert!(error.what.contains("damaged"), "{error}");
                        refused += 1;
                    }
                }
            }
        }
        let cut = MotionRecord { bytes: record.bytes[..last / 2].to_vec(), ..record.clone() };
        assert!(super::motion(&cut, desc).is_err(), "{name}");
        assert!(refused > 0 && survived > 0, "{name}: {refused} {survived}");
    }
}
