//! Photons on their way: from the surfaces that focus them to those that receive them.
//!
//! A photon goes on in narrow lobes alone, and lands wherever light may also leave in other directions: what goes on from there is
//! the paths' affair. So each way from a light to the eye belongs to either photons or paths: to photons if, seen from the light,
//! narrow lobes come before the first surface that scatters otherwise.

use super::Photon;
use super::guide::Guide;
use crate::bsdf::{Bsdf, BsdfDraw};
use crate::cone::Cone;
use crate::light::LightSample;
use crate::medium::transmittance;
use crate::path::{MAX_PANES, absorption};
use crate::sample::Sample;
use crate::vertex::Vertex;
use crate::wavefront::{CAMERA_DIMENSIONS, Context, Front, PathState, ShadowQueue};
use std::ops::Range;
use vastlight_math::{FAR, Ray, Sampler, Vec3, rng, warp};
use vastlight_paging::PageError;

/// Sampler dimensions of a vertex: choice of lobe, direction, roulette.
const VERTEX_DIMENSIONS: u32 = 3;
/// Sampler dimensions of all that follows from one hit of a chord: the choice of a light, the place on it, vertices.
const HIT_DIMENSIONS: u32 = 1 << 10;
/// Stands where a pixel's column would in the keys of random numbers.
const KEY: u32 = 0x9407_0a5e;

/// A photon at its end, and where it began.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Landed {
    pub(crate) photon: Photon,
    /// Number of the cell.
    pub(crate) cell: u32,
}

/// Which photons fly: some of those of a pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Departure<'a> {
    pub(crate) guide: &'a Guide,
    /// Number of the pass.
    pub(crate) pass: u32,
    /// Chords of the whole pass.
    pub(crate) chords: u32,
}

/// Photons in flight, and the memory of all queues.
#[derive(Debug, Default)]
pub(crate) struct Flight {
    pub(crate) front: Front,
    /// By slot: a photon, its cell, and the first dimension of its vertices' random numbers.
    paths: Vec<PathState>,
    origins: Vec<(u32, u32)>,
    /// The first rays of photons, and what arrives to begin with.
    first_rays: Vec<Ray>,
    arriving: Vec<Sample>,
    lit: ShadowQueue,
    next: Vec<(u32, Ray)>,
    landed: Vec<Landed>,
    rays: u64,
}

/// A line through a cell, and how far it has come.
#[derive(Clone, Copy)]
struct Chord {
    cell: u32,
    /// Area of focusing surface that a hit stands for.
    area: f32,
    hits: u32,
}

impl Flight {
    /// Lets the chords numbered `range` find surfaces, light shine on these, and photons fly on. Gives what landed, and the number
    /// of rays.
    pub(crate) fn run(
        &mut self,
        context: &Context<'_>,
        departure: &Departure<'_>,
        range: Range<u32>,
    ) -> Result<(&[Landed], u64), PageError> {
        self.clear();
        self.find_starts(context, departure, range)?;
        self.rays += self.lit.len() as u64;
        self.lit.trace(context, self.front.walk.as_mut(), &mut self.arriving)?;
        self.front.clear();
        for (slot, (sample, ray)) in self.arriving.iter().zip(&self.first_rays).enumerate() {
            if sample.radiance != Vec3::ZERO {
                self.paths[slot].throughput = sample.radiance;
                self.front.push(slot as u32, *ray);
            }
        }
        self.follow(context, 2)?;
        Ok((&self.landed, self.rays))
    }

    fn clear(&mut self) {
        self.paths.clear();
        self.origins.clear();
        self.first_rays.clear();
        self.arriving.clear();
        self.lit.clear();
        self.landed.clear();
        self.rays = 0;
    }

    /// Follows chords through their cells; each surface that they cross may be where photons begin.
    fn find_starts(
        &mut self,
        context: &Context<'_>,
        departure: &Departure<'_>,
        range: Range<u32>,
    ) -> Result<(), PageError> {
        self.front.clear();
        let (mut chords, mut lines) = (Vec::with_capacity(range.len()), Vec::with_capacity(range.len()));
        for number in range {
            let (line, chord, ray) = departure.chord(context.settings.seed, number);
            self.front.push(lines.len() as u32, ray);
            lines.push(line);
            chords.push(chord);
        }
        let mut depth = 1;
        while !self.front.rays.is_empty() {
            self.rays += self.front.rays.len() as u64;
            self.front.trace(context, &lines, depth)?;
            self.next.clear();
            for i in 0..self.front.rays.len() {
                let slot = self.front.slots[i];
                let chord = &mut chords[slot as usize];
                if self.front.hits[i].is_hit() {
                    self.cross(context, departure, i, &lines[slot as usize], chord);
                }
            }
            self.advance();
            depth += 1;
        }
        Ok(())
    }

