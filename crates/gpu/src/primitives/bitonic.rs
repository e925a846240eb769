//! Short sorts, each in the memory of one workgroup: Batcher 1968, "Sorting networks and their applications".

use super::check_count;
use super::radix::Pairs;
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::limits::WORKGROUPS_PER_AXIS;
use crate::recording::{Buffer, Groups, Recording};

/// Longest stretch that is sorted.
pub const LONGEST: u32 = 1024;

device_struct! {
    struct Parameters as "Parameters" { count }
}
kernel!(pub(crate) BITONIC = "bitonic", Parameters, 5);

/// Sorts each stretch (start, length) of the pairs by its keys, stably; what is in none stays.
///
/// # Errors
/// A stretch is longer than [`LONGEST`] or not within the pairs.
pub fn bitonic(stretches: &[[u32; 2]], keys: &mut [u32], payloads: &mut [u32]) -> Result<(), GpuError> {
    check(stretches, keys.len().min(payloads.len()) as u32)?;
    for stretch in stretches {
        let range = stretch[0] as usize..(stretch[0] + stretch[1]) as usize;
        let mut pairs: Vec<(u32, u32)> =
            keys[range.clone()].iter().copied().zip(payloads[range.clone()].iter().copied()).collect();
        pairs.sort_by_key(|pair| pair.0);
        for (i, (key, payload)) in range.zip(pairs) {
            (keys[i], payloads[i]) = (key, payload);
        }
    }
    Ok(())
}

fn check(stretches: &[[u32; 2]], count: u32) -> Result<(), GpuError> {
    for &[start, length] in stretches {
        if length > LONGEST {
            let what = "bitonic sort in elements".to_owned();
            return Err(GpuError::Limit { what, wanted: length.into(), limit: LONGEST.into() });
        }
        if start.checked_add(length).is_none_or(|end| end > count) {
            let reason = format!("bitonic sort: {length} elements at {start} of {count}");
            return Err(GpuError::Rejected { reason });
        }
    }
    Ok(())
}

/// Records [`bitonic`] of disjoint stretches among `count` pairs; what is in none of them is anything.
///
/// # Errors
/// A stretch is longer than [`LONGEST`] or not within the pairs, or there are too many elements.
pub fn record(
    recording: &mut Recording,
    stretches: &[[u32; 2]],
    keys: Buffer,
    payloads: Buffer,
    count: u32,
) -> Result<Pairs, GpuError> {
    check_count("bitonic sort", count)?;
    check(stretches, count)?;
    let sorted_keys = recording.buffer("sorted keys", count.into());
    let sorted_payloads = recording.buffer("sorted payloads", count.into());
    for some in stretches.chunks(WORKGROUPS_PER_AXIS as usize) {
        let groups = Groups::Direct(some.len() as u32);
        let parameters = Parameters { count: some.len() as u32 };
        let some = recording.upload("stretches", some);
        let buffers = [some, keys, payloads, sorted_keys, sorted_payloads];
        recording.dispatch(&BITONIC, &parameters, &buffers, groups);
    }
    Ok(Pairs { keys: sorted_keys, payloads: Some(sorted_payloads) })
}
