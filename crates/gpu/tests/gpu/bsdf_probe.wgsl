// Everything that `bsdf` answers, for records of a material, two directions and random numbers.
//#include bsdf

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> answers: array<f32>;
@group(0) @binding(2) var<storage, read> records: array<f32>;
@group(0) @binding(3) var<storage, read> tables: array<u32>;

const RECORD_WORDS: u32 = 52u;
const ANSWER_WORDS: u32 = 20u;

var<private> next_word: u32;

fn take() -> f32 {
    let word = records[next_word];
    next_word++;
    return word;
}

fn take2() -> vec2<f32> {
    let x = take();
    return vec2<f32>(x, take());
}

fn take3() -> vec3<f32> {
    let xy = take2();
    return vec3<f32>(xy, take());
}

fn take_params() -> BsdfParams {
    var p: BsdfParams;
    p.base_color = take3();
    p.metallic = take();
    p.roughness = take();
    p.ior = take();
    p.specular = take();
    p.specular_color = take3();
    p.transmission = take();
    p.transmission_tint = take3();
    p.thin = take() > 0.0;
    p.dispersion = take();
    p.clearcoat = take();
    p.clearcoat_roughness = take();
    p.clearcoat_normal = take3();
    p.sheen_color = take3();
    p.sheen_roughness = take();
    p.anisotropy = take();
    p.anisotropy_direction = take2();
    p.iridescence = take();
    p.iridescence_ior = take();
    p.iridescence_thickness = take();
    p.conductor = take() > 0.0;
    p.conductor_eta = take3();
    p.conductor_k = take3();
    p.conductor_average = take3();
    return p;
}

fn put(at: u32, v: vec4<f32>) {
    answers[at] = v.x;
    answers[at + 1u] = v.y;
    answers[at + 2u] = v.z;
    answers[at + 3u] = v.w;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    next_word = id.x * RECORD_WORDS;
    var p = take_params();
    let wo = take3();
    let wi = take3();
    let lobe = take();
    let u = take2();
    let wavelength = take();
    let dispersed = take() > 0.0;
    if (wavelength >= 0.0) {
        wavelength_apply(wavelength, dispersed, &p);
    }
    let bsdf = bsdf_new(p);
    let s = bsdf_sample(bsdf, wo, lobe, u);
    let at = id.x * ANSWER_WORDS;
    put(at, bsdf_eval_pdf(bsdf, wo, wi));
    put(at + 4u, vec4<f32>(s.wi, s.pdf));
    put(at + 8u, vec4<f32>(s.weight, s.radiance_scale));
    var is = s.flags;
    is |= select(0u, 16u, bsdf_is_pane(bsdf));
    is |= select(0u, 32u, bsdf_has_nondelta(bsdf));
    is |= select(0u, 64u, bsdf_transmits(bsdf));
    put(at + 12u, vec4<f32>(bsdf_straight(bsdf, wo), f32(is)));
    put(at + 16u, vec4<f32>(bsdf_albedo(bsdf), 0.0));
}
