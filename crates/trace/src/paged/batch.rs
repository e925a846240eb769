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
    /// The rays of a pass, and their numbers.
    rays: Vec<Ray>,
    numbers: Vec<u32>,
    /// Numbers of the rays that wait for a page.
    waiting: Vec<u32>,
    /// By number in the whole batch.
    ways: Vec<Way>,
    /// Pages that all unfinished rays have looked through.
    done: PageSet,
    used: PageSet,
    undecided: PageSet,
    geometry: Wanted,
    attributes: Wanted,
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
        self.waiting.clear();
        self.numbers.clear();
        self.numbers.extend(0..rays.len() as u32);
        pager.fetch(&[], &[])?;
        self.done.clear(pager.geometry().pages());
        loop {
            self.go_on::<P, ANY>(tracer, pager, rays, filter);
            if self.waiting.is_empty() {
                return Ok(());
            }
            self.note_wanted();
            pager.fetch(&self.geometry.pages, &self.attributes.pages)?;
            self.choose_ready(&pager.geometry(), &pager.attributes());
        }
    }

    /// A pass of the chosen rays.
    fn go_on<P: Pager, const ANY: bool>(
        &mut self,
        tracer: &Tracer,
        pager: &mut P,
        rays: &[Ray],
        filter: Option<&dyn PagedFilter>,
    ) {
        let (table, attributes) = (pager.geometry(), pager.attributes());
        self.rays.clear();
        self.rays.extend(self.numbers.iter().map(|&number| rays[number as usize]));
        let all = self.waiting.is_empty();
        if ANY {
            self.pass_for_any(tracer, &table, &attributes, filter);
        } else {
            self.pass_for_closest(tracer, &table, &attributes, filter);
        }
        pager.used(&self.used.words());
        if all {
            self.note_done(&table);
        }
        self.keep_unfinished::<ANY>();
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

    /// Puts the rays of the pass that need something that is not in memory to those that wait.
    fn keep_unfinished<const ANY: bool>(&mut self) {
        for &number in &self.numbers {
            let way = &mut self.ways[number as usize];
            if (!ANY || !way.best.is_hit()) && way.missing.matters(&way.best) {
                way.restart = way.missing.turn;
                self.waiting.push(number);
            }
        }
    }

    /// Collects what the rays wait for.
    fn note_wanted(&mut self) {
        let missing = |&number: &u32| self.ways[number as usize].missing;
        self.geometry.collect(self.waiting.iter().map(|number| missing(number).page));
        let attributes = self.waiting.iter().map(|number| missing(number).attributes);
        self.attributes.collect(attributes.filter(|&page| page != Hit::NONE));
    }

    /// Chooses the rays for the next pass: those for which all has come.
    fn choose_ready(&mut self, geometry: &Table, attributes: &Table) {
        let Self { waiting, numbers, ways, .. } = self;
        numbers.clear();
        waiting.retain(|&number| {
            let missing = &ways[number as usize].missing;
            let ready = geometry.page(missing.page).is_some()
                && (missing.attributes == Hit::NONE || attributes.page(missing.attributes).is_some());
            if ready {
                numbers.push(number);
            }
            !ready
        });
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

/// Numbers of pages: first that of the first ray that waits, then by how many rays want them.
#[derive(Debug, Default)]
struct Wanted {
    pages: Vec<u32>,
    /// Number of rays and page.
    counted: Vec<(u32, u32)>,
}

impl Wanted {
    fn collect(&mut self, wanted: impl Iterator<Item = u32>) {
        let Self { pages, counted } = self;
        pages.clear();
        counted.clear();
        pages.extend(wanted);
        let Some(&first) = pages.first() else { return };
        pages.sort_unstable();
        counted.extend(pages.chunk_by(|a, b| a == b).map(|same| (same.len() as u32, same[0])));
        // The first gets on whatever others want, so that waiting ends.
        counted.sort_unstable_by_key(|&(count, page)| (page != first, std::cmp::Reverse(count), page));
        pages.clear();
        pages.extend(counted.iter().map(|&(_, page)| page));
    }
}
