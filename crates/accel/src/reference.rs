//! What builders see of a primitive: its box and its number.

use vastlight_math::{Aabb, Vec3};

/// A primitive's box and number in 32 bytes, laid out so that one eight-lane minimum unites two boxes:
/// lower corner, number, negated upper corner, and how many primitives it stands for besides the first.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub struct Reference {
    lanes: [f32; 8],
}

impl Reference {
    /// Coordinates beyond this are pulled in, so that sums of two stay finite.
    pub(crate) const LIMIT: f32 = 1e37;

    /// A reference to primitive `prim`. An empty or non-finite box is pulled into the finite range; it costs speed, not
    /// hits, since builders use boxes only to order primitives.
    #[must_use]
    pub fn new(bounds: &Aabb, prim: u32) -> Self {
        let limit = Vec3::splat(Self::LIMIT);
        // `max` and `min` in this order also turn NaN into a number.
        let lo = bounds.min.max(-limit).min(limit);
        let hi = bounds.max.min(limit).max(-limit);
        Self { lanes: [lo.x, lo.y, lo.z, f32::from_bits(prim), -hi.x, -hi.y, -hi.z, 0.0] }
    }

    /// A reference to primitive `prim` whose box is finite and not empty.
    #[inline(always)]
    pub(crate) fn finite(bounds: &Aabb, prim: u32) -> Self {
        let (lo, hi) = (bounds.min, bounds.max);
        Self { lanes: [lo.x, lo.y, lo.z, f32::from_bits(prim), -hi.x, -hi.y, -hi.z, 0.0] }
    }

    /// The primitive's number.
    #[inline]
    #[must_use]
    pub fn prim(&self) -> u32 {
        self.lanes[3].to_bits()
    }

    /// The primitive's box.
    #[inline]
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        unpack(&self.lanes)
    }

    /// As they are packed.
    #[inline]
    pub(crate) fn lanes(&self) -> &[f32; 8] {
        &self.lanes
    }

    /// The reference of packed lanes.
    #[inline(always)]
    pub(crate) fn from_lanes(lanes: [f32; 8]) -> Self {
        Self { lanes }
    }

    /// A reference to cluster `number` of `weight` primitives, at least one, in the packed box `lanes`.
    #[inline(always)]
    pub(crate) fn to_cluster(mut lanes: [f32; 8], number: u32, weight: u32) -> Self {
        (lanes[3], lanes[7]) = (f32::from_bits(number), f32::from_bits(weight - 1));
        Self { lanes }
    }

    /// How many primitives the reference stands for.
    #[inline(always)]
    pub(crate) fn weight(&self) -> u32 {
        self.lanes[7].to_bits() + 1
    }

    /// Twice the centre of the box along `axis`.
    #[inline(always)]
    pub(crate) fn twice_center(&self, axis: usize) -> f32 {
        self.lanes[axis] - self.lanes[axis + 4]
    }
}

/// The packed form of a box that contains nothing.
pub(crate) const EMPTY_LANES: [f32; 8] = [f32::INFINITY; 8];

/// The box in packed lanes.
#[inline]
pub(crate) fn unpack(lanes: &[f32; 8]) -> Aabb {
    Aabb { min: Vec3::new(lanes[0], lanes[1], lanes[2]), max: -Vec3::new(lanes[4], lanes[5], lanes[6]) }
}

/// Half the surface area of a packed box that is not empty.
#[inline(always)]
pub(crate) fn packed_half_area(lanes: &[f32; 8]) -> f32 {
    let d = [-(lanes[0] + lanes[4]), -(lanes[1] + lanes[5]), -(lanes[2] + lanes[6])];
    d[0] * d[1] + d[1] * d[2] + d[2] * d[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_and_numbers_survive_packing() {
        let bounds = Aabb { min: Vec3::new(-1.0, 2.0, -3.5), max: Vec3::new(4.0, 5.0, 6.0) };
        let reference = Reference::new(&bounds, 0x7fff_1234);
        assert_eq!((reference.bounds(), reference.prim()), (bounds, 0x7fff_1234));
        assert_eq!(packed_half_area(reference.lanes()), bounds.half_area());
    }

    #[test]
    fn odd_boxes_become_finite() {
        for bounds in [
            Aabb::EMPTY,
            Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY },
            Aabb { min: Vec3::NAN, max: Vec3::NAN },
        ] {
            let packed = Reference::new(&bounds, 1).bounds();
            assert!(packed.min.is_finite() && packed.max.is_finite(), "{bounds:?} {packed:?}");
        }
    }
}
