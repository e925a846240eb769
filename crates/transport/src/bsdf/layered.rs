//! The general material, from the top: clear coat, sheen, interface, and what leaves in all directions below it.
//!
//! A layer lets pass what it does not reflect, the smaller of the shares of both directions: reciprocal, and never
//! more than it received. One lobe is chosen by its estimated albedo; the density is that of the mixture.

use super::coat::Coat;
use super::cosine::{Cosine, Losses};
use super::interface::Interface;
use super::sheen::Sheen;
use super::{BsdfDraw, BsdfParams, BsdfSample, color, mean3, unit};
use vastlight_math::{Vec2, Vec3, warp};

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layered {
    interface: Interface,
    cosine: Cosine,
    coat: Option<Coat>,
    sheen: Option<Sheen>,
    /// The local x axis seen from the highlight's own axes: cosine and sine of its rotation.
    rotation: Vec2,
    albedo: Vec3,
}

/// Probabilities of the lobes; they sum to 1.
#[derive(Clone, Copy, Default)]
struct Chances {
    coat: f32,
    sheen: f32,
    interface: f32,
    up: f32,
    down: f32,
}

/// The side that `wo` is on, and what depends on `wo` alone.
struct Outgoing {
    /// In the highlight's axes, with `z > 0`.
    wo: Vec3,
    mirrored: bool,
    /// In the volume; everything else is outside, whichever side it is seen from.
    inside: bool,
    eta: f32,
    coat: Option<Coat>,
    losses: Losses,
    passed: Passed,
    chances: Chances,
}

/// Shares of light that coat and sheen let pass.
#[derive(Clone, Copy)]
struct Passed {
    coat: f32,
    sheen: f32,
}

impl Layered {
    pub(crate) fn new(p: &BsdfParams) -> Self {
        let interface = Interface::new(p);
        let rotation =
            if p.anisotropy > 0.0 { p.anisotropy_direction.normalize_or(Vec2::X) } else { Vec2::X };
        let (metal, dielectric) = interface.reflectance.normal();
        let metallic = interface.reflectance.metallic();
        Self {
            interface,
            cosine: Cosine::new(p, &interface),
            coat: Coat::new(p.clearcoat, p.clearcoat_roughness, rotate(rotation, p.clearcoat_normal)),
            sheen: Sheen::new(p.sheen_color, p.sheen_roughness),
            rotation,
            albedo: color((color(p.base_color) + dielectric).lerp(metal, metallic)),
        }
    }

    fn outgoing(&self, wo: Vec3) -> Option<Outgoing> {
        if wo.z == 0.0 || !wo.is_finite() {
            return None;
        }
        let mirrored = wo.z < 0.0;
        let inside = mirrored && self.interface.refracts();
        let coat = if mirrored { self.coat.map(Coat::seen_from_behind) } else { self.coat };
        let local = self.local(wo, mirrored);
        let mut out = Outgoing {
            wo: local,
            mirrored,
            inside,
            eta: self.interface.eta(inside),
            coat,
            losses: self.cosine.losses(local, inside, &self.interface),
            passed: Passed { coat: 1.0, sheen: 1.0 },
            chances: Chances::default(),
        };
        out.passed = self.passed(&out, local);
        out.chances = self.chances(&out);
        Some(out)
    }

    fn local(&self, w: Vec3, mirrored: bool) -> Vec3 {
        let w = rotate(self.rotation, w);
        if mirrored { Vec3::new(w.x, w.y, -w.z) } else { w }
    }

    fn outer(&self, w: Vec3, mirrored: bool) -> Vec3 {
        let w = if mirrored { Vec3::new(w.x, w.y, -w.z) } else { w };
        rotate(Vec2::new(self.rotation.x, -self.rotation.y), w)
    }

    /// What coat and sheen let pass for a direction: they lie on the outside of a volume, and on both sides of a wall.
    fn passed(&self, out: &Outgoing, w: Vec3) -> Passed {
        let covered = if self.interface.refracts() { (w.z < 0.0) == out.inside } else { true };
        if !covered {
            return Passed { coat: 1.0, sheen: 1.0 };
        }
        Passed {
            coat: out.coat.map_or(1.0, |c| 1.0 - c.reflected(w)),
            sheen: self.sheen.map_or(1.0, |s| s.passed(w.z.abs())),
        }
    }

