//! What sums are sums of: the names and values that must agree when they are taken up again, or added to others.

use crate::fingerprint::fingerprint;
use crate::{Error, OpenScene, RenderRequest};
use vastlight_film::{Aov, Recipe};
use vastlight_transport::RenderSettings;

/// The recipe of a request on the graphics processor of this name, or on the CPU. What does not change a bit is not in it: threads,
/// memory, structures, the number of samples.
pub(crate) fn recipe(
    open: &OpenScene,
    request: &RenderRequest,
    adapter: Option<&str>,
) -> Result<Recipe, Error> {
    let RenderSettings {
        width,
        height,
        // The film says which part it is.
        crop: _,
        camera,
        camera_keys,
        integrator,
        max_depth,
        russian_roulette,
        seed,
        filter,
        direct_sampling,
        caustics,
        ao_distance,
    } = &request.settings;
    let aovs = Aov::ALL.into_iter().filter(|aov| request.aovs.contains(aov));
    let aovs: Vec<&str> = aovs.map(Aov::name).collect();
    Ok(Recipe::default()
        .with("program", env!("CARGO_PKG_VERSION"))
        .with("scene", fingerprint(open)?)
        .with("size", format!("{width} x {height}"))
        .with("seed", seed)
        .with("integrator", format!("{integrator:?}"))
        .with("depth", max_depth)
        .with("device", adapter.unwrap_or("cpu"))
        .with("auxiliary outputs", if aovs.is_empty() { "none".into() } else { aovs.join(" ") })
        .with("noise", request.noise.map_or_else(|| "none".into(), |noise| noise.to_string()))
        .with("camera", format!("{camera:?}"))
        .with("shutter", format!("{camera_keys:?}"))
        .with("filter", format!("{filter:?}"))
        .with("roulette", russian_roulette)
        .with("light sampling", format!("{direct_sampling:?}"))
        .with("photons", format!("{caustics:?}"))
        .with("occlusion distance", ao_distance))
}
