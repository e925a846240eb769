//! Lookups in textures: wrap modes, nearest and bilinear filtering, trilinear between the levels of a pyramid.
//!
//! Texels stay in the scene's images as they were stored (8 or 16 bits, or floats) and are decoded when they are read.

use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use vastlight_math::{Vec2, Vec4, real};
use vastlight_paging::Table;
use vastlight_scene::{Content, Filter, Image, Scene, TexelReader, Texture, Wrap, pyramid, texture_uses};
use vastlight_store::{StoredTexture, TileGrid};

/// A texture that is ready for lookups; borrows the texels of its image.
#[derive(Clone, Debug)]
pub struct PreparedTexture<'s> {
    pub(crate) image: &'s Image,
    /// The levels above it.
    pub(crate) smaller: Arc<[Image]>,
    /// Where all levels are, if not in memory.
    pub(crate) tiles: Option<Arc<TileGrid>>,
    /// Rows of the affine map of coordinates: x, y, offset.
    pub(crate) matrix: [[f32; 3]; 2],
    /// Texels of a unit square of coordinates.
    pub(crate) texels: f32,
    pub(crate) wrap: [Wrap; 2],
    pub(crate) filter: Filter,
    pub(crate) reader: TexelReader,
    pub(crate) uv_set: u32,
}

impl<'s> PreparedTexture<'s> {
    /// All textures of a scene, with pyramids of the images that are looked up from afar. Images of `stored` are in tiles.
    #[must_use]
    pub fn all(scene: &'s Scene, stored: &[StoredTexture]) -> Vec<Self> {
        let uses = texture_uses(scene.materials(), scene.textures());
        let key = |i: usize| (scene.textures()[i].image, uses[i].content);
        let stored: BTreeMap<(u32, Content), &Arc<TileGrid>> =
            stored.iter().map(|s| ((s.image, s.content), &s.grid)).collect();
        let mut wanted: Vec<(u32, Content)> =
            (0..uses.len()).filter(|&i| uses[i].filtered && !stored.contains_key(&key(i))).map(key).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let make =
            |&(image, content): &(u32, Content)| pyramid(&scene.images()[image as usize], content).into();
        let pyramids: Vec<Arc<[Image]>> = wanted.par_iter().map(make).collect();
        let prepare = |(i, texture): (usize, &Texture)| {
            let made = wanted.binary_search(&key(i)).ok().filter(|_| uses[i].filtered);
            Self {
                smaller: made.map(|at| pyramids[at].clone()).unwrap_or_default(),
                tiles: stored.get(&key(i)).map(|&grid| grid.clone()),
                ..Self::new(texture, &scene.images()[texture.image as usize])
            }
        };
        scene.textures().iter().enumerate().map(prepare).collect()
    }

    /// A texture over the image that it names, without a pyramid.
    #[must_use]
    pub fn new(texture: &Texture, image: &'s Image) -> Self {
        let t = &texture.transform;
        let (sin, cos) = real::sin_cos(t.rotation);
        let matrix =
            [[cos * t.scale.x, sin * t.scale.y, t.offset.x], [-sin * t.scale.x, cos * t.scale.y, t.offset.y]];
        Self {
            image,
            smaller: Arc::default(),
            tiles: None,
            matrix,
            texels: (t.scale.x * t.scale.y).abs() * image.width as f32 * image.height as f32,
            wrap: texture.wrap,
            filter: texture.filter,
            reader: TexelReader::new(texture.encoding),
            uv_set: texture.uv_set,
        }
    }

    /// Index of the texture coordinate set that the texture is looked up with.
    #[must_use]
    pub fn uv_set(&self) -> u32 {
        self.uv_set
    }

    /// Whether the texels are in tiles, not in memory.
    #[must_use]
    pub fn is_in_tiles(&self) -> bool {
        self.tiles.is_some()
    }

    /// The linear RGBA value at texture coordinates (before the texture's own transform) in the image itself.
    ///
    /// Images of one or two channels are grey (and alpha); an absent alpha is 1. White if the texels are not in memory.
    #[must_use]
    pub fn lookup(&self, uv: Vec2) -> Vec4 {
        self.lookup_area(uv, 0.0)
    }

