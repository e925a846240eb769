//! Nodes of the threaded kd-tree: plain data that a GPU can share, indices and no pointers.

use crate::quality::STEP;
use vastlight_math::Aabb;

/// A node, one cache line.
///
/// A fork cuts its cell by a plane; its lower child stands at an index, the upper one follows it. A leaf names a run of
/// items.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct KdNode {
    /// Around everything below, clipped to the cell; empty where nothing is below.
    pub bounds: Aabb,
    /// Bits of the plane's coordinate (a fork), or the number of items (a leaf).
    pub cut_or_count: u32,
    /// Axis of the plane in the upper two bits, [`KdNode::LEAF`] there for a leaf; below them the index of the lower
    /// child or of the first item.
    pub link: u32,
    /// Where a walk goes on after this node and all below it, by octant of the ray's direction: bit `k` of the octant
    /// is set where the direction is negative along axis `k`. [`KdNode::END`] after the last.
    pub next: [u32; 8],
}

impl KdNode {
    /// In the place of an axis: the node is a leaf.
    pub const LEAF: u32 = 3;
    /// The thread that leads nowhere.
    pub const END: u32 = u32::MAX;
    /// Indices stay below this.
    pub(super) const INDICES: usize = 1 << 30;
    const INDEX_MASK: u32 = (1 << 30) - 1;

    /// A fork without threads.
    #[must_use]
    pub fn fork(bounds: Aabb, axis: usize, cut: f32, lower: u32) -> Self {
        let link = (axis as u32) << 30 | lower;
        Self { bounds, cut_or_count: cut.to_bits(), link, next: [Self::END; 8] }
    }

    /// A leaf without threads.
    #[must_use]
    pub fn leaf(bounds: Aabb, first: u32, count: u32) -> Self {
        Self { bounds, cut_or_count: count, link: Self::LEAF << 30 | first, next: [Self::END; 8] }
    }

    /// Whether this is a leaf.
    #[inline(always)]
    #[must_use]
    pub fn is_leaf(&self) -> bool {
        self.link >> 30 == Self::LEAF
    }

    /// Axis of a fork's plane.
    #[inline(always)]
    #[must_use]
    pub fn axis(&self) -> usize {
        (self.link >> 30) as usize
    }

    /// Coordinate of a fork's plane.
    #[inline(always)]
    #[must_use]
    pub fn cut(&self) -> f32 {
        f32::from_bits(self.cut_or_count)
    }

    /// The lower child of a fork; the upper one follows it.
    #[inline(always)]
    #[must_use]
    pub fn lower(&self) -> usize {
        (self.link & Self::INDEX_MASK) as usize
    }

    /// The items of a leaf.
    #[inline(always)]
    #[must_use]
    pub fn items(&self) -> std::ops::Range<usize> {
        let first = (self.link & Self::INDEX_MASK) as usize;
        first..first + self.cut_or_count as usize
    }
}

/// A threaded kd-tree over boxes. Node 0 is the root; without boxes there are no nodes.
#[derive(Clone, Debug, Default)]
pub struct KdTree {
    /// The nodes; children stand in pairs behind their parent.
    pub nodes: Vec<KdNode>,
    /// Numbers of boxes, leaf by leaf. A box may be in several leaves.
    pub items: Vec<u32>,
    /// Nodes on the longest way from the root to a leaf.
    pub levels: usize,
}

impl KdTree {
    /// The box around everything; empty without boxes.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// Cost of the tree as `C(root)` of [`crate::Quality`]; items have the costs of `item_cost`.
    #[must_use]
    pub fn cost(&self, item_cost: impl Fn(u32) -> f64) -> f64 {
        let mut cost = vec![0.0_f64; self.nodes.len()];
        for (i, node) in self.nodes.iter().enumerate().rev() {
            if node.is_leaf() {
                cost[i] = self.items[node.items()].iter().map(|&item| item_cost(item)).sum();
                continue;
            }
            cost[i] = STEP;
            for child in [node.lower(), node.lower() + 1] {
                let part = self.nodes[child].bounds.half_area() / node.bounds.half_area();
                cost[i] += cost[child] * if part.is_finite() { f64::from(part) } else { 1.0 };
            }
        }
        cost.first().copied().unwrap_or(0.0)
    }

    /// Memory of nodes and items.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice())
    }
}
