//! The tree of one mesh: wide nodes over blocks of triangles.

use super::collapse::{emit, plan};
use super::direct::{self, Direct};
use super::{Block8, ChildRef, Node8};
use crate::build::{CLUSTERED, MortonTree, NAMES, build_clustered, clip_triangle, resolve, triangle_slabs};
use crate::memory::Pages;
use crate::quality::counts;
use crate::{BinaryTree, BuildConfig, BuildError, Clip, Quality, Reference, Scratch, build, quality};
use rayon::prelude::*;
use std::time::{Duration, Instant};
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::{Kernel, Simd8};

/// The triangles of a mesh, borrowed. Indices are in range and positions finite.
#[derive(Clone, Copy, Debug)]
pub struct MeshView<'a> {
    /// Vertex positions.
    pub positions: &'a [Vec3],
    /// Three vertex indices a triangle.
    pub triangles: &'a [[u32; 3]],
}

/// Geometry with coordinates in this range is traced as it is.
const COMFORTABLE: std::ops::RangeInclusive<f32> = 1.0 / 1_048_576.0..=1_048_576.0;

impl MeshView<'_> {
    /// The corners of a triangle.
    #[inline]
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// The box around all vertices, used or not, with all threads of the current pool.
    pub(crate) fn bounds(&self) -> Aabb {
        let fold = self.positions.par_iter().with_min_len(1 << 14).fold(|| Aabb::EMPTY, |b, &p| b.grow(p));
        fold.reduce(|| Aabb::EMPTY, Aabb::union)
    }

    /// The power of two by which the mesh is scaled so that products of its coordinates neither under- nor overflow; 1
    /// for nearly all meshes.
    #[must_use]
    pub fn scale(&self, bounds: &Aabb) -> f32 {
        let extent = extent(bounds);
        if COMFORTABLE.contains(&extent) || extent == 0.0 {
            return 1.0;
        }
        let exponent = (extent.to_bits() >> 23) as i32 - 127;
        f32::from_bits(((127 - exponent).clamp(1, 254) as u32) << 23)
    }
}

/// A mesh with its positions scaled, as builders may cut it.
pub(super) struct Scaled<'a> {
    pub(super) mesh: &'a MeshView<'a>,
    pub(super) scale: f32,
}

impl Scaled<'_> {
    #[inline(always)]
    pub(super) fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.corners(triangle).map(|p| p * self.scale)
    }
}

impl Scaled<'_> {
    /// The tree over references to all triangles, or to parts of them.
    fn tree_over_references(
        &self,
        name: &str,
        config: &BuildConfig,
        scratch: &mut Scratch,
        clock: &mut Clock,
    ) -> Result<BinaryTree, BuildError> {
        let mut references = std::mem::take(&mut scratch.references);
        (0..self.mesh.triangles.len() as u32)
            .into_par_iter()
            .with_min_len(1 << 12)
            .map(|i| Reference::new(&Aabb::from_points(self.corners(i)), i))
            .collect_into_vec(&mut references);
        clock.lap("references");
        let tree = build(name, &mut references, Some(self), config, scratch)?;
        scratch.references = references;
        Ok(tree)
    }
}

impl Clip for Scaled<'_> {
    fn clip(&self, prim: u32, bounds: &Aabb) -> Aabb {
        clip_triangle(self.corners(prim), bounds)
    }

    fn slabs(&self, prim: u32, bounds: &Aabb, axis: usize, planes: &[f32], parts: &mut [Aabb]) {
        triangle_slabs(self.corners(prim), bounds, axis, planes, parts);
    }
}

/// The largest absolute coordinate of a box; zero for an empty one.
pub(crate) fn extent(bounds: &Aabb) -> f32 {
    if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() }
}

/// A mesh made traceable, in its own space times [`MeshBvh::scale`].
#[derive(Clone, Debug)]
pub struct MeshBvh {
    /// Wide nodes; leaves are indices of blocks.
    pub nodes: Pages<Node8>,
    /// Triangles.
    pub blocks: Pages<Block8>,
    /// Where rays start; none for a mesh without triangles.
    pub root: Option<ChildRef>,
    /// Nodes on the longest way from the root to a block.
    pub levels: usize,
    /// Around all triangles, scaled.
    pub bounds: Aabb,
    /// Largest absolute coordinate of the mesh's vertices, used or not, scaled.
    pub extent: f32,
    /// Positions here are the mesh's times this power of two.
    pub scale: f32,
}

