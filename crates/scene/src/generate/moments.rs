//! Moments of what is simulated, kept at even steps of time.

/// The kept moment at or before a time in seconds, of so many, and the part of the way from it to the next; the ends hold.
pub(super) fn moment_at(moments: usize, a_second: u32, time: f32) -> (usize, f32) {
    let x = (time * a_second as f32).clamp(0.0, moments.saturating_sub(1) as f32);
    (x as usize, x - x.floor())
}

/// All parts of what moves at a time in seconds. Without moments there are none.
pub(super) fn between<T: Clone>(
    moments: &[Vec<T>],
    a_second: u32,
    time: f32,
    towards: impl Fn(&T, &T, f32) -> T,
) -> Vec<T> {
    let (first, t) = moment_at(moments.len(), a_second, time);
    match (moments.get(first), moments.get(first + 1)) {
        (Some(a), Some(b)) => a.iter().zip(b).map(|(a, b)| towards(a, b, t)).collect(),
        (Some(a), None) => a.clone(),
        _ => Vec::new(),
    }
}
