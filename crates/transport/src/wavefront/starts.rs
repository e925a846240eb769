//! Which paths a wave starts: pixels of a tile in the order of [`order`], the samples of a pixel ascending.

use crate::order;
use crate::settings::Tile;
use std::ops::Range;
use vastlight_math::{Sampler, rng};

/// Samples of one pixel that follow each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    /// Column and row.
    pub(crate) pixel: [u32; 2],
    /// Numbers of the samples.
    pub(crate) samples: Range<u32>,
}

impl Run {
    /// The sampler of each sample, and a hash of pixel, sample and seed.
    #[inline(always)]
    pub(crate) fn starts(self, seed: u32) -> impl Iterator<Item = (Sampler, u32)> {
        let (pixel_sampler, pixel_hash) = (Sampler::new(self.pixel, 0, seed), rng::hash_words(&self.pixel));
        self.samples.map(move |sample| {
            let key = (rng::hash_more(pixel_hash, &[sample, seed]) >> 32) as u32;
            (pixel_sampler.at_sample(sample), key)
        })
    }
}

/// The samples of a tile, numbered from 0 in the order of rendering.
#[derive(Clone, Debug)]
pub(crate) struct Starts {
    pixels: Vec<[u32; 2]>,
    samples: Range<u32>,
}

impl Starts {
    /// The samples numbered `samples` of every pixel of `tile`.
    pub(crate) fn new(tile: Tile, samples: Range<u32>) -> Self {
        Self { pixels: order::pixels(tile).collect(), samples }
    }

    /// Number of samples.
    pub(crate) fn len(&self) -> u64 {
        self.pixels.len() as u64 * self.samples.len() as u64
    }

    /// Those numbered `range`, pixel by pixel.
    pub(crate) fn runs(&self, range: Range<u64>) -> impl Iterator<Item = Run> {
        let (each, first_sample) = (self.samples.len() as u64, self.samples.start);
        let mut next = range.start;
        std::iter::from_fn(move || {
            (next < range.end).then(|| {
                let (pixel, sample) = (next / each, next % each);
                let last = each.min(sample + (range.end - next));
                next += last - sample;
                Run {
                    pixel: self.pixels[pixel as usize],
                    samples: first_sample + sample as u32..first_sample + last as u32,
                }
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_cut_anywhere_give_every_sample_once_and_in_order() {
        let starts = Starts::new(Tile { min: [3, 5], max: [7, 8] }, 10..15);
        let expected: Vec<_> = order::pixels(Tile { min: [3, 5], max: [7, 8] })
            .flat_map(|pixel| (10..15).map(move |s| (pixel, s)))
            .collect();
        assert_eq!(starts.len(), expected.len() as u64);
        for step in [1, 2, 5, 7, 60, 100] {
            let mut found = Vec::new();
            for first in (0..starts.len()).step_by(step) {
                for run in starts.runs(first..starts.len().min(first + step as u64)) {
                    assert!(!run.samples.is_empty());
                    found.extend(run.samples.map(|s| (run.pixel, s)));
                }
            }
            assert_eq!(found, expected, "{step}");
        }
        assert_eq!(Starts::new(Tile { min: [0, 0], max: [4, 4] }, 3..3).len(), 0);
    }
}
