//! What is written is what is read again.

use std::path::{Path, PathBuf};
use vastlight_export::{write, write_stream};
use vastlight_import::{LoadOptions, load};
use vastlight_scene::generate::{GenerateOptions, by_name, names, stream};
use vastlight_scene::{Camera, Instance, Projection, Scene, SceneDesc, SceneError, SceneStream};

/// A small version of a demo: the first size that it accepts.
fn demo(name: &str) -> Scene {
    let sizes = [None, Some(20_000)];
    let made = sizes.iter().rev().find_map(|&triangles| {
        by_name(name, &GenerateOptions { triangles, seed: 3, ..GenerateOptions::default() }).ok()
    });
    Scene::new(made.expect("a demo")).expect("valid")
}

fn written(scene: &Scene, directory: &Path, file: &str) -> PathBuf {
    let path = directory.join(file);
    write(scene, &path).expect("writes");
    path
}

fn reloaded(path: &Path) -> Scene {
    let desc: SceneDesc = load(path, &LoadOptions::default()).expect("reads");
    let found: Vec<String> = desc.diagnostics.items().iter().map(ToString::to_string).collect();
    assert!(found.is_empty(), "{}: {found:?}", path.display());
    Scene::new(desc).expect("valid")
}

#[test]
fn glb_gives_back_every_demo() {
    let directory = tempfile::tempdir().expect("a directory");
    for name in names() {
        let scene = demo(name);
        let file = format!("{name}.glb");
        if scene.implicit_mesh().is_some() {
            let error = write(&scene, &directory.path().join(file)).expect_err("no triangles");
            assert!(error.to_string().contains("implicit"), "{error}");
            continue;
        }
        let back = reloaded(&written(&scene, directory.path(), &file));
        assert_eq!(back.meshes().len(), scene.meshes().len(), "{name}");
        assert_eq!(scene.instances().len(), back.instances().len(), "{name}");
        for (a, b) in scene.instances().iter().zip(back.instances().iter()) {
            assert_eq!(a.world_from_object, b.world_from_object, "{name}");
            // A reader may number meshes in the order of use.
            check_mesh(name, &scene.meshes()[a.mesh as usize], &back.meshes()[b.mesh as usize]);
        }
        check_cameras(name, &scene, &back);
        assert_eq!(back.environment(), scene.environment(), "{name}");
        assert_eq!(back.lights(), scene.lights(), "{name}");
        check_materials(name, &scene, &back);
    }
}

/// The same cameras; where a pinhole is in focus does not matter.
fn check_cameras(name: &str, scene: &Scene, back: &Scene) {
    let optics = |camera: &Camera| match camera.projection {
        Projection::Perspective { vertical_fov, lens_radius: 0.0, .. } => (vertical_fov, 0.0, 0.0),
        Projection::Perspective { vertical_fov, lens_radius, focus_distance } => {
            (vertical_fov, lens_radius, focus_distance)
        }
        Projection::Orthographic { half_height } => (0.0, half_height, 0.0),
    };
    assert_eq!(scene.cameras().len(), back.cameras().len(), "{name}");
    for (a, b) in scene.cameras().iter().zip(back.cameras()) {
        let all = |c: &Camera| (c.name.clone(), c.aspect, optics(c), c.world_from_camera);
        assert_eq!(all(a), all(b), "{name}");
    }
}

/// The same triangles with the same attributes and materials.
fn check_mesh(name: &str, a: &vastlight_scene::Mesh, b: &vastlight_scene::Mesh) {
    assert!(corners(a) == corners(b), "{name}/{}: positions", a.name);
    let normals = used(a, &a.normals).into_iter().zip(used(b, &b.normals));
    assert_eq!(a.normals.is_empty(), b.normals.is_empty(), "{name}/{}", a.name);
    // A reader may normalise what it reads.
    assert!(normals.into_iter().all(|(x, y)| x.abs_diff_eq(y, 1e-6)), "{name}/{}: normals", a.name);
    assert!(used(a, &a.colors) == used(b, &b.colors), "{name}/{}: colours", a.name);
    let uvs = |m: &vastlight_scene::Mesh| m.uvs.first().map(|set| used(m, set));
    assert!(uvs(a) == uvs(b), "{name}/{}: coordinates", a.name);
    assert!((0..a.triangles.len() as u32).all(|t| a.material_of(t) == b.material_of(t)), "{name}/{}", a.name);
}

/// Positions of all corners, triangle by triangle.
fn corners(mesh: &vastlight_scene::Mesh) -> Vec<[vastlight_math::Vec3; 3]> {
    (0..mesh.triangles.len() as u32).map(|t| mesh.corners(t)).collect()
}

/// An attribute, corner by corner.
fn used<T: Copy>(mesh: &vastlight_scene::Mesh, values: &[T]) -> Vec<T> {
    if values.is_empty() {
        return Vec::new();
    }
    mesh.triangles.iter().flatten().map(|&i| values[i as usize]).collect()
}

