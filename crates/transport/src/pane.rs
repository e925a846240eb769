//! Window panes: shadow rays go straight through smooth thin walls, as light does.
//!
//! A path that goes straight through a pane keeps the density of its last scattering, so that next-event estimation
//! through the pane and the path itself are two strategies for the same light, weighed against each other as usual.
//!
//! A shadow ray passes a pane in each colour channel with the probability of the share that the pane lets through. All
//! channels use one random number, and a channel that is blocked once stays blocked: the outcome is a set of blocked
//! channels, which does not depend on the order in which the tracer finds the panes, nor on how often.

use crate::alpha::AlphaFilter;
use crate::cone::Cone;
use crate::corners::{MeshCorners, PageCorners};
use crate::pages::PageHit;
use crate::surface::mesh_of;
use crate::veil::Veils;
use crate::vertex::Vertex;
use std::sync::atomic::{AtomicU8, Ordering};
use vastlight_math::rng::hash_to_unit;
use vastlight_math::{Ray, Vec3};
use vastlight_paging::Table;
use vastlight_store::MOST_FLOATS;
use vastlight_trace::paged::{Found, PagedFilter, Verdict};
use vastlight_trace::{Hit, HitFilter};

/// All channels blocked.
const OPAQUE: u8 = 0b111;

/// Accepts hits that block a shadow ray in all channels.
#[derive(Debug)]
pub(crate) struct ShadowFilter<'a> {
    pub(crate) alpha: AlphaFilter<'a>,
    pub(crate) rays: &'a [Ray],
    /// A bit for each blocked channel of each ray.
    pub(crate) blocked: &'a [AtomicU8],
}

impl ShadowFilter<'_> {
    /// The channels that the pane at a hit blocks.
    fn blocks(&self, ray: usize, hit: &Hit, corners: Option<PageCorners<'_>>) -> u8 {
        // The textures of panes are in memory.
        let page = corners.map(|corners| PageHit { corners: Some(corners), evaluated: None });
        let (mut own_material, mut own_bsdf) = (None, None);
        let vertex =
            Vertex::new(self.alpha.context, (&self.rays[ray], Cone::RAY), hit, page, &mut own_material);
        let bsdf = vertex.bsdf_alone(&mut own_bsdf);
        let passed = bsdf.straight(vertex.frame.to_local(vertex.wo));
        // Another number than the one that decides about alpha.
        let chance = hash_to_unit(&[!self.alpha.keys[ray], hit.instance, hit.prim]);
        (0..3).filter(|&channel| chance >= passed[channel]).fold(0, |set, channel| set | 1 << channel)
    }
}

impl ShadowFilter<'_> {
    /// Whether nothing passes any more after a pane that blocks these channels.
    fn is_blocked(&self, ray: usize, blocks: u8) -> bool {
        self.blocked[ray].fetch_or(blocks, Ordering::Relaxed) | blocks == OPAQUE
    }
}

impl HitFilter for ShadowFilter<'_> {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        let veils = self.alpha.veils(hit);
        if veils.alpha {
            let corners = MeshCorners::new(mesh_of(self.alpha.context.scene, hit), hit);
            if !self.alpha.is_there(ray, hit, &corners) {
                return false;
            }
        }
        !veils.pane || self.is_blocked(ray, self.blocks(ray, hit, None))
    }
}

impl PagedFilter for ShadowFilter<'_> {
    fn judge(&self, ray: usize, hit: &Hit, found: &Found, attributes: &Table) -> Verdict {
        let veils = self.alpha.veils(hit);
        if veils == Veils::default() {
            return Verdict::Counts;
        }
        let mut records = [0.0; MOST_FLOATS];
        let corners = match self.alpha.context.corners(hit, found, attributes, &mut records) {
            Ok(corners) => corners,
            Err(page) => return Verdict::Unknown(page),
        };
        let passes = veils.alpha && !self.alpha.is_there(ray, hit, &corners)
            || veils.pane && !self.is_blocked(ray, self.blocks(ray, hit, corners.page()));
        if passes { Verdict::Passes } else { Verdict::Counts }
    }
}

/// One in the channels that are not blocked, zero in the others.
pub(crate) fn open_channels(blocked: &AtomicU8) -> Vec3 {
    let set = blocked.load(Ordering::Relaxed);
    Vec3::from_array([0, 1, 2].map(|channel| if set >> channel & 1 == 0 { 1.0 } else { 0.0 }))
}
