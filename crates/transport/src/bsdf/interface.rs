//! The base interface: microfacets that reflect, and refract into a volume (Walter et al. 2007) or let light straight
//! through a thin wall, blurred like the reflection.

use super::ggx::Ggx;
use super::reflectance::{Reflectance, Split};
use super::{BsdfParams, color, fresnel, mean3, positive, unit};
use vastlight_math::{Vec2, Vec3};

/// Smallest difference of the indices on both sides of a volume's surface that f32 can refract by.
const SMALLEST_STEP: f32 = 2e-3;

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interface {
    pub(crate) ggx: Ggx,
    pub(crate) reflectance: Reflectance,
    /// What light that passes the dielectric is multiplied with before it leaves on the other side.
    pub(crate) transmitted: Vec3,
    ior: f32,
    pub(crate) thin: bool,
    dispersive: bool,
}

/// A direction drawn by [`Interface::sample`].
pub(crate) struct Drawn {
    pub(crate) wi: Vec3,
    /// Share of energy over the probability of the choice, for a mirror-like interface.
    pub(crate) weight: Vec3,
}

impl Interface {
    pub(crate) fn new(p: &BsdfParams) -> Self {
        let transmission = unit(p.transmission) * (1.0 - unit(p.metallic));
        // An infinite index (0) cannot refract: only its reflection is infinite.
        let ior = if p.ior > 0.0 { p.ior.clamp(0.25, 4.0) } else { 1.5 };
        let same = !p.thin && (ior - 1.0).abs() < SMALLEST_STEP;
        let tint = if transmission > 0.0 { positive(p.transmission_tint) } else { Vec3::ZERO };
        Self {
            ggx: Ggx::new(unit(p.roughness), unit(p.anisotropy)),
            reflectance: Reflectance::new(p),
            transmitted: color(p.base_color) * tint * unit(p.transmission),
            ior: if same { 1.0 + SMALLEST_STEP } else { ior },
            thin: p.thin,
            dispersive: p.dispersion > 0.0 && !p.thin,
        }
    }

    /// Whether light passes to the other side.
    pub(crate) fn transmits(&self) -> bool {
        self.transmitted != Vec3::ZERO
    }

    /// Whether the surface bounds a volume: its two sides differ.
    pub(crate) fn refracts(&self) -> bool {
        !self.thin && self.transmits()
    }

    /// Index outside against inside.
    pub(crate) fn ior(&self) -> f32 {
        self.ior
    }

    /// Index of the far side over the near side's.
    pub(crate) fn eta(&self, inside: bool) -> f32 {
        if inside { 1.0 / self.ior } else { self.ior }
    }

    /// `(n_far / n_near)^2` for a direction on the far side of a volume's surface, else 1.
    pub(crate) fn radiance_scale(&self, eta: f32, wi: Vec3) -> f32 {
        if wi.z < 0.0 && !self.thin { eta * eta } else { 1.0 }
    }

    /// Whether a direction depends on the wavelength.
    pub(crate) fn disperses(&self, wi: Vec3) -> bool {
        self.dispersive && wi.z < 0.0
    }

    /// Share of light that a smooth interface lets pass into the dielectric.
    pub(crate) fn passed_to_base(&self, cos: f32, inside: bool) -> f32 {
        let dielectric = 1.0 - self.reflectance.metallic();
        let passed = self.reflectance.at(cos, self.eta(inside)).passed;
        if dielectric > 0.0 { passed / dielectric } else { 0.0 }
    }

    fn shares(&self, cos: f32, eta: f32) -> (Vec3, Vec3) {
        let Split { reflected, passed } = self.reflectance.at(cos, eta);
        (reflected, self.transmitted * passed)
    }

    /// Share of light that a smooth thin wall lets through.
    pub(crate) fn passed_straight(&self, cos: f32, eta: f32) -> Vec3 {
        self.shares(cos, eta).1
    }

