use super::*;
use rayon::prelude::*;
use tempfile::TempDir;
use vastlight_scene::{Scene, Severity};

/// Two quads side by side that share an edge; the corner in the middle goes along x.
fn obj(x: f32) -> String {
    format!("v 0 0 0\nv 2 0 0\nv 2 2 0\nv {x} 1 0\nv 0 4 {x}\ns 1\nf 1 2 3 4\ns off\nf 4 3 5\nf 1 4 5\n")
}

fn ply(z: f32) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty \
         float ny\nproperty float nz\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 {z} 0 0 1\n1 0 {z} 0 0 1\n\
         1 1 {z} 0 0 1\n0 1 {z} 0 {z} 1\n4 0 1 2 3\n"
    )
}

/// A folder with files, and a path with marks for them.
fn files(pattern: &str, contents: &[(&str, String)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    contents.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).expect("written"));
    let path = folder.path().join(pattern);
    (folder, path)
}

fn load(path: &Path, fps: f32) -> Result<SceneDesc, ImportError> {
    crate::load(path, &LoadOptions { sequence_fps: fps, ..LoadOptions::default() })
}

fn at(desc: &SceneDesc, time: f32) -> Mesh {
    let mut desc = desc.clone().at(time).expect("a moment");
    drop(Scene::new(desc.clone()).expect("a scene"));
    desc.meshes.remove(0)
}

#[test]
fn vertices_go_straight_from_file_to_file() {
    let (_folder, path) =
        files("a.##.ply", &[("a.07.ply", ply(0.0)), ("a.08.ply", ply(1.0)), ("a.09.ply", ply(5.0))]);
    let desc = load(&path, 10.0).expect("read");
    assert_eq!(desc.motion.as_ref().map(|m| m.duration()), Some(0.2));
    assert_eq!(
        (desc.names[0].as_str(), desc.meshes[0].positions[0].z),
        ("a.07", 0.0),
        "at rest as the first"
    );
    let moments = [
        (-1.0, 0.0),
        (0.0, 0.0),
        (0.05, 0.5),
        (0.1, 1.0),
        (0.175, 4.0),
        (0.2, 5.0),
        (7.0, 5.0),
        (f32::NAN, 0.0),
    ];
    for (time, z) in moments {
        let mesh = at(&desc, time);
        assert!(mesh.positions.iter().all(|p| (p.z - z).abs() < 1e-5), "{:?} at {time}", mesh.positions);
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    }
    let tilted = at(&desc, 0.05).normals[3];
    let unit = Vec3::new(0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt());
    let read = at(&desc, 0.1).normals[3];
    assert!(read.abs_diff_eq(unit, 1e-5), "{read}");
    assert!(tilted.abs_diff_eq(Vec3::Z.lerp(unit, 0.5).normalize(), 1e-5), "{tilted}");
    let twice = load(&path, 20.0).expect("read");
    assert_eq!(at(&twice, 0.05).positions[0].z, 1.0);
}

#[test]
fn quads_of_an_obj_may_fold_and_keep_their_triangles() {
    // Convex, then with a corner that goes in, which alone would be cut otherwise.
    let (_folder, path) =
        files("m#.obj", &[("m0.obj", obj(0.0)), ("m1.obj", obj(1.9)), ("m2.obj", obj(-1.0))]);
    let desc = load(&path, 1.0).expect("read");
    let alone = crate::load(&path.with_file_name("m1.obj"), &LoadOptions::default()).expect("read");
    let corners = |mesh: &Mesh| -> Vec<[Vec3; 3]> { (0..4).map(|t| mesh.corners(t)).collect() };
    for (time, x) in [(0.0, 0.0), (1.0, 1.9), (1.5, 0.45), (2.0, -1.0)] {
        let mesh = at(&desc, time);
        assert_eq!(mesh.triangles, desc.meshes[0].triangles);
        let moving = mesh.positions.iter().filter(|p| (p.x, p.y) != (0.0, 0.0) && p.y == 1.0);
        assert!(
            moving.clone().count() >= 3 && moving.clone().all(|p| (p.x - x).abs() < 1e-6),
            "{:?}",
            mesh.positions
        );
    }
    assert_ne!(
        corners(&at(&desc, 1.0)),
        corners(&alone.meshes[0]),
        "alone it is cut along the other diagonal"
    );
}

