//! An image of light from infinity, by latitude and longitude.

use super::grid::{DirectionGrid, direction_of, footprint, uv_of};
use super::luminance;
use crate::words::Words;
use std::f32::consts::PI;
use vastlight_math::real::sin_cos;
use vastlight_math::{Vec2, Vec3};
use vastlight_scene::{Image, Scene, Texels};

/// Cells of the density: a larger image is summed into fewer.
const MAX_CELLS: usize = 1 << 21;
/// Brighter texels (infinities included) count as this bright.
const BRIGHTEST: f32 = 1e8;

/// A latitude-longitude map; borrows the scene's texels.
#[derive(Clone, Debug)]
pub(super) struct MapLight<'a> {
    texels: &'a [f32],
    width: usize,
    height: usize,
    channels: usize,
    strength: f32,
    /// Sine and cosine of the rotation about +y.
    rotation: (f32, f32),
    pub(super) grid: DirectionGrid,
}

impl<'a> MapLight<'a> {
    /// `None` if the image is not what the scene's contract says, or black.
    pub(super) fn new(scene: &'a Scene, image: u32, rotation: f32, strength: f32) -> Option<Self> {
        let image: &Image = scene.images().get(image as usize)?;
        let Texels::F32(texels) = &image.texels else { return None };
        let (width, height, channels) =
            (image.width as usize, image.height as usize, usize::from(image.channels));
        if channels < 3 || width == 0 || height == 0 || texels.len() < width * height * channels {
            return None;
        }
        let strength = if strength.is_finite() { strength.max(0.0) } else { 0.0 };
        let texel = |x: usize, y: usize| luminance(texel(texels, channels, y * width + x)) * strength;
        let factor = (1..).find(|f| (width / f) * (height / f) <= MAX_CELLS)?;
        let (columns, rows) = ((width / factor).max(1), (height / factor).max(2));
        // Every texel lies in at least one cell.
        let span = |i: usize, n: usize, cells: usize| i * n / cells..((i + 1) * n).div_ceil(cells);
        let grid = DirectionGrid::new(columns, rows, |x, y| {
            mean_of_block(span(x, width, columns), span(y, height, rows), texel)
        });
        let rotation = sin_cos(if rotation.is_finite() { rotation } else { 0.0 });
        (grid.integrals() != [0.0; 2]).then_some(Self {
            texels,
            width,
            height,
            channels,
            strength,
            rotation,
            grid,
        })
    }

    /// Appends the texels as lookups read them, three numbers each, and the grid; then the map, whose word it gives: grid,
    /// texels, width, height, strength, sine and cosine of the rotation.
    pub(super) fn pack(&self, words: &mut Words) -> u32 {
        let grid = self.grid.pack(words);
        let texels = words.offset();
        (0..self.width * self.height).for_each(|i| words.vec3(texel(self.texels, self.channels, i)));
        let start = words.offset();
        words.u32s(&[grid, texels, self.width as u32, self.height as u32]);
        words.f32s(&[self.strength, self.rotation.0, self.rotation.1]);
        start
    }

    /// Radiance from a direction.
    #[inline]
    pub(super) fn radiance(&self, wi: Vec3) -> Vec3 {
        let uv = uv_of(self.to_map(wi));
        let sum: Vec3 = footprint(uv, self.width, self.height)
            .iter()
            .map(|&(x, y, weight)| texel(self.texels, self.channels, y * self.width + x) * weight)
            .sum();
        sum * self.strength
    }

    /// A direction, for a surface with this normal.
    #[inline]
    pub(super) fn sample(&self, normal: Vec3, u: Vec2) -> Option<Vec3> {
        let uv = self.grid.sample(&self.grid.halves(normal), u)?;
        Some(self.to_world(direction_of(uv).0))
    }

    /// Density over solid angle with which [`MapLight::sample`] finds a direction.
    #[inline]
    pub(super) fn pdf(&self, normal: Vec3, wi: Vec3) -> f32 {
        let local = self.to_map(wi);
        solid_angle_pdf(&self.grid, normal, local, uv_of(local))
    }

    fn to_map(&self, d: Vec3) -> Vec3 {
        let (s, c) = self.rotation;
        Vec3::new(d.x * c - d.z * s, d.y, d.x * s + d.z * c)
    }

    fn to_world(&self, d: Vec3) -> Vec3 {
        let (s, c) = self.rotation;
        Vec3::new(d.x * c + d.z * s, d.y, d.z * c - d.x * s)
    }
}

/// Density over solid angle at a point of a grid's map.
#[inline]
pub(super) fn solid_angle_pdf(grid: &DirectionGrid, normal: Vec3, direction: Vec3, uv: Vec2) -> f32 {
    let sin_theta = (direction.x * direction.x + direction.z * direction.z).sqrt().max(1e-6);
    grid.density(&grid.halves(normal), uv) / (2.0 * PI * PI * sin_theta)
}

/// A texel with nothing negative, infinite or undefined.
#[inline]
fn texel(texels: &[f32], channels: usize, index: usize) -> Vec3 {
    let at = &texels[index * channels..index * channels + 3];
    // `max` turns NaN into 0.
    Vec3::new(at[0].max(0.0), at[1].max(0.0), at[2].max(0.0)).min(Vec3::splat(BRIGHTEST))
}

fn mean_of_block(
    columns: std::ops::Range<usize>,
    rows: std::ops::Range<usize>,
    value: impl Fn(usize, usize) -> f32,
) -> f32 {
    let count = columns.len() * rows.len();
    let sum: f32 = rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| value(x, y)).sum();
    sum / count.max(1) as f32
}
