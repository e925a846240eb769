//! The random numbers of many vertices at once.

use crate::wavefront::CAMERA_DIMENSIONS;
use vastlight_math::lanes::{LANES, Lanes, Lanes2, Lanes3};
use vastlight_math::{Sampler, SamplerLanes, warp};

/// Sampler dimensions of a vertex: choice of light, place on it, choice of lobe, direction, roulette.
const VERTEX_DIMENSIONS: u32 = 5;

/// The random numbers of the vertices at one depth, by lane.
pub(super) struct VertexRandom {
    first: u32,
    /// Choice of a light, and the place on it.
    pub(super) light: Lanes,
    pub(super) place: Lanes2,
    /// Choice of a lobe, and the direction.
    pub(super) lobe: Lanes,
    pub(super) direction: Lanes2,
    /// [`warp::cosine_hemisphere`] of the direction's numbers.
    pub(super) cosine: Lanes3,
}

impl VertexRandom {
    #[inline(always)]
    pub(super) fn new(samplers: &SamplerLanes, depth: u32) -> Self {
        let before = depth.wrapping_sub(1).wrapping_mul(VERTEX_DIMENSIONS);
        let first = CAMERA_DIMENSIONS.wrapping_add(before);
        let at = |offset: u32| first.wrapping_add(offset);
        let direction = samplers.points_at(at(3));
        let mut cosine = Lanes3::ZERO;
        for lane in 0..LANES {
            cosine.set(lane, warp::cosine_hemisphere(direction.get(lane)));
        }
        let (light, place) = (samplers.numbers_at(at(0)), samplers.points_at(at(1)));
        Self { first, light, place, lobe: samplers.numbers_at(at(2)), direction, cosine }
    }

    /// The number that decides about a path's end.
    pub(super) fn roulette(&self, sampler: Sampler) -> f32 {
        sampler.at_dimension(self.first.wrapping_add(4)).next_1d()
    }
}
