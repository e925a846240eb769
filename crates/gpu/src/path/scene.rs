//! A scene on the device: what rays are traced through, and what is known of surfaces and lights.

use super::is_stream;
use crate::error::GpuError;
use crate::recording::Resident;
use crate::run::Executor;
use crate::trace::tree_of;
use vastlight_trace::words::TracerWords;
use vastlight_transport::Renderer;
use vastlight_transport::words::{RendererWords, ScenePages, WordsError};

/// A scene on the device, but for its pages.
#[derive(Clone, Copy, Debug)]
pub struct DeviceScene {
    /// Nodes and instances.
    pub(super) tree: Resident,
    /// Triangles in the leaves of kd-trees.
    pub(super) blocks: Resident,
    pub(super) tables: Resident,
    pub(super) lights: Resident,
}

impl DeviceScene {
    /// Brings what a renderer knows to the device; gives also its pages, which are not there yet.
    ///
    /// # Errors
    /// Its tracer is not in the layout `compact` (of the integrator `whitted`, not over threaded kd-trees), a binding is too small for
    /// it, or memory does not suffice; then nothing stays.
    pub fn new<'r>(
        executor: &mut Executor,
        renderer: &'r Renderer<'_>,
    ) -> Result<(Self, ScenePages<'r>), GpuError> {
        let (words, pages) = renderer.words().map_err(|error| match error {
            WordsError::Pages(error) => error.into(),
            error @ WordsError::TooLong(_) => GpuError::Scene { reason: error.to_string() },
        })?;
        let traced = traced(renderer, &pages, &words)?;
        let [tree, blocks, tables, lights] = executor.keep_all([
            ("tree", &traced.tree),
            ("blocks", &traced.blocks),
            ("tables", &words.tables),
            ("lights", &words.lights),
        ])?;
        Ok((Self { tree, blocks, tables, lights }, pages))
    }

    /// Gives its memory back.
    pub fn release(self, executor: &mut Executor) {
        let all = [self.tree, self.blocks, self.tables, self.lights];
        all.into_iter().for_each(|resident| executor.release(resident));
    }
}

/// The words of a renderer's tracer.
fn traced(
    renderer: &Renderer<'_>,
    pages: &ScenePages<'_>,
    words: &RendererWords,
) -> Result<TracerWords, GpuError> {
    let tracer = renderer.tracer();
    let settings = renderer.settings();
    let is_stream = is_stream(settings.integrator);
    let all = |bytes| if is_stream { tracer.threaded_words() } else { tracer.words(bytes) };
    let mut traced = tree_of(pages, all)?;
    // Where there are photons, clear things cast shadows.
    if is_stream && settings.caustics.is_none() {
        traced.set_veils(|instance| words.is_veiled_to_whitted(instance));
    } else {
        traced.set_veils(|instance| words.is_veiled(instance));
    }
    Ok(traced)
}
