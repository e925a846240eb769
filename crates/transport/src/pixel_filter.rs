//! Pixel reconstruction by filter importance sampling (Ernst, Stamminger, Greiner 2006): the sample's place in the
//! picture is drawn from the filter itself, so that every sample has weight 1 and belongs to one pixel alone.

use std::str::FromStr;
use vastlight_math::{Vec2, real};

/// The shape of the pixel filter. All are separable, normalised and nowhere negative. Radii are in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelFilter {
    /// The pixel's own square.
    Box,
    /// A tent that falls to zero at `radius`.
    Triangle {
        /// Half width.
        radius: f32,
    },
    /// A Gaussian of standard deviation `radius / 3`, lowered so that it reaches zero at `radius`.
    Gaussian {
        /// Half width.
        radius: f32,
    },
    /// The four-term Blackman-Harris window, zero at `radius`.
    BlackmanHarris {
        /// Half width.
        radius: f32,
    },
}

impl Default for PixelFilter {
    fn default() -> Self {
        Self::BlackmanHarris { radius: 1.5 }
    }
}

impl FromStr for PixelFilter {
    type Err = String;

    /// `box`, `triangle`, `gaussian` or `blackman-harris`, with a radius in pixels after a colon if wanted.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, radius) = match text.split_once(':') {
            Some((name, radius)) => {
                (name, Some(radius.trim().parse().map_err(|_| "the radius is a number")?))
            }
            None => (text, None),
        };
        if radius.is_some_and(|r: f32| !(0.1..=16.0).contains(&r)) {
            return Err("the radius is 0.1 to 16 pixels".into());
        }
        match name {
            "box" if radius.is_none() => Ok(Self::Box),
            "box" => Err("the box has no radius".into()),
            "triangle" => Ok(Self::Triangle { radius: radius.unwrap_or(1.0) }),
            "gaussian" => Ok(Self::Gaussian { radius: radius.unwrap_or(1.5) }),
            "blackman-harris" => Ok(Self::BlackmanHarris { radius: radius.unwrap_or(1.5) }),
            _ => Err("known are box, triangle, gaussian and blackman-harris".into()),
        }
    }
}

impl PixelFilter {
    /// Half width in pixels, at least a hundredth.
    #[must_use]
    pub fn radius(&self) -> f32 {
        match *self {
            Self::Box => 0.5,
            Self::Triangle { radius } | Self::Gaussian { radius } | Self::BlackmanHarris { radius } => {
                radius.max(0.01)
            }
        }
    }

    /// The unnormalised profile at `x` in [-1, 1], where 1 is the radius.
    fn profile(&self, x: f32) -> f32 {
        match self {
            Self::Box => 1.0,
            Self::Triangle { .. } => 1.0 - x.abs(),
            Self::Gaussian { .. } => real::exp(-4.5 * x * x) - real::exp(-4.5),
            Self::BlackmanHarris { .. } => {
                let cos = |k: f32| real::cos(std::f32::consts::PI * k * x);
                0.358_75 + 0.488_29 * cos(1.0) + 0.141_28 * cos(2.0) + 0.011_68 * cos(3.0)
            }
        }
    }
}

/// The inverse of the filter's distribution, tabulated.
#[derive(Clone, Debug)]
pub struct FilterSampler {
    /// Offsets in pixels at equal steps of probability.
    offsets: Box<[f32; STEPS + 1]>,
    variance: f32,
}

/// Steps of the inverse distribution.
const STEPS: usize = 1024;
/// Steps of the profile's integral.
const BINS: usize = 8192;

