//! Path tracing with next-event estimation and multiple importance sampling (J. Kajiya 1986, "The rendering equation";
//! E. Veach 1997, "Robust Monte Carlo methods for light transport simulation", 10.3), one segment at a time.
//!
//! The estimator, its weights and its conventions are written down in docs/transport.md.

use crate::bsdf::{Bsdf, BsdfSample};
use crate::light::{Odds, Weights};
use crate::medium::transmittance;
use crate::vertex::Vertex;
use crate::wavefront::{CAMERA_DIMENSIONS, Context, PathState, Shade, ShadeInput, ShadowQueue};
use vastlight_math::{FAR, Ray, Sampler, Vec2, Vec3};
use vastlight_trace::Hit;

/// Sampler dimensions of a vertex: choice of light, place on it, choice of lobe, direction, roulette.
const VERTEX_DIMENSIONS: u32 = 5;

/// Segments after which roulette may end a path.
const ROULETTE_DEPTH: u32 = 4;

/// Panes that a path passes without counting; the rest count as segments, so that no path is endless.
const MAX_PANES: u32 = 32;

/// Roulette lets a path live with at most this probability, so that no path is endless.
const ROULETTE_MAX: f32 = 0.95;

/// Shortens shadow rays so that they do not meet the light itself.
const SHADOW_SHORTENING: f32 = 1e-4;

/// The path tracer, or its direct-light part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathTracing {
    /// Ends after the light of the first vertex that is not perfectly specular.
    pub(crate) direct_only: bool,
}

/// The random numbers of one vertex, drawn when they are asked for.
struct VertexRandom {
    sampler: Sampler,
    first: u32,
}

impl VertexRandom {
    fn new(sampler: Sampler, depth: u32) -> Self {
        let before = depth.wrapping_sub(1).wrapping_mul(VERTEX_DIMENSIONS);
        Self { sampler, first: CAMERA_DIMENSIONS.wrapping_add(before) }
    }

    #[inline(always)]
    fn dimension(&self, offset: u32) -> Sampler {
        self.sampler.at_dimension(self.first.wrapping_add(offset))
    }

    /// Choice of a light, and the place on it.
    #[inline(always)]
    fn light(&self) -> (f32, Vec2) {
        (self.dimension(0).next_1d(), self.dimension(1).next_2d())
    }

    /// Choice of a lobe, and the direction.
    #[inline(always)]
    fn direction(&self) -> (f32, Vec2) {
        (self.dimension(2).next_1d(), self.dimension(3).next_2d())
    }

    fn roulette(&self) -> f32 {
        self.dimension(4).next_1d()
    }
}

impl Shade for PathTracing {
    #[inline(always)]
    fn shade(&self, at: ShadeInput<'_>, path: &mut PathState, shadows: &mut ShadowQueue) -> Option<Ray> {
        let ShadeInput { context, depth, ray, hit, sample } = at;
        // Going straight through a pane is no new segment: shadow rays, which do the same, have none either.
        let length = depth - path.panes;
        let visible = length <= context.settings.max_depth;
        if !hit.is_hit() {
            if visible {
                sample.radiance += background(context, path, ray.direction);
            }
            return None;
        }
        let (mut own_material, mut own_bsdf) = (None, None);
        let vertex = Vertex::new(context, &ray, &hit, &mut own_material);
        path.throughput *= absorption(context, &vertex, path, hit.t);
        let bsdf = vertex.bsdf(context, path, &mut own_bsdf);
        if depth == 1 {
            vertex.describe(context, bsdf, &ray, &hit, sample);
        }
        if !visible {
            return None;
        }
        let emission = vertex.emission(context);
        if emission != Vec3::ZERO {
            let seen = seen_from(path, context, &vertex, &hit);
            sample.radiance += path.throughput * emission * seen;
        }
        // At its end a path may still be on its way through panes, to the light that shadow rays see through them.
        let ends = length >= context.settings.max_depth || (self.direct_only && path.scattered);
        if ends && !bsdf.is_pane() {
            return None;
        }
        let random = VertexRandom::new(path.sampler, depth);
        let light_normal = if bsdf.transmits() { Vec3::ZERO } else { vertex.facing_normal() };
        let mut odds = Odds::default();
        if bsdf.has_nondelta()
            && !ends
            && let Some(weights) = context.lights.weights(vertex.surface.position, light_normal)
        {
            odds = weights.odds;
            let key = path.shadow_key(depth);
            let connection = connect(context, &vertex, bsdf, path, (&weights, light_normal), &random);
            if let Some((shadow_ray, radiance)) = connection {
                shadows.push(path.slot, key, Ray { time: ray.time, ..shadow_ray }, radiance);
            }
        }
        let (next, straight) = continue_path(&vertex, bsdf, path, &random)?;
        if ends && !straight {
            return None;
        }
        if straight {
            path.panes += u32::from(path.panes < MAX_PANES);
        } else {
            path.origin = vertex.surface.position;
            path.normal = light_normal;
            path.odds = odds;
        }
        let roulette = context.settings.russian_roulette && depth >= ROULETTE_DEPTH;
        if roulette && !survives(path, random.roulette()) {
            return None;
        }
        Some(Ray { time: ray.time, ..next })
    }
}

