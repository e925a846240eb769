//! What moving costs: a scene is followed through its moments, and rays over the updated structures are compared with rays
//! over fresh ones.

mod clusters;

use crate::{CameraChoice, Error, ErrorClass};
use rayon::prelude::*;
use std::time::Instant;
use vastlight_accel::build::NAMES;
use vastlight_math::{Frame, Ray, Sampler, Vec2, Vec3, rng, warp};
use vastlight_scene::Scene;
use vastlight_trace::bench::trace;
use vastlight_trace::sort::SortRays;
use vastlight_trace::{Hit, TraceError, Tracer, TracerConfig, UpdateMethod};
use vastlight_transport::{CameraRays, RenderSettings};

pub use clusters::{ClusterFigures, ClusterMoment, ClusterRequest, measure_clusters};

/// What to measure.
#[derive(Clone, Debug)]
pub struct MovingRequest {
    /// Methods, each of which follows the scene by itself.
    pub methods: Vec<UpdateMethod>,
    /// Moments, in seconds.
    pub times: Vec<f32>,
    /// Columns and rows of the camera's rays; as many bounce from what they hit.
    pub size: [u32; 2],
    /// What tracing takes between two moments, as the automatic choice is told, in rays.
    pub rays_per_frame: f64,
    /// Builder of the fresh structures; empty for the fastest whose rays are within 5 % of the best.
    pub rebuild: String,
}

/// A moment by a method.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingFigures {
    /// Which method.
    pub method: UpdateMethod,
    /// Number of the moment.
    pub frame: usize,
    /// The moment.
    pub time: f32,
    /// Builder of the fresh structure, and its time.
    pub builder: String,
    /// Milliseconds that building anew took.
    pub rebuild_ms: f64,
    /// Milliseconds from new vertices in the scene to rays: structures of meshes and what is above them.
    pub update_ms: f64,
    /// Milliseconds of bringing the pose into the scene: copies, lattice, boxes.
    pub scene_ms: f64,
    /// Milliseconds of all rays over the updated structure.
    pub trace_ms: f64,
    /// The same over the fresh one.
    pub fresh_trace_ms: f64,
    /// Binary nodes that were rebuilt, and subtrees that were put elsewhere, as shares of all nodes.
    pub changed: [f64; 2],
    /// Meshes and instances that moved.
    pub moved: [usize; 2],
    /// Rays.
    pub rays: usize,
    /// Whether both structures gave the same hits.
    pub same_hits: bool,
}

/// Builders that come into question.
const BUILDERS: [&str; 5] = [NAMES[0], "grid-sah", "hlbvh2", "hlbvh2-binned", "ploc"];
/// Rays may take so much longer than over the best structure.
const SLOWER: f64 = 1.05;
/// Times that rays are traced; the best counts.
const REPEATS: u32 = 2;

/// Follows a scene that moves by each method, and gives the figures of every moment.
///
/// # Errors
/// Nothing moves, or a moment cannot be had.
pub fn measure_moving(
    scene: &Scene,
    request: &MovingRequest,
    mut each: impl FnMut(&MovingFigures),
) -> Result<(), Error> {
    let motion = scene.motion().cloned();
    let motion = motion.ok_or_else(|| Error::scene("nothing moves in this scene", "", ""))?;
    let builder = match request.rebuild.as_str() {
        "" => fastest_builder(scene, request)?.to_owned(),
        named => named.to_owned(),
    };
    let follower = |&method: &UpdateMethod| {
        let scene = scene.clone();
        let own = if method == UpdateMethod::Rebuild { builder.clone() } else { String::new() };
        let config = TracerConfig { update: method, rebuild: own, ..TracerConfig::default() };
        let tracer = Tracer::new(&scene, &config).map_err(error)?;
        Ok((method, scene, tracer))
    };
    let mut followers = request.methods.iter().map(follower).collect::<Result<Vec<_>, Error>>()?;
    for (frame, &time) in request.times.iter().enumerate() {
        let mut fresh: Option<Fresh> = None;
        for (method, scene, tracer) in &mut followers {
            let report = tracer.pose(scene, motion.pose(time)?)?;
            let fresh = match &mut fresh {
                Some(fresh) => fresh,
                none => none.insert(Fresh::new(scene, &builder, request.size)?),
            };
            let figures = trace(tracer, &fresh.rays, false, SortRays::Auto, REPEATS);
            let trace_ms = fresh.rays.len() as f64 / figures.mrays_per_s / 1e3;
            tracer.expect_tracing(trace_ms * request.rays_per_frame / fresh.rays.len().max(1) as f64);
            each(&MovingFigures {
                method: *method,
                frame,
                time,
                builder: builder.clone(),
                rebuild_ms: fresh.ms,
                update_ms: report.ms - report.scene_ms,
                scene_ms: report.scene_ms,
                trace_ms,
                fresh_trace_ms: fresh.trace_ms,
                changed: report.meshes.first().map_or([0.0; 2], |mesh| [mesh.rebuilt, mesh.migrated]),
                moved: [report.change.meshes.len(), report.change.instances.len()],
                rays: fresh.rays.len(),
                same_hits: (figures.hits, figures.sum_t.to_bits()) == fresh.answer,
            });
        }
    }
    Ok(())
}