impl FilterSampler {
    /// Tabulates `filter`.
    #[must_use]
    pub fn new(filter: PixelFilter) -> Self {
        let radius = filter.radius();
        let x_of = |i: f32| 2.0 * i / BINS as f32 - 1.0;
        let mut cumulative = vec![0.0_f64; BINS + 1];
        for i in 0..BINS {
            cumulative[i + 1] = cumulative[i] + f64::from(filter.profile(x_of(i as f32 + 0.5)).max(0.0));
        }
        let total = cumulative[BINS];
        let mut bin = 0;
        let offset_at = |step: usize| {
            let target = total * step as f64 / STEPS as f64;
            while bin + 1 < BINS && cumulative[bin + 1] < target {
                bin += 1;
            }
            let width = cumulative[bin + 1] - cumulative[bin];
            let inside = if width > 0.0 { (target - cumulative[bin]) / width } else { 0.0 };
            x_of(bin as f32 + inside.clamp(0.0, 1.0) as f32) * radius
        };
        let offsets: Box<[f32; STEPS + 1]> = Box::new(std::array::from_fn(offset_at));
        let variance = offsets.iter().map(|x| x * x).sum::<f32>() / offsets.len() as f32;
        Self { offsets, variance }
    }

    /// Offsets in pixels at equal steps of probability.
    pub(crate) fn offsets(&self) -> &[f32] {
        &self.offsets[..]
    }

    /// The variance of offsets along an axis, square pixels.
    #[must_use]
    pub fn variance(&self) -> f32 {
        self.variance
    }

    /// An offset from the pixel's centre, in pixels.
    #[inline(always)]
    #[must_use]
    pub fn sample(&self, u: Vec2) -> Vec2 {
        Vec2::new(self.sample_1d(u.x), self.sample_1d(u.y))
    }

    #[inline(always)]
    fn sample_1d(&self, u: f32) -> f32 {
        let scaled = u * STEPS as f32;
        let step = (scaled as i32).clamp(0, STEPS as i32 - 1) as usize;
        let (a, b) = (self.offsets[step], self.offsets[step + 1]);
        a + (b - a) * (scaled - step as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [PixelFilter; 4] = [
        PixelFilter::Box,
        PixelFilter::Triangle { radius: 1.0 },
        PixelFilter::Gaussian { radius: 1.5 },
        PixelFilter::BlackmanHarris { radius: 1.5 },
    ];

    /// Largest difference between the sampler's distribution and the integral of `filter`'s profile.
    fn distance_to(sampler: &FilterSampler, filter: PixelFilter) -> f64 {
        let n = 100_000;
        let mut samples: Vec<f32> = (0..n).map(|i| sampler.sample_1d((i as f32 + 0.5) / n as f32)).collect();
        samples.sort_by(f32::total_cmp);
        let profile: Vec<f64> =
            (0..2000).map(|i| f64::from(filter.profile((i as f32 + 0.5) / 1000.0 - 1.0))).collect();
        let total: f64 = profile.iter().sum();
        let mut sum = 0.0;
        let mut worst = 0.0_f64;
        for (i, p) in profile.iter().enumerate() {
            sum += p;
            let x = ((i + 1) as f32 / 1000.0 - 1.0) * filter.radius();
            let found = samples.partition_point(|&s| s <= x) as f64 / f64::from(n);
            worst = worst.max((found - sum / total).abs());
        }
        worst
    }

    #[test]
    fn samples_follow_the_profile_and_no_other() {
        for filter in ALL {
            assert!(distance_to(&FilterSampler::new(filter), filter) < 1e-3, "{filter:?}");
        }
        let wrong = FilterSampler::new(PixelFilter::Gaussian { radius: 1.5 });
        assert!(distance_to(&wrong, PixelFilter::BlackmanHarris { radius: 1.5 }) > 1e-2);
    }

    #[test]
    fn samples_are_symmetric_and_inside() {
        for filter in ALL {
            let sampler = FilterSampler::new(filter);
            for i in 0..=1000 {
                let u = i as f32 / 1000.0;
                let x = sampler.sample_1d(u);
                assert!(x.abs() <= filter.radius());
                assert!((x + sampler.sample_1d(1.0 - u)).abs() < 1e-3 * filter.radius() + 1e-4);
            }
        }
    }
}
