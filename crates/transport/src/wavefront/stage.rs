//! One shading stage of a wave, as integrators see it.

use super::ahead::fetch_ahead;
use super::{Context, PathState, ShadowQueue};
use crate::pages::{PageHit, PageHits};
use crate::sample::Sample;
use vastlight_math::Ray;
use vastlight_simd::Simd8;
use vastlight_trace::Hit;

/// The shading stage of an integrator.
pub(crate) trait Shade: Sync {
    /// Shades every hit and miss of a stage: adds to samples, queues shadow rays, and hands on the next rays of paths
    /// that go on. Becomes part of a kernel: implementations are `#[inline(always)]`.
    fn shade<L: Simd8>(&self, level: L, stage: &mut Stage<'_>);
}

/// Rays and what they met, and what becomes of them.
pub(crate) struct Stage<'w> {
    pub(crate) context: &'w Context<'w>,
    /// Segments from the camera, those of `rays` included.
    pub(crate) depth: u32,
    pub(crate) rays: &'w [Ray],
    pub(crate) hits: &'w [Hit],
    /// What is known of the triangles that were hit, where meshes are not in memory.
    pub(crate) pages: Option<PageHits<'w>>,
    /// Which path each ray belongs to.
    pub(crate) slots: &'w [u32],
    /// By slot.
    pub(crate) paths: &'w mut [PathState],
    pub(crate) samples: &'w mut [Sample],
    pub(crate) shadows: &'w mut ShadowQueue,
    /// The rays of the next stage and their slots.
    pub(super) next_rays: &'w mut Vec<Ray>,
    pub(super) next_slots: &'w mut Vec<u32>,
    /// Memory for numbers of rays.
    pub(super) met: &'w mut Vec<u32>,
}

/// One ray and what it met.
pub(crate) struct ShadeInput<'a> {
    pub(crate) context: &'a Context<'a>,
    pub(crate) depth: u32,
    pub(crate) ray: Ray,
    pub(crate) hit: Hit,
    pub(crate) page: Option<PageHit<'a>>,
    pub(crate) sample: &'a mut Sample,
}

impl Stage<'_> {
    /// Hands on the next ray of the path in `slot`.
    #[inline(always)]
    pub(crate) fn go_on(&mut self, slot: u32, next: Ray) {
        self.next_rays.push(next);
        self.next_slots.push(slot);
    }

    /// The numbers of the rays that met something; `miss` gets those of the others.
    #[inline(always)]
    pub(crate) fn met(&mut self, mut miss: impl FnMut(&mut Self, usize)) -> Vec<u32> {
        let mut met = std::mem::take(self.met);
        met.clear();
        for i in 0..self.rays.len() {
            if self.hits[i].is_hit() {
                met.push(i as u32);
            } else {
                miss(self, i);
            }
        }
        met
    }

    /// Takes back what [`Stage::met`] gave: its memory is used again.
    #[inline(always)]
    pub(crate) fn give_back(&mut self, met: Vec<u32>) {
        *self.met = met;
    }

    /// Asks the caches for what hits need that come after the ray number `met[i]`.
    #[inline(always)]
    pub(crate) fn fetch_ahead<L: Simd8>(&self, level: L, met: &[u32], i: usize) {
        if self.pages.is_none() {
            fetch_ahead(level, self.context.scene, self.hits, met, i);
        }
    }

    /// Shades every ray by itself, without next rays.
    #[inline(always)]
    pub(crate) fn one_by_one(&mut self, shade: impl Fn(ShadeInput<'_>, &mut PathState, &mut ShadowQueue)) {
        for (i, &slot) in self.slots.iter().enumerate() {
            let input = ShadeInput {
                context: self.context,
                depth: self.depth,
                ray: self.rays[i],
                hit: self.hits[i],
                page: self.pages.map(|pages| pages.at(i)),
                sample: &mut self.samples[slot as usize],
            };
            shade(input, &mut self.paths[slot as usize], self.shadows);
        }
    }
}
