//! No structure at all: every photon is looked at. What the others are checked against.

use super::{Kept, Runs, sorted_by_key};
use crate::photon::Photon;
use vastlight_accel::sort::Pair;

/// All photons, in their own order.
#[derive(Clone, Copy, Debug)]
pub(in crate::photon) struct Brute {
    photons: u32,
}

impl Brute {
    pub(super) fn new(photons: &[Photon], kept: &Kept) -> (Self, Vec<Pair>) {
        (Self { photons: kept.photons as u32 }, sorted_by_key(photons, kept, 1, |_| 0))
    }

    #[inline(always)]
    pub(super) fn runs(self) -> Runs {
        let mut runs = Runs::NONE;
        runs.push(0, self.photons);
        runs
    }
}
