//! The stream tracer: Whitted's ray tracing (T. Whitted 1980, "An improved illumination model for shaded display") by
//! four kernels that are joined by queues, after Z. Chen, G. Zhang, W. Shi, T. Ren, "Improved ray tracing on stream
//! processors".
//!
//! Rays are generated; traversal brings a ray to a leaf, intersection tests the leaf's triangles, back and forth until
//! its way ends; shading computes Phong's local colour and derives new rays: mirrored, refracted, and to a light. They
//! go back to traversal. The host runs the kernel for which most rays wait, and generates rays when none is busy.
//!
//! There is no recursion: a ray carries the product of the reflectances on its way, and the colour of a pixel is the
//! sum over all of its rays, `sum over j of (product of r_i, i < j) * local_j`. The sum is exact, so the picture does
//! not depend on the order in which queues are served, hence not on tiles and threads.
//!
//! Deviations: refracted rays are derived side by side with mirrored ones; a light is chosen by the path tracer's light
//! sampling, which makes soft shadows of the project's physical lights.

mod phong;
mod records;
mod shade;

use crate::sample::{RenderStats, Sample};
use crate::wavefront::{Batches, Context, Run};
use records::{Load, Sum};
pub(crate) use shade::is_clear;
use shade::{Derived, StreamFilter};
use vastlight_math::{Ray, Sampler};
use vastlight_paging::PageError;
use vastlight_trace::stream::{Outlets, StreamRay};

/// Rays for which a kernel is worth running while there are more to generate.
const BATCH: usize = 1024;

/// The queues of the stream tracer, and the records of rays between kernels.
#[derive(Debug, Default)]
pub(crate) struct Stream {
    /// By slot: a ray and what it carries.
    rays: Vec<StreamRay>,
    loads: Vec<Load>,
    free: Vec<u32>,
    /// Slots that wait for a kernel.
    to_traverse: Vec<u32>,
    to_intersect: Vec<u32>,
    to_shade: Vec<u32>,
    /// The queue that is being served.
    serving: Vec<u32>,
    /// By sample.
    samplers: Vec<Sampler>,
    sums: Vec<Sum>,
    samples: Vec<Sample>,
}

impl Batches for Stream {
    fn run(
        &mut self,
        context: &Context<'_>,
        runs: impl Iterator<Item = Run>,
        stats: &mut RenderStats,
    ) -> Result<&[Sample], PageError> {
        self.samplers.clear();
        self.sums.clear();
        self.samples.clear();
        let mut starts = runs.flat_map(|run| {
            let pixel = run.pixel;
            run.starts(context.settings.seed).map(move |(sampler, key)| (pixel, sampler, key))
        });
        let mut more = true;
        loop {
            let waiting = [self.to_traverse.len(), self.to_intersect.len(), self.to_shade.len()];
            let most = waiting.into_iter().max().unwrap_or(0);
            if more && most < BATCH {
                more = self.generate(context, &mut starts, stats);
            } else if most == 0 {
                break;
            } else if most == waiting[2] {
                self.shade(context, stats);
            } else if most == waiting[1] {
                self.intersect(context);
            } else {
                self.traverse(context);
            }
        }
        for (sample, sum) in self.samples.iter_mut().zip(&self.sums) {
            sample.radiance = sum.value();
        }
        Ok(&self.samples)
    }
}

impl Stream {
    /// The first kernel: a batch of camera rays; false when there are no more.
    fn generate(
        &mut self,
        context: &Context<'_>,
        starts: &mut impl Iterator<Item = ([u32; 2], Sampler, u32)>,
        stats: &mut RenderStats,
    ) -> bool {
        for _ in 0..BATCH {
            let Some((pixel, sampler, key)) = starts.next() else { return false };
            let ray = context.camera.ray(pixel, context.camera.draw(sampler));
            let load = Load::of_camera(self.samples.len() as u32, key);
            self.samplers.push(sampler);
            self.sums.push(Sum::default());
            self.samples.push(Sample::MISS);
            stats.rays += 1;
            self.put(&ray, load, false);
        }
        true
    }

    /// Makes a ray wait for traversal.
    fn put(&mut self, ray: &Ray, load: Load, any: bool) {
        let ray = StreamRay::new(ray, any);
        let slot = match self.free.pop() {
            Some(slot) => {
                (self.rays[slot as usize], self.loads[slot as usize]) = (ray, load);
                slot
            }
            None => {
                self.rays.push(ray);
                self.loads.push(load);
                self.rays.len() as u32 - 1
            }
        };
        self.to_traverse.push(slot);
    }

    /// The second kernel; for structures without stream kernels, the second and the third.
    fn traverse(&mut self, context: &Context<'_>) {
        std::mem::swap(&mut self.serving, &mut self.to_traverse);
        self.to_traverse.clear();
        let tracer = context.tracer;
        if tracer.has_stream_kernels() {
            let outlets = Outlets { on: &mut self.to_intersect, ended: &mut self.to_shade };
            tracer.traverse(&mut self.rays, &self.serving, outlets);
        } else {
            let filter = StreamFilter { context, loads: &self.loads };
            tracer.trace_whole(&mut self.rays, &self.serving, &filter, &mut self.to_shade);
        }
    }

    /// The third kernel.
    fn intersect(&mut self, context: &Context<'_>) {
        std::mem::swap(&mut self.serving, &mut self.to_intersect);
        self.to_intersect.clear();
        let filter = StreamFilter { context, loads: &self.loads };
        let outlets = Outlets { on: &mut self.to_traverse, ended: &mut self.to_shade };
        context.tracer.intersect(&mut self.rays, &self.serving, &filter, outlets);
    }

    /// The fourth kernel: shades rays whose way has ended and derives new ones.
    fn shade(&mut self, context: &Context<'_>, stats: &mut RenderStats) {
        std::mem::swap(&mut self.serving, &mut self.to_shade);
        self.to_shade.clear();
        let serving = std::mem::take(&mut self.serving);
        for &slot in &serving {
            let (ray, load) = (self.rays[slot as usize], self.loads[slot as usize]);
            self.free.push(slot);
            let at = load.sample as usize;
            if load.is_shadow() {
                if !ray.hit().is_hit() {
                    self.sums[at].add(load.weight);
                }
                continue;
            }
            let mut derived = Derived::default();
            let sample = &mut self.samples[at];
            self.sums[at].add(shade::shade(context, &ray, &load, &self.samplers[at], sample, &mut derived));
            for (ray, load) in derived.into_iter().flatten() {
                let counter = if load.is_shadow() { &mut stats.shadow_rays } else { &mut stats.rays };
                *counter += 1;
                self.put(&ray, load, load.is_shadow());
            }
        }
        self.serving = serving;
    }
}
