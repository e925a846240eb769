//! Textures of a scene that is packed: from images to tiles.

use crate::Error;
use crate::budget::image_bytes;
use std::collections::BTreeSet;
use vastlight_scene::{Content, Environment, Image, ImageRows, SceneDesc, SceneStream, texture_uses};
use vastlight_store::{StoreWriter, TileGrid, is_worth_tiles};

/// Puts the images that may leave memory into tiles, and takes their texels out of `desc`. Rows of images without texels come from
/// `rows`; those that must stay in memory get their texels.
///
/// `check` is asked before each row whether to go on.
///
/// What hits and light depend on stays: images of environments, of emission, of the alpha of surfaces with holes, of window panes;
/// and small images.
pub(crate) fn pack(
    desc: &mut SceneDesc,
    mut rows: Vec<ImageRows>,
    tile_bytes: usize,
    writer: &mut StoreWriter,
    check: &dyn Fn() -> Result<(), Error>,
) -> Result<(), Error> {
    for image in 0..desc.images.len() as u32 {
        let of_image = rows.iter().position(|rows| rows.image == image).map(|at| rows.swap_remove(at));
        if !put_in_tiles(desc, image, of_image.as_ref(), tile_bytes, writer, check)?
            && let Some(rows) = of_image
        {
            rows.fill(desc)?;
        }
    }
    Ok(())
}

/// Bytes of images that stay in memory, as soon as all of them are there.
pub(crate) fn resident_bytes(stream: &SceneStream, tile_bytes: usize) -> u64 {
    let desc = &stream.desc;
    let still_to_come = stream.rows.iter().map(|rows| rows.image).filter(|&image| {
        let known = desc.images.get(image as usize);
        known.is_some_and(|i| !is_worth_tiles(i, tile_bytes)) || contents_in_tiles(desc, image).is_empty()
    });
    let to_come = still_to_come.filter_map(|image| desc.images.get(image as usize)).map(Image::whole_bytes);
    desc.images.iter().map(image_bytes).chain(to_come).sum()
}

/// Most bytes that it takes to bring an image's rows and to put them into tiles: strips of tiles of all levels, and rows of each to
/// make the next.
pub(crate) fn working_bytes(stream: &SceneStream, tile_bytes: usize) -> u64 {
    let of = |rows: &ImageRows| {
        let image = stream.desc.images.get(rows.image as usize)?;
        let edge = TileGrid::edge_of(tile_bytes, image.channels, &image.texels);
        let decoded = u64::from(image.width) * size_of::<vastlight_math::Vec4>() as u64;
        Some(rows.working_bytes + 2 * (2 * (image.row_bytes() << edge) + 4 * decoded))
    };
    stream.rows.iter().filter_map(of).max().unwrap_or(0)
}

/// Whether the image is in tiles now.
fn put_in_tiles(
    desc: &mut SceneDesc,
    number: u32,
    rows: Option<&ImageRows>,
    tile_bytes: usize,
    writer: &mut StoreWriter,
    check: &dyn Fn() -> Result<(), Error>,
) -> Result<bool, Error> {
    let contents = contents_in_tiles(desc, number);
    let image = &desc.images[number as usize];
    let row = image.width as usize * usize::from(image.channels.clamp(1, 4));
    let whole = rows.is_some() || image.texels.len() >= row * image.height as usize;
    if contents.is_empty() || !whole || !is_worth_tiles(image, tile_bytes) {
        return Ok(false);
    }
    for content in contents {
        let mut made = rows.map(|rows| (rows.open)()).transpose()?;
        let mut y = 0;
        let added = writer.add_texture((number, image), content, tile_bytes, |out| {
            check()?;
            match &mut made {
                Some(next) => next(out)?,
                None => out.append(&image.texels, y * row..(y + 1) * row),
            }
            y += 1;
            Ok::<(), Error>(())
        })?;
        if !added {
            return Ok(false);
        }
    }
    let texels = image.texels.none_like();
    desc.images[number as usize].texels = texels;
    Ok(true)
}

/// What the numbers of an image are to those who look it up; nothing if it must stay in memory.
fn contents_in_tiles(desc: &SceneDesc, image: u32) -> BTreeSet<Content> {
    let lights_all = matches!(&desc.environment, Some(Environment::Map { image: map, .. }) if *map == image);
    let uses = texture_uses(&desc.materials, &desc.textures);
    let of_image =
        || uses.iter().zip(&desc.textures).filter(|(_, t)| t.image == image).map(|(found, _)| found);
    if lights_all || of_image().any(|found| found.exact) {
        return BTreeSet::new();
    }
    of_image().filter(|found| found.filtered).map(|found| found.content).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Vec3;
    use vastlight_scene::{AlphaMode, Channel, ColorInput, Encoding, Image, Material, Texels, Texture};

    #[test]
    fn what_hits_and_light_depend_on_stays_in_memory() {
        let image = Image {
            name: "i".into(),
            width: 64,
            height: 64,
            channels: 4,
            texels: Texels::U8(vec![1; 64 * 64 * 4]),
        };
        let textured = ColorInput { factor: Vec3::ONE, texture: Some(0) };
        let with = |change: &dyn Fn(&mut Material)| {
            let mut material = Material { base_color: textured, ..Material::new("m") };
            change(&mut material);
            SceneDesc {
                images: vec![image.clone()],
                textures: vec![Texture::new(0, Encoding::Srgb)],
                materials: vec![material],
                ..SceneDesc::default()
            }
        };
        let leaf = |mode: AlphaMode| {
            with(&|m| {
                m.alpha_mode = mode;
                m.alpha.texture = Some((0, Channel::A));
            })
        };
        assert_eq!(contents_in_tiles(&with(&|_| {}), 0), [Content::Color].into());
        assert_eq!(contents_in_tiles(&leaf(AlphaMode::Opaque), 0), [Content::Color].into());
        assert!(contents_in_tiles(&leaf(AlphaMode::Blend), 0).is_empty());
        assert!(contents_in_tiles(&with(&|m| m.emission = textured), 0).is_empty());
        let pane = with(&|m| (m.transmission.factor, m.roughness.factor) = (1.0, 0.0));
        assert!(contents_in_tiles(&pane, 0).is_empty());
        let environment = Some(Environment::Map { image: 0, rotation: 0.0, strength: 1.0 });
        assert!(contents_in_tiles(&SceneDesc { environment, ..with(&|_| {}) }, 0).is_empty());
        let unused = with(&|m| m.base_color.texture = None);
        assert!(contents_in_tiles(&unused, 0).is_empty());
    }
}
