//! Lanes, crossings and their lights.

use super::super::shape::turn;
use serde::{Deserialize, Serialize};
use std::f32::consts::{FRAC_PI_2, PI};
use vastlight_math::{Affine3, Vec3};

/// The city's streets are so far from each other along x and z, half of that from the origin.
const PITCH: [f32; 2] = [62.0, 78.0];
/// Streets with moving cars along each axis: their numbers.
const STREETS: [[i32; 3]; 2] = [[-1, 0, 1], [-1, 0, 1]];
/// From a street's middle to that of a lane, and to its kerb.
const LANE: f32 = 2.0;
pub(super) const KERB: f32 = 7.0;
/// Half the length of lanes along x and along z.
const HALF: [f32; 2] = [170.0, 190.0];
/// From a crossing's middle to where cars wait.
const STOP: f32 = 9.5;

/// Seconds of green for one direction, of red for both, and of a whole cycle.
const GREEN: f32 = 7.0;
const CLEAR: f32 = 3.0;
const CYCLE: f32 = 2.0 * (GREEN + CLEAR);

/// A lane: a line on which cars go forward and come back to the start from the end.
#[derive(Clone, Debug)]
pub(super) struct Lane {
    /// 0 along x, 1 along z.
    axis: usize,
    /// Towards + or - of the axis.
    sign: f32,
    /// Where it is across.
    across: f32,
    pub(super) length: f32,
    /// Stop lines and the crossings that they belong to.
    pub(super) stops: Vec<(f32, Crossing)>,
    /// The part of all cars that drives here.
    pub(super) share: u32,
}

/// Where street `x` along z and street `z` along x meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Crossing {
    pub(super) x: i32,
    pub(super) z: i32,
}

/// The middle of a street of one axis.
fn middle(axis: usize, number: i32) -> f32 {
    (number as f32 + 0.5) * PITCH[1 - axis]
}

impl Crossing {
    pub(super) fn center(self) -> Vec3 {
        Vec3::new(middle(1, self.x), 0.0, middle(0, self.z))
    }

    /// Whether cars along an axis may go.
    pub(super) fn is_green(self, axis: usize, time: f32) -> bool {
        let shifted =
            time + 5.0 * self.x as f32 + 7.0 * self.z as f32 + if axis == 0 { 0.5 * CYCLE } else { 0.0 };
        let turns = shifted / CYCLE;
        (turns - turns.floor()) * CYCLE < GREEN
    }
}

impl Lane {
    /// All lanes.
    pub(super) fn all() -> Vec<Self> {
        let mut lanes = Vec::new();
        for (axis, streets) in STREETS.into_iter().enumerate() {
            for street in streets {
                for sign in [-1.0, 1.0] {
                    lanes.push(Self::new(axis, street, sign));
                }
            }
        }
        lanes
    }

    fn new(axis: usize, street: i32, sign: f32) -> Self {
        // On the right: towards +x that is +z, towards +z it is -x.
        let right = if axis == 0 { sign } else { -sign };
        let crossing = |other: i32| {
            if axis == 0 { Crossing { x: other, z: street } } else { Crossing { x: street, z: other } }
        };
        let mut stops: Vec<(f32, Crossing)> = STREETS[1 - axis]
            .map(|other| (HALF[axis] + sign * middle(1 - axis, other) - STOP, crossing(other)))
            .to_vec();
        stops.sort_by(|a, b| a.0.total_cmp(&b.0));
        let busy = axis == 1 && street == 0;
        Self {
            axis,
            sign,
            across: middle(axis, street) + right * LANE,
            length: 2.0 * HALF[axis],
            stops,
            share: if busy { 10 } else { 5 },
        }
    }

    pub(super) fn axis(&self) -> usize {
        self.axis
    }

    /// The place of a car whose middle is so far along, its front ahead.
    pub(super) fn place(&self, along: f32) -> Affine3 {
        let laps = along / self.length;
        let on_axis = self.sign * ((laps - laps.floor()) * self.length - HALF[self.axis]);
        let (at, angle) = if self.axis == 0 {
            (Vec3::new(on_axis, 0.0, self.across), if self.sign > 0.0 { 0.0 } else { PI })
        } else {
            (Vec3::new(self.across, 0.0, on_axis), -self.sign * FRAC_PI_2)
        };
        Affine3::from_translation(at) * turn(angle)
    }
}

/// Whether a place is on a lane of a street along z.
pub(super) fn is_on_a_lane(p: Vec3) -> bool {
    let streets = p.x / PITCH[0] - 0.5;
    (streets - streets.round()).abs() * PITCH[0] < LANE + 1.0
}

/// Whether a place is on a street along x where cars drive.
pub(super) fn is_across(p: Vec3) -> bool {
    STREETS[0].iter().any(|&street| (p.z - middle(0, street)).abs() < KERB)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn never_both_directions_are_green() {
        let mut greens = [0, 0];
        for x in -1..=1 {
            for z in -1..=1 {
                for i in 0..400 {
                    let green = [0, 1].map(|axis| Crossing { x, z }.is_green(axis, i as f32 * 0.1));
                    assert!(!(green[0] && green[1]));
                    greens = [0, 1].map(|axis| greens[axis] + usize::from(green[axis]));
                }
            }
        }
        assert!(greens[0] > 1000 && greens[1] > 1000, "{greens:?}");
    }

    #[test]
    fn cars_keep_to_the_right_and_go_forward() {
        for lane in Lane::all() {
            let (a, b) = (lane.place(100.0), lane.place(101.0));
            let way = b.translation - a.translation;
            let ahead = a.transform_vector3(Vec3::X);
            assert!((way - ahead).length() < 1e-3, "{way} {ahead}");
            let right = ahead.cross(Vec3::Y);
            let street = if lane.axis == 1 { right.x } else { right.z };
            let number = lane.across / PITCH[1 - lane.axis] - 0.5;
            let off = (number - number.round()) * PITCH[1 - lane.axis];
            assert!((off - street * LANE).abs() < 1e-3, "{off} {street}");
            assert_eq!(lane.place(5.0 + lane.length).translation.x, lane.place(5.0).translation.x);
            for (stop, crossing) in &lane.stops {
                let before = lane.place(*stop).translation;
                let gap = (crossing.center() - before).dot(ahead);
                assert!((gap - STOP).abs() < 1e-3, "{gap}");
            }
        }
    }
}
