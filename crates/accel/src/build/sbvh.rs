//! Spatial splits: Stich, Friedrich, Dietrich 2009, "Spatial splits in bounding volume hierarchies".
//!
//! A node is split between its references, as with the binned heuristic, or, where the parts of that split overlap by
//! more than `alpha` of the root's area, by a plane that cuts references in two; the cheaper of both is taken. A
//! reference at the plane is not cut where leaving it whole on one side is cheaper (unsplitting).
//!
//! Deviation: a budget bounds the number of references. What is left of it after a split is shared among the parts in
//! proportion to their references, so that parts can be built side by side and the tree does not depend on the threads.

use super::pieces::Piece;
use super::top_down::{self, MAX_HEURISTIC_DEPTH};
use super::{Binned, BuildConfig, Clip, Heuristic, RunBounds};
use crate::reference::unpack;
use crate::{BinaryTree, Node, Reference};
use vastlight_math::Aabb;
use vastlight_simd::Portable;

/// Overlap, as a part of the root's area, from which a plane is looked for.
const ALPHA: f32 = 1e-5;
const BINS: usize = 16;
/// Deeper nodes are split between references alone.
const MAX_SPATIAL_DEPTH: u32 = 48;
/// Nodes with fewer references are built by one thread.
const SERIAL: usize = 1 << 10;

/// Builds a tree with at most `most` references; none are cut without `clip`.
pub(super) fn build(
    references: &[Reference],
    clip: Option<&dyn Clip>,
    most: usize,
    config: &BuildConfig,
) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let around = unpack(&top_down::bounds(references, config.level).boxes);
    let builder = Builder {
        clip,
        binned: Binned::new(config),
        max_leaf: config.max_leaf.max(1) as usize,
        traversal_cost: config.traversal_cost,
        least_overlap: ALPHA * around.half_area(),
    };
    let room = if clip.is_some() { most.saturating_sub(references.len()) } else { 0 };
    let share = Share { room, depth: 0 };
    let (piece, prims) = builder.node(references.to_vec(), share);
    BinaryTree { nodes: piece.assemble(), prims }
}

struct Builder<'a> {
    clip: Option<&'a dyn Clip>,
    binned: Binned,
    max_leaf: usize,
    traversal_cost: f32,
    least_overlap: f32,
}

/// What a node has to go on with.
#[derive(Clone, Copy)]
struct Share {
    /// References that may be added.
    room: usize,
    depth: u32,
}

/// A plane, and the cost of splitting there.
#[derive(Clone, Copy)]
struct Plane {
    axis: usize,
    at: f32,
    cost: f32,
}

/// References on both sides.
struct Parts {
    left: Vec<Reference>,
    right: Vec<Reference>,
}

/// What fell into a bin: the box of the parts in it, and how many references start and end there.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    enter: usize,
    leave: usize,
}

