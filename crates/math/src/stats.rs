//! Statistics for tests: chi-square of samplers against their densities.

use crate::rng::hash_words;
use glam::Vec3;
use std::f64::consts::{PI, TAU};

/// What a chi-square test found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChiSquare {
    /// Probability of a deviation at least as large, if the counts follow the expectation.
    pub p: f64,
    /// The statistic.
    pub statistic: f64,
    /// Degrees of freedom.
    pub freedom: usize,
}

/// Compares counts with expected counts (any total: both are expected to have the same). Cells that expect fewer than
/// 5 are pooled; a count where nothing is expected gives p = 0.
#[must_use]
pub fn chi_square(observed: &[f64], expected: &[f64]) -> ChiSquare {
    let (mut statistic, mut cells) = (0.0, 0_usize);
    let (mut pooled_observed, mut pooled_expected) = (0.0, 0.0);
    for (&o, &e) in observed.iter().zip(expected) {
        if e < 5.0 {
            pooled_observed += o;
            pooled_expected += e;
        } else {
            statistic += (o - e) * (o - e) / e;
            cells += 1;
        }
    }
    if pooled_expected >= 1.0 {
        statistic += (pooled_observed - pooled_expected).powi(2) / pooled_expected;
        cells += 1;
    } else if pooled_observed > 10.0 + 10.0 * pooled_expected {
        statistic = f64::INFINITY;
    }
    let freedom = cells.saturating_sub(1);
    let p = if statistic.is_finite() { upper_gamma(freedom as f64 * 0.5, statistic * 0.5) } else { 0.0 };
    ChiSquare { p, statistic, freedom }
}

/// What [`sphere_chi_square`] found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereTest {
    /// Probability of a deviation at least as large, if the sampler follows its density.
    pub p: f64,
    /// Integral of the density over the sphere; at most 1 (less where the sampler may fail).
    pub density_integral: f64,
    /// The underlying test.
    pub chi_square: ChiSquare,
}

/// Resolution of [`sphere_chi_square_with`].
#[derive(Clone, Copy, Debug)]
pub struct SphereGrid {
    /// Cells along z (equal heights, so equal solid angles).
    pub rows: usize,
    /// Cells around z.
    pub columns: usize,
    /// The density is evaluated at `quadrature`^2 points of each cell.
    pub quadrature: usize,
}

impl Default for SphereGrid {
    fn default() -> Self {
        Self { rows: 20, columns: 40, quadrature: 16 }
    }
}

/// Compares `n` directions with their density over solid angle on a grid of 20 x 40 cells around z.
///
/// `sample(i)` may fail; the failures are compared with what the density's integral lacks to 1.
pub fn sphere_chi_square(
    n: u32,
    sample: impl FnMut(u32) -> Option<Vec3>,
    density: impl Fn(Vec3) -> f32,
) -> SphereTest {
    sphere_chi_square_with(SphereGrid::default(), n, sample, density)
}

/// [`sphere_chi_square`] on a grid of the caller's choice.
pub fn sphere_chi_square_with(
    grid: SphereGrid,
    n: u32,
    mut sample: impl FnMut(u32) -> Option<Vec3>,
    density: impl Fn(Vec3) -> f32,
) -> SphereTest {
    let cells = grid.rows * grid.columns;
    let mut observed = vec![0.0; cells + 1];
    for i in 0..n {
        observed[sample(i).map_or(cells, |d| grid.cell(d))] += 1.0;
    }
    let mut expected: Vec<f64> = (0..cells).map(|c| grid.integrate(c, &density)).collect();
    let density_integral: f64 = expected.iter().sum();
    expected.iter_mut().for_each(|e| *e *= f64::from(n));
    // The quadrature's own error must not look like failures.
    let failed = if observed[cells] == 0.0 { 0.0 } else { (1.0 - density_integral).max(0.0) };
    expected.push(failed * f64::from(n));
    let chi_square = chi_square(&observed, &expected);
    SphereTest { p: chi_square.p, density_integral, chi_square }
}

