//! What a render computes on.

use crate::{Error, ErrorClass, RenderRequest};
use std::str::FromStr;
use std::sync::{Mutex, MutexGuard, PoisonError};
use vastlight_accel::kdtree::KdKind;
use vastlight_gpu::page::PageStats;
use vastlight_gpu::path::{DeviceRenderer, is_stream, kernels};
use vastlight_gpu::{AdapterKind, CompileProgress, DeviceChoice, Drivers, Executor, GpuError};
use vastlight_trace::{Layout, TracerConfig};
use vastlight_transport::photon::{PhotonMaps, PhotonPlan};
use vastlight_transport::{Integrator, RenderStats, Renderer, SampleSink, Tile};

/// Where to render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Device {
    /// A graphics card where there is one that can do the work, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The adapter of this number, or the first usable one; software adapters too.
    Gpu(Option<u32>),
}

impl Device {
    /// The adapter that is asked for; none for the CPU, and where the choice is free.
    #[must_use]
    pub fn adapter(self) -> Option<DeviceChoice> {
        match self {
            Self::Auto | Self::Cpu => None,
            Self::Gpu(number) => Some(number.map_or(DeviceChoice::Any, DeviceChoice::Index)),
        }
    }
}

impl FromStr for Device {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.strip_prefix("gpu:")?.parse().ok();
        match text {
            "auto" => Ok(Self::Auto),
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu(None)),
            _ => number(text).map(|number| Self::Gpu(Some(number))).ok_or_else(|| {
                "known are auto, cpu, gpu and gpu:N with a number of `vastlight devices`".to_owned()
            }),
        }
    }
}

/// What is asked of devices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceRequest {
    /// Where to render.
    pub device: Device,
    /// Most bytes on a graphics processor; `None` for what it has.
    pub gpu_memory: Option<u64>,
    /// Goes on on the CPU where the graphics processor fails. [`Device::Auto`] does so in any case.
    pub fallback: bool,
}

/// Paths in flight: as many as hide the latency of a card, or as few as stay in the caches behind a software adapter.
#[must_use]
pub fn paths_in_flight(executor: &Executor) -> u32 {
    if executor.adapter().kind == AdapterKind::Software { 1 << 16 } else { 1 << 19 }
}

impl DeviceRequest {
    /// Whether the CPU takes over where a graphics processor fails.
    #[must_use]
    pub fn falls_back(&self) -> bool {
        self.fallback || self.device == Device::Auto
    }

    /// For work that no graphics processor can do: an error if one was asked for.
    pub(crate) fn refuse(&self, what: &str) -> Result<(), Error> {
        match self.device {
            Device::Auto | Device::Cpu => Ok(()),
            Device::Gpu(_) => Err(Error::new(ErrorClass::Device, what, "--device gpu", "use --device cpu")),
        }
    }

    /// The graphics processor for a request; none for the CPU.
    ///
    /// # Errors
    /// The adapter that was asked for is not there or not usable.
    pub(crate) fn open(&self) -> Result<Option<Executor>, Error> {
        if let Some(choice) = self.device.adapter() {
            return Ok(Some(Executor::open(choice, self.gpu_memory)?));
        }
        if self.device == Device::Cpu || !Drivers::may_have_hardware() {
            return Ok(None);
        }
        match Executor::open(DeviceChoice::Hardware, self.gpu_memory) {
            Err(GpuError::NoAdapter | GpuError::NoSuchKind { .. }) => Ok(None),
            executor => Ok(Some(executor?)),
        }
    }
}

/// The structures that the kernels of a request need: the stream tracer's threaded kd-trees, else pages. Hits do not depend on it.
pub(crate) fn structures(request: &RenderRequest) -> TracerConfig {
    let given = request.tracer.clone();
    if !is_stream(request.settings.integrator) {
        return TracerConfig { layout: Layout::Compact, ..given };
    }
    let is_threaded = KdKind::from_name(&given.accel).is_some_and(|kind| !kind.stacked);
    let accel = if is_threaded { given.accel.clone() } else { "kd-threaded".to_owned() };
    TracerConfig { accel, layout: Layout::default(), ..given }
}

