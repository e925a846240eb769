//! The film: a grid of tiles, and the way from sums to a picture.

use crate::coverage::Coverage;
use crate::{Aov, Cryptomatte, FilmError, FilmTile, Picture, Plane};
use rayon::prelude::*;
use std::ops::Range;

/// A rectangle of pixels, half open: `x0 <= x < x1`, `y0 <= y < y1`; y grows downwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Left edge.
    pub x0: u32,
    /// Top edge.
    pub y0: u32,
    /// Right edge, exclusive.
    pub x1: u32,
    /// Bottom edge, exclusive.
    pub y1: u32,
}

impl Window {
    /// The window of a whole picture.
    #[must_use]
    pub const fn whole(width: u32, height: u32) -> Self {
        Self { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// Columns.
    #[must_use]
    pub const fn width(&self) -> u32 {
        self.x1.saturating_sub(self.x0)
    }

    /// Rows.
    #[must_use]
    pub const fn height(&self) -> u32 {
        self.y1.saturating_sub(self.y0)
    }

    /// Number of pixels.
    #[must_use]
    pub const fn pixels(&self) -> usize {
        self.width() as usize * self.height() as usize
    }

    /// The row-major index of pixel (x, y); `None` outside.
    #[inline]
    #[must_use]
    pub fn index(&self, x: u32, y: u32) -> Option<usize> {
        let inside = (self.x0..self.x1).contains(&x) && (self.y0..self.y1).contains(&y);
        inside.then(|| (y - self.y0) as usize * self.width() as usize + (x - self.x0) as usize)
    }

    /// The rows of pixels that are in both windows, as the places that they have in each.
    pub(crate) fn shared_rows(&self, other: &Self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
        let (a, b) = (*self, *other);
        let (x0, x1) = (a.x0.max(b.x0), a.x1.min(b.x1));
        let width = x1.saturating_sub(x0) as usize;
        let rows = if width > 0 { a.y0.max(b.y0)..a.y1.min(b.y1) } else { 0..0 };
        let run = move |window: Self, y: u32| window.index(x0, y).map(|start| start..start + width);
        rows.filter_map(move |y| Some((run(a, y)?, run(b, y)?)))
    }

    /// Squares of `size` pixels (smaller at the edges) on the grid of the whole picture, row by row.
    pub(crate) fn tiles(self, size: u32) -> impl Iterator<Item = Self> {
        let starts = move |lo: u32, hi: u32| (lo / size * size..hi).step_by(size as usize);
        starts(self.y0, self.y1).flat_map(move |y| {
            starts(self.x0, self.x1).map(move |x| Self {
                x0: x.max(self.x0),
                y0: y.max(self.y0),
                x1: x.saturating_add(size).min(self.x1),
                y1: y.saturating_add(size).min(self.y1),
            })
        })
    }
}

/// What a film records.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilmSettings {
    /// Width and height of the whole picture in pixels.
    pub full_size: [u32; 2],
    /// The part to render.
    pub window: Window,
    /// Edge of the tiles in pixels.
    pub tile_size: u32,
    /// Auxiliary outputs.
    pub aovs: Vec<Aov>,
    /// Whether squares of the samples' luminance are summed too, from which the noise of a pixel follows.
    pub squares: bool,
}

impl FilmSettings {
    /// Whether films of both record the same, whatever their tiles are.
    #[must_use]
    pub fn records_the_same(&self, other: &Self) -> bool {
        let Self { full_size, window, tile_size: _, aovs, squares } = self;
        let has = |aov| (aovs.contains(aov), other.aovs.contains(aov));
        let same_aovs = Aov::ALL.iter().map(has).all(|(a, b)| a == b);
        (*full_size, *window, *squares) == (other.full_size, other.window, other.squares) && same_aovs
    }
}

/// The sums of a picture. Samples go to its tiles, which threads may fill at the same time.
#[derive(Clone, Debug)]
pub struct Film {
    settings: FilmSettings,
    tiles: Vec<FilmTile>,
}

impl Film {
    /// Name of the matte layer of objects.
    pub const OBJECT_LAYER: &str = "CryptoObject";
    /// Name of the matte layer of materials.
    pub const MATERIAL_LAYER: &str = "CryptoMaterial";

