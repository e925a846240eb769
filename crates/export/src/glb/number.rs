//! Numbers in JSON: the shortest digits that give the same f32 back.

use serde_json::Value;

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
