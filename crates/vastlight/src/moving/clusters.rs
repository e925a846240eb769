//! Trees over precomputed clusters beside trees over all triangles, of a scene that moves.

use super::error;
use super::rays::{normal, rays, seen, traced};
use crate::Error;
use rayon::prelude::*;
use std::sync::Arc;
use vastlight_accel::ClusterConfig;
use vastlight_accel::cluster::Heuristic;
use vastlight_film::Picture;
use vastlight_math::{Ray, Vec3, rng};
use vastlight_scene::{Motion, Scene};
use vastlight_trace::{Hit, Tracer, TracerConfig, UpdateMethod};

/// What to measure.
#[derive(Clone, Debug)]
pub struct ClusterRequest {
    /// What clusters should look like, each with each of `max_counts`.
    pub heuristics: Vec<Heuristic>,
    /// About the most vertices of a cluster, and its largest size; see [`ClusterConfig`].
    pub max_counts: Vec<u32>,
    /// Moments, in seconds; clusters are made at the first one.
    pub times: Vec<f32>,
    /// Columns and rows of the camera's rays; as many bounce from what they hit.
    pub size: [u32; 2],
    /// Builder on both sides; empty for the default.
    pub accel: String,
}

/// What clusters of one kind gave.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusterFigures {
    /// How the clusters were made.
    pub config: ClusterConfig,
    /// Clusters of all meshes that move.
    pub clusters: usize,
    /// Triangles of these meshes.
    pub triangles: usize,
    /// Milliseconds of making them, once.
    pub made_ms: f64,
    /// The moments.
    pub moments: Vec<ClusterMoment>,
    /// Whether all trees gave the same hits.
    pub same_hits: bool,
}

/// Trees of a moment: over clusters, by the same builder over all triangles, none of which is split, and by the default builder with its
/// own choice of splits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClusterMoment {
    /// Milliseconds of building each; the boxes of clusters are included.
    pub build_ms: [f64; 3],
    /// Milliseconds of the same rays through each.
    pub trace_ms: [f64; 3],
}

impl ClusterFigures {
    /// The means over the moments.
    #[must_use]
    pub fn mean(&self) -> ClusterMoment {
        let count = self.moments.len().max(1) as f64;
        let mean = |of: fn(&ClusterMoment) -> [f64; 3]| {
            [0, 1, 2].map(|side| self.moments.iter().map(|m| of(m)[side]).sum::<f64>() / count)
        };
        ClusterMoment { build_ms: mean(|m| m.build_ms), trace_ms: mean(|m| m.trace_ms) }
    }
}

/// Times that trees of a moment are built; the best counts.
const TURNS: u32 = 3;

/// Follows a scene that moves with trees over clusters of each kind, and gives what each kind brought; the last kind's
/// clusters by colour, at the last moment.
///
/// # Errors
/// No mesh deforms, or a moment cannot be had.
pub fn measure_clusters(
    scene: &Scene,
    request: &ClusterRequest,
    mut each: impl FnMut(&ClusterFigures),
) -> Result<Picture, Error> {
    let still =
        || Error::scene("no mesh of this scene changes its form", "", "clusters are of meshes that do");
    let motion = scene.motion().cloned().ok_or_else(still)?;
    let mut last = None;
    for &heuristic in &request.heuristics {
        for &most in &request.max_counts {
            let config =
                ClusterConfig { heuristic, max_count: most, max_size: most, ..ClusterConfig::DEFAULT };
            let mut sides = Sides::new(scene, &request.accel, config)?;
            for &time in &request.times {
                sides.moment(&motion, time, request.size)?;
            }
            each(&sides.figures(config).ok_or_else(still)?);
            last = Some(sides);
        }
    }
    last.map_or_else(|| Err(still()), |sides| sides.with().picture(request.size))
}

/// A scene that is followed in one way.
struct Side {
    scene: Scene,
    tracer: Tracer,
    made_ms: f64,
}

/// With clusters, by the same builder without, and by the default builder.
struct Sides {
    all: [Side; 3],
    moments: Vec<ClusterMoment>,
    same_hits: bool,
}

