//! Ambient occlusion: the cosine-weighted part of the hemisphere over the first surface in which nothing stands nearer
//! than a distance. White is open; rays that leave the scene are white.

use crate::vertex::Vertex;
use crate::wavefront::{CAMERA_DIMENSIONS, PathState, Shade, ShadeInput, ShadowQueue, Stage};
use vastlight_math::{FAR, Frame, Ray, Vec3, warp};
use vastlight_scene::Scene;
use vastlight_simd::Simd8;

/// The ambient-occlusion shader.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AmbientOcclusion {
    distance: f32,
}

impl AmbientOcclusion {
    /// Looks as far as [`distance`] of these says.
    pub(crate) fn new(scene: &Scene, wanted: f32) -> Self {
        Self { distance: distance(scene, wanted) }
    }
}

/// The distance wanted, or for 0 a fifth of the scene's diagonal.
pub(crate) fn distance(scene: &Scene, wanted: f32) -> f32 {
    let diagonal = scene.bounds().size().length();
    let distance = if wanted > 0.0 { wanted } else { 0.2 * diagonal };
    if distance > 0.0 { distance.min(FAR) } else { FAR }
}

impl Shade for AmbientOcclusion {
    #[inline(always)]
    fn shade<L: Simd8>(&self, _level: L, stage: &mut Stage<'_>) {
        stage.one_by_one(|at, path, shadows| self.shade_one(at, path, shadows));
    }
}

impl AmbientOcclusion {
    fn shade_one(&self, at: ShadeInput<'_>, path: &PathState, shadows: &mut ShadowQueue) {
        let ShadeInput { context, depth, ray, hit, page, sample } = at;
        if !hit.is_hit() {
            sample.radiance = Vec3::ONE;
            return;
        }
        let (mut own_material, mut own_bsdf) = (None, None);
        let vertex = Vertex::new(context, (&ray, path.cone), &hit, page, &mut own_material);
        vertex.describe(context, vertex.bsdf(context, path, &mut own_bsdf), &ray, &hit, sample);
        let u = path.sampler.at_dimension(CAMERA_DIMENSIONS).next_2d();
        let direction = Frame::from_z(vertex.facing_normal()).to_outer(warp::cosine_hemisphere(u));
        if direction.dot(vertex.facing_side()) <= 0.0 {
            return;
        }
        let occlusion = Ray { t_max: self.distance, ..vertex.ray_towards(direction, ray.time) };
        shadows.push(path.slot, path.shadow_key(depth), occlusion, Vec3::ONE);
    }
}
