//! Photons on their way: from lights by the surfaces that focus them to those that receive them.
//!
//! A photon begins at a light and enters the box of a cell, see [`Guide`]. It goes on in narrow lobes alone, the first of them in that
//! cell, and lands wherever light may also leave in other directions: what goes on from there is the paths' affair. So each way from a
//! light to the eye belongs to either photons or paths: to photons if, seen from the light, narrow lobes come before the first surface
//! that scatters otherwise.

use super::Photon;
use super::guide::Guide;
use super::plan::Emission;
use super::rectangle::Rectangle;
use crate::bsdf::{Bsdf, BsdfDraw};
use crate::cone::Cone;
use crate::path::{MAX_PANES, absorption};
use crate::vertex::Vertex;
use crate::wavefront::{CAMERA_DIMENSIONS, Context, Front, PathState};
use std::ops::Range;
use vastlight_math::{Aabb, FAR, Ray, Sampler, Vec2, Vec3, rng, warp};
use vastlight_paging::PageError;

/// Sampler dimensions of a start: choice of light, place on it; and of a vertex: choice of lobe, direction, roulette.
const START_DIMENSIONS: u32 = 2;
const VERTEX_DIMENSIONS: u32 = 3;
/// Stands where a pixel's column would in the keys of random numbers.
const KEY: u32 = 0x9407_0a5e;
/// Part of its way by which a photon begins off its light.
const OFF_LIGHT: f32 = 1e-4;

/// A photon at its end, and where it began.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Landed {
    pub(crate) photon: Photon,
    /// Number of the square through which it came: of the guide, or of a grid.
    pub(crate) square: u32,
}

/// Which photons fly: some of those of a pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Departure<'a> {
    pub(crate) emission: &'a Emission,
    /// Number of the pass.
    pub(crate) pass: u32,
    /// Photons of the whole pass.
    pub(crate) photons: u32,
}

/// Photons in flight, and the memory of all queues.
#[derive(Debug, Default)]
pub(crate) struct Flight {
    pub(crate) front: Front,
    /// By slot: a photon, and the number of its square.
    paths: Vec<PathState>,
    squares: Vec<u32>,
    next: Vec<(u32, Ray)>,
    landed: Vec<Landed>,
}

impl Flight {
    /// Lets the photons numbered `range` fly. Gives what landed, and the number of rays.
    pub(crate) fn run(
        &mut self,
        context: &Context<'_>,
        departure: &Departure<'_>,
        range: Range<u32>,
    ) -> Result<(&[Landed], u64), PageError> {
        self.paths.clear();
        self.squares.clear();
        self.landed.clear();
        self.front.clear();
        for (slot, start) in (0..).zip(range.filter_map(|number| departure.start(context, number))) {
            self.front.push(slot, start.ray);
            self.paths.push(start.path);
            self.squares.push(start.square);
        }
        let (mut rays, mut depth) = (0, 1);
        while !self.front.rays.is_empty() {
            rays += self.front.rays.len() as u64;
            self.front.trace(context, &self.paths, depth)?;
            self.next.clear();
            for i in 0..self.front.rays.len() {
                if self.front.hits[i].is_hit() {
                    self.arrive(context, departure.emission, i, depth);
                }
            }
            self.advance();
            depth += 1;
        }
        Ok((&self.landed, rays))
    }

