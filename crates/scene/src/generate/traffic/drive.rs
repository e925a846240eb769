//! Cars that follow each other and stop at red lights: the intelligent driver model (Treiber, Hennecke and Helbing,
//! "Congested traffic states in empirical observations and microscopic simulations", 2000), stepped at a fixed rate.

use super::super::chance::Chance;
use super::super::moments;
use super::DURATION;
use super::roads::Lane;

/// Kept moments a second, and steps from one to the next.
const KEYS_A_SECOND: u32 = 30;
const STEPS_A_KEY: u32 = 2;
const STEP: f32 = 1.0 / (KEYS_A_SECOND * STEPS_A_KEY) as f32;
/// Seconds that they have driven before the first moment.
const BEFORE: f32 = 30.0;
/// Metres of a car, and from its middle to its front.
const LENGTH: f32 = 4.6;
const FRONT: f32 = 2.3;
/// Metres a second squared: how cars like to speed up and to brake, and the most that they brake for a light.
const SPEEDING: f32 = 1.7;
const BRAKING: f32 = 2.4;
const HARDEST: f32 = 5.0;
/// Metres between cars that stand, and seconds to the car ahead.
const STANDING: f32 = 2.2;
const HEADWAY: f32 = 1.1;

/// A car on a lane.
#[derive(Clone, Copy, Debug)]
struct Car {
    /// Of its middle, metres from the lane's start; goes on growing.
    along: f32,
    speed: f32,
    /// The speed that it wants, metres a second.
    wish: f32,
}

/// How far all cars are along their lanes: lane by lane, in the order of [`shares`], at each kept moment.
pub(super) fn keys(lanes: &[Lane], cars: usize, chance: &Chance) -> Vec<Vec<f32>> {
    let counts = shares(lanes, cars);
    let mut traffic: Vec<Vec<Car>> =
        (0..lanes.len()).map(|i| line_up(&lanes[i], counts[i], chance.part(i as u64))).collect();
    let steps = |seconds: f32| (seconds / STEP) as u32;
    let mut time = -BEFORE;
    let mut keys = Vec::new();
    for step in 0..=steps(BEFORE + DURATION) {
        if step >= steps(BEFORE) && (step - steps(BEFORE)).is_multiple_of(STEPS_A_KEY) {
            keys.push(traffic.iter().flatten().map(|car| car.along).collect());
        }
        for (lane, cars) in lanes.iter().zip(&mut traffic) {
            drive(lane, cars, time);
        }
        time += STEP;
    }
    keys
}

/// Where all cars are at a time in seconds; the ends hold.
pub(super) fn between_keys(keys: &[Vec<f32>], time: f32) -> Vec<f32> {
    moments::between(keys, KEYS_A_SECOND, time, |a, b, t| a + (b - a) * t)
}

/// Cars of each lane; all of them together are as many as there are.
pub(super) fn shares(lanes: &[Lane], cars: usize) -> Vec<usize> {
    let total: usize = lanes.iter().map(|lane| lane.share as usize).sum();
    let mut before = 0;
    lanes
        .iter()
        .map(|lane| {
            let first = cars * before / total;
            before += lane.share as usize;
            cars * before / total - first
        })
        .collect()
}

/// Cars with even gaps, nearly.
fn line_up(lane: &Lane, cars: usize, mut chance: Chance) -> Vec<Car> {
    let gap = lane.length / cars.max(1) as f32;
    let shift = chance.range(0.0, gap);
    let loose = (0.4 * (gap - LENGTH - STANDING)).max(0.0);
    (0..cars)
        .map(|i| Car {
            along: gap * i as f32 + shift + chance.range(0.0, loose),
            speed: 5.0,
            wish: chance.range(9.0, 12.5),
        })
        .collect()
}

/// One step of a lane: all decide at once, then all move.
fn drive(lane: &Lane, cars: &mut [Car], time: f32) {
    let count = cars.len();
    let decisions: Vec<f32> = (0..count)
        .map(|i| {
            let car = cars[i];
            let free = acceleration(&car, f32::INFINITY, 0.0);
            let lead = cars[(i + 1) % count];
            // The first car is a lap ahead of the last.
            let ahead = lead.along + if i + 1 == count { lane.length } else { 0.0 } - car.along;
            let following = if count > 1 { acceleration(&car, ahead - LENGTH, lead.speed) } else { free };
            following.min(red_light(lane, &car, time).map_or(free, |gap| acceleration(&car, gap, 0.0)))
        })
        .collect();
    for (car, decision) in cars.iter_mut().zip(decisions) {
        car.speed = (car.speed + decision * STEP).max(0.0);
        car.along += car.speed * STEP;
    }
}

/// What the model does behind a car of some speed, so far ahead.
fn acceleration(car: &Car, gap: f32, speed_ahead: f32) -> f32 {
    let part = car.speed / car.wish;
    let square = part * part;
    let closing = car.speed * (car.speed - speed_ahead) / (2.0 * (SPEEDING * BRAKING).sqrt());
    let wanted = STANDING + (car.speed * HEADWAY + closing).max(0.0);
    let tight = wanted / gap.max(0.1);
    (SPEEDING * (1.0 - square * square - tight * tight)).max(-9.0)
}

/// Metres that a car has to the next red light, if it can stop there; it stands a little before the line.
fn red_light(lane: &Lane, car: &Car, time: f32) -> Option<f32> {
    let laps = car.along / lane.length;
    let front = (laps - laps.floor()) * lane.length + FRONT;
    let (stop, crossing) = lane.stops.iter().find(|stop| stop.0 > front)?;
    let gap = stop - front;
    let can_stop = gap > car.speed * car.speed / (2.0 * HARDEST);
    (can_stop && !crossing.is_green(lane.axis(), time)).then_some(gap + 0.5 * STANDING)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_car_is_left_over() {
        let lanes = Lane::all();
        for cars in [0, 1, 15, 70, 83] {
            assert_eq!(shares(&lanes, cars).iter().sum::<usize>(), cars);
        }
    }

    #[test]
    fn a_free_car_takes_its_speed_and_a_following_one_keeps_its_distance() {
        let mut car = Car { along: 0.0, speed: 0.0, wish: 12.0 };
        for _ in 0..6000 {
            car.speed += acceleration(&car, f32::INFINITY, 0.0) * STEP;
        }
        assert!((car.speed - 12.0).abs() < 0.1, "{}", car.speed);
        // Behind a car of 8 m/s the model's equilibrium gap is (s0 + v T) / sqrt(1 - (v / v0)^4).
        let (mut gap, ahead) = (60.0, 8.0);
        for _ in 0..12_000 {
            car.speed += acceleration(&car, gap, ahead) * STEP;
            gap += (ahead - car.speed) * STEP;
        }
        let part: f32 = 8.0 / 12.0;
        let expected = (STANDING + 8.0 * HEADWAY) / (1.0 - part * part * part * part).sqrt();
        assert!((gap - expected).abs() < 0.1, "{gap} {expected}");
    }
}
