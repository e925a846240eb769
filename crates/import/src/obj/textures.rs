//! Images that an MTL file names: found, decoded once, and turned into textures.

use super::mtl::Map;
use crate::Limits;
use crate::texels::{Deferral, ImageBytes, ImageFile, ImageSize, at_once_bytes};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use vastlight_math::Vec2;
use vastlight_scene::{Encoding, Image, SceneDesc, Texels, Texture, TextureTransform, Wrap};

/// Decoded images by their path.
pub(super) struct Images {
    numbers: HashMap<PathBuf, Option<u32>>,
    /// Normal maps by the image of heights and the bits of the strength; `None` where the image is one itself.
    from_bump: HashMap<(u32, u32), Option<u32>>,
    /// What the limits leave for more images.
    left_bytes: u64,
}

/// What is known about image files before they are read.
pub(super) struct Sources<'a> {
    /// Those whose texels must be there with the scene.
    pub(super) whole: BTreeSet<PathBuf>,
    pub(super) limits: &'a Limits,
    /// For messages.
    pub(super) place: &'a str,
}

impl Images {
    /// Decodes all `files` in parallel into `desc.images`; what cannot be read is named in a warning, once. Those that `deferral`
    /// is for are only checked.
    pub(super) fn load(
        files: impl Iterator<Item = PathBuf>,
        sources: &Sources<'_>,
        deferral: &mut Deferral,
        desc: &mut SceneDesc,
    ) -> Self {
        let Sources { whole, limits, place } = sources;
        let mut paths: Vec<PathBuf> = files.collect();
        paths.sort();
        paths.dedup();
        let sizes: Vec<ImageSize> = paths.par_iter().map(|path| image_file(path, limits).size()).collect();
        let later = deferral.plan(&sizes, |i| whole.contains(&paths[i]), limits, place);
        let later = later.unwrap_or_else(|e| {
            desc.diagnostics.error(e.what, e.place, e.hint);
            paths.clear();
            Vec::new()
        });
        let left_bytes = limits.all_images_bytes.saturating_sub(at_once_bytes(&sizes, &later));
        let decode = |(path, &later): (&PathBuf, &bool)| image_file(path, limits).load(later);
        let decoded: Vec<_> = paths.par_iter().zip(&later).map(decode).collect();
        let mut numbers = HashMap::new();
        for (path, result) in paths.into_iter().zip(decoded) {
            let number = match result {
                Ok(image) => Some(deferral.add(image, desc)),
                Err(e) => {
                    let what = format!("the texture \"{}\" cannot be used: {}", path.display(), e.what);
                    desc.diagnostics.warn(what, *place, "the material goes without it");
                    None
                }
            };
            numbers.insert(path, number);
        }
        Self { numbers, from_bump: HashMap::new(), left_bytes }
    }

    /// The number of an image in the scene's table.
    pub(super) fn number(&self, path: &Path) -> Option<u32> {
        self.numbers.get(path).copied().flatten()
    }

    /// The number of the normal map made from the heights in `image`; `None` if the image is a normal map itself, or if
    /// there is no room for more images.
    pub(super) fn normal_map_of(&mut self, image: u32, strength: f32, desc: &mut SceneDesc) -> Option<u32> {
        let key = (image, strength.to_bits());
        if let Some(&number) = self.from_bump.get(&key) {
            return number;
        }
        let heights = &desc.images[image as usize];
        let left_bytes =
            self.left_bytes.checked_sub(3 * u64::from(heights.width) * u64::from(heights.height));
        let normals = left_bytes.and_then(|_| normals_from_bump(heights, strength));
        let number = normals.map(|normals| {
            desc.images.push(normals);
            desc.images.len() as u32 - 1
        });
        if number.is_some() {
            self.left_bytes = left_bytes.unwrap_or(0);
        }
        self.from_bump.insert(key, number);
        number
    }
}

fn image_file(path: &Path, limits: &Limits) -> ImageFile {
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    ImageFile { bytes: ImageBytes::File(path.to_owned()), name, limits: *limits }
}

