//! Locally-ordered clustering: Meister, Bittner 2018, "Parallel locally-ordered clustering for bounding volume hierarchy
//! construction", in the order of Benthin, Meister, Barczak, Mehalwal, Tsakok, Kensler 2024, "H-PLOC: Hierarchical parallel
//! locally-ordered clustering for bounding volume hierarchy construction".
//!
//! Primitives in Morton order are clusters of one. In a round each cluster finds, among the [`RADIUS`] on either side, the
//! one with which it has the smallest box; two that found each other become one. H-PLOC does not do this for all clusters at
//! once, but upwards through the tree that the codes make: a node takes over the clusters of its children, and joins them
//! as soon as they are more than [`KEPT`], until they are no more. So all rounds stay within a cache.
//!
//! Deviations: of equally small boxes that of the clusters whose places differ in the lowest bit wins, so that equal
//! primitives pair off at once; a round that would join a single pair pairs neighbours instead, since in a row of growing
//! boxes, each nearest to the one before, trees would become as deep as the row is long.

use super::codes::{Boxes, sorted_codes};
use super::morton::split;
use super::{BuildConfig, Scratch};
use crate::reference::{EMPTY_LANES, unpack};
use crate::sort::{Pair, payload};
use crate::{BinaryTree, Node, Reference};
use vastlight_simd::{Kernel, Level, Simd8};

/// Neighbours that a cluster looks at on each side.
const RADIUS: usize = 8;
/// Most clusters that a node hands up.
const KEPT: usize = 16;
/// Most clusters of a node.
const MOST: usize = 2 * KEPT;
/// Runs and subtrees with fewer primitives are worked on by one thread.
const SERIAL: u32 = 1 << 12;

/// Builds a tree with one primitive in each leaf.
pub(super) fn build(references: &[Reference], config: &BuildConfig, scratch: &mut Scratch) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let sorted = sorted_codes(references, config.level, scratch);
    let none = Joint { children: [Reference::from_lanes(EMPTY_LANES); 2], count: 0 };
    let mut joints = vec![none; sorted.len()];
    let clusterer = Clusterer { references, leaves: sorted.len() as u32, level: config.level };
    let clusters = clusterer.below(sorted, 0, &mut joints);
    let root = clusterer.join(clusters, 1, 0, &mut joints).all[0];
    let forest = Forest { leaves: clusterer.leaves, joints };
    forest.lay_out(&root, |leaf| references[payload(sorted[leaf as usize]) as usize].prim())
}

/// Two clusters that became one.
#[derive(Clone, Copy, Debug)]
struct Joint {
    children: [Reference; 2],
    /// Primitives below.
    count: u32,
}

/// Clusters of a node. A cluster's number is that of a leaf, or that of a joint and the number of leaves. As many joints
/// as there are clusters are still free among those of the node's run; each cluster names one of them in its last lane.
#[derive(Clone, Copy)]
struct Clusters {
    all: [Reference; MOST],
    len: usize,
}

impl Clusters {
    fn as_slice(&self) -> &[Reference] {
        &self.all[..self.len]
    }
}

struct Clusterer<'a> {
    references: &'a [Reference],
    leaves: u32,
    level: Level,
}

impl Clusterer<'_> {
    /// The clusters of a run, at most [`KEPT`]; the run starts at `first`, and `joints` are its own.
    fn below(&self, run: &[Pair], first: u32, joints: &mut [Joint]) -> Clusters {
        if run.len() <= KEPT {
            return self.level.dispatch(Single { references: self.references, run, first });
        }
        let middle = split(run);
        let (left, right) = run.split_at(middle);
        let (left_joints, right_joints) = joints.split_at_mut(middle);
        let next = first + middle as u32;
        let mut left_clusters = || self.below(left, first, left_joints);
        let mut right_clusters = || self.below(right, next, right_joints);
        let (mut clusters, other) = if run.len() > SERIAL as usize {
            rayon::join(left_clusters, right_clusters)
        } else {
            (left_clusters(), right_clusters())
        };
        clusters.all[clusters.len..clusters.len + other.len].copy_from_slice(other.as_slice());
        clusters.len += other.len;
        self.join(clusters, KEPT, first, joints)
    }

    /// Joins clusters until at most `most` are left.
    fn join(&self, mut clusters: Clusters, most: usize, first: u32, joints: &mut [Joint]) -> Clusters {
        while clusters.len > most {
            clusters = self.level.dispatch(Round { clusters: &clusters, leaves: self.leaves, first, joints });
        }
        clusters
    }
}

