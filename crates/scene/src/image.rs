//! Decoded images and the way they are sampled.

use serde::{Deserialize, Serialize};
use vastlight_math::Vec2;

/// Texels of an image, rows from the top, RGBA or fewer channels interleaved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Texels {
    /// 8 bits a channel.
    U8(Vec<u8>),
    /// 16 bits a channel.
    U16(Vec<u16>),
    /// Linear floats.
    F32(Vec<f32>),
}

/// A decoded image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Image {
    /// Name or file, for messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// Channels: 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA.
    pub channels: u8,
    /// `width * height * channels` numbers.
    pub texels: Texels,
}

impl Image {
    /// Bytes of all its texels, whether they are there or not.
    #[must_use]
    pub fn whole_bytes(&self) -> u64 {
        self.row_bytes() * u64::from(self.height)
    }

    /// Bytes of the texels of a row.
    #[must_use]
    pub fn row_bytes(&self) -> u64 {
        let texel = u64::from(self.channels.clamp(1, 4)) * self.texels.number_bytes() as u64;
        u64::from(self.width) * texel
    }
}

/// How stored numbers become linear values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Encoding {
    /// Colour channels are sRGB-encoded, alpha is linear.
    Srgb,
    /// Numbers are used as they are.
    Linear,
}

/// What happens outside [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wrap {
    /// The image repeats.
    Repeat,
    /// The image repeats, every other copy mirrored.
    Mirror,
    /// The border texel goes on.
    Clamp,
}

/// How values between texel centres are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Filter {
    /// The texel that contains the point.
    Nearest,
    /// Bilinear interpolation.
    Linear,
}

/// KHR_texture_transform: uv' = translation * rotation * scale * uv.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureTransform {
    /// Offset in texture space.
    pub offset: Vec2,
    /// Counter-clockwise rotation, radians.
    pub rotation: f32,
    /// Scale.
    pub scale: Vec2,
}

impl TextureTransform {
    /// No change.
    pub const IDENTITY: Self = Self { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
}

/// An image with the way it is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Texture {
    /// Index into [`crate::SceneDesc::images`].
    pub image: u32,
    /// Index of the texture coordinate set.
    pub uv_set: u32,
    /// Applied to the coordinates first.
    pub transform: TextureTransform,
    /// Outside [0, 1] along u and v.
    pub wrap: [Wrap; 2],
    /// Between texels.
    pub filter: Filter,
    /// How stored numbers become linear.
    pub encoding: Encoding,
}

impl Texture {
    /// A repeating, bilinear texture on the first coordinate set.
    #[must_use]
    pub const fn new(image: u32, encoding: Encoding) -> Self {
        Self {
            image,
            uv_set: 0,
            transform: TextureTransform::IDENTITY,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
            encoding,
        }
    }
}
