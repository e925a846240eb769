//! Dispersion: one wavelength for a path, Cauchy's index of refraction, and RGB weights that average to white.
//!
//! A path draws a provisional wavelength when it starts. The first time that it goes on in a direction which depends
//! on it, its throughput takes the wavelength's RGB weight and the wavelength stays for the rest of the path.

use super::BsdfParams;
use vastlight_math::{Vec3, real};

/// Shortest and longest wavelength drawn, nanometres: beyond them the eye sees little.
const RANGE: [f32; 2] = [420.0, 680.0];
/// Where blue is pure, green is pure, and red is pure; in between two neighbours mix.
const PURE: [f32; 3] = [450.0, 540.0, 620.0];

/// The wavelength of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelength {
    nanometres: f32,
    chosen: bool,
}

impl Wavelength {
    /// The wavelength for `u` in [0, 1), always the same for one path. `chosen`: the path has already gone on with this
    /// wavelength alone, because a sample was [`super::BsdfSample::dispersed`].
    #[must_use]
    pub fn new(u: f32, chosen: bool) -> Self {
        Self { nanometres: RANGE[0] + (RANGE[1] - RANGE[0]) * u, chosen }
    }

    /// In nanometres.
    #[must_use]
    pub fn nanometres(&self) -> f32 {
        self.nanometres
    }

    /// Sets the index of refraction for this wavelength where the material disperses, and the colour that light takes
    /// when it is transmitted: the wavelength's RGB weight the first time, white from then on.
    pub fn apply(&self, params: &mut BsdfParams) {
        if params.dispersion > 0.0 && !params.thin && params.ior > 0.0 {
            params.ior = cauchy(params.ior, params.dispersion, self.nanometres);
            params.transmission_tint = if self.chosen { Vec3::ONE } else { rgb_weight(self.nanometres) };
        }
    }
}

/// Index of refraction at a wavelength (nm) from that at 587.6 nm and 20 / Abbe number: Cauchy's equation with two
/// terms, as in KHR_materials_dispersion.
fn cauchy(ior: f32, dispersion: f32, nanometres: f32) -> f32 {
    let slope = (ior - 1.0) * dispersion / 20.0;
    (ior + slope * (523_655.0 / (nanometres * nanometres) - 1.5168)).max(1.0)
}

/// Colour of light of one wavelength, scaled so that the mean over all drawn wavelengths is white.
fn rgb_weight(nanometres: f32) -> Vec3 {
    // Mean of each bell over the range: its flat part and half of its slopes.
    let width = RANGE[1] - RANGE[0];
    let blue_mean = (0.5 * (PURE[0] + PURE[1]) - RANGE[0]) / width;
    let green_mean = 0.5 * (PURE[2] - PURE[0]) / width;
    let red_mean = (RANGE[1] - 0.5 * (PURE[1] + PURE[2])) / width;
    let step = |a: f32, b: f32| {
        let t = ((nanometres - a) / (b - a)).clamp(0.0, 1.0);
        0.5 - 0.5 * real::cos(std::f32::consts::PI * t)
    };
    let (to_green, to_red) = (step(PURE[0], PURE[1]), step(PURE[1], PURE[2]));
    Vec3::new(to_red / red_mean, (to_green - to_red) / green_mean, (1.0 - to_green) / blue_mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_average_to_white_and_are_never_negative() {
        let n = 10_000;
        let mut sum = Vec3::ZERO;
        for i in 0..n {
            let w = rgb_weight(Wavelength::new((i as f32 + 0.5) / n as f32, false).nanometres());
            assert!(w.min_element() > -1e-6);
            sum += w;
        }
        assert!((sum / n as f32 - Vec3::ONE).abs().max_element() < 1e-3, "{}", sum / n as f32);
    }

    #[test]
    fn cauchy_gives_back_the_abbe_number() {
        let (n_d, abbe) = (1.5168, 64.17); // crown glass
        let n = |nm| cauchy(n_d, 20.0 / abbe, nm);
        assert!((n(587.6) - n_d).abs() < 1e-4);
        let found = (n_d - 1.0) / (n(486.1) - n(656.3));
        assert!((found / abbe - 1.0).abs() < 2e-3, "{found}");
    }
}
