//! A frame's tree over clusters: their boxes are refreshed, any builder builds over them, and what is known of each cluster
//! beforehand ([`super::treelet`]) hangs below.
//!
//! The published algorithm stops at leaves of clusters with at most [`PUBLISHED_LEAF`] triangles together
//! ([`Clusters::published_tree`]). For rays this goes further: a wide node's slots are the blocks of clusters, shared among
//! neighbouring clusters by the expected cost as in any other wide tree; blocks and the nodes between those of a large cluster never
//! change, and stand at fixed places of the tree's memory.

use super::Clusters;
use super::treelet::{ENTRIES, First, Lanes};
use crate::build::resolve;
use crate::memory::Pages;
use crate::quality::counts;
use crate::sort::parts;
use crate::wide::{Block8, ChildRef, Clock, LeafSlots, MeshBuild, MeshBvh, MeshView, Node8, plan_over};
use crate::{BinaryTree, BuildConfig, BuildError, Node, Reference, Scratch, build, quality_with};
use rayon::prelude::*;
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::{Kernel, Simd8};

/// Most triangles of a leaf of several clusters, as published.
pub const PUBLISHED_LEAF: u32 = 32;
/// Most clusters of a leaf, whose entries fit into a node together.
const LEAF: u32 = (8 / ENTRIES) as u32;
/// How many blocks ahead the caches are asked for corners.
const AHEAD: usize = 3;
/// Clusters that one thread refreshes at a time.
const CHUNK: usize = 128;

impl Clusters {
    /// Builds a tree of a frame by the builder `name` over clusters. `mesh` has the triangles that the clusters were made of,
    /// and its own positions; one with another number of triangles or too few vertices is built without clusters.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn build(
        &self,
        name: &str,
        mesh: &MeshView<'_>,
        config: &BuildConfig,
        scratch: &mut Scratch,
    ) -> Result<(MeshBvh, MeshBuild), BuildError> {
        let mut bvh = MeshBvh::default();
        let report = self.rebuild(name, mesh, config, scratch, &mut bvh)?;
        Ok((bvh, report))
    }

    /// As [`Clusters::build`], in the memory of another tree, best that of the last frame.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn rebuild(
        &self,
        name: &str,
        mesh: &MeshView<'_>,
        config: &BuildConfig,
        scratch: &mut Scratch,
        bvh: &mut MeshBvh,
    ) -> Result<MeshBuild, BuildError> {
        if !self.fits(mesh) {
            let (other, report) = MeshBvh::build(name, mesh, config, scratch)?;
            *bvh = other;
            return Ok(report);
        }
        let name = resolve(name)?;
        let mut clock = Clock::start();
        bvh.scale_to(mesh);
        clock.lap("bounds");
        let mut boxes = std::mem::take(&mut scratch.boxes);
        let mut references = std::mem::take(&mut scratch.references);
        self.refresh(mesh, config, bvh, (&mut references, &mut boxes));
        clock.lap("clusters");
        let tree = build(name, &mut references, None, &BuildConfig { max_leaf: LEAF, ..*config }, scratch);
        scratch.references = references;
        clock.lap("tree");
        scratch.boxes = boxes;
        let tree = tree?;
        self.put_above(&tree, &scratch.boxes, config, bvh, &mut clock);
        let quality = if config.measure {
            quality_with(&tree, |cluster| self.triangles(cluster).len() as f64)
        } else {
            counts(&tree.nodes)
        };
        Ok(MeshBuild { triangles: mesh.triangles.len(), quality, stages: clock.stages })
    }

    /// The tree that is published: its primitives are clusters, and its leaves have at most [`PUBLISHED_LEAF`] triangles,
    /// or one cluster. Over a mesh that [`Clusters::build`] builds without clusters it has none.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn published_tree(
        &self,
        name: &str,
        mesh: &MeshView<'_>,
        config: &BuildConfig,
        scratch: &mut Scratch,
    ) -> Result<BinaryTree, BuildError> {
        let mut references: Vec<Reference> = (0..if self.fits(mesh) { self.len() as u32 } else { 0 })
            .into_par_iter()
            .map(|cluster| {
                let corners = self.triangles(cluster).iter().flat_map(|&triangle| mesh.corners(triangle));
                Reference::new(&Aabb::from_points(corners), cluster)
            })
            .collect();
        let config = BuildConfig { max_leaf: 1, ..*config };
        let mut tree = build(name, &mut references, None, &config, scratch)?;
        stop_leaves(&mut tree, |cluster| self.triangles(cluster).len() as u32, PUBLISHED_LEAF);
        Ok(tree)
    }

    /// Whether the mesh may be one that the clusters were made of.
    fn fits(&self, mesh: &MeshView<'_>) -> bool {
        mesh.triangles.len() == self.of_triangle.len() && mesh.positions.len() >= self.vertices
    }

    /// Writes all that stands below clusters: blocks, the boxes of entries, nodes; and references to the clusters.
    fn refresh(
        &self,
        mesh: &MeshView<'_>,
        config: &BuildConfig,
        bvh: &mut MeshBvh,
        (references, boxes): (&mut Vec<Reference>, &mut Pages<Aabb>),
    ) {
        let treelets = &self.treelets;
        let nodes = treelets.nodes.len();
        bvh.blocks.set_len(treelets.lanes.len());
        // Fewer than the clusters join these, and a cluster may have a node of its own.
        bvh.nodes.set_len(nodes + 2 * self.len());
        boxes.set_len(treelets.entries.len());
        references.resize(self.len(), Reference::new(&Aabb::EMPTY, 0));
        let starts = treelets.first.iter().step_by(CHUNK).chain(treelets.first.last());
        let starts: Vec<&First> = starts.collect();
        let lengths = |of: fn(&First) -> u32| starts.windows(2).map(move |w| (of(w[1]) - of(w[0])) as usize);
        let jobs = parts(&mut bvh.blocks, lengths(|first| first.block))
            .into_iter()
            .zip(parts(&mut bvh.nodes, lengths(|first| first.node)))
            .zip(parts(boxes, lengths(|first| first.entry)))
            .zip(references.chunks_mut(CHUNK))
            .enumerate();
        let jobs: Vec<Refresh<'_>> = jobs
            .map(|(chunk, (((blocks, nodes), boxes), references))| {
                let first = chunk * CHUNK;
                Refresh { clusters: self, mesh, scale: bvh.scale, first, blocks, nodes, boxes, references }
            })
            .collect();
        jobs.into_par_iter().for_each(|job| config.level.dispatch(job));
    }

    /// Puts the nodes of a tree over clusters behind those below clusters.
    fn put_above(
        &self,
        tree: &BinaryTree,
        boxes: &[Aabb],
        config: &BuildConfig,
        bvh: &mut MeshBvh,
        clock: &mut Clock,
    ) {
        let above = Above { clusters: self, tree, boxes };
        let plan = plan_over(&tree.nodes, &above, config.level);
        clock.lap("collapse");
        let below = self.treelets.nodes.len();
        bvh.nodes.set_len(below + plan.nodes.len());
        let placed = |child: ChildRef| ChildRef::node(child.index() as u32 + below as u32);
        bvh.nodes[below..].par_iter_mut().zip(&plan.nodes).with_min_len(256).for_each(|(node, slots)| {
            *node = Node8::EMPTY;
            let mut before = 0;
            for (slot, &(binary, child)) in slots.iter().enumerate().filter(|(_, s)| s.1 != ChildRef::NONE) {
                let own = &tree.nodes[binary as usize];
                if child.is_leaf() {
                    // Entries of a leaf stand in a row.
                    before = if slot > 0 && slots[slot - 1].0 == binary { before + 1 } else { 0 };
                    let entry = above.entries(own).nth(before).unwrap_or_default();
                    node.set(slot, self.treelets.entries[entry], &boxes[entry]);
                } else {
                    node.set(slot, placed(child), &own.bounds);
                }
            }
        });
        bvh.root = plan.root.map(|root| {
            // A leaf as the root has one entry.
            if root.is_leaf() { self.treelets.entries[0] } else { placed(root) }
        });
        bvh.levels = plan.levels + self.treelets.levels;
        bvh.bounds = tree.bounds();
        clock.lap("emit");
    }
}

