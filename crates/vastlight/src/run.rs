//! The render loop: passes over tiles over threads, until the samples, the noise, the time or the patience end.

use crate::checkpoint::Keeper;
use crate::device::Worker;
use crate::ids::Ids;
use crate::passes::PassSchedule;
use crate::render::millis;
use crate::stats::Ending;
use crate::{Control, Error, Progress, RenderRequest};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use vastlight_film::{Accumulator, FilmTile, PixelSample, Window, is_look};
use vastlight_transport::photon::{PhotonMaps, PhotonPlan};
use vastlight_transport::{RenderStats, Sample, SampleSink, Tile};

/// Hands the renderer's samples to a tile of the film.
pub(crate) struct TileSink<'t> {
    pub(crate) tile: &'t mut FilmTile,
    pub(crate) ids: &'t Ids,
}

impl SampleSink for TileSink<'_> {
    #[inline]
    fn add(&mut self, pixel: [u32; 2], sample: &Sample) {
        let film_sample = PixelSample {
            radiance: sample.radiance,
            hit: sample.coverage > 0.0,
            albedo: sample.albedo,
            normal: sample.normal,
            depth: sample.depth,
            position: sample.position,
            object: self.ids.object(sample.object),
            material: self.ids.material(sample.material),
        };
        self.tile.add(pixel[0], pixel[1], &film_sample);
    }
}

/// A render under way.
pub(crate) struct Run<'r, 'w> {
    worker: &'r Worker<'w>,
    ids: &'r Ids,
    request: &'r RenderRequest,
    control: &'r Control<'r>,
    start: Instant,
    deadline: Option<Instant>,
    photons: Option<PhotonPlan>,
    /// Samples taken by this run, those of earlier ones, and all that there will be.
    samples: AtomicU64,
    resumed: AtomicU64,
    samples_total: AtomicU64,
}

/// What all passes came to.
pub(crate) struct Outcome {
    /// What this run cost.
    pub(crate) cost: RenderStats,
    pub(crate) resumed_passes: u32,
    pub(crate) resumed_samples: u64,
    pub(crate) ending: Ending,
    pub(crate) first_pass_ms: f64,
    pub(crate) render_ms: f64,
}

/// A pass under way.
struct Pass<'p> {
    samples: Range<u32>,
    photons: Option<&'p PhotonMaps>,
    /// Whether a picture is there already, so that the time limit counts.
    may_stop: bool,
    /// When a checkpoint is to be written.
    due: Option<Instant>,
}

impl<'r, 'w> Run<'r, 'w> {
    pub(crate) fn new(
        worker: &'r Worker<'w>,
        ids: &'r Ids,
        request: &'r RenderRequest,
        control: &'r Control<'r>,
        deadline: Option<Instant>,
    ) -> Result<Self, Error> {
        let [samples, resumed, samples_total] = [const { AtomicU64::new(0) }; 3];
        let (start, photons) = (Instant::now(), worker.photon_plan()?);
        Ok(Self { worker, ids, request, control, start, deadline, photons, samples, resumed, samples_total })
    }

    /// Renders what the sums lack, until something ends it.
    pub(crate) fn all_passes(&self, sums: &mut Accumulator) -> Result<Outcome, Error> {
        let mut keeper = Keeper::new(self.request.checkpoint.as_ref());
        let mut schedule = PassSchedule::new(self.request.wanted(), sums.samples().len());
        schedule.one_by_one = self.photons.is_some();
        schedule.looks = self.request.noise.is_some();
        let mut outcome = Outcome {
            cost: RenderStats::default(),
            resumed_passes: sums.samples().len(),
            resumed_samples: sums.blocks().samples(),
            ending: Ending::Complete,
            first_pass_ms: 0.0,
            render_ms: 0.0,
        };
        self.resumed.store(outcome.resumed_samples, Ordering::Relaxed);
        while let Some(samples) = self.next_pass(&schedule, sums) {
            if !self.pass(sums, samples, &mut outcome.cost, &mut keeper)? {
                break;
            }
            if outcome.first_pass_ms == 0.0 {
                outcome.first_pass_ms = millis(self.start.elapsed());
            }
        }
        keeper.save(sums)?;
        outcome.ending = self.ending(sums);
        outcome.render_ms = millis(self.start.elapsed());
        Ok(outcome)
    }

    /// The pass that was left in the middle, or the next one.
    fn next_pass(&self, schedule: &PassSchedule, sums: &Accumulator) -> Option<Range<u32>> {
        if sums.blocks().going_on() == 0 {
            return None;
        }
        let next = || schedule.next(sums.samples(), self.start.elapsed(), self.time_left());
        sums.open_pass().or_else(next)
    }

    /// Adds the given samples to every tile, under photons of their own where there are any; says whether it came to the end.
    fn pass(
        &self,
        sums: &mut Accumulator,
        samples: Range<u32>,
        cost: &mut RenderStats,
        keeper: &mut Keeper<'_>,
    ) -> Result<bool, Error> {
        let may_stop = !sums.samples().is_empty();
        self.expect(sums);
        let photons =
            self.photons.as_ref().map(|plan| self.worker.photons(plan, samples.start)).transpose()?;
        if let (Some((_, rays)), None) = (&photons, sums.open_pass()) {
            sums.counters.rays += rays;
        }
        sums.begin_pass(samples.clone());
        loop {
            let photons = photons.as_ref().map(|(maps, _)| maps);
            let pass = Pass { samples: samples.clone(), photons, may_stop, due: keeper.due() };
            *cost += self.tiles(sums, &pass)?;
            let is_whole = sums.end_pass();
            if is_whole {
                self.stop_quiet(sums);
            }
            self.look_up(sums, keeper)?;
            if is_whole || self.is_to_stop(may_stop) {
                return Ok(is_whole);
            }
        }
    }

