//! The published array of two dimensions for flat receivers, section 2.4: voxels that reach through the whole box along the
//! axis of which the photons need least; nine of them for a point.

use super::{Kept, voxel::Voxels};
use crate::photon::Photon;
use vastlight_accel::sort::Pair;

/// Most voxels along the two other axes.
const MOST: u32 = 256;

/// Sorts photons into columns of voxels.
pub(super) fn columns(photons: &[Photon], kept: &Kept, radius: f32) -> (Voxels, Vec<Pair>) {
    let mut most = [MOST; 3];
    most[kept.axes_by_extent()[2]] = 1;
    Voxels::of_box(photons, kept, radius, most)
}
