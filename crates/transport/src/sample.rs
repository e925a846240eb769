//! What one sample of one pixel is, and who receives it.

use vastlight_math::Vec3;
use vastlight_trace::Hit;

/// The result of one path: radiance, and what its first surface was.
///
/// Where the camera ray leaves the scene, everything but `radiance` is zero and the ids are [`Hit::NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Radiance, W/(sr m^2) per linear Rec. 709 channel. Always finite.
    pub radiance: Vec3,
    /// Directional albedo of the first surface, 0..1.
    pub albedo: Vec3,
    /// Shading normal of the first surface in world space, on the side of the camera.
    pub normal: Vec3,
    /// Position of the first hit in world space.
    pub position: Vec3,
    /// Distance of the first hit from the camera's plane, along its viewing axis, in scene units.
    pub depth: f32,
    /// 1 where the camera ray met a surface, else 0.
    pub coverage: f32,
    /// Instance of the first hit, or [`Hit::NONE`].
    pub object: u32,
    /// Material of the first hit, or [`Hit::NONE`].
    pub material: u32,
}

impl Sample {
    /// A camera ray that met nothing, without radiance.
    pub const MISS: Self = Self {
        radiance: Vec3::ZERO,
        albedo: Vec3::ZERO,
        normal: Vec3::ZERO,
        position: Vec3::ZERO,
        depth: 0.0,
        coverage: 0.0,
        object: Hit::NONE,
        material: Hit::NONE,
    };

    /// Whether every number of the sample is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.radiance.is_finite()
            && self.albedo.is_finite()
            && self.normal.is_finite()
            && self.position.is_finite()
            && self.depth.is_finite()
    }
}

/// Receives samples. The renderer calls it in a fixed order: pixel by pixel in rows, the samples of a pixel ascending.
pub trait SampleSink {
    /// Adds a finite sample of the pixel at column `pixel[0]` and row `pixel[1]`, rows from the top.
    fn add(&mut self, pixel: [u32; 2], sample: &Sample);
}

impl<F: FnMut([u32; 2], &Sample)> SampleSink for F {
    fn add(&mut self, pixel: [u32; 2], sample: &Sample) {
        self(pixel, sample);
    }
}

/// What a piece of rendering cost, and what went wrong in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderStats {
    /// Samples finished, dropped ones included.
    pub samples: u64,
    /// Samples that were not finite; they were dropped and no sink saw them.
    pub non_finite: u64,
    /// Closest-hit rays.
    pub rays: u64,
    /// Occlusion rays.
    pub shadow_rays: u64,
    /// Nanoseconds of lookups in textures in tiles, all threads together, with the time that they waited for tiles.
    pub tile_ns: u64,
}

impl std::ops::AddAssign for RenderStats {
    fn add_assign(&mut self, other: Self) {
        self.samples += other.samples;
        self.non_finite += other.non_finite;
        self.rays += other.rays;
        self.shadow_rays += other.shadow_rays;
        self.tile_ns += other.tile_ns;
    }
}
