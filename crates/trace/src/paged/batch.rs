//! A batch of rays, pass after pass.

use super::filter::{PageSet, PassFilter};
use super::{Begin, End, Found, Missing, PagedFilter, Pager, Turn};
use crate::walk::{Answers, Batch};
use crate::{Hit, Tracer};
use vastlight_math::Ray;
use vastlight_paging::{Edition, Table};

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
    /// Pages that will be done after a pass of all rays.
    complete: PageSet,
    geometry: Wanted,
    attributes: Wanted,
}

/// Rays that see the same pages in memory.
const TOGETHER: usize = 2048;

/// What the rays of a pass see.
struct Pass<'p> {
    tracer: &'p Tracer,
    table: &'p Table,
    attributes: &'p Table,
    /// By number in the pass.
    numbers: &'p [u32],
    filter: Option<&'p dyn PagedFilter>,
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
            self.go_on::<P, ANY>(tracer, pager, rays, filter)?;
            if self.waiting.is_empty() {
                pager.rest();
                return Ok(());
            }
            self.note_wanted();
            pager.fetch(&self.geometry.pages, &self.attributes.pages)?;
            self.choose_ready(&pager.geometry(), &pager.attributes());
        }
    }

    /// A pass of the chosen rays, some of them at a time: what is in memory is seen anew by each, so that the memory of
    /// pages that left is not held for long.
    fn go_on<P: Pager, const ANY: bool>(
        &mut self,
        tracer: &Tracer,
        pager: &mut P,
        rays: &[Ray],
        filter: Option<&dyn PagedFilter>,
    ) -> Result<(), P::Error> {
        let (numbers, all) = (std::mem::take(&mut self.numbers), self.waiting.is_empty());
        let mut before = None;
        for (i, chunk) in numbers.chunks(TOGETHER).enumerate() {
            if i > 0 {
                pager.fetch(&[], &[])?;
            }
            let (table, attributes) = (pager.geometry(), pager.attributes());
            self.rays.clear();
            self.rays.extend(chunk.iter().map(|&number| rays[number as usize]));
            let pass = Pass { tracer, table: &table, attributes: &attributes, numbers: chunk, filter };
            if ANY {
                self.pass_for_any(&pass);
            } else {
                self.pass_for_closest(&pass);
            }
            pager.used(&self.used.words());
            if all {
                self.note_complete(&table, before.as_ref());
                before = Some(table.edition());
            }
            self.keep_unfinished::<ANY>(chunk);
        }
        if all {
            std::mem::swap(&mut self.done, &mut self.complete);
        }
        self.numbers = numbers;
        Ok(())
    }

    // Compiled here, and not anew wherever there is a pager.
    #[inline(never)]
    fn pass_for_closest(&mut self, pass: &Pass<'_>) {
        self.pass::<false>(pass);
    }

    #[inline(never)]
    fn pass_for_any(&mut self, pass: &Pass<'_>) {
        self.pass::<true>(pass);
    }

    fn pass<const ANY: bool>(&mut self, pass: &Pass<'_>) {
        let &Pass { tracer, table, attributes, numbers, filter } = pass;
        self.used.clear(table.pages());
        self.undecided.clear(table.pages());
        let ways = &mut self.ways[..];
        let (done, used, undecided) = (&self.done, &self.used, &self.undecided);
        let filter = &PassFilter { filter, tracer, attributes, numbers, done, used, undecided };
        let (pages, rays, answers) = (table, &self.rays[..], Ways { numbers, ways });
        tracer.level().dispatch(Batch::<_, _, ANY> { tracer, pages, rays, filter, answers });
    }

    /// Puts the rays of the pass that need something that is not in memory to those that wait.
    fn keep_unfinished<const ANY: bool>(&mut self, numbers: &[u32]) {
        for &number in numbers {
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

    /// Notes the pages that all rays so far have looked through: those that were in memory each time and left nothing
    /// undecided. `before` is what was in memory the last time.
    fn note_complete(&mut self, table: &Table, before: Option<&Edition>) {
        match before {
            None => {
                self.complete.clear(table.pages());
                table.present().for_each(|page| self.complete.insert(page));
            }
            Some(before) if table.is_of(before) => {}
            Some(_) => self.complete.retain(|page| table.page(page).is_some()),
        }
        self.complete.remove_all(&mut self.undecided);
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
