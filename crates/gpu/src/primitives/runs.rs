//! Run-length encoding: key and start of each run of equal keys.

use super::{check_count, scan, tiles};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::recording::{Buffer, Groups, Recording};

device_struct! {
    struct Parameters as "Parameters" { count, shift }
}
kernel!(pub(crate) COUNT = "runs_count", Parameters, 2);
kernel!(pub(crate) EMIT = "runs_emit", Parameters, 4);

/// Buffers of an encoding.
#[derive(Clone, Copy, Debug)]
pub struct Encoded {
    /// The key of each run, shifted, and anything behind.
    pub keys: Buffer,
    /// Where each run starts; behind the last, the number of keys, and then anything.
    pub starts: Buffer,
    /// How many runs there are: one word.
    pub count: Buffer,
}

/// The upper bits of the keys of each run (all but the lower `shift`, at most 31), and where the runs start, with the
/// number of keys behind the last.
#[must_use]
pub fn runs(keys: &[u32], shift: u32) -> (Vec<u32>, Vec<u32>) {
    let shift = shift.min(31);
    let (mut run_keys, mut starts) = (Vec::new(), Vec::new());
    for (i, key) in (0..).zip(keys.iter().map(|key| key >> shift)) {
        if run_keys.last() != Some(&key) {
            run_keys.push(key);
            starts.push(i);
        }
    }
    starts.push(keys.len() as u32);
    (run_keys, starts)
}

/// Records [`runs`] of the first `count` keys.
///
/// # Errors
/// There are too many elements.
pub fn record(recording: &mut Recording, keys: Buffer, count: u32, shift: u32) -> Result<Encoded, GpuError> {
    check_count("runs", count)?;
    let groups = tiles(count).max(1);
    let parameters = Parameters { count, shift: shift.min(31) };
    let counts = recording.buffer("runs in tiles", groups.into());
    recording.dispatch(&COUNT, &parameters, &[keys, counts], Groups::Direct(groups));
    let firsts = scan::record(recording, counts, groups)?;
    let run_keys = recording.buffer("keys of runs", count.into());
    let starts = recording.buffer("starts of runs", u64::from(count) + 1);
    recording.dispatch(&EMIT, &parameters, &[keys, firsts, run_keys, starts], Groups::Direct(groups));
    let total = recording.buffer("count of runs", 1);
    recording.copy(firsts, groups.into(), total, 1);
    Ok(Encoded { keys: run_keys, starts, count: total })
}
