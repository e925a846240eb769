//! What is known of a cluster's part of a tree before any frame: its triangles in blocks of eight, and what a wide node above it
//! points to.
//!
//! A cluster is cut in two, again and again, until its parts fit into blocks: across one of the axes, where the surface-area
//! heuristic over blocks is the least. The parts are its entries, a slot of a wide node each. A cluster of more parts than
//! [`ENTRIES`] has one entry, a wide node; where its parts are more than eight, the largest are wide nodes too.

use crate::sort::parts;
use crate::wide::{ChildRef, MeshView};
use rayon::prelude::*;
use vastlight_math::{Aabb, Vec3};

/// Most triangles of a block.
pub(super) const BLOCK: usize = 8;
/// Most children of a node.
const SLOTS: usize = 8;
/// Most entries of a cluster, so that two clusters fit into a node.
pub(super) const ENTRIES: usize = SLOTS / 2;
/// Parts deeper than this are halved without looking, which bounds the depth.
const MAX_DEPTH: usize = 24;

/// What a block is made of. Lanes without triangle hold the first corner of the first triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lanes {
    /// Vertices, by corner, then lane.
    pub(super) vertices: [[u32; BLOCK]; 3],
    /// Triangles, by lane; `u32::MAX` for none.
    pub(super) triangles: [u32; BLOCK],
}

/// The known parts of all clusters, in the order of the clusters.
#[derive(Clone, Debug, Default)]
pub(super) struct Treelets {
    /// By block.
    pub(super) lanes: Vec<Lanes>,
    /// What nodes above clusters point to: blocks, or nodes of these.
    pub(super) entries: Vec<ChildRef>,
    /// Children of nodes, which stand behind their parents.
    pub(super) nodes: Vec<[ChildRef; SLOTS]>,
    /// By cluster: where its blocks, entries and nodes start; and the end of all.
    pub(super) first: Vec<First>,
    /// Nodes on the longest way from an entry to a block.
    pub(super) levels: usize,
}

/// Where what belongs to a cluster starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct First {
    pub(super) block: u32,
    pub(super) entry: u32,
    pub(super) node: u32,
}

impl Treelets {
    /// Orders the triangles of each cluster by blocks.
    pub(super) fn new(mesh: &MeshView<'_>, clusters: &mut [Vec<u32>]) -> Self {
        let cut: Vec<Treelet> =
            clusters.par_iter_mut().map(|triangles| Treelet::new(mesh, triangles)).collect();
        let mut all = Self { first: vec![First::default()], ..Self::default() };
        for (treelet, triangles) in cut.iter().zip(clusters) {
            let First { block, node, .. } = all.first[all.first.len() - 1];
            let moved = |child: ChildRef| moved(child, node, block);
            all.entries.extend(treelet.entries.iter().map(|&child| moved(child)));
            all.nodes.extend(treelet.nodes.iter().map(|node| node.map(moved)));
            let runs = parts(triangles, treelet.blocks.iter().copied());
            all.lanes.extend(runs.into_iter().map(|run| Lanes::new(mesh, run)));
            all.levels = all.levels.max(treelet.levels);
            all.first.push(First {
                block: all.lanes.len() as u32,
                entry: all.entries.len() as u32,
                node: all.nodes.len() as u32,
            });
        }
        all
    }

    /// Their memory.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.lanes.as_slice())
            + size_of_val(self.entries.as_slice())
            + size_of_val(self.nodes.as_slice())
            + size_of_val(self.first.as_slice())
    }
}

/// A child with its number counted from elsewhere.
fn moved(child: ChildRef, nodes: u32, blocks: u32) -> ChildRef {
    let index = child.index() as u32;
    match child {
        ChildRef::NONE => child,
        _ if child.is_leaf() => ChildRef::leaf(index + blocks),
        _ => ChildRef::node(index + nodes),
    }
}