/// A mesh without triangles.
impl Default for MeshBvh {
    fn default() -> Self {
        Self {
            nodes: Pages::default(),
            blocks: Pages::default(),
            root: None,
            levels: 0,
            bounds: Aabb::EMPTY,
            extent: 0.0,
            scale: 1.0,
        }
    }
}

/// What a build took and gave.
#[derive(Clone, Debug, Default)]
pub struct MeshBuild {
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Of the binary tree: counts of nodes and references; the rest only with [`BuildConfig::measure`].
    pub quality: Quality,
    /// Time by stage.
    pub stages: Vec<(&'static str, Duration)>,
}

impl MeshBvh {
    /// Takes scale and extent from the positions of `mesh`.
    pub(crate) fn scale_to(&mut self, mesh: &MeshView<'_>) {
        let bounds = mesh.bounds();
        self.scale = mesh.scale(&bounds);
        self.extent = extent(&bounds) * self.scale;
    }

    /// Builds with the builder `name`.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn build(
        name: &str,
        mesh: &MeshView<'_>,
        config: &BuildConfig,
        scratch: &mut Scratch,
    ) -> Result<(Self, MeshBuild), BuildError> {
        let config = BuildConfig { max_leaf: config.max_leaf.min(8), ..*config };
        let mut clock = Clock::start();
        let bounds = mesh.bounds();
        let scale = mesh.scale(&bounds);
        let scaled = Scaled { mesh, scale };
        let extent = extent(&bounds) * scale;
        let around = Aabb { min: bounds.min * scale, max: bounds.max * scale };
        let name = resolve(name)?;
        let kind = MortonTree::of_builder(name);
        let clustered = name == NAMES[0] && mesh.triangles.len() >= CLUSTERED;
        let sorted = if clustered || kind.is_some() && config.optimize == 0 {
            direct::sorted_codes(&scaled, &around, &config, scratch)
        } else {
            None
        };
        clock.lap("codes");
        let built = |built: Direct, stages| {
            let Direct { nodes, blocks, root, levels, bounds, quality } = built;
            let bvh = Self { nodes, blocks, root, levels, bounds, extent, scale };
            (bvh, MeshBuild { triangles: mesh.triangles.len(), quality, stages })
        };
        if let (Some(sorted), Some(kind)) = (sorted, kind)
            && let Some(direct) = direct::build(&scaled, sorted, kind, &config, &mut clock)
        {
            return Ok(built(direct, clock.stages));
        }
        let tree = match sorted {
            Some(sorted) if clustered => build_clustered(&scaled, sorted, &config),
            _ => scaled.tree_over_references(name, &config, scratch, &mut clock)?,
        };
        clock.lap("tree");
        let direct = over_tree(&scaled, &tree, &config, &mut clock);
        Ok(built(direct, clock.stages))
    }

    /// The mesh over wide nodes in its own space that were built elsewhere, of which the first is the root and children stand behind
    /// their parents. Leaves are runs of `order`, first and length, of at most eight triangles.
    #[must_use]
    pub fn over_nodes(mesh: &MeshView<'_>, nodes: &[Node8], runs: &[[u32; 2]], order: &[u32]) -> Self {
        let bounds = mesh.bounds();
        let scale = mesh.scale(&bounds);
        let block = |&[first, count]: &[u32; 2]| {
            let mut prims: Vec<u32> =
                order.iter().skip(first as usize).take(count as usize).copied().collect();
            // Parts of one triangle need but one lane.
            prims.sort_unstable();
            prims.dedup();
            Block8::new(prims.into_iter().map(|prim| (prim, mesh.corners(prim).map(|p| p * scale))))
        };
        let mut levels = vec![1_usize; nodes.len()];
        for (node, children) in nodes.iter().map(|node| node.children).enumerate() {
            for below in children.into_iter().filter(|child| !child.is_leaf()).map(ChildRef::index) {
                levels[below] = levels[node] + 1;
            }
        }
        let root = if nodes.is_empty() { ChildRef::leaf(0) } else { ChildRef::node(0) };
        let mut scaled = Pages::zeroed(nodes.len());
        scaled.copy_from_slice(nodes);
        scaled
            .iter_mut()
            .flat_map(|node| node.planes.as_flattened_mut().as_flattened_mut())
            .for_each(|x| *x *= scale);
        let mut blocks = Pages::zeroed(runs.len());
        blocks.iter_mut().zip(runs).for_each(|(slot, run)| *slot = block(run));
        Self {
            nodes: scaled,
            blocks,
            root: (!runs.is_empty()).then_some(root),
            levels: levels.into_iter().max().unwrap_or(0),
            bounds: Aabb { min: bounds.min * scale, max: bounds.max * scale },
            extent: extent(&bounds) * scale,
            scale,
        }
    }

