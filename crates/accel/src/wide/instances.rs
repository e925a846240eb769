//! The tree over the instances of a scene: where they are many, of small nodes, and built in little memory.
//!
//! Many instances are parted first: by the cells of a Morton-ordered grid over their boxes' centres, which needs four bytes for
//! each of them. Groups of neighbours then get trees of their own, a few groups at a time, and one tree goes above
//! the groups.

use super::{ChildRef, Node8, QuantisedBoxes, TopBvh, WideNode};
use crate::{BuildConfig, BuildError, Quality, Scratch};
use rayon::prelude::*;
use std::ops::Range;
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::Simd8;

/// Up to so many instances have a tree of full nodes, built at once.
const FEW: usize = 1 << 18;
/// Most instances that are built over at once where they are more.
const GROUP: usize = 1 << 15;
/// Instances for each node at least, unless they lie oddly.
const USUAL_CHILDREN: usize = 4;
/// Groups that are built side by side, before their nodes are put to the others.
const WAVE: usize = 32;
/// Bits of a cell's number along each axis.
const CELL_BITS: u32 = 6;
/// Grids in cells of grids.
const MOST_DEPTH: u32 = 8;

/// Eight children with rounded boxes, 96 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub struct SmallNode {
    boxes: QuantisedBoxes,
    children: [ChildRef; 8],
}

impl SmallNode {
    /// The node with the boxes of `node` rounded outward, and its children changed.
    fn new(node: &Node8, child: impl Fn(ChildRef) -> ChildRef) -> Self {
        let children = node.children.map(|c| if c == ChildRef::NONE { c } else { child(c) });
        let used = (0..8).fold(0, |used, slot| used | u8::from(children[slot] != ChildRef::NONE) << slot);
        Self { boxes: QuantisedBoxes::new(node, used), children }
    }
}

/// A node further on; leaves stay.
fn moved(child: ChildRef, by: u32) -> ChildRef {
    if child.is_leaf() { child } else { ChildRef::node(child.index() as u32 + by) }
}

impl WideNode for SmallNode {
    #[inline(always)]
    fn child(&self, _place: usize, slot: usize) -> ChildRef {
        self.children[slot]
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

/// Nodes of one of two kinds.
#[derive(Clone, Debug, PartialEq)]
pub enum InstanceNodes {
    /// Faster, for few instances.
    Full(Vec<Node8>),
    /// Three eighths of the memory, for many.
    Small(Vec<SmallNode>),
}

impl Default for InstanceNodes {
    fn default() -> Self {
        Self::Full(Vec::new())
    }
}

/// A node of either kind.
#[derive(Clone, Copy, Debug)]
pub enum InstanceNode<'a> {
    /// A full one.
    Full(&'a Node8),
    /// A small one.
    Small(&'a SmallNode),
}

impl InstanceNodes {
    /// The node at a place; none where there is none.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, place: usize) -> Option<InstanceNode<'_>> {
        match self {
            Self::Full(nodes) => nodes.get(place).map(InstanceNode::Full),
            Self::Small(nodes) => nodes.get(place).map(InstanceNode::Small),
        }
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Full(nodes) => nodes.len(),
            Self::Small(nodes) => nodes.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Leaves the first nodes alone.
    pub(super) fn truncate(&mut self, count: usize) {
        match self {
            Self::Full(nodes) => nodes.truncate(count),
            Self::Small(nodes) => nodes.truncate(count),
        }
    }

    /// Adds a node with its children changed.
    pub(super) fn push(&mut self, node: &Node8, child: impl Fn(ChildRef) -> ChildRef) {
        match self {
            Self::Full(nodes) => nodes.push(Node8 { children: node.children.map(child), ..*node }),
            Self::Small(nodes) => nodes.push(SmallNode::new(node, child)),
        }
    }

    /// Memory, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match self {
            Self::Full(nodes) => size_of_val(&nodes[..]),
            Self::Small(nodes) => size_of_val(&nodes[..]),
        }
    }
}

impl WideNode for InstanceNode<'_> {
    #[inline(always)]
    fn child(&self, place: usize, slot: usize) -> ChildRef {
        match self {
            Self::Full(node) => node.child(place, slot),
            Self::Small(node) => node.child(place, slot),
        }
    }

    #[inline(always)]
    fn planes<S: Simd8>(&self, s: S, axis: usize, side: usize) -> S::F {
        match self {
            Self::Full(node) => node.planes(s, axis, side),
            Self::Small(node) => node.planes(s, axis, side),
        }
    }

    #[inline(always)]
    fn bounds(&self, slot: usize) -> Aabb {
        match self {
            Self::Full(node) => node.bounds(slot),
            Self::Small(node) => node.bounds(slot),
        }
    }