impl Lanes {
    fn new(mesh: &MeshView<'_>, run: &[u32]) -> Self {
        let mut lanes = Self { vertices: [[0; BLOCK]; 3], triangles: [u32::MAX; BLOCK] };
        let filler = run.first().map_or(0, |&first| mesh.triangles[first as usize][0]);
        lanes.vertices = [[filler; BLOCK]; 3];
        for (lane, &triangle) in run.iter().take(BLOCK).enumerate() {
            lanes.triangles[lane] = triangle;
            for (of_corner, vertex) in lanes.vertices.iter_mut().zip(mesh.triangles[triangle as usize]) {
                of_corner[lane] = vertex;
            }
        }
        lanes
    }
}

/// The known part of one cluster; numbers count from its own.
struct Treelet {
    /// Triangles of each block.
    blocks: Vec<usize>,
    entries: Vec<ChildRef>,
    nodes: Vec<[ChildRef; SLOTS]>,
    levels: usize,
}

impl Treelet {
    fn new(mesh: &MeshView<'_>, triangles: &mut [u32]) -> Self {
        let mut items: Vec<Item> = triangles.iter().map(|&triangle| Item::new(mesh, triangle)).collect();
        let root = Part::new(&mut items, 0);
        triangles.iter_mut().zip(&items).for_each(|(slot, item)| *slot = item.triangle);
        let mut treelet = Self { blocks: Vec::new(), entries: Vec::new(), nodes: Vec::new(), levels: 0 };
        let entries = if root.blocks > ENTRIES { vec![&root] } else { root.largest() };
        treelet.entries = entries.into_iter().map(|part| treelet.child(part, 1)).collect();
        treelet
    }

    /// A block, or a node on the level `level`.
    fn child(&mut self, part: &Part, level: usize) -> ChildRef {
        if part.halves.is_none() {
            self.blocks.push(part.triangles);
            return ChildRef::leaf(self.blocks.len() as u32 - 1);
        }
        self.levels = self.levels.max(level);
        let number = self.nodes.len();
        self.nodes.push([ChildRef::NONE; SLOTS]);
        for (slot, part) in part.largest().into_iter().enumerate() {
            self.nodes[number][slot] = self.child(part, level + 1);
        }
        ChildRef::node(number as u32)
    }
}

/// A triangle that is to be put into a block.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    center: Vec3,
    triangle: u32,
}

impl Item {
    fn new(mesh: &MeshView<'_>, triangle: u32) -> Self {
        let bounds = Aabb::from_points(mesh.corners(triangle));
        Self { bounds, center: bounds.center(), triangle }
    }
}

/// A part of a cluster: a block, or two parts, of which the left one comes first.
struct Part {
    triangles: usize,
    blocks: usize,
    halves: Option<Box<[Part; 2]>>,
}

impl Part {
    fn new(items: &mut [Item], depth: usize) -> Self {
        if items.len() <= BLOCK {
            return Self { triangles: items.len(), blocks: 1, halves: None };
        }
        let middle = if depth < MAX_DEPTH { best_cut(items) } else { items.len() / 2 };
        let (left, right) = items.split_at_mut(middle);
        let halves = [Self::new(left, depth + 1), Self::new(right, depth + 1)];
        let blocks = halves[0].blocks + halves[1].blocks;
        Self { triangles: items.len(), blocks, halves: Some(Box::new(halves)) }
    }

    /// Up to eight parts of it, in order, that are as small as can be.
    fn largest(&self) -> Vec<&Self> {
        let mut found = vec![self];
        while found.len() < SLOTS {
            let parted = |part: &&Self| if part.halves.is_some() { part.blocks } else { 0 };
            let most = found.iter().map(parted).max().unwrap_or(0);
            let place = found.iter().position(|part| most > 0 && parted(part) == most);
            let Some((place, halves)) = place.and_then(|at| Some((at, found[at].halves.as_ref()?))) else {
                break;
            };
            found.splice(place..=place, halves.iter());
        }
        found
    }
}

