// Numbers with 64 bits of mantissa, in integers, for the few places where single precision does not settle a question
// and drivers have no double precision. Results are cut off, not rounded; there are no infinities.
//#include whole_numbers

/// sign * mantissa / 2^63 * 2^exponent; the top bit of the mantissa (low word, high word) is set, but for zero.
struct WideNumber {
    negative: bool,
    exponent: i32,
    mantissa: vec2<u32>,
}

fn wide_zero() -> WideNumber {
    return WideNumber(false, 0, vec2<u32>(0u));
}

fn wide_is_zero(a: WideNumber) -> bool {
    return a.mantissa.y == 0u;
}

/// The mantissa shifted until its top bit is set.
fn wide_normal(negative: bool, exponent: i32, mantissa: vec2<u32>) -> WideNumber {
    var high = mantissa.y;
    var low = mantissa.x;
    var shift = 0u;
    if (high == 0u) {
        if (low == 0u) {
            return wide_zero();
        }
        high = low;
        low = 0u;
        shift = 32u;
    }
    let more = countLeadingZeros(high);
    return WideNumber(negative, exponent - i32(shift + more), u64_shifted_left(vec2<u32>(low, high), more));
}

fn wide_of(x: f32) -> WideNumber {
    let bits = bitcast<u32>(x);
    let exponent = (bits >> 23u) & 255u;
    if (exponent == 0u) {
        return wide_zero();
    }
    let mantissa = (bits << 8u) | 0x80000000u;
    return WideNumber(bits >= 0x80000000u, i32(exponent) - 127, vec2<u32>(0u, mantissa));
}

/// The f32 next to it towards zero; zero and the largest f32 for what is beyond them.
fn wide_to_f32(a: WideNumber) -> f32 {
    if (wide_is_zero(a) || a.exponent < -126) {
        return 0.0;
    }
    let exponent = u32(min(a.exponent, 127) + 127);
    let bits = (exponent << 23u) | ((a.mantissa.y >> 8u) & 0x7fffffu);
    return bitcast<f32>(bits | select(0u, 0x80000000u, a.negative));
}

fn wide_product(a: WideNumber, b: WideNumber) -> WideNumber {
    if (wide_is_zero(a) || wide_is_zero(b)) {
        return wide_zero();
    }
    let top = u64_of_words(a.mantissa.y, b.mantissa.y);
    let left = u64_of_words(a.mantissa.y, b.mantissa.x);
    let right = u64_of_words(a.mantissa.x, b.mantissa.y);
    let carry = u32(left.x + right.x < left.x);
    let rest = u64_sum(u64_sum(vec2<u32>(left.y, 0u), vec2<u32>(right.y, 0u)), vec2<u32>(carry, 0u));
    let mantissa = u64_sum(top, rest);
    return wide_normal(a.negative != b.negative, a.exponent + b.exponent + 1, mantissa);
}

/// The mantissa shifted to the right.
fn wide_shifted(mantissa: vec2<u32>, by: u32) -> vec2<u32> {
    if (by >= 64u) {
        return vec2<u32>(0u);
    }
    return u64_shifted_right(mantissa, by);
}

/// Whether |a| < |b|.
fn wide_is_less(a: WideNumber, b: WideNumber) -> bool {
    if (wide_is_zero(a) || wide_is_zero(b)) {
        return !wide_is_zero(b);
    }
    if (a.exponent != b.exponent) {
        return a.exponent < b.exponent;
    }
    return a.mantissa.y < b.mantissa.y || (a.mantissa.y == b.mantissa.y && a.mantissa.x < b.mantissa.x);
}

fn wide_add(a: WideNumber, b: WideNumber) -> WideNumber {
    if (wide_is_less(a, b)) {
        return wide_add_smaller(b, a);
    }
    return wide_add_smaller(a, b);
}

/// The sum where |b| <= |a|. One bit of room at the top.
fn wide_add_smaller(a: WideNumber, b: WideNumber) -> WideNumber {
    if (wide_is_zero(b)) {
        return a;
    }
    let large = wide_shifted(a.mantissa, 1u);
    let small = wide_shifted(b.mantissa, min(u32(a.exponent - b.exponent), 64u) + 1u);
    if (a.negative == b.negative) {
        return wide_normal(a.negative, a.exponent + 1, u64_sum(large, small));
    }
    let minus = u64_sum(~small, vec2<u32>(1u, 0u));
    return wide_normal(a.negative, a.exponent + 1, u64_sum(large, minus));
}

fn wide_minus(a: WideNumber) -> WideNumber {
    return WideNumber(!a.negative && !wide_is_zero(a), a.exponent, a.mantissa);
}

/// 1 / a for an a that is not zero, by Newton's steps from the quotient in single precision.
fn wide_quotient(a: WideNumber) -> WideNumber {
    // Between 1/2 and 1.
    let guess = 1.0 / (f32(a.mantissa.y >> 8u) / 8388608.0);
    let unit = WideNumber(a.negative, 0, a.mantissa);
    let two = wide_of(2.0);
    var x = wide_of(guess);
    x.negative = a.negative;
    for (var step = 0u; step < 2u; step++) {
        x = wide_product(x, wide_add(two, wide_minus(wide_product(unit, x))));
    }
    x.exponent -= a.exponent;
    return x;
}
