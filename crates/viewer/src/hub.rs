//! Where connections and the stage meet: the view, orders for the stage, and news for all.

use crate::command::Command;
use crate::picture::Frame;
use crate::view::View;
use axum::body::Bytes;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::{mpsc, oneshot, watch};
use vastlight::Error;

/// The first byte of messages that are JSON.
const NEWS: u8 = 2;
/// How long the stage waits for browsers that have not shown the last pictures.
const PATIENCE: Duration = Duration::from_millis(250);

/// A message of JSON.
pub(crate) fn news(value: &Value) -> Bytes {
    let mut bytes = vec![NEWS];
    bytes.extend(value.to_string().into_bytes());
    bytes.into()
}

/// An error as the page shows it.
pub(crate) fn error_value(error: &Error) -> Value {
    json!({"kind": "error", "what": error.what, "place": error.place, "hint": error.hint})
}

/// Where answers to one connection go.
pub(crate) type Answers = mpsc::Sender<Bytes>;

/// A question about a point of the picture.
#[derive(Debug)]
pub(crate) struct Pick {
    pub(crate) point: [f32; 2],
    pub(crate) answers: Answers,
}

/// A file of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileKind {
    Png,
    Exr,
}

/// Somebody who waits for the picture as a file.
#[derive(Debug)]
pub(crate) struct Snapshot {
    pub(crate) kind: FileKind,
    pub(crate) answer: oneshot::Sender<Result<Vec<u8>, Error>>,
}

/// What of a scene is to be other than it was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Changes {
    /// Looks.
    pub(crate) revise: bool,
    /// The moment.
    pub(crate) pose: bool,
    /// Places of objects.
    pub(crate) place: bool,
}

impl Changes {
    pub(crate) fn any(self) -> bool {
        self.revise || self.pose || self.place
    }
}

/// What the stage is to do.
#[derive(Debug, Default)]
pub(crate) struct Orders {
    /// Another picture.
    pub(crate) restart: bool,
    /// The same, developed anew.
    pub(crate) develop: bool,
    /// Another scene of the same things.
    pub(crate) changes: Changes,
    /// Another scene.
    pub(crate) open: Option<String>,
    pub(crate) picks: Vec<Pick>,
    pub(crate) snapshots: Vec<Snapshot>,
    /// Looked at anew, without anything else: somebody came or went, or goes on.
    pub(crate) look: bool,
}

impl Orders {
    fn is_empty(&self) -> bool {
        let Self { restart, develop, changes, open, picks, snapshots, look } = self;
        let flags = [*restart, *develop, changes.any(), *look];
        !flags.contains(&true) && open.is_none() && picks.is_empty() && snapshots.is_empty()
    }
}

/// What the stage would do without orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Work {
    /// Nothing.
    None,
    /// Refine, if anybody looks.
    Refine,
    /// Follow a camera that moves, if anybody looks, no faster than that one can.
    Follow,
    /// Something that somebody waits for.
    Owed,
}

/// The stage's next step.
#[derive(Debug)]
pub(crate) struct Turn {
    pub(crate) view: View,
    /// The last input that the view holds.
    pub(crate) input: u32,
    pub(crate) orders: Orders,
    pub(crate) closing: bool,
}

#[derive(Debug)]
struct Shared {
    view: View,
    /// The scene that is shown.
    source: Option<String>,
    input: u32,
    orders: Orders,
    /// Who watches, and whether pictures are on their way to them as many as may be.
    viewers: BTreeMap<u64, bool>,
    joined: u64,
    steering: Option<u64>,
    closing: bool,
}

/// The meeting point.
#[derive(Debug)]
pub(crate) struct Hub {
    shared: Mutex<Shared>,
    wake: Condvar,
    attention: AtomicBool,
    urgent: AtomicBool,
    pub(crate) frames: watch::Sender<Option<Frame>>,
    pub(crate) scene: watch::Sender<Bytes>,
    pub(crate) state: watch::Sender<Bytes>,
    pub(crate) status: watch::Sender<Bytes>,
    /// Errors that all see.
    pub(crate) notices: watch::Sender<Bytes>,
    /// Samples that were ever rendered.
    pub(crate) rendered: AtomicU64,
    pub(crate) closed: watch::Sender<bool>,
}

