//! Round after round on one prepared scene: take orders, do a piece of work, show what came out.

use super::Stage;
use super::canvas::Canvas;
use super::objects::Objects;
use crate::develop::{Channel, Shown};
use crate::hub::{Changes, FileKind, Pick, Snapshot, Turn, news};
use crate::inventory;
use crate::picture::{Caption, Coding, frame};
use crate::view::{CameraView, View};
use serde_json::{Value, json};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use vastlight::film::{encode_exr, encode_png};
use vastlight::{CameraChoice, Error, ErrorClass, Live, LivePicture, peak_rss_bytes, rss_bytes};

/// Quality of pictures of a camera that moves, and of pictures that are refined.
const MOVING_QUALITY: u8 = 75;
const RESTING_QUALITY: u8 = 90;
/// Time between figures.
const FIGURES_EVERY: Duration = Duration::from_millis(250);

/// Why the rounds end.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Leave {
    /// Another scene of the same things.
    Change(Changes),
    /// Another scene.
    Open(String),
    /// The end.
    Close,
}

/// The rounds on one prepared scene.
pub(crate) struct Rounds<'r, 'l> {
    stage: &'r mut Stage,
    live: &'r mut Live<'l>,
    objects: &'r Objects,
    canvas: Canvas,
    view: View,
    input: u32,
    owed: Vec<Snapshot>,
    told: Option<Instant>,
    /// Time of the last pass, and of developing and encoding it.
    pass: Duration,
    encode: Duration,
}

impl<'r, 'l> Rounds<'r, 'l> {
    pub(crate) fn new(stage: &'r mut Stage, live: &'r mut Live<'l>, objects: &'r Objects) -> Self {
        let view = stage.hub.view();
        let canvas = Canvas::new(&view, &stage.meter);
        let (pass, encode) = (Duration::ZERO, Duration::ZERO);
        Self { stage, live, objects, canvas, view, input: 0, owed: Vec::new(), told: None, pass, encode }
    }

    /// Works until something outside of the picture changes. Tells of a scene that is new.
    pub(crate) fn run(mut self, about: Option<Value>) -> Result<Leave, Error> {
        if let Some(about) = about {
            self.stage.hub.scene.send_replace(news(&about));
        }
        loop {
            let work = self.canvas.work(&self.view, !self.owed.is_empty());
            let turn = self.stage.hub.turn(work);
            if let Some(leave) = self.take(turn)? {
                return Ok(leave);
            }
            self.canvas.limit(&self.view);
            self.piece()?;
            self.settle();
            self.tell_figures();
        }
    }

    /// Takes orders.
    fn take(&mut self, turn: Turn) -> Result<Option<Leave>, Error> {
        let Turn { view, input, mut orders, closing } = turn;
        (self.view, self.input) = (view, input);
        self.owed.append(&mut orders.snapshots);
        for pick in std::mem::take(&mut orders.picks) {
            self.answer(&pick)?;
        }
        let leave = match orders.open {
            _ if closing => Some(Leave::Close),
            Some(source) => Some(Leave::Open(source)),
            None => orders.changes.any().then_some(Leave::Change(orders.changes)),
        };
        if leave.is_some() {
            // Whoever waits for a file waits on.
            self.owed.drain(..).for_each(|snapshot| self.stage.hub.ask_snapshot(snapshot));
            return Ok(leave);
        }
        if orders.restart {
            self.canvas = Canvas::new(&self.view, &self.stage.meter);
        } else if orders.develop {
            self.canvas.is_changed();
            self.show(false)?;
        }
        Ok(None)
    }

    /// Renders a piece of what there is to do.
    fn piece(&mut self) -> Result<(), Error> {
        let Self { stage, live, canvas, view, .. } = self;
        let is_owed = !self.owed.is_empty();
        if !canvas.goes_on(view, is_owed) {
            return Ok(());
        }
        let spp = canvas.next_spp(view);
        let start = Instant::now();
        let picture = match &mut canvas.picture {
            Some(picture) => picture,
            none => none.insert(begin(live, stage, view, canvas.scale)?),
        };
        let before = picture.cost();
        let (hub, follows) = (&stage.hub, canvas.is_first);
        let stop = || if follows { hub.calls_urgently() } else { hub.calls() };
        let watched = || !is_owed && stop();
        let is_done = live.advance(picture, spp, &watched)?;
        let cost = picture.cost();
        let rays = (cost.rays + cost.shadow_rays) - (before.rays + before.shadow_rays);
        self.pass = start.elapsed();
        stage.meter.note(cost.samples - before.samples, rays, self.pass);
        stage.hub.rendered.fetch_add(cost.samples - before.samples, Ordering::Relaxed);
        canvas.limit(view);
        if is_done {
            if canvas.is_to_show(view) {
                self.show(true)?;
            }
            self.canvas.grow();
        }
        Ok(())
    }

