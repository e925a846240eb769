//! Numbers in JSON: the shortest digits that give the same f32 back.

use serde_json::Value;
use vastlight_math::Vec3;

/// A number; zero for what JSON cannot say.
pub(super) fn number(x: f32) -> Value {
    let shortest = x.to_string().parse::<f64>().unwrap_or(0.0);
    if shortest.fract() == 0.0 && shortest.abs() < 1e9 {
        Value::from(shortest as i64)
    } else {
        Value::from(shortest)
    }
}

/// A list of numbers.
pub(super) fn numbers(values: &[f32]) -> Value {
    values.iter().map(|&x| number(x)).collect()
}

/// A colour of at most 1 and a strength of which `value` is the exact product (up to 1e38); `value` is not negative.
///
/// The strength is the largest component where that is exact, otherwise a power of two.
pub(super) fn color_and_strength(value: Vec3) -> (Vec3, f32) {
    let strength = value.max_element();
    if strength <= 0.0 {
        return (Vec3::ONE, 0.0);
    }
    if value / strength * strength == value || strength > 1e38 {
        return (value / strength, strength);
    }
    let mut power = 1.0;
    while power < strength {
        power *= 2.0;
    }
    while power * 0.5 >= strength && power > f32::MIN_POSITIVE {
        power *= 0.5;
    }
    (value / power, power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_times_strength_is_the_value() {
        let values = [
            Vec3::ZERO,
            Vec3::ONE,
            Vec3::splat(17.0),
            Vec3::new(0.1, 0.3, 0.7) * 31.7,
            Vec3::new(1e-20, 3e-19, 0.0),
            Vec3::new(0.9e38, 1e37, 1.0),
        ];
        for value in values {
            let (color, strength) = color_and_strength(value);
            assert_eq!(color * strength, value);
            assert!(color.max_element() <= 1.0 && color.min_element() >= 0.0, "{value}: {color}");
        }
    }
}
