//! How often photons begin in each cell: where they will be seen, and now and then elsewhere.

use super::cells::Cell;

/// Share of photons by area alone, so that nothing is missed.
const ANYWHERE: f32 = 0.2;

/// The cells of a scene, and with which chances photons begin there.
#[derive(Clone, Debug)]
pub(crate) struct Guide {
    cells: Vec<Cell>,
    /// The sum of the chances up to each cell, of 1.
    upto: Vec<f32>,
}

impl Guide {
    /// By area alone.
    pub(crate) fn by_area(cells: Vec<Cell>) -> Self {
        let areas: Vec<f64> = cells.iter().map(|cell| f64::from(cell.bounds.half_area())).collect();
        Self { upto: cumulative(&areas), cells }
    }

    /// By what came of chords in each cell, and by area. `worth` is not negative.
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
        Self { upto: cumulative(&chances), cells: self.cells }
    }

    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }

    pub(crate) fn cell(&self, number: u32) -> &Cell {
        &self.cells[number as usize]
    }

    /// With which chance a photon begins in the cell of this number.
    pub(crate) fn chance(&self, number: usize) -> f32 {
        self.upto[number] - if number == 0 { 0.0 } else { self.upto[number - 1] }
    }

    /// The cell for `u`, uniform in [0, 1); its chance; and the rest of `u` as a new uniform number.
    pub(crate) fn choose(&self, u: f32) -> (u32, f32, f32) {
        let number = self.upto.partition_point(|&upto| upto <= u).min(self.cells.len() - 1);
        let (chance, before) = (self.chance(number), if number == 0 { 0.0 } else { self.upto[number - 1] });
        (number as u32, chance, ((u - before) / chance).clamp(0.0, 1.0 - f32::EPSILON))
    }
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
