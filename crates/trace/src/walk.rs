//! Batches of rays on one thread: in bundles, one flight after the other, or several flights that take turns.
//!
//! Rays that follow each other and go much the same way, or stand below each other in rows of a picture, are tried as a bundle. If that turns out to be work, the next
//! ones fly alone for a while.
//!
//! Taking turns hides the time that memory needs, but it mixes up what the processor has learnt about branches. So it pays
//! where ways are short and memory is what they wait for, and costs where ways are long: rays whose neighbours
//! needed few steps take turns, others do not.

use crate::bundle::{self, Bundle, Job, RAYS};
use crate::flight::Flight;
use crate::judge::Judge;
use crate::paged::{Begin, End};
use crate::patch::{self, Patch};
use crate::{Hit, Tracer};
use std::ops::Range;
use vastlight_accel::wide::traverse::Entry;
use vastlight_math::Ray;
use vastlight_paging::Table;
use vastlight_simd::{Kernel, Simd8};

/// Flights that take turns.
const TOGETHER: usize = 8;
/// Rays after which it is decided anew whether flights take turns.
const SPAN: usize = 256;
/// Rays of a batch's first span.
const FIRST_SPAN: usize = 32;
/// Rays that fly alone after a bundle that did not stay together; four times as many if the next one does not either.
const FIRST_ALONE: usize = 256;
/// Flights with fewer steps take turns.
const SHORT_WAY: usize = 20;

/// Traces a batch for the closest hits, or with `ANY` for some hit of each ray. `answers` gets a ray's number and hit.
pub(crate) struct Batch<'a, F, A, const ANY: bool> {
    pub(crate) tracer: &'a Tracer,
    pub(crate) pages: &'a Table,
    pub(crate) rays: &'a [Ray],
    pub(crate) filter: &'a F,
    pub(crate) answers: A,
}

/// Takes answers; they come in any order, one for each ray.
pub(crate) trait Answers {
    fn set(&mut self, index: usize, hit: &Hit, end: &End);

    /// What a ray begins with.
    #[inline(always)]
    fn begin(&self, _index: usize) -> Begin {
        Begin::AFRESH
    }
}

impl Answers for &mut [Hit] {
    #[inline(always)]
    fn set(&mut self, index: usize, hit: &Hit, _end: &End) {
        self[index] = *hit;
    }
}

impl Answers for &mut [bool] {
    #[inline(always)]
    fn set(&mut self, index: usize, hit: &Hit, _end: &End) {
        self[index] = hit.is_hit();
    }
}

impl<F: Judge, A: Answers, const ANY: bool> Kernel for Batch<'_, F, A, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(mut self, simd: S) {
        let mut stacks = Stacks::new(self.tracer.stack_entries);
        let [a, b, c, d, e, f, g, h] = stacks.split();
        let scene = (self.tracer, self.pages);
        // Written out, since a closure would make calls of all vector operations.
        let mut flights: [Flight<'_, S>; TOGETHER] = [
            Flight::grounded(simd, scene, a),
            Flight::grounded(simd, scene, b),
            Flight::grounded(simd, scene, c),
            Flight::grounded(simd, scene, d),
            Flight::grounded(simd, scene, e),
            Flight::grounded(simd, scene, f),
            Flight::grounded(simd, scene, g),
            Flight::grounded(simd, scene, h),
        ];
        let (mut span, mut short) = (FIRST_SPAN, false);
        // Its memory is worth its while only where rays do go together.
        let mut bundle = None;
        let (mut alone, mut still_alone) = (FIRST_ALONE, 0);
        let bundles = self.tracer.bundles;
        let rows = if bundles { patch::rows(self.rays) } else { None };
        for strip in patch::strips(self.rays.len(), rows) {
            let mut column = 0;
            while let Some(patch) = strip.patch(column, RAYS) {
                let try_bundle = bundles && still_alone == 0;
                let count = if try_bundle { bundle::count(self.rays, &patch) } else { 0 };
                if count == patch.count || count > 0 && strip.is_row() {
                    let patch = patch.truncated(count);
                    if self.in_bundle(simd, patch, bundle.get_or_insert_default()) {
                        (column, alone) = (strip.behind(column, count), FIRST_ALONE);
                        continue;
                    }
                    still_alone = alone;
                    alone *= 4;
                }
                let Some(patch) = strip.patch(column, span) else { break };
                column = strip.behind(column, patch.count);
                still_alone = still_alone.saturating_sub(patch.count);
                let steps = if short {
                    self.in_turns(simd, patch, &mut flights)
                } else {
                    self.one_by_one(simd, patch, &mut flights[0])
                };
                (span, short) = (SPAN, !self.tracer.vertices_move && steps < patch.count * SHORT_WAY);
            }
        }
    }
}

