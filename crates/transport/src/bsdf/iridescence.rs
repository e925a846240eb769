//! Interference in a thin film (Belcour and Barla 2017, "A practical extension to microfacet theory for the modeling
//! of varying iridescence") with the simplifications of KHR_materials_iridescence: unpolarised, Schlick's curves, two
//! orders of reflection integrated over Gaussian fits of the eye's sensitivities.

use super::{fresnel, unit};
use std::f32::consts::{PI, TAU};
use vastlight_math::{Vec3, real};

/// A film on the base interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Film {
    /// Share of the surface that the film covers.
    pub(crate) weight: f32,
    ior: f32,
    /// Metres.
    thickness: f32,
}

impl Film {
    /// Thickness in nanometres; `None` for weight or thickness 0.
    pub(crate) fn new(weight: f32, ior: f32, nanometres: f32) -> Option<Self> {
        let valid = unit(weight) > 0.0 && nanometres > 0.0 && nanometres.is_finite() && ior.is_finite();
        let film = Self { weight: unit(weight), ior: ior.clamp(1.0, 4.0), thickness: nanometres * 1e-9 };
        valid.then_some(film)
    }

    /// Reflectance of film and base together at the cosine outside; `f0` is the base's own reflectance in air.
    pub(crate) fn reflectance(&self, cos: f32, f0: Vec3) -> Vec3 {
        let cos = cos.clamp(0.0, 1.0);
        let sin2_film = (1.0 - cos * cos) / (self.ior * self.ior);
        let cos_film = (1.0 - sin2_film).max(0.0).sqrt();
        let first = schlick(Vec3::splat(fresnel::dielectric_f0(self.ior)), cos);
        // The base's index as if it were a dielectric; a reflectance of 1 would need an infinite one.
        let root = Vec3::new(f0.x.sqrt(), f0.y.sqrt(), f0.z.sqrt()).min(Vec3::splat(0.9999));
        let base = (Vec3::ONE + root) / (Vec3::ONE - root);
        let contrast = (base - self.ior) / (base + self.ior);
        let second = schlick(contrast * contrast, cos_film);
        let phase = Vec3::new(self.phase(base.x), self.phase(base.y), self.phase(base.z));
        let path = 2.0 * self.ior * self.thickness * cos_film;
        interference(first, second, path, phase)
    }

    /// Phase shift of one order: pi at the film's upper side from within, and pi more where the base is thinner.
    fn phase(&self, base: f32) -> f32 {
        if base < self.ior { TAU } else { PI }
    }
}

fn schlick(f0: Vec3, cos: f32) -> Vec3 {
    f0 + (Vec3::ONE - f0) * fresnel::schlick_weight(cos)
}

/// The series over reflection orders, cut after the second.
fn interference(first: Vec3, second: Vec3, path: f32, phase: Vec3) -> Vec3 {
    let through = Vec3::ONE - first;
    let both = (first * second).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
    let root = Vec3::new(both.x.sqrt(), both.y.sqrt(), both.z.sqrt());
    let round_trips = through * through * second / (Vec3::ONE - both);
    let mut sum = first + round_trips;
    let mut order = round_trips - through;
    for m in 1..=2 {
        order *= root;
        sum += order * sensitivity(m as f32 * path, phase * m as f32) * 2.0;
    }
    sum.clamp(Vec3::ZERO, Vec3::ONE)
}

/// Fourier transform of the eye's sensitivities at an optical path difference (metres), in linear Rec. 709.
fn sensitivity(path: f32, shift: Vec3) -> Vec3 {
    let k = TAU * path;
    // Height, centre and variance of the Gaussians in wave numbers: x, y, z and the second lobe of x.
    let lobe = |value: f32, centre: f32, variance: f32, shift: f32| {
        value * (TAU * variance).sqrt() * real::cos(centre * k + shift) * real::exp(-variance * k * k)
            / 1.0685e-7
    };
    let x = lobe(5.4856e-13, 1.6810e6, 4.3278e9, shift.x) + lobe(9.7470e-14, 2.2399e6, 4.5282e9, shift.x);
    let y = lobe(4.4201e-13, 1.7953e6, 9.3046e9, shift.y);
    let z = lobe(5.2481e-13, 2.2084e6, 6.6121e9, shift.z);
    Vec3::new(
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thick_films_lose_their_colour_and_thin_ones_have_it() {
        let base = Vec3::splat(0.04);
        let spread = |nm: f32| {
            let f = Film::new(1.0, 1.8, nm).expect("film").reflectance(0.9, base);
            f.max_element() - f.min_element()
        };
        assert!(spread(400.0) > 0.02, "{}", spread(400.0));
        assert!(spread(50_000.0) < 1e-3, "{}", spread(50_000.0));
    }

    #[test]
    fn a_thick_film_reflects_what_two_interfaces_reflect() {
        let film = Film::new(1.0, 1.3, 100_000.0).expect("film");
        let (r1, r2) = (fresnel::dielectric_f0(1.3), fresnel::dielectric_f0(1.5 / 1.3));
        let expected = r1 + (1.0 - r1) * (1.0 - r1) * r2 / (1.0 - r1 * r2);
        let f = film.reflectance(1.0, Vec3::splat(fresnel::dielectric_f0(1.5)));
        assert!((f - expected).abs().max_element() < 1e-3, "{f} {expected}");
    }

    #[test]
    fn reflectance_stays_in_range() {
        for i in 0..1000 {
            let t = i as f32 / 999.0;
            let film = Film::new(1.0, 1.0 + 2.0 * t, 1.0 + 1500.0 * ((i * 37) % 1000) as f32 / 999.0);
            let f = film.expect("film").reflectance(t, Vec3::new(0.0, t, 1.0));
            assert!(f.min_element() >= 0.0 && f.max_element() <= 1.0, "{i} {f}");
        }
    }
}
