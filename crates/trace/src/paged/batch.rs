//! A batch of rays, pass after pass.

use super::filter::{PageSet, PassFilter};
use super::{Begin, End, Found, Missing, PagedFilter, Pager, Turn};
use crate::walk::{Answers, Batch};
use crate::{Hit, Tracer};
use vastlight_math::Ray;
use vastlight_paging::Table;

/// Traces batches of rays through pages; keeps its memory for the next.
#[derive(Debug, Default)]
pub struct PagedBatch {
    /// The rays that are not finished, and their numbers.
    rays: Vec<Ray>,
    numbers: Vec<u32>,
    /// By number in the whole batch.
    ways: Vec<Way>,
    /// Pages that all unfinished rays have looked through.
    done: PageSet,
    used: PageSet,
    undecided: PageSet,
    asked: PageSet,
    wanted: Wanted,
}

/// Numbers of pages, the most wanted first.
#[derive(Debug, Default)]
struct Wanted {
    geometry: Vec<u32>,
    attributes: Vec<u32>,
}

/// How far a ray is.
#[derive(Clone, Copy, Debug)]
struct Way {
    best: Hit,
    found: Found,
    restart: Turn,
    missing: Missing,
}

impl Way {
    const AFRESH: Self =
        Self { best: Hit::MISS, found: Found::NONE, restart: Turn::FIRST, missing: Missing::NOTHING };
}

/// Answers of a pass.
struct Ways<'a> {
    numbers: &'a [u32],
    ways: &'a mut [Way],
}

impl Answers for Ways<'_> {
    #[inline(always)]
    fn set(&mut self, index: usize, hit: &Hit, end: &End) {
        let way = &mut self.ways[self.numbers[index] as usize];
        (way.best, way.found, way.missing) = (*hit, end.found, end.missing);
    }

    #[inline(always)]
    fn begin(&self, index: usize) -> Begin {
        let way = &self.ways[self.numbers[index] as usize];
        Begin { best: way.best, found: way.found, restart: way.restart }
    }
}

impl PagedBatch {
    /// The closest hit of each ray that `filter` accepts, and where it is; without filter all count. On the calling
    /// thread. Rays and hits are as in [`Tracer::closest`].
    ///
    /// # Errors
    /// Those of the pager.
    pub fn closest<P: Pager>(
        &mut self,
        tracer: &Tracer,
        pager: &mut P,
        rays: &[Ray],
        filter: Option<&dyn PagedFilter>,
        mut answer: impl FnMut(usize, &Hit, &Found),
    ) -> Result<(), P::Error> {
        self.trace::<P, false>(tracer, pager, rays, filter)?;
        for (i, way) in self.ways.iter().enumerate() {
            answer(i, &way.best, &tracer.unscaled(&way.best, way.found));
        }
        Ok(())
    }

    /// Whether each ray has a hit that `filter` accepts; otherwise as [`PagedBatch::closest`].
    ///
    /// # Errors
    /// Those of the pager.
    pub fn occluded<P: Pager>(
        &mut self,
        tracer: &Tracer,
        pager: &mut P,
        rays: &[Ray],
        filter: Option<&dyn PagedFilter>,
        occluded: &mut [bool],
    ) -> Result<(), P::Error> {
        self.trace::<P, true>(tracer, pager, rays, filter)?;
        occluded.iter_mut().zip(&self.ways).for_each(|(answer, way)| *answer = way.best.is_hit());
        Ok(())
    }

    fn trace<P: Pager, const ANY: bool>(
        &mut self,
        tracer: &Tracer,
        pager: &mut P,
        rays: &[Ray],
        filter: Option<&dyn PagedFilter>,
    ) -> Result<(), P::Error> {
        self.ways.clear();
        self.ways.resize(rays.len(), Way::AFRESH);
        self.numbers.clear();
        self.numbers.extend(0..rays.len() as u32);
        self.rays.clear();
        self.rays.extend(rays);
        pager.fetch(&[], &[])?;
        let mut table = pager.geometry();
        self.done.clear(table.pages());
        loop {
            if ANY {
                self.pass_for_any(tracer, &table, &pager.attributes(), filter);
            } else {
                self.pass_for_closest(tracer, &table, &pager.attributes(), filter);
            }
            pager.used(&self.used.words());
            self.keep_unfinished::<ANY>(rays, table.pages());
            if self.rays.is_empty() {
                return Ok(());
            }
            self.note_done(&table);
            // Pages that are taken out of memory meanwhile are free only without this.
            drop(table);
            pager.fetch(&self.wanted.geometry, &self.wanted.attributes)?;
            table = pager.geometry();
        }
    }

    // Compiled here, and not anew wherever there is a pager.
    #[inline(never)]
    fn pass_for_closest(
        &mut self,
        tracer: &Tracer,
        table: &Table,
        attributes: &Table,
        filter: Option<&dyn PagedFilter>,
    ) {
        self.pass::<false>(tracer, table, attributes, filter);
    }

    #[inline(never)]
    fn pass_for_any(
        &mut self,
        tracer: &Tracer,
        table: &Table,
        attributes: &Table,
        filter: Option<&dyn PagedFilter>,
    ) {
        self.pass::<true>(tracer, table, attributes, filter);
    }

    fn pass<const ANY: bool>(
        &mut self,
        tracer: &Tracer,
        table: &Table,
        attributes: &Table,
        filter: Option<&dyn PagedFilter>,
    ) {
        self.used.clear(table.pages());
        self.undecided.clear(table.pages());
        let (numbers, ways) = (&self.numbers[..], &mut self.ways[..]);
        let (done, used, undecided) = (&self.done, &self.used, &self.undecided);
        let filter = &PassFilter { filter, tracer, attributes, numbers, done, used, undecided };
        let (pages, rays, answers) = (table, &self.rays[..], Ways { numbers, ways });
        tracer.level().dispatch(Batch::<_, _, ANY> { tracer, pages, rays, filter, answers });
    }

    /// Leaves the rays that need something that is not in memory, and collects what that is.
    fn keep_unfinished<const ANY: bool>(&mut self, rays: &[Ray], pages: usize) {
        self.asked.clear(pages);
        self.wanted.geometry.clear();
        self.wanted.attributes.clear();
        self.rays.clear();
        let mut kept = 0;
        for i in 0..self.numbers.len() {
            let number = self.numbers[i];
            let way = &mut self.ways[number as usize];
            if ANY && way.best.is_hit() || !way.missing.matters(&way.best) {
                continue;
            }
            way.restart = way.missing.turn;
            if self.asked.insert(way.missing.page) {
                self.wanted.geometry.push(way.missing.page);
            }
            if way.missing.attributes != Hit::NONE {
                self.wanted.attributes.push(way.missing.attributes);
            }
            self.numbers[kept] = number;
            self.rays.push(rays[number as usize]);
            kept += 1;
        }
        self.numbers.truncate(kept);
        dedup(&mut self.wanted.attributes);
    }

    /// Notes the pages that all rays have looked through now: those that were in memory and left nothing undecided.
    fn note_done(&self, table: &Table) {
        for page in table.present() {
            if !self.undecided.contains(page) {
                self.done.insert(page);
            }
        }
    }
}

/// Leaves the first of each number.
fn dedup(numbers: &mut Vec<u32>) {
    let mut seen = std::collections::HashSet::new();
    numbers.retain(|&number| seen.insert(number));
}
