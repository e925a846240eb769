//! Environment maps: latitude-longitude images with radiance that can be used for light.

use crate::blob::open_within;
use crate::{ImportError, Limits, decode_image};
use std::io::Read;
use std::path::Path;
use vastlight_scene::{Diagnostics, Image, Texels};

/// Reads a latitude-longitude map (OpenEXR or Radiance HDR; PNG, JPEG and WebP are taken as sRGB) as linear RGB floats.
/// Numbers that no light has are repaired, with a warning that counts them: negative ones and NaN become 0, infinity the
/// largest finite number of the map.
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
        let what = format!("{repaired} numbers of the environment map are negative or not finite");
        diagnostics.warn(what, &place, "they are taken as 0, or as the largest number of the map");
    }
    if u64::from(image.width) != 2 * u64::from(image.height) {
        let what = format!("the environment map has {} x {} texels", image.width, image.height);
        diagnostics.warn(what, place, "a latitude-longitude map is twice as wide as high");
    }
    Ok(image)
}

/// The whole of a file, if it is not larger than the limits.
pub(crate) fn read_file(path: &Path, limits: &Limits) -> Result<Vec<u8>, ImportError> {
    let (file, bytes) = open_within(path, limits)?;
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

/// Replaces numbers that no light can have; returns how many there were.
fn repair(image: &mut Image) -> usize {
    let Texels::F32(values) = &mut image.texels else { return 0 };
    let largest = values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f32::max);
    let mut repaired = 0;
    for value in values.iter_mut().filter(|v| !(v.is_finite() && **v >= 0.0)) {
        *value = if *value == f32::INFINITY { largest } else { 0.0 };
        repaired += 1;
    }
    repaired
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_light_is_repaired() {
        let values = vec![1.0, -0.5, f32::NAN, f32::INFINITY, 7.0, f32::NEG_INFINITY];
        let mut image =
            Image { name: String::new(), width: 2, height: 1, channels: 3, texels: Texels::F32(values) };
        assert_eq!(repair(&mut image), 4);
        assert_eq!(image.texels, Texels::F32(vec![1.0, 0.0, 0.0, 7.0, 7.0, 0.0]));
        assert_eq!(repair(&mut image), 0);
    }

    #[test]
    fn any_image_becomes_linear_rgb() {
        let grey =
            Image { name: String::new(), width: 1, height: 1, channels: 2, texels: Texels::U8(vec![188, 0]) };
        let Texels::F32(values) = to_linear_rgb(grey).texels else { panic!("floats") };
        assert_eq!(values.len(), 3);
        assert!((values[2] - 0.5029).abs() < 1e-3);
        let rgba = Image {
            name: String::new(),
            width: 1,
            height: 1,
            channels: 4,
            texels: Texels::F32(vec![4.0, 5.0, 6.0, 0.5]),
        };
        assert_eq!(to_linear_rgb(rgba).texels, Texels::F32(vec![4.0, 5.0, 6.0]));
    }

    #[test]
    fn files_with_defects_are_read_with_a_warning() {
        let image = image::Rgb32FImage::from_fn(3, 2, |x, _| image::Rgb([x as f32, 0.25, 2.0]));
        let file = tempfile::Builder::new().suffix(".hdr").tempfile().expect("temporary file");
        let encoder = image::codecs::hdr::HdrEncoder::new(std::io::BufWriter::new(file.as_file()));
        let texels: Vec<image::Rgb<f32>> = image.pixels().copied().collect();
        encoder.encode(&texels, 3, 2).expect("encoded");
        let mut found = Diagnostics::default();
        let loaded = load_environment(file.path(), &Limits::default(), &mut found).expect("read");
        assert_eq!((loaded.width, loaded.height, loaded.channels), (3, 2, 3));
        assert!(found.items()[0].what.contains("3 x 2 texels"));
        let missing = load_environment(Path::new("/nonexistent.hdr"), &Limits::default(), &mut found);
        assert_eq!(missing.expect_err("missing").kind, crate::ErrorKind::Io);
    }
}
