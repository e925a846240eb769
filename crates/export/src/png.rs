//! Images as PNG in memory.

use crate::ExportError;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use vastlight_scene::{Diagnostics, Image, Texels};

/// PNG bytes of an image. Floats become 16 bits in [0, 1], and that is noted.
pub(crate) fn encode(image: &Image, lost: &mut Diagnostics) -> Result<Vec<u8>, ExportError> {
    let (bytes, deep) = match &image.texels {
        Texels::U8(texels) => (texels.clone(), false),
        Texels::U16(texels) => (native(texels), true),
        Texels::F32(texels) => {
            let place = format!("image \"{}\"", image.name);
            lost.warn("floating-point texels become 16 bits between 0 and 1", place, "");
            (
                native(
                    &texels.iter().map(|x| (x.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16).collect::<Vec<_>>(),
                ),
                true,
            )
        }
    };
    let color = match (image.channels, deep) {
        (1, false) => ExtendedColorType::L8,
        (2, false) => ExtendedColorType::La8,
        (3, false) => ExtendedColorType::Rgb8,
        (_, false) => ExtendedColorType::Rgba8,
        (1, true) => ExtendedColorType::L16,
        (2, true) => ExtendedColorType::La16,
        (3, true) => ExtendedColorType::Rgb16,
        (_, true) => ExtendedColorType::Rgba16,
    };
    let mut out = Vec::new();
    PngEncoder::new(&mut out)
        .write_image(&bytes, image.width, image.height, color)
        .map_err(|source| ExportError::Image { place: format!("image \"{}\"", image.name), source })?;
    Ok(out)
}

/// The encoder takes 16-bit texels in the machine's byte order.
fn native(texels: &[u16]) -> Vec<u8> {
    texels.iter().flat_map(|x| x.to_ne_bytes()).collect()
}
