//! The render loop: passes over tiles over threads, until the samples, the time or the patience end.

use crate::device::{Device, DeviceRequest, Tiles, Worker, structures};
use crate::ids::Ids;
use crate::paged::PagingRequest;
use crate::passes::PassSchedule;
use crate::session::{Kept, kept_tracer};
use crate::stats::{Ending, PagingStats, Residency, SceneCounts, Stats};
use crate::{Error, ErrorClass, OpenScene, paged, peak_rss_bytes, shutter};
use rayon::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use vastlight_film::{Aov, Cryptomatte, Film, FilmSettings, FilmTile, Picture, PixelSample, Window};
use vastlight_gpu::{CompileProgress, Executor};
use vastlight_trace::{Tracer, TracerConfig};
use vastlight_transport::photon::{PhotonMaps, PhotonPlan};
use vastlight_transport::{Lights, RenderSettings, RenderStats, Renderer, Sample, SampleSink, Tile};

/// What to render.
#[derive(Clone, Debug)]
pub struct RenderRequest {
    /// Integrator, camera, size, depth, seed, filter.
    pub settings: RenderSettings,
    /// Samples a pixel.
    pub spp: u32,
    /// Auxiliary outputs.
    pub aovs: Vec<Aov>,
    /// The call ends here, building included, with the samples that there are; at least one pass is finished.
    pub time_limit: Option<Duration>,
    /// How rays are traced.
    pub tracer: TracerConfig,
    /// How a scene in a store is paged.
    pub paging: PagingRequest,
    /// What it is computed on.
    pub device: DeviceRequest,
}

impl RenderRequest {
    /// `spp` samples a pixel on the CPU, without auxiliary outputs or time limit.
    #[must_use]
    pub fn new(settings: RenderSettings, spp: u32) -> Self {
        Self {
            settings,
            spp,
            aovs: Vec::new(),
            time_limit: None,
            tracer: TracerConfig::default(),
            paging: PagingRequest::default(),
            device: DeviceRequest { device: Device::Cpu, ..DeviceRequest::default() },
        }
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples taken so far, all pixels together.
    pub samples: u64,
    /// Samples asked for, all pixels together.
    pub samples_total: u64,
    /// Samples that every pixel has.
    pub spp: u32,
    /// Time since rendering began.
    pub elapsed: Duration,
    /// Expected time to the end, the time limit included; `None` before anything is known.
    pub remaining: Option<Duration>,
    /// What of the store is in memory, of a scene in one.
    pub residency: Option<Residency>,
    /// Kernels of a graphics processor that are compiled, of so many; `None` once rendering has begun.
    pub kernels: Option<[usize; 2]>,
}

impl Progress {
    /// Nothing rendered yet, and kernels on their way.
    fn compiling(request: &RenderRequest, compiled: CompileProgress) -> Self {
        Self {
            samples: 0,
            samples_total: request.settings.region().pixels() * u64::from(request.spp),
            spp: 0,
            elapsed: Duration::ZERO,
            remaining: None,
            residency: None,
            kernels: Some([compiled.done, compiled.total]),
        }
    }
}

/// How a render is watched and stopped.
pub struct Control<'c> {
    /// Set to stop: tiles that are begun are finished.
    pub cancel: &'c AtomicBool,
    /// Called after every tile, from any thread, one call at a time.
    pub progress: &'c (dyn Fn(&Progress) + Sync),
}

impl std::fmt::Debug for Control<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Control").field("cancel", &self.cancel).finish_non_exhaustive()
    }
}

/// A finished (or stopped) render.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The sums.
    pub film: Film,
    /// Names for the mattes that the film records.
    pub mattes: Vec<Cryptomatte>,
    /// What it cost.
    pub stats: Stats,
}

impl Rendered {
    /// The picture: linear means of all planes.
    #[must_use]
    pub fn develop(&self) -> Picture {
        self.film.develop(self.mattes.clone())
    }
}

/// Renders a scene on the device of the request: on the CPU on the threads of the current rayon pool, a scene in a store on
/// twice as many, of which some wait for pages. Bits depend on scene, request and device alone, not on threads, nor on
/// what is in memory.
///
/// # Errors
/// If the device cannot be used and the request has no other, the acceleration structure cannot be built, a scene in a
/// store does not fit into the memory of the request, or a page cannot be had.
pub fn render(open: &OpenScene, request: &RenderRequest, control: &Control<'_>) -> Result<Rendered, Error> {
    render_keeping(open, request, control, &mut Kept::default())
}

