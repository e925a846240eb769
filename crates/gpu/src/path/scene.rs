//! A scene on the device: what rays are traced through, and what is known of surfaces and lights.

use crate::error::GpuError;
use crate::recording::Resident;
use crate::run::Executor;
use crate::trace::DeviceTracer;
use vastlight_transport::{Integrator, Renderer};

/// A scene on the device.
#[derive(Clone, Copy, Debug)]
pub struct DeviceScene {
    pub(super) tracer: DeviceTracer,
    pub(super) tables: Resident,
    pub(super) corners: Resident,
    pub(super) texels: Resident,
    pub(super) lights: Resident,
}

impl DeviceScene {
    /// Brings what a renderer knows to the device.
    ///
    /// # Errors
    /// The scene is in a store, its tracer not in the layout `compact` (of the integrator `whitted`, not over threaded kd-trees), a binding too small for it, or memory does not
    /// suffice; then nothing stays.
    pub fn new(executor: &mut Executor, renderer: &Renderer<'_>) -> Result<Self, GpuError> {
        let refused = |reason: String| GpuError::Scene { reason };
        let words = renderer.words().map_err(|e| refused(e.to_string()))?;
        let is_stream = renderer.settings().integrator == Integrator::Whitted;
        let tracer = renderer.tracer();
        let traced = if is_stream { tracer.threaded_words() } else { tracer.words() };
        let mut traced = traced.map_err(|e| refused(e.to_string()))?;
        if is_stream {
            traced.set_veils(|instance| words.is_veiled_to_whitted(instance));
        } else {
            traced.set_veils(|instance| words.is_veiled(instance));
        }
        let tracer = DeviceTracer::new(executor, &traced)?;
        drop(traced);
        let kept = executor.keep_all([
            ("tables", &words.tables),
            ("corners", &words.corners),
            ("texels", &words.texels),
            ("lights", &words.lights),
        ]);
        let [tables, corners, texels, lights] = kept.inspect_err(|_| tracer.release(executor))?;
        Ok(Self { tracer, tables, corners, texels, lights })
    }

    /// Gives its memory back.
    pub fn release(self, executor: &mut Executor) {
        self.tracer.release(executor);
        let all = [self.tables, self.corners, self.texels, self.lights];
        all.into_iter().for_each(|resident| executor.release(resident));
    }
}
