//! Sheen of cloth: the "Charlie" distribution and its shadowing (Estevez and Kulla 2017, "Production friendly
//! microfacet sheen BRDF"), as KHR_materials_sheen prescribes, drawn uniformly over the hemisphere.
//!
//! At low roughness and grazing angles that lobe reflects more than it receives; there it is scaled down,
//! symmetrically in both directions.

use super::{color, max3, unit};
use std::f32::consts::{FRAC_1_PI, TAU};
use std::sync::LazyLock;
use vastlight_math::{Vec2, Vec3, real, warp};

const NODES: usize = 16;
/// Roughness below which the lobe would be too thin for its table.
const SMALLEST_ROUGHNESS: f32 = 0.1;

/// Cosine below which the fit of the shadowing is not used.
const SMALLEST_COS: f32 = 1e-3;

/// A sheen lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sheen {
    color: Vec3,
    roughness: f32,
    strength: f32,
}

impl Sheen {
    /// `None` for black.
    pub(crate) fn new(tint: Vec3, roughness: f32) -> Option<Self> {
        let tint = color(tint);
        let strength = max3(tint);
        let roughness = unit(roughness).max(SMALLEST_ROUGHNESS);
        (strength > 0.0).then_some(Self { color: tint, roughness, strength })
    }

    /// Share of the light of this direction that passes to what lies below.
    pub(crate) fn passed(&self, cos: f32) -> f32 {
        1.0 - self.strength * albedo(cos, self.roughness).min(1.0)
    }

    /// Estimated share of the light of this direction that the lobe reflects.
    pub(crate) fn reflected(&self, cos: f32) -> Vec3 {
        self.color * albedo(cos, self.roughness).min(1.0)
    }

    /// `f * cos` for directions above the surface, and the density of [`Sheen::sample`].
    pub(crate) fn evaluate(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let alpha = self.roughness * self.roughness;
        let h = (wo + wi).normalize_or(Vec3::Z);
        let limit = albedo(wo.z, self.roughness).max(albedo(wi.z, self.roughness)).max(1.0);
        (self.color * (charlie(wo.z, wi.z, h, alpha) / limit), FRAC_1_PI * 0.5)
    }

    /// A direction above the surface.
    pub(crate) fn sample(u: Vec2) -> Vec3 {
        warp::uniform_hemisphere(u)
    }
}

/// `D * G / (4 cos_o)`: the reflection of white fibres times the cosine of `wi`.
fn charlie(cos_o: f32, cos_i: f32, h: Vec3, alpha: f32) -> f32 {
    let exponent = 1.0 / alpha;
    let sin2 = (h.x * h.x + h.y * h.y).min(1.0);
    let d = (2.0 + exponent) * real::pow(sin2, 0.5 * exponent) * (1.0 / TAU);
    d / ((1.0 + lambda(cos_o, alpha) + lambda(cos_i, alpha)) * 4.0 * cos_o.max(SMALLEST_COS))
}

/// The paper's fit of Smith's Lambda.
fn lambda(cos: f32, alpha: f32) -> f32 {
    let cos = cos.clamp(SMALLEST_COS, 1.0);
    let t = (1.0 - alpha) * (1.0 - alpha);
    if cos < 0.5 { real::exp(fit(cos, t)) } else { real::exp(2.0 * fit(0.5, t) - fit(1.0 - cos, t)) }
}

fn fit(x: f32, t: f32) -> f32 {
    let mix = |rough: f32, smooth: f32| rough + (smooth - rough) * t;
    let (a, b) = (mix(21.5473, 25.3245), mix(3.82987, 3.32435));
    let (c, d, e) = (mix(0.19823, 0.16801), mix(-1.9776, -1.27393), mix(-4.32054, -4.85967));
    a / (1.0 + b * real::pow(x, c)) + d * x + e
}

/// Albedo of white sheen by roughness and the square root of the cosine.
pub(crate) type Table = [[f32; NODES]; NODES];

/// The table; computed at the first call.
pub(crate) fn table() -> &'static Table {
    static TABLE: LazyLock<Table> = LazyLock::new(|| {
        let axis = |i: usize| i as f32 / (NODES - 1) as f32;
        let roughness = |r| SMALLEST_ROUGHNESS + (1.0 - SMALLEST_ROUGHNESS) * axis(r);
        let cell = |r, c| integrate((axis(c) * axis(c)).max(SMALLEST_COS), roughness(r));
        std::array::from_fn(|r| std::array::from_fn(|c| cell(r, c)))
    });
    &TABLE
}

/// Share of light that white sheen reflects before it is limited.
fn albedo(cos: f32, roughness: f32) -> f32 {
    let (r, fr) = node((roughness - SMALLEST_ROUGHNESS) / (1.0 - SMALLEST_ROUGHNESS));
    let (c, fc) = node(cos.clamp(0.0, 1.0).sqrt());
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let rows = table();
    let (a, b) = (&rows[r], &rows[r + 1]);
    mix(mix(a[c], a[c + 1], fc), mix(b[c], b[c + 1], fc), fr)
}

fn node(x: f32) -> (usize, f32) {
    let t = x.clamp(0.0, 1.0) * (NODES - 1) as f32;
    let i = (t as usize).min(NODES - 2);
    (i, t - i as f32)
}

/// Albedo of white sheen by quadrature: directions dense near the horizon, half the angles (the rest is a mirror
/// image).
fn integrate(cos: f32, roughness: f32) -> f32 {
    const STEPS: usize = 24;
    let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let alpha = roughness * roughness;
    let mut sum = 0.0;
    for i in 0..STEPS * STEPS {
        let t = ((i / STEPS) as f32 + 0.5) / STEPS as f32;
        let phi = std::f32::consts::PI * ((i % STEPS) as f32 + 0.5) / STEPS as f32;
        let wi = warp::direction(t * t, phi);
        sum += 2.0 * t * charlie(cos, wi.z, (wo + wi).normalize_or(Vec3::Z), alpha);
    }
    sum * TAU / (STEPS * STEPS) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Rng;

    #[test]
    fn table_equals_random_sampling_between_nodes() {
        let mut rng = Rng::new(9);
        for (cos, roughness) in [(0.3_f32, 0.45_f32), (0.8, 0.9), (0.07, 0.62)] {
            let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let alpha = roughness * roughness;
            let n = 40_000;
            let mut sum = 0.0;
            for _ in 0..n {
                let wi = Sheen::sample(rng.next_2d());
                sum += TAU * charlie(cos, wi.z, (wo + wi).normalize_or(Vec3::Z), alpha);
            }
            let (found, expected) = (albedo(cos, roughness), sum / n as f32);
            assert!((found - expected).abs() < 0.02, "{cos} {roughness}: {found} {expected}");
        }
    }
}
