// Everything that leaves in all directions as in `vastlight-transport`, `bsdf::cosine`: diffuse light under the
// interface, and what single scattering at a rough interface loses (Kulla and Conty 2017).
//#include bsdf/albedo
//#include bsdf/interface

/// A mean loss below which there is nothing worth compensating.
const COSINE_SMALLEST_LOSS: f32 = 2e-3;

/// One side of the interface of a volume, or the only side of everything else.
struct CosineSide {
    /// Colour under the interface.
    diffuse: vec3<f32>,
    /// One over the mean share of light that reaches the base.
    over_base: f32,
    /// Share of a rough volume's loss that is reflected, and that is transmitted.
    volume_up: f32,
    volume_down: f32,
    /// One over the mean loss of the volume's surface, seen from this side.
    over_volume: f32,
}

struct Cosine {
    roughness: f32,
    /// Table axis of the reflection's curve, and of the refraction.
    contrast: f32,
    volume_contrast: f32,
    /// The inside is optically rarer than the outside: a bubble.
    rarer: bool,
    /// The dielectric's reflectance at normal incidence and at grazing, largest channel.
    ends: vec2<f32>,
    /// Largest channel of the light that the opaque dielectric reflects after several bounces.
    bounced: f32,
    /// Colour of the light that bounced several times: reflected, and passed through a thin wall.
    full_up: vec3<f32>,
    full_down: vec3<f32>,
    /// One over the mean loss of a reflector that absorbs nothing.
    over_full: f32,
    /// Colour of light that passes a volume's surface.
    transmitted: vec3<f32>,
    front: CosineSide,
    back: CosineSide,
    any: bool,
}

/// What the tables say about one direction: lost by a reflector that absorbs nothing; reaching the base below the
/// dielectric; lost at the surface of a volume; the rise of a bounce.
struct CosineLosses {
    full: f32,
    base: f32,
    volume: f32,
    rise: f32,
}

fn cosine_new(p: ptr<function, BsdfParams>, base: Interface) -> Cosine {
    var c: Cosine;
    let dielectric = 1.0 - base.reflectance.metallic;
    var transmission = 0.0;
    if (interface_transmits(base)) {
        transmission = bsdf_unit((*p).transmission);
    }
    c.roughness = ggx_mean_roughness(base.alpha);
    c.contrast = albedo_contrast(reflectance_table_ior(base.reflectance, base.ior));
    c.volume_contrast = albedo_contrast(base.ior);
    c.rarer = base.ior < 1.0;
    let ends = reflectance_dielectric_ends(base.reflectance, base.ior);
    c.ends = vec2<f32>(bsdf_max3(ends.xyz), ends.w);
    let rise = albedo_bounce_average(false, c.contrast, 0.0).x;
    let average = ends.xyz + (vec3<f32>(ends.w) - ends.xyz) * rise;
    let loss = 1.0 - albedo_full_average(c.roughness);
    let compensate = loss > COSINE_SMALLEST_LOSS;
    let metal_average = reflectance_metal_average(base.reflectance);
    let metal = cosine_several_bounces(metal_average, loss) * base.reflectance.metallic;
    let bounced = cosine_several_bounces(average, loss);
    let opaque = 1.0 - transmission;
    let wall = select(0.0, 1.0, base.thin);
    if (compensate) {
        c.bounced = bsdf_max3(bounced);
        c.over_full = 1.0 / loss;
    }
    c.full_up = metal + (bounced * opaque + average * (transmission * wall)) * dielectric;
    c.full_down = base.transmitted * (wall * dielectric * (1.0 - bsdf_max3(average)));
    c.transmitted = base.transmitted * dielectric;
    let diffuse = bsdf_color((*p).base_color) * (dielectric * opaque);
    c.any = compensate || !bsdf_is_black(diffuse);
    c.front.diffuse = diffuse;
    c.front.over_base = cosine_over_base_average(c, false);
    if (interface_refracts(base)) {
        c.back.diffuse = diffuse;
        c.back.over_base = cosine_over_base_average(c, true);
        if (compensate) {
            // The tables know neither films nor stretched highlights: there, what is lost stays lost.
            var plain = 0.0;
            if (base.alpha.x == base.alpha.y) {
                plain = reflectance_plainness(base.reflectance);
            }
            c.transmitted *= plain;
            cosine_split_volume_loss(&c, base.ior, transmission * dielectric * plain);
        }
    }
    return c;
}