    /// An empty film.
    #[must_use]
    pub fn new(settings: FilmSettings) -> Self {
        let windows = settings.window.tiles(settings.tile_size.max(1));
        let tiles = windows.map(|w| FilmTile::new(w, &settings)).collect();
        Self { settings, tiles }
    }

    /// What the film records.
    #[must_use]
    pub fn settings(&self) -> &FilmSettings {
        &self.settings
    }

    /// The tiles.
    pub(crate) fn tiles(&self) -> &[FilmTile] {
        &self.tiles
    }

    /// The rows of the window from the top, each cut where tiles end: a tile, and the run of its pixels.
    pub(crate) fn runs(&self) -> Vec<(usize, Range<usize>)> {
        let mut runs: Vec<(u32, u32, usize, Range<usize>)> = Vec::new();
        for (number, tile) in self.tiles.iter().enumerate() {
            let (window, width) = (tile.window(), tile.window().width() as usize);
            let row = |(i, y): (usize, u32)| (y, window.x0, number, i * width..(i + 1) * width);
            runs.extend((window.y0..window.y1).enumerate().map(row));
        }
        runs.sort_unstable_by_key(|&(y, x, ..)| (y, x));
        runs.into_iter().map(|(_, _, tile, run)| (tile, run)).collect()
    }

    /// The tiles, to add samples to.
    pub fn tiles_mut(&mut self) -> &mut [FilmTile] {
        &mut self.tiles
    }

    /// Samples whose radiance was not finite; they count as black.
    #[must_use]
    pub fn non_finite(&self) -> u64 {
        self.tiles.iter().map(FilmTile::non_finite).sum()
    }

    /// Takes the number of samples that were not finite from a file.
    pub(crate) fn set_non_finite(&mut self, count: u64) {
        if let Some(tile) = self.tiles.first_mut() {
            tile.non_finite = count;
        }
    }

    /// Samples in all pixels together.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.tiles.iter().flat_map(|t| &t.samples).map(|&n| u64::from(n)).sum()
    }

    /// A number of each pixel of the window, row by row, from the tile that it is in and the samples that it has.
    #[must_use]
    pub fn per_pixel(&self, number: impl Fn(usize, u32) -> u32) -> Vec<u32> {
        let mut numbers = Vec::with_capacity(self.settings.window.pixels());
        for (tile, run) in self.runs() {
            numbers.extend(self.tiles[tile].samples[run].iter().map(|&samples| number(tile, samples)));
        }
        numbers
    }

    /// Adds all samples of `other`, whatever its tiles are. Merging in any order and grouping gives the same bits.
    ///
    /// # Errors
    /// If the two films do not record the same thing.
    pub fn merge(&mut self, other: &Self) -> Result<(), FilmError> {
        if !self.settings.records_the_same(&other.settings) {
            return Err(FilmError::mismatch("the films differ in size, window or AOVs"));
        }
        if self.tiles.iter().map(FilmTile::window).eq(other.tiles.iter().map(FilmTile::window)) {
            self.tiles.iter_mut().zip(&other.tiles).for_each(|(a, b)| a.merge(b));
        } else {
            self.tiles.iter_mut().for_each(|a| other.tiles.iter().for_each(|b| a.merge(b)));
        }
        if let Some(tile) = self.tiles.first_mut() {
            tile.non_finite += other.non_finite();
        }
        Ok(())
    }

    /// Puts tiles of other pixels beside those that are there; the film is of `window` then.
    pub(crate) fn join(&mut self, other: Self, window: Window) {
        self.settings.window = window;
        self.tiles.extend(other.tiles);
    }

    /// The mean of the samples of every pixel, linear; black where there are none. The mattes name the ids of the
    /// object and material planes.
    #[must_use]
    pub fn develop(&self, mattes: Vec<Cryptomatte>) -> Picture {
        let window = self.settings.window;
        let names = plane_names(&self.settings.aovs);
        let developed: Vec<Vec<f32>> =
            self.tiles.par_iter().map(|t| develop_tile(t, &self.settings.aovs)).collect();
        let scatter = |(index, name): (usize, String)| {
            let mut values = vec![0.0; window.pixels()];
            for (tile, data) in self.tiles.iter().zip(&developed) {
                let pixels = tile.window().pixels();
                place(&mut values, window, tile.window(), &data[index * pixels..(index + 1) * pixels]);
            }
            Plane { name, values }
        };
        let planes = names.into_par_iter().enumerate().map(scatter).collect();
        Picture { full_size: self.settings.full_size, window, planes, mattes, denoiser: None }
    }
}

