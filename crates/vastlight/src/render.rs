//! What is asked for and what comes out: the way from a scene and a request to sums and figures.

use crate::checkpoint::{Checkpoint, restore};
use crate::device::{Device, DeviceRequest, Tiles, Worker, structures};
use crate::ids::Ids;
use crate::paged::{KeptCaches, PagingRequest, kept_caches, kept_pool};
use crate::recipe::recipe;
use crate::run::Run;
use crate::session::{Kept, kept_tracer};
use crate::stats::{PagingStats, Residency, SceneCounts, Stats};
use crate::{Error, ErrorClass, OpenScene, paged, peak_rss_bytes, shutter};
use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use vastlight_film::{Accumulator, Aov, FilmSettings, Picture, Recipe, Window};
use vastlight_gpu::{CompileProgress, Executor};
use vastlight_trace::{Tracer, TracerConfig};
use vastlight_transport::{Integrator, Lights, RenderSettings, RenderStats, Renderer};

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
    /// Only the samples of these numbers, which count from 0; `None` for all.
    pub passes: Option<Range<u32>>,
    /// Parts of the picture are done when their relative error, estimated, is at most this: the root of `relmse`. Then
    /// [`spp`](Self::spp) is the most that they get.
    pub noise: Option<f32>,
    /// Where the picture is kept while it is under way.
    pub checkpoint: Option<Checkpoint>,
    /// Whether the sums are to go into a file, and must say what they are sums of.
    pub keep_recipe: bool,
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
            passes: None,
            noise: None,
            checkpoint: None,
            keep_recipe: false,
        }
    }

    /// The samples that are asked for.
    pub(crate) fn wanted(&self) -> Range<u32> {
        self.passes.clone().unwrap_or(0..self.spp)
    }

    fn check(&self) -> Result<(), Error> {
        if self.passes.is_some() && self.noise.is_some() {
            let hint = "render all passes in one run, or leave --noise out";
            return Err(Error::usage("which parts are done shows in all passes together", "--noise", hint));
        }
        let wanted = self.wanted();
        if wanted.is_empty() || wanted.end > self.spp {
            let what = format!("passes are numbered from 1 to {}, the samples a pixel", self.spp);
            return Err(Error::usage(what, "--passes", "see --spp"));
        }
        Ok(())
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
    /// How the picture is looked at while it is under way.
    pub snapshot: Option<Snapshot<'c>>,
}

/// How a picture is looked at while it is under way.
#[derive(Clone, Copy)]
pub struct Snapshot<'c> {
    /// Set to see it soon; it is reset.
    pub wanted: &'c AtomicBool,
    /// Called with the picture so far, while no tile is rendered.
    pub take: &'c (dyn Fn(&Accumulator) + Sync),
}

impl std::fmt::Debug for Snapshot<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Snapshot").field("wanted", &self.wanted).finish_non_exhaustive()
    }
}

impl<'c> Control<'c> {
    /// Without snapshots.
    pub fn new(cancel: &'c AtomicBool, progress: &'c (dyn Fn(&Progress) + Sync)) -> Self {
        Self { cancel, progress, snapshot: None }
    }
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
    pub sums: Accumulator,
    /// What it cost.
    pub stats: Stats,
}

