//! An open scene.

use crate::accumulator::Accumulator;
use crate::arguments::arguments;
use crate::errors::{OrRaise, exception};
use crate::image::Image;
use crate::pool::Pool;
use crate::render::Request;
use crate::view::{Page, Server};
use crate::work::{Listener, Watch, run};
use pyo3::prelude::*;
use serde_json::json;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{ThreadId, current, sleep};
use std::time::{Duration, Instant};
use vastlight::scene::{Scene as Contents, SceneDesc};
use vastlight::{
    Denoising, Error, Exposure, LoadOptions, LookChoice, OpenScene, Overrides, PackControl, Rendered,
    SceneChoice, Session, check_request, open_within,
};
use vastlight_viewer::Viewer;

/// Longest time between two looks whether a scene is free.
const LONGEST_PAUSE: Duration = Duration::from_millis(20);

arguments! {
    /// How a scene is opened.
    #[derive(Debug)]
    struct Source {
        source: String,
        memory: Option<u64>,
        threads: Option<usize>,
        time: Option<f32>,
        env: Option<PathBuf>,
        sun: Option<[f32; 2]>,
        /// Paths of TOML files, or texts of JSON.
        overrides: Vec<(Option<PathBuf>, Option<String>)>,
        file_scene: Option<String>,
        animation: Option<String>,
        sequence_fps: f32,
        triangles: Option<u64>,
        texture_bytes: Option<u64>,
        cache_dir: Option<PathBuf>,
    }
}

impl Source {
    /// What is said of the scene.
    fn choice(&self) -> SceneChoice {
        let look = |(path, text): &(Option<PathBuf>, Option<String>)| match path {
            Some(path) => LookChoice::File(path.clone()),
            None => LookChoice::Json(text.clone().unwrap_or_else(|| "{}".to_owned())),
        };
        SceneChoice {
            file_scene: self.file_scene.clone(),
            animation: self.animation.clone(),
            sequence_fps: self.sequence_fps,
            triangles: self.triangles,
            texture_bytes: self.texture_bytes,
            time: self.time,
            environment: self.env.clone(),
            sun: self.sun,
            overrides: self.overrides.iter().map(look).collect(),
        }
    }
}

arguments! {
    /// A scene with nothing in it.
    #[derive(Debug)]
    struct Empty {
        memory: Option<u64>,
        threads: Option<usize>,
    }
}

/// Changes in JSON.
pub(crate) fn changes_of(text: &str) -> Result<Overrides, Error> {
    LookChoice::Json(text.to_owned()).read()
}

/// What is behind the lock. It is taken outside of the pool: its threads may come to other work while they wait for a part of theirs, and
/// that would wait for the same lock.
#[derive(Debug)]
pub(crate) struct State {
    pub(crate) session: Session,
    /// The moment, if one was set.
    pub(crate) time: Option<f32>,
    /// How the shutter stands open.
    pub(crate) exposed: Option<Exposure>,
}

impl State {
    /// Opens the shutter as it is asked for, or closes it.
    fn expose(&mut self, exposure: Exposure) -> Result<(), Error> {
        let wanted = (exposure.seconds > 0.0).then_some(exposure);
        // Changes of the scene close its shutter.
        let is_open = self.session.open().scene.shutter().is_some();
        self.exposed = self.exposed.filter(|_| is_open);
        if wanted == self.exposed {
            return Ok(());
        }
        let Some(time) = self.time else {
            let what = "a shutter opens at a moment, and there is none";
            return Err(Error::usage(what, "shutter", "call set_time first"));
        };
        self.session.expose(time, &exposure)?;
        self.exposed = wanted;
        Ok(())
    }
}

/// A scene with what pictures of it share.
#[pyclass(frozen, module = "vastlight._native")]
#[derive(Debug)]
pub(crate) struct Scene {
    state: Mutex<State>,
    /// Threads of Python that wait for work of the scene.
    waiting: Mutex<Vec<ThreadId>>,
    pool: Pool,
    memory: Option<u64>,
    source: String,
    options: LoadOptions,
    /// How it was opened, on a command line.
    words: Vec<String>,
    load_ms: f64,
}

