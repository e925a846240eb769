//! The published structure on a device, sections 2.3 and 2.4: photons in the order of their voxels, by a stable sort, and for each voxel
//! its first photon and the one behind its last.
//!
//! The grid is the CPU's: the host makes it from the photons' box, so that voxels are the same to the bit.

use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::radix::{self, Pairs};
use crate::primitives::tiles;
use crate::recording::{Buffer, Groups, Recording};
use vastlight_math::{Aabb, Vec3};
use vastlight_transport::photon::{Kernel as Weight, PHOTON_WORDS, VoxelGrid};

/// Words of what [`record_bounds`] gives.
pub const BOUNDS_WORDS: u64 = 7;

device_struct! {
    struct CountParameters as "Parameters" { count }
}
device_struct! {
    struct KeysParameters as "Parameters" { count, cells }
}
kernel!(pub(crate) BOUNDS = "photon_bounds", CountParameters, 2);
kernel!(pub(crate) KEYS = "photon_keys", KeysParameters, 4);
kernel!(pub(crate) VOXELS = "photon_voxels", CountParameters, 2);
kernel!(pub(crate) PLACE = "photon_place", CountParameters, 3);

/// What has to be known of photons before they are sorted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The box of those whose place and power are numbers, world units.
    pub bounds: Aabb,
    /// How many these are.
    pub kept: u32,
}

impl Bounds {
    /// From the words that [`record_bounds`] gave.
    #[must_use]
    pub fn from_words(words: &[u32]) -> Self {
        let word = |at: usize| words.get(at).copied().unwrap_or(0);
        let kept = word(6);
        if kept == 0 {
            return Self { bounds: Aabb::EMPTY, kept };
        }
        let corner = |at| Vec3::from([at, at + 1, at + 2].map(|at| coordinate(word(at))));
        Self { bounds: Aabb { min: corner(0), max: corner(3) }, kept }
    }
}

/// The number behind a word whose order is that of numbers: see `boxes.wgsl`.
fn coordinate(word: u32) -> f32 {
    f32::from_bits(if word >> 31 == 0 { !word } else { word ^ 1 << 31 })
}

/// Records the box of the first `count` photons and how many of them are kept: [`BOUNDS_WORDS`] words.
#[must_use]
pub fn record_bounds(recording: &mut Recording, photons: Buffer, count: u32) -> Buffer {
    let bounds = recording.upload("bounds of photons", &[u32::MAX, u32::MAX, u32::MAX, 0, 0, 0, 0]);
    let groups = Groups::Direct(tiles(count).max(1));
    recording.dispatch(&BOUNDS, &CountParameters { count }, &[photons, bounds], groups);
    bounds
}

/// Photons in the order of their voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotonIndex {
    /// The grid's header, then photons: [`map_words`] words.
    pub map: Buffer,
    /// The first photon of each voxel and the one behind its last; 0 and 0 where there is none: [`voxel_words`] words.
    pub voxels: Buffer,
}

/// Words of a map of so many photons.
#[must_use]
pub const fn map_words(photons: u32) -> u64 {
    VoxelGrid::WORDS as u64 + PHOTON_WORDS as u64 * photons as u64
}

/// Words of the voxels of a grid.
#[must_use]
pub fn voxel_words(grid: &VoxelGrid) -> u64 {
    2 * u64::from(grid.cells())
}

/// Photons to be sorted.
#[derive(Clone, Copy, Debug)]
pub struct Unsorted {
    /// The photons, [`PHOTON_WORDS`] words each.
    pub photons: Buffer,
    /// How many they are, and how many of them are kept.
    pub count: u32,
    /// See [`Bounds::kept`].
    pub kept: u32,
}

/// Records sorting photons into an index. Gives the numbers of the photons in their new order.
///
/// # Errors
/// There are too many photons.
pub fn record(
    recording: &mut Recording,
    unsorted: Unsorted,
    (grid, weight): (&VoxelGrid, Weight),
    index: PhotonIndex,
) -> Result<Buffer, GpuError> {
    let Unsorted { photons, count, kept } = unsorted;
    recording.write(index.map, bytemuck::cast_slice(&grid.words(weight)).to_vec());
    let keys = recording.buffer("voxels of photons", count.into());
    let numbers = recording.buffer("numbers of photons", count.into());
    let all = Groups::Direct(tiles(count).max(1));
    let parameters = KeysParameters { count, cells: grid.cells() };
    recording.dispatch(&KEYS, &parameters, &[photons, index.map, keys, numbers], all);
    let pairs = Pairs { keys, payloads: Some(numbers) };
    let sorted = radix::record(recording, pairs, count, grid.key_bits())?;
    let order = sorted.payloads.unwrap_or(numbers);
    recording.clear(index.voxels);
    let (parameters, those_kept) = (CountParameters { count: kept }, Groups::Direct(tiles(kept).max(1)));
    recording.dispatch(&VOXELS, &parameters, &[sorted.keys, index.voxels], those_kept);
    recording.dispatch(&PLACE, &parameters, &[photons, order, index.map], those_kept);
    Ok(order)
}
