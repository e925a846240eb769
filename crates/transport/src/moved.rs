//! What a ray of an open shutter met, as it is at the ray's time.

use crate::cone::Cone;
use crate::corners::{Corners, MeshCorners};
use crate::placement::Placement;
use crate::surface::{Surface, mesh_of};
use crate::vertex::surface;
use crate::wavefront::Context;
use vastlight_math::{Between, Ray, Vec2, Vec3, Vec4};
use vastlight_scene::{MeshKey, Shutter};
use vastlight_trace::Hit;

/// The corners of a triangle whose mesh moves: places and directions between two keys, and all else as in the mesh.
struct MovedCorners<'m> {
    still: MeshCorners<'m>,
    ends: [&'m MeshKey; 2],
    between: Between,
}

impl MovedCorners<'_> {
    fn of<T: Copy>(&self, values: impl Fn(&MeshKey) -> &[T], blend: impl Fn(T, T) -> T) -> Option<[T; 3]> {
        let [a, b] = self.ends.map(values);
        (!a.is_empty()).then(|| self.still.index().map(|i| blend(a[i], b[i])))
    }
}

impl Corners for MovedCorners<'_> {
    fn points(&self) -> [Vec3; 3] {
        let points = self.of(|key| &key.positions, |a, b| self.between.blend(a, b));
        points.unwrap_or_else(|| self.still.points())
    }

    fn normals(&self) -> Option<[Vec3; 3]> {
        self.of(|key| &key.normals, |a, b| self.between.blend(a, b))
    }

    fn tangents(&self) -> Option<[Vec4; 3]> {
        self.of(|key| &key.tangents, |a, b| self.between.tangent(a, b))
    }

    fn colors(&self) -> Option<[Vec4; 3]> {
        self.still.colors()
    }

    fn uvs(&self, set: usize) -> Option<[Vec2; 3]> {
        self.still.uvs(set)
    }
}

/// The surface that a ray of an open shutter met, whether it moves or not.
#[inline(never)]
pub(crate) fn surface_at_time(
    (context, shutter): (&Context<'_>, &Shutter),
    (ray, cone): (&Ray, Cone),
    hit: &Hit,
    uv_sets: usize,
    with_tangent: bool,
) -> Surface {
    let (scene, mesh, between) = (context.scene, mesh_of(context.scene, hit), shutter.between(ray.time));
    let moved = shutter.instance(hit.instance).and_then(|keys| keys.at(&between));
    let still = scene.instances().map(hit.instance as usize);
    let placement = match &moved {
        Some(map) => Placement::new(map),
        None => context.placements.get(still, hit.instance),
    };
    let place = (moved.as_ref().unwrap_or(still), &placement);
    if let Some(shape) = &mesh.implicit {
        return Surface::of_implicit(place, shape, (ray, hit.t));
    }
    let corners = MeshCorners::new(mesh, hit);
    let keys = shutter.mesh(scene.instances().mesh(hit.instance as usize));
    match keys.and_then(|keys| between.ends(keys)) {
        Some(ends) => {
            let corners = MovedCorners { still: corners, ends, between };
            surface(place, (ray, cone), hit, &corners, uv_sets, with_tangent)
        }
        None => surface(place, (ray, cone), hit, &corners, uv_sets, with_tangent),
    }
}
