//! The path tracer on a device: the wavefront of `vastlight-transport` as kernels joined by queues (Laine, Karras, Aila 2013,
//! "Megakernels considered harmful"), with the same random numbers and the same estimator.
//!
//! A wave of paths advances segment by segment: closest hits, shading, shadow rays. How many paths go on stays on the
//! device. What comes back is a `Sample` for each path, which the film sums exactly; so a picture depends on the device
//! alone, not on how waves are cut nor on the order in which workgroups run.

#[cfg(test)]
mod numbers;
mod scene;
mod stream;

pub use scene::DeviceScene;
use stream::Streams;

use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Download, Groups, Recording, Resident};
use crate::run::Executor;
use std::ops::Range;
use vastlight_math::Vec3;
use vastlight_transport::{
    DirectSampling, Integrator, RenderStats, Renderer, Sample, SampleSink, Tile, pixel_order,
};

/// Words of a path on the device: see `path_state.wgsl`.
const PATH_FIELDS: u32 = 63;
/// The first of them that are a sample.
const SAMPLE_FIELDS: u32 = 47;
/// Words of a sample.
const SAMPLE_WORDS: u64 = (PATH_FIELDS - SAMPLE_FIELDS) as u64;
/// Waves of more paths than this are halved for want of memory.
const LEAST_WAVE: u32 = 1 << 12;
/// Queues of paths: two that take turns, that of the shadow rays, and that of rays which are not settled.
const QUEUES: u64 = 4;
/// The numbers of the last two.
const SHADOWS: u32 = 2;
const LEFT: u32 = 3;
/// Which counters are those of rays and shadow rays, and which does not matter.
const RAYS: u32 = 4;
const SHADOW_RAYS: u32 = 5;
const SPARE: u32 = 6;
/// Counters of queues and rays.
const TAILS: u64 = 7;
/// Segments that are recorded before the device is asked whether paths are left.
const SEGMENTS: u32 = 8;

device_struct! {
    struct GenerateParameters as "Parameters" { capacity, count, first, samples, first_sample, seed }
}
device_struct! {
    struct NextParameters as "Parameters" { full, empty, other_empty, total }
}
device_struct! {
    struct WalkParameters as "Parameters" { capacity, full, left }
}
device_struct! {
    struct SettledParameters as "Parameters" { capacity, full, depth }
}
device_struct! {
    struct ShadeParameters as "Parameters" {
        capacity, depth, full, next, max_depth, integrator, roulette, direct_sampling, ao_distance
    }
}
kernel!(pub(crate) GENERATE = "path_generate", GenerateParameters, 4);
kernel!(pub(crate) NEXT = "path_next", NextParameters, 2);
kernel!(pub(crate) CLOSEST = "path_closest", WalkParameters, 5);
kernel!(pub(crate) CLOSEST_SETTLED = "path_closest_settled", SettledParameters, 8);
kernel!(pub(crate) SHADE = "path_shade", ShadeParameters, 7);
kernel!(pub(crate) SHADOW = "path_shadow", WalkParameters, 5);
kernel!(pub(crate) SHADOW_SETTLED = "path_shadow_settled", SettledParameters, 8);

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 7] =
    [&GENERATE, &NEXT, &CLOSEST, &CLOSEST_SETTLED, &SHADE, &SHADOW, &SHADOW_SETTLED];
pub(crate) use stream::KERNELS as STREAM_KERNELS;

/// The kernels of an integrator, to be compiled ahead of their use.
#[must_use]
pub fn kernels(integrator: Integrator) -> &'static [&'static Kernel] {
    if integrator == Integrator::Whitted { &stream::OWN_KERNELS } else { &KERNELS }
}

/// Renders tiles of one picture on a device, one after the other.
#[derive(Debug)]
pub struct DeviceRenderer<'r> {
    executor: &'r mut Executor,
    renderer: &'r Renderer<'r>,
    scene: DeviceScene,
    wave: Wave,
    /// Samples that are rendered at once.
    at_once: u32,
}

/// Paths in flight, on the device.
#[derive(Clone, Copy, Debug)]
struct Wave {
    /// Most paths.
    capacity: u32,
    paths: Resident,
    queues: Resident,
    tails: Resident,
    /// Rays of the stream tracer; next to nothing for the others.
    rays: Resident,
    streams: Option<Streams>,
}

