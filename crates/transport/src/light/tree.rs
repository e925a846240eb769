//! The light tree: a binary tree over lights that is descended at random, by importance at the shaded point.
//!
//! Conty Estevez and Kulla 2018 (see [`super::bounds`]): built top down with their surface area orientation heuristic
//! over binned centroids. Every light remembers its way from the root as bits, so its probability is found without a
//! search.

use super::ONE_MINUS_EPSILON;
use super::bounds::{LightBounds, Node};
use crate::words::Words;
use vastlight_math::lanes::{LANES, Lanes, Lanes3};
use vastlight_math::{Aabb, Vec3};

/// A light to be put into a tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: LightBounds,
    /// A sphere around the light; the centre of a planar one lies in its plane.
    pub(super) center: Vec3,
    pub(super) radius: f32,
    /// The caller's number of the light.
    pub(super) light: u32,
    /// A single triangle.
    pub(super) planar: bool,
}

/// A light chosen from a tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    pub(super) light: u32,
    pub(super) probability: f32,
    /// What is left of the random number, in [0, 1).
    pub(super) u: f32,
}

/// A binary tree of lights. The root is node 0, inner nodes' children follow each other. Up to [`FEW`] lights are a
/// list of leaves instead, of which each one is asked.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    is_list: bool,
}

/// So many lights need no tree.
pub(super) const FEW: usize = 4;

/// What a point may expect of a tree; see [`LightTree::estimate`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    /// Importance of all lights together; 0 where none can matter.
    pub(super) total: f32,
    /// Importance of each light of a list.
    each: [f32; FEW],
}

/// [`Estimate`] by lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct EstimateLanes {
    pub(super) total: Lanes,
    each: [Lanes; FEW],
}

impl EstimateLanes {
    /// That of a lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> Estimate {
        let [a, b, c, d] = &self.each;
        Estimate { total: self.total[lane], each: [a[lane], b[lane], c[lane], d[lane]] }
    }
}

/// Beyond this depth nodes are halved, so that 64 bits hold every way from the root.
const MAX_HEURISTIC_DEPTH: u32 = 32;
/// Subtrees with at least this many lights are built in parallel.
const PARALLEL: usize = 4096;
const BINS: usize = 12;
/// About so many of a node's lights are asked where to cut it.
const ASKED: usize = 4096;

/// Appends ways, two words each, the lower first.
pub(super) fn pack_trails(trails: &[u64], words: &mut Words) {
    trails.iter().for_each(|&trail| words.u32s(&[trail as u32, (trail >> 32) as u32]));
}

/// The way of a light that is in no tree.
pub(super) const NO_TRAIL: u64 = u64::MAX;

impl LightTree {
    /// Builds the tree and writes every light's way from the root into `trails[light]`.
    pub(super) fn build(mut items: Vec<Item>, trails: &mut [u64]) -> Self {
        if items.len() <= FEW {
            for (place, item) in items.iter().enumerate() {
                trails[item.light as usize] = place as u64;
            }
            return Self { nodes: items.iter().map(leaf).collect(), is_list: true };
        }
        let mut nodes = vec![Node::NOTHING; 2 * items.len() - 1];
        let (root, rest) = nodes.split_at_mut(1);
        let (node, _) = build_range(&mut items, rest, 1, 0);
        root[0] = node;
        let tree = Self { nodes, is_list: false };
        tree.mark_trails(0, 0, 0, trails);
        tree
    }

