//! The path tracer on a device: the wavefront of `vastlight-transport` as kernels joined by queues (Laine, Karras, Aila 2013,
//! "Megakernels considered harmful"), with the same random numbers and the same estimator.
//!
//! A wave of paths advances segment by segment: closest hits, shading, shadow rays. Where all pages of the scene are on the device,
//! how many paths go on stays there. Where they are not, each of these is done again for those that waited for pages, until none waits. What comes back is a `Sample` for each path, which the film sums exactly; so a picture depends on the device
//! alone, not on how waves are cut nor on the order in which workgroups run.

#[cfg(test)]
mod numbers;
mod photons;
mod scene;
mod stage;
mod stream;
mod wave;

use photons::DevicePhotons;
pub use photons::PhotonPass;
pub use scene::DeviceScene;
use stage::{Pass, Stage};
use wave::{Buffers, Wave};

use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::page::{DevicePages, PageStats};
use crate::primitives::GROUP;
use crate::recording::{Download, Groups, Recording};
use crate::run::Executor;
use std::ops::Range;
use vastlight_math::Vec3;
use vastlight_transport::words::ScenePages;
use vastlight_transport::{Integrator, RenderStats, Renderer, Sample, SampleSink, Tile, pixel_order};

/// Words of a path on the device: see `path_state.wgsl`.
const PATH_FIELDS: u32 = 77;
/// The first of them that are a sample.
const SAMPLE_FIELDS: u32 = 61;
/// Words of a sample.
const SAMPLE_WORDS: u64 = (PATH_FIELDS - SAMPLE_FIELDS) as u64;
/// Waves of more paths than this are halved for want of memory.
const LEAST_WAVE: u32 = 1 << 12;
/// Where not all pages fit, waves take no more than this part of the memory that is left.
const WAVE_PART: u64 = 4;
/// Queues of paths: two that take turns, that of the shadow rays, those of rays which are not settled, and of what waits for pages.
const QUEUES: u64 = 7;
/// The numbers of the last five.
const SHADOWS: u32 = 2;
const LEFT: [u32; 2] = [3, 4];
const WAITING: [u32; 2] = [5, 6];
/// Which counters are those of rays and shadow rays, and which does not matter.
const RAYS: u32 = 7;
const SHADOW_RAYS: u32 = 8;
const SPARE: u32 = 9;
/// Counters of queues and rays.
const TAILS: u64 = 10;
/// Segments that are recorded before the device is asked whether paths are left.
const SEGMENTS: u32 = 8;

device_struct! {
    struct GenerateParameters as "Parameters" { capacity, count, first, samples, first_sample, seed }
}
device_struct! {
    struct NextParameters as "Parameters" { full, empties, total }
}
device_struct! {
    struct WalkParameters as "Parameters" { capacity, full, waiting, left, again }
}
device_struct! {
    struct SettledParameters as "Parameters" { capacity, full, waiting, again, depth }
}
device_struct! {
    struct ShadeParameters as "Parameters" {
        capacity, depth, full, next, waiting, again, max_depth, integrator, roulette, direct_sampling, ao_distance
    }
}
kernel!(pub(crate) GENERATE = "path_generate", GenerateParameters, 4);
kernel!(pub(crate) NEXT = "path_next", NextParameters, 2);
kernel!(pub(crate) CLOSEST = "path_closest", WalkParameters, 7);
kernel!(pub(crate) CLOSEST_SETTLED = "path_closest_settled", SettledParameters, 8);
kernel!(pub(crate) SHADE = "path_shade", ShadeParameters, 8);
kernel!(pub(crate) SHADOW = "path_shadow", WalkParameters, 7);
kernel!(pub(crate) SHADOW_SETTLED = "path_shadow_settled", SettledParameters, 8);

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 7] =
    [&GENERATE, &NEXT, &CLOSEST, &CLOSEST_SETTLED, &SHADE, &SHADOW, &SHADOW_SETTLED];
pub(crate) use photons::KERNELS as PHOTON_KERNELS;
pub(crate) use stream::KERNELS as STREAM_KERNELS;

/// The kernels of an integrator, to be compiled ahead of their use.
#[must_use]
pub fn kernels(integrator: Integrator) -> &'static [&'static Kernel] {
    match integrator {
        Integrator::Whitted => &stream::OWN_KERNELS,
        Integrator::PhotonCaustics => &photons::OWN_KERNELS,
        _ => &KERNELS,
    }
}

/// Whether an integrator is the stream tracer's, with photons or without.
#[must_use]
pub fn is_stream(integrator: Integrator) -> bool {
    matches!(integrator, Integrator::Whitted | Integrator::PhotonCaustics)
}

/// Renders tiles of one picture on a device, one after the other.
#[derive(Debug)]
pub struct DeviceRenderer<'r> {
    executor: &'r mut Executor,
    renderer: &'r Renderer<'r>,
    scene: DeviceScene,
    /// Where pages come from, and those that are there.
    source: ScenePages<'r>,
    pages: DevicePages,
    wave: Wave,
    photons: Option<DevicePhotons>,
    /// Samples that are rendered at once.
    at_once: u32,
}

