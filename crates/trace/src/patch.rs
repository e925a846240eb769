//! Rays of a picture that stand in rows, found as such by their directions, and taken as patches of several rows.
//!
//! Sixty-four rays of one row spread over 64 pixels in a line; of eight rows, over a block of eight by eight, and meet far fewer nodes
//! and leaves together. Nobody has to say that rays are those of a picture: where a row ends, directions jump back.

use crate::bundle;
use std::ops::Range;
use vastlight_math::{Aabb, Ray};

/// Most rows of a patch.
pub(crate) const ROWS: usize = 8;
/// Rows shorter than this are not looked for.
const SHORTEST_ROW: usize = 64;
/// Steps from ray to ray that tell what is usual.
const USUAL: usize = 15;
/// A step this much longer than usual ends a row, as a factor of squares.
const JUMP: f32 = 64.0;

/// Some rays of a batch: the first ones of several rows, or of the batch as one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Patch {
    first: usize,
    /// Rays of a row, as power of two.
    width_bits: u32,
    /// Rays from one row to the next.
    stride: usize,
    /// Number of rays.
    pub(crate) count: usize,
}

impl Patch {
    /// The number in the batch of a ray of the patch.
    #[inline(always)]
    pub(crate) fn index(&self, i: usize) -> usize {
        let row = i >> self.width_bits;
        self.first + row * self.stride + (i - (row << self.width_bits))
    }

    /// The first rays of it.
    #[inline(always)]
    pub(crate) fn truncated(self, count: usize) -> Self {
        Self { count, ..self }
    }

    /// The box around the directions of some of its rays.
    #[inline(always)]
    pub(crate) fn directions(&self, rays: &[Ray], range: Range<usize>) -> Aabb {
        range.fold(Aabb::EMPTY, |around, i| around.grow(rays[self.index(i)].direction))
    }
}

/// Rows that patches are taken from, all at the same place of the row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Strip {
    first: usize,
    /// Rays of a row.
    length: usize,
    /// A power of two, at most [`ROWS`].
    rows: usize,
}

impl Strip {
    /// The rays of a range as one row.
    pub(crate) fn row(range: Range<usize>) -> Self {
        Self { first: range.start, length: range.len(), rows: 1 }
    }

    /// Whether it is one row.
    pub(crate) fn is_row(&self) -> bool {
        self.rows == 1
    }

    /// At most `count` rays, a multiple of [`ROWS`], from `column` on; none at the end.
    #[inline(always)]
    pub(crate) fn patch(&self, column: usize, count: usize) -> Option<Patch> {
        let rest = self.length.checked_sub(column).filter(|&rest| rest > 0)?;
        let first = self.first + column;
        if self.rows == 1 {
            return Some(Patch { first, width_bits: usize::BITS - 1, stride: 0, count: count.min(rest) });
        }
        let width_bits = (count / self.rows).min(rest).max(1).ilog2();
        Some(Patch { first, width_bits, stride: self.length, count: self.rows << width_bits })
    }

    /// The column behind the first `count` rays of a patch.
    #[inline(always)]
    pub(crate) fn behind(&self, column: usize, count: usize) -> usize {
        column + count / self.rows
    }
}

/// The parts of a batch of `whole` rays with the given rows, in order.
pub(crate) fn strips(whole: usize, rows: Option<(usize, usize)>) -> impl Iterator<Item = Strip> {
    let (begin, length) = rows.unwrap_or((whole, whole.max(1)));
    let mut first = 0;
    std::iter::from_fn(move || {
        let strip = if first < begin {
            Strip::row(first..begin)
        } else {
            let rows = ((whole - first) / length).min(ROWS);
            if rows < 2 { Strip::row(first..whole) } else { Strip { first, length, rows: 1 << rows.ilog2() } }
        };
        first += strip.length * strip.rows;
        (strip.length > 0).then_some(strip)
    })
}

/// Where the first whole row begins and how long rows are, if the rays stand in rows of a picture.
pub(crate) fn rows(rays: &[Ray]) -> Option<(usize, usize)> {
    if rays.len() < 2 * SHORTEST_ROW {
        return None;
    }
    // Rays that part at once go in no bundles, in rows or not.
    let start = Strip::row(0..USUAL + 1).patch(0, USUAL + 1)?;
    if bundle::count(rays, &start) == 0 {
        return None;
    }
    let step = |i: usize| distance(&rays[i - 1], &rays[i]);
    let usual = (1..=USUAL).map(step).fold(0.0, f32::max);
    let mut ends = (1..rays.len()).filter(|&i| step(i) > JUMP * usual);
    let first = ends.next()?;
    let length = match ends.next() {
        Some(second) => second - first,
        // The second row is the last.
        None if rays.len() == 2 * first => first,
        None => return None,
    };
    let begin = if first == length { 0 } else { first };
    // No row before the first is longer than the others.
    if length < SHORTEST_ROW || first > length || begin + 2 * length > rays.len() {
        return None;
    }
    let below = distance(&rays[begin], &rays[begin + length]);
    (below <= JUMP * usual && is_tighter(rays, begin, length)).then_some((begin, length))
}