impl SphereGrid {
    fn cell(&self, d: Vec3) -> usize {
        let row = ((f64::from(d.z) + 1.0) * 0.5 * self.rows as f64) as usize;
        let turn = f64::from(d.y).atan2(f64::from(d.x)) / TAU;
        let column = (turn.rem_euclid(1.0) * self.columns as f64) as usize;
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }

    /// The density's integral over a cell: jittered points, so that edges of the density do not align with them.
    fn integrate(&self, cell: usize, density: impl Fn(Vec3) -> f32) -> f64 {
        let (row, column) = ((cell / self.columns) as f64, (cell % self.columns) as f64);
        let q = self.quadrature;
        let mut sum = 0.0;
        for i in 0..q * q {
            let jitter = hash_words(&[cell as u32, i as u32]);
            let unit = |bits: u64| (bits & 0xffff) as f64 / 65_536.0;
            let a = ((i % q) as f64 + unit(jitter)) / q as f64;
            let b = ((i / q) as f64 + unit(jitter >> 16)) / q as f64;
            let z = (row + b) / self.rows as f64 * 2.0 - 1.0;
            let phi = (column + a) / self.columns as f64 * TAU;
            let r = (1.0 - z * z).sqrt();
            let d = Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32);
            sum += f64::from(density(d));
        }
        sum / (q * q) as f64 * (4.0 * PI / (self.rows * self.columns) as f64)
    }
}

/// The regularised upper incomplete gamma function Q(a, x), by its series or continued fraction.
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 || a <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-15 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        (1.0 - sum * scale).clamp(0.0, 1.0)
    } else {
        // Lentz's method.
        let mut b = x + 1.0 - a;
        let mut c = 1e300;
        let mut d = 1.0 / b;
        let mut h = d;
        for i in 1..10_000 {
            let an = -f64::from(i) * (f64::from(i) - a);
            b += 2.0;
            d = 1.0 / (an * d + b);
            c = b + an / c;
            h *= d * c;
            if (d * c - 1.0).abs() < 1e-14 {
                break;
            }
        }
        (scale * h).clamp(0.0, 1.0)
    }
}

/// ln of the gamma function for x > 0: Stirling's series after shifting x beyond 10.
fn ln_gamma(x: f64) -> f64 {
    let mut shift = 0.0;
    let mut x = x;
    while x < 10.0 {
        shift += x.ln();
        x += 1.0;
    }
    let r = 1.0 / (x * x);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * TAU.ln() + series - shift
}

/// Mean and variance of the mean of a series of numbers.
#[must_use]
pub fn mean_and_variance(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut mean, mut square) = (0.0, 0.0, 0.0);
    for value in values {
        n += 1.0;
        let delta: f64 = value - mean;
        mean += delta / n;
        square += delta * (value - mean);
    }
    (mean, square / (n * (n - 1.0_f64).max(1.0)).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tail_probabilities_equal_tabulated_ones() {
        // 5 % and 0.1 % points of the chi-square distribution.
        for (freedom, x, p) in [(1.0, 3.841_459, 0.05), (10.0, 18.307_04, 0.05), (100.0, 149.449, 0.001)] {
            assert!((upper_gamma(freedom / 2.0, x / 2.0) / p - 1.0).abs() < 1e-4, "{freedom}");
        }
        assert!((ln_gamma(0.5) - PI.sqrt().ln()).abs() < 1e-12);
        assert!((ln_gamma(11.0) - 3_628_800.0_f64.ln()).abs() < 1e-12);
    }

    #[test]
    fn wrong_counts_fail_and_right_ones_pass() {
        assert!(chi_square(&[100.0, 110.0, 95.0], &[100.0, 100.0, 105.0]).p > 0.1);
        assert!(chi_square(&[100.0, 200.0], &[150.0, 150.0]).p < 1e-6);
        assert_eq!(chi_square(&[100.0, 50.0], &[150.0, 0.0]).p, 0.0);
    }

    #[test]
    fn moments() {
        let (mean, variance) = mean_and_variance([1.0, 2.0, 3.0, 4.0]);
        assert!((mean - 2.5).abs() < 1e-12 && (variance - 5.0 / 12.0).abs() < 1e-12);
    }
}
