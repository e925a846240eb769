//! Keyframes of one property and what is between them (glTF 2.0, appendix C, "Animation sampler interpolation modes").

use serde::{Deserialize, Serialize};
use vastlight_math::glam::{DQuat, DVec4};
use vastlight_math::real;

/// Below this angle in radians a great circle and its chord are the same.
const SMALL_ANGLE: f32 = 1e-4;

/// How values between two keys are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Interpolation {
    /// The earlier key's value.
    Step,
    /// The straight line, or for rotations the shorter great circle.
    Linear,
    /// Hermite's cubic with a tangent on both sides of each key.
    CubicSpline,
}

impl Interpolation {
    /// From `sampler.interpolation`; linear where there is none.
    pub(super) fn from_name(name: Option<&str>) -> Self {
        match name {
            Some("STEP") => Self::Step,
            Some("CUBICSPLINE") => Self::CubicSpline,
            _ => Self::Linear,
        }
    }

    /// Elements of a key: its value, and in splines the tangents before and behind it.
    fn elements(self) -> usize {
        if self == Self::CubicSpline { 3 } else { 1 }
    }
}

/// Values of one property at ascending times.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Keys {
    /// Seconds; at least one.
    times: Vec<f32>,
    /// For each time `width` numbers, in splines after those of the tangent that comes in and before those of the one that goes out.
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
}

/// A moment between two keys.
#[derive(Clone, Copy, Debug)]
struct Moment {
    before: usize,
    after: usize,
    /// 0 at the first of them, 1 at the second.
    fraction: f64,
    /// Seconds from the first to the second.
    seconds: f64,
}

impl Keys {
    /// From a sampler's numbers; `None` if there are no times, or not as many values for each.
    pub(super) fn new(times: Vec<f32>, values: Vec<f32>, interpolation: Interpolation) -> Option<Self> {
        let width = values.len().checked_div(times.len())? / interpolation.elements();
        let fits = width > 0 && width * times.len() * interpolation.elements() == values.len();
        fits.then_some(Self { times, values, width, interpolation })
    }

    /// Whether there are as many values for each time, and some.
    pub(super) fn is_sound(&self) -> bool {
        let values = self.width.checked_mul(self.interpolation.elements());
        let all = values.and_then(|values| values.checked_mul(self.times.len()));
        all.is_some_and(|all| all > 0 && all == self.values.len())
    }

    /// Numbers of a value.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// The last time, seconds.
    pub(super) fn end(&self) -> f32 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// A vector of `N` numbers; those that the keys do not have are 0.
    pub(super) fn vector<const N: usize>(&self, time: f32) -> [f64; N] {
        let moment = self.moment(time);
        std::array::from_fn(|c| if c < self.width { self.number(&moment, c) } else { 0.0 })
    }

    /// All numbers of a value.
    pub(super) fn numbers(&self, time: f32) -> Vec<f32> {
        let moment = self.moment(time);
        (0..self.width).map(|c| self.number(&moment, c) as f32).collect()
    }

    /// A rotation: between keys on a great circle or a spline, always of unit length.
    pub(super) fn rotation(&self, time: f32) -> DQuat {
        if self.interpolation != Interpolation::Linear {
            return unit(DVec4::from_array(self.vector(time)));
        }
        let moment = self.moment(time);
        let [before, after] = [moment.before, moment.after].map(|key| {
            let number = |c| if c < self.width { self.value(key, c) } else { 0.0 };
            unit(DVec4::from_array(std::array::from_fn(number)))
        });
        slerp(before, after, moment.fraction)
    }

    /// Where a time is among the keys; the ends hold before the first and after the last.
    fn moment(&self, time: f32) -> Moment {
        let after = self.times.partition_point(|&key| key <= time).min(self.times.len() - 1);
        let before = after.saturating_sub(1);
        let [start, end, time] = [self.times[before], self.times[after], time].map(f64::from);
        if time >= end {
            return Moment { before: after, after, fraction: 0.0, seconds: 0.0 };
        }
        if time > start && before < after {
            let seconds = end - start;
            return Moment { before, after, fraction: (time - start) / seconds, seconds };
        }
        Moment { before, after: before, fraction: 0.0, seconds: 0.0 }
    }

