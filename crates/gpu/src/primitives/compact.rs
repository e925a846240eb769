//! Compaction: the values whose flag is set, in order (Blelloch 1990, "Prefix sums and their applications", packing).

use super::{check_count, scan, tiles};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::recording::{Buffer, Groups, Recording};

device_struct! {
    struct Parameters as "Parameters" { count }
}
kernel!(pub(crate) COUNT = "compact_count", Parameters, 2);
kernel!(pub(crate) EMIT = "compact_emit", Parameters, 4);

/// Buffers of a compaction.
#[derive(Clone, Copy, Debug)]
pub struct Compacted {
    /// The values that stayed, and anything behind them.
    pub kept: Buffer,
    /// How many there are: one word.
    pub count: Buffer,
}

/// The values whose flag is not 0; flags that are missing are 0.
#[must_use]
pub fn compact(flags: &[u32], values: &[u32]) -> Vec<u32> {
    flags.iter().zip(values).filter(|(flag, _)| **flag != 0).map(|(_, value)| *value).collect()
}

/// Records [`compact`] of the first `count` elements.
///
/// # Errors
/// There are too many elements.
pub fn record(
    recording: &mut Recording,
    flags: Buffer,
    values: Buffer,
    count: u32,
) -> Result<Compacted, GpuError> {
    check_count("compact", count)?;
    let groups = tiles(count).max(1);
    let parameters = Parameters { count };
    let counts = recording.buffer("kept in tiles", groups.into());
    recording.dispatch(&COUNT, &parameters, &[flags, counts], Groups::Direct(groups));
    let firsts = scan::record(recording, counts, groups)?;
    let kept = recording.buffer("kept", count.into());
    recording.dispatch(&EMIT, &parameters, &[flags, values, firsts, kept], Groups::Direct(groups));
    let total = recording.buffer("count of kept", 1);
    recording.copy(firsts, groups.into(), total, 1);
    Ok(Compacted { kept, count: total })
}