/// Where a file that is named in a library lies: as it is named, else beside the library, else there under another
/// case. The first candidate if there is none.
pub(super) fn locate(name: &str, directory: &Path) -> PathBuf {
    let named = directory.join(name);
    if named.is_file() {
        return named;
    }
    let Some(file) = Path::new(name).file_name() else { return named };
    let beside = directory.join(file);
    if beside.is_file() {
        return beside;
    }
    let folders = [named.parent().map(Path::to_path_buf), Some(directory.to_path_buf())];
    folders.into_iter().flatten().find_map(|folder| ignoring_case(&folder, file)).unwrap_or(named)
}

fn ignoring_case(folder: &Path, file: &std::ffi::OsStr) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.file_name().is_some_and(|n| n.eq_ignore_ascii_case(file)))
        .collect();
    found.sort();
    found.into_iter().next()
}

/// The texture of a map; `v` is flipped in the image's rows already, so the offset is turned around here.
pub(super) fn texture(map: &Map, image: u32, encoding: Encoding) -> Texture {
    let mut texture = Texture::new(image, encoding);
    let offset = Vec2::new(map.offset.x, 1.0 - map.scale.y - map.offset.y);
    texture.transform = TextureTransform { offset, scale: map.scale, ..TextureTransform::IDENTITY };
    if map.clamp {
        texture.wrap = [Wrap::Clamp; 2];
    }
    texture
}

/// Whether the image has an alpha channel that is not opaque everywhere.
pub(super) fn has_alpha(image: &Image) -> bool {
    let step = usize::from(image.channels);
    let is = |opaque: bool| !opaque;
    step % 2 == 0
        && match &image.texels {
            Texels::U8(v) => v.chunks_exact(step).any(|t| is(t[step - 1] == u8::MAX)),
            Texels::U16(v) => v.chunks_exact(step).any(|t| is(t[step - 1] == u16::MAX)),
            Texels::F32(v) => v.chunks_exact(step).any(|t| is(t[step - 1] >= 1.0)),
        }
}

/// A tangent-space normal map from the image of a `bump` statement: the image itself if it is one already, else made
/// from its heights. `strength` is `-bm`; at 1 the slope is the difference of the two neighbouring texels.
fn normals_from_bump(image: &Image, strength: f32) -> Option<Image> {
    let height = Heights::of(image);
    if height.is_normal_map(image) {
        return None;
    }
    let (w, h) = (image.width as usize, image.height as usize);
    let at = |x: usize, y: usize| height.0[(y % h) * w + x % w];
    let mut texels = Vec::with_capacity(w * h * 3);
    for y in 0..h {
        for x in 0..w {
            let slope_u = strength * (at(x + 1, y) - at(x + w - 1, y));
            // Rows grow downwards, v of the tangent frame upwards.
            let slope_v = strength * (at(x, y + h - 1) - at(x, y + 1));
            let n = vastlight_math::Vec3::new(-slope_u, -slope_v, 1.0).normalize();
            texels.extend(n.to_array().map(|c| ((c * 0.5 + 0.5) * 255.0).round() as u8));
        }
    }
    let name = format!("{} (normals)", image.name);
    Some(Image { name, channels: 3, texels: Texels::U8(texels), ..*image })
}

/// The first channel of an image, in [0, 1].
struct Heights(Vec<f32>);

impl Heights {
    fn of(image: &Image) -> Self {
        let step = usize::from(image.channels);
        Self(match &image.texels {
            Texels::U8(v) => v.chunks_exact(step).map(|t| f32::from(t[0]) / 255.0).collect(),
            Texels::U16(v) => v.chunks_exact(step).map(|t| f32::from(t[0]) / 65535.0).collect(),
            Texels::F32(v) => v.chunks_exact(step).map(|t| t[0]).collect(),
        })
    }

    /// Normal maps are blue: red is near one half and blue near one on average, which grey images cannot be.
    fn is_normal_map(&self, image: &Image) -> bool {
        let Texels::U8(v) = &image.texels else { return false };
        let step = usize::from(image.channels);
        if step < 3 || self.0.is_empty() {
            return false;
        }
        let count = self.0.len() as f32;
        let red = self.0.iter().sum::<f32>() / count;
        let blue = v.chunks_exact(step).map(|t| f32::from(t[2]) / 255.0).sum::<f32>() / count;
        blue > 0.65 && (0.35..0.65).contains(&red)
    }
}
