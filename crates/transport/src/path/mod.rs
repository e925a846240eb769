//! Path tracing with next-event estimation and multiple importance sampling (J. Kajiya 1986, "The rendering equation";
//! E. Veach 1997, "Robust Monte Carlo methods for light transport simulation", 10.3), one segment at a time.
//!
//! The estimator, its weights and its conventions are written down in docs/transport.md.

mod random;

use crate::bsdf::{Bsdf, BsdfDraw, BsdfSample};
use crate::light::{LightAnswers, LightQueries, LightSample};
use crate::material::Evaluated;
use crate::medium::transmittance;
use crate::photon::{Gather, InPixel, receives};
use crate::vertex::Vertex;
use crate::wavefront::{Context, PathState, Shade, Stage};
use random::VertexRandom;
use vastlight_math::lanes::{LANES, Lanes3};
use vastlight_math::{FAR, Ray, SamplerLanes, Vec3};
use vastlight_simd::Simd8;
use vastlight_trace::Hit;

/// Segments after which roulette may end a path.
const ROULETTE_DEPTH: u32 = 4;

/// Panes that a path passes without counting; the rest count as segments, so that no path is endless.
pub(crate) const MAX_PANES: u32 = 32;

/// Roulette lets a path live with at most this probability, so that no path is endless.
const ROULETTE_MAX: f32 = 0.95;

/// The path tracer, or its direct-light part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathTracing {
    /// Ends after the light of the first vertex that is not perfectly specular.
    pub(crate) direct_only: bool,
}

impl Shade for PathTracing {
    #[inline(always)]
    fn shade<L: Simd8>(&self, level: L, stage: &mut Stage<'_>) {
        let met = stage.met(leave);
        for first in (0..met.len()).step_by(LANES) {
            self.shade_block(level, stage, &met, first);
        }
        stage.give_back(met);
    }
}

/// A path at a vertex where it scatters.
struct Arrival<'a> {
    /// Number of the ray.
    ray: usize,
    slot: u32,
    vertex: Vertex<'a>,
    bsdf: &'a Bsdf,
    /// The normal that light sampling is told.
    light_normal: Vec3,
    /// Whether a light is chosen for it.
    lit: bool,
    /// Whether the path goes on through panes at most.
    ends: bool,
}

/// What a vertex has of its own where its surface is not the same everywhere.
struct Own {
    material: Option<Evaluated>,
    bsdf: Option<Bsdf>,
}

impl PathTracing {
    /// Shades the hits of the rays from number `met[first]` on, as many as there are lanes.
    #[inline(always)]
    fn shade_block<L: Simd8>(&self, level: L, stage: &mut Stage<'_>, met: &[u32], first: usize) {
        let mut own = [const { Own { material: None, bsdf: None } }; LANES];
        let mut arrivals = [const { None }; LANES];
        let (mut samplers, mut count) = (SamplerLanes::ZERO, 0);
        for (i, own) in (first..met.len()).zip(&mut own) {
            stage.fetch_ahead(level, met, i);
            arrivals[count] = self.arrive(level, stage, met[i] as usize, own);
            if let Some(arrival) = &arrivals[count] {
                samplers.set(count, &stage.paths[arrival.slot as usize].sampler);
                count += 1;
            }
        }
        if count == 0 {
            return;
        }
        let random = VertexRandom::new(&samplers, stage.depth);
        let lights = sample_lights(stage, &arrivals, &random);
        for (lane, arrival) in arrivals.iter().enumerate().take(count) {
            if let Some(arrival) = arrival {
                scatter(stage, arrival, lane, &lights, &random);
            }
        }
    }

