//! A path's vertex: the surface that a ray met, its material and its scattering.

use crate::bsdf::{Bsdf, Wavelength};
use crate::cone::Cone;
use crate::corners::{Corners, MeshCorners, PageCorners};
use crate::light::LightSample;
use crate::material::Evaluated;
use crate::medium::MediumStack;
use crate::moved::surface_at_time;
use crate::pages::PageHit;
use crate::placement::Placement;
use crate::sample::Sample;
use crate::surface::{Surface, mesh_of};
use crate::wavefront::{Context, PathState, WAVELENGTH_DIMENSION};
use vastlight_math::{Affine3, FAR, Frame, Ray, Vec3};
use vastlight_trace::Hit;

/// Shortens shadow rays so that they do not meet the light itself.
const SHADOW_SHORTENING: f32 = 1e-4;

/// Everything about the point that a ray met, seen from where the ray came.
pub(crate) struct Vertex<'a> {
    pub(crate) surface: Surface,
    pub(crate) material: u32,
    pub(crate) evaluated: &'a Evaluated,
    /// The scattering in empty space, where it is known already.
    prepared: Option<&'a Bsdf>,
    /// Shading frame, z outside.
    pub(crate) frame: Frame,
    /// Unit direction back along the ray, in world space.
    pub(crate) wo: Vec3,
    /// Whether the ray came from the outside.
    pub(crate) outside: bool,
}

impl<'a> Vertex<'a> {
    /// `page` is what is known of the hit triangle where meshes are in pages; `own` takes the material where it is not the
    /// same everywhere.
    #[inline(always)]
    pub(crate) fn new(
        context: &'a Context<'_>,
        (ray, cone): (&Ray, Cone),
        hit: &Hit,
        page: Option<PageHit<'_>>,
        own: &'a mut Option<Evaluated>,
    ) -> Self {
        let mesh = mesh_of(context.scene, hit);
        let material = mesh.material_of(hit.prim);
        let table = context.materials;
        let with_tangent = table.needs_tangent(material);
        let uv_sets = table.uv_sets(material);
        let surface = if let Some(shutter) = context.scene.shutter().filter(|shutter| !shutter.is_still()) {
            // Nothing is in pages then.
            surface_at_time((context, shutter), (ray, cone), hit, uv_sets, with_tangent)
        } else {
            let map = context.scene.instances().map(hit.instance as usize);
            let placement = context.placements.get(map, hit.instance);
            let place = (map, &placement);
            match (page.and_then(|page| page.corners), &mesh.implicit) {
                (Some(corners), _) => {
                    surface_in_page(place, (ray, cone), hit, &corners, uv_sets, with_tangent)
                }
                (None, None) => {
                    let corners = MeshCorners::new(mesh, hit);
                    surface(place, (ray, cone), hit, &corners, uv_sets, with_tangent)
                }
                (None, Some(shape)) => Surface::of_implicit(place, shape, (ray, hit.t)),
            }
        };
        let mut frame = surface.frame();
        let (evaluated, prepared) = match table.uniform(material, &surface.attributes) {
            Some((evaluated, bsdf)) => (evaluated, Some(bsdf)),
            None => {
                let evaluated = own.insert(match page.and_then(|page| page.evaluated) {
                    Some(evaluated) => *evaluated,
                    None => table.evaluate(material, &surface.attributes),
                });
                frame = evaluated.shading_frame(&frame);
                (&*evaluated, None)
            }
        };
        let wo = -ray.direction;
        let frame = surface.facing(frame, wo);
        let outside = wo.dot(surface.normal) >= 0.0;
        Self { surface, material, evaluated, prepared, frame, wo, outside }
    }

    /// Emitted radiance towards the ray.
    #[inline(always)]
    pub(crate) fn emission(&self, context: &Context<'_>) -> Vec3 {
        if self.outside || self.evaluated.unlit || context.materials.is_two_sided(self.material) {
            self.evaluated.emission
        } else {
            Vec3::ZERO
        }
    }

    /// Whether the surface bounds a volume that light can enter.
    pub(crate) fn bounds_volume(&self) -> bool {
        !self.evaluated.params.thin && self.evaluated.params.transmission > 0.0
    }

    /// The media on the far side of the surface for a path that is inside `media` on this side.
    pub(crate) fn media_behind(&self, media: MediumStack) -> MediumStack {
        match (self.bounds_volume(), self.outside) {
            (false, _) => media,
            (true, true) => media.entered(self.material),
            (true, false) => media.left(self.material),
        }
    }