    #[inline(always)]
    fn used(&self) -> u32 {
        match self {
            Self::Full(node) => node.used(),
            Self::Small(node) => node.used(),
        }
    }
}

/// A wide tree over instances; its leaves are their numbers.
#[derive(Clone, Debug, Default)]
pub struct InstanceBvh {
    /// Wide nodes.
    pub nodes: InstanceNodes,
    /// Where rays start; none without instances.
    pub root: Option<ChildRef>,
    /// Nodes on the longest way from the root to a leaf.
    pub levels: usize,
    /// Of the binary trees as they were built, without movers that were put beside them.
    pub quality: Quality,
}

/// A group's tree, whose nodes are counted from 0.
pub(super) struct Group {
    nodes: Vec<SmallNode>,
    root: ChildRef,
    pub(super) levels: usize,
    quality: Quality,
    bounds: Aabb,
}

impl InstanceBvh {
    /// Builds with the builder `name` over those of `count` instances whose box is not empty; instance `i` becomes leaf `i`, for
    /// whose cost `costs` is asked. The tree is the same for any number of threads.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn build(
        name: &str,
        count: usize,
        bounds: impl Fn(u32) -> Aabb + Sync,
        costs: impl Fn(u32) -> f64 + Sync,
        config: &BuildConfig,
    ) -> Result<Self, BuildError> {
        if count >= 1 << 31 {
            return Err(BuildError::TooMany(count));
        }
        if count > FEW {
            return Self::of_groups(name, count, bounds, costs, config);
        }
        let boxes: Vec<Aabb> = (0..count as u32).into_par_iter().map(&bounds).collect();
        let top = TopBvh::build(name, &boxes, costs, config, &mut Scratch::default())?;
        let TopBvh { nodes, root, levels, quality } = top;
        Ok(Self { nodes: InstanceNodes::Full(nodes), root, levels, quality })
    }

    /// The same for many.
    fn of_groups(
        name: &str,
        count: usize,
        bounds: impl Fn(u32) -> Aabb + Sync,
        costs: impl Fn(u32) -> f64 + Sync,
        config: &BuildConfig,
    ) -> Result<Self, BuildError> {
        let mut order: Vec<u32> = Vec::with_capacity(count);
        order.extend((0..count as u32).filter(|&i| !bounds(i).is_empty()));
        let groups = groups(&mut order, &bounds);
        let group = |scratch: &mut Scratch, run: &Range<usize>| {
            Group::build(name, &order[run.clone()], &bounds, &costs, config, scratch)
        };
        let (mut nodes, mut parts) = (Vec::new(), Vec::with_capacity(groups.len()));
        // Room for all: a vector of such elements is copied when it grows. What is not used costs no memory.
        nodes.reserve_exact(count / USUAL_CHILDREN + 1);
        for wave in groups.chunks(WAVE) {
            let built: Vec<_> = wave.par_iter().map_init(Scratch::default, group).collect();
            for group in built {
                if let Some(group) = group? {
                    parts.push(group.moved_to(&mut nodes));
                }
            }
        }
        drop(order);
        Self::join(name, nodes, &parts, config)
    }

    /// Puts a tree above groups whose nodes are `nodes`.
    fn join(
        name: &str,
        mut nodes: Vec<SmallNode>,
        groups: &[Group],
        config: &BuildConfig,
    ) -> Result<Self, BuildError> {
        let boxes: Vec<Aabb> = groups.iter().map(|group| group.bounds).collect();
        let costs = |group: u32| groups[group as usize].quality.cost;
        let top = TopBvh::build(name, &boxes, costs, config, &mut Scratch::default())?;
        let first = nodes.len() as u32;
        let child = |child: ChildRef| {
            if child.is_leaf() { groups[child.index()].root } else { moved(child, first) }
        };
        nodes.extend(top.nodes.iter().map(|node| SmallNode::new(node, child)));
        let levels = top.levels + groups.iter().map(|group| group.levels).max().unwrap_or(0);
        let of_groups = |figure: fn(&Quality) -> usize| groups.iter().map(move |g| figure(&g.quality));
        let quality = Quality {
            nodes: top.quality.nodes + of_groups(|q| q.nodes).sum::<usize>() - groups.len(),
            references: of_groups(|q| q.references).sum(),
            depth: (top.quality.depth + of_groups(|q| q.depth).max().unwrap_or(0)).saturating_sub(1),
            ..top.quality
        };
        Ok(Self { nodes: InstanceNodes::Small(nodes), root: top.root.map(child), levels, quality })
    }

    /// Memory of the nodes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.nodes.bytes()
    }
}

impl Group {
    /// Puts the nodes behind others; what is left.
    fn moved_to(self, nodes: &mut Vec<SmallNode>) -> Self {
        let Self { levels, quality, bounds, .. } = self;
        let root = self.append_to(nodes, |leaf| leaf);
        Self { nodes: Vec::new(), root, levels, quality, bounds }
    }

