// A sample of a light as in `vastlight-transport`, `light`.

/// There is a sample.
const LIGHT_VALID: u32 = 1u;
/// The light is a point or a direction, which no other ray finds by itself.
const LIGHT_DELTA: u32 = 2u;

/// Light that reaches a point from one direction, if nothing is in the way.
struct LightSample {
    /// Unit vector towards the light.
    wi: vec3<f32>,
    /// LIGHT_FAR for light from infinity.
    distance: f32,
    /// What arrives from there, times the emitting point's coverage; of a delta light the irradiance on a plane that
    /// faces it.
    radiance: vec3<f32>,
    /// Over solid angle, the choice of the light included; of a delta light the probability of the choice.
    pdf: f32,
    flags: u32,
}

/// No sample: black.
fn light_nothing() -> LightSample {
    return LightSample(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), 0.0, 0u);
}