/// [`render`] with what earlier pictures of the scene left.
pub(crate) fn render_keeping(
    open: &OpenScene,
    request: &RenderRequest,
    control: &Control<'_>,
    kept: &mut Kept,
) -> Result<Rendered, Error> {
    shutter::check(open, request)?;
    let fallback = match on_graphics_processor(open, request, control, kept) {
        Ok(Some(rendered)) => return Ok(rendered),
        Ok(None) => None,
        Err(error) if error.class == ErrorClass::Device && request.device.falls_back() => {
            Some(error.to_string())
        }
        Err(error) => return Err(error),
    };
    let tracer = &mut kept.tracer;
    let mut rendered = match &open.stored {
        None => render_with(open, request, control, tracer, None),
        Some(_) => {
            paged::pool(&request.paging)?.install(|| render_with(open, request, control, tracer, None))
        }
    }?;
    rendered.stats.fallback = fallback;
    Ok(rendered)
}

/// [`render`] on a graphics processor; none if the request is for the CPU.
fn on_graphics_processor(
    open: &OpenScene,
    request: &RenderRequest,
    control: &Control<'_>,
    kept: &mut Kept,
) -> Result<Option<Rendered>, Error> {
    if open.scene.implicit_mesh().is_some() {
        return request.device.refuse("implicit surfaces are rendered by the CPU alone").map(|()| None);
    }
    if open.scene.shutter().is_some() {
        return Ok(None);
    }
    if open.triangles_beside_pages() > 0 {
        let what = "meshes that deform beside the pages of a store are rendered by the CPU alone";
        return request.device.refuse(what).map(|()| None);
    }
    if kept.executor.is_none() {
        kept.executor = request.device.open()?;
    }
    let Kept { tracer, executor: Some(executor), .. } = kept else { return Ok(None) };
    let request = RenderRequest { tracer: structures(request), ..request.clone() };
    let rendered = render_with(open, &request, control, tracer, Some(executor));
    if rendered.is_err() {
        // A device that failed once is not trusted again.
        kept.executor = None;
    }
    rendered.map(Some)
}

fn render_with(
    open: &OpenScene,
    request: &RenderRequest,
    control: &Control<'_>,
    kept: &mut Option<(TracerConfig, Tracer)>,
    executor: Option<&mut Executor>,
) -> Result<Rendered, Error> {
    let start = Instant::now();
    let scene = &open.scene;
    let tracer = kept_tracer(kept, open, request)?;
    let build_ms = millis(start.elapsed());
    let prepare_start = Instant::now();
    let materials = open.materials();
    let lights = Lights::new(scene, &materials);
    let renderer = Renderer::new(scene, tracer, &materials, &lights, request.settings.clone());
    let caches = open
        .stored
        .as_ref()
        .map(|stored| paged::caches((stored, open.triangles_beside_pages()), request, materials.most_tiles()))
        .transpose()?;
    let renderer = match (&open.stored, &caches) {
        (Some(stored), Some(caches)) => renderer.with_pages(paged::through(stored, caches, &request.paging)),
        _ => renderer,
    };
    let ids = Ids::new(scene, &request.aovs);
    let adapter = executor.as_ref().map(|executor| executor.adapter().name.clone());
    let worker = match executor {
        None => Worker::Cpu(&renderer),
        Some(executor) => {
            let compiling = |p: CompileProgress| (control.progress)(&Progress::compiling(request, p));
            Worker::on_gpu(executor, &renderer, &mut { compiling })?
        }
    };
    let prepare_ms = millis(prepare_start.elapsed());

    let mut film = Film::new(film_settings(request, worker.tiles(caches.is_some())));
    let deadline = request.time_limit.and_then(|limit| start.checked_add(limit));
    let store_bytes = open.stored.as_ref().and_then(|stored| stored.source.bytes().ok()).unwrap_or(0);
    let residency = || caches.as_ref().map(|caches| Residency::new(caches, store_bytes));
    let progress = |p: &Progress| (control.progress)(&Progress { residency: residency(), ..*p });
    let watched = Control { cancel: control.cancel, progress: &progress };
    let run = Run::new(&worker, &ids, request, &watched, deadline)?;
    let outcome = run.all_passes(&mut film)?;
    let total = outcome.cost;
    let stats = Stats {
        device: if adapter.is_some() { "gpu" } else { "cpu" },
        adapter,
        fallback: None,
        simd: tracer.level().name(),
        threads: rayon::current_num_threads(),
        scene: SceneCounts::new(scene),
        width: request.settings.width,
        height: request.settings.height,
        spp: request.spp,
        spp_done: outcome.spp,
        passes: outcome.passes,
        ending: outcome.ending,
        samples: total.samples,
        non_finite: total.non_finite,
        rays: total.rays,
        shadow_rays: total.shadow_rays,
        build_ms,
        prepare_ms,
        first_pass_ms: outcome.first_pass_ms,
        render_ms: outcome.render_ms,
        msamples_per_s: total.samples as f64 / (outcome.render_ms * 1e3).max(1e-9),
        structure_bytes: tracer.report().bytes,
        peak_rss_bytes: peak_rss_bytes(),
        paging: caches.as_ref().map(PagingStats::new),
        gpu_paging: worker.gpu_paging(),
    };
    Ok(Rendered { film, mattes: ids.mattes(), stats })
}

