//! How many samples the parts of a picture have: squares of 16 pixels on the grid of the whole picture, whatever the tiles are.

use crate::Window;

/// Counts of samples, and which squares want no more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Blocks {
    window: Window,
    /// Row by row: samples of each pixel, and [`Blocks::STOPPED`].
    words: Vec<u32>,
}

impl Blocks {
    /// Edge of a square in pixels.
    pub const EDGE: u32 = 16;
    /// Set in the word of a square that wants no more samples.
    pub(crate) const STOPPED: u32 = 1 << 31;

    /// The squares of a window, without samples.
    #[must_use]
    pub fn new(window: Window) -> Self {
        let words = vec![0; window.tiles(Self::EDGE).count()];
        Self { window, words }
    }

    /// How many squares a window has.
    pub(crate) fn count_of(window: Window) -> u64 {
        let count =
            |low: u32, high: u32| u64::from(high.div_ceil(Self::EDGE).saturating_sub(low / Self::EDGE));
        count(window.x0, window.x1) * count(window.y0, window.y1)
    }

    /// The same with words from a file.
    pub(crate) fn with_words(window: Window, words: Vec<u32>) -> Self {
        Self { window, words }
    }

    pub(crate) fn words(&self) -> &[u32] {
        &self.words
    }

    /// The squares, row by row; those at the edges of the window are cut.
    #[must_use]
    pub fn windows(&self) -> Vec<Window> {
        self.window.tiles(Self::EDGE).collect()
    }

    /// Columns of the grid.
    #[must_use]
    pub fn columns(&self) -> usize {
        let [first, last] = [self.window.x0 / Self::EDGE, self.window.x1.div_ceil(Self::EDGE)];
        last.saturating_sub(first) as usize
    }

    /// Samples of each pixel of a square.
    #[must_use]
    pub fn count(&self, block: usize) -> u32 {
        self.words[block] & !Self::STOPPED
    }

    /// Whether a square wants no more samples.
    #[must_use]
    pub fn is_stopped(&self, block: usize) -> bool {
        self.words[block] & Self::STOPPED != 0
    }

    /// Takes a square out of all passes to come.
    pub fn stop(&mut self, block: usize) {
        self.words[block] |= Self::STOPPED;
    }

    /// How many squares want more samples.
    #[must_use]
    pub fn going_on(&self) -> usize {
        (0..self.words.len()).filter(|&block| !self.is_stopped(block)).count()
    }

    /// Samples that every pixel has.
    #[must_use]
    pub fn least(&self) -> u32 {
        (0..self.words.len()).map(|block| self.count(block)).min().unwrap_or(0)
    }

    /// Samples of all pixels together.
    #[must_use]
    pub fn samples(&self) -> u64 {
        let each = self.window.tiles(Self::EDGE).enumerate();
        each.map(|(block, window)| window.pixels() as u64 * u64::from(self.count(block))).sum()
    }

    /// Pixels that want more samples.
    #[must_use]
    pub fn pixels_going_on(&self) -> u64 {
        let each = self.window.tiles(Self::EDGE).enumerate();
        let going_on = each.filter(|&(block, _)| !self.is_stopped(block));
        going_on.map(|(_, window)| window.pixels() as u64).sum()
    }

    /// Rectangles that cover the squares within `tile` that go on and have exactly `count` samples: rows of neighbours, and those
    /// of the same columns together. `tile` is made of whole squares.
    #[must_use]
    pub fn waiting(&self, tile: Window, count: u32) -> Vec<Window> {
        let mut found: Vec<Window> = Vec::new();
        for square in tile.tiles(Self::EDGE).filter(|square| self.at(square) == count) {
            match found.last_mut() {
                Some(row) if row.y0 == square.y0 && row.x1 == square.x0 => row.x1 = square.x1,
                _ => found.push(square),
            }
        }
        let mut joined: Vec<Window> = Vec::new();
        for row in found {
            let above = joined.iter_mut().find(|w| w.y1 == row.y0 && (w.x0, w.x1) == (row.x0, row.x1));
            match above {
                Some(above) => above.y1 = row.y1,
                None => joined.push(row),
            }
        }
        joined
    }

    /// Counts further samples of the squares in `windows`, which [`Blocks::waiting`] gave.
    pub fn add(&mut self, windows: &[Window], samples: u32) {
        for square in windows.iter().flat_map(|window| window.tiles(Self::EDGE)) {
            let block = self.index(&square);
            self.words[block] += samples;
        }
    }

    /// Samples of each pixel of a tile, rows from the top.
    pub(crate) fn counts_in(&self, tile: Window) -> impl Iterator<Item = u32> + '_ {
        let count = move |(x0, y0)| self.at(&Window { x0, y0, x1: x0, y1: y0 }) & !Self::STOPPED;
        (tile.y0..tile.y1).flat_map(move |y| (tile.x0..tile.x1).map(move |x| (x, y))).map(count)
    }

    fn at(&self, square: &Window) -> u32 {
        self.words[self.index(square)]
    }

    fn index(&self, square: &Window) -> usize {
        let [column, row] = [
            square.x0 / Self::EDGE - self.window.x0 / Self::EDGE,
            square.y0 / Self::EDGE - self.window.y0 / Self::EDGE,
        ];
        row as usize * self.columns() + column as usize
    }

    /// Adds the counts of the same squares, none of which is stopped.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(a, &b)| *a += b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rectangles_cover_what_waits_once(
            origin in prop::array::uniform2(0_u32..50), size in prop::array::uniform2(1_u32..120),
            stopped in prop::collection::vec(any::<prop::sample::Index>(), 0..40), scale in 1_u32..5,
        ) {
            let [x0, y0] = origin;
            let window = Window { x0, y0, x1: x0 + size[0], y1: y0 + size[1] };
            let mut blocks = Blocks::new(window);
            let squares = blocks.windows();
            prop_assert_eq!(blocks.columns(), squares.iter().filter(|s| s.y0 == y0).count());
            stopped.iter().for_each(|i| blocks.stop(i.index(squares.len())));
            let tiles: Vec<Window> = window.tiles(scale * Blocks::EDGE).collect();
            let mut seen = vec![0; window.pixels()];
            for tile in tiles {
                let waiting = blocks.waiting(tile, 0);
                for rectangle in &waiting {
                    for (x, y) in (rectangle.y0..rectangle.y1).flat_map(|y| (rectangle.x0..rectangle.x1).map(move |x| (x, y))) {
                        seen[window.index(x, y).expect("inside")] += 1;
                    }
                }
                blocks.add(&waiting, 3);
            }
            for (i, square) in squares.iter().enumerate() {
                let expected = u32::from(!blocks.is_stopped(i));
                prop_assert_eq!(blocks.count(i), 3 * expected);
                prop_assert_eq!(seen[window.index(square.x0, square.y0).expect("inside")], expected);
            }
            prop_assert_eq!(seen.iter().map(|&n| u64::from(n)).sum::<u64>(), blocks.pixels_going_on());
            prop_assert_eq!(3 * blocks.pixels_going_on(), blocks.samples());
        }
    }

    #[test]
    fn a_whole_tile_is_one_rectangle() {
        let window = Window::whole(100, 70);
        assert_eq!(Blocks::new(window).waiting(window, 0), [window]);
    }
}
