//! How much a photon counts by its distance: D. Bogolepov, D. Sopin, V. Turlapov 2010, "Simulation of caustics in real
//! time", formulas 1 and 2, scaled so that a weight is a density over area.

use std::f32::consts::PI;
use vastlight_simd::Simd8;

/// A weight that falls from the middle of a disc to zero at its edge; its integral over the disc is 1, so that the sum of
/// flux times weight is irradiance where the receiver is flat.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kernel {
    /// `1 - t`, a cone.
    #[default]
    Linear,
    /// `1 - smoothstep(0, 1, t)`, which gives more to the near.
    Smoothstep,
}

impl Kernel {
    /// Every kernel.
    pub const ALL: [Self; 2] = [Self::Linear, Self::Smoothstep];

    /// The kernel of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kernel| kernel.name() == name)
    }

    /// `linear` or `smoothstep`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Smoothstep => "smoothstep",
        }
    }

    /// The weight in the middle of a disc of this radius, 1/m².
    #[must_use]
    pub fn peak(self, radius: f32) -> f32 {
        let volume = match self {
            Self::Linear => 3.0,
            Self::Smoothstep => 10.0 / 3.0,
        };
        volume / (PI * radius * radius)
    }

    /// The variance along an axis of a photon's light in a disc of radius 1.
    #[must_use]
    pub const fn variance(self) -> f32 {
        match self {
            Self::Linear => 0.15,
            Self::Smoothstep => 5.0 / 42.0,
        }
    }

    /// The radius, or 0 where it is not positive, or its square or the [`peak`](Self::peak) is not a number that f32 has.
    pub(super) fn usable(self, radius: f32) -> f32 {
        let usable = radius > 0.0 && (radius * radius).is_normal() && self.peak(radius).is_normal();
        if usable { radius } else { 0.0 }
    }

    /// The weights at eight distances of at most 1, the disc's radius, as shares of the peak.
    #[inline(always)]
    pub(super) fn shares<S: Simd8>(self, s: S, t: S::F) -> S::F {
        let one = s.splat(1.0);
        let fallen = match self {
            Self::Linear => t,
            Self::Smoothstep => s.mul(s.mul(t, t), s.sub(s.splat(3.0), s.add(t, t))),
        };
        s.max(s.sub(one, fallen), s.splat(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_simd::Portable;

    /// The integral over a disc by rings of equal width.
    fn integral(kernel: Kernel, radius: f32) -> f64 {
        let rings = 4000;
        let ring = |i: usize| {
            let t = (i as f32 + 0.5) / rings as f32;
            let share = Portable.to_array(kernel.shares(Portable, Portable.splat(t)))[0];
            let weight = f64::from(share * kernel.peak(radius));
            weight * std::f64::consts::TAU * f64::from(t * radius) * f64::from(radius) / rings as f64
        };
        (0..rings).map(ring).sum()
    }

    #[test]
    fn weights_integrate_to_one_and_end_at_zero() {
        for kernel in Kernel::ALL {
            for radius in [0.01, 1.0, 30.0] {
                let sum = integral(kernel, radius);
                assert!((sum - 1.0).abs() < 1e-4, "{kernel:?} {radius}: {sum}");
            }
            let shares = Portable.to_array(kernel.shares(Portable, [0.0, 0.5, 1.0, 1.0, 0.2, 0.3, 0.4, 0.9]));
            assert_eq!(shares[..4], [1.0, 0.5, 0.0, 0.0], "{kernel:?}");
            assert_eq!(Kernel::from_name(kernel.name()), Some(kernel));
        }
        assert_eq!(Kernel::from_name("box"), None);
        // The papers' own constant is no density.
        assert!((integral(Kernel::Linear, 1.0) * f64::from(PI) / 3.0 - 1.0).abs() > 0.04, "negative control");
    }
}
