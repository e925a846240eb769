//! Sorting the rays of a large batch before they are traced: Garanzha's thesis of 2014, section 6.6.
//!
//! Rays whose keys are close start near each other and go the same way, so that what one of them needs is still in
//! the caches for the next, and bundles find each other. Up to 16 M rays are sorted together, traced in blocks of 1 M in the
//! order of their keys, and answered in their own order; the answers are those of unsorted rays.

mod key;

use crate::tracer::in_parallel;
use crate::{AcceptAll, Hit, Tracer};
use key::Cells;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use vastlight_accel::sort::{Pair, compressed_radix_sort, key, pair, payload, radix_sort};
use vastlight_math::Ray;

/// Most rays that are sorted together.
const TOGETHER: usize = 16 << 20;
/// Rays of a block: all threads trace one block before the next.
const BLOCK: usize = 1 << 20;
/// Rays that one thread gathers and traces at a time.
const CHUNK: usize = 4096;
/// Batches of fewer rays are not worth sorting.
const FEWEST: usize = 1 << 16;
/// Pairs of neighbours that stand for a batch.
const SAMPLE: usize = 256;

/// Neighbours in no order are more cells of origins apart than this, of 64,
const FAR_ORIGINS: u32 = 4;
/// or of directions, of 128.
const FAR_DIRECTIONS: u32 = 8;

/// When rays are sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SortRays {
    /// Where the rays are many and come in no order, by a sample of them.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// What sorting took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SortReport {
    /// Whether rays were sorted.
    pub sorted: bool,
    /// Time of sampling, of keys and of the sort.
    pub sorting: Duration,
    /// Time of the rest: gathering rays, tracing, and giving answers.
    pub tracing: Duration,
}

/// Sorts batches of rays; keeps 20 bytes a ray for the next, and needs room for the answers once more.
#[derive(Debug)]
pub struct RaySorter {
    /// Most rays that are sorted together.
    together: usize,
    pairs: Vec<Pair>,
    spare: Vec<Pair>,
    /// Each ray's place in the order of keys.
    places: Vec<AtomicU32>,
}

impl Default for RaySorter {
    fn default() -> Self {
        Self { together: TOGETHER, pairs: Vec::new(), spare: Vec::new(), places: Vec::new() }
    }
}

impl RaySorter {
    /// [`Tracer::closest_parallel`] with rays sorted where `when` says so.
    pub fn closest(&mut self, tracer: &Tracer, when: SortRays, rays: &[Ray], hits: &mut [Hit]) -> SortReport {
        let trace = |rays: &[Ray], hits: &mut [Hit]| tracer.closest(rays, &AcceptAll, hits);
        self.run(tracer, when, (rays, hits), Hit::MISS, trace)
    }

    /// [`Tracer::occluded_parallel`] with rays sorted where `when` says so.
    pub fn occluded(
        &mut self,
        tracer: &Tracer,
        when: SortRays,
        rays: &[Ray],
        occluded: &mut [bool],
    ) -> SortReport {
        let trace = |rays: &[Ray], occluded: &mut [bool]| tracer.occluded(rays, &AcceptAll, occluded);
        self.run(tracer, when, (rays, occluded), false, trace)
    }

    /// Whether [`SortRays::Auto`] sorts so many rays: they are many and come in no order.
    #[must_use]
    pub fn pays(tracer: &Tracer, rays: usize, ray: impl Fn(usize) -> Ray) -> bool {
        let sample = if rays < FEWEST { Vec::new() } else { sample(rays, ray) };
        !sample.is_empty() && in_no_order(&Cells::new(&tracer.world(), &sample), &sample)
    }

    fn run<A: Copy + Send + Sync>(
        &mut self,
        tracer: &Tracer,
        when: SortRays,
        (rays, answers): (&[Ray], &mut [A]),
        none: A,
        trace: impl Fn(&[Ray], &mut [A]) + Sync,
    ) -> SortReport {
        let mut report = SortReport::default();
        let traced = rays.len().min(answers.len());
        let (rays, answers) = (&rays[..traced], &mut answers[..traced]);
        for (rays, answers) in rays.chunks(self.together).zip(answers.chunks_mut(self.together)) {
            let start = Instant::now();
            let sorted = self.sort_where(tracer, when, rays);
            let begin = Instant::now();
            if sorted {
                self.trace_sorted((rays, answers), none, &trace);
            } else {
                in_parallel(rays, answers, &trace);
            }
            report.sorted |= sorted;
            report.sorting += begin - start;
            report.tracing += begin.elapsed();
        }
        report
    }

