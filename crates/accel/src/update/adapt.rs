//! First stage of the clustered update (chapter 2.2 of the thesis): new boxes from the bottom up, and which nodes to change.
//!
//! A node's children *migrate* where its split has become cheaper than it was made: they moved apart. A node has *exploded*
//! where it has become dearer and its children overlap. Beyond the thesis, a leaf has *burst* where its box has grown far
//! more than those of its triangles: blocks of triangles are the smallest things that move.

use super::leaves::LeafBox;
use super::tree::{DynamicTree, NONE};
use super::{UpdateConfig, regroup};
use vastlight_math::Aabb;

/// Nodes are looked at for rotations where their split has become dearer by this factor.
const ROTATED: f32 = 1.05;

/// Leaves whose box is not larger than those of their triangles by this factor are never parted by a build.
const WIDE: f32 = 2.0;

/// What there is to do; each list in the order of a walk that comes to children before their parents.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// Nodes whose children migrate, and leaves that burst.
    pub(super) migrating: Vec<u32>,
    /// Nodes to rebuild.
    pub(super) exploded: Vec<Exploded>,
    /// Nodes whose area shrinks if a child and a grandchild change places.
    pub(super) rotating: Vec<u32>,
    /// Nodes to rebuild over triangles, none below another.
    pub(super) scattered: Vec<u32>,
    /// Nodes on the longest way down.
    pub(super) depth: u32,
}

/// A node to rebuild.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exploded {
    pub(super) node: u32,
    bounds: Aabb,
    /// The box that its children share.
    pub(super) shared: Aabb,
    /// Where the entries below the node start in the list.
    first: u32,
}

/// What adapting looks for; nothing, unless told.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sought {
    pub(super) migrating: bool,
    pub(super) exploded: bool,
    pub(super) bursts: bool,
    pub(super) rotating: bool,
    /// Rotations of all nodes, not of those alone whose splits became dearer.
    pub(super) always: bool,
}

/// Gives every node the box of what is below, and tells what to do.
pub(super) fn adapt(tree: &DynamicTree, leaves: &[LeafBox], config: &UpdateConfig, sought: Sought) -> Found {
    let mut found = Found::default();
    if tree.root != NONE {
        let adapter = Adapter { tree, leaves, config, sought };
        found.depth = adapter.below(tree.root, &mut found).depth;
    }
    found
}

/// A node's figures, for its parent.
struct Below {
    bounds: Aabb,
    area: f32,
    count: u32,
    leaves: u32,
    depth: u32,
}

struct Adapter<'a> {
    tree: &'a DynamicTree,
    leaves: &'a [LeafBox],
    config: &'a UpdateConfig,
    sought: Sought,
}

impl Adapter<'_> {
    fn below(&self, node: u32, found: &mut Found) -> Below {
        let link = self.tree.link(node);
        if link.children[0] == NONE {
            let leaf = &self.leaves[link.children[1] as usize];
            self.tree.set_bounds(node, &leaf.bounds);
            let spread = leaf.spread();
            let limit = (link.saved * (1.0 + self.config.burst)).max(WIDE);
            if self.sought.bursts && link.count > 1 && spread > limit {
                found.migrating.push(node);
            }
            let area = leaf.bounds.half_area();
            return Below { bounds: leaf.bounds, area, count: link.count, leaves: 1, depth: 1 };
        }
        let first = found.exploded.len() as u32;
        let first_scattered = found.scattered.len();
        let [left, right] = self.children(link.children, link.count, found);
        let bounds = left.bounds.union(right.bounds);
        self.tree.set_bounds(node, &bounds);
        let area = bounds.half_area();
        let cost = super::tree::split_cost(area, [(left.area, left.count), (right.area, right.count)]);
        let many = link.count >= self.config.least;
        if self.sought.migrating && many && cost < link.saved * (1.0 - self.config.d_m) {
            found.migrating.push(node);
        } else if self.sought.exploded
            && many
            && cost > link.accepted.max(link.saved * (1.0 + self.config.d_e))
        {
            let shared = left.bounds.intersection(right.bounds);
            let least = left.area.min(right.area);
            if !shared.is_empty() && shared.half_area() > self.config.max_overlap * least {
                found.exploded.push(Exploded { node, bounds, shared, first });
            }
        }
        let looks = self.sought.rotating && (self.sought.always || cost > link.saved * ROTATED);
        if looks && super::rotate::best(self.tree, node).is_some() {
            found.rotating.push(node);
        }
        let (count, leaves) = (left.count + right.count, left.leaves + right.leaves);
        if self.sought.bursts && leaves > link.grouped && regroup::is_scattered(count, leaves) {
            found.scattered.truncate(first_scattered);
            found.scattered.push(node);
        }
        Below { bounds, area, count, leaves, depth: 1 + left.depth.max(right.depth) }
    }

    /// The figures of two nodes with `count` triangles together.
    fn children(&self, [a, b]: [u32; 2], count: u32, found: &mut Found) -> [Below; 2] {
        if count <= super::tree::SERIAL {
            return [self.below(a, found), self.below(b, found)];
        }
        let mut of_right = Found::default();
        let (left, right) = rayon::join(|| self.below(a, found), || self.below(b, &mut of_right));
        found.append(of_right);
        [left, right]
    }
}

impl Found {
    fn append(&mut self, other: Self) {
        let exploded = self.exploded.len() as u32;
        self.migrating.extend(other.migrating);
        self.rotating.extend(other.rotating);
        self.scattered.extend(other.scattered);
        let moved = other.exploded.into_iter().map(|e| Exploded { first: e.first + exploded, ..e });
        self.exploded.extend(moved);
    }

    /// The exploded nodes that are locked, by their places in the list: a node stays so unless it meets the box that the children
    /// of an exploded node above it share.
    pub(super) fn locked(&self, detail: f32) -> Vec<bool> {
        let mut locked = vec![true; self.exploded.len()];
        for (place, above) in self.exploded.iter().enumerate() {
            let below = above.first as usize..place;
            for (locked, exploded) in locked[below.clone()].iter_mut().zip(&self.exploded[below]) {
                *locked &= !concerns(&above.shared, &exploded.bounds, detail);
            }
        }
        locked
    }
}

/// Whether a node with the box `bounds` meets a box that others share, and is not small beside it.
pub(super) fn concerns(shared: &Aabb, bounds: &Aabb, detail: f32) -> bool {
    !shared.intersection(*bounds).is_empty() && bounds.half_area() >= detail * shared.half_area()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Vec3;

    #[test]
    fn lists_of_two_subtrees_keep_what_is_below_whom() {
        let cube = |side: f32| Aabb { min: Vec3::ZERO, max: Vec3::splat(side) };
        let exploded = |node, first| Exploded { node, bounds: cube(1.0), shared: cube(1.0), first };
        // Of each list the last is above the others, and meets them.
        let mut found = Found { exploded: vec![exploded(1, 0), exploded(2, 0)], ..Found::default() };
        let right = [exploded(3, 0), exploded(4, 1), exploded(5, 1)];
        found.append(Found { exploded: right.to_vec(), ..Found::default() });
        assert!(found.exploded.iter().map(|e| (e.node, e.first)).eq([
            (1, 0),
            (2, 0),
            (3, 2),
            (4, 3),
            (5, 3)
        ]));
        assert_eq!(found.locked(0.1), [false, true, true, false, true]);
        assert!(!concerns(&cube(10.0), &cube(1.0), 0.1) && concerns(&cube(10.0), &cube(1.0), 0.01));
    }
}
