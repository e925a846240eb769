//! The two middle kernels of the stream tracer: scene traversal and intersection, over queues of rays.
//!
//! After Z. Chen, G. Zhang, W. Shi, T. Ren, "Improved ray tracing on stream processors": traversal brings a ray to the
//! next leaf of the kd-tree and hands on the pair of ray and leaf; intersection tests the leaf's triangles and hands
//! the ray back to traversal, or on to shading when its way has ended. Walks by threads need no stack, so a ray
//! between two kernels is a plain record ([`StreamRay`]) that a GPU could share.

use crate::judge::Filtered;
use crate::kd::{Place, Threads, Walk};
use crate::{Hit, HitFilter, Tracer};
use vastlight_math::{Ray, Vec3};
use vastlight_simd::{Kernel, Simd8};

/// A ray on its way, and where it stands; 112 bytes.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct StreamRay {
    origin: Vec3,
    t_min: f32,
    direction: Vec3,
    t_max: f32,
    /// The closest hit so far: parameter, weights, instance, triangle.
    t: f32,
    weights: [f32; 2],
    hit: [u32; 2],
    /// 1 if any hit will do.
    any: u32,
    time: f32,
    /// The instance that is being crossed, and the leaf of its mesh; [`Hit::NONE`] outside of all.
    instance: u32,
    leaf: u32,
    /// What comes after the leaf lies behind this parameter.
    safe: f32,
    place: Place,
}

impl StreamRay {
    /// A ray at its start, which looks for the closest hit, or with `any` for some hit.
    #[must_use]
    pub fn new(ray: &Ray, any: bool) -> Self {
        let mut stream = Self {
            origin: ray.origin,
            t_min: ray.t_min.max(0.0),
            direction: ray.direction,
            t_max: ray.t_max,
            t: 0.0,
            weights: [0.0; 2],
            hit: [Hit::NONE; 2],
            any: u32::from(any),
            time: ray.time,
            instance: Hit::NONE,
            leaf: Hit::NONE,
            safe: 0.0,
            place: Place::START,
        };
        // What a walk would refuse has no way at all; written so that NaN is refused too.
        if !(ray.t_min <= ray.t_max && stream.t_min <= ray.t_max) {
            stream.t_max = -1.0;
        }
        stream.set_hit(&Hit::MISS);
        stream
    }

    /// The ray.
    #[must_use]
    pub fn ray(&self) -> Ray {
        let Self { origin, t_min, direction, t_max, time, .. } = *self;
        Ray { origin, t_min, direction, t_max, time }
    }

    /// What it has hit, once its way has ended.
    #[must_use]
    pub fn hit(&self) -> Hit {
        let ([u, v], [instance, prim]) = (self.weights, self.hit);
        Hit { t: self.t, u, v, instance, prim }
    }

    /// Whether any hit will do.
    #[must_use]
    pub fn looks_for_any(&self) -> bool {
        self.any != 0
    }

    fn set_hit(&mut self, hit: &Hit) {
        (self.t, self.weights, self.hit) = (hit.t, [hit.u, hit.v], [hit.instance, hit.prim]);
    }
}

/// Where rays go after a kernel; slots of the rays' array, appended in the order of the input.
#[derive(Debug)]
pub struct Outlets<'a> {
    /// On to the other of the two kernels.
    pub on: &'a mut Vec<u32>,
    /// Their way has ended: to shading.
    pub ended: &'a mut Vec<u32>,
}

impl Tracer {
    /// Whether [`Tracer::traverse`] and [`Tracer::intersect`] do anything: they need threaded kd-trees, and no surfaces
    /// beside those.
    #[must_use]
    pub fn has_stream_kernels(&self) -> bool {
        self.implicits.is_none() && self.kd.as_ref().is_some_and(|kd| !kd.stacked)
    }

    /// The traversal kernel: brings the rays of `rays` in the slots `queue` to their next leaf.
    pub fn traverse(&self, rays: &mut [StreamRay], queue: &[u32], outlets: Outlets<'_>) {
        let Some(kd) = &self.kd else { return };
        for &slot in queue {
            let ray = &mut rays[slot as usize];
            let mut walk = Walk::resume(self, kd, ray.ray(), ray.hit(), ray.place);
            let leaf = next_leaf(ray, &mut walk);
            ray.place = walk.place;
            match leaf {
                Some((instance, leaf, safe)) => {
                    (ray.instance, ray.leaf, ray.safe) = (instance, leaf, safe);
                    outlets.on.push(slot);
                }
                None => outlets.ended.push(slot),
            }
        }
    }

