//! Flags of `render` that cut the work into parts, and keep them.

use crate::output::numbered;
use crate::values;
use clap::Args;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;
use vastlight::film::check_writable;
use vastlight::{Checkpoint, Error, RenderRequest};

/// Which samples are taken, and where the sums are kept meanwhile.
#[derive(Args, Debug)]
#[command(next_help_heading = "Options for long work")]
pub(crate) struct KeepArguments {
    /// Only these passes of --spp, numbered from 1, such as 17-32; a pass is one sample a pixel. Write them to .vlc, for `merge`
    #[arg(long, value_name = "A-B", value_parser = values::passes, conflicts_with = "noise")]
    passes: Option<Range<u32>>,
    /// Parts of the picture are done when their relative error is this (the root of what `diff` calls relmse), such as 0.01; --spp is
    /// then the most that they get
    #[arg(long, value_name = "ERROR", value_parser = values::positive)]
    noise: Option<f32>,
    /// Keep the picture under way in this file (see docs/checkpoints.md); with --frames its name has ####
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Time between two checkpoints
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = values::duration, requires = "checkpoint")]
    checkpoint_every: Duration,
    /// Go on where the checkpoint was written; where there is none, begin. Frames that are done are skipped
    #[arg(long, requires = "checkpoint")]
    resume: bool,
}

impl KeepArguments {
    /// Everything that can be found out before the work.
    pub(crate) fn check(&self, is_sequence: bool) -> Result<(), Error> {
        let Some(path) = &self.checkpoint else { return Ok(()) };
        let place = path.display().to_string();
        match (is_sequence, numbered(path, 0).is_some()) {
            (true, false) => {
                let what = "several frames need a place for their number in the checkpoint's name";
                return Err(Error::usage(what, place, "write to frame.####.vlc or the like"));
            }
            (false, true) => {
                let what = "#### in a checkpoint's name stands for the number of a frame";
                return Err(Error::usage(what, place, "say which with --frames, or take another name"));
            }
            _ => {}
        }
        Ok(check_writable(path)?)
    }

    /// Adds what was asked for to the request of a picture, or of a frame.
    pub(crate) fn apply(&self, request: &mut RenderRequest, frame: Option<u32>) {
        request.passes.clone_from(&self.passes);
        request.noise = self.noise;
        request.checkpoint = self.of_frame(frame).map(|path| Checkpoint {
            path,
            every: self.checkpoint_every,
            resume: self.resume,
        });
    }

    fn of_frame(&self, frame: Option<u32>) -> Option<PathBuf> {
        let path = self.checkpoint.as_ref()?;
        Some(frame.and_then(|frame| numbered(path, frame)).unwrap_or_else(|| path.clone()))
    }

    /// Whether a frame is done: its picture is there, and its checkpoint is not.
    pub(crate) fn is_done(&self, frame: u32, picture: &Path) -> bool {
        self.resume && picture.exists() && self.of_frame(Some(frame)).is_some_and(|path| !path.exists())
    }

    /// Removes the checkpoint of a frame whose picture is written.
    pub(crate) fn forget(&self, frame: u32) {
        if let Some(path) = self.of_frame(Some(frame)) {
            // If it stays, the frame is developed from it once more, with the same bytes.
            let _ = std::fs::remove_file(path);
        }
    }
}
