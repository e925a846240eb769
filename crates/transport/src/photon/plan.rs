//! What is decided before the first pass: where photons begin, and within which radii they are gathered.
//!
//! All of it follows from scene, settings and seed, so that any worker who renders any pass of a picture decides the same.

use super::cells::Cell;
use super::density::Density;
use super::flight::{Departure, Landed, grid_shift};
use super::guide::Guide;
use super::rectangle::Rectangle;
use super::seen::Seen;
use super::{Kernel, PhotonSettings};
use crate::light::Lights;
use vastlight_math::Vec2;

/// Photons of a trial pass.
const TRIAL: u32 = 1 << 16;
/// Numbers of trial passes: far from those of the picture.
const TRIALS: [u32; 2] = [u32::MAX - 1, u32::MAX - 2];

/// Photons of the first pass that are to be in a square two radii wide.
const NEIGHBOURS: f32 = 12.0;
/// The widest radius, as a part of the scene's longest edge.
const WIDEST: f32 = 0.015;

/// The radius where photons begin by a grid: the papers' 0.4 %.
const PUBLISHED: f32 = 0.004;

/// How the squared radius shrinks: towards 0, but so slowly that noise does too (C. Knaus, M. Zwicker 2011, "Progressive photon
/// mapping: a probabilistic approach").
const ALPHA: f64 = 2.0 / 3.0;

/// Where photons begin.
#[derive(Clone, Debug)]
pub(crate) enum Emission {
    /// Anywhere, by chance.
    Guided(Guide),
    /// At point lights, by a grid of so many columns and rows each.
    Gridded(Vec<Rectangle>, [u32; 2]),
}

/// Where photons begin, and how far they are gathered.
#[derive(Clone, Debug)]
pub struct PhotonPlan {
    pub(crate) settings: PhotonSettings,
    /// Photons of a pass.
    pub(crate) photons: u32,
    pub(crate) emission: Emission,
    /// The radii of pass 0.
    pub(crate) density: Density,
}

/// A pass of photons by a grid, as a device is told of it.
#[derive(Clone, Debug, PartialEq)]
pub struct GridPass {
    /// Number of the pass.
    pub pass: u32,
    /// Photons of the pass: those of each light follow each other.
    pub photons: u32,
    /// Columns and rows before each light.
    pub grid: [u32; 2],
    /// By how much of a square the grid is moved.
    pub shift: Vec2,
    /// A rectangle for each point or spot light, [`GridPass::RECTANGLE_WORDS`] words each: frame, least corner, sides of a square.
    pub rectangles: Vec<u32>,
    /// Within which radius photons are gathered, world units.
    pub radius: f32,
    /// How they count by distance.
    pub weight: Kernel,
}

impl GridPass {
    /// Words of a rectangle.
    pub const RECTANGLE_WORDS: usize = Rectangle::WORDS;
}

impl PhotonPlan {
    /// A pass of photons by a grid; none where they begin anywhere.
    #[must_use]
    pub fn grid_pass(&self, pass: u32, seed: u32) -> Option<GridPass> {
        let Emission::Gridded(rectangles, grid) = &self.emission else { return None };
        Some(GridPass {
            pass,
            photons: self.photons,
            grid: *grid,
            shift: grid_shift(pass, seed),
            rectangles: rectangles.iter().flat_map(|rectangle| rectangle.words(*grid)).collect(),
            radius: self.density.radius(0) * Self::shrunk(pass),
            weight: self.settings.weight,
        })
    }

    /// What radii have shrunk to in a pass, of 1: a function of the pass's number alone.
    #[must_use]
    pub fn shrunk(pass: u32) -> f32 {
        let squared: f64 = (1..=pass).map(|i| (f64::from(i) + ALPHA) / (f64::from(i) + 1.0)).product();
        squared.sqrt() as f32
    }

    /// As published: photons by a grid from each light, one radius.
    pub(crate) fn gridded(
        cells: &[Cell],
        lights: &Lights<'_>,
        settings: &PhotonSettings,
        grid: [u32; 2],
        size: f32,
    ) -> Self {
        let rectangles: Vec<Rectangle> =
            lights.punctual().iter().filter_map(|light| Rectangle::new(light, cells)).collect();
        Self {
            settings: *settings,
            photons: grid[0] * grid[1] * rectangles.len() as u32,
            emission: Emission::Gridded(rectangles, grid),
            density: Density::even(settings.radius.unwrap_or(PUBLISHED) * size),
        }
    }

    /// Decides by two trial passes, which `fly` makes, for so many photons a pass in a scene of this size, world units.
    pub(crate) fn new<E>(
        cells: Vec<Cell>,
        seen: &Seen,
        settings: &PhotonSettings,
        (photons, size): (u32, f32),
        mut fly: impl FnMut(&Departure<'_>) -> Result<Vec<Landed>, E>,
    ) -> Result<Self, E> {
        let mut trial = |guide: &Guide, pass| {
            fly(&Departure { emission: &Emission::Guided(guide.clone()), pass, photons: TRIAL })
        };
        let by_area = Guide::by_area(cells);
        let worth = worth(&by_area, seen, &trial(&by_area, TRIALS[0])?);
        let guide = by_area.by_worth(&worth);
        let density = match settings.radius {
            Some(part) => Density::even(part * size),
            None => {
                let wanted = NEIGHBOURS * TRIAL as f32 / photons as f32;
                Density::new(&trial(&guide, TRIALS[1])?, seen, WIDEST * size, wanted.max(2.0) as u32)
            }
        };
        Ok(Self { settings: *settings, photons, emission: Emission::Guided(guide), density })
    }
}

/// What photons by each face are worth: the root of the mean square of what one brings to the eye.
fn worth(guide: &Guide, seen: &Seen, landed: &[Landed]) -> Vec<f64> {
    let mut squares = vec![0.0; guide.faces()];
    for Landed { photon, face } in landed {
        let brought = f64::from(photon.flux.element_sum() * seen.weight(photon.position));
        squares[*face as usize] += brought * brought;
    }
    // Power is over the chance already: times it, it is what a photon by this face brings.
    squares.iter().enumerate().map(|(i, square)| (square * f64::from(guide.chance(i))).sqrt()).collect()
}
