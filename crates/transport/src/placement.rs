//! What shading needs of an instance's matrix beside the matrix itself.

use crate::words::Words;
use rayon::prelude::*;
use vastlight_math::{Affine3, Mat3, Vec3};
use vastlight_scene::{Instances, Scene};

/// Roundings between a hit and the next ray's intersection, in units of f32's epsilon times the largest coordinate on
/// the way. Found by search (`rays_leave_their_own_triangle`) and doubled.
const ERROR_FACTOR: f32 = 4.0 * f32::EPSILON;

/// An instance's way to the world: 52 bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// The transposed inverse of the matrix up to a positive factor; for a mirrored instance too.
    normals: Mat3,
    /// 1, or -1 for a mirrored instance.
    pub(crate) handedness: f32,
    /// Largest row sum of the matrix' absolute values.
    norm: f32,
    /// The same times that of the inverse, at least 1, times the error of one rounding.
    spread: f32,
    /// Largest absolute coordinate of the translation.
    translation: f32,
}

/// The placements of a scene's instances: of at most [`Instances::AT_HAND`]; those of larger scenes are found at each hit.
#[derive(Clone, Debug)]
pub(crate) struct Placements(Vec<Placement>);

impl Placements {
    pub(crate) fn new(scene: &Scene) -> Self {
        let maps = scene.instances().maps();
        let at_hand = if maps.len() <= Instances::AT_HAND { maps } else { &[] };
        Self(at_hand.par_iter().map(Placement::new).collect())
    }

    /// That of an instance, whose matrix this is.
    #[inline(always)]
    pub(crate) fn get(&self, world_from_object: &Affine3, instance: u32) -> Placement {
        match self.0.get(instance as usize) {
            Some(placement) => *placement,
            None => Placement::new(world_from_object),
        }
    }
}

impl Placement {
    pub(crate) fn new(map: &Affine3) -> Self {
        let linear = Mat3::from_cols(map.x_axis, map.y_axis, map.z_axis);
        let largest = linear.x_axis.abs().max(linear.y_axis.abs()).max(linear.z_axis.abs()).max_element();
        let (x, y, z) = (linear.x_axis / largest, linear.y_axis / largest, linear.z_axis / largest);
        let (cx, cy, cz) = (y.cross(z), z.cross(x), x.cross(y));
        let determinant = x.dot(cx);
        let handedness = 1.0_f32.copysign(determinant);
        // The rows of the inverse are the cofactor columns over the determinant.
        let row_sum = |v: Vec3| v.abs().element_sum();
        let inverse_norm = row_sum(cx).max(row_sum(cy)).max(row_sum(cz)) / (determinant.abs() * largest);
        let norm = (linear.x_axis.abs() + linear.y_axis.abs() + linear.z_axis.abs()).max_element();
        Self {
            normals: Mat3::from_cols(cx * handedness, cy * handedness, cz * handedness),
            handedness,
            norm,
            spread: ERROR_FACTOR * (norm * inverse_norm).max(1.0),
            translation: map.translation.abs().max_element(),
        }
    }

    /// Appends the map of normals, handedness and the three numbers of error bounds.
    pub(crate) fn put(&self, words: &mut Words) {
        words.f32s(&self.normals.to_cols_array());
        words.f32s(&[self.handedness, self.norm, self.spread, self.translation]);
    }

    /// A normal in world space, unit; `fallback` where it has none.
    #[inline(always)]
    pub(crate) fn normal(&self, normal: Vec3, fallback: Vec3) -> Vec3 {
        (self.normals * normal).normalize_or(fallback)
    }

    /// Bound of the error of a coordinate, there and back.
    #[inline(always)]
    pub(crate) fn error(&self, [a, b, c]: [Vec3; 3], position: Vec3) -> f32 {
        let object = a.abs().max(b.abs()).max(c.abs()).max_element();
        let world = self.norm * object + self.translation + position.abs().max_element();
        self.spread * world
    }
}
