// All lights of a scene: the choice of one, and densities, as in `vastlight-transport`, `light`. Who includes this has
// `lights`, packed by `Lights::pack`, and defines `textured_emission`: see `light_surfaces`.
//#include light_environment
//#include light_local

/// Probabilities at a point of the groups whose light a ray can find by itself.
struct LightOdds {
    local: f32,
    background: f32,
    sun: f32,
}

struct LightAnswer {
    sample: LightSample,
    /// Zero where no light can reach the point.
    odds: LightOdds,
}

/// What the choice of a light at a point depends on.
struct LightWeights {
    odds: LightOdds,
    estimate: LightEstimate,
    /// 1 / the sum of all groups' weights; 0 where no light can reach the point.
    scale: f32,
}

fn light_weights(at: vec3<f32>, normal: vec3<f32>) -> LightWeights {
    let estimate = light_estimate(light_local_view(at, normal));
    let local = sqrt(estimate.total);
    let background = sqrt(light_background_estimate(normal));
    let sun = sqrt(light_sun_estimate(normal));
    let sum = local + background + sun + light_directional_total(normal);
    if (!(sum > 0.0)) {
        return LightWeights(LightOdds(0.0, 0.0, 0.0), estimate, 0.0);
    }
    let scale = 1.0 / sum;
    return LightWeights(LightOdds(local * scale, background * scale, sun * scale), estimate, scale);
}

/// Density over solid angle with which `light_sample` chooses a direction that leaves the scene.
fn light_density_of_direction(odds: LightOdds, normal: vec3<f32>, wi: vec3<f32>) -> f32 {
    var pdf = 0.0;
    if (odds.background > 0.0) {
        pdf += odds.background * light_background_pdf(normal, wi);
    }
    if (odds.sun > 0.0) {
        pdf += odds.sun * light_sun_pdf(wi);
    }
    return pdf;
}

/// Density over solid angle with which `light_sample` chooses the point `position` of a surface; 0 if that is no light.
fn light_density_of_hit(
    odds: LightOdds,
    at: vec3<f32>,
    normal: vec3<f32>,
    instance: u32,
    prim: u32,
    position: vec3<f32>,
) -> f32 {
    if (!(odds.local > 0.0)) {
        return 0.0;
    }
    return odds.local * light_local_pdf(at, normal, instance, prim, position);
}

fn light_from_infinity(odds: LightOdds, normal: vec3<f32>, wi: vec3<f32>) -> LightSample {
    if (light_is_zero(wi)) {
        return light_nothing();
    }
    let radiance = light_environment(wi);
    let pdf = light_density_of_direction(odds, normal, wi);
    if (light_is_zero(radiance) || !(pdf > 0.0)) {
        return light_nothing();
    }
    return LightSample(wi, LIGHT_FAR, radiance, pdf, LIGHT_VALID);
}

fn light_directional_sample(scale: f32, normal: vec3<f32>, pick: f32) -> LightSample {
    var rest = pick;
    var chosen = light_nothing();
    for (var i = 0u; i < lights[LIGHT_DIRECTIONAL_COUNT]; i++) {
        let light = light_directional(i);
        let p = sqrt(light_directional_estimate(light, normal)) * scale;
        if (p > 0.0) {
            let irradiance = light_vec3(light + 3u);
            chosen = LightSample(light_vec3(light), LIGHT_FAR, irradiance, p, LIGHT_VALID | LIGHT_DELTA);
            if (rest < p) {
                break;
            }
            rest -= p;
        }
    }
    return chosen;
}

/// Chooses a light and a direction to it. `normal` is the unit shading normal on the side from which the light is to
/// come, or zero if light from both sides counts; `pick` and `u` are uniform in [0, 1).
fn light_sample(at: vec3<f32>, normal: vec3<f32>, pick: f32, u: vec2<f32>) -> LightAnswer {
    let weights = light_weights(at, normal);
    let odds = weights.odds;
    if (!(weights.scale > 0.0)) {
        return LightAnswer(light_nothing(), odds);
    }
    if (pick < odds.local) {
        let within = min(pick / odds.local, LIGHT_BELOW_ONE);
        var sample = light_local_sample(weights.estimate, at, normal, within, u);
        sample.pdf *= odds.local;
        return LightAnswer(sample, odds);
    }
    let beyond_local = pick - odds.local;
    let beyond_background = beyond_local - odds.background;
    if (beyond_local < odds.background || beyond_background < odds.sun) {
        var wi = vec3<f32>(0.0);
        if (beyond_local < odds.background) {
            wi = light_background_sample(normal, u);
        } else {
            wi = light_sun_sample(u);
        }
        return LightAnswer(light_from_infinity(odds, normal, wi), odds);
    }
    let beyond_sun = beyond_background - odds.sun;
    return LightAnswer(light_directional_sample(weights.scale, normal, beyond_sun), odds);
}
