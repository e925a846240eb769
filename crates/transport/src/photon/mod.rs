//! Photon maps: light that reaches a surface by mirrors and lenses, found from the light's side.
//!
//! D. Bogolepov, D. Sopin, V. Turlapov 2010, "Simulation of caustics in real time" (photons in a structure of voxels, all within
//! a radius gathered), made physical and progressive; see docs/algorithms/caustics.md.

pub mod bench;
mod cells;
mod density;
mod direction;
mod flight;
mod gather;
mod guide;
mod kernel;
mod map;
mod pass;
mod plan;
mod rectangle;
mod search;
mod seen;
#[cfg(test)]
mod tests;

pub(crate) use flight::receives;
pub(crate) use gather::{Gather, InPixel};
pub use kernel::Kernel;
pub use map::{Near, PHOTON_WORDS, PhotonMap};
pub use plan::{GridPass, PhotonPlan};
pub use search::{SearchKind, VoxelGrid};

use vastlight_math::Vec3;

/// Light that arrived at a surface after mirrors and lenses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where it arrived, world space.
    pub position: Vec3,
    /// Power that arrived, W.
    pub flux: Vec3,
    /// Unit vector to where it came from.
    pub from: Vec3,
    /// Unit geometric normal of the surface, on the side that the light came from.
    pub normal: Vec3,
    /// Segments of its way from the light.
    pub segments: u32,
}

impl Photon {
    /// Whether its place and its power are numbers.
    #[inline]
    fn is_finite(&self) -> bool {
        self.position.is_finite() && self.flux.is_finite()
    }
}

/// The photons of a pass, a map for each radius.
#[derive(Debug, Default)]
pub struct PhotonMaps(Vec<PhotonMap>);

impl PhotonMaps {
    /// The maps, from the widest radius on.
    #[must_use]
    pub fn maps(&self) -> &[PhotonMap] {
        &self.0
    }
}

/// How photons are sent and gathered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonSettings {
    /// How many are sent in each pass; none for a quarter of the picture's pixels, within bounds.
    pub photons: Option<u32>,
    /// Sends them by a regular grid of so many columns and rows from a point or spot light, and from nothing else, as published; more
    /// such lights share the number. Where there is none, as without a grid.
    pub grid: Option<[u32; 2]>,
    /// The one radius of the first pass, as a part of the scene's longest edge; none for radii by the photons' density.
    pub radius: Option<f32>,
    /// How photons are found.
    pub search: SearchKind,
    /// How they count by distance.
    pub weight: Kernel,
}

impl PhotonSettings {
    /// Photons of a pass for a picture of so many pixels; by a grid, its squares.
    #[must_use]
    pub fn count(&self, pixels: u64) -> u32 {
        match self.grid {
            Some([columns, rows]) => columns.saturating_mul(rows),
            // Their work is a part of the paths' work.
            None => self.photons.unwrap_or((pixels / 4).clamp(1 << 16, 1 << 20) as u32),
        }
    }
}
