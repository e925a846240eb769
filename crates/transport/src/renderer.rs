//! The renderer: joins scene, tracer, materials and lights, and renders tiles.

use crate::ao::AmbientOcclusion;
use crate::camera::CameraRays;
use crate::light::Lights;
use crate::material::MaterialTable;
use crate::pages::{PageWalk, PagedGeometry, PagesError};
use crate::path::PathTracing;
use crate::photon::PhotonMaps;
use crate::placement::Placements;
use crate::primary::Primary;
use crate::sample::{RenderStats, SampleSink};
use crate::settings::{Integrator, RenderSettings, Tile};
use crate::steps::Steps;
use crate::stream::Stream;
use crate::veil::VeilIndex;
use crate::wavefront::{Batches, Context, Shade, Shaded, Starts, Wave};
use std::cell::Cell;
use std::ops::Range;
use vastlight_scene::Scene;
use vastlight_trace::Tracer;

/// Paths that one thread keeps in flight: enough to amortise a stage, few enough for the second-level cache.
const WAVE_PATHS: u64 = 4096;

thread_local! {
    /// Queues of the last tile that this thread has rendered: their memory is used again.
    static WAVE: Cell<Wave> = Cell::default();
    static STREAM: Cell<Stream> = Cell::default();
}

/// The settings with a camera that stands still, if they have no keys for the scene's open shutter.
fn with_keys(scene: &Scene, mut settings: RenderSettings) -> RenderSettings {
    if let Some(shutter) = scene.shutter().filter(|_| settings.camera_keys.is_empty()) {
        settings.camera_keys = vec![settings.camera.clone(); shutter.keys()];
    }
    settings
}

/// Some samples of the pixels of a tile.
struct Part {
    tile: Tile,
    samples: Range<u32>,
}

/// Renders tiles of one picture. Shared by all threads; each call of [`Renderer::render_tile`] works on its own.
#[derive(Debug)]
pub struct Renderer<'a> {
    pub(crate) scene: &'a Scene,
    tracer: &'a Tracer,
    pub(crate) materials: &'a MaterialTable<'a>,
    pub(crate) lights: &'a Lights<'a>,
    settings: RenderSettings,
    pub(crate) camera: CameraRays,
    pub(crate) veils: VeilIndex,
    pub(crate) placements: Placements,
    pub(crate) pages: Option<PagedGeometry<'a>>,
}

impl<'a> Renderer<'a> {
    /// A renderer of `scene`. Tracer, materials and lights must have been made for the same scene. A camera without keys stands still in an
    /// open shutter.
    #[must_use]
    pub fn new(
        scene: &'a Scene,
        tracer: &'a Tracer,
        materials: &'a MaterialTable<'a>,
        lights: &'a Lights<'a>,
        settings: RenderSettings,
    ) -> Self {
        let settings = with_keys(scene, settings);
        let camera = CameraRays::new(&settings);
        let veils = VeilIndex::new(scene, materials);
        let placements = Placements::new(scene);
        Self { scene, tracer, materials, lights, camera, veils, placements, pages: None, settings }
    }

    /// The same for a scene whose meshes are in pages: the tracer must have been made over these.
    #[must_use]
    pub fn with_pages(self, pages: PagedGeometry<'a>) -> Self {
        Self { pages: Some(pages), ..self }
    }

    /// Goes on with other settings: another camera, size or integrator of the same scene.
    pub fn use_settings(&mut self, settings: RenderSettings) {
        let settings = with_keys(self.scene, settings);
        self.camera = CameraRays::new(&settings);
        self.settings = settings;
    }

    /// What rays are traced through.
    #[must_use]
    pub fn tracer(&self) -> &Tracer {
        self.tracer
    }

    /// What is rendered.
    #[must_use]
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// How far ambient occlusion sees, scene units.
    #[must_use]
    pub fn ao_distance(&self) -> f32 {
        crate::ao::distance(self.scene, self.settings.ao_distance)
    }

