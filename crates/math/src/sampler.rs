//! The sampler: Owen-scrambled Sobol points, padded in pairs of dimensions (Burley 2020).
//!
//! Each pixel has its own scrambled (0,2)-sequence in every pair of dimensions: the first 2^k samples (and every
//! aligned run of 2^k) fall into different cells of all 2^a x 2^(k-a) grids. Pairs are made independent by shuffling
//! the sample's index with an Owen scramble of its own, which keeps that property for every run of samples, so the
//! number of samples need not be known.

use crate::lanes::{LANES, Lanes, Lanes2};
use crate::rng::{hash_u64, hash_words};
use crate::sobol::{owen_reversed, second_dimension_reversed, to_unit};
use glam::Vec2;

/// Numbers for one sample of one pixel: a pure function of pixel, sample, seed and the count of dimensions drawn so
/// far. 16 bytes, to be kept with a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampler {
    key: u64,
    index_reversed: u32,
    dimension: u32,
}

impl Sampler {
    /// The sampler of a pixel's sample, at dimension 0.
    #[inline]
    #[must_use]
    pub fn new(pixel: [u32; 2], sample: u32, seed: u32) -> Self {
        Self {
            key: hash_words(&[pixel[0], pixel[1], seed]),
            index_reversed: sample.reverse_bits(),
            dimension: 0,
        }
    }

    /// The same pixel's sample number `sample`, at dimension 0.
    #[inline]
    #[must_use]
    pub const fn at_sample(self, sample: u32) -> Self {
        Self { index_reversed: sample.reverse_bits(), dimension: 0, ..self }
    }

    /// The next number, in [0, 1). Uses one dimension.
    #[inline(always)]
    pub fn next_1d(&mut self) -> f32 {
        let (index, seed_x, _) = self.next_index();
        to_unit(owen_reversed(index, seed_x))
    }

    /// The next point, in [0, 1)^2. Uses one dimension (of the counter), and both coordinates are stratified together.
    #[inline(always)]
    pub fn next_2d(&mut self) -> Vec2 {
        let (index, seed_x, seed_y) = self.next_index();
        Vec2::new(
            to_unit(owen_reversed(index, seed_x)),
            to_unit(owen_reversed(second_dimension_reversed(index), seed_y)),
        )
    }

    /// How many numbers and points have been drawn.
    #[inline]
    #[must_use]
    pub const fn dimension(&self) -> u32 {
        self.dimension
    }

    /// Continues at another dimension, so that a part of a path (say, its n-th bounce) can have fixed dimensions.
    #[inline]
    #[must_use]
    pub const fn at_dimension(self, dimension: u32) -> Self {
        Self { dimension, ..self }
    }

    /// The shuffled index and the seeds of both scrambles for the next dimension.
    #[inline(always)]
    fn next_index(&mut self) -> (u32, u32, u32) {
        self.dimension = self.dimension.wrapping_add(1);
        let step = u64::from(self.dimension).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let h = hash_u64(self.key.wrapping_add(step));
        let (seed_x, seed_y) = (h as u32, (h >> 32) as u32);
        let seed_shuffle = (h.wrapping_mul(0xd134_2543_de82_ef95) >> 32) as u32;
        (owen_reversed(self.index_reversed, seed_shuffle).reverse_bits(), seed_x, seed_y)
    }
}

/// Samplers side by side, which draw the same dimension together.
#[derive(Clone, Copy, Debug)]
pub struct SamplerLanes {
    keys: [u64; LANES],
    indices_reversed: [u32; LANES],
}

impl SamplerLanes {
    /// All lanes the first sample of no pixel.
    pub const ZERO: Self = Self { keys: [0; LANES], indices_reversed: [0; LANES] };

