//! The one root in an interval where a function changes its sign.

/// Halvings that are enough for any interval of doubles that matters here.
const MOST_STEPS: usize = 80;

/// Where `function`, which gives value and slope, changes its sign between `low` and `high`, to `tolerance`; values of 0 count as
/// positive. Newton's steps, and halving wherever those leave the bracket or do not halve it in two steps.
///
/// `positive_low` is the sign at `low`; that at `high` is the other.
pub(super) fn bracketed(
    function: impl Fn(f64) -> (f64, f64),
    (mut low, mut high): (f64, f64),
    positive_low: bool,
    tolerance: f64,
) -> f64 {
    let mut x = 0.5 * (low + high);
    let mut before = (high - low) * 2.0;
    for _ in 0..MOST_STEPS {
        let (value, slope) = function(x);
        if (value >= 0.0) == positive_low {
            low = x
        } else {
            high = x
        }
        let width = high - low;
        if width <= tolerance {
            break;
        }
        let newton = x - value / slope;
        let step = (newton - x).abs();
        if newton > low && newton < high && step < 0.5 * before {
            x = newton;
            if step <= 0.5 * tolerance {
                break;
            }
        } else {
            x = 0.5 * (low + high);
        }
        before = step.min(width);
    }
    x.clamp(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_found_whatever_the_slope() {
        let cubic = |root: f64| move |x: f64| ((x - root).powi(3), 3.0 * (x - root).powi(2));
        let steep = |root: f64| move |x: f64| (((x - root) * 1e9).tanh(), 1e9);
        let flat = |root: f64| move |x: f64| ((x - root).signum(), 0.0);
        for i in 0..100 {
            let root = f64::from(i) / 99.0;
            let found = [
                bracketed(cubic(root), (-0.1, 1.2), false, 1e-10),
                bracketed(steep(root), (-0.1, 1.2), false, 1e-10),
                bracketed(flat(root), (-0.1, 1.2), false, 1e-10),
                bracketed(|x| (root - x, -1.0), (-0.1, 1.2), true, 1e-10),
            ];
            for (which, x) in found.into_iter().enumerate() {
                assert!((x - root).abs() <= 1e-10, "{which}: {x} for {root}");
            }
        }
    }
}
