//! An open scene with what pictures of it share: structures for rays, and a graphics processor. Frames of a scene that moves
//! update them.

use crate::edit::{Addition, Table, changed};
use crate::fingerprint::fingerprint;
use crate::live::{Live, LiveParts};
use crate::open::check_looks;
use crate::overrides::Files;
use crate::paged::{KeptCaches, KeptPool, any_caches, kept_caches, kept_pool};
use crate::rays::RayBuffers;
use crate::render::{render_keeping, tracer_of};
use crate::{
    Control, DeviceRequest, Error, ErrorClass, Exposure, LoadOptions, OpenScene, Overrides, PagingRequest,
    RenderRequest, Rendered, open,
};
use rayon::ThreadPool;
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Instant;
use vastlight_gpu::Executor;
use vastlight_scene::{Environment, Light, Material, Pose, Scene, SceneDesc, generate};
use vastlight_trace::paged::Caches;
use vastlight_trace::{PoseError, PoseReport, Tracer, TracerConfig};

/// What one picture leaves for the next of the same scene.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    /// The structures, and how they were asked for.
    pub(crate) tracer: Option<(TracerConfig, Tracer)>,
    /// The graphics processor, and how it was asked for.
    pub(crate) executor: Option<(DeviceRequest, Executor)>,
    pub(crate) caches: Option<KeptCaches>,
    /// Threads for a scene in a store.
    pub(crate) pool: Option<KeptPool>,
}

/// What a scene looked like when it was opened.
#[derive(Clone, Debug)]
struct Looks {
    materials: Vec<Material>,
    lights: Vec<Light>,
    environment: Option<Environment>,
    images: usize,
}

impl Looks {
    fn of(desc: &SceneDesc) -> Self {
        let SceneDesc { materials, lights, environment, images, .. } = desc;
        let (materials, lights) = (materials.clone(), lights.clone());
        Self { materials, lights, environment: environment.clone(), images: images.len() }
    }

    /// Undoes changes; lights stay where they have moved to.
    fn restore(&self, desc: &mut SceneDesc, files: &mut Files) {
        desc.materials.clone_from(&self.materials);
        desc.environment.clone_from(&self.environment);
        files.take_back(desc, self.images);
        for (light, looked) in desc.lights.iter_mut().zip(&self.lights) {
            *light = Light { world_from_light: light.world_from_light, ..looked.clone() };
        }
    }
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
    files: Files,
    /// What waits to be put into the scene.
    pub(crate) pending: Vec<Addition>,
    /// Names that these bring, by table.
    pub(crate) waiting: [HashSet<String>; Table::ALL.len()],
    /// Changes since the scene was opened, and what they change.
    revision: Option<(Overrides, Looks)>,
    /// Whether places, vertices or tables are others than those that were opened.
    edited: bool,
    pub(crate) rays: RayBuffers,
}

impl Session {
    /// A session of the scene that was opened from `source` with `options`.
    #[must_use]
    pub fn new(open: OpenScene, source: &str, options: &LoadOptions) -> Self {
        let is_function = open.scene.motion().is_none()
            && source.strip_prefix("demo:").is_some_and(generate::moves)
            && open.stored.is_none();
        let reopened = is_function.then(|| (source.to_owned(), options.clone()));
        Self {
            open,
            kept: Kept::default(),
            moving: 0,
            reopened,
            files: Files::new(options.import.limits),
            pending: Vec::new(),
            waiting: Default::default(),
            revision: None,
            edited: false,
            rays: RayBuffers::default(),
        }
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
        if let Some((source, options)) = &self.reopened {
            if self.edited {
                let hint = "change places, vertices and meshes after the time is set, in a scene that is loaded anew";
                return Err(Error::usage(
                    "this scene is made anew for each moment, without its changes",
                    "time",
                    hint,
                ));
            }
            let options = LoadOptions { time: Some(time), ..options.clone() };
            let source = source.clone();
            return self.remake(source, options);
        }
        let poses = exposure.poses(&self.open.scene, time)?;
        let report = self.follow(poses)?;
        self.moving = self.triangles_of(&report.change.meshes);
        Ok(report)
    }