    fn chances(&self, out: &Outgoing) -> Chances {
        let covered = !out.inside;
        let coat = if covered { 1.0 - out.passed.coat } else { 0.0 };
        let sheen = match &self.sheen {
            Some(sheen) if covered => out.passed.coat * mean3(sheen.reflected(out.wo.z)),
            _ => 0.0,
        };
        let base = out.passed.coat * out.passed.sheen;
        let (up, down) = self.cosine.shares(&out.losses, out.inside);
        let chances = Chances {
            coat,
            sheen,
            interface: base * self.interface_share(out),
            up: base * mean3(up),
            down: base * mean3(down),
        };
        chances.normalized()
    }

    /// Estimated share of light that the interface reflects or transmits after one bounce.
    fn interface_share(&self, out: &Outgoing) -> f32 {
        let at = self.interface.reflectance.at(out.wo.z, out.eta);
        let mirror = mean3(at.reflected) + mean3(self.interface.transmitted) * at.passed;
        if self.interface.ggx.is_delta() || !self.cosine.is_some() || self.interface.reflectance.has_film() {
            return mirror;
        }
        // A rough interface has microfacets that face the light: less Fresnel rise than a mirror at grazing angles.
        let Losses { full, rise, .. } = out.losses;
        let metallic = self.interface.reflectance.metallic();
        let (metal, dielectric) = self.interface.reflectance.normal();
        let reflected = |f0: Vec3, f90: f32| mean3(f0) * (1.0 - full - rise) + f90 * rise;
        let dielectric = reflected(dielectric, self.interface.reflectance.grazing());
        let passed = (1.0 - full - dielectric).max(0.0) * mean3(self.interface.transmitted);
        metallic * reflected(metal, 1.0) + (1.0 - metallic) * (dielectric + passed)
    }

    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        match self.outgoing(wo) {
            Some(out) => self.evaluate(&out, self.local(wi, out.mirrored)),
            None => (Vec3::ZERO, 0.0),
        }
    }

    fn evaluate(&self, out: &Outgoing, wi: Vec3) -> (Vec3, f32) {
        if wi.z == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (mut f, pdf) = self.interface.evaluate(out.wo, wi, out.eta);
        let mut pdf = pdf * out.chances.interface;
        let chance = if wi.z > 0.0 { out.chances.up } else { out.chances.down };
        if chance > 0.0 {
            let into = self.cosine.losses(
                wi,
                out.inside != (wi.z < 0.0 && self.interface.refracts()),
                &self.interface,
            );
            let scale = self.interface.radiance_scale(out.eta, wi);
            f += self.cosine.evaluate(&out.losses, &into, wi, out.inside) / scale;
            pdf += chance * warp::cosine_hemisphere_pdf(wi.z.abs());
        }
        if self.coat.is_some() || self.sheen.is_some() {
            self.cover(out, wi, &mut f, &mut pdf);
        }
        (f, pdf)
    }

    /// Lays sheen and coat over the base.
    fn cover(&self, out: &Outgoing, wi: Vec3, f: &mut Vec3, pdf: &mut f32) {
        let passed = self.passed(out, wi);
        let above = wi.z > 0.0 && !out.inside;
        *f *= out.passed.sheen.min(passed.sheen);
        if let (Some(sheen), true) = (&self.sheen, above) {
            let (fs, ps) = sheen.evaluate(out.wo, wi);
            *f += fs;
            *pdf += out.chances.sheen * ps;
        }
        *f *= out.passed.coat.min(passed.coat);
        if let (Some(coat), true) = (&out.coat, above) {
            let (fc, pc) = coat.evaluate(out.wo, wi);
            *f += Vec3::splat(fc);
            *pdf += out.chances.coat * pc;
        }
    }

    pub(crate) fn sample(&self, wo: Vec3, draw: &BsdfDraw) -> Option<BsdfSample> {
        let u = draw.u;
        let out = self.outgoing(wo)?;
        let (lobe, u_rest) = out.chances.choose(draw.lobe)?;
        match lobe {
            Lobe::Coat => self.sample_coat(&out, u),
            Lobe::Sheen => self.finish(&out, Sheen::sample(u)),
            Lobe::Interface => self.sample_interface(&out, u_rest, u),
            Lobe::Up => self.finish(&out, draw.cosine),
            Lobe::Down => self.finish(&out, -draw.cosine),
        }
    }

    fn sample_coat(&self, out: &Outgoing, u: Vec2) -> Option<BsdfSample> {
        let coat = out.coat?;
        let wi = coat.sample(out.wo, u).filter(|wi| wi.z > 0.0)?;
        if coat.is_delta() {
            return self.mirror(out, wi, Vec3::splat(coat.reflected(out.wo) / out.chances.coat));
        }
        self.finish(out, wi)
    }

    fn sample_interface(&self, out: &Outgoing, u_choice: f32, u: Vec2) -> Option<BsdfSample> {
        let drawn = self.interface.sample(out.wo, out.eta, u_choice, u)?;
        if !self.interface.ggx.is_delta() {
            return self.finish(out, drawn.wi);
        }
        let share = self.covered(out, drawn.wi) / out.chances.interface;
        self.mirror(out, drawn.wi, drawn.weight * share)
    }

    /// A sample of a mirror-like lobe.
    fn mirror(&self, out: &Outgoing, wi: Vec3, weight: Vec3) -> Option<BsdfSample> {
        (weight.max_element() > 0.0 && weight.is_finite()).then(|| BsdfSample {
            wi: self.outer(wi, out.mirrored),
            weight,
            pdf: 0.0,
            delta: true,
            transmitted: wi.z < 0.0,
            radiance_scale: self.interface.radiance_scale(out.eta, wi),
            dispersed: self.interface.disperses(wi),
        })
    }

    /// A sample of a lobe of finite width: weighed with all of them.
    fn finish(&self, out: &Outgoing, wi: Vec3) -> Option<BsdfSample> {
        let (f, pdf) = self.evaluate(out, wi);
        let sample = self.mirror(out, wi, f / pdf)?;
        Some(BsdfSample { pdf, delta: false, ..sample })
    }

    /// Share of light that goes on straight through a smooth thin wall; zero for anything else.
    pub(crate) fn straight(&self, wo: Vec3) -> Vec3 {
        if !self.is_pane() {
            return Vec3::ZERO;
        }
        let Some(out) = self.outgoing(wo) else { return Vec3::ZERO };
        self.interface.passed_straight(out.wo.z, out.eta) * self.covered(&out, -out.wo)
    }

    pub(crate) fn is_pane(&self) -> bool {
        self.interface.thin && self.interface.transmits() && self.interface.ggx.is_delta()
    }

    /// What coat and sheen leave of light on its way between `wo` and `wi`.
    fn covered(&self, out: &Outgoing, wi: Vec3) -> f32 {
        let passed = self.passed(out, wi);
        out.passed.coat.min(passed.coat) * out.passed.sheen.min(passed.sheen)
    }

    pub(crate) fn albedo(&self) -> Vec3 {
        self.albedo
    }

    pub(crate) fn has_nondelta(&self) -> bool {
        !self.interface.ggx.is_delta()
            || self.cosine.is_some()
            || self.sheen.is_some()
            || self.coat.is_some_and(|c| !c.is_delta())
    }

    /// Whether nothing leaves but in narrow lobes.
    pub(crate) fn focuses(&self) -> bool {
        !self.cosine.is_diffuse()
            && self.sheen.is_none()
            && self.interface.ggx.is_narrow()
            && self.coat.is_none_or(|coat| coat.is_narrow())
    }

    /// Whether some light leaves like from a mirror.
    pub(crate) fn has_delta(&self) -> bool {
        self.interface.ggx.is_delta() || self.coat.is_some_and(|coat| coat.is_delta())
    }

    pub(crate) fn transmits(&self) -> bool {
        self.interface.transmits() && !self.interface.ggx.is_delta()
    }
}