    /// The scattering for `path`, in `own` unless it is known already.
    #[inline(always)]
    pub(crate) fn bsdf(
        &self,
        context: &Context<'_>,
        path: &PathState,
        own: &'a mut Option<Bsdf>,
    ) -> &'a Bsdf {
        if self.bounds_volume() {
            own.insert(self.bsdf_in_medium(context, path))
        } else {
            self.bsdf_alone(own)
        }
    }

    /// The scattering of the surface in empty space, in `own` unless it is known already.
    #[inline(always)]
    pub(crate) fn bsdf_alone(&self, own: &'a mut Option<Bsdf>) -> &'a Bsdf {
        match self.prepared {
            Some(bsdf) => bsdf,
            None => own.insert(Bsdf::new(&self.evaluated.params)),
        }
    }

    /// The scattering with the index of refraction relative to the medium around the volume.
    fn bsdf_in_medium(&self, context: &Context<'_>, path: &PathState) -> Bsdf {
        let mut params = self.evaluated.params;
        if params.dispersion > 0.0 {
            let u = path.sampler.at_dimension(WAVELENGTH_DIMENSION).next_1d();
            Wavelength::new(u, path.dispersed).apply(&mut params);
        }
        let around = if self.outside { path.media } else { path.media.left(self.material) };
        if let Some(medium) = around.current() {
            let ior = context.scene.materials()[medium as usize].ior;
            params.ior = if ior > 0.0 { params.ior / ior } else { params.ior };
        }
        Bsdf::new(&params)
    }

    /// `direction` in the shading frame, or `None` if shading normal and geometric normal disagree about its side:
    /// light would leak through the surface, or be reflected into it.
    #[inline]
    pub(crate) fn local_if_consistent(&self, direction: Vec3) -> Option<Vec3> {
        let local = self.frame.to_local(direction);
        (local.z * direction.dot(self.surface.normal) > 0.0).then_some(local)
    }

    /// Fills in what a sample says about its first surface.
    #[inline(always)]
    pub(crate) fn describe(
        &self,
        context: &Context<'_>,
        bsdf: &Bsdf,
        ray: &Ray,
        hit: &Hit,
        sample: &mut Sample,
    ) {
        sample.albedo = if self.evaluated.unlit { unit(self.evaluated.emission) } else { bsdf.albedo() };
        sample.normal = self.facing_normal();
        sample.position = self.surface.position;
        sample.depth = context.camera.depth(ray, hit.t);
        sample.coverage = 1.0;
        sample.object = hit.instance;
        sample.material = self.material;
    }

    /// A ray from here on.
    #[inline(always)]
    pub(crate) fn ray_towards(&self, direction: Vec3, time: f32) -> Ray {
        let origin = self.surface.origin_towards(direction);
        Ray { origin, t_min: 0.0, direction, t_max: FAR, time }
    }

    /// The ray that asks whether a light is to be seen from here; none where there is no way between.
    #[inline(always)]
    pub(crate) fn shadow_ray(&self, light: &LightSample, time: f32) -> Option<Ray> {
        let ray = self.ray_towards(light.wi, time);
        if light.distance >= FAR {
            return Some(ray);
        }
        let t_max = light.distance * (1.0 - SHADOW_SHORTENING) - 2.0 * self.surface.offset;
        (t_max > 0.0).then_some(Ray { t_max, ..ray })
    }

    /// Geometric normal on the side of the ray.
    #[inline(always)]
    pub(crate) fn facing_side(&self) -> Vec3 {
        if self.outside { self.surface.normal } else { -self.surface.normal }
    }

    /// Shading normal on the side of the ray.
    #[inline(always)]
    pub(crate) fn facing_normal(&self) -> Vec3 {
        if self.outside { self.frame.z } else { -self.frame.z }
    }
}

fn unit(color: Vec3) -> Vec3 {
    color.clamp(Vec3::ZERO, Vec3::ONE)
}

/// [`Surface::placed`], and the areas that lookups stand for.
#[inline(always)]
pub(crate) fn surface(
    place: (&Affine3, &Placement),
    (ray, cone): (&Ray, Cone),
    hit: &Hit,
    corners: &impl Corners,
    uv_sets: usize,
    with_tangent: bool,
) -> Surface {
    let mut surface = Surface::placed(place, hit, corners, uv_sets, with_tangent);
    surface.attributes.areas = cone.areas((ray, hit.t), place.0, corners, uv_sets);
    surface
}

/// [`surface`] of corners in a page.
#[inline(never)]
fn surface_in_page(
    place: (&Affine3, &Placement),
    seen: (&Ray, Cone),
    hit: &Hit,
    corners: &PageCorners<'_>,
    uv_sets: usize,
    with_tangent: bool,
) -> Surface {
    surface(place, seen, hit, corners, uv_sets, with_tangent)
}
