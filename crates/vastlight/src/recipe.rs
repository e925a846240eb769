//! What sums are sums of: the names and values that must agree when they are taken up again, or added to others.

use crate::fingerprint::fingerprint;
use crate::{Error, OpenScene, RenderRequest};
use vastlight_film::{Aov, Recipe};
use vastlight_transport::{RenderSettings, Tile};

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
    let Tile { min, max } = request.settings.region();
    let aovs = Aov::ALL.into_iter().filter(|aov| request.aovs.contains(aov));
    let aovs: Vec<&str> = aovs.map(Aov::name).collect();
    Ok(Recipe::default()
        .with("program", env!("CARGO_PKG_VERSION"))
        .with("scene", fingerprint(open)?)
        .with("size", format!("{width} x {height}"))
        .with("crop", format!("{},{} to {},{}", min[0], min[1], max[0], max[1]))
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
