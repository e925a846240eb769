//! The stage: a thread that opens scenes and renders what is looked at.

mod canvas;
mod objects;
mod rounds;

use crate::edits::Edits;
use crate::hub::{Changes, Hub, Turn, Work, error_value, news};
use crate::meter::Meter;
use crate::objects::Places;
use crate::server::Viewer;
use crate::view::{CameraView, Size, View};
use crate::{files, inventory};
pub(crate) use objects::Objects;
use rounds::{Leave, Rounds};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use vastlight::scene::Scene;
use vastlight::transport::RenderSettings;
use vastlight::{
    CameraChoice, Error, LoadOptions, MemoryEstimate, OpenScene, PackControl, RenderRequest, Session,
    default_budget_bytes, open_within,
};

/// What the thread has between scenes.
pub(crate) struct Stage {
    hub: Arc<Hub>,
    viewer: Arc<Viewer>,
    meter: Meter,
    /// Number of the last picture.
    number: u32,
}

impl Stage {
    pub(crate) fn new(hub: Arc<Hub>, viewer: Arc<Viewer>) -> Self {
        Self { hub, viewer, meter: Meter::default(), number: 0 }
    }

    /// Opens what is asked for until the hub closes, on the threads of the current pool.
    pub(crate) fn run(mut self) {
        let mut next: Option<String> = None;
        loop {
            while let Some(source) = next.take() {
                next = self.play(&source);
            }
            let Turn { orders, closing, .. } = self.hub.turn(Work::None);
            if closing {
                return;
            }
            next = orders.open;
        }
    }

    /// Opens a scene and shows it until it fails, or another is asked for.
    fn play(&mut self, name: &str) -> Option<String> {
        self.tell_loading(name, "reading");
        self.hub.set_source(Some(name));
        let shown = self.open(name).and_then(|(session, options)| self.show(session, name, &options));
        match shown {
            Ok(Leave::Open(source)) => Some(source),
            Ok(_) => None,
            Err(error) => {
                let mut value = error_value(&error);
                self.hub.set_source(None);
                value["kind"] = json!("scene");
                value["phase"] = json!("failed");
                value["source"] = json!(name);
                self.hub.scene.send_replace(news(&value));
                None
            }
        }
    }

    fn tell_loading(&self, name: &str, step: &str) {
        let value = json!({"kind": "scene", "phase": "loading", "source": name, "step": step});
        self.hub.scene.send_replace(news(&value));
    }

    /// Opens a scene within the budget.
    fn open(&self, name: &str) -> Result<(Session, LoadOptions), Error> {
        let (source, options) = self.viewer.source_of(name)?;
        let never = AtomicBool::new(false);
        let control = PackControl { memory: self.viewer.memory, cancel: &never, progress: &|_| {} };
        let scene = open_within(&source, &options, None, control)?;
        self.check_memory(&scene)?;
        Ok((Session::new(scene, &source, &options), options))
    }

    /// Refuses a scene in memory that does not fit with its structures and the largest picture.
    fn check_memory(&self, open: &OpenScene) -> Result<(), Error> {
        let Size { width, height } = Size::LARGEST;
        let pixels = u64::from(width * height);
        let estimate = MemoryEstimate::new(&open.scene, pixels, &[], rayon::current_num_threads());
        match (&open.stored, self.viewer.memory.or_else(default_budget_bytes)) {
            (None, Some(budget)) => estimate.check(budget),
            _ => Ok(()),
        }
    }

