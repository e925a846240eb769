//! The first surface under a light at the camera: shape and base colour, for looking at models without lights.
//!
//! Radiance is `emission + albedo * (0.2 + 0.8 |n . wo|)`, where the ray leaves the scene a neutral gradient. All
//! values lie near 0..1 whatever the scene's own lights are.

use crate::vertex::Vertex;
use crate::wavefront::{PathState, Shade, ShadeInput, Stage};
use vastlight_math::Vec3;
use vastlight_simd::Simd8;

/// The primary-ray shader.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Primary;

impl Shade for Primary {
    #[inline(always)]
    fn shade<L: Simd8>(&self, _level: L, stage: &mut Stage<'_>) {
        stage.one_by_one(|at, path, _| shade(at, path));
    }
}

fn shade(at: ShadeInput<'_>, path: &PathState) {
    let ShadeInput { context, ray, hit, page, sample, .. } = at;
    if !hit.is_hit() {
        sample.radiance = Vec3::splat(0.35 + 0.25 * ray.direction.y.clamp(-1.0, 1.0));
        return;
    }
    let (mut own_material, mut own_bsdf) = (None, None);
    let vertex = Vertex::new(context, (&ray, path.cone), &hit, page, &mut own_material);
    let bsdf = vertex.bsdf(context, path, &mut own_bsdf);
    vertex.describe(context, bsdf, &ray, &hit, sample);
    let facing = vertex.facing_normal().dot(vertex.wo).max(0.0);
    sample.radiance = vertex.emission(context) + bsdf.albedo() * (0.2 + 0.8 * facing);
}