/// A binary tree over clusters, whose leaves need as many slots as their clusters have entries.
struct Above<'a> {
    clusters: &'a Clusters,
    tree: &'a BinaryTree,
    boxes: &'a [Aabb],
}

impl Above<'_> {
    /// The entries of a leaf's clusters.
    #[inline(always)]
    fn entries(&self, leaf: &Node) -> impl Iterator<Item = usize> {
        let run = leaf.first as usize..(leaf.first + leaf.count) as usize;
        self.tree.prims[run].iter().flat_map(|&cluster| {
            let first = &self.clusters.treelets.first[cluster as usize..][..2];
            first[0].entry as usize..first[1].entry as usize
        })
    }
}

impl LeafSlots for Above<'_> {
    const SINGLE: bool = false;

    #[inline(always)]
    fn of(&self, leaf: &Node) -> (u8, f32) {
        let mut slots = 0;
        let cost =
            self.entries(leaf).inspect(|_| slots += 1).map(|entry| self.boxes[entry].half_area()).sum();
        (slots, cost)
    }
}

/// Refreshes some clusters.
struct Refresh<'a> {
    clusters: &'a Clusters,
    mesh: &'a MeshView<'a>,
    scale: f32,
    /// Number of the first.
    first: usize,
    blocks: &'a mut [Block8],
    nodes: &'a mut [Node8],
    boxes: &'a mut [Aabb],
    references: &'a mut [Reference],
}