/// Orders items along the axis on which cutting them in two costs the least, and gives where. The cost of a part is its
/// area times the blocks that it needs.
fn best_cut(items: &mut [Item]) -> usize {
    let mut best = (f32::INFINITY, usize::MAX, 0, items.len() / 2);
    for axis in 0..3 {
        sort_along(items, axis);
        let mut right = vec![0.0; items.len()];
        let mut around = Aabb::EMPTY;
        for (item, area) in items.iter().zip(&mut right).rev() {
            around = around.union(item.bounds);
            *area = around.half_area();
        }
        around = Aabb::EMPTY;
        for cut in 1..items.len() {
            around = around.union(items[cut - 1].bounds);
            let blocks = |triangles: usize| triangles.div_ceil(BLOCK) as f32;
            let cost = around.half_area() * blocks(cut) + right[cut] * blocks(items.len() - cut);
            let uneven = cut.abs_diff(items.len() - cut);
            if (cost, uneven) < (best.0, best.1) {
                best = (cost, uneven, axis, cut);
            }
        }
    }
    sort_along(items, best.2);
    best.3
}

fn sort_along(items: &mut [Item], axis: usize) {
    items.sort_unstable_by(|a, b| {
        a.center[axis].total_cmp(&b.center[axis]).then_with(|| a.triangle.cmp(&b.triangle))
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(count: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let positions = (0..count + 2).map(|i| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0)).collect();
        (positions, (0..count).map(|i| [i, i + 1, i + 2]).collect())
    }

    #[test]
    fn every_triangle_is_in_one_lane_and_every_block_below_one_entry() {
        for count in [1, 2, 8, 9, 16, 17, 63, 64, 65, 200, 3000] {
            let (positions, triangles) = strip(count);
            let mesh = MeshView { positions: &positions, triangles: &triangles };
            let mut clusters = vec![(0..count).rev().collect(), (0..count.min(5)).collect()];
            let treelets = Treelets::new(&mesh, &mut clusters);
            let end = treelets.first[1];
            let mut lanes: Vec<u32> =
                treelets.lanes[..end.block as usize].iter().flat_map(|lanes| lanes.triangles).collect();
            lanes.retain(|&triangle| triangle != u32::MAX);
            assert_eq!(lanes, clusters[0], "in the order of the blocks");
            lanes.sort_unstable();
            assert!(lanes.into_iter().eq(0..count));

            let mut waiting = treelets.entries[..end.entry as usize].to_vec();
            assert!((1..=ENTRIES).contains(&waiting.len()));
            let mut blocks = Vec::new();
            while let Some(child) = waiting.pop() {
                if child.is_leaf() {
                    blocks.push(child.index() as u32);
                } else {
                    let below = treelets.nodes[child.index()].iter().filter(|&&c| c != ChildRef::NONE);
                    assert!(below.clone().all(|c| c.is_leaf() || c.index() > child.index()));
                    waiting.extend(below);
                }
            }
            blocks.sort_unstable();
            assert!(blocks.into_iter().eq(0..end.block));
            assert_eq!(treelets.entries[end.entry as usize..], [ChildRef::leaf(end.block)]);
            assert_eq!(treelets.levels == 0, end.block as usize <= ENTRIES);
            assert!(end.block as usize <= (count as usize).div_ceil(4), "{count}: {end:?}");
        }
    }

    #[test]
    fn a_strip_is_cut_across() {
        let (positions, triangles) = strip(32);
        let mesh = MeshView { positions: &positions, triangles: &triangles };
        let mut clusters = vec![(0..32).collect()];
        let treelets = Treelets::new(&mesh, &mut clusters);
        for lanes in treelets.lanes {
            let (least, most) = (lanes.triangles.iter().min(), lanes.triangles.iter().max());
            assert!(most.zip(least).is_some_and(|(most, least)| most - least < 9), "{lanes:?}");
        }
    }
}