/// Whether rays of several rows go more the same way than as many that follow each other: not where these come in
/// blocks already, whose rows look like rows of a picture.
fn is_tighter(rays: &[Ray], begin: usize, length: usize) -> bool {
    let rows = 1 << ((rays.len() - begin) / length).clamp(1, ROWS).ilog2();
    let spread = |strip: Strip| {
        let patch = strip.patch(0, SHORTEST_ROW)?;
        Some(patch.directions(rays, 0..patch.count).size().max_element())
    };
    spread(Strip { first: begin, length, rows }) <= spread(Strip::row(begin..begin + length))
}

/// How different two rays are; infinite where they are no numbers.
#[inline(always)]
fn distance(a: &Ray, b: &Ray) -> f32 {
    let square = a.direction.distance_squared(b.direction) + a.origin.distance_squared(b.origin);
    if square.is_nan() { f32::INFINITY } else { square }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Vec3;

    /// Rays of a picture of so many columns, from a pixel on.
    fn picture(width: usize, pixels: Range<usize>) -> Vec<Ray> {
        let ray = |i: usize| {
            let (x, y) = ((i % width) as f32 / 500.0, (i / width) as f32 / 500.0);
            Ray::new(Vec3::ZERO, Vec3::new(x - 0.5, 0.5 - y, -1.0).normalize())
        };
        pixels.map(ray).collect()
    }

    #[test]
    fn blocks_that_follow_each_other_are_no_rows() {
        let inside = |i: usize| (i & 1 | i >> 1 & 2 | i >> 2 & 4, i >> 1 & 1 | i >> 2 & 2 | i >> 3 & 4);
        let ray = |i: usize| {
            let ((x, y), block) = (inside(i % 64), i / 64);
            let (x, y) = ((8 * (block % 8) + x) as f32, (8 * (block / 8) + y) as f32);
            Ray::new(Vec3::ZERO, Vec3::new(x / 500.0, y / 500.0, -1.0).normalize())
        };
        assert_eq!(rows(&(0..4096).map(ray).collect::<Vec<_>>()), None);
        assert_eq!(rows(&picture(512, 0..4096)), Some((0, 512)), "the same jumps");
    }

    #[test]
    fn rows_are_found_where_they_begin() {
        assert_eq!(rows(&picture(100, 0..1000)), Some((0, 100)));
        assert_eq!(rows(&picture(100, 30..1000)), Some((70, 100)));
        assert_eq!(rows(&picture(1000, 0..2000)), Some((0, 1000)));
        assert_eq!(rows(&picture(1000, 1..2000)), None);
        assert_eq!(rows(&picture(40, 0..1000)), None);
        assert_eq!(rows(&picture(1000, 0..900)), None);
        assert_eq!(rows(&[]), None);
        let orthographic: Vec<Ray> = (0..1000)
            .map(|i| Ray::new(Vec3::new((i % 100) as f32, (i / 100) as f32, 0.0), Vec3::Z))
            .collect();
        assert_eq!(rows(&orthographic), Some((0, 100)));
        let odd = vec![Ray::new(Vec3::NAN, Vec3::ZERO); 1000];
        assert_eq!(rows(&odd), None);
    }

    #[test]
    fn strips_and_patches_hold_every_ray_once() {
        for (width, pixels) in
            [(100, 0..1000), (100, 30..1717), (77, 3..777), (500, 0..999), (64, 0..64 * 15)]
        {
            let rays = picture(width, pixels);
            let mut seen = vec![0; rays.len()];
            let mut most_rows = 0;
            for strip in strips(rays.len(), rows(&rays)) {
                let mut column = 0;
                while let Some(patch) = strip.patch(column, 64) {
                    (0..patch.count).for_each(|i| seen[patch.index(i)] += 1);
                    column = strip.behind(column, patch.count);
                    most_rows = most_rows.max(strip.rows);
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{width}");
            assert_eq!(most_rows > 1, rows(&rays).is_some());
        }
    }

    #[test]
    fn patches_of_rows_are_blocks() {
        let rays = picture(100, 0..1000);
        let strip = strips(rays.len(), rows(&rays)).next().expect("rows");
        let patch = strip.patch(8, 64).expect("a patch");
        let places: Vec<usize> = (0..patch.count).map(|i| patch.index(i)).collect();
        let expected: Vec<usize> = (0..64).map(|i| 8 + i % 8 + i / 8 * 100).collect();
        assert_eq!(places, expected);
        let line = Strip::row(0..1000).patch(8, 64).expect("a patch");
        let size = |patch: &Patch| patch.directions(&rays, 0..64).size().max_element();
        assert!(size(&patch) < size(&line) / 4.0);
    }
}
