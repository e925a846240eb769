//! Which surfaces the camera sees, and how much they count: a few paths from the eye, before photons are sent.

use super::flight::receives;
use crate::bsdf::BsdfDraw;
use crate::cone::PIXEL_PART;
use crate::path::{absorption, continue_path};
use crate::sample::RenderStats;
use crate::vertex::Vertex;
use crate::wavefront::{Batches, CAMERA_DIMENSIONS, Context, Run, Shade, Shaded, Stage, Wave};
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use vastlight_math::{Aabb, Ray, Vec3, warp};
use vastlight_paging::PageError;
use vastlight_simd::Simd8;

/// Paths along the longer edge of the picture.
const PATHS: u32 = 128;
/// Segments of a path.
const DEPTH: u32 = 5;
/// Cubes along the longest edge of the scene.
const CUBES: f32 = 256.0;
/// The smallest radius of photons, in pixels: their discs blur about as pixels do, see `InPixel`.
const FINEST: f32 = 0.75;
/// The number of the samples whose paths these are: far from those of the picture.
const SAMPLE: u32 = 1 << 30;

/// What paths have told of a cube.
#[derive(Clone, Copy, Debug)]
struct Look {
    /// The sum of what they would carry to the eye.
    weight: f32,
    /// The width of what they are the mean of, the least.
    width: f32,
}

/// How much light at a place counts in the picture.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    /// By cube of the space.
    cubes: HashMap<[i32; 3], Look>,
    origin: Vec3,
    per_unit: f32,
}

impl Seen {
    /// Looks around from all of the picture: photons of a crop are those of the whole.
    pub(crate) fn new(context: &Context<'_>, wave: Wave) -> Result<Self, PageError> {
        let (width, height) = (context.settings.width, context.settings.height);
        let step = (width.max(height) / PATHS).max(1) as usize;
        let columns = (0..width).step_by(step);
        let pixels = columns.flat_map(|x| (0..height).step_by(step).map(move |y| [x, y]));
        let looking = Looking::default();
        let mut waves = Shaded { wave, shade: &looking };
        let runs = pixels.map(|pixel| Run { pixel, samples: SAMPLE..SAMPLE + 1 });
        waves.run(context, runs, &mut RenderStats::default())?;
        let Aabb { min, .. } = context.scene.bounds();
        let size = context.scene.bounds().size().max_element().max(f32::MIN_POSITIVE);
        let mut seen = Self { cubes: HashMap::new(), origin: min, per_unit: CUBES / size };
        for (place, look) in looking.found.into_inner().unwrap_or_else(PoisonError::into_inner) {
            let known = seen.cubes.entry(seen.cube(place)).or_insert(Look { weight: 0.0, ..look });
            *known = Look { weight: known.weight + look.weight, width: known.width.min(look.width) };
        }
        Ok(seen)
    }

    fn cube(&self, place: Vec3) -> [i32; 3] {
        ((place - self.origin) * self.per_unit).floor().as_ivec3().to_array()
    }

    /// How much light at a place counts: 0 where no path came by.
    pub(crate) fn weight(&self, place: Vec3) -> f32 {
        self.near(place).map(|look| look.weight).sum()
    }

    /// The width of the smallest thing at a place that the picture shows; infinite where no path came by.
    pub(crate) fn width(&self, place: Vec3) -> f32 {
        self.near(place).map(|look| look.width).fold(f32::INFINITY, f32::min)
    }

    fn near(&self, place: Vec3) -> impl Iterator<Item = &Look> {
        let [x, y, z] = self.cube(place);
        let near = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
        near.filter_map(move |[i, j, k]| self.cubes.get(&[x + i, y + j, z + k]))
    }
}

/// Follows paths and remembers where photons could land that they would see.
#[derive(Debug, Default)]
struct Looking {
    found: Mutex<Vec<(Vec3, Look)>>,
}

impl Shade for Looking {
    #[inline(always)]
    fn shade<L: Simd8>(&self, _level: L, stage: &mut Stage<'_>) {
        let met = stage.met(|_, _| {});
        for &i in &met {
            self.look(stage, i as usize);
        }
        stage.give_back(met);
    }
}

impl Looking {
    fn look(&self, stage: &mut Stage<'_>, i: usize) {
        let (context, ray, hit, slot) = (stage.context, stage.rays[i], stage.hits[i], stage.slots[i]);
        let (mut own, mut own_bsdf) = (None, None);
        let page = stage.pages.map(|pages| pages.at(i));
        let path = &mut stage.paths[slot as usize];
        let vertex = Vertex::new(context, (&ray, path.cone), &hit, page, &mut own);
        path.throughput *= absorption(context, &vertex, path, hit.t);
        let bsdf = vertex.bsdf(context, path, &mut own_bsdf);
        if receives(bsdf) {
            let width = FINEST * path.cone.moved(hit.t).width / PIXEL_PART;
            let look = Look { weight: path.throughput.element_sum(), width };
            let found = (vertex.surface.position, look);
            self.found.lock().unwrap_or_else(PoisonError::into_inner).push(found);
        }
        if stage.depth >= DEPTH {
            return;
        }
        path.cone = path.cone.moved(hit.t);
        let first = CAMERA_DIMENSIONS + 2 * (stage.depth - 1);
        let u = path.sampler.at_dimension(first + 1).next_2d();
        let lobe = path.sampler.at_dimension(first).next_1d();
        let draw = BsdfDraw { lobe, u, cosine: warp::cosine_hemisphere(u) };
        if let Some((next, _)) = continue_path(&vertex, bsdf, path, draw) {
            stage.go_on(slot, Ray { time: ray.time, ..next });
        }
    }
}
