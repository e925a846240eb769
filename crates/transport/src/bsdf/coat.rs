//! The clear coat: a thin layer of varnish with an index of 1.5, its own roughness and its own normal.

use super::albedo::{contrast, tables};
use super::{fresnel, ggx::Ggx, unit};
use vastlight_math::{Frame, Vec2, Vec3};

const IOR: f32 = 1.5;

/// A clear coat over everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coat {
    weight: f32,
    roughness: f32,
    ggx: Ggx,
    normal: Vec3,
}

impl Coat {
    /// `None` for weight 0.
    pub(crate) fn new(weight: f32, roughness: f32, normal: Vec3) -> Option<Self> {
        let (weight, roughness) = (unit(weight), unit(roughness));
        let normal = normal.try_normalize().filter(|n| n.z > 0.0).unwrap_or(Vec3::Z);
        (weight > 0.0).then_some(Self { weight, roughness, ggx: Ggx::new(roughness, 0.0), normal })
    }

    /// The coat as directions see it whose z has been mirrored because they come from the back.
    pub(crate) fn seen_from_behind(self) -> Self {
        Self { normal: Vec3::new(-self.normal.x, -self.normal.y, self.normal.z), ..self }
    }

    pub(crate) fn is_delta(&self) -> bool {
        self.ggx.is_delta()
    }

    pub(crate) fn is_narrow(&self) -> bool {
        self.ggx.is_narrow()
    }

    /// Share of the light of this direction that the coat reflects.
    pub(crate) fn reflected(&self, w: Vec3) -> f32 {
        let cos = w.dot(self.normal).abs();
        if self.is_delta() {
            return self.weight * fresnel::dielectric(cos, IOR);
        }
        let f0 = fresnel::dielectric_f0(IOR);
        let full = tables().full(cos, self.roughness);
        let rise = tables().bounce(false, contrast(IOR), cos, self.roughness).rise;
        self.weight * (f0 * (full - rise) + rise)
    }

    /// `f * cos` and the density of [`Coat::sample`], for directions above the surface.
    pub(crate) fn evaluate(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let (wo, wi) = (self.to_coat(wo), self.to_coat(wi));
        if self.is_delta() || wo.z <= 0.0 || wi.z <= 0.0 {
            return (0.0, 0.0);
        }
        let h = (wo + wi).normalize_or(Vec3::Z);
        let f = self.weight * fresnel::dielectric(wo.dot(h), IOR);
        (f * self.ggx.d(h) * self.ggx.visibility(wo, wi) * wi.z, 0.25 * self.ggx.visible_density(wo, h))
    }

    /// A reflected direction; for a smooth coat the mirror direction. May point below the surface.
    pub(crate) fn sample(&self, wo: Vec3, u: Vec2) -> Option<Vec3> {
        let local = self.to_coat(wo);
        if local.z <= 0.0 {
            return None;
        }
        let h = if self.is_delta() { Vec3::Z } else { self.ggx.sample(local, u) };
        let wi = h * (2.0 * local.dot(h)) - local;
        if self.normal == Vec3::Z { Some(wi) } else { Some(Frame::from_z(self.normal).to_outer(wi)) }
    }

    fn to_coat(self, w: Vec3) -> Vec3 {
        if self.normal == Vec3::Z { w } else { Frame::from_z(self.normal).to_local(w) }
    }
}
