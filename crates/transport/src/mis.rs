//! Weights of multiple importance sampling: E. Veach, L. Guibas 1995, "Optimally combining sampling techniques for
//! Monte Carlo rendering".

use crate::settings::DirectSampling;

/// The power heuristic with exponent 2: the weight of a sample drawn with density `mine` that another technique
/// would have drawn with density `other`.
#[inline]
fn power_heuristic(mine: f32, other: f32) -> f32 {
    // By the ratio, so that nothing overflows: densities of small lights are large.
    let ratio = other / mine;
    1.0 / (1.0 + ratio * ratio)
}

impl DirectSampling {
    /// Weight of a direction drawn from the lights with density `light` that the BSDF draws with density `bsdf`.
    #[inline]
    pub(crate) fn weight_of_light(self, light: f32, bsdf: f32) -> f32 {
        match self {
            Self::Both => power_heuristic(light, bsdf),
            Self::Light => 1.0,
            Self::Bsdf => 0.0,
        }
    }

    /// Weight of a direction drawn from the BSDF with density `bsdf` that the lights draw with density `light`.
    /// Light that the lights cannot draw counts in full.
    #[inline]
    pub(crate) fn weight_of_bsdf(self, bsdf: f32, light: f32) -> f32 {
        match self {
            _ if light <= 0.0 => 1.0,
            Self::Both => power_heuristic(bsdf, light),
            Self::Light => 0.0,
            Self::Bsdf => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_both_techniques_sum_to_one() {
        for (a, b) in [(1.0, 1.0), (0.3, 7.0), (1e20, 1e30), (1e-20, 1e-30), (2.0, 1e-3)] {
            for sampling in [DirectSampling::Both, DirectSampling::Bsdf, DirectSampling::Light] {
                let sum = sampling.weight_of_light(a, b) + sampling.weight_of_bsdf(b, a);
                assert!((sum - 1.0).abs() < 1e-6, "{a} {b} {sampling:?} {sum}");
            }
        }
        assert_eq!(DirectSampling::Both.weight_of_bsdf(3.0, 0.0), 1.0);
    }
}
