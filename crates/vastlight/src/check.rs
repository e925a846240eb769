//! What can be said of a picture before work on it begins.

use crate::device::Device;
use crate::memory::{MemoryEstimate, default_budget_bytes};
use crate::{Error, OpenScene, RenderRequest};
use vastlight_transport::Integrator;

/// Refuses what cannot be done with a scene of which so many triangles move, or does not fit into the memory of the request.
///
/// # Errors
/// It does not fit, or the integrator needs the scene in memory.
pub fn check_request(open: &OpenScene, request: &RenderRequest, moving: u64) -> Result<(), Error> {
    check_integrator(request.settings.integrator, open.stored.is_some())?;
    if open.stored.is_some() { Ok(()) } else { check_memory(open, request, moving) }
}

/// Refuses integrators that need the scene in memory, for one in pages.
pub(crate) fn check_integrator(integrator: Integrator, in_pages: bool) -> Result<(), Error> {
    let what = match integrator {
        Integrator::Whitted | Integrator::PhotonCaustics => "the stream tracer needs the scene in memory",
        Integrator::Steps => "steps are counted in scenes in memory",
        _ => return Ok(()),
    };
    let hint = "render the file that the store was packed from, or use path, direct, primary or ao";
    if in_pages { Err(Error::usage(what, "--integrator", hint)) } else { Ok(()) }
}

/// Refuses a picture that cannot fit into the budget.
fn check_memory(open: &OpenScene, request: &RenderRequest, moving: u64) -> Result<(), Error> {
    let scene = &open.scene;
    let pixels = request.settings.region().pixels();
    let estimate = MemoryEstimate::new(scene, pixels, &request.aovs, rayon::current_num_threads())
        .with_photons(&request.settings)
        .with_moving(moving)
        .with_shutter(scene);
    let estimate = if request.noise.is_some() { estimate.with_noise(pixels) } else { estimate };
    let on_cpu = !matches!(request.device.device, Device::Gpu(_));
    let estimate = if on_cpu { estimate } else { estimate.on_graphics_processor(scene) };
    match request.paging.memory.or_else(default_budget_bytes) {
        Some(budget) => estimate.check(budget),
        None => Ok(()),
    }
}
