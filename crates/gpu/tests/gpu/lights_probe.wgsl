// What the shared part `lights` says at many points; textured lights have two halves by one texture coordinate.
//#include lights

struct Parameters {
    count: u32,
}

/// Point, normal, pick, u, a direction; instance, triangle and position of a hit.
const QUERY_WORDS: u32 = 17u;
/// wi, distance, radiance, pdf, flags, odds, environment, density of the direction, density of the hit.
const ANSWER_WORDS: u32 = 17u;

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> answers: array<u32>;
@group(0) @binding(2) var<storage, read> lights: array<u32>;
@group(0) @binding(3) var<storage, read> queries: array<u32>;
/// Two colours; texture coordinates of each triangle's corners.
@group(0) @binding(4) var<storage, read> texture: array<f32>;

fn textured_emission(instance: u32, prim: u32, weights: vec2<f32>) -> vec3<f32> {
    let at = 6u + 3u * prim;
    let u = texture[at] * (1.0 - weights.x - weights.y) + texture[at + 1u] * weights.x + texture[at + 2u] * weights.y;
    let half = select(0u, 3u, fract(u) >= 0.5);
    return vec3<f32>(texture[half], texture[half + 1u], texture[half + 2u]);
}

fn query_f32(at: u32) -> f32 {
    return bitcast<f32>(queries[at]);
}

fn query_vec3(at: u32) -> vec3<f32> {
    return vec3<f32>(query_f32(at), query_f32(at + 1u), query_f32(at + 2u));
}

fn answer(at: u32, value: f32) {
    answers[at] = bitcast<u32>(value);
}

fn answer_vec3(at: u32, value: vec3<f32>) {
    answer(at, value.x);
    answer(at + 1u, value.y);
    answer(at + 2u, value.z);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let query = id.x * QUERY_WORDS;
    let to = id.x * ANSWER_WORDS;
    let at = query_vec3(query);
    let normal = query_vec3(query + 3u);
    let wi = query_vec3(query + 9u);
    let u = vec2<f32>(query_f32(query + 7u), query_f32(query + 8u));
    let drawn = light_sample(at, normal, query_f32(query + 6u), u);
    answer_vec3(to, drawn.sample.wi);
    answer(to + 3u, drawn.sample.distance);
    answer_vec3(to + 4u, drawn.sample.radiance);
    answer(to + 7u, drawn.sample.pdf);
    answers[to + 8u] = drawn.sample.flags;
    answer_vec3(to + 9u, vec3<f32>(drawn.odds.local, drawn.odds.background, drawn.odds.sun));
    answer_vec3(to + 12u, light_environment(wi));
    answer(to + 15u, light_density_of_direction(drawn.odds, normal, wi));
    let position = query_vec3(query + 14u);
    let hit = light_density_of_hit(drawn.odds, at, normal, queries[query + 12u], queries[query + 13u], position);
    answer(to + 16u, hit);
}
