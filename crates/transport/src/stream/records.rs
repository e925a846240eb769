//! What a ray carries between kernels, and the exact sum of a sample.

use vastlight_math::Vec3;

/// What a ray carries; 24 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Load {
    /// The product of the reflectances on the way; for a shadow ray what it adds to the sample if nothing is in its
    /// way.
    pub(super) weight: Vec3,
    /// Place in the batch's samples.
    pub(super) sample: u32,
    /// Number of the ray in the tree of its sample: 1 from the camera, `2 n` mirrored, `2 n + 1` refracted at the end
    /// of ray `n`. 0 for shadow rays.
    pub(super) node: u32,
    /// Decides about blended surfaces on the way.
    pub(super) key: u32,
}

impl Load {
    pub(super) fn of_camera(sample: u32, key: u32) -> Self {
        Self { weight: Vec3::ONE, sample, node: 1, key }
    }

    /// That of a ray derived at the end of this one: mirrored (0) or refracted (1).
    pub(super) fn derived(&self, kind: u32, weight: Vec3) -> Self {
        let node = 2 * self.node + kind;
        Self {
            weight: self.weight * weight,
            node,
            key: self.key.wrapping_mul(0x9e37_79b9).wrapping_add(node),
            ..*self
        }
    }

    /// That of a shadow ray at the end of this one.
    pub(super) fn shadow(&self, radiance: Vec3) -> Self {
        Self { weight: self.weight * radiance, node: 0, key: self.key ^ 0x5bd1_e995, ..*self }
    }

    pub(super) fn is_shadow(&self) -> bool {
        self.node == 0
    }

    /// Segments from the camera, this ray's included.
    pub(super) fn depth(&self) -> u32 {
        u32::BITS - self.node.leading_zeros()
    }
}

/// A sum of colours in fixed point, whose bits do not depend on the order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sum {
    channels: [i128; 3],
    broken: bool,
}

impl Sum {
    /// Units of one: every f32 from 2^-40 on is a whole number of them.
    const ONE: f64 = 18_446_744_073_709_551_616.0;

    /// Adds a colour; one that is not finite makes the sum undefined.
    pub(super) fn add(&mut self, color: Vec3) {
        self.broken |= !color.is_finite();
        for (sum, x) in self.channels.iter_mut().zip(color.to_array()) {
            *sum = sum.saturating_add((f64::from(x) * Self::ONE) as i128);
        }
    }

    pub(super) fn value(&self) -> Vec3 {
        if self.broken {
            return Vec3::NAN;
        }
        Vec3::from(self.channels.map(|sum| (sum as f64 / Self::ONE) as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_do_not_depend_on_the_order() {
        let colors: Vec<Vec3> = (0..50)
            .map(|i| Vec3::new(0.1, 1e-6, 3e4) * (1.0 + i as f32 * 0.37) * (-1.0_f32).powi(i))
            .collect();
        let sum = |colors: &mut dyn Iterator<Item = &Vec3>| {
            let mut sum = Sum::default();
            colors.for_each(|c| sum.add(*c));
            sum.value()
        };
        assert_eq!(sum(&mut colors.iter()), sum(&mut colors.iter().rev()));
        // Negative control: plain sums do.
        let plain = |a: Vec3, b: &Vec3| a + *b;
        assert_ne!(colors.iter().fold(Vec3::ZERO, plain), colors.iter().rev().fold(Vec3::ZERO, plain));
        let mut broken = Sum::default();
        broken.add(Vec3::new(1.0, f32::INFINITY, 0.0));
        assert!(!broken.value().is_finite());
        assert_eq!(sum(&mut [Vec3::new(0.1, 2.5e-7, 1e9)].iter()), Vec3::new(0.1, 2.5e-7, 1e9));
    }

    #[test]
    fn nodes_count_their_depth() {
        let camera = Load::of_camera(3, 7);
        let mirrored = camera.derived(0, Vec3::splat(0.5));
        let refracted = mirrored.derived(1, Vec3::splat(0.5));
        assert_eq!([camera.depth(), mirrored.depth(), refracted.depth()], [1, 2, 3]);
        assert_eq!((refracted.weight, refracted.node, refracted.sample), (Vec3::splat(0.25), 5, 3));
        assert!(refracted.shadow(Vec3::ONE).is_shadow() && !refracted.is_shadow());
    }
}
