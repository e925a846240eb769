// The general material as in `vastlight-transport`, `bsdf::layered`, from the top: clear coat, sheen, interface, and
// what leaves in all directions below it. A layer lets pass what it does not reflect, the smaller of the shares of both
// directions; one lobe is chosen by its estimated albedo, the density is that of the mixture.
//#include warp
//#include bsdf/coat
//#include bsdf/cosine
//#include bsdf/sheen

struct Layered {
    base: Interface,
    cosine: Cosine,
    coat: Coat,
    sheen: Sheen,
    /// The local x axis seen from the highlight's own axes: cosine and sine of its rotation.
    rotation: vec2<f32>,
    albedo: vec3<f32>,
}

/// Probabilities of the lobes; they sum to 1.
struct LayeredChances {
    coat: f32,
    sheen: f32,
    base: f32,
    up: f32,
    down: f32,
}

/// Shares of light that coat and sheen let pass.
struct LayeredPassed {
    coat: f32,
    sheen: f32,
}

/// The side that `wo` is on, and what depends on `wo` alone.
struct LayeredOut {
    valid: bool,
    /// In the highlight's axes, with `z > 0`.
    wo: vec3<f32>,
    mirrored: bool,
    /// In the volume; everything else is outside, whichever side it is seen from.
    inside: bool,
    eta: f32,
    coat: Coat,
    losses: CosineLosses,
    passed: LayeredPassed,
    chances: LayeredChances,
}

const LOBE_NONE: u32 = 0u;
const LOBE_BASE: u32 = 1u;
const LOBE_UP: u32 = 2u;
const LOBE_DOWN: u32 = 3u;
const LOBE_COAT: u32 = 4u;
const LOBE_SHEEN: u32 = 5u;

/// A lobe, and the rest of the number that chose it.
struct LayeredLobe {
    lobe: u32,
    rest: f32,
}

/// A direction drawn: in the highlight's axes, its value and density; a mirror-like one has a weight in place of both.
struct LayeredDrawn {
    valid: bool,
    is_delta: bool,
    wi: vec3<f32>,
    weight: vec3<f32>,
    pdf: f32,
}

/// The direction in axes that are rotated by the angle of this cosine and sine.
fn layered_rotate(rotation: vec2<f32>, w: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(w.x * rotation.x + w.y * rotation.y, w.y * rotation.x - w.x * rotation.y, w.z);
}

fn layered_new(p: ptr<function, BsdfParams>) -> Layered {
    var s: Layered;
    s.base = interface_new(p);
    s.rotation = vec2<f32>(1.0, 0.0);
    let direction = (*p).anisotropy_direction;
    let length_squared = dot(direction, direction);
    if ((*p).anisotropy > 0.0 && length_squared > 0.0 && real_is_finite(length_squared)) {
        s.rotation = direction * (1.0 / sqrt(length_squared));
    }
    s.cosine = cosine_new(p, s.base);
    let coat_normal = layered_rotate(s.rotation, (*p).clearcoat_normal);
    s.coat = coat_new((*p).clearcoat, (*p).clearcoat_roughness, coat_normal);
    s.sheen = sheen_new((*p).sheen_color, (*p).sheen_roughness);
    let r = s.base.reflectance;
    let dielectric = bsdf_color((*p).base_color) + r.f0;
    s.albedo = bsdf_color(dielectric + (r.metal_f0 - dielectric) * r.metallic);
    return s;
}

fn layered_local(s: Layered, w: vec3<f32>, mirrored: bool) -> vec3<f32> {
    let turned = layered_rotate(s.rotation, w);
    return vec3<f32>(turned.xy, select(turned.z, -turned.z, mirrored));
}

fn layered_outer(s: Layered, w: vec3<f32>, mirrored: bool) -> vec3<f32> {
    let unmirrored = vec3<f32>(w.xy, select(w.z, -w.z, mirrored));
    return layered_rotate(vec2<f32>(s.rotation.x, -s.rotation.y), unmirrored);
}

fn layered_out(s: Layered, wo: vec3<f32>) -> LayeredOut {
    var out: LayeredOut;
    out.valid = wo.z != 0.0 && real_is_finite3(wo);
    if (!out.valid) {
        return out;
    }
    out.mirrored = wo.z < 0.0;
    out.inside = out.mirrored && interface_refracts(s.base);
    out.coat = s.coat;
    if (out.mirrored) {
        out.coat.normal = vec3<f32>(-s.coat.normal.xy, s.coat.normal.z);
    }
    out.wo = layered_local(s, wo, out.mirrored);
    out.eta = interface_eta(s.base, out.inside);
    out.losses = cosine_losses(s.cosine, out.wo, out.inside, s.base);
    out.passed = layered_passed(s, out.coat, out.inside, out.wo);
    out.chances = layered_chances(s, out);
    return out;
}

