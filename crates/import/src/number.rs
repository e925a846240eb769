//! Numbers in text: correctly rounded and fast.
//!
//! Decimal numbers with at most 19 digits and small exponents go through one exact f64 operation (Clinger, "How to read
//! floating point numbers accurately", 1990); the rare rest, and results too near to the middle between two f32, go
//! through the standard library.

/// 10^0 to 10^22 are exact in f64.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The number that the whole of `token` writes, or `None`. Accepts what C's `strtof` accepts in decimal: signs,
/// fractions, exponents, `inf`, `nan`.
pub(crate) fn parse_f32(token: &[u8]) -> Option<f32> {
    fast_f64(token).and_then(round_safely).or_else(|| slow(token))
}

/// The integer that the whole of `token` writes, or `None`.
pub(crate) fn parse_i64(token: &[u8]) -> Option<i64> {
    let (negative, digits) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, token),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0_i64;
    for &c in digits {
        let digit = c.wrapping_sub(b'0');
        if digit > 9 {
            return None;
        }
        value = value * 10 + i64::from(digit);
    }
    Some(if negative { -value } else { value })
}

fn slow(token: &[u8]) -> Option<f32> {
    let text = std::str::from_utf8(token).ok()?;
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    // What the C runtimes of old exporters print: "nan(ind)", "-nan", "1.#QNAN", "1.#INF", "-1.#IND".
    let lower = text.to_ascii_lowercase();
    let unsigned = lower.trim_start_matches(['+', '-']);
    if unsigned.starts_with("nan") || unsigned.contains("#qnan") || unsigned.contains("#ind") {
        return Some(f32::NAN);
    }
    unsigned.contains("#inf").then_some(if lower.starts_with('-') {
        f32::NEG_INFINITY
    } else {
        f32::INFINITY
    })
}

/// Rounds to f32 unless `value` lies so near to a midpoint that rounding twice could differ from rounding once.
fn round_safely(value: f64) -> Option<f32> {
    const DROPPED: u64 = (1 << 29) - 1;
    const MIDDLE: u64 = 1 << 28;
    let distance = (value.to_bits() & DROPPED).abs_diff(MIDDLE);
    let magnitude = value.abs();
    let normal = value == 0.0 || (1.2e-38..3.4e38).contains(&magnitude);
    (distance > 1 && normal).then_some(value as f32)
}

/// Exact up to one correctly rounded operation, or `None` where that is not possible.
fn fast_f64(token: &[u8]) -> Option<f64> {
    let (negative, mut rest) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, token),
    };
    let mut mantissa = 0_u64;
    let integer_digits = take_digits(&mut rest, &mut mantissa);
    let mut fraction_digits = 0;
    if let [b'.', after @ ..] = rest {
        rest = after;
        fraction_digits = take_digits(&mut rest, &mut mantissa);
    }
    let digits = integer_digits + fraction_digits;
    if digits == 0 || digits > 18 || mantissa > 1 << 53 {
        return None;
    }
    let exponent = take_exponent(rest)? - i64::try_from(fraction_digits).ok()?;
    let scale = *POWERS.get(usize::try_from(exponent.unsigned_abs()).ok()?)?;
    let value = if exponent < 0 { mantissa as f64 / scale } else { mantissa as f64 * scale };
    Some(if negative { -value } else { value })
}

#[inline]
fn take_digits(rest: &mut &[u8], mantissa: &mut u64) -> usize {
    let mut count = 0;
    while let Some(digit) = rest.get(count).map(|c| c.wrapping_sub(b'0')).filter(|&d| d <= 9) {
        *mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        count += 1;
    }
    *rest = &rest[count..];
    count
}

fn take_exponent(rest: &[u8]) -> Option<i64> {
    match rest {
        [] => Some(0),
        [b'e' | b'E', digits @ ..] => parse_i64(digits).filter(|e| e.abs() < 1000),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn odd_writings() {
        assert_eq!(parse_f32(b"-1.5e2"), Some(-150.0));
        assert_eq!(parse_f32(b"+.5"), Some(0.5));
        assert_eq!(parse_f32(b"7."), Some(7.0));
        assert_eq!(parse_f32(b"1E+03"), Some(1000.0));
        assert_eq!(parse_f32(b"-0").map(f32::to_bits), Some((-0.0_f32).to_bits()));
        assert_eq!(parse_f32(b"1e60"), Some(f32::INFINITY));
        assert!(parse_f32(b"-1.#IND").is_some_and(f32::is_nan));
        for wrong in ["", "-", ".", "1x", "1e", "e5", "--1", "1.2.3"] {
            assert_eq!(parse_f32(wrong.as_bytes()), None, "{wrong}");
        }
    }

    #[test]
    fn integers() {
        assert_eq!(parse_i64(b"-12"), Some(-12));
        assert_eq!(parse_i64(b"+3"), Some(3));
        for wrong in ["", "-", "1.0", "9999999999999999999"] {
            assert_eq!(parse_i64(wrong.as_bytes()), None, "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn same_bits_as_the_standard_library(bits in any::<u32>(), digits in 0_usize..25) {
            let value = f32::from_bits(bits);
            for text in [format!("{value}"), format!("{value:e}"), format!("{value:.digits$}")] {
                let expected: f32 = text.parse().expect("a number");
                let ours = parse_f32(text.as_bytes()).expect("a number");
                prop_assert!(ours.to_bits() == expected.to_bits() || (ours.is_nan() && expected.is_nan()), "{}", text);
            }
        }

        #[test]
        fn same_bits_for_written_decimals(mantissa in any::<u64>(), exponent in -45_i32..40, point in 0_usize..19) {
            let mut text = mantissa.to_string();
            text.insert(point.min(text.len()), '.');
            text.push_str(&format!("e{exponent}"));
            let expected: f32 = text.parse().expect("a number");
            prop_assert_eq!(parse_f32(text.as_bytes()).map(f32::to_bits), Some(expected.to_bits()));
        }

        #[test]
        fn garbage_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..12)) {
            let _ = parse_f32(&bytes);
            let _ = parse_i64(&bytes);
        }
    }
}
