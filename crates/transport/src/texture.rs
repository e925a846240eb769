//! Point lookups in textures: wrap modes, nearest and bilinear filtering, decoding texel by texel.
//!
//! Texels stay in the scene's images as they were stored (8 or 16 bits, or floats) and are decoded when they are read.
//! There are no mipmaps: the path tracer averages many lookups a pixel instead.

use std::sync::LazyLock;
use vastlight_math::{Vec2, Vec4, real};
use vastlight_scene::{Encoding, Filter, Image, Scene, Texels, Texture, Wrap};

/// sRGB-encoded bytes as linear numbers.
static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// The transfer function of IEC 61966-2-1.
fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { real::pow((x + 0.055) / 1.055, 2.4) }
}

/// A texture that is ready for lookups; borrows the texels of its image.
#[derive(Clone, Copy, Debug)]
pub struct PreparedTexture<'s> {
    image: &'s Image,
    /// Rows of the affine map of coordinates: x, y, offset.
    matrix: [[f32; 3]; 2],
    wrap: [Wrap; 2],
    filter: Filter,
    srgb: Option<&'static [f32; 256]>,
    uv_set: u32,
}

impl<'s> PreparedTexture<'s> {
    /// All textures of a scene.
    #[must_use]
    pub fn all(scene: &'s Scene) -> Vec<Self> {
        scene.textures().iter().map(|t| Self::new(t, &scene.images()[t.image as usize])).collect()
    }

    /// A texture over the image that it names.
    #[must_use]
    pub fn new(texture: &Texture, image: &'s Image) -> Self {
        let t = &texture.transform;
        let (sin, cos) = real::sin_cos(t.rotation);
        Self {
            image,
            matrix: [
                [cos * t.scale.x, sin * t.scale.y, t.offset.x],
                [-sin * t.scale.x, cos * t.scale.y, t.offset.y],
            ],
            wrap: texture.wrap,
            filter: texture.filter,
            srgb: (texture.encoding == Encoding::Srgb).then(|| &*LINEAR_FROM_SRGB),
            uv_set: texture.uv_set,
        }
    }

    /// Index of the texture coordinate set that the texture is looked up with.
    #[must_use]
    pub fn uv_set(&self) -> u32 {
        self.uv_set
    }

    /// The linear RGBA value at texture coordinates (before the texture's own transform).
    ///
    /// Images of one or two channels are grey (and alpha); an absent alpha is 1.
    #[must_use]
    pub fn lookup(&self, uv: Vec2) -> Vec4 {
        let [a, b] = self.matrix;
        let x = (a[0] * uv.x + a[1] * uv.y + a[2]) * self.image.width as f32;
        let y = (b[0] * uv.x + b[1] * uv.y + b[2]) * self.image.height as f32;
        match self.filter {
            Filter::Nearest => self.wrapped(whole(x), whole(y)),
            Filter::Linear => self.bilinear(x - 0.5, y - 0.5),
        }
    }

    fn bilinear(&self, x: f32, y: f32) -> Vec4 {
        let (column, row) = (whole(x), whole(y));
        let (fx, fy) = (fraction(x), fraction(y));
        let top = self.wrapped(column, row).lerp(self.wrapped(column + 1, row), fx);
        let bottom = self.wrapped(column, row + 1).lerp(self.wrapped(column + 1, row + 1), fx);
        top.lerp(bottom, fy)
    }

    fn wrapped(&self, column: i64, row: i64) -> Vec4 {
        let column = wrap(column, self.image.width, self.wrap[0]);
        let row = wrap(row, self.image.height, self.wrap[1]);
        self.texel(row * self.image.width as usize + column)
    }

    fn texel(&self, index: usize) -> Vec4 {
        let n = usize::from(self.image.channels.clamp(1, 4));
        let range = index * n..(index + 1) * n;
        let srgb = self.srgb;
        match &self.image.texels {
            Texels::U8(data) => texel_of(data.get(range), |v, is_color| match srgb {
                Some(table) if is_color => table[usize::from(v)],
                _ => f32::from(v) * (1.0 / 255.0),
            }),
            Texels::U16(data) => texel_of(data.get(range), |v, is_color| {
                let x = f32::from(v) * (1.0 / 65_535.0);
                if srgb.is_some() && is_color { linear_from_srgb(x) } else { x }
            }),
            Texels::F32(data) => texel_of(data.get(range), |v, _| if v.is_finite() { v } else { 0.0 }),
        }
    }
}

