//! Blocks of triangles as leaves of a tree that changes: filled from new positions, split where they burst, joined where
//! small ones meet.

use super::arena::Arena;
use super::tree::{DynamicTree, NONE};
use crate::build::build_some;
use crate::memory::Pages;
use crate::wide::{Block8, MeshView};
use crate::{BinaryTree, BuildConfig, Reference};
use bytemuck::Pod;
use rayon::prelude::*;
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::{Kernel, Level, Simd8};

/// Blocks that one thread fills at a time.
const BLOCKS: usize = 256;
/// How many blocks ahead the caches are asked for corners.
const AHEAD: usize = 2;
/// How many blocks ahead they are asked for triangles.
const TRIANGLES_AHEAD: usize = 6;

/// The box around a block's triangles, and the sum of the half areas of their boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LeafBox {
    pub(super) bounds: Aabb,
    pub(super) parts: f32,
}

impl LeafBox {
    /// How much larger the box is than those of the triangles; 1 where that cannot be told.
    pub(super) fn spread(&self) -> f32 {
        let spread = self.bounds.half_area() / self.parts;
        if spread.is_finite() { spread } else { 1.0 }
    }

    /// Of the triangles in a block.
    pub(super) fn of(block: &Block8) -> Self {
        let boxes = block.boxes();
        let bounds = boxes.iter().fold(Aabb::EMPTY, |around, (_, b)| around.union(*b));
        Self { bounds, parts: boxes.iter().map(|(_, b)| b.half_area()).sum() }
    }
}

/// The vertices of a block's triangles; lanes without triangle repeat those of the first.
pub(super) type Corners = [[u32; 3]; 8];

/// A triangle's number, its vertices, and where they are.
pub(super) type Triangle = (u32, [u32; 3], [Vec3; 3]);

/// What is known of blocks besides what rays need.
#[derive(Clone, Debug)]
pub(super) struct Leaves {
    pub(super) boxes: Vec<LeafBox>,
    corners: Vec<Corners>,
    arena: Arena,
    config: BuildConfig,
}

impl Leaves {
    /// Blocks of the runs of `tree` below `leaves`, not filled yet.
    pub(super) fn new(
        tree: &BinaryTree,
        leaves: &[u32],
        mesh: &MeshView<'_>,
        config: &BuildConfig,
    ) -> (Self, Pages<Block8>) {
        let mut blocks: Pages<Block8> = Pages::zeroed(leaves.len());
        let fill = |(block, &leaf): (&mut Block8, &u32)| {
            let node = &tree.nodes[leaf as usize];
            let run = node.first as usize..(node.first + node.count.min(8)) as usize;
            block.clear_prims();
            block.prims.iter_mut().zip(&tree.prims[run]).for_each(|(lane, &prim)| *lane = prim);
            corners_of(block, mesh)
        };
        let corners = blocks.par_iter_mut().zip(leaves).map(fill).collect();
        let none = LeafBox { bounds: Aabb::EMPTY, parts: 0.0 };
        let boxes = vec![none; leaves.len()];
        (Self { boxes, corners, arena: Arena::full(leaves.len()), config: *config }, blocks)
    }

    /// Fills all blocks from the positions times `scale`.
    pub(super) fn refill(&mut self, blocks: &mut [Block8], positions: &[Vec3], scale: f32, level: Level) {
        let parts = blocks.par_chunks_mut(BLOCKS).zip(self.boxes.par_chunks_mut(BLOCKS));
        parts.zip(self.corners.par_chunks(BLOCKS)).for_each(|((blocks, boxes), corners)| {
            level.dispatch(Refill { blocks, boxes, corners, positions, scale });
        });
    }

    /// How a leaf whose triangles flew apart is best parted; none if it is best left as it is.
    fn parting(&self, block: usize, blocks: &[Block8]) -> Option<BinaryTree> {
        Some(self.grouped(&[block], blocks)).filter(|tree| tree.nodes.len() > 1)
    }

    /// Parts the leaves among `listed` that are best parted. Gives the list without leaves, but with the nodes above their
    /// parts, children before parents as before.
    pub(super) fn part_all(
        &mut self,
        tree: &mut DynamicTree,
        blocks: &mut Pages<Block8>,
        listed: &[u32],
    ) -> Vec<u32> {
        let part = |&node: &u32| tree.is_leaf(node).then(|| self.parting(tree.block(node), blocks));
        let parts: Vec<_> = listed.par_iter().with_min_len(64).map(part).collect();
        let mut inner = Vec::with_capacity(listed.len());
        for (&node, parts) in listed.iter().zip(parts) {
            match parts {
                None => inner.push(node),
                Some(None) => self.save(tree, node),
                Some(Some(parts)) => inner.extend(self.part(tree, blocks, node, &parts)),
            }
        }
        inner
    }

