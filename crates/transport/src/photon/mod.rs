//! Photon maps: light that reaches a surface by mirrors and lenses, found from the light's side.
//!
//! D. Bogolepov, D. Sopin, V. Turlapov 2010, "Simulation of caustics in real time" (photons in a structure of voxels, all within
//! a radius gathered), made physical and progressive; see docs/algorithms/caustics.md.

pub mod bench;
mod direction;
mod kernel;
mod map;
mod search;
#[cfg(test)]
mod tests;

pub use kernel::Kernel;
pub use map::{Near, PhotonMap};
pub use search::SearchKind;

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