/// A structure that was built for a moment, and rays through it.
struct Fresh {
    ms: f64,
    trace_ms: f64,
    rays: Vec<Ray>,
    answer: (u64, u64),
}

impl Fresh {
    fn new(scene: &Scene, builder: &str, size: [u32; 2]) -> Result<Self, Error> {
        let config = TracerConfig { accel: builder.into(), ..TracerConfig::default() };
        // The second build finds memory that the first one left.
        drop(Tracer::new(scene, &config).map_err(error)?);
        let start = Instant::now();
        let tracer = Tracer::new(scene, &config).map_err(error)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let rays = rays(scene, &tracer, size)?;
        let figures = trace(&tracer, &rays, false, SortRays::Auto, REPEATS);
        let answer = (figures.hits, figures.sum_t.to_bits());
        Ok(Self { ms, trace_ms: rays.len() as f64 / figures.mrays_per_s / 1e3, rays, answer })
    }
}

/// The builder of the least time among those whose rays are nearly as fast as the fastest.
fn fastest_builder(scene: &Scene, request: &MovingRequest) -> Result<&'static str, Error> {
    let fresh = |name| Ok((name, Fresh::new(scene, name, request.size)?));
    let all = BUILDERS.into_iter().map(fresh).collect::<Result<Vec<(&str, Fresh)>, Error>>()?;
    let best = all.iter().map(|(_, fresh)| fresh.trace_ms).fold(f64::INFINITY, f64::min);
    let good = all.iter().filter(|(_, fresh)| fresh.trace_ms <= SLOWER * best);
    Ok(good.min_by(|a, b| a.1.ms.total_cmp(&b.1.ms)).map_or(BUILDERS[0], |(name, _)| *name))
}

/// Rays of the scene's first camera, and rays that bounce from what they hit, spread by the cosine.
pub(crate) fn rays(scene: &Scene, tracer: &Tracer, [width, height]: [u32; 2]) -> Result<Vec<Ray>, Error> {
    let settings = RenderSettings::new(CameraChoice::default().resolve(scene)?, width, height);
    let camera = CameraRays::new(&settings);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let mut rays: Vec<Ray> =
        pixels.map(|pixel| camera.ray(pixel, camera.draw(Sampler::new(pixel, 0, 0)))).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    tracer.closest_parallel(&rays, &mut hits);
    let bounced = |(i, (ray, hit)): (usize, (&Ray, &Hit))| {
        let map = scene.instances().maps().get(hit.instance as usize).filter(|_| hit.is_hit())?;
        let mesh = &scene.meshes()[scene.instances().mesh(hit.instance as usize) as usize];
        let [a, b, c] = mesh.corners(hit.prim).map(|p| map.transform_point3(p));
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let unit = |dimension| rng::hash_to_unit(&[i as u32, dimension]);
        let local = warp::cosine_hemisphere(Vec2::new(unit(0), unit(1)));
        let frame = Frame::from_z(normal);
        let direction = frame.x * local.x + frame.y * local.y + frame.z * local.z;
        let origin = ray.origin + ray.direction * hit.t;
        Some(Ray::new(origin + normal * (1e-4 * hit.t), direction))
    };
    let more: Vec<Ray> = rays.par_iter().zip(&hits).enumerate().filter_map(bounced).collect();
    rays.extend(more);
    Ok(rays)
}

pub(crate) fn error(error: TraceError) -> Error {
    Error::new(ErrorClass::Usage, error.to_string(), "--accel", "")
}
