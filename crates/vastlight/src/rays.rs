//! Arrays of rays, asked of a session's scene.

use crate::{Error, OpenScene, RenderRequest, Session, paged};
use rayon::prelude::*;
use vastlight_math::{Affine3, Mat3, Ray, Vec3};
use vastlight_scene::Scene;
use vastlight_trace::Hit;
use vastlight_trace::paged::{CachePager, Caches, Found, PagedBatch};
use vastlight_trace::sort::{RaySorter, SortRays};
use vastlight_transport::{PagesError, RenderSettings};

/// Rays that one thread takes at a time.
const CHUNK: usize = 8192;
/// Rays for which buffers are kept.
const KEPT: usize = 1 << 22;

/// Memory that is used again.
#[derive(Debug, Default)]
pub(crate) struct RayBuffers {
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
    fn misses(count: usize) -> Self {
        Self {
            t: vec![0.0; count],
            prim: vec![0; count],
            instance: vec![0; count],
            uv: vec![[0.0; 2]; count],
            normal: vec![[0.0; 3]; count],
        }
    }

    /// Parts of so many rows.
    fn chunks(&mut self) -> impl IndexedParallelIterator<Item = Rows<'_>> {
        let Self { t, prim, instance, uv, normal } = self;
        let first = t.par_chunks_mut(CHUNK).zip(prim.par_chunks_mut(CHUNK));
        let second = instance.par_chunks_mut(CHUNK).zip(uv.par_chunks_mut(CHUNK));
        first
            .zip(second)
            .zip(normal.par_chunks_mut(CHUNK))
            .map(|((first, second), normal)| (first, second, normal))
    }
}

/// Writes an answer into its row.
fn put(((t, prim), (instance, uv), normal): &mut Rows<'_>, row: usize, hit: &Hit, facing: Vec3) {
    // Ids have 31 bits, and none is -1.
    (t[row], prim[row], instance[row]) = (hit.t, hit.prim as i32, hit.instance as i32);
    (uv[row], normal[row]) = ([hit.u, hit.v], facing.to_array());
}

/// The last instance's map for normals: neighbours hit the same one.
struct Facing<'s> {
    scene: &'s Scene,
    of: u32,
    normals: Mat3,
}

impl<'s> Facing<'s> {
    fn new(scene: &'s Scene) -> Self {
        Self { scene, of: Hit::NONE, normals: Mat3::IDENTITY }
    }

    /// The world's unit normal of a triangle of an instance.
    fn of(&mut self, instance: u32, [a, b, c]: [Vec3; 3]) -> Vec3 {
        if instance != self.of {
            self.normals = for_normals(self.scene.instances().map(instance as usize));
            self.of = instance;
        }
        (self.normals * (b - a).cross(c - a).normalize_or_zero()).normalize_or_zero()
    }

    /// The same of a hit on a triangle that is in memory.
    fn of_hit(&mut self, hit: &Hit) -> Vec3 {
        if !hit.is_hit() || hit.prim == Hit::NONE {
            return Vec3::ZERO;
        }
        let mesh = &self.scene.meshes()[self.scene.instances().mesh(hit.instance as usize) as usize];
        self.of(hit.instance, mesh.corners(hit.prim))
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

impl Session {
    /// The closest hits of rays with all threads of the current pool, of a scene in a store within `memory` bytes (none for the default
    /// budget). Structures are built if there are none. Every surface counts, whatever its material's alpha.
    ///
    /// # Errors
    /// The structures cannot be built, or a page of a store cannot be had.
    pub fn trace(&mut self, rays: &[Ray], memory: Option<u64>) -> Result<RayHits, Error> {
        let request = request_for(&self.open().scene, memory);
        let mut answers = RayHits::misses(rays.len());
        if self.open().stored.is_some() {
            paged::pool(&request.paging)?.install(|| self.trace_paged(rays, &request, &mut answers))?;
            return Ok(answers);
        }
        let RayBuffers { mut sorter, mut hits } = std::mem::take(&mut self.rays);
        hits.resize(rays.len(), Hit::MISS);
        let (open, tracer, _) = self.structures(&request)?;
        sorter.closest(tracer, SortRays::Auto, rays, &mut hits);
        fill(&open.scene, &hits, &mut answers);
        if rays.len() <= KEPT {
            self.rays = RayBuffers { sorter, hits };
        }
        Ok(answers)
    }

    /// Whether rays hit anything; otherwise as [`Session::trace`].
    ///
    /// # Errors
    /// Those of [`Session::trace`].
    pub fn occluded(&mut self, rays: &[Ray], memory: Option<u64>) -> Result<Vec<bool>, Error> {
        let request = request_for(&self.open().scene, memory);
        let mut occluded = vec![false; rays.len()];
        if self.open().stored.is_some() {
            paged::pool(&request.paging)?.install(|| self.occluded_paged(rays, &request, &mut occluded))?;
            return Ok(occluded);
        }
        let mut sorter = std::mem::take(&mut self.rays.sorter);
        let (_, tracer, _) = self.structures(&request)?;
        sorter.occluded(tracer, SortRays::Auto, rays, &mut occluded);
        if rays.len() <= KEPT {
            self.rays.sorter = sorter;
        }
        Ok(occluded)
    }

    fn trace_paged(
        &mut self,
        rays: &[Ray],
        request: &RenderRequest,
        answers: &mut RayHits,
    ) -> Result<(), Error> {
        let (OpenScene { scene, .. }, tracer, caches) = self.structures(request)?;
        let Some(caches) = caches else { return Ok(()) };
        let chunks = rays.par_chunks(CHUNK).zip(answers.chunks()).with_max_len(1);
        chunks.try_for_each(|(rays, mut rows)| {
            let mut facing = Facing::new(scene);
            through(caches, |batch, pager| {
                batch.closest(tracer, pager, rays, None, |row, hit: &Hit, found: &Found| {
                    let normal =
                        if hit.is_hit() { facing.of(hit.instance, found.corners) } else { Vec3::ZERO };
                    put(&mut rows, row, hit, normal);
                })
            })
        })
    }

    fn occluded_paged(
        &mut self,
        rays: &[Ray],
        request: &RenderRequest,
        occluded: &mut [bool],
    ) -> Result<(), Error> {
        let (_, tracer, caches) = self.structures(request)?;
        let Some(caches) = caches else { return Ok(()) };
        let chunks = rays.par_chunks(CHUNK).zip(occluded.par_chunks_mut(CHUNK)).with_max_len(1);
        chunks.try_for_each(|(rays, occluded)| {
            through(caches, |batch, pager| batch.occluded(tracer, pager, rays, None, occluded))
        })
    }
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
fn fill(scene: &Scene, hits: &[Hit], answers: &mut RayHits) {
    hits.par_chunks(CHUNK).zip(answers.chunks()).for_each(|(hits, mut rows)| {
        let mut facing = Facing::new(scene);
        for (row, hit) in hits.iter().enumerate() {
            put(&mut rows, row, hit, facing.of_hit(hit));
        }
    });
}
