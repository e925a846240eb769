//! A walk: feet on their own paths, hips that swing over them as far up as legs reach, arms against the legs.

use super::super::noise::smoothstep;
use super::super::rigid::{Place, Turn};
use super::flesh::{BALL, HEEL, join};
use super::skeleton::{
    BONES, Bone, CHEST, CLAVICLE, FOOT, FOREARM, HAND, HEAD, NECK, PELVIS, SHIN, SPINE, THIGH, TOES,
    UPPER_ARM, bones, on,
};
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;
use vastlight_math::{Vec3, real::sin_cos};

/// Part of the cycle of one second that a foot is on the ground.
const STANCE: f32 = 0.62;
/// How far legs are let stretch, and how much lower than at rest the hips are carried, metres.
const STRETCH: f32 = 0.996;
const LOWERED: f32 = 0.022;
/// Radians that a foot points up when its heel strikes, and down when its toes leave.
const STRIKE: f32 = 0.3;
const LEAVE: f32 = 0.8;

/// A way of walking.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Gait {
    #[serde(skip, default = "bones")]
    pub(super) bones: [Bone; BONES],
    /// Metres a cycle.
    pub(super) stride: f32,
    /// Radians that arms swing to either side.
    pub(super) swing: f32,
    /// Metres that a foot is lifted.
    pub(super) lift: f32,
}

/// A foot at a moment.
struct Step {
    foot: Place,
    ankle: Vec3,
    toes: Turn,
}

impl Gait {
    pub(super) fn new(stride: f32, swing: f32, lift: f32) -> Self {
        Self { bones: bones(), stride, swing, lift }
    }

    /// Where all bones have come from rest, at a moment.
    pub(super) fn at(&self, time: f32) -> [Place; BONES] {
        let mut places = [Place { turn: Turn::NONE, at: Vec3::ZERO }; BONES];
        let (sin, cos) = sin_cos(TAU * (time - time.floor()));
        let steps = [0, 1].map(|side| self.step(time, side));
        self.trunk(&mut places, &steps, self.stride * time, [sin, cos]);
        for (side, step) in steps.into_iter().enumerate() {
            self.leg(&mut places, side, &step);
            self.arm(&mut places, side, if side == 0 { cos } else { -cos });
        }
        places
    }

    /// A foot's way: it rolls from heel to toes on its place, then flies to the next.
    fn step(&self, time: f32, side: usize) -> Step {
        let offset = 0.5 * side as f32;
        let cycle = (time + offset).floor();
        let s = time + offset - cycle;
        let flight = smoothstep(STANCE, 1.0, s);
        let at = self.stride * (cycle + 0.5 * STANCE - offset + flight);
        let u = ((s - STANCE) / (1.0 - STANCE)).clamp(0.0, 1.0);
        let up = self.lift * 16.0 * u * u * (1.0 - u) * (1.0 - u);
        let strike = 1.0 - smoothstep(0.0, 0.1, s) + smoothstep(0.8, 1.0, s);
        let leave = smoothstep(0.33, STANCE, s) * (1.0 - smoothstep(STANCE, 0.85, s));
        let pitch = STRIKE * strike - LEAVE * leave;
        let mut pivot = if pitch > 0.0 { HEEL } else { BALL };
        if side == 1 {
            pivot.x = -pivot.x;
        }
        let turn = nod(-pitch);
        let ground = Vec3::new(0.0, up, at) + pivot;
        let foot = Place { turn, at: ground - turn.apply(pivot) };
        // Toes stay flat until they have left the ground.
        let toes = if pitch > 0.0 { turn } else { nod(-pitch * smoothstep(STANCE - 0.02, 0.76, s)) };
        Step { ankle: foot.point(self.bones[on(side, FOOT)].joint), foot, toes }
    }

    /// Pelvis to head.
    fn trunk(&self, places: &mut [Place; BONES], steps: &[Step; 2], along: f32, [sin, cos]: [f32; 2]) {
        let pelvis = Turn::about(Vec3::Y, -0.1 * cos) * Turn::about(Vec3::Z, 0.035 * sin) * nod(0.03);
        let chest = Turn::about(Vec3::Y, 0.1 * cos) * Turn::about(Vec3::Z, -0.02 * sin) * nod(0.05);
        let head = Turn::about(Vec3::Y, 0.02 * cos) * nod(0.02);
        let rest = self.bones[PELVIS].joint;
        let mut at = Vec3::new(0.018 * sin, rest.y - LOWERED, along);
        for (side, step) in steps.iter().enumerate() {
            let hip = at + pelvis.apply(self.bones[on(side, THIGH)].joint - rest);
            let reach = STRETCH * (self.length(on(side, THIGH)) + self.length(on(side, SHIN)));
            let level = (step.ankle - hip).with_y(0.0).length_squared();
            let highest = step.ankle.y + (reach * reach - level).max(0.0).sqrt();
            at.y = join(at.y, at.y + highest - hip.y, 0.03);
        }
        places[PELVIS] = Place { turn: pelvis, at: at - pelvis.apply(rest) };
        self.hang(places, SPINE, pelvis.towards(chest, 0.5));
        self.hang(places, CHEST, chest);
        self.hang(places, NECK, chest.towards(head, 0.5));
        self.hang(places, HEAD, head);
    }

