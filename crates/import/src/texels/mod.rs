//! Image files to texels: PNG, JPEG, WebP, Radiance HDR, OpenEXR, KTX2.

mod exr;

#[cfg(test)]
mod tests;

use crate::decode::{KTX2_SIGNATURE, ktx2};
use crate::{ErrorKind, ImportError, Limits};
use ::image::{DynamicImage, ImageFormat, ImageReader};
use std::io::Cursor;
use vastlight_scene::{Image, Texels};

/// Decodes an image file in memory; the format is found from its first bytes. `name` goes into the image and into
/// messages.
///
/// PNG, JPEG and WebP keep their 8 or 16 bits as they are stored; HDR and EXR become linear floats; KTX2 as
/// [`crate::decode::ktx2`] says.
///
/// # Errors
/// Unknown format, malformed, or beyond the limits.
pub fn decode_image(bytes: &[u8], name: &str, limits: &Limits) -> Result<Image, ImportError> {
    if bytes.starts_with(KTX2_SIGNATURE) {
        return ktx2(bytes, name, limits);
    }
    let Some(format) = format_of(bytes) else {
        let error = ImportError::new(ErrorKind::UnknownFormat, "unknown image format", name);
        return Err(error.with_hint("vastlight reads PNG, JPEG, WebP, HDR, EXR and KTX2"));
    };
    match format {
        ImageFormat::OpenExr => exr::decode(bytes, name, limits),
        other => guarded(name, || decode_common(bytes, other, name, limits)),
    }
}

fn format_of(bytes: &[u8]) -> Option<ImageFormat> {
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    let signatures: [(&[u8], ImageFormat); 5] = [
        (b"\x89PNG\r\n\x1a\n", ImageFormat::Png),
        (b"\xff\xd8\xff", ImageFormat::Jpeg),
        (b"#?RADIANCE", ImageFormat::Hdr),
        (b"#?RGBE", ImageFormat::Hdr),
        (b"\x76\x2f\x31\x01", ImageFormat::OpenExr),
    ];
    let by_signature = signatures.iter().find(|(magic, _)| bytes.starts_with(magic)).map(|&(_, f)| f);
    by_signature.or_else(|| webp.then_some(ImageFormat::WebP))
}

fn decode_common(
    bytes: &[u8],
    format: ImageFormat,
    name: &str,
    limits: &Limits,
) -> Result<Image, ImportError> {
    let broken =
        |e: ::image::ImageError| ImportError::malformed(format!("the image cannot be decoded: {e}"), name);
    let (width, height) =
        ImageReader::with_format(Cursor::new(bytes), format).into_dimensions().map_err(broken)?;
    let bytes_per_texel = if format == ImageFormat::Hdr { 12 } else { 4 };
    limits.check_image(u64::from(width), u64::from(height), bytes_per_texel, name)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut allocation = ::image::Limits::default();
    allocation.max_alloc = Some(limits.decoded_bytes);
    reader.limits(allocation);
    Ok(from_dynamic(reader.decode().map_err(broken)?, name))
}

fn from_dynamic(image: DynamicImage, name: &str) -> Image {
    let (width, height) = (image.width(), image.height());
    let (channels, texels) = match image {
        DynamicImage::ImageLuma8(i) => (1, Texels::U8(i.into_raw())),
        DynamicImage::ImageLumaA8(i) => (2, Texels::U8(i.into_raw())),
        DynamicImage::ImageRgb8(i) => (3, Texels::U8(i.into_raw())),
        DynamicImage::ImageLuma16(i) => (1, Texels::U16(i.into_raw())),
        DynamicImage::ImageLumaA16(i) => (2, Texels::U16(i.into_raw())),
        DynamicImage::ImageRgb16(i) => (3, Texels::U16(i.into_raw())),
        DynamicImage::ImageRgba16(i) => (4, Texels::U16(i.into_raw())),
        DynamicImage::ImageRgb32F(i) => (3, Texels::F32(i.into_raw())),
        DynamicImage::ImageRgba32F(i) => (4, Texels::F32(i.into_raw())),
        other => (4, Texels::U8(other.into_rgba8().into_raw())),
    };
    Image { name: name.to_owned(), width, height, channels, texels }
}

/// Runs a decoder that is not ours and turns a panic of it into an error.
pub(crate) fn guarded<T>(
    name: &str,
    decode: impl FnOnce() -> Result<T, ImportError>,
) -> Result<T, ImportError> {
    let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(decode));
    caught.unwrap_or_else(|_| Err(ImportError::malformed("the decoder gave up on this data", name)))
}
