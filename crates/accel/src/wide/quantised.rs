//! Eight boxes with planes of eight bits.
//!
//! After H. Ylitie, T. Karras, S. Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs".

use super::Node8;
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::Simd8;

/// The boxes of eight slots in 64 bytes, rounded outward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct QuantisedBoxes {
    /// Bits of the f32 from which planes are counted, by axis.
    origin: [u32; 3],
    /// Distance between planes, by axis: the exponent bits of an f32.
    exponents: [u8; 3],
    /// Slots with a box, as bits.
    used: u8,
    /// By axis, then lower or upper, then slot.
    planes: [[[u8; 8]; 2]; 3],
}

impl QuantisedBoxes {
    /// Rounds those boxes of `node` whose slot has its bit in `used`.
    pub(crate) fn new(node: &Node8, used: u8) -> Self {
        let mut boxes = Self { used, planes: [[[u8::MAX; 8], [0; 8]]; 3], ..Self::default() };
        (0..3).for_each(|axis| boxes.set_axis(node, axis));
        boxes
    }

    /// Rounds the planes of an axis outward, to the smallest distance with which eight bits reach.
    fn set_axis(&mut self, node: &Node8, axis: usize) {
        let slots = || (0..8).filter(|&slot| self.used >> slot & 1 == 1);
        let [lower, upper] = &node.planes[axis];
        let first = slots().map(|s| lower[s]).fold(f32::INFINITY, f32::min).max(f32::MIN);
        let last = slots().map(|s| upper[s]).fold(f32::NEG_INFINITY, f32::max);
        let smallest = ((last - first) / 255.0).to_bits() >> 23;
        for exponent in smallest.clamp(1, 253)..=254 {
            let step = f32::from_bits(exponent << 23);
            let plane = |q: u8| first + f32::from(q) * step;
            let mut planes = [[u8::MAX; 8], [0; 8]];
            let mut fits = true;
            for slot in slots() {
                let down =
                    (0..=last_below(lower[slot] - first, step)).rev().find(|&q| plane(q) <= lower[slot]);
                let up = (last_below(upper[slot] - first, step)..=u8::MAX).find(|&q| plane(q) >= upper[slot]);
                fits &= up.is_some();
                (planes[0][slot], planes[1][slot]) = (down.unwrap_or(0), up.unwrap_or(u8::MAX));
            }
            (self.origin[axis], self.exponents[axis], self.planes[axis]) =
                (first.to_bits(), exponent as u8, planes);
            if fits {
                return;
            }
        }
    }

    /// The slots with a box, as bits.
    #[inline(always)]
    #[must_use]
    pub fn used(&self) -> u8 {
        self.used
    }

    /// The lower (`side` 0) or upper (1) planes of all slots.
    #[inline(always)]
    #[must_use]
    pub fn planes<S: Simd8>(&self, s: S, axis: usize, side: usize) -> S::F {
        let step = f32::from_bits(u32::from(self.exponents[axis]) << 23);
        // The product is exact, so the sum is rounded once at every level.
        s.add(
            s.splat(f32::from_bits(self.origin[axis])),
            s.mul(s.widen(&self.planes[axis][side]), s.splat(step)),
        )
    }

    /// The box of a slot.
    #[inline(always)]
    #[must_use]
    pub fn bounds(&self, slot: usize) -> Aabb {
        let corner = |side: usize| Vec3::from(std::array::from_fn(|axis| self.plane(axis, side, slot % 8)));
        Aabb { min: corner(0), max: corner(1) }
    }

    #[inline(always)]
    fn plane(&self, axis: usize, side: usize, slot: usize) -> f32 {
        let step = f32::from_bits(u32::from(self.exponents[axis]) << 23);
        f32::from_bits(self.origin[axis]) + f32::from(self.planes[axis][side][slot]) * step
    }
}

/// The number of steps up to `x`, in 8 bits.
fn last_below(x: f32, step: f32) -> u8 {
    (x / step).min(255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wide::ChildRef;

    #[test]
    fn boxes_without_end_are_contained_as_far_as_numbers_go() {
        let far = [f32::INFINITY, f32::MAX, 3e38, 1e37, 1.0];
        for (i, &upper) in far.iter().enumerate() {
            for &lower in &far {
                let mut node = Node8::EMPTY;
                node.set(1, ChildRef::leaf(0), &Aabb { min: Vec3::splat(-lower), max: Vec3::splat(upper) });
                node.set(6, ChildRef::leaf(1), &Aabb { min: Vec3::ZERO, max: Vec3::splat(1.0) });
                let boxes = QuantisedBoxes::new(&node, 1 << 1 | 1 << 6);
                let (found, small) = (boxes.bounds(1), boxes.bounds(6));
                assert!(found.min.x <= -lower.min(f32::MAX), "{lower} {found:?}");
                assert!(found.max.x >= upper, "{upper} {found:?}");
                assert!(small.contains(&node.bounds(6)), "{i} {small:?}");
            }
        }
    }
}
