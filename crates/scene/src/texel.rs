//! Stored numbers of images as linear values, and back.

use crate::{Encoding, Texels};
use std::ops::Range;
use std::sync::LazyLock;
use vastlight_math::{Vec4, real};

/// sRGB-encoded bytes as linear numbers.
static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// Linear numbers from which on the next sRGB-encoded byte is nearer.
static NEXT_SRGB: LazyLock<[f32; 255]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb((i as f32 + 0.5) / 255.0)));

/// The transfer function of IEC 61966-2-1.
fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { real::pow((x + 0.055) / 1.055, 2.4) }
}

/// Its inverse.
fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.003_130_8 { x * 12.92 } else { 1.055 * real::pow(x, 1.0 / 2.4) - 0.055 }
}

/// Decodes texels: the one place that says what stored numbers mean.
#[derive(Clone, Copy, Debug)]
pub struct TexelReader {
    srgb: Option<&'static [f32; 256]>,
}

impl TexelReader {
    /// A reader of numbers in this encoding. Floats are linear in any.
    #[must_use]
    pub fn new(encoding: Encoding) -> Self {
        Self { srgb: (encoding == Encoding::Srgb).then(|| &*LINEAR_FROM_SRGB) }
    }

    /// Whether colours are sRGB-encoded.
    #[must_use]
    pub fn is_srgb(self) -> bool {
        self.srgb.is_some()
    }

    /// sRGB-encoded bytes as linear numbers.
    #[must_use]
    pub fn srgb_table() -> &'static [f32; 256] {
        &LINEAR_FROM_SRGB
    }

    /// The linear RGBA value of the texel number `index`; white where there is none. One or two channels are grey (and
    /// alpha); an absent alpha is 1; a float that is not finite is 0.
    #[inline(always)]
    #[must_use]
    pub fn read(self, texels: &Texels, channels: u8, index: usize) -> Vec4 {
        let n = usize::from(channels.clamp(1, 4));
        let range = index * n..(index + 1) * n;
        match texels {
            Texels::U8(data) => rgba(data.get(range), |v, is_color| self.byte(v, is_color)),
            Texels::U16(data) => rgba(data.get(range), |v, is_color| self.word(v, is_color)),
            Texels::F32(data) => rgba(data.get(range), |v, _| finite(v)),
        }
    }

    /// The same from little-endian bytes that hold texels stored like `kind`, whose own texels do not matter.
    #[inline(always)]
    #[must_use]
    pub fn read_bytes(self, kind: &Texels, channels: u8, bytes: &[u8], index: usize) -> Vec4 {
        let n = usize::from(channels.clamp(1, 4));
        let part = |width: usize| bytes.get(index * n * width..(index + 1) * n * width);
        match kind {
            Texels::U8(_) => rgba(part(1), |v, is_color| self.byte(v, is_color)),
            Texels::U16(_) => {
                let words = part(2).map(|b| numbers(b, u16::from_le_bytes));
                rgba(words.as_ref().and_then(|w| w.get(..n)), |v, is_color| self.word(v, is_color))
            }
            Texels::F32(_) => {
                let floats = part(4).map(|b| numbers(b, f32::from_le_bytes));
                rgba(floats.as_ref().and_then(|f| f.get(..n)), |v, _| finite(v))
            }
        }
    }

    #[inline(always)]
    fn byte(self, v: u8, is_color: bool) -> f32 {
        match self.srgb {
            Some(table) if is_color => table[usize::from(v)],
            _ => f32::from(v) * (1.0 / 255.0),
        }
    }

    #[inline(always)]
    fn word(self, v: u16, is_color: bool) -> f32 {
        let x = f32::from(v) * (1.0 / 65_535.0);
        if self.srgb.is_some() && is_color { linear_from_srgb(x) } else { x }
    }
}

#[inline(always)]
fn finite(v: f32) -> f32 {
    if v.is_finite() { v } else { 0.0 }
}

/// Up to four numbers of `N` bytes each.
#[inline(always)]
fn numbers<const N: usize, T: Copy + Default>(bytes: &[u8], number: impl Fn([u8; N]) -> T) -> [T; 4] {
    let mut out = [T::default(); 4];
    for (out, &bytes) in out.iter_mut().zip(bytes.as_chunks().0) {
        *out = number(bytes);
    }
    out
}

/// RGBA from one to four stored channels; `decode` is told whether a channel is colour (not alpha).
#[inline(always)]
fn rgba<T: Copy>(stored: Option<&[T]>, decode: impl Fn(T, bool) -> f32) -> Vec4 {
    match stored {
        Some(&[g]) => Vec4::new(decode(g, true), decode(g, true), decode(g, true), 1.0),
        Some(&[g, a]) => {
            let g = decode(g, true);
            Vec4::new(g, g, g, decode(a, false))
        }
        Some(&[r, g, b]) => Vec4::new(decode(r, true), decode(g, true), decode(b, true), 1.0),
        Some(&[r, g, b, a]) => Vec4::new(decode(r, true), decode(g, true), decode(b, true), decode(a, false)),
        _ => Vec4::ONE,
    }
}

impl Texels {
    /// None, stored like these.
    #[must_use]
    pub fn none_like(&self) -> Self {
        match self {
            Self::U8(_) => Self::U8(Vec::new()),
            Self::U16(_) => Self::U16(Vec::new()),
            Self::F32(_) => Self::F32(Vec::new()),
        }
    }

    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::F32(v) => v.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of one number.
    #[must_use]
    pub fn number_bytes(&self) -> usize {
        match self {
            Self::U8(_) => 1,
            Self::U16(_) => 2,
            Self::F32(_) => 4,
        }
    }

