// The middle of a box.
//#include boxes

/// Twice the centre of a box along an axis.
fn doubled_centre(b: Box, axis: u32) -> f32 {
    return bitcast<f32>(coordinate(b[axis])) + bitcast<f32>(coordinate(b[axis + 3u]));
}