    /// Makes a leaf that is parted as `parts` says the root of leaves; gives its inner nodes, the root last.
    fn part(
        &mut self,
        tree: &mut DynamicTree,
        blocks: &mut Pages<Block8>,
        leaf: u32,
        parts: &BinaryTree,
    ) -> Vec<u32> {
        let triangles = self.triangles(&blocks[tree.block(leaf)], tree.block(leaf));
        self.release(blocks, tree.block(leaf));
        self.plant(tree, blocks, leaf, parts, &triangles)
    }

    /// The best tree over the triangles of some blocks, which are numbered in this order.
    pub(super) fn grouped(&self, own: &[usize], blocks: &[Block8]) -> BinaryTree {
        let boxes = own.iter().flat_map(|&block| blocks[block].boxes());
        let mut references: Vec<Reference> =
            boxes.zip(0..).map(|((_, b), i)| Reference::new(&b, i)).collect();
        build_some(&mut references, &self.config)
    }

    /// Frees leaves with their blocks; gives their triangles.
    pub(super) fn take_apart(
        &mut self,
        tree: &mut DynamicTree,
        blocks: &mut [Block8],
        leaves: &[u32],
    ) -> Vec<Triangle> {
        let mut triangles = Vec::new();
        for &leaf in leaves {
            let block = tree.block(leaf);
            triangles.extend(self.triangles(&blocks[block], block));
            self.release(blocks, block);
            tree.free(leaf);
        }
        triangles
    }

    fn triangles(&self, block: &Block8, number: usize) -> Vec<Triangle> {
        let of_lane = |lane: usize| (block.prims[lane], self.corners[number][lane], block.triangle(lane));
        block.used().map(of_lane).collect()
    }

    fn release(&mut self, blocks: &mut [Block8], block: usize) {
        blocks[block] = Block8::EMPTY;
        self.arena.release(block);
    }

    /// Makes a node that has nothing below it the root of `shape`, whose leaves become blocks of `triangles`; gives its inner
    /// nodes, children before parents.
    pub(super) fn plant(
        &mut self,
        tree: &mut DynamicTree,
        blocks: &mut Pages<Block8>,
        root: u32,
        shape: &BinaryTree,
        triangles: &[Triangle],
    ) -> Vec<u32> {
        let mut own = vec![root; shape.nodes.len()];
        for slot in own.iter_mut().skip(1) {
            *slot = tree.take(root);
        }
        let mut near = 0;
        for (node, &own) in shape.nodes.iter().zip(&own).filter(|(node, _)| node.is_leaf()) {
            let block = self.take(blocks, near);
            let run = node.first as usize..(node.first + node.count) as usize;
            self.set(blocks, block, shape.prims[run].iter().map(|&i| triangles[i as usize]));
            self.name(tree, blocks, own, block);
            near = block;
        }
        if shape.nodes.len() == 1 {
            tree.release_wide(root);
            tree.touched.push(root);
        }
        let mut inner = Vec::new();
        for (place, node) in shape.nodes.iter().enumerate().rev().filter(|(_, node)| !node.is_leaf()) {
            let left = node.left as usize;
            tree.set_children(own[place], [own[left], own[left + 1]]);
            inner.push(own[place]);
        }
        inner
    }

    /// Whether a build would make two leaves one: where they fit into a block that is hardly larger than they.
    pub(super) fn may_merge(&self, tree: &DynamicTree, a: u32, b: u32) -> bool {
        let few = tree.link(a).count + tree.link(b).count <= self.config.max_leaf;
        few && tree.is_leaf(a) && tree.is_leaf(b) && {
            let [first, second] = [a, b].map(|leaf| tree.bounds(leaf));
            let whole = first.union(second).half_area();
            whole * (1.0 - self.config.traversal_cost) <= first.half_area() + second.half_area()
        }
    }

    /// Moves the triangles of leaf `from` to leaf `to`, whose count and box grow; `from` and its block are freed.
    pub(super) fn merge(&mut self, tree: &mut DynamicTree, blocks: &mut [Block8], to: u32, from: u32) {
        let (target, source) = (tree.block(to), tree.block(from));
        let moved = (blocks[source], self.corners[source]);
        let first = blocks[target].used().count();
        for (lane, other) in (first..8).zip(moved.0.used()) {
            blocks[target].set(lane, moved.0.prims[other], moved.0.triangle(other));
            self.corners[target][lane] = moved.1[other];
        }
        self.release(blocks, source);
        tree.free(from);
        self.name(tree, blocks, to, target);
    }

