//! How wide each photon's disc of light is: narrow where photons are dense, wide where they are sparse.
//!
//! An adaptive kernel estimator (I. Abramson 1982, "On bandwidth variation in kernel estimates"): each photon brings its own radius, so
//! that its light is spread but never lost, and the relative noise is about the same everywhere. Radii are halves of each other; a
//! photon's is a function of its place alone, by the counts of a trial pass.

use super::flight::Landed;
use super::seen::Seen;
use std::collections::HashMap;
use vastlight_math::Vec3;

/// Radii at most.
const LEVELS: usize = 12;

/// Photons of a trial, counted in cubes of several sizes.
#[derive(Clone, Debug)]
pub(crate) struct Density {
    /// From the widest radius on. Cubes are two radii wide.
    levels: Vec<HashMap<[i32; 3], u32>>,
    widest: f32,
    /// Photons of a trial in a cube that make its radius the right one.
    wanted: u32,
}

impl Density {
    /// One radius everywhere.
    pub(crate) fn even(radius: f32) -> Self {
        Self { levels: vec![HashMap::new()], widest: radius, wanted: 0 }
    }

    /// Counts where photons of a trial landed. No radius is wider than `widest`, nor narrower than what the picture shows.
    pub(crate) fn new(landed: &[Landed], seen: &Seen, widest: f32, wanted: u32) -> Self {
        let mut density = Self { levels: vec![HashMap::new(); LEVELS], widest, wanted };
        for Landed { photon, .. } in landed {
            let width = seen.width(photon.position);
            let wide_enough = (0..LEVELS).take_while(|&level| density.radius(level) >= width).count();
            for level in 0..wide_enough {
                let cube = density.cube(level, photon.position);
                *density.levels[level].entry(cube).or_default() += 1;
            }
        }
        let crowded = |counts: &HashMap<_, u32>| counts.values().any(|&count| count >= wanted);
        let needed = density.levels.iter().rposition(crowded).map_or(1, |last| last + 1);
        density.levels.truncate(needed);
        density
    }

    fn cube(&self, level: usize, place: Vec3) -> [i32; 3] {
        (place / (2.0 * self.radius(level))).floor().as_ivec3().to_array()
    }

    /// How many radii there are.
    pub(crate) fn levels(&self) -> usize {
        self.levels.len()
    }

    /// The radius of this number, world units.
    pub(crate) fn radius(&self, level: usize) -> f32 {
        self.widest / (1_u32 << level) as f32
    }

    /// The number of the radius for a photon at a place.
    pub(crate) fn level(&self, place: Vec3) -> usize {
        let crowded = |&level: &usize| {
            self.levels[level].get(&self.cube(level, place)).is_some_and(|&count| count >= self.wanted)
        };
        (1..self.levels()).rev().find(crowded).unwrap_or(0)
    }
}
