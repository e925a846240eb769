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
use vastlight_simd::{Kernel, Simd8};
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

/// Paths in flight, and the memory of all queues.
#[derive(Debug, Default)]
pub(crate) struct Wave {
    /// By slot, for as long as the wave lasts.
    paths: Vec<PathState>,
    samples: Vec<Sample>,
    /// The rays to trace, the slots that they belong to, and what they met.
    rays: Vec<Ray>,
    slots: Vec<u32>,
    hits: Vec<Hit>,
    /// The rays of the next stage and their slots.
    next_rays: Vec<Ray>,
    next_slots: Vec<u32>,
    keys: Vec<u32>,
    shadows: ShadowQueue,
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
        while !self.rays.is_empty() {
            stats.rays += self.rays.len() as u64;
            self.trace(context, depth);
            context.tracer.level().dispatch(Shading { wave: self, context, shade, depth });
            stats.shadow_rays += self.shadows.len() as u64;
            self.shadows.trace(context, &mut self.samples);
            depth += 1;
        }
        &self.samples
    }

    fn generate(&mut self, context: &Context<'_>, starts: impl Iterator<Item = ([u32; 2], u32)>) {
        self.paths.clear();
        self.samples.clear();
        self.rays.clear();
        self.slots.clear();
        let seed = context.settings.seed;
        for (slot, (pixel, sample)) in (0_u32..).zip(starts) {
            let mut sampler = Sampler::new(pixel, sample, seed);
            let random =
                CameraRandom { filter: sampler.next_2d(), lens: sampler.next_2d(), time: sampler.next_1d() };
            let key = (rng::hash_words(&[pixel[0], pixel[1], sample, seed]) >> 32) as u32;
            self.rays.push(context.camera.ray(pixel, random));
            self.slots.push(slot);
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
        self.keys.extend(self.slots.iter().map(|&slot| self.paths[slot as usize].alpha_key(depth)));
        let filter = AlphaFilter { context, keys: &self.keys };
        context.tracer.closest(&self.rays, &filter, &mut self.hits);
    }

    /// Shades all hits and collects the rays of the paths that go on.
    #[inline(always)]
    fn shade<S: Shade>(&mut self, context: &Context<'_>, shade: &S, depth: u32) {
        self.shadows.clear();
        self.next_rays.clear();
        self.next_slots.clear();
        for i in 0..self.rays.len() {
            if i % WARM_AHEAD == 0 {
                let ahead = (i + WARM_AHEAD).min(self.hits.len());
                warm(context.scene, &self.hits[i..ahead]);
            }
            let slot = self.slots[i];
            let input = ShadeInput {
                context,
                depth,
                ray: self.rays[i],
                hit: self.hits[i],
                sample: &mut self.samples[slot as usize],
            };
            if let Some(next) = shade.shade(input, &mut self.paths[slot as usize], &mut self.shadows) {
                self.next_rays.push(next);
                self.next_slots.push(slot);
            }
        }
        std::mem::swap(&mut self.rays, &mut self.next_rays);
        std::mem::swap(&mut self.slots, &mut self.next_slots);
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
    fn run<L: Simd8>(self, _level: L) {
        self.wave.shade(self.context, self.shade, self.depth);
    }
}

/// Hits whose triangles are read before they are shaded.
const WARM_AHEAD: usize = 32;

/// Reads the corners of the hit triangles, so that the processor fetches them side by side and not one by one while
/// shading.
fn warm(scene: &Scene, hits: &[Hit]) {
    let mut sum = 0.0;
    for hit in hits.iter().filter(|h| h.is_hit()) {
        let mesh = &scene.meshes()[scene.instances()[hit.instance as usize].mesh as usize];
        sum += mesh.corners(hit.prim).into_iter().map(|p| p.x).sum::<f32>();
    }
    std::hint::black_box(sum);
}