    /// Opens the scene again, at another moment, with its looks; after an error all is as it was.
    fn remake(&mut self, source: String, options: LoadOptions) -> Result<PoseReport, Error> {
        let before = std::mem::replace(&mut self.open, open(&source, &options)?);
        let revision = self.revision.take();
        if let Some(Err(error)) = revision.as_ref().map(|(changes, _)| self.revise(changes)) {
            (self.open, self.revision) = (before, revision);
            return Err(error);
        }
        self.reopened = Some((source, options));
        self.kept.tracer = None;
        Ok(PoseReport::default())
    }

    /// Brings the scene to a pose, or opens its shutter over several, and lets structures that are there follow.
    fn follow(&mut self, poses: Vec<Pose>) -> Result<PoseReport, PoseError> {
        let opens = poses.len() > 1;
        let Self { open: OpenScene { scene, .. }, kept: Kept { tracer, .. }, .. } = self;
        let outcome = match tracer {
            Some((_, tracer)) => tracer.open_shutter(scene, poses),
            None => scene
                .open_shutter(poses)
                .map(|change| PoseReport { change, ..PoseReport::default() })
                .map_err(PoseError::from),
        };
        // A pose that does not fit changes nothing, but those before it may have.
        if matches!(outcome, Err(PoseError::Trace(_))) || opens && outcome.is_err() {
            *tracer = None;
        }
        outcome
    }

    fn triangles_of(&self, meshes: &[u32]) -> u64 {
        let extents = self.open.scene.extents();
        meshes.iter().map(|&mesh| extents[mesh as usize].triangles).sum()
    }

    /// Poses the scene by hand, and lets structures that are there follow.
    pub(crate) fn apply(&mut self, pose: Pose) -> Result<PoseReport, Error> {
        let outcome = self.follow(vec![pose]);
        self.edited |= !matches!(outcome, Err(PoseError::Scene(_)));
        let report = outcome?;
        self.moving = self.moving.max(self.triangles_of(&report.change.meshes));
        Ok(report)
    }

    /// Makes the scene anew of its description after a change, which was found to fit before: should it not, the scene is empty.
    pub(crate) fn rebuild(
        &mut self,
        change: impl FnOnce(&mut SceneDesc) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.refuse_store()?;
        let revision = self.revision.take();
        let scene = std::mem::replace(&mut self.open.scene, Scene::new(SceneDesc::default())?);
        self.kept.tracer = None;
        (self.edited, self.moving) = (true, 0);
        let files = &mut self.files;
        let whole = |desc: &mut SceneDesc| {
            if let Some((_, looks)) = &revision {
                looks.restore(desc, files);
            }
            change(desc)
        };
        self.open.scene = changed(scene, whole)?;
        // All names are there still.
        revision.map_or(Ok(()), |(changes, _)| self.revise_with(&changes, true))
    }

    /// Refuses a scene whose tables cannot change.
    pub(crate) fn refuse_store(&self) -> Result<(), Error> {
        if self.open.stored.is_none() {
            return Ok(());
        }
        let hint = "change the file that it was packed from";
        Err(Error::usage("nothing is put into or taken out of a store", "scene", hint))
    }

    /// What tells this scene from others, as it is: contents, not names of files or dates.
    ///
    /// # Errors
    /// If its contents cannot be had.
    pub fn fingerprint(&self) -> Result<String, Error> {
        fingerprint(&self.open)
    }

    /// Whether places, vertices or tables were changed since the scene was opened.
    #[must_use]
    pub fn is_edited(&self) -> bool {
        self.edited
    }

