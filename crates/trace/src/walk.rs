//! One ray through both levels: instances, then the triangles of their meshes.

use crate::instance::Placed;
use crate::{Hit, HitFilter, Tracer};
use vastlight_accel::ray::{BoxRay, ScaledRay, TriangleRay};
use vastlight_accel::triangle::intersect;
use vastlight_accel::wide::traverse::{Entry, Leaves, STACK, Tree, traverse};
use vastlight_accel::wide::{Block8, MeshBvh};
use vastlight_math::Ray;
use vastlight_simd::{Kernel, Simd8};

/// Traces a batch for the closest hits.
pub(crate) struct Closest<'a, F> {
    pub(crate) tracer: &'a Tracer,
    pub(crate) rays: &'a [Ray],
    pub(crate) filter: &'a F,
    pub(crate) hits: &'a mut [Hit],
}

impl<F: HitFilter> Kernel for Closest<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let mut stack = [0; 2 * STACK];
        for (index, (ray, hit)) in self.rays.iter().zip(self.hits).enumerate() {
            *hit = walk::<S, F, false>(simd, self.tracer, ray, index, self.filter, &mut stack);
        }
    }
}

/// Traces a batch for any hit.
pub(crate) struct Occluded<'a, F> {
    pub(crate) tracer: &'a Tracer,
    pub(crate) rays: &'a [Ray],
    pub(crate) filter: &'a F,
    pub(crate) occluded: &'a mut [bool],
}

impl<F: HitFilter> Kernel for Occluded<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        let mut stack = [0; 2 * STACK];
        for (index, (ray, occluded)) in self.rays.iter().zip(self.occluded).enumerate() {
            *occluded = walk::<S, F, true>(simd, self.tracer, ray, index, self.filter, &mut stack).is_hit();
        }
    }
}

/// The closest hit of one ray, or with `ANY` some hit.
#[inline(always)]
fn walk<S: Simd8, F: HitFilter, const ANY: bool>(
    simd: S,
    tracer: &Tracer,
    ray: &Ray,
    index: usize,
    filter: &F,
    stack: &mut [Entry; 2 * STACK],
) -> Hit {
    let t_min = ray.t_min.max(0.0);
    let in_order = ray.t_min <= ray.t_max && t_min <= ray.t_max;
    let (Some(root), Some(scaled), true) =
        (tracer.top.root, ScaledRay::new(ray.origin, ray.direction), in_order)
    else {
        return Hit::MISS;
    };
    // A scene of one instance needs no boxes here.
    let boxes = if root.is_leaf() {
        BoxRay::default()
    } else {
        scaled.for_boxes(tracer.extent, tracer.margin_factor)
    };
    let (own_stack, mesh_stack) = stack.split_at_mut(STACK);
    let mut instances = Instances::<F, ANY> {
        tracer,
        ray,
        t_min,
        t_max: ray.t_max,
        index,
        filter,
        stack: mesh_stack,
        best: Hit::MISS,
        t_scale: scaled.t_scale,
    };
    let mut t_max = ray.t_max / scaled.t_scale;
    let tree = Tree { nodes: &tracer.top.nodes, root };
    traverse(simd, tree, &boxes, (t_min / scaled.t_scale, &mut t_max), own_stack, &mut instances);
    instances.best
}

/// The leaves of the upper level.
struct Instances<'a, F, const ANY: bool> {
    tracer: &'a Tracer,
    ray: &'a Ray,
    t_min: f32,
    t_max: f32,
    index: usize,
    filter: &'a F,
    stack: &'a mut [Entry],
    best: Hit,
    t_scale: f32,
}

impl<S: Simd8, F: HitFilter, const ANY: bool> Leaves<S> for Instances<'_, F, ANY> {
    #[inline(always)]
    fn visit(&mut self, simd: S, leaf: usize, t_max: &mut f32) -> bool {
        let placed = &self.tracer.placed[leaf];
        let mesh = &self.tracer.meshes[placed.mesh as usize];
        let (origin, direction) = placed.map_ray(self.ray.origin, self.ray.direction);
        let Some(scaled) = ScaledRay::new(origin, direction) else { return false };
        let (Some(root), Some(ray)) = (mesh.root, scaled.for_triangles(mesh.extent)) else { return false };
        let mut triangles = Triangles::<F, ANY> {
            mesh,
            ray: &ray,
            t_min: self.t_min / scaled.t_scale,
            t_scale: scaled.t_scale,
            instance: leaf as u32,
            index: self.index,
            filter: self.filter,
            best: self.best,
        };
        let mut t_max_here = self.t_max / scaled.t_scale;
        let range = (triangles.t_min, &mut t_max_here);
        let tree = Tree { nodes: &mesh.nodes, root };
        let done = traverse(simd, tree, &ray.boxes, range, self.stack, &mut triangles);
        self.best = triangles.best;
        if self.best.is_hit() {
            self.t_max = self.best.t;
            *t_max = self.best.t / self.t_scale;
        }
        done
    }

    #[inline(always)]
    fn memory(&self) -> (*const u8, usize) {
        (self.tracer.placed.as_ptr().cast(), size_of::<Placed>())
    }
}

/// The leaves of the lower level: blocks of triangles.
struct Triangles<'a, F, const ANY: bool> {
    mesh: &'a MeshBvh,
    ray: &'a TriangleRay,
    t_min: f32,
    t_scale: f32,
    instance: u32,
    index: usize,
    filter: &'a F,
    best: Hit,
}

impl<S: Simd8, F: HitFilter, const ANY: bool> Leaves<S> for Triangles<'_, F, ANY> {
    #[inline(always)]
    fn visit(&mut self, simd: S, leaf: usize, t_max: &mut f32) -> bool {
        let block = &self.mesh.blocks[leaf];
        let hits = intersect(simd, block, self.ray);
        let mut lanes = hits.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % 8;
            lanes &= lanes - 1;
            let t = hits.t[lane];
            if t < self.t_min || t > *t_max {
                continue;
            }
            let (instance, prim) = (self.instance, block.prims[lane]);
            // On a tie the lower (instance, triangle) wins, whichever comes first.
            if t == *t_max && (instance, prim) >= (self.best.instance, self.best.prim) {
                continue;
            }
            let hit = Hit { t: t * self.t_scale, u: hits.u[lane], v: hits.v[lane], instance, prim };
            if F::ACCEPTS_ALL || self.filter.accepts(self.index, &hit) {
                self.best = hit;
                *t_max = t;
                if ANY {
                    return true;
                }
            }
        }
        false
    }

    #[inline(always)]
    fn memory(&self) -> (*const u8, usize) {
        (self.mesh.blocks.as_ptr().cast(), size_of::<Block8>())
    }
}