/// An error where photons are wanted that graphics processors do not send: those of paths, and those that do not begin at point and
/// spot lights.
fn check_photons(renderer: &Renderer<'_>) -> Result<(), Error> {
    let is_refused = |what| {
        let hint = "use --device cpu, or --gpu-fallback";
        Err(Error::new(ErrorClass::Device, what, "--device gpu", hint))
    };
    match (renderer.settings().caustics.is_some(), renderer.settings().integrator) {
        (false, _) => Ok(()),
        (true, Integrator::PhotonCaustics) if renderer.has_photon_grid() => Ok(()),
        (true, Integrator::PhotonCaustics) => is_refused(
            "graphics processors send photons from point and spot lights alone; the scene has none",
        ),
        (true, _) => is_refused("graphics processors send no photons for paths yet"),
    }
}

fn lock<'l, 'r>(renderer: &'l Mutex<DeviceRenderer<'r>>) -> MutexGuard<'l, DeviceRenderer<'r>> {
    renderer.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where tiles are rendered, which decides how large they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tiles {
    /// On a thread each, of scenes in memory.
    InMemory,
    /// On a thread each, of scenes in pages.
    InPages,
    /// One after the other, on a graphics processor.
    OnDevice,
}

/// Renders tiles, wherever that is.
pub(crate) enum Worker<'r> {
    /// On the calling thread.
    Cpu(&'r Renderer<'r>),
    /// On a graphics processor, one tile after the other.
    Gpu(Box<Mutex<DeviceRenderer<'r>>>),
}

impl<'r> Worker<'r> {
    /// Brings a renderer to a graphics processor; `progress` is told of every kernel that is compiled.
    ///
    /// # Errors
    /// The scene does not fit, or a kernel does not compile.
    pub(crate) fn on_gpu(
        executor: &'r mut Executor,
        renderer: &'r Renderer<'r>,
        progress: &mut dyn FnMut(CompileProgress),
    ) -> Result<Self, Error> {
        check_photons(renderer)?;
        executor.prepare(kernels(renderer.settings().integrator), progress)?;
        let capacity = paths_in_flight(executor);
        Ok(Self::Gpu(Box::new(Mutex::new(DeviceRenderer::new(executor, renderer, capacity)?))))
    }

    /// What tiles it likes.
    pub(crate) fn tiles(&self, paged: bool) -> Tiles {
        match self {
            Self::Gpu(_) => Tiles::OnDevice,
            Self::Cpu(_) if paged => Tiles::InPages,
            Self::Cpu(_) => Tiles::InMemory,
        }
    }

    /// The pages that were brought to a graphics processor.
    pub(crate) fn gpu_paging(&self) -> Option<PageStats> {
        match self {
            Self::Cpu(_) => None,
            Self::Gpu(renderer) => Some(lock(renderer).page_stats()),
        }
    }

    /// Where photons begin; none where the settings want none.
    pub(crate) fn photon_plan(&self) -> Result<Option<PhotonPlan>, Error> {
        match self {
            Self::Cpu(renderer) => Ok(renderer.photon_plan()?),
            Self::Gpu(renderer) => Ok(lock(renderer).renderer().photon_plan()?),
        }
    }

    /// The photons of the sample of this number, by all threads, and their rays. Those of a graphics processor stay there.
    pub(crate) fn photons(&self, plan: &PhotonPlan, sample: u32) -> Result<(PhotonMaps, u64), Error> {
        match self {
            Self::Cpu(renderer) => Ok(renderer.photon_maps(plan, sample)?),
            Self::Gpu(renderer) => {
                Ok((PhotonMaps::default(), lock(renderer).send_photons(plan, sample)?.rays))
            }
        }
    }

    /// Renders the samples numbered `samples` of every pixel of `tile`, under the light of photons if there are any.
    pub(crate) fn render_tile(
        &self,
        photons: Option<&PhotonMaps>,
        tile: Tile,
        samples: std::ops::Range<u32>,
        sink: &mut impl SampleSink,
    ) -> Result<RenderStats, Error> {
        match self {
            Self::Cpu(renderer) => Ok(renderer.render_tile_under(photons, tile, samples, sink)?),
            Self::Gpu(renderer) => Ok(lock(renderer).render_tile(tile, samples, sink)?),
        }
    }
}
