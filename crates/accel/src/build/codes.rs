//! Morton codes of the centres of boxes, eight boxes at a time, and their sorted order.
//!
//! Boxes are read through [`Boxes`], so that those of triangles need never be written: their codes follow from the mesh.

use super::{RunBounds, Scratch};
use crate::Reference;
use crate::sort::{Pair, pair, payload, radix_sort};
use rayon::prelude::*;
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::{Kernel, Level, Simd8};

/// Bits of a code along one axis.
const AXIS_BITS: u32 = 10;
/// Bits of a code.
pub(crate) const CODE_BITS: u32 = 3 * AXIS_BITS;
/// Boxes that one thread looks at at a time, a multiple of eight.
const CHUNK: usize = 1 << 13;

/// Boxes of primitives, read where they are needed.
pub(crate) trait Boxes: Sync {
    /// The boxes of eight primitives from `first` on: lower corners by axis, then upper ones, scaled as coordinates are in
    /// the tree. Lanes behind the last primitive hold its box again.
    fn eight<S: Simd8>(&self, simd: S, first: usize) -> [S::F; 6];
    /// The reference to primitive `i`.
    fn one(&self, i: u32) -> Reference;
    /// Asks the caches for what [`Boxes::one`] needs of the primitives of `pairs` from `place` on, some time later.
    fn prefetch<S: Simd8>(&self, simd: S, pairs: &[Pair], place: usize);
}

/// How many places ahead the caches are asked.
const AHEAD: usize = 24;

impl Boxes for [Reference] {
    #[inline(always)]
    fn eight<S: Simd8>(&self, simd: S, first: usize) -> [S::F; 6] {
        let lanes: [&[f32; 8]; 8] = std::array::from_fn(|i| self[(first + i).min(self.len() - 1)].lanes());
        let mut boxes = [simd.splat(0.0); 6];
        for (slot, lane) in [0, 1, 2, 4, 5, 6].into_iter().enumerate() {
            let sign = if slot < 3 { 1.0 } else { -1.0 };
            let values: [f32; 8] = std::array::from_fn(|i| lanes[i][lane] * sign);
            boxes[slot] = simd.load(&values);
        }
        boxes
    }

    #[inline(always)]
    fn one(&self, i: u32) -> Reference {
        self[i as usize]
    }

    #[inline(always)]
    fn prefetch<S: Simd8>(&self, simd: S, pairs: &[Pair], place: usize) {
        if let Some(&pair) = pairs.get(place + AHEAD) {
            simd.prefetch::<1>(self.as_ptr().wrapping_add(payload(pair) as usize).cast());
        }
    }
}

/// What is known of the boxes once their codes are made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extents {
    /// Around the centres.
    pub(crate) centers: Aabb,
    /// The longest side of any box.
    pub(crate) longest_side: f32,
}

impl Extents {
    const NONE: Self = Self { centers: Aabb::EMPTY, longest_side: 0.0 };

    fn union(self, other: Self) -> Self {
        Self {
            centers: self.centers.union(other.centers),
            longest_side: self.longest_side.max(other.longest_side),
        }
    }
}

/// The Morton codes of the centres in cells of `around`, with the numbers of the primitives, unsorted in `pairs`.
pub(crate) fn codes<B: Boxes + ?Sized>(
    boxes: &B,
    around: &Aabb,
    level: Level,
    pairs: &mut [Pair],
) -> Extents {
    let grid = Grid::new(around);
    let chunk = |(i, pairs): (usize, &mut [Pair])| {
        level.dispatch(Codes { grid: &grid, boxes, first: i * CHUNK, pairs })
    };
    pairs.par_chunks_mut(CHUNK).enumerate().map(chunk).reduce(|| Extents::NONE, Extents::union)
}

/// The references' Morton codes with their places in `references`, sorted.
pub(crate) fn sorted_codes<'a>(
    references: &[Reference],
    level: Level,
    scratch: &'a mut Scratch,
) -> &'a [Pair] {
    let RunBounds { centers: c, .. } = super::top_down::bounds(references, level);
    let twice = Aabb { min: Vec3::new(c[0], c[1], c[2]), max: -Vec3::new(c[4], c[5], c[6]) };
    let (pairs, spare) = scratch.pairs(references.len());
    codes(references, &Aabb { min: twice.min * 0.5, max: twice.max * 0.5 }, level, pairs);
    radix_sort(pairs, spare, CODE_BITS)
}

/// Maps twice the centres to cells.
struct Grid {
    start: [f32; 3],
    scale: [f32; 3],
}

impl Grid {
    fn new(around: &Aabb) -> Self {
        let (lower, upper) = (2.0 * around.min, 2.0 * around.max);
        let cells = ((1 << AXIS_BITS) as f32 / (upper - lower)).to_array();
        let scale = cells.map(|cells| if cells.is_finite() { cells } else { 0.0 });
        Self { start: lower.to_array(), scale }
    }
}

