//! Tracing through pages of which some are not in memory.
//!
//! After K. Garanzha, A. Bely, V. Galaktionov (thesis of K. Garanzha 2013, 6.4): a batch of rays is traced again and again;
//! a ray tests all pages on its way that are in memory and asks for the first one that is not; between passes the pages
//! that were asked for are fetched, and the next pass is that of the rays whose pages have come.
//!
//! # Why it ends, with the right hits
//! For each ray the subtrees in pages have an order, turns: by where the ray enters them, ties by number. It depends
//! on the ray and the scene alone. `restart` is the turn of the first subtree that the ray could not look through; all
//! before it have been, in this pass or an earlier one, and are never asked for again, whether they are still in memory or
//! not. In a pass the ray looks through all others that are in memory, so the next `restart` is not before this one,
//! and behind it if the page was there. A pager grants at least what the first ray that waits needs: so in every pass
//! or two some ray goes on by a turn. Turns are finite, hence so are passes. A ray is finished when
//! its first missing subtree begins behind its closest hit; hits do not depend on the order in which they are found,
//! so they are those of a scene in memory, bit for bit.
//!
//! Deviations from the thesis: turns instead of cells of a grid, so that any tree over pages will do; rays whose page has
//! not come sit a pass out, so the most wanted pages come first and serve all who wait for them; a page that every
//! ray of the batch has looked through ("WasRead"), after the first pass, is known by the batch, not by the page, so
//! that several batches can be on their way at once.

mod batch;
mod caches;
mod filter;
mod progress;

pub use batch::PagedBatch;
pub use caches::{CachePager, Caches};
pub(crate) use progress::{Begin, End, Missing, Turn};

use crate::Hit;
use vastlight_math::Vec3;
use vastlight_paging::Table;

/// Where a hit was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The triangle's corners in its mesh's space.
    pub corners: [Vec3; 3],
    /// Number of the page; [`Hit::NONE`] in a mesh that has none.
    pub page: u32,
    /// The triangle's place in the page.
    pub place: u32,
}

impl Found {
    /// Nowhere.
    pub const NONE: Self = Self { corners: [Vec3::ZERO; 3], page: Hit::NONE, place: 0 };
}

/// Whether a hit counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It does.
    Counts,
    /// The ray passes.
    Passes,
    /// Nobody knows before this page of attributes is in memory.
    Unknown(u32),
}

/// Decides whether a hit counts; see [`crate::HitFilter`]. What it answered once it must answer again.
pub trait PagedFilter: Sync {
    /// Whether `hit` of the ray number `ray` in the batch counts; `attributes` are the pages of attributes in memory.
    fn judge(&self, ray: usize, hit: &Hit, found: &Found, attributes: &Table) -> Verdict;
}

/// Brings pages into memory.
pub trait Pager {
    /// Why a page cannot be had.
    type Error;

    /// The pages of geometry that are in memory now. They stay for as long as the table is kept.
    fn geometry(&self) -> Table;

    /// The pages of attributes that are in memory now.
    fn attributes(&self) -> Table;

    /// Waits for pages of geometry and of attributes, the most wanted first in each; not for all of them if they are many,
    /// but at least for the first of each. They stay in memory until the next call; those of a kind of which nothing is wanted now,
    /// longer. With nothing wanted it only sees anew what is in memory.
    ///
    /// # Errors
    /// A page cannot be had.
    fn fetch(&mut self, geometry: &[u32], attributes: &[u32]) -> Result<(), Self::Error>;

    /// Lets go of what is seen in memory until the next fetch.
    fn rest(&mut self) {}

    /// Is told which pages of geometry a pass has used, a bit each.
    fn used(&mut self, pages: &[u64]);
}
