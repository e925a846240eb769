//! Colours of JPEG: the numbers of ITU-T T.871 with the rounding of the Independent JPEG Group's library; inks as Adobe stores them,
//! with 255 for none.

use super::MOST_COMPONENTS;
use zune_jpeg::zune_core::colorspace::ColorSpace;

/// What the components of an image are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Colors {
    Grey,
    Rgb,
    /// Luma and two differences.
    YCbCr,
    /// Four inks.
    Cmyk,
    /// Three of them as luma and two differences.
    Ycck,
}

impl Colors {
    /// None if we do not know them.
    pub(super) fn of(space: ColorSpace) -> Option<Self> {
        match space {
            ColorSpace::Luma => Some(Self::Grey),
            ColorSpace::RGB => Some(Self::Rgb),
            ColorSpace::YCbCr => Some(Self::YCbCr),
            ColorSpace::CMYK => Some(Self::Cmyk),
            ColorSpace::YCCK => Some(Self::Ycck),
            _ => None,
        }
    }

    /// Components in the file.
    pub(super) fn components(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::Rgb | Self::YCbCr => 3,
            Self::Cmyk | Self::Ycck => 4,
        }
    }

    /// Channels of the image.
    pub(super) fn channels(self) -> u8 {
        if self == Self::Grey { 1 } else { 3 }
    }

    /// Adds a row of texels, from a row of each component.
    pub(super) fn convert(self, rows: &[&[u8]; MOST_COMPONENTS], width: usize, out: &mut Vec<u8>) {
        if self == Self::Grey {
            return out.extend_from_slice(rows[0]);
        }
        let start = out.len();
        out.resize(start + 3 * width, 0);
        let texels = out[start..].as_chunks_mut::<3>().0;
        match self {
            Self::Grey | Self::Rgb => each(texels, rows, |rgb| rgb),
            Self::YCbCr => each(texels, rows, rgb_of),
            Self::Cmyk => {
                each(texels, rows, |inks| inks);
                darken(texels, rows[3]);
            }
            Self::Ycck => {
                each(texels, rows, |yuv| rgb_of(yuv).map(|ink| 255 - ink));
                darken(texels, rows[3]);
            }
        }
    }
}

#[inline(always)]
fn each(texels: &mut [[u8; 3]], rows: &[&[u8]; MOST_COMPONENTS], of: impl Fn([u8; 3]) -> [u8; 3]) {
    let [a, b, c, _] = rows;
    for (((texel, &a), &b), &c) in texels.iter_mut().zip(*a).zip(*b).zip(*c) {
        *texel = of([a, b, c]);
    }
}

/// What black ink leaves.
fn darken(texels: &mut [[u8; 3]], black: &[u8]) {
    for (texel, &k) in texels.iter_mut().zip(black) {
        *texel = texel.map(|ink| product(ink, k));
    }
}

/// `a b / 255`, rounded.
fn product(a: u8, b: u8) -> u8 {
    let t = u32::from(a) * u32::from(b) + 128;
    ((t + (t >> 8)) >> 8) as u8
}

/// 1.402, 0.71414, 0.34414 and 1.772 in units of 2^-16.
const RED: i32 = 91_881;
const GREEN: [i32; 2] = [46_802, 22_554];
const BLUE: i32 = 116_130;
const HALF: i32 = 1 << 15;

#[inline(always)]
fn rgb_of([y, cb, cr]: [u8; 3]) -> [u8; 3] {
    let [y, cb, cr] = [i32::from(y), i32::from(cb) - 128, i32::from(cr) - 128];
    let rgb = [
        y + ((RED * cr + HALF) >> 16),
        y + ((HALF - GREEN[1] * cb - GREEN[0] * cr) >> 16),
        y + ((BLUE * cb + HALF) >> 16),
    ];
    rgb.map(|x| x.clamp(0, 255) as u8)
}
