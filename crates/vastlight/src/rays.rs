//! Arrays of rays, asked of a session's scene.

use crate::{Error, OpenScene, RenderRequest, Session};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use vastlight_math::{Affine3, Mat3, Ray, Vec3};
use vastlight_scene::{Mesh, Scene};
use vastlight_trace::paged::{CachePager, Caches, Found, PagedBatch};
use vastlight_trace::sort::{RaySorter, SortRays};
use vastlight_trace::{AcceptAll, Hit, LARGEST_CHUNK, Tracer, parallel_chunk};
use vastlight_transport::{PagesError, RenderSettings};

/// Rays that one thread takes at a time.
const CHUNK: usize = 8192;
/// Rays that are in memory at a time.
const TOGETHER: usize = 1 << 22;

/// Memory that is used again.
#[derive(Debug, Default)]
pub(crate) struct RayBuffers {
    rays: Vec<Ray>,
    sorter: RaySorter,
    hits: Vec<Hit>,
}

/// The closest hits of an array of rays, a row each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayHits {
    /// In units of the direction's length; infinite for a miss.
    pub t: Vec<f32>,
    /// Triangle of the instance's mesh; -1 for a miss, and on a surface without triangles.
    pub prim: Vec<i32>,
    /// Instance; -1 for a miss.
    pub instance: Vec<i32>,
    /// Weights of the triangle's second and third corner; 0 for a miss.
    pub uv: Vec<[f32; 2]>,
    /// Unit normal of the triangle in world space, on the side from which its corners go counter-clockwise; 0 for a miss, and
    /// on a surface without triangles.
    pub normal: Vec<[f32; 3]>,
}

/// A part of the answers.
type Rows<'a> = ((&'a mut [f32], &'a mut [i32]), (&'a mut [i32], &'a mut [[f32; 2]]), &'a mut [[f32; 3]]);

impl RayHits {
    fn new(count: usize) -> Self {
        Self {
            t: vec![0.0; count],
            prim: vec![0; count],
            instance: vec![0; count],
            uv: vec![[0.0; 2]; count],
            normal: vec![[0.0; 3]; count],
        }
    }

    /// Parts of `chunk` rows of those of some rays.
    fn chunks(&mut self, rows: Range<usize>, chunk: usize) -> impl IndexedParallelIterator<Item = Rows<'_>> {
        let Self { t, prim, instance, uv, normal } = self;
        let first = t[rows.clone()].par_chunks_mut(chunk).zip(prim[rows.clone()].par_chunks_mut(chunk));
        let second = instance[rows.clone()].par_chunks_mut(chunk).zip(uv[rows.clone()].par_chunks_mut(chunk));
        let third = normal[rows].par_chunks_mut(chunk);
        first.zip(second).zip(third).map(|((first, second), normal)| (first, second, normal))
    }
}

/// Writes an answer into its row; only triangles have a normal.
fn put(((t, prim), (instance, uv), normal): &mut Rows<'_>, row: usize, (hit, facing): (&Hit, Option<Vec3>)) {
    // Ids have 31 bits, and none is -1.
    let id = if facing.is_some() { hit.prim } else { Hit::NONE };
    (t[row], prim[row], instance[row]) = (hit.t, id as i32, hit.instance as i32);
    (uv[row], normal[row]) = ([hit.u, hit.v], facing.unwrap_or(Vec3::ZERO).to_array());
}

/// The last instance's mesh and its map for normals: neighbours hit the same one.
struct Facing<'s> {
    scene: &'s Scene,
    of: u32,
    mesh: Option<&'s Mesh>,
    normals: Mat3,
}

impl<'s> Facing<'s> {
    fn new(scene: &'s Scene) -> Self {
        Self { scene, of: Hit::NONE, mesh: None, normals: Mat3::IDENTITY }
    }

    /// Turns to another instance.
    fn turn_to(&mut self, instance: u32) {
        if instance != self.of {
            let instances = self.scene.instances();
            let mesh = &self.scene.meshes()[instances.mesh(instance as usize) as usize];
            self.mesh = mesh.implicit.is_none().then_some(mesh);
            self.normals = for_normals(instances.map(instance as usize));
            self.of = instance;
        }
    }

    /// The world's unit normal of a triangle of an instance.
    fn of(&mut self, instance: u32, corners: [Vec3; 3]) -> Vec3 {
        self.turn_to(instance);
        self.normal(corners)
    }

