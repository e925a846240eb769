//! How long the ways of rays are, for looking at structures.

use crate::flight::Flight;
use crate::paged::Begin;
use crate::walk::Stacks;
use crate::{AcceptAll, Tracer};
use vastlight_math::Ray;
use vastlight_simd::{Kernel, Simd8};

impl Tracer {
    /// The steps of each ray on the way to its closest hit, alone: nodes, blocks of triangles, and ways into instances. 0 for rays through
    /// kd-trees; implicit surfaces count nothing. Rays without a place in `steps` are left out.
    ///
    /// Meshes must be in memory.
    pub fn steps(&self, rays: &[Ray], steps: &mut [u32]) {
        if self.has_kd_trees() {
            steps.fill(0);
        } else {
            self.level().dispatch(Counting { tracer: self, rays, steps });
        }
    }
}

/// Flies rays one after the other and counts.
struct Counting<'a> {
    tracer: &'a Tracer,
    rays: &'a [Ray],
    steps: &'a mut [u32],
}

impl Kernel for Counting<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let mut stacks = Stacks::new(self.tracer.stack_entries);
        let [stack, ..] = stacks.split();
        let mut flight = Flight::grounded(simd, (self.tracer, &self.tracer.pages), stack);
        for (index, (ray, steps)) in self.rays.iter().zip(self.steps).enumerate() {
            let before = flight.steps;
            let mut flying = flight.start::<AcceptAll>(simd, ray, index, &Begin::AFRESH);
            while flying {
                flying = flight.step::<AcceptAll, false, true>(simd, &AcceptAll);
            }
            *steps = (flight.steps - before) as u32;
        }
    }
}