#[derive(Clone, Copy)]
enum Lobe {
    Coat,
    Sheen,
    Interface,
    Up,
    Down,
}

impl Chances {
    fn normalized(self) -> Self {
        let sum = self.coat + self.sheen + self.interface + self.up + self.down;
        let scale = if sum > 0.0 && sum.is_finite() { 1.0 / sum } else { 0.0 };
        Self {
            coat: self.coat * scale,
            sheen: self.sheen * scale,
            interface: self.interface * scale,
            up: self.up * scale,
            down: self.down * scale,
        }
    }

    /// The lobe at `u`, and the rest of `u` as a new uniform number. `None` if there is no lobe.
    fn choose(&self, u: f32) -> Option<(Lobe, f32)> {
        let lobes = [
            (Lobe::Interface, self.interface),
            (Lobe::Up, self.up),
            (Lobe::Down, self.down),
            (Lobe::Coat, self.coat),
            (Lobe::Sheen, self.sheen),
        ];
        let (mut start, mut last) = (0.0, None);
        for (lobe, chance) in lobes {
            if chance > 0.0 {
                if u < start + chance {
                    return Some((lobe, unit((u - start) / chance).min(1.0 - f32::EPSILON)));
                }
                start += chance;
                last = Some((lobe, 1.0 - f32::EPSILON));
            }
        }
        last
    }
}

/// The direction in axes that are rotated by the angle of this cosine and sine.
fn rotate(rotation: Vec2, w: Vec3) -> Vec3 {
    let (c, s) = (rotation.x, rotation.y);
    Vec3::new(w.x * c + w.y * s, w.y * c - w.x * s, w.z)
}
