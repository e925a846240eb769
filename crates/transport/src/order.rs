//! The order in which a tile's pixels are rendered: blocks of 8x8, each along a Morton curve (G. Morton 1966), so that rays which
//! follow each other start and go much the same way and can share their walk.

use crate::settings::Tile;

/// Edge of a block, a power of two.
const BLOCK: u32 = 8;

/// Every pixel of `tile` once, in the order of rendering.
pub fn pixels(tile: Tile) -> impl Iterator<Item = [u32; 2]> {
    let [x0, y0] = tile.min;
    let (width, height) = (tile.width(), tile.height());
    let starts = |length: u32| (0..length).step_by(BLOCK as usize);
    starts(height)
        .flat_map(move |y| starts(width).map(move |x| [x, y]))
        .flat_map(|[x, y]| {
            (0..BLOCK * BLOCK).map(move |code| [x + even_bits(code), y + even_bits(code >> 1)])
        })
        .filter(move |&[x, y]| x < width && y < height)
        .map(move |[x, y]| [x0 + x, y0 + y])
}

/// Bits 0, 2 and 4 of `code` side by side.
const fn even_bits(code: u32) -> u32 {
    (code & 1) | (code >> 1 & 2) | (code >> 2 & 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_comes_once_and_neighbours_stay_together() {
        for (min, max) in [([3, 5], [20, 18]), ([0, 0], [16, 16]), ([7, 9], [8, 10]), ([0, 0], [33, 1])] {
            let tile = Tile { min, max };
            let order: Vec<[u32; 2]> = pixels(tile).collect();
            let mut sorted = order.clone();
            sorted.sort_unstable();
            let expected: Vec<[u32; 2]> =
                (min[0]..max[0]).flat_map(|x| (min[1]..max[1]).map(move |y| [x, y])).collect();
            assert_eq!(sorted, expected);
        }
        let order: Vec<[u32; 2]> = pixels(Tile { min: [0, 0], max: [16, 16] }).collect();
        for (i, run) in order.chunks_exact(16).enumerate() {
            let spread = |axis: usize| {
                let of = run.iter().map(|p| p[axis]);
                of.clone().max().unwrap_or(0) - of.min().unwrap_or(0)
            };
            assert_eq!([spread(0), spread(1)], [3, 3], "run {i}");
        }
    }
}
