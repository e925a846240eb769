//! What the base interface reflects at an angle: a blend of metal and dielectric, with or without a thin film.

use super::iridescence::Film;
use super::{BsdfParams, color, fresnel, max3, positive, unit};
use vastlight_math::Vec3;
use vastlight_scene::Conductor;

/// A measured metal with the numbers that are dear to compute at every point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metal {
    index: Conductor,
    /// Reflectance at normal incidence.
    pub(crate) normal: Vec3,
    /// Cosine-weighted mean over the hemisphere.
    average: Vec3,
}

impl Metal {
    /// Prepares a measured metal. Indices that are negative or no numbers count as 0.
    #[must_use]
    pub fn new(index: Conductor) -> Self {
        let index = Conductor { eta: positive(index.eta), k: positive(index.k) };
        const STEPS: usize = 64;
        let mut sum = Vec3::ZERO;
        for i in 0..STEPS {
            let cos = (i as f32 + 0.5) / STEPS as f32;
            sum += fresnel::conductor(cos, &index) * (2.0 * cos);
        }
        Self { index, normal: fresnel::conductor(1.0, &index), average: sum / STEPS as f32 }
    }

    /// Its complex index of refraction.
    #[must_use]
    pub fn index(&self) -> Conductor {
        self.index
    }

    /// Cosine-weighted mean of its reflectance over the hemisphere.
    #[must_use]
    pub fn average(&self) -> Vec3 {
        self.average
    }
}

/// What happens to light that meets a microfacet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split {
    /// Reflected.
    pub(crate) reflected: Vec3,
    /// Passed into the dielectric; the same for all channels, as KHR_materials_specular asks.
    pub(crate) passed: f32,
}

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reflectance {
    metallic: f32,
    metal_f0: Vec3,
    measured: Option<Metal>,
    f0: Vec3,
    f90: f32,
    /// An infinite index: Schlick's curve takes the place of Fresnel's.
    infinite: bool,
    film: Option<Film>,
}

impl Reflectance {
    pub(crate) fn new(p: &BsdfParams) -> Self {
        let infinite = p.ior <= 0.0 || p.ior.is_nan();
        let normal = if infinite { 1.0 } else { fresnel::dielectric_f0(p.ior.min(4.0)) };
        Self {
            metallic: unit(p.metallic),
            metal_f0: p.conductor.map_or(color(p.base_color), |m| m.normal),
            measured: p.conductor.filter(|_| p.metallic > 0.0),
            f0: color(p.specular_color * normal) * unit(p.specular),
            f90: unit(p.specular),
            infinite,
            film: Film::new(p.iridescence, p.iridescence_ior, p.iridescence_thickness),
        }
    }

    /// At the cosine to a microfacet; `eta` is the index of the far side over the near side's.
    pub(crate) fn at(&self, cos: f32, eta: f32) -> Split {
        let mut reflected = Vec3::ZERO;
        if self.metallic > 0.0 {
            reflected += self.metal(cos) * self.metallic;
        }
        let mut passed = 0.0;
        if self.metallic < 1.0 {
            let f = self.dielectric(cos, eta);
            reflected += f * (1.0 - self.metallic);
            passed = (1.0 - self.metallic) * (1.0 - max3(f)).max(0.0);
        }
        Split { reflected, passed }
    }

    fn metal(&self, cos: f32) -> Vec3 {
        let bare = match &self.measured {
            Some(metal) => fresnel::conductor(cos, &metal.index),
            None => self.metal_f0 + (Vec3::ONE - self.metal_f0) * fresnel::schlick_weight(cos),
        };
        self.with_film(bare, self.metal_f0, cos)
    }

    fn dielectric(&self, cos: f32, eta: f32) -> Vec3 {
        let real = fresnel::dielectric(cos, eta);
        if real >= 1.0 && eta < 1.0 {
            return Vec3::ONE; // total internal reflection, whatever the artist's weights say
        }
        let rise = if self.infinite {
            fresnel::schlick_weight(cos)
        } else {
            let f0 = fresnel::dielectric_f0(eta);
            ((real - f0) / (1.0 - f0)).clamp(0.0, 1.0)
        };
        let bare = self.f0 + (self.f90 - self.f0) * rise;
        // The film knows the angle outside.
        let outside = if eta < 1.0 && self.film.is_some() {
            (1.0 - (1.0 - cos * cos) / (eta * eta)).max(0.0).sqrt()
        } else {
            cos
        };
        self.with_film(bare, self.f0, outside)
    }

