// All emissive triangles, times instances, as in `vastlight-transport`, `light::surfaces`. Who includes this defines
// `textured_emission(instance, prim, weights)`: the radiance times the coverage of a point of a triangle, by the weights
// of its second and third corner.
//#include light_sample
//#include light_tree
//#include light_triangle

/// The triangle in the world, radiance, kind.
const LIGHT_SURFACE_WORDS: u32 = 16u;
const LIGHT_ONE_SIDED: u32 = 0u;
const LIGHT_BOTH_SIDES: u32 = 1u;
/// Instance, triangle and whether both sides shine in place of the radiance.
const LIGHT_TEXTURED: u32 = 2u;
/// Stands for all triangles of an instance with a shared tree: map, mesh, instance, flags, kind.
const LIGHT_SHARED: u32 = 3u;

/// Flags of such an instance: the map keeps angles; it mirrors.
const LIGHT_SIMILAR: u32 = 1u;
const LIGHT_MIRRORED: u32 = 2u;

/// First instance, end of instances, first light, emissive triangles; runs, how many; shared tree, its trails (0 where
/// there is none), its triangles' corners.
const LIGHT_MESH_WORDS: u32 = 10u;
/// First triangle, how many, emissive triangles before; flags, radiance.
const LIGHT_RUN_WORDS: u32 = 7u;
const LIGHT_RUN_TWO_SIDED: u32 = 1u;
const LIGHT_RUN_CONSTANT: u32 = 2u;

/// What a triangle of the scene is as a light.
struct LightFound {
    /// LIGHT_NONE if it is none.
    light: u32,
    /// Its mesh's record.
    mesh: u32,
    /// Its number among the mesh's emissive ones.
    number: u32,
}

/// How many of `count` records of `stride` words have, at the word `at` of the first, a number that is at most `x`.
fn light_partition(at: u32, stride: u32, count: u32, x: u32) -> u32 {
    var first = 0u;
    var end = count;
    while (first < end) {
        let middle = (first + end) / 2u;
        if (lights[at + middle * stride] <= x) {
            first = middle + 1u;
        } else {
            end = middle;
        }
    }
    return first;
}

/// The light that a triangle belongs to.
fn light_find(instance: u32, prim: u32) -> LightFound {
    let none = LightFound(LIGHT_NONE, 0u, 0u);
    let meshes = lights[LIGHT_MESHES];
    let after = light_partition(meshes, LIGHT_MESH_WORDS, lights[LIGHT_MESH_COUNT], instance);
    if (after == 0u) {
        return none;
    }
    let mesh = meshes + (after - 1u) * LIGHT_MESH_WORDS;
    let runs = light_partition(lights[mesh + 4u], LIGHT_RUN_WORDS, lights[mesh + 5u], prim);
    if (instance >= lights[mesh + 1u] || runs == 0u) {
        return none;
    }
    let run = lights[mesh + 4u] + (runs - 1u) * LIGHT_RUN_WORDS;
    let offset = prim - lights[run];
    if (offset >= lights[run + 1u]) {
        return none;
    }
    let number = lights[run + 2u] + offset;
    let place = instance - lights[mesh];
    let flat_light = place * lights[mesh + 3u] + number;
    return LightFound(lights[mesh + 2u] + select(place, flat_light, lights[mesh + 8u] == 0u), mesh, number);
}

/// What `light` is, as the word of its record.
fn light_surface(light: u32) -> u32 {
    return lights[LIGHT_SURFACES] + light * LIGHT_SURFACE_WORDS;
}

fn light_linear(surface: u32) -> mat3x3<f32> {
    return mat3x3<f32>(light_vec3(surface), light_vec3(surface + 3u), light_vec3(surface + 6u));
}