    /// Renders the samples numbered `samples` of every pixel of `tile` on the calling thread.
    ///
    /// Sample `i` of a pixel is a pure function of scene, settings, pixel and `i`: tiles and ranges may be cut in any
    /// way and rendered in any order. Samples that are not finite are counted and not handed on.
    ///
    /// # Errors
    /// A page of a scene in pages cannot be had. The whole integrator `whitted` has no walk through pages: it meets nothing there.
    pub fn render_tile(
        &self,
        tile: Tile,
        samples: Range<u32>,
        sink: &mut impl SampleSink,
    ) -> Result<RenderStats, PagesError> {
        self.render_tile_under(None, tile, samples, sink)
    }

    /// [`Renderer::render_tile`] under the light of photons.
    ///
    /// # Errors
    /// Those of [`Renderer::render_tile`].
    pub fn render_tile_under(
        &self,
        photons: Option<&PhotonMaps>,
        tile: Tile,
        samples: Range<u32>,
        sink: &mut impl SampleSink,
    ) -> Result<RenderStats, PagesError> {
        let (s, context) = (&self.settings, self.context(photons));
        let part = Part { tile, samples };
        match s.integrator {
            Integrator::Path => self.render_waves(&PathTracing { direct_only: false }, &context, part, sink),
            Integrator::Direct => self.render_waves(&PathTracing { direct_only: true }, &context, part, sink),
            Integrator::Primary => self.render_waves(&Primary, &context, part, sink),
            Integrator::Ao => {
                let shade = AmbientOcclusion::new(self.scene, s.ao_distance);
                self.render_waves(&shade, &context, part, sink)
            }
            Integrator::Steps => self.render_waves(&Steps, &context, part, sink),
            Integrator::Whitted | Integrator::PhotonCaustics => {
                let mut stream = STREAM.take();
                let stats = self.render_with(&mut stream, &context, part, sink);
                STREAM.set(stream);
                stats
            }
        }
    }

    fn render_waves<S: Shade>(
        &self,
        shade: &S,
        context: &Context<'_>,
        part: Part,
        sink: &mut impl SampleSink,
    ) -> Result<RenderStats, PagesError> {
        let mut waves = Shaded { wave: WAVE.take(), shade };
        waves.wave.walk_through(self.walk()?);
        let stats = self.render_with(&mut waves, context, part, sink);
        waves.wave.walk_through(None);
        WAVE.set(waves.wave);
        stats
    }

    pub(crate) fn walk(&self) -> Result<Option<PageWalk>, PagesError> {
        Ok(match self.pages {
            Some(pages) => Some(PageWalk::new(&pages, self.materials)?),
            None => None,
        })
    }

    /// What every stage reads.
    pub(crate) fn context<'c>(&'c self, photons: Option<&'c PhotonMaps>) -> Context<'c> {
        Context {
            scene: self.scene,
            tracer: self.tracer,
            materials: self.materials,
            lights: self.lights,
            settings: &self.settings,
            camera: &self.camera,
            veils: &self.veils,
            placements: &self.placements,
            photons,
            pages: self.pages,
        }
    }

    fn render_with(
        &self,
        batches: &mut impl Batches,
        context: &Context<'_>,
        Part { tile, samples }: Part,
        sink: &mut impl SampleSink,
    ) -> Result<RenderStats, PagesError> {
        let mut stats = RenderStats::default();
        let starts = Starts::new(tile, samples);
        let wave_paths = self.pages.map_or(WAVE_PATHS, |pages| pages.wave_paths.max(1));
        let mut first = 0;
        while first < starts.len() {
            let last = starts.len().min(first + wave_paths);
            let mut results = batches.run(context, starts.runs(first..last), &mut stats)?.iter();
            for run in starts.runs(first..last) {
                for sample in results.by_ref().take(run.samples.len()) {
                    if sample.is_finite() {
                        sink.add(run.pixel, sample);
                    } else {
                        stats.non_finite += 1;
                    }
                }
            }
            stats.samples += last - first;
            first = last;
        }
        Ok(stats)
    }
}
