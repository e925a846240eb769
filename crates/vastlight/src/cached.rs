//! Scenes that do not fit into memory, packed once to a folder.

use crate::pack::identity;
use crate::{Error, ErrorClass, LoadOptions, PackControl, check_fits, pack_input, pack_within};
use std::path::{Path, PathBuf};
use vastlight_store::PackConfig;

/// The store of a scene that will not fit into `control.memory` bytes, in the folder `cache`: packed there, if it is not yet. None
/// for a scene that fits.
///
/// # Errors
/// Those of [`pack_input`] and [`pack_within`], and if the folder cannot be made.
pub fn cached_store(
    source: &str,
    options: &LoadOptions,
    cache: &Path,
    control: PackControl<'_>,
) -> Result<Option<PathBuf>, Error> {
    match check_fits(source, options, control.memory) {
        Ok(()) => return Ok(None),
        Err(error) if error.class == ErrorClass::Memory => {}
        Err(error) => return Err(error),
    }
    let input = pack_input(&[source.to_owned()], options, control.memory)?;
    let made = std::fs::create_dir_all(cache);
    made.map_err(|e| Error::new(ErrorClass::Output, e.to_string(), cache.display().to_string(), ""))?;
    let config = PackConfig::default();
    // The same store whatever the budget is: where buckets end does not matter to a picture.
    let identity = identity(&input, &config, None)?;
    let stem = source.rsplit(['/', '\\', ':']).next().unwrap_or(source);
    let other = identity.iter().rev().copied().collect::<Vec<u8>>();
    let [a, b] = [&identity, &other].map(|bytes| crc32fast::hash(bytes));
    let path = cache.join(format!("{stem}-{a:08x}{b:08x}.vls"));
    if !path.exists() {
        pack_within(input, &path, &config, control)?;
    }
    Ok(Some(path))
}
