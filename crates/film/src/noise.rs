//! How noisy the parts of a picture are, and which of them are done: sampling that goes where the noise is.
//!
//! The noise of a pixel is the standard error of its mean luminance (from the sums of luminances and of their squares), taken
//! relative to sqrt(L^2 + 0.01) with L that mean: the root of the relative squared error that `diff` prints as `relmse`. That
//! of a block of 16 x 16 pixels is the root of the mean of its pixels' squares. A block is done when it and its eight neighbours
//! are at or below the tolerance (the neighbours, so that a block that was lucky is not left behind, and steps between blocks
//! stay small). Errors for stopping rules by blocks: H. Dammertz et al. 2010, "A hierarchical automatic stopping condition for
//! Monte Carlo global illumination"; here from variances, since samples are no stream.

use crate::tile::LUMINANCE;
use crate::{Blocks, Film, FilmTile, Window};
use rayon::prelude::*;
use vastlight_math::Vec3;

/// Blocks are looked at when they have so many samples, and whenever they have twice as many.
const FIRST_LOOK: u32 = 16;
/// What is added to squared luminances, so that black needs no samples without end: that of `relmse`.
const FLOOR: f64 = 0.01;

/// The number of samples above `samples` at which blocks are looked at next.
#[must_use]
pub fn next_look(samples: u32) -> u32 {
    let mut look = FIRST_LOOK;
    while look <= samples {
        look *= 2;
    }
    look
}

/// Whether blocks are looked at when they have so many samples.
#[must_use]
pub fn is_look(samples: u32) -> bool {
    samples >= FIRST_LOOK && next_look(samples - 1) == samples
}

impl Film {
    /// The noise of each block of [`Blocks`], in their order; infinite where a pixel has less than two samples. The film must sum
    /// [`squares`](crate::FilmSettings::squares).
    #[must_use]
    pub fn noise(&self) -> Vec<f64> {
        let of_tile = |tile: &FilmTile| {
            let squares = tile.window().tiles(Blocks::EDGE);
            squares.map(|square| ((square.y0, square.x0), block_noise(tile, square))).collect::<Vec<_>>()
        };
        let mut found: Vec<((u32, u32), f64)> = self.tiles().par_iter().flat_map_iter(of_tile).collect();
        found.sort_unstable_by_key(|&(place, _)| place);
        found.into_iter().map(|(_, noise)| noise).collect()
    }
}

fn block_noise(tile: &FilmTile, block: Window) -> f64 {
    let pixels = (block.y0..block.y1).flat_map(|y| (block.x0..block.x1).map(move |x| (x, y)));
    let sum: f64 = pixels.filter_map(|(x, y)| tile.window().index(x, y)).map(|i| pixel_noise(tile, i)).sum();
    (sum / block.pixels() as f64).sqrt()
}

/// The squared relative standard error of a pixel.
fn pixel_noise(tile: &FilmTile, i: usize) -> f64 {
    let (count, Some(squares)) = (tile.samples[i], tile.squares.get(i)) else { return f64::INFINITY };
    if count < 2 {
        return f64::INFINITY;
    }
    let [r, g, b] = tile.color[i].map(|sum| sum.mean_f64(count));
    let Vec3 { x, y, z } = LUMINANCE;
    let mean = f64::from(x) * r + f64::from(y) * g + f64::from(z) * b;
    let variance_of_mean = (squares.mean_f64(count) - mean * mean).max(0.0) / f64::from(count - 1);
    variance_of_mean / (mean * mean + FLOOR)
}

/// Stops the blocks that are done, given the noise of all.
pub(crate) fn stop_quiet(blocks: &mut Blocks, noise: &[f64], tolerance: f64) {
    let columns = blocks.columns();
    let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    let rows = noise.len() / columns.max(1);
    let is_quiet = |block: usize| {
        let (column, row) = (block % columns, block / columns);
        let mut near = around(row, rows).flat_map(|y| around(column, columns).map(move |x| y * columns + x));
        near.all(|block| noise[block] <= tolerance)
    };
    (0..noise.len()).filter(|&block| is_quiet(block)).for_each(|block| blocks.stop(block));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aov, FilmSettings, PixelSample};
    use vastlight_math::{Rng, rng::hash_words};

    #[test]
    fn looks_are_at_doubling_counts() {
        let looks: Vec<u32> = (0..200).filter(|&n| is_look(n)).collect();
        assert_eq!(looks, [16, 32, 64, 128]);
        assert_eq!([0, 15, 16, 31, 32].map(next_look), [16, 16, 32, 32, 64]);
    }

    /// A film of uniform noise of half-width `spread` around `mean`, left of x = 48; constant on the right.
    fn noisy(mean: f32, spread: f32, samples: u32, seed: u32) -> Film {
        let window = Window { x0: 5, y0: 3, x1: 100, y1: 70 };
        let settings = FilmSettings {
            full_size: [128, 128],
            window,
            tile_size: 32,
            aovs: Vec::<Aov>::new(),
            squares: true,
        };
        let mut film = Film::new(settings);
        for tile in film.tiles_mut() {
            let w = tile.window();
            for (x, y) in (w.y0..w.y1).flat_map(|y| (w.x0..w.x1).map(move |x| (x, y))) {
                let mut random = Rng::new(hash_words(&[x, y, seed]));
                for _ in 0..samples {
                    let spread = if x < 48 { spread } else { 0.0 };
                    let radiance = Vec3::splat(mean + spread * (2.0 * random.next_1d() - 1.0));
                    tile.add(x, y, &PixelSample { radiance, ..PixelSample::default() });
                }
            }
        }
        film
    }

    #[test]
    fn noise_is_the_relative_standard_error() {
        for (mean, spread, samples) in [(1.0, 0.5, 16), (0.2, 0.2, 64), (0.0, 0.3, 100)] {
            let film = noisy(mean, spread, samples, 7);
            let noise = film.noise();
            let blocks = Blocks::new(film.settings().window);
            assert_eq!(noise.len(), blocks.windows().len());
            // The variance of a uniform number is a third of its half-width's square.
            let variance = f64::from(spread).powi(2) / 3.0 / f64::from(samples);
            let expected = (variance / (f64::from(mean).powi(2) + FLOOR)).sqrt();
            for (window, noise) in blocks.windows().iter().zip(&noise) {
                if window.x0 >= 48 {
                    assert!(*noise < 1e-3, "{noise}");
                } else if window.pixels() > 100 {
                    assert!((noise / expected - 1.0).abs() < 0.15, "{noise} and {expected}");
                }
            }
        }
    }

    #[test]
    fn quiet_blocks_stop_unless_a_neighbour_is_loud() {
        let film = noisy(1.0, 0.5, 16, 1);
        let mut blocks = Blocks::new(film.settings().window);
        stop_quiet(&mut blocks, &film.noise(), 0.02);
        for (block, window) in blocks.windows().iter().enumerate() {
            assert_eq!(blocks.is_stopped(block), window.x0 >= 64, "{window:?}");
        }
        stop_quiet(&mut blocks, &film.noise(), 1.0);
        assert_eq!(blocks.going_on(), 0);
        let mut none = Blocks::new(film.settings().window);
        stop_quiet(&mut none, &noisy(1.0, 0.5, 1, 1).noise(), 1e9);
        assert_eq!(none.going_on(), none.windows().len(), "one sample says nothing");
    }
}