    /// The structures that are there, be they as they may, or such as pictures have; and the caches over a store's pages.
    pub(crate) fn structures(
        &mut self,
        request: &RenderRequest,
    ) -> Result<(&OpenScene, &Tracer, Option<&Caches>), Error> {
        let Self { open, kept: Kept { tracer, caches, .. }, .. } = self;
        let config = tracer.as_ref().map_or_else(|| request.tracer.clone(), |(config, _)| config.clone());
        let request = RenderRequest { tracer: config, ..request.clone() };
        let tracer = kept_tracer(tracer, open, &request)?;
        let most_tiles = if open.stored.is_some() { open.materials().most_tiles() } else { 0 };
        let caches = any_caches(caches, open, &request, most_tiles)?;
        Ok((open, tracer, caches))
    }

    /// Threads for a scene in a store: those that are there, or new ones.
    pub(crate) fn store_pool(&mut self, paging: &PagingRequest) -> Result<Arc<ThreadPool>, Error> {
        kept_pool(&mut self.kept.pool, paging)
    }

    /// Whether [`Session::pose`] does anything, and the time from the first moment to the last, in seconds, where there is one.
    #[must_use]
    pub fn movement(&self) -> Option<Option<f32>> {
        let motion = self.open.scene.motion();
        motion.map(|motion| Some(motion.duration())).or(self.reopened.is_some().then_some(None))
    }

    /// Gives the scene as it was opened other looks, in place of those that were given before. The pictures are those of a scene that is
    /// opened with these changes.
    ///
    /// # Errors
    /// They name what is not there, or need what a store does not have; then nothing is changed.
    pub fn revise(&mut self, changes: &Overrides) -> Result<(), Error> {
        self.revise_with(changes, false)
    }

    /// [`Session::revise`]; with `as_read` files that were read count as they were then.
    fn revise_with(&mut self, changes: &Overrides, as_read: bool) -> Result<(), Error> {
        let Self { open: OpenScene { scene, stored }, files, revision, .. } = self;
        let fresh = || (Overrides::default(), Looks::of(scene.desc()));
        let (known, looks) = revision.take().unwrap_or_else(fresh);
        let mut look = |changes: &Overrides, as_read: bool| {
            files.as_read = as_read;
            scene.revise(|desc| {
                looks.restore(desc, files);
                changes.apply(desc, files)
            })?;
            stored.as_ref().map_or(Ok(()), |pages| check_looks(scene, pages))
        };
        let outcome = look(changes, as_read);
        let kept = if outcome.is_ok() { changes.clone() } else { known };
        let back = if outcome.is_err() { look(&kept, true) } else { Ok(()) };
        files.drop_spare();
        *revision = Some((kept, looks));
        back.and(outcome)
    }

    /// Makes the scene ready for live pictures, and hands it to `body`. The request's structures and memory count, and its size and
    /// outputs as the largest that there will be; pictures are made on the CPU, on the threads of the current pool, of a scene in a
    /// store on twice as many.
    ///
    /// # Errors
    /// The structures cannot be built, or a scene in a store does not fit into the memory of the request.
    pub fn live<R: Send>(
        &mut self,
        request: &RenderRequest,
        body: impl FnOnce(&mut Live<'_>) -> R + Send,
    ) -> Result<R, Error> {
        if self.open.stored.is_none() {
            return self.live_here(request, body);
        }
        self.store_pool(&request.paging)?.install(|| self.live_here(request, body))
    }

    fn live_here<R>(
        &mut self,
        request: &RenderRequest,
        body: impl FnOnce(&mut Live<'_>) -> R,
    ) -> Result<R, Error> {
        let Self { open, kept: Kept { tracer, caches, .. }, .. } = self;
        let start = Instant::now();
        let tracer = kept_tracer(tracer, open, request)?;
        let build = start.elapsed();
        let materials = open.materials();
        let caches = kept_caches(caches, open, request, materials.most_tiles())?;
        let parts = LiveParts { open, tracer, materials: &materials, caches };
        parts.with_live(request, (start, build), body)
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
