//! The general material: a microfacet interface (metal or dielectric) over a diffuse or transmitting base.

use super::ggx::Ggx;
use super::{BsdfParams, BsdfSample, color, fresnel, unit};
use std::f32::consts::FRAC_1_PI;
use vastlight_math::{Vec2, Vec3, warp};
use vastlight_scene::Conductor;

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layered {
    base_color: Vec3,
    metallic: f32,
    conductor: Option<Conductor>,
    ggx: Ggx,
    ior: f32,
    f0: Vec3,
    f90: f32,
    transmission: f32,
    tint: Vec3,
    thin: bool,
    dispersive: bool,
}

/// Directions on the side of `wo`.
#[derive(Clone, Copy)]
struct Side {
    wo: Vec3,
    flip: f32,
    eta: f32,
}

impl Layered {
    pub(crate) fn new(p: &BsdfParams) -> Self {
        let ior = p.ior.clamp(1.0, 4.0);
        let f0 = (fresnel::dielectric_f0(ior) * p.specular_color).min(Vec3::ONE) * unit(p.specular);
        Self {
            base_color: color(p.base_color),
            metallic: unit(p.metallic),
            conductor: p.conductor,
            ggx: Ggx::new(unit(p.roughness), unit(p.anisotropy)),
            ior,
            f0,
            f90: unit(p.specular),
            transmission: unit(p.transmission),
            tint: p.transmission_tint,
            thin: p.thin || ior < 1.002,
            dispersive: p.dispersion > 0.0,
        }
    }

    fn side(&self, wo: Vec3) -> Side {
        let inside = wo.z < 0.0 && self.transmission > 0.0 && !self.thin;
        let flip = if wo.z < 0.0 { -1.0 } else { 1.0 };
        let eta = if inside { 1.0 / self.ior } else { self.ior };
        Side { wo: Vec3::new(wo.x, wo.y, wo.z * flip), flip, eta }
    }

    fn reflectance(&self, cos: f32, eta: f32) -> (Vec3, Vec3) {
        let metal = match &self.conductor {
            Some(c) => fresnel::conductor(cos, c),
            None => self.base_color + (Vec3::ONE - self.base_color) * fresnel::schlick_weight(cos),
        };
        let real = fresnel::dielectric(cos, eta);
        let f0 = fresnel::dielectric_f0(eta);
        let s = ((real - f0) / (1.0 - f0)).max(0.0);
        let dielectric = if real >= 1.0 { Vec3::ONE } else { self.f0 + (self.f90 - self.f0) * s };
        (metal * self.metallic, dielectric * (1.0 - self.metallic))
    }

    /// Reflected share, transmitted share, diffuse share at a cosine.
    fn shares(&self, cos: f32, eta: f32) -> (Vec3, Vec3, f32) {
        let (metal, dielectric) = self.reflectance(cos, eta);
        let rest = (1.0 - self.metallic) - dielectric.max_element();
        let rest = rest.max(0.0);
        (
            metal + dielectric,
            self.base_color * self.tint * rest * self.transmission,
            rest * (1.0 - self.transmission),
        )
    }

