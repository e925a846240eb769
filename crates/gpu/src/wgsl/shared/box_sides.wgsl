// The sides of boxes.
//#include boxes

/// The least and the greatest coordinate along an axis.
fn side_of(b: Box, axis: u32) -> vec2<f32> {
    var words = b;
    return vec2<f32>(bitcast<f32>(coordinate(words[axis])), bitcast<f32>(coordinate(words[axis + 3u])));
}

/// The lengths of the sides.
fn lengths_of(b: Box) -> vec3<f32> {
    let x = side_of(b, 0u);
    let y = side_of(b, 1u);
    let z = side_of(b, 2u);
    return vec3<f32>(x.y - x.x, y.y - y.x, z.y - z.x);
}
