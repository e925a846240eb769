//! Scenes mesh by mesh against the same as a whole, from memory and from disk.

use super::builder::{Builder, load_bytes};
use crate::blob::MOST_IN_MEMORY;
use crate::gltf;
use crate::{LoadOptions, Streamed};
use serde_json::json;
use vastlight_scene::{SceneDesc, SceneStream};

/// Meshes of different size, some placed several times, and one without a surface.
fn many_meshes(vertices: usize) -> Builder {
    let mut file = Builder::new();
    for number in 0..5 {
        let count = vertices / (number + 1);
        let positions: Vec<[f32; 3]> =
            (0..count).map(|i| [i as f32, (i * i % 97) as f32, number as f32]).collect();
        let indices: Vec<u16> = (0..3 * count).map(|i| (i * 7 % count) as u16).collect();
        let (positions, indices) = (file.positions(&positions), file.indices(&indices));
        let mode = if number == 3 { 1 } else { 4 };
        file.mesh(json!([{"attributes": {"POSITION": positions}, "indices": indices, "mode": mode}]));
    }
    for node in 0..12 {
        let name = format!("node {node}");
        file.node(json!({"mesh": node * 7 % 5, "translation": [node, 0, 0], "name": name}));
    }
    file
}

fn collected(streamed: Streamed) -> SceneDesc {
    assert!(streamed.large.is_empty());
    streamed.stream.collect().expect("sound")
}

#[test]
fn a_file_on_disk_is_the_same_mesh_by_mesh() {
    let folder = tempfile::tempdir().expect("a folder");
    for vertices in [100, 60_000] {
        let glb = many_meshes(vertices).glb();
        assert_eq!(glb.len() as u64 > MOST_IN_MEMORY, vertices > 100);
        let path = folder.path().join("test.glb");
        std::fs::write(&path, &glb).expect("written");
        let options = LoadOptions::default();
        let whole = load_bytes(&glb, &options);
        assert_eq!((whole.meshes.len(), whole.diagnostics.first_error()), (5, None));
        let (from_disk, _) = gltf::load(&path, &options).expect("read");
        assert_eq!(from_disk.meshes, whole.meshes);
        assert_eq!(from_disk.diagnostics.items().len(), whole.diagnostics.items().len());
        let expected = SceneStream::from(whole).collect().expect("sound");
        let streamed = gltf::stream(&path, &options).expect("read");
        let triangles: usize = expected.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        assert_eq!(streamed.stream.triangles, Some(triangles as u64));
        let size = gltf::file_size(&path, &options).expect("read");
        assert_eq!((size.triangles, size.instances), (triangles as u64, expected.instances.len() as u64));
        let found = collected(streamed);
        assert_eq!(found.meshes, expected.meshes);
        assert_eq!(found.instances, expected.instances);
        assert_eq!(found.names, expected.names);
        assert_eq!(found.diagnostics.items().len(), expected.diagnostics.items().len());
    }
}

#[test]
fn files_that_move_are_streamed_with_what_moves_them_and_name_the_same_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("test.gltf");
    let mut file = Builder::triangle();
    let moved = file.floats(&[[1.0_f32; 3]; 2], "VEC3");
    file.channel(0, "translation", "LINEAR", &[0.0, 1.0], moved);
    let up = file.positions(&[[0.0, 0.0, 1.0]; 3]);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": up}]);
    let weights = file.floats(&[[0.0_f32], [1.0]], "SCALAR");
    file.channel(0, "weights", "LINEAR", &[0.0, 1.0], weights);
    file.node(json!({"mesh": 0}));
    file.json["buffers"] = json!([{"uri": "test.bin", "byteLength": file.bin.len()}]);
    std::fs::write(&path, file.json.to_string()).expect("written");
    std::fs::write(folder.path().join("test.bin"), &file.bin).expect("written");
    let options = LoadOptions::default();
    let (desc, files) = crate::load_with_files(&path, &options).expect("read");
    assert!(desc.motion.is_some(), "{:?}", desc.diagnostics);
    assert_eq!(files, [folder.path().join("test.bin")]);
    let streamed = gltf::stream(&path, &options).expect("read");
    assert_eq!(streamed.files, files);
    let collected = collected(streamed);
    assert_eq!((desc.meshes.len(), &collected.meshes), (2, &desc.meshes));
    let [whole, by_mesh] = [&desc, &collected].map(|desc| desc.motion.clone().expect("moves"));
    let record = whole.record().expect("can be kept");
    let read = crate::gltf_motion(&record, &desc).expect("sound").expect("a document's");
    for time in [0.0, 0.3, 1.0] {
        let pose = whole.pose(time).expect("a moment");
        assert_eq!(by_mesh.pose(time).expect("a moment"), pose);
        assert_eq!(read.pose(time).expect("a moment"), pose);
    }
    assert_ne!(whole.pose(0.0), whole.pose(0.3));
    let other = vastlight_scene::MotionRecord { kind: "demo:walker".into(), ..record };
    assert!(crate::gltf_motion(&other, &desc).expect("not read").is_none());
}

