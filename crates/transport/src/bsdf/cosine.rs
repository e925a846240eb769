//! Everything that leaves in all directions: diffuse light under the interface, and what single scattering at a rough
//! interface loses because it bounces between microfacets (Kulla and Conty 2017, "Revisiting physically based shading
//! at Imageworks"; the coupling of diffuse and specular goes back to Kelemen and Szirmay-Kalos 2001).
//!
//! Every term has the form `colour * loss(wo) * loss(wi) / (pi * mean loss)`, which is reciprocal and returns exactly
//! what is missing. Terms on the upper and the lower side are drawn by the cosine.

use super::albedo::{Bounce, contrast, tables};
use super::interface::Interface;
use super::{BsdfParams, color, max3, unit};
use std::f32::consts::FRAC_1_PI;
use vastlight_math::Vec3;

/// A mean loss below which there is nothing worth compensating.
const SMALLEST_LOSS: f32 = 2e-3;

/// One side of the interface of a volume, or the only side of everything else.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SideTerms {
    /// Colour under the interface.
    diffuse: Vec3,
    /// One over the mean share of light that reaches the base.
    over_base: f32,
    /// Share of a rough volume's loss that is reflected, and that is transmitted.
    volume_up: f32,
    volume_down: f32,
    /// One over the mean loss of the volume's surface, seen from this side.
    over_volume: f32,
}

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cosine {
    roughness: f32,
    /// Table axis of the reflection's curve, and of the refraction.
    contrast: f32,
    volume_contrast: f32,
    /// The inside is optically rarer than the outside: a bubble.
    rarer: bool,
    /// The dielectric's reflectance at normal incidence and at grazing, largest channel.
    ends: [f32; 2],
    /// Largest channel of the light that the opaque dielectric reflects after several bounces.
    bounced: f32,
    /// Colour of the light that bounced several times: reflected, and passed through a thin wall.
    full_up: Vec3,
    full_down: Vec3,
    /// One over the mean loss of a reflector that absorbs nothing.
    over_full: f32,
    /// Colour of light that passes a volume's surface.
    transmitted: Vec3,
    /// Outside, inside.
    sides: [SideTerms; 2],
    any: bool,
}

/// What the tables say about one direction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Losses {
    /// Lost by a reflector that absorbs nothing.
    pub(crate) full: f32,
    /// Reaches the base below the dielectric.
    base: f32,
    /// Lost at the surface of a volume.
    volume: f32,
    /// See [`Bounce::rise`].
    pub(crate) rise: f32,
}

impl Cosine {
    pub(crate) fn new(p: &BsdfParams, interface: &Interface) -> Self {
        let reflectance = &interface.reflectance;
        let dielectric = 1.0 - reflectance.metallic();
        let transmission = if interface.transmits() { unit(p.transmission) } else { 0.0 };
        let roughness = interface.ggx.mean_roughness();
        let contrast = contrast(reflectance.table_ior(interface.ior()));
        let (f0, f90) = reflectance.dielectric_ends(interface.ior());
        let average = f0 + (f90 - f0) * tables().bounce_average(false, contrast, 0.0).rise;
        let loss = 1.0 - tables().full_average(roughness);
        let compensate = loss > SMALLEST_LOSS;
        let metal = several_bounces(reflectance.metal_average(), loss) * reflectance.metallic();
        let bounced = several_bounces(average, loss);
        let [opaque, wall] = [1.0 - transmission, if interface.thin { 1.0 } else { 0.0 }];
        let mut cosine = Self {
            roughness,
            contrast,
            volume_contrast: super::albedo::contrast(interface.ior()),
            rarer: interface.ior() < 1.0,
            ends: [max3(f0), f90],
            bounced: if compensate { max3(bounced) } else { 0.0 },
            full_up: metal + (bounced * opaque + average * (transmission * wall)) * dielectric,
            full_down: interface.transmitted * (wall * dielectric * (1.0 - max3(average))),
            over_full: if compensate { 1.0 / loss } else { 0.0 },
            transmitted: interface.transmitted * dielectric,
            sides: [SideTerms::default(); 2],
            any: compensate,
        };
        cosine.couple_diffuse(color(p.base_color) * (dielectric * opaque), interface.refracts());
        if interface.refracts() && compensate {
            // The tables know neither films nor stretched highlights: there, what is lost stays lost.
            let plain = if interface.ggx.is_isotropic() { reflectance.plainness() } else { 0.0 };
            cosine.transmitted *= plain;
            cosine.split_volume_loss(interface.ior(), transmission * dielectric * plain);
        }
        cosine
    }

    /// Whether there is diffuse light under the interface.
    pub(crate) fn is_diffuse(&self) -> bool {
        self.sides.iter().any(|side| side.diffuse != Vec3::ZERO)
    }

    fn couple_diffuse(&mut self, diffuse: Vec3, two_sided: bool) {
        self.any |= diffuse != Vec3::ZERO;
        self.sides[0].diffuse = diffuse;
        self.sides[0].over_base = self.over_base_average(false);
        if two_sided {
            self.sides[1].diffuse = diffuse;
            self.sides[1].over_base = self.over_base_average(true);
        }
    }

