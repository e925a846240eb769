//! Through which squares photons enter cells: through those behind which they will be seen, and now and then through others.

use super::cells::Cell;
use vastlight_math::{Vec2, Vec3};

/// Share of photons by area alone, so that nothing is missed.
const ANYWHERE: f32 = 0.2;

/// Faces of a cell: two for x, low and high, two for y, two for z.
const FACES: u32 = 6;
/// Squares of all faces together, about.
const SQUARES: f32 = 4096.0;

/// The cells of a scene, the squares of their faces, and with which chances photons are drawn for each square.
#[derive(Clone, Debug)]
pub(crate) struct Guide {
    cells: Vec<Cell>,
    squares: Vec<Square>,
    /// The sum of the chances up to each square, of 1.
    upto: Vec<f32>,
}

/// A part of a face, a rectangle really.
#[derive(Clone, Copy, Debug)]
struct Square {
    cell: u32,
    /// Of the cell.
    face: u32,
    /// Of the face: column, row, and how many columns and rows there are.
    at: [u32; 2],
    of: u32,
}

/// A point of a square.
pub(crate) struct Place {
    pub(crate) position: Vec3,
    /// To the outside.
    pub(crate) normal: Vec3,
    /// Of the whole square.
    pub(crate) area: f32,
}

impl Square {
    fn axis(&self) -> usize {
        self.face as usize / 2
    }

    fn area(&self, cells: &[Cell]) -> f32 {
        face_area(&cells[self.cell as usize], self.axis()) / (self.of * self.of) as f32
    }
}

/// Of a face across an axis.
fn face_area(cell: &Cell, axis: usize) -> f32 {
    let size = cell.bounds.size();
    size[(axis + 1) % 3] * size[(axis + 2) % 3]
}

/// The squares of all faces: more of large ones.
fn squares(cells: &[Cell]) -> Vec<Square> {
    let total: f32 = cells.iter().map(|cell| 2.0 * cell.bounds.half_area()).sum();
    let mut squares = Vec::new();
    for (cell, number) in cells.iter().zip(0..) {
        for face in 0..FACES {
            let share = face_area(cell, face as usize / 2) / total;
            let of = ((share * SQUARES).sqrt() as u32).max(1);
            let parts = (0..of * of).map(|i| Square { cell: number, face, at: [i % of, i / of], of });
            squares.extend(parts);
        }
    }
    squares
}

impl Guide {
    /// By area alone.
    pub(crate) fn by_area(cells: Vec<Cell>) -> Self {
        let squares = squares(&cells);
        let areas: Vec<f64> = squares.iter().map(|square| f64::from(square.area(&cells))).collect();
        Self { upto: cumulative(&areas), squares, cells }
    }

    /// By what came of photons through each square, and by area. `worth` is not negative.
    pub(crate) fn by_worth(self, worth: &[f64]) -> Self {
        let worth: Vec<f64> =
            (0..worth.len()).map(|i| worth[i].max(0.5 * self.best_beside(worth, i))).collect();
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

    /// The worth of the best square that touches this one on its face. What a trial has not seen there may be as good: the rim of a
    /// lens goes through squares of which little shines.
    fn best_beside(&self, worth: &[f64], number: usize) -> f64 {
        let Square { at: [x, y], of, .. } = self.squares[number];
        let first = number - (y * of + x) as usize;
        let columns = x.saturating_sub(1)..(x + 2).min(of);
        let rows = y.saturating_sub(1)..(y + 2).min(of);
        let beside = rows.flat_map(|y| columns.clone().map(move |x| first + (y * of + x) as usize));
        beside.map(|i| worth[i]).fold(0.0, f64::max)
    }

    /// How many squares there are.
    pub(crate) fn len(&self) -> usize {
        self.squares.len()
    }

    /// The cell of a square.
    pub(crate) fn cell_of(&self, square: u32) -> &Cell {
        &self.cells[self.squares[square as usize].cell as usize]
    }

    /// The point of a square for `u`, uniform by area.
    pub(crate) fn place(&self, square: u32, u: Vec2) -> Place {
        let (cell, square) = (self.cell_of(square), &self.squares[square as usize]);
        let (axis, high) = (square.axis(), square.face % 2 == 1);
        let (x, y, size) = ((axis + 1) % 3, (axis + 2) % 3, cell.bounds.size());
        let (mut position, mut normal) = (cell.bounds.min, Vec3::ZERO);
        position[x] += (square.at[0] as f32 + u.x) / square.of as f32 * size[x];
        position[y] += (square.at[1] as f32 + u.y) / square.of as f32 * size[y];
        position[axis] = if high { cell.bounds.max[axis] } else { cell.bounds.min[axis] };
        normal[axis] = if high { 1.0 } else { -1.0 };
        Place { position, normal, area: square.area(&self.cells) }
    }

    /// With which chance a photon is drawn for the square of this number.
    pub(crate) fn chance(&self, number: usize) -> f32 {
        self.upto[number] - if number == 0 { 0.0 } else { self.upto[number - 1] }
    }

    /// The square for `u`, uniform in [0, 1), and its chance.
    pub(crate) fn choose(&self, u: f32) -> (u32, f32) {
        let number = self.upto.partition_point(|&upto| upto <= u).min(self.upto.len() - 1);
        (number as u32, self.chance(number))
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
