//! Photon maps on a device: D. Bogolepov, D. Sopin, V. Turlapov 2010, "Simulation of caustics in real time". Photons are sorted by
//! their voxels and gathered around points, as in `vastlight-transport`, `photon`.

pub mod voxels;

use crate::kernel::Kernel;

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 4] = [&voxels::BOUNDS, &voxels::KEYS, &voxels::VOXELS, &voxels::PLACE];
