//! PNG row by row, with the texels and the errors of the whole decoder.

use super::rows::{Bytes, Rows};
use super::{broken, guarded};
use crate::{ImportError, Limits};
use ::image::error::{
    DecodingError, ImageError, LimitError, LimitErrorKind, ParameterError, ParameterErrorKind,
    UnsupportedError, UnsupportedErrorKind,
};
use ::image::{ExtendedColorType, ImageFormat, ImageResult};
use png::{BitDepth, ColorType, Reader, Transformations};
use vastlight_scene::{Image, Texels};

/// Where a file says whether it is interlaced: behind the signature, and the length, type and first 12 bytes of its first chunk.
const INTERLACED_AT: usize = 28;

/// Whether the file with these first bytes is interlaced: its rows do not come one after the other.
pub(super) fn is_interlaced(first: &[u8]) -> bool {
    first.get(INTERLACED_AT) == Some(&1)
}

/// Starts with the first row.
pub(super) fn rows(bytes: Box<dyn Bytes>, name: &str, limits: &Limits) -> Result<Rows, ImportError> {
    let mut reader = open(bytes).map_err(|e| broken(&e, name))?;
    let (width, height) = reader.info().size();
    let (color, depth) = reader.output_color_type();
    let channels = color.samples() as u8;
    let deep = depth == BitDepth::Sixteen;
    let texel = u64::from(channels) * if deep { 2 } else { 1 };
    limits.check_image(u64::from(width), u64::from(height), texel, name)?;
    let texels = if deep { Texels::U16(Vec::new()) } else { Texels::U8(Vec::new()) };
    let image = Image { name: name.to_owned(), width, height, channels, texels };
    let mut row = vec![0; width as usize * texel as usize];
    let (mut left, name) = (height, name.to_owned());
    let next = move |out: &mut Texels| {
        guarded(&name, || read(&mut reader, &mut row, &mut left, out).map_err(|e| broken(&e, &name)))
    };
    // Rows before and behind the filters, and what is unpacked ahead.
    let working_bytes = (1 << 20) + 8 * image.row_bytes();
    Ok(Rows { image, working_bytes, held_bytes: 0, next: Box::new(next) })
}

fn open(bytes: Box<dyn Bytes>) -> ImageResult<Reader<Box<dyn Bytes>>> {
    let mut decoder = png::Decoder::new(bytes);
    decoder.set_transformations(Transformations::EXPAND);
    let reader = decoder.read_info().map_err(of_image)?;
    match reader.output_color_type() {
        (ColorType::Indexed, depth) => {
            let kind = UnsupportedErrorKind::Color(ExtendedColorType::Unknown(depth as u8));
            let error = UnsupportedError::from_format_and_kind(ImageFormat::Png.into(), kind);
            Err(ImageError::Unsupported(error))
        }
        _ => Ok(reader),
    }
}

/// Reads a row, and behind the last one what belongs to the image's data.
fn read(
    reader: &mut Reader<Box<dyn Bytes>>,
    row: &mut [u8],
    left: &mut u32,
    out: &mut Texels,
) -> ImageResult<()> {
    reader.read_row(row).map_err(of_image)?;
    *left = left.saturating_sub(1);
    if *left == 0 {
        reader.read_row(&mut []).map_err(of_image)?;
    }
    match out {
        Texels::U8(v) => v.extend(&*row),
        Texels::U16(v) => v.extend(row.as_chunks().0.iter().map(|&bytes| u16::from_be_bytes(bytes))),
        Texels::F32(_) => {}
    }
    Ok(())
}

/// The error as the whole decoder words it.
fn of_image(error: png::DecodingError) -> ImageError {
    match error {
        png::DecodingError::IoError(e) => ImageError::IoError(e),
        e @ png::DecodingError::Format(_) => {
            ImageError::Decoding(DecodingError::new(ImageFormat::Png.into(), e))
        }
        e @ png::DecodingError::Parameter(_) => {
            ImageError::Parameter(ParameterError::from_kind(ParameterErrorKind::Generic(e.to_string())))
        }
        png::DecodingError::LimitsExceeded => {
            ImageError::Limits(LimitError::from_kind(LimitErrorKind::InsufficientMemory))
        }
    }
}