/// Writes the codes of some boxes.
struct Codes<'a, B: ?Sized> {
    grid: &'a Grid,
    boxes: &'a B,
    first: usize,
    pairs: &'a mut [Pair],
}

impl<B: Boxes + ?Sized> Kernel for Codes<'_, B> {
    type Output = Extents;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Extents {
        let last = simd.splat(((1 << AXIS_BITS) - 1) as f32);
        let (mut low, mut high) = ([simd.splat(f32::INFINITY); 3], [simd.splat(f32::NEG_INFINITY); 3]);
        let mut longest = simd.splat(0.0);
        for (group, pairs) in self.pairs.chunks_mut(8).enumerate() {
            let first = self.first + 8 * group;
            let boxes = self.boxes.eight(simd, first);
            let mut cells = [[0.0; 8]; 3];
            for axis in 0..3 {
                let (lower, upper) = (boxes[axis], boxes[axis + 3]);
                let twice = simd.add(lower, upper);
                low[axis] = simd.min(low[axis], twice);
                high[axis] = simd.max(high[axis], twice);
                longest = simd.max(longest, simd.sub(upper, lower));
                let (start, scale) = (simd.splat(self.grid.start[axis]), simd.splat(self.grid.scale[axis]));
                cells[axis] = simd.to_array(simd.min(simd.mul(simd.sub(twice, start), scale), last));
            }
            let codes = interleave(&cells);
            for (slot, i) in pairs.iter_mut().zip(0..8) {
                *slot = pair(codes[i], (first + i) as u32);
            }
        }
        let least = |lanes: [f32; 8]| 0.5 * lanes.into_iter().fold(f32::INFINITY, f32::min);
        let most = |lanes: [f32; 8]| lanes.into_iter().fold(f32::NEG_INFINITY, f32::max);
        let centers = Aabb {
            min: low.map(|x| least(simd.to_array(x))).into(),
            max: high.map(|x| 0.5 * most(simd.to_array(x))).into(),
        };
        Extents { centers, longest_side: most(simd.to_array(longest)) }
    }
}

/// The Morton codes of eight cells, x highest; coordinates are cut down to integers.
#[inline(always)]
fn interleave(cells: &[[f32; 8]; 3]) -> [u32; 8] {
    let mut codes = [0; 8];
    for (axis, cells) in cells.iter().enumerate() {
        for (code, &x) in codes.iter_mut().zip(cells) {
            // Adding 2^23 leaves the nearest integer in the low bits of the mantissa; half a cell less makes it the one below.
            let mut x = (x - 0.499 + 8_388_608.0).max(8_388_608.0).to_bits() & ((1 << AXIS_BITS) - 1);
            x = (x | x << 16) & 0x0300_00ff;
            x = (x | x << 8) & 0x0300_f00f;
            x = (x | x << 4) & 0x030c_30c3;
            x = (x | x << 2) & 0x0924_9249;
            *code |= x << (2 - axis);
        }
    }
    codes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_interleave_bits_x_first() {
        let code = |cell: [f32; 3]| interleave(&cell.map(|x| [x; 8]))[5];
        assert_eq!(code([0.0; 3]), 0);
        assert_eq!(code([1023.0; 3]), (1 << 30) - 1);
        assert_eq!(code([0.9, 0.0, 0.99]), 0);
        for bit in 0..AXIS_BITS {
            let x = (1 << bit) as f32;
            assert_eq!(code([x, 0.0, 0.0]), 4 << (3 * bit));
            assert_eq!(code([0.0, x, 0.0]), 2 << (3 * bit));
            assert_eq!(code([0.0, 0.0, x]), 1 << (3 * bit));
        }
        assert_eq!(code([f32::NAN, -1.0, 0.0]) & 0x4924_9249, 0);
    }

    #[test]
    fn extents_are_those_of_the_boxes() {
        let corner = |i: u32| Vec3::new(i as f32, (i * i % 7) as f32, -(i as f32));
        let boxes: Vec<Aabb> = (0..21)
            .map(|i| Aabb { min: corner(i), max: corner(i) + Vec3::new(1.0, 2.0, i as f32) })
            .collect();
        let references: Vec<Reference> = boxes.iter().zip(0..).map(|(b, i)| Reference::new(b, i)).collect();
        let around = boxes.iter().fold(Aabb::EMPTY, |a, &b| a.union(b));
        for level in Level::available() {
            let mut pairs = vec![0; boxes.len()];
            let extents = codes(&references[..], &around, level, &mut pairs);
            let centers = boxes.iter().fold(Aabb::EMPTY, |a, b| a.grow((b.min + b.max) * 0.5));
            assert_eq!((extents.centers, extents.longest_side), (centers, 20.0));
            assert!(pairs.iter().zip(0..).all(|(&p, i)| crate::sort::payload(p) == i));
        }
    }
}
