//! The picture that is under way: small while its camera moves, then larger, then better.

use crate::hub::Work;
use crate::meter::Meter;
use crate::view::View;
use std::time::{Duration, Instant};
use vastlight::LivePicture;

/// Longest time between pictures that are shown of one that is refined.
const SHOWN_EVERY: Duration = Duration::from_millis(300);
/// Passes that are shown in any case.
const ALWAYS_SHOWN: u32 = 4;
/// Most samples a pixel of one pass.
const LARGEST_PASS: u32 = 4;

/// One view's picture.
pub(crate) struct Canvas {
    /// Of the scale that is under way, once it is begun.
    pub(crate) picture: Option<LivePicture>,
    /// The part of the full size.
    pub(crate) scale: f32,
    /// Whether nothing of this view was shown yet.
    pub(crate) is_first: bool,
    pub(crate) started: Instant,
    last_shown: Option<Instant>,
    is_final: bool,
}

impl Canvas {
    /// For a view that is new.
    pub(crate) fn new(view: &View, meter: &Meter) -> Self {
        let pixels = u64::from(view.size.width) * u64::from(view.size.height);
        let scale = meter.scale(pixels);
        let started = Instant::now();
        Self { picture: None, scale, is_first: true, started, last_shown: None, is_final: false }
    }

    /// Samples of all pixels, of a picture of full size.
    pub(crate) fn spp(&self) -> u32 {
        if self.scale < 1.0 { 0 } else { self.picture.as_ref().map_or(0, LivePicture::spp) }
    }

    /// Whether the picture has all the samples that are wanted.
    pub(crate) fn is_complete(&self, view: &View) -> bool {
        self.spp() >= view.render.spp
    }

    /// Whether it is a picture of full size between two passes.
    pub(crate) fn is_whole(&self) -> bool {
        self.spp() > 0 && self.picture.as_ref().is_some_and(LivePicture::is_even)
    }

    /// What there is to do, if anybody waits for a file or nobody does.
    pub(crate) fn work(&self, view: &View, is_owed: bool) -> Work {
        if is_owed && !self.is_whole() {
            Work::Owed
        } else if self.is_first {
            Work::Follow
        } else if self.spp() == 0 || !(self.is_complete(view) || view.paused) {
            Work::Refine
        } else {
            Work::None
        }
    }

    /// The samples that the next pass brings all pixels to.
    pub(crate) fn next_spp(&self, view: &View) -> u32 {
        if self.scale < 1.0 {
            return 1;
        }
        let done = self.spp();
        (done + (done / 2).clamp(1, LARGEST_PASS)).min(view.render.spp.max(1))
    }

    /// Whether a pass that is finished is shown; notes that it is.
    pub(crate) fn is_to_show(&mut self, view: &View) -> bool {
        let is_due = self.last_shown.is_none_or(|last| last.elapsed() >= SHOWN_EVERY);
        let shown =
            self.scale < 1.0 || self.spp() <= ALWAYS_SHOWN || is_due || self.is_complete(view) || view.paused;
        if shown {
            self.last_shown = Some(Instant::now());
        }
        shown
    }

    /// Whether the picture is complete now and was not shown so; notes that it is.
    pub(crate) fn becomes_final(&mut self, view: &View) -> bool {
        let is_new = self.is_complete(view) && !self.is_final;
        self.is_final |= is_new;
        is_new
    }

    /// Takes back that the picture was shown as complete: it is to be developed anew.
    pub(crate) fn is_changed(&mut self) {
        self.is_final = false;
    }

    /// Whether anything is to be rendered. More samples may be wanted than before.
    pub(crate) fn goes_on(&mut self, view: &View, is_owed: bool) -> bool {
        self.is_final &= self.is_complete(view);
        let rests = self.is_complete(view) || (view.paused && self.spp() > 0);
        !rests || (is_owed && !self.is_whole())
    }

    /// Limits the picture to the view's region, once all of it has a sample.
    pub(crate) fn limit(&mut self, view: &View) {
        let Some(picture) = &mut self.picture else { return };
        picture.limit(None);
        if self.scale == 1.0 && picture.spp() > 0 {
            picture.limit(view.region.map(|region| region.pixels(view.size)));
        }
    }

    /// Goes on to the next size after a picture that was shown.
    pub(crate) fn grow(&mut self) {
        self.is_first = false;
        if self.scale < 1.0 {
            self.scale = Meter::next_scale(self.scale);
            self.picture = None;
        }
    }
}
