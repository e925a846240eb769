//! Sorting photons by voxels.

use crate::error::GpuError;
use crate::photon::voxels::{self, BOUNDS_WORDS, Bounds, PhotonIndex, Unsorted};
use crate::recording::{Recording, Resident};
use crate::run::Executor;
use std::time::Instant;
use vastlight_transport::photon::{Kernel, Photon, VoxelGrid};

/// The times of sorting photons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexFigures {
    /// Best time in milliseconds, from photons on the device to their index there, the box's way to the host included.
    pub ms: f64,
    /// Dispatches.
    pub dispatches: usize,
    /// Photons that are kept.
    pub kept: u32,
    /// Voxels.
    pub voxels: u32,
    /// Memory of photons, keys and index, without what the sort needs.
    pub bytes: u64,
}

/// Sorts photons for a radius, m, and finds their voxels, `repeat` times (at least once) after a first time.
///
/// # Errors
/// There are too many for the device, or it fails.
pub fn index(
    executor: &mut Executor,
    photons: &[Photon],
    radius: f32,
    repeat: u32,
) -> Result<IndexFigures, GpuError> {
    let words: Vec<u32> = photons.iter().flat_map(Photon::words).collect();
    let count = u32::try_from(photons.len()).unwrap_or(u32::MAX);
    let unsorted = executor.keep("photons", &words)?;
    let mut figures = once(executor, unsorted, (count, radius));
    for _ in 0..repeat.max(1) {
        let (best, next) = (figures, once(executor, unsorted, (count, radius)));
        figures = best.and_then(|best| next.map(|next| IndexFigures { ms: next.ms.min(best.ms), ..next }));
    }
    executor.release(unsorted);
    figures
}

fn once(
    executor: &mut Executor,
    unsorted: Resident,
    (count, radius): (u32, f32),
) -> Result<IndexFigures, GpuError> {
    let start = Instant::now();
    let mut first = Recording::new();
    let photons = first.resident("photons", unsorted);
    let bounds = voxels::record_bounds(&mut first, photons, count);
    let bounds = first.download(bounds, BOUNDS_WORDS);
    let Bounds { bounds, kept } = Bounds::from_words(&executor.run(&first)?.words(bounds));
    let (weight, numbers) = (Kernel::default(), [kept, count - kept].map(|number| number as usize));
    let grid = VoxelGrid::new(bounds, numbers, radius, weight);
    let mut second = Recording::new();
    let photons = second.resident("photons", unsorted);
    let index = PhotonIndex {
        map: second.buffer("photons in order", voxels::map_words(kept)),
        voxels: second.buffer("voxels", voxels::voxel_words(&grid)),
    };
    voxels::record(&mut second, Unsorted { photons, count, kept }, (&grid, weight), index)?;
    executor.run(&second)?;
    let ms = start.elapsed().as_secs_f64() * 1e3;
    let words = voxels::map_words(kept) + voxels::voxel_words(&grid) + 2 * u64::from(count);
    let dispatches = first.dispatches() + second.dispatches();
    Ok(IndexFigures { ms, dispatches, kept, voxels: grid.cells(), bytes: unsorted.bytes + 4 * words })
}