    fn number(&self, moment: &Moment, component: usize) -> f64 {
        let Moment { before, after, fraction: t, seconds } = *moment;
        let start = self.value(before, component);
        if before == after || self.interpolation == Interpolation::Step {
            return start;
        }
        let end = self.value(after, component);
        if self.interpolation == Interpolation::Linear {
            return start + (end - start) * t;
        }
        let (leaves, arrives) = (self.element(before, 2, component), self.element(after, 0, component));
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * start
            + seconds * (t3 - 2.0 * t2 + t) * leaves
            + (3.0 * t2 - 2.0 * t3) * end
            + seconds * (t3 - t2) * arrives
    }

    fn value(&self, key: usize, component: usize) -> f64 {
        self.element(key, self.interpolation.elements() / 2, component)
    }

    fn element(&self, key: usize, element: usize, component: usize) -> f64 {
        let elements = self.interpolation.elements();
        f64::from(self.values[(key * elements + element) * self.width + component])
    }
}

/// The rotation along a quaternion; none along one without length.
fn unit(quaternion: DVec4) -> DQuat {
    DQuat::from_vec4(quaternion.try_normalize().unwrap_or(DVec4::W))
}

/// Spherical linear interpolation (Shoemake, "Animating rotation with quaternion curves", 1985) of unit quaternions, the shorter way.
fn slerp(from: DQuat, to: DQuat, fraction: f64) -> DQuat {
    let (from, to) = (DVec4::from(from), DVec4::from(to));
    let to = if from.dot(to) < 0.0 { -to } else { to };
    // The angle by its half's tangent, which is exact for small ones too.
    let angle = 2.0 * real::atan2((to - from).length() as f32, (to + from).length() as f32);
    if angle < SMALL_ANGLE {
        return unit(from + (to - from) * fraction);
    }
    let part = |x: f64| f64::from(real::sin((f64::from(angle) * x) as f32));
    unit(from * part(1.0 - fraction) + to * part(fraction))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn keys(times: &[f32], values: &[f32], interpolation: Interpolation) -> Keys {
        Keys::new(times.to_vec(), values.to_vec(), interpolation).expect("as many values")
    }

    #[test]
    fn steps_and_lines_hold_their_ends() {
        let at = |interpolation, time| {
            keys(&[1.0, 2.0, 4.0], &[1.0, 10.0, 2.0, 20.0, 6.0, 60.0], interpolation).vector::<2>(time)
        };
        let inner = [(1.0, [1.0, 1.0]), (1.5, [1.0, 1.5]), (2.0, [2.0, 2.0]), (3.0, [2.0, 4.0])];
        let ends = [(f32::NEG_INFINITY, 1.0), (f32::NAN, 1.0), (4.0, 6.0), (9.0, 6.0), (f32::INFINITY, 6.0)];
        let held = ends.map(|(time, x)| (time, [x, x]));
        for (time, [step, line]) in inner.into_iter().chain(held) {
            assert_eq!(at(Interpolation::Step, time), [step, 10.0 * step], "step at {time}");
            assert_eq!(at(Interpolation::Linear, time), [line, 10.0 * line], "line at {time}");
        }
        assert_eq!(keys(&[3.0], &[7.0], Interpolation::Linear).numbers(0.0), [7.0]);
    }

    #[test]
    fn rotations_go_the_shorter_way_at_an_even_speed() {
        let turn = |degrees: f64| DQuat::from_rotation_z(degrees.to_radians());
        let list = |q: DQuat| q.to_array().map(|x| x as f32);
        for (from, to) in [(0.0, 90.0), (10.0, 170.0), (20.0, 20.001), (0.0, 179.9)] {
            // The same rotation with the other sign is the same way.
            for sign in [1.0, -1.0] {
                let values = [list(turn(from)), list(turn(to) * sign)].concat();
                let keys = keys(&[0.0, 3.0], &values, Interpolation::Linear);
                for third in [0.0, 1.0, 2.0, 3.0_f32] {
                    let expected = turn(from + (to - from) * f64::from(third) / 3.0);
                    let found = keys.rotation(third);
                    let difference = found.dot(expected).abs();
                    assert!((difference - 1.0).abs() < 1e-12, "{from} to {to}: {difference}");
                }
            }
        }
        let held = keys(&[0.0, 3.0], &[list(turn(0.0)), list(turn(90.0))].concat(), Interpolation::Step);
        assert_eq!(held.rotation(2.0), turn(0.0));
        // Negative control: the straight line is no third of the way at a third.
        let line = turn(0.0).lerp(turn(170.0), 1.0 / 3.0);
        assert!(line.dot(turn(170.0 / 3.0)).abs() < 1.0 - 1e-6);
    }

    #[test]
    fn values_without_length_or_number_are_no_rotation() {
        let broken = keys(&[0.0, 1.0], &[0.0, 0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0, 1.0], Interpolation::Linear);
        assert_eq!([0.0, 0.5, 1.0].map(|t| broken.rotation(t)), [DQuat::IDENTITY; 3]);
    }

    /// x^3 - 2 x + 1 and its slope.
    fn cubic(x: f32) -> [f32; 2] {
        [x * x * x - 2.0 * x + 1.0, 3.0 * x * x - 2.0]
    }

    #[test]
    fn splines_reproduce_cubics() {
        let times = [0.5_f32, 1.0, 3.0];
        let values: Vec<f32> = times
            .iter()
            .flat_map(|&x| {
                let [value, slope] = cubic(x);
                // A second number that stands still.
                [slope, 0.0, value, 5.0, slope, 0.0]
            })
            .collect();
        let curve = keys(&times, &values, Interpolation::CubicSpline);
        assert_eq!(curve.width(), 2);
        for time in [0.5, 0.7, 1.0, 1.7, 2.9, 3.0] {
            let [found, still] = curve.vector::<2>(time);
            assert!((found - f64::from(cubic(time)[0])).abs() < 1e-5, "at {time}");
            assert!((still - 5.0).abs() < 1e-12);
        }
        assert_eq!(curve.vector::<1>(9.0)[0], f64::from(cubic(3.0)[0]));
        // Negative control: without tangents it is another curve.
        let flat: Vec<f32> = times.iter().flat_map(|&x| [0.0, cubic(x)[0], 0.0]).collect();
        let flat = keys(&times, &flat, Interpolation::CubicSpline);
        assert!((flat.vector::<1>(1.7)[0] - f64::from(cubic(1.7)[0])).abs() > 0.1);
    }

    #[test]
    fn splines_of_rotations_have_unit_length() {
        let values: Vec<f32> = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]]
            .iter()
            .flat_map(|q: &[f32; 4]| [[0.0; 4], *q, [0.0; 4]].concat())
            .collect();
        let keys = keys(&[0.0, 1.0], &values, Interpolation::CubicSpline);
        let found = keys.rotation(0.5);
        // Halfway, without tangents, is the mean, which has a length of 0.7.
        assert!(found.dot(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)).abs() > 1.0 - 1e-12);
        assert!((keys.rotation(0.3).length() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn as_many_values_as_times() {
        let fits = |times: usize, values: usize, interpolation| {
            Keys::new(vec![0.0; times], vec![0.0; values], interpolation).map(|keys| keys.width())
        };
        assert_eq!(fits(2, 6, Interpolation::Linear), Some(3));
        assert_eq!(fits(2, 6, Interpolation::CubicSpline), Some(1));
        assert_eq!(fits(0, 0, Interpolation::Linear), None);
        assert_eq!(fits(2, 0, Interpolation::Linear), None);
        assert_eq!(fits(2, 7, Interpolation::Linear), None);
        assert_eq!(fits(2, 5, Interpolation::CubicSpline), None);
    }

    proptest! {
        /// Whatever a file holds and whatever the moment is.
        #[test]
        fn no_keys_make_a_panic(
            times in prop::collection::vec(prop::num::f32::ANY, 1..8),
            value in prop::num::f32::ANY,
            moment in prop::num::f32::ANY,
        ) {
            for interpolation in [Interpolation::Step, Interpolation::Linear, Interpolation::CubicSpline] {
                let values = vec![value; times.len() * 4 * interpolation.elements()];
                let keys = keys(&times, &values, interpolation);
                for time in times.iter().copied().chain([moment]) {
                    keys.vector::<3>(time);
                    keys.numbers(time);
                    prop_assert!((keys.rotation(time).length() - 1.0).abs() < 1e-6);
                }
            }
        }
    }
}
