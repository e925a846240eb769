//! Rays on their way through both levels of kd-trees.
//!
//! By threads, all that a ray must remember is in which leaf of each level it stands: a walk can be laid aside
//! ([`Place`]) and taken up again, which the stream tracer does after every leaf.
//!
//! An instance is in every leaf that its box reaches into. It is crossed as a whole when it is met first; the last few
//! are remembered, so that it is rarely crossed again.

use super::KdScene;
use crate::judge::Filtered;
use crate::paged::{End, Found};
use crate::reach::{Meeting, Reach, meet};
use crate::walk::Answers;
use crate::{Hit, Tracer};
use vastlight_accel::kdtree::traverse::{KdRay, Span};
use vastlight_accel::kdtree::{KdMesh, KdNode};
use vastlight_accel::ray::{ScaledRay, TriangleRay};
use vastlight_math::Ray;
use vastlight_simd::{Kernel, Simd8};

/// How a walk gets from leaf to leaf.
pub(crate) trait Steps: Default {
    /// The first leaf that the ray meets before `t_max`.
    fn first(&mut self, way: &KdRay, nodes: &[KdNode], t_max: f32) -> Option<(usize, Span)>;
    /// The leaf after `leaf`.
    fn after(&mut self, way: &KdRay, nodes: &[KdNode], leaf: usize, t_max: f32) -> Option<(usize, Span)>;
}

/// By threads.
#[derive(Default)]
pub(crate) struct Threads;

impl Steps for Threads {
    #[inline(always)]
    fn first(&mut self, way: &KdRay, nodes: &[KdNode], t_max: f32) -> Option<(usize, Span)> {
        way.first(nodes, t_max)
    }
    #[inline(always)]
    fn after(&mut self, way: &KdRay, nodes: &[KdNode], leaf: usize, t_max: f32) -> Option<(usize, Span)> {
        way.after(nodes, leaf, t_max)
    }
}

/// With a stack.
#[derive(Default)]
struct Stack(Vec<(u32, Span)>);

impl Steps for Stack {
    #[inline(always)]
    fn first(&mut self, way: &KdRay, nodes: &[KdNode], t_max: f32) -> Option<(usize, Span)> {
        way.first_stacked(nodes, t_max, &mut self.0)
    }
    #[inline(always)]
    fn after(&mut self, way: &KdRay, nodes: &[KdNode], _leaf: usize, t_max: f32) -> Option<(usize, Span)> {
        way.after_stacked(nodes, t_max, &mut self.0)
    }
}

/// Where a walk stands among instances.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Place {
    /// The leaf, [`Place::BEFORE`] before the first.
    leaf: u32,
    /// The next of its items.
    item: u32,
    /// What comes after the leaf lies behind this parameter.
    safe: f32,
    /// The instances that were crossed last.
    seen: [u32; 4],
}

impl Place {
    const BEFORE: u32 = u32::MAX;

    /// Before the first leaf.
    pub(crate) const START: Self = Self { leaf: Self::BEFORE, item: 0, safe: 0.0, seen: [Hit::NONE; 4] };
}

/// A ray among instances.
pub(crate) struct Walk<'a> {
    tracer: &'a Tracer,
    kd: &'a KdScene,
    ray: Ray,
    pub(crate) best: Hit,
    pub(crate) place: Place,
    /// The ray in the world, and the scale of its parameters; found when it is needed.
    way: Option<(KdRay, f32)>,
}

impl<'a> Walk<'a> {
    /// The walk of `ray` from its start; none if it is at its end already.
    #[inline(always)]
    pub(crate) fn start(tracer: &'a Tracer, kd: &'a KdScene, ray: &Ray) -> Option<Self> {
        let t_min = ray.t_min.max(0.0);
        let in_order = ray.t_min <= ray.t_max && t_min <= ray.t_max;
        let ray = Ray { t_min, ..*ray };
        in_order.then_some(Self { tracer, kd, ray, best: Hit::MISS, place: Place::START, way: None })
    }

    /// A walk that was laid aside.
    #[inline(always)]
    pub(crate) fn resume(tracer: &'a Tracer, kd: &'a KdScene, ray: Ray, best: Hit, place: Place) -> Self {
        Self { tracer, kd, ray, best, place, way: None }
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        if self.best.is_hit() { self.best.t } else { self.ray.t_max }
    }