    /// Sorts where `when` says so; whether it did.
    fn sort_where(&mut self, tracer: &Tracer, when: SortRays, rays: &[Ray]) -> bool {
        if when == SortRays::Off || when == SortRays::Auto && rays.len() < FEWEST {
            return false;
        }
        let sample = sample(rays.len(), |i| rays[i]);
        let cells = Cells::new(&tracer.world(), &sample);
        let sorted = when == SortRays::On || in_no_order(&cells, &sample);
        if sorted {
            self.sort(&cells, rays);
        }
        sorted
    }

    /// Makes `pairs` the keys and numbers of the rays, in the order of the keys, and fills `places`.
    fn sort(&mut self, cells: &Cells, rays: &[Ray]) {
        let keyed = |(i, ray): (usize, &Ray)| pair(cells.key(ray), i as u32);
        rays.par_iter().enumerate().with_min_len(CHUNK).map(keyed).collect_into_vec(&mut self.pairs);
        self.spare.resize(rays.len(), 0);
        let sort = if in_runs(&self.pairs) { compressed_radix_sort } else { radix_sort };
        let in_spare = std::ptr::eq(sort(&mut self.pairs, &mut self.spare, 32), self.spare.as_slice());
        if in_spare {
            std::mem::swap(&mut self.pairs, &mut self.spare);
        }
        self.places.resize_with(rays.len(), AtomicU32::default);
        self.pairs.par_iter().enumerate().with_min_len(CHUNK).for_each(|(place, &pair)| {
            self.places[payload(pair) as usize].store(place as u32, Ordering::Relaxed);
        });
    }

    fn trace_sorted<A: Copy + Send + Sync>(
        &self,
        (rays, answers): (&[Ray], &mut [A]),
        none: A,
        trace: &(impl Fn(&[Ray], &mut [A]) + Sync),
    ) {
        let mut in_order = vec![none; rays.len()];
        for (pairs, found) in self.pairs.chunks(BLOCK).zip(in_order.chunks_mut(BLOCK)) {
            let chunks = pairs.par_chunks(CHUNK).zip(found.par_chunks_mut(CHUNK));
            chunks.for_each_init(Vec::new, |gathered, (pairs, found)| {
                gathered.clear();
                gathered.extend(pairs.iter().map(|&pair| rays[payload(pair) as usize]));
                trace(gathered, found);
            });
        }
        let each = answers.par_iter_mut().zip(&self.places[..rays.len()]).with_min_len(CHUNK);
        each.for_each(|(answer, place)| *answer = in_order[place.load(Ordering::Relaxed) as usize]);
    }
}

/// Pairs of neighbours, evenly spread over a batch of so many rays.
fn sample(rays: usize, ray: impl Fn(usize) -> Ray) -> Vec<Ray> {
    let pairs = rays / 2;
    let count = pairs.min(SAMPLE);
    let first = |i: usize| 2 * (i * pairs / count);
    (0..count).flat_map(|i| [ray(first(i)), ray(first(i) + 1)]).collect()
}

/// Whether most neighbours start far apart, or, where all rays start in one place, go different ways.
fn in_no_order(cells: &Cells, sample: &[Ray]) -> bool {
    let apart = |a: &[u32], b: &[u32], cells: u32| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > cells);
    let origins =
        |pair: &&[Ray]| apart(&cells.origin_cell(&pair[0]), &cells.origin_cell(&pair[1]), FAR_ORIGINS);
    let directions = |pair: &&[Ray]| {
        apart(&cells.direction_cell(&pair[0]), &cells.direction_cell(&pair[1]), FAR_DIRECTIONS)
    };
    let most = |pairs: usize| 4 * pairs > sample.len();
    let one_place =
        sample.iter().all(|ray| !apart(&cells.origin_cell(ray), &cells.origin_cell(&sample[0]), 1));
    let pairs = sample.chunks_exact(2);
    if one_place { most(pairs.filter(directions).count()) } else { most(pairs.filter(origins).count()) }
}

