//! Image files to texels: PNG, JPEG, WebP, Radiance HDR, OpenEXR, KTX2.

mod exr;
mod jpeg;
mod png;
mod rows;

#[cfg(test)]
mod tests;

use crate::decode::{KTX2_SIGNATURE, ktx2, ktx2_decoded_bytes};
use crate::{ErrorKind, ImportError, Limits};
use ::image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};
use std::io::{BufRead, Cursor, Read, Seek};
use vastlight_scene::{Image, Texels};

pub(crate) use rows::{Deferral, ImageBytes, ImageFile, ImageSize, Loaded, at_once_bytes};

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
    match format_of(bytes, name)? {
        ImageFormat::OpenExr => exr::decode(bytes, name, limits),
        ImageFormat::Jpeg => jpeg::decode(bytes, name, limits),
        other => guarded(name, || decode_common(bytes, other, name, limits)),
    }
}

/// How many bytes the texels of an image file that begins with `first` take once decoded, from its header alone; for formats that are
/// decoded as a whole.
///
/// # Errors
/// Unknown format, or the header cannot be read or is malformed.
fn header_bytes<B: BufRead + Seek>(
    first: &[u8],
    open: impl FnOnce() -> Result<B, ImportError>,
    name: &str,
) -> Result<u64, ImportError> {
    if first.starts_with(KTX2_SIGNATURE) {
        let mut header = Vec::new();
        let read = open()?.take(KTX2_HEADER).read_to_end(&mut header);
        read.map_err(|e| ImportError::new(ErrorKind::Io, e.to_string(), name))?;
        return ktx2_decoded_bytes(&header, name);
    }
    let (format, reader) = (format_of(first, name)?, open()?);
    guarded(name, || Ok(open_common(reader, format, name)?.total_bytes()))
}

/// Bytes in which the header of a KTX2 file and the description of its texels stand.
const KTX2_HEADER: u64 = 1 << 16;

fn format_of(bytes: &[u8], name: &str) -> Result<ImageFormat, ImportError> {
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    let signatures: [(&[u8], ImageFormat); 5] = [
        (b"\x89PNG\r\n\x1a\n", ImageFormat::Png),
        (b"\xff\xd8\xff", ImageFormat::Jpeg),
        (b"#?RADIANCE", ImageFormat::Hdr),
        (b"#?RGBE", ImageFormat::Hdr),
        (b"\x76\x2f\x31\x01", ImageFormat::OpenExr),
    ];
    let by_signature = signatures.iter().find(|(magic, _)| bytes.starts_with(magic)).map(|&(_, f)| f);
    by_signature.or_else(|| webp.then_some(ImageFormat::WebP)).ok_or_else(|| {
        let error = ImportError::new(ErrorKind::UnknownFormat, "unknown image format", name);
        error.with_hint("vastlight reads PNG, JPEG, WebP, HDR, EXR and KTX2")
    })
}

/// Reads the header.
fn open_common<'a, B: BufRead + Seek + 'a>(
    reader: B,
    format: ImageFormat,
    name: &str,
) -> Result<impl ImageDecoder + 'a, ImportError> {
    ImageReader::with_format(reader, format).into_decoder().map_err(|e| broken(&e, name))
}

fn broken(error: &ImageError, name: &str) -> ImportError {
    ImportError::malformed(format!("the image cannot be decoded: {error}"), name)
}

fn decode_common(
    bytes: &[u8],
    format: ImageFormat,
    name: &str,
    limits: &Limits,
) -> Result<Image, ImportError> {
    let mut decoder = open_common(Cursor::new(bytes), format, name)?;
    let (width, height) = decoder.dimensions();
    let bytes_per_texel = u64::from(decoder.color_type().bytes_per_pixel());
    limits.check_image(u64::from(width), u64::from(height), bytes_per_texel, name)?;
    let mut allocation = ::image::Limits::default();
    allocation.max_alloc = Some(limits.decoded_bytes);
    decoder.set_limits(allocation).map_err(|e| broken(&e, name))?;
    let image = DynamicImage::from_decoder(decoder).map_err(|e| broken(&e, name))?;
    Ok(from_dynamic(image, name))
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
