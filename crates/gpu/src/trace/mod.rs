//! Tracing rays on a device, over the same page bytes as the CPU: a scene in memory, instances over meshes.
//!
//! The counterpart on the CPU is the tracer of `vastlight-trace` over the layout `compact`, whose words these are. The test of a
//! triangle is the same, down to the triangles seen edge-on, which the CPU settles in double precision and the device in
//! integers. What may differ is rounding: drivers may fuse, and divide with an error.

use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::limits::WORKGROUPS_PER_AXIS;
use crate::page::{DevicePages, PageBuffers};
use crate::primitives::GROUP;
use crate::primitives::queue::{NEXT, NextParameters};
use crate::recording::{Buffer, Groups, Recording, Resident};
use crate::run::Executor;
use vastlight_math::Ray;
use vastlight_trace::words::TracerWords;
use vastlight_trace::{Hit, TraceError, Tracer};
use vastlight_transport::words::ScenePages;
use vastlight_transport::words::pages::GEOMETRY;

/// References that a ray can have put aside in the kernel.
pub const STACK: usize = 192;
/// Most rays of a batch: one dispatch.
pub const MAX_RAYS: u32 = WORKGROUPS_PER_AXIS * GROUP;
/// Words of a hit.
pub(crate) const HIT_WORDS: usize = 5;

device_struct! {
    struct Parameters as "Parameters" { count }
}
kernel!(pub(crate) CLOSEST = "closest", Parameters, 8);
kernel!(pub(crate) CLOSEST_SETTLED = "closest_settled", Parameters, 8);
kernel!(pub(crate) OCCLUDED = "occluded", Parameters, 8);
kernel!(pub(crate) OCCLUDED_SETTLED = "occluded_settled", Parameters, 8);

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 4] = [&CLOSEST, &CLOSEST_SETTLED, &OCCLUDED, &OCCLUDED_SETTLED];

/// A traceable scene on the device, all of it.
#[derive(Debug)]
pub struct DeviceTracer {
    tree: Resident,
    pages: DevicePages,
}

impl DeviceTracer {
    /// Brings a tracer in the layout `compact` to the device.
    ///
    /// # Errors
    /// It is another one, its trees are too deep, a binding is too small for it, or memory does not suffice.
    pub fn new(executor: &mut Executor, tracer: &Tracer) -> Result<Self, GpuError> {
        let mut pages = ScenePages::of_tracer(tracer);
        let tree = tree_of(&pages, |bytes| tracer.words(bytes))?;
        let [tree] = executor.keep_all([("tree", &tree.tree)])?;
        let kept = DevicePages::new(executor, &mut pages, false);
        let pages = kept.inspect_err(|_| executor.release(tree))?;
        if pages.has_all() {
            return Ok(Self { tree, pages });
        }
        let wanted_bytes = pages.stats().all_bytes;
        executor.release(tree);
        pages.release(executor);
        let (what, held_bytes) = ("the pages of all meshes".to_owned(), executor.held_bytes());
        Err(GpuError::OutOfMemory { what, wanted_bytes, held_bytes })
    }

    /// Gives its memory back.
    pub fn release(self, executor: &mut Executor) {
        executor.release(self.tree);
        self.pages.release(executor);
    }
}

/// The words of a tracer over such pages.
pub(crate) fn tree_of(
    pages: &ScenePages<'_>,
    words: impl FnOnce(usize) -> Result<TracerWords, TraceError>,
) -> Result<TracerWords, GpuError> {
    let words = words(pages.kinds()[GEOMETRY].slot_bytes as usize);
    let words = words.map_err(|e| GpuError::Scene { reason: e.to_string() })?;
    let most = 7 * words.levels + 2;
    if most > STACK {
        let what = "the stack of rays in nodes".to_owned();
        return Err(GpuError::Limit { what, wanted: most as u64, limit: STACK as u64 });
    }
    Ok(words)
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
        let PageBuffers { pool: [first, second], table } = tracer.pages.buffers(recording);
        let left = recording.buffer("rays that are left", count.into());
        let tails = recording.upload("tails", &[0_u32, 0]);
        let workgroups = recording.buffer("workgroups", 3);
        let parameters = Parameters { count };
        let all = [tree, first, second, table, rays, answers, left, tails];
        recording.dispatch(kernel, &parameters, &all, Groups::Direct(count.div_ceil(GROUP)));
        let next = NextParameters { capacity: count, full: 0, empty: 1 };
        recording.dispatch(&NEXT, &next, &[tails, workgroups], Groups::Direct(1));
        recording.dispatch(settled, &parameters, &all, Groups::Indirect(workgroups, 0));
    }
    Ok(answers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_scene::{Scene, SceneDesc};
    use vastlight_trace::{Layout, TracerConfig};

    #[test]
    fn trees_deeper_than_the_stack_are_refused() {
        let scene = Scene::new(SceneDesc::default()).expect("valid");
        let config = TracerConfig { layout: Layout::Compact, ..TracerConfig::default() };
        let tracer = Tracer::new(&scene, &config).expect("built");
        let of_levels = |levels| {
            let words = |_| Ok(TracerWords { tree: Vec::new(), blocks: Vec::new(), levels });
            tree_of(&ScenePages::of_tracer(&tracer), words)
        };
        assert!(of_levels(27).is_ok());
        let deep = of_levels(100).expect_err("too deep");
        assert!(matches!(deep, GpuError::Limit { wanted: 702, .. }), "{deep}");
    }
}