/// Whether most keys are those of their neighbours, by a sample.
fn in_runs(pairs: &[Pair]) -> bool {
    let step = (pairs.len() / SAMPLE).max(2);
    let sampled = pairs.chunks_exact(step);
    let count = sampled.len();
    2 * sampled.filter(|chunk| key(chunk[0]) == key(chunk[1])).count() > count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TracerConfig;
    use vastlight_math::{Aabb, Affine3, Vec3, rng};
    use vastlight_scene::{Instance, Mesh, Scene, SceneDesc};

    fn unit(i: usize, dimension: u32) -> f32 {
        rng::hash_to_unit(&[i as u32, dimension])
    }

    fn point(i: usize, dimension: u32) -> Vec3 {
        Vec3::new(unit(i, dimension), unit(i, dimension + 1), unit(i, dimension + 2)) * 2.0 - 1.0
    }

    /// A hundred triangles in the cube from -1 to 1.
    fn tracer() -> Tracer {
        let positions = (0..300).map(|i| point(i / 3, 0) + point(i, 3) * 0.2).collect();
        let triangles = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mut desc = SceneDesc::default();
        desc.meshes.push(Mesh { name: "soup".into(), positions, triangles, ..Mesh::default() });
        desc.instances.push(Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 });
        let scene = Scene::new(desc).expect("a valid scene");
        Tracer::new(&scene, &TracerConfig::default()).expect("built")
    }

    fn rays(count: usize) -> Vec<Ray> {
        (0..count).map(|i| Ray::new(point(i, 10), point(i, 20))).collect()
    }

    #[test]
    fn rays_sorted_in_several_parts_have_their_own_hits() {
        let (tracer, rays) = (tracer(), rays(2500));
        let mut sorter = RaySorter { together: 1000, ..RaySorter::default() };
        let mut expected = vec![Hit::MISS; rays.len()];
        tracer.closest(&rays, &AcceptAll, &mut expected);
        let mut hits = vec![Hit::MISS; rays.len()];
        let report = sorter.closest(&tracer, SortRays::On, &rays, &mut hits);
        assert!(report.sorted && report.sorting > Duration::ZERO);
        assert_eq!(hits, expected);
        // Rays and hits of different numbers: those in both are traced.
        let mut few = vec![Hit::MISS; 1700];
        sorter.closest(&tracer, SortRays::On, &rays, &mut few);
        assert_eq!(few, expected[..1700]);
        // Answers that stay in the order of the keys are others.
        let cells = Cells::new(&tracer.world(), &sample(rays.len(), |i| rays[i]));
        sorter.sort(&cells, &rays);
        let in_order: Vec<Hit> = sorter.pairs.iter().map(|&pair| expected[payload(pair) as usize]).collect();
        assert_ne!(in_order, expected);
    }

    #[test]
    fn batches_without_order_are_told_from_others() {
        let world = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
        let unordered = |rays: &[Ray]| {
            let sample = sample(rays.len(), |i| rays[i]);
            in_no_order(&Cells::new(&world, &sample), &sample)
        };
        let pixel =
            |i: usize| Vec3::new((i % 300) as f32 / 300.0 - 0.5, (i / 300) as f32 / 300.0 - 0.5, -1.0);
        let shuffled = |i: usize| i * 7919 % 90_000;
        let camera = |i: usize| Ray::new(Vec3::Z, pixel(i));
        let lens = |i: usize| Ray::new(Vec3::Z + point(i, 0) * 0.01, pixel(i));
        let bounce = |i: usize| Ray::new(pixel(i) + Vec3::Z * 0.5, point(i, 0));
        let batch = |ray: &dyn Fn(usize) -> Ray| (0..90_000).map(ray).collect::<Vec<Ray>>();
        assert!(!unordered(&batch(&camera)) && !unordered(&batch(&lens)) && !unordered(&batch(&bounce)));
        assert!(unordered(&batch(&|i| camera(shuffled(i)))));
        assert!(unordered(&batch(&|i| lens(shuffled(i)))));
        assert!(unordered(&batch(&|i| bounce(shuffled(i)))));
        assert!(!unordered(&[]) && !unordered(&[camera(0)]));
    }
}