    /// Stops the parts of the picture that are done, where it is time to look.
    fn stop_quiet(&self, sums: &mut Accumulator) {
        if let Some(noise) = self.request.noise
            && is_look(sums.samples().len())
        {
            sums.stop_quiet(noise.into());
        }
    }

    /// Writes a checkpoint and shows the picture, where these are due. No tile is rendered meanwhile.
    fn look_up(&self, sums: &Accumulator, keeper: &mut Keeper<'_>) -> Result<(), Error> {
        let snapshot = self.control.snapshot.filter(|s| s.wanted.swap(false, Ordering::Relaxed));
        if snapshot.is_some() || keeper.is_due() {
            keeper.save(sums)?;
        }
        if let Some(snapshot) = snapshot {
            (snapshot.take)(sums);
        }
        Ok(())
    }

    /// Adds the samples of a pass to the tiles that wait for them. Tiles are skipped once the render is to stop or to be looked at.
    fn tiles(&self, sums: &mut Accumulator, pass: &Pass<'_>) -> Result<RenderStats, Error> {
        let (reporting, spp) = (Mutex::new(()), sums.samples().len());
        let waiting = sums.waiting();
        let tile_cost = |(tile, parts): (&mut FilmTile, &Vec<Window>)| {
            if parts.is_empty() || self.is_to_pause(pass) {
                return Ok(None);
            }
            let cost = self.parts(tile, parts, pass)?;
            self.samples.fetch_add(cost.samples, Ordering::Relaxed);
            if let Ok(_one_at_a_time) = reporting.try_lock() {
                (self.control.progress)(&self.progress(spp));
            }
            Ok(Some(cost))
        };
        let tiles = sums.tiles_mut().par_iter_mut().zip(&waiting).with_max_len(1);
        let costs: Vec<Option<RenderStats>> = tiles.map(tile_cost).collect::<Result<_, Error>>()?;
        let mut total = RenderStats::default();
        for (parts, cost) in waiting.iter().zip(costs) {
            if let Some(cost) = cost {
                sums.note_done(parts);
                total += cost;
            }
        }
        let counters = &mut sums.counters;
        counters.samples += total.samples;
        counters.non_finite += total.non_finite;
        counters.rays += total.rays;
        counters.shadow_rays += total.shadow_rays;
        Ok(total)
    }

    /// Adds the samples of a pass to parts of a tile.
    fn parts(&self, tile: &mut FilmTile, parts: &[Window], pass: &Pass<'_>) -> Result<RenderStats, Error> {
        let mut cost = RenderStats::default();
        for part in parts {
            let region = Tile { min: [part.x0, part.y0], max: [part.x1, part.y1] };
            let mut sink = TileSink { tile, ids: self.ids };
            cost += self.worker.render_tile(pass.photons, region, pass.samples.clone(), &mut sink)?;
        }
        Ok(cost)
    }

    /// Whether what is begun is to be finished and nothing more. The first pass goes on beyond the time limit.
    fn is_to_stop(&self, may_stop: bool) -> bool {
        self.cancelled() || (may_stop && self.out_of_time())
    }

    fn is_to_pause(&self, pass: &Pass<'_>) -> bool {
        let is_set = |flag: &AtomicBool| flag.load(Ordering::Relaxed);
        self.is_to_stop(pass.may_stop)
            || pass.due.is_some_and(|due| Instant::now() >= due)
            || self.control.snapshot.is_some_and(|snapshot| is_set(snapshot.wanted))
    }

    fn cancelled(&self) -> bool {
        self.control.cancel.load(Ordering::Relaxed)
    }

    fn time_left(&self) -> Option<Duration> {
        self.deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()))
    }

    fn out_of_time(&self) -> bool {
        self.time_left().is_some_and(|left| left.is_zero())
    }

    fn ending(&self, sums: &Accumulator) -> Ending {
        let is_done = sums.samples().first_gap(self.request.wanted()).is_none();
        if is_done || sums.blocks().going_on() == 0 {
            Ending::Complete
        } else if self.cancelled() {
            Ending::Interrupted
        } else {
            Ending::TimeLimit
        }
    }

    /// Counts the samples that there will be, if no more parts are done before the last pass.
    fn expect(&self, sums: &Accumulator) {
        let wanted = self.request.wanted().len() as u32;
        let passes = u64::from(wanted.saturating_sub(sums.samples().len()));
        let to_come = sums.blocks().pixels_going_on() * passes;
        // What the open pass has already stands in both.
        let total = sums.blocks().samples() + to_come;
        self.samples_total.store(total, Ordering::Relaxed);
    }

    fn progress(&self, spp: u32) -> Progress {
        let here = self.samples.load(Ordering::Relaxed);
        let samples = here + self.resumed.load(Ordering::Relaxed);
        let samples_total = self.samples_total.load(Ordering::Relaxed).max(samples);
        let elapsed = self.start.elapsed();
        let to_go = (samples_total - samples) as f64 / here.max(1) as f64;
        let by_samples = Duration::try_from_secs_f64(elapsed.as_secs_f64() * to_go).unwrap_or(Duration::MAX);
        let remaining = self.time_left().map_or(by_samples, |left| left.min(by_samples));
        Progress {
            samples,
            samples_total,
            spp,
            elapsed,
            remaining: Some(remaining),
            residency: None,
            kernels: None,
        }
    }
}
