//! Alpha as a filter of hits: a masked or blended surface is there, or it is not, for a whole ray.
//!
//! Blending is stochastic: the hit counts with probability alpha, decided by a hash of the sample and the triangle.
//! The expected picture is the exact blend in any order of surfaces, and no ray needs to be continued or sorted.

use crate::corners::{Corners, MeshCorners};
use crate::surface::{attributes, mesh_of};
use crate::veil::Veils;
use crate::wavefront::Context;
use vastlight_math::rng::hash_to_unit;
use vastlight_paging::Table;
use vastlight_store::MOST_FLOATS;
use vastlight_trace::paged::{Found, PagedFilter, Verdict};
use vastlight_trace::{Hit, HitFilter};

/// Accepts hits by alpha. `keys` has a number for each ray of the batch, the same for the same sample and vertex.
#[derive(Debug)]
pub(crate) struct AlphaFilter<'a> {
    pub(crate) context: &'a Context<'a>,
    pub(crate) keys: &'a [u32],
}

impl AlphaFilter<'_> {
    /// What the surface at a hit is to a ray that wants to pass.
    pub(crate) fn veils(&self, hit: &Hit) -> Veils {
        self.context.veils.of(self.context.scene, hit)
    }

    /// Whether the surface is there, for a material that has alpha.
    pub(crate) fn is_there(&self, ray: usize, hit: &Hit, corners: &impl Corners) -> bool {
        let Context { scene, materials, .. } = self.context;
        let material = mesh_of(scene, hit).material_of(hit.prim);
        let alpha = materials.alpha(material, &attributes(corners, hit, materials.uv_sets(material)));
        alpha >= 1.0 || (alpha > 0.0 && hash_to_unit(&[self.keys[ray], hit.instance, hit.prim]) < alpha)
    }
}

impl HitFilter for AlphaFilter<'_> {
    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        !self.veils(hit).alpha || {
            let corners = MeshCorners::new(mesh_of(self.context.scene, hit), hit);
            self.is_there(ray, hit, &corners)
        }
    }
}

impl PagedFilter for AlphaFilter<'_> {
    fn judge(&self, ray: usize, hit: &Hit, found: &Found, attributes: &Table) -> Verdict {
        if !self.veils(hit).alpha {
            return Verdict::Counts;
        }
        let mut records = [0.0; MOST_FLOATS];
        match self.context.corners(hit, found, attributes, &mut records) {
            Ok(corners) if self.is_there(ray, hit, &corners) => Verdict::Counts,
            Ok(_) => Verdict::Passes,
            Err(page) => Verdict::Unknown(page),
        }
    }
}
