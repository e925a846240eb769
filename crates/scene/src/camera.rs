//! Cameras.

use vastlight_math::{Aabb, Affine3, Vec3};

/// How a camera maps directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A thin lens.
    Perspective {
        /// Full vertical angle of view, radians.
        vertical_fov: f32,
        /// Radius of the lens in scene units; 0 is a pinhole.
        lens_radius: f32,
        /// Distance to the plane in focus along the view axis, scene units.
        focus_distance: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the picture's height in scene units.
        half_height: f32,
    },
}

/// A camera looks along its own -z, with +y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name, for `--camera`.
    pub name: String,
    /// Place and direction.
    pub world_from_camera: Affine3,
    /// Projection.
    pub projection: Projection,
    /// Width over height that the file asks for, if it does; the picture's own shape wins.
    pub aspect: Option<f32>,
}

impl Camera {
    /// A pinhole camera at `eye` that looks at `target` with +y up (or +z up when it looks along y).
    #[must_use]
    pub fn look_at(name: impl Into<String>, eye: Vec3, target: Vec3, vertical_fov: f32) -> Self {
        let forward = (target - eye).try_normalize().unwrap_or(Vec3::NEG_Z);
        let up_hint = if forward.y.abs() > 0.9999 { Vec3::NEG_Z } else { Vec3::Y };
        let right = forward.cross(up_hint).normalize();
        let up = right.cross(forward);
        Self {
            name: name.into(),
            world_from_camera: Affine3::from_cols(right, up, -forward, eye),
            projection: Projection::Perspective {
                vertical_fov,
                lens_radius: 0.0,
                focus_distance: (target - eye).length().max(f32::MIN_POSITIVE),
            },
            aspect: None,
        }
    }

    /// A camera from which the whole of `bounds` is seen, from the front, a little right and above.
    #[must_use]
    pub fn framing(bounds: &Aabb) -> Self {
        let fov = 0.6_f32;
        let (center, radius) = if bounds.is_empty() {
            (Vec3::ZERO, 1.0)
        } else {
            (bounds.center(), (bounds.size().length() * 0.5).max(1e-20))
        };
        let direction = Vec3::new(0.5, 0.38, 1.0).normalize();
        Self::look_at("framing", center + direction * (radius / 0.2955), center, fov)
    }
}