/// Primitives as clusters.
struct Single<'a> {
    references: &'a [Reference],
    run: &'a [Pair],
    first: u32,
}

impl Kernel for Single<'_> {
    type Output = Clusters;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Clusters {
        let mut clusters = Clusters { all: [Reference::from_lanes(EMPTY_LANES); MOST], len: self.run.len() };
        for (place, slot) in clusters.all.iter_mut().enumerate().take(self.run.len()) {
            self.references.prefetch(simd, self.run, place);
            let number = self.first + place as u32;
            let reference = &self.references[payload(self.run[place]) as usize];
            *slot = Reference::to_cluster(*reference.lanes(), number, number + 1);
        }
        clusters
    }
}

/// One round of joining pairs.
struct Round<'a> {
    clusters: &'a Clusters,
    leaves: u32,
    first: u32,
    joints: &'a mut [Joint],
}

impl Kernel for Round<'_> {
    type Output = Clusters;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Clusters {
        let Self { clusters, leaves, first, joints } = self;
        let all = clusters.as_slice();
        let mut nearest = nearest(simd, all);
        let mutual = (0..all.len()).filter(|&i| nearest[nearest[i] as usize % MOST] as usize == i).count();
        if mutual <= 2 && all.len() > KEPT {
            for (i, nearest) in nearest.iter_mut().enumerate().take(all.len()) {
                *nearest = if (i ^ 1) < all.len() { i ^ 1 } else { i } as u8;
            }
        }
        let mut left = Clusters { all: clusters.all, len: 0 };
        for (i, cluster) in all.iter().enumerate() {
            let partner = nearest[i] as usize % MOST;
            let is_pair = nearest[partner] as usize == i && partner != i;
            if is_pair && partner < i {
                continue;
            }
            let mut kept = *cluster;
            if is_pair {
                let children = [*cluster, all[partner]];
                let [a, b] = children.map(|child| count(&child, leaves, first, joints));
                let [place, free] = children.map(|child| child.weight() - 1);
                let lanes = simd.min(simd.load(children[0].lanes()), simd.load(children[1].lanes()));
                joints[(place - first) as usize] = Joint { children, count: a + b };
                kept = Reference::to_cluster(simd.to_array(lanes), leaves + place, free + 1);
            }
            left.all[left.len] = kept;
            left.len += 1;
        }
        left
    }
}

/// Primitives below a cluster; `joints` start with that of number `first`.
#[inline(always)]
fn count(cluster: &Reference, leaves: u32, first: u32, joints: &[Joint]) -> u32 {
    cluster.prim().checked_sub(leaves).map_or(1, |joint| joints[(joint - first) as usize].count)
}

