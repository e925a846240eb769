//! The memory of paths in flight, and the buffers that kernels see.

use super::stream::Streams;
use super::{DeviceScene, LEAST_WAVE, PATH_FIELDS, QUEUES, SAMPLE_WORDS, TAILS};
use crate::error::GpuError;
use crate::page::{DevicePages, PageBuffers};
use crate::recording::{Buffer, Recording, Resident};
use crate::run::Executor;

/// Paths in flight, on the device.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wave {
    /// Most paths.
    pub(super) capacity: u32,
    pub(super) paths: Resident,
    pub(super) queues: Resident,
    pub(super) tails: Resident,
    /// Rays of the stream tracer; next to nothing for the others.
    pub(super) rays: Resident,
    pub(super) streams: Option<Streams>,
}

impl Wave {
    /// Room for at most `most` paths, fewer where memory does not suffice; and room for samples on their way back, to be released when
    /// all else has its memory.
    pub(super) fn new(
        executor: &mut Executor,
        most: u32,
        is_stream: bool,
    ) -> Result<(Self, Resident), GpuError> {
        let fitting = executor.adapter().limits.binding_bytes / (4 * u64::from(PATH_FIELDS));
        let mut capacity = most.clamp(1, u32::try_from(fitting).unwrap_or(u32::MAX).max(1));
        loop {
            match Self::of(executor, capacity, is_stream) {
                Err(GpuError::OutOfMemory { .. }) if capacity > LEAST_WAVE => capacity /= 2,
                wave => return wave,
            }
        }
    }

    /// The words of its buffers: paths, queues, tails, rays, samples on their way back.
    fn words(capacity: u32, is_stream: bool) -> [u64; 5] {
        let all = u64::from(capacity);
        let slots = if is_stream { Streams::slots(capacity) } else { capacity };
        let (tails, rays) =
            if is_stream { (Streams::tail_words(capacity), Streams::ray_words(slots)) } else { (TAILS, 1) };
        [u64::from(PATH_FIELDS) * all, QUEUES * u64::from(slots), tails, rays, 2 * SAMPLE_WORDS * all]
    }

    /// About the bytes of so many paths.
    pub(super) fn bytes(capacity: u32, is_stream: bool) -> u64 {
        // Sizes are rounded up.
        Self::words(capacity, is_stream).iter().sum::<u64>() * 5
    }

    fn of(executor: &mut Executor, capacity: u32, is_stream: bool) -> Result<(Self, Resident), GpuError> {
        let mut kept = [Resident::NOTHING; 5];
        let labels = ["paths", "queues", "tails", "rays", "samples"];
        for (i, (label, words)) in labels.into_iter().zip(Self::words(capacity, is_stream)).enumerate() {
            let done = executor.allocate(label, 4 * words);
            kept[i] =
                done.inspect_err(|_| kept.into_iter().for_each(|resident| executor.release(resident)))?;
        }
        let [paths, queues, tails, rays, samples] = kept;
        let streams = is_stream.then_some(Streams { slots: Streams::slots(capacity) });
        Ok((Self { capacity, paths, queues, tails, rays, streams }, samples))
    }

    pub(super) fn release(&self, executor: &mut Executor) {
        let all = [self.paths, self.queues, self.tails, self.rays];
        all.into_iter().for_each(|resident| executor.release(resident));
    }
}

/// The buffers of one recording.
pub(super) struct Buffers {
    pub(super) tree: Buffer,
    pub(super) blocks: Buffer,
    pub(super) pages: PageBuffers,
    pub(super) tables: Buffer,
    pub(super) lights: Buffer,
    pub(super) paths: Buffer,
    pub(super) queues: Buffer,
    pub(super) tails: Buffer,
    pub(super) workgroups: Buffer,
    pub(super) workgroups_left: Buffer,
}

impl Buffers {
    pub(super) fn new(
        recording: &mut Recording,
        scene: &DeviceScene,
        pages: &DevicePages,
        wave: &Wave,
    ) -> Self {
        Self {
            tree: recording.resident("tree", scene.tree),
            blocks: recording.resident("blocks", scene.blocks),
            pages: pages.buffers(recording),
            tables: recording.resident("tables", scene.tables),
            lights: recording.resident("lights", scene.lights),
            paths: recording.resident("paths", wave.paths),
            queues: recording.resident("queues", wave.queues),
            tails: recording.resident("tails", wave.tails),
            workgroups: recording.buffer("workgroups", 3),
            workgroups_left: recording.buffer("workgroups of rays that are left", 3),
        }
    }
}