    /// The same for an area of the coordinates around `uv`: the mean of two neighbouring levels of the pyramid, so that a texel is about as large as
    /// the area. For areas of at most a texel it is [`lookup`](Self::lookup).
    #[must_use]
    pub fn lookup_area(&self, uv: Vec2, area: f32) -> Vec4 {
        self.filtered(uv, area, self.smaller.len(), &mut InMemory(self))
    }

    /// [`lookup_area`](Self::lookup_area) through tiles, if the texels are there.
    #[must_use]
    pub fn lookup_through(&self, tiles: &mut TileAccess<'_>, uv: Vec2, area: f32) -> Vec4 {
        match &self.tiles {
            Some(grid) => {
                self.filtered(uv, area, grid.levels().len() - 1, &mut InTiles { texture: self, grid, tiles })
            }
            None => self.lookup_area(uv, area),
        }
    }

    #[inline]
    fn filtered(&self, uv: Vec2, area: f32, last: usize, levels: &mut impl Levels) -> Vec4 {
        let place = self.place(uv);
        let Some((level, share)) = level_of(area * self.texels, last) else {
            return self.sample(0, place, levels);
        };
        let fine = self.sample(level, place, levels);
        if share > 0.0 { fine.lerp(self.sample(level + 1, place, levels), share) } else { fine }
    }

    /// Coordinates in the image, its sides 1.
    #[inline]
    fn place(&self, uv: Vec2) -> Vec2 {
        let [a, b] = self.matrix;
        Vec2::new(a[0] * uv.x + a[1] * uv.y + a[2], b[0] * uv.x + b[1] * uv.y + b[2])
    }

    #[inline]
    fn sample(&self, level: usize, place: Vec2, levels: &mut impl Levels) -> Vec4 {
        let [width, height] = levels.size(level);
        let (x, y) = (place.x * width as f32, place.y * height as f32);
        let mut wrapped = |column: i64, row: i64| {
            levels.texel(level, wrap(column, width, self.wrap[0]), wrap(row, height, self.wrap[1]))
        };
        match self.filter {
            Filter::Nearest => wrapped(whole(x), whole(y)),
            Filter::Linear => {
                let (x, y) = (x - 0.5, y - 0.5);
                let (column, row) = (whole(x), whole(y));
                let (fx, fy) = (fraction(x), fraction(y));
                let top = wrapped(column, row).lerp(wrapped(column + 1, row), fx);
                let bottom = wrapped(column, row + 1).lerp(wrapped(column + 1, row + 1), fx);
                top.lerp(bottom, fy)
            }
        }
    }
}

/// The finer of two levels and the share of the other, for an area of so many texels; none for the image itself.
#[inline]
fn level_of(texels: f32, last: usize) -> Option<(usize, f32)> {
    // What is not a number is no area.
    if last == 0 || texels.is_nan() || texels <= 1.0 {
        return None;
    }
    let level = (0.5 * std::f32::consts::LOG2_E * real::ln(texels)).clamp(0.0, last as f32);
    Some((level as usize, level - level.floor()))
}

/// Where texels come from.
trait Levels {
    fn size(&self, level: usize) -> [u32; 2];
    fn texel(&mut self, level: usize, column: u32, row: u32) -> Vec4;
}

/// The image and its pyramid.
struct InMemory<'t>(&'t PreparedTexture<'t>);

impl InMemory<'_> {
    #[inline]
    fn image(&self, level: usize) -> &Image {
        level.checked_sub(1).and_then(|i| self.0.smaller.get(i)).unwrap_or(self.0.image)
    }
}

impl Levels for InMemory<'_> {
    #[inline]
    fn size(&self, level: usize) -> [u32; 2] {
        let image = self.image(level);
        [image.width, image.height]
    }

    #[inline]
    fn texel(&mut self, level: usize, column: u32, row: u32) -> Vec4 {
        let image = self.image(level);
        let index = row as usize * image.width as usize + column as usize;
        self.0.reader.read(&image.texels, image.channels, index)
    }
}

/// Tiles that are in memory, and those that lookups touched.
#[derive(Debug)]
pub struct TileAccess<'t> {
    table: &'t Table,
    /// The tiles that were touched, each once.
    touched: &'t mut Vec<u32>,
    is_missing: bool,
}

