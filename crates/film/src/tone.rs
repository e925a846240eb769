//! Tone curves: from scene-linear radiance to display-linear [0, 1], and the sRGB encoding.

use std::{fmt, str::FromStr};
use vastlight_math::{Vec3, real};

/// A tone curve by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// `linear` (or `none`): values are clipped to [0, 1].
    Linear,
    /// `filmic`: a smooth shoulder and toe, bright saturated light fades towards white. Middle grey (0.18) stays.
    ///
    /// With `Y` the luminance: the colour is drawn towards `Y` by `FILMIC_INSET`, every channel passes
    /// `x^n / (x^n + k)` (the Naka-Rushton response, `n` = `FILMIC_CONTRAST`, `k` so that 0.18 maps to itself), and
    /// the colour is drawn away from the new luminance by `FILMIC_OUTSET`.
    #[default]
    Filmic,
    /// `reinhard`: `x / (1 + x)` on the luminance (Reinhard et al. 2002), hue kept, clipped.
    Reinhard,
}

/// Exponent of the filmic curve: its slope at middle grey in log-log space is `n (1 - 0.18)`, 1.1.
const FILMIC_CONTRAST: f32 = 1.35;
/// Share of luminance mixed into each channel before the filmic curve.
const FILMIC_INSET: f32 = 0.14;
/// Share of luminance taken out of each channel after the filmic curve.
const FILMIC_OUTSET: f32 = 0.10;
/// Middle grey.
const GREY: f32 = 0.18;

impl ToneCurve {
    /// Every curve.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Filmic, Self::Reinhard];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Filmic => "filmic",
            Self::Reinhard => "reinhard",
        }
    }

    /// Display-linear colour in [0, 1] of a scene-linear colour. NaN becomes 0.
    #[must_use]
    pub fn apply(self, color: Vec3) -> Vec3 {
        let color = Vec3::from_array(color.to_array().map(|x| if x > 0.0 { x.min(1e9) } else { 0.0 }));
        let mapped = match self {
            Self::Linear => color,
            Self::Filmic => filmic(color),
            Self::Reinhard => color / (1.0 + luminance(color)),
        };
        mapped.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

fn luminance(c: Vec3) -> f32 {
    0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z
}

fn filmic(color: Vec3) -> Vec3 {
    let inset = color.lerp(Vec3::splat(luminance(color)), FILMIC_INSET);
    let curved = Vec3::from_array(inset.to_array().map(filmic_channel));
    (curved - Vec3::splat(luminance(curved) * FILMIC_OUTSET)) / (1.0 - FILMIC_OUTSET)
}

/// `x^n / (x^n + k)`, written as `1 / (1 + (1/GREY - 1) (GREY/x)^n)` so that neither overflows.
fn filmic_channel(x: f32) -> f32 {
    if x <= 0.0 { 0.0 } else { 1.0 / (1.0 + (1.0 / GREY - 1.0) * real::pow(GREY / x, FILMIC_CONTRAST)) }
}

impl fmt::Display for ToneCurve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for ToneCurve {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let name = if name == "none" { "linear" } else { name };
        Self::ALL.into_iter().find(|c| c.name() == name).ok_or_else(|| {
            let known: Vec<_> = Self::ALL.iter().map(|c| c.name()).collect();
            format!("unknown tone curve \"{name}\"; known are none, {}", known.join(", "))
        })
    }
}

/// The sRGB encoding (IEC 61966-2-1) of a linear value in [0, 1].
#[must_use]
pub fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * real::pow(x, 1.0 / 2.4) - 0.055 }
}

/// The linear value of an sRGB-encoded one.
#[must_use]
pub fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.040_45 { x / 12.92 } else { real::pow((x + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(curve: ToneCurve, x: f32) -> f32 {
        curve.apply(Vec3::splat(x)).x
    }

    #[test]
    fn golden_values() {
        let expect = [(0.0, 0.0), (0.18, 0.18), (1.0, 0.689_6), (4.0, 0.935_3), (1e9, 1.0)];
        for (x, y) in expect {
            assert!((grey(ToneCurve::Filmic, x) - y).abs() < 2e-3, "{x}: {}", grey(ToneCurve::Filmic, x));
        }
        assert!((grey(ToneCurve::Filmic, 0.18) - 0.18).abs() < 1e-6);
        assert_eq!(grey(ToneCurve::Linear, 0.25), 0.25);
        assert_eq!(grey(ToneCurve::Linear, 7.0), 1.0);
        assert!((grey(ToneCurve::Reinhard, 1.0) - 0.5).abs() < 1e-6);
        assert!((srgb_from_linear(0.5) - 0.735_357).abs() < 1e-6);
        assert!((srgb_from_linear(0.001) - 0.012_92).abs() < 1e-7);
    }

    #[test]
    fn curves_rise_and_stay_in_range() {
        for curve in ToneCurve::ALL {
            let mut last = -1.0;
            for i in 0..4000 {
                let y = grey(curve, real::exp2(i as f32 / 100.0 - 20.0));
                assert!((0.0..=1.0).contains(&y) && y >= last - 1e-6, "{curve}");
                last = y;
            }
            let odd = curve.apply(Vec3::new(f32::NAN, -1.0, f32::INFINITY));
            assert!(odd.is_finite() && odd.min_element() >= 0.0 && odd.max_element() <= 1.0);
        }
    }

    #[test]
    fn bright_saturated_light_fades_to_white() {
        let mapped = ToneCurve::Filmic.apply(Vec3::new(0.0, 0.0, 100.0));
        assert!(mapped.z > 0.95 && mapped.x > 0.5, "{mapped}");
        let dim = ToneCurve::Filmic.apply(Vec3::new(0.0, 0.0, 0.2));
        assert!(dim.x < 0.02 && dim.z > 0.1, "{dim}");
    }

    #[test]
    fn srgb_round_trips() {
        for i in 0..=255 {
            let encoded = i as f32 / 255.0;
            let back = srgb_from_linear(linear_from_srgb(encoded));
            assert!((back - encoded).abs() < 2e-6, "{i}");
        }
    }
}
