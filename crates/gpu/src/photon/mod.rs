//! Photon maps on a device: D. Bogolepov, D. Sopin, V. Turlapov 2010, "Simulation of caustics in real time". Photons are sorted by
//! their voxels and gathered around points, as in `vastlight-transport`, `photon`.

pub mod voxels;

use crate::kernel::Kernel;

/// Photons that an invocation looks at, at most: llvmpipe ends loops, without a word, that have turned 65,535 times, all loops of an
/// invocation together.
pub const PHOTONS_AT_ONCE: u32 = 60_000;

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 4] = [&voxels::BOUNDS, &voxels::KEYS, &voxels::VOXELS, &voxels::PLACE];