    /// A chord crosses a surface: light may begin a photon there. The chord goes on behind it.
    fn cross(
        &mut self,
        context: &Context<'_>,
        departure: &Departure<'_>,
        i: usize,
        line: &PathState,
        chord: &mut Chord,
    ) {
        let (ray, hit) = (self.front.rays[i], self.front.hits[i]);
        let mut own = None;
        let page = self.front.page_hits().map(|pages| pages.at(i));
        let vertex = Vertex::new(context, (&ray, Cone::RAY), &hit, page, &mut own);
        let on = Ray { t_max: ray.t_max - hit.t, ..vertex.ray_towards(ray.direction, ray.time) };
        if on.t_max > 0.0 {
            self.next.push((self.front.slots[i], on));
        }
        let position = vertex.surface.position;
        let first = CAMERA_DIMENSIONS.wrapping_add(chord.hits.wrapping_mul(HIT_DIMENSIONS));
        chord.hits += 1;
        if !context.materials.may_focus(vertex.material) || !departure.guide.cell(chord.cell).has(position) {
            return;
        }
        let (u_pick, u) =
            (line.sampler.at_dimension(first).next_1d(), line.sampler.at_dimension(first + 1).next_2d());
        let Some(light) = context.lights.sample(position, Vec3::ZERO, u_pick, u) else { return };
        let towards = Ray { direction: -light.wi, ..ray };
        let mut own = None;
        let page = self.front.page_hits().map(|pages| pages.at(i));
        let vertex = Vertex::new(context, (&towards, Cone::RAY), &hit, page, &mut own);
        let slot = self.paths.len() as u32;
        let key = line.alpha_key(chord.hits).rotate_left(16);
        let mut path = PathState::new(slot, line.sampler, key, Cone::RAY);
        path.throughput = arriving(&vertex, &light) * chord.area;
        let mut own = None;
        let bsdf = vertex.bsdf(context, &path, &mut own);
        let draw = Draw { sampler: line.sampler, first: first + 2 };
        let Some((next, false)) = bounce(&vertex, bsdf, &mut path, draw) else { return };
        let Some(shadow) = vertex.shadow_ray(&light, ray.time) else { return };
        let carried = std::mem::replace(&mut path.throughput, Vec3::ZERO);
        self.lit.push(slot, path.shadow_key(1), Ray { time: ray.time, ..shadow }, carried);
        self.paths.push(path);
        self.origins.push((chord.cell, first + 2));
        self.first_rays.push(Ray { time: ray.time, ..next });
        self.arriving.push(Sample::MISS);
    }

    /// Follows all photons to their ends. `depth` is the number of the segments that begin.
    fn follow(&mut self, context: &Context<'_>, mut depth: u32) -> Result<(), PageError> {
        while !self.front.rays.is_empty() {
            self.rays += self.front.rays.len() as u64;
            self.front.trace(context, &self.paths, depth)?;
            self.next.clear();
            for i in 0..self.front.rays.len() {
                if self.front.hits[i].is_hit() {
                    self.arrive(context, i, depth);
                }
            }
            self.advance();
            depth += 1;
        }
        Ok(())
    }

    /// A photon arrives at a surface, may land there, and may go on.
    fn arrive(&mut self, context: &Context<'_>, i: usize, depth: u32) {
        let (ray, hit, slot) = (self.front.rays[i], self.front.hits[i], self.front.slots[i]);
        let (mut own, mut own_bsdf) = (None, None);
        let page = self.front.page_hits().map(|pages| pages.at(i));
        let vertex = Vertex::new(context, (&ray, Cone::RAY), &hit, page, &mut own);
        let path = &mut self.paths[slot as usize];
        path.throughput *= absorption(context, &vertex, path, hit.t);
        let segments = depth - path.panes;
        // The eye adds one at least.
        if segments >= context.settings.max_depth {
            return;
        }
        let bsdf = vertex.bsdf(context, path, &mut own_bsdf);
        let (cell, first) = self.origins[slot as usize];
        if segments >= 2 && receives(bsdf) {
            let (position, normal) = (vertex.surface.position, vertex.facing_side());
            let photon = Photon { position, flux: path.throughput, from: vertex.wo, normal, segments };
            self.landed.push(Landed { photon, cell });
        }
        let draw = Draw { sampler: path.sampler, first: first.wrapping_add((depth - 1) * VERTEX_DIMENSIONS) };
        if let Some((next, _)) = bounce(&vertex, bsdf, path, draw) {
            self.next.push((slot, Ray { time: ray.time, ..next }));
        }
    }

    /// The next rays take the place of those that have arrived.
    fn advance(&mut self) {
        self.front.clear();
        for &(slot, ray) in &self.next {
            self.front.push(slot, ray);
        }
    }
}

