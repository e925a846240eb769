//! Where the texels of an image's pyramid are: square tiles of each level, and one last page for all small levels.

use std::sync::Arc;
use vastlight_scene::{Content, Image, Texels, level_sizes};

/// Bytes of a tile unless another size is asked for.
pub const TILE_BYTES: usize = 4096;
/// Largest edge of a tile, as a power of two.
pub(crate) const MOST_EDGE: u32 = 10;

/// Most texels of an image that is believed.
const MOST_TEXELS: u64 = 1 << 48;

/// An image whose texels are in tiles.
#[derive(Clone, Debug)]
pub struct StoredTexture {
    /// Number of the image.
    pub image: u32,
    /// What its numbers are.
    pub content: Content,
    /// Where its texels are.
    pub grid: Arc<TileGrid>,
}

/// Where the texels of a pyramid are.
///
/// Levels have tiles row by row, and levels follow each other. From the first level on whose texels fit into one tile together with
/// those of all levels above it, all are in one page, row by row.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TileGrid {
    levels: Vec<Level>,
    /// Edge of a tile in texels, as a power of two.
    edge: u32,
    /// The level number from which on all are in the last page.
    tail: usize,
    first_page: u32,
    pages: u32,
}

/// A level of a pyramid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Tiles of a row of tiles.
    pub across: u32,
    /// The page of its first tile, or the last page.
    pub page: u32,
    /// Its first texel there.
    pub texel: u32,
}

impl TileGrid {
    /// The grid of an image of this size, with tiles of `2^edge` texels a side; its pages start at `first_page`. None where numbers are
    /// too large to be believed.
    #[must_use]
    pub fn new(width: u32, height: u32, edge: u32, first_page: u32) -> Option<Self> {
        let texels = u64::from(width) * u64::from(height);
        if texels == 0 || texels > MOST_TEXELS || edge > MOST_EDGE {
            return None;
        }
        let sizes = level_sizes(width, height);
        let tile = 1_u64 << (2 * edge);
        let area = |&[w, h]: &[u32; 2]| u64::from(w) * u64::from(h);
        let fits = |&level: &usize| sizes[level..].iter().map(area).sum::<u64>() <= tile;
        let tail = (0..sizes.len()).find(fits).unwrap_or(sizes.len() - 1);
        let (mut page, mut texel) = (u64::from(first_page), 0_u32);
        let mut levels = Vec::with_capacity(sizes.len());
        for (number, size) in sizes.iter().enumerate() {
            let [width, height] = *size;
            let across = width.div_ceil(1 << edge);
            levels.push(Level { width, height, across, page: u32::try_from(page).ok()?, texel });
            if number < tail {
                page += u64::from(across) * u64::from(height.div_ceil(1 << edge));
            } else {
                texel += area(size) as u32;
            }
        }
        let end = u32::try_from(page + 1).ok()?;
        Some(Self { levels, edge, tail, first_page, pages: end - first_page })
    }

    /// The largest edge of a tile of at most `bytes`, as a power of two.
    #[must_use]
    pub fn edge_of(bytes: usize, channels: u8, texels: &Texels) -> u32 {
        let texel = usize::from(channels.clamp(1, 4)) * texels.number_bytes();
        (0..=MOST_EDGE).rev().find(|&edge| texel << (2 * edge) <= bytes).unwrap_or(0)
    }

    /// The levels, the image itself first.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The first page.
    #[must_use]
    pub fn first_page(&self) -> u32 {
        self.first_page
    }

    /// How many pages there are.
    #[must_use]
    pub fn pages(&self) -> u32 {
        self.pages
    }

    /// Edge of a tile in texels, as a power of two.
    #[must_use]
    pub fn edge(&self) -> u32 {
        self.edge
    }

    /// The first level that is in the last page.
    #[must_use]
    pub fn tail(&self) -> usize {
        self.tail
    }

    /// The page of a texel and its number there. The texel must exist.
    #[inline(always)]
    #[must_use]
    pub fn place(&self, level: usize, column: u32, row: u32) -> (u32, usize) {
        let Level { width, across, page, texel, .. } = self.levels[level];
        if level >= self.tail {
            return (page, (texel + row * width + column) as usize);
        }
        let mask = (1 << self.edge) - 1;
        let tile = (row >> self.edge) * across + (column >> self.edge);
        (page + tile, (((row & mask) << self.edge) + (column & mask)) as usize)
    }
}

/// Whether an image is worth tiles.
#[must_use]
pub fn is_worth_tiles(image: &Image, tile_bytes: usize) -> bool {
    image.whole_bytes() > 4 * tile_bytes as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No two texels are in the same place, and all places are in the pages.
    #[test]
    fn every_texel_has_a_place_of_its_own() {
        for (width, height, edge) in
            [(64, 64, 3), (65, 33, 3), (7, 100, 2), (1, 1, 5), (300, 1, 2), (8, 8, 3), (9, 9, 0)]
        {
            let grid = TileGrid::new(width, height, edge, 7).expect("small");
            let mut taken = vec![false; (grid.pages() as usize) << (2 * edge)];
            for (number, level) in grid.levels().iter().enumerate() {
                for (column, row) in (0..level.height).flat_map(|y| (0..level.width).map(move |x| (x, y))) {
                    let (page, texel) = grid.place(number, column, row);
                    assert!(texel < 1 << (2 * edge) && page >= 7, "{width} {height} {edge}");
                    let place = (((page - 7) as usize) << (2 * edge)) + texel;
                    assert!(!std::mem::replace(&mut taken[place], true), "{number}: {column} {row}");
                }
            }
            let used = taken.iter().filter(|&&taken| taken).count();
            assert_eq!(used as u32, grid.levels().iter().map(|l| l.width * l.height).sum::<u32>());
        }
    }

    #[test]
    fn sizes_that_cannot_be_are_refused() {
        assert!(TileGrid::new(0, 5, 3, 0).is_none() && TileGrid::new(5, 5, 11, 0).is_none());
        assert!(TileGrid::new(u32::MAX, u32::MAX, 3, 0).is_none());
        assert!(TileGrid::new(5, 5, 3, u32::MAX).is_none());
        let edges = [(4096, 4), (4096, 3), (4095, 4), (1, 1), (0, 4)]
            .map(|(bytes, channels)| TileGrid::edge_of(bytes, channels, &Texels::U8(Vec::new())));
        assert_eq!(edges, [5, 5, 4, 0, 0]);
    }
}
