//! The wavefront: many paths advance together, one stage at a time (Laine, Karras, Aila 2013, "Megakernels considered
//! harmful"): trace all rays, shade all hits, trace all shadow rays, keep the paths that go on.
//!
//! A wave belongs to one thread. What a path computes depends on its pixel, sample and the settings alone, never on
//! its neighbours in the wave.

mod queues;

pub(crate) use queues::{PathState, ShadowQueue};

use crate::alpha::AlphaFilter;
use crate::camera::{CameraRandom, CameraRays};
use crate::light::Lights;
use crate::material::MaterialTable;
use crate::sample::{RenderStats, Sample};
use crate::settings::RenderSettings;
use crate::veil::VeilIndex;
use vastlight_math::{Ray, Sampler, rng};
use vastlight_scene::Scene;
use vastlight_trace::{AcceptAll, Hit, Tracer};

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
}

/// The shading stage of an integrator.
pub(crate) trait Shade: Sync {
    /// Shades one hit or miss: adds to the sample, may queue shadow rays, and returns the next ray of a path that
    /// goes on. `depth` counts segments from the camera, this ray's included.
    fn shade(&self, at: ShadeInput<'_>, path: &mut PathState, shadows: &mut ShadowQueue) -> Option<Ray>;
}

/// One ray and what it met.
pub(crate) struct ShadeInput<'a> {
    pub(crate) context: &'a Context<'a>,
    pub(crate) depth: u32,
    pub(crate) ray: Ray,
    pub(crate) hit: Hit,
    pub(crate) sample: &'a mut Sample,
}

/// Sampler dimensions of a whole path: filter, lens, time, wavelength.
pub(crate) const CAMERA_DIMENSIONS: u32 = 4;

/// Which of them is the wavelength.
pub(crate) const WAVELENGTH_DIMENSION: u32 = 3;

/// Paths in flight.
#[derive(Debug, Default)]
pub(crate) struct Wave {
    paths: Vec<PathState>,
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    keys: Vec<u32>,
    shadows: ShadowQueue,
    samples: Vec<Sample>,
}

impl Wave {
    /// Starts a path for every pixel and sample, in this order, and follows all to their end.
    pub(crate) fn run<S: Shade>(
        &mut self,
        context: &Context<'_>,
        shade: &S,
        starts: impl Iterator<Item = ([u32; 2], u32)>,
        stats: &mut RenderStats,
    ) -> &[Sample] {
        self.generate(context, starts);
        let mut depth = 1;
        while !self.paths.is_empty() {
            stats.rays += self.rays.len() as u64;
            self.trace(context, depth);
            self.shade(context, shade, depth);
            stats.shadow_rays += self.shadows.len() as u64;
            self.shadows.trace(context, &mut self.samples);
            depth += 1;
        }
        &self.samples
    }

    fn generate(&mut self, context: &Context<'_>, starts: impl Iterator<Item = ([u32; 2], u32)>) {
        self.paths.clear();
        self.rays.clear();
        self.samples.clear();
        let seed = context.settings.seed;
        for (slot, (pixel, sample)) in (0_u32..).zip(starts) {
            let mut sampler = Sampler::new(pixel, sample, seed);
            let random =
                CameraRandom { filter: sampler.next_2d(), lens: sampler.next_2d(), time: sampler.next_1d() };
            let key = (rng::hash_words(&[pixel[0], pixel[1], sample, seed]) >> 32) as u32;
            self.rays.push(context.camera.ray(pixel, random));
            self.paths.push(PathState::new(slot, sampler, key));
            self.samples.push(Sample::MISS);
        }
    }

    fn trace(&mut self, context: &Context<'_>, depth: u32) {
        self.hits.clear();
        self.hits.resize(self.rays.len(), Hit::MISS);
        if !context.veils.any().alpha {
            context.tracer.closest(&self.rays, &AcceptAll, &mut self.hits);
            return;
        }
        self.keys.clear();
        self.keys.extend(self.paths.iter().map(|p| p.alpha_key(depth)));
        let filter = AlphaFilter { context, keys: &self.keys };
        context.tracer.closest(&self.rays, &filter, &mut self.hits);
    }

    /// Shades all hits; paths that go on move to the front, in their order.
    fn shade<S: Shade>(&mut self, context: &Context<'_>, shade: &S, depth: u32) {
        self.shadows.clear();
        let mut alive = 0;
        for i in 0..self.paths.len() {
            let mut path = self.paths[i];
            let input = ShadeInput {
                context,
                depth,
                ray: self.rays[i],
                hit: self.hits[i],
                sample: &mut self.samples[path.slot as usize],
            };
            if let Some(next) = shade.shade(input, &mut path, &mut self.shadows) {
                self.rays[alive] = next;
                self.paths[alive] = path;
                alive += 1;
            }
        }
        self.rays.truncate(alive);
        self.paths.truncate(alive);
    }
}