fn check_materials(name: &str, scene: &Scene, back: &Scene) {
    assert_eq!(scene.materials().len(), back.materials().len(), "{name}");
    for (a, b) in scene.materials().iter().zip(back.materials()) {
        let colors =
            |m: &vastlight_scene::Material| [m.base_color, m.emission, m.sheen_color].map(|c| c.factor);
        assert_eq!(colors(a), colors(b), "{name}/{}", a.name);
        if a.thickness > 0.0 {
            assert_eq!(a.attenuation_color, b.attenuation_color, "{name}/{}", a.name);
            assert_eq!(a.attenuation_distance, b.attenuation_distance, "{name}/{}", a.name);
        }
        let numbers = |m: &vastlight_scene::Material| {
            let inputs = [m.metallic, m.roughness, m.specular, m.transmission, m.clearcoat].map(|i| i.factor);
            (inputs, m.ior, m.thickness, m.dispersion, m.anisotropy, m.double_sided, m.iridescence.factor)
        };
        assert_eq!(numbers(a), numbers(b), "{name}/{}", a.name);
        assert_eq!(a.conductor, b.conductor, "{name}/{}", a.name);
        let texture = |s: &Scene, m: &vastlight_scene::Material| {
            let texture = s.textures()[m.base_color.texture? as usize];
            Some((s.images()[texture.image as usize].texels.clone(), texture.transform, texture.wrap))
        };
        assert!(texture(scene, a) == texture(back, b), "{name}/{}: texture", a.name);
    }
}

#[test]
fn ply_holds_all_instances_in_world_space() {
    let directory = tempfile::tempdir().expect("a directory");
    for name in ["cornell", "caustic-sphere"] {
        let scene = demo(name);
        let back = reloaded(&written(&scene, directory.path(), &format!("{name}.ply")));
        assert_eq!(back.unique_triangles(), scene.instanced_triangles(), "{name}");
        let size = scene.bounds().size().length();
        assert!((back.bounds().min - scene.bounds().min).length() < 1e-5 * size, "{name}");
        assert!((back.bounds().max - scene.bounds().max).length() < 1e-5 * size, "{name}");
    }
    let scene = demo("cornell");
    let back = reloaded(&directory.path().join("cornell.ply"));
    let red = back.meshes()[0].colors.iter().find(|c| c.x > 4.0 * c.y).expect("the red wall");
    assert!((red.truncate() - scene.materials()[1].base_color.factor).length() < 0.01);
}

#[test]
fn the_same_scene_is_the_same_bytes() {
    let directory = tempfile::tempdir().expect("a directory");
    for extension in vastlight_export::FORMATS {
        let bytes = |file: &str| {
            std::fs::read(written(&demo("cornell"), directory.path(), &format!("{file}.{extension}")))
                .expect("written")
        };
        let (a, b) = (bytes("a"), bytes("b"));
        // An OBJ names its library.
        assert_eq!(
            String::from_utf8_lossy(&a).replace("a.mtl", "b.mtl"),
            String::from_utf8_lossy(&b),
            "{extension}"
        );
        assert!(a.len() > 500);
    }
    let parts = std::fs::read_dir(directory.path()).expect("lists");
    assert!(parts.flatten().all(|e| !e.file_name().to_string_lossy().ends_with(".part")));
}

#[test]
fn unknown_extensions_and_unwritable_places_are_errors() {
    let scene = demo("cornell");
    let error = write(&scene, Path::new("scene.xyz")).expect_err("no such format");
    assert!(error.to_string().contains(".glb"), "{error}");
    let error = write(&scene, Path::new("no/such/folder/scene.glb")).expect_err("no folder");
    assert!(error.to_string().contains("no/such/folder"), "{error}");
}

#[test]
fn a_stream_is_written_as_the_whole_scene_is() {
    let directory = tempfile::tempdir().expect("a directory");
    let options = GenerateOptions { triangles: Some(20_000), seed: 3, ..GenerateOptions::default() };
    let terrain = || stream("terrain", &options);
    let cornell = || {
        let mut desc = by_name("cornell", &GenerateOptions::default())?;
        let again: Vec<Instance> = desc.instances.iter().rev().copied().collect();
        desc.instances.extend(again);
        Ok(SceneStream::from(desc))
    };
    let makes: [&dyn Fn() -> Result<SceneStream, SceneError>; 2] = [&terrain, &cornell];
    for make in makes {
        let scene = Scene::new(make().expect("made").collect().expect("whole")).expect("valid");
        for extension in vastlight_export::FORMATS {
            let path = |name: &str| directory.path().join(format!("{name}/scene.{extension}"));
            for folder in ["whole", "stream"] {
                std::fs::create_dir_all(directory.path().join(folder)).expect("a folder");
            }
            let lost = write(&scene, &path("whole")).expect("writes");
            let written = write_stream(make, &path("stream")).expect("writes");
            assert_eq!(written.triangles, scene.instanced_triangles());
            assert_eq!(written.lost.items(), lost.items());
            let bytes = |name: &str| std::fs::read(path(name)).expect("written");
            assert!(bytes("whole") == bytes("stream"), "{extension}");
        }
    }
}

#[test]
fn a_stream_too_large_or_broken_leaves_nothing_behind() {
    let directory = tempfile::tempdir().expect("a directory");
    let broken = || {
        let whole = stream("cornell", &GenerateOptions::default())?;
        let pieces = whole.pieces.take(2).chain([Err(SceneError::new("lost its way", "", ""))]);
        Ok(SceneStream { pieces: Box::new(pieces), ..whole })
    };
    let huge = || {
        stream(
            "terrain",
            &GenerateOptions { triangles: Some(4_000_000_000), seed: 0, ..GenerateOptions::default() },
        )
    };
    for (extension, says) in [("glb", "4 GiB"), ("ply", "lost its way"), ("obj", "lost its way")] {
        let path = directory.path().join(format!("scene.{extension}"));
        let error = write_stream(if says == "4 GiB" { &huge } else { &broken }, &path).expect_err("refused");
        assert!(error.to_string().contains(says), "{error}");
        assert!(!path.exists());
    }
    let left = std::fs::read_dir(directory.path()).expect("lists").flatten();
    assert!(left.into_iter().all(|e| e.path().extension().is_some_and(|x| x == "mtl")));
}
