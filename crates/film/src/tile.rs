//! A rectangle of the film that takes samples.

use crate::coverage::Coverage;
use crate::{Aov, Exact, ExactUnit, FilmSettings, Window};
use std::ops::{AddAssign, Range};
use vastlight_math::Vec3;

/// Rec. 709 luminance of linear RGB.
pub(crate) const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// One sample of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSample {
    /// Radiance that reaches the camera, linear Rec. 709, W/(sr m^2).
    pub radiance: Vec3,
    /// Whether the camera ray hit a surface. If not, everything below is ignored.
    pub hit: bool,
    /// Reflectance of the first surface.
    pub albedo: Vec3,
    /// Shading normal in world space, unit length.
    pub normal: Vec3,
    /// Distance from the camera's plane, scene units.
    pub depth: f32,
    /// World-space position.
    pub position: Vec3,
    /// Id of the object, see [`crate::name_hash`].
    pub object: u32,
    /// Id of the material, see [`crate::name_hash`].
    pub material: u32,
}

/// The sums of a rectangle of pixels. Planes that were not asked for are empty.
#[derive(Clone, Debug)]
pub struct FilmTile {
    window: Window,
    pub(crate) samples: Vec<u32>,
    pub(crate) color: Vec<[Exact; 3]>,
    pub(crate) squares: Vec<Exact>,
    pub(crate) hits: Vec<u32>,
    pub(crate) albedo: Vec<[ExactUnit; 3]>,
    pub(crate) normal: Vec<[ExactUnit; 3]>,
    pub(crate) depth: Vec<Exact>,
    pub(crate) position: Vec<[Exact; 3]>,
    pub(crate) objects: Vec<Coverage>,
    pub(crate) materials: Vec<Coverage>,
    pub(crate) non_finite: u64,
}

impl FilmTile {
    /// An empty tile with the planes that the settings need.
    #[must_use]
    pub fn new(window: Window, settings: &FilmSettings) -> Self {
        let (pixels, aovs) = (window.pixels(), &settings.aovs);
        let when = |wanted: &[Aov]| if aovs.iter().any(|a| wanted.contains(a)) { pixels } else { 0 };
        Self {
            window,
            samples: vec![0; pixels],
            color: vec![[Exact::default(); 3]; pixels],
            squares: vec![Exact::default(); if settings.squares { pixels } else { 0 }],
            hits: vec![0; when(&[Aov::Alpha, Aov::Depth, Aov::Position])],
            albedo: vec![[ExactUnit::default(); 3]; when(&[Aov::Albedo])],
            normal: vec![[ExactUnit::default(); 3]; when(&[Aov::Normal])],
            depth: vec![Exact::default(); when(&[Aov::Depth])],
            position: vec![[Exact::default(); 3]; when(&[Aov::Position])],
            objects: vec![Coverage::default(); when(&[Aov::Object])],
            materials: vec![Coverage::default(); when(&[Aov::Material])],
            non_finite: 0,
        }
    }

    /// The pixels of the tile, in coordinates of the whole picture.
    #[must_use]
    pub fn window(&self) -> Window {
        self.window
    }

    /// Samples whose radiance was not finite; they count as black.
    #[must_use]
    pub fn non_finite(&self) -> u64 {
        self.non_finite
    }

    /// Adds one sample to pixel (x, y) of the whole picture; samples outside the tile are ignored.
    #[inline]
    pub fn add(&mut self, x: u32, y: u32, sample: &PixelSample) {
        let Some(i) = self.window.index(x, y) else { return };
        self.samples[i] += 1;
        if sample.radiance.is_finite() {
            add_vec3(&mut self.color, i, sample.radiance, Exact::from_f32);
            if let Some(squares) = self.squares.get_mut(i) {
                let luminance = sample.radiance.dot(LUMINANCE);
                *squares += Exact::from_f32(luminance * luminance);
            }
        } else {
            self.non_finite += 1;
        }
        if sample.hit {
            self.add_surface(i, sample);
        }
    }

