//! How much of the light a rough interface returns after one bounce: tables of directional albedo, computed once by
//! quadrature over visible normals. They drive energy compensation (Kulla and Conty 2017), the coupling of diffuse and
//! specular reflection, and the choice of lobes.
//!
//! Axes: the square root of the cosine (fine near grazing), perceptual roughness, and for dielectrics
//! `|n - 1| / (n + 1)` for each side of the interface. Values between nodes are interpolated linearly.

use super::{fresnel, ggx::Ggx};
use crate::words::Words;
use std::sync::LazyLock;
use vastlight_math::{Vec2, Vec3, sobol};

const COSINES: usize = 16;
const ROUGHNESSES: usize = 16;
const INDICES: usize = 8;
/// Samples for an interface that reflects everything; dielectrics use the first quarter of them.
const SAMPLES: u32 = 512;
/// `(n - 1) / (n + 1)` of the last node: an index of 4.
const LARGEST_CONTRAST: f32 = 0.6;

/// One bounce at a dielectric interface, as shares of the light that comes from a direction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bounce {
    /// Reflected, weighted with the Fresnel curve's rise from normal incidence: 0 there, 1 at grazing.
    pub(crate) rise: f32,
    /// Neither reflected nor transmitted: shadowed, and due to further bounces.
    pub(crate) loss: f32,
}

impl Bounce {
    fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            rise: self.rise + (other.rise - self.rise) * t,
            loss: self.loss + (other.loss - self.loss) * t,
        }
    }
}

type Row<T> = [T; COSINES];

/// See the module.
#[derive(Debug)]
pub(crate) struct Tables {
    full: [Row<f32>; ROUGHNESSES],
    full_average: [f32; ROUGHNESSES],
    /// Outside, then inside; then by index and roughness.
    bounces: [Vec<[Row<Bounce>; ROUGHNESSES]>; 2],
    bounce_averages: [Vec<[Bounce; ROUGHNESSES]>; 2],
}

/// The tables; computed at the first call.
pub(crate) fn tables() -> &'static Tables {
    static TABLES: LazyLock<Tables> = LazyLock::new(Tables::new);
    &TABLES
}

/// The table axis of an index of refraction.
pub(crate) fn contrast(ior: f32) -> f32 {
    (ior - 1.0).abs() / (ior + 1.0)
}

impl Tables {
    /// Share of light reflected in one bounce by microfacets that absorb nothing.
    pub(crate) fn full(&self, cos: f32, roughness: f32) -> f32 {
        let (r, fr) = node(roughness, ROUGHNESSES);
        let (c, fc) = node(cos.sqrt(), COSINES);
        let (a, b) = (&self.full[r], &self.full[r + 1]);
        mix(mix(a[c], a[c + 1], fc), mix(b[c], b[c + 1], fc), fr)
    }

    /// Cosine-weighted mean of [`Tables::full`] over the hemisphere.
    pub(crate) fn full_average(&self, roughness: f32) -> f32 {
        let (r, fr) = node(roughness, ROUGHNESSES);
        mix(self.full_average[r], self.full_average[r + 1], fr)
    }

    /// One bounce at a dielectric, from a direction outside or inside.
    pub(crate) fn bounce(&self, inside: bool, contrast: f32, cos: f32, roughness: f32) -> Bounce {
        let (r, fr) = node(roughness, ROUGHNESSES);
        let (c, fc) = node(cos.sqrt(), COSINES);
        over_contrast(contrast, |i| {
            let side = &self.bounces[usize::from(inside)][i];
            let (a, b) = (&side[r], &side[r + 1]);
            a[c].lerp(a[c + 1], fc).lerp(b[c].lerp(b[c + 1], fc), fr)
        })
    }

    /// Cosine-weighted mean of [`Tables::bounce`] over the hemisphere.
    pub(crate) fn bounce_average(&self, inside: bool, contrast: f32, roughness: f32) -> Bounce {
        let (r, fr) = node(roughness, ROUGHNESSES);
        over_contrast(contrast, |i| {
            let side = &self.bounce_averages[usize::from(inside)][i];
            side[r].lerp(side[r + 1], fr)
        })
    }

