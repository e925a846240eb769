//! Pictures under way in files, so that work that is interrupted goes on.

use crate::Error;
use std::ops::Range;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use vastlight_film::{Accumulator, SampleSet, SumsFile, write_sums};

/// Where a picture is kept while it is under way. The file appears whole or not at all, and stays when the picture is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    /// The file.
    pub path: PathBuf,
    /// Time between two writes; at least ten times what a write takes. It is written at the end in any case.
    pub every: Duration,
    /// Goes on with what is in the file, if it is there.
    pub resume: bool,
}

/// A write takes no more than this part of the time.
const SHARE: u32 = 10;
/// Least time between two writes: tiles must come on.
const LEAST: Duration = Duration::from_millis(1);

/// The sums that a checkpoint has, or `new` where there is none, in the tiles of `new`.
///
/// # Errors
/// The file cannot be read or is damaged, it is of another picture, or has samples that are not wanted.
pub(crate) fn restore(
    checkpoint: &Checkpoint,
    new: Accumulator,
    wanted: &Range<u32>,
) -> Result<Accumulator, Error> {
    let path = &checkpoint.path;
    if !checkpoint.resume || !path.exists() {
        return Ok(new);
    }
    let refuse = |what: String| {
        let hint = "leave --resume out to begin anew, or name another --checkpoint";
        Err(Error::scene(what, path.display().to_string(), hint))
    };
    let file = SumsFile::open(path)?;
    if let Some(difference) = file.recipe().difference(&new.recipe) {
        return refuse(format!("the checkpoint is of another render, by its {difference}"));
    }
    let settings = new.film().settings();
    if !file.settings().records_the_same(settings) {
        return refuse("the checkpoint is of another part of the picture".into());
    }
    if file.samples().beyond(wanted).is_some() {
        let (has, asked) = (file.samples(), SampleSet::from(wanted.clone()));
        return refuse(format!("the checkpoint has passes {has}, those asked for are {asked}"));
    }
    let mut sums = file.load(settings.tile_size)?;
    sums.mattes = new.mattes;
    Ok(sums)
}

/// Writes checkpoints when it is time.
pub(crate) struct Keeper<'c> {
    checkpoint: Option<&'c Checkpoint>,
    due: Option<Instant>,
}

impl<'c> Keeper<'c> {
    pub(crate) fn new(checkpoint: Option<&'c Checkpoint>) -> Self {
        let due = checkpoint.and_then(|c| Instant::now().checked_add(c.every.max(LEAST)));
        Self { checkpoint, due }
    }

    /// When the next is to be written.
    pub(crate) fn due(&self) -> Option<Instant> {
        self.due
    }

    /// Whether it is time.
    pub(crate) fn is_due(&self) -> bool {
        self.due.is_some_and(|due| Instant::now() >= due)
    }

    /// Writes what there is, if there is anything and it is to be kept.
    pub(crate) fn save(&mut self, sums: &Accumulator) -> Result<(), Error> {
        let Some(checkpoint) = self.checkpoint else { return Ok(()) };
        let start = Instant::now();
        if sums.blocks().samples() > 0 {
            write_sums(&checkpoint.path, sums)?;
        }
        let pause = checkpoint.every.max(start.elapsed() * SHARE).max(LEAST);
        self.due = Instant::now().checked_add(pause);
        Ok(())
    }
}
