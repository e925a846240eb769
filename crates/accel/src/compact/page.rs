//! A page as rays see it.

use super::cluster::{Anchor, Packing};
use super::node::{LeafPlace, LeafRun, PackedNode};
use crate::wide::traverse::Prefetch;
use crate::wide::{ChildRef, Leaf, LeafLanes};
use vastlight_simd::{Simd8, WINDOW};

/// What places of nodes are counted in.
pub(super) const UNIT: usize = 4;
/// Bytes that must follow a page in memory: what [`Page`] may look at behind the last vertex.
pub const SLACK: usize = (WINDOW + 1).next_multiple_of(64);

const NODE: usize = size_of::<PackedNode>();
const ANCHOR: usize = size_of::<Anchor>();

/// A page of a mesh. Reading never leaves the page's memory, whatever it holds.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// The page and some bytes behind it.
    bytes: &'a [u8],
}

impl<'a> Page<'a> {
    /// The page at the start of `bytes`, which are aligned to 4 bytes.
    #[inline(always)]
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    /// The node at a place; none where the page does not go so far.
    #[inline(always)]
    #[must_use]
    pub fn node(&self, place: usize) -> Option<&'a PackedNode> {
        bytemuck::try_from_bytes(self.bytes.get(UNIT * place..)?.get(..NODE)?).ok()
    }

    /// Numbers in their mesh of all triangles, in the order of their places. What a damaged page does not have is left out.
    #[must_use]
    pub fn triangles(&self) -> Vec<u32> {
        let (mut numbers, mut place) = (Vec::new(), 0);
        // Nodes and clusters stand in a row; behind the last are zeros, which have no triangles.
        while let Some(node) = self.node(place) {
            place += NODE / UNIT;
            let Packing { triangles, number_bits, .. } = node.packing;
            if triangles == 0 {
                continue;
            }
            let Some((anchor, cluster)) =
                self.bytes.get(UNIT * place..).and_then(|rest| rest.split_at_checked(ANCHOR))
            else {
                break;
            };
            let anchor: Anchor = bytemuck::pod_read_unaligned(anchor);
            let Some(packed) = cluster.get(node.packing.numbers_at()..) else { break };
            let count = usize::from(triangles);
            numbers.extend((0..count).map(|i| node.packing.number(&anchor, i, packed)));
            let bytes = node.packing.numbers_at() + (count * usize::from(number_bits)).div_ceil(8);
            place += (ANCHOR + bytes).div_ceil(UNIT);
        }
        numbers
    }

    /// More than the page has nodes and leaves.
    #[inline(always)]
    #[must_use]
    pub fn most_children(&self) -> usize {
        self.bytes.len() / NODE * 9 + 9
    }

    /// The triangles of a leaf, unpacked. What a damaged page names but does not have has no triangles.
    #[inline(always)]
    #[must_use]
    pub fn leaf<S: Simd8>(&self, s: S, leaf: usize) -> PackedLeaf<'a> {
        let LeafPlace { node: place, slot } = LeafPlace::from_index(leaf);
        let mut unpacked = PackedLeaf::none();
        let Some(node) = self.node(place) else { return unpacked };
        let Some((anchor, cluster)) =
            self.bytes.get(UNIT * place + NODE..).and_then(|behind| behind.split_at_checked(ANCHOR))
        else {
            return unpacked;
        };
        let (packing, run) = (node.packing, node.run(slot));
        unpacked.anchor = bytemuck::try_from_bytes(anchor).copied().unwrap_or_default();
        (unpacked.packing, unpacked.run, unpacked.cluster) = (packing, run, cluster);
        let (first, count) = (3 * usize::from(run.first), usize::from(run.count));
        let (Some(vertices), Some(at)) = (cluster.get(packing.vertices_at()..), cluster.get(first..)) else {
            return unpacked;
        };
        let (Some(window), Some(at)) = (vertices.first_chunk::<WINDOW>(), at.first_chunk::<24>()) else {
            return unpacked;
        };
        let rest = vertices.get(1..).and_then(|rest| rest.first_chunk::<WINDOW>()).unwrap_or(window);
        let (words, words_of_rest) = (packing.words(), packing.words_from_second_byte());
        let power = |axis: usize| f32::from_bits(u32::from(packing.exponents[axis]) << 23);
        let steps = [s.splat(power(0)), s.splat(power(1)), s.splat(power(2))];
        let corner = unpacked.anchor.corner.map(f32::from_bits);
        let anchor = [s.splat(corner[0]), s.splat(corner[1]), s.splat(corner[2])];
        for corner in 0..3 {
            // Lanes without triangle get what stands there.
            let Some(at) = at[corner * count..].first_chunk::<8>() else { return unpacked };
            let mut offsets = s.unpack(window, words, at);
            if let Some(words) = words_of_rest {
                offsets[2] = s.unpack(rest, words, at)[2];
            }
            for axis in 0..3 {
                // Exact at every level.
                let place = s.add(anchor[axis], s.mul(offsets[axis], steps[axis]));
                unpacked.corners[corner][axis] = s.to_array(place);
            }
        }
        unpacked.lanes = (1 << count) - 1;
        unpacked.first_triangle = u32::from(node.first_triangle()) + u32::from(run.first);
        unpacked
    }
}

impl Page<'_> {
    /// Asks the caches for the cluster behind a node.
    #[inline(always)]
    pub fn prefetch_cluster<S: Simd8>(&self, simd: S, place: usize) {
        simd.prefetch::<6>(self.bytes.as_ptr().wrapping_add(UNIT * place + 128));
    }
}

impl Prefetch for Page<'_> {
    #[inline(always)]
    fn prefetch<S: Simd8>(&self, simd: S, child: ChildRef) {
        if !child.is_leaf() {
            simd.prefetch::<3>(self.bytes.as_ptr().wrapping_add(UNIT * child.index()));
        }
    }
}

/// The unpacked triangles of a leaf.
#[derive(Clone, Debug)]
pub struct PackedLeaf<'a> {
    corners: LeafLanes,
    lanes: u32,
    run: LeafRun,
    /// Number of the first triangle in the page.
    first_triangle: u32,
    packing: Packing,
    anchor: Anchor,
    /// Corners, vertices, numbers, and what follows.
    cluster: &'a [u8],
}

impl PackedLeaf<'_> {
    #[inline(always)]
    fn none() -> Self {
        Self {
            corners: [[[0.0; 8]; 3]; 3],
            lanes: 0,
            run: LeafRun::default(),
            first_triangle: 0,
            packing: Packing::default(),
            anchor: Anchor::default(),
            cluster: &[],
        }
    }
}

impl Leaf for PackedLeaf<'_> {
    #[inline(always)]
    fn corners(&self) -> &LeafLanes {
        &self.corners
    }

    #[inline(always)]
    fn lanes(&self) -> u32 {
        self.lanes
    }

    #[inline(always)]
    fn prim(&self, lane: usize) -> u32 {
        let numbers = self.cluster.get(self.packing.numbers_at()..).unwrap_or_default();
        self.packing.number(&self.anchor, usize::from(self.run.first) + lane, numbers)
    }

    #[inline(always)]
    fn place(&self, lane: usize) -> u32 {
        self.first_triangle + lane as u32
    }
}
