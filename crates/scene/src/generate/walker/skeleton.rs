//! The figure's bones at rest: it stands at the origin with its arms a little spread, looks along +z, and has its left at +x.

use vastlight_math::Vec3;

/// Bones in the middle, and those of one side.
pub(super) const PELVIS: usize = 0;
pub(super) const SPINE: usize = 1;
pub(super) const CHEST: usize = 2;
pub(super) const NECK: usize = 3;
pub(super) const HEAD: usize = 4;
pub(super) const CLAVICLE: usize = 0;
pub(super) const UPPER_ARM: usize = 1;
pub(super) const FOREARM: usize = 2;
pub(super) const HAND: usize = 3;
pub(super) const THIGH: usize = 4;
pub(super) const SHIN: usize = 5;
pub(super) const FOOT: usize = 6;
pub(super) const TOES: usize = 7;
/// All bones.
pub(super) const BONES: usize = 21;

const IN_THE_MIDDLE: usize = 5;
const ON_A_SIDE: usize = 8;

/// A bone from its joint to its end, with the radius of the flesh at both.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bone {
    pub(super) parent: usize,
    pub(super) joint: Vec3,
    pub(super) end: Vec3,
    pub(super) radii: [f32; 2],
}

const fn bone(parent: usize, joint: [f32; 3], end: [f32; 3], radii: [f32; 2]) -> Bone {
    Bone { parent, joint: Vec3::from_array(joint), end: Vec3::from_array(end), radii }
}

const MIDDLE: [Bone; IN_THE_MIDDLE] = [
    bone(PELVIS, [0.0, 0.96, 0.0], [0.0, 1.06, 0.0], [0.125, 0.115]),
    bone(PELVIS, [0.0, 1.08, 0.0], [0.0, 1.22, 0.0], [0.112, 0.115]),
    bone(SPINE, [0.0, 1.24, 0.0], [0.0, 1.40, -0.01], [0.125, 0.12]),
    bone(CHEST, [0.0, 1.48, -0.015], [0.0, 1.57, 0.0], [0.056, 0.052]),
    bone(NECK, [0.0, 1.59, 0.0], [0.0, 1.73, 0.02], [0.06, 0.085]),
];

/// Those of the left side.
const LEFT: [Bone; ON_A_SIDE] = [
    bone(CHEST, [0.03, 1.445, -0.01], [0.165, 1.445, -0.015], [0.055, 0.056]),
    bone(IN_THE_MIDDLE, [0.185, 1.44, -0.015], [0.348, 1.203, -0.015], [0.054, 0.042]),
    bone(IN_THE_MIDDLE + UPPER_ARM, [0.348, 1.203, -0.015], [0.489, 0.997, 0.0], [0.042, 0.028]),
    bone(IN_THE_MIDDLE + FOREARM, [0.489, 0.997, 0.0], [0.574, 0.872, 0.012], [0.03, 0.024]),
    bone(PELVIS, [0.1, 0.93, 0.0], [0.105, 0.505, 0.012], [0.088, 0.055]),
    bone(IN_THE_MIDDLE + THIGH, [0.105, 0.505, 0.012], [0.105, 0.09, -0.02], [0.053, 0.036]),
    bone(IN_THE_MIDDLE + SHIN, [0.105, 0.09, -0.02], [0.11, 0.034, 0.115], [0.044, 0.037]),
    bone(IN_THE_MIDDLE + FOOT, [0.11, 0.034, 0.115], [0.112, 0.026, 0.175], [0.036, 0.028]),
];

/// The number of a bone on a side: 0 left, 1 right.
pub(super) const fn on(side: usize, bone: usize) -> usize {
    IN_THE_MIDDLE + side * ON_A_SIDE + bone
}

/// The side of a bone, if it has one.
pub(super) const fn side_of(bone: usize) -> Option<usize> {
    if bone < IN_THE_MIDDLE { None } else { Some((bone - IN_THE_MIDDLE) / ON_A_SIDE) }
}

/// All bones; a parent comes before its children.
pub(super) fn bones() -> [Bone; BONES] {
    std::array::from_fn(|i| match side_of(i) {
        None => MIDDLE[i],
        Some(side) => {
            let left = LEFT[i - on(side, 0)];
            let mirror = Vec3::new(if side == 0 { 1.0 } else { -1.0 }, 1.0, 1.0);
            let parent =
                if left.parent < IN_THE_MIDDLE { left.parent } else { left.parent + side * ON_A_SIDE };
            Bone { parent, joint: left.joint * mirror, end: left.end * mirror, ..left }
        }
    })
}

/// Distance to a round stick whose radius goes from the first to the second.
pub(super) fn stick(p: Vec3, a: Vec3, b: Vec3, radii: [f32; 2]) -> f32 {
    let (pa, ba) = (p - a, b - a);
    let h = (pa.dot(ba) / ba.length_squared()).clamp(0.0, 1.0);
    (pa - ba * h).length() - (radii[0] + (radii[1] - radii[0]) * h)
}