impl<'t> TileAccess<'t> {
    /// Lookups in the tiles of `table`; `touched` is made empty first.
    pub fn new(table: &'t Table, touched: &'t mut Vec<u32>) -> Self {
        touched.clear();
        Self { table, touched, is_missing: false }
    }

    /// Whether a tile was not in memory: what was looked up is then of no use.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        self.is_missing
    }
}

/// Levels in tiles.
struct InTiles<'a, 't> {
    texture: &'a PreparedTexture<'a>,
    grid: &'a TileGrid,
    tiles: &'a mut TileAccess<'t>,
}

impl Levels for InTiles<'_, '_> {
    #[inline]
    fn size(&self, level: usize) -> [u32; 2] {
        let level = &self.grid.levels()[level];
        [level.width, level.height]
    }

    #[inline]
    fn texel(&mut self, level: usize, column: u32, row: u32) -> Vec4 {
        let (page, index) = self.grid.place(level, column, row);
        let TileAccess { table, touched, is_missing } = &mut *self.tiles;
        if touched.last() != Some(&page) && !touched.contains(&page) {
            touched.push(page);
        }
        let PreparedTexture { image, reader, .. } = self.texture;
        match table.page(page) {
            Some(bytes) => reader.read_bytes(&image.texels, image.channels, bytes, index),
            None => {
                *is_missing = true;
                Vec4::ONE
            }
        }
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

fn wrap(i: i64, size: u32, mode: Wrap) -> u32 {
    let n = i64::from(size.max(1));
    let wrapped = match mode {
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * n);
            i.min(2 * n - 1 - i)
        }
    };
    wrapped as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_scene::{Encoding, Texels, TextureTransform};

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

    /// From near to far: the image, then means of more and more texels, and of all in the end.
    #[test]
    fn larger_areas_are_looked_up_in_smaller_images() {
        let texels = Texels::F32((0..64).map(|i| if i % 2 == i / 8 % 2 { 1.0 } else { 0.0 }).collect());
        let image = Image { name: String::new(), width: 8, height: 8, channels: 1, texels };
        let plain = PreparedTexture::new(&Texture::new(0, Encoding::Linear), &image);
        let texture = PreparedTexture { smaller: pyramid(&image, Content::Data).into(), ..plain.clone() };
        let uv = Vec2::new(1.5 / 8.0, 0.5 / 8.0);
        let at = |texels: f32| texture.lookup_area(uv, texels / 64.0).x;
        for texels in [0.0, 0.3, 1.0, f32::NAN, -1.0] {
            assert_eq!(at(texels), texture.lookup(uv).x);
        }
        assert_eq!(at(4.0), 0.5, "every 2 x 2 texels have the same mean");
        assert!((at(2.0) - 0.25).abs() < 1e-6, "half way");
        assert_eq!([at(64.0), at(1e30), at(f32::INFINITY)], [0.5; 3]);
        assert_eq!(plain.lookup_area(uv, 1.0), plain.lookup(uv), "there is no pyramid");
        let far = TextureTransform { scale: Vec2::splat(8.0), ..TextureTransform::IDENTITY };
        let far = Texture { transform: far, ..Texture::new(0, Encoding::Linear) };
        let far = PreparedTexture { smaller: texture.smaller.clone(), ..PreparedTexture::new(&far, &image) };
        assert_eq!(far.lookup_area(uv, 1.0 / 64.0).x, 0.5, "the transform makes areas larger");
    }

    /// The pages of an image and its pyramid.
    fn pages(image: &Image, smaller: &[Image], grid: &TileGrid) -> Vec<Vec<u8>> {
        let mut pages = vec![Vec::new(); grid.pages() as usize];
        let n = usize::from(image.channels);
        let bytes = n * image.texels.number_bytes();
        for (number, level) in std::iter::once(image).chain(smaller).enumerate() {
            for i in 0..level.width * level.height {
                let (page, texel) = grid.place(number, i % level.width, i / level.width);
                let page: &mut Vec<u8> = &mut pages[page as usize];
                page.resize(page.len().max((texel + 1) * bytes), 0);
                let mut raw = Vec::new();
                level.texels.append_bytes(i as usize * n..(i as usize + 1) * n, &mut raw);
                page[texel * bytes..(texel + 1) * bytes].copy_from_slice(&raw);
            }
        }
        pages
    }

