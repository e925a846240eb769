//! The stream tracer on a device: the four kernels of `vastlight-transport`, `stream`, joined by queues, over the CPU's threaded
//! kd-trees (Z. Chen, G. Zhang, W. Shi, T. Ren, "Improved ray tracing on stream processors").
//!
//! All rays of a wave of samples are generated at once. Then the host runs the kernels for which most rays wait: traversal and
//! intersection in turns, which hand rays to each other leaf by leaf, or shading, which derives new ones. A ray that is derived takes
//! the slot of the one that ended, further ones take new slots; where these do not suffice, the wave starts again with fewer
//! samples. Colours are summed exactly, in fixed point, so a picture depends neither on that nor on the order of the queues.

use super::photons::PhotonLight;
use super::wave::Buffers;
use super::{DeviceRenderer, GenerateParameters, NEXT, NextParameters, Starts, hand_over, sample_in};
use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording};
use vastlight_math::Vec3;
use vastlight_transport::{RenderStats, SampleSink};

/// Words of a ray on the device: see `stream_state.wgsl`.
pub(super) const RAY_FIELDS: u32 = 27;
/// Slots for each sample of a wave, further ones, and most of all: a binding has 128 MiB.
const SLOTS_PER_SAMPLE: u32 = 4;
const SLOTS_BESIDES: u32 = 1024;
const MOST_SLOTS: u32 = 1 << 20;
/// Queues of rays that wait: for traversal, intersection, intersection that settles everything, and shading.
pub(super) const TRAVERSE: u32 = 0;
const INTERSECT: u32 = 1;
const LEFT: u32 = 2;
pub(super) const SHADE_RAYS: u32 = 3;
/// Counters of slots that were given out, and of rays and shadow rays that were derived; one that does not matter.
pub(super) const SLOTS: u32 = 4;
pub(super) const RAYS: u32 = 5;
pub(super) const SHADOW_RAYS: u32 = 6;
pub(super) const SPARE: u32 = 7;
/// All counters, behind which sums stand.
pub(super) const COUNTERS: u32 = 8;
/// Words of a sum: see `stream_sum.wgsl`.
pub(super) const SUM_WORDS: u32 = 7;
/// What sums are counted in.
const SUM_UNIT: f64 = 1.0 / (1 << 28) as f64;
/// Turns of traversal and intersection that are recorded before the host looks at the queues.
const TURNS: usize = 8;

device_struct! {
    struct StreamGenerateParameters as "Parameters" { capacity, count, first, samples, first_sample, seed, slots }
}
device_struct! {
    struct TraverseParameters as "Parameters" { slots, full, on, ended }
}
device_struct! {
    struct IntersectParameters as "Parameters" { slots, full, on, ended, left }
}
device_struct! {
    struct IntersectSettledParameters as "Parameters" { slots, full, on, ended, has_photons }
}
device_struct! {
    struct StreamShadeParameters as "Parameters" { slots, capacity, full, next, max_depth }
}
kernel!(pub(crate) STREAM_GENERATE = "stream_generate", StreamGenerateParameters, 5);
kernel!(pub(crate) TRAVERSE_RAYS = "stream_traverse", TraverseParameters, 4);
kernel!(pub(crate) INTERSECT_RAYS = "stream_intersect", IntersectParameters, 5);
kernel!(pub(crate) INTERSECT_SETTLED = "stream_intersect_settled", IntersectSettledParameters, 8);
kernel!(pub(crate) STREAM_SHADE = "stream_shade", StreamShadeParameters, 8);

/// The kernels that no other integrator has.
pub(crate) static KERNELS: [&Kernel; 5] =
    [&STREAM_GENERATE, &TRAVERSE_RAYS, &INTERSECT_RAYS, &INTERSECT_SETTLED, &STREAM_SHADE];
/// All kernels of the integrator.
pub(super) static OWN_KERNELS: [&Kernel; 6] =
    [&STREAM_GENERATE, &NEXT, &TRAVERSE_RAYS, &INTERSECT_RAYS, &INTERSECT_SETTLED, &STREAM_SHADE];

/// How the stream tracer's rays are kept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Streams {
    /// Most rays of a wave.
    pub(super) slots: u32,
}

impl Streams {
    /// Slots for waves of `capacity` samples.
    pub(super) fn slots(capacity: u32) -> u32 {
        let wanted = capacity.saturating_mul(SLOTS_PER_SAMPLE).saturating_add(SLOTS_BESIDES);
        wanted.min(MOST_SLOTS).max(capacity)
    }

    /// Words of counters and sums.
    pub(super) fn tail_words(capacity: u32) -> u64 {
        u64::from(COUNTERS) + u64::from(SUM_WORDS) * u64::from(capacity)
    }

