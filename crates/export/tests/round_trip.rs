//! What is written is what is read again.

use std::path::{Path, PathBuf};
use vastlight_export::write;
use vastlight_import::{LoadOptions, load};
use vastlight_scene::generate::{GenerateOptions, by_name, names};
use vastlight_scene::{Scene, SceneDesc};

/// A small version of a demo: the first size that it accepts.
fn demo(name: &str) -> Scene {
    let sizes = [None, Some(20_000)];
    let made =
        sizes.iter().rev().find_map(|&triangles| by_name(name, &GenerateOptions { triangles, seed: 3 }).ok());
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
        let back = reloaded(&written(&scene, directory.path(), &format!("{name}.glb")));
        assert_eq!(back.meshes().len(), scene.meshes().len(), "{name}");
        assert_eq!(scene.instances().len(), back.instances().len(), "{name}");
        for (a, b) in scene.instances().iter().zip(back.instances()) {
            assert!(a.world_from_object.abs_diff_eq(b.world_from_object, 1e-5), "{name}");
            // A reader may number meshes in the order of use.
            check_mesh(name, &scene.meshes()[a.mesh as usize], &back.meshes()[b.mesh as usize]);
        }
        for (a, b) in scene.cameras().iter().zip(back.cameras()) {
            assert_eq!((&a.name, a.aspect), (&b.name, b.aspect), "{name}");
            assert!(a.world_from_camera.abs_diff_eq(b.world_from_camera, 1e-4), "{name}");
        }
        check_materials(name, &scene, &back);
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
        let near = |x: vastlight_math::Vec3, y| {
            assert!(x.abs_diff_eq(y, 1e-5 * x.max_element().max(1.0)), "{name}/{}", a.name)
        };
        near(a.base_color.factor, b.base_color.factor);
        near(a.emission.factor, b.emission.factor);
        near(a.sheen_color.factor, b.sheen_color.factor);
        if a.thickness > 0.0 {
            near(a.attenuation_color, b.attenuation_color);
            assert_eq!(a.attenuation_distance, b.attenuation_distance, "{name}/{}", a.name);
        }
        let numbers = |m: &vastlight_scene::Material| {
            let inputs = [m.metallic, m.roughness, m.specular, m.transmission, m.clearcoat].map(|i| i.factor);
            (inputs, m.ior, m.thickness, m.dispersion, m.anisotropy, m.double_sided, m.iridescence.factor)
        };
        assert_eq!(numbers(a), numbers(b), "{name}/{}", a.name);
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