    /// Brings a path to the surface that its ray met, and adds what shines there; none if the path ends.
    #[inline(always)]
    fn arrive<'a, 'w: 'a, L: Simd8>(
        &self,
        level: L,
        stage: &mut Stage<'w>,
        i: usize,
        own: &'a mut Own,
    ) -> Option<Arrival<'a>> {
        let (context, ray, hit, slot) = (stage.context, &stage.rays[i], &stage.hits[i], stage.slots[i]);
        let (path, sample) = (&mut stage.paths[slot as usize], &mut stage.samples[slot as usize]);
        let page = stage.pages.map(|pages| pages.at(i));
        let vertex = Vertex::new(context, (ray, path.cone), hit, page, &mut own.material);
        path.throughput *= absorption(context, &vertex, path, hit.t);
        let bsdf = vertex.bsdf(context, path, &mut own.bsdf);
        if stage.depth == 1 {
            vertex.describe(context, bsdf, ray, hit, sample);
        }
        let length = segments(path, stage.depth);
        if length > context.settings.max_depth {
            return None;
        }
        let emission = if is_for_photons(context, path) { Vec3::ZERO } else { vertex.emission(context) };
        if emission != Vec3::ZERO {
            let seen = seen_from(path, context, &vertex, (hit, ray.time));
            sample.radiance += path.throughput * emission * seen;
        }
        // At its end a path may still be on its way through panes, to the light that shadow rays see through them.
        let ends = length >= context.settings.max_depth || (self.direct_only && path.scattered);
        if let Some(photons) = context.photons
            && receives(bsdf)
        {
            let most_segments = context.settings.max_depth - length;
            let seen = || InPixel::new(context, &vertex, ray, hit.t, path.sampler);
            let pixel = (stage.depth == 1).then(seen).flatten();
            let gather = Gather { photons, vertex: &vertex, most_segments, pixel };
            sample.radiance += path.throughput * gather.scattered(level, bsdf);
        }
        let light_normal = if bsdf.transmits() { Vec3::ZERO } else { vertex.facing_normal() };
        let lit =
            bsdf.has_nondelta() && !ends && !(context.photons.is_some() && path.received && bsdf.focuses());
        (!ends || bsdf.is_pane()).then_some(Arrival { ray: i, slot, vertex, bsdf, light_normal, lit, ends })
    }
}

/// Segments of a path. Going straight through a pane is no new one: shadow rays, which do the same, have none either.
#[inline(always)]
fn segments(path: &PathState, depth: u32) -> u32 {
    depth - path.panes
}

/// The end of a path whose ray met nothing.
#[inline(always)]
fn leave(stage: &mut Stage<'_>, i: usize) {
    let slot = stage.slots[i] as usize;
    let path = &stage.paths[slot];
    if segments(path, stage.depth) <= stage.context.settings.max_depth && !is_for_photons(stage.context, path)
    {
        stage.samples[slot].radiance += background(stage.context, path, stage.rays[i].direction);
    }
}

