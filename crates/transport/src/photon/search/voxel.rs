//! The published structure, sections 2.3 and 2.4: voxels at least as wide as the radius, an array of the first and last
//! photon of each, and 27 of them for a point.

use super::{Axis, Kept, Runs, bounds, sorted_by_key};
use crate::photon::{Kernel, Photon};
use vastlight_accel::sort::{Pair, payload};
use vastlight_math::{Aabb, Vec3};

/// Most voxels along an axis.
const MOST: u32 = 256;

/// The array of voxels, z the fastest.
#[derive(Debug)]
pub(in crate::photon) struct Voxels {
    axes: [Axis; 3],
    radius: f32,
    /// First photon and the one behind the last.
    bounds: Vec<[u32; 2]>,
}

impl Voxels {
    /// Voxels are cubes with sides of the radius, or of as much as leaves [`MOST`] along the longest side of the box of all
    /// photons.
    pub(super) fn new(photons: &[Photon], kept: &Kept, radius: f32) -> (Self, Vec<Pair>) {
        Self::of_box(photons, kept, radius, [MOST; 3])
    }

    /// With at most `most` voxels along the axes.
    pub(super) fn of_box(photons: &[Photon], kept: &Kept, radius: f32, most: [u32; 3]) -> (Self, Vec<Pair>) {
        let axes = axes(kept, radius, most);
        let cells = axes.iter().map(Axis::cells).product();
        let sorted = sorted_by_key(photons, kept, cells, |position| {
            let [x, y, z] = [0, 1, 2].map(|i| axes[i].cell(position[i]));
            (x * axes[1].cells() + y) * axes[2].cells() + z
        });
        let bounds = bounds::first_and_end(&sorted, 0, cells as usize);
        (Self { axes, radius, bounds }, sorted)
    }

    #[inline(always)]
    pub(super) fn runs(&self, at: Vec3) -> Runs {
        let mut runs = Runs::NONE;
        let [x, y, z] = &self.axes;
        let (low, high) = (at - self.radius, at + self.radius);
        let (Some(xs), Some(ys), Some(zs)) =
            (x.cells_of(low.x, high.x), y.cells_of(low.y, high.y), z.cells_of(low.z, high.z))
        else {
            return runs;
        };
        for i in xs {
            for j in ys.clone() {
                for k in zs.clone() {
                    let [first, end] = self.bounds[((i * y.cells() + j) * z.cells() + k) as usize];
                    runs.push(first, end);
                }
            }
        }
        runs
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.bounds.as_slice())
    }
}

/// The axes of cubes around what is kept.
fn axes(kept: &Kept, radius: f32, most: [u32; 3]) -> [Axis; 3] {
    let Aabb { min, max } = kept.bounds;
    let side = kept.reach(radius).max(kept.bounds.size().max_element() / MOST as f32);
    [0, 1, 2].map(|i| Axis::new(min[i], max[i], side, most[i]))
}

/// The voxels without their photons: what a device is told of them.
#[derive(Clone, Copy, Debug)]
pub struct VoxelGrid {
    axes: [Axis; 3],
    radius: f32,
    /// The greatest key that a photon can have.
    greatest: u32,
}

impl VoxelGrid {
    /// Words of the header in front of the photons on a device.
    pub const WORDS: usize = 16;

    /// The voxels of photons within `bounds`, so many of them and so many left out, gathered within a radius, m. Nothing is near
    /// anything where the radius is of no use: see [`PhotonMap`](crate::photon::PhotonMap).
    #[must_use]
    pub fn new(bounds: Aabb, [photons, lost]: [usize; 2], radius: f32, weight: Kernel) -> Self {
        let radius = weight.usable(radius);
        let kept = Kept { photons, lost, bounds };
        let axes = axes(&kept, radius, [MOST; 3]);
        let cells: u32 = axes.iter().map(Axis::cells).product();
        Self { axes, radius, greatest: if lost > 0 { cells } else { cells - 1 } }
    }

    /// How many voxels there are; the key of photons that are left out.
    #[must_use]
    pub fn cells(&self) -> u32 {
        self.axes.iter().map(Axis::cells).product()
    }

    /// Bits of the photons' keys.
    #[must_use]
    pub fn key_bits(&self) -> u32 {
        u32::BITS - self.greatest.leading_zeros()
    }

    /// The header: least and greatest corner, voxels to the metre and their number by axis, then radius, its inverse, the weight in the
    /// middle, and which weight it is.
    #[must_use]
    pub fn words(&self, weight: Kernel) -> [u32; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        for (i, axis) in self.axes.iter().enumerate() {
            let [min, max, per_cell] = axis.numbers().map(f32::to_bits);
            (words[i], words[3 + i], words[6 + i], words[9 + i]) = (min, max, per_cell, axis.cells());
        }
        let radius = self.radius;
        let peak = if radius > 0.0 { weight.peak(radius) } else { 0.0 };
        words[12..15].copy_from_slice(&[radius, 1.0 / radius, peak].map(f32::to_bits));
        words[15] = weight as u32;
        words
    }

    /// The numbers of the photons in the order of their voxels, without those that are left out, and for each voxel its first and the
    /// one behind its last.
    #[must_use]
    pub fn index(photons: &[Photon], radius: f32) -> (Vec<u32>, Vec<[u32; 2]>) {
        let (voxels, sorted) = Voxels::new(photons, &Kept::of(photons), radius);
        (sorted.into_iter().map(payload).collect(), voxels.bounds)
    }
}
