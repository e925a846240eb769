//! Nodes with eight boxes, and blocks of eight triangles, as arrays of lanes.

use vastlight_math::{Aabb, Vec3};
use vastlight_simd::Simd8;

/// A node with eight slots, however it is kept.
pub trait WideNode {
    /// What a slot points to, of the node that stands at `place`.
    fn child(&self, place: usize, slot: usize) -> ChildRef;
    /// The lower (`side` 0) or upper (1) planes of the slots' boxes, those of slots without child anything.
    fn planes<S: Simd8>(&self, simd: S, axis: usize, side: usize) -> S::F;
    /// The box of a slot with a child.
    fn bounds(&self, slot: usize) -> Aabb;
    /// The slots that may have a child, as bits; no ray meets the box of another of these.
    fn used(&self) -> u32;

    /// The same with full boxes; it stands at `place`.
    #[must_use]
    fn to_wide(&self, place: usize) -> Node8 {
        let mut node = Node8::EMPTY;
        for slot in (0..8).filter(|&slot| self.used() >> slot & 1 == 1) {
            node.set(slot, self.child(place, slot), &self.bounds(slot));
        }
        node
    }
}

impl<N: WideNode> WideNode for &N {
    #[inline(always)]
    fn child(&self, place: usize, slot: usize) -> ChildRef {
        N::child(self, place, slot)
    }

    #[inline(always)]
    fn planes<S: Simd8>(&self, simd: S, axis: usize, side: usize) -> S::F {
        N::planes(self, simd, axis, side)
    }

    #[inline(always)]
    fn bounds(&self, slot: usize) -> Aabb {
        N::bounds(self, slot)
    }

    #[inline(always)]
    fn used(&self) -> u32 {
        N::used(self)
    }
}

/// Corners of eight triangles: by corner, then axis, then lane.
pub type LeafLanes = [[[f32; 8]; 3]; 3];

/// Up to eight triangles, however they are kept.
pub trait Leaf {
    /// Their corners, those of lanes without triangle anything.
    fn corners(&self) -> &LeafLanes;
    /// The lanes that may hold a triangle, as bits; no ray hits another of these.
    fn lanes(&self) -> u32;
    /// The number of the triangle in a lane.
    fn prim(&self, lane: usize) -> u32;
    /// Where the triangle in a lane stands in its page; 0 where there are no pages.
    fn place(&self, lane: usize) -> u32;
}

/// What a node's slot points to: a node, a leaf, or nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct ChildRef(pub u32);

impl ChildRef {
    const LEAF_BIT: u32 = 1 << 31;
    /// Nothing.
    pub const NONE: Self = Self(u32::MAX);

    /// The node with this index.
    #[inline]
    #[must_use]
    pub const fn node(index: u32) -> Self {
        Self(index)
    }

    /// The leaf with this index.
    #[inline]
    #[must_use]
    pub const fn leaf(index: u32) -> Self {
        Self(index | Self::LEAF_BIT)
    }

    /// Whether this is a leaf (or nothing).
    #[inline(always)]
    #[must_use]
    pub const fn is_leaf(self) -> bool {
        self.0 & Self::LEAF_BIT != 0
    }

    /// Index of the node or leaf.
    #[inline(always)]
    #[must_use]
    pub const fn index(self) -> usize {
        (self.0 & !Self::LEAF_BIT) as usize
    }
}

/// Eight children with their boxes, 256 bytes.
///
/// A slot without child has an empty box and [`ChildRef::NONE`].
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct Node8 {
    /// By axis, then lower or upper, then slot.
    pub planes: [[[f32; 8]; 2]; 3],
    /// By slot.
    pub children: [ChildRef; 8],
    /// Nothing yet; keeps the size a multiple of a cache line.
    pub reserved: [u32; 8],
}

impl Node8 {
    /// A node without children.
    pub const EMPTY: Self = Self {
        planes: [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3],
        children: [ChildRef::NONE; 8],
        reserved: [0; 8],
    };

