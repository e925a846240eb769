//! Texture references of materials: samplers, KHR_texture_transform, and which image holds the texels.

use super::json::Json;
use std::collections::BTreeMap;
use vastlight_math::Vec2;
use vastlight_scene::{Encoding, Filter, Texture, TextureTransform, Wrap};

/// Textures that materials use, each combination of image, sampler, coordinates and encoding once.
#[derive(Debug, Default)]
pub(super) struct Textures {
    list: Vec<Texture>,
    /// glTF's image of each entry of the scene's image table.
    images: Vec<usize>,
    image_numbers: BTreeMap<usize, u32>,
    numbers: BTreeMap<Key, u32>,
}

type Key = (u32, u32, [u32; 5], [u8; 4]);

impl Textures {
    /// The number of a texture for a `textureInfo`; `None` if there is none, or it has no image.
    pub(super) fn add(&mut self, root: &Json<'_>, info: &Json<'_>, encoding: Encoding) -> Option<u32> {
        let texture = root.list("textures").get(info.index("index")?)?;
        let image = self.image(image_of(texture).filter(|&i| i < root.list("images").len())?);
        let sampler = texture.index("sampler").and_then(|i| root.list("samplers").get(i));
        let transform = info.extension("KHR_texture_transform");

        let texture = Texture {
            image,
            uv_set: u32::try_from(uv_set_of(info)).ok()?,
            transform: transform.map_or(TextureTransform::IDENTITY, transform_of),
            wrap: ["wrapS", "wrapT"].map(|key| wrap_of(sampler.and_then(|s| s.index(key)))),
            filter: filter_of(sampler),
            encoding,
        };
        Some(self.number(texture))
    }

    fn image(&mut self, image: usize) -> u32 {
        *self.image_numbers.entry(image).or_insert_with(|| {
            self.images.push(image);
            (self.images.len() - 1) as u32
        })
    }

    fn number(&mut self, texture: Texture) -> u32 {
        *self.numbers.entry(key(&texture)).or_insert_with(|| {
            self.list.push(texture);
            (self.list.len() - 1) as u32
        })
    }

    /// The textures, and glTF's image for each entry of the scene's image table.
    pub(super) fn finish(self) -> (Vec<Texture>, Vec<usize>) {
        (self.list, self.images)
    }
}

fn key(t: &Texture) -> Key {
    let TextureTransform { offset, rotation, scale } = t.transform;
    let numbers = [offset.x, offset.y, rotation, scale.x, scale.y].map(f32::to_bits);
    let choices = [t.wrap[0] as u8, t.wrap[1] as u8, t.filter as u8, t.encoding as u8];
    (t.image, t.uv_set, numbers, choices)
}

/// The texture coordinates of a `textureInfo`: those of its transform, if that names some.
pub(super) fn uv_set_of(info: &Json<'_>) -> usize {
    let transform = info.extension("KHR_texture_transform");
    transform.and_then(|t| t.index("texCoord")).or_else(|| info.index("texCoord")).unwrap_or(0)
}

/// The image of a texture: the extensions' before the fallback.
pub(super) fn image_of(texture: &Json<'_>) -> Option<usize> {
    let extended = ["KHR_texture_basisu", "EXT_texture_webp"]
        .into_iter()
        .find_map(|name| texture.extension(name).and_then(|e| e.index("source")));
    extended.or_else(|| texture.index("source"))
}

fn transform_of(json: &Json<'_>) -> TextureTransform {
    TextureTransform {
        offset: json.floats("offset").map_or(Vec2::ZERO, Vec2::from_array),
        rotation: json.float("rotation", 0.0),
        scale: json.floats("scale").map_or(Vec2::ONE, Vec2::from_array),
    }
}

fn wrap_of(code: Option<usize>) -> Wrap {
    match code {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

/// A path tracer has many samples in a pixel, so mip maps do not matter; magnification decides.
fn filter_of(sampler: Option<&Json<'_>>) -> Filter {
    match sampler.and_then(|s| s.index("magFilter")) {
        Some(9728) => Filter::Nearest,
        _ => Filter::Linear,
    }
}