    /// Appends all nodes, rows of the cosine last.
    pub(crate) fn put(&self, words: &mut Words) {
        self.full.iter().for_each(|row| words.f32s(row));
        words.f32s(&self.full_average);
        let mut put = |bounce: &Bounce| words.f32s(&[bounce.rise, bounce.loss]);
        self.bounces.iter().flatten().flatten().flatten().for_each(&mut put);
        self.bounce_averages.iter().flatten().flatten().for_each(&mut put);
    }

    fn new() -> Self {
        let mut full = [[0.0; COSINES]; ROUGHNESSES];
        let empty = || vec![[[Bounce::default(); COSINES]; ROUGHNESSES]; INDICES];
        let mut bounces = [empty(), empty()];
        for r in 0..ROUGHNESSES {
            for c in 0..COSINES {
                let cell = Cell::new(r, c);
                full[r][c] = cell.full();
                for (inside, side) in bounces.iter_mut().enumerate() {
                    for (i, table) in side.iter_mut().enumerate() {
                        table[r][c] = cell.bounce(eta_of(i, inside == 1));
                    }
                }
            }
        }
        let full_average = std::array::from_fn(|r| average(|cos| interpolate(&full[r], cos, mix)));
        let averages = |side: &Vec<[Row<Bounce>; ROUGHNESSES]>| side.iter().map(average_bounces).collect();
        let bounce_averages = [averages(&bounces[0]), averages(&bounces[1])];
        Self { full, full_average, bounces, bounce_averages }
    }
}

fn over_contrast(contrast: f32, at: impl Fn(usize) -> Bounce) -> Bounce {
    let (i, fi) = node(contrast * (1.0 / LARGEST_CONTRAST), INDICES);
    at(i).lerp(at(i + 1), fi)
}

/// Index of the far side over the near side at a node of the contrast axis.
fn eta_of(index: usize, inside: bool) -> f32 {
    let q = LARGEST_CONTRAST * index as f32 / (INDICES - 1) as f32;
    let ior = (1.0 + q) / (1.0 - q);
    if inside { 1.0 / ior } else { ior }
}

fn average_bounces(rows: &[Row<Bounce>; ROUGHNESSES]) -> [Bounce; ROUGHNESSES] {
    std::array::from_fn(|r| {
        let of = |pick: fn(&Bounce) -> f32| average(|cos| pick(&interpolate(&rows[r], cos, Bounce::lerp)));
        Bounce { rise: of(|b| b.rise), loss: of(|b| b.loss) }
    })
}

fn interpolate<T: Copy>(row: &Row<T>, cos: f32, mix: impl Fn(T, T, f32) -> T) -> T {
    let (c, fc) = node(cos.sqrt(), COSINES);
    mix(row[c], row[c + 1], fc)
}

/// `2 * integral of f(cos) * cos` over [0, 1], with the axis's own spacing.
fn average(f: impl Fn(f32) -> f32) -> f32 {
    const STEPS: usize = 16 * (COSINES - 1);
    let mut sum = 0.0;
    for i in 0..STEPS {
        let x = (i as f32 + 0.5) / STEPS as f32;
        sum += 4.0 * x * x * x * f(x * x);
    }
    sum / STEPS as f32
}

/// The node below `x` in [0, 1] and the fraction beyond it.
fn node(x: f32, nodes: usize) -> (usize, f32) {
    let t = x.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let i = (t as usize).min(nodes - 2);
    (i, t - i as f32)
}

fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// A microfacet as seen from one direction, and the share of its reflection that is not shadowed.
struct Microfacet {
    normal: Vec3,
    cos: f32,
    reflected: f32,
}

/// Quadrature for one direction and one roughness.
struct Cell {
    ggx: Ggx,
    wo: Vec3,
    few: Vec<Microfacet>,
}

impl Cell {
    fn new(r: usize, c: usize) -> Self {
        let x = c as f32 / (COSINES - 1) as f32;
        let cos = (x * x).max(1e-4);
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let ggx = Ggx::new(r as f32 / (ROUGHNESSES - 1) as f32, 0.0);
        let mut cell = Self { ggx, wo, few: Vec::new() };
        cell.few = cell.microfacets(SAMPLES / 4);
        cell
    }

