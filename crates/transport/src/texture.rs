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