/// Copies the rows of a tile to their place in a plane.
fn place(plane: &mut [f32], window: Window, tile: Window, values: &[f32]) {
    let width = tile.width() as usize;
    for (row, y) in values.chunks_exact(width.max(1)).zip(tile.y0..) {
        if let Some(start) = window.index(tile.x0, y) {
            plane[start..start + width].copy_from_slice(row);
        }
    }
}

/// The channels of a picture with the given AOVs, in the order in which [`develop_tile`] computes them.
fn plane_names(aovs: &[Aov]) -> Vec<String> {
    let mut names: Vec<String> = ["R", "G", "B"].map(String::from).into();
    for aov in Aov::ALL.iter().filter(|a| aovs.contains(a)) {
        match aov {
            Aov::Albedo | Aov::Normal | Aov::Position => {
                names.extend(aov.vector_channels().into_iter().flatten().map(String::from));
            }
            Aov::Depth => names.push("depth.Z".into()),
            Aov::Alpha => names.push("A".into()),
            Aov::Object => names.extend(matte_channels(Film::OBJECT_LAYER)),
            Aov::Material => names.extend(matte_channels(Film::MATERIAL_LAYER)),
        }
    }
    names
}

/// `<layer>00.R`, `<layer>00.G`, ...: id and coverage of each rank in turn.
fn matte_channels(layer: &str) -> impl Iterator<Item = String> + '_ {
    (0..Cryptomatte::RANKS * 2).map(move |i| format!("{layer}{:02}.{}", i / 4, ["R", "G", "B", "A"][i % 4]))
}

/// All planes of a tile, one after the other.
fn develop_tile(tile: &FilmTile, aovs: &[Aov]) -> Vec<f32> {
    let mut out = Vec::new();
    let samples = &tile.samples;
    let hits = &tile.hits;
    develop_means(&mut out, &tile.color, samples, crate::Exact::mean);
    for aov in Aov::ALL.iter().filter(|a| aovs.contains(a)) {
        match aov {
            Aov::Albedo => develop_means(&mut out, &tile.albedo, samples, crate::ExactUnit::mean),
            Aov::Normal => develop_means(&mut out, &tile.normal, samples, crate::ExactUnit::mean),
            Aov::Position => develop_means(&mut out, &tile.position, hits, crate::Exact::mean),
            Aov::Depth => out.extend(tile.depth.iter().zip(hits).map(|(d, &n)| d.mean(n))),
            Aov::Alpha => out.extend(hits.iter().zip(samples).map(|(&h, &n)| fraction(h, n))),
            Aov::Object => develop_matte(&mut out, &tile.objects, samples),
            Aov::Material => develop_matte(&mut out, &tile.materials, samples),
        }
    }
    out
}

fn fraction(part: u32, whole: u32) -> f32 {
    if whole == 0 { 0.0 } else { (f64::from(part) / f64::from(whole)) as f32 }
}

fn develop_means<S: Copy>(out: &mut Vec<f32>, sums: &[[S; 3]], counts: &[u32], mean: fn(S, u32) -> f32) {
    for axis in 0..3 {
        out.extend(sums.iter().zip(counts).map(|(sum, &n)| mean(sum[axis], n)));
    }
}

fn develop_matte(out: &mut Vec<f32>, plane: &[Coverage], samples: &[u32]) {
    let ranked: Vec<Vec<(u32, u32)>> = plane.iter().map(Coverage::ranked).collect();
    for rank in 0..Cryptomatte::RANKS {
        let at = |pixel: &Vec<(u32, u32)>| pixel.get(rank).copied().unwrap_or((0, 0));
        out.extend(ranked.iter().map(|p| f32::from_bits(at(p).0)));
        out.extend(ranked.iter().zip(samples).map(|(p, &n)| fraction(at(p).1, n)));
    }
}