    /// Words of rays.
    pub(super) fn ray_words(slots: u32) -> u64 {
        u64::from(RAY_FIELDS) * u64::from(slots)
    }
}

/// What the counters of slots and of derived rays came to.
pub(super) struct Counts {
    slots: u32,
    pub(super) rays: u32,
    shadow_rays: u32,
}

/// The buffers of one recording, the number of slots, and the photons under whose light samples are.
pub(super) struct Waiting {
    pub(super) b: Buffers,
    pub(super) rays: Buffer,
    pub(super) slots: u32,
    pub(super) photons: Option<PhotonLight>,
}

impl Waiting {
    /// Brings what a queue holds into the size of the next dispatch, and empties two others.
    pub(super) fn next(&self, recording: &mut Recording, full: u32, [empty, other_empty]: [u32; 2]) {
        let next = NextParameters { full, empties: 1 << empty | 1 << other_empty, total: SPARE };
        recording.dispatch(&NEXT, &next, &[self.b.tails, self.b.workgroups], Groups::Direct(1));
    }

    pub(super) fn groups(&self) -> Groups {
        Groups::Indirect(self.b.workgroups, 0)
    }

    /// The second and the third kernel, once each.
    fn turn(&self, recording: &mut Recording) {
        let Self { b, rays, slots, photons } = self;
        self.next(recording, TRAVERSE, [INTERSECT, LEFT]);
        let parameters =
            TraverseParameters { slots: *slots, full: TRAVERSE, on: INTERSECT, ended: SHADE_RAYS };
        let seen = [b.tree, *rays, b.queues, b.tails];
        recording.dispatch(&TRAVERSE_RAYS, &parameters, &seen, self.groups());

        self.next(recording, INTERSECT, [TRAVERSE, SPARE]);
        let (full, on, ended, left) = (INTERSECT, TRAVERSE, SHADE_RAYS, LEFT);
        let parameters = IntersectParameters { slots: *slots, full, on, ended, left };
        let seen = [b.tree, b.blocks, *rays, b.queues, b.tails];
        recording.dispatch(&INTERSECT_RAYS, &parameters, &seen, self.groups());

        self.next(recording, LEFT, [SPARE, SPARE]);
        // Photons bring what passes clear things, and bend it.
        let has_photons = u32::from(photons.is_some());
        let parameters = IntersectSettledParameters { slots: *slots, full: LEFT, on, ended, has_photons };
        let seen = [b.tree, b.blocks, b.tables, b.pages.pool[0], b.pages.table, *rays, b.queues, b.tails];
        recording.dispatch(&INTERSECT_SETTLED, &parameters, &seen, self.groups());
    }

    /// The fourth kernel.
    fn shade(&self, recording: &mut Recording, capacity: u32, max_depth: u32) {
        let Self { b, rays, slots, photons } = self;
        self.next(recording, SHADE_RAYS, [SPARE, SPARE]);
        if let Some(photons) = photons {
            self.gather(recording, photons, max_depth);
        }
        let parameters =
            StreamShadeParameters { slots: *slots, capacity, full: SHADE_RAYS, next: TRAVERSE, max_depth };
        let seen = [b.tables, b.lights, b.pages.pool[0], b.pages.table, b.paths, *rays, b.queues, b.tails];
        recording.dispatch(&STREAM_SHADE, &parameters, &seen, self.groups());
        self.next(recording, SPARE, [SHADE_RAYS, SPARE]);
    }
}

