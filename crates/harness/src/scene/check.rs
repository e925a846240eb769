//! What must hold of every scene.

use crate::scratch::{Scratch, options};
use std::sync::atomic::AtomicBool;
use vastlight::import::load;
use vastlight::scene::{Environment, Image, Mesh, Scene, Texels, is_usable};
use vastlight::transport::RenderSettings;
use vastlight::{CameraChoice, Control, OpenScene, RenderRequest, export, render};

/// Scenes beyond this are not traced: a fuzzer needs many runs a second.
const MOST_TRIANGLES: u64 = 4000;

/// Whether a scene is small enough for slow checks.
fn is_small(scene: &Scene) -> bool {
    scene.unique_triangles() <= MOST_TRIANGLES
        && scene.instanced_triangles() <= 4 * MOST_TRIANGLES
        && scene.instances().len() <= 1000
}

/// Tables lead nowhere but into each other, and numbers are finite.
pub(crate) fn scene(scene: &Scene) {
    let materials = scene.materials().len();
    assert!(materials > 0 && !scene.cameras().is_empty());
    scene.meshes().iter().for_each(|found| mesh(found, materials));
    scene.images().iter().for_each(image);
    let images = scene.images().len();
    assert!(scene.textures().iter().all(|texture| (texture.image as usize) < images));
    for instance in scene.instances().iter() {
        assert!((instance.mesh as usize) < scene.meshes().len() && instance.world_from_object.is_finite());
        let _ = scene.name(instance.name);
    }
    for light in scene.lights() {
        assert!(light.intensity.is_finite() && light.world_from_light.is_finite(), "{light:?}");
    }
    for camera in scene.cameras() {
        assert!(camera.world_from_camera.is_finite(), "{camera:?}");
    }
    let bounds = scene.bounds();
    assert!(bounds.is_empty() || bounds.min.is_finite() && bounds.max.is_finite());
}

fn mesh(mesh: &Mesh, materials: usize) {
    let vertices = mesh.positions.len();
    let fits = |length: usize| length == 0 || length == vertices;
    assert!(fits(mesh.normals.len()) && fits(mesh.tangents.len()) && fits(mesh.colors.len()));
    assert!(mesh.uvs.iter().all(|set| set.len() == vertices));
    assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
    assert!(mesh.triangles.iter().flatten().all(|&i| is_usable(mesh.positions[i as usize])));
    assert!(mesh.parts.is_sorted_by_key(|part| part.first_triangle));
    assert!(mesh.parts.iter().all(|part| (part.material as usize) < materials));
}

/// An image has as many numbers as its size says.
pub(crate) fn image(image: &Image) {
    let numbers = match &image.texels {
        Texels::U8(texels) => texels.len(),
        Texels::U16(texels) => texels.len(),
        Texels::F32(texels) => texels.len(),
    };
    let texels = image.width as usize * image.height as usize;
    assert!(texels > 0 && (1..=4).contains(&image.channels));
    assert_eq!(numbers, texels * usize::from(image.channels), "{}", image.name);
}

/// A scene that moves does so at any moment; it is left within its movement.
pub(crate) fn moments(found: &mut Scene) {
    let Some(motion) = found.motion().cloned() else { return };
    if !is_small(found) {
        return;
    }
    for time in [0.0, 1e9, -1.0, 0.37] {
        let Ok(pose) = motion.pose(time) else { continue };
        if found.pose(pose).is_ok() {
            scene(found);
        }
    }
}

/// Written as PLY and read again, it has as many triangles.
pub(crate) fn written_again(scene: &Scene) {
    if !is_small(scene) || scene.instanced_triangles() == 0 {
        return;
    }
    let scratch = Scratch::with(&[]);
    let path = scratch.path("again.ply");
    if export::write(scene, &path).is_err() {
        return;
    }
    let again = load(&path, &options()).expect("what is written can be read");
    let triangles: usize = again.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    assert_eq!(triangles as u64, scene.instanced_triangles());
}

/// A picture of a few pixels is finite; skies are too slow for every run.
pub(crate) fn rendered(scene: &Scene) {
    if is_small(scene) && !matches!(scene.environment(), Environment::Sky(_)) {
        picture(&scene.clone().into());
    }
}

/// Renders a few pixels of a scene that is small.
pub(crate) fn picture(open: &OpenScene) {
    let Ok(camera) = CameraChoice::default().resolve(&open.scene) else { return };
    let settings = RenderSettings { max_depth: 3, ..RenderSettings::new(camera, 4, 3) };
    let request = RenderRequest::new(settings, 1);
    let Ok(rendered) = render(open, &request, &Control::new(&AtomicBool::new(false), &|_| {})) else {
        return;
    };
    let picture = rendered.develop();
    let mut values = picture.planes.iter().flat_map(|plane| &plane.values);
    assert!(values.all(|value| value.is_finite()), "the picture is not finite");
}
