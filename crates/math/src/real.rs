//! Real functions with the same bits on every platform: range reduction and polynomials in plain f32 arithmetic.
//!
//! The coefficients are those of S. Moshier's Cephes library (single precision). Errors are a few units in the last
//! place inside the stated domains, and every function is total: no input makes it panic.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, LN_2, LOG2_E, PI};

/// 1.5 * 2^23. Its sum with a number below 2^22 has no room for a fraction.
const NO_FRACTION: f32 = 12_582_912.0;

/// `x` rounded to the nearest integer, ties to even, for |x| < 2^22; with the last bits of that integer.
#[inline(always)]
fn nearest(x: f32) -> (f32, u32) {
    let shifted = x + NO_FRACTION;
    (shifted - NO_FRACTION, shifted.to_bits())
}

/// `a` and `b`, exchanged if `mask` is all ones instead of zero. For decisions that cannot be foretold: no branch.
#[inline(always)]
pub(crate) fn exchange(a: f32, b: f32, mask: u32) -> (f32, f32) {
    let (a, b) = (a.to_bits(), b.to_bits());
    let flip = (a ^ b) & mask;
    (f32::from_bits(a ^ flip), f32::from_bits(b ^ flip))
}

/// Sine and cosine of `x` in radians; accurate for |x| up to about 8000, which any angle in a renderer is.
#[inline(always)]
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let (quarter, quarter_bits) = nearest(x * (2.0 / PI));
    // pi/2 in three parts, so that the reduction is exact to f32.
    let r = ((x - quarter * 1.570_312_5) - quarter * 4.837_513e-4) - quarter * 7.549_79e-8;
    let z = r * r;
    let sin = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * r + r;
    let cos = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    let (sin, cos) = exchange(sin, cos, (quarter_bits & 1).wrapping_neg());
    let sin_sign = (quarter_bits & 2) << 30;
    let cos_sign = (quarter_bits.wrapping_add(1) & 2) << 30;
    (f32::from_bits(sin.to_bits() ^ sin_sign), f32::from_bits(cos.to_bits() ^ cos_sign))
}

/// Sine of `x` radians. See [`sin_cos`].
#[inline]
#[must_use]
pub fn sin(x: f32) -> f32 {
    sin_cos(x).0
}

/// Cosine of `x` radians. See [`sin_cos`].
#[inline]
#[must_use]
pub fn cos(x: f32) -> f32 {
    sin_cos(x).1
}

/// Tangent of `x` radians. See [`sin_cos`].
#[inline]
#[must_use]
pub fn tan(x: f32) -> f32 {
    let (s, c) = sin_cos(x);
    s / c
}

/// e to the power `x`; 0 below about -87, infinity above about 88.7.
#[inline]
#[must_use]
pub fn exp(x: f32) -> f32 {
    if x.is_nan() {
        return x;
    }
    if x > 88.72 {
        return f32::INFINITY;
    }
    if x < -87.3 {
        return 0.0;
    }
    let (n, _) = nearest(x * LOG2_E);
    let r = (x - n * 0.693_359_4) + n * 2.121_944_4e-4;
    let p = ((((1.987_569_1e-4 * r + 1.398_199_9e-3) * r + 8.333_452e-3) * r + 4.166_579_6e-2) * r
        + 1.666_666_5e-1)
        * r
        + 0.5;
    let mantissa = p * r * r + r + 1.0;
    // In two steps: 2^128 is not representable, half of it is.
    let half = n as i32 / 2;
    mantissa * power_of_two(half) * power_of_two(n as i32 - half)
}

/// 2^n for |n| <= 126.
fn power_of_two(n: i32) -> f32 {
    f32::from_bits(((n + 127) as u32) << 23)
}

/// Natural logarithm; minus infinity at 0, NaN below.
#[inline]
#[must_use]
pub fn ln(x: f32) -> f32 {
    if x.is_nan() || x < 0.0 {
        return f32::NAN;
    }
    if x == 0.0 {
        return f32::NEG_INFINITY;
    }
    if x == f32::INFINITY {
        return x;
    }
    let (x, shift) = if x < f32::MIN_POSITIVE { (x * 8_388_608.0, -23.0) } else { (x, 0.0) };
    let bits = x.to_bits();
    let mut exponent = ((bits >> 23) as i32 - 126) as f32 + shift;
    let mut m = f32::from_bits((bits & 0x007f_ffff) | 0x3f00_0000);
    if m < std::f32::consts::FRAC_1_SQRT_2 {
        exponent -= 1.0;
        m += m;
    }
    m -= 1.0;
    let z = m * m;
    let mut p = 7.037_683_6e-2_f32;
    for c in [
        -1.151_461e-1,
        1.167_699_9e-1,
        -1.242_014_1e-1,
        1.424_932_3e-1,
        -1.666_805_8e-1,
        2.000_071_5e-1,
        -2.499_999_4e-1,
        3.333_333e-1,
    ] {
        p = p * m + c;
    }
    (m * z * p - exponent * 2.121_944_4e-4 - 0.5 * z) + m + exponent * 0.693_359_4
}

