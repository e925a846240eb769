//! The published first step, section 2.2: photons in the order of (x, y, z), and those of the slab that is as near as the
//! radius along x found by halving.

use super::{Kept, LOST, Runs, pairs_of, sorted};
use crate::photon::Photon;
use rayon::prelude::*;
use vastlight_accel::sort::{Pair, key, payload};

/// Half the thickness of a slab, m.
#[derive(Clone, Copy, Debug)]
pub(in crate::photon) struct Lexicographic {
    radius: f32,
}

impl Lexicographic {
    pub(super) fn new(photons: &[Photon], kept: &Kept, radius: f32) -> (Self, Vec<Pair>) {
        let pairs = pairs_of(photons, LOST, |position| ascending(position.x));
        let mut pairs = sorted(pairs, LOST, kept);
        let rest = |pair: Pair| {
            let position = photons[payload(pair) as usize].position;
            (ascending(position.y), ascending(position.z), payload(pair))
        };
        pairs
            .par_chunk_by_mut(|&a, &b| key(a) == key(b))
            .filter(|same_x| same_x.len() > 1)
            .for_each(|same_x| same_x.par_sort_unstable_by_key(|&pair| rest(pair)));
        (Self { radius }, pairs)
    }

    /// The slab around `x`; `xs` are all photons' in their order.
    #[inline(always)]
    pub(super) fn runs(self, xs: &[f32], x: f32) -> Runs {
        let first = xs.partition_point(|&other| other < x - self.radius);
        let end = xs.partition_point(|&other| other <= x + self.radius);
        let mut runs = Runs::NONE;
        runs.push(first as u32, end as u32);
        runs
    }
}

/// A number that grows with a finite `x`, and is less than [`LOST`].
fn ascending(x: f32) -> u32 {
    let bits = x.to_bits();
    if x.is_sign_negative() { !bits } else { bits | 1 << 31 }
}
