//! The light of photons at a vertex of a path.

use super::{Near, PhotonMaps};
use crate::bsdf::Bsdf;
use crate::vertex::Vertex;
use vastlight_math::Vec3;
use vastlight_simd::Simd8;

/// Cosine between the normals of a photon's surface and the vertex's, below which they are not one surface.
const SAME_SURFACE: f32 = 0.7;

/// Radiance towards the path: that of photons with at most so many segments.
#[inline(always)]
pub(crate) fn gather<L: Simd8>(
    level: L,
    photons: &PhotonMaps,
    vertex: &Vertex<'_>,
    bsdf: &Bsdf,
    most_segments: u32,
) -> Vec3 {
    let wo = vertex.frame.to_local(vertex.wo);
    let mut radiance = Vec3::ZERO;
    let mut add = |near: Near| {
        if near.segments > most_segments || near.normal.dot(vertex.surface.normal).abs() < SAME_SURFACE {
            return;
        }
        let Some(wi) = vertex.local_if_consistent(near.from) else { return };
        let cos = near.from.dot(near.normal);
        if cos > 0.0 {
            // The value has the cosine that the power over an area has already.
            radiance += bsdf.eval(wo, wi) * near.flux * (near.weight / cos);
        }
    };
    photons.maps().iter().for_each(|map| map.near(level, vertex.surface.position, &mut add));
    radiance
}