    /// Puts a sampler into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, sampler: &Sampler) {
        (self.keys[lane], self.indices_reversed[lane]) = (sampler.key, sampler.index_reversed);
    }

    /// What [`Sampler::next_1d`] gives at a dimension, by lane.
    #[inline(always)]
    #[must_use]
    pub fn numbers_at(&self, dimension: u32) -> Lanes {
        let mut numbers = [0.0; LANES];
        for (lane, number) in numbers.iter_mut().enumerate() {
            *number = self.at(lane, dimension).next_1d();
        }
        numbers
    }

    /// What [`Sampler::next_2d`] gives at a dimension, by lane.
    #[inline(always)]
    #[must_use]
    pub fn points_at(&self, dimension: u32) -> Lanes2 {
        let mut points = Lanes2::ZERO;
        for lane in 0..LANES {
            points.set(lane, self.at(lane, dimension).next_2d());
        }
        points
    }

    #[inline(always)]
    fn at(&self, lane: usize, dimension: u32) -> Sampler {
        Sampler { key: self.keys[lane], index_reversed: self.indices_reversed[lane], dimension }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::chi_square;

    fn point(pixel: [u32; 2], sample: u32, dimension: u32) -> Vec2 {
        Sampler::new(pixel, sample, 7).at_dimension(dimension).next_2d()
    }

    /// Whether 2^k points fall into different cells of every 2^a x 2^(k-a) grid.
    fn is_stratified(points: &[Vec2]) -> bool {
        let k = points.len().trailing_zeros();
        (0..=k).all(|a| {
            let (nx, ny) = (1_usize << a, 1_usize << (k - a));
            let mut cells: Vec<usize> = points
                .iter()
                .map(|p| (p.x * nx as f32) as usize + nx * ((p.y * ny as f32) as usize))
                .collect();
            cells.sort_unstable();
            cells.iter().copied().eq(0..points.len())
        })
    }

    #[test]
    fn aligned_runs_are_stratified_on_every_grid() {
        for pixel in [[0, 0], [1, 0], [1919, 1079]] {
            for dimension in [0, 1, 5, 40] {
                for (k, run) in [(0, 3), (1, 0), (4, 0), (6, 5), (8, 1), (10, 0)] {
                    let points: Vec<Vec2> =
                        (0..1_u32 << k).map(|i| point(pixel, (run << k) + i, dimension)).collect();
                    assert!(is_stratified(&points), "{pixel:?} {dimension} {k} {run}");
                }
            }
        }
        let mut rng = crate::rng::Rng::new(3);
        let random: Vec<Vec2> = (0..64).map(|_| rng.next_2d()).collect();
        assert!(!is_stratified(&random), "negative control");
    }

    #[test]
    fn numbers_are_uniform_across_pixels() {
        let mut counts = vec![0.0; 256];
        for pixel in 0..65_536_u32 {
            let p = point([pixel % 256, pixel / 256], 5, 2);
            assert!(p.cmpge(Vec2::ZERO).all() && p.cmplt(Vec2::ONE).all());
            counts[(p.x * 16.0) as usize + 16 * (p.y * 16.0) as usize] += 1.0;
        }
        assert!(chi_square(&counts, &[256.0; 256]).p > 1e-3);
    }

    /// Correlation of two series of numbers in [0, 1).
    fn correlation(pairs: impl Iterator<Item = (f32, f32)>) -> f64 {
        let (mut n, mut sum) = (0.0, 0.0);
        for (a, b) in pairs {
            n += 1.0;
            sum += (f64::from(a) - 0.5) * (f64::from(b) - 0.5);
        }
        sum / n * 12.0
    }

    #[test]
    fn pixels_and_dimensions_are_uncorrelated() {
        let n = 128_u32;
        let pixels = || (0..n * n).map(|i| [i % n, i / n]);
        for sample in [0, 1, 13] {
            let next_pixel = correlation(
                pixels().map(|[x, y]| (point([x, y], sample, 0).x, point([x + 1, y], sample, 0).x)),
            );
            let next_dimension =
                correlation(pixels().map(|p| (point(p, sample, 0).x, point(p, sample, 1).x)));
            let axes = correlation(pixels().map(|p| {
                let u = point(p, sample, 3);
                (u.x, u.y)
            }));
            for c in [next_pixel, next_dimension, axes] {
                assert!(c.abs() < 4.0 / f64::from(n), "{c}");
            }
        }
        // Within a pixel, over samples: two dimensions together must fill the square like independent numbers.
        let mut counts = vec![0.0; 64];
        for i in 0..65_536_u32 {
            let (pixel, sample) = ([i / 64, 9], i % 64);
            let cell =
                (point(pixel, sample, 0).x * 8.0) as usize + 8 * (point(pixel, sample, 1).x * 8.0) as usize;
            counts[cell] += 1.0;
        }
        let worst = counts.iter().map(|c: &f64| (c / 1024.0 - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 0.2, "{worst}");
        let same = correlation(pixels().map(|p| (point(p, 0, 0).x, point(p, 0, 0).x)));
        assert!(same > 0.9, "negative control");
    }

    /// Root mean square error over pixels of the mean of f over n samples; f is smooth with an edge.
    fn integration_error(n: u32) -> f64 {
        let exact = std::f64::consts::FRAC_PI_4;
        let square: f64 = (0..200)
            .map(|pixel| {
                let inside = (0..n).filter(|&s| point([pixel, 3], s, 1).length_squared() < 1.0).count();
                (inside as f64 / f64::from(n) - exact).powi(2)
            })
            .sum();
        (square / 200.0).sqrt()
    }

    #[test]
    fn error_falls_faster_than_random() {
        let (few, many) = (integration_error(16), integration_error(4096));
        // Random sampling: a factor of 16. A (0,2)-sequence on a disc's edge: n^-3/4, a factor of 64.
        assert!(few / many > 40.0, "{few} {many}");
    }

    #[test]
    fn the_state_alone_decides() {
        let mut a = Sampler::new([3, 4], 5, 6);
        let first = a.next_1d();
        let second = a.next_2d();
        let mut b = Sampler::new([3, 4], 5, 6).at_dimension(1);
        assert_eq!(b.next_2d(), second);
        assert_eq!(Sampler::new([3, 4], 5, 6).next_1d(), first);
        assert_eq!(a.at_sample(5).next_1d(), first);
        assert_ne!(Sampler::new([3, 4], 5, 8).next_1d(), first);
        let mut lanes = SamplerLanes::ZERO;
        lanes.set(9, &Sampler::new([3, 4], 5, 6).at_dimension(77));
        assert_eq!((lanes.numbers_at(0)[9], lanes.points_at(1).get(9)), (first, second));
        assert_ne!(lanes.numbers_at(1)[9], first);
        assert_eq!((a, std::mem::size_of::<Sampler>()), (b, 16));
    }
}