/// Stacks of the flights of a batch.
pub(crate) struct Stacks {
    entries: Vec<Entry>,
    each: usize,
}

impl Stacks {
    pub(crate) fn new(each: usize) -> Self {
        let each = each.max(1);
        Self { entries: vec![0; each * TOGETHER], each }
    }

    pub(crate) fn split(&mut self) -> [&mut [Entry]; TOGETHER] {
        let mut stacks = self.entries.chunks_mut(self.each);
        std::array::from_fn(|_| stacks.next().unwrap_or_default())
    }
}

impl<'a, F: Judge, A: Answers, const ANY: bool> Batch<'a, F, A, ANY> {
    /// Traces rays as a bundle; false, and nothing answered, if they do not go together.
    #[inline(always)]
    fn in_bundle<S: Simd8>(&mut self, simd: S, patch: Patch, bundle: &mut Bundle) -> bool {
        let (tracer, pages, rays, filter) = (self.tracer, self.pages, self.rays, self.filter);
        let job: Job<'_, F, ANY> = Job { tracer, pages, rays, patch, filter };
        bundle.trace(simd, &job, &mut self.answers)
    }

    /// Flies one ray after the other; gives the number of steps.
    #[inline(always)]
    fn one_by_one<'f, S: Simd8>(&mut self, simd: S, patch: Patch, flight: &mut Flight<'f, S>) -> usize
    where
        'a: 'f,
    {
        let before = flight.steps;
        for i in 0..patch.count {
            let index = patch.index(i);
            let mut flying = flight.start::<F>(simd, &self.rays[index], index, &self.answers.begin(index));
            while flying {
                flying = flight.step::<F, ANY, true>(simd, self.filter);
            }
            self.answers.set(index, &flight.best, &flight.end);
        }
        flight.steps - before
    }

    /// Flies rays in turns; gives the number of steps.
    #[inline(always)]
    fn in_turns<'f, S: Simd8>(
        &mut self,
        simd: S,
        patch: Patch,
        flights: &mut [Flight<'f, S>; TOGETHER],
    ) -> usize
    where
        'a: 'f,
    {
        let before: usize = flights.iter().map(|f| f.steps).sum();
        let mut rest = (patch, 0..patch.count);
        let mut flying = 0;
        while flying < TOGETHER && self.take_off(simd, &mut flights[flying], &mut rest) {
            flying += 1;
        }
        while flying > 0 {
            let mut turn = 0;
            while turn < flying {
                let flight = &mut flights[turn];
                if flight.step::<F, ANY, false>(simd, self.filter) {
                    flight.prefetch(simd);
                    turn += 1;
                    continue;
                }
                self.answers.set(flight.index, &flight.best, &flight.end);
                if self.take_off(simd, flight, &mut rest) {
                    turn += 1;
                } else {
                    flying -= 1;
                    flights.swap(turn, flying);
                }
            }
        }
        flights.iter().map(|f| f.steps).sum::<usize>() - before
    }

    /// Starts a flight with the next ray of the rest of a patch that has a way to go; false if there is none.
    #[inline(always)]
    fn take_off<'f, S: Simd8>(
        &mut self,
        simd: S,
        flight: &mut Flight<'f, S>,
        (patch, rest): &mut (Patch, Range<usize>),
    ) -> bool
    where
        'a: 'f,
    {
        for i in rest.by_ref() {
            let index = patch.index(i);
            if flight.start::<F>(simd, &self.rays[index], index, &self.answers.begin(index)) {
                flight.prefetch(simd);
                return true;
            }
            self.answers.set(index, &flight.best, &flight.end);
        }
        false
    }
}