/// RGBA from one to four stored channels; `decode` is told whether a channel is colour (not alpha).
fn texel_of<T: Copy>(stored: Option<&[T]>, decode: impl Fn(T, bool) -> f32) -> Vec4 {
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

/// The largest whole number below; 0 for what is not a number, and bounded so that sums do not overflow.
fn whole(x: f32) -> i64 {
    x.floor().clamp(-1e12, 1e12) as i64
}

fn fraction(x: f32) -> f32 {
    let f = x - x.floor();
    if f.is_finite() { f } else { 0.0 }
}

fn wrap(i: i64, size: u32, mode: Wrap) -> usize {
    let n = i64::from(size.max(1));
    let wrapped = match mode {
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * n);
            i.min(2 * n - 1 - i)
        }
    };
    wrapped as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_scene::TextureTransform;

    /// A grey image of 3 x 2 bytes: 0 10 20 / 30 40 50.
    fn ramp() -> Image {
        let texels = Texels::U8(vec![0, 10, 20, 30, 40, 50]);
        Image { name: String::new(), width: 3, height: 2, channels: 1, texels }
    }

    fn byte(texture: &Texture, u: f32, v: f32) -> f32 {
        PreparedTexture::new(texture, &ramp()).lookup(Vec2::new(u, v)).x * 255.0
    }

    #[test]
    fn nearest_wraps_in_three_ways() {
        let texture =
            |mode| Texture { wrap: [mode; 2], filter: Filter::Nearest, ..Texture::new(0, Encoding::Linear) };
        let columns = [-0.6_f32, -0.1, 0.1, 0.5, 0.9, 1.1, 1.9].map(|x| x / 1.0);
        let row = |mode| columns.map(|u| byte(&texture(mode), u, 0.25).round() as i32);
        assert_eq!(row(Wrap::Repeat), [10, 20, 0, 10, 20, 0, 20]);
        assert_eq!(row(Wrap::Mirror), [10, 0, 0, 10, 20, 20, 0]);
        assert_eq!(row(Wrap::Clamp), [0, 0, 0, 10, 20, 20, 20]);
    }

    #[test]
    fn bilinear_interpolates_between_centres_and_over_the_seam() {
        let texture = Texture::new(0, Encoding::Linear);
        assert!((byte(&texture, 0.5, 0.25) - 10.0).abs() < 1e-3);
        assert!((byte(&texture, 1.0 / 3.0, 0.25) - 5.0).abs() < 1e-3);
        assert!((byte(&texture, 0.5, 0.5) - 25.0).abs() < 1e-3);
        assert!((byte(&texture, 0.0, 0.25) - 10.0).abs() < 1e-3, "half of 0 and 20");
    }

    #[test]
    fn srgb_is_decoded_for_colour_and_not_for_alpha() {
        let image = |texels| Image { name: String::new(), width: 1, height: 1, channels: 4, texels };
        let bytes = image(Texels::U8(vec![188, 0, 255, 188]));
        let srgb = Texture::new(0, Encoding::Srgb);
        let v = PreparedTexture::new(&srgb, &bytes).lookup(Vec2::splat(0.3));
        assert!((v - Vec4::new(0.502_886, 0.0, 1.0, 188.0 / 255.0)).abs().max_element() < 1e-5, "{v}");
        let words = image(Texels::U16(vec![32_896, 0, 65_535, 32_896]));
        let v = PreparedTexture::new(&srgb, &words).lookup(Vec2::splat(0.3));
        assert!((v.x - linear_from_srgb(32_896.0 / 65_535.0)).abs() < 1e-6 && (v.w - 0.501_96).abs() < 1e-4);
        let floats = image(Texels::F32(vec![3.5, f32::NAN, 0.25, 1.0]));
        assert_eq!(PreparedTexture::new(&srgb, &floats).lookup(Vec2::ZERO), Vec4::new(3.5, 0.0, 0.25, 1.0));
    }

    #[test]
    fn the_transform_scales_turns_counter_clockwise_and_moves() {
        let transform = TextureTransform {
            offset: Vec2::new(0.1, 0.2),
            rotation: std::f32::consts::FRAC_PI_2,
            scale: Vec2::new(0.5, 2.0),
        };
        let image = ramp();
        let texture = Texture { transform, ..Texture::new(0, Encoding::Linear) };
        let [a, b] = PreparedTexture::new(&texture, &image).matrix;
        let map = |u: f32, v: f32| Vec2::new(a[0] * u + a[1] * v + a[2], b[0] * u + b[1] * v + b[2]);
        // v grows downwards: counter-clockwise takes u to minus v, v to u.
        assert!((map(1.0, 0.0) - Vec2::new(0.1, -0.3)).length() < 1e-6);
        assert!((map(0.0, 1.0) - Vec2::new(2.1, 0.2)).length() < 1e-6);
    }

    #[test]
    fn no_coordinate_and_no_image_breaks_a_lookup() {
        let short = Image { texels: Texels::U8(vec![1]), ..ramp() };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for filter in [Filter::Nearest, Filter::Linear] {
                let texture = Texture { wrap: [wrap; 2], filter, ..Texture::new(0, Encoding::Srgb) };
                for image in [&ramp(), &short] {
                    for u in [f32::NAN, f32::INFINITY, -1e30, 1e30, 1e-40] {
                        let v = PreparedTexture::new(&texture, image).lookup(Vec2::new(u, -u));
                        assert!(v.is_finite(), "{wrap:?} {filter:?} {u} {v}");
                    }
                }
            }
        }
    }
}
