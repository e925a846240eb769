//! Files of sums, added.

use crate::Error;
use crate::memory::{budget_bytes, film_bytes, refuse_beyond, rss_bytes};
use std::path::{Path, PathBuf};
use vastlight_film::{Accumulator, FilmError, FilmSettings, Mosaic, SumsFile, Window};

/// Edge of the tiles of sums that are added: long runs are read quickly.
const TILE: u32 = 64;

/// Adds the sums in files, and puts parts of a picture side by side: the bits of one run, in any order. A single file may also be one of
/// a picture under way.
///
/// # Errors
/// A file cannot be read or is damaged, two of them do not belong together or have passes in common, parts leave gaps, or they do not
/// fit into `memory` bytes (none for the default budget).
pub fn merge_sums(paths: &[PathBuf], memory: Option<u64>) -> Result<Accumulator, Error> {
    let (mut mosaic, mut held) = (Mosaic::default(), rss_bytes().unwrap_or(0));
    for path in paths {
        let file = SumsFile::open(path)?;
        let bytes = bytes_of(&file.settings());
        refuse_beyond(budget_bytes(memory), held.saturating_add(bytes), "about", "a larger --memory")?;
        let refused = |e: FilmError| match e {
            FilmError::Mismatch { what } => mismatch(path, &paths[0], what),
            other => other.into(),
        };
        if mosaic.add(file.load(TILE)?).map_err(refused)? {
            held += bytes;
        }
    }
    let refused = |e: FilmError| match e {
        FilmError::Mismatch { what } => Error::scene(what, "merge", "parts of a picture fill a rectangle"),
        other => other.into(),
    };
    let sums = mosaic.finish().map_err(refused)?;
    sums.ok_or_else(|| Error::usage("no file of sums is named", "merge", ""))
}

fn mismatch(path: &Path, first: &Path, what: String) -> Error {
    let hint = format!("it does not belong to {}", first.display());
    Error::scene(what, path.display().to_string(), hint)
}

fn bytes_of(settings: &FilmSettings) -> u64 {
    let Window { x0, y0, x1, y1 } = settings.window;
    let pixels = u64::from(x1 - x0).saturating_mul(u64::from(y1 - y0)).min(1 << 48);
    film_bytes(pixels, &settings.aovs)
}