#[test]
fn keys_that_many_nodes_share_are_recorded_once() {
    let record_of = |nodes: usize| {
        let mut file = Builder::triangle();
        let times: Vec<f32> = (0..1000).map(|i| i as f32).collect();
        let moved = file.floats(&vec![[1.0_f32; 3]; 1000], "VEC3");
        file.channel(0, "translation", "LINEAR", &times, moved);
        for _ in 1..nodes {
            let node = file.node(json!({"mesh": 0}));
            let channel = json!({"sampler": 0, "target": {"node": node, "path": "translation"}});
            file.json["animations"][0]["channels"].as_array_mut().expect("a list").push(channel);
        }
        let desc = file.load_clean();
        let motion = desc.motion.clone().expect("moves");
        assert_eq!(motion.pose(0.5).expect("a moment").instances.len(), nodes);
        motion.record().expect("can be kept").bytes.len()
    };
    let (few, many) = (record_of(1), record_of(41));
    assert!(few > 12_000 && many < few + 40 * 300, "{few} {many}");
}

#[test]
fn keys_that_nothing_follows_are_not_recorded() {
    let record_of = |used: usize, unused: bool| {
        let mut file = Builder::triangle();
        let other = file.node(json!({"mesh": 0}));
        file.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [other]}]);
        let mut moved = |node: usize, path: &str, width: usize, times: usize| {
            let times: Vec<f32> = (0..times).map(|i| i as f32).collect();
            let values = match width {
                3 => file.floats(&vec![[used as f32; 3]; times.len()], "VEC3"),
                _ => file.floats(&vec![[0.0, 0.0, 0.0, 1.0]; times.len()], "VEC4"),
            };
            file.channel(node, path, "LINEAR", &times, values);
        };
        if unused {
            // Of a node of another scene, and of no property.
            moved(other, "translation", 3, 1000);
            moved(0, "colour", 3, 1000);
        }
        moved(0, "rotation", 4, 1000);
        moved(0, "translation", 3, 1000);
        let desc = file.load_clean();
        let motion = desc.motion.clone().expect("moves");
        let record = motion.record().expect("can be kept");
        let again = gltf::motion(&record, &desc).expect("sound").expect("a document's");
        let poses = [motion.pose(0.5), again.pose(0.5)].map(|pose| pose.expect("a moment").instances);
        assert_eq!(poses[0], poses[1]);
        assert_eq!(poses[0][0].1.translation.x, used as f32);
        record.bytes.len()
    };
    assert_eq!(record_of(3, true), record_of(3, false));
}

