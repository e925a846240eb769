//! Which photons a cell has: the published way, section 2.4. A photon is the first of its cell where its predecessor is in
//! another, and the last where its successor is; one of each exists, so that threads do not meet.

use rayon::prelude::*;
use std::ops::Range;
use vastlight_accel::sort::{Pair, key, parts};

/// Photons that one thread looks at at a time.
const CHUNK: usize = 1 << 14;

/// The first photon of each of `cells` cells, and the one behind the last, of pairs in the order of their keys; the cell is
/// the key without its lowest `shift` bits. Cells without photons have 0 and 0.
pub(super) fn first_and_end(sorted: &[Pair], shift: u32, cells: usize) -> Vec<[u32; 2]> {
    let cell = |i: usize| (key(sorted[i]) >> shift) as usize;
    let chunks = chunks_of_whole_cells(sorted.len(), |i| {
        let own = cell(i);
        sorted[..i].partition_point(|&pair| ((key(pair) >> shift) as usize) < own)
    });
    let mut bounds = vec![[0; 2]; cells];
    let ends: Vec<usize> = chunks.iter().map(|chunk| cell(chunk.end - 1) + 1).collect();
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let lengths = ends.iter().zip(starts.clone()).map(|(end, start)| end - start);
    let jobs: Vec<_> = chunks.into_iter().zip(starts).zip(parts(&mut bounds, lengths)).collect();
    jobs.into_par_iter().for_each(|((chunk, start), bounds)| {
        for i in chunk.clone() {
            if i == chunk.start || cell(i) != cell(i - 1) {
                bounds[cell(i) - start][0] = i as u32;
            }
            if i + 1 == chunk.end || cell(i) != cell(i + 1) {
                bounds[cell(i) - start][1] = i as u32 + 1;
            }
        }
    });
    bounds
}

/// Chunks of `len` photons, none of which ends within a cell; `first` gives the first photon of a photon's cell.
fn chunks_of_whole_cells(len: usize, first: impl Fn(usize) -> usize) -> Vec<Range<usize>> {
    let mut cuts: Vec<usize> = (0..len).step_by(CHUNK).map(first).collect();
    cuts.push(len);
    cuts.dedup();
    cuts.windows(2).map(|cut| cut[0]..cut[1]).collect()
}
