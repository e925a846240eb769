//! How the samples of a picture are cut into passes, so that a picture that is stopped is even.

use std::ops::Range;
use std::time::Duration;
use vastlight_film::{SampleSet, next_look};

/// Most samples a pixel in one pass.
const LARGEST_PASS: u32 = 16;

/// Hands out passes: 1, 1, 2, 4, ... samples a pixel, and under a time limit no more than will fit.
#[derive(Clone, Debug)]
pub(crate) struct PassSchedule {
    /// The samples that are asked for.
    wanted: Range<u32>,
    /// Samples that were there when the time began.
    resumed: u32,
    /// Passes of one sample.
    pub(crate) one_by_one: bool,
    /// Passes end where blocks are looked at.
    pub(crate) looks: bool,
}

impl PassSchedule {
    pub(crate) fn new(wanted: Range<u32>, resumed: u32) -> Self {
        Self { wanted, resumed, one_by_one: false, looks: false }
    }

    /// The sample numbers of the next pass beside those that are there, or `None` if all are or none fits into `remaining`.
    ///
    /// `elapsed` is the time that the passes so far took. The first pass always comes: half a picture helps nobody.
    pub(crate) fn next(
        &self,
        done: &SampleSet,
        elapsed: Duration,
        remaining: Option<Duration>,
    ) -> Option<Range<u32>> {
        let gap = done.first_gap(self.wanted.clone())?;
        let most = if self.one_by_one { 1 } else { LARGEST_PASS };
        let mut count = done.len().clamp(1, most).min(gap.end - gap.start);
        if self.looks {
            count = count.min(next_look(done.len()) - done.len());
        }
        if let (Some(remaining), 1..) = (remaining, done.len()) {
            count = count.min(self.fitting(done.len(), elapsed, remaining));
        }
        (count > 0).then(|| gap.start..gap.start + count)
    }

    /// How many samples fit into `remaining`; one is tried where no time was measured.
    fn fitting(&self, done: u32, elapsed: Duration, remaining: Duration) -> u32 {
        match done - self.resumed {
            0 => u32::from(!remaining.is_zero()),
            measured => {
                let per_sample = elapsed.as_secs_f64() / f64::from(measured);
                (remaining.as_secs_f64() / per_sample.max(1e-9)) as u32
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn all(schedule: &PassSchedule, mut done: SampleSet) -> Vec<Range<u32>> {
        let next = || {
            let pass = schedule.next(&done, SECOND, None)?;
            done.insert(pass.clone());
            Some(pass)
        };
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn passes_grow_and_cover_every_sample_once() {
        let passes = all(&PassSchedule::new(0..70, 0), SampleSet::default());
        assert_eq!(&passes[..5], &[0..1, 1..2, 2..4, 4..8, 8..16]);
        assert!(passes.windows(2).all(|w| w[0].end == w[1].start));
        assert_eq!(passes.last().map(|p| p.end), Some(70));
        assert!(passes.iter().all(|p| p.len() <= LARGEST_PASS as usize));
        let mut single = PassSchedule::new(5..8, 0);
        single.one_by_one = true;
        assert_eq!(all(&single, SampleSet::default()), [5..6, 6..7, 7..8]);
    }

    #[test]
    fn what_is_there_is_left_out() {
        let mut done = SampleSet::from(0..20);
        done.insert(30..40);
        assert_eq!(all(&PassSchedule::new(0..50, 30), done), [20..30, 40..50]);
    }

    #[test]
    fn passes_end_where_blocks_are_looked_at() {
        let mut schedule = PassSchedule::new(0..100, 0);
        schedule.looks = true;
        let passes = all(&schedule, SampleSet::from(0..10));
        assert_eq!(&passes[..2], &[10..16, 16..32]);
    }

    #[test]
    fn a_pass_that_does_not_fit_is_not_begun_but_the_first_is() {
        let schedule = PassSchedule::new(0..8, 0);
        let next = |done: u32, remaining: u64| {
            let done = if done == 0 { SampleSet::default() } else { SampleSet::from(0..done) };
            schedule.next(&done, SECOND, Some(Duration::from_millis(remaining)))
        };
        assert_eq!(next(0, 0), Some(0..1));
        assert_eq!(next(1, 900), None);
        assert_eq!(next(1, 1100), Some(1..2));
        assert_eq!(next(2, 600), Some(2..3));
        let resumed = PassSchedule::new(0..8, 4);
        assert_eq!(resumed.next(&SampleSet::from(0..4), SECOND, Some(SECOND)), Some(4..5));
        assert_eq!(resumed.next(&SampleSet::from(0..4), SECOND, Some(Duration::ZERO)), None);
    }
}