    /// A photon arrives at a surface, may land there, and may go on.
    fn arrive(&mut self, context: &Context<'_>, emission: &Emission, i: usize, depth: u32) {
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
        let (square, position) = (self.squares[slot as usize], vertex.surface.position);
        let was_focused = path.focused;
        if was_focused && receives(bsdf) {
            let (flux, normal) = (path.throughput, vertex.facing_side());
            let photon = Photon { position, flux, from: vertex.wo, normal, segments };
            self.landed.push(Landed { photon, square });
        }
        let first = CAMERA_DIMENSIONS + START_DIMENSIONS + (depth - 1) * VERTEX_DIMENSIONS;
        let Some(next) = bounce(&vertex, bsdf, path, first) else { return };
        if was_focused || !path.focused || emission.begins_at(square, position) {
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

/// A photon that leaves its light.
struct Start {
    path: PathState,
    square: u32,
    ray: Ray,
}

impl Emission {
    /// Whether a photon through this square may be focused here for the first time.
    fn begins_at(&self, square: u32, position: Vec3) -> bool {
        match self {
            Self::Guided(guide) => guide.cell_of(square).has(position),
            Self::Gridded(..) => true,
        }
    }
}

impl Departure<'_> {
    /// Whether nothing could land.
    pub(crate) fn is_empty(&self) -> bool {
        match self.emission {
            Emission::Guided(guide) => guide.len() == 0,
            Emission::Gridded(rectangles, _) => rectangles.is_empty(),
        }
    }

    /// The photon of this number; none if no light shines on the place that was drawn for it.
    fn start(&self, context: &Context<'_>, number: u32) -> Option<Start> {
        let (seed, sample) =
            (context.settings.seed, self.pass.wrapping_mul(self.photons).wrapping_add(number));
        let sampler = Sampler::new([KEY, 0], sample, seed);
        let (ray, flux, square) = match self.emission {
            Emission::Guided(guide) => guided(context, guide, &sampler, self.photons)?,
            Emission::Gridded(rectangles, grid) => self.gridded(context, rectangles, *grid, number),
        };
        let key = (rng::hash_words(&[KEY, sample, seed]) >> 32) as u32;
        let mut path = PathState::new(number, sampler, key, Cone::RAY);
        path.throughput = flux;
        (flux.is_finite() && flux != Vec3::ZERO).then_some(Start { path, square, ray })
    }

    /// The photon of this number through a grid. The grid of the first pass lies in the middle, those of others by chance.
    fn gridded(
        &self,
        context: &Context<'_>,
        rectangles: &[Rectangle],
        grid: [u32; 2],
        number: u32,
    ) -> (Ray, Vec3, u32) {
        let (each, shift) = (grid[0] * grid[1], grid_shift(self.pass, context.settings.seed));
        let (light, square) = (number / each, [number % each % grid[0], number % each / grid[0]]);
        let (ray, flux) = rectangles[light as usize].photon(square, grid, shift);
        (ray, flux, number)
    }
}

/// By how much of a square the grid of a pass is moved.
pub(super) fn grid_shift(pass: u32, seed: u32) -> Vec2 {
    match pass {
        0 => Vec2::ZERO,
        pass => Sampler::new([KEY, 1], pass, seed).next_2d() - 0.5,
    }
}

/// A photon that enters a cell: its ray, its power, and the square.
///
/// The place is in a square on the box around a cell, drawn by area, and a light is chosen for it as for any point. A ray from
/// outside enters a box once, one from inside leaves it once: so none is drawn in two ways.
fn guided(context: &Context<'_>, guide: &Guide, sampler: &Sampler, photons: u32) -> Option<(Ray, Vec3, u32)> {
    let at = |dimension: u32| sampler.at_dimension(dimension);
    let (square, chance) = guide.choose(at(0).next_1d());
    let (cell, place) = (guide.cell_of(square), guide.place(square, at(1).next_2d()));
    let u_pick = at(CAMERA_DIMENSIONS).next_1d();
    let u = at(CAMERA_DIMENSIONS + 1).next_2d();
    let light = context.lights.sample(place.position, Vec3::ZERO, u_pick, u)?;
    let cos = light.wi.dot(place.normal);
    let is_far = light.distance >= FAR;
    let distance = if is_far { context.beyond(place.position) } else { light.distance };
    let source = place.position + light.wi * (distance * (1.0 - OFF_LIGHT));
    let is_inside = !is_far && cell.bounds.contains(&Aabb::point(source));
    if (cos > 0.0) == is_inside {
        return None;
    }
    let flux = light.radiance * (cos.abs() * place.area / (light.pdf * chance * photons as f32));
    Some((Ray::new(source, -light.wi), flux, square))
}

impl Context<'_> {
    /// A distance from which all of the scene lies ahead.
    fn beyond(&self, from: Vec3) -> f32 {
        let bounds = self.scene.bounds();
        1.01 * (bounds.min - from).abs().max((bounds.max - from).abs()).length()
    }
}

/// Whether photons land on a surface.
pub(crate) fn receives(bsdf: &Bsdf) -> bool {
    bsdf.has_nondelta() && !bsdf.focuses()
}

/// Sends a photon on in a narrow lobe; none if it ends. Going straight through a pane focuses nothing and is no vertex.
///
/// A photon carries power, not radiance: nothing is gained by entering glass, and where the shading normal is not the surface's own,
/// power and radiance scatter differently (E. Veach 1997, 5.3).
fn bounce(vertex: &Vertex<'_>, bsdf: &Bsdf, path: &mut PathState, first: u32) -> Option<Ray> {
    let wo = vertex.frame.to_local(vertex.wo);
    let sampler = path.sampler;
    let at = |offset: u32| sampler.at_dimension(first.wrapping_add(offset));
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
    // A factor that is no number ends the photon too.
    let survival = factor.max_element().clamp(0.0, 1.0);
    if at(2).next_1d() >= survival {
        return None;
    }
    path.throughput *= factor / survival;
    let straight = next.delta && next.transmitted && bsdf.is_pane();
    path.panes += u32::from(straight && path.panes < MAX_PANES);
    path.focused |= !straight;
    path.dispersed |= next.dispersed;
    if next.transmitted {
        path.media = vertex.media_behind(path.media);
    }
    path.throughput.is_finite().then(|| vertex.ray_towards(direction, 0.0))
}