/// Chooses lights for all arrivals that scatter into more than single directions.
#[inline(always)]
fn sample_lights(
    stage: &Stage<'_>,
    arrivals: &[Option<Arrival<'_>>; LANES],
    random: &VertexRandom,
) -> LightAnswers {
    let mut queries = LightQueries {
        wanted: [false; LANES],
        from: Lanes3::ZERO,
        normal: Lanes3::ZERO,
        pick: random.light,
        u: random.place,
        time: [0.0; LANES],
    };
    for (lane, arrival) in arrivals.iter().enumerate() {
        if let Some(arrival) = arrival {
            queries.wanted[lane] = arrival.lit;
            queries.from.set(lane, arrival.vertex.surface.position);
            queries.normal.set(lane, arrival.light_normal);
            queries.time[lane] = stage.rays[arrival.ray].time;
        }
    }
    stage.context.lights.draw_lanes(&queries)
}

/// Sends a path on from a vertex, and a shadow ray to the light that was chosen for it.
#[inline(always)]
fn scatter(
    stage: &mut Stage<'_>,
    arrival: &Arrival<'_>,
    lane: usize,
    lights: &LightAnswers,
    random: &VertexRandom,
) {
    let (context, depth) = (stage.context, stage.depth);
    let (path, time) = (&mut stage.paths[arrival.slot as usize], stage.rays[arrival.ray].time);
    path.cone = path.cone.moved(stage.hits[arrival.ray].t);
    if let Some(light) = &lights.samples[lane]
        && let Some((ray, radiance)) = connect(context, arrival, path, light)
    {
        stage.shadows.push(arrival.slot, path.shadow_key(depth), Ray { time, ..ray }, radiance);
    }
    let draw =
        BsdfDraw { lobe: random.lobe[lane], u: random.direction.get(lane), cosine: random.cosine.get(lane) };
    let Some((next, straight)) = continue_path(&arrival.vertex, arrival.bsdf, path, draw) else { return };
    if arrival.ends && !straight {
        return;
    }
    if straight {
        path.panes += u32::from(path.panes < MAX_PANES);
    } else {
        path.origin = arrival.vertex.surface.position;
        path.normal = arrival.light_normal;
        path.odds = lights.odds[lane];
    }
    let roulette = context.settings.russian_roulette && depth >= ROULETTE_DEPTH;
    if roulette && !survives(path, random.roulette(path.sampler)) {
        return;
    }
    stage.go_on(arrival.slot, Ray { time, ..next });
}

/// Whether photons bring the light that the path would meet now.
#[inline(always)]
fn is_for_photons(context: &Context<'_>, path: &PathState) -> bool {
    context.photons.is_some() && path.focused
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
fn seen_from(path: &PathState, context: &Context<'_>, vertex: &Vertex<'_>, (hit, time): (&Hit, f32)) -> f32 {
    if path.pdf <= 0.0 {
        return 1.0;
    }
    let (place, at) = ((hit.instance, hit.prim), (vertex.surface.position, time));
    let light = context.lights.density_of_hit(path.odds, path.origin, path.normal, place, at);
    context.settings.direct_sampling.weight_of_bsdf(path.pdf, light)
}

/// Absorption on the way to `vertex`: by the volume around the path, or, when the camera stood in a volume, by the
/// one that the path is about to leave.
#[inline(always)]
pub(crate) fn absorption(
    context: &Context<'_>,
    vertex: &Vertex<'_>,
    path: &PathState,
    distance: f32,
) -> Vec3 {
    match path.media.current() {
        Some(material) => transmittance(context.materials.attenuation(material), distance),
        None if !vertex.outside && vertex.bounds_volume() => {
            transmittance(vertex.evaluated.attenuation, distance)
        }
        None => Vec3::ONE,
    }
}

/// Next-event estimation: a shadow ray to the chosen light, and what it carries.
#[inline(always)]
fn connect(
    context: &Context<'_>,
    &Arrival { ref vertex, bsdf, .. }: &Arrival<'_>,
    path: &PathState,
    light: &LightSample,
) -> Option<(Ray, Vec3)> {
    let wi = vertex.local_if_consistent(light.wi)?;
    let (value, bsdf_pdf) = bsdf.eval_pdf(vertex.frame.to_local(vertex.wo), wi);
    let sampling = context.settings.direct_sampling;
    let weight = if light.delta { 1.0 } else { sampling.weight_of_light(light.pdf, bsdf_pdf) };
    let mut radiance = path.throughput * value * light.radiance * (weight / light.pdf);
    if radiance.max_element() <= 0.0 {
        return None;
    }
    let through = (light.wi.dot(vertex.surface.normal) >= 0.0) != vertex.outside;
    let media = if through { vertex.media_behind(path.media) } else { path.media };
    if let (Some(medium), false) = (media.current(), light.distance >= FAR) {
        radiance *= transmittance(context.materials.attenuation(medium), light.distance);
    }
    Some((vertex.shadow_ray(light, 0.0)?, radiance))
}

/// Draws the next direction and moves the path's state over the surface. True if the path goes straight through a
/// pane: it then keeps the density of its last scattering, as shadow rays through the pane expect.
#[inline(always)]
pub(crate) fn continue_path(
    vertex: &Vertex<'_>,
    bsdf: &Bsdf,
    path: &mut PathState,
    draw: BsdfDraw,
) -> Option<(Ray, bool)> {
    let wo = vertex.frame.to_local(vertex.wo);
    let next: BsdfSample = bsdf.sample_drawn(wo, draw)?;
    let direction = vertex.frame.to_outer(next.wi);
    let outwards = direction.dot(vertex.surface.normal);
    if next.wi.z * outwards <= 0.0 || next.weight.max_element() <= 0.0 {
        return None;
    }
    path.throughput *= next.weight;
    path.eta_squared *= next.radiance_scale;
    let straight = next.delta && next.transmitted && bsdf.is_pane();
    if !straight {
        path.leaves(next.delta || bsdf.focuses());
        path.pdf = if next.delta { 0.0 } else { next.pdf };
        path.cone = path.cone.scattered(path.pdf);
    }
    path.scattered |= !next.delta;
    path.dispersed |= next.dispersed;
    if next.transmitted {
        path.media = vertex.media_behind(path.media);
    }
    Some((vertex.ray_towards(direction, 0.0), straight))
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