/// What coat and sheen let pass for a direction: they lie on the outside of a volume, and on both sides of a wall.
fn layered_passed(s: Layered, coat: Coat, inside: bool, w: vec3<f32>) -> LayeredPassed {
    var passed = LayeredPassed(1.0, 1.0);
    if (!interface_refracts(s.base) || (w.z < 0.0) == inside) {
        passed.coat = 1.0 - coat_reflected(coat, w);
        if (s.sheen.strength > 0.0) {
            passed.sheen = 1.0 - s.sheen.strength * min(sheen_albedo(abs(w.z), s.sheen.roughness), 1.0);
        }
    }
    return passed;
}

fn layered_chances(s: Layered, out: LayeredOut) -> LayeredChances {
    var chances = LayeredChances(0.0, 0.0, 0.0, 0.0, 0.0);
    if (!out.inside) {
        chances.coat = 1.0 - out.passed.coat;
        if (s.sheen.strength > 0.0) {
            // What does not pass the sheen is its albedo times the largest channel of its colour.
            let reflected = (1.0 - out.passed.sheen) / s.sheen.strength;
            chances.sheen = out.passed.coat * reflected * bsdf_mean3(s.sheen.color);
        }
    }
    let below = out.passed.coat * out.passed.sheen;
    let shares = cosine_shares(s.cosine, out.losses, out.inside);
    chances.base = below * layered_base_share(s, out);
    chances.up = below * shares.x;
    chances.down = below * shares.y;
    let sum = chances.coat + chances.sheen + chances.base + chances.up + chances.down;
    var scale = 0.0;
    if (sum > 0.0 && real_is_finite(sum)) {
        scale = 1.0 / sum;
    }
    return LayeredChances(
        chances.coat * scale,
        chances.sheen * scale,
        chances.base * scale,
        chances.up * scale,
        chances.down * scale,
    );
}

/// Estimated share of light that the interface reflects or transmits after one bounce.
fn layered_base_share(s: Layered, out: LayeredOut) -> f32 {
    let r = s.base.reflectance;
    let transmitted = bsdf_mean3(s.base.transmitted);
    if (ggx_is_delta(s.base.alpha) || !s.cosine.any || r.film.weight > 0.0) {
        let at = reflectance_at(r, out.wo.z, out.eta);
        return bsdf_mean3(at.reflected) + transmitted * at.passed;
    }
    // A rough interface has microfacets that face the light: less Fresnel rise than a mirror at grazing angles.
    let level = 1.0 - out.losses.full - out.losses.rise;
    let metal = bsdf_mean3(r.metal_f0) * level + out.losses.rise;
    let dielectric = bsdf_mean3(r.f0) * level + r.f90 * out.losses.rise;
    let passed = max(1.0 - out.losses.full - dielectric, 0.0) * transmitted;
    return r.metallic * metal + (1.0 - r.metallic) * (dielectric + passed);
}

/// `f * cos` and (w) the density; `wi` in the highlight's axes.
fn layered_evaluate(s: Layered, out: LayeredOut, wi: vec3<f32>) -> vec4<f32> {
    if (wi.z == 0.0) {
        return vec4<f32>(0.0);
    }
    let up = wi.z > 0.0;
    var value = interface_evaluate(s.base, out.wo, wi, out.eta);
    value.w *= out.chances.base;
    let chance = select(out.chances.down, out.chances.up, up);
    if (chance > 0.0) {
        let into_inside = out.inside != (!up && interface_refracts(s.base));
        let into = cosine_losses(s.cosine, wi, into_inside, s.base);
        let f = cosine_evaluate(s.cosine, out.losses, into, wi, out.inside);
        let scale = interface_radiance_scale(s.base, out.eta, wi);
        value += vec4<f32>(f / scale, chance * warp_cosine_hemisphere_pdf(abs(wi.z)));
    }
    if (s.coat.weight > 0.0 || s.sheen.strength > 0.0) {
        value = layered_cover(s, out, wi, value);
    }
    return value;
}