/// The shared tree of an instance's mesh, asked from a point in the world.
fn light_object_view(surface: u32, at: vec3<f32>, normal: vec3<f32>) -> LightView {
    let m = light_linear(surface);
    let p = at - light_vec3(surface + 9u);
    let across = cross(m[1], m[2]);
    let inside = vec3<f32>(dot(across, p), dot(cross(m[2], m[0]), p), dot(cross(m[0], m[1]), p)) / dot(m[0], across);
    let tree = light_tree_at(lights[surface + 12u] + 6u);
    let similar = (lights[surface + 14u] & LIGHT_SIMILAR) != 0u;
    return LightView(tree, inside, light_unit_or_zero(normal * m), similar);
}

/// The emissive triangle `number` of an instance with a shared tree.
fn light_placed(surface: u32, number: u32) -> LightTriangle {
    let corners = lights[lights[surface + 12u] + 9u] + number * 9u;
    let m = light_linear(surface);
    let translation = light_vec3(surface + 9u);
    let a = m * light_vec3(corners) + translation;
    let b = m * light_vec3(corners + 3u) + translation;
    let c = m * light_vec3(corners + 6u) + translation;
    let front = select(1.0, -1.0, (lights[surface + 14u] & LIGHT_MIRRORED) != 0u);
    return LightTriangle(a, b - a, c - a, cross(b - a, c - a) * front);
}

fn light_is_shared(surface: u32) -> bool {
    return lights[surface + 15u] == LIGHT_SHARED;
}

/// The triangle of a light; of one that stands for many, that of this number.
fn light_triangle(surface: u32, number: u32) -> LightTriangle {
    if (light_is_shared(surface)) {
        return light_placed(surface, number);
    }
    return light_triangle_at(surface);
}

/// How a triangle shines.
struct LightShine {
    radiance: vec3<f32>,
    /// The radiance must be looked up instead.
    textured: bool,
    two_sided: bool,
    instance: u32,
    prim: u32,
}

fn light_shared_shine(surface: u32, number: u32) -> LightShine {
    let mesh = lights[surface + 12u];
    let runs = lights[mesh + 4u];
    let after = light_partition(runs + 2u, LIGHT_RUN_WORDS, lights[mesh + 5u], number);
    let run = runs + (after - 1u) * LIGHT_RUN_WORDS;
    let flags = lights[run + 3u];
    let prim = lights[run] + (number - lights[run + 2u]);
    let textured = (flags & LIGHT_RUN_CONSTANT) == 0u;
    let two_sided = (flags & LIGHT_RUN_TWO_SIDED) != 0u;
    return LightShine(light_vec3(run + 4u), textured, two_sided, lights[surface + 13u], prim);
}

fn light_shine(surface: u32, number: u32) -> LightShine {
    let kind = lights[surface + 15u];
    if (kind == LIGHT_SHARED) {
        return light_shared_shine(surface, number);
    }
    if (kind == LIGHT_TEXTURED) {
        let two_sided = lights[surface + 14u] != 0u;
        return LightShine(vec3<f32>(0.0), true, two_sided, lights[surface + 12u], lights[surface + 13u]);
    }
    return LightShine(light_vec3(surface + 12u), false, kind == LIGHT_BOTH_SIDES, 0u, 0u);
}

/// A point of the chosen triangle.
fn light_surface_sample(surface: u32, number: u32, at: vec3<f32>, u: vec2<f32>, probability: f32) -> LightSample {
    let shine = light_shine(surface, number);
    let triangle = light_triangle(surface, number);
    if (!shine.two_sided && !light_faces(triangle, at)) {
        return light_nothing();
    }
    let point = light_triangle_sample(triangle, at, u);
    if (!(point.pdf > 0.0)) {
        return light_nothing();
    }
    var radiance = shine.radiance;
    if (shine.textured) {
        radiance = textured_emission(shine.instance, shine.prim, point.weights);
    }
    if (light_is_zero(radiance)) {
        return light_nothing();
    }
    return LightSample(point.wi, point.distance, radiance, point.pdf * probability, LIGHT_VALID);
}
