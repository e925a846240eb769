//! The fourth kernel for one ray: its local colour, and the rays that it derives.

use super::phong::Phong;
use super::records::Load;
use crate::alpha::AlphaFilter;
use crate::cone::Cone;
use crate::medium::transmittance;
use crate::photon::{Gather, receives};
use crate::sample::Sample;
use crate::surface::mesh_of;
use crate::vertex::Vertex;
use crate::wavefront::{CAMERA_DIMENSIONS, Context};
use vastlight_math::{Ray, Sampler, Vec3};
use vastlight_scene::Material;
use vastlight_trace::stream::StreamRay;
use vastlight_trace::{Hit, HitFilter};

/// Rays that carry less are not derived.
const FAINTEST: f32 = 1.0 / 512.0;
/// Rays are numbered by their way through the tree of a sample in 32 bits.
const DEEPEST: u32 = 31;

/// Rays derived at one hit: mirrored, refracted, to a light.
pub(super) type Derived = [Option<(Ray, Load)>; 3];

/// What the end of a ray adds to its sample at once. Rays that may add more are put into `derived`.
pub(super) fn shade(
    context: &Context<'_>,
    stream: &StreamRay,
    load: &Load,
    sampler: &Sampler,
    sample: &mut Sample,
    derived: &mut Derived,
) -> Vec3 {
    let (ray, hit) = (stream.ray(), stream.hit());
    if load.depth() > context.settings.max_depth {
        return Vec3::ZERO;
    }
    if !hit.is_hit() {
        return load.weight * context.lights.environment(ray.direction);
    }
    let mut own_material = None;
    let vertex = Vertex::new(context, (&ray, Cone::RAY), &hit, None, &mut own_material);
    if load.depth() == 1 {
        vertex.describe(context, vertex.bsdf_alone(&mut None), &ray, &hit, sample);
    }
    let mut load = *load;
    if !vertex.outside && vertex.bounds_volume() {
        load.weight *= transmittance(vertex.evaluated.attenuation, hit.t);
    }
    if load.depth() < context.settings.max_depth.min(DEEPEST) {
        let phong = Phong::new(vertex.evaluated);
        let normal = vertex.facing_normal();
        let mirrored = normal * (2.0 * normal.dot(vertex.wo)) - vertex.wo;
        derive(&vertex, &phong, &ray, mirrored, &load, derived);
        derived[2] = towards_light(context, &vertex, &phong, (&ray, mirrored), &load, sampler);
    }
    let mut leaves = vertex.emission(context);
    if let Some(photons) = context.photons {
        let most_segments = context.settings.max_depth - load.depth();
        leaves += of_photons(context, &Gather { photons, vertex: &vertex, most_segments, pixel: None });
    }
    load.weight * leaves
}

/// The light of photons where they land.
fn of_photons(context: &Context<'_>, gather: &Gather<'_>) -> Vec3 {
    let vertex = gather.vertex;
    if !receives(vertex.bsdf_alone(&mut None)) {
        return Vec3::ZERO;
    }
    let phong = Phong::new(vertex.evaluated);
    let normal = vertex.facing_normal();
    let mirrored = normal * (2.0 * normal.dot(vertex.wo)) - vertex.wo;
    gather.reflected(context.tracer.level(), |from| phong.local(mirrored.dot(from), true))
}

/// The mirrored and the refracted ray.
fn derive(vertex: &Vertex<'_>, phong: &Phong, ray: &Ray, mirrored: Vec3, load: &Load, derived: &mut Derived) {
    let parting = phong.part(vertex.wo, vertex.facing_normal(), vertex.outside);
    let side = vertex.facing_side();
    let goes_on = |direction: Vec3, weight: Vec3, kind: u32| {
        let load = load.derived(kind, weight);
        (load.weight.max_element() >= FAINTEST).then_some((vertex.ray_towards(direction, ray.time), load))
    };
    if mirrored.dot(side) > 0.0 {
        derived[0] = goes_on(mirrored, parting.mirrored, 0);
    }
    if let Some((direction, weight)) = parting.refracted
        && direction.dot(side) < 0.0
    {
        derived[1] = goes_on(direction, weight, 1);
    }
}

/// A shadow ray to a light, with what it adds if nothing is in its way.
fn towards_light(
    context: &Context<'_>,
    vertex: &Vertex<'_>,
    phong: &Phong,
    (ray, mirrored): (&Ray, Vec3),
    load: &Load,
    sampler: &Sampler,
) -> Option<(Ray, Load)> {
    let normal = vertex.facing_normal();
    // Each ray of the tree has two dimensions of its own.
    let first = CAMERA_DIMENSIONS.wrapping_add(2 * load.node);
    let (u_pick, u) = (sampler.at_dimension(first).next_1d(), sampler.at_dimension(first + 1).next_2d());
    let light = context.lights.sample(vertex.surface.position, normal, u_pick, u)?;
    let cos = vertex.local_if_consistent(light.wi).map_or(0.0, |_| light.wi.dot(normal));
    if cos <= 0.0 {
        return None;
    }
    let local = phong.local(mirrored.dot(light.wi), light.delta);
    let load = load.shadow(local * light.radiance * (cos / light.pdf));
    (load.weight.max_element() > 0.0).then_some((vertex.shadow_ray(&light, ray.time)?, load))
}

/// Lets rays pass by alpha, and shadow rays through what is clear: light through glass is not bent here.
pub(super) struct StreamFilter<'a> {
    pub(super) context: &'a Context<'a>,
    /// By slot.
    pub(super) loads: &'a [Load],
}

impl HitFilter for StreamFilter<'_> {
    fn accepts(&self, slot: usize, hit: &Hit) -> bool {
        let load = &self.loads[slot];
        // Photons bring what passes clear things, and bend it.
        if load.is_shadow() && self.context.photons.is_none() && self.is_clear(hit) {
            return false;
        }
        let filter = AlphaFilter { context: self.context, keys: std::slice::from_ref(&load.key) };
        filter.accepts(0, hit)
    }
}

impl StreamFilter<'_> {
    fn is_clear(&self, hit: &Hit) -> bool {
        let scene = self.context.scene;
        is_clear(&scene.materials()[mesh_of(scene, hit).material_of(hit.prim) as usize])
    }
}

/// Whether shadow rays pass a material.
pub(crate) fn is_clear(material: &Material) -> bool {
    material.transmission.factor * (1.0 - material.metallic.factor) > 0.5
}
