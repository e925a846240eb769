//! The two steps of every walk through a wide tree: test a node's boxes, and put its hit children aside.
//!
//! Children wait on a stack of (distance, child) in one u64 each, near ones on top, so that a child behind the closest
//! hit is dropped when its turn comes.

use super::{ChildRef, InstanceNodes, Node8, SmallNode, WideNode};
use crate::ray::BoxRay;
use vastlight_simd::Simd8;

/// A waiting child: distance as bits above, reference below.
pub type Entry = u64;

/// Most entries that a walk through a tree with so many levels of wide nodes puts aside.
#[must_use]
pub const fn stack_entries(levels: usize) -> usize {
    7 * levels
}

/// Children put aside.
#[derive(Debug)]
pub struct Waiting<'a> {
    /// Room for [`stack_entries`].
    pub entries: &'a mut [Entry],
    /// How many wait.
    pub depth: usize,
}

impl Waiting<'_> {
    /// The nearest child that waits above `floor` and is not behind `t_max`.
    #[inline(always)]
    pub fn pop(&mut self, floor: usize, t_max: f32) -> Option<ChildRef> {
        while self.depth > floor {
            self.depth -= 1;
            let entry = self.entries[self.depth];
            if f32::from_bits((entry >> 32) as u32) <= t_max {
                return Some(ChildRef(entry as u32));
            }
        }
        None
    }

    /// Puts the hit children of a node, given with its place, aside but for the nearest, which it gives. With `PREFETCH` the caches are asked
    /// for all of them, where there are several. With `ANY`, for walks that end at the first hit, the others wait in no
    /// order.
    #[inline(always)]
    pub fn descend<S: Simd8, const PREFETCH: bool, const ANY: bool>(
        &mut self,
        simd: S,
        (place, node): (usize, &impl WideNode),
        (mut hits, distances): (u32, S::F),
        memory: &impl Prefetch,
    ) -> Option<ChildRef> {
        if hits == 0 {
            return None;
        }
        let first = take_lowest(&mut hits);
        if hits == 0 {
            return Some(node.child(place, first));
        }
        let distances = simd.to_array(distances);
        let bottom = self.depth;
        let a = entry::<PREFETCH>(simd, (place, node), first, &distances, memory);
        let b = entry::<PREFETCH>(simd, (place, node), take_lowest(&mut hits), &distances, memory);
        let mut nearest = a.min(b);
        self.insert(self.depth, a.max(b));
        while hits != 0 {
            let other = entry::<PREFETCH>(simd, (place, node), take_lowest(&mut hits), &distances, memory);
            let farther = nearest.max(other);
            let bottom = if ANY { self.depth } else { bottom };
            self.insert(bottom, farther);
            nearest = nearest.min(other);
        }
        Some(ChildRef(nearest as u32))
    }

    /// Inserts above `bottom`, where larger entries lie deeper. Only damaged trees have more than there is room for: the
    /// rest is lost.
    #[inline(always)]
    fn insert(&mut self, bottom: usize, entry: Entry) {
        let mut place = self.depth;
        if place >= self.entries.len() {
            return;
        }
        while place > bottom && self.entries[place - 1] < entry {
            self.entries[place] = self.entries[place - 1];
            place -= 1;
        }
        self.entries[place] = entry;
        self.depth += 1;
    }
}

/// The lowest set bit, which is cleared.
#[inline(always)]
fn take_lowest(bits: &mut u32) -> usize {
    let lowest = bits.trailing_zeros() as usize % 8;
    *bits &= *bits - 1;
    lowest
}

#[inline(always)]
fn entry<const PREFETCH: bool>(
    simd: impl Simd8,
    (place, node): (usize, &impl WideNode),
    slot: usize,
    distances: &[f32; 8],
    memory: &impl Prefetch,
) -> Entry {
    let child = node.child(place, slot);
    if PREFETCH {
        memory.prefetch(simd, child);
    }
    u64::from(distances[slot].to_bits()) << 32 | u64::from(child.0)
}

/// Knows where nodes and leaves stand in memory.
pub trait Prefetch {
    /// Asks the caches for what a child is.
    fn prefetch<S: Simd8>(&self, simd: S, child: ChildRef);
}