    fn with_film(&self, bare: Vec3, f0: Vec3, cos: f32) -> Vec3 {
        match &self.film {
            Some(film) => bare.lerp(film.reflectance(cos, f0), film.weight),
            None => bare,
        }
    }

    /// Share of metal.
    pub(crate) fn metallic(&self) -> f32 {
        self.metallic
    }

    /// Reflectance of the metal and of the dielectric at normal incidence, without a film.
    pub(crate) fn normal(&self) -> (Vec3, Vec3) {
        (self.metal_f0, self.f0)
    }

    /// The dielectric as the two ends of a rising curve that is nowhere below its reflectance: at normal incidence and
    /// at grazing.
    pub(crate) fn dielectric_ends(&self, eta: f32) -> (Vec3, f32) {
        let Some(film) = &self.film else { return (self.f0, self.f90) };
        let f90 = self.f90 + (1.0 - self.f90) * film.weight;
        let mut bound = Vec3::ZERO;
        for cos in [1.0, 0.85, 0.7, 0.55, 0.4, 0.25] {
            let rise = fresnel::schlick_weight(cos);
            bound = bound.max((self.dielectric(cos, eta.max(1.0)) - f90 * rise) / (1.0 - rise));
        }
        (bound.clamp(Vec3::ZERO, Vec3::ONE), f90)
    }

    /// The dielectric's reflectance at grazing, without a film.
    pub(crate) fn grazing(&self) -> f32 {
        self.f90
    }

    /// The index whose Fresnel curve rises like this reflectance: a film's and an infinite index's rise like Schlick's
    /// curve, which is near that of 1.5.
    pub(crate) fn table_ior(&self, ior: f32) -> f32 {
        if self.infinite {
            1.5
        } else if self.film.is_some() {
            ior.max(1.0 / ior).max(1.5)
        } else {
            ior
        }
    }

    /// 1 where the dielectric reflects what its index says, 0 where something else decides.
    pub(crate) fn plainness(&self) -> f32 {
        if self.infinite { 0.0 } else { 1.0 - self.film.map_or(0.0, |f| f.weight) }
    }

    /// Whether there is a thin film.
    pub(crate) fn has_film(&self) -> bool {
        self.film.is_some()
    }

    /// Mean reflectance of the metal over the hemisphere.
    pub(crate) fn metal_average(&self) -> Vec3 {
        match (&self.film, &self.measured) {
            (Some(_), _) => self.metal(0.65),
            (None, Some(metal)) => metal.average,
            // The integral of Schlick's curve.
            (None, None) => self.metal_f0 + (Vec3::ONE - self.metal_f0) / 21.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metal_average_is_the_integral() {
        let p = BsdfParams { metallic: 1.0, ..BsdfParams::diffuse(Vec3::new(0.9, 0.5, 0.1)) };
        let r = Reflectance::new(&p);
        let n = 1000;
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let cos = (i as f32 + 0.5) / n as f32;
            sum += r.at(cos, 1.5).reflected * (2.0 * cos / n as f32);
        }
        assert!((sum - r.metal_average()).abs().max_element() < 1e-3);
    }

    #[test]
    fn specular_weights_scale_both_ends_and_the_rest_passes() {
        let p = BsdfParams {
            specular: 0.5,
            specular_color: Vec3::new(2.0, 1.0, 0.0),
            ..BsdfParams::diffuse(Vec3::ONE)
        };
        let r = Reflectance::new(&p);
        let at_normal = r.at(1.0, 1.5);
        assert!((at_normal.reflected - Vec3::new(0.04, 0.02, 0.0)).abs().max_element() < 1e-6);
        assert!((at_normal.passed - 0.96).abs() < 1e-6);
        assert!((r.at(0.0, 1.5).reflected - 0.5).abs().max_element() < 1e-5);
        let infinite = Reflectance::new(&BsdfParams { ior: 0.0, specular: 1.0, ..p });
        assert!((infinite.at(1.0, 1.5).reflected - Vec3::new(1.0, 1.0, 0.0)).abs().max_element() < 1e-6);
    }
}
