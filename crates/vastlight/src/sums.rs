//! Files of sums, added.

use crate::Error;
use crate::memory::{budget_bytes, film_bytes, refuse_beyond, rss_bytes};
use std::borrow::Cow;
use std::path::PathBuf;
use vastlight_film::{Accumulator, FilmError, FilmSettings, Mosaic, SumsFile, Window};

/// Edge of the tiles of sums that are read: long runs are read quickly.
pub const SUMS_TILE: u32 = 64;

/// Adds sums that come one after the other, and puts parts of a picture side by side: the bits of one run, in any order.
#[derive(Debug, Default)]
pub struct Merger {
    mosaic: Mosaic,
    first: Option<String>,
}

impl Merger {
    /// Adds sums, which messages call `place`; says whether they are the first of their part.
    ///
    /// # Errors
    /// They do not belong to those before, or have passes in common with them.
    pub fn add(&mut self, place: &str, sums: Cow<'_, Accumulator>) -> Result<bool, Error> {
        let first = self.first.get_or_insert_with(|| place.to_owned());
        self.mosaic.add(sums).map_err(|error| match error {
            FilmError::Mismatch { what } => {
                Error::scene(what, place, format!("it does not belong to {first}"))
            }
            other => other.into(),
        })
    }

    /// The sums of all. Those of a single part may be of a picture under way.
    ///
    /// # Errors
    /// There are none, or parts overlap or leave gaps.
    pub fn finish(self) -> Result<Accumulator, Error> {
        let sums = self.mosaic.finish().map_err(|error| match error {
            FilmError::Mismatch { what } => {
                Error::scene(what, "merge", "parts of a picture fill a rectangle")
            }
            other => other.into(),
        })?;
        sums.ok_or_else(|| Error::usage("there is nothing to add", "merge", ""))
    }
}

/// Adds the sums in files: see [`Merger`].
///
/// # Errors
/// A file cannot be read or is damaged, those of [`Merger`], or they do not fit into `memory` bytes (none for the default budget).
pub fn merge_sums(paths: &[PathBuf], memory: Option<u64>) -> Result<Accumulator, Error> {
    let (mut merger, mut held) = (Merger::default(), rss_bytes().unwrap_or(0));
    for path in paths {
        let file = SumsFile::open(path)?;
        let bytes = bytes_of(&file.settings());
        refuse_beyond(budget_bytes(memory), held.saturating_add(bytes), "about", "a larger --memory")?;
        if merger.add(&path.display().to_string(), Cow::Owned(file.load(SUMS_TILE)?))? {
            held += bytes;
        }
    }
    merger.finish()
}

fn bytes_of(settings: &FilmSettings) -> u64 {
    let Window { x0, y0, x1, y1 } = settings.window;
    let pixels = u64::from(x1 - x0).saturating_mul(u64::from(y1 - y0)).min(1 << 48);
    film_bytes(pixels, &settings.aovs)
}