/// Lays sheen and coat over the base.
fn layered_cover(s: Layered, out: LayeredOut, wi: vec3<f32>, below: vec4<f32>) -> vec4<f32> {
    let passed = layered_passed(s, out.coat, out.inside, wi);
    let above = wi.z > 0.0 && !out.inside;
    var f = below.xyz * min(out.passed.sheen, passed.sheen);
    var pdf = below.w;
    if (above && s.sheen.strength > 0.0) {
        f += sheen_evaluate(s.sheen, out.wo, wi);
        pdf += out.chances.sheen * (OVER_PI * 0.5);
    }
    f *= min(out.passed.coat, passed.coat);
    if (above && s.coat.weight > 0.0) {
        let coat = coat_evaluate(out.coat, out.wo, wi);
        f += vec3<f32>(coat.x);
        pdf += out.chances.coat * coat.y;
    }
    return vec4<f32>(f, pdf);
}

fn layered_eval_pdf(s: Layered, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    let out = layered_out(s, wo);
    if (!out.valid) {
        return vec4<f32>(0.0);
    }
    return layered_evaluate(s, out, layered_local(s, wi, out.mirrored));
}

/// The lobe at `u`, in this order; none if no lobe has a chance.
fn layered_choose(chances: LayeredChances, u: f32) -> LayeredLobe {
    var order = array<f32, 5>(chances.base, chances.up, chances.down, chances.coat, chances.sheen);
    var start = 0.0;
    var chosen = LayeredLobe(LOBE_NONE, 1.0 - 1.1920929e-7);
    for (var i = 0u; i < 5u; i++) {
        let chance = order[i];
        if (chance > 0.0) {
            chosen.lobe = i + LOBE_BASE;
            if (u < start + chance) {
                chosen.rest = min(bsdf_unit((u - start) / chance), 1.0 - 1.1920929e-7);
                return chosen;
            }
            start += chance;
        }
    }
    return chosen;
}

fn layered_sample(s: Layered, out: LayeredOut, u_lobe: f32, u: vec2<f32>) -> LayeredDrawn {
    var drawn: LayeredDrawn;
    let chosen = layered_choose(out.chances, u_lobe);
    drawn.valid = out.valid && chosen.lobe != LOBE_NONE;
    switch chosen.lobe {
        case LOBE_COAT: {
            drawn.wi = coat_sample(out.coat, out.wo, u);
            drawn.valid = drawn.valid && drawn.wi.z > 0.0;
            drawn.is_delta = ggx_is_delta(out.coat.alpha);
            // Of the coat, as much as the rest lets not pass.
            drawn.weight = vec3<f32>((1.0 - out.passed.coat) / out.chances.coat);
        }
        case LOBE_SHEEN: {
            drawn.wi = warp_uniform_hemisphere(u);
        }
        case LOBE_BASE: {
            let of_base = interface_sample(s.base, out.wo, out.eta, chosen.rest, u);
            drawn.valid = drawn.valid && of_base.valid;
            drawn.wi = of_base.wi;
            drawn.is_delta = ggx_is_delta(s.base.alpha);
            if (drawn.is_delta) {
                drawn.weight = of_base.weight * (layered_covered(s, out, drawn.wi) / out.chances.base);
            }
        }
        default: {
            drawn.wi = warp_cosine_hemisphere(u) * select(1.0, -1.0, chosen.lobe == LOBE_DOWN);
        }
    }
    if (drawn.valid && !drawn.is_delta) {
        let value = layered_evaluate(s, out, drawn.wi);
        drawn.pdf = value.w;
        drawn.valid = value.w > 0.0;
        drawn.weight = value.xyz / max(value.w, REAL_MIN_POSITIVE);
    }
    drawn.valid = drawn.valid && bsdf_max3(drawn.weight) > 0.0 && real_is_finite3(drawn.weight);
    return drawn;
}

/// What coat and sheen leave of light on its way between `wo` and `wi`.
fn layered_covered(s: Layered, out: LayeredOut, wi: vec3<f32>) -> f32 {
    let passed = layered_passed(s, out.coat, out.inside, wi);
    return min(out.passed.coat, passed.coat) * min(out.passed.sheen, passed.sheen);
}

/// Whether the surface is a smooth thin wall that light goes straight through.
fn layered_is_pane(s: Layered) -> bool {
    return s.base.thin && interface_transmits(s.base) && ggx_is_delta(s.base.alpha);
}

/// Share of light that goes on straight through a pane; zero for anything else.
fn layered_straight(s: Layered, wo: vec3<f32>) -> vec3<f32> {
    if (!layered_is_pane(s)) {
        return vec3<f32>(0.0);
    }
    let out = layered_out(s, wo);
    if (!out.valid) {
        return vec3<f32>(0.0);
    }
    let split = reflectance_at(s.base.reflectance, out.wo.z, out.eta);
    return s.base.transmitted * (split.passed * layered_covered(s, out, -out.wo));
}