impl<'r> DeviceRenderer<'r> {
    /// Brings a renderer to a device, with waves of at most `capacity` paths, fewer where memory does not suffice. Its tracer must be
    /// in the layout `compact`, or for the integrator `whitted` have threaded kd-trees.
    ///
    /// # Errors
    /// The tracer is another one, the scene is in a store, a binding is too small for it, or memory does not suffice.
    pub fn new(
        executor: &'r mut Executor,
        renderer: &'r Renderer<'r>,
        capacity: u32,
    ) -> Result<Self, GpuError> {
        let is_stream = renderer.settings().integrator == Integrator::Whitted;
        let scene = DeviceScene::new(executor, renderer)?;
        let wave = Wave::new(executor, capacity, is_stream).inspect_err(|_| scene.release(executor))?;
        Ok(Self { executor, renderer, scene, wave, at_once: wave.capacity })
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
        let mut buffers = Buffers::new(&mut recording, &self.scene, &self.wave);
        self.start(&mut recording, &buffers, starts);
        let mut depth = 1;
        let counts = loop {
            let last = depth + self.segments_at_once();
            for depth in depth..last {
                self.segment(&mut recording, &buffers, depth);
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
            recording = Recording::new();
            buffers = Buffers::new(&mut recording, &self.scene, &self.wave);
        };
        let count = |which: u32| u64::from(counts.get(which as usize).copied().unwrap_or(0));
        stats.rays += count(RAYS);
        stats.shadow_rays += count(SHADOW_RAYS);
        Ok(())
    }

    /// Whether paths end at their first surface.
    fn is_single(&self) -> bool {
        matches!(self.renderer.settings().integrator, Integrator::Primary | Integrator::Ao)
    }

    fn segments_at_once(&self) -> u32 {
        if self.is_single() { 1 } else { SEGMENTS.min(self.renderer.settings().max_depth.max(1)) }
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

    /// One segment of all paths; the first has the number 1.
    fn segment(&self, recording: &mut Recording, b: &Buffers, depth: u32) {
        let (full, empty) = (1 - depth % 2, depth % 2);
        let next = NextParameters { full, empty, other_empty: SHADOWS, total: RAYS };
        recording.dispatch(&NEXT, &next, &[b.tails, b.workgroups], Groups::Direct(1));
        self.walk(recording, b, [&CLOSEST, &CLOSEST_SETTLED], (full, depth));

        let shaded = [b.tables, b.lights, b.corners, b.texels, b.paths, b.queues, b.tails];
        let parameters = self.shade_parameters(depth, full, empty);
        recording.dispatch(&SHADE, &parameters, &shaded, Groups::Indirect(b.workgroups, 0));

        let next = NextParameters { full: SHADOWS, empty: SPARE, other_empty: SPARE, total: SHADOW_RAYS };
        recording.dispatch(&NEXT, &next, &[b.tails, b.workgroups], Groups::Direct(1));
        self.walk(recording, b, [&SHADOW, &SHADOW_SETTLED], (SHADOWS, depth));
    }

    /// Rays of a queue on their way: all by the first kernel, those that it leaves by the second.
    fn walk(
        &self,
        recording: &mut Recording,
        b: &Buffers,
        [kernel, settled]: [&'static Kernel; 2],
        (full, depth): (u32, u32),
    ) {
        let capacity = self.wave.capacity;
        let parameters = WalkParameters { capacity, full, left: LEFT };
        let seen = [b.tree, b.pages, b.paths, b.queues, b.tails];
        recording.dispatch(kernel, &parameters, &seen, Groups::Indirect(b.workgroups, 0));
        let next = NextParameters { full: LEFT, empty: SPARE, other_empty: SPARE, total: SPARE };
        recording.dispatch(&NEXT, &next, &[b.tails, b.workgroups_left], Groups::Direct(1));
        let parameters = SettledParameters { capacity, full: LEFT, depth };
        let seen = [b.tree, b.pages, b.tables, b.corners, b.texels, b.paths, b.queues, b.tails];
        recording.dispatch(settled, &parameters, &seen, Groups::Indirect(b.workgroups_left, 0));
        let next = NextParameters { full: SPARE, empty: LEFT, other_empty: SPARE, total: SPARE };
        recording.dispatch(&NEXT, &next, &[b.tails, b.workgroups_left], Groups::Direct(1));
    }

    fn shade_parameters(&self, depth: u32, full: u32, next: u32) -> ShadeParameters {
        let settings = self.renderer.settings();
        ShadeParameters {
            capacity: self.wave.capacity,
            depth,
            full,
            next,
            max_depth: settings.max_depth,
            integrator: match settings.integrator {
                Integrator::Path | Integrator::Whitted => 0,
                Integrator::Direct => 1,
                Integrator::Primary => 2,
                Integrator::Ao => 3,
            },
            roulette: u32::from(settings.russian_roulette),
            direct_sampling: match settings.direct_sampling {
                DirectSampling::Both => 0,
                DirectSampling::Bsdf => 1,
                DirectSampling::Light => 2,
            },
            ao_distance: self.renderer.ao_distance().to_bits(),
        }
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
        self.wave.release(self.executor);
    }
}

impl Wave {
    /// Room for at most `most` paths, fewer where memory does not suffice.
    fn new(executor: &mut Executor, most: u32, is_stream: bool) -> Result<Self, GpuError> {
        let fitting = executor.adapter().limits.binding_bytes / (4 * u64::from(PATH_FIELDS));
        let mut capacity = most.clamp(1, u32::try_from(fitting).unwrap_or(u32::MAX).max(1));
        loop {
            match Self::of(executor, capacity, is_stream) {
                Err(GpuError::OutOfMemory { .. }) if capacity > LEAST_WAVE => capacity /= 2,
                wave => return wave,
            }
        }
    }

    fn of(executor: &mut Executor, capacity: u32, is_stream: bool) -> Result<Self, GpuError> {
        let all = u64::from(capacity);
        let slots = if is_stream { Streams::slots(capacity) } else { capacity };
        let (tails, rays) =
            if is_stream { (Streams::tail_words(capacity), Streams::ray_words(slots)) } else { (TAILS, 0) };
        let mut kept = [Resident::NOTHING; 5];
        // The last is room for samples on their way back.
        let words = [
            u64::from(PATH_FIELDS) * all,
            QUEUES * u64::from(slots),
            tails,
            rays.max(1),
            2 * SAMPLE_WORDS * all,
        ];
        let labels = ["paths", "queues", "tails", "rays", "samples"];
        for (i, (label, words)) in labels.into_iter().zip(words).enumerate() {
            let done = executor.allocate(label, 4 * words);
            kept[i] =
                done.inspect_err(|_| kept.into_iter().for_each(|resident| executor.release(resident)))?;
        }
        let [paths, queues, tails, rays, room] = kept;
        executor.release(room);
        let streams = is_stream.then_some(Streams { slots });
        Ok(Self { capacity, paths, queues, tails, rays, streams })
    }

    fn release(&self, executor: &mut Executor) {
        let all = [self.paths, self.queues, self.tails, self.rays];
        all.into_iter().for_each(|resident| executor.release(resident));
    }
}

/// The buffers of one recording.
struct Buffers {
    tree: Buffer,
    pages: Buffer,
    tables: Buffer,
    lights: Buffer,
    corners: Buffer,
    texels: Buffer,
    paths: Buffer,
    queues: Buffer,
    tails: Buffer,
    workgroups: Buffer,
    workgroups_left: Buffer,
}

impl Buffers {
    fn new(recording: &mut Recording, scene: &DeviceScene, wave: &Wave) -> Self {
        Self {
            tree: recording.resident("tree", scene.tracer.tree),
            pages: recording.resident("pages", scene.tracer.pages),
            tables: recording.resident("tables", scene.tables),
            lights: recording.resident("lights", scene.lights),
            corners: recording.resident("corners", scene.corners),
            texels: recording.resident("texels", scene.texels),
            paths: recording.resident("paths", wave.paths),
            queues: recording.resident("queues", wave.queues),
            tails: recording.resident("tails", wave.tails),
            workgroups: recording.buffer("workgroups", 3),
            workgroups_left: recording.buffer("workgroups of rays that are left", 3),
        }
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
