// Lights at a place, in one tree, as in `vastlight-transport`, `light::local`. A light of that tree may stand for all
// triangles of an instance, which are in a tree of their own: one loop goes down both, since drivers inline every call.
//#include light_punctual
//#include light_surfaces

fn light_local_view(at: vec3<f32>, normal: vec3<f32>) -> LightView {
    return LightView(light_tree_at(LIGHT_TREE), at, normal, true);
}

/// Chooses a light and a point on it; `estimate` is that of `light_local_view`. The density does not include the choice
/// of local lights over others.
fn light_local_sample(
    estimate: LightEstimate,
    at: vec3<f32>,
    normal: vec3<f32>,
    pick: f32,
    u: vec2<f32>,
) -> LightSample {
    let surfaces = lights[LIGHT_SURFACE_COUNT];
    var view = light_local_view(at, normal);
    var expected = estimate;
    var rest = pick;
    var probability = 1.0;
    // The record of the light that stands for many; the number of the light, or of the triangle within.
    var surface = 0u;
    var number = 0u;
    loop {
        let choice = light_choose(view, expected, rest);
        probability *= choice.probability;
        number = choice.light;
        let deeper = surface == 0u && probability > 0.0 && number < surfaces && light_is_shared(light_surface(number));
        if (!deeper) {
            break;
        }
        surface = light_surface(number);
        view = light_object_view(surface, at, normal);
        expected = light_estimate(view);
        rest = choice.u;
    }
    if (!(probability > 0.0)) {
        return light_nothing();
    }
    if (surface == 0u && number >= surfaces) {
        return light_punctual_sample(number - surfaces, at, probability);
    }
    if (surface == 0u) {
        surface = light_surface(number);
    }
    return light_surface_sample(surface, number, at, u, probability);
}

/// Density over solid angle with which `light_local_sample` finds a point of a surface.
fn light_local_pdf(
    at: vec3<f32>,
    normal: vec3<f32>,
    instance: u32,
    prim: u32,
    position: vec3<f32>,
) -> f32 {
    let found = light_find(instance, prim);
    if (found.light == LIGHT_NONE) {
        return 0.0;
    }
    let surface = light_surface(found.light);
    var view = light_local_view(at, normal);
    var trail = lights[LIGHT_TRAILS] + 2u * found.light;
    var deeper = light_is_shared(surface);
    var probability = 1.0;
    loop {
        probability *= light_probability(view, light_estimate(view), trail);
        if (!deeper || !(probability > 0.0)) {
            break;
        }
        deeper = false;
        view = light_object_view(surface, at, normal);
        trail = lights[found.mesh + 8u] + 2u * found.number;
    }
    if (!(probability > 0.0)) {
        return 0.0;
    }
    return probability * light_triangle_pdf(light_triangle(surface, found.number), at, position);
}
