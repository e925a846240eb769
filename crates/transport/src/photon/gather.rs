//! The light of photons at a surface.

use super::{Near, PhotonMaps};
use crate::bsdf::Bsdf;
use crate::vertex::Vertex;
use vastlight_math::Vec3;
use vastlight_simd::{Kernel, Level, Simd8};

/// Cosine between the normals of a photon's surface and the vertex's, below which they are not one surface.
const SAME_SURFACE: f32 = 0.7;

/// The light of photons at a vertex, of those with at most so many segments.
pub(crate) struct Gather<'a> {
    pub(crate) photons: &'a PhotonMaps,
    pub(crate) vertex: &'a Vertex<'a>,
    pub(crate) most_segments: u32,
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
        self.photons.maps().iter().for_each(|map| map.near(level, self.vertex.surface.position, &mut add));
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