    /// Probabilities of the interface and of the diffuse lobe.
    fn probabilities(&self, side: &Side) -> (f32, f32) {
        let (r, t, d) = self.shares(side.wo.z, side.eta);
        let interface = mean(r) + mean(t);
        let diffuse = mean(self.base_color) * d;
        let sum = interface + diffuse;
        if sum > 0.0 { (interface / sum, diffuse / sum) } else { (0.0, 0.0) }
    }

    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let side = self.side(wo);
        self.eval_oriented(&side, Vec3::new(wi.x, wi.y, wi.z * side.flip))
    }

    fn eval_oriented(&self, side: &Side, wi: Vec3) -> (Vec3, f32) {
        let wo = side.wo;
        if wo.z <= 0.0 || wi.z == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (p_interface, p_diffuse) = self.probabilities(side);
        let (mut f, mut pdf) = (Vec3::ZERO, 0.0);
        if wi.z > 0.0 && p_diffuse > 0.0 {
            let (_, _, d) = self.shares(side.wo.z, side.eta);
            f += self.base_color * (d * wi.z * FRAC_1_PI);
            pdf += p_diffuse * warp::cosine_hemisphere_pdf(wi.z);
        }
        if p_interface > 0.0 && !self.ggx.is_delta() {
            let (fi, pi) = if wi.z > 0.0 || self.thin {
                self.eval_reflection(side, wi)
            } else {
                self.eval_refraction(side, wi)
            };
            f += fi;
            pdf += p_interface * pi;
        }
        (f, pdf)
    }

    /// Reflection, or its mirror image behind a thin wall.
    fn eval_reflection(&self, side: &Side, wi: Vec3) -> (Vec3, f32) {
        let mirrored = Vec3::new(wi.x, wi.y, wi.z.abs());
        let h = (side.wo + mirrored).normalize_or(Vec3::Z);
        let (r, t, _) = self.shares(side.wo.dot(h), side.eta);
        let (share, other) = if wi.z > 0.0 { (r, t) } else { (t, r) };
        let f = share * (self.ggx.d(h) * self.ggx.visibility(side.wo, mirrored) * mirrored.z);
        let choice = mean(share) / (mean(share) + mean(other)).max(f32::MIN_POSITIVE);
        (f, 0.25 * self.ggx.visible_density(side.wo, h) * choice)
    }

    fn eval_refraction(&self, side: &Side, wi: Vec3) -> (Vec3, f32) {
        let (wo, eta) = (side.wo, side.eta);
        let h = wo + wi * eta;
        let h = (h * -1.0_f32.copysign(-h.z)).normalize_or(Vec3::Z);
        let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
        if cos_o <= 0.0 || cos_i >= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (r, t, _) = self.shares(cos_o, eta);
        let denominator = cos_o + eta * cos_i;
        let jacobian = -cos_i / (denominator * denominator);
        let f = t * (4.0 * self.ggx.d(h) * self.ggx.visibility(wo, wi) * wi.z.abs() * cos_o * jacobian);
        let choice = mean(t) / (mean(t) + mean(r)).max(f32::MIN_POSITIVE);
        (f, self.ggx.visible_density(wo, h) * cos_o * jacobian * eta * eta * choice)
    }

    pub(crate) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let side = self.side(wo);
        let (p_interface, p_diffuse) = self.probabilities(&side);
        if side.wo.z <= 0.0 || p_interface + p_diffuse <= 0.0 {
            return None;
        }
        if u_lobe >= p_interface {
            return self.finish(&side, warp::cosine_hemisphere(u));
        }
        let u_choice = u_lobe / p_interface;
        let delta = self.ggx.is_delta();
        let h = if delta { Vec3::Z } else { self.ggx.sample(side.wo, u) };
        let (r, t, _) = self.shares(side.wo.dot(h), side.eta);
        let choice = mean(r) / (mean(r) + mean(t));
        let reflected = h * (2.0 * side.wo.dot(h)) - side.wo;
        let (wi, share, probability) = if u_choice < choice {
            (reflected, r, choice)
        } else if self.thin {
            (Vec3::new(reflected.x, reflected.y, -reflected.z), t, 1.0 - choice)
        } else {
            (fresnel::refract(side.wo, h, side.eta)?, t, 1.0 - choice)
        };
        if reflected.z <= 0.0 && (u_choice < choice || self.thin) {
            return None;
        }
        if !delta {
            return self.finish(&side, wi);
        }
        let scale = self.radiance_scale(&side, wi);
        Some(BsdfSample {
            wi: Vec3::new(wi.x, wi.y, wi.z * side.flip),
            weight: share / (probability * p_interface * scale),
            pdf: 0.0,
            delta: true,
            transmitted: wi.z < 0.0,
            radiance_scale: scale,
            dispersed: self.disperses(wi),
        })
    }

    fn radiance_scale(&self, side: &Side, wi: Vec3) -> f32 {
        if wi.z < 0.0 && !self.thin { side.eta * side.eta } else { 1.0 }
    }

    fn disperses(&self, wi: Vec3) -> bool {
        wi.z < 0.0 && self.dispersive && !self.thin
    }

    fn finish(&self, side: &Side, wi: Vec3) -> Option<BsdfSample> {
        let (f, pdf) = self.eval_oriented(side, wi);
        if pdf <= 0.0 || !pdf.is_finite() {
            return None;
        }
        Some(BsdfSample {
            wi: Vec3::new(wi.x, wi.y, wi.z * side.flip),
            weight: f / pdf,
            pdf,
            delta: false,
            transmitted: wi.z < 0.0,
            radiance_scale: self.radiance_scale(side, wi),
            dispersed: self.disperses(wi),
        })
    }

    pub(crate) fn albedo(&self) -> Vec3 {
        self.base_color
    }

    pub(crate) fn has_nondelta(&self) -> bool {
        !self.ggx.is_delta() || (self.metallic < 1.0 && self.transmission < 1.0)
    }

    pub(crate) fn transmits(&self) -> bool {
        self.transmission > 0.0 && self.metallic < 1.0 && !self.ggx.is_delta()
    }
}

fn mean(c: Vec3) -> f32 {
    (c.x + c.y + c.z) * (1.0 / 3.0)
}