    /// Thigh and shin between hip and ankle, the knee in front.
    fn leg(&self, places: &mut [Place; BONES], side: usize, step: &Step) {
        let (thigh, shin) = (on(side, THIGH), on(side, SHIN));
        let hip = places[PELVIS].point(self.bones[thigh].joint);
        let (upper, lower) = (self.length(thigh), self.length(shin));
        let way = step.ankle - hip;
        let length = way.length().min((upper + lower) * 0.9999);
        let down = way.normalize_or(Vec3::NEG_Y);
        let along = (upper * upper - lower * lower + length * length) / (2.0 * length);
        let forward = (Vec3::Z - down * down.z).normalize_or(Vec3::Z);
        let knee = hip + down * along + forward * (upper * upper - along * along).max(0.0).sqrt();
        for (bone, from, to) in [(thigh, hip, knee), (shin, knee, step.ankle)] {
            let rest = &self.bones[bone];
            let turn = between(
                (rest.end - rest.joint).normalize_or(Vec3::NEG_Y),
                (to - from).normalize_or(Vec3::NEG_Y),
            );
            places[bone] = Place { turn, at: from - turn.apply(rest.joint) };
        }
        places[on(side, FOOT)] = step.foot;
        self.hang(places, on(side, TOES), step.toes);
    }

    /// An arm that swings: `back` is 1 where it is furthest behind and -1 where it is furthest in front.
    fn arm(&self, places: &mut [Place; BONES], side: usize, back: f32) {
        let chest = places[CHEST].turn;
        let inward = Turn::about(Vec3::Z, if side == 0 { -0.43 } else { 0.43 });
        let swing = self.swing * back - 0.06;
        let bend = -0.3 - 0.18 * (1.0 - back);
        self.hang(places, on(side, CLAVICLE), chest);
        self.hang(places, on(side, UPPER_ARM), chest * nod(swing) * inward);
        self.hang(places, on(side, FOREARM), chest * nod(swing + bend) * inward);
        self.hang(places, on(side, HAND), chest * nod(swing + bend - 0.12) * inward);
    }

    /// Turns a bone about its joint, which its parent carries.
    fn hang(&self, places: &mut [Place; BONES], bone: usize, turn: Turn) {
        let Bone { parent, joint, .. } = self.bones[bone];
        places[bone] = Place { turn, at: places[parent].point(joint) - turn.apply(joint) };
    }

    fn length(&self, bone: usize) -> f32 {
        (self.bones[bone].end - self.bones[bone].joint).length()
    }
}

/// A turn about the axis from right to left: what is above comes forward.
fn nod(angle: f32) -> Turn {
    Turn::about(Vec3::X, angle)
}

/// The shortest turn from one unit vector to another.
fn between(from: Vec3, to: Vec3) -> Turn {
    Turn { w: 1.0 + from.dot(to), v: from.cross(to) }.normalized()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limbs_hold_together_at_all_times() {
        let gait = Gait::new(1.15, 0.4, 0.05);
        for i in 0..=240 {
            let places = gait.at(i as f32 / 60.0);
            for (i, bone) in gait.bones.iter().enumerate() {
                let apart = places[i].point(bone.joint) - places[bone.parent].point(bone.joint);
                assert!(apart.length() < 2e-3, "{i}: {apart}");
            }
        }
    }

    #[test]
    fn feet_stand_still_while_they_stand() {
        let gait = Gait::new(1.15, 0.4, 0.05);
        for side in 0..2 {
            let mut still = 0;
            for i in 0..240 {
                let ball = |time: f32| {
                    let mut ball = BALL;
                    ball.x *= if side == 0 { 1.0 } else { -1.0 };
                    gait.at(time)[on(side, FOOT)].point(ball)
                };
                let (now, next) = (ball(i as f32 / 60.0), ball((i + 1) as f32 / 60.0));
                assert!(now.y > -1e-3, "{now}");
                still += usize::from((next - now).length() < 1e-4);
            }
            assert!((90..150).contains(&still), "{still}");
        }
    }

    #[test]
    fn the_walk_repeats_every_second() {
        let gait = Gait::new(1.15, 0.4, 0.05);
        for i in 0..20 {
            let time = i as f32 / 20.0;
            let (now, later) = (gait.at(time), gait.at(time + 1.0));
            for (now, later) in now.iter().zip(&later) {
                let p = Vec3::new(0.1, 1.0, 0.1);
                assert!((later.point(p) - now.point(p) - Vec3::Z * gait.stride).length() < 1e-4);
            }
        }
    }
}
