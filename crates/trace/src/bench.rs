//! What `bench trace` and `bench build` do: read a ray file, trace it several times, give the figures.

use crate::sort::{RaySorter, SortRays, SortReport};
use crate::usage::{LeastCpu, peak_growth};
use crate::{BuildReport, Hit, TraceError, Tracer, TracerConfig};
use vastlight_math::{Ray, Vec3};
use vastlight_scene::Scene;

/// Bytes of a ray in a file: `ox oy oz tmin dx dy dz tmax`, little-endian f32.
pub const RAY_BYTES: usize = 32;

/// The rays of a ray file's bytes; bytes after the last whole ray are an error, given as the number of bytes.
///
/// # Errors
/// The length is not a multiple of [`RAY_BYTES`].
pub fn parse_rays(bytes: &[u8]) -> Result<Vec<Ray>, RayFileError> {
    if !bytes.len().is_multiple_of(RAY_BYTES) {
        return Err(RayFileError { bytes: bytes.len() });
    }
    let ray = |chunk: &[u8]| {
        let at = |i: usize| {
            f32::from_le_bytes([chunk[4 * i], chunk[4 * i + 1], chunk[4 * i + 2], chunk[4 * i + 3]])
        };
        Ray {
            origin: Vec3::new(at(0), at(1), at(2)),
            t_min: at(3),
            direction: Vec3::new(at(4), at(5), at(6)),
            t_max: at(7),
            time: 0.0,
        }
    };
    Ok(bytes.chunks_exact(RAY_BYTES).map(ray).collect())
}

/// A ray file of a length that it cannot have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a ray file has 32 bytes a ray, {bytes} bytes are no whole number of rays")]
pub struct RayFileError {
    /// Length of the file.
    pub bytes: usize,
}

/// The figures of a `bench trace` line.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceFigures {
    /// Full name of the builder.
    pub accel: &'static str,
    /// Name of the instructions.
    pub level: &'static str,
    /// Triangles, each mesh counted once.
    pub triangles: u64,
    /// Time of the build in milliseconds.
    pub build_ms: f64,
    /// Memory of the structures over the number of triangles.
    pub bytes_per_triangle: f64,
    /// The part of it that tells the triangles' numbers in their meshes.
    pub number_bytes_per_triangle: f64,
    /// Rays in the file.
    pub rays: u64,
    /// What sorting and tracing took in the best repeat.
    pub sort: SortReport,
    /// Millions of rays a second, best repeat, sorted and traced, all threads of the current pool.
    pub mrays_per_s: f64,
    /// Millions of rays in a second of processor time; none where the system does not say.
    pub mrays_per_cpu_s: Option<f64>,
    /// Rays that hit (or are occluded).
    pub hits: u64,
    /// Sum of `t` over hits in f64, in the order of the rays; zero for occlusion.
    pub sum_t: f64,
}

/// Traces `rays` `repeat` times (at least once) with the threads of the current pool, sorted where `when` says so.
#[must_use]
pub fn trace(tracer: &Tracer, rays: &[Ray], occluded: bool, when: SortRays, repeat: u32) -> TraceFigures {
    let (mut best, mut cpu): (Option<SortReport>, _) = (None, LeastCpu::default());
    let mut hits = vec![Hit::MISS; if occluded { 0 } else { rays.len() }];
    let mut flags = vec![false; if occluded { rays.len() } else { 0 }];
    let mut sorter = RaySorter::default();
    let total = |report: &SortReport| report.sorting + report.tracing;
    for _ in 0..repeat.max(1) {
        let report = cpu.of(|| {
            if occluded {
                sorter.occluded(tracer, when, rays, &mut flags)
            } else {
                sorter.closest(tracer, when, rays, &mut hits)
            }
        });
        if best.is_none_or(|best| total(&report) < total(&best)) {
            best = Some(report);
        }
    }
    let sort = best.unwrap_or_default();
    let report = tracer.report();
    let found = hits.iter().filter(|h| h.is_hit());
    TraceFigures {
        accel: report.accel,
        level: tracer.level().name(),
        triangles: report.triangles,
        build_ms: report.build_ms,
        bytes_per_triangle: report.bytes as f64 / report.triangles.max(1) as f64,
        number_bytes_per_triangle: report.number_bytes as f64 / report.triangles.max(1) as f64,
        rays: rays.len() as u64,
        sort,
        mrays_per_s: rays.len() as f64 / total(&sort).as_secs_f64() / 1e6,
        mrays_per_cpu_s: cpu.ms.map(|ms| rays.len() as f64 / ms.max(1e-3) / 1e3),
        hits: found.clone().count() as u64 + flags.iter().filter(|&&f| f).count() as u64,
        sum_t: found.fold(0.0, |sum, h| sum + f64::from(h.t)),
    }
}

/// The figures of a `bench build` line.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildFigures {
    /// Full name of the builder.
    pub accel: &'static str,
    /// Triangles, each mesh counted once.
    pub triangles: u64,
    /// References to triangles in leaves.
    pub references: u64,
    /// Nodes of the binary trees.
    pub nodes: u64,
    /// Best time in milliseconds.
    pub build_ms: f64,
    /// Least processor time of a build, all threads together, in milliseconds; none where the system does not say.
    pub cpu_ms: Option<f64>,
    /// Millions of triangles a second in the best build.
    pub mtri_per_s: f64,
    /// `C(root)`.
    pub cost: f64,
    /// Nodes on the longest way from the root to a leaf.
    pub depth: u64,
    /// Overlap of siblings.
    pub overlap: f64,
    /// Memory that the finished structures keep.
    pub bytes: u64,
    /// By how much the process's resident memory grew during the first build, at its peak: the structures and what a build
    /// needs besides. None where the system does not say.
    pub peak_build_bytes: Option<u64>,
    /// Stages of the best build in milliseconds.
    pub stages: Vec<(&'static str, f64)>,
}

/// Builds once and measures trees and memory, then `repeat` times (at least once) and measures time, with the threads of
/// the current pool.
///
/// # Errors
/// Those of [`Tracer::new`].
pub fn build(scene: &Scene, config: &TracerConfig, repeat: u32) -> Result<BuildFigures, TraceError> {
    let measuring = TracerConfig { measure: true, ..config.clone() };
    let (measured, peak_build_bytes) = peak_growth(|| Tracer::new(scene, &measuring));
    let measured = measured?.report().clone();
    let mut best = BuildReport { build_ms: f64::INFINITY, ..BuildReport::default() };
    let mut cpu = LeastCpu::default();
    for _ in 0..repeat.max(1) {
        let tracer = cpu.of(|| Tracer::new(scene, config))?;
        if tracer.report().build_ms < best.build_ms {
            best = tracer.report().clone();
        }
    }
    Ok(BuildFigures {
        accel: best.accel,
        triangles: best.triangles,
        references: best.references,
        nodes: best.nodes,
        build_ms: best.build_ms,
        cpu_ms: cpu.ms,
        mtri_per_s: best.triangles as f64 / best.build_ms / 1e3,
        cost: measured.cost,
        depth: measured.depth,
        overlap: measured.overlap,
        bytes: best.bytes,
        peak_build_bytes,
        stages: best.stages,
    })
}
