//! Photons from a point light through a rectangle with a regular grid on it, one through the middle of each of its squares and none
//! at random: D. Bogolepov, D. Sopin, V. Turlapov 2010, section 2.1.
//!
//! The rectangle is laid around all that may focus light. A photon has the power that the light sends through its square.

use super::cells::Cell;
use crate::light::PunctualLight;
use vastlight_math::{Aabb, Frame, Ray, Vec2, Vec3};

/// The steepest slope to the rectangle's axis: about 80 degrees.
const STEEPEST: f32 = 6.0;

/// A light, and a rectangle at distance 1 from it.
#[derive(Clone, Debug)]
pub(crate) struct Rectangle {
    light: PunctualLight,
    frame: Frame,
    min: Vec2,
    max: Vec2,
}

impl Rectangle {
    /// The rectangle before the cells as seen from a light; none where there are no cells.
    pub(crate) fn new(light: &PunctualLight, cells: &[Cell]) -> Option<Self> {
        let all = cells.iter().fold(Aabb::EMPTY, |all, cell| all.union(cell.bounds));
        let frame = Frame::from_z((all.center() - light.position).normalize_or(Vec3::Z));
        let (mut min, mut max) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for corner in cells.iter().flat_map(|cell| corners(&cell.bounds)) {
            let seen = frame.to_local(corner - light.position);
            // What stands beside the light or behind it is out of any rectangle: the widest must do.
            let slope = if seen.z > 0.0 { seen.truncate() / seen.z } else { seen.truncate() * f32::INFINITY };
            let slope = slope.clamp(Vec2::splat(-STEEPEST), Vec2::splat(STEEPEST));
            (min, max) = (min.min(slope), max.max(slope));
        }
        (!cells.is_empty()).then(|| Self { light: light.clone(), frame, min, max })
    }

    /// The part of the rectangle around some squares of a grid.
    pub(crate) fn around(&self, squares: impl Iterator<Item = [u32; 2]>, grid: [u32; 2]) -> Self {
        let step = self.step(grid);
        let (mut min, mut max) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for [x, y] in squares {
            let at = self.min + Vec2::new(x as f32, y as f32) * step;
            // One more on each side: what is smaller than a square may reach there.
            (min, max) = (min.min(at - step), max.max(at + 2.0 * step));
        }
        if min.x > max.x {
            return self.clone();
        }
        Self { min: min.max(self.min), max: max.min(self.max), ..self.clone() }
    }

    /// Words of a rectangle on a device.
    pub(crate) const WORDS: usize = 13;

    /// The frame, the least corner, and the sides of a square of a grid.
    pub(super) fn words(&self, grid: [u32; 2]) -> [u32; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let Frame { x, y, z } = self.frame;
        let frame = [x, y, z].into_iter().flat_map(|axis| axis.to_array());
        let plane = [self.min, self.step(grid)].into_iter().flat_map(|v| v.to_array());
        words.iter_mut().zip(frame.chain(plane)).for_each(|(word, number)| *word = number.to_bits());
        words
    }

    /// The sides of a square.
    fn step(&self, grid: [u32; 2]) -> Vec2 {
        (self.max - self.min) / Vec2::new(grid[0] as f32, grid[1] as f32)
    }

    /// The photon through a square of a grid: its ray and its power. `shift`, from -0.5 to 0.5 of a square, moves the whole grid.
    pub(crate) fn photon(&self, square: [u32; 2], grid: [u32; 2], shift: Vec2) -> (Ray, Vec3) {
        let step = self.step(grid);
        let at = self.min + (Vec2::new(square[0] as f32, square[1] as f32) + 0.5 + shift) * step;
        let squared = 1.0 + at.length_squared();
        let direction = self.frame.to_outer(at.extend(1.0)) / squared.sqrt();
        // Seen from the light, a square is smaller by its distance and its slant.
        let solid_angle = step.x * step.y / (squared * squared.sqrt());
        (Ray::new(self.light.position, direction), self.light.intensity(direction) * solid_angle)
    }
}

fn corners(bounds: &Aabb) -> impl Iterator<Item = Vec3> + use<> {
    let Aabb { min, max } = *bounds;
    (0..8).map(move |i: u32| {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
        Vec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
    })
}
