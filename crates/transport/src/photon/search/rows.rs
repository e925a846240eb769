//! Rows of photons: our own structure, made of the published one by looking at how it is read.
//!
//! Rows run along the axis of which the photons need most, side by side in a grid over the two other axes, and photons
//! within a row are in the order of a fine step along it. A point needs the rows that the sphere of the radius touches,
//! and of each only the chord that the sphere cuts out of it: one run of photons. Each row has a table of where its
//! steps start, as long as its photons are many, so that both ends of a run are found at once, and the memory is
//! proportional to the photons whatever the radius.

use super::{Axis, Kept, Runs, bounds, sorted_by_key};
use crate::photon::Photon;
use rayon::prelude::*;
use vastlight_accel::sort::{Pair, key, parts};
use vastlight_math::{Aabb, Vec3};

/// Rows to the radius, side by side.
const ROWS: f32 = 1.0;
/// Steps to the radius, along a row.
const STEPS: f32 = 4.0;
/// Most rows along an axis, and most steps.
const MOST: u32 = 4096;
/// Most rows, whatever the number of photons.
const MOST_ROWS: usize = 1 << 18;
/// Fewest rows that are worth joining.
const FEW_ROWS: usize = 1 << 10;
/// Rows whose tables one thread fills at a time.
const ROWS_OF_JOB: usize = 16;

/// A row's table.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    /// Where it starts.
    start: u32,
    /// The steps of the first photon and the last.
    first: u16,
    last: u16,
    /// An entry is for two to the power of this steps.
    shift: u32,
}

/// The grid of rows.
#[derive(Debug)]
pub(in crate::photon) struct Rows {
    /// The axes' numbers: along rows, and the two across.
    order: [usize; 3],
    along: Axis,
    across: [Axis; 2],
    radius: f32,
    /// A little more.
    reach: f32,
    rows: Vec<Row>,
    /// The tables: where the photons of a step start; each ends with the end of its row.
    tables: Vec<u32>,
}

impl Rows {
    pub(super) fn new(photons: &[Photon], kept: &Kept, radius: f32) -> (Self, Vec<Pair>) {
        let Aabb { min, max } = kept.bounds;
        let order = kept.axes_by_extent();
        let reach = kept.reach(radius);
        let [a, b, c] = order;
        let along = Axis::new(min[a], max[a], reach / STEPS, MOST);
        let across = across([min[b], min[c]], [max[b], max[c]], reach / ROWS, kept.photons);
        let step_bits = (along.cells() - 1).checked_ilog2().map_or(0, |bit| bit + 1);
        let rows = across[0].cells() * across[1].cells();
        let sorted = sorted_by_key(photons, kept, rows << step_bits, |position| {
            let row = across[0].cell(position[b]) * across[1].cells() + across[1].cell(position[c]);
            row << step_bits | along.cell(position[a])
        });
        let (rows, tables) = tables(&sorted, step_bits, rows as usize);
        (Self { order, along, across, radius, reach, rows, tables }, sorted)
    }

    #[inline(always)]
    pub(super) fn runs(&self, at: Vec3) -> Runs {
        let mut runs = Runs::NONE;
        let [x, y, z] = self.order.map(|axis| at[axis]);
        let [ys, zs] = &self.across;
        let (low, high) = (at - self.radius, at + self.radius);
        let [_, b, c] = self.order;
        let (Some(near_y), Some(near_z)) = (ys.cells_of(low[b], high[b]), zs.cells_of(low[c], high[c]))
        else {
            return runs;
        };
        let (place_y, place_z) = (ys.place(y), zs.place(z));
        for j in near_y {
            let to_y = ys.distance(place_y, j);
            for k in near_z.clone() {
                let to_z = zs.distance(place_z, k);
                let squared = self.reach * self.reach - to_y * to_y - to_z * to_z;
                if squared > 0.0 {
                    let half = squared.sqrt();
                    self.push_chord(&mut runs, j * zs.cells() + k, x - half, x + half);
                }
            }
        }
        runs
    }

