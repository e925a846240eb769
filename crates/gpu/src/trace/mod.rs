//! Tracing rays on a device, over the same page bytes as the CPU: a scene in memory, instances over meshes.
//!
//! The counterpart on the CPU is the tracer of `vastlight-trace` over the layout `compact`, whose words these are. The test of a
//! triangle is the same, down to the triangles seen edge-on, which the CPU settles in double precision and the device in
//! integers. What may differ is rounding: drivers may fuse, and divide with an error.

use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::limits::WORKGROUPS_PER_AXIS;
use crate::recording::{Buffer, Groups, Recording, Resident};
use crate::run::Executor;
use vastlight_math::Ray;
use vastlight_trace::Hit;
use vastlight_trace::words::TracerWords;

/// References that a ray can have put aside in the kernel.
pub const STACK: usize = 192;
/// Rays that a workgroup takes.
const RAYS_PER_GROUP: u32 = 64;
/// Most rays of a batch: one dispatch.
pub const MAX_RAYS: u32 = WORKGROUPS_PER_AXIS * RAYS_PER_GROUP;
/// Words of a hit.
const HIT_WORDS: usize = 5;

device_struct! {
    struct Parameters as "Parameters" { count }
}
kernel!(pub(crate) CLOSEST = "closest", Parameters, 4);
kernel!(pub(crate) OCCLUDED = "occluded", Parameters, 4);

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 2] = [&CLOSEST, &OCCLUDED];

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
        let limit = executor.adapter().limits.binding_bytes;
        for (what, words) in [("the tree in bytes", &words.tree), ("the pages in bytes", &words.pages)] {
            let wanted = 4 * words.len() as u64;
            if wanted > limit {
                return Err(GpuError::Limit { what: what.to_owned(), wanted, limit });
            }
        }
        let tree = executor.keep("tree", &words.tree)?;
        let pages = executor.keep("pages", &words.pages).inspect_err(|_| executor.release(tree))?;
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
    record(recording, &CLOSEST, tracer, rays, (count, HIT_WORDS as u64))
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
    record(recording, &OCCLUDED, tracer, rays, (count, 1))
}

fn record(
    recording: &mut Recording,
    kernel: &'static Kernel,
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
        let groups = Groups::Direct(count.div_ceil(RAYS_PER_GROUP));
        recording.dispatch(kernel, &Parameters { count }, &[tree, pages, rays, answers], groups);
    }
    Ok(answers)
}