impl<'r> DeviceRenderer<'r> {
    /// Brings a renderer to a device, with waves of at most `capacity` paths, fewer where memory does not suffice, and as much of its
    /// pages as fits beside. Its tracer must be in the layout `compact`, or for the integrator `whitted` have threaded kd-trees.
    ///
    /// # Errors
    /// The tracer is another one, a binding is too small for it, a page cannot be had, or memory does not suffice.
    pub fn new(
        executor: &'r mut Executor,
        renderer: &'r Renderer<'r>,
        capacity: u32,
    ) -> Result<Self, GpuError> {
        let is_stream = is_stream(renderer.settings().integrator);
        let (scene, mut source) = DeviceScene::new(executor, renderer)?;
        let made = Self::room(executor, &mut source, capacity, is_stream);
        let (wave, pages) = made.inspect_err(|_| scene.release(executor))?;
        if pages.has_all() {
            source.finish();
        }
        Ok(Self { executor, renderer, scene, source, pages, wave, photons: None, at_once: wave.capacity })
    }

    /// Room for paths and pages.
    fn room(
        executor: &mut Executor,
        source: &mut ScenePages<'_>,
        most: u32,
        is_stream: bool,
    ) -> Result<(Wave, DevicePages), GpuError> {
        let free = executor.free_bytes();
        let fits = DevicePages::bytes_for_all(source).saturating_add(Wave::bytes(most, is_stream)) <= free;
        let part = (LEAST_WAVE..most).rev().step_by(LEAST_WAVE as usize);
        let smaller = || part.clone().find(|&n| Wave::bytes(n, is_stream) <= free / WAVE_PART);
        let capacity = if fits { most } else { smaller().unwrap_or(most.min(LEAST_WAVE)) };
        let (wave, rest) = Wave::new(executor, capacity, is_stream)?;
        let pages = DevicePages::new(executor, source, is_stream);
        executor.release(rest);
        let pages = pages.inspect_err(|_| wave.release(executor))?;
        if is_stream && !pages.has_all() {
            let wanted_bytes = pages.stats().all_bytes;
            pages.release(executor);
            wave.release(executor);
            let (what, held_bytes) = ("all pages, for whitted".to_owned(), executor.held_bytes());
            return Err(GpuError::OutOfMemory { what, wanted_bytes, held_bytes });
        }
        Ok((wave, pages))
    }

    /// What is rendered.
    #[must_use]
    pub fn renderer(&self) -> &'r Renderer<'r> {
        self.renderer
    }

    /// What paging did so far.
    #[must_use]
    pub fn page_stats(&self) -> PageStats {
        self.pages.stats()
    }

    /// Renders the samples numbered `samples` of every pixel of `tile`; see [`Renderer::render_tile`].
    ///
    /// # Errors
    /// The device fails.
    pub fn render_tile(
        &mut self,
        tile: Tile,
        samples: Range<u32>,
        sink: &mut impl SampleSink,
    ) -> Result<RenderStats, GpuError> {
        let pixels: Vec<[u32; 2]> = pixel_order(tile).collect();
        let (each, mut stats) = (samples.len() as u64, RenderStats::default());
        let all = pixels.len() as u64 * each;
        let mut first = 0;
        while first < all {
            // Whole pixels, or parts of one.
            let pixels_at_once = (u64::from(self.at_once) / each.max(1)).max(1);
            let pixel = (first / each) as usize;
            let here = &pixels[pixel..pixels.len().min(pixel + pixels_at_once as usize)];
            let start = first % each;
            let count = (here.len() as u64 * each - start).min(self.at_once.into());
            let paths =
                Starts { pixels: here, samples: samples.clone(), first: start as u32, count: count as u32 };
            if self.run(&paths, &mut stats, sink)? {
                first += count;
            } else {
                self.at_once = count as u32 / 2;
            }
        }
        Ok(stats)
    }

    /// Renders a wave of samples; false where it has to be a smaller one.
    fn run(
        &mut self,
        starts: &Starts<'_>,
        stats: &mut RenderStats,
        sink: &mut impl SampleSink,
    ) -> Result<bool, GpuError> {
        match self.wave.streams {
            None => self.run_paths(starts, stats, sink).map(|()| true),
            Some(streams) => self.run_streams(streams, starts, stats, sink),
        }
    }

