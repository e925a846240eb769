//! Which camera a picture is taken with.

use crate::Error;
use vastlight_math::Vec3;
use vastlight_scene::{Camera, Projection, Scene};

/// What was asked for. The default is the scene's first camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraChoice {
    /// A camera by name, or by number from 0.
    pub name: Option<String>,
    /// Eye and target in world space; replaces the camera's place and direction.
    pub look_at: Option<[Vec3; 2]>,
    /// Full vertical angle of view, degrees.
    pub fov: Option<f32>,
}

impl CameraChoice {
    /// The camera.
    ///
    /// # Errors
    /// If no camera has the name.
    pub fn resolve(&self, scene: &Scene) -> Result<Camera, Error> {
        self.resolve_among(scene.cameras(), scene)
    }

    /// The camera at the keys of the scene's shutter; none where it is closed.
    ///
    /// # Errors
    /// Those of [`CameraChoice::resolve`].
    pub fn resolve_keys(&self, scene: &Scene) -> Result<Vec<Camera>, Error> {
        let Some(shutter) = scene.shutter() else { return Ok(Vec::new()) };
        shutter.cameras().iter().map(|cameras| self.resolve_among(cameras, scene)).collect()
    }

    fn resolve_among(&self, cameras: &[Camera], scene: &Scene) -> Result<Camera, Error> {
        let mut camera = self.named(cameras)?.clone();
        if let Some([eye, target]) = self.look_at {
            camera = looking_at(&camera, eye, target);
        }
        if let Some(degrees) = self.fov {
            camera.projection = with_fov(&camera, scene, degrees.to_radians());
        }
        Ok(camera)
    }

    fn named<'s>(&self, cameras: &'s [Camera]) -> Result<&'s Camera, Error> {
        let Some(wanted) = &self.name else { return Ok(&cameras[0]) };
        let by_number = || wanted.parse().ok().and_then(|i: usize| cameras.get(i));
        cameras.iter().find(|c| &c.name == wanted).or_else(by_number).ok_or_else(|| {
            let known: Vec<&str> = cameras.iter().map(|c| c.name.as_str()).collect();
            let hint = format!("there are {} (or a number from 0)", known.join(", "));
            Error::scene(format!("no camera is named \"{wanted}\""), "--camera", hint)
        })
    }
}

/// A perspective camera at `eye` that looks at `target`, with the camera's own angle of view if it has one.
fn looking_at(camera: &Camera, eye: Vec3, target: Vec3) -> Camera {
    const DEFAULT_FOV: f32 = 0.7;
    let fov = match camera.projection {
        Projection::Perspective { vertical_fov, .. } => vertical_fov,
        Projection::Orthographic { .. } => DEFAULT_FOV,
    };
    Camera { aspect: camera.aspect, ..Camera::look_at("look-at", eye, target, fov) }
}

/// The camera's projection with another angle of view; a parallel projection becomes a perspective one.
fn with_fov(camera: &Camera, scene: &Scene, vertical_fov: f32) -> Projection {
    match camera.projection {
        Projection::Perspective { lens_radius, focus_distance, .. } => {
            Projection::Perspective { vertical_fov, lens_radius, focus_distance }
        }
        Projection::Orthographic { .. } => Projection::Perspective {
            vertical_fov,
            lens_radius: 0.0,
            focus_distance: scene.bounds().size().length().max(1e-3),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_scene::SceneDesc;

    fn scene() -> Scene {
        let camera = |name: &str, z: f32| Camera::look_at(name, Vec3::new(0.0, 0.0, z), Vec3::ZERO, 1.0);
        let cameras = vec![camera("front", 5.0), camera("far", 50.0)];
        Scene::new(SceneDesc { cameras, ..SceneDesc::default() }).expect("valid")
    }

    #[test]
    fn cameras_are_found_by_name_and_number() {
        let choose = |name: &str| {
            let choice = CameraChoice { name: Some(name.into()), ..CameraChoice::default() };
            choice.resolve(&scene()).map(|c| c.name)
        };
        assert_eq!(choose("far").as_deref(), Ok("far"));
        assert_eq!(choose("1").as_deref(), Ok("far"));
        assert!(choose("2").expect_err("none").hint.contains("front, far"));
        assert_eq!(CameraChoice::default().resolve(&scene()).expect("first").name, "front");
    }

    #[test]
    fn look_at_and_field_of_view_replace_the_cameras() {
        let look_at = Some([Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO]);
        let choice = CameraChoice { name: None, look_at, fov: Some(90.0) };
        let camera = choice.resolve(&scene()).expect("resolved");
        assert_eq!(camera.world_from_camera.translation, Vec3::new(1.0, 2.0, 3.0));
        let Projection::Perspective { vertical_fov, .. } = camera.projection else { panic!("perspective") };
        assert!((vertical_fov - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }
}
