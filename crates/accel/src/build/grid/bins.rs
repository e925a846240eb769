//! What fell into each of eight bins along each axis, and the plane of least cost between them.

use super::cells::{Lattice, Region, SIDE};

/// Counts of references, and which cells have any, as projections on three planes: bit `8 * row + column`.
pub(super) struct Bins {
    counts: [[u32; 8]; 3],
    /// Rows are y, columns x.
    y_x: u64,
    /// Rows are z, columns x.
    z_x: u64,
    /// Rows are z, columns y.
    z_y: u64,
}

/// A plane: bins up to `last` go left.
struct Plane {
    axis: usize,
    last: usize,
    cost: u64,
}

/// Occupied bins of one axis, and for each which bins of the other two have something in it.
struct Sweep {
    counts: [u32; 8],
    others: [u64; 2],
    /// Sizes of a bin: along this axis, and along the others.
    sizes: [u32; 3],
}

/// The cost of a side with nothing in it. Costs of others are less, and two of them can be added.
const NONE: u64 = u64::MAX / 2;

/// Length of the span between the lowest and the highest bit.
#[inline(always)]
fn span(mask: u8) -> u32 {
    8 - mask.leading_zeros().min(8) - mask.trailing_zeros() % 8
}

impl Bins {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { counts: [[0; 8]; 3], y_x: 0, z_x: 0, z_y: 0 }
    }

    /// Adds a reference in a cell.
    #[inline(always)]
    pub(super) fn add(&mut self, x: u32, y: u32, z: u32) {
        self.counts[0][x as usize & 7] += 1;
        self.counts[1][y as usize & 7] += 1;
        self.counts[2][z as usize & 7] += 1;
        self.y_x |= 1 << ((8 * y + x) & 63);
        self.z_x |= 1 << ((8 * z + x) & 63);
        self.z_y |= 1 << ((8 * z + y) & 63);
    }

    /// Adds a row of cells along x, of which those in `full` have references.
    #[inline(always)]
    pub(super) fn add_row(&mut self, row: &[u32; 8], full: u32, y: usize, z: usize) {
        let mut sum = 0;
        for (total, &count) in self.counts[0].iter_mut().zip(row) {
            *total += count;
            sum += count;
        }
        self.counts[1][y & 7] += sum;
        self.counts[2][z & 7] += sum;
        self.y_x |= u64::from(full) << (8 * (y & 7));
        self.z_x |= u64::from(full) << (8 * (z & 7));
        self.z_y |= 1 << (8 * (z & 7) + (y & 7));
    }

    /// The parts of `region` on both sides of the plane of least cost, as tight as cells tell, with their numbers of
    /// references; none where everything is in one cell.
    #[inline(always)]
    pub(super) fn split(&self, region: &Region, lattice: &Lattice) -> Option<[(Region, u32); 2]> {
        let best = self.best(lattice)?;
        let count = |bins: &[u32]| bins.iter().sum();
        let counts = &self.counts[best.axis];
        let (left, right) = counts.split_at(best.last + 1);
        let below = (2_u32 << best.last) as u8 - 1;
        Some([
            (self.within(region, best.axis, below), count(left)),
            (self.within(region, best.axis, !below), count(right)),
        ])
    }

    /// `region` as tight as cells tell.
    #[inline(always)]
    pub(super) fn tight(&self, region: &Region) -> Region {
        self.within(region, 0, u8::MAX)
    }

    /// The tight part of `region` in some of the bins along an axis.
    #[inline(always)]
    fn within(&self, region: &Region, axis: usize, bins: u8) -> Region {
        let masks = self.masks(axis);
        let mut own = 0_u8;
        let mut others = [0_u8; 2];
        for bin in (0..8).filter(|bin| bins >> bin & 1 == 1) {
            let row = masks.map(|m| (m >> (8 * bin)) as u8);
            own |= u8::from(row[0] != 0) << bin;
            others = [others[0] | row[0], others[1] | row[1]];
        }
        let mut part = *region;
        for (axis, mask) in [(axis, own), ((axis + 1) % 3, others[0]), ((axis + 2) % 3, others[1])] {
            part.max[axis] = region.min[axis] + SIDE - mask.leading_zeros();
            part.min[axis] = region.min[axis] + mask.trailing_zeros() % SIDE;
        }
        part
    }

    /// For each bin of an axis, a row of eight bits, the bins of the next axis and of the one after that.
    #[inline(always)]
    fn masks(&self, axis: usize) -> [u64; 2] {
        match axis {
            0 => [transposed(self.y_x), transposed(self.z_x)],
            1 => [transposed(self.z_y), self.y_x],
            _ => [self.z_x, self.z_y],
        }
    }

    #[inline(always)]
    fn best(&self, lattice: &Lattice) -> Option<Plane> {
        let mut best: Option<Plane> = None;
        for axis in 0..3 {
            let sizes = [lattice.size[axis], lattice.size[(axis + 1) % 3], lattice.size[(axis + 2) % 3]];
            let sweep = Sweep { counts: self.counts[axis], others: self.masks(axis), sizes };
            let costs = sweep.costs();
            for (last, &cost) in costs.iter().enumerate() {
                if cost < best.as_ref().map_or(NONE, |b| b.cost) {
                    best = Some(Plane { axis, last, cost });
                }
            }
        }
        best
    }
}

impl Sweep {
    /// The cost of the plane behind each bin: `SA(left) count(left) + SA(right) count(right)`, at least [`NONE`] where a side is empty.
    #[inline(always)]
    fn costs(&self) -> [u64; 7] {
        let mut right = [0; 8];
        let (mut count, mut own, mut others) = (0, 0_u8, [0_u8; 2]);
        for bin in (1..8).rev() {
            self.grow(bin, &mut count, &mut own, &mut others);
            right[bin] = self.side(count, own, others);
        }
        let mut costs = [0; 7];
        let (mut count, mut own, mut others) = (0, 0_u8, [0_u8; 2]);
        for bin in 0..7 {
            self.grow(bin, &mut count, &mut own, &mut others);
            costs[bin] = self.side(count, own, others) + right[bin + 1];
        }
        costs
    }

    #[inline(always)]
    fn grow(&self, bin: usize, count: &mut u32, own: &mut u8, others: &mut [u8; 2]) {
        *count += self.counts[bin];
        *own |= u8::from(self.counts[bin] != 0) << bin;
        *others = [
            others[0] | (self.others[0] >> (8 * bin)) as u8,
            others[1] | (self.others[1] >> (8 * bin)) as u8,
        ];
    }

    #[inline(always)]
    fn side(&self, count: u32, own: u8, others: [u8; 2]) -> u64 {
        let [a, b, c] =
            [span(own) * self.sizes[0], span(others[0]) * self.sizes[1], span(others[1]) * self.sizes[2]];
        if count == 0 { NONE } else { u64::from(a * b + b * c + c * a) * u64::from(count) }
    }
}

/// Rows become columns: Warren 2012, "Hacker's Delight", 7-3.
#[inline(always)]
fn transposed(mut x: u64) -> u64 {
    let mut swap = |shift: u32, mask: u64| {
        let t = (x ^ x >> shift) & mask;
        x ^= t ^ t << shift;
    };
    swap(7, 0x00aa_00aa_00aa_00aa);
    swap(14, 0x0000_cccc_0000_cccc);
    swap(28, 0x0000_0000_f0f0_f0f0);
    x
}
