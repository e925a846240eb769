//! Rays that fly together.

use super::{Context, PathState};
use crate::alpha::AlphaFilter;
use crate::pages::{PageHits, PageWalk};
use vastlight_math::Ray;
use vastlight_paging::PageError;
use vastlight_trace::paged::PagedFilter;
use vastlight_trace::{AcceptAll, Hit};

/// Rays, the paths that they belong to, and what they met.
#[derive(Debug, Default)]
pub(crate) struct Front {
    pub(crate) rays: Vec<Ray>,
    pub(crate) slots: Vec<u32>,
    pub(crate) hits: Vec<Hit>,
    keys: Vec<u32>,
    /// Where meshes are not in memory.
    pub(crate) walk: Option<PageWalk>,
}

impl Front {
    pub(crate) fn clear(&mut self) {
        self.rays.clear();
        self.slots.clear();
    }

    /// Adds the ray of the path in `slot`.
    #[inline(always)]
    pub(crate) fn push(&mut self, slot: u32, ray: Ray) {
        self.rays.push(ray);
        self.slots.push(slot);
    }

    /// What is known of the triangles that were hit, where meshes are not in memory.
    pub(crate) fn page_hits(&self) -> Option<PageHits<'_>> {
        self.walk.as_ref().map(PageWalk::hits)
    }

    /// Finds what all rays meet, on segment number `depth` of their paths.
    pub(crate) fn trace(
        &mut self,
        context: &Context<'_>,
        paths: &[PathState],
        depth: u32,
    ) -> Result<(), PageError> {
        self.hits.clear();
        self.hits.resize(self.rays.len(), Hit::MISS);
        self.keys.clear();
        let has_alpha = context.veils.any().alpha;
        if has_alpha {
            self.keys.extend(self.slots.iter().map(|&slot| paths[slot as usize].alpha_key(depth)));
        }
        let filter = AlphaFilter { context, keys: &self.keys };
        match &mut self.walk {
            Some(walk) => {
                let filter = has_alpha.then_some(&filter as &dyn PagedFilter);
                let cone_of = |i: usize| paths[self.slots[i] as usize].cone;
                return walk.closest(context, (&self.rays, cone_of), filter, &mut self.hits);
            }
            None if has_alpha => context.tracer.closest(&self.rays, &filter, &mut self.hits),
            None => context.tracer.closest(&self.rays, &AcceptAll, &mut self.hits),
        }
        Ok(())
    }
}