    /// Makes a node with two leaves the leaf of one block.
    pub(super) fn merge_children(&mut self, tree: &mut DynamicTree, blocks: &mut [Block8], node: u32) {
        let [a, b] = tree.link(node).children;
        self.merge(tree, blocks, a, b);
        let block = tree.block(a);
        tree.free(a);
        tree.release_wide(node);
        self.name(tree, blocks, node, block);
        tree.touched.push(node);
    }

    /// Blocks stand in the order `old`, which leaves free ones out.
    pub(super) fn reorder(&mut self, blocks: &mut Pages<Block8>, old: &[usize]) {
        let mut new = Pages::zeroed(old.len());
        new.par_iter_mut().zip(old).for_each(|(new, &old)| *new = blocks[old]);
        *blocks = new;
        self.corners = old.par_iter().map(|&block| self.corners[block]).collect();
        self.boxes = old.iter().map(|&block| self.boxes[block]).collect();
        self.arena = Arena::full(old.len());
    }

    /// Free blocks, as a share of all.
    pub(super) fn looseness(&self) -> f64 {
        self.arena.looseness()
    }

    /// Blocks in use.
    pub(super) fn used(&self) -> usize {
        self.arena.len() - self.arena.free()
    }

    /// Memory besides the blocks.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.boxes.as_slice()) + size_of_val(self.corners.as_slice())
    }

    /// How leaves are built.
    pub(super) fn config(&self) -> &BuildConfig {
        &self.config
    }

    /// Makes a node the leaf of a block.
    fn name(&mut self, tree: &mut DynamicTree, blocks: &[Block8], leaf: u32, block: usize) {
        self.boxes[block] = LeafBox::of(&blocks[block]);
        tree.set_bounds(leaf, &self.boxes[block].bounds);
        let link = tree.link_mut(leaf);
        link.children = [NONE, block as u32];
        link.count = blocks[block].used().count() as u32;
        link.saved = self.boxes[block].spread();
    }

    /// Notes how large leaves are that are as they should be.
    pub(super) fn save(&self, tree: &mut DynamicTree, leaf: u32) {
        tree.link_mut(leaf).saved = self.boxes[tree.block(leaf)].spread();
    }

    /// Fills a block.
    fn set(&mut self, blocks: &mut [Block8], block: usize, triangles: impl Iterator<Item = Triangle>) {
        blocks[block] = Block8::EMPTY;
        for (lane, (prim, corners, places)) in triangles.enumerate() {
            blocks[block].set(lane, prim, places);
            // Lanes without triangle repeat the first.
            let lanes = if lane == 0 { 0..8 } else { lane..lane + 1 };
            self.corners[block][lanes].fill(corners);
        }
    }

    /// A free block near another.
    fn take(&mut self, blocks: &mut Pages<Block8>, near: usize) -> usize {
        if self.arena.free() == 0 {
            let len = self.arena.len() + self.arena.len() / 16 + 16;
            self.arena.grow(len);
            lengthen(blocks, len, Block8::EMPTY);
            self.corners.resize(len, [[0; 3]; 8]);
            self.boxes.resize(len, LeafBox { bounds: Aabb::EMPTY, parts: 0.0 });
        }
        self.arena.take(near).unwrap_or(near)
    }
}

/// Makes an array longer.
pub(super) fn lengthen<T: Pod>(pages: &mut Pages<T>, len: usize, new: T) {
    let mut longer = Pages::zeroed(len);
    longer[..pages.len()].copy_from_slice(pages);
    longer[pages.len()..].fill(new);
    *pages = longer;
}

fn corners_of(block: &Block8, mesh: &MeshView<'_>) -> Corners {
    let first = mesh.triangles[block.prims[0] as usize];
    block.prims.map(|prim| if prim == Block8::NO_PRIM { first } else { mesh.triangles[prim as usize] })
}

/// Fills some blocks and finds their boxes.
struct Refill<'a> {
    blocks: &'a mut [Block8],
    boxes: &'a mut [LeafBox],
    corners: &'a [Corners],
    positions: &'a [Vec3],
    scale: f32,
}