    /// Visible microfacets; half the angles are enough, the other half is their mirror image.
    fn microfacets(&self, n: u32) -> Vec<Microfacet> {
        if self.ggx.is_delta() {
            return vec![Microfacet { normal: Vec3::Z, cos: self.wo.z, reflected: 1.0 }];
        }
        let at = |i: u32| {
            let u = Vec2::new(0.5 * (i as f32 + 0.5) / n as f32, sobol::to_unit(i));
            let normal = self.ggx.sample(self.wo, u);
            let cos = self.wo.dot(normal);
            let wi = normal * (2.0 * cos) - self.wo;
            let reflected = if wi.z > 0.0 { self.ggx.unshadowed(self.wo, wi) } else { 0.0 };
            Microfacet { normal, cos, reflected }
        };
        (0..n).map(at).collect()
    }

    fn full(&self) -> f32 {
        let all = self.microfacets(SAMPLES);
        all.iter().map(|m| m.reflected).sum::<f32>() / all.len() as f32
    }

    fn bounce(&self, eta: f32) -> Bounce {
        let f0 = fresnel::dielectric_f0(eta);
        let (mut rise, mut kept) = (0.0, 0.0);
        for m in &self.few {
            let f = fresnel::dielectric(m.cos, eta);
            rise += m.reflected * ((f - f0) / (1.0 - f0)).max(0.0);
            kept += m.reflected * f + (1.0 - f) * self.refracted(m, eta);
        }
        let n = self.few.len() as f32;
        Bounce { rise: rise / n, loss: (1.0 - kept / n).max(0.0) }
    }

    fn refracted(&self, m: &Microfacet, eta: f32) -> f32 {
        match fresnel::refract(self.wo, m.normal, eta) {
            Some(_) if self.ggx.is_delta() => 1.0,
            Some(wi) if wi.z < 0.0 => self.ggx.unshadowed(self.wo, wi),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Rng;

    /// Share of light reflected, by drawing microfacets at random.
    fn brute_force(cos: f32, roughness: f32, mut weight: impl FnMut(f32) -> f32) -> f32 {
        let ggx = Ggx::new(roughness, 0.0);
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let mut rng = Rng::new(3);
        let n = 40_000;
        let mut sum = 0.0;
        for _ in 0..n {
            let h = ggx.sample(wo, rng.next_2d());
            let wi = h * (2.0 * wo.dot(h)) - wo;
            if wi.z > 0.0 {
                sum += ggx.unshadowed(wo, wi) * weight(wo.dot(h));
            }
        }
        sum / n as f32
    }

    #[test]
    fn tables_equal_brute_force_between_nodes() {
        for (cos, roughness, ior) in [(0.9, 0.33, 1.5), (0.3, 0.7, 1.33), (0.1, 0.95, 2.4), (0.55, 0.5, 1.8)]
        {
            let full = brute_force(cos, roughness, |_| 1.0);
            assert!((tables().full(cos, roughness) - full).abs() < 4e-3, "{cos} {roughness}");
            let f0 = fresnel::dielectric_f0(ior);
            let rise = brute_force(cos, roughness, |c| (fresnel::dielectric(c, ior) - f0) / (1.0 - f0));
            let found = tables().bounce(false, contrast(ior), cos, roughness).rise;
            assert!((found - rise).abs() < 1e-2, "{cos} {roughness} {ior}: {found} {rise}");
        }
    }

    #[test]
    fn a_mirror_loses_nothing_and_roughness_loses_more() {
        assert!((tables().full(0.3, 0.0) - 1.0).abs() < 1e-5);
        assert!(tables().bounce(true, contrast(1.5), 0.5, 0.0).loss < 1e-5);
        let losses: Vec<f32> = (1..=10).map(|i| 1.0 - tables().full_average(0.1 * i as f32)).collect();
        assert!(losses.windows(2).all(|w| w[0] < w[1] + 1e-4), "{losses:?}");
        assert!(losses[9] > 0.4 && losses[9] < 0.7, "{losses:?}");
    }
}