    fn mark_trails(&self, node: usize, trail: u64, depth: u32, trails: &mut [u64]) {
        let link = self.nodes[node].link as usize;
        if self.nodes[node].is_leaf() {
            trails[link] = trail;
        } else {
            self.mark_trails(link, trail, depth + 1, trails);
            self.mark_trails(link + 1, trail | 1 << depth, depth + 1, trails);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>()
    }

    /// Appends the nodes. Gives the words that name the tree: where the nodes start, and how many lights a list has (all
    /// bits for a tree).
    pub(super) fn pack(&self, words: &mut Words) -> [u32; 2] {
        let start = words.offset();
        self.nodes.iter().for_each(|node| node.pack(words));
        [start, if self.is_list { self.nodes.len() as u32 } else { u32::MAX }]
    }

    /// How much the lights may matter to a point; see [`Node::importance`].
    #[inline(always)]
    pub(super) fn estimate(&self, from: Vec3, normal: Vec3, directions: bool) -> Estimate {
        let mut each = [0.0; FEW];
        if !self.is_list {
            return Estimate { total: self.nodes[0].importance(from, normal, directions), each };
        }
        let mut total = 0.0;
        for (value, node) in each.iter_mut().zip(&self.nodes) {
            *value = node.importance(from, normal, directions);
            total += *value;
        }
        Estimate { total, each }
    }

    /// [`LightTree::estimate`] by lane, with `directions`.
    #[inline(always)]
    pub(super) fn estimate_lanes(&self, from: &Lanes3, normal: &Lanes3) -> EstimateLanes {
        let mut estimate = EstimateLanes { total: [0.0; LANES], each: [[0.0; LANES]; FEW] };
        if !self.is_list {
            estimate.total = self.nodes[0].importance_lanes(from, normal);
            return estimate;
        }
        for (each, node) in estimate.each.iter_mut().zip(&self.nodes) {
            *each = node.importance_lanes(from, normal);
            for (total, each) in estimate.total.iter_mut().zip(each) {
                *total += *each;
            }
        }
        estimate
    }

    /// Chooses a light with probability by importance; `None` where none can matter. Without `directions` normals of
    /// the lights are not looked at. `estimate` must be this tree's for the same arguments.
    #[inline]
    pub(super) fn sample(
        &self,
        estimate: &Estimate,
        from: Vec3,
        normal: Vec3,
        u: f32,
        directions: bool,
    ) -> Option<Choice> {
        if self.is_list {
            return self.sample_list(estimate, u);
        }
        let mut node = &self.nodes[0];
        let (mut u, mut probability) = (u, 1.0_f32);
        while !node.is_leaf() {
            let p = self.left_probability(node, from, normal, directions)?;
            let link = node.link as usize;
            if u < p {
                (node, u, probability) = (&self.nodes[link], u / p, probability * p);
            } else {
                let q = 1.0 - p;
                (node, u, probability) = (&self.nodes[link + 1], (u - p) / q, probability * q);
            }
            u = u.min(ONE_MINUS_EPSILON);
        }
        Some(Choice { light: node.link, probability, u })
    }

    #[inline]
    fn sample_list(&self, estimate: &Estimate, u: f32) -> Option<Choice> {
        let mut rest = u * estimate.total;
        let mut chosen = None;
        for (node, &value) in self.nodes.iter().zip(&estimate.each) {
            if value > 0.0 {
                let u = (rest / value).min(ONE_MINUS_EPSILON);
                chosen = Some(Choice { light: node.link, probability: value / estimate.total, u });
                if rest < value {
                    break;
                }
                rest -= value;
            }
        }
        chosen
    }

    /// The probability with which [`LightTree::sample`] chooses the light at the end of `trail`.
    #[inline]
    pub(super) fn probability(
        &self,
        estimate: &Estimate,
        trail: u64,
        from: Vec3,
        normal: Vec3,
        directions: bool,
    ) -> f32 {
        if trail == NO_TRAIL || estimate.total <= 0.0 {
            return 0.0;
        }
        if self.is_list {
            return estimate.each[trail as usize] / estimate.total;
        }
        let (mut node, mut trail, mut probability) = (&self.nodes[0], trail, 1.0_f32);
        while !node.is_leaf() {
            let Some(p) = self.left_probability(node, from, normal, directions) else { return 0.0 };
            let right = trail & 1;
            probability *= if right == 0 { p } else { 1.0 - p };
            node = &self.nodes[node.link as usize + right as usize];
            trail >>= 1;
        }
        probability
    }

    #[inline]
    fn left_probability(&self, node: &Node, from: Vec3, normal: Vec3, directions: bool) -> Option<f32> {
        let link = node.link as usize;
        let left = self.nodes[link].importance(from, normal, directions);
        let right = self.nodes[link + 1].importance(from, normal, directions);
        let sum = left + right;
        (sum > 0.0).then(|| left / sum)
    }
}

fn leaf(item: &Item) -> Node {
    Node::new(&item.bounds, item.center, item.radius, item.light).into_leaf(item.planar)
}

/// Builds the subtree over `items`, whose inner nodes' children go to `nodes` (two less than twice the items), which
/// start at `offset` in the whole tree. Returns its root and bounds.
fn build_range(items: &mut [Item], nodes: &mut [Node], offset: usize, depth: u32) -> (Node, LightBounds) {
    if let [item] = items {
        return (leaf(item), item.bounds);
    }
    let middle = split(items, depth);
    let parallel = items.len() >= PARALLEL;
    let (left_items, right_items) = items.split_at_mut(middle);
    let (pair, below) = nodes.split_at_mut(2);
    let left_len = 2 * (left_items.len() - 1);
    let (left_nodes, right_nodes) = below.split_at_mut(left_len);
    let mut left = || build_range(left_items, left_nodes, offset + 2, depth + 1);
    let mut right = || build_range(right_items, right_nodes, offset + 2 + left_len, depth + 1);
    let ((l, lb), (r, rb)) = if parallel { rayon::join(left, right) } else { (left(), right()) };
    pair.copy_from_slice(&[l, r]);
    let bounds = lb.union(&rb);
    let center = bounds.aabb.center();
    let reach = (l.center.distance(center) + l.radius).max(r.center.distance(center) + r.radius);
    let radius = reach.min(0.5 * bounds.aabb.size().length());
    (Node::new(&bounds, center, radius, offset as u32), bounds)
}

/// Orders `items` and returns where to cut them, at least one on each side.
fn split(items: &mut [Item], depth: u32) -> usize {
    let half = items.len() / 2;
    if items.len() == 2 {
        return half;
    }
    let centers = Aabb::from_points(items.iter().map(|i| i.bounds.aabb.center()));
    if depth < MAX_HEURISTIC_DEPTH
        && let Some((axis, cut)) = best_cut(items, &centers)
    {
        let bin = |i: &Item| bin_of(i.bounds.aabb.center()[axis], &centers, axis);
        // Stable, so that the tree does not depend on the sort.
        items.sort_by_key(|i| bin(i) >= cut);
        return items.partition_point(|i| bin(i) < cut);
    }
    let axis = centers.longest_axis();
    items.select_nth_unstable_by(half, |a, b| {
        let key = |i: &Item| i.bounds.aabb.center()[axis];
        key(a).total_cmp(&key(b)).then(a.light.cmp(&b.light))
    });
    half
}

fn bin_of(x: f32, centers: &Aabb, axis: usize) -> usize {
    let (low, high) = (centers.min[axis], centers.max[axis]);
    (((x - low) / (high - low) * BINS as f32) as usize).min(BINS - 1)
}

/// The axis and first bin of the right side with the lowest cost, if the centres differ at all.
fn best_cut(items: &[Item], centers: &Aabb) -> Option<(usize, usize)> {
    let size = centers.size();
    let mut best: Option<(f32, usize, usize)> = None;
    let stride = items.len().div_ceil(ASKED);
    for axis in 0..3 {
        // A very flat axis is never chosen: the heuristic's factor for long thin nodes.
        if size[axis] <= size.max_element() * 0.05 {
            continue;
        }
        let stretch = size.max_element() / size[axis];
        let mut bins: [Option<LightBounds>; BINS] = [None; BINS];
        for item in items.iter().step_by(stride) {
            let bin = &mut bins[bin_of(item.bounds.aabb.center()[axis], centers, axis)];
            *bin = Some(bin.map_or(item.bounds, |b| b.union(&item.bounds)));
        }
        for (cut, cost) in cut_costs(&bins) {
            if best.is_none_or(|(lowest, _, _)| cost * stretch < lowest) {
                best = Some((cost * stretch, axis, cut));
            }
        }
    }
    best.map(|(_, axis, cut)| (axis, cut))
}

/// Cost of cutting before each bin, where both sides have lights.
fn cut_costs(bins: &[Option<LightBounds>; BINS]) -> impl Iterator<Item = (usize, f32)> {
    let mut right_cost = [None; BINS];
    let mut right: Option<LightBounds> = None;
    for i in (1..BINS).rev() {
        right = join(right, bins[i]);
        right_cost[i] = right.map(|b| b.cost());
    }
    let mut left: Option<LightBounds> = None;
    let bins = *bins;
    (1..BINS).filter_map(move |i| {
        left = join(left, bins[i - 1]);
        Some((i, left?.cost() + right_cost[i]?))
    })
}

fn join(a: Option<LightBounds>, b: Option<LightBounds>) -> Option<LightBounds> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(&b)),
        (a, b) => a.or(b),
    }
}