    /// The intersection kernel: tests the leaves at which the rays in the slots `queue` stand. The filter is told
    /// slots.
    pub fn intersect(
        &self,
        rays: &mut [StreamRay],
        queue: &[u32],
        filter: &dyn HitFilter,
        outlets: Outlets<'_>,
    ) {
        self.level().dispatch(Intersect { tracer: self, rays, queue, filter: Filtered(filter), outlets });
    }
}

impl Tracer {
    /// Both kernels at once, for structures that have none: brings the rays in the slots `queue` to the ends of their
    /// ways. The filter is told slots.
    pub fn trace_whole(
        &self,
        rays: &mut [StreamRay],
        queue: &[u32],
        filter: &dyn HitFilter,
        ended: &mut Vec<u32>,
    ) {
        let (any, closest): (Vec<u32>, Vec<u32>) =
            queue.iter().partition(|&&slot| rays[slot as usize].looks_for_any());
        let ray_of = |rays: &[StreamRay], slots: &[u32]| -> Vec<Ray> {
            slots.iter().map(|&slot| rays[slot as usize].ray()).collect()
        };
        let mut hits = vec![Hit::MISS; closest.len()];
        self.closest(&ray_of(rays, &closest), &BySlot { filter, slots: &closest }, &mut hits);
        let mut occluded = vec![false; any.len()];
        self.occluded(&ray_of(rays, &any), &BySlot { filter, slots: &any }, &mut occluded);
        for (&slot, hit) in closest.iter().zip(&hits) {
            rays[slot as usize].set_hit(hit);
        }
        let some = Hit { t: 0.0, u: 0.0, v: 0.0, instance: 0, prim: 0 };
        for (&slot, &occluded) in any.iter().zip(&occluded) {
            rays[slot as usize].set_hit(if occluded { &some } else { &Hit::MISS });
        }
        ended.extend_from_slice(queue);
    }
}

/// A filter that is told slots where a batch counts rays.
struct BySlot<'a> {
    filter: &'a dyn HitFilter,
    slots: &'a [u32],
}

impl HitFilter for BySlot<'_> {
    fn accepts_all(&self) -> bool {
        self.filter.accepts_all()
    }

    fn accepts(&self, ray: usize, hit: &Hit) -> bool {
        self.filter.accepts(self.slots[ray] as usize, hit)
    }
}

/// Instance, leaf and safe parameter of the next leaf.
fn next_leaf(ray: &StreamRay, walk: &mut Walk<'_>) -> Option<(u32, u32, f32)> {
    if ray.leaf != Hit::NONE
        && let Some(crossing) = walk.crossing(ray.instance)
        && let Some((leaf, span)) = crossing.after(&mut Threads, ray.leaf as usize, ray.safe)
    {
        return Some((ray.instance, leaf as u32, span.safe));
    }
    while let Some(crossing) = walk.next_crossing(&mut Threads) {
        if let Some((leaf, span)) = crossing.first(&mut Threads) {
            return Some((crossing.instance, leaf as u32, span.safe));
        }
    }
    None
}

struct Intersect<'a> {
    tracer: &'a Tracer,
    rays: &'a mut [StreamRay],
    queue: &'a [u32],
    filter: Filtered<'a>,
    outlets: Outlets<'a>,
}

impl Kernel for Intersect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let Some(kd) = &self.tracer.kd else { return };
        for &slot in self.queue {
            let ray = &mut self.rays[slot as usize];
            let mut walk = Walk::resume(self.tracer, kd, ray.ray(), ray.hit(), ray.place);
            let Some(mut crossing) = walk.crossing(ray.instance) else { continue };
            let found = crossing.test(simd, ray.leaf as usize, slot as usize, self.filter, &mut walk.best);
            ray.set_hit(&walk.best);
            let outlet =
                if found && ray.looks_for_any() { &mut *self.outlets.ended } else { &mut *self.outlets.on };
            outlet.push(slot);
        }
    }
}