impl Kernel for Refill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let Self { blocks, boxes, corners, positions, scale } = self;
        for (i, (block, own)) in blocks.iter_mut().zip(boxes).enumerate() {
            if let Some(next) = corners.get(i + AHEAD) {
                for corner in next.as_flattened() {
                    simd.prefetch::<1>(positions.as_ptr().wrapping_add(*corner as usize).cast());
                }
            }
            if block.prims[0] == Block8::NO_PRIM {
                continue;
            }
            fill(block, &corners[i], positions, scale);
            *own = around(simd, block);
        }
    }
}

/// The box of a block whose unused lanes repeat a triangle, which become zero.
#[inline(always)]
fn around<S: Simd8>(simd: S, block: &mut Block8) -> LeafBox {
    let mut used = 8;
    while used > 1 && block.prims[used - 1] == Block8::NO_PRIM {
        used -= 1;
    }
    let mut bounds = Aabb::EMPTY;
    let mut sides = [simd.splat(0.0); 3];
    for (axis, side) in sides.iter_mut().enumerate() {
        let [a, b, c] = [0, 1, 2].map(|corner| block.corners[corner][axis]);
        let (a, b, c) = (simd.load(&a), simd.load(&b), simd.load(&c));
        let (lower, upper) = (simd.min(simd.min(a, b), c), simd.max(simd.max(a, b), c));
        *side = simd.sub(upper, lower);
        let half = simd.to_array(simd.min(lower, simd.swap_halves(lower)));
        bounds.min[axis] = half[0].min(half[1]).min(half[2].min(half[3]));
        let half = simd.to_array(simd.max(upper, simd.swap_halves(upper)));
        bounds.max[axis] = half[0].max(half[1]).max(half[2].max(half[3]));
    }
    let [x, y, z] = sides;
    let areas = simd.to_array(simd.add(simd.mul(x, y), simd.add(simd.mul(y, z), simd.mul(z, x))));
    let mut parts = 0.0;
    for area in &areas[..used] {
        parts += area;
    }
    for lane in used..8 {
        for of_axis in block.corners.as_flattened_mut() {
            of_axis[lane] = 0.0;
        }
    }
    LeafBox { bounds, parts }
}

/// Writes the corners of all lanes.
#[inline(always)]
fn fill(block: &mut Block8, corners: &Corners, positions: &[Vec3], scale: f32) {
    for (lane, triangle) in corners.iter().enumerate() {
        for (of_corner, &vertex) in block.corners.iter_mut().zip(triangle) {
            let p = positions[vertex as usize];
            of_corner[0][lane] = p.x * scale;
            of_corner[1][lane] = p.y * scale;
            of_corner[2][lane] = p.z * scale;
        }
    }
}

/// Fills blocks with the triangles that they name; `boxes` becomes their boxes.
pub(super) fn fill_named(
    blocks: &mut [Block8],
    boxes: &mut [Aabb],
    mesh: &MeshView<'_>,
    scale: f32,
    level: Level,
) {
    blocks.par_chunks_mut(BLOCKS).zip(boxes.par_chunks_mut(BLOCKS)).for_each(|(blocks, boxes)| {
        level.dispatch(FillNamed { blocks, boxes, mesh, scale });
    });
}

struct FillNamed<'a> {
    blocks: &'a mut [Block8],
    boxes: &'a mut [Aabb],
    mesh: &'a MeshView<'a>,
    scale: f32,
}

impl Kernel for FillNamed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let Self { blocks, boxes, mesh: MeshView { positions, triangles }, scale } = self;
        for i in 0..blocks.len() {
            if let Some(later) = blocks.get(i + TRIANGLES_AHEAD) {
                for prim in later.prims {
                    simd.prefetch::<1>(triangles.as_ptr().wrapping_add(prim as usize).cast());
                }
            }
            if let Some(next) = blocks.get(i + AHEAD) {
                for corners in next.prims.map(|prim| triangles.get(prim as usize)).into_iter().flatten() {
                    for &corner in corners {
                        simd.prefetch::<1>(positions.as_ptr().wrapping_add(corner as usize).cast());
                    }
                }
            }
            let block = &mut blocks[i];
            let Some(&first) = triangles.get(block.prims[0] as usize) else { continue };
            let mut corners = [first; 8];
            for (corners, prim) in corners.iter_mut().zip(block.prims) {
                if let Some(&own) = triangles.get(prim as usize) {
                    *corners = own;
                }
            }
            fill(block, &corners, positions, scale);
            boxes[i] = around(simd, block).bounds;
        }
    }
}