/// A thread that waits for work of a scene.
struct Waiting<'s>(&'s Scene, ThreadId);

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        lock(&self.0.waiting).retain(|&thread| thread != self.1);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Scene {
    fn around(
        session: Session,
        source: String,
        options: LoadOptions,
        memory: Option<u64>,
        pool: Pool,
    ) -> Self {
        let state = State { session, time: options.time, exposed: None };
        let (state, waiting) = (Mutex::new(state), Mutex::default());
        Self { state, waiting, pool, memory, source, options, words: Vec::new(), load_ms: 0.0 }
    }

    /// What is behind the lock, unless `check` says to wait no longer.
    fn state<E>(&self, check: impl Fn() -> Result<(), E>) -> Result<MutexGuard<'_, State>, E> {
        let mut pause = Duration::from_micros(50);
        loop {
            match self.state.try_lock() {
                Ok(state) => return Ok(state),
                Err(TryLockError::Poisoned(state)) => return Ok(state.into_inner()),
                Err(TryLockError::WouldBlock) => check()?,
            }
            sleep(pause);
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }

    /// The memory budget.
    pub(crate) fn memory(&self) -> Option<u64> {
        self.memory
    }

    /// Does work on the scene, which Ctrl-C ends.
    pub(crate) fn work<T: Send>(
        &self,
        py: Python<'_>,
        threads: Option<usize>,
        listener: Option<&Listener>,
        work: impl FnOnce(&mut State, &Watch) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let pool = self.pool.get(threads).or_raise(py)?;
        self.alone(py, || {
            run(py, listener, |watch| {
                let go_on = || watch.check("the scene is at other work");
                let state = &mut *self.state(go_on)?;
                pool.install(|| {
                    state.session.settle()?;
                    work(state, watch)
                })
            })
        })
    }

    /// Does something short with the scene.
    pub(crate) fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut State) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        self.with_unsettled(py, |state| {
            state.session.settle()?;
            work(state)
        })
    }

    /// Does something short with a scene for which things may wait.
    pub(crate) fn with_unsettled<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut State) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let pool = self.pool.get(None).or_raise(py)?;
        let alone = || {
            let state = &mut *self.state(|| Python::attach(|py| py.check_signals()))?;
            Ok(pool.install(|| work(state)))
        };
        self.alone(py, || py.detach(alone).and_then(|done| done.or_raise(py)))
    }

    /// Refuses what would wait for itself: a call from the progress of the scene's own work.
    fn alone<T>(&self, py: Python<'_>, work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
        let here = current().id();
        if lock(&self.waiting).contains(&here) {
            let what = "the scene is at work, and this is called from its progress";
            return Err(exception(py, &Error::usage(what, "scene", "wait for the end of the work")));
        }
        lock(&self.waiting).push(here);
        let _waiting = Waiting(self, here);
        work()
    }

    /// Renders, and makes something of the sums.
    fn rendered<T: Send>(
        &self,
        py: Python<'_>,
        (request, keep): (Request, bool),
        listener: Option<(Py<PyAny>, Option<f64>)>,
        finish: impl FnOnce(Rendered, Option<Denoising>) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        request.check().or_raise(py)?;
        let preview = |seconds: Option<f64>| seconds.and_then(|s| Duration::try_from_secs_f64(s).ok());
        let listener = listener.map(|(call, seconds)| Listener { call, preview: preview(seconds) });
        let memory = request.memory.or(self.memory);
        self.work(py, request.threads, listener.as_ref(), |state, watch| {
            let denoising = request.denoising()?;
            state.expose(request.exposure())?;
            let session = &mut state.session;
            let mut wanted = request.resolve(session.open(), denoising.as_ref(), memory)?;
            wanted.keep_recipe = keep;
            check_request(session.open(), &wanted, session.moving_triangles())?;
            if let Some(denoising) = &denoising {
                denoising.check_memory(wanted.settings.region().pixels(), memory)?;
            }
            finish(watch.control(|control| session.render(&wanted, control))?, denoising)
        })
    }
}