    /// Probability of reflection at a microfacet.
    fn choice(reflected: Vec3, transmitted: Vec3) -> f32 {
        let r = mean3(reflected);
        r / (r + mean3(transmitted)).max(f32::MIN_POSITIVE)
    }

    /// `f * cos` and the density of [`Interface::sample`]; `wo.z > 0`.
    pub(crate) fn evaluate(&self, wo: Vec3, wi: Vec3, eta: f32) -> (Vec3, f32) {
        if self.ggx.is_delta() {
            (Vec3::ZERO, 0.0)
        } else if wi.z > 0.0 {
            self.reflect(wo, wi, eta)
        } else if !self.transmits() {
            (Vec3::ZERO, 0.0)
        } else if self.thin {
            self.pass(wo, wi, eta)
        } else {
            self.refract(wo, wi, eta)
        }
    }

    fn reflect(&self, wo: Vec3, wi: Vec3, eta: f32) -> (Vec3, f32) {
        let h = (wo + wi).normalize_or(Vec3::Z);
        let (r, t) = self.shares(wo.dot(h), eta);
        let f = r * (self.ggx.d(h) * self.ggx.visibility(wo, wi) * wi.z);
        (f, 0.25 * self.ggx.visible_density(wo, h) * Self::choice(r, t))
    }

    /// Through a thin wall: the mirror image of the reflection.
    fn pass(&self, wo: Vec3, wi: Vec3, eta: f32) -> (Vec3, f32) {
        let mirrored = Vec3::new(wi.x, wi.y, -wi.z);
        let h = (wo + mirrored).normalize_or(Vec3::Z);
        let (r, t) = self.shares(wo.dot(h), eta);
        let f = t * (self.ggx.d(h) * self.ggx.visibility(wo, mirrored) * mirrored.z);
        (f, 0.25 * self.ggx.visible_density(wo, h) * (1.0 - Self::choice(r, t)))
    }

    fn refract(&self, wo: Vec3, wi: Vec3, eta: f32) -> (Vec3, f32) {
        let h = (wo + wi * eta).normalize_or(Vec3::Z);
        let h = if h.z < 0.0 { -h } else { h };
        let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
        if cos_o <= 0.0 || cos_i >= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (r, t) = self.shares(cos_o, eta);
        let denominator = cos_o + eta * cos_i;
        let jacobian = -cos_i / (denominator * denominator);
        if !jacobian.is_finite() {
            return (Vec3::ZERO, 0.0);
        }
        let f = t * (4.0 * self.ggx.d(h) * self.ggx.visibility(wo, wi) * -wi.z * cos_o * jacobian);
        let density = self.ggx.visible_density(wo, h) * cos_o * jacobian * eta * eta;
        (f, density * (1.0 - Self::choice(r, t)))
    }

    /// A reflected or transmitted direction; `None` where shadowing ends the path. `u_choice` in [0, 1).
    pub(crate) fn sample(&self, wo: Vec3, eta: f32, u_choice: f32, u: Vec2) -> Option<Drawn> {
        let h = if self.ggx.is_delta() { Vec3::Z } else { self.ggx.sample(wo, u) };
        let (r, t) = self.shares(wo.dot(h), eta);
        let choice = Self::choice(r, t);
        let mirror = h * (2.0 * wo.dot(h)) - wo;
        if u_choice < choice {
            return (mirror.z > 0.0).then(|| Drawn { wi: mirror.normalize(), weight: r / choice });
        }
        let weight = t / (1.0 - choice);
        if self.thin {
            let wi = Vec3::new(mirror.x, mirror.y, -mirror.z).normalize();
            return (mirror.z > 0.0 && weight.is_finite()).then_some(Drawn { wi, weight });
        }
        let wi = fresnel::refract(wo, h, eta)?;
        (wi.z < 0.0 && weight.is_finite())
            .then(|| Drawn { wi, weight: weight / self.radiance_scale(eta, wi) })
    }
}
