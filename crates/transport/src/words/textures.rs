//! Textures as words: a record for each, a record for each of their levels, and the texels as they are stored.

use super::Words;
use crate::texture::PreparedTexture;
use std::collections::BTreeMap;
use vastlight_scene::{Filter, Image, Texels, Wrap};

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

/// Words of a level: the word of the texels where it begins, width, height, channels, bytes of a number.
pub const LEVEL_WORDS: usize = 5;

/// Appends the textures to `tables` and their texels to `texels`. The levels come first; gives where the textures begin.
pub(crate) fn put(tables: &mut Words, texels: &mut Words, textures: &[PreparedTexture<'_>]) -> u32 {
    let mut known: BTreeMap<usize, u32> = BTreeMap::new();
    let levels: Vec<u32> = textures
        .iter()
        .map(|texture| {
            let first = tables.offset();
            for image in std::iter::once(texture.image).chain(texture.smaller.iter()) {
                let start = *known
                    .entry(std::ptr::from_ref(image).addr())
                    .or_insert_with(|| put_texels(texels, image));
                tables.u32s(&[start, image.width, image.height, u32::from(image.channels.clamp(1, 4))]);
                tables.u32(image.texels.number_bytes() as u32);
            }
            first
        })
        .collect();
    let first = tables.offset();
    for (texture, levels) in textures.iter().zip(levels) {
        put_texture(tables, texture, levels);
    }
    first
}

fn put_texture(tables: &mut Words, texture: &PreparedTexture<'_>, levels: u32) {
    texture.matrix.iter().for_each(|row| tables.f32s(row));
    tables.f32(texture.texels);
    tables.u32s(&texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }));
    tables.u32(u32::from(texture.filter == Filter::Nearest));
    tables.u32(u32::from(texture.reader.is_srgb()));
    tables.u32s(&[texture.uv_set, levels, 1 + texture.smaller.len() as u32]);
}

/// Appends the numbers of an image's texels; white ones where it has too few. Gives where they begin.
fn put_texels(words: &mut Words, image: &Image) -> u32 {
    let first = words.offset();
    let numbers = image.width as usize * image.height as usize * usize::from(image.channels.clamp(1, 4));
    match &image.texels {
        Texels::U8(data) => put_bytes(words, padded(data, numbers, u8::MAX)),
        Texels::U16(data) => put_bytes(words, padded(data, numbers, u16::MAX).flat_map(u16::to_le_bytes)),
        Texels::F32(data) => {
            let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
            padded(data, numbers, 1.0).for_each(|x| words.f32(finite(x)));
        }
    }
    first
}

fn padded<T: Copy>(data: &[T], count: usize, with: T) -> impl Iterator<Item = T> {
    data.iter().copied().chain(std::iter::repeat(with)).take(count)
}

fn put_bytes(words: &mut Words, mut bytes: impl Iterator<Item = u8>) {
    while let Some(first) = bytes.next() {
        let rest: [u8; 3] = std::array::from_fn(|_| bytes.next().unwrap_or(0));
        words.u32(u32::from_le_bytes([first, rest[0], rest[1], rest[2]]));
    }
}
