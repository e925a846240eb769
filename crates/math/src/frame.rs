//! Orthonormal frames.

use glam::Vec3;

/// A right-handed orthonormal frame; `z` is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent.
    pub y: Vec3,
    /// Normal.
    pub z: Vec3,
}

impl Frame {
    /// A frame around the unit vector `z`, without a branch at the poles (Duff et al. 2017, "Building an orthonormal
    /// basis, revisited").
    #[inline(always)]
    #[must_use]
    pub fn from_z(z: Vec3) -> Self {
        let sign = 1.0_f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// A frame around the unit vector `z` whose `x` is as near to `tangent` as it can be; any frame if they are
    /// parallel or `tangent` is zero.
    #[must_use]
    pub fn from_z_and_tangent(z: Vec3, tangent: Vec3) -> Self {
        let x = tangent - z * z.dot(tangent);
        let length_squared = x.length_squared();
        if length_squared.is_finite() && length_squared > 1e-12 * tangent.length_squared() {
            let x = x / length_squared.sqrt();
            Self { x, y: z.cross(x), z }
        } else {
            Self::from_z(z)
        }
    }

    /// From this frame's coordinates to the outer ones.
    #[inline(always)]
    #[must_use]
    pub fn to_outer(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// From outer coordinates to this frame's.
    #[inline(always)]
    #[must_use]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }
}