impl Rendered {
    /// The picture: linear means of all planes.
    #[must_use]
    pub fn develop(&self) -> Picture {
        self.sums.develop()
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
    shutter::check(&open.scene, request)?;
    let fallback = match on_graphics_processor(open, request, control, kept) {
        Ok(Some(rendered)) => return Ok(rendered),
        Ok(None) => None,
        Err(error) if error.class == ErrorClass::Device && request.device.falls_back() => {
            Some(error.to_string())
        }
        Err(error) => return Err(error),
    };
    let pool = open.stored.is_some().then(|| kept_pool(&mut kept.pool, &request.paging)).transpose()?;
    let parts = (&mut kept.tracer, &mut kept.caches);
    let here = || render_with(open, request, control, parts, None);
    let rendered = match pool {
        Some(pool) => pool.install(here),
        None => here(),
    };
    if rendered.is_err() {
        kept.caches = None;
    }
    let mut rendered = rendered?;
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
    if request.settings.integrator == Integrator::Steps {
        return request.device.refuse("steps are counted on the ways of the CPU's rays").map(|()| None);
    }
    if open.scene.shutter().is_some() {
        return Ok(None);
    }
    if open.triangles_beside_pages() > 0 {
        let what = "meshes that deform beside the pages of a store are rendered by the CPU alone";
        return request.device.refuse(what).map(|()| None);
    }
    if request.device.device == Device::Cpu {
        return Ok(None);
    }
    if kept.executor.as_ref().is_none_or(|(opened_for, _)| *opened_for != request.device) {
        kept.executor = None;
        kept.executor = request.device.open()?.map(|executor| (request.device, executor));
    }
    let Kept { tracer, executor: Some((_, executor)), caches, .. } = kept else { return Ok(None) };
    let request = RenderRequest { tracer: structures(request), ..request.clone() };
    let rendered = render_with(open, &request, control, (tracer, caches), Some(executor));
    if rendered.is_err() {
        // A device that failed once is not trusted again.
        (kept.executor, kept.caches) = (None, None);
    }
    rendered.map(Some)
}

fn render_with(
    open: &OpenScene,
    request: &RenderRequest,
    control: &Control<'_>,
    (tracer, caches): (&mut Option<(TracerConfig, Tracer)>, &mut Option<KeptCaches>),
    executor: Option<&mut Executor>,
) -> Result<Rendered, Error> {
    request.check()?;
    let start = Instant::now();
    let scene = &open.scene;
    let tracer = kept_tracer(tracer, open, request)?;
    let build_ms = millis(start.elapsed());
    let prepare_start = Instant::now();
    let materials = open.materials();
    let lights = Lights::new(scene, &materials);
    let renderer = Renderer::new(scene, tracer, &materials, &lights, request.settings.clone());
    let caches = kept_caches(caches, open, request, materials.most_tiles())?;
    let paging_before = caches.map(PagingStats::new);
    let renderer = match (&open.stored, caches) {
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

    let settings = film_settings(request, worker.tiles(caches.is_some()));
    let mut sums = begin(open, request, adapter.as_deref(), settings, &ids)?;
    let deadline = request.time_limit.and_then(|limit| start.checked_add(limit));
    let store_bytes = open.stored.as_ref().and_then(|stored| stored.source.bytes().ok()).unwrap_or(0);
    let residency = || caches.map(|caches| Residency::new(caches, store_bytes));
    let progress = |p: &Progress| (control.progress)(&Progress { residency: residency(), ..*p });
    let watched = Control { progress: &progress, ..*control };
    let outcome = Run::new(&worker, &ids, request, &watched, deadline)?.all_passes(&mut sums)?;
    let counters = sums.counters;
    let pixels = request.settings.region().pixels();
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
        spp_done: sums.blocks().least(),
        spp_mean: sums.blocks().samples() as f64 / pixels.max(1) as f64,
        noise: request.noise,
        passes: sums.samples().len(),
        resumed_passes: outcome.resumed_passes,
        resumed_samples: outcome.resumed_samples,
        ending: outcome.ending,
        samples: counters.samples,
        non_finite: counters.non_finite,
        rays: counters.rays,
        shadow_rays: counters.shadow_rays,
        build_ms,
        prepare_ms,
        first_pass_ms: outcome.first_pass_ms,
        render_ms: outcome.render_ms,
        msamples_per_s: outcome.cost.samples as f64 / (outcome.render_ms * 1e3).max(1e-9),
        structure_bytes: tracer.report().bytes,
        peak_rss_bytes: peak_rss_bytes(),
        paging: caches.zip(paging_before).map(|(caches, before)| PagingStats::new(caches).since(&before)),
        gpu_paging: worker.gpu_paging(),
    };
    Ok(Rendered { sums, stats })
}

/// The sums that a render goes on with: those of its checkpoint, or none yet.
fn begin(
    open: &OpenScene,
    request: &RenderRequest,
    adapter: Option<&str>,
    settings: FilmSettings,
    ids: &Ids,
) -> Result<Accumulator, Error> {
    let is_kept = request.keep_recipe || request.checkpoint.is_some();
    let recipe = if is_kept { recipe(open, request, adapter)? } else { Recipe::default() };
    let new = Accumulator::new(settings, recipe, ids.mattes());
    match &request.checkpoint {
        Some(checkpoint) => restore(checkpoint, new, &request.wanted()),
        None => Ok(new),
    }
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
    let settings = film_settings(request, Tiles::InPages);
    let mut sums = Accumulator::new(settings, Recipe::default(), Vec::new());
    let worker = Worker::Cpu(renderer);
    let outcome = Run::new(&worker, ids, request, control, None)?.all_passes(&mut sums)?;
    Ok((outcome.cost, outcome.render_ms))
}

pub(crate) fn millis(duration: Duration) -> f64 {
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
        squares: request.noise.is_some(),
    }
}