    /// Puts the nodes behind others, with other numbers of leaves; gives the root.
    pub(super) fn append_to(self, nodes: &mut Vec<SmallNode>, leaf: impl Fn(u32) -> u32) -> ChildRef {
        let first = nodes.len() as u32;
        let child = |child: ChildRef| match child {
            ChildRef::NONE => child,
            child if child.is_leaf() => ChildRef::leaf(leaf(child.index() as u32)),
            child => moved(child, first),
        };
        let renumbered = |node: &SmallNode| SmallNode { children: node.children.map(child), ..*node };
        nodes.extend(self.nodes.iter().map(renumbered));
        child(self.root)
    }

    /// The tree over some instances; none if their boxes are empty.
    pub(super) fn build(
        name: &str,
        instances: &[u32],
        bounds: &(impl Fn(u32) -> Aabb + Sync),
        costs: &(impl Fn(u32) -> f64 + Sync),
        config: &BuildConfig,
        scratch: &mut Scratch,
    ) -> Result<Option<Self>, BuildError> {
        let boxes: Vec<Aabb> = instances.par_iter().with_min_len(256).map(|&i| bounds(i)).collect();
        let costs = |place: u32| costs(instances[place as usize]);
        let top = TopBvh::build(name, &boxes, costs, config, scratch)?;
        let child = |child: ChildRef| {
            if child.is_leaf() { ChildRef::leaf(instances[child.index()]) } else { child }
        };
        let nodes = top.nodes.iter().map(|node| SmallNode::new(node, child)).collect();
        let bounds = boxes.into_iter().filter(|b| !b.is_empty()).fold(Aabb::EMPTY, Aabb::union);
        let (levels, quality) = (top.levels, top.quality);
        Ok(top.root.map(|root| Self { nodes, root: child(root), levels, quality, bounds }))
    }
}

/// Orders instances so that neighbours follow each other, and cuts them into runs of at most [`GROUP`].
fn groups(order: &mut [u32], bounds: &(impl Fn(u32) -> Aabb + Sync)) -> Vec<Range<usize>> {
    let mut groups = Vec::new();
    part(order, 0, 0, bounds, &mut groups);
    groups
}

/// The same for a run that begins at `first`, in a cell of so many grids.
fn part(
    run: &mut [u32],
    first: usize,
    depth: u32,
    bounds: &(impl Fn(u32) -> Aabb + Sync),
    groups: &mut Vec<Range<usize>>,
) {
    if run.len() <= GROUP || depth == MOST_DEPTH {
        let starts = (first..first + run.len()).step_by(GROUP);
        groups.extend(starts.map(|start| start..(start + GROUP).min(first + run.len())));
        return;
    }
    let starts = sort_by_cell(run, bounds);
    gather(&starts, 0, starts.len() - 1, &mut |cells: Range<usize>| {
        let inside = starts[cells.start]..starts[cells.end];
        part(&mut run[inside.clone()], first + inside.start, depth + 1, bounds, groups);
    });
}

/// Gives runs of cells with at most [`GROUP`] instances each, or of a single cell, in order.
fn gather(starts: &[usize], first: usize, cells: usize, give: &mut impl FnMut(Range<usize>)) {
    let count = starts[first + cells] - starts[first];
    if count == 0 {
        return;
    }
    if count <= GROUP || cells == 1 {
        return give(first..first + cells);
    }
    gather(starts, first, cells / 2, give);
    gather(starts, first + cells / 2, cells / 2, give);
}

/// Sorts instances by their cell in a grid over the centres of their boxes; gives where each cell begins, and the end.
fn sort_by_cell(run: &mut [u32], bounds: &(impl Fn(u32) -> Aabb + Sync)) -> Vec<usize> {
    const CELLS: usize = 1 << (3 * CELL_BITS);
    let center = |i: u32| {
        let Aabb { min, max } = bounds(i);
        let limit = Vec3::splat(1e30);
        (min.max(-limit) * 0.5 + max.min(limit) * 0.5).min(limit)
    };
    let around = |a: Aabb, b: Aabb| a.union(b);
    let centers =
        run.par_iter().map(|&i| Aabb { min: center(i), max: center(i) }).reduce(|| Aabb::EMPTY, around);
    let scale = ((1 << CELL_BITS) as f32 / centers.size()).min(Vec3::splat(f32::MAX));
    let cell = |i: u32| morton(((center(i) - centers.min) * scale).to_array());
    let mut starts = vec![0; CELLS + 1];
    let before = run.to_vec();
    for_cells(&before, &cell, |_, cell| starts[cell + 1] += 1);
    (0..CELLS).for_each(|i| starts[i + 1] += starts[i]);
    let mut next = starts.clone();
    for_cells(&before, &cell, |i, cell| {
        run[next[cell]] = i;
        next[cell] += 1;
    });
    starts
}

