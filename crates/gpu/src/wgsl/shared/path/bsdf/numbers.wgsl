// Small numbers and colours as in `vastlight-transport`, `bsdf`: what is out of range is brought into it.
//#include real

/// A number in [0, 1]; 0 where it is not a number.
fn bsdf_unit(x: f32) -> f32 {
    if (x > 0.0) {
        return min(x, 1.0);
    }
    return 0.0;
}

/// A colour whose channels are all in [0, 1]; black where it is not a number.
fn bsdf_color(c: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(bsdf_unit(c.x), bsdf_unit(c.y), bsdf_unit(c.z));
}

fn bsdf_positive_channel(x: f32) -> f32 {
    if (x > 0.0) {
        return min(x, 1e6);
    }
    return 0.0;
}

/// A colour without negative or infinite channels.
fn bsdf_positive(c: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(bsdf_positive_channel(c.x), bsdf_positive_channel(c.y), bsdf_positive_channel(c.z));
}

fn bsdf_max3(c: vec3<f32>) -> f32 {
    return max(max(c.x, c.y), c.z);
}

fn bsdf_mean3(c: vec3<f32>) -> f32 {
    return (c.x + c.y + c.z) * (1.0 / 3.0);
}

fn bsdf_is_black(c: vec3<f32>) -> bool {
    return c.x == 0.0 && c.y == 0.0 && c.z == 0.0;
}

/// Unit length, or z where there is no direction.
fn bsdf_normalize_or_z(v: vec3<f32>) -> vec3<f32> {
    let length_squared = dot(v, v);
    if (length_squared > 0.0 && real_is_finite(length_squared)) {
        return v * (1.0 / sqrt(length_squared));
    }
    return vec3<f32>(0.0, 0.0, 1.0);
}