impl Sides {
    fn new(scene: &Scene, accel: &str, clusters: ClusterConfig) -> Result<Self, Error> {
        let side = |accel: &str, split_budget, clusters| {
            let config = TracerConfig {
                accel: accel.to_owned(),
                split_budget,
                clusters,
                update: UpdateMethod::Rebuild,
                ..TracerConfig::default()
            };
            let (scene, tracer) = (scene.clone(), Tracer::new(scene, &config).map_err(error)?);
            Ok::<_, Error>(Side { scene, tracer, made_ms: 0.0 })
        };
        let all = [side(accel, None, Some(clusters))?, side(accel, Some(1.0), None)?, side("", None, None)?];
        Ok(Self { all, moments: Vec::new(), same_hits: true })
    }

    fn with(&self) -> &Side {
        &self.all[0]
    }

    /// Builds and traces a moment on all sides in turn.
    fn moment(&mut self, motion: &Arc<dyn Motion>, time: f32, size: [u32; 2]) -> Result<(), Error> {
        let mut build_ms = [f64::INFINITY; 3];
        for _ in 0..TURNS {
            for (side, best) in self.all.iter_mut().zip(&mut build_ms) {
                *best = best.min(side.build(motion, time)?);
            }
        }
        let rays = rays(&self.all[0].scene, &self.all[0].tracer, size)?;
        let traced = self.all.each_ref().map(|side| traced(&side.tracer, &rays));
        self.same_hits &= traced.iter().all(|side| side.answer == traced[0].answer);
        let trace_ms = traced.map(|side| side.ms);
        self.moments.push(ClusterMoment { build_ms, trace_ms });
        Ok(())
    }

    /// What was measured; none where there are no clusters.
    fn figures(&self, config: ClusterConfig) -> Option<ClusterFigures> {
        let with = self.with();
        let meshes = 0..with.scene.meshes().len() as u32;
        let of_meshes: Vec<_> = meshes.filter_map(|mesh| with.tracer.clusters(mesh)).collect();
        (!of_meshes.is_empty()).then(|| ClusterFigures {
            config,
            clusters: of_meshes.iter().map(|clusters| clusters.len()).sum(),
            triangles: of_meshes.iter().map(|clusters| clusters.of_triangle().len()).sum(),
            made_ms: with.made_ms,
            moments: self.moments.clone(),
            same_hits: self.same_hits,
        })
    }
}

impl Side {
    /// Milliseconds of the trees of a moment.
    fn build(&mut self, motion: &Arc<dyn Motion>, time: f32) -> Result<f64, Error> {
        let report = self.tracer.pose(&mut self.scene, motion.pose(time)?)?;
        self.made_ms += report.meshes.iter().map(|mesh| mesh.clusters_ms).sum::<f64>();
        Ok(report.meshes.iter().map(|mesh| mesh.ms).sum())
    }

    /// What the camera sees, each cluster in a colour of its own, lit from the camera.
    fn picture(&self, [width, height]: [u32; 2]) -> Result<Picture, Error> {
        let (rays, hits) = seen(&self.scene, &self.tracer, [width, height])?;
        let color = |(ray, hit)| self.color(ray, hit).unwrap_or(Vec3::ONE);
        let pixels: Vec<Vec3> = rays.par_iter().zip(&hits).map(color).collect();
        let plane = |axis: usize| pixels.iter().map(|color| color[axis]).collect();
        Ok(Picture::from_rgb(width, height, [plane(0), plane(1), plane(2)]))
    }

    /// The colour of what a ray meets; none where it meets nothing.
    fn color(&self, ray: &Ray, hit: &Hit) -> Option<Vec3> {
        let normal = normal(&self.scene, ray, hit)?;
        let mesh = self.scene.instances().mesh(hit.instance as usize);
        let clusters = self.tracer.clusters(mesh);
        let cluster = clusters.and_then(|clusters| clusters.of_triangle().get(hit.prim as usize));
        let hue = |&cluster: &u32| {
            Vec3::from([0, 1, 2].map(|axis| 0.15 + 0.8 * rng::hash_to_unit(&[mesh, cluster, axis])))
        };
        let light = 0.25 - 0.75 * normal.dot(ray.direction.normalize());
        Some(cluster.map_or(Vec3::splat(0.5), hue) * light)
    }
}
