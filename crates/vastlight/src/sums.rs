//! Files of sums, added.

use crate::Error;
use crate::memory::{budget_bytes, film_bytes, refuse_beyond, rss_bytes};
use std::path::{Path, PathBuf};
use vastlight_film::{Accumulator, FilmError, FilmSettings, SumsFile, Window};

/// Edge of the tiles of sums that are added: long runs are read quickly.
const TILE: u32 = 64;

/// Adds the sums in files: the bits of one run, in any order. A single file may also be one of a picture under way.
///
/// # Errors
/// A file cannot be read or is damaged, two of them do not belong together or have passes in common, or they do not fit into
/// `memory` bytes (none for the default budget).
pub fn merge_sums(paths: &[PathBuf], memory: Option<u64>) -> Result<Accumulator, Error> {
    let mut sums: Option<Accumulator> = None;
    for path in paths {
        let file = SumsFile::open(path)?;
        check_memory(&file.settings(), sums.is_some(), memory)?;
        let refused = |e: FilmError| match e {
            FilmError::Mismatch { what } => mismatch(path, &paths[0], what),
            other => other.into(),
        };
        match &mut sums {
            None => sums = Some(file.load(TILE)?),
            Some(sums) => {
                if let Some(difference) = sums.recipe.difference(file.recipe()) {
                    let what = format!("it is of another render, by its {difference}");
                    return Err(mismatch(path, &paths[0], what));
                }
                sums.merge(&file.load(TILE)?).map_err(refused)?;
            }
        }
    }
    sums.ok_or_else(|| Error::usage("no file of sums is named", "merge", ""))
}

fn mismatch(path: &Path, first: &Path, what: String) -> Error {
    let hint = format!("it does not belong to {}", first.display());
    Error::scene(what, path.display().to_string(), hint)
}

fn check_memory(settings: &FilmSettings, is_second: bool, memory: Option<u64>) -> Result<(), Error> {
    let Window { x0, y0, x1, y1 } = settings.window;
    let pixels = u64::from(x1 - x0).saturating_mul(u64::from(y1 - y0)).min(1 << 48);
    let film = film_bytes(pixels, &settings.aovs);
    let there = if is_second { 0 } else { rss_bytes().unwrap_or(0) };
    let needed = there + if is_second { 2 * film } else { film };
    refuse_beyond(budget_bytes(memory), needed, "about", "a larger --memory")
}