impl Hub {
    /// A hub with nothing to look at yet but what is to be opened.
    pub(crate) fn new(view: View, source: Option<String>) -> Self {
        let orders = Orders { open: source, ..Orders::default() };
        let shared = Shared {
            view,
            source: None,
            input: 0,
            orders,
            viewers: BTreeMap::new(),
            joined: 0,
            steering: None,
            closing: false,
        };
        let hub = Self {
            shared: Mutex::new(shared),
            wake: Condvar::new(),
            attention: AtomicBool::new(true),
            urgent: AtomicBool::new(true),
            frames: watch::Sender::new(None),
            scene: watch::Sender::new(news(&json!({"kind": "scene", "phase": "idle"}))),
            state: watch::Sender::new(Bytes::new()),
            status: watch::Sender::new(Bytes::new()),
            notices: watch::Sender::new(Bytes::new()),
            rendered: AtomicU64::new(0),
            closed: watch::Sender::new(false),
        };
        hub.tell_state(&hub.lock());
        hub
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tell_state(&self, shared: &Shared) {
        self.state.send_replace(news(&json!({
            "kind": "state",
            "view": shared.view,
            "steering": shared.steering,
            "viewers": shared.viewers.len(),
        })));
    }

    /// Wakes the stage. What is urgent stops also small pictures; all else waits for these, or one who drags a slider would see none.
    fn call(&self, is_urgent: bool) {
        if is_urgent {
            self.urgent.store(true, Ordering::Release);
        }
        self.attention.store(true, Ordering::Release);
        self.wake.notify_all();
    }

    /// Whether there are orders that refining stops for.
    pub(crate) fn calls(&self) -> bool {
        self.attention.load(Ordering::Acquire)
    }

    /// Whether there are orders that even following stops for.
    pub(crate) fn calls_urgently(&self) -> bool {
        self.urgent.load(Ordering::Acquire)
    }

    /// Waits for orders, or for somebody who looks if there is work, and takes them.
    pub(crate) fn turn(&self, work: Work) -> Turn {
        let mut shared = self.lock();
        let mut patient = true;
        while !shared.closing && shared.orders.is_empty() && !shared.may(work, patient) {
            let waits_for_browser = work == Work::Follow && shared.steerer_is_busy();
            if waits_for_browser {
                let waited = self.wake.wait_timeout(shared, PATIENCE);
                let (guard, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
                (shared, patient) = (guard, !timeout.timed_out());
            } else {
                shared = self.wake.wait(shared).unwrap_or_else(PoisonError::into_inner);
            }
        }
        self.attention.store(shared.closing, Ordering::Release);
        self.urgent.store(shared.closing, Ordering::Release);
        Turn {
            view: shared.view.clone(),
            input: shared.input,
            orders: std::mem::take(&mut shared.orders),
            closing: shared.closing,
        }
    }

    /// Changes the view on behalf of the stage, and tells all.
    pub(crate) fn change_view(&self, change: impl FnOnce(&mut View)) {
        let mut shared = self.lock();
        change(&mut shared.view);
        self.tell_state(&shared);
    }

    /// Notes which scene is shown.
    pub(crate) fn set_source(&self, source: Option<&str>) {
        self.lock().source = source.map(str::to_owned);
    }

    /// The view, and the scene that it shows.
    pub(crate) fn shown(&self) -> (View, Option<String>) {
        let shared = self.lock();
        (shared.view.clone(), shared.source.clone())
    }

    /// Somebody watches; the first steers.
    pub(crate) fn join(&self) -> u64 {
        let mut shared = self.lock();
        shared.joined += 1;
        let viewer = shared.joined;
        shared.viewers.insert(viewer, false);
        shared.steering.get_or_insert(viewer);
        self.tell_state(&shared);
        shared.orders.look = true;
        self.call(false);
        viewer
    }

    /// Somebody is gone; if that was who steered, the next in order of coming does.
    pub(crate) fn leave(&self, viewer: u64) {
        let mut shared = self.lock();
        shared.viewers.remove(&viewer);
        if shared.steering == Some(viewer) {
            shared.steering = shared.viewers.keys().next().copied();
        }
        self.tell_state(&shared);
        shared.orders.look = true;
        self.call(shared.viewers.is_empty());
    }

    /// Notes whether as many pictures are on their way to a viewer as may be.
    pub(crate) fn set_busy(&self, viewer: u64, busy: bool) {
        if let Some(known) = self.lock().viewers.get_mut(&viewer) {
            *known = busy;
        }
        self.wake.notify_all();
    }

    /// Asks for the picture as a file.
    pub(crate) fn ask_snapshot(&self, snapshot: Snapshot) {
        self.lock().orders.snapshots.push(snapshot);
        self.call(false);
    }

    /// The end.
    pub(crate) fn close(&self) {
        self.lock().closing = true;
        self.closed.send_replace(true);
        self.call(true);
    }

    /// What is looked at now.
    pub(crate) fn view(&self) -> View {
        self.lock().view.clone()
    }

    /// Does what a viewer wants, or says why not.
    pub(crate) fn obey(&self, viewer: u64, command: Command, answers: &Answers) -> Result<(), String> {
        let mut shared = self.lock();
        if command.steers() && shared.steering != Some(viewer) {
            return Err("somebody else steers: take over first".to_owned());
        }
        if let Command::Object { instance, place: Some(_) } = command
            && !shared.view.objects.takes(instance)
        {
            return Err("no more objects are put elsewhere: put others back first".to_owned());
        }
        let is_urgent = matches!(command, Command::Open { .. });
        shared.obey(viewer, command, answers);
        self.tell_state(&shared);
        self.call(is_urgent);
        Ok(())
    }
}

impl Shared {
    fn steerer_is_busy(&self) -> bool {
        self.steering.and_then(|viewer| self.viewers.get(&viewer)).is_some_and(|&busy| busy)
    }

    /// Whether work is to be done without orders.
    fn may(&self, work: Work, patient: bool) -> bool {
        match work {
            Work::None => false,
            Work::Refine => !self.viewers.is_empty(),
            Work::Follow => !(self.viewers.is_empty() || patient && self.steerer_is_busy()),
            Work::Owed => true,
        }
    }

    fn obey(&mut self, viewer: u64, command: Command, answers: &Answers) {
        let Self { view, orders, .. } = self;
        match command {
            Command::Camera { camera, input } => {
                view.camera = crate::view::CameraView { name: None, ..camera };
                (self.input, orders.restart) = (input, true);
            }
            Command::SceneCamera { name } => (view.camera.name, orders.restart) = (Some(name), true),
            Command::Size { size } => {
                orders.restart |= view.size != size;
                view.size = size;
            }
            Command::Tone { tone } => (view.tone, orders.develop) = (tone, true),
            Command::Render { render } => {
                let same = crate::view::RenderView { spp: render.spp, ..view.render } == render;
                orders.restart |= !same || render.spp < view.render.spp;
                (view.render, orders.look) = (render, true);
            }
            Command::Channel { channel } => (view.channel, orders.restart) = (channel, true),
            Command::Region { region } => (view.region, orders.look) = (region, true),
            Command::Pause { paused } => (view.paused, orders.look) = (paused, true),
            Command::Reset {} => orders.restart = true,
            Command::Pick { x, y } => {
                orders.picks.push(Pick { point: [x, y], answers: answers.clone() });
            }
            Command::Material { name, edit } => {
                view.edits.edit_material(name, edit);
                orders.changes.revise = true;
            }
            Command::Light { name, edit } => {
                view.edits.edit_light(name, edit);
                orders.changes.revise = true;
            }
            Command::Environment { edit } => {
                view.edits.environment = Some(edit);
                orders.changes.revise = true;
            }
            Command::Object { instance, place } => {
                view.objects.put(instance, place);
                orders.changes.place = true;
            }
            Command::Revert {} => {
                view.edits = crate::edits::Edits::default();
                view.objects = crate::objects::Places::default();
                (orders.changes.revise, orders.changes.place) = (true, true);
            }
            Command::Time { seconds } => (view.time, orders.changes.pose) = (seconds, true),
            Command::Open { source } => orders.open = Some(source),
            Command::Steer {} => self.steering = Some(viewer),
            // Answered where they arrive.
            Command::Files { .. } | Command::Share {} => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::CameraView;

    fn hub() -> (Hub, Answers) {
        (Hub::new(View::new(4), None), mpsc::channel(4).0)
    }

    fn camera(x: f32, input: u32) -> Command {
        let camera = CameraView { eye: [x, 0.0, 0.0], target: [0.0; 3], fov: 40.0, name: None };
        Command::Camera { camera, input }
    }

    #[test]
    fn one_steers_and_the_newest_wins() {
        let (hub, answers) = hub();
        let (first, second) = (hub.join(), hub.join());
        hub.turn(Work::None);
        for i in 1..4 {
            hub.obey(first, camera(i as f32, i), &answers).expect("steers");
        }
        assert!(hub.obey(second, camera(9.0, 9), &answers).is_err());
        assert!(hub.calls() && !hub.calls_urgently());
        let turn = hub.turn(Work::None);
        assert_eq!((turn.view.camera.eye[0], turn.input, turn.orders.restart), (3.0, 3, true));
        hub.obey(second, Command::Steer {}, &answers).expect("allowed");
        assert!(hub.obey(first, Command::Reset {}, &answers).is_err());
        hub.leave(second);
        hub.obey(first, Command::Open { source: "demo:cornell".into() }, &answers).expect("steers again");
        assert!(hub.calls_urgently());
    }

    #[test]
    fn work_waits_for_viewers_and_for_slow_browsers() {
        let (hub, _) = hub();
        assert!(!hub.lock().may(Work::Refine, true) && hub.lock().may(Work::Owed, true));
        let viewer = hub.join();
        assert!(hub.lock().may(Work::Follow, true));
        hub.set_busy(viewer, true);
        assert!(!hub.lock().may(Work::Follow, true) && hub.lock().may(Work::Refine, true));
        hub.turn(Work::Follow);
        let start = std::time::Instant::now();
        hub.turn(Work::Follow);
        assert!(start.elapsed() >= PATIENCE / 2, "patience ends, but not at once");
    }

    #[test]
    fn a_larger_target_goes_on_and_a_smaller_one_begins_anew() {
        let (hub, answers) = hub();
        let viewer = hub.join();
        hub.turn(Work::None);
        for (spp, restart) in [(8, false), (2, true)] {
            let render = crate::view::RenderView { spp, ..hub.view().render };
            hub.obey(viewer, Command::Render { render }, &answers).expect("obeyed");
            assert_eq!(hub.turn(Work::None).orders.restart, restart);
        }
    }
}