/// Where a tree's nodes and leaves stand in memory, to ask the caches for them without a branch.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    first: [*const u8; 2],
    stride: [usize; 2],
}

impl Memory {
    /// The memory of a tree whose leaves are the elements of `leaves`.
    #[inline(always)]
    #[must_use]
    pub fn new<N, L>(nodes: &[N], leaves: &[L]) -> Self {
        Self {
            first: [nodes.as_ptr().cast(), leaves.as_ptr().cast()],
            stride: [size_of::<N>(), size_of::<L>()],
        }
    }
}

/// The same for a tree over instances, whose leaves are rows of a table.
#[derive(Clone, Copy, Debug)]
pub struct InstanceMemory(Memory);

impl InstanceMemory {
    /// The memory of a tree; `table` says where the table begins and how many bytes a row has.
    #[inline(always)]
    #[must_use]
    pub fn new(nodes: &InstanceNodes, table: (*const u8, usize)) -> Self {
        let (first, stride) = match nodes {
            InstanceNodes::Full(nodes) => (nodes.as_ptr().cast(), size_of::<Node8>()),
            InstanceNodes::Small(nodes) => (nodes.as_ptr().cast(), size_of::<SmallNode>()),
        };
        Self(Memory { first: [first, table.0], stride: [stride, table.1] })
    }
}

impl Prefetch for InstanceMemory {
    #[inline(always)]
    fn prefetch<S: Simd8>(&self, simd: S, child: ChildRef) {
        let Memory { first, stride } = &self.0;
        let kind = usize::from(child.is_leaf());
        simd.prefetch::<4>(first[kind].wrapping_add(stride[kind] * child.index()));
    }
}

impl Prefetch for Memory {
    #[inline(always)]
    fn prefetch<S: Simd8>(&self, simd: S, child: ChildRef) {
        let kind = usize::from(child.is_leaf());
        simd.prefetch::<5>(self.first[kind].wrapping_add(self.stride[kind] * child.index()));
    }
}

/// A ray's figures, spread over lanes.
#[derive(Clone, Copy, Debug)]
pub struct RayLanes<S: Simd8> {
    reciprocal: [S::F; 3],
    near_offset: [S::F; 3],
    far_offset: [S::F; 3],
    enters_by_upper: [usize; 3],
    t_min: S::F,
}

impl<S: Simd8> RayLanes<S> {
    /// Spreads `ray`, which starts at `t_min >= 0`.
    #[inline(always)]
    #[must_use]
    pub fn new(simd: S, ray: &BoxRay, t_min: f32) -> Self {
        Self {
            reciprocal: splat3(simd, ray.reciprocal),
            near_offset: splat3(simd, ray.near_offset),
            far_offset: splat3(simd, ray.far_offset),
            enters_by_upper: ray.enters_by_upper.map(|side| side & 1),
            t_min: simd.splat(t_min),
        }
    }

    /// The slots whose box the ray meets before `t_max`, as bits, and where it enters each.
    #[inline(always)]
    #[must_use]
    pub fn test(&self, s: S, node: &impl WideNode, t_max: f32) -> (u32, S::F) {
        let (x, y, z) = (self.slab(s, node, 0), self.slab(s, node, 1), self.slab(s, node, 2));
        let enter = s.max(s.max(x.0, y.0), s.max(z.0, self.t_min));
        let leave = s.min(s.min(x.1, y.1), s.min(z.1, s.splat(t_max)));
        (s.bits(s.le(enter, leave)) & node.used(), enter)
    }

    /// Where the ray enters and leaves the slabs of one axis.
    #[inline(always)]
    fn slab(&self, s: S, node: &impl WideNode, axis: usize) -> (S::F, S::F) {
        let upper = self.enters_by_upper[axis] & 1;
        let (near, far) = (node.planes(s, axis, upper), node.planes(s, axis, upper ^ 1));
        let reciprocal = self.reciprocal[axis];
        let enter = s.mul_sub(near, reciprocal, self.near_offset[axis]);
        (enter, s.mul_sub(far, reciprocal, self.far_offset[axis]))
    }
}

#[inline(always)]
fn splat3<S: Simd8>(simd: S, v: [f32; 3]) -> [S::F; 3] {
    [simd.splat(v[0]), simd.splat(v[1]), simd.splat(v[2])]
}
