//! Rays against quaternion Julia sets, by steps that are proven.
//!
//! The iterate along a piece of the line is enclosed in a straight piece of a line and a ball around it (a Taylor model of first
//! order; after K. Makino and M. Berz 1996, "Remainder differential algebras and their applications"), and so is its slope. A piece counts as
//! passed only if the enclosure proves that it lies outside, or inside, or that the iterate's length only grows or only shrinks on it, so
//! that it has one crossing if the sides of its ends differ. Other pieces are cut. The enclosure's ball shrinks with the
//! square of the piece's length, so pieces need not be much shorter than the distance to the surface, and not short
//! at all where a ray grazes.
//!
//! J. Hart, D. Sandin, L. Kauffman 1989 ("Ray tracing deterministic 3-D fractals") step by an estimate of the distance instead,
//! which is a bound for the whole set but not for its levels.

use super::root::bracketed;
use super::{LEAST, Line, Visit};
use std::ops::ControlFlow;
use vastlight_scene::{Julia, Quaternion};

/// Rounding of a step of the iteration relative to the products in it; a bound with room.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Pieces that a line is cut into at first.
const FIRST_PIECES: f64 = 8.0;
/// How much longer the piece after one that was passed is, and how much shorter one that was not becomes.
const GROWTH: f64 = 1.6;
const SHRINKAGE: f64 = 0.4;

/// What is known of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Piece {
    Outside,
    Inside,
    /// At most one crossing.
    OneWay,
    Unknown,
}

/// The iterates along a piece: `|iterate(s) - (center + s * slope)| <= error` and `|iterate'(s) - slope| <= slope_error` for
/// |s| <= 1.
struct Enclosure {
    center: Quaternion,
    slope: Quaternion,
    error: f64,
    slope_error: f64,
}

impl Enclosure {
    /// After a step of the iteration.
    #[inline(always)]
    fn stepped(&self, c: Quaternion) -> Self {
        let (center, slope) = (self.center.0.length(), self.slope.0.length());
        let beside = slope + self.error;
        let rounding = ROUNDING * (center * center + center * slope + c.0.length());
        Self {
            center: Quaternion(self.center.squared().0 + c.0),
            slope: self.center.anticommutator(self.slope),
            error: slope * slope + 2.0 * (center + slope) * self.error + self.error * self.error + rounding,
            slope_error: 2.0 * (center * self.slope_error + beside * (slope + self.slope_error)) + rounding,
        }
    }

    /// The smallest length that the iterate may have.
    #[inline(always)]
    fn least(&self) -> f64 {
        let (center, slope) = (self.center.0, self.slope.0);
        let s = (-center.dot(slope) / slope.length_squared()).clamp(-1.0, 1.0);
        (center + slope * s).length() - self.error
    }

    /// The largest.
    fn most(&self) -> f64 {
        let (center, slope) = (self.center.0, self.slope.0);
        (center + slope).length().max((center - slope).length()) + self.error
    }

    /// Whether its length only grows, or only shrinks.
    fn is_one_way(&self) -> bool {
        let (center, slope) = (self.center.0.length(), self.slope.0.length());
        let beside = (slope + self.error) * (slope + self.slope_error);
        self.center.0.dot(self.slope.0).abs() > center * self.slope_error + beside
    }
}

/// A line through a set.
struct Crossing<'a> {
    shape: &'a Julia,
    line: &'a Line,
    c: Quaternion,
}

impl Crossing<'_> {
    /// What is known of the piece between two distances.
    fn look_at(&self, from: f64, to: f64) -> Piece {
        let slope = self.line.direction * (0.5 * (to - from));
        let mut enclosure = Enclosure {
            center: self.shape.quaternion(self.line.at(0.5 * (from + to))),
            slope: Quaternion(slope.extend(0.0)),
            error: 0.0,
            slope_error: 0.0,
        };
        for _ in 0..self.shape.iterations {
            enclosure = enclosure.stepped(self.c);
            if enclosure.least() > Julia::BAILOUT {
                return Piece::Outside;
            }
            let is_of_use = enclosure.error < 1e30;
            if !is_of_use {
                return Piece::Unknown;
            }
        }
        if enclosure.most() < Julia::BAILOUT {
            Piece::Inside
        } else if enclosure.is_one_way() {
            Piece::OneWay
        } else {
            Piece::Unknown
        }
    }

    /// What the last iterate's squared length is below the bailout's, and how that changes along the line.
    fn field(&self, s: f64) -> (f64, f64) {
        let mut q = self.shape.quaternion(self.line.at(s));
        let mut slope = Quaternion(self.line.direction.extend(0.0));
        for _ in 0..self.shape.iterations {
            slope = q.anticommutator(slope);
            q = Quaternion(q.squared().0 + self.c.0);
            if q.0.length_squared() > 1e30 {
                break;
            }
        }
        (Julia::BAILOUT * Julia::BAILOUT - q.0.length_squared(), -2.0 * q.0.dot(slope.0))
    }
}

/// Tells `visit` the distances at which the line crosses the surface, in order.
pub(super) fn cross(shape: &Julia, line: &Line, visit: &mut Visit<'_>) -> ControlFlow<()> {
    let crossing = Crossing { shape, line, c: shape.constant() };
    let least = LEAST * shape.radius();
    let (mut from, mut length) = (line.from, (line.to - line.from) / FIRST_PIECES);
    let mut inside = crossing.field(from).0 >= 0.0;
    while from < line.to {
        let to = (from + length).min(line.to);
        let piece = crossing.look_at(from, to);
        if piece == Piece::Unknown && to - from > least {
            length = (to - from) * SHRINKAGE;
            continue;
        }
        let ends_inside = match piece {
            Piece::Outside => false,
            Piece::Inside => true,
            Piece::OneWay | Piece::Unknown => crossing.field(to).0 >= 0.0,
        };
        if ends_inside != inside {
            visit(bracketed(|s| crossing.field(s), (from, to), inside, 1e-3 * least))?;
            inside = ends_inside;
        }
        (from, length) = (to, length * GROWTH);
    }
    ControlFlow::Continue(())
}