    /// Follows a wave of paths to their end.
    fn run_paths(
        &mut self,
        starts: &Starts<'_>,
        stats: &mut RenderStats,
        sink: &mut impl SampleSink,
    ) -> Result<(), GpuError> {
        let mut recording = Recording::new();
        let mut buffers = Buffers::new(&mut recording, &self.scene, &self.pages, &self.wave);
        self.start(&mut recording, &buffers, starts);
        let mut depth = 1;
        let counts = loop {
            let last = depth + self.segments_at_once();
            for depth in depth..last {
                for stage in Stage::ALL {
                    self.record_stage(&mut recording, &buffers, stage, &Pass::first(depth));
                    if !self.pages.has_all() {
                        self.until_none_waits(&mut recording, &mut buffers, stage, depth)?;
                    }
                }
            }
            let tails = recording.download(buffers.tails, TAILS);
            let samples = self.download_samples(&mut recording, &buffers);
            let results = self.executor.run(&recording)?;
            let tails = results.words(tails);
            depth = last;
            if tails.get((1 - depth % 2) as usize).is_none_or(|&left| left == 0) || self.is_single() {
                let (words, capacity) = (results.words(samples), self.wave.capacity);
                hand_over(|slot| sample_in(&words, capacity, slot), starts, stats, sink);
                break tails;
            }
            (recording, buffers) = self.anew();
        };
        let count = |which: u32| u64::from(counts.get(which as usize).copied().unwrap_or(0));
        stats.rays += count(RAYS);
        stats.shadow_rays += count(SHADOW_RAYS);
        Ok(())
    }

    /// A new recording.
    fn anew(&self) -> (Recording, Buffers) {
        let mut recording = Recording::new();
        let buffers = Buffers::new(&mut recording, &self.scene, &self.pages, &self.wave);
        (recording, buffers)
    }

    /// Whether paths end at their first surface.
    fn is_single(&self) -> bool {
        matches!(self.renderer.settings().integrator, Integrator::Primary | Integrator::Ao)
    }

    fn segments_at_once(&self) -> u32 {
        if self.is_single() || !self.pages.has_all() {
            1
        } else {
            SEGMENTS.min(self.renderer.settings().max_depth.max(1))
        }
    }

    /// The start of a wave: what `GENERATE` is told.
    fn generate_parameters(&self, starts: &Starts<'_>) -> GenerateParameters {
        GenerateParameters {
            capacity: self.wave.capacity,
            count: starts.count,
            first: starts.first,
            samples: starts.samples.len() as u32,
            first_sample: starts.samples.start,
            seed: self.renderer.settings().seed,
        }
    }

    fn start(&self, recording: &mut Recording, buffers: &Buffers, starts: &Starts<'_>) {
        let pixels = recording.upload("pixels", starts.pixels);
        let mut tails = [0_u32; TAILS as usize];
        tails[0] = starts.count;
        recording.write(buffers.tails, bytemuck::cast_slice(&tails).to_vec());
        let parameters = self.generate_parameters(starts);
        let all = [buffers.tables, pixels, buffers.paths, buffers.queues];
        recording.dispatch(&GENERATE, &parameters, &all, Groups::Direct(starts.count.div_ceil(GROUP)));
    }

    fn download_samples(&self, recording: &mut Recording, buffers: &Buffers) -> Download {
        let capacity = u64::from(self.wave.capacity);
        let words = SAMPLE_WORDS * capacity;
        let samples = recording.buffer("samples", words);
        recording.copy(buffers.paths, u64::from(SAMPLE_FIELDS) * capacity, samples, words);
        recording.download(samples, words)
    }
}

impl Drop for DeviceRenderer<'_> {
    fn drop(&mut self) {
        self.scene.release(self.executor);
        self.pages.release(self.executor);
        self.wave.release(self.executor);
        self.release_photons();
    }
}

/// The paths of a wave: the samples of pixels, from the sample number `first` of all on.
struct Starts<'p> {
    pixels: &'p [[u32; 2]],
    samples: Range<u32>,
    first: u32,
    count: u32,
}

/// Hands the samples of a wave, by slot, to the film.
fn hand_over(
    sample: impl Fn(usize) -> Sample,
    starts: &Starts<'_>,
    stats: &mut RenderStats,
    sink: &mut impl SampleSink,
) {
    let each = starts.samples.len();
    for slot in 0..starts.count as usize {
        let sample = sample(slot);
        match starts.pixels.get((starts.first as usize + slot) / each) {
            Some(&pixel) if sample.is_finite() => sink.add(pixel, &sample),
            _ => stats.non_finite += 1,
        }
    }
    stats.samples += u64::from(starts.count);
}

/// The sample in a slot of the words of a wave.
fn sample_in(words: &[u32], capacity: u32, slot: usize) -> Sample {
    sample_of(|field| words.get(field * capacity as usize + slot).copied().unwrap_or(0))
}

fn sample_of(word: impl Fn(usize) -> u32) -> Sample {
    let float = |field| f32::from_bits(word(field));
    let vec3 = |field| Vec3::new(float(field), float(field + 1), float(field + 2));
    Sample {
        radiance: vec3(0),
        albedo: vec3(3),
        normal: vec3(6),
        position: vec3(9),
        depth: float(12),
        coverage: float(13),
        object: word(14),
        material: word(15),
    }
}
