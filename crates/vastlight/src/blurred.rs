//! What an open shutter costs: rays of all its times, beside the same rays at the moment when it opens.

use crate::moving::{error, rays};
use crate::{Error, Exposure};
use std::time::Instant;
use vastlight_math::{Ray, rng};
use vastlight_scene::Scene;
use vastlight_trace::bench::{TraceFigures, trace};
use vastlight_trace::sort::SortRays;
use vastlight_trace::{Tracer, TracerConfig};

/// The same rays at a moment, and each at its own time.
#[derive(Clone, Debug, PartialEq)]
pub struct ShutterFigures {
    /// Rays: half of them the camera's, half that bounce.
    pub rays: usize,
    /// Millions of rays a second at the moment, on the wall and by processor time where the system says that.
    pub still: [Option<f64>; 2],
    /// The same while the shutter is open.
    pub open: [Option<f64>; 2],
    /// Milliseconds from poses to rays: of the moment, and of all keys.
    pub pose_ms: [f64; 2],
    /// Instances and triangles of meshes that move.
    pub moving: [u64; 2],
}

/// Rounds of which the best counts; both ways take turns.
const ROUNDS: u32 = 5;

/// Measures a scene at a moment with a camera of so many columns and rows.
///
/// # Errors
/// Nothing moves, or the moment cannot be had.
pub fn measure_shutter(
    scene: &Scene,
    time: f32,
    exposure: &Exposure,
    size: [u32; 2],
) -> Result<ShutterFigures, Error> {
    let moment = Exposure { seconds: 0.0, ..*exposure };
    let follower = |exposure: &Exposure| {
        let (mut scene, poses) = (scene.clone(), exposure.poses(scene, time)?);
        let mut tracer = Tracer::new(&scene, &TracerConfig::default()).map_err(error)?;
        let start = Instant::now();
        tracer.open_shutter(&mut scene, poses)?;
        Ok::<_, Error>((scene, tracer, start.elapsed().as_secs_f64() * 1e3))
    };
    let (still_scene, still, still_ms) = follower(&moment)?;
    let (open_scene, open, open_ms) = follower(exposure)?;
    let rays = rays(&still_scene, &still, size)?;
    let at_own_time = |(i, ray): (usize, &Ray)| Ray { time: rng::hash_to_unit(&[i as u32, 2]), ..*ray };
    let timed: Vec<Ray> = rays.iter().enumerate().map(at_own_time).collect();
    let (mut of_still, mut of_open) = ([None; 2], [None; 2]);
    for _ in 0..ROUNDS {
        keep_best(&mut of_still, &trace(&still, &rays, false, SortRays::Off, 1));
        keep_best(&mut of_open, &trace(&open, &timed, false, SortRays::Off, 1));
    }
    let shutter = open_scene.shutter();
    let triangles = |(mesh, _)| open_scene.extents()[mesh as usize].triangles;
    let moving = shutter.map_or([0; 2], |shutter| {
        [shutter.instances().count() as u64, shutter.meshes().map(triangles).sum()]
    });
    let pose_ms = [still_ms, open_ms];
    Ok(ShutterFigures { rays: rays.len(), still: of_still, open: of_open, pose_ms, moving })
}

fn keep_best(best: &mut [Option<f64>; 2], figures: &TraceFigures) {
    let now = [Some(figures.mrays_per_s), figures.mrays_per_cpu_s];
    for (best, now) in best.iter_mut().zip(now) {
        *best = now.map(|now| best.map_or(now, |best| best.max(now)));
    }
}