/// `x` to the power `y` for `x >= 0`; 0 at `x = 0` unless `y` is 0.
#[inline]
#[must_use]
pub fn pow(x: f32, y: f32) -> f32 {
    if y == 0.0 || x == 1.0 {
        1.0
    } else if x <= 0.0 {
        0.0
    } else {
        exp(y * ln(x))
    }
}

/// 2 to the power `x`.
#[inline]
#[must_use]
pub fn exp2(x: f32) -> f32 {
    exp(x * LN_2)
}

/// Arcsine in radians; the argument is clamped to [-1, 1].
#[inline]
#[must_use]
pub fn asin(x: f32) -> f32 {
    let a = x.abs().min(1.0);
    let large = a > 0.5;
    let (z, r) = if large {
        let z = 0.5 * (1.0 - a);
        (z, z.sqrt())
    } else {
        (a * a, a)
    };
    let p = ((((4.216_32e-2 * z + 2.418_131e-2) * z + 4.547_002_5e-2) * z + 7.495_300_3e-2) * z
        + 1.666_675_2e-1)
        * z
        * r
        + r;
    let value = if large { FRAC_PI_2 - 2.0 * p } else { p };
    value.copysign(x)
}

/// Arccosine in radians; the argument is clamped to [-1, 1].
#[inline]
#[must_use]
pub fn acos(x: f32) -> f32 {
    if x > 0.5 {
        2.0 * asin((0.5 * (1.0 - x)).max(0.0).sqrt())
    } else if x < -0.5 {
        PI - 2.0 * asin((0.5 * (1.0 + x)).max(0.0).sqrt())
    } else {
        FRAC_PI_2 - asin(x)
    }
}

/// Arctangent in radians.
#[inline(always)]
#[must_use]
pub fn atan(x: f32) -> f32 {
    let a = x.abs();
    // One division for all, without branches.
    let (large, small) = (a > 2.414_213_7, a <= 0.414_213_57);
    let base = if large { FRAC_PI_2 } else { FRAC_PI_4 };
    let base = if small { 0.0 } else { base };
    let (dividend, divisor) = if large { (-1.0, a) } else { (a - 1.0, a + 1.0) };
    let (dividend, divisor) = if small { (a, 1.0) } else { (dividend, divisor) };
    let r = dividend / divisor;
    let z = r * r;
    let p = (((8.053_744_5e-2 * z - 1.387_768_5e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1) * z * r + r;
    (base + p).copysign(x)
}

/// Angle of the point (x, y) in radians, in [-pi, pi]; 0 at the origin.
#[inline(always)]
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    let flat = x.abs() >= y.abs();
    let (dividend, divisor) = if flat { (y, x) } else { (x, y) };
    let a = atan(dividend / divisor);
    let left = if x > 0.0 { a } else { a + PI.copysign(y) };
    let angle = if flat { left } else { FRAC_PI_2.copysign(y) - a };
    if (x == 0.0) & (y == 0.0) { 0.0 } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error of `f` against `exact`, relative to `max(1, |exact|)`, over `n` points of [lo, hi].
    fn worst(f: fn(f32) -> f32, exact: fn(f64) -> f64, lo: f32, hi: f32) -> f64 {
        (0..=100_000)
            .map(|i| {
                let x = lo + (hi - lo) * i as f32 / 100_000.0;
                let e = exact(f64::from(x));
                (f64::from(f(x)) - e).abs() / e.abs().max(1.0)
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn functions_agree_with_double_precision() {
        assert!(worst(sin, f64::sin, -100.0, 100.0) < 2e-7);
        assert!(worst(cos, f64::cos, -100.0, 100.0) < 2e-7);
        assert!(worst(exp, f64::exp, -80.0, 80.0) < 3e-7);
        assert!(worst(ln, f64::ln, 1e-6, 1e6) < 3e-7);
        assert!(worst(asin, f64::asin, -1.0, 1.0) < 4e-7);
        assert!(worst(acos, f64::acos, -1.0, 1.0) < 4e-7);
        assert!(worst(atan, f64::atan, -50.0, 50.0) < 3e-7);
    }

    #[test]
    fn atan2_covers_the_circle() {
        for i in 0..10_000 {
            let a = (f64::from(i) / 5000.0 - 1.0) * 3.1;
            let (s, c) = a.sin_cos();
            assert!((f64::from(atan2(s as f32, c as f32)) - a).abs() < 1e-6, "{a}");
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
    }

    #[test]
    fn edges_are_total() {
        assert_eq!(exp(-1000.0), 0.0);
        assert_eq!(exp(1000.0), f32::INFINITY);
        assert_eq!(ln(0.0), f32::NEG_INFINITY);
        assert!(ln(-1.0).is_nan() && exp(f32::NAN).is_nan());
        assert!((exp(88.5) / 2.723_088_2e38 - 1.0).abs() < 1e-5);
        assert!((ln(1e-40) + 92.103_4).abs() < 1e-3);
        assert_eq!((pow(0.0, 2.0), pow(0.0, 0.0), pow(1.0, 1e9)), (0.0, 1.0, 1.0));
        assert!((pow(2.0, 10.0) - 1024.0).abs() < 1e-2);
    }
}
