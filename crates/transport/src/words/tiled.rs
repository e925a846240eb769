//! Textures in tiles for a device: those of a store as they are, those in memory cut alike.

use crate::texture::PreparedTexture;
use std::collections::BTreeMap;
use std::sync::Arc;
use vastlight_scene::{Image, Scene, texture_uses};
use vastlight_store::{TILE_BYTES, TileGrid};

/// Where the texels of a texture are.
#[derive(Clone, Debug)]
pub(super) struct TiledTexture {
    pub(super) grid: Arc<TileGrid>,
    /// Levels that are looked up, the image first.
    pub(super) levels: usize,
    /// Whether its tiles stay on the device.
    pub(super) kept: bool,
}

/// An image in memory and its pyramid, to be cut.
#[derive(Debug)]
pub(super) struct Tiled<'a> {
    grid: Arc<TileGrid>,
    levels: Vec<&'a Image>,
}

/// All textures in tiles; images that have to be cut are appended to the tiles, or to those that are kept: what hits and light depend
/// on, and of a scene in a store all that is in memory.
pub(super) fn all<'a>(
    scene: &Scene,
    textures: &'a [PreparedTexture<'_>],
    is_stored: bool,
    [tiles, kept]: [&mut Vec<Tiled<'a>>; 2],
) -> Vec<TiledTexture> {
    let uses = texture_uses(scene.materials(), scene.textures());
    let key = |texture: &PreparedTexture<'_>| {
        (std::ptr::from_ref(texture.image).addr(), texture.smaller.as_ptr().addr(), texture.smaller.len())
    };
    let mut exact: BTreeMap<_, bool> = BTreeMap::new();
    for (texture, found) in textures.iter().zip(&uses) {
        *exact.entry(key(texture)).or_default() |= found.exact || is_stored;
    }
    let mut known: BTreeMap<_, TiledTexture> = BTreeMap::new();
    let place = |texture: &'a PreparedTexture<'_>| {
        if let Some(grid) = &texture.tiles {
            return TiledTexture { grid: grid.clone(), levels: grid.levels().len(), kept: false };
        }
        let made = known.entry(key(texture)).or_insert_with(|| {
            let is_kept = exact[&key(texture)];
            let list = if is_kept { &mut *kept } else { &mut *tiles };
            let first_page = list.last().map_or(0, |last| last.first_page() + last.pages());
            // An image of a size that cannot be is white.
            let Some(tiled) = Tiled::new(texture, first_page) else {
                return TiledTexture { grid: Arc::default(), levels: 0, kept: true };
            };
            let place = TiledTexture { grid: tiled.grid.clone(), levels: tiled.levels.len(), kept: is_kept };
            list.push(tiled);
            place
        });
        made.clone()
    };
    textures.iter().map(place).collect()
}

impl<'a> Tiled<'a> {
    fn new(texture: &'a PreparedTexture<'_>, first_page: u32) -> Option<Self> {
        let image = texture.image;
        let edge = TileGrid::edge_of(TILE_BYTES, image.channels, &image.texels);
        let grid = TileGrid::new(image.width, image.height, edge, first_page)?;
        let levels = std::iter::once(image).chain(texture.smaller.iter()).collect();
        Some(Self { grid: Arc::new(grid), levels })
    }

    pub(super) fn first_page(&self) -> u32 {
        self.grid.first_page()
    }

    pub(super) fn pages(&self) -> u32 {
        self.grid.pages()
    }

    fn texel_bytes(&self) -> usize {
        let image = self.levels[0];
        usize::from(image.channels.clamp(1, 4)) * image.texels.number_bytes()
    }

    /// Bytes of a page, in whole words.
    pub(super) fn slot_bytes(&self) -> u32 {
        ((self.texel_bytes() << (2 * self.grid.edge())).next_multiple_of(4)) as u32
    }

    /// All pages.
    pub(super) fn all(&self) -> impl Iterator<Item = Vec<u8>> {
        (self.first_page()..self.first_page() + self.pages()).map(|page| self.page(page))
    }

    /// The bytes of a page.
    pub(super) fn page(&self, page: u32) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.slot_bytes() as usize);
        let (grid, edge) = (&self.grid, self.grid.edge());
        let levels = grid.levels();
        if page + 1 == self.first_page() + self.pages() {
            for (level, image) in levels.iter().zip(&self.levels).skip(grid.tail()) {
                (0..level.height).for_each(|row| self.put_row(image, (0, row), level.width, &mut bytes));
            }
            return bytes;
        }
        let number = levels[..grid.tail()].partition_point(|level| level.page <= page).saturating_sub(1);
        let (level, Some(image)) = (&levels[number], self.levels.get(number)) else { return bytes };
        let (x, y) = ((page - level.page) % level.across, (page - level.page) / level.across);
        for row in y << edge..((y + 1) << edge).min(level.height) {
            self.put_row(image, (x << edge, row), 1 << edge, &mut bytes);
        }
        bytes
    }

    /// Appends so many texels of an image from a place on; what it does not have is zero.
    fn put_row(&self, image: &Image, (column, row): (u32, u32), count: u32, bytes: &mut Vec<u8>) {
        let end = bytes.len() + count as usize * self.texel_bytes();
        let numbers = usize::from(image.channels.clamp(1, 4));
        let there = image.width.saturating_sub(column).min(count) as usize;
        let first = row as usize * image.width as usize + column as usize;
        image.texels.append_bytes(first * numbers..(first + there) * numbers, bytes);
        bytes.resize(end, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_scene::{Content, Encoding, TexelReader, Texels, Texture, pyramid};

    #[test]
    fn every_texel_of_a_pyramid_is_where_its_grid_says() {
        for (width, height, channels) in [(70, 41, 4), (3, 300, 3), (1, 1, 1), (33, 5, 2)] {
            let count = width as usize * height as usize * usize::from(channels);
            let words: Vec<u16> =
                (0..count as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
            for texels in [
                Texels::U8(words.iter().map(|&w| w as u8).collect()),
                Texels::F32(words.iter().map(|&w| f32::from(w)).collect()),
                Texels::U16(words.clone()),
            ] {
                let image = Image { name: String::new(), width, height, channels, texels };
                let levels = pyramid(&image, Content::Data);
                let texture = PreparedTexture::new(&Texture::new(0, Encoding::Linear), &image);
                let texture = PreparedTexture { smaller: levels.clone().into(), ..texture };
                let tiled = Tiled::new(&texture, 5).expect("a size");
                let reader = TexelReader::new(Encoding::Linear);
                for (number, level) in std::iter::once(&image).chain(&levels).enumerate() {
                    for i in 0..level.width * level.height {
                        let (page, texel) = tiled.grid.place(number, i % level.width, i / level.width);
                        let bytes = tiled.page(page);
                        assert!(bytes.len() <= tiled.slot_bytes() as usize);
                        let found = reader.read_bytes(&image.texels, channels, &bytes, texel);
                        assert_eq!(found, reader.read(&level.texels, channels, i as usize), "{number}: {i}");
                    }
                }
            }
        }
    }
}
