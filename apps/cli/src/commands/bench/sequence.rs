//! What benchmarks of scenes that move through frames are asked.

use crate::arguments::SceneArguments;
use crate::values::{self, Frames, Resolution};
use clap::Args;

#[derive(Args, Debug)]
pub(super) struct Sequence {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Frames
    #[arg(short, long, value_name = "A-BxS", default_value = "0-71", value_parser = values::frames)]
    frames: Frames,
    /// Frames a second
    #[arg(long, value_name = "N", default_value_t = 24.0, value_parser = values::positive)]
    fps: f32,
    /// Columns and rows of the camera's rays
    #[arg(short, long, value_name = "SIZE", default_value = "640x480", value_parser = values::resolution)]
    resolution: Resolution,
}

impl Sequence {
    /// The moments of the frames, in seconds.
    pub(super) fn times(&self) -> Vec<f32> {
        self.frames.iter().map(|frame| values::moment(frame, self.fps)).collect()
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        self.resolution.size(None).into()
    }
}