impl Builder<'_> {
    /// The tree over `references`, and its primitives in order.
    fn node(&self, references: Vec<Reference>, share: Share) -> (Piece, Vec<u32>) {
        let bounds = top_down::bounds_of(Portable, &references);
        let count = references.len();
        let Some(parts) = self.divide(&references, &bounds, share) else {
            let node = Node { bounds: unpack(&bounds.boxes), left: 0, first: 0, count: count as u32 };
            return (Piece::subtree(vec![node]), references.iter().map(Reference::prim).collect());
        };
        drop(references);
        let total = parts.left.len() + parts.right.len();
        let room = share.room - (total - count);
        let left_room = (room as u64 * parts.left.len() as u64 / total as u64) as usize;
        let depth = share.depth + 1;
        let left = || self.node(parts.left, Share { room: left_room, depth });
        let right = || self.node(parts.right, Share { room: room - left_room, depth });
        let (left, right) = if total > SERIAL { rayon::join(left, right) } else { (left(), right()) };
        let mut prims = left.1;
        prims.extend(right.1);
        (Piece::pair(left.0, right.0), prims)
    }

    /// The parts of a node; none where it becomes a leaf.
    fn divide(&self, references: &[Reference], bounds: &RunBounds, share: Share) -> Option<Parts> {
        let count = references.len();
        if count == 1 {
            return None;
        }
        let may_be_leaf = count <= self.max_leaf;
        if share.depth >= MAX_HEURISTIC_DEPTH {
            return (!may_be_leaf).then(|| halves(references));
        }
        let figures = self.binned.gather(Portable, references, bounds, count);
        let object = self.binned.try_split(Portable, &figures, bounds, count);
        let whole = object.map(|(split, cost)| {
            let goes_left = |r: &&Reference| self.binned.goes_left(&split, r);
            let (left, right): (Vec<&Reference>, Vec<&Reference>) = references.iter().partition(goes_left);
            let copied = |part: Vec<&Reference>| part.into_iter().copied().collect::<Vec<_>>();
            (Parts { left: copied(left), right: copied(right) }, cost)
        });
        let object_cost = whole.as_ref().map_or(f32::INFINITY, |w| w.1);
        let plane = self.plane(references, bounds, whole.as_ref().map(|w| &w.0), share);
        let best = plane.map_or(object_cost, |p| p.cost.min(object_cost));
        if may_be_leaf && best >= self.binned.leaf_cost(bounds, count) {
            return None;
        }
        let cut = plane.filter(|p| p.cost < object_cost).and_then(|p| self.cut(references, &p, share.room));
        let parts = cut.or(whole.map(|w| w.0)).filter(|p| !p.left.is_empty() && !p.right.is_empty());
        parts.or_else(|| (!may_be_leaf).then(|| halves(references)))
    }

    /// The plane of least cost, if it is worth looking for.
    fn plane(
        &self,
        references: &[Reference],
        bounds: &RunBounds,
        object: Option<&Parts>,
        share: Share,
    ) -> Option<Plane> {
        if share.room == 0 || share.depth >= MAX_SPATIAL_DEPTH {
            return None;
        }
        if let Some(parts) = object {
            let overlap = around(&parts.left).intersection(around(&parts.right));
            if overlap.half_area() <= self.least_overlap {
                return None;
            }
        }
        let whole = unpack(&bounds.boxes);
        let planes = (0..3).filter_map(|axis| self.plane_along(references, &whole, axis));
        let best = planes.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some(Plane { cost: best.cost + self.traversal_cost * whole.half_area(), ..best })
    }

    fn plane_along(&self, references: &[Reference], whole: &Aabb, axis: usize) -> Option<Plane> {
        let (start, width) = (whole.min[axis], whole.size()[axis] / BINS as f32);
        if !(width > 0.0 && width.is_finite() && start + width > start) {
            return None;
        }
        let bin = |x: f32| (((x - start) / width) as usize).min(BINS - 1);
        let at: [f32; BINS + 1] = std::array::from_fn(|bin| start + width * bin as f32);
        let mut bins = [Bin { bounds: Aabb::EMPTY, enter: 0, leave: 0 }; BINS];
        let mut parts = [Aabb::EMPTY; BINS];
        for reference in references {
            let bounds = reference.bounds();
            let (first, last) = (bin(bounds.min[axis]), bin(bounds.max[axis]));
            bins[first].enter += 1;
            bins[last].leave += 1;
            match self.clip {
                Some(clip) if first < last => {
                    clip.slabs(reference.prim(), &bounds, axis, &at[first + 1..=last], &mut parts);
                }
                _ => parts[..=last - first].fill(bounds),
            }
            for (bin, part) in bins[first..=last].iter_mut().zip(&parts) {
                bin.bounds = bin.bounds.union(*part);
            }
        }
        let (last, cost) = self.cheapest(&bins)?;
        Some(Plane { axis, at: at[last + 1], cost })
    }

    /// The last bin on the left of the cheapest plane, and its cost.
    fn cheapest(&self, bins: &[Bin; BINS]) -> Option<(usize, f32)> {
        let cost = |bounds: &Aabb, count: usize| bounds.half_area() * count.div_ceil(self.max_leaf) as f32;
        let mut right = [(0.0, 0); BINS];
        let (mut bounds, mut count) = (Aabb::EMPTY, 0);
        for i in (1..BINS).rev() {
            (bounds, count) = (bounds.union(bins[i].bounds), count + bins[i].leave);
            right[i] = (cost(&bounds, count), count);
        }
        let mut best: Option<(usize, f32)> = None;
        let (mut bounds, mut count) = (Aabb::EMPTY, 0);
        for i in 0..BINS - 1 {
            (bounds, count) = (bounds.union(bins[i].bounds), count + bins[i].enter);
            let total = cost(&bounds, count) + right[i + 1].0;
            if count > 0 && right[i + 1].1 > 0 && total < best.map_or(f32::INFINITY, |b| b.1) {
                best = Some((i, total));
            }
        }
        best
    }

    /// The references on both sides of a plane; none if that gets nowhere or needs more than `room`.
    fn cut(&self, references: &[Reference], plane: &Plane, room: usize) -> Option<Parts> {
        let mut parts = Parts { left: Vec::new(), right: Vec::new() };
        let mut at_plane = Vec::new();
        for reference in references {
            let bounds = reference.bounds();
            if bounds.max[plane.axis] <= plane.at {
                parts.left.push(*reference);
            } else if bounds.min[plane.axis] >= plane.at {
                parts.right.push(*reference);
            } else {
                at_plane.push(*reference);
            }
        }
        self.place(&at_plane, plane, room, &mut parts);
        let count = references.len();
        (parts.left.len() < count && parts.right.len() < count).then_some(parts)
    }

    /// Puts references at the plane into the left part, the right part, or cut into both.
    fn place(&self, at_plane: &[Reference], plane: &Plane, room: usize, parts: &mut Parts) {
        let halves: Vec<[Aabb; 2]> = at_plane.iter().map(|r| self.cut_one(r, plane)).collect();
        let both = |side: usize| halves.iter().fold(Aabb::EMPTY, |a, h| a.union(h[side]));
        let mut bounds = [around(&parts.left).union(both(0)), around(&parts.right).union(both(1))];
        let mut counts =
            [parts.left.len() + at_plane.len(), parts.right.len() + at_plane.len()].map(|n| n as f32);
        let mut room = room;
        for (reference, cut) in at_plane.iter().zip(&halves) {
            let own = reference.bounds();
            let whole = [bounds[0].union(own), bounds[1].union(own)];
            let cost = |l: &Aabb, nl: f32, r: &Aabb, nr: f32| l.half_area() * nl + r.half_area() * nr;
            let left = cost(&whole[0], counts[0], &bounds[1], counts[1] - 1.0);
            let right = cost(&bounds[0], counts[0] - 1.0, &whole[1], counts[1]);
            let split = cost(&bounds[0], counts[0], &bounds[1], counts[1]);
            if cut.iter().all(|c| !c.is_empty()) && room > 0 && split < left.min(right) {
                parts.left.push(Reference::new(&cut[0], reference.prim()));
                parts.right.push(Reference::new(&cut[1], reference.prim()));
                room -= 1;
            } else if left <= right {
                parts.left.push(*reference);
                (bounds[0], counts[1]) = (whole[0], counts[1] - 1.0);
            } else {
                parts.right.push(*reference);
                (bounds[1], counts[0]) = (whole[1], counts[0] - 1.0);
            }
        }
    }

    /// The boxes of a reference's parts on both sides of a plane.
    fn cut_one(&self, reference: &Reference, plane: &Plane) -> [Aabb; 2] {
        let mut sides = [reference.bounds(); 2];
        (sides[0].max[plane.axis], sides[1].min[plane.axis]) = (plane.at, plane.at);
        sides.map(|side| self.part(reference, &side))
    }

    /// The box of the part of a reference inside `bounds`.
    fn part(&self, reference: &Reference, bounds: &Aabb) -> Aabb {
        self.clip.map_or(*bounds, |clip| clip.clip(reference.prim(), bounds))
    }
}

fn around(references: &[Reference]) -> Aabb {
    unpack(&top_down::bounds_of(Portable, references).boxes)
}

fn halves(references: &[Reference]) -> Parts {
    let (left, right) = references.split_at(references.len() / 2);
    Parts { left: left.to_vec(), right: right.to_vec() }
}
