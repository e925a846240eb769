//! The published structure, sections 2.3 and 2.4: voxels at least as wide as the radius, an array of the first and last
//! photon of each, and 27 of them for a point.

use super::{Axis, Kept, Runs, bounds, sorted_by_key};
use crate::photon::Photon;
use vastlight_accel::sort::Pair;
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
        let Aabb { min, max } = kept.bounds;
        let side = kept.reach(radius).max(kept.bounds.size().max_element() / MOST as f32);
        let axes = [0, 1, 2].map(|i| Axis::new(min[i], max[i], side, most[i]));
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