    /// The next instance on the way, ready to be crossed.
    #[inline(always)]
    pub(crate) fn next_crossing<W: Steps>(&mut self, steps: &mut W) -> Option<Crossing<'a>> {
        loop {
            let instance = self.next_instance(steps)?;
            if let Some(crossing) = self.crossing(instance) {
                return Some(crossing);
            }
        }
    }

    #[inline(always)]
    fn next_instance<W: Steps>(&mut self, steps: &mut W) -> Option<u32> {
        let top = &self.kd.top;
        loop {
            let items = match top.nodes.get(self.place.leaf as usize) {
                Some(leaf) => &top.items[leaf.items()],
                None => &[],
            };
            while let Some(&instance) = items.get(self.place.item as usize) {
                self.place.item += 1;
                if !self.place.seen.contains(&instance) && self.meets_box(instance) {
                    self.place.seen.rotate_right(1);
                    self.place.seen[0] = instance;
                    return Some(instance);
                }
            }
            let (leaf, span) = self.next_leaf(steps)?;
            (self.place.leaf, self.place.item, self.place.safe) = (leaf as u32, 0, span.safe);
        }
    }

    /// Whether a scene of one instance needs no boxes in the world.
    #[inline(always)]
    fn is_alone(&self) -> bool {
        self.kd.top.items.len() == 1
    }

    #[inline(always)]
    fn meets_box(&self, instance: u32) -> bool {
        let Some((way, t_scale)) = self.way else { return true };
        let span = way.span(&self.kd.boxes[instance as usize], self.t_max() / t_scale);
        span.enter <= span.leave
    }

    #[inline(always)]
    fn next_leaf<W: Steps>(&mut self, steps: &mut W) -> Option<(usize, Span)> {
        let first = self.place.leaf == Place::BEFORE;
        if self.is_alone() {
            return first.then_some((0, Span::default()));
        }
        let (way, t_scale) = self.way_in_world()?;
        let (nodes, t_max) = (&self.kd.top.nodes[..], self.t_max() / t_scale);
        if first {
            steps.first(&way, nodes, t_max)
        } else if t_max < self.place.safe {
            None
        } else {
            steps.after(&way, nodes, self.place.leaf as usize, t_max)
        }
    }

    #[inline(always)]
    fn way_in_world(&mut self) -> Option<(KdRay, f32)> {
        if self.way.is_none() {
            let scaled = ScaledRay::new(self.ray.origin, self.ray.direction)?;
            let boxes = scaled.for_boxes(self.tracer.places.extent, self.tracer.places.margin_factor);
            self.way = Some((KdRay::new(&boxes, self.ray.t_min / scaled.t_scale), scaled.t_scale));
        }
        self.way
    }

    /// The ray in the mesh of an instance; none if it cannot hit it.
    #[inline(always)]
    pub(crate) fn crossing(&self, instance: u32) -> Option<Crossing<'a>> {
        let mut room = None;
        let placed = self.tracer.places.get(instance as usize, &mut room)?;
        let mesh = &self.kd.meshes[placed.mesh as usize];
        let (origin, direction) = placed.map_ray(self.ray.origin, self.ray.direction);
        let scaled = ScaledRay::new(origin, direction)?;
        let (boxes, triangles) = scaled.for_triangles(mesh.extent)?;
        let t_scale = scaled.t_scale;
        let reach = Reach { t_min: self.ray.t_min / t_scale, t_max: self.t_max() / t_scale, t_scale };
        let way = KdRay::new(&boxes, reach.t_min);
        Some(Crossing { mesh, triangles, way, reach, instance })
    }
}

/// A ray in the mesh of an instance.
pub(crate) struct Crossing<'a> {
    mesh: &'a KdMesh,
    triangles: TriangleRay,
    way: KdRay,
    reach: Reach,
    pub(crate) instance: u32,
}

impl Crossing<'_> {
    /// The first leaf on the way.
    #[inline(always)]
    pub(crate) fn first<W: Steps>(&self, steps: &mut W) -> Option<(usize, Span)> {
        steps.first(&self.way, &self.mesh.nodes, self.reach.t_max)
    }

    /// The leaf after `leaf`, whose span was safe up to `safe`.
    #[inline(always)]
    pub(crate) fn after<W: Steps>(&self, steps: &mut W, leaf: usize, safe: f32) -> Option<(usize, Span)> {
        if self.reach.t_max < safe {
            return None;
        }
        steps.after(&self.way, &self.mesh.nodes, leaf, self.reach.t_max)
    }

    /// Tests the triangles of a leaf; whether one is hit closer than `best`, which it becomes.
    #[inline(always)]
    pub(crate) fn test<S: Simd8>(
        &mut self,
        simd: S,
        leaf: usize,
        index: usize,
        filter: Filtered<'_>,
        best: &mut Hit,
    ) -> bool {
        let mut found = false;
        for block in &self.mesh.blocks[self.mesh.nodes[leaf].items()] {
            let ray = (&self.triangles, index);
            let mut meeting = Meeting { best, found: &mut Found::NONE.clone(), unknown: None };
            found |= meet(simd, (block, self.instance, 0), ray, &filter, &mut self.reach, &mut meeting);
        }
        found
    }
}

/// Traces a batch for the closest hits, or with `ANY` for some hit of each ray.
pub(crate) struct KdBatch<'a, A: Answers, const ANY: bool> {
    pub(crate) tracer: &'a Tracer,
    pub(crate) kd: &'a KdScene,
    pub(crate) rays: &'a [Ray],
    pub(crate) filter: Filtered<'a>,
    pub(crate) answers: A,
}

impl<A: Answers, const ANY: bool> Kernel for KdBatch<'_, A, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) {
        if self.kd.stacked { self.run_with::<S, Stack>(simd) } else { self.run_with::<S, Threads>(simd) }
    }
}

impl<A: Answers, const ANY: bool> KdBatch<'_, A, ANY> {
    #[inline(always)]
    fn run_with<S: Simd8, W: Steps>(mut self, simd: S) {
        let mut steps = (W::default(), W::default());
        for (index, ray) in self.rays.iter().enumerate() {
            let hit = self.follow(simd, index, ray, &mut steps);
            self.answers.set(index, &hit, &End::COMPLETE);
        }
    }

    /// Follows a ray to its end.
    #[inline(always)]
    fn follow<S: Simd8, W: Steps>(&self, simd: S, index: usize, ray: &Ray, steps: &mut (W, W)) -> Hit {
        let Some(mut walk) = Walk::start(self.tracer, self.kd, ray) else { return Hit::MISS };
        while let Some(mut crossing) = walk.next_crossing(&mut steps.0) {
            let mut next = crossing.first(&mut steps.1);
            while let Some((leaf, span)) = next {
                if crossing.test(simd, leaf, index, self.filter, &mut walk.best) && ANY {
                    return walk.best;
                }
                next = crossing.after(&mut steps.1, leaf, span.safe);
            }
        }
        walk.best
    }
}
