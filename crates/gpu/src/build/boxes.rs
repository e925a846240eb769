//! Boxes on the device: six words, lower corner and upper corner, whose order as unsigned numbers is that of the
//! coordinates.

use super::check_fits;
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording};
use vastlight_accel::Reference;
use vastlight_math::{Aabb, Vec3};

/// Words of a box.
pub const BOX_WORDS: u64 = 6;

device_struct! {
    struct Parameters as "Parameters" { count }
}
kernel!(pub(crate) BOXES = "build_boxes", Parameters, 3);

/// A box as the kernels read it. As for builders on the CPU, what is empty or not finite is pulled into the finite range.
#[must_use]
pub fn box_words(bounds: &Aabb) -> [u32; 6] {
    let Aabb { min, max } = Reference::new(bounds, 0).bounds();
    [min.x, min.y, min.z, max.x, max.y, max.z].map(|x| ordered(x.to_bits()))
}

/// The word of a coordinate: all bits of negative numbers turned, the first of others.
const fn ordered(bits: u32) -> u32 {
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

/// The words of the boxes of triangles, as [`record`] gives them; corners that do not exist are everywhere here, and
/// anywhere on the device.
#[must_use]
pub fn boxes(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    let everything = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
    let corner = |&i: &u32| match positions.get(i as usize) {
        Some(p) if !p.is_nan() => box_words(&Aabb::point(*p)),
        Some(p) => {
            let [low, high] = [box_words(&everything), box_words(&Aabb::point(*p))];
            let numbers = p.to_array().map(f32::is_nan);
            std::array::from_fn(|i| if numbers[i % 3] { low[i] } else { high[i] })
        }
        None => box_words(&everything),
    };
    triangles.iter().flat_map(|triangle| triangle.iter().map(corner).fold(EMPTY, join)).collect()
}

/// The words of the box that contains nothing.
pub(super) const EMPTY: [u32; 6] = [u32::MAX, u32::MAX, u32::MAX, 0, 0, 0];

/// The smallest box around both.
pub(super) fn join(a: [u32; 6], b: [u32; 6]) -> [u32; 6] {
    std::array::from_fn(|i| if i < 3 { a[i].min(b[i]) } else { a[i].max(b[i]) })
}

/// Records the boxes of `count` triangles: three words of `triangles` each, which name vertices of three words. The answer
/// is [`BOX_WORDS`] a triangle.
///
/// # Errors
/// There are too many.
pub fn record(
    recording: &mut Recording,
    positions: Buffer,
    triangles: Buffer,
    count: u32,
) -> Result<Buffer, GpuError> {
    check_fits(count)?;
    let boxes = recording.buffer("boxes", BOX_WORDS * u64::from(count));
    if count > 0 {
        let groups = Groups::Direct(count.div_ceil(GROUP));
        recording.dispatch(&BOXES, &Parameters { count }, &[positions, triangles, boxes], groups);
    }
    Ok(boxes)
}
