//! What moving costs: a scene is followed through its moments, and rays over the updated structures are compared with rays
//! over fresh ones.

mod clusters;
mod rays;

use crate::{Error, ErrorClass};
use rays::{Traced, traced};
use std::time::Instant;
use vastlight_accel::build::NAMES;
use vastlight_math::Ray;
use vastlight_scene::Scene;
use vastlight_trace::{TraceError, Tracer, TracerConfig, UpdateMethod};

pub use clusters::{ClusterFigures, ClusterMoment, ClusterRequest, measure_clusters};
pub(crate) use rays::rays;

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
            let Traced { ms: trace_ms, answer } = traced(tracer, &fresh.rays);
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
                fresh_trace_ms: fresh.traced.ms,
                changed: report.meshes.first().map_or([0.0; 2], |mesh| [mesh.rebuilt, mesh.migrated]),
                moved: [report.change.meshes.len(), report.change.instances.len()],
                rays: fresh.rays.len(),
                same_hits: answer == fresh.traced.answer,
            });
        }
    }
    Ok(())
}

/// A structure that was built for a moment, and rays through it.
struct Fresh {
    ms: f64,
    rays: Vec<Ray>,
    traced: Traced,
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
        Ok(Self { ms, traced: traced(&tracer, &rays), rays })
    }
}

/// The builder of the least time among those whose rays are nearly as fast as the fastest.
fn fastest_builder(scene: &Scene, request: &MovingRequest) -> Result<&'static str, Error> {
    let fresh = |name| Ok((name, Fresh::new(scene, name, request.size)?));
    let all = BUILDERS.into_iter().map(fresh).collect::<Result<Vec<(&str, Fresh)>, Error>>()?;
    let best = all.iter().map(|(_, fresh)| fresh.traced.ms).fold(f64::INFINITY, f64::min);
    let good = all.iter().filter(|(_, fresh)| fresh.traced.ms <= SLOWER * best);
    Ok(good.min_by(|a, b| a.1.ms.total_cmp(&b.1.ms)).map_or(BUILDERS[0], |(name, _)| *name))
}

pub(crate) fn error(error: TraceError) -> Error {
    Error::new(ErrorClass::Usage, error.to_string(), "--accel", "")
}
