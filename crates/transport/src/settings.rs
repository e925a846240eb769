//! What the user asks for: integrator, size, depth, filter; and the tiles that a picture is cut into.

use crate::photon::PhotonSettings;
use crate::pixel_filter::PixelFilter;
use std::str::FromStr;
use vastlight_scene::Camera;

/// How a picture is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Global illumination by path tracing.
    #[default]
    Path,
    /// Emission and direct light, seen through any number of perfectly specular bounces within the depth.
    Direct,
    /// The first surface under a light at the camera: shows shape and base colour, needs no lights.
    Primary,
    /// Ambient occlusion: the unoccluded part of the cosine-weighted hemisphere.
    Ao,
    /// The length of the camera ray's way through structures: nodes, blocks of triangles and ways into instances. In memory alone.
    Steps,
    /// Phong's shading with shadows, mirrored and refracted rays, by the stream tracer. No light between rough surfaces.
    Whitted,
    /// The same with the light of photons: the papers' renderer. Needs [`RenderSettings::caustics`].
    PhotonCaustics,
}

impl FromStr for Integrator {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Ok(match name {
            "path" => Self::Path,
            "direct" => Self::Direct,
            "primary" => Self::Primary,
            "ao" => Self::Ao,
            "steps" => Self::Steps,
            "whitted" => Self::Whitted,
            "photon-caustics" => Self::PhotonCaustics,
            _ => return Err("known are path, direct, primary, ao, steps, whitted and photon-caustics".into()),
        })
    }
}

/// How direct light is estimated; anything but `Both` is for tests and teaching.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DirectSampling {
    /// Light sampling and BSDF sampling, weighted by the power heuristic.
    #[default]
    Both,
    /// BSDF sampling alone. Lights without surface are never found.
    Bsdf,
    /// Light sampling alone. Light that a specular bounce carries is still counted.
    Light,
}

/// A region of pixels, `min` inclusive, `max` exclusive: `[column, row]`, rows from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// First column and row.
    pub min: [u32; 2],
    /// One past the last column and row.
    pub max: [u32; 2],
}

impl Tile {
    /// Width in pixels.
    #[must_use]
    pub const fn width(&self) -> u32 {
        self.max[0].saturating_sub(self.min[0])
    }

    /// Height in pixels.
    #[must_use]
    pub const fn height(&self) -> u32 {
        self.max[1].saturating_sub(self.min[1])
    }

    /// Number of pixels.
    #[must_use]
    pub const fn pixels(&self) -> u64 {
        self.width() as u64 * self.height() as u64
    }

    /// Pixels row by row.
    pub fn iter(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let (min, max) = (self.min, self.max);
        (min[1]..max[1]).flat_map(move |y| (min[0]..max[0]).map(move |x| [x, y]))
    }

    /// Tiles of at most `size` x `size` pixels that cover this one, row by row.
    #[must_use]
    pub fn split(&self, size: u32) -> Vec<Tile> {
        let step = size.max(1) as usize;
        let (min, max) = (self.min, self.max);
        (min[1]..max[1])
            .step_by(step)
            .flat_map(|y| (min[0]..max[0]).step_by(step).map(move |x| [x, y]))
            .map(|[x, y]| Tile {
                min: [x, y],
                max: [x.saturating_add(size.max(1)).min(max[0]), y.saturating_add(size.max(1)).min(max[1])],
            })
            .collect()
    }
}

/// Everything but the scene and the number of samples that decides what a sample is.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width of the whole picture in pixels.
    pub width: u32,
    /// Height of the whole picture in pixels.
    pub height: u32,
    /// The part of the picture that is rendered; `None` for all of it.
    pub crop: Option<Tile>,
    /// The camera.
    pub camera: Camera,
    /// Where a shutter is open, the camera at its keys, of which the first is `camera`; paths then have a time each. Empty for
    /// a moment.
    pub camera_keys: Vec<Camera>,
    /// How the picture is computed.
    pub integrator: Integrator,
    /// Longest path in segments: 1 is emission seen directly, 2 adds direct light, 3 one bounce more, and so on
    /// (Mitsuba's convention). 0 gives black. Going straight through a window pane does not count,
    /// for the first 32 of a path.
    pub max_depth: u32,
    /// Whether long paths that carry little end at random. Unbiased either way; off for comparisons path by path.
    pub russian_roulette: bool,
    /// Key of all random numbers.
    pub seed: u32,
    /// Pixel reconstruction filter.
    pub filter: PixelFilter,
    /// How direct light is estimated.
    pub direct_sampling: DirectSampling,
    /// Light that reaches a rough surface by mirrors and lenses comes from photons, if this is there; else from paths, which
    /// find little of it. For [`Integrator::Path`] and [`Integrator::PhotonCaustics`].
    pub caustics: Option<PhotonSettings>,
    /// Longest distance at which ambient occlusion sees, scene units; 0 means a fifth of the scene's diagonal.
    pub ao_distance: f32,
}

impl RenderSettings {
    /// Path tracing of `camera` at `width` x `height` with the defaults: depth 16, roulette on, seed 0.
    #[must_use]
    pub fn new(camera: Camera, width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            crop: None,
            camera,
            camera_keys: Vec::new(),
            integrator: Integrator::default(),
            max_depth: 16,
            russian_roulette: true,
            seed: 0,
            filter: PixelFilter::default(),
            direct_sampling: DirectSampling::default(),
            caustics: None,
            ao_distance: 0.0,
        }
    }

    /// All pixels of the picture, whatever the crop is.
    #[must_use]
    pub fn whole(&self) -> Tile {
        Tile { min: [0, 0], max: [self.width, self.height] }
    }

    /// The rendered pixels: the crop, cut to the picture.
    #[must_use]
    pub fn region(&self) -> Tile {
        self.crop.map_or(self.whole(), |c| Tile {
            min: [c.min[0].min(self.width), c.min[1].min(self.height)],
            max: [c.max[0].min(self.width), c.max[1].min(self.height)],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_the_region_once() {
        let region = Tile { min: [3, 5], max: [50, 41] };
        let tiles = region.split(16);
        assert_eq!(tiles.iter().map(Tile::pixels).sum::<u64>(), region.pixels());
        let mut seen: Vec<[u32; 2]> = tiles.iter().flat_map(Tile::iter).collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len() as u64, region.pixels());
        assert!(Tile { min: [4, 4], max: [4, 9] }.split(16).is_empty());
    }
}