    /// Takes all away and keeps the memory.
    pub fn clear(&mut self) {
        match self {
            Self::U8(v) => v.clear(),
            Self::U16(v) => v.clear(),
            Self::F32(v) => v.clear(),
        }
    }

    /// Adds those numbers of `other` that `range` names and that there are; nothing if they are stored in another way.
    pub fn append(&mut self, other: &Self, range: Range<usize>) {
        match (self, other) {
            (Self::U8(to), Self::U8(from)) => to.extend(from.get(range).unwrap_or_default()),
            (Self::U16(to), Self::U16(from)) => to.extend(from.get(range).unwrap_or_default()),
            (Self::F32(to), Self::F32(from)) => to.extend(from.get(range).unwrap_or_default()),
            _ => {}
        }
    }

    /// Adds the numbers that `range` names to `out`, little-endian.
    pub fn append_bytes(&self, range: Range<usize>, out: &mut Vec<u8>) {
        match self {
            Self::U8(v) => out.extend(v.get(range).unwrap_or_default()),
            Self::U16(v) => v.get(range).unwrap_or_default().iter().for_each(|x| out.extend(x.to_le_bytes())),
            Self::F32(v) => v.get(range).unwrap_or_default().iter().for_each(|x| out.extend(x.to_le_bytes())),
        }
    }

    /// Adds a texel that a reader of `encoding` reads as near to the linear `value` as can be.
    pub fn push(&mut self, channels: u8, encoding: Encoding, value: Vec4) {
        let [r, g, b, a] = value.to_array();
        let (colors, alpha): (&[f32], _) = match channels {
            0 | 1 => (&[r], None),
            2 => (&[r], Some(a)),
            3 => (&[r, g, b], None),
            _ => (&[r, g, b], Some(a)),
        };
        let srgb = encoding == Encoding::Srgb;
        match self {
            Self::U8(v) => {
                v.extend(colors.iter().map(|&x| if srgb { srgb_byte(x) } else { whole(x, 255.0) as u8 }));
                v.extend(alpha.map(|x| whole(x, 255.0) as u8));
            }
            Self::U16(v) => {
                let color = |x: f32| if srgb { srgb_from_linear(x) } else { x };
                v.extend(colors.iter().map(|&x| whole(color(x), 65_535.0) as u16));
                v.extend(alpha.map(|x| whole(x, 65_535.0) as u16));
            }
            Self::F32(v) => v.extend(colors.iter().copied().chain(alpha)),
        }
    }
}

fn srgb_byte(x: f32) -> u8 {
    NEXT_SRGB.partition_point(|&next| next <= x) as u8
}

fn whole(x: f32, largest: f32) -> f32 {
    (x * largest + 0.5).clamp(0.0, largest).floor()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let bytes = Texels::U8((0..=255).collect());
        let words = Texels::U16((0..=255).map(|i| i * 257).collect());
        let floats = Texels::F32((0..=255).map(|i| i as f32 * 0.01).collect());
        for encoding in [Encoding::Srgb, Encoding::Linear] {
            let reader = TexelReader::new(encoding);
            for stored in [&bytes, &words, &floats] {
                for channels in 1..=4 {
                    let mut raw = Vec::new();
                    stored.append_bytes(0..stored.len(), &mut raw);
                    assert_eq!(raw.len(), stored.len() * stored.number_bytes());
                    let mut back = stored.none_like();
                    for i in 0..256 / usize::from(channels) {
                        let value = reader.read(stored, channels, i);
                        assert_eq!(value, reader.read_bytes(&back, channels, &raw, i));
                        back.push(channels, encoding, value);
                    }
                    let mut start = stored.none_like();
                    start.append(stored, 0..back.len());
                    assert_eq!(back, start, "{encoding:?} {channels}");
                }
            }
        }
    }

    #[test]
    fn srgb_is_decoded_for_colour_and_not_for_alpha() {
        let srgb = TexelReader::new(Encoding::Srgb);
        let v = srgb.read(&Texels::U8(vec![188, 0, 255, 188]), 4, 0);
        assert!((v - Vec4::new(0.502_886, 0.0, 1.0, 188.0 / 255.0)).abs().max_element() < 1e-5, "{v}");
        let v = srgb.read(&Texels::U16(vec![32_896, 0, 65_535, 32_896]), 4, 0);
        assert!((v.x - linear_from_srgb(32_896.0 / 65_535.0)).abs() < 1e-6 && (v.w - 0.501_96).abs() < 1e-4);
        let v = srgb.read(&Texels::F32(vec![3.5, f32::NAN, 0.25, 1.0]), 4, 0);
        assert_eq!(v, Vec4::new(3.5, 0.0, 0.25, 1.0));
        assert_eq!(srgb.read(&Texels::U8(vec![1, 2, 3]), 4, 0), Vec4::ONE, "too short");
    }

    #[test]
    fn numbers_out_of_range_are_clamped() {
        let mut bytes = Texels::U8(Vec::new());
        bytes.push(4, Encoding::Srgb, Vec4::new(-1.0, 2.0, f32::NAN, 7.0));
        bytes.push(4, Encoding::Linear, Vec4::new(-1.0, 2.0, 0.5, -7.0));
        assert_eq!(bytes, Texels::U8(vec![0, 255, 0, 255, 0, 255, 128, 0]));
    }
}
