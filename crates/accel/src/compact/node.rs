//! Nodes with eight quantised boxes.
//!
//! After H. Ylitie, T. Karras, S. Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs".
//! Deviation: a reference for each child, since pages are small enough for 16 bits; and the triangles of all leaves below a
//! node stand behind it, so that one look at memory brings them all.

use super::cluster::Packing;
use crate::wide::{ChildRef, Node8, QuantisedBoxes, WideNode};
use vastlight_math::Aabb;
use vastlight_simd::Simd8;

/// Eight children and their boxes in 92 bytes, in a page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PackedNode {
    boxes: QuantisedBoxes,
    /// By slot: how far behind this node another one stands, in units of four bytes less one; or the first triangle of a
    /// leaf in the cluster in the lower eight bits, and its number of triangles less one. So nodes only ever lead on, also
    /// in a damaged page.
    children: [u16; 8],
    /// Slots with a leaf, as bits.
    leaves: u8,
    /// Number of the cluster's first triangle in the page.
    first_triangle: [u8; 2],
    /// How the cluster behind the node is packed.
    pub(super) packing: Packing,
}

/// What a slot of a node in a page points to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PackedChild {
    /// A node, whose place is told later.
    Node,
    /// Triangles of the node's cluster.
    Leaf(LeafRun),
}

/// The triangles of a leaf, in the cluster.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LeafRun {
    pub(super) first: u8,
    pub(super) count: u8,
}

/// A leaf in a page: its node's place, and its slot there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LeafPlace {
    pub(super) node: usize,
    pub(super) slot: usize,
}

impl LeafPlace {
    #[inline(always)]
    pub(super) fn from_index(index: usize) -> Self {
        Self { node: index / 8, slot: index % 8 }
    }
}

impl PackedNode {
    /// Packs the boxes of `node`, whose children become these.
    pub(super) fn new(
        node: &Node8,
        children: &[Option<PackedChild>; 8],
        packing: Packing,
        first_triangle: u16,
    ) -> Self {
        let first_triangle = first_triangle.to_le_bytes();
        let used = (0..8).fold(0, |used, slot| used | u8::from(children[slot].is_some()) << slot);
        let boxes = QuantisedBoxes::new(node, used);
        let mut packed = Self { boxes, packing, first_triangle, ..Self::default() };
        for (slot, child) in children.iter().enumerate() {
            match child {
                Some(PackedChild::Leaf(run)) => {
                    packed.leaves |= 1 << slot;
                    packed.children[slot] = u16::from(run.first) | u16::from(run.count - 1) << 8;
                }
                Some(PackedChild::Node) | None => {}
            }
        }
        packed
    }

    /// Makes a slot of this node, which stands at `place`, point to the node at another place behind it.
    pub(super) fn set_node(&mut self, slot: usize, place: u16, child: u16) {
        self.children[slot % 8] = child - place - 1;
    }

    /// Number of the cluster's first triangle in the page.
    #[inline(always)]
    pub(super) fn first_triangle(&self) -> u16 {
        u16::from_le_bytes(self.first_triangle)
    }

    /// The triangles of the leaf in a slot.
    #[inline(always)]
    pub(super) fn run(&self, slot: usize) -> LeafRun {
        let child = self.children[slot % 8];
        LeafRun { first: child as u8, count: (child >> 8) as u8 % 8 + 1 }
    }
}

impl WideNode for PackedNode {
    #[inline(always)]
    fn child(&self, place: usize, slot: usize) -> ChildRef {
        if self.leaves >> (slot % 8) & 1 == 0 {
            ChildRef::node(place as u32 + 1 + u32::from(self.children[slot % 8]))
        } else {
            ChildRef::leaf((8 * place + slot % 8) as u32)
        }
    }

    #[inline(always)]
    fn planes<S: Simd8>(&self, s: S, axis: usize, side: usize) -> S::F {
        self.boxes.planes(s, axis, side)
    }

    #[inline(always)]
    fn bounds(&self, slot: usize) -> Aabb {
        self.boxes.bounds(slot)
    }

    #[inline(always)]
    fn used(&self) -> u32 {
        u32::from(self.boxes.used())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Vec3;

    #[test]
    fn packed_boxes_contain_the_given_ones_and_are_little_larger() {
        let mut state = 7_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        for scale in [1e-6_f32, 0.3, 1.0, 1e6] {
            for count in 1..=8 {
                let mut node = Node8::EMPTY;
                for slot in 0..count {
                    let min = Vec3::new(random(), random() * 1e-3, 5.0 + random()) * scale;
                    let size = Vec3::new(random(), random(), 0.0) * scale;
                    node.set(slot, ChildRef::leaf(slot as u32), &Aabb { min, max: min + size });
                }
                let children: [_; 8] = std::array::from_fn(|slot| {
                    let run = LeafRun { first: 9 * slot as u8, count: slot as u8 + 1 };
                    let child = if slot % 3 == 0 { PackedChild::Node } else { PackedChild::Leaf(run) };
                    (slot < count).then_some(child)
                });
                let mut packed = PackedNode::new(&node, &children, Packing::default(), 4_321);
                (0..count).step_by(3).for_each(|slot| packed.set_node(slot, 777, 999));
                assert_eq!(packed.first_triangle(), 4_321);
                let wide = packed.to_wide(777);
                for (slot, &child) in children.iter().enumerate() {
                    match child {
                        None => assert_eq!(wide.children[slot], ChildRef::NONE),
                        Some(PackedChild::Node) => assert_eq!(wide.children[slot], ChildRef::node(999)),
                        Some(PackedChild::Leaf(run)) => {
                            let place = LeafPlace::from_index(wide.children[slot].index());
                            assert_eq!(place, LeafPlace { node: 777, slot });
                            assert_eq!(packed.run(slot), run);
                        }
                    }
                    let (own, given) = (wide.bounds(slot), node.bounds(slot));
                    assert!(slot >= count || own.contains(&given), "{own:?} {given:?}");
                    let slack = Vec3::splat(scale * (2.0 / 100.0));
                    assert!(
                        slot >= count
                            || Aabb { min: given.min - slack, max: given.max + slack }.contains(&own)
                    );
                }
            }
        }
    }
}
