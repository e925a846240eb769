//! The wavefront: many paths advance together, one stage at a time (Laine, Karras, Aila 2013, "Megakernels considered
//! harmful"): trace all rays, shade all hits, trace all shadow rays, keep the paths that go on.
//!
//! A wave belongs to one thread. What a path computes depends on its pixel, sample and the settings alone, never on
//! its neighbours in the wave.

mod ahead;
mod front;
mod queues;
mod stage;
mod starts;

pub(crate) use front::Front;
pub(crate) use queues::{PathState, ShadowQueue};
pub(crate) use stage::{Shade, ShadeInput, Stage};
pub(crate) use starts::{Run, Starts};

use crate::camera::CameraRays;
use crate::light::Lights;
use crate::material::MaterialTable;
use crate::pages::{PageWalk, PagedGeometry};
use crate::photon::PhotonMaps;
use crate::placement::Placements;
use crate::sample::{RenderStats, Sample};
use crate::settings::RenderSettings;
use crate::veil::VeilIndex;
use vastlight_math::Ray;
use vastlight_paging::PageError;
use vastlight_scene::Scene;
use vastlight_simd::{Kernel, Simd8};
use vastlight_trace::Tracer;

/// What every stage reads.
#[derive(Debug)]
pub(crate) struct Context<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) tracer: &'a Tracer,
    pub(crate) materials: &'a MaterialTable<'a>,
    pub(crate) lights: &'a Lights<'a>,
    pub(crate) settings: &'a RenderSettings,
    pub(crate) camera: &'a CameraRays,
    pub(crate) veils: &'a VeilIndex,
    /// By instance.
    pub(crate) placements: &'a Placements,
    /// Light that mirrors and lenses bring, if paths leave that to photons.
    pub(crate) photons: Option<&'a PhotonMaps>,
    /// Where the meshes are, if not in memory.
    pub(crate) pages: Option<PagedGeometry<'a>>,
}

/// Computes samples, a batch of them at a time.
pub(crate) trait Batches {
    /// One sample for every sample of `runs`, in this order.
    fn run(
        &mut self,
        context: &Context<'_>,
        runs: impl Iterator<Item = Run>,
        stats: &mut RenderStats,
    ) -> Result<&[Sample], PageError>;
}

/// Sampler dimensions of a whole path: filter, lens, time, wavelength.
pub(crate) const CAMERA_DIMENSIONS: u32 = 4;

/// Which of them is the time.
pub(crate) const TIME_DIMENSION: u32 = 2;

/// Which of them is the wavelength.
pub(crate) const WAVELENGTH_DIMENSION: u32 = 3;

/// Paths in flight, and the memory of all queues.
#[derive(Debug, Default)]
pub(crate) struct Wave {
    /// By slot, for as long as the wave lasts.
    paths: Vec<PathState>,
    samples: Vec<Sample>,
    front: Front,
    /// The rays of the next stage and their slots.
    next_rays: Vec<Ray>,
    next_slots: Vec<u32>,
    met: Vec<u32>,
    shadows: ShadowQueue,
}

/// Waves with the shading of an integrator.
#[derive(Debug)]
pub(crate) struct Shaded<'s, S> {
    pub(crate) wave: Wave,
    pub(crate) shade: &'s S,
}

impl<S: Shade> Batches for Shaded<'_, S> {
    /// Starts a path for every sample, and follows all to their end.
    fn run(
        &mut self,
        context: &Context<'_>,
        runs: impl Iterator<Item = Run>,
        stats: &mut RenderStats,
    ) -> Result<&[Sample], PageError> {
        let Self { wave, shade } = self;
        wave.clear();
        context.tracer.level().dispatch(Generating { wave, context, runs });
        let mut depth = 1;
        while !wave.front.rays.is_empty() {
            stats.rays += wave.front.rays.len() as u64;
            wave.front.trace(context, &wave.paths, depth)?;
            context.tracer.level().dispatch(Shading { wave, context, shade: *shade, depth });
            stats.shadow_rays += wave.shadows.len() as u64;
            wave.shadows.trace(context, wave.front.walk.as_mut(), &mut wave.samples)?;
            depth += 1;
        }
        if let Some(walk) = &mut wave.front.walk {
            stats.tile_ns += walk.take_tile_time().as_nanos() as u64;
        }
        Ok(&wave.samples)
    }
}

impl Wave {
    fn clear(&mut self) {
        self.paths.clear();
        self.samples.clear();
        self.front.clear();
    }

    /// Starts a path for each sample of one pixel.
    #[inline(always)]
    fn generate(&mut self, context: &Context<'_>, run: Run) {
        let (pixel, cone) = (run.pixel, context.camera.cone());
        for (sampler, key) in run.starts(context.settings.seed) {
            let slot = self.paths.len() as u32;
            self.front.push(slot, context.camera.ray(pixel, context.camera.draw(sampler)));
            self.paths.push(PathState::new(slot, sampler, key, cone));
            self.samples.push(Sample::MISS);
        }
    }

    /// Goes through pages from now on, or through meshes in memory.
    pub(crate) fn walk_through(&mut self, walk: Option<PageWalk>) {
        self.front.walk = walk;
    }

    /// Shades all hits and collects the rays of the paths that go on.
    #[inline(always)]
    fn shade<L: Simd8, S: Shade>(&mut self, level: L, context: &Context<'_>, shade: &S, depth: u32) {
        self.shadows.clear();
        self.next_rays.clear();
        self.next_slots.clear();
        let mut stage = Stage {
            context,
            depth,
            rays: &self.front.rays,
            hits: &self.front.hits,
            pages: self.front.page_hits(),
            slots: &self.front.slots,
            paths: &mut self.paths,
            samples: &mut self.samples,
            shadows: &mut self.shadows,
            next_rays: &mut self.next_rays,
            next_slots: &mut self.next_slots,
            met: &mut self.met,
        };
        shade.shade(level, &mut stage);
        std::mem::swap(&mut self.front.rays, &mut self.next_rays);
        std::mem::swap(&mut self.front.slots, &mut self.next_slots);
    }
}

/// The first stage, compiled for the machine's instructions.
struct Generating<'w, 'c, R> {
    wave: &'w mut Wave,
    context: &'w Context<'c>,
    runs: R,
}

impl<R: Iterator<Item = Run>> Kernel for Generating<'_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Simd8>(self, _level: L) {
        for run in self.runs {
            self.wave.generate(self.context, run);
        }
    }
}

/// The shading stage, compiled for the machine's instructions.
struct Shading<'w, 'c, S> {
    wave: &'w mut Wave,
    context: &'w Context<'c>,
    shade: &'w S,
    depth: u32,
}

impl<S: Shade> Kernel for Shading<'_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Simd8>(self, level: L) {
        self.wave.shade(level, self.context, self.shade, self.depth);
    }
}
