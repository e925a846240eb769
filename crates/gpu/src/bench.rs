//! What `bench sort`, `bench build` and `bench trace` do with `--device gpu`.

mod build;
mod photons;
mod trace;

pub use build::{BuildFigures, BuildInput, Built, build};
pub use photons::{IndexFigures, index};
pub use trace::{TraceFigures, trace};

use crate::error::GpuError;
use crate::primitives::radix::{self, Pairs};
use crate::recording::{Recording, Resident};
use crate::run::Executor;
use std::time::Instant;

/// The times of a sort.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SortFigures {
    /// Best time in milliseconds, from handing commands over to the end of the last, without moving keys to and fro.
    pub ms: f64,
    /// The first time, when some drivers finish compiling.
    pub first_ms: f64,
    /// Compiling the kernels that were not ready, before the first.
    pub compile_ms: f64,
    /// Dispatches of one sort.
    pub dispatches: usize,
}

/// What was sorted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sorted {
    /// The keys in order.
    pub keys: Vec<u32>,
    /// What went along, if anything.
    pub payloads: Vec<u32>,
}

/// Sorts keys, with payloads of the same number or without, `repeat` times (at least once).
///
/// # Errors
/// There are too many for the device, or it fails.
pub fn sort(
    executor: &mut Executor,
    keys: &[u32],
    payloads: Option<&[u32]>,
    repeat: u32,
) -> Result<(SortFigures, Sorted), GpuError> {
    let count = u32::try_from(keys.len()).unwrap_or(u32::MAX);
    let mut rooms = vec![executor.keep("keys", keys)?];
    if let Some(payloads) = payloads {
        let room = executor.keep("payloads", payloads).inspect_err(|_| executor.release(rooms[0]))?;
        rooms.push(room);
    }
    let outcome = sort_in(executor, count, repeat, &rooms);
    rooms.into_iter().for_each(|room| executor.release(room));
    outcome
}

fn sort_in(
    executor: &mut Executor,
    count: u32,
    repeat: u32,
    rooms: &[Resident],
) -> Result<(SortFigures, Sorted), GpuError> {
    let (recording, _) = record(rooms, count)?;
    let mut compile_ms = 0.0;
    executor.prepare(&recording.kernels(), &mut |progress| compile_ms += progress.ms)?;
    let mut times = Vec::new();
    for _ in 0..repeat.max(1) {
        let start = Instant::now();
        executor.run(&recording)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    let ms = times.iter().copied().fold(f64::INFINITY, f64::min);
    let figures = SortFigures { ms, first_ms: times[0], compile_ms, dispatches: recording.dispatches() };

    let (mut recording, output) = record(rooms, count)?;
    let keys = recording.download(output.keys, count.into());
    let payloads = output.payloads.map(|payloads| recording.download(payloads, count.into()));
    let results = executor.run(&recording)?;
    let payloads = payloads.map(|payloads| results.words(payloads)).unwrap_or_default();
    Ok((figures, Sorted { keys: results.words(keys), payloads }))
}

/// A sort of what is on the device already.
fn record(rooms: &[Resident], count: u32) -> Result<(Recording, Pairs), GpuError> {
    let mut recording = Recording::new();
    let buffers: Vec<_> = rooms.iter().map(|room| recording.resident("input", *room)).collect();
    let input = Pairs { keys: buffers[0], payloads: buffers.get(1).copied() };
    let output = radix::record(&mut recording, input, count, u32::BITS)?;
    Ok((recording, output))
}
