//! Rays against implicit surfaces: after the triangles, each ray is tried against every implicit instance, of which
//! there are few.
//!
//! All is double precision; a hit's `t` is rounded at the end. Methods give every crossing of a ray with the surface, in order,
//! so that filters may refuse some; entering and leaving both count. They miss no crossing: only two that are closer
//! than [`LEAST`] to each other, where a ray grazes, may count as none.

mod bernstein;
mod julia;
mod metaballs;
mod root;

use crate::instance::widen;
use crate::{Hit, HitFilter};
use std::ops::ControlFlow;
use std::sync::Arc;
use vastlight_math::glam::{DAffine3, DVec3};
use vastlight_math::{Aabb, Ray};
use vastlight_scene::{ImplicitShape, InstanceKeys, Scene, Shutter};

/// Two crossings closer than this, as a part of the shape's size, may count as none.
const LEAST: f64 = 1.0 / (1_u64 << 30) as f64;

/// A straight line through object space, the direction of unit length, and the part of it that counts.
#[derive(Clone, Copy, Debug)]
struct Line {
    origin: DVec3,
    direction: DVec3,
    from: f64,
    to: f64,
}

impl Line {
    fn at(&self, s: f64) -> DVec3 {
        self.origin + self.direction * s
    }

    /// The part within a sphere; none where that is empty.
    fn within(&self, center: DVec3, radius: f64) -> Option<Self> {
        let middle = (center - self.origin).dot(self.direction);
        let square = radius * radius - self.at(middle).distance_squared(center);
        let is_met = square > 0.0;
        if !is_met {
            return None;
        }
        let half = square.sqrt();
        let (from, to) = (self.from.max(middle - half), self.to.min(middle + half));
        (from < to).then_some(Self { from, to, ..*self })
    }
}

/// Is told of the crossings, in order, until it has enough.
type Visit<'a> = dyn FnMut(f64) -> ControlFlow<()> + 'a;

/// Memory that rays share.
#[derive(Debug, Default)]
struct Scratch {
    metaballs: metaballs::Scratch,
}

/// An implicit surface with its place.
#[derive(Debug)]
struct Placed {
    shape: Arc<ImplicitShape>,
    object_from_world: DAffine3,
    instance: u32,
    /// Where it moves while a shutter is open.
    shutter: Option<Arc<Shutter>>,
    /// The sphere around the shape in object space.
    center: DVec3,
    radius: f64,
}

impl Placed {
    /// The map at the time of a ray; none where the surface is not to be seen.
    fn object_from_world(&self, time: f32) -> Option<DAffine3> {
        let Some(shutter) = &self.shutter else { return Some(self.object_from_world) };
        let map = shutter.instance(self.instance)?.at(&shutter.between(time))?;
        Some(widen(&map).inverse())
    }

    /// The crossings of a world ray, as its parameters.
    fn cross(&self, ray: &Ray, t_max: f32, scratch: &mut Scratch, visit: &mut Visit<'_>) {
        let Some(object_from_world) = self.object_from_world(ray.time) else { return };
        let origin = object_from_world.transform_point3(ray.origin.as_dvec3());
        let direction = object_from_world.transform_vector3(ray.direction.as_dvec3());
        let length = direction.length();
        let (from, to) = (f64::from(ray.t_min.max(0.0)) * length, f64::from(t_max) * length);
        let line = Line { origin, direction: direction / length, from, to };
        let Some(line) = line.within(self.center, self.radius) else { return };
        let mut visit = |s: f64| visit(s / length);
        // Enough or not, nothing follows.
        let _ = match &*self.shape {
            ImplicitShape::Metaballs(shape) => {
                metaballs::cross(shape, &line, &mut scratch.metaballs, &mut visit)
            }
            ImplicitShape::Julia(shape) => julia::cross(shape, &line, &mut visit),
        };
    }
}

/// The implicit surfaces of a scene.
#[derive(Debug)]
pub(crate) struct Implicits {
    placed: Vec<Placed>,
    /// Around all of them in the world.
    pub(crate) world: Aabb,
}

impl Implicits {
    /// Those of `scene`; `None` if it has none.
    pub(crate) fn new(scene: &Scene) -> Option<Self> {
        let (mut placed, mut world) = (Vec::new(), Aabb::EMPTY);
        for (number, mesh) in (0..).zip(scene.meshes()) {
            let Some(shape) = &mesh.implicit else { continue };
            let bounds = shape.bounds();
            for instance in scene.instances().of_mesh(number) {
                let map = scene.instances().map(instance as usize);
                let shutter = scene.shutter().filter(|s| s.instance(instance).is_some()).cloned();
                let keys = shutter.as_ref().and_then(|s| s.instance(instance));
                let ends = keys.into_iter().flat_map(InstanceKeys::ways).flatten();
                world = ends.chain([map]).fold(world, |world, map| world.union(bounds.transformed(map)));
                placed.push(Placed {
                    shape: Arc::clone(shape),
                    object_from_world: widen(map).inverse(),
                    instance,
                    shutter,
                    center: (bounds.min.as_dvec3() + bounds.max.as_dvec3()) * 0.5,
                    radius: bounds.size().as_dvec3().length() * 0.5,
                });
            }
        }
        (!placed.is_empty()).then_some(Self { placed, world })
    }

    /// Puts the hits of implicit surfaces in the place of those that are behind them.
    pub(crate) fn closest(&self, rays: &[Ray], filter: &dyn HitFilter, hits: &mut [Hit]) {
        let scratch = &mut Scratch::default();
        for (index, (ray, best)) in rays.iter().zip(hits).enumerate() {
            self.improve(index, ray, filter, scratch, best);
        }
    }

    /// Sets what implicit surfaces occlude.
    pub(crate) fn occluded(&self, rays: &[Ray], filter: &dyn HitFilter, occluded: &mut [bool]) {
        let scratch = &mut Scratch::default();
        for (index, (ray, occluded)) in rays.iter().zip(occluded).enumerate() {
            if !*occluded {
                let mut best = Hit::MISS;
                self.improve(index, ray, filter, scratch, &mut best);
                *occluded = best.is_hit();
            }
        }
    }

    fn improve(
        &self,
        index: usize,
        ray: &Ray,
        filter: &dyn HitFilter,
        scratch: &mut Scratch,
        best: &mut Hit,
    ) {
        // Written so that NaN is refused too.
        if !(ray.t_min <= ray.t_max && ray.origin.is_finite() && ray.direction.is_finite()) {
            return;
        }
        for placed in &self.placed {
            let t_max = ray.t_max.min(best.t);
            placed.cross(ray, t_max, scratch, &mut |t| {
                let t = (t as f32).max(ray.t_min).max(0.0);
                let hit = Hit { t, u: 0.0, v: 0.0, instance: placed.instance, prim: 0 };
                let is_closer = t < best.t || t == best.t && placed.instance < best.instance;
                if t > ray.t_max || !is_closer {
                    return ControlFlow::Break(());
                }
                if !filter.accepts(index, &hit) {
                    return ControlFlow::Continue(());
                }
                *best = hit;
                ControlFlow::Break(())
            });
        }
    }
}

#[cfg(test)]
mod tests;
