//! Exact sums in fixed point.
//!
//! Float addition is not associative; integer addition is. A sample is rounded once, on its own, to a multiple of a
//! fixed unit; from then on every sum is exact, so any grouping and any order give the same bits.

use std::ops::{Add, AddAssign};

/// A sum of f32 values in units of 2^-64, 128 bits wide: for quantities of any scale (radiance, depth, position).
///
/// A value is exact where its magnitude is at least 2^-40 (or it is a multiple of 2^-64), and is limited to
/// ±[`Exact::LIMIT`]; 2^22 values at the limit fit. NaN counts as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exact(i128);

impl Exact {
    /// Largest magnitude of one value, 2^40.
    pub const LIMIT: f32 = 1_099_511_627_776.0;

    /// The sum of one value.
    #[inline]
    #[must_use]
    pub fn from_f32(x: f32) -> Self {
        let magnitude = units(x, Self::LIMIT, 64) as i128;
        Self(if x < 0.0 { -magnitude } else { magnitude })
    }

    /// The mean of `count` values; 0 for none.
    #[inline]
    #[must_use]
    pub fn mean(self, count: u32) -> f32 {
        self.mean_f64(count) as f32
    }

    /// The same in double precision.
    #[inline]
    #[must_use]
    pub fn mean_f64(self, count: u32) -> f64 {
        const UNIT: f64 = 1.0 / 18_446_744_073_709_551_616.0;
        if count == 0 { 0.0 } else { self.0 as f64 * UNIT / f64::from(count) }
    }
}

/// A sum of f32 values in units of 2^-32, 64 bits wide: for quantities around 1 (albedo, unit normals).
///
/// Values are limited to ±[`ExactUnit::LIMIT`]; 2^24 values at the limit fit. NaN counts as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExactUnit(i64);

impl ExactUnit {
    /// Largest magnitude of one value.
    pub const LIMIT: f32 = 64.0;

    /// The sum of one value.
    #[inline]
    #[must_use]
    pub fn from_f32(x: f32) -> Self {
        let magnitude = units(x, Self::LIMIT, 32) as i64;
        Self(if x < 0.0 { -magnitude } else { magnitude })
    }

    /// The mean of `count` values; 0 for none.
    #[inline]
    #[must_use]
    pub fn mean(self, count: u32) -> f32 {
        const UNIT: f64 = 1.0 / 4_294_967_296.0;
        if count == 0 { 0.0 } else { (self.0 as f64 * UNIT / f64::from(count)) as f32 }
    }
}

/// |x|, limited, in units of 2^-`unit_exponent`, rounded to nearest (halves up). NaN gives 0.
#[inline]
fn units(x: f32, limit: f32, unit_exponent: i32) -> u128 {
    if x.is_nan() {
        return 0;
    }
    let bits = x.abs().min(limit).to_bits();
    let exponent = (bits >> 23) as i32;
    let hidden = if exponent == 0 { 0 } else { 1 << 23 };
    let mantissa = u128::from(bits & 0x007f_ffff | hidden);
    // |x| = mantissa * 2^(exponent - 150), and denormals have the exponent of the smallest normal number.
    let shift = exponent.max(1) - 150 + unit_exponent;
    match shift {
        0.. => mantissa << shift,
        -25..0 => (mantissa + (1 << (-shift - 1))) >> -shift,
        _ => 0,
    }
}

macro_rules! impl_integer {
    ($sum:ident, $integer:ident) => {
        impl $sum {
            /// The sum in its unit.
            pub(crate) const fn units(self) -> $integer {
                self.0
            }

            /// A sum of so many units.
            pub(crate) const fn from_units(units: $integer) -> Self {
                Self(units)
            }
        }

        impl Add for $sum {
            type Output = Self;

            #[inline]
            fn add(self, other: Self) -> Self {
                Self(self.0.wrapping_add(other.0))
            }
        }

        impl AddAssign for $sum {
            #[inline]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }
    };
}

impl_integer!(Exact, i128);
impl_integer!(ExactUnit, i64);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn one_value_comes_back(x in -1e12_f32..1e12) {
            prop_assert_eq!(Exact::from_f32(x).mean(1), x);
        }

        #[test]
        fn small_values_come_back_to_the_unit(x in -1e-6_f32..1e-6) {
            prop_assert!((f64::from(Exact::from_f32(x).mean(1)) - f64::from(x)).abs() <= 2.8e-20);
            prop_assert!((f64::from(ExactUnit::from_f32(x).mean(1)) - f64::from(x)).abs() <= 1.2e-10);
        }

        #[test]
        fn the_sum_does_not_depend_on_order_or_grouping(
            mut values in prop::collection::vec(any::<f32>(), 1..64), cut in any::<prop::sample::Index>(),
        ) {
            let sum = |v: &[f32]| v.iter().fold(Exact::default(), |s, &x| s + Exact::from_f32(x));
            let whole = sum(&values);
            let cut = cut.index(values.len());
            prop_assert_eq!(sum(&values[cut..]) + sum(&values[..cut]), whole);
            values.sort_by(f32::total_cmp);
            prop_assert_eq!(sum(&values), whole);
        }
    }

    #[test]
    fn float_sums_fail_where_exact_sums_hold() {
        let values = [1e8_f32, 1.0, -1e8];
        let exact = values.iter().fold(Exact::default(), |s, &x| s + Exact::from_f32(x));
        assert_eq!(exact.mean(1), 1.0);
        assert_ne!(values.iter().sum::<f32>(), 1.0);
    }

    #[test]
    fn extremes_are_limited() {
        assert_eq!(Exact::from_f32(f32::NAN), Exact::default());
        assert_eq!(Exact::from_f32(f32::NEG_INFINITY).mean(1), -Exact::LIMIT);
        assert_eq!(Exact::from_f32(f32::MIN_POSITIVE), Exact::default());
        assert_eq!(ExactUnit::from_f32(f32::MAX).mean(1), ExactUnit::LIMIT);
        let many = (0..1000).fold(Exact::default(), |s, _| s + Exact::from_f32(f32::MAX));
        assert_eq!(many.mean(1000), Exact::LIMIT);
        assert_eq!(many.mean(0), 0.0);
    }
}
