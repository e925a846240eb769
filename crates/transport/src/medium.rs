//! The media that a path is inside of: closed volumes of absorbing glass, nested or overlapping.

use vastlight_math::{Vec3, real};

/// Volumes around a path, outermost first, by material. Entering adds, leaving removes the innermost of the same
/// material; what does not fit is ignored, and so is leaving a volume that was never entered (the camera was inside).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MediumStack {
    materials: [u32; Self::CAPACITY],
}

impl MediumStack {
    const CAPACITY: usize = 4;
    const FREE: u32 = u32::MAX;

    /// Outside of everything.
    pub(crate) const EMPTY: Self = Self { materials: [Self::FREE; Self::CAPACITY] };

    /// The material whose volume surrounds the path.
    #[inline]
    pub(crate) fn current(&self) -> Option<u32> {
        self.materials.iter().rev().copied().find(|&m| m != Self::FREE)
    }

    /// The stack inside of the volume of `material`.
    pub(crate) fn entered(mut self, material: u32) -> Self {
        if let Some(place) = self.materials.iter_mut().find(|m| **m == Self::FREE) {
            *place = material;
        }
        self
    }

    /// The stack outside of the volume of `material`.
    pub(crate) fn left(mut self, material: u32) -> Self {
        if let Some(place) = self.materials.iter().rposition(|&m| m == material) {
            self.materials[place..].rotate_left(1);
            self.materials[Self::CAPACITY - 1] = Self::FREE;
        }
        self
    }
}

/// Beer and Lambert's law: what remains of light after `distance` in a medium that absorbs `sigma_a` per unit.
#[inline]
pub(crate) fn transmittance(sigma_a: Vec3, distance: f32) -> Vec3 {
    if sigma_a == Vec3::ZERO {
        return Vec3::ONE;
    }
    let depth = sigma_a * distance;
    Vec3::new(real::exp(-depth.x), real::exp(-depth.y), real::exp(-depth.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_volumes_are_left_in_any_order() {
        let stack = MediumStack::EMPTY.entered(3).entered(5).entered(3);
        assert_eq!(stack.current(), Some(3));
        assert_eq!(stack.left(3).current(), Some(5));
        assert_eq!(stack.left(5), MediumStack::EMPTY.entered(3).entered(3));
        assert_eq!(stack.left(5).left(3).left(3), MediumStack::EMPTY);
        assert_eq!(MediumStack::EMPTY.left(1).current(), None);
        let full = (0..9).fold(MediumStack::EMPTY, |s, _| s.entered(1));
        assert_eq!((0..4).fold(full, |s, _| s.left(1)), MediumStack::EMPTY);
    }
}