    /// Adds the photons of a row between two coordinates.
    #[inline(always)]
    fn push_chord(&self, runs: &mut Runs, row: u32, low: f32, high: f32) {
        let row = &self.rows[row as usize];
        let (first, last) = (u32::from(row.first), u32::from(row.last));
        let Some(steps) = self.along.cells_of(low, high) else { return };
        let (low, high) = (first.max(*steps.start()), last.min(*steps.end()));
        if low <= high {
            let entry = |step: u32| (row.start + ((step - first) >> row.shift)) as usize;
            runs.push(self.tables[entry(low)], self.tables[entry(high) + 1]);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.rows.as_slice()) + size_of_val(self.tables.as_slice())
    }
}

/// Rows side by side along two axes, of `size` metres, or larger, so that they are not many more than the photons.
fn across(min: [f32; 2], max: [f32; 2], mut size: f32, photons: usize) -> [Axis; 2] {
    let most = photons.clamp(FEW_ROWS, MOST_ROWS);
    loop {
        let axes = [0, 1].map(|i| Axis::new(min[i], max[i], size, MOST));
        if axes[0].cells() as usize * axes[1].cells() as usize <= most {
            return axes;
        }
        size = axes[0].size().min(axes[1].size()).max(size) * 1.1;
    }
}

/// All rows and their tables.
fn tables(sorted: &[Pair], step_bits: u32, rows: usize) -> (Vec<Row>, Vec<u32>) {
    let bounds = bounds::first_and_end(sorted, step_bits, rows);
    let step = |photon: u32| key(sorted[photon as usize]) & ((1 << step_bits) - 1);
    let mut start = 0;
    let rows: Vec<Row> = bounds
        .iter()
        .map(|&[first, end]| {
            if first == end {
                return Row { start, first: 1, last: 0, shift: 0 };
            }
            let (row, entries) = row(start, [step(first), step(end - 1)], end - first);
            start += entries;
            row
        })
        .collect();
    let mut tables = vec![0; start as usize];
    let starts_of_jobs = rows.chunks(ROWS_OF_JOB).map(|rows| rows[0].start);
    let ends_of_jobs = starts_of_jobs.clone().skip(1).chain([start]);
    let lengths = starts_of_jobs.zip(ends_of_jobs).map(|(start, end)| (end - start) as usize);
    let jobs: Vec<_> = parts(&mut tables, lengths)
        .into_iter()
        .zip(rows.chunks(ROWS_OF_JOB).zip(bounds.chunks(ROWS_OF_JOB)))
        .collect();
    jobs.into_par_iter().for_each(|(tables, (rows, bounds))| {
        let base = rows[0].start;
        for (row, &[first, end]) in rows.iter().zip(bounds).filter(|(_, bounds)| bounds[0] < bounds[1]) {
            let entry = |photon: u32| (step(photon) - u32::from(row.first)) >> row.shift;
            fill(&mut tables[(row.start - base) as usize..], first..end, entry);
        }
    });
    (rows, tables)
}

/// The row whose table is at `start` and how many entries that has, with photons from one step to another.
fn row(start: u32, [first, last]: [u32; 2], photons: u32) -> (Row, u32) {
    let mut shift = 0;
    while (last - first) >> shift > 2 * photons {
        shift += 1;
    }
    (Row { start, first: first as u16, last: last as u16, shift }, ((last - first) >> shift) + 2)
}

/// Writes where each entry's photons start, and the end of all.
fn fill(table: &mut [u32], photons: std::ops::Range<u32>, entry: impl Fn(u32) -> u32) {
    let mut filled = 0;
    for photon in photons.clone() {
        let next = entry(photon) as usize + 1;
        if next > filled {
            table[filled..next].fill(photon);
            filled = next;
        }
    }
    table[filled] = photons.end;
}
