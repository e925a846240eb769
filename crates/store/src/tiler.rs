//! From the rows of an image to tiles of all levels of its pyramid, a strip of each level in memory at a time.

use crate::tiles::TileGrid;
use vastlight_scene::{Content, PyramidRows, Texels};

/// Cuts an image that comes row by row.
#[derive(Debug)]
pub(crate) struct Tiler {
    grid: TileGrid,
    texel_bytes: usize,
    rows: PyramidRows,
    strips: Vec<Strip>,
    last: Vec<u8>,
}

/// Rows of a level that are not cut yet.
#[derive(Debug, Default)]
struct Strip {
    bytes: Vec<u8>,
    /// Rows that came, those of earlier strips included.
    rows: u32,
}

impl Tiler {
    pub(crate) fn new(grid: TileGrid, channels: u8, kind: &Texels, content: Content) -> Self {
        let levels = grid.levels();
        let rows = PyramidRows::new(levels[0].width, levels[0].height, channels, content);
        let strips = levels.iter().map(|_| Strip::default()).collect();
        let texel_bytes = usize::from(channels.clamp(1, 4)) * kind.number_bytes();
        Self { grid, texel_bytes, rows, strips, last: Vec::new() }
    }

    /// Takes the next row; `each` gets numbers of pages and their bytes.
    pub(crate) fn push<E>(
        &mut self,
        row: &Texels,
        mut each: impl FnMut(u32, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self { grid, texel_bytes, rows, strips, last } = self;
        let mut cut = Cut { grid, texel_bytes: *texel_bytes, strips, last };
        cut.add(0, row, &mut each)?;
        let mut outcome = Ok(());
        rows.push(row, |level, row| {
            if outcome.is_ok() {
                outcome = cut.add(level, row, &mut each);
            }
        });
        outcome
    }

    /// The last page.
    pub(crate) fn last(&self) -> (u32, &[u8]) {
        (self.grid.first_page() + self.grid.pages() - 1, &self.last)
    }
}

/// The parts of a tiler that rows are put into.
struct Cut<'t> {
    grid: &'t TileGrid,
    texel_bytes: usize,
    strips: &'t mut [Strip],
    last: &'t mut Vec<u8>,
}

impl Cut<'_> {
    fn add<E>(
        &mut self,
        number: usize,
        row: &Texels,
        each: &mut impl FnMut(u32, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (level, strip) = (self.grid.levels()[number], &mut self.strips[number]);
        row.append_bytes(0..row.len(), &mut strip.bytes);
        strip.rows += 1;
        if number >= self.grid.tail() {
            let (_, first) = self.grid.place(number, 0, strip.rows - 1);
            let (start, end) = (first * self.texel_bytes, (first + level.width as usize) * self.texel_bytes);
            self.last.resize(self.last.len().max(end), 0);
            self.last[start..end].copy_from_slice(&strip.bytes);
            strip.bytes.clear();
            return Ok(());
        }
        let edge = 1_u32 << self.grid.edge();
        if !strip.rows.is_multiple_of(edge) && strip.rows < level.height {
            return Ok(());
        }
        let pitch = level.width as usize * self.texel_bytes;
        let width = edge as usize * self.texel_bytes;
        let mut tile = Vec::new();
        for x in 0..level.across {
            tile.clear();
            for row in strip.bytes.chunks_exact(pitch) {
                let part = &row[x as usize * width..((x as usize + 1) * width).min(pitch)];
                tile.extend(part);
                tile.resize(tile.len() + width - part.len(), 0);
            }
            each(self.grid.place(number, x * edge, strip.rows - 1).0, &tile)?;
        }
        strip.bytes.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use vastlight_math::Vec4;
    use vastlight_scene::{Encoding, Image, TexelReader, pyramid};

    /// Every texel of every level is in its place, with the bytes that the pyramid in memory has.
    #[test]
    fn tiles_hold_the_pyramid() {
        for (width, height, channels, edge) in
            [(64, 64, 4, 3), (65, 33, 3, 3), (5, 100, 1, 2), (1, 1, 3, 2), (100, 3, 2, 4), (3, 3, 4, 2)]
        {
            let count = width as usize * height as usize * usize::from(channels);
            let words = (0..count as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
            let image = Image { name: String::new(), width, height, channels, texels: Texels::U16(words) };
            let grid = TileGrid::new(width, height, edge, 3).expect("small");
            let mut tiler = Tiler::new(grid.clone(), channels, &image.texels, Content::Color);
            let mut pages = BTreeMap::new();
            let row = width as usize * usize::from(channels);
            for y in 0..height as usize {
                let mut texels = image.texels.none_like();
                texels.append(&image.texels, y * row..(y + 1) * row);
                let put = |page, bytes: &[u8]| {
                    assert!(pages.insert(page, bytes.to_vec()).is_none());
                    Ok::<(), ()>(())
                };
                tiler.push(&texels, put).expect("kept");
            }
            let (page, bytes) = tiler.last();
            assert!(pages.insert(page, bytes.to_vec()).is_none());
            assert!(pages.keys().copied().eq(3..3 + grid.pages()));
            let levels = pyramid(&image, Content::Color);
            let reader = TexelReader::new(Encoding::Srgb);
            for (number, level) in std::iter::once(&image).chain(&levels).enumerate() {
                for i in 0..level.width * level.height {
                    let (page, texel) = grid.place(number, i % level.width, i / level.width);
                    let stored = reader.read_bytes(&image.texels, channels, &pages[&page], texel);
                    let expected: Vec4 = reader.read(&level.texels, channels, i as usize);
                    assert_eq!(stored, expected, "{width}x{height} level {number}, texel {i}");
                }
            }
        }
    }

    #[test]
    fn errors_end_the_work() {
        let grid = TileGrid::new(8, 8, 2, 0).expect("small");
        let mut tiler = Tiler::new(grid, 1, &Texels::U8(Vec::new()), Content::Data);
        let row = Texels::U8(vec![1; 8]);
        let outcomes: Vec<_> = (0..4).map(|_| tiler.push(&row, |_, _| Err("full"))).collect();
        assert_eq!(outcomes, [Ok(()), Ok(()), Ok(()), Err("full")]);
    }
}
