// Division that is the same on all devices.

/// a / b rounded to the nearest, by hand, for numbers above 0 whose quotient is neither large nor small.
fn rounded_quotient(a: f32, b: f32) -> f32 {
    let divisor = (bitcast<u32>(b) & 0x7fffffu) | 0x800000u;
    var rest = (bitcast<u32>(a) & 0x7fffffu) | 0x800000u;
    var exponent = 127u + (bitcast<u32>(a) >> 23u) - (bitcast<u32>(b) >> 23u);
    if (rest < divisor) {
        rest <<= 1u;
        exponent--;
    }
    rest -= divisor;
    var digits = 1u;
    for (var i = 0u; i < 23u; i++) {
        rest <<= 1u;
        digits <<= 1u;
        if (rest >= divisor) {
            rest -= divisor;
            digits |= 1u;
        }
    }
    digits += select(0u, 1u, 2u * rest > divisor || (2u * rest == divisor && (digits & 1u) != 0u));
    // A carry out of the digits goes to the exponent.
    return bitcast<f32>((exponent << 23u) + (digits - 0x800000u));
}
