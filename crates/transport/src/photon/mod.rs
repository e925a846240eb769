//! Photon maps: light that reaches a surface by mirrors and lenses, found from the light's side.
//!
//! D. Bogolepov, D. Sopin, V. Turlapov 2010, "Simulation of caustics in real time" (photons in a structure of voxels, all within
//! a radius gathered), made physical and progressive; see docs/algorithms/caustics.md.

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
