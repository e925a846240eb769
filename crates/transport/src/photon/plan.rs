//! What is decided before the first pass: where photons begin, and within which radii they are gathered.
//!
//! All of it follows from scene, settings and seed, so that any worker who renders any pass of a picture decides the same.

use super::cells::Cell;
use super::density::Density;
use super::flight::{Departure, Landed, grid_shift};
use super::guide::Guide;
use super::rectangle::Rectangle;
use super::seen::Seen;
use super::{Kernel, Photon, PhotonMap, PhotonMaps, PhotonSettings, SearchKind};
use crate::light::Lights;
use rayon::prelude::*;
use vastlight_math::Vec2;

/// Photons of a trial pass.
const TRIAL: u32 = 1 << 16;
/// The same by grids, all lights together.
const TRIAL_GRID: [u32; 2] = [128, 128];
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
    /// At point lights, by a grid of so many columns and rows before each.
    Gridded(Vec<Rectangle>, [u32; 2]),
}

impl Emission {
    /// Squares of all grids.
    fn squares(&self) -> u32 {
        match self {
            Self::Guided(_) => 0,
            Self::Gridded(rectangles, [columns, rows]) => rectangles.len() as u32 * columns * rows,
        }
    }

    /// The rectangles around the squares from which photons landed.
    fn fitted(&self, landed: &[Landed]) -> Vec<Rectangle> {
        let Self::Gridded(rectangles, grid) = self else { return Vec::new() };
        let each = grid[0] * grid[1];
        let of = |light: usize| {
            let numbers = landed.iter().map(|landed| landed.square);
            let own = numbers.filter(move |number| (number / each) as usize == light);
            own.map(|number| [number % each % grid[0], number % each / grid[0]])
        };
        rectangles.iter().enumerate().map(|(light, rectangle)| rectangle.around(of(light), *grid)).collect()
    }
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

    /// How photons are found.
    #[must_use]
    pub fn search(&self) -> SearchKind {
        self.settings.search
    }

    /// The widest radius of pass 0, world units.
    #[must_use]
    pub fn widest_radius(&self) -> f32 {
        self.density.radius(0)
    }

    /// The photons of a pass, sorted and indexed: those of each radius by themselves.
    #[must_use]
    pub fn maps(&self, photons: &[Photon], pass: u32) -> PhotonMaps {
        let PhotonSettings { search, weight, .. } = self.settings;
        let shrunk = Self::shrunk(pass);
        let map = |level, photons: &[Photon]| {
            PhotonMap::new(photons, search, self.density.radius(level) * shrunk, weight)
        };
        if self.density.levels() == 1 {
            return PhotonMaps(vec![map(0, photons)]);
        }
        let levels: Vec<usize> =
            photons.par_iter().map(|photon| self.density.level(photon.position)).collect();
        let mut parts = vec![Vec::new(); self.density.levels()];
        for (photon, level) in photons.iter().zip(levels) {
            parts[level].push(*photon);
        }
        let maps = parts.iter().enumerate().filter(|(_, photons)| !photons.is_empty());
        PhotonMaps(maps.map(|(level, photons)| map(level, photons)).collect())
    }

    /// As published: photons by a grid from each light, one radius. Trial passes, which `fly` makes, find how large rectangles must be.
    pub(crate) fn gridded<E>(
        cells: &[Cell],
        lights: &Lights<'_>,
        settings: &PhotonSettings,
        (grid, size): ([u32; 2], f32),
        mut fly: impl FnMut(&Departure<'_>) -> Result<Vec<Landed>, E>,
    ) -> Result<Self, E> {
        let first = |light| Rectangle::new(light, cells);
        let mut rectangles: Vec<Rectangle> = lights.punctual().iter().filter_map(first).collect();
        for pass in TRIALS {
            let grid = shared(TRIAL_GRID, rectangles.len());
            let emission = Emission::Gridded(rectangles, grid);
            let landed = fly(&Departure { emission: &emission, pass, photons: emission.squares() })?;
            rectangles = emission.fitted(&landed);
        }
        let grid = shared(grid, rectangles.len());
        let emission = Emission::Gridded(rectangles, grid);
        let (photons, radius) = (emission.squares(), settings.radius.unwrap_or(PUBLISHED) * size);
        Ok(Self { settings: *settings, photons, emission, density: Density::even(radius) })
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

/// The grid of each of so many lights, where all together have no more squares than one would have, but one each.
fn shared([columns, rows]: [u32; 2], lights: usize) -> [u32; 2] {
    let edge = (lights.max(1) as f64).sqrt();
    [columns, rows].map(|count| ((f64::from(count) / edge) as u32).max(1))
}

/// What photons through each square are worth: the root of the mean square of what one brings to the eye.
fn worth(guide: &Guide, seen: &Seen, landed: &[Landed]) -> Vec<f64> {
    let mut squares = vec![0.0; guide.len()];
    for Landed { photon, square } in landed {
        let brought = f64::from(photon.flux.element_sum() * seen.weight(photon.position));
        squares[*square as usize] += brought * brought;
    }
    // Power is over the chance already: times it, it is what a photon through this square brings.
    squares.iter().enumerate().map(|(i, square)| (square * f64::from(guide.chance(i))).sqrt()).collect()
}
