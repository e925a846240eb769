// Real functions as in `vastlight-math`, `real`: range reduction and the same polynomials. Where that gives infinity,
// or no number, these give the largest finite number: kernels must not count on either.

const PI: f32 = 3.1415927;
const TAU: f32 = 6.2831855;
const HALF_PI: f32 = 1.5707964;
const QUARTER_PI: f32 = 0.7853982;
const OVER_PI: f32 = 0.31830987;
/// The largest number, and the least positive one of full precision.
const REAL_MAX: f32 = 3.4028235e38;
const REAL_MIN_POSITIVE: f32 = 1.1754944e-38;

/// The magnitude of `a` with the sign bit of `b`.
fn real_copysign(a: f32, b: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(a) & 0x7fffffffu) | (bitcast<u32>(b) & 0x80000000u));
}

/// Whether `x` is neither infinite nor no number, by its bits.
fn real_is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn real_is_finite3(v: vec3<f32>) -> bool {
    return real_is_finite(v.x) && real_is_finite(v.y) && real_is_finite(v.z);
}

/// Sine and cosine of `x` in radians, |x| below about 8000.
fn real_sin_cos(x: f32) -> vec2<f32> {
    let quarter = round(x * 0.63661975);
    let quarters = u32(i32(quarter));
    let r = ((x - quarter * 1.5703125) - quarter * 4.837513e-4) - quarter * 7.54979e-8;
    let z = r * r;
    let s = ((-1.9515296e-4 * z + 8.332161e-3) * z - 1.6666655e-1) * z * r + r;
    let c = ((2.4433157e-5 * z - 1.3887316e-3) * z + 4.1666646e-2) * z * z - 0.5 * z + 1.0;
    let turned = select(vec2<f32>(s, c), vec2<f32>(c, s), (quarters & 1u) == 1u);
    let negative = vec2<bool>((quarters & 2u) != 0u, ((quarters + 1u) & 2u) != 0u);
    return select(turned, -turned, negative);
}

fn real_sin(x: f32) -> f32 {
    return real_sin_cos(x).x;
}

fn real_cos(x: f32) -> f32 {
    return real_sin_cos(x).y;
}

fn real_tan(x: f32) -> f32 {
    let sc = real_sin_cos(x);
    return sc.x / sc.y;
}

/// 2^n for |n| <= 126.
fn real_power_of_two(n: i32) -> f32 {
    return bitcast<f32>(u32(n + 127) << 23u);
}

/// e to the power `x`; 0 below about -87.
fn real_exp(x: f32) -> f32 {
    if (x > 88.72) {
        return REAL_MAX;
    }
    if (x < -87.3) {
        return 0.0;
    }
    let n = round(x * 1.442695);
    let r = (x - n * 0.6933594) + n * 2.1219444e-4;
    let p = ((((1.9875691e-4 * r + 1.3981999e-3) * r + 8.333452e-3) * r + 4.1665796e-2) * r + 1.6666655e-1) * r
        + 0.5;
    let mantissa = p * r * r + r + 1.0;
    let half = i32(n) / 2;
    return mantissa * real_power_of_two(half) * real_power_of_two(i32(n) - half);
}

/// Natural logarithm of `x > 0`; the least number for others.
fn real_ln(x: f32) -> f32 {
    if (!(x > 0.0)) {
        return -REAL_MAX;
    }
    if (x > REAL_MAX) {
        return REAL_MAX;
    }
    let tiny = x < REAL_MIN_POSITIVE;
    let bits = bitcast<u32>(select(x, x * 8388608.0, tiny));
    var exponent = f32(i32(bits >> 23u) - 126) + select(0.0, -23.0, tiny);
    var m = bitcast<f32>((bits & 0x007fffffu) | 0x3f000000u);
    if (m < 0.70710677) {
        exponent -= 1.0;
        m += m;
    }
    m -= 1.0;
    let z = m * m;
    var p = 7.0376836e-2 * m - 1.151461e-1;
    p = p * m + 1.1676999e-1;
    p = p * m - 1.2420141e-1;
    p = p * m + 1.4249323e-1;
    p = p * m - 1.6668058e-1;
    p = p * m + 2.0000715e-1;
    p = p * m - 2.4999994e-1;
    p = p * m + 3.333333e-1;
    return (m * z * p - exponent * 2.1219444e-4 - 0.5 * z) + m + exponent * 0.6933594;
}

/// `x` to the power `y` for `x >= 0`; 0 at `x = 0` unless `y` is 0.
fn real_pow(x: f32, y: f32) -> f32 {
    if (y == 0.0 || x == 1.0) {
        return 1.0;
    }
    if (x <= 0.0) {
        return 0.0;
    }
    return real_exp(y * real_ln(x));
}

fn real_exp2(x: f32) -> f32 {
    return real_exp(x * 0.6931472);
}

/// Arcsine in radians; the argument is clamped to [-1, 1].
fn real_asin(x: f32) -> f32 {
    let a = min(abs(x), 1.0);
    let large = a > 0.5;
    let halved = 0.5 * (1.0 - a);
    let z = select(a * a, halved, large);
    let r = select(a, sqrt(halved), large);
    let p = ((((4.21632e-2 * z + 2.418131e-2) * z + 4.5470025e-2) * z + 7.4953003e-2) * z + 1.6666752e-1) * z * r
        + r;
    return real_copysign(select(p, HALF_PI - 2.0 * p, large), x);
}

/// Arccosine in radians; the argument is clamped to [-1, 1].
fn real_acos(x: f32) -> f32 {
    if (x > 0.5) {
        return 2.0 * real_asin(sqrt(max(0.5 * (1.0 - x), 0.0)));
    }
    if (x < -0.5) {
        return PI - 2.0 * real_asin(sqrt(max(0.5 * (1.0 + x), 0.0)));
    }
    return HALF_PI - real_asin(x);
}

/// Arctangent in radians.
fn real_atan(x: f32) -> f32 {
    let a = abs(x);
    var base = QUARTER_PI;
    var ratio = vec2<f32>(a - 1.0, a + 1.0);
    if (a > 2.4142137) {
        base = HALF_PI;
        ratio = vec2<f32>(-1.0, a);
    } else if (a <= 0.41421357) {
        base = 0.0;
        ratio = vec2<f32>(a, 1.0);
    }
    let r = ratio.x / ratio.y;
    let z = r * r;
    let p = (((8.0537445e-2 * z - 1.3877685e-1) * z + 1.9977711e-1) * z - 3.333295e-1) * z * r + r;
    return real_copysign(base + p, x);
}

/// Angle of the point (x, y) in radians, in [-pi, pi]; 0 at the origin.
fn real_atan2(y: f32, x: f32) -> f32 {
    if (x == 0.0 && y == 0.0) {
        return 0.0;
    }
    if (abs(x) >= abs(y)) {
        let a = real_atan(y / x);
        return select(a + real_copysign(PI, y), a, x > 0.0);
    }
    return real_copysign(HALF_PI, y) - real_atan(x / y);
}