/// Radiance from infinity, weighted against light sampling.
#[inline(always)]
fn background(context: &Context<'_>, path: &PathState, direction: Vec3) -> Vec3 {
    let radiance = context.lights.environment(direction);
    if radiance == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let weight = if path.pdf > 0.0 {
        let light = context.lights.density_of_direction(path.odds, path.normal, direction);
        context.settings.direct_sampling.weight_of_bsdf(path.pdf, light)
    } else {
        1.0
    };
    path.throughput * radiance * weight
}

/// Weight of emission that the path's ray ran into, against light sampling at the last vertex.
#[inline(always)]
fn seen_from(path: &PathState, context: &Context<'_>, vertex: &Vertex<'_>, hit: &Hit) -> f32 {
    if path.pdf <= 0.0 {
        return 1.0;
    }
    let (place, position) = ((hit.instance, hit.prim), vertex.surface.position);
    let light = context.lights.density_of_hit(path.odds, path.origin, path.normal, place, position);
    context.settings.direct_sampling.weight_of_bsdf(path.pdf, light)
}

/// Absorption on the way to `vertex`: by the volume around the path, or, when the camera stood in a volume, by the
/// one that the path is about to leave.
#[inline(always)]
fn absorption(context: &Context<'_>, vertex: &Vertex<'_>, path: &PathState, distance: f32) -> Vec3 {
    match path.media.current() {
        Some(material) => transmittance(context.materials.attenuation(material), distance),
        None if !vertex.outside && vertex.bounds_volume() => {
            transmittance(vertex.evaluated.attenuation, distance)
        }
        None => Vec3::ONE,
    }
}

/// Next-event estimation: a shadow ray and what it carries.
#[inline(always)]
fn connect(
    context: &Context<'_>,
    vertex: &Vertex<'_>,
    bsdf: &Bsdf,
    path: &PathState,
    (weights, light_normal): (&Weights, Vec3),
    random: &VertexRandom,
) -> Option<(Ray, Vec3)> {
    let from = vertex.surface.position;
    let (u_pick, u) = random.light();
    let light = context.lights.draw(weights, from, light_normal, u_pick, u)?;
    let wi = vertex.local_if_consistent(light.wi)?;
    let (value, bsdf_pdf) = bsdf.eval_pdf(vertex.frame.to_local(vertex.wo), wi);
    let sampling = context.settings.direct_sampling;
    let weight = if light.delta { 1.0 } else { sampling.weight_of_light(light.pdf, bsdf_pdf) };
    let mut radiance = path.throughput * value * light.radiance * (weight / light.pdf);
    if radiance.max_element() <= 0.0 {
        return None;
    }
    let infinite = light.distance >= FAR;
    let through = (light.wi.dot(vertex.surface.normal) >= 0.0) != vertex.outside;
    let media = if through { vertex.media_behind(path.media) } else { path.media };
    if let (Some(medium), false) = (media.current(), infinite) {
        radiance *= transmittance(context.materials.attenuation(medium), light.distance);
    }
    let t_max =
        if infinite { FAR } else { light.distance * (1.0 - SHADOW_SHORTENING) - 2.0 * vertex.surface.offset };
    let origin = vertex.surface.origin_towards(light.wi);
    (t_max > 0.0).then_some((Ray { origin, t_min: 0.0, direction: light.wi, t_max, time: 0.0 }, radiance))
}

/// Draws the next direction and moves the path's state over the surface. True if the path goes straight through a
/// pane: it then keeps the density of its last scattering, as shadow rays through the pane expect.
#[inline(always)]
fn continue_path(
    vertex: &Vertex<'_>,
    bsdf: &Bsdf,
    path: &mut PathState,
    random: &VertexRandom,
) -> Option<(Ray, bool)> {
    let wo = vertex.frame.to_local(vertex.wo);
    let (u_lobe, u) = random.direction();
    let next: BsdfSample = bsdf.sample(wo, u_lobe, u)?;
    let direction = vertex.frame.to_outer(next.wi);
    let outwards = direction.dot(vertex.surface.normal);
    if next.wi.z * outwards <= 0.0 || next.weight.max_element() <= 0.0 {
        return None;
    }
    path.throughput *= next.weight;
    path.eta_squared *= next.radiance_scale;
    let straight = next.delta && next.transmitted && bsdf.is_pane();
    if !straight {
        path.pdf = if next.delta { 0.0 } else { next.pdf };
    }
    path.scattered |= !next.delta;
    path.dispersed |= next.dispersed;
    if next.transmitted {
        path.media = vertex.media_behind(path.media);
    }
    let origin = vertex.surface.origin_towards(direction);
    Some((Ray { origin, t_min: 0.0, direction, t_max: FAR, time: 0.0 }, straight))
}

/// Russian roulette by the energy that the path still carries.
fn survives(path: &mut PathState, u: f32) -> bool {
    let probability = (path.throughput.max_element() * path.eta_squared).min(ROULETTE_MAX);
    if u >= probability {
        return false;
    }
    path.throughput /= probability;
    true
}
