//! The lattice of a mesh: positions are multiples of a power of two, so that every layout holds the same floats.

use vastlight_math::Vec3;

/// A power-of-two lattice through the object's origin on which coordinates are integers of at most 24 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Distance between neighbouring lattice points, a power of two.
    pub step: f32,
}

impl Lattice {
    /// The finest lattice that holds coordinates up to `max_abs`.
    #[must_use]
    pub fn for_extent(max_abs: f32) -> Self {
        let exponent = (max_abs.max(f32::MIN_POSITIVE).to_bits() >> 23) as i32 - 127;
        let step_exponent = (exponent - 22).clamp(-126, 100);
        Self { step: f32::from_bits(((step_exponent + 127) as u32) << 23) }
    }

    /// The lattice point nearest to `p`; exact in f32.
    #[inline]
    #[must_use]
    pub fn snap(&self, p: Vec3) -> Vec3 {
        Vec3::new(self.snap_scalar(p.x), self.snap_scalar(p.y), self.snap_scalar(p.z))
    }

    fn snap_scalar(&self, x: f32) -> f32 {
        // Scaling by a power of two is exact; beyond 2^23 every float is an integer already.
        (x / self.step).round_ties_even() * self.step + 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snapped_coordinates_are_integers_of_24_bits() {
        for max_abs in [1e-30_f32, 0.37, 1.0, 255.99, 1e6, 3e30] {
            let lattice = Lattice::for_extent(max_abs);
            for i in -1000..=1000 {
                let x = max_abs * i as f32 / 1000.0;
                let snapped = lattice.snap(Vec3::splat(x)).x;
                let integer = snapped / lattice.step;
                assert_eq!(integer, integer.round());
                assert!(integer.abs() <= 16_777_216.0, "{max_abs} {x} {integer}");
                assert!((snapped - x).abs() <= lattice.step * 0.5);
                assert_eq!(lattice.snap(Vec3::splat(snapped)).x, snapped);
            }
        }
    }
}
