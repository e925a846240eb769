//! Tracing rays on a device, over the same page bytes as the CPU: a scene in memory, instances over meshes.
//!
//! The counterpart on the CPU is the tracer of `vastlight-trace` over the layout `compact`, whose words these are. The test of a
//! triangle is the same, down to the triangles seen edge-on, which the CPU settles in double precision and the device in
//! integers. What may differ is rounding: drivers may fuse, and divide with an error.

use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::limits::WORKGROUPS_PER_AXIS;
use crate::primitives::GROUP;
use crate::primitives::queue::{NEXT, NextParameters};
use crate::recording::{Buffer, Groups, Recording, Resident};
use crate::run::Executor;
use vastlight_math::Ray;
use vastlight_trace::Hit;
use vastlight_trace::words::TracerWords;

/// References that a ray can have put aside in the kernel.
pub const STACK: usize = 192;
/// Most rays of a batch: one dispatch.
pub const MAX_RAYS: u32 = WORKGROUPS_PER_AXIS * GROUP;
/// Words of a hit.
pub(crate) const HIT_WORDS: usize = 5;

device_struct! {
    struct Parameters as "Parameters" { count }
}
kernel!(pub(crate) CLOSEST = "closest", Parameters, 6);
kernel!(pub(crate) CLOSEST_SETTLED = "closest_settled", Parameters, 6);
kernel!(pub(crate) OCCLUDED = "occluded", Parameters, 6);
kernel!(pub(crate) OCCLUDED_SETTLED = "occluded_settled", Parameters, 6);

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 4] = [&CLOSEST, &CLOSEST_SETTLED, &OCCLUDED, &OCCLUDED_SETTLED];

/// A traceable scene on the device.
#[derive(Clone, Copy, Debug)]
pub struct DeviceTracer {
    pub(crate) tree: Resident,
    pub(crate) pages: Resident,
}

impl DeviceTracer {
    /// Brings a tracer to the device.
    ///
    /// # Errors
    /// Its trees are too deep, a binding is too small for it, or memory does not suffice.
    pub fn new(executor: &mut Executor, words: &TracerWords) -> Result<Self, GpuError> {
        let most = 7 * words.levels + 2;
        if most > STACK {
            let what = "the stack of rays in nodes".to_owned();
            return Err(GpuError::Limit { what, wanted: most as u64, limit: STACK as u64 });
        }
        let [tree, pages] = executor.keep_all([("tree", &words.tree), ("pages", &words.pages)])?;
        Ok(Self { tree, pages })
    }

    /// Gives its memory back.
    pub fn release(self, executor: &mut Executor) {
        [self.tree, self.pages].into_iter().for_each(|resident| executor.release(resident));
    }
}

/// A ray as the kernels read it: origin and least t, direction and greatest t. Rays that are not finite end before they begin.
#[must_use]
pub fn ray_words(ray: &Ray) -> [f32; 8] {
    let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin.to_array(), ray.direction.to_array());
    let finite = ray.origin.is_finite() && ray.direction.is_finite() && ray.t_min <= ray.t_max;
    if !finite {
        return [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, -1.0];
    }
    [ox, oy, oz, ray.t_min.max(0.0), dx, dy, dz, ray.t_max.min(f32::MAX)]
}

/// The hits, or misses, of words that [`record_closest`] had written.
#[must_use]
pub fn hits_of_words(words: &[u32]) -> Vec<Hit> {
    let hit = |words: &[u32]| Hit {
        t: f32::from_bits(words[0]),
        u: f32::from_bits(words[1]),
        v: f32::from_bits(words[2]),
        instance: words[3],
        prim: words[4],
    };
    let misses = |hit: Hit| if hit.is_hit() { hit } else { Hit::MISS };
    words.chunks_exact(HIT_WORDS).map(|words| misses(hit(words))).collect()
}

/// Records the closest hits of `count` rays (eight words each, see [`ray_words`]); the answer is five words a ray, see
/// [`hits_of_words`].
///
/// # Errors
/// There are more than [`MAX_RAYS`].
pub fn record_closest(
    recording: &mut Recording,
    tracer: &DeviceTracer,
    rays: Buffer,
    count: u32,
) -> Result<Buffer, GpuError> {
    record(recording, [&CLOSEST, &CLOSEST_SETTLED], tracer, rays, (count, HIT_WORDS as u64))
}

/// Records whether `count` rays meet anything; the answer is a word a ray, 1 or 0.
///
/// # Errors
/// There are more than [`MAX_RAYS`].
pub fn record_occluded(
    recording: &mut Recording,
    tracer: &DeviceTracer,
    rays: Buffer,
    count: u32,
) -> Result<Buffer, GpuError> {
    record(recording, [&OCCLUDED, &OCCLUDED_SETTLED], tracer, rays, (count, 1))
}

fn record(
    recording: &mut Recording,
    [kernel, settled]: [&'static Kernel; 2],
    tracer: &DeviceTracer,
    rays: Buffer,
    (count, answer_words): (u32, u64),
) -> Result<Buffer, GpuError> {
    if count > MAX_RAYS {
        let what = "a batch in rays".to_owned();
        return Err(GpuError::Limit { what, wanted: count.into(), limit: MAX_RAYS.into() });
    }
    let answers = recording.buffer("answers", answer_words * u64::from(count.max(1)));
    if count > 0 {
        let tree = recording.resident("tree", tracer.tree);
        let pages = recording.resident("pages", tracer.pages);
        let left = recording.buffer("rays that are left", count.into());
        let tails = recording.upload("tails", &[0_u32, 0]);
        let workgroups = recording.buffer("workgroups", 3);
        let (parameters, all) = (Parameters { count }, [tree, pages, rays, answers, left, tails]);
        recording.dispatch(kernel, &parameters, &all, Groups::Direct(count.div_ceil(GROUP)));
        let next = NextParameters { capacity: count, full: 0, empty: 1 };
        recording.dispatch(&NEXT, &next, &[tails, workgroups], Groups::Direct(1));
        recording.dispatch(settled, &parameters, &all, Groups::Indirect(workgroups, 0));
    }
    Ok(answers)
}