    /// Gives triangles the numbers that they have in a larger mesh: triangle `i` becomes `numbers[i]`.
    pub fn renumber(&mut self, numbers: &[u32]) {
        for number in self.blocks.iter_mut().flat_map(|block| &mut block.prims) {
            *number = numbers.get(*number as usize).copied().unwrap_or(*number);
        }
    }

    /// Memory of nodes and blocks.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..])
    }
}

/// The wide tree over a binary one.
fn over_tree(mesh: &Scaled<'_>, tree: &BinaryTree, config: &BuildConfig, clock: &mut Clock) -> Direct {
    let plan = plan(&tree.nodes, config.max_leaf, config.level);
    clock.lap("collapse");
    let mut nodes = Pages::zeroed(plan.nodes.len());
    let mut blocks = Pages::zeroed(plan.leaves.len());
    emit(&plan, &mut nodes, |binary| tree.nodes[binary as usize].bounds, |leaf| leaf);
    blocks.par_chunks_mut(BLOCKS).zip(plan.leaves.par_chunks(BLOCKS)).for_each(|(blocks, leaves)| {
        config.level.dispatch(Fill { mesh: mesh.mesh, scale: mesh.scale, tree, leaves, blocks });
    });
    clock.lap("emit");
    let quality = if config.measure { quality(tree) } else { counts(&tree.nodes) };
    Direct { nodes, blocks, root: plan.root, levels: plan.levels, bounds: tree.bounds(), quality }
}

/// Blocks that one thread fills at a time.
const BLOCKS: usize = 512;
/// How many primitives ahead the caches are asked for corners, and for their indices.
pub(super) const CORNERS_AHEAD: usize = 12;
pub(super) const INDICES_AHEAD: usize = 32;

/// Fills the blocks of some leaves, which are all zero before.
struct Fill<'a> {
    mesh: &'a MeshView<'a>,
    scale: f32,
    tree: &'a BinaryTree,
    leaves: &'a [u32],
    blocks: &'a mut [Block8],
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let (prims, triangles) = (&self.tree.prims[..], self.mesh.triangles);
        for (block, &binary) in self.blocks.iter_mut().zip(self.leaves) {
            let node = &self.tree.nodes[binary as usize];
            let run = node.first as usize..(node.first + node.count.min(8)) as usize;
            block.clear_prims();
            let mut lane = 0;
            for place in run {
                if let Some(&prim) = prims.get(place + INDICES_AHEAD) {
                    simd.prefetch::<1>(triangles.as_ptr().wrapping_add(prim as usize).cast());
                }
                if let Some(&prim) = prims.get(place + CORNERS_AHEAD) {
                    for corner in triangles[prim as usize] {
                        simd.prefetch::<1>(self.mesh.positions.as_ptr().wrapping_add(corner as usize).cast());
                    }
                }
                let prim = prims[place];
                // Parts of one triangle need but one lane.
                if !block.prims[..lane].contains(&prim) {
                    block.set(lane, prim, self.mesh.corners(prim).map(|p| p * self.scale));
                    lane += 1;
                }
            }
        }
    }
}

/// The binary tree over a mesh, none of whose triangles is cut, and which of its nodes become leaves of a wide one.
pub(crate) fn whole_tree(
    name: &str,
    mesh: &MeshView<'_>,
    config: &BuildConfig,
    scratch: &mut Scratch,
) -> Result<(BinaryTree, Vec<u32>, Clock), BuildError> {
    let mut clock = Clock::start();
    let config = BuildConfig { split_budget: Some(1.0), ..*config };
    let scaled = Scaled { mesh, scale: mesh.scale(&mesh.bounds()) };
    let tree = scaled.tree_over_references(name, &config, scratch, &mut clock)?;
    clock.lap("tree");
    let leaves = plan(&tree.nodes, config.max_leaf, config.level).leaves;
    clock.lap("plan");
    Ok((tree, leaves, clock))
}

/// Measures stages.
pub(crate) struct Clock {
    last: Instant,
    pub(crate) stages: Vec<(&'static str, Duration)>,
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    pub(crate) fn lap(&mut self, name: &'static str) {
        let now = Instant::now();
        self.stages.push((name, now - self.last));
        self.last = now;
    }
}
