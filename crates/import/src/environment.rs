//! Environment maps: latitude-longitude images with radiance that can be used for light.

use crate::{ImportError, Limits, decode_image};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use vastlight_math::Vec3;
use vastlight_scene::{Diagnostics, Image, Texels};

/// Reads a latitude-longitude map (OpenEXR or Radiance HDR; PNG, JPEG and WebP are taken as sRGB) as linear RGB floats.
/// Texels that are negative or not finite become black, with a warning that counts them.
///
/// # Errors
/// The file cannot be read, or is not an image.
pub fn load_environment(
    path: &Path,
    limits: &Limits,
    diagnostics: &mut Diagnostics,
) -> Result<Image, ImportError> {
    let place = path.display().to_string();
    let mut image = to_linear_rgb(decode_image(&read_file(path, limits)?, &place, limits)?);
    let repaired = repair(&mut image);
    if repaired > 0 {
        let what = format!("{repaired} texels of the environment map are negative or not finite");
        diagnostics.warn(what, &place, "they are taken as black");
    }
    if u64::from(image.width) != 2 * u64::from(image.height) {
        let what = format!("the environment map has {} x {} texels", image.width, image.height);
        diagnostics.warn(what, place, "a latitude-longitude map is twice as wide as high");
    }
    Ok(image)
}

/// The whole of a file, if it is not larger than the limits.
pub(crate) fn read_file(path: &Path, limits: &Limits) -> Result<Vec<u8>, ImportError> {
    let file = File::open(path).map_err(|e| ImportError::io(&e, path))?;
    let bytes = file.metadata().map_err(|e| ImportError::io(&e, path))?.len();
    limits.check_count(bytes, limits.file_bytes, "bytes", &path.display().to_string())?;
    let mut content = Vec::with_capacity(usize::try_from(bytes).unwrap_or(0));
    file.take(limits.file_bytes).read_to_end(&mut content).map_err(|e| ImportError::io(&e, path))?;
    Ok(content)
}

/// Linear RGB floats from any image; alpha is dropped, numbers of 8 and 16 bits are decoded from sRGB.
fn to_linear_rgb(image: Image) -> Image {
    let step = usize::from(image.channels);
    let values: Vec<f32> = match image.texels {
        Texels::F32(v) if step == 3 => v,
        Texels::F32(v) => pick_rgb(&v, step),
        Texels::U8(v) => pick_rgb(&v.iter().map(|&x| linear(f32::from(x) / 255.0)).collect::<Vec<_>>(), step),
        Texels::U16(v) => {
            pick_rgb(&v.iter().map(|&x| linear(f32::from(x) / 65535.0)).collect::<Vec<_>>(), step)
        }
    };
    Image { channels: 3, texels: Texels::F32(values), ..image }
}

fn pick_rgb(values: &[f32], step: usize) -> Vec<f32> {
    let channels = if step < 3 { [0, 0, 0] } else { [0, 1, 2] };
    values.chunks_exact(step).flat_map(|texel| channels.map(|c| texel[c])).collect()
}

/// The linear value of an sRGB-encoded one.
pub(crate) fn linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        vastlight_math::real::pow((encoded + 0.055) / 1.055, 2.4)
    }
}

/// Blackens texels that no light can have; returns how many there were.
fn repair(image: &mut Image) -> usize {
    let Texels::F32(values) = &mut image.texels else { return 0 };
    let mut repaired = 0;
    for texel in values.as_chunks_mut::<3>().0 {
        let color = Vec3::from_array(*texel);
        if !color.is_finite() || color.min_element() < 0.0 {
            *texel = [0.0; 3];
            repaired += 1;
        }
    }
    repaired
}
