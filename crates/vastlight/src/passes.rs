//! How the samples of a picture are cut into passes, so that a picture that is stopped is even.

use std::ops::Range;
use std::time::Duration;

/// Most samples a pixel in one pass.
const LARGEST_PASS: u32 = 16;

/// Hands out passes: 1, 1, 2, 4, ... samples a pixel, and under a time limit no more than will fit.
#[derive(Clone, Debug)]
pub(crate) struct PassSchedule {
    done: u32,
    total: u32,
}

impl PassSchedule {
    pub(crate) fn new(total: u32) -> Self {
        Self { done: 0, total }
    }

    /// The sample numbers of the next pass, or `None` if all are done or none fits into `remaining`.
    ///
    /// `elapsed` is the time that the passes so far took. The first pass always comes: half a picture helps nobody.
    pub(crate) fn next(&mut self, elapsed: Duration, remaining: Option<Duration>) -> Option<Range<u32>> {
        let mut count = self.done.clamp(1, LARGEST_PASS).min(self.total - self.done);
        if let (Some(remaining), 1..) = (remaining, self.done) {
            let per_sample = elapsed.as_secs_f64() / f64::from(self.done);
            let fitting = remaining.as_secs_f64() / per_sample.max(1e-9);
            count = count.min(fitting as u32);
        }
        if count == 0 {
            return None;
        }
        let first = self.done;
        self.done += count;
        Some(first..self.done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(schedule: &mut PassSchedule, remaining: Option<Duration>) -> Vec<Range<u32>> {
        std::iter::from_fn(|| schedule.next(Duration::from_secs(1), remaining)).collect()
    }

    #[test]
    fn passes_grow_and_cover_every_sample_once() {
        let passes = all(&mut PassSchedule::new(70), None);
        assert_eq!(&passes[..5], &[0..1, 1..2, 2..4, 4..8, 8..16]);
        assert!(passes.windows(2).all(|w| w[0].end == w[1].start));
        assert_eq!(passes.last().map(|p| p.end), Some(70));
        assert!(passes.iter().all(|p| p.len() <= LARGEST_PASS as usize));
    }

    #[test]
    fn a_pass_that_does_not_fit_is_not_begun_but_the_first_is() {
        let mut schedule = PassSchedule::new(8);
        assert_eq!(schedule.next(Duration::ZERO, Some(Duration::ZERO)), Some(0..1));
        let second = Duration::from_secs(1);
        assert_eq!(schedule.next(second, Some(Duration::from_millis(900))), None);
        assert_eq!(schedule.next(second, Some(Duration::from_millis(1100))), Some(1..2));
        assert_eq!(schedule.next(second, Some(Duration::from_millis(600))), Some(2..3));
    }
}
