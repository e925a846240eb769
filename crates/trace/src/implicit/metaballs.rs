//! Rays against metaballs, exactly: between two points where a ray enters or leaves a ball, the sum of fields is a
//! polynomial of degree 6 in the distance.

use super::bernstein::{Coefficients, cube, roots};
use super::{LEAST, Line, Visit};
use std::ops::ControlFlow;
use vastlight_scene::{Metaball, Metaballs};

/// A ball that the line meets.
#[derive(Clone, Copy, Debug)]
struct Met {
    enter: f64,
    leave: f64,
    /// Where the line comes closest to the centre.
    middle: f64,
    /// 1 / radius^2.
    scale: f64,
    /// `1 - distance^2 / radius^2` there.
    peak: f64,
    strength: f64,
}

impl Met {
    fn new(ball: &Metaball, line: &Line) -> Option<Self> {
        let (center, radius) = (ball.center.as_dvec3(), f64::from(ball.radius));
        let middle = (center - line.origin).dot(line.direction);
        let scale = 1.0 / (radius * radius);
        let peak = 1.0 - line.at(middle).distance_squared(center) * scale;
        let half = radius * peak.max(0.0).sqrt();
        let (enter, leave) = (middle - half, middle + half);
        let is_met = peak > 0.0 && enter < line.to && leave > line.from;
        is_met.then_some(Self { enter, leave, middle, scale, peak, strength: f64::from(ball.strength) })
    }

    /// Adds the ball's field between two distances, both in the ball.
    fn add(&self, (from, to): (f64, f64), sum: &mut Coefficients) {
        let (a, b) = (from - self.middle, to - self.middle);
        let field = cube([a * a, a * b, b * b].map(|square| self.peak - square * self.scale));
        sum.iter_mut().zip(field).for_each(|(sum, x)| *sum += self.strength * x);
    }
}

/// Memory that lines share.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    met: Vec<Met>,
    /// Where balls are entered or left.
    events: Vec<f64>,
}

/// Tells `visit` the distances at which the line crosses the surface, in order.
pub(super) fn cross(
    shape: &Metaballs,
    line: &Line,
    scratch: &mut Scratch,
    visit: &mut Visit<'_>,
) -> ControlFlow<()> {
    let Scratch { met, events } = scratch;
    met.clear();
    met.extend(shape.balls.iter().filter_map(|ball| Met::new(ball, line)));
    events.clear();
    events.extend(met.iter().flat_map(|m| [m.enter, m.leave]).map(|s| s.clamp(line.from, line.to)));
    events.sort_unstable_by(f64::total_cmp);
    // By when they are entered, so that a span looks at those before its end alone.
    met.sort_unstable_by(|a, b| a.enter.total_cmp(&b.enter));
    let mut was_inside = None;
    for pair in events.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        if from < to {
            let sum = field_between((from, to), met, -f64::from(shape.threshold));
            was_inside = Some(cross_span((from, to), &sum, was_inside, visit)?);
        }
    }
    ControlFlow::Continue(())
}

/// The sum of fields above the threshold between two neighbouring events.
fn field_between((from, to): (f64, f64), met: &[Met], outside: f64) -> Coefficients {
    let mut sum = [outside; 7];
    let entered = met.iter().take_while(|m| m.enter < to);
    entered.filter(|m| m.leave > from).for_each(|m| m.add((from, to), &mut sum));
    sum
}

/// Visits the crossings of a span, and one at its beginning if rounding says that the sides before and after differ; says whether its
/// end is inside.
fn cross_span(
    (from, to): (f64, f64),
    sum: &Coefficients,
    was_inside: Option<bool>,
    visit: &mut Visit<'_>,
) -> ControlFlow<(), bool> {
    let starts_inside = sum[0] >= 0.0;
    if was_inside.is_some_and(|was| was != starts_inside) {
        visit(from)?;
    }
    let width = to - from;
    roots(sum, LEAST, &mut |x| visit(from + width * x))?;
    ControlFlow::Continue(sum[6] >= 0.0)
}
