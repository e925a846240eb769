//! PNG: exposure, tone curve, sRGB, 8 or 16 bits.

use crate::{FilmError, Picture, ToneCurve, srgb_from_linear, write_atomically};
use rayon::prelude::*;
use std::io;
use std::path::Path;
use vastlight_math::{Vec3, real};

/// Bits a channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitDepth {
    /// 8 bits.
    #[default]
    Eight,
    /// 16 bits.
    Sixteen,
}

/// How a linear picture becomes an integer one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PngOptions {
    /// Exposure in stops (EV): radiance is multiplied by 2 to this power first.
    pub exposure: f32,
    /// Tone curve.
    pub curve: ToneCurve,
    /// Bits a channel.
    pub depth: BitDepth,
    /// Hide the steps of 8-bit gradients with a fixed fine pattern of at most one step.
    pub dither: bool,
}

impl Default for PngOptions {
    fn default() -> Self {
        Self { exposure: 0.0, curve: ToneCurve::Filmic, depth: BitDepth::Eight, dither: true }
    }
}

/// Writes the colour channels as PNG.
///
/// # Errors
/// If the picture has no colour channels or the file cannot be written.
pub fn write_png(path: &Path, picture: &Picture, options: &PngOptions) -> Result<(), FilmError> {
    let bytes = encode_png(picture, options).map_err(|e| FilmError::write(path, e))?;
    write_atomically(path, |w| w.write_all(&bytes))
}

/// The bytes of a PNG file of the colour channels.
///
/// # Errors
/// If the picture has no colour channels or no pixels.
pub fn encode_png(picture: &Picture, options: &PngOptions) -> io::Result<Vec<u8>> {
    let samples =
        quantise(picture, options).ok_or_else(|| io::Error::other("the picture has no R, G and B"))?;
    let [width, height] = picture.size();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(match options.depth {
        BitDepth::Eight => png::BitDepth::Eight,
        BitDepth::Sixteen => png::BitDepth::Sixteen,
    });
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    if let Some(denoiser) = &picture.denoiser {
        encoder.add_text_chunk("Denoiser".to_owned(), denoiser.clone())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&samples)?;
    writer.finish()?;
    Ok(bytes)
}

/// The samples of a PNG file, rows from the top, RGB, big-endian; none if the picture has no colour channels.
#[must_use]
pub fn quantise(picture: &Picture, options: &PngOptions) -> Option<Vec<u8>> {
    let [red, green, blue] = picture.rgb()?;
    let scale = real::exp2(options.exposure);
    let width = picture.window.width() as usize;
    let pixel_bytes = |i: usize| {
        let color = options.curve.apply(Vec3::new(red[i], green[i], blue[i]) * scale);
        let x = picture.window.x0 + (i % width) as u32;
        let y = picture.window.y0 + (i / width) as u32;
        let offset = if options.dither { threshold(x, y) } else { 0.5 };
        color.to_array().map(|c| quantise_channel(srgb_from_linear(c), offset, options.depth))
    };
    let pixels: Vec<[u16; 3]> = (0..picture.window.pixels()).into_par_iter().map(pixel_bytes).collect();
    let channels = pixels.as_flattened().iter();
    Some(match options.depth {
        BitDepth::Eight => channels.map(|&c| c as u8).collect(),
        BitDepth::Sixteen => channels.flat_map(|c| c.to_be_bytes()).collect(),
    })
}

fn quantise_channel(encoded: f32, offset: f32, depth: BitDepth) -> u16 {
    match depth {
        BitDepth::Eight => (encoded * 255.0 + offset).min(255.0) as u16,
        BitDepth::Sixteen => (encoded * 65535.0 + 0.5) as u16,
    }
}

/// Interleaved gradient noise (Jimenez 2014) in [0, 1): an even pattern that depends on the pixel alone.
fn threshold(x: u32, y: u32) -> f32 {
    // Wrapped so that products stay small; the pattern's repetition is far beyond sight.
    let (x, y) = ((x % 8192) as f32, (y % 8192) as f32);
    (52.982_918 * (0.067_110_56 * x + 0.005_837_15 * y).fract()).fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Picture {
        let values: Vec<f32> = (0..4096).map(|i| i as f32 / 4096.0).collect();
        Picture::from_rgb(64, 64, [values.clone(), values.clone(), values])
    }

    fn linear(depth: BitDepth, dither: bool) -> PngOptions {
        PngOptions { exposure: 0.0, curve: ToneCurve::Linear, depth, dither }
    }

    #[test]
    fn known_values() {
        let values = vec![0.0, 1.0, 0.5, 0.214_041_14];
        let picture = Picture::from_rgb(2, 2, [values.clone(), values.clone(), values]);
        let bytes = quantise(&picture, &linear(BitDepth::Eight, false)).expect("has colours");
        assert_eq!([bytes[0], bytes[3], bytes[6], bytes[9]], [0, 255, 188, 128]);
        let dithered = quantise(&picture, &linear(BitDepth::Eight, true)).expect("has colours");
        assert_eq!(&dithered[..6], &[0, 0, 0, 255, 255, 255]);
        let brighter = PngOptions { exposure: 1.0, ..linear(BitDepth::Sixteen, false) };
        let bytes = quantise(&picture, &brighter).expect("has colours");
        assert_eq!(&bytes[12..14], &[255, 255]);
    }

    #[test]
    fn dithering_keeps_the_mean() {
        let flat = vec![0.2; 128 * 128];
        let picture = Picture::from_rgb(128, 128, [flat.clone(), flat.clone(), flat]);
        let bytes = quantise(&picture, &linear(BitDepth::Eight, true)).expect("has colours");
        let mean = bytes.iter().map(|&b| f64::from(b)).sum::<f64>() / bytes.len() as f64;
        assert!((mean - f64::from(srgb_from_linear(0.2)) * 255.0).abs() < 0.02, "{mean}");
        assert!(bytes.iter().any(|&b| b != bytes[0]));
    }

    #[test]
    fn the_file_is_tagged_and_repeatable() {
        let bytes = encode_png(&ramp(), &PngOptions::default()).expect("encoded");
        assert!(bytes.windows(4).any(|w| w == b"sRGB"));
        assert!(!bytes.windows(4).any(|w| w == b"tIME"));
        assert_eq!(bytes, encode_png(&ramp(), &PngOptions::default()).expect("encoded"));
        let denoised = Picture { denoiser: Some("a filter".into()), ..ramp() };
        let bytes = encode_png(&denoised, &PngOptions::default()).expect("encoded");
        assert!(bytes.windows(17).any(|w| w == b"Denoiser\0a filter"));
    }
}