impl DeviceRenderer<'_> {
    /// Follows all rays of a wave of samples to their end; false if there were more of them than slots.
    pub(super) fn run_streams(
        &mut self,
        streams: Streams,
        starts: &Starts<'_>,
        stats: &mut RenderStats,
        sink: &mut impl SampleSink,
    ) -> Result<bool, GpuError> {
        let (capacity, max_depth) = (self.wave.capacity, self.renderer.settings().max_depth);
        let (mut recording, waiting) = self.waiting(streams);
        self.generate(&mut recording, &waiting, starts);
        let shade = |waiting: &Waiting, recording: &mut Recording| {
            waiting.shade(recording, capacity, max_depth);
        };
        let counts = self.follow(streams, (recording, waiting), shade)?;
        if counts.slots > streams.slots {
            return self.too_many(starts.count, counts.slots).map(|()| false);
        }
        stats.rays += u64::from(starts.count) + u64::from(counts.rays);
        stats.shadow_rays += u64::from(counts.shadow_rays);
        let (mut recording, waiting) = self.waiting(streams);
        let samples = self.download_samples(&mut recording, &waiting.b);
        let sums = recording.download(waiting.b.tails, Streams::tail_words(self.wave.capacity));
        let results = self.executor.run(&recording)?;
        let (words, sums, capacity) = (results.words(samples), results.words(sums), self.wave.capacity);
        let sample = |slot| {
            let mut sample = sample_in(&words, capacity, slot);
            sample.radiance = sum_of(&sums, slot);
            sample
        };
        hand_over(sample, starts, stats, sink);
        Ok(true)
    }

    /// Runs kernels until no ray is left, or rays want more slots than there are; `shade` records the fourth kernel.
    pub(super) fn follow(
        &mut self,
        streams: Streams,
        (mut recording, mut waiting): (Recording, Waiting),
        shade: impl Fn(&Waiting, &mut Recording),
    ) -> Result<Counts, GpuError> {
        loop {
            (0..TURNS).for_each(|_| waiting.turn(&mut recording));
            let counters = recording.download(waiting.b.tails, COUNTERS.into());
            let counters = self.executor.run(&recording)?.words(counters);
            let count = |which: u32| counters.get(which as usize).copied().unwrap_or(0);
            let (to_traverse, to_shade) = (count(TRAVERSE), count(SHADE_RAYS));
            if count(SLOTS) > streams.slots || to_traverse + to_shade == 0 {
                return Ok(Counts {
                    slots: count(SLOTS),
                    rays: count(RAYS),
                    shadow_rays: count(SHADOW_RAYS),
                });
            }
            (recording, waiting) = self.waiting(streams);
            if to_shade >= to_traverse {
                shade(&waiting, &mut recording);
            }
        }
    }

    /// Whether a wave whose rays want so many slots can be a smaller one.
    fn too_many(&self, samples: u32, wanted: u32) -> Result<(), GpuError> {
        let limit = self.wave.streams.map_or(0, |streams| streams.slots);
        let what = "the rays of a sample".to_owned();
        let error = GpuError::Limit { what, wanted: wanted.into(), limit: limit.into() };
        if samples > 1 { Ok(()) } else { Err(error) }
    }

    pub(super) fn waiting(&self, streams: Streams) -> (Recording, Waiting) {
        let mut recording = Recording::new();
        let b = Buffers::new(&mut recording, &self.scene, &self.pages, &self.wave);
        let rays = recording.resident("rays", self.wave.rays);
        let photons = self.photons.map(|photons| photons.light(&mut recording));
        (recording, Waiting { b, rays, slots: streams.slots, photons })
    }

    /// The first kernel.
    fn generate(&self, recording: &mut Recording, waiting: &Waiting, starts: &Starts<'_>) {
        let Waiting { b, rays, slots, .. } = waiting;
        let pixels = recording.upload("pixels", starts.pixels);
        recording.clear(b.tails);
        let mut counters = [0_u32; COUNTERS as usize];
        counters[TRAVERSE as usize] = starts.count;
        counters[SLOTS as usize] = starts.count;
        recording.write(b.tails, bytemuck::cast_slice(&counters).to_vec());
        let GenerateParameters { capacity, count, first, samples, first_sample, seed } =
            self.generate_parameters(starts);
        let slots = *slots;
        let parameters =
            StreamGenerateParameters { capacity, count, first, samples, first_sample, seed, slots };
        let seen = [b.tables, pixels, b.paths, *rays, b.queues];
        recording.dispatch(&STREAM_GENERATE, &parameters, &seen, Groups::Direct(count.div_ceil(GROUP)));
    }
}

/// The sum of the sample in a slot; no number if some colour was none.
fn sum_of(words: &[u32], slot: usize) -> Vec3 {
    let first = COUNTERS as usize + slot * SUM_WORDS as usize;
    let word = |at: usize| words.get(first + at).copied().unwrap_or(0);
    if word(6) != 0 {
        return Vec3::NAN;
    }
    let channel = |k: usize| (u64::from(word(2 * k + 1)) << 32 | u64::from(word(2 * k))) as i64;
    Vec3::from([0, 1, 2].map(|k| (channel(k) as f64 * SUM_UNIT) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_read_as_they_are_written() {
        let mut words = vec![0; (COUNTERS + 2 * SUM_WORDS) as usize];
        let at = (COUNTERS + SUM_WORDS) as usize;
        // 2^32 units are 16.
        words[at..at + 7].copy_from_slice(&[1 << 27, 1, 0, u32::MAX, 0, 0, 0]);
        assert_eq!(sum_of(&words, 1), Vec3::new(16.5, -16.0, 0.0));
        words[at + 6] = 1;
        assert!(sum_of(&words, 1).is_nan());
        assert_eq!(sum_of(&words, 0), Vec3::ZERO);
    }
}