#[pymethods]
impl Scene {
    /// Opens a file, a store or a demo.
    #[staticmethod]
    fn load(py: Python<'_>, source: Source) -> PyResult<Self> {
        let start = Instant::now();
        let pool = Pool::new(source.threads);
        let threads = pool.get(None).or_raise(py)?;
        let choice = source.choice();
        let open = |watch: &Watch| {
            let options = choice.apply(LoadOptions::within(source.memory))?;
            let control = PackControl { memory: source.memory, cancel: watch.cancel(), progress: &|_| {} };
            let open = open_within(&source.source, &options, source.cache_dir.as_deref(), control)?;
            Ok((Session::new(open, &source.source, &options), options))
        };
        let (session, options) = run(py, None, |watch| threads.install(|| open(watch)))?;
        let scene = Self::around(session, source.source, options, source.memory, pool);
        Ok(Self { words: choice.words(), load_ms: start.elapsed().as_secs_f64() * 1e3, ..scene })
    }

    /// A scene with nothing in it.
    #[staticmethod]
    fn empty(py: Python<'_>, about: Empty) -> PyResult<Self> {
        let Empty { memory, threads } = about;
        let options = LoadOptions::within(memory);
        let contents = Contents::new(SceneDesc::default()).map_err(Error::from).or_raise(py)?;
        let session = Session::new(OpenScene::from(contents), "", &options);
        Ok(Self::around(session, String::new(), options, memory, Pool::new(threads)))
    }

    /// Where it was opened; empty if nowhere.
    #[getter]
    fn source(&self) -> &str {
        &self.source
    }

    /// A picture.
    fn render(
        &self,
        py: Python<'_>,
        request: Request,
        listener: Option<(Py<PyAny>, Option<f64>)>,
    ) -> PyResult<Image> {
        self.rendered(py, (request, false), listener, |rendered, denoising| {
            let mut picture = rendered.develop();
            let start = Instant::now();
            denoising.map_or(Ok(()), |denoising| denoising.run(&mut picture))?;
            let mut stats = json!(rendered.stats);
            stats["load_ms"] = json!(self.load_ms);
            stats["denoiser"] = json!(picture.denoiser);
            stats["denoise_ms"] =
                json!(picture.denoiser.as_ref().map(|_| start.elapsed().as_secs_f64() * 1e3));
            stats["version"] = json!(env!("CARGO_PKG_VERSION"));
            Ok(Image::new(picture, stats.to_string()))
        })
    }

    /// The sums of a picture.
    fn accumulate(
        &self,
        py: Python<'_>,
        request: Request,
        listener: Option<(Py<PyAny>, Option<f64>)>,
    ) -> PyResult<Accumulator> {
        self.rendered(py, (request, true), listener, |rendered, _| Ok(Accumulator(rendered.sums)))
    }

    /// The interactive page of the scene as it was opened, with changes of its looks in JSON.
    fn view(&self, py: Python<'_>, page: Page, changes: Option<String>) -> PyResult<Server> {
        let (time, is_edited) = self.with(py, |state| Ok((state.time, state.session.is_edited())))?;
        if is_edited || self.source.is_empty() {
            let hint = "save pictures, or view the file";
            let what =
                "the page opens the scene anew, without places, vertices and meshes that were changed here";
            return Err(exception(py, &Error::usage(what, "view", hint)));
        }
        let mut options = LoadOptions { time, ..self.options.clone() };
        options.overrides.extend(changes.as_deref().map(changes_of).transpose().or_raise(py)?);
        let viewer = Viewer {
            source: Some(self.source.clone()),
            options,
            memory: self.memory,
            scene_arguments: self.words.clone(),
            ..Viewer::default()
        };
        Server::start(py, page.apply(py, viewer)?)
    }
}
