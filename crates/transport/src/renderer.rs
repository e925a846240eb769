//! The renderer: joins scene, tracer, materials and lights, and renders tiles.

use crate::ao::AmbientOcclusion;
use crate::camera::CameraRays;
use crate::light::Lights;
use crate::material::MaterialTable;
use crate::path::PathTracing;
use crate::primary::Primary;
use crate::sample::{RenderStats, SampleSink};
use crate::settings::{Integrator, RenderSettings, Tile};
use crate::veil::VeilIndex;
use crate::wavefront::{Context, Shade, Wave};
use std::cell::Cell;
use std::ops::Range;
use vastlight_scene::Scene;
use vastlight_trace::Tracer;

/// Paths that one thread keeps in flight: enough to amortise a stage, few enough for the second-level cache.
const WAVE_PATHS: u64 = 4096;

thread_local! {
    /// Queues of the last tile that this thread has rendered: their memory is used again.
    static WAVE: Cell<Wave> = Cell::default();
}

/// Renders tiles of one picture. Shared by all threads; each call of [`Renderer::render_tile`] works on its own.
#[derive(Debug)]
pub struct Renderer<'a> {
    scene: &'a Scene,
    tracer: &'a Tracer,
    materials: &'a MaterialTable<'a>,
    lights: &'a Lights<'a>,
    settings: RenderSettings,
    camera: CameraRays,
    veils: VeilIndex,
}

impl<'a> Renderer<'a> {
    /// A renderer of `scene`. Tracer, materials and lights must have been made for the same scene.
    #[must_use]
    pub fn new(
        scene: &'a Scene,
        tracer: &'a Tracer,
        materials: &'a MaterialTable<'a>,
        lights: &'a Lights<'a>,
        settings: RenderSettings,
    ) -> Self {
        let camera = CameraRays::new(&settings);
        Self { scene, tracer, materials, lights, camera, veils: VeilIndex::new(scene, materials), settings }
    }

    /// What is rendered.
    #[must_use]
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Renders the samples numbered `samples` of every pixel of `tile` on the calling thread.
    ///
    /// Sample `i` of a pixel is a pure function of scene, settings, pixel and `i`: tiles and ranges may be cut in any
    /// way and rendered in any order. Samples that are not finite are counted and not handed on.
    pub fn render_tile(&self, tile: Tile, samples: Range<u32>, sink: &mut impl SampleSink) -> RenderStats {
        let s = &self.settings;
        match s.integrator {
            Integrator::Path => self.render_with(&PathTracing { direct_only: false }, tile, samples, sink),
            Integrator::Direct => self.render_with(&PathTracing { direct_only: true }, tile, samples, sink),
            Integrator::Primary => self.render_with(&Primary, tile, samples, sink),
            Integrator::Ao => {
                self.render_with(&AmbientOcclusion::new(self.scene, s.ao_distance), tile, samples, sink)
            }
        }
    }

    fn render_with<S: Shade>(
        &self,
        shade: &S,
        tile: Tile,
        samples: Range<u32>,
        sink: &mut impl SampleSink,
    ) -> RenderStats {
        let context = Context {
            scene: self.scene,
            tracer: self.tracer,
            materials: self.materials,
            lights: self.lights,
            settings: &self.settings,
            camera: &self.camera,
            veils: &self.veils,
        };
        let mut stats = RenderStats::default();
        let mut wave = WAVE.take();
        let count = u64::from(samples.end.saturating_sub(samples.start));
        let total = tile.pixels() * count;
        let start_of = |i: u64| {
            let (pixel, sample) = (i / count, i % count);
            let width = u64::from(tile.width());
            let [x, y] = tile.min;
            ([x + (pixel % width) as u32, y + (pixel / width) as u32], samples.start + sample as u32)
        };
        let mut first = 0;
        while first < total {
            let last = total.min(first + WAVE_PATHS);
            let results = wave.run(&context, shade, (first..last).map(start_of), &mut stats);
            for (i, sample) in (first..last).zip(results) {
                if sample.is_finite() {
                    sink.add(start_of(i).0, sample);
                } else {
                    stats.non_finite += 1;
                }
            }
            stats.samples += last - first;
            first = last;
        }
        WAVE.set(wave);
        stats
    }
}