/// Calls `each` with every instance and its cell, in order; cells are found by all threads.
fn for_cells(run: &[u32], cell: &(impl Fn(u32) -> u32 + Sync), mut each: impl FnMut(u32, usize)) {
    const BLOCK: usize = 1 << 16;
    let mut cells = Vec::new();
    for block in run.chunks(BLOCK) {
        block.par_iter().with_min_len(256).map(|&i| cell(i)).collect_into_vec(&mut cells);
        block.iter().zip(&cells).for_each(|(&i, &cell)| each(i, cell as usize));
    }
}

/// The number of a cell in Morton order; what is no number is cell 0.
fn morton(place: [f32; 3]) -> u32 {
    let bit = |x: f32, bit: u32| (x as u32).min((1 << CELL_BITS) - 1) >> bit & 1;
    (0..3 * CELL_BITS).fold(0, |code, i| code | bit(place[i as usize % 3], i / 3) << i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Violation;
    use crate::wide::{Boxes, validate_nodes};

    fn boxes(count: usize, place: impl Fn(f32) -> f32) -> Vec<Aabb> {
        let mut state = 7_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        let mut one = || {
            let min = Vec3::new(place(random()), place(random()), place(random()));
            Aabb { min, max: min + Vec3::new(random(), random(), random()) * 0.01 }
        };
        (0..count).map(|_| one()).collect()
    }

    fn validate(bvh: &InstanceBvh, boxes: &[Aabb]) -> Result<(), Violation> {
        let nodes: Vec<Node8> = match &bvh.nodes {
            InstanceNodes::Full(nodes) => nodes.clone(),
            InstanceNodes::Small(nodes) => {
                nodes.iter().enumerate().map(|(place, node)| node.to_wide(place)).collect()
            }
        };
        let leaf = |i: usize| Some(vec![(i as u32, *boxes.get(i)?)]);
        validate_nodes(&nodes, bvh.root, boxes.len(), Boxes::Rounded, leaf, |_, _| false).map(drop)
    }

    fn build(boxes: &[Aabb]) -> InstanceBvh {
        let config = BuildConfig { measure: true, ..BuildConfig::default() };
        InstanceBvh::of_groups("", boxes.len(), |i| boxes[i as usize], |_| 1.0, &config).expect("built")
    }

    #[test]
    fn few_and_many_are_sound_wherever_they_are() {
        type Place = fn(f32) -> f32;
        let everywhere: Place = |x| x;
        // Most in one cell of one cell, and all in one place.
        let heap: Place = |x| if x > 0.99 { x * 1e6 } else { x * 1e-3 };
        let one: Place = |_| 5.0;
        for (count, place) in [
            (0, everywhere),
            (1, everywhere),
            (2, one),
            (1000, heap),
            (70_000, everywhere),
            (70_000, heap),
            (40_000, one),
        ] {
            let boxes = boxes(count, place);
            let bvh = build(&boxes);
            validate(&bvh, &boxes).unwrap_or_else(|violation| panic!("{count}: {violation}"));
            assert_eq!(bvh.quality.references, count);
            assert!(bvh.levels < 64 && bvh.bytes() <= 32 * count.max(3), "{count} {}", bvh.bytes());
        }
    }

    #[test]
    fn a_box_that_is_cut_off_is_found() {
        let mut boxes = boxes(50_000, |x| x);
        let bvh = build(&boxes);
        boxes[4_321].max.x += 1.0;
        assert!(validate(&bvh, &boxes).is_err());
    }

    #[test]
    fn odd_boxes_stay_and_empty_ones_go() {
        let mut boxes = boxes(40_000, |x| x);
        boxes[3] = Aabb::EMPTY;
        boxes[5] = Aabb { min: Vec3::splat(-f32::MAX), max: Vec3::INFINITY };
        boxes[7] = Aabb { min: Vec3::splat(-3e38), max: Vec3::splat(3e38) };
        match validate(&build(&boxes), &boxes) {
            Err(Violation::Coverage { prim: 3, times: 0 }) => {}
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_tree_does_not_depend_on_threads_and_groups_cost_little() {
        let boxes = boxes(80_000, |x| x);
        let trees = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| build(&boxes))
        });
        assert_eq!((&trees[0].nodes, trees[0].root), (&trees[1].nodes, trees[1].root));
        let config = BuildConfig { measure: true, ..BuildConfig::default() };
        let whole = TopBvh::build("", &boxes, |_| 1.0, &config, &mut Scratch::default()).expect("built");
        let (grouped, whole) = (trees[0].quality, whole.quality);
        assert!(grouped.cost < 1.05 * whole.cost, "{grouped:?} {whole:?}");
        assert_eq!((grouped.nodes, grouped.references), (whole.nodes, whole.references));
    }
}
