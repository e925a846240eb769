//! Roots of polynomials of degree 6 in Bernstein's form.
//!
//! A polynomial on an interval lies within the hull of its coefficients and has at most as many roots as they change
//! their sign: none means no root, one means one. What has more is cut in half (J. Lane and R. Riesenfeld 1981, "Bounds on a
//! polynomial"). So no root is passed over.

use super::root::bracketed;
use std::ops::ControlFlow;

/// Coefficients on an interval.
pub(super) type Coefficients = [f64; 7];

/// Halvings after which two roots count as none, and a change of sign as one.
const MOST_CUTS: u32 = 32;

/// The cube of a quadratic polynomial in Bernstein's form.
pub(super) fn cube([a, b, c]: [f64; 3]) -> Coefficients {
    let square = [a * a, a * b, (a * c + 2.0 * b * b) / 3.0, b * c, c * c];
    let [q0, q1, q2, q3, q4] = square;
    [
        q0 * a,
        (q0 * b + 2.0 * q1 * a) / 3.0,
        (q0 * c + 8.0 * q1 * b + 6.0 * q2 * a) / 15.0,
        (q1 * c + 3.0 * q2 * b + q3 * a) / 5.0,
        (6.0 * q2 * c + 8.0 * q3 * b + q4 * a) / 15.0,
        (2.0 * q3 * c + q4 * b) / 3.0,
        q4 * c,
    ]
}

/// Changes of sign, 0 being positive.
fn variations(coefficients: &Coefficients) -> usize {
    coefficients.windows(2).filter(|pair| (pair[0] >= 0.0) != (pair[1] >= 0.0)).count()
}

/// Both halves, by de Casteljau's scheme.
fn halves(coefficients: &Coefficients) -> [Coefficients; 2] {
    let (mut row, mut low, mut high) = (*coefficients, [0.0; 7], [0.0; 7]);
    for level in 0..7 {
        (low[level], high[6 - level]) = (row[0], row[6 - level]);
        for i in 0..6 - level {
            row[i] = 0.5 * (row[i] + row[i + 1]);
        }
    }
    [low, high]
}

/// Value and slope at `x` of the unit interval.
fn evaluate(coefficients: &Coefficients, x: f64) -> (f64, f64) {
    let mut row = *coefficients;
    for level in 1..6 {
        for i in 0..7 - level {
            row[i] += x * (row[i + 1] - row[i]);
        }
    }
    let slope = row[1] - row[0];
    (row[0] + x * slope, 6.0 * slope)
}

/// Tells `visit` the roots in the unit interval at which the sign changes, in order, to `tolerance`.
pub(super) fn roots(
    coefficients: &Coefficients,
    tolerance: f64,
    visit: &mut impl FnMut(f64) -> ControlFlow<()>,
) -> ControlFlow<()> {
    between(coefficients, (0.0, 1.0), MOST_CUTS, tolerance, visit)
}

fn between(
    coefficients: &Coefficients,
    (low, high): (f64, f64),
    cuts: u32,
    tolerance: f64,
    visit: &mut impl FnMut(f64) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let [first, .., last] = *coefficients;
    match variations(coefficients) {
        0 => ControlFlow::Continue(()),
        1 => {
            let width = high - low;
            let function = |x| evaluate(coefficients, x);
            visit(low + width * bracketed(function, (0.0, 1.0), first >= 0.0, tolerance / width))
        }
        _ if cuts == 0 || high - low <= tolerance => {
            if (first >= 0.0) == (last >= 0.0) {
                ControlFlow::Continue(())
            } else {
                visit(0.5 * (low + high))
            }
        }
        _ => {
            let ([left, right], middle) = (halves(coefficients), 0.5 * (low + high));
            between(&left, (low, middle), cuts - 1, tolerance, visit)?;
            between(&right, (middle, high), cuts - 1, tolerance, visit)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coefficients of a product of six factors `x - root`, by polar forms: symmetric in the arguments, so each is a mean over
    /// orders of the product.
    fn product(factors: [f64; 6]) -> Coefficients {
        let mut coefficients = [0.0; 7];
        for (ones, coefficient) in coefficients.iter_mut().enumerate() {
            let chosen = (0..64_u32).filter(|bits| bits.count_ones() as usize == ones);
            let term = |bits: u32| -> f64 { (0..6).map(|i| f64::from(bits >> i & 1) - factors[i]).product() };
            let terms: Vec<f64> = chosen.map(term).collect();
            *coefficient = terms.iter().sum::<f64>() / terms.len() as f64;
        }
        coefficients
    }

    fn found(coefficients: &Coefficients) -> Vec<f64> {
        let mut all = Vec::new();
        let _ = roots(coefficients, 1e-12, &mut |x| {
            all.push(x);
            ControlFlow::Continue(())
        });
        all
    }

    #[test]
    fn all_roots_are_found_in_order() {
        let cases: [&[f64]; 5] =
            [&[0.5], &[0.1, 0.100_001], &[0.2, 0.3, 0.4, 0.5], &[0.0001, 0.5, 0.9999], &[]];
        for case in cases {
            let mut factors = [1.5, -0.7, 2.0, -3.0, 1.1, -0.2];
            factors[..case.len()].copy_from_slice(case);
            let found = found(&product(factors));
            assert_eq!(found.len(), case.len(), "{case:?}: {found:?}");
            assert!(found.iter().zip(case).all(|(a, b)| (a - b).abs() < 1e-8), "{case:?}: {found:?}");
        }
        // The negative control: roots that touch but do not cross are none, and coefficients of another polynomial are others.
        assert!(found(&product([0.5, 0.5, 2.0, 3.0, 4.0, 5.0])).len() != 1);
        let mut other = product([0.5, -1.0, 2.0, 3.0, 4.0, 5.0]);
        other[6] = -other[6];
        assert_ne!(found(&other).len(), 1);
    }

    #[test]
    fn cubes_are_cubes() {
        let quadratic = |[a, b, c]: [f64; 3], x: f64| {
            let y = 1.0 - x;
            a * y * y + 2.0 * b * x * y + c * x * x
        };
        for i in 0..50 {
            let at = |step: f64| (f64::from(i) * step).fract() * 2.0 - 1.0;
            let coefficients = [at(0.37), at(0.71), at(0.13)];
            let x = at(0.59).abs();
            let (value, slope) = evaluate(&cube(coefficients), x);
            assert!((value - quadratic(coefficients, x).powi(3)).abs() < 1e-12);
            let h = 1e-6;
            let there = |x: f64| quadratic(coefficients, x).powi(3);
            assert!((slope - (there(x + h) - there(x - h)) / (2.0 * h)).abs() < 1e-6);
        }
    }
}
