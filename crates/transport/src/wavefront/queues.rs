//! What a path carries from stage to stage, and the shadow rays of one stage.

use super::Context;
use crate::alpha::AlphaFilter;
use crate::cone::Cone;
use crate::light::Odds;
use crate::medium::MediumStack;
use crate::pages::PageWalk;
use crate::pane::{ShadowFilter, open_channels};
use crate::sample::Sample;
use crate::veil::Veils;
use std::sync::atomic::AtomicU8;
use vastlight_math::{Ray, Sampler, Vec3};
use vastlight_paging::PageError;
use vastlight_trace::AcceptAll;
use vastlight_trace::paged::PagedFilter;

/// A path in flight. Its next ray stands beside it in the wave.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathState {
    /// Random numbers of this pixel and sample.
    pub(crate) sampler: Sampler,
    /// Place in the wave's samples.
    pub(crate) slot: u32,
    /// Hash of pixel, sample and seed.
    key: u32,
    /// Product of all weights so far.
    pub(crate) throughput: Vec3,
    /// The last vertex, and the normal that light sampling was told there.
    pub(crate) origin: Vec3,
    pub(crate) normal: Vec3,
    /// The odds of light sampling there.
    pub(crate) odds: Odds,
    /// Solid-angle density with which the ray's direction was drawn; 0 where light sampling could not have found it:
    /// from the camera, or after a perfectly specular bounce.
    pub(crate) pdf: f32,
    /// Product of the squared relative indices of refraction: radiance is larger inside glass, and roulette should
    /// not take that for brightness.
    pub(crate) eta_squared: f32,
    /// Volumes around the path.
    pub(crate) media: MediumStack,
    /// Panes that the path has gone straight through.
    pub(crate) panes: u32,
    /// The cone around the next ray.
    pub(crate) cone: Cone,
    /// Whether the path has scattered at a surface that is not perfectly specular.
    pub(crate) scattered: bool,
    /// Whether the path has left a surface that receives photons.
    pub(crate) received: bool,
    /// Whether it has gone on in a narrow lobe since: the light that it meets now is the photons', where there are any. Of a
    /// photon: whether a narrow lobe has sent it on.
    pub(crate) focused: bool,
    /// Whether the path has been bent by a dispersive medium, and carries one wavelength since.
    pub(crate) dispersed: bool,
}

impl PathState {
    pub(crate) fn new(slot: u32, sampler: Sampler, key: u32, cone: Cone) -> Self {
        Self {
            sampler,
            slot,
            key,
            throughput: Vec3::ONE,
            origin: Vec3::ZERO,
            normal: Vec3::ZERO,
            odds: Odds::default(),
            pdf: 0.0,
            eta_squared: 1.0,
            media: MediumStack::EMPTY,
            panes: 0,
            cone,
            scattered: false,
            received: false,
            focused: false,
            dispersed: false,
        }
    }

    /// Remembers that the path goes on from a surface, in one of its narrow lobes or not.
    #[inline(always)]
    pub(crate) fn leaves(&mut self, narrow: bool) {
        self.focused = narrow && self.received;
        self.received |= !narrow;
    }

    /// The key of alpha decisions of this path's segment number `depth`.
    pub(crate) fn alpha_key(&self, depth: u32) -> u32 {
        self.key.wrapping_add(depth.wrapping_mul(0x9e37_79b9))
    }

    /// The key of alpha decisions of the shadow ray at the end of segment number `depth`.
    #[inline(always)]
    pub(crate) fn shadow_key(&self, depth: u32) -> u32 {
        self.alpha_key(depth) ^ 0x5bd1_e995
    }
}

/// Shadow rays and what they carry if nothing blocks them.
#[derive(Debug, Default)]
pub(crate) struct ShadowQueue {
    rays: Vec<Ray>,
    carried: Vec<(u32, Vec3)>,
    keys: Vec<u32>,
    blocked: Vec<bool>,
    /// Colour channels that panes block, a bit each.
    channels: Vec<AtomicU8>,
}

impl ShadowQueue {
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    pub(crate) fn clear(&mut self) {
        self.rays.clear();
        self.carried.clear();
        self.keys.clear();
    }

    /// Adds `radiance` to the sample in `slot` if `ray` is free. `key` decides about blended surfaces on the way.
    #[inline(always)]
    pub(crate) fn push(&mut self, slot: u32, key: u32, ray: Ray, radiance: Vec3) {
        self.rays.push(ray);
        self.carried.push((slot, radiance));
        self.keys.push(key);
    }

    /// Traces all rays: adds what free ones carry to `samples`.
    pub(crate) fn trace(
        &mut self,
        context: &Context<'_>,
        walk: Option<&mut PageWalk>,
        samples: &mut [Sample],
    ) -> Result<(), PageError> {
        self.blocked.clear();
        self.blocked.resize(self.rays.len(), false);
        self.channels.clear();
        self.channels.resize_with(self.rays.len(), AtomicU8::default);
        let has_veils = context.veils.any() != Veils::default();
        let alpha = AlphaFilter { context, keys: &self.keys };
        let filter = ShadowFilter { alpha, rays: &self.rays, blocked: &self.channels };
        match walk {
            Some(walk) => {
                let filter = has_veils.then_some(&filter as &dyn PagedFilter);
                walk.occluded(context, &self.rays, filter, &mut self.blocked)?;
            }
            None if has_veils => context.tracer.occluded(&self.rays, &filter, &mut self.blocked),
            None => context.tracer.occluded(&self.rays, &AcceptAll, &mut self.blocked),
        }
        for ((&(slot, radiance), &blocked), channels) in
            self.carried.iter().zip(&self.blocked).zip(&self.channels)
        {
            if !blocked {
                samples[slot as usize].radiance += radiance * open_channels(channels);
            }
        }
        Ok(())
    }
}
