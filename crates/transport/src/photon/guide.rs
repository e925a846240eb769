//! By which faces of cells photons enter: by those behind which they will be seen, and now and then by others.

use super::cells::Cell;
use vastlight_math::{Aabb, Vec2, Vec3};

/// Share of photons by area alone, so that nothing is missed.
const ANYWHERE: f32 = 0.2;

/// The cells of a scene, and with which chances photons are drawn for each face. Faces are numbered cell by cell: two for x, low and
/// high, two for y, two for z.
#[derive(Clone, Debug)]
pub(crate) struct Guide {
    cells: Vec<Cell>,
    bounds: Aabb,
    /// The sum of the chances up to each face, of 1.
    upto: Vec<f32>,
}

/// A point of a face.
pub(crate) struct Place {
    pub(crate) position: Vec3,
    /// To the outside.
    pub(crate) normal: Vec3,
    /// Of the whole face.
    pub(crate) area: f32,
}

const FACES: usize = 6;

impl Guide {
    /// By area alone.
    pub(crate) fn by_area(cells: Vec<Cell>) -> Self {
        let faces = cells.iter().flat_map(|cell| (0..FACES).map(|face| area(cell, face / 2)));
        let areas: Vec<f64> = faces.map(f64::from).collect();
        let bounds = cells.iter().fold(Aabb::EMPTY, |all, cell| all.union(cell.bounds));
        Self { upto: cumulative(&areas), bounds, cells }
    }

    /// By what came of photons by each face, and by area. `worth` is not negative.
    pub(crate) fn by_worth(self, worth: &[f64]) -> Self {
        let total: f64 = worth.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return self;
        }
        let by_area = |i: usize| f64::from(self.chance(i) * ANYWHERE);
        let chances: Vec<f64> = worth
            .iter()
            .enumerate()
            .map(|(i, worth)| by_area(i) + worth / total * f64::from(1.0 - ANYWHERE))
            .collect();
        Self { upto: cumulative(&chances), ..self }
    }

    /// How many faces there are.
    pub(crate) fn faces(&self) -> usize {
        self.upto.len()
    }

    /// The cell of a face.
    pub(crate) fn cell_of(&self, face: u32) -> &Cell {
        &self.cells[face as usize / FACES]
    }

    /// The number of a place on a curve through all cells (G. Morton 1966).
    pub(crate) fn order(&self, place: Vec3) -> u32 {
        let at = ((place - self.bounds.min) / self.bounds.size() * 1023.0).as_uvec3();
        let spread = |x: u32| (0..10).fold(0, |code, bit| code | (x >> bit & 1) << (3 * bit));
        spread(at.x) << 2 | spread(at.y) << 1 | spread(at.z)
    }

    /// The point of a face for `u`, uniform by area.
    pub(crate) fn face(&self, face: u32, u: Vec2) -> Place {
        let cell = self.cell_of(face);
        let (axis, high) = (face as usize % FACES / 2, face % 2 == 1);
        let (x, y, size) = ((axis + 1) % 3, (axis + 2) % 3, cell.bounds.size());
        let (mut position, mut normal) = (cell.bounds.min, Vec3::ZERO);
        position[x] += u.x * size[x];
        position[y] += u.y * size[y];
        position[axis] = if high { cell.bounds.max[axis] } else { cell.bounds.min[axis] };
        normal[axis] = if high { 1.0 } else { -1.0 };
        Place { position, normal, area: area(cell, axis) }
    }

    /// With which chance a photon is drawn for the face of this number.
    pub(crate) fn chance(&self, number: usize) -> f32 {
        self.upto[number] - if number == 0 { 0.0 } else { self.upto[number - 1] }
    }

    /// The face for `u`, uniform in [0, 1), and its chance.
    pub(crate) fn choose(&self, u: f32) -> (u32, f32) {
        let number = self.upto.partition_point(|&upto| upto <= u).min(self.upto.len() - 1);
        (number as u32, self.chance(number))
    }
}

/// Of a face across an axis.
fn area(cell: &Cell, axis: usize) -> f32 {
    let size = cell.bounds.size();
    size[(axis + 1) % 3] * size[(axis + 2) % 3]
}

/// Running sums, scaled to end at 1.
fn cumulative(shares: &[f64]) -> Vec<f32> {
    let total: f64 = shares.iter().sum();
    let mut sum = 0.0;
    let mut upto: Vec<f32> = shares
        .iter()
        .map(|share| {
            sum += share / total;
            sum as f32
        })
        .collect();
    if let Some(last) = upto.last_mut() {
        *last = 1.0;
    }
    upto
}
