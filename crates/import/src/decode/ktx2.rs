//! KTX2 textures: Basis Universal (ETC1S, UASTC and their relatives), plain or supercompressed with Zstandard.
//!
//! The transcoder is the crate `basisu`, a port of the reference to safe Rust. Textures in a fixed GPU format other
//! than ASTC are not decoded.

use crate::texels::guarded;
use crate::{ImportError, Limits};
use basisu::{DecodeFlags, Error, SourceFormat, TargetFormat, Transcoder};
use half::f16;
use vastlight_scene::{Image, Texels};

/// The first bytes of every KTX2 file.
pub(crate) const SIGNATURE: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Decodes the largest level of the first layer and face. 8 bits a channel, RGB or RGBA; textures of high dynamic range
/// become linear floats.
///
/// # Errors
/// Malformed, beyond the limits, or in a format that is not decoded.
pub fn ktx2(bytes: &[u8], name: &str, limits: &Limits) -> Result<Image, ImportError> {
    let field = |offset: usize| field(bytes, offset, name);
    if !bytes.starts_with(SIGNATURE) {
        return Err(ImportError::malformed("this is not a KTX2 texture", name));
    }
    let (vk_format, width, height, depth) = (field(12)?, field(20)?, field(24)?, field(28)?);
    if depth > 1 {
        return Err(ImportError::unsupported("volume textures are not supported", name));
    }
    // Blocks of up to 12 x 12 texels are decoded whole.
    let padded = |side: u32| u64::from(side).next_multiple_of(12);
    limits.check_image(padded(width), padded(height), 16, name)?;
    // A level is inflated whole, with all layers and faces: at most a byte for a texel of blocks.
    let images = u64::from(field(32)?.max(1)).saturating_mul(u64::from(field(36)?.max(1)));
    let level_bytes = u64::from(field(96)?) | u64::from(field(100)?) << 32;
    let most = (padded(width) * padded(height)).saturating_mul(images).min(limits.decoded_bytes);
    limits.check_count(level_bytes, most, "bytes of the largest level", name)?;
    guarded(name, || decode(bytes, name)).map_err(|error| match vk_format {
        0 => error,
        other => ImportError::unsupported(format!("KTX2 textures of VkFormat {other} are not decoded"), name)
            .with_hint("Basis Universal textures are"),
    })
}

/// A number of the header.
fn field(bytes: &[u8], offset: usize, name: &str) -> Result<u32, ImportError> {
    let word = bytes.get(offset..offset.saturating_add(4)).and_then(|b| b.first_chunk::<4>());
    let number = word.map(|&b| u32::from_le_bytes(b));
    number.ok_or_else(|| ImportError::malformed("the KTX2 header is cut off", name))
}

/// Bytes of the texels that [`ktx2`] gives, from the header: 8 bits a channel, or floats where the data format
/// descriptor names a model of high dynamic range.
///
/// # Errors
/// The header is cut off.
pub(crate) fn ktx2_decoded_bytes(bytes: &[u8], name: &str) -> Result<u64, ImportError> {
    /// Colour models of the Khronos Data Format: ETC1S and UASTC.
    const LOW_RANGE: [u32; 2] = [163, 166];
    let (width, height) = (u64::from(field(bytes, 20, name)?), u64::from(field(bytes, 24, name)?));
    let descriptor = field(bytes, 48, name)? as usize;
    let model = field(bytes, descriptor.saturating_add(12), name)? & 0xff;
    let texel_bytes = if LOW_RANGE.contains(&model) { 4 } else { 16 };
    Ok(width.saturating_mul(height).saturating_mul(texel_bytes))
}

fn decode(bytes: &[u8], name: &str) -> Result<Image, ImportError> {
    let broken =
        |e: Error| ImportError::malformed(format!("the KTX2 texture cannot be decoded: {e:?}"), name);
    let texture = Transcoder::new(bytes).map_err(broken)?;
    let (width, height) = texture.base_dimensions();
    let is_hdr = matches!(
        texture.source_format(),
        SourceFormat::UastcHdr4x4 | SourceFormat::AstcHdr6x6 | SourceFormat::UastcHdr6x6
    );
    let target = if is_hdr { TargetFormat::RgbaHalf } else { TargetFormat::Rgba32 };
    let channels = if texture.has_alpha() { 4 } else { 3 };
    let rgba = texture.transcode(0, target, DecodeFlags::NONE).map_err(broken)?;
    let texels = if is_hdr {
        let halves = rgba.as_chunks::<2>().0.iter().map(|&b| f16::from_le_bytes(b).to_f32());
        Texels::F32(keep(&halves.collect::<Vec<_>>(), channels))
    } else {
        Texels::U8(keep(&rgba, channels))
    };
    Ok(Image { name: name.to_owned(), width, height, channels: channels as u8, texels })
}

/// The first `channels` of every four numbers.
fn keep<T: Copy>(rgba: &[T], channels: usize) -> Vec<T> {
    rgba.as_chunks::<4>().0.iter().flat_map(|texel| &texel[..channels]).copied().collect()
}

#[cfg(test)]
mod tests;
