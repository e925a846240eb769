//! The length of camera rays' ways through acceleration structures, as radiance: for looking at where a structure costs much.

use crate::vertex::Vertex;
use crate::wavefront::{PathState, Shade, ShadeInput, Stage};
use vastlight_math::Vec3;
use vastlight_simd::Simd8;

/// The shader of steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Steps;

impl Shade for Steps {
    #[inline(always)]
    fn shade<L: Simd8>(&self, _level: L, stage: &mut Stage<'_>) {
        stage.one_by_one(|at, path, _| shade(at, path));
    }
}

fn shade(at: ShadeInput<'_>, path: &PathState) {
    let ShadeInput { context, ray, hit, page, sample, .. } = at;
    let mut steps = [0];
    context.tracer.steps(&[ray], &mut steps);
    sample.radiance = Vec3::splat(steps[0] as f32);
    if hit.is_hit() {
        let (mut own_material, mut own_bsdf) = (None, None);
        let vertex = Vertex::new(context, (&ray, path.cone), &hit, page, &mut own_material);
        vertex.describe(context, vertex.bsdf(context, path, &mut own_bsdf), &ray, &hit, sample);
    }
}
