//! Parallel locally-ordered clustering: Meister, Bittner 2018, "Parallel locally-ordered clustering for bounding volume
//! hierarchy construction".
//!
//! Primitives in Morton order are clusters of one. In each round every cluster finds, among the [`RADIUS`] on either
//! side, the one with which it has the smallest box; two that found each other become one, in the place of the first.
//! Bottom-up, no plane and no cost model are needed.
//!
//! Deviations: of equally small boxes that of the clusters whose places differ in the lowest bit wins, so that equal
//! primitives pair off at once; a round in which too few found each other pairs neighbours, so that rounds stay few.

use super::codes::sorted_codes;
use super::{BuildConfig, Scratch};
use crate::reference::unpack;
use crate::sort::{parts, payload};
use crate::{BinaryTree, Node, Reference};
use rayon::prelude::*;
use vastlight_simd::{Kernel, Level, Simd8};

/// Neighbours that a cluster looks at on each side.
const RADIUS: usize = 14;
/// Clusters that one thread looks at at a time.
const CHUNK: usize = 1 << 10;
/// A round that joins fewer than one in so many clusters pairs neighbours instead.
const FEWEST: usize = 8;
/// Rounds over so few clusters may be as many as they like.
const FEW: usize = 32;
/// Subtrees with fewer primitives are laid out by one thread.
const SERIAL: u32 = 1 << 12;

/// Builds a tree with one primitive in each leaf.
pub(super) fn build(references: &[Reference], config: &BuildConfig, scratch: &mut Scratch) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let sorted = sorted_codes(references, config.level, scratch);
    let mut clusters: Vec<Reference> = sorted
        .par_iter()
        .zip(0..sorted.len() as u32)
        .map(|(&pair, i)| references[payload(pair) as usize].renumbered(i))
        .collect();
    let mut forest = Forest { leaves: clusters.len() as u32, joints: Vec::with_capacity(clusters.len()) };
    while clusters.len() > 1 {
        clusters = forest.round(&clusters, config.level);
    }
    let root = clusters[0];
    let prim = |leaf: u32| references[payload(sorted[leaf as usize]) as usize].prim();
    forest.lay_out(&root, prim)
}

/// Two clusters that became one.
#[derive(Clone, Copy, Debug)]
struct Joint {
    children: [Reference; 2],
    /// Primitives below.
    count: u32,
}

/// What the clusters consist of. Numbers below `leaves` are leaves, others count joints.
struct Forest {
    leaves: u32,
    joints: Vec<Joint>,
}

impl Forest {
    fn count(&self, cluster: &Reference) -> u32 {
        match cluster.prim().checked_sub(self.leaves) {
            Some(joint) => self.joints[joint as usize].count,
            None => 1,
        }
    }

    /// Joins pairs; gives the clusters that are left.
    fn round(&mut self, clusters: &[Reference], level: Level) -> Vec<Reference> {
        let mut nearest = vec![0; clusters.len()];
        nearest.par_chunks_mut(CHUNK).enumerate().for_each(|(i, nearest)| {
            level.dispatch(FindNearest { clusters, first: i * CHUNK, nearest });
        });
        let all = clusters.len();
        let mutual = |i: usize| nearest[nearest[i] as usize] as usize == i;
        let joined = (0..all).into_par_iter().with_min_len(CHUNK).filter(|&i| mutual(i)).count() / 2;
        if joined * FEWEST < all && all > FEW {
            nearest = (0..all as u32).map(|i| if (i ^ 1) < all as u32 { i ^ 1 } else { i }).collect();
        }
        self.join(clusters, &nearest, level)
    }

