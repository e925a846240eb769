//! Brings a ray to the leaves of a wide tree that it may hit, near ones first.
//!
//! Single rays, a stack of (distance, child) in one u64 each, so that a child behind the closest hit is dropped when it
//! is popped. Children are ordered by distance.

use super::{ChildRef, Node8};
use crate::ray::BoxRay;
use vastlight_simd::Simd8;

/// Entries that a tree built here can fill at most: seven a level, and builders bound the depth (64 levels that a
/// heuristic chose, at most 31 halvings).
pub const STACK: usize = 7 * 96;

/// Waiting children: distance as bits above, reference below.
pub type Entry = u64;

/// What happens at leaves.
pub trait Leaves<S: Simd8> {
    /// Visits the leaf with this index. The ray reaches to `t_max`, which may be shortened. Gives true to end the walk.
    fn visit(&mut self, simd: S, leaf: usize, t_max: &mut f32) -> bool;

    /// Where leaves stand in memory: the address of the first, and the distance between two. The caches are asked for a
    /// leaf that is put aside.
    fn memory(&self) -> (*const u8, usize);
}

/// A wide tree, borrowed.
#[derive(Clone, Copy, Debug)]
pub struct Tree<'a> {
    /// Nodes.
    pub nodes: &'a [Node8],
    /// Where to start.
    pub root: ChildRef,
}

/// Walks `tree` with a ray from `t_min >= 0` to `t_max`. `ray` may be anything if the root is a leaf. `stack` has
/// [`STACK`] entries. Gives true if a visit ended the walk.
#[inline(always)]
pub fn traverse<S: Simd8, L: Leaves<S>>(
    simd: S,
    tree: Tree<'_>,
    ray: &BoxRay,
    (t_min, t_max): (f32, &mut f32),
    stack: &mut [Entry],
    leaves: &mut L,
) -> bool {
    let lanes = RayLanes::new(simd, ray, t_min);
    let (first_leaf, leaf_stride) = leaves.memory();
    let memory =
        Memory { first: [tree.nodes.as_ptr().cast(), first_leaf], stride: [size_of::<Node8>(), leaf_stride] };
    let mut waiting = Waiting { stack, depth: 0 };
    let mut current = tree.root;
    loop {
        let next = if current.is_leaf() {
            if leaves.visit(simd, current.index(), t_max) {
                return true;
            }
            None
        } else {
            let node = &tree.nodes[current.index()];
            let (hits, distances) = lanes.test(simd, node, *t_max);
            waiting.descend(simd, node, hits, distances, &memory)
        };
        match next.or_else(|| waiting.pop(*t_max)) {
            Some(next) => current = next,
            None => return false,
        }
    }
}

/// Children put aside, nearest last within a node.
struct Waiting<'a> {
    stack: &'a mut [Entry],
    depth: usize,
}

impl Waiting<'_> {
    /// The nearest waiting child that is not behind `t_max`.
    #[inline(always)]
    fn pop(&mut self, t_max: f32) -> Option<ChildRef> {
        while self.depth > 0 {
            self.depth -= 1;
            let entry = self.stack[self.depth];
            if f32::from_bits((entry >> 32) as u32) <= t_max {
                return Some(ChildRef(entry as u32));
            }
        }
        None
    }

    /// Puts the hit children of `node` aside but for the nearest, which it gives.
    #[inline(always)]
    fn descend<S: Simd8>(
        &mut self,
        simd: S,
        node: &Node8,
        mut hits: u32,
        distances: S::F,
        memory: &Memory,
    ) -> Option<ChildRef> {
        if hits == 0 {
            return None;
        }
        let first = take_lowest(&mut hits);
        if hits == 0 {
            return Some(node.children[first]);
        }
        let distances = simd.to_array(distances);
        let bottom = self.depth;
        let (a, b) = (
            memory.entry(simd, node, first, &distances),
            memory.entry(simd, node, take_lowest(&mut hits), &distances),
        );
        let mut nearest = a.min(b);
        self.stack[self.depth] = a.max(b);
        self.depth += 1;
        while hits != 0 {
            let other = memory.entry(simd, node, take_lowest(&mut hits), &distances);
            self.insert(bottom, nearest.max(other));
            nearest = nearest.min(other);
        }
        Some(ChildRef(nearest as u32))
    }

    /// Inserts above `bottom`, where larger entries lie deeper.
    #[inline(always)]
    fn insert(&mut self, bottom: usize, entry: Entry) {
        let mut place = self.depth;
        while place > bottom && self.stack[place - 1] < entry {
            self.stack[place] = self.stack[place - 1];
            place -= 1;
        }
        self.stack[place] = entry;
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

/// Where nodes and leaves stand, for prefetching without a branch.
struct Memory {
    first: [*const u8; 2],
    stride: [usize; 2],
}

impl Memory {
    /// The entry of a slot, whose child is asked for.
    #[inline(always)]
    fn entry<S: Simd8>(&self, simd: S, node: &Node8, slot: usize, distances: &[f32; 8]) -> Entry {
        let child = node.children[slot];
        let kind = usize::from(child.is_leaf());
        simd.prefetch::<5>(self.first[kind].wrapping_add(self.stride[kind] * child.index()));
        u64::from(distances[slot].to_bits()) << 32 | u64::from(child.0)
    }
}

/// A ray's figures, spread over lanes.
struct RayLanes<S: Simd8> {
    reciprocal: [S::F; 3],
    near_offset: [S::F; 3],
    far_offset: [S::F; 3],
    enters_by_upper: [usize; 3],
    t_min: S::F,
}

impl<S: Simd8> RayLanes<S> {
    #[inline(always)]
    fn new(simd: S, ray: &BoxRay, t_min: f32) -> Self {
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
    fn test(&self, s: S, node: &Node8, t_max: f32) -> (u32, S::F) {
        let (x, y, z) = (self.slab(s, node, 0), self.slab(s, node, 1), self.slab(s, node, 2));
        let enter = s.max(s.max(x.0, y.0), s.max(z.0, self.t_min));
        let leave = s.min(s.min(x.1, y.1), s.min(z.1, s.splat(t_max)));
        (s.bits(s.le(enter, leave)), enter)
    }

    /// Where the ray enters and leaves the slabs of one axis.
    #[inline(always)]
    fn slab(&self, s: S, node: &Node8, axis: usize) -> (S::F, S::F) {
        let upper = self.enters_by_upper[axis] & 1;
        let (near, far) = (s.load(&node.planes[axis][upper]), s.load(&node.planes[axis][upper ^ 1]));
        let reciprocal = self.reciprocal[axis];
        let enter = s.mul_sub(near, reciprocal, self.near_offset[axis]);
        (enter, s.mul_sub(far, reciprocal, self.far_offset[axis]))
    }
}

#[inline(always)]
fn splat3<S: Simd8>(simd: S, v: [f32; 3]) -> [S::F; 3] {
    [simd.splat(v[0]), simd.splat(v[1]), simd.splat(v[2])]
}
