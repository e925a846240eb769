//! Cameras.

use serde::{Deserialize, Serialize};
use vastlight_math::{Aabb, Affine3, Vec3};

/// How a camera maps directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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

    /// A camera from which the whole of `bounds` is seen in any picture that is at least as wide as high, from the
    /// front, a little right and above.
    #[must_use]
    pub fn framing(bounds: &Aabb) -> Self {
        /// Tangent of half the angle of view, and the part of it that the bounds may fill.
        const HALF_HEIGHT: f32 = 0.309_336_25;
        const FILLED: f32 = 0.92;
        let bounds = if bounds.is_empty() { Aabb { min: -Vec3::ONE, max: Vec3::ONE } } else { *bounds };
        let direction = Vec3::new(0.5, 0.38, 1.0).normalize();
        let camera = Self::look_at("framing", direction, Vec3::ZERO, 0.6);
        let camera_from_world = camera.world_from_camera.matrix3.transpose();
        let half = bounds.size() * 0.5;
        let needed = |i: u32| {
            let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = camera_from_world * (half * Vec3::new(sign(0), sign(1), sign(2)));
            corner.x.abs().max(corner.y.abs()) / (HALF_HEIGHT * FILLED) + corner.z
        };
        let distance = (0..8).map(needed).fold(1e-20, f32::max);
        Self::look_at("framing", bounds.center() + direction * distance, bounds.center(), 0.6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest of |x| and |y| over the corners of `bounds`, in units of half the picture's height.
    fn extent(bounds: &Aabb) -> f32 {
        let camera = Camera::framing(bounds);
        let camera_from_world = camera.world_from_camera.inverse();
        let corner = |i: u32| {
            let pick =
                |bit: u32, axis: usize| if i >> bit & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            let p = camera_from_world.transform_point3(Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2)));
            assert!(p.z < 0.0, "behind the camera");
            p.x.abs().max(p.y.abs()) / (-p.z * 0.3_f32.tan())
        };
        (0..8).map(corner).fold(0.0, f32::max)
    }

    #[test]
    fn the_framing_shows_the_bounds_and_fills_the_picture() {
        let boxes = [
            [1.0, 1.0, 1.0],
            [10.0, 0.1, 0.1],
            [0.1, 10.0, 0.1],
            [0.1, 0.1, 10.0],
            [1e-6, 2e-6, 0.0],
            [1e9, 1e8, 1e7],
        ];
        for size in boxes {
            let min = Vec3::new(-3.0, 2.0, 5.0) * size[0];
            let extent = extent(&Aabb { min, max: min + Vec3::from_array(size) });
            assert!((extent - 0.92).abs() < 0.01, "{size:?}: {extent}");
        }
    }

    #[test]
    fn points_and_nothing_have_a_camera() {
        for bounds in [Aabb::EMPTY, Aabb::point(Vec3::ONE)] {
            assert!(Camera::framing(&bounds).world_from_camera.is_finite());
        }
    }
}
