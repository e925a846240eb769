//! What is decided before the first pass: where photons begin, and within which radius they are gathered.
//!
//! All of it follows from scene, settings and seed, so that any worker who renders any pass of a picture decides the same.

use super::cells::Cell;
use super::flight::{Departure, Landed};
use super::guide::Guide;
use super::seen::Seen;
use super::{Kernel, Photon, PhotonMap, PhotonSettings, SearchKind};
use vastlight_math::Vec3;

/// Chords of a trial pass.
pub(crate) const TRIAL: u32 = 1 << 16;
/// Numbers of trial passes: far from those of the picture.
const TRIALS: [u32; 2] = [u32::MAX - 1, u32::MAX - 2];

/// Photons within the first radius, where the median of all seen light arrives.
const NEIGHBOURS: f32 = 12.0;
/// The first radius at most, as a part of the scene's longest edge.
const LARGEST: f32 = 0.015;
/// Photons whose neighbours are counted.
const COUNTED: usize = 512;

/// How the squared radius shrinks: towards 0, but so slowly that noise does too (C. Knaus, M. Zwicker 2011, "Progressive photon
/// mapping: a probabilistic approach").
const ALPHA: f64 = 2.0 / 3.0;

/// Where photons begin, and how far they are gathered.
#[derive(Clone, Debug)]
pub struct PhotonPlan {
    pub(crate) settings: PhotonSettings,
    pub(crate) guide: Guide,
    /// The radius of pass 0.
    pub(crate) radius: f32,
}

impl PhotonPlan {
    /// The radius of gathering in a pass, world units: a function of the pass's number alone.
    #[must_use]
    pub fn radius(&self, pass: u32) -> f32 {
        let shrunk: f64 = (1..=pass).map(|i| (f64::from(i) + ALPHA) / (f64::from(i) + 1.0)).product();
        (f64::from(self.radius) * shrunk.sqrt()) as f32
    }

    /// Decides by two trial passes, which `fly` makes.
    pub(crate) fn new<E>(
        cells: Vec<Cell>,
        seen: &Seen,
        settings: &PhotonSettings,
        scene_size: f32,
        mut fly: impl FnMut(&Departure<'_>) -> Result<Vec<Landed>, E>,
    ) -> Result<Self, E> {
        let mut trial = |guide: &Guide, pass| fly(&Departure { guide, pass, chords: TRIAL });
        let by_area = Guide::by_area(cells);
        let worth = worth(&by_area, seen, &trial(&by_area, TRIALS[0])?);
        let guide = by_area.by_worth(&worth);
        let radius = match settings.radius {
            Some(part) => part * scene_size,
            None => {
                let landed = trial(&guide, TRIALS[1])?;
                let wanted = NEIGHBOURS * TRIAL as f32 / settings.photons as f32;
                first_radius(&landed, seen, wanted, LARGEST * scene_size)
            }
        };
        Ok(Self { settings: *settings, guide, radius })
    }
}

/// What photons from each cell are worth: the root of the mean square of what a chord brings to the eye.
fn worth(guide: &Guide, seen: &Seen, landed: &[Landed]) -> Vec<f64> {
    let mut squares = vec![0.0; guide.len()];
    for Landed { photon, cell } in landed {
        let brought = f64::from(photon.flux.element_sum() * seen.weight(photon.position));
        squares[*cell as usize] += brought * brought;
    }
    // Power is over the chance already: times it, it is what a chord of this cell brings.
    squares.iter().enumerate().map(|(i, square)| (square * f64::from(guide.chance(i))).sqrt()).collect()
}

/// The radius within which the median photon, by the light that it brings to the eye, has so many neighbours.
fn first_radius(landed: &[Landed], seen: &Seen, wanted: f32, largest: f32) -> f32 {
    let brought: Vec<f64> = landed
        .iter()
        .map(|Landed { photon, .. }| f64::from(photon.flux.element_sum() * seen.weight(photon.position)))
        .collect();
    let chosen = by_share(landed, &brought);
    if chosen.is_empty() {
        return largest;
    }
    let photons: Vec<Photon> = landed.iter().map(|landed| landed.photon).collect();
    let (mut low, mut high) = (0.0, largest);
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if median_neighbours(&photons, &chosen, middle) > wanted {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Places of photons, drawn by their shares at even steps.
fn by_share(landed: &[Landed], shares: &[f64]) -> Vec<Vec3> {
    let total: f64 = shares.iter().sum();
    let step = total / COUNTED as f64;
    let (mut chosen, mut sum) = (Vec::new(), 0.0);
    for (landed, share) in landed.iter().zip(shares) {
        sum += share;
        while step > 0.0 && sum > (chosen.len() as f64 + 0.5) * step && chosen.len() < COUNTED {
            chosen.push(landed.photon.position);
        }
    }
    chosen
}

fn median_neighbours(photons: &[Photon], places: &[Vec3], radius: f32) -> f32 {
    let map = PhotonMap::new(photons, SearchKind::default(), radius, Kernel::default());
    let count = |&at: &Vec3| {
        let mut near = 0_u32;
        map.near_at(at, |_| near += 1);
        near
    };
    let mut counts: Vec<u32> = places.iter().map(count).collect();
    let middle = counts.len() / 2;
    *counts.select_nth_unstable(middle).1 as f32
}
