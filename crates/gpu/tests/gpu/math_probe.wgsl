// Answers of `real`, `frame` and `warp` for records of two numbers, two vectors and a point of the unit square.
//#include real
//#include frame
//#include warp

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> answers: array<f32>;
@group(0) @binding(2) var<storage, read> records: array<f32>;

const RECORD_WORDS: u32 = 10u;
const ANSWER_WORDS: u32 = 56u;

var<private> next_answer: u32;

fn put(x: f32) {
    answers[next_answer] = x;
    next_answer++;
}

fn put2(v: vec2<f32>) {
    put(v.x);
    put(v.y);
}

fn put3(v: vec3<f32>) {
    put2(v.xy);
    put(v.z);
}

fn put_frame(frame: Frame, v: vec3<f32>) {
    put3(frame.x);
    put3(frame.y);
    put3(frame_to_outer(frame, v));
    put3(frame_to_local(frame, v));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let at = id.x * RECORD_WORDS;
    next_answer = id.x * ANSWER_WORDS;
    let a = records[at];
    let b = records[at + 1u];
    let z = vec3<f32>(records[at + 2u], records[at + 3u], records[at + 4u]);
    let v = vec3<f32>(records[at + 5u], records[at + 6u], records[at + 7u]);
    let u = vec2<f32>(records[at + 8u], records[at + 9u]);
    put(real_sin(a));
    put(real_cos(a));
    put(real_exp(a));
    put(real_exp2(a));
    put(real_ln(abs(a)));
    put(real_pow(u.x, abs(b)));
    put(real_asin(b));
    put(real_acos(b));
    put(real_atan(a));
    put(real_atan2(a, b));
    put(real_copysign(a, b));
    put(select(0.0, 1.0, real_is_finite3(vec3<f32>(a, b, 1.0))));
    put_frame(frame_from_z(z), v);
    put_frame(frame_from_z_and_tangent(z, v), v);
    put2(warp_concentric_disk(u));
    put3(warp_cosine_hemisphere(u));
    put(warp_cosine_hemisphere_pdf(z.z));
    put3(warp_uniform_hemisphere(u));
    put3(warp_uniform_sphere(u));
    put3(warp_uniform_cone(u, abs(z.z)));
    put(warp_uniform_cone_pdf(1.0 + abs(b)));
    put2(warp_uniform_triangle(u));
    put(warp_tent(u.x));
    put(real_tan(0.25 * u.x));
}