/// The nearest neighbour of each cluster.
#[inline(always)]
fn nearest<S: Simd8>(simd: S, clusters: &[Reference]) -> [u8; MOST] {
    // Lower corner and negated upper corner, by axis: places beyond the end hold anything.
    let mut lanes = [[0.0_f32; MOST + 8]; 6];
    for (place, cluster) in clusters.iter().enumerate() {
        for axis in 0..3 {
            lanes[axis][place] = cluster.lanes()[axis];
            lanes[axis + 3][place] = cluster.lanes()[axis + 4];
        }
    }
    let mut nearest = [0; MOST];
    for (own, nearest) in nearest.iter_mut().enumerate().take(clusters.len()) {
        let (from, to) = (own.saturating_sub(RADIUS), (own + RADIUS + 1).min(clusters.len()));
        let mut own_lanes = [simd.splat(0.0); 6];
        for axis in 0..6 {
            own_lanes[axis] = simd.splat(lanes[axis][own]);
        }
        let mut best = (u64::MAX, own);
        let mut block = from;
        while block < to {
            let mut d = [simd.splat(0.0); 3];
            for axis in 0..3 {
                let lower = simd.min(own_lanes[axis], load_at(simd, &lanes[axis], block));
                let upper = simd.min(own_lanes[axis + 3], load_at(simd, &lanes[axis + 3], block));
                d[axis] = simd.add(lower, upper);
            }
            let area = simd.add(simd.mul(d[0], d[1]), simd.add(simd.mul(d[1], d[2]), simd.mul(d[2], d[0])));
            let area = simd.to_array(area);
            for (lane, area) in area.into_iter().enumerate().take(to - block) {
                let other = block + lane;
                let rank = u64::from(area.to_bits()) << 32 | (own ^ other) as u64;
                if rank < best.0 && other != own {
                    best = (rank, other);
                }
            }
            block += 8;
        }
        *nearest = best.1 as u8;
    }
    nearest
}

#[inline(always)]
fn load_at<S: Simd8>(simd: S, lanes: &[f32; MOST + 8], place: usize) -> S::F {
    let lanes = lanes[place..].first_chunk::<8>();
    lanes.map_or(simd.splat(0.0), |lanes| simd.load(lanes))
}

/// What the clusters consist of. Numbers below `leaves` are leaves, others count joints.
struct Forest {
    leaves: u32,
    joints: Vec<Joint>,
}

impl Forest {
    fn count(&self, cluster: &Reference) -> u32 {
        count(cluster, self.leaves, 0, &self.joints)
    }

    /// The tree below `root`, depth first.
    fn lay_out(&self, root: &Reference, prim: impl Fn(u32) -> u32 + Sync) -> BinaryTree {
        let count = self.count(root);
        let mut nodes = bytemuck::zeroed_vec(2 * count as usize - 1);
        let mut prims = bytemuck::zeroed_vec(count as usize);
        if let Some((slot, below)) = nodes.split_first_mut() {
            self.place(&prim, Place { cluster: *root, slot, below, prims: &mut prims, next: 1, first: 0 });
        }
        BinaryTree { nodes, prims }
    }

    fn place(&self, prim: &(impl Fn(u32) -> u32 + Sync), place: Place<'_>) {
        let mut waiting = vec![place];
        while let Some(place) = waiting.pop() {
            let Place { cluster, slot, below, prims, next, first } = place;
            let count = prims.len() as u32;
            *slot = Node { bounds: unpack(cluster.lanes()), left: 0, first, count };
            let Some(joint) = cluster.prim().checked_sub(self.leaves) else {
                prims.iter_mut().for_each(|p| *p = prim(cluster.prim()));
                continue;
            };
            slot.left = next;
            let [left, right] = self.joints[joint as usize].children;
            let count_left = self.count(&left);
            let (pair, below) = below.split_at_mut(2);
            let (slot_left, slot_right) = pair.split_at_mut(1);
            let (below_left, below_right) = below.split_at_mut(2 * count_left as usize - 2);
            let (prims_left, prims_right) = prims.split_at_mut(count_left as usize);
            let next_right = next + 2 * count_left;
            let left = Place {
                cluster: left,
                slot: &mut slot_left[0],
                below: below_left,
                prims: prims_left,
                next: next + 2,
                first,
            };
            let right = Place {
                cluster: right,
                slot: &mut slot_right[0],
                below: below_right,
                prims: prims_right,
                next: next_right,
                first: first + count_left,
            };
            if count > SERIAL {
                rayon::join(|| self.place(prim, left), || self.place(prim, right));
            } else {
                waiting.extend([right, left]);
            }
        }
    }
}

/// Where a cluster's subtree goes: its root, what is below, its primitives, and the numbers of the last two's firsts.
struct Place<'a> {
    cluster: Reference,
    slot: &'a mut Node,
    below: &'a mut [Node],
    prims: &'a mut [u32],
    next: u32,
    first: u32,
}
