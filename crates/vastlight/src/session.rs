//! An open scene with what pictures of it share: structures for rays, and a graphics processor. Frames of a scene that moves
//! update them.

use crate::render::{render_keeping, tracer_of};
use crate::{Control, Error, ErrorClass, Exposure, LoadOptions, OpenScene, RenderRequest, Rendered, open};
use vastlight_gpu::Executor;
use vastlight_scene::generate;
use vastlight_trace::{PoseError, PoseReport, Tracer, TracerConfig};

/// What one picture leaves for the next of the same scene.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    /// The structures, and how they were asked for.
    pub(crate) tracer: Option<(TracerConfig, Tracer)>,
    pub(crate) executor: Option<Executor>,
}

/// The structures of a request: those that are there, or new ones.
pub(crate) fn kept_tracer<'k>(
    kept: &'k mut Option<(TracerConfig, Tracer)>,
    open: &OpenScene,
    request: &RenderRequest,
) -> Result<&'k Tracer, Error> {
    let known = kept.take().filter(|(config, _)| *config == request.tracer);
    let tracer = known.map_or_else(|| tracer_of(open, request), |(_, tracer)| Ok(tracer))?;
    Ok(&kept.insert((request.tracer.clone(), tracer)).1)
}

/// A scene of which several pictures are made.
#[derive(Debug)]
pub struct Session {
    open: OpenScene,
    kept: Kept,
    moving: u64,
    /// Where the scene comes from, if moments of it are made by opening it again.
    reopened: Option<(String, LoadOptions)>,
}

impl Session {
    /// A session of the scene that was opened from `source` with `options`.
    #[must_use]
    pub fn new(open: OpenScene, source: &str, options: &LoadOptions) -> Self {
        let is_function = open.scene.motion().is_none()
            && source.strip_prefix("demo:").is_some_and(generate::moves)
            && open.stored.is_none();
        let reopened = is_function.then(|| (source.to_owned(), options.clone()));
        Self { open, kept: Kept::default(), moving: 0, reopened }
    }

    /// The scene at the moment of the last pose, and where its meshes are.
    #[must_use]
    pub fn open(&self) -> &OpenScene {
        &self.open
    }

    /// Brings the scene to a moment, in seconds. The pictures are those of a scene that is opened at that moment.
    ///
    /// # Errors
    /// Nothing moves, the moment cannot be had, or does not fit the scene.
    pub fn pose(&mut self, time: f32) -> Result<PoseReport, Error> {
        self.expose(time, &Exposure { seconds: 0.0, keys: 2 })
    }

    /// Opens a shutter at a moment, in seconds; it stays open in all pictures until the next pose.
    ///
    /// # Errors
    /// Those of [`Session::pose`], or the scene knows but moments.
    pub fn expose(&mut self, time: f32, exposure: &Exposure) -> Result<PoseReport, Error> {
        let moments_alone = self.reopened.is_some() || self.open.stored.is_some();
        if moments_alone && !exposure.is_moment() {
            let (what, hint) = if self.open.stored.is_some() {
                ("a store has no shutter", "render the file that it was packed from")
            } else {
                ("this scene is made anew for each moment and has no shutter", "leave --shutter out")
            };
            return Err(Error::usage(what, "--shutter", hint));
        }
        if let Some((source, options)) = &mut self.reopened {
            options.time = Some(time);
            self.open = open(source, options)?;
            self.kept.tracer = None;
            return Ok(PoseReport::default());
        }
        let poses = exposure.poses(&self.open.scene, time)?;
        let report = match self.kept.tracer.take() {
            Some((config, mut tracer)) => {
                let report = tracer.open_shutter(&mut self.open.scene, poses)?;
                self.kept.tracer = Some((config, tracer));
                report
            }
            None => PoseReport { change: self.open.scene.open_shutter(poses)?, ..PoseReport::default() },
        };
        let extents = self.open.scene.extents();
        self.moving = report.change.meshes.iter().map(|&mesh| extents[mesh as usize].triangles).sum();
        Ok(report)
    }

    /// Triangles of the meshes that the last pose gave other vertices.
    #[must_use]
    pub fn moving_triangles(&self) -> u64 {
        self.moving
    }

    /// Renders the scene as it is: see [`render`](crate::render()).
    ///
    /// # Errors
    /// Those of [`render`](crate::render()).
    pub fn render(&mut self, request: &RenderRequest, control: &Control<'_>) -> Result<Rendered, Error> {
        let rendered = render_keeping(&self.open, request, control, &mut self.kept)?;
        if let Some((_, tracer)) = &mut self.kept.tracer {
            tracer.expect_tracing(rendered.stats.render_ms);
        }
        Ok(rendered)
    }
}

impl From<PoseError> for Error {
    fn from(error: PoseError) -> Self {
        match error {
            PoseError::Scene(error) => error.into(),
            PoseError::Trace(error) => Self::new(ErrorClass::Usage, error.to_string(), "--accel", ""),
        }
    }
}
