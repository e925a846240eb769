// Walks that leave rays unsettled which meet what is dear to judge: triangles seen so much edge-on that single precision does
// not say whether the ray meets them, and surfaces that rays may pass. Most rays meet neither, and their walk is
// short and needs few registers; the others walk again with the parts `settled` and `veils`.

var<private> unsettled: bool = false;

/// Whether the walk met what it cannot judge.
fn is_unsettled() -> bool {
    return unsettled;
}

fn triangle_again(ray: TriangleRay, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, negative: bool) -> vec4<f32> {
    unsettled = true;
    return vec4<f32>(0.0);
}

fn accepts(hit: Hit, veiled: bool) -> bool {
    unsettled = unsettled || veiled;
    return !veiled;
}
