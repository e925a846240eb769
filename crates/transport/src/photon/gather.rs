//! The light of photons at a surface.

use super::{Near, PhotonMaps};
use crate::bsdf::Bsdf;
use crate::vertex::Vertex;
use crate::wavefront::Context;
use vastlight_math::{Ray, Sampler, Vec3};
use vastlight_simd::{Kernel, Level, Simd8};

/// Cosine between the normals of a photon's surface and the vertex's, below which they are not one surface.
const SAME_SURFACE: f32 = 0.7;

/// The light of photons at a vertex, of those with at most so many segments.
pub(crate) struct Gather<'a> {
    pub(crate) photons: &'a PhotonMaps,
    pub(crate) vertex: &'a Vertex<'a>,
    pub(crate) most_segments: u32,
    /// Where the camera sees the vertex.
    pub(crate) pixel: Option<InPixel>,
}

/// The place of a vertex that the camera sees, in its pixel.
#[derive(Clone, Copy)]
pub(crate) struct InPixel {
    /// By column and by row: from where the pixel's middle is seen, the way on the surface's plane, and the variance of such ways
    /// by the pixel's filter.
    ways: [(Vec3, f32); 2],
}

impl InPixel {
    /// None where the surface is seen almost edge-on.
    pub(crate) fn new(
        context: &Context<'_>,
        vertex: &Vertex<'_>,
        ray: &Ray,
        t: f32,
        sampler: Sampler,
    ) -> Option<Self> {
        let camera = context.camera;
        let steps = camera.steps(ray, t, vertex.surface.normal)?;
        let offset = camera.filter.sample(camera.draw(sampler).filter);
        let way = |step: Vec3, offset: f32| (step * offset, camera.filter.variance() * step.length_squared());
        Some(Self { ways: [way(steps[0], offset.x), way(steps[1], offset.y)] })
    }

    /// The way to where photons with discs of this variance are gathered. Discs blur as the pixel's filter does: so much nearer to
    /// the pixel's middle, both together blur as the filter alone, with less noise. Discs of no size leave the place as it is.
    fn towards_middle(&self, variance: f32) -> Vec3 {
        let part = |(way, own): (Vec3, f32)| way * ((1.0 - variance / own).max(0.0).sqrt() - 1.0);
        part(self.ways[0]) + part(self.ways[1])
    }
}

impl Gather<'_> {
    /// Radiance towards a path from a surface that scatters so.
    #[inline(always)]
    pub(crate) fn scattered<L: Simd8>(&self, level: L, bsdf: &Bsdf) -> Vec3 {
        let vertex = self.vertex;
        let wo = vertex.frame.to_local(vertex.wo);
        self.sum(level, |near| {
            let wi = vertex.local_if_consistent(near.from);
            // The value has the cosine that the power over an area has already.
            wi.map_or(Vec3::ZERO, |wi| bsdf.eval(wo, wi) / near.from.dot(near.normal))
        })
    }

    /// Radiance where `brdf` is that for irradiance from a direction.
    pub(crate) fn reflected(&self, level: Level, brdf: impl Fn(Vec3) -> Vec3) -> Vec3 {
        level.dispatch(Reflected { gather: self, brdf })
    }

    /// The sum of power by area times `brdf`.
    #[inline(always)]
    fn sum<L: Simd8>(&self, level: L, brdf: impl Fn(&Near) -> Vec3) -> Vec3 {
        let mut radiance = Vec3::ZERO;
        let mut add = |near: Near| {
            let same_surface = near.normal.dot(self.vertex.surface.normal).abs() >= SAME_SURFACE;
            if same_surface && near.segments <= self.most_segments && near.from.dot(near.normal) > 0.0 {
                radiance += brdf(&near) * near.flux * near.weight;
            }
        };
        for map in self.photons.maps() {
            let way = self.pixel.map_or(Vec3::ZERO, |pixel| pixel.towards_middle(map.variance()));
            map.near(level, self.vertex.surface.position + way, &mut add);
        }
        radiance
    }
}

/// [`Gather::reflected`], compiled for the machine's instructions.
struct Reflected<'g, 'a, F> {
    gather: &'g Gather<'a>,
    brdf: F,
}

impl<F: Fn(Vec3) -> Vec3> Kernel for Reflected<'_, '_, F> {
    type Output = Vec3;

    #[inline(always)]
    fn run<L: Simd8>(self, level: L) -> Vec3 {
        let facing = self.gather.vertex.facing_normal();
        self.gather.sum(
            level,
            |near| {
                if near.from.dot(facing) > 0.0 { (self.brdf)(near.from) } else { Vec3::ZERO }
            },
        )
    }
}