    /// Puts a child into a slot.
    pub fn set(&mut self, slot: usize, child: ChildRef, bounds: &Aabb) {
        for axis in 0..3 {
            self.planes[axis][0][slot] = bounds.min[axis];
            self.planes[axis][1][slot] = bounds.max[axis];
        }
        self.children[slot] = child;
    }

    /// The box of a slot.
    #[must_use]
    pub fn bounds(&self, slot: usize) -> Aabb {
        let corner = |side: usize| Vec3::from(std::array::from_fn(|axis| self.planes[axis][side][slot]));
        Aabb { min: corner(0), max: corner(1) }
    }
}

impl WideNode for Node8 {
    #[inline(always)]
    fn child(&self, _place: usize, slot: usize) -> ChildRef {
        self.children[slot]
    }

    #[inline(always)]
    fn planes<S: Simd8>(&self, simd: S, axis: usize, side: usize) -> S::F {
        simd.load(&self.planes[axis][side])
    }

    #[inline(always)]
    fn bounds(&self, slot: usize) -> Aabb {
        Self::bounds(self, slot)
    }

    #[inline(always)]
    fn used(&self) -> u32 {
        // The boxes of the others are empty.
        0xff
    }
}

/// Up to eight triangles, 320 bytes. Lanes without triangle hold a point that no ray hits, and the number `u32::MAX`.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct Block8 {
    /// By corner, then axis, then lane.
    pub corners: LeafLanes,
    /// The triangles' numbers, by lane.
    pub prims: [u32; 8],
}

impl Block8 {
    /// The number in lanes without triangle.
    pub const NO_PRIM: u32 = u32::MAX;

    /// A block without triangles.
    pub const EMPTY: Self = Self { corners: [[[0.0; 8]; 3]; 3], prims: [Self::NO_PRIM; 8] };

    /// A block of the first eight triangles of `triangles`, with their numbers.
    #[must_use]
    pub fn new(triangles: impl IntoIterator<Item = (u32, [Vec3; 3])>) -> Self {
        let mut block = Self::EMPTY;
        triangles.into_iter().take(8).enumerate().for_each(|(lane, (prim, t))| block.set(lane, prim, t));
        block
    }

    /// Makes a block of zeros one without triangles.
    #[inline(always)]
    pub(crate) fn clear_prims(&mut self) {
        self.prims = [Self::NO_PRIM; 8];
    }

    /// Puts a triangle into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, prim: u32, corners: [Vec3; 3]) {
        self.prims[lane] = prim;
        for (of_corner, corner) in self.corners.iter_mut().zip(corners) {
            for (of_axis, x) in of_corner.iter_mut().zip(corner.to_array()) {
                of_axis[lane] = x;
            }
        }
    }

    /// The corners of the triangle in a lane.
    #[must_use]
    pub fn triangle(&self, lane: usize) -> [Vec3; 3] {
        std::array::from_fn(|corner| Vec3::from(std::array::from_fn(|axis| self.corners[corner][axis][lane])))
    }

    /// The lanes that hold triangles.
    pub fn used(&self) -> impl Iterator<Item = usize> {
        (0..8).filter(|&lane| self.prims[lane] != Self::NO_PRIM)
    }

    /// The numbers and boxes of its triangles.
    pub(crate) fn boxes(&self) -> Vec<(u32, Aabb)> {
        self.used().map(|lane| (self.prims[lane], Aabb::from_points(self.triangle(lane)))).collect()
    }
}

impl Leaf for Block8 {
    #[inline(always)]
    fn corners(&self) -> &LeafLanes {
        &self.corners
    }

    #[inline(always)]
    fn lanes(&self) -> u32 {
        // The others hold points.
        0xff
    }

    #[inline(always)]
    fn prim(&self, lane: usize) -> u32 {
        self.prims[lane]
    }

    #[inline(always)]
    fn place(&self, _lane: usize) -> u32 {
        0
    }
}