    /// Publishes the picture as it is. One that is complete is published without loss, once.
    fn show(&mut self, is_whole: bool) -> Result<(), Error> {
        let start = Instant::now();
        let is_final = self.canvas.becomes_final(&self.view);
        let Self { stage, canvas, view, input, .. } = self;
        let Some(picture) = &canvas.picture else { return Ok(()) };
        if !is_whole && picture.spp() == 0 {
            return Ok(());
        }
        stage.number = stage.number.wrapping_add(1);
        let full = [view.size.width, view.size.height];
        let caption = Caption { number: stage.number, input: *input, spp: canvas.spp(), full };
        let coding = match canvas.scale < 1.0 {
            true => Coding::Lossy(MOVING_QUALITY),
            false if is_final => Coding::Lossless,
            false => Coding::Lossy(RESTING_QUALITY),
        };
        let shown = Shown::new(picture, view.channel, &view.tone);
        stage.hub.frames.send_replace(Some(frame(&shown, coding, caption)?));
        self.encode = start.elapsed();
        Ok(())
    }

    /// Hands out files, once there is a picture of full size.
    fn settle(&mut self) {
        let ready = self.canvas.is_whole();
        let Some(picture) = self.canvas.picture.as_ref().filter(|_| ready) else { return };
        for Snapshot { kind, answer } in self.owed.drain(..) {
            // Who no longer waits misses nothing.
            let _ = answer.send(file(picture, &self.view, kind));
        }
    }

    /// Says what is at a point.
    fn answer(&mut self, Pick { point, answers }: &Pick) -> Result<(), Error> {
        let settings = self.view.request(self.live.scene(), 1.0)?.settings;
        let pixel = |part: f32, edge: u32| ((part.clamp(0.0, 1.0) * edge as f32) as u32).min(edge - 1);
        let [x, y] = *point;
        let picked = self.live.pick(&settings, [pixel(x, settings.width), pixel(y, settings.height)])?;
        // A full queue is a browser that asks without listening.
        let _ = answers.try_send(news(&inventory::of_pick(picked.as_ref(), self.live.scene(), self.objects)));
        Ok(())
    }

    /// Tells all how it goes, now and then, and when the picture is complete.
    fn tell_figures(&mut self) {
        let is_complete = self.canvas.is_complete(&self.view);
        let is_due = self.told.is_none_or(|told| told.elapsed() >= FIGURES_EVERY);
        if is_due || is_complete || self.view.paused {
            self.told = Some(Instant::now());
            self.stage.hub.status.send_replace(news(&self.figures(is_complete)));
        }
    }

    fn figures(&self, is_complete: bool) -> Value {
        let Self { stage, live, canvas, view, .. } = self;
        let millis = |duration: Duration| duration.as_secs_f64() * 1e3;
        let activity = match () {
            () if is_complete => "done",
            () if view.paused => "paused",
            () if canvas.spp() == 0 => "moving",
            () => "refining",
        };
        let residency = live.residency();
        let hits = live.paging().map(|paging| {
            json!({"geometry": paging.geometry.hit_rate(), "attributes": paging.attributes.hit_rate()})
        });
        json!({
            "kind": "status",
            "activity": activity,
            "spp": canvas.spp(),
            "target": view.render.spp,
            "non_finite": canvas.picture.as_ref().map_or(0, |picture| picture.cost().non_finite),
            "scale": canvas.scale,
            "elapsed_s": canvas.started.elapsed().as_secs_f64(),
            "msamples_per_s": stage.meter.samples_per_s() / 1e6,
            "mrays_per_s": stage.meter.rays_per_s() / 1e6,
            "build_ms": millis(live.build_time()),
            "prepare_ms": millis(live.prepare_time()),
            "pass_ms": millis(self.pass),
            "encode_ms": millis(self.encode),
            "structure_bytes": live.structure_bytes(),
            "rss_bytes": rss_bytes(),
            "peak_bytes": peak_rss_bytes(),
            "budget_bytes": stage.viewer.memory.or_else(vastlight::default_budget_bytes),
            "residency": residency,
            "hit_rate": hits,
        })
    }
}

/// Begins a picture. All are told where a camera of the scene stands; one that the scene does not have is replaced by its first, and an
/// output that it cannot have by light.
fn begin(live: &mut Live<'_>, stage: &Stage, view: &mut View, scale: f32) -> Result<LivePicture, Error> {
    let scene = live.scene();
    let camera = CameraView::chosen(&view.camera.choice(), scene).or_else(|error| {
        stage.tell_error(&error);
        CameraView::chosen(&CameraChoice::default(), scene)
    })?;
    if camera != view.camera {
        stage.hub.change_view(|shared| {
            // Another may be wanted by now.
            if shared.camera == view.camera {
                shared.camera.clone_from(&camera);
            }
        });
        view.camera = camera;
    }
    let request = view.request(scene, scale)?;
    match live.begin(request) {
        Err(error) if view.channel != Channel::Beauty && error.class == ErrorClass::Usage => {
            stage.tell_error(&error);
            stage.hub.change_view(|shared| {
                if shared.channel == view.channel {
                    shared.channel = Channel::Beauty;
                }
            });
            view.channel = Channel::Beauty;
            let request = view.request(live.scene(), scale)?;
            live.begin(request)
        }
        begun => begun,
    }
}

/// The picture as a file.
fn file(picture: &LivePicture, view: &View, kind: FileKind) -> Result<Vec<u8>, Error> {
    let bytes = match kind {
        FileKind::Exr => encode_exr(&picture.develop()),
        FileKind::Png => {
            let shown = Shown::new(picture, view.channel, &view.tone);
            encode_png(&shown.picture, &shown.options)
        }
    };
    bytes.map_err(|e| Error::new(ErrorClass::Output, e.to_string(), "picture", ""))
}
