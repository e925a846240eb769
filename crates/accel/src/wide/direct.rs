//! From Morton codes to wide nodes and blocks without references or an order of primitives in between.
//!
//! Leaves of the trees that Morton codes give are known before any box is. So the triangles' corners are fetched once,
//! in the order of the codes: they fill the blocks, and boxes follow from them while they are at hand.

use super::collapse::{emit, plan};
use super::mesh::{CORNERS_AHEAD, Clock, INDICES_AHEAD, Scaled};
use super::{Block8, ChildRef, MeshView, Node8};
use crate::build::{Boxes, CODE_BITS, Leaves, MortonTree, PORTIONS, codes};
use crate::memory::Pages;
use crate::quality::{counts, quality_of};
use crate::sort::{Pair, payload, radix_sort};
use crate::{BuildConfig, Node, Quality, Reference, Scratch};
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::Simd8;

/// Leaves hold at least so many triangles on average.
const FEWEST: usize = 4;

/// What is made of a mesh.
pub(super) struct Direct {
    pub(super) nodes: Pages<Node8>,
    pub(super) blocks: Pages<Block8>,
    pub(super) root: Option<ChildRef>,
    pub(super) levels: usize,
    pub(super) bounds: Aabb,
    pub(super) quality: Quality,
}

/// The Morton codes of the triangles, sorted; `around` holds all vertices. None where triangles may have to be cut first.
pub(super) fn sorted_codes<'a>(
    mesh: &Scaled<'_>,
    around: &Aabb,
    config: &BuildConfig,
    scratch: &'a mut Scratch,
) -> Option<&'a [Pair]> {
    let count = mesh.mesh.triangles.len();
    if count == 0 || count >= 1 << 31 {
        return None;
    }
    let (pairs, spare) = scratch.pairs(count);
    let extents = codes(mesh, around, config.level, pairs);
    let scene = extents.centers.size();
    if config.split_budget.is_none_or(|budget| budget > 1.0)
        && extents.longest_side >= scene.max_element() / PORTIONS
    {
        return None;
    }
    if (scene * 2.0).cmplt(around.size()).any() {
        // Vertices far away, of no triangle perhaps, would leave few cells to the others.
        codes(mesh, &extents.centers, config.level, pairs);
    }
    Some(radix_sort(pairs, spare, CODE_BITS))
}

/// Builds the tree `kind` over the triangles of sorted codes; none where clusters are too small.
pub(super) fn build(
    mesh: &Scaled<'_>,
    sorted: &[Pair],
    kind: MortonTree,
    config: &BuildConfig,
    clock: &mut Clock,
) -> Option<Direct> {
    let count = sorted.len();
    let mut forest = kind.forest(sorted, config);
    if forest.leaves() * FEWEST > count {
        // Leaves of small clusters are better joined, which this way cannot do.
        return None;
    }
    clock.lap("topology");
    let mut blocks = Pages::zeroed(forest.leaves());
    forest.fill(sorted, &Blocks { mesh }, &mut blocks, config.level);
    clock.lap("leaves");
    let mut nodes: Pages<Node> = Pages::zeroed(forest.nodes());
    forest.join(config, &mut nodes, false);
    clock.lap("top");
    let plan = plan(&nodes, 0, config.level);
    clock.lap("collapse");
    let mut wide = Pages::zeroed(plan.nodes.len());
    let leaf = |leaf: ChildRef| ChildRef::leaf(nodes[plan.leaves[leaf.index()] as usize].first);
    emit(&plan, &mut wide, |binary| nodes[binary as usize].bounds, leaf);
    clock.lap("emit");
    let root = plan.root.map(|root| if root.is_leaf() { leaf(root) } else { root });
    let cost = |leaf: &Node| f64::from(leaf.count);
    let quality = if config.measure { quality_of(&nodes, cost) } else { counts(&nodes) };
    Some(Direct { nodes: wide, blocks, root, levels: plan.levels, bounds: nodes[0].bounds, quality })
}

impl Boxes for Scaled<'_> {
    #[inline(always)]
    fn eight<S: Simd8>(&self, simd: S, first: usize) -> [S::F; 6] {
        let last = self.mesh.triangles.len() - 1;
        let corners: [[Vec3; 3]; 8] =
            std::array::from_fn(|i| self.mesh.corners((first + i).min(last) as u32));
        let scale = simd.splat(self.scale);
        let mut boxes = [scale; 6];
        for axis in 0..3 {
            let a: [f32; 8] = std::array::from_fn(|i| corners[i][0][axis]);
            let b: [f32; 8] = std::array::from_fn(|i| corners[i][1][axis]);
            let c: [f32; 8] = std::array::from_fn(|i| corners[i][2][axis]);
            let (a, b, c) = (simd.load(&a), simd.load(&b), simd.load(&c));
            boxes[axis] = simd.mul(simd.min(simd.min(a, b), c), scale);
            boxes[axis + 3] = simd.mul(simd.max(simd.max(a, b), c), scale);
        }
        boxes
    }

    #[inline(always)]
    fn one(&self, i: u32) -> Reference {
        let [a, b, c] = self.corners(i);
        Reference::finite(&Aabb { min: a.min(b).min(c), max: a.max(b).max(c) }, i)
    }

    #[inline(always)]
    fn prefetch<S: Simd8>(&self, simd: S, pairs: &[Pair], place: usize) {
        let MeshView { positions, triangles } = *self.mesh;
        if let Some(&pair) = pairs.get(place + INDICES_AHEAD) {
            simd.prefetch::<1>(triangles.as_ptr().wrapping_add(payload(pair) as usize).cast());
        }
        if let Some(&pair) = pairs.get(place + CORNERS_AHEAD) {
            for corner in triangles[payload(pair) as usize] {
                simd.prefetch::<1>(positions.as_ptr().wrapping_add(corner as usize).cast());
            }
        }
    }
}

/// Leaves as blocks, numbered through.
struct Blocks<'a> {
    mesh: &'a Scaled<'a>,
}

impl Leaves for Blocks<'_> {
    type Element = Block8;

    fn room(&self, nodes: &[Node]) -> usize {
        nodes.len().div_ceil(2)
    }

    #[inline(always)]
    fn fill<S: Simd8>(
        &self,
        simd: S,
        node: &mut Node,
        [number, within]: [usize; 2],
        run: &[Pair],
        blocks: &mut [Block8],
    ) -> S::F {
        let range = node.first as usize..(node.first + node.count.min(8)) as usize;
        node.first = number as u32;
        let block = &mut blocks[within];
        block.clear_prims();
        let mut around = Aabb::EMPTY;
        for (lane, place) in range.enumerate() {
            self.mesh.prefetch(simd, run, place);
            let prim = payload(run[place]);
            let corners = self.mesh.corners(prim);
            block.set(lane, prim, corners);
            for corner in corners {
                around = around.grow(corner);
            }
        }
        let (lo, hi) = (around.min, -around.max);
        simd.load(&[lo.x, lo.y, lo.z, 0.0, hi.x, hi.y, hi.z, 0.0])
    }
}