    /// Lookups in memory and through tiles have the same bits, once all tiles that they name are there.
    #[test]
    fn tiles_say_what_memory_says() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        let count = 45 * 29 * 3;
        let floats: Vec<f32> = (0..count).map(|_| random()).collect();
        let kinds = [
            Texels::U8(floats.iter().map(|x| (x * 255.0) as u8).collect()),
            Texels::U16(floats.iter().map(|x| (x * 65_535.0) as u16).collect()),
            Texels::F32(floats),
        ];
        for (kind, texels) in kinds.into_iter().enumerate() {
            let image = Image { name: String::new(), width: 45, height: 29, channels: 3, texels };
            let smaller: Arc<[Image]> = pyramid(&image, Content::Color).into();
            let grid = Arc::new(TileGrid::new(45, 29, 2, 0).expect("small"));
            let pages = pages(&image, &smaller, &grid);
            let all = Table::resident(pages.iter().map(Vec::as_slice), 0);
            let bare = Image { texels: image.texels.none_like(), ..image.clone() };
            for (wrap, filter) in [
                (Wrap::Repeat, Filter::Linear),
                (Wrap::Mirror, Filter::Linear),
                (Wrap::Clamp, Filter::Linear),
                (Wrap::Repeat, Filter::Nearest),
            ] {
                let texture = Texture { wrap: [wrap; 2], filter, ..Texture::new(0, Encoding::Srgb) };
                let here =
                    PreparedTexture { smaller: smaller.clone(), ..PreparedTexture::new(&texture, &image) };
                let there =
                    PreparedTexture { tiles: Some(grid.clone()), ..PreparedTexture::new(&texture, &bare) };
                let mut most = 0;
                for _ in 0..400 {
                    let uv = Vec2::new(random() * 4.0 - 2.0, random() * 4.0 - 2.0);
                    let area = real::exp(random() * 12.0 - 9.0);
                    let expected = here.lookup_area(uv, area);
                    let mut touched = Vec::new();
                    let mut access = TileAccess::new(&all, &mut touched);
                    assert_eq!(there.lookup_through(&mut access, uv, area), expected, "{kind} {wrap:?}");
                    assert!(!access.is_missing());
                    most = most.max(touched.len());
                    // The tiles that it names are all that it needs, and it needs each of them.
                    let mut few = Table::new(pages.len());
                    for &page in &touched {
                        let mut unused = Vec::new();
                        let mut access = TileAccess::new(&few, &mut unused);
                        let _ = there.lookup_through(&mut access, uv, area);
                        assert!(access.is_missing());
                        let one =
                            Table::resident(std::iter::once(pages[page as usize].as_slice()), 0).set(0, None);
                        few.set(page, one);
                    }
                    let mut again = Vec::new();
                    let mut access = TileAccess::new(&few, &mut again);
                    assert_eq!(there.lookup_through(&mut access, uv, area), expected);
                    assert!(!access.is_missing() && again == touched);
                }
                assert!((2..=8).contains(&most), "{most}");
            }
        }
    }

    #[test]
    fn no_coordinate_and_no_image_breaks_a_lookup() {
        let short = Image { texels: Texels::U8(vec![1]), ..ramp() };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for filter in [Filter::Nearest, Filter::Linear] {
                let texture = Texture { wrap: [wrap; 2], filter, ..Texture::new(0, Encoding::Srgb) };
                for image in [&ramp(), &short] {
                    for u in [f32::NAN, f32::INFINITY, -1e30, 1e30, 1e-40] {
                        let plain = PreparedTexture::new(&texture, image);
                        let smaller = pyramid(image, Content::Color).into();
                        let texture = PreparedTexture { smaller, ..plain };
                        let v = texture.lookup(Vec2::new(u, -u));
                        assert!(v.is_finite(), "{wrap:?} {filter:?} {u} {v}");
                        assert!(texture.lookup_area(Vec2::new(u, u), u).is_finite());
                    }
                }
            }
        }
    }
}