/// The structures that rays are traced through.
pub(crate) fn tracer_of(open: &OpenScene, request: &RenderRequest) -> Result<Tracer, Error> {
    let tracer = match &open.stored {
        None => Tracer::new(&open.scene, &request.tracer),
        Some(stored) => {
            paged::check((stored, open.triangles_beside_pages()), request)?;
            Tracer::over_pages(&open.scene, stored.meshes.clone(), &request.tracer)
        }
    };
    tracer.map_err(|e| Error::new(ErrorClass::Usage, e.to_string(), "--accel", ""))
}

/// A picture of a scene in pages that is forgotten: what it cost, and how long it took.
pub(crate) fn frame(
    renderer: &Renderer<'_>,
    ids: &Ids,
    request: &RenderRequest,
    control: &Control<'_>,
) -> Result<(RenderStats, f64), Error> {
    let mut film = Film::new(film_settings(request, Tiles::InPages));
    let worker = Worker::Cpu(renderer);
    let outcome = Run::new(&worker, ids, request, control, None)?.all_passes(&mut film)?;
    Ok((outcome.cost, outcome.render_ms))
}

fn millis(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// Edge of the film's tiles: large for long batches, smaller where threads would wait for each other. A device takes one
/// after the other, and they are large in any case.
fn tile_size(pixels: u64, threads: usize, tiles: Tiles) -> u32 {
    let (sizes, each): (&[u32], _) = match tiles {
        Tiles::InMemory => (&[64, 32], 8 * threads),
        Tiles::InPages => (&[384, 256, 128, 64, 32], threads),
        Tiles::OnDevice => (&[512], 0),
    };
    sizes.iter().copied().find(|&n| pixels / u64::from(n * n) >= each as u64).unwrap_or(16)
}

pub(crate) fn film_settings(request: &RenderRequest, tiles: Tiles) -> FilmSettings {
    let settings = &request.settings;
    let region = settings.region();
    FilmSettings {
        full_size: [settings.width, settings.height],
        window: Window { x0: region.min[0], y0: region.min[1], x1: region.max[0], y1: region.max[1] },
        tile_size: tile_size(region.pixels(), rayon::current_num_threads(), tiles),
        aovs: request.aovs.clone(),
    }
}

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
struct Run<'r, 'w> {
    worker: &'r Worker<'w>,
    ids: &'r Ids,
    request: &'r RenderRequest,
    control: &'r Control<'r>,
    start: Instant,
    deadline: Option<Instant>,
    photons: Option<PhotonPlan>,
    samples: AtomicU64,
    samples_total: u64,
}

/// What all passes came to.
struct Outcome {
    cost: RenderStats,
    spp: u32,
    passes: u32,
    ending: Ending,
    first_pass_ms: f64,
    render_ms: f64,
}

impl<'r, 'w> Run<'r, 'w> {
    fn new(
        worker: &'r Worker<'w>,
        ids: &'r Ids,
        request: &'r RenderRequest,
        control: &'r Control<'r>,
        deadline: Option<Instant>,
    ) -> Result<Self, Error> {
        let samples_total = request.settings.region().pixels() * u64::from(request.spp);
        let (start, samples) = (Instant::now(), AtomicU64::new(0));
        let photons = worker.photon_plan()?;
        Ok(Self { worker, ids, request, control, start, deadline, photons, samples, samples_total })
    }

    fn all_passes(&self, film: &mut Film) -> Result<Outcome, Error> {
        let mut schedule = PassSchedule::new(self.request.spp);
        let mut outcome = Outcome {
            cost: RenderStats::default(),
            spp: 0,
            passes: 0,
            ending: Ending::Complete,
            first_pass_ms: 0.0,
            render_ms: 0.0,
        };
        while let Some(samples) = schedule.next(self.start.elapsed(), self.time_left()) {
            let last = samples.end;
            let may_stop = samples.start > 0;
            outcome.cost += self.pass(film, samples, outcome.spp, may_stop)?;
            if self.is_to_stop(may_stop) {
                break;
            }
            outcome.spp = last;
            outcome.passes += 1;
            if outcome.passes == 1 {
                outcome.first_pass_ms = millis(self.start.elapsed());
            }
        }
        outcome.ending = self.ending(outcome.spp);
        outcome.render_ms = millis(self.start.elapsed());
        Ok(outcome)
    }

    /// Adds the given samples to every tile, each under photons of its own where there are any.
    fn pass(
        &self,
        film: &mut Film,
        samples: std::ops::Range<u32>,
        spp: u32,
        may_stop: bool,
    ) -> Result<RenderStats, Error> {
        let Some(plan) = &self.photons else { return self.tiles(film, None, samples, spp, may_stop) };
        let mut cost = RenderStats::default();
        for sample in samples {
            if self.is_to_stop(may_stop) {
                break;
            }
            let (photons, rays) = self.worker.photons(plan, sample)?;
            cost.rays += rays;
            cost += self.tiles(film, Some(&photons), sample..sample + 1, spp, may_stop)?;
        }
        Ok(cost)
    }

    /// Adds the given samples to every tile. Tiles are skipped once the render is to stop.
    fn tiles(
        &self,
        film: &mut Film,
        photons: Option<&PhotonMaps>,
        samples: std::ops::Range<u32>,
        spp: u32,
        may_stop: bool,
    ) -> Result<RenderStats, Error> {
        let reporting = Mutex::new(());
        let tile_cost = |tile: &mut FilmTile| {
            if self.is_to_stop(may_stop) {
                return Ok(RenderStats::default());
            }
            let window = tile.window();
            let region = Tile { min: [window.x0, window.y0], max: [window.x1, window.y1] };
            let mut sink = TileSink { tile, ids: self.ids };
            let cost = self.worker.render_tile(photons, region, samples.clone(), &mut sink)?;
            self.samples.fetch_add(cost.samples, Ordering::Relaxed);
            if let Ok(_one_at_a_time) = reporting.try_lock() {
                (self.control.progress)(&self.progress(spp));
            }
            Ok(cost)
        };
        let add = |mut a: RenderStats, b| {
            a += b;
            Ok(a)
        };
        film.tiles_mut().par_iter_mut().with_max_len(1).map(tile_cost).try_reduce(RenderStats::default, add)
    }

    /// Whether what is begun is to be finished and nothing more. The first pass goes on beyond the time limit.
    fn is_to_stop(&self, may_stop: bool) -> bool {
        self.cancelled() || (may_stop && self.out_of_time())
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

    fn ending(&self, spp: u32) -> Ending {
        if spp == self.request.spp {
            Ending::Complete
        } else if self.cancelled() {
            Ending::Interrupted
        } else {
            Ending::TimeLimit
        }
    }

    fn progress(&self, spp: u32) -> Progress {
        let samples = self.samples.load(Ordering::Relaxed);
        let elapsed = self.start.elapsed();
        let to_go = self.samples_total.saturating_sub(samples) as f64 / samples.max(1) as f64;
        let by_samples = Duration::try_from_secs_f64(elapsed.as_secs_f64() * to_go).unwrap_or(Duration::MAX);
        let remaining = self.time_left().map_or(by_samples, |left| left.min(by_samples));
        let samples_total = self.samples_total;
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
