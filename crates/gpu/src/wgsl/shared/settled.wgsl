// Walks that settle every triangle: those seen so much edge-on that single precision does not say whether the ray meets them
// are tested in integers, as the CPU does in double precision. Slow, since every test has that code: for the few rays
// that walks of `unsettled` leave.
//#include wide_number

/// Whether the walk met what it cannot judge.
fn is_unsettled() -> bool {
    return false;
}

/// An edge function to the last bit, times a sign; zero where that is negative.
fn wide_edge(p: vec3<f32>, q: vec3<f32>, negative: bool) -> WideNumber {
    let left = wide_product(wide_of(p.x), wide_of(q.y));
    let right = wide_product(wide_of(p.y), wide_of(q.x));
    var area = wide_add(left, wide_minus(right));
    area.negative = area.negative != negative;
    if (area.negative) {
        return wide_zero();
    }
    return area;
}

/// The test of a triangle seen so much edge-on that the place which its weights name is off the ray.
fn triangle_again(ray: TriangleRay, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, negative: bool) -> vec4<f32> {
    var corners = array<vec3<f32>, 3>(a, b, c);
    var weights = array<WideNumber, 3>(
        wide_edge(corners[2], corners[1], negative),
        wide_edge(corners[0], corners[2], negative),
        wide_edge(corners[1], corners[0], negative),
    );
    let sum = wide_add(wide_add(weights[0], weights[1]), weights[2]);
    if (wide_is_zero(sum)) {
        return vec4<f32>(0.0);
    }
    let limit = wide_product(sum, wide_of(ray.tolerance));
    var places = array<WideNumber, 3>(wide_zero(), wide_zero(), wide_zero());
    for (var corner = 0u; corner < 3u; corner++) {
        for (var axis = 0u; axis < 3u; axis++) {
            places[axis] = wide_add(places[axis], wide_product(weights[corner], wide_of(corners[corner][axis])));
        }
    }
    if (wide_is_less(limit, places[0]) || wide_is_less(limit, places[1])) {
        return vec4<f32>(0.0);
    }
    let whole = wide_quotient(sum);
    let t = wide_to_f32(wide_product(places[2], whole)) * ray.shear.z;
    return vec4<f32>(1.0, t, wide_to_f32(wide_product(weights[1], whole)), wide_to_f32(wide_product(weights[2], whole)));
}