    /// Joins clusters that name each other in `nearest`.
    fn join(&mut self, clusters: &[Reference], nearest: &[u32], level: Level) -> Vec<Reference> {
        let partner = |i: usize| (nearest[nearest[i] as usize] as usize == i).then_some(nearest[i] as usize);
        let chunks = clusters.len().div_ceil(CHUNK);
        let range = |chunk: usize| chunk * CHUNK..((chunk + 1) * CHUNK).min(clusters.len());
        let sizes: Vec<[usize; 2]> = (0..chunks)
            .into_par_iter()
            .map(|chunk| {
                let pairs = range(chunk).filter(|&i| partner(i).is_some_and(|p| p > i)).count();
                let gone = range(chunk).filter(|&i| partner(i).is_some_and(|p| p < i)).count();
                [pairs, range(chunk).len() - gone]
            })
            .collect();
        let joint = Joint { children: [clusters[0]; 2], count: 0 };
        let mut joints = vec![joint; sizes.iter().map(|s| s[0]).sum()];
        let mut left = vec![clusters[0]; sizes.iter().map(|s| s[1]).sum()];
        let firsts = sizes.iter().scan(self.leaves + self.joints.len() as u32, |next, size| {
            *next += size[0] as u32;
            Some(*next - size[0] as u32)
        });
        let firsts: Vec<u32> = firsts.collect();
        let places = parts(&mut joints, sizes.iter().map(|s| s[0]));
        let left_places = parts(&mut left, sizes.iter().map(|s| s[1]));
        places.into_par_iter().zip(left_places).zip(firsts).enumerate().for_each(
            |(chunk, ((joints, left), first))| {
                let (mut joints, mut left) = (joints.iter_mut().zip(first..), left.iter_mut());
                for i in range(chunk) {
                    let kept = match partner(i) {
                        Some(p) if p < i => continue,
                        Some(p) if p > i => {
                            let children = [clusters[i], clusters[p]];
                            let Some((joint, number)) = joints.next() else { continue };
                            *joint = Joint {
                                children,
                                count: self.count(&children[0]) + self.count(&children[1]),
                            };
                            level.dispatch(Unite { children, number })
                        }
                        _ => clusters[i],
                    };
                    if let Some(place) = left.next() {
                        *place = kept;
                    }
                }
            },
        );
        self.joints.append(&mut joints);
        left
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

/// The box around two clusters, with a number.
struct Unite {
    children: [Reference; 2],
    number: u32,
}

impl Kernel for Unite {
    type Output = Reference;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Reference {
        let [a, b] = &self.children;
        Reference::from_lanes(simd.to_array(simd.min(simd.load(a.lanes()), simd.load(b.lanes()))))
            .renumbered(self.number)
    }
}

/// Finds the nearest neighbour of each of the clusters from `first` on.
struct FindNearest<'a> {
    clusters: &'a [Reference],
    first: usize,
    nearest: &'a mut [u32],
}

/// Clusters of a chunk and those around it.
const WINDOW: usize = CHUNK + 2 * RADIUS + 8;

impl Kernel for FindNearest<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let start = self.first.saturating_sub(RADIUS);
        let end = (self.first + self.nearest.len() + RADIUS).min(self.clusters.len());
        // Lower corner and negated upper corner, by axis: places beyond the end hold anything.
        let mut lanes = vec![[0.0_f32; WINDOW]; 6];
        for (place, cluster) in self.clusters[start..end].iter().enumerate() {
            for axis in 0..3 {
                lanes[axis][place] = cluster.lanes()[axis];
                lanes[axis + 3][place] = cluster.lanes()[axis + 4];
            }
        }
        for (own, nearest) in (self.first..).zip(self.nearest.iter_mut()) {
            let (from, to) = (own.saturating_sub(RADIUS).max(start), (own + RADIUS + 1).min(end));
            let mut own_lanes = [simd.splat(0.0); 6];
            for axis in 0..6 {
                own_lanes[axis] = simd.splat(lanes[axis][own - start]);
            }
            let mut best = (u64::MAX, own);
            let mut block = from;
            while block < to {
                let mut d = [simd.splat(0.0); 3];
                for axis in 0..3 {
                    let lower = simd.min(own_lanes[axis], load_at(simd, &lanes[axis], block - start));
                    let upper = simd.min(own_lanes[axis + 3], load_at(simd, &lanes[axis + 3], block - start));
                    d[axis] = simd.add(lower, upper);
                }
                let area =
                    simd.add(simd.mul(d[0], d[1]), simd.add(simd.mul(d[1], d[2]), simd.mul(d[2], d[0])));
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
            *nearest = best.1 as u32;
        }
    }
}

#[inline(always)]
fn load_at<S: Simd8>(simd: S, lanes: &[f32; WINDOW], place: usize) -> S::F {
    let lanes = lanes[place..].first_chunk::<8>();
    lanes.map_or(simd.splat(0.0), |lanes| simd.load(lanes))
}
