// Photons around points: irradiance, and a sum over what else is known of them; of each part of the photons an answer of its own.
//#include photon_gather

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> answers: array<f32>;
@group(0) @binding(2) var<storage, read> points: array<f32>;
@group(0) @binding(3) var<storage, read> photon_map: array<u32>;
@group(0) @binding(4) var<storage, read> voxels: array<vec2<u32>>;

/// Photons of a part: as many as `PHOTONS_AT_ONCE` of the renderer.
const PART: u32 = 60000u;

var<private> rest: f32;

fn of_near(near: Near) -> vec3<f32> {
    rest += near.weight * (dot(near.wi, near.normal) + f32(near.segments));
    return near.flux * near.weight;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i < parameters.count) {
        let count = arrayLength(&points) / 3u;
        let part = i / count * PART;
        gather_part = vec2<u32>(part, part + PART);
        let at = 3u * (i % count);
        let sum = gather(vec3<f32>(points[at], points[at + 1u], points[at + 2u]));
        for (var k = 0u; k < 3u; k++) {
            answers[4u * i + k] = sum[k];
        }
        answers[4u * i + 3u] = rest;
    }
}
