//! Pictures on their way to the page: a header of [`HEADER`] bytes, then a JPEG or PNG file.
//!
//! Header, little-endian: kind (1), format (0 JPEG, 1 PNG), whether it is the last of this view, 0; number, number of the input that it
//! shows, samples a pixel, as u32; width and height of the file and of the whole picture, as u16.

use crate::develop::Shown;
use axum::body::Bytes;
use jpeg_encoder::{ColorType, Encoder};
use vastlight::film::{encode_png, quantise};
use vastlight::{Error, ErrorClass};

/// Bytes before the file.
pub(crate) const HEADER: usize = 24;
/// The first byte of pictures.
const KIND: u8 = 1;

/// A picture for the page.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) number: u32,
    pub(crate) message: Bytes,
}

/// What stands in the header beside sizes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Caption {
    pub(crate) number: u32,
    pub(crate) input: u32,
    pub(crate) spp: u32,
    pub(crate) full: [u32; 2],
}

/// How a picture is encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coding {
    /// JPEG of a quality.
    Lossy(u8),
    /// PNG: the last picture of a view.
    Lossless,
}

/// Encodes a picture.
pub(crate) fn frame(shown: &Shown, coding: Coding, caption: Caption) -> Result<Frame, Error> {
    let size = shown.picture.size();
    let is_lossless = u8::from(coding == Coding::Lossless);
    let mut bytes = Vec::with_capacity(HEADER);
    bytes.extend([KIND, is_lossless, is_lossless, 0]);
    for number in [caption.number, caption.input, caption.spp] {
        bytes.extend(number.to_le_bytes());
    }
    for edge in [size, caption.full].as_flattened() {
        bytes.extend((*edge as u16).to_le_bytes());
    }
    let failed = |e: &dyn std::fmt::Display| Error::new(ErrorClass::Output, e.to_string(), "picture", "");
    match coding {
        Coding::Lossless => {
            bytes.extend(encode_png(&shown.picture, &shown.options).map_err(|e| failed(&e))?);
        }
        Coding::Lossy(quality) => {
            let pixels =
                quantise(&shown.picture, &shown.options).ok_or_else(|| failed(&"it has no colours"))?;
            let encoder = Encoder::new(&mut bytes, quality);
            let [width, height] = size.map(|edge| edge as u16);
            encoder.encode(&pixels, width, height, ColorType::Rgb).map_err(|e| failed(&e))?;
        }
    }
    Ok(Frame { number: caption.number, message: bytes.into() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::View;
    use vastlight::film::Picture;

    #[test]
    fn the_header_says_what_the_file_is() {
        let grey = vec![0.18; 12 * 8];
        let shown = || {
            let picture = Picture::from_rgb(12, 8, [grey.clone(), grey.clone(), grey.clone()]);
            Shown { picture, options: View::new(1).tone.options() }
        };
        let caption = Caption { number: 7, input: 260, spp: 3, full: [48, 32] };
        for (coding, magic) in [(Coding::Lossless, &b"\x89PNG"[..]), (Coding::Lossy(80), &b"\xff\xd8"[..])] {
            let frame = frame(&shown(), coding, caption).expect("encoded");
            let bytes = &frame.message;
            assert_eq!((bytes[0], &bytes[4..12]), (1, &[7, 0, 0, 0, 4, 1, 0, 0][..]));
            assert_eq!(&bytes[12..HEADER], &[3, 0, 0, 0, 12, 0, 8, 0, 48, 0, 32, 0]);
            assert!(bytes[HEADER..].starts_with(magic));
            assert_eq!(image::load_from_memory(&bytes[HEADER..]).is_ok(), coding == Coding::Lossless);
        }
    }
}