#[test]
fn files_are_read_when_they_are_asked_for_and_two_are_kept() {
    let contents: Vec<(String, String)> = (0..6).map(|i| (format!("{i}.ply"), ply(i as f32))).collect();
    let contents: Vec<(&str, String)> =
        contents.iter().map(|(name, text)| (name.as_str(), text.clone())).collect();
    let (folder, path) = files("#.ply", &contents);
    let desc = load(&path, 1.0).expect("read");
    let motion = desc.motion.clone().expect("moves");
    assert!(motion.pose(1.5).is_ok());
    let broken = |name: &str| std::fs::write(folder.path().join(name), "ply\n").expect("written");
    ["1.ply", "2.ply", "4.ply"].into_iter().for_each(broken);
    assert!(motion.pose(1.75).is_ok(), "both are kept");
    assert!(motion.pose(3.0).is_ok(), "4 is not asked for");
    let error = motion.pose(3.5).expect_err("broken");
    assert!(error.place.contains("4.ply"), "{error}");
    assert!(motion.pose(1.0).is_err(), "1 was not kept");
    std::fs::remove_file(folder.path().join("5.ply")).expect("removed");
    assert!(motion.pose(5.0).expect_err("gone").place.contains("5.ply"));
}

#[test]
fn threads_may_ask_for_any_moment() {
    let (_folder, path) = files("#.obj", &[("0.obj", obj(0.0)), ("1.obj", obj(1.0)), ("2.obj", obj(3.0))]);
    let motion = load(&path, 1.0).expect("read").motion.expect("moves");
    let times: Vec<f32> = (0..200).map(|i| (i * 7 % 200) as f32 * 0.01).collect();
    let expected: Vec<Pose> = times.iter().map(|&time| motion.pose(time).expect("a pose")).collect();
    let found: Vec<Pose> = times.par_iter().map(|&time| motion.pose(time).expect("a pose")).collect();
    assert!(found == expected);
}

#[test]
fn other_triangles_are_refused_with_the_file() {
    let swapped = ply(1.0).replace("4 0 1 2 3", "4 0 1 3 2");
    let fewer = ply(1.0).replace("4 0 1 2 3", "3 0 1 2");
    let flat = ply(1.0).replace("nx", "ax");
    for (other, words) in [(swapped, "other corners"), (fewer, "1 triangles"), (flat, "0 normals")] {
        let (_folder, path) = files("#.ply", &[("0.ply", ply(0.0)), ("1.ply", other)]);
        let motion = load(&path, 1.0).expect("the first is fine").motion.expect("moves");
        assert!(motion.pose(0.0).is_ok());
        let error = motion.pose(0.5).expect_err("another shape");
        assert!(error.what.contains(words) && error.place.ends_with("1.ply"), "{error}");
    }
    let objects = format!("o a\n{}o b\nf 1 2 3\n", obj(0.0));
    let (_folder, path) = files("#.obj", &[("0.obj", obj(0.0)), ("1.obj", objects)]);
    let motion = load(&path, 1.0).expect("the first is fine").motion.expect("moves");
    assert!(motion.pose(1.0).expect_err("two meshes").what.contains("2 meshes"));
}

#[test]
fn everything_takes_the_path_of_a_sequence() {
    let (folder, path) =
        files("a#.obj", &[("a1.obj", obj(0.0)), ("a2.obj", obj(1.0)), ("b1.stl", "solid".into())]);
    let options = LoadOptions::default();
    assert_eq!(detect(&path, &options.limits), Ok(SceneFormat::Obj));
    let first = folder.path().join("a1.obj");
    assert_eq!(crate::file_size(&path, &options), crate::file_size(&first, &options));
    let moving = crate::load(&path, &options).expect("read").motion.expect("moves");
    assert_eq!(moving.duration(), 1.0 / 24.0);
    let streamed = crate::stream(&path, &options).expect("read").stream.collect().expect("sound");
    assert_eq!(streamed.meshes.len(), 1);
    assert!(streamed.diagnostics.items().iter().all(|d| d.severity == Severity::Warning));
    assert_eq!(files_of(&path, &options.limits), Ok(vec![first.clone(), folder.path().join("a2.obj")]));
    assert_eq!(files_of(&first, &options.limits), Ok(vec![first]));
    assert!(
        load(&folder.path().join("b#.stl"), 1.0).expect_err("no sequences").what.contains("no sequences")
    );
    for fps in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(load(&path, fps).expect_err("no rate").what.contains("files a second"));
    }
    assert!(load(&folder.path().join("c#.obj"), 1.0).is_err());
}
