//! Rays on a device: what `bench trace --device gpu` does.

use crate::error::GpuError;
use crate::recording::{Recording, Resident};
use crate::run::Executor;
use crate::trace::{
    DeviceTracer, HIT_WORDS, MAX_RAYS, hits_of_words, ray_words, record_closest, record_occluded,
};
use std::time::Instant;
use vastlight_math::Ray;

/// The figures of rays on a device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TraceFigures {
    /// Best time in milliseconds, without moving rays and answers to and fro.
    pub ms: f64,
    /// Compiling the kernels that were not ready; some drivers finish at the first dispatch.
    pub compile_ms: f64,
    /// Dispatches for all rays.
    pub dispatches: usize,
    /// Rays that hit (or are occluded).
    pub hits: u64,
    /// Sum of `t` over hits, in the order of the rays; zero for occlusion.
    pub sum_t: f64,
}

/// Traces `rays` `repeat` times (at least once): closest hits, or occlusion.
///
/// # Errors
/// They do not fit on the device, or it fails.
pub fn trace(
    executor: &mut Executor,
    tracer: &DeviceTracer,
    rays: &[Ray],
    occluded: bool,
    repeat: u32,
) -> Result<TraceFigures, GpuError> {
    let mut all = TraceFigures::default();
    for rays in rays.chunks(MAX_RAYS as usize) {
        let words: Vec<[f32; 8]> = rays.iter().map(ray_words).collect();
        let room = executor.keep("rays", &words)?;
        let part = trace_in(executor, tracer, (room, rays.len() as u32), occluded, repeat);
        executor.release(room);
        let part = part?;
        all.ms += part.ms;
        all.compile_ms += part.compile_ms;
        all.dispatches += part.dispatches;
        all.hits += part.hits;
        all.sum_t += part.sum_t;
    }
    Ok(all)
}

fn trace_in(
    executor: &mut Executor,
    tracer: &DeviceTracer,
    (room, count): (Resident, u32),
    occluded: bool,
    repeat: u32,
) -> Result<TraceFigures, GpuError> {
    let mut recording = Recording::new();
    let rays = recording.resident("rays", room);
    let record = if occluded { record_occluded } else { record_closest };
    let answers = record(&mut recording, tracer, rays, count)?;
    let mut figures =
        TraceFigures { ms: f64::INFINITY, dispatches: recording.dispatches(), ..TraceFigures::default() };
    executor.prepare(&recording.kernels(), &mut |progress| figures.compile_ms += progress.ms)?;
    for _ in 0..repeat.max(1) {
        let start = Instant::now();
        executor.run(&recording)?;
        figures.ms = figures.ms.min(start.elapsed().as_secs_f64() * 1e3);
    }
    let words = u64::from(count) * if occluded { 1 } else { HIT_WORDS as u64 };
    let answers = recording.download(answers, words);
    let words = executor.run(&recording)?.words(answers);
    if occluded {
        figures.hits = words.iter().filter(|&&word| word == 1).count() as u64;
    } else {
        for hit in hits_of_words(&words).iter().filter(|hit| hit.is_hit()) {
            figures.hits += 1;
            figures.sum_t += f64::from(hit.t);
        }
    }
    Ok(figures)
}
