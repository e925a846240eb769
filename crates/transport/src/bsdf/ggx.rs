//! The anisotropic GGX (Trowbridge-Reitz) distribution with height-correlated Smith shadowing (Heitz 2014).
//!
//! Visible normals are sampled with spherical caps (Dupuy and Benyoub 2023). All directions are in the local frame
//! with `z >= 0` on the side that the distribution is seen from, x along the first axis of roughness.

use std::f32::consts::{PI, TAU};
use vastlight_math::{Vec2, Vec3, real};

/// Below this width the lobe is treated as a mirror: f32 could not resolve it.
const SMALLEST_ALPHA: f32 = 1e-3;

/// Up to this width a lobe focuses light: what goes on in it is followed from the light's side where photons are wanted.
const NARROW_ALPHA: f32 = 0.1;

/// Widths of the distribution of microfacet slopes along x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ggx {
    ax: f32,
    ay: f32,
}

impl Ggx {
    /// From perceptual roughness and KHR_materials_anisotropy's strength, both in [0, 1].
    pub(crate) fn new(roughness: f32, anisotropy: f32) -> Self {
        let alpha = roughness * roughness;
        let ax = alpha + (1.0 - alpha) * anisotropy * anisotropy;
        Self { ax: ax.max(SMALLEST_ALPHA), ay: alpha.max(SMALLEST_ALPHA) }
    }

    /// Whether both widths are so small that the surface is a mirror.
    pub(crate) fn is_delta(&self) -> bool {
        self.ax <= SMALLEST_ALPHA && self.ay <= SMALLEST_ALPHA
    }

    /// Whether light leaves so close to the mirror direction that it forms caustics.
    pub(crate) fn is_narrow(&self) -> bool {
        self.ax <= NARROW_ALPHA && self.ay <= NARROW_ALPHA
    }

    /// Whether both widths are equal.
    pub(crate) fn is_isotropic(&self) -> bool {
        self.ax == self.ay
    }

    /// Density of microfacet normals `h`, per steradian of h and per unit of macroscopic area.
    pub(crate) fn d(&self, h: Vec3) -> f32 {
        let (x, y) = (h.x / self.ax, h.y / self.ay);
        let t = x * x + y * y + h.z * h.z;
        1.0 / (PI * self.ax * self.ay * t * t)
    }

    /// `sqrt(z^2 + ax^2 x^2 + ay^2 y^2)`: with it, Smith's Lambda is `(stretch / z - 1) / 2`.
    fn stretch(&self, w: Vec3) -> f32 {
        let (x, y) = (w.x * self.ax, w.y * self.ay);
        (w.z * w.z + x * x + y * y).sqrt()
    }

    /// Masking and shadowing over the cosines: `G2(wo, wi) / (4 |cos wo| |cos wi|)`.
    pub(crate) fn visibility(&self, wo: Vec3, wi: Vec3) -> f32 {
        let sum = wi.z.abs() * self.stretch(wo) + wo.z.abs() * self.stretch(wi);
        0.5 / sum.max(f32::MIN_POSITIVE)
    }

    /// Share of the light reflected or refracted from a visible microfacet towards `wi` that leaves the surface: G2 / G1.
    pub(crate) fn unshadowed(&self, wo: Vec3, wi: Vec3) -> f32 {
        2.0 * self.visibility(wo, wi) * wi.z.abs() * (wo.z.abs() + self.stretch(wo))
    }

    /// Perceptual roughness of the isotropic surface that loses about as much light between its microfacets, averaged
    /// over directions.
    pub(crate) fn mean_roughness(&self) -> f32 {
        (0.5 * (self.ax * self.ax + self.ay * self.ay)).sqrt().sqrt()
    }

    /// [`Ggx::mean_roughness`] as seen from one direction: our fit to the albedo of stretched distributions. Near grazing
    /// more is lost across the rough axis, from above a little more along it.
    pub(crate) fn roughness_from(&self, w: Vec3) -> f32 {
        let across = w.x * w.x + w.y * w.y;
        if self.ax == self.ay || across < 1e-12 {
            return self.mean_roughness();
        }
        let mean = 0.5 * (self.ax * self.ax + self.ay * self.ay);
        let half = 0.5 * (self.ax * self.ax - self.ay * self.ay);
        let turn = (w.x * w.x - w.y * w.y) / across;
        let strength = (0.45 * mean.sqrt() / w.z.abs().max(1e-3) - 0.3).clamp(-0.3, 1.0);
        let smallest = self.ax.min(self.ay).powi(2);
        (mean - strength * turn * half).max(smallest).sqrt().sqrt()
    }

    /// Density of [`Ggx::sample`] at `h`, per steradian of h, divided by `|wo . h|`.
    pub(crate) fn visible_density(&self, wo: Vec3, h: Vec3) -> f32 {
        2.0 * self.d(h) / (wo.z.abs() + self.stretch(wo)).max(f32::MIN_POSITIVE)
    }

    /// A microfacet normal as seen from `wo` (`wo.z >= 0`).
    pub(crate) fn sample(&self, wo: Vec3, u: Vec2) -> Vec3 {
        let scale = Vec3::new(self.ax, self.ay, 1.0);
        let wo = (wo * scale).normalize_or(Vec3::Z);
        let z = (1.0 - u.y) * (1.0 + wo.z) - wo.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = real::sin_cos(TAU * u.x);
        let h = Vec3::new(r * cos, r * sin, z) + wo;
        (h * scale).normalize_or(Vec3::Z)
    }
}