    fn add_surface(&mut self, i: usize, sample: &PixelSample) {
        if let Some(hits) = self.hits.get_mut(i) {
            *hits += 1;
        }
        add_vec3(&mut self.albedo, i, sample.albedo, ExactUnit::from_f32);
        add_vec3(&mut self.normal, i, sample.normal, ExactUnit::from_f32);
        add_vec3(&mut self.position, i, sample.position, Exact::from_f32);
        if let Some(depth) = self.depth.get_mut(i) {
            *depth += Exact::from_f32(sample.depth);
        }
        if let Some(objects) = self.objects.get_mut(i) {
            objects.add(sample.object, 1);
        }
        if let Some(materials) = self.materials.get_mut(i) {
            materials.add(sample.material, 1);
        }
    }

    /// Adds the sums of a tile with the same planes, in the pixels that both have.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (ours, theirs) in self.window.shared_rows(&other.window) {
            let runs = (&ours, &theirs);
            add_run(&mut self.samples, &other.samples, runs);
            add_run(&mut self.hits, &other.hits, runs);
            add_run(&mut self.squares, &other.squares, runs);
            add_run(&mut self.depth, &other.depth, runs);
            add_rows(&mut self.color, &other.color, runs);
            add_rows(&mut self.albedo, &other.albedo, runs);
            add_rows(&mut self.normal, &other.normal, runs);
            add_rows(&mut self.position, &other.position, runs);
            merge_run(&mut self.objects, &other.objects, runs);
            merge_run(&mut self.materials, &other.materials, runs);
        }
    }

    /// Bytes that [`FilmSettings::squares`] add to a pixel.
    pub const SQUARES_BYTES: usize = size_of::<Exact>();

    /// Bytes a pixel takes with the given planes, ids beyond the second apart.
    #[must_use]
    pub fn bytes_per_pixel(aovs: &[Aov]) -> usize {
        let has = |aov| aovs.contains(&aov);
        let mattes = usize::from(has(Aov::Object)) + usize::from(has(Aov::Material));
        4 + 3 * size_of::<Exact>()
            + if has(Aov::Alpha) || has(Aov::Depth) || has(Aov::Position) { 4 } else { 0 }
            + (usize::from(has(Aov::Albedo)) + usize::from(has(Aov::Normal))) * 3 * size_of::<ExactUnit>()
            + (usize::from(has(Aov::Depth)) + 3 * usize::from(has(Aov::Position))) * size_of::<Exact>()
            + mattes * size_of::<Coverage>()
    }
}

/// Adds a vector to the sums of pixel `i`, if the plane is there.
#[inline]
fn add_vec3<S: AddAssign>(plane: &mut [[S; 3]], i: usize, v: Vec3, convert: impl Fn(f32) -> S) {
    if let Some([x, y, z]) = plane.get_mut(i) {
        *x += convert(v.x);
        *y += convert(v.y);
        *z += convert(v.z);
    }
}

/// Where a row of pixels stands in the planes of two tiles.
type Runs<'a> = (&'a Range<usize>, &'a Range<usize>);

/// The same row in two planes; empty where the planes are.
fn both<'a, T>(
    plane: &'a mut [T],
    other: &'a [T],
    (a, b): Runs<'_>,
) -> impl Iterator<Item = (&'a mut T, &'a T)> {
    let (plane, other) = (plane.get_mut(a.clone()), other.get(b.clone()));
    plane.unwrap_or_default().iter_mut().zip(other.unwrap_or_default())
}

fn add_run<S: AddAssign + Copy>(plane: &mut [S], other: &[S], runs: Runs<'_>) {
    both(plane, other, runs).for_each(|(sum, &other)| *sum += other);
}

fn add_rows<S: AddAssign + Copy>(plane: &mut [[S; 3]], other: &[[S; 3]], runs: Runs<'_>) {
    for (sums, others) in both(plane, other, runs) {
        sums.iter_mut().zip(others).for_each(|(sum, &other)| *sum += other);
    }
}

fn merge_run(plane: &mut [Coverage], other: &[Coverage], runs: Runs<'_>) {
    both(plane, other, runs).for_each(|(sum, other)| sum.merge(other));
}
