//! Textures as words: a record for each, and a record for each of their levels; texels are in pages.

use super::Words;
use super::tiled::TiledTexture;
use crate::texture::PreparedTexture;
use std::collections::BTreeMap;
use std::sync::Arc;
use vastlight_scene::{Filter, Wrap};

/// Words of a texture.
pub const WORDS: usize = 14;
/// Rows of the map of coordinates: twice x, y, offset.
pub const MATRIX: usize = 0;
/// Texels of a unit square of coordinates.
pub const TEXELS: usize = 6;
/// How coordinates beyond the borders go on along both axes: 0 repeats, 1 mirrors, 2 stays.
pub const WRAP: usize = 7;
/// 1 where the nearest texel counts alone.
pub const NEAREST: usize = 9;
/// 1 where colours are sRGB-encoded.
pub const SRGB: usize = 10;
/// Its texture coordinate set.
pub const UV_SET: usize = 11;
/// The word of `tables` where its levels begin, the image first.
pub const LEVELS: usize = 12;
/// How many there are.
pub const LEVEL_COUNT: usize = 13;

/// Words of a level: the page of its first tile, width, height, channels, bytes of a number, tiles of a row, its first texel in
/// its page, and the edge of a tile as a power of two, [`IN_A_ROW`] for a level that is in one page row by row.
pub const LEVEL_WORDS: usize = 8;
/// See [`LEVEL_WORDS`].
pub const IN_A_ROW: u32 = 32;

/// Appends the textures, whose tiles are counted from a page on, or from another one those that stay on the device. The levels come
/// first; gives where the textures begin.
pub(super) fn put(
    tables: &mut Words,
    textures: &[PreparedTexture<'_>],
    tiled: &[TiledTexture],
    [first_tile, first_kept]: [u32; 2],
) -> u32 {
    let mut known: BTreeMap<(usize, usize), u32> = BTreeMap::new();
    let levels: Vec<u32> = textures
        .iter()
        .zip(tiled)
        .map(|(texture, tiled)| {
            let key = (Arc::as_ptr(&tiled.grid).addr(), tiled.levels);
            *known.entry(key).or_insert_with(|| {
                let first = tables.offset();
                put_levels(tables, texture, tiled, if tiled.kept { first_kept } else { first_tile });
                first
            })
        })
        .collect();
    let first = tables.offset();
    for ((texture, tiled), levels) in textures.iter().zip(tiled).zip(levels) {
        put_texture(tables, texture, levels, tiled.levels as u32);
    }
    first
}

fn put_levels(tables: &mut Words, texture: &PreparedTexture<'_>, tiled: &TiledTexture, first_page: u32) {
    let image = texture.image;
    let (channels, bytes) = (u32::from(image.channels.clamp(1, 4)), image.texels.number_bytes() as u32);
    for (number, level) in tiled.grid.levels().iter().enumerate().take(tiled.levels) {
        let edge = if number < tiled.grid.tail() { tiled.grid.edge() } else { IN_A_ROW };
        tables.u32s(&[first_page + level.page, level.width, level.height, channels, bytes]);
        tables.u32s(&[level.across, level.texel, edge]);
    }
}

fn put_texture(tables: &mut Words, texture: &PreparedTexture<'_>, levels: u32, count: u32) {
    texture.matrix.iter().for_each(|row| tables.f32s(row));
    tables.f32(texture.texels);
    tables.u32s(&texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }));
    tables.u32(u32::from(texture.filter == Filter::Nearest));
    tables.u32(u32::from(texture.reader.is_srgb()));
    tables.u32s(&[texture.uv_set, levels, count]);
}
