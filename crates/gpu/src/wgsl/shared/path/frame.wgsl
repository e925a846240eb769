// Orthonormal frames as in `vastlight-math`, `frame`.
//#include real

/// Right-handed; `z` is the normal.
struct Frame {
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
}

/// A frame around the unit vector `z` (Duff et al. 2017, "Building an orthonormal basis, revisited").
fn frame_from_z(z: vec3<f32>) -> Frame {
    let sign_z = real_copysign(1.0, z.z);
    let a = -1.0 / (sign_z + z.z);
    let b = z.x * z.y * a;
    return Frame(
        vec3<f32>(1.0 + sign_z * z.x * z.x * a, sign_z * b, -sign_z * z.x),
        vec3<f32>(b, sign_z + z.y * z.y * a, -z.y),
        z,
    );
}

/// A frame around the unit vector `z` whose `x` is as near to `tangent` as it can be; any frame if they are parallel or
/// `tangent` is zero.
fn frame_from_z_and_tangent(z: vec3<f32>, tangent: vec3<f32>) -> Frame {
    let x = tangent - z * dot(z, tangent);
    let length_squared = dot(x, x);
    if (real_is_finite(length_squared) && length_squared > 1e-12 * dot(tangent, tangent)) {
        let unit_x = x / sqrt(length_squared);
        return Frame(unit_x, cross(z, unit_x), z);
    }
    return frame_from_z(z);
}

/// From the frame's coordinates to the outer ones.
fn frame_to_outer(frame: Frame, v: vec3<f32>) -> vec3<f32> {
    return frame.x * v.x + frame.y * v.y + frame.z * v.z;
}

/// From outer coordinates to the frame's.
fn frame_to_local(frame: Frame, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(v, frame.x), dot(v, frame.y), dot(v, frame.z));
}