    /// Shows a scene.
    fn show(&mut self, mut session: Session, name: &str, options: &LoadOptions) -> Result<Leave, Error> {
        let scene = &session.open().scene;
        let is_own = self.viewer.source.as_deref() == Some(name);
        let choice = if is_own { self.viewer.camera.clone() } else { CameraChoice::default() };
        let camera = CameraView::chosen(&choice, scene)?;
        self.hub.change_view(|view| {
            let View { tone, render, size, channel, paused, .. } = view.clone();
            let time = options.time.unwrap_or(0.0);
            *view = View { tone, render, size, channel, paused, camera, time, ..View::new(1) };
        });
        self.meter = Meter::default();
        self.tell_loading(name, "building");
        let about = json!({
            "kind": "scene",
            "phase": "ready",
            "source": name,
            "moves": session.movement().is_some(),
            "duration": session.movement().flatten(),
            "inventory": inventory::of_scene(&session.open().scene),
        });
        let mut about = Some(about);
        let mut good = Edits::default();
        let mut objects = Objects::new(&session);
        loop {
            let request = self.largest_request(&session.open().scene)?;
            let leave =
                session.live(&request, |live| Rounds::new(self, live, &objects).run(about.take()))??;
            match leave {
                Leave::Change(changes) => self.change(&mut session, &mut good, &mut objects, changes),
                Leave::Open(_) | Leave::Close => return Ok(leave),
            }
        }
    }

    /// Gives the scene the looks, the moment and the places of the view. What cannot be done is told, and the scene stays as it was, with the looks
    /// that were good.
    fn change(&self, session: &mut Session, good: &mut Edits, objects: &mut Objects, changes: Changes) {
        let view = self.hub.view();
        if changes.revise {
            match view.edits.overrides().and_then(|changes| session.revise(&changes)) {
                Ok(()) => *good = view.edits,
                Err(error) => {
                    self.hub.change_view(|shared| shared.edits.clone_from(good));
                    self.tell_error(&error);
                }
            }
        }
        if changes.pose
            && let Err(error) = session.pose(view.time)
        {
            self.tell_error(&error);
        }
        if changes.place {
            self.arrange(session, objects, &view.objects);
        }
    }

    /// Puts objects where they are wanted. The view takes back what cannot be, unless something else is wanted by now.
    fn arrange(&self, session: &mut Session, objects: &mut Objects, wanted: &Places) {
        for (instance, error) in objects.arrange(session, wanted) {
            self.hub.change_view(|shared| {
                if shared.objects.of(instance) == wanted.of(instance) {
                    shared.objects.put(instance, objects.placed().of(instance));
                }
            });
            self.tell_error(&error);
        }
    }

    /// Shows an error to all.
    fn tell_error(&self, error: &Error) {
        self.hub.notices.send_replace(news(&error_value(error)));
    }

    /// The largest picture that there will be, for budgets.
    fn largest_request(&self, scene: &Scene) -> Result<RenderRequest, Error> {
        let camera = CameraChoice::default().resolve(scene)?;
        let Size { width, height } = Size::LARGEST;
        let mut request = RenderRequest::new(RenderSettings::new(camera, width, height), 1);
        request.paging.memory = self.viewer.memory;
        Ok(request)
    }
}

impl Viewer {
    /// The source behind a name that a page gave, and how it is opened.
    pub(crate) fn source_of(&self, name: &str) -> Result<(String, LoadOptions), Error> {
        if self.source.as_deref() == Some(name) {
            return Ok((name.to_owned(), self.options.clone()));
        }
        let options = LoadOptions { import: self.options.import.clone(), ..LoadOptions::default() };
        if name.starts_with("demo:") {
            return Ok((name.to_owned(), options));
        }
        let path = files::below(self.shared_folder()?, name)?;
        Ok((path.display().to_string(), options))
    }

    /// The folder whose scenes may be opened.
    pub(crate) fn shared_folder(&self) -> Result<&std::path::Path, Error> {
        let hint = "start it with --folder DIR";
        self.folder.as_deref().ok_or_else(|| Error::usage("this page shares no folder", "", hint))
    }

    /// A list of the folder for the page.
    pub(crate) fn listing(&self, folder: &str) -> Value {
        match self.shared_folder().and_then(|root| files::list(root, folder)) {
            Ok(listing) => json!({"kind": "files", "listing": listing}),
            Err(error) => error_value(&error),
        }
    }
}
