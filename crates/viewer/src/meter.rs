//! How fast pictures come, and how large a picture may be that must come soon.

use std::time::Duration;

/// Time for the rays of a picture of a camera that moves.
const SOON: Duration = Duration::from_millis(32);
/// Parts of the full size that are rendered: few, so that pictures do not flicker from size to size.
const SCALES: [f32; 9] = [1.0, 0.75, 0.5, 0.375, 0.25, 0.1875, 0.125, 0.0833, 0.0625];
/// Samples a second before anything is known.
const GUESS: f64 = 1.0e6;

/// The rate of samples, smoothed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meter {
    samples_per_s: f64,
    rays_per_s: f64,
}

impl Default for Meter {
    fn default() -> Self {
        Self { samples_per_s: GUESS, rays_per_s: 0.0 }
    }
}

impl Meter {
    /// Notes work that was done.
    pub(crate) fn note(&mut self, samples: u64, rays: u64, elapsed: Duration) {
        let secs = elapsed.as_secs_f64();
        if samples == 0 || secs <= 0.0 {
            return;
        }
        // Long work counts more than a short piece of it.
        let weight = (secs / 0.1).clamp(0.2, 0.7);
        let towards = |old: f64, new: f64| old + (new - old) * weight;
        self.samples_per_s = towards(self.samples_per_s, samples as f64 / secs);
        self.rays_per_s = towards(self.rays_per_s, rays as f64 / secs);
    }

    pub(crate) fn samples_per_s(&self) -> f64 {
        self.samples_per_s
    }

    pub(crate) fn rays_per_s(&self) -> f64 {
        self.rays_per_s
    }

    /// The largest scale at which a sample of every pixel comes soon.
    pub(crate) fn scale(&self, pixels: u64) -> f32 {
        let soon = self.samples_per_s * SOON.as_secs_f64();
        let fits = |scale: &f32| pixels as f64 * f64::from(scale * scale) <= soon;
        SCALES.into_iter().find(fits).unwrap_or(SCALES[SCALES.len() - 1])
    }

    /// The scale after a picture at `scale`, on the way to all of it.
    pub(crate) fn next_scale(scale: f32) -> f32 {
        if scale < 0.4 { (scale * 2.0).min(0.5) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_machines_get_small_pictures_that_grow() {
        let mut meter = Meter::default();
        for _ in 0..50 {
            meter.note(20_000, 100_000, Duration::from_millis(100));
        }
        assert!((meter.samples_per_s() - 2e5).abs() < 1.0 && (meter.rays_per_s() - 1e6).abs() < 1.0);
        let scale = meter.scale(1280 * 720);
        assert!(scale < 0.1, "{scale}");
        let mut steps = vec![scale];
        while steps[steps.len() - 1] < 1.0 {
            steps.push(Meter::next_scale(steps[steps.len() - 1]));
        }
        assert!(steps.len() < 7 && steps.is_sorted(), "{steps:?}");
        for _ in 0..50 {
            meter.note(100_000_000, 0, Duration::from_millis(100));
        }
        assert_eq!(meter.scale(1280 * 720), 1.0);
        assert_eq!(Meter { samples_per_s: 1.0, rays_per_s: 0.0 }.scale(1 << 22), 0.0625);
    }
}