/// Shares the losses of a rough volume's surface out between its sides, so that both directions through it agree.
fn cosine_split_volume_loss(c: ptr<function, Cosine>, ior: f32, weight: f32) {
    let front = albedo_bounce_average((*c).rarer, (*c).volume_contrast, (*c).roughness).y;
    let back = albedo_bounce_average(!(*c).rarer, (*c).volume_contrast, (*c).roughness).y;
    if (min(front, back) < 0.1 * COSINE_SMALLEST_LOSS) {
        return;
    }
    let through = 1.0 - (*c).ends.x;
    let ratio = ior * ior * back / front;
    let enters = through * min(ratio, 1.0);
    let leaves = through / max(ratio, 1.0);
    (*c).front.volume_up = weight * (1.0 - enters);
    (*c).front.volume_down = enters;
    (*c).front.over_volume = 1.0 / front;
    (*c).back.volume_up = weight * (1.0 - leaves);
    (*c).back.volume_down = leaves;
    (*c).back.over_volume = 1.0 / back;
}

fn cosine_side(c: Cosine, inside: bool) -> CosineSide {
    if (inside) {
        return c.back;
    }
    return c.front;
}

/// One over the mean share of light that reaches the base; 0 where nothing does.
fn cosine_over_base_average(c: Cosine, inside: bool) -> f32 {
    let dense = inside != c.rarer;
    let rise = albedo_bounce_average(dense, c.contrast, c.roughness).x;
    let average = cosine_reaches_base(c, albedo_full_average(c.roughness), rise, dense);
    if (average > 1e-3) {
        return 1.0 / average;
    }
    return 0.0;
}

/// What the dielectric does not reflect, of a direction whose full albedo and rise are given; `dense`: on the optically
/// denser side, where total internal reflection is total.
fn cosine_reaches_base(c: Cosine, full: f32, rise: f32, dense: bool) -> f32 {
    let f90 = select(c.ends.y, 1.0, dense);
    return max(1.0 - c.ends.x * (full - rise) - f90 * rise - c.bounced * (1.0 - full), 0.0);
}

/// Looks up a direction; `inside`: the side it is on.
fn cosine_losses(c: Cosine, w: vec3<f32>, inside: bool, base: Interface) -> CosineLosses {
    if (!c.any) {
        return CosineLosses(0.0, 0.0, 0.0, 0.0);
    }
    let cos_theta = abs(w.z);
    let is_delta = ggx_is_delta(base.alpha);
    let dense = inside != c.rarer;
    var roughness = 0.0;
    var full = 1.0;
    if (!is_delta) {
        roughness = ggx_roughness_from(base.alpha, w);
        full = albedo_full(cos_theta, roughness);
    }
    let bounce = albedo_bounce(dense, c.contrast, cos_theta, roughness);
    let reaches = cosine_reaches_base(c, full, bounce.x, dense);
    if (is_delta) {
        // A smooth interface loses nothing, and what it lets pass is known exactly; a film's mean comes from a bound,
        // which must then hold for every direction.
        let passed = interface_passed_to_base(base, cos_theta, inside);
        return CosineLosses(0.0, select(passed, min(passed, reaches), base.reflectance.film.weight > 0.0), 0.0, 0.0);
    }
    var loss = bounce.y;
    if (c.contrast != c.volume_contrast) {
        loss = albedo_bounce(dense, c.volume_contrast, cos_theta, roughness).y;
    }
    return CosineLosses(1.0 - full, reaches, loss, bounce.x);
}

/// Mean energy that goes up and down, of light from a direction on the side `inside`.
fn cosine_shares(c: Cosine, out: CosineLosses, inside: bool) -> vec2<f32> {
    let side = cosine_side(c, inside);
    let full = select(0.0, out.full, c.over_full > 0.0);
    let up = c.full_up * full + side.diffuse * out.base + vec3<f32>(side.volume_up * out.volume);
    let down = c.full_down * full + c.transmitted * (side.volume_down * out.volume);
    return vec2<f32>(bsdf_mean3(up), bsdf_mean3(down));
}

/// `f * cos` towards a direction, up or down, without the factor for radiance in a denser medium.
fn cosine_evaluate(c: Cosine, out: CosineLosses, into: CosineLosses, wi: vec3<f32>, inside: bool) -> vec3<f32> {
    let side = cosine_side(c, inside);
    let full = out.full * into.full * c.over_full;
    let volume = out.volume * into.volume;
    var f = c.full_up * full
        + side.diffuse * (out.base * into.base * side.over_base)
        + vec3<f32>(side.volume_up * volume * side.over_volume);
    if (!(wi.z > 0.0)) {
        let over_far = select(c.back.over_volume, c.front.over_volume, inside);
        f = c.full_down * full + c.transmitted * (side.volume_down * volume * over_far);
    }
    return f * (abs(wi.z) * OVER_PI);
}

/// Share reflected by several bounces between microfacets of this mean reflectance, of the share `loss` that does not
/// leave after one.
fn cosine_several_bounces(average: vec3<f32>, loss: f32) -> vec3<f32> {
    return average * average * (1.0 - loss) / (vec3<f32>(1.0) - average * loss);
}
