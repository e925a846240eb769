//! Structures that find the photons around a point.
//!
//! Each decides an order of the photons, the same whatever the number of threads, and gives for a point runs of photons in
//! that order, among which are all that are near enough.

mod axis;
mod bounds;
mod brute;
mod lexicographic;
mod planar;
mod rows;
mod voxel;

use super::Photon;
use axis::Axis;
use brute::Brute;
use lexicographic::Lexicographic;
use rayon::prelude::*;
use rows::Rows;
use vastlight_accel::sort::{Pair, pair, radix_sort};
use vastlight_math::{Aabb, Vec3};
pub use voxel::VoxelGrid;
use voxel::Voxels;

/// Most runs of a point.
const MOST_RUNS: usize = 27;
/// The key of a photon that is left out, where it is not the number of cells.
const LOST: u32 = u32::MAX;
/// Photons that one thread takes at a time.
const CHUNK: usize = 1 << 13;

/// The structures, by what they are in the papers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SearchKind {
    /// Every photon is looked at.
    Brute,
    /// Photons in the order of (x, y, z), a slab for a point.
    Lexicographic,
    /// Voxels as wide as the radius, 27 for a point.
    Voxel,
    /// Voxels over two axes, nine for a point: for flat receivers.
    Planar,
    /// Rows along the longest axis, a chord of each row that the sphere touches: our own.
    #[default]
    Rows,
}

impl SearchKind {
    /// Every structure.
    pub const ALL: [Self; 5] = [Self::Brute, Self::Lexicographic, Self::Voxel, Self::Planar, Self::Rows];

    /// The structure of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// `brute`, `lexicographic`, `voxel`, `planar` or `rows`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Brute => "brute",
            Self::Lexicographic => "lexicographic",
            Self::Voxel => "voxel",
            Self::Planar => "planar",
            Self::Rows => "rows",
        }
    }
}

/// What there is to sort.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    /// Photons whose numbers are finite,
    pub(super) photons: usize,
    /// and the others.
    pub(super) lost: usize,
    /// The box of the first.
    pub(super) bounds: Aabb,
}

impl Kept {
    /// Looks at all photons.
    pub(super) fn of(photons: &[Photon]) -> Self {
        let none = Self { photons: 0, lost: 0, bounds: Aabb::EMPTY };
        photons.par_chunks(CHUNK).map(|chunk| chunk.iter().fold(none, Self::with)).reduce(
            || none,
            |a, b| Self {
                photons: a.photons + b.photons,
                lost: a.lost + b.lost,
                bounds: a.bounds.union(b.bounds),
            },
        )
    }

    fn with(self, photon: &Photon) -> Self {
        if photon.is_finite() {
            Self { photons: self.photons + 1, bounds: self.bounds.grow(photon.position), ..self }
        } else {
            Self { lost: self.lost + 1, ..self }
        }
    }

    /// A little more than the radius, so that rounding neither loses photons that count nor widens the reach of twice the
    /// radius to more cells than there would be.
    fn reach(&self, radius: f32) -> f32 {
        let farthest = self.bounds.min.abs().max_element().max(self.bounds.max.abs().max_element());
        let rounding = if self.photons > 0 { farthest * (4.0 * f32::EPSILON) } else { 0.0 };
        radius * (1.0 + 1.0 / 1024.0) + rounding
    }

    /// The axes, the longest side of the box first.
    fn axes_by_extent(&self) -> [usize; 3] {
        let size = self.bounds.size();
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| size[b].total_cmp(&size[a]));
        axes
    }
}

/// Runs of photons around a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Runs {
    count: usize,
    runs: [[u32; 2]; MOST_RUNS],
}

impl Runs {
    const NONE: Self = Self { count: 0, runs: [[0; 2]; MOST_RUNS] };

    /// Adds the photons from `first` to before `end`.
    #[inline(always)]
    fn push(&mut self, first: u32, end: u32) {
        if first < end
            && let Some(run) = self.runs.get_mut(self.count)
        {
            *run = [first, end];
            self.count += 1;
        }
    }

    /// First photons and ends.
    #[inline(always)]
    pub(super) fn iter(&self) -> impl Iterator<Item = [usize; 2]> {
        self.runs.iter().take(self.count).map(|run| run.map(|photon| photon as usize))
    }
}

/// One of the structures.
#[derive(Debug)]
pub(super) enum Search {
    Brute(Brute),
    Lexicographic(Lexicographic),
    Voxels(Voxels),
    Rows(Rows),
}

impl Search {
    /// The structure for a radius, m, and the numbers of the photons in its order as payloads.
    pub(super) fn new(kind: SearchKind, photons: &[Photon], kept: &Kept, radius: f32) -> (Self, Vec<Pair>) {
        match kind {
            SearchKind::Brute => of(Self::Brute, Brute::new(photons, kept)),
            SearchKind::Lexicographic => of(Self::Lexicographic, Lexicographic::new(photons, kept, radius)),
            SearchKind::Voxel => of(Self::Voxels, Voxels::new(photons, kept, radius)),
            SearchKind::Planar => of(Self::Voxels, planar::columns(photons, kept, radius)),
            SearchKind::Rows => of(Self::Rows, Rows::new(photons, kept, radius)),
        }
    }

    /// Runs among which are all photons within the radius; `xs` are those of all photons in the structure's order.
    #[inline(always)]
    pub(super) fn runs(&self, xs: &[f32], at: Vec3) -> Runs {
        match self {
            Self::Brute(all) => all.runs(),
            Self::Lexicographic(slab) => slab.runs(xs, at.x),
            Self::Voxels(voxels) => voxels.runs(at),
            Self::Rows(rows) => rows.runs(at),
        }
    }

    /// Memory of the index.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Brute(_) | Self::Lexicographic(_) => 0,
            Self::Voxels(voxels) => voxels.bytes(),
            Self::Rows(rows) => rows.bytes(),
        }
    }
}

fn of<T>(wrap: impl Fn(T) -> Search, (index, sorted): (T, Vec<Pair>)) -> (Search, Vec<Pair>) {
    (wrap(index), sorted)
}

/// The kept photons in the order of their keys, which are less than `keys`.
fn sorted_by_key(photons: &[Photon], kept: &Kept, keys: u32, key: impl Fn(Vec3) -> u32 + Sync) -> Vec<Pair> {
    let greatest = if kept.lost > 0 { keys } else { keys - 1 };
    sorted(pairs_of(photons, keys, key), greatest, kept)
}

/// Keys and numbers of all photons; those to leave out have the key `lost`.
fn pairs_of(photons: &[Photon], lost: u32, key: impl Fn(Vec3) -> u32 + Sync) -> Vec<Pair> {
    let key = |photon: &Photon| if photon.is_finite() { key(photon.position) } else { lost };
    let keyed = |(i, photon): (usize, &Photon)| pair(key(photon), i as u32);
    photons.par_iter().enumerate().with_min_len(CHUNK).map(keyed).collect()
}

/// Pairs by key, those to leave out, which have the greatest, cut off.
fn sorted(mut pairs: Vec<Pair>, greatest: u32, kept: &Kept) -> Vec<Pair> {
    let mut spare = vec![0; pairs.len()];
    let in_spare =
        std::ptr::eq(radix_sort(&mut pairs, &mut spare, 32 - greatest.leading_zeros()), spare.as_slice());
    let mut sorted = if in_spare { spare } else { pairs };
    sorted.truncate(kept.photons);
    sorted
}