impl Kernel for Refresh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let treelets = &self.clusters.treelets;
        let start = treelets.first[self.first];
        let mut of_block: Vec<Aabb> = Vec::with_capacity(64);
        for (i, reference) in self.references.iter_mut().enumerate() {
            let [own, next] = [treelets.first[self.first + i], treelets.first[self.first + i + 1]];
            of_block.clear();
            for number in own.block..next.block {
                let block = &mut self.blocks[(number - start.block) as usize];
                if let Some(ahead) = treelets.lanes.get(number as usize + AHEAD) {
                    for &vertex in &ahead.vertices[1] {
                        simd.prefetch::<1>(self.mesh.positions.as_ptr().wrapping_add(vertex as usize).cast());
                    }
                }
                of_block.push(fill(simd, &treelets.lanes[number as usize], self.mesh, self.scale, block));
            }
            let first = Below { start, own, blocks: &of_block };
            for number in (own.node..next.node).rev() {
                let at = (number - start.node) as usize;
                let mut node = Node8::EMPTY;
                for (slot, &child) in treelets.nodes[number as usize].iter().enumerate() {
                    if child != ChildRef::NONE {
                        node.set(slot, child, &first.bounds(child, self.nodes));
                    }
                }
                self.nodes[at] = node;
            }
            let mut around = Aabb::EMPTY;
            for number in own.entry..next.entry {
                let bounds = first.bounds(treelets.entries[number as usize], self.nodes);
                self.boxes[(number - start.entry) as usize] = bounds;
                around = around.union(bounds);
            }
            *reference = Reference::new(&around, (self.first + i) as u32);
        }
    }
}

/// What is known so far of a cluster's blocks and nodes.
struct Below<'a> {
    start: First,
    own: First,
    blocks: &'a [Aabb],
}

impl Below<'_> {
    /// The box of a block or a node, whose own boxes are known.
    #[inline(always)]
    fn bounds(&self, child: ChildRef, nodes: &[Node8]) -> Aabb {
        if child.is_leaf() {
            return self.blocks[child.index() - self.own.block as usize];
        }
        let node = &nodes[child.index() - self.start.node as usize];
        (0..8).fold(Aabb::EMPTY, |around, slot| around.union(node.bounds(slot)))
    }
}

/// Fills a block, and gives the box around it.
#[inline(always)]
fn fill<S: Simd8>(simd: S, lanes: &Lanes, mesh: &MeshView<'_>, scale: f32, block: &mut Block8) -> Aabb {
    let scale = simd.splat(scale);
    let mut sides = [[simd.splat(f32::INFINITY); 3], [simd.splat(f32::NEG_INFINITY); 3]];
    for (of_corner, vertices) in block.corners.iter_mut().zip(&lanes.vertices) {
        let corners: [Vec3; 8] = std::array::from_fn(|lane| mesh.positions[vertices[lane] as usize]);
        for axis in 0..3 {
            let along: [f32; 8] = std::array::from_fn(|lane| corners[lane][axis]);
            let scaled = simd.mul(simd.load(&along), scale);
            of_corner[axis] = simd.to_array(scaled);
            sides[0][axis] = simd.min(sides[0][axis], scaled);
            sides[1][axis] = simd.max(sides[1][axis], scaled);
        }
    }
    block.prims = lanes.triangles;
    let [min, max] = sides.map(|side| side.map(|of_axis| simd.to_array(of_axis)));
    let least = |x: [f32; 8]| halves(halves4(x, f32::min), f32::min);
    let most = |x: [f32; 8]| halves(halves4(x, f32::max), f32::max);
    Aabb { min: Vec3::from(min.map(least)), max: Vec3::from(max.map(most)) }
}

#[inline(always)]
fn halves4(x: [f32; 8], of: fn(f32, f32) -> f32) -> [f32; 4] {
    std::array::from_fn(|i| of(x[i], x[i + 4]))
}

#[inline(always)]
fn halves(x: [f32; 4], of: fn(f32, f32) -> f32) -> f32 {
    of(of(x[0], x[2]), of(x[1], x[3]))
}

/// Makes leaves of the highest nodes with at most `most` in total, by the primitives' weights; their descendants go.
pub fn stop_leaves(tree: &mut BinaryTree, weight: impl Fn(u32) -> u32, most: u32) {
    let Some(root) = tree.nodes.first().copied() else { return };
    let total = |node: &Node| {
        let run = &tree.prims[node.first as usize..(node.first + node.count) as usize];
        run.iter().map(|&prim| u64::from(weight(prim))).sum::<u64>()
    };
    let mut nodes = vec![root];
    let mut waiting = vec![0];
    while let Some(at) = waiting.pop() {
        let node = nodes[at];
        // Sums of long runs need not be known.
        if node.is_leaf() || node.count <= most && total(&node) <= u64::from(most) {
            nodes[at].left = 0;
            continue;
        }
        let left = node.left as usize;
        nodes[at].left = nodes.len() as u32;
        waiting.extend([nodes.len() + 1, nodes.len()]);
        nodes.extend_from_slice(&tree.nodes[left..left + 2]);
    }
    tree.nodes = nodes;
}