    /// Shares the losses of a rough volume's surface out between its sides, so that both directions through it agree:
    /// what goes in over the mean loss inside is `ior^2` times what comes out over the mean loss outside.
    fn split_volume_loss(&mut self, ior: f32, weight: f32) {
        let loss = |inside| {
            tables().bounce_average(self.is_dense(inside), self.volume_contrast, self.roughness).loss
        };
        let (outside, inside) = (loss(false), loss(true));
        if outside < 0.1 * SMALLEST_LOSS || inside < 0.1 * SMALLEST_LOSS {
            return;
        }
        let through = 1.0 - self.ends[0];
        let ratio = ior * ior * inside / outside;
        let (enters, leaves) = (through * ratio.min(1.0), through / ratio.max(1.0));
        for (side, share, mean) in [(0, enters, outside), (1, leaves, inside)] {
            self.sides[side].volume_up = weight * (1.0 - share);
            self.sides[side].volume_down = share;
            self.sides[side].over_volume = 1.0 / mean;
        }
    }

    /// Whether a side of the surface is the optically denser one: the tables know outside and inside of glass.
    fn is_dense(&self, inside: bool) -> bool {
        inside != self.rarer
    }

    /// One over the mean share of light that reaches the base; 0 where nothing does.
    fn over_base_average(&self, inside: bool) -> f32 {
        let dense = self.is_dense(inside);
        let rise = tables().bounce_average(dense, self.contrast, self.roughness).rise;
        let full = tables().full_average(self.roughness);
        let average = self.reaches_base(full, rise, dense);
        if average > 1e-3 { 1.0 / average } else { 0.0 }
    }

    /// What the dielectric does not reflect, of a direction whose full albedo and rise are given.
    fn reaches_base(&self, full: f32, rise: f32, dense: bool) -> f32 {
        let [f0, f90] = self.ends;
        // Total internal reflection is total, whatever the strength of the specular reflection.
        let f90 = if dense { 1.0 } else { f90 };
        (1.0 - f0 * (full - rise) - f90 * rise - self.bounced * (1.0 - full)).max(0.0)
    }

    /// Looks up a direction; `inside`: the side it is on.
    pub(crate) fn losses(&self, w: Vec3, inside: bool, interface: &Interface) -> Losses {
        if !self.any {
            return Losses::default();
        }
        let cos = w.z.abs();
        if interface.ggx.is_delta() {
            return self.smooth_losses(cos, inside, interface);
        }
        let roughness = interface.ggx.roughness_from(w);
        let full = tables().full(cos, roughness);
        let dense = self.is_dense(inside);
        let Bounce { rise, mut loss } = tables().bounce(dense, self.contrast, cos, roughness);
        if self.contrast != self.volume_contrast {
            loss = tables().bounce(dense, self.volume_contrast, cos, roughness).loss;
        }
        Losses { full: 1.0 - full, base: self.reaches_base(full, rise, dense), volume: loss, rise }
    }

    /// A smooth interface loses nothing, and what it lets pass is known exactly. (A film's mean comes from a bound, which
    /// must then hold for every direction.)
    fn smooth_losses(&self, cos: f32, inside: bool, interface: &Interface) -> Losses {
        let mut base = interface.passed_to_base(cos, inside);
        if interface.reflectance.has_film() {
            let dense = self.is_dense(inside);
            let rise = tables().bounce(dense, self.contrast, cos, 0.0).rise;
            base = base.min(self.reaches_base(1.0, rise, dense));
        }
        Losses { base, ..Losses::default() }
    }

    /// Energy that goes up and down, of light from a direction on the side `inside`.
    pub(crate) fn shares(&self, out: &Losses, inside: bool) -> (Vec3, Vec3) {
        let side = &self.sides[usize::from(inside)];
        let full = if self.over_full > 0.0 { out.full } else { 0.0 };
        let up = self.full_up * full + side.diffuse * out.base + Vec3::splat(side.volume_up * out.volume);
        (up, self.full_down * full + self.transmitted * (side.volume_down * out.volume))
    }

    /// `f * cos` towards a direction, up or down, without the factor for radiance in a denser medium.
    pub(crate) fn evaluate(&self, out: &Losses, into: &Losses, wi: Vec3, inside: bool) -> Vec3 {
        let side = &self.sides[usize::from(inside)];
        let full = out.full * into.full * self.over_full;
        let volume = out.volume * into.volume;
        let f = if wi.z > 0.0 {
            self.full_up * full
                + side.diffuse * (out.base * into.base * side.over_base)
                + Vec3::splat(side.volume_up * volume * side.over_volume)
        } else {
            let far = &self.sides[usize::from(!inside)];
            self.full_down * full + self.transmitted * (side.volume_down * volume * far.over_volume)
        };
        f * (wi.z.abs() * FRAC_1_PI)
    }

    /// Whether there is anything.
    pub(crate) fn is_some(&self) -> bool {
        self.any
    }
}

/// Share reflected by several bounces between microfacets of this mean reflectance, of the share `loss` that does not
/// leave after one.
fn several_bounces(average: Vec3, loss: f32) -> Vec3 {
    average * average * (1.0 - loss) / (Vec3::ONE - average * loss)
}