impl Departure<'_> {
    /// The chord of this number: its random numbers, its cell, and its ray.
    ///
    /// Points by area on the box of a cell and directions by the cosine make lines that are uniform in space. They cross every
    /// piece of surface in the box equally often: an area `a` on average `2 a / area of the box` times (M. Crofton 1868).
    fn chord(&self, seed: u32, number: u32) -> (PathState, Chord, Ray) {
        let sample = self.pass.wrapping_mul(self.chords).wrapping_add(number);
        let sampler = Sampler::new([KEY, 0], sample, seed);
        let key = (rng::hash_words(&[KEY, sample, seed]) >> 32) as u32;
        let (cell, chance, rest) = self.guide.choose(sampler.at_dimension(0).next_1d());
        let bounds = self.guide.cell(cell).bounds;
        let direction = warp::cosine_hemisphere(sampler.at_dimension(2).next_2d());
        let ray = line_through(&bounds, rest, sampler.at_dimension(1).next_2d(), direction);
        let area = bounds.half_area() / (self.chords as f32 * chance);
        (PathState::new(number, sampler, key, Cone::RAY), Chord { cell, area, hits: 0 }, ray)
    }
}

/// The line that enters a box at a point of its surface, uniform by area, in a direction about the inner normal.
fn line_through(bounds: &vastlight_math::Aabb, u_face: f32, u: vastlight_math::Vec2, about: Vec3) -> Ray {
    let size = bounds.size();
    let areas = [size.y * size.z, size.z * size.x, size.x * size.y];
    let mut pick = u_face * 2.0 * (areas[0] + areas[1] + areas[2]);
    let mut face = 0;
    while face < 5 && pick >= areas[face / 2] {
        pick -= areas[face / 2];
        face += 1;
    }
    let (axis, high) = (face / 2, face % 2 == 1);
    let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
    let (mut origin, mut direction) = (bounds.min, Vec3::ZERO);
    origin[x] += u.x * size[x];
    origin[y] += u.y * size[y];
    (direction[x], direction[y]) = (about.x, about.y);
    direction[axis] = if high { -about.z } else { about.z };
    if high {
        origin[axis] = bounds.max[axis];
    }
    let exits = Vec3::select(direction.cmpge(Vec3::ZERO), bounds.max, bounds.min) - origin;
    let t = Vec3::select(direction.abs().cmpgt(Vec3::ZERO), exits / direction, Vec3::splat(FAR));
    Ray { origin, t_min: 0.0, direction, t_max: t.min_element().clamp(0.0, FAR), time: 0.0 }
}

/// Irradiance by a light at the surface that it shines on, with the way inside of a volume.
fn arriving(vertex: &Vertex<'_>, light: &LightSample) -> Vec3 {
    let irradiance = light.radiance * (light.wi.dot(vertex.surface.normal).abs() / light.pdf);
    if vertex.outside || !vertex.bounds_volume() || light.distance >= FAR {
        return irradiance;
    }
    irradiance * transmittance(vertex.evaluated.attenuation, light.distance)
}

/// Whether photons land on a surface.
pub(crate) fn receives(bsdf: &Bsdf) -> bool {
    bsdf.has_nondelta() && !bsdf.focuses()
}

/// Where the random numbers of a vertex are.
struct Draw {
    sampler: Sampler,
    first: u32,
}

/// Sends a photon on in a narrow lobe; none if it ends. True if it goes straight through a pane, which is no vertex.
///
/// A photon carries power, not radiance: nothing is gained by entering glass, and where the shading normal is not the surface's own,
/// power and radiance scatter differently (E. Veach 1997, 5.3).
fn bounce(vertex: &Vertex<'_>, bsdf: &Bsdf, path: &mut PathState, draw: Draw) -> Option<(Ray, bool)> {
    let wo = vertex.frame.to_local(vertex.wo);
    let at = |offset: u32| draw.sampler.at_dimension(draw.first.wrapping_add(offset));
    let u = at(1).next_2d();
    let draw = BsdfDraw { lobe: at(0).next_1d(), u, cosine: warp::cosine_hemisphere(u) };
    let next = bsdf.sample_drawn(wo, draw)?;
    let direction = vertex.frame.to_outer(next.wi);
    let outwards = direction.dot(vertex.surface.normal);
    if next.wi.z * outwards <= 0.0 || !(next.delta || bsdf.focuses()) {
        return None;
    }
    let inwards = vertex.wo.dot(vertex.surface.normal);
    let shading = (wo.z * outwards / (inwards * next.wi.z)).abs();
    let factor = next.weight * (next.radiance_scale * shading);
    let survival = factor.max_element().min(1.0);
    if !(at(2).next_1d() < survival) {
        return None;
    }
    path.throughput *= factor / survival;
    let straight = next.delta && next.transmitted && bsdf.is_pane();
    path.panes += u32::from(straight && path.panes < MAX_PANES);
    path.dispersed |= next.dispersed;
    if next.transmitted {
        path.media = vertex.media_behind(path.media);
    }
    path.throughput.is_finite().then(|| (vertex.ray_towards(direction, 0.0), straight))
}