#[test]
fn instances_that_are_sorted_by_mesh_move_as_before() {
    // Nodes of all meshes stand among each other; two of them move.
    let mut file = many_meshes(100);
    let up = file.floats(&[[0.0_f32; 3], [0.0, 2.0, 0.0]], "VEC3");
    file.channel(10, "translation", "LINEAR", &[0.0, 1.0], up);
    file.channel(11, "translation", "LINEAR", &[0.0, 1.0], up);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("test.glb");
    std::fs::write(&path, file.glb()).expect("written");
    let desc = crate::load(&path, &LoadOptions::default()).expect("read");
    let sorted = collected(gltf::stream(&path, &LoadOptions::default()).expect("read"));
    assert_ne!(desc.instances, sorted.instances, "they are sorted");
    let moved = |desc: &SceneDesc| {
        let desc = desc.clone().at(0.5).expect("a moment");
        let mut all = desc.instances;
        all.sort_by_key(|i| i.mesh);
        all
    };
    assert_eq!(moved(&desc), moved(&sorted));
    let record = sorted.motion.clone().expect("moves").record().expect("can be kept");
    let order = |i: usize| (desc.instances[i].mesh, i);
    let place = |old: usize| (0..desc.instances.len()).filter(|&i| order(i) < order(old)).count() as u32;
    assert_eq!(record.numbers, [[10, place(10)], [11, place(11)]]);
    let read = crate::gltf_motion(&record, &desc).expect("sound").expect("a document's");
    let read = SceneDesc { motion: Some(vastlight_scene::renumbered(read, record.numbers)), ..sorted };
    assert_eq!(moved(&desc), moved(&read));
}

#[test]
fn pieces_can_be_passed_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("test.glb");
    std::fs::write(&path, many_meshes(100).glb()).expect("written");
    let all = collected(gltf::stream(&path, &LoadOptions::default()).expect("read"));
    let mut pieces = gltf::stream(&path, &LoadOptions::default()).expect("read").stream.pieces;
    let third = pieces.nth(2).expect("a piece").expect("sound");
    assert_eq!(third.mesh, all.meshes[2]);
    assert_eq!(third.instances.len(), all.instances.iter().filter(|i| i.mesh == 2).count());
}

#[test]
fn a_file_that_is_cut_off_while_it_is_read_is_an_error_of_its_mesh() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("test.glb");
    let glb = many_meshes(60_000).glb();
    std::fs::write(&path, &glb).expect("written");
    let mut pieces = gltf::stream(&path, &LoadOptions::default()).expect("read").stream.pieces;
    std::fs::write(&path, &glb[..glb.len() / 2]).expect("written");
    let error = pieces.find_map(Result::err).expect("an error");
    assert!(error.to_string().contains("cannot be read"), "{error}");
}

#[test]
fn what_is_wrong_with_a_file_is_said_before_its_meshes() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("test.glb");
    let mut file = many_meshes(100);
    file.json["meshes"][1]["primitives"][0]["indices"] = json!(77);
    std::fs::write(&path, file.glb()).expect("written");
    let streamed = gltf::stream(&path, &LoadOptions::default()).expect("read");
    assert!(streamed.stream.desc.diagnostics.first_error().is_some());
}

#[test]
fn the_text_says_how_large_a_file_is_whatever_it_promises() {
    let folder = tempfile::tempdir().expect("a folder");
    ::image::DynamicImage::new_rgb8(1000, 900).save(folder.path().join("large.png")).expect("written");
    let many = 9_000_000_000_000_000_u64;
    let primitive = json!({"attributes": {"POSITION": 0}, "mode": 5});
    let copies = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}});
    let size = |primitives: usize| {
        let text = json!({
            "asset": {"version": "2.0"},
            "accessors": [{"componentType": 5126, "count": many, "type": "VEC3"}],
            "meshes": [{"primitives": vec![primitive.clone(); primitives]}],
            "nodes": [{"mesh": 0}, {"mesh": 0, "extensions": copies.clone()}, {}],
            "images": [{"uri": "large.png"}],
        });
        let path = folder.path().join("test.gltf");
        std::fs::write(&path, text.to_string()).expect("written");
        gltf::file_size(&path, &LoadOptions::default()).expect("read")
    };
    let (one, beyond) = (size(1), size(2100));
    assert_eq!((one.triangles, one.instances, one.image_bytes), (many - 2, many + 1, 2_700_000));
    assert_eq!(one.image_working_bytes, (1 << 20) + 8 * 3000);
    assert!(one.streaming_bytes > 100 * many && one.streaming_bytes < u64::MAX);
    assert_eq!((beyond.triangles, beyond.streaming_bytes), (u64::MAX, u64::MAX));
}