    #[inline]
    fn normal(&self, [a, b, c]: [Vec3; 3]) -> Vec3 {
        /// Squares of lengths between which nothing overflows or vanishes.
        const SAFE: Range<f32> = 1e-30..1e30;
        let normal = (b - a).cross(c - a);
        let turned = self.normals * normal;
        let square = turned.length_squared();
        if SAFE.contains(&square) && SAFE.contains(&normal.length_squared()) {
            return turned / square.sqrt();
        }
        // As large or as small as scenes may be.
        let scaled = |edge: Vec3| edge.normalize_or_zero();
        (self.normals * scaled(b - a).cross(scaled(c - a))).normalize_or_zero()
    }

    /// The same of a hit on a triangle that is in memory.
    #[inline]
    fn of_hit(&mut self, hit: &Hit) -> Option<Vec3> {
        if !hit.is_hit() {
            return None;
        }
        self.turn_to(hit.instance);
        self.mesh.map(|mesh| self.normal(mesh.corners(hit.prim)))
    }
}

/// The transposed inverse, but for a positive factor.
fn for_normals(world_from_object: &Affine3) -> Mat3 {
    let [x, y, z] = [
        world_from_object.matrix3.x_axis,
        world_from_object.matrix3.y_axis,
        world_from_object.matrix3.z_axis,
    ];
    let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if world_from_object.matrix3.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
}

/// A request that is there for its memory alone.
fn request_for(scene: &Scene, memory: Option<u64>) -> RenderRequest {
    let camera = scene.cameras()[0].clone();
    let mut request = RenderRequest::new(RenderSettings::new(camera, 1280, 720), 1);
    request.paging.memory = memory;
    request
}

/// An array of rays.
#[derive(Debug)]
pub struct RayArray<'a, F> {
    /// How many there are.
    pub count: usize,
    /// A ray by its number.
    pub ray: F,
    /// Memory for a scene in a store, bytes; `None` for the default budget.
    pub memory: Option<u64>,
    /// Set to stop: rays that were not traced have no answers then.
    pub cancel: &'a AtomicBool,
}

impl<F: Fn(usize) -> Ray + Sync> RayArray<'_, F> {
    /// Some of the rays.
    fn rays(&self, numbers: Range<usize>) -> Vec<Ray> {
        numbers.map(&self.ray).collect()
    }

    /// Has parts of the rays traced where they are, without memory for all of them: by how many a thread should take, and numbers.
    fn in_place(&self, mut trace: impl FnMut(usize, Range<usize>)) {
        let chunk = parallel_chunk(&self.rays(0..self.count.min(LARGEST_CHUNK)));
        let together = TOGETHER / chunk * chunk;
        for start in (0..self.count).step_by(together) {
            if self.cancel.load(Ordering::Relaxed) {
                break;
            }
            trace(chunk, start..self.count.min(start + together));
        }
    }

    /// Hands parts of the rays to `trace`, with their numbers.
    fn parts(
        &self,
        rays: &mut Vec<Ray>,
        mut trace: impl FnMut(&[Ray], Range<usize>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        for start in (0..self.count).step_by(TOGETHER) {
            if self.cancel.load(Ordering::Relaxed) {
                break;
            }
            let part = start..self.count.min(start + TOGETHER);
            part.clone().into_par_iter().with_min_len(CHUNK).map(&self.ray).collect_into_vec(rays);
            trace(rays, part)?;
        }
        Ok(())
    }
}

impl Session {
    /// The closest hits of rays with all threads of the current pool. Structures are built if there are none. Every surface counts,
    /// whatever its material's alpha.
    ///
    /// # Errors
    /// The structures cannot be built, or a page of a store cannot be had.
    pub fn trace(&mut self, array: &RayArray<'_, impl Fn(usize) -> Ray + Sync>) -> Result<RayHits, Error> {
        let mut answers = RayHits::new(array.count);
        let mut buffers = std::mem::take(&mut self.rays);
        let RayBuffers { rays, sorter, hits } = &mut buffers;
        self.with_structures(array.memory, |open, tracer, caches| match caches {
            None if !RaySorter::pays(tracer, array.count, &array.ray) => {
                array.in_place(|chunk, part| {
                    let chunks = answers.chunks(part.clone(), chunk).enumerate();
                    chunks.for_each_init(Vec::new, |hits, (number, mut rows)| {
                        let first = part.start + number * chunk;
                        let rays = array.rays(first..part.end.min(first + chunk));
                        hits.resize(rays.len(), Hit::MISS);
                        tracer.closest(&rays, &AcceptAll, hits);
                        let mut facing = Facing::new(&open.scene);
                        for (row, hit) in hits.iter().enumerate() {
                            put(&mut rows, row, (hit, facing.of_hit(hit)));
                        }
                    });
                });
                Ok(())
            }
            None => array.parts(rays, |rays, part| {
                hits.resize(rays.len(), Hit::MISS);
                sorter.closest(tracer, SortRays::Auto, rays, hits);
                fill(&open.scene, hits, answers.chunks(part, CHUNK));
                Ok(())
            }),
            Some(caches) => array.parts(rays, |rays, part| {
                trace_paged(open, (tracer, caches), (rays, array.cancel), answers.chunks(part, CHUNK))
            }),
        })?;
        self.rays = buffers;
        Ok(answers)
    }

    /// Whether rays hit anything; otherwise as [`Session::trace`].
    ///
    /// # Errors
    /// Those of [`Session::trace`].
    pub fn occluded(
        &mut self,
        array: &RayArray<'_, impl Fn(usize) -> Ray + Sync>,
    ) -> Result<Vec<bool>, Error> {
        let mut occluded = vec![false; array.count];
        let mut buffers = std::mem::take(&mut self.rays);
        let RayBuffers { rays, sorter, .. } = &mut buffers;
        self.with_structures(array.memory, |_, tracer, caches| {
            if caches.is_none() && !RaySorter::pays(tracer, array.count, &array.ray) {
                array.in_place(|chunk, part| {
                    let chunks = occluded[part.clone()].par_chunks_mut(chunk).enumerate();
                    chunks.for_each(|(number, occluded)| {
                        let first = part.start + number * chunk;
                        tracer.occluded(
                            &array.rays(first..part.end.min(first + chunk)),
                            &AcceptAll,
                            occluded,
                        );
                    });
                });
                return Ok(());
            }
            array.parts(rays, |rays, part| match caches {
                None => {
                    sorter.occluded(tracer, SortRays::Auto, rays, &mut occluded[part]);
                    Ok(())
                }
                Some(caches) => occluded_paged((tracer, caches), (rays, array.cancel), &mut occluded[part]),
            })
        })?;
        self.rays = buffers;
        Ok(occluded)
    }

    /// Hands the structures to `trace`, of a scene in a store on threads of which some wait for pages.
    fn with_structures(
        &mut self,
        memory: Option<u64>,
        trace: impl FnOnce(&OpenScene, &Tracer, Option<&Caches>) -> Result<(), Error> + Send,
    ) -> Result<(), Error> {
        let request = request_for(&self.open().scene, memory);
        let pool = self.open().stored.is_some().then(|| self.store_pool(&request.paging)).transpose()?;
        let here = || {
            let (open, tracer, caches) = self.structures(&request)?;
            trace(open, tracer, caches)
        };
        match pool {
            Some(pool) => pool.install(here),
            None => here(),
        }
    }
}

fn trace_paged<'a>(
    OpenScene { scene, .. }: &OpenScene,
    (tracer, caches): (&Tracer, &Caches),
    (rays, cancel): (&[Ray], &AtomicBool),
    answers: impl IndexedParallelIterator<Item = Rows<'a>>,
) -> Result<(), Error> {
    rays.par_chunks(CHUNK).zip(answers).with_max_len(1).try_for_each(|(rays, mut rows)| {
        if cancel.load(Ordering::Relaxed) {
            return Ok(());
        }
        let mut facing = Facing::new(scene);
        through(caches, |batch, pager| {
            batch.closest(tracer, pager, rays, None, |row, hit: &Hit, found: &Found| {
                let normal = hit.is_hit().then(|| facing.of(hit.instance, found.corners));
                put(&mut rows, row, (hit, normal));
            })
        })
    })
}

fn occluded_paged(
    (tracer, caches): (&Tracer, &Caches),
    (rays, cancel): (&[Ray], &AtomicBool),
    occluded: &mut [bool],
) -> Result<(), Error> {
    let chunks = rays.par_chunks(CHUNK).zip(occluded.par_chunks_mut(CHUNK)).with_max_len(1);
    chunks.try_for_each(|(rays, occluded)| {
        if cancel.load(Ordering::Relaxed) {
            return Ok(());
        }
        through(caches, |batch, pager| batch.occluded(tracer, pager, rays, None, occluded))
    })
}

/// Traces a batch through the caches over a store.
fn through<E>(
    caches: &Caches,
    trace: impl FnOnce(&mut PagedBatch, &mut CachePager) -> Result<(), E>,
) -> Result<(), Error>
where
    Error: From<E>,
{
    let mut pager = caches.pager().map_err(PagesError::Cache)?;
    Ok(trace(&mut PagedBatch::default(), &mut pager)?)
}

/// Hits in memory as rows.
fn fill<'a>(scene: &Scene, hits: &[Hit], answers: impl IndexedParallelIterator<Item = Rows<'a>>) {
    hits.par_chunks(CHUNK).zip(answers).for_each(|(hits, mut rows)| {
        let mut facing = Facing::new(scene);
        for (row, hit) in hits.iter().enumerate() {
            put(&mut rows, row, (hit, facing.of_hit(hit)));
        }
    });
}
