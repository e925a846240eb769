//! Scenes that do not fit into memory, packed once to a folder.

use crate::budget::check_fits;
use crate::load::{keeps_motion, request_of};
use crate::pack::identity;
use crate::{
    Error, ErrorClass, LoadOptions, OpenScene, PackControl, is_store, open, pack_input, pack_within,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use vastlight_paging::{FileSource, KernelCache};
use vastlight_store::{PackConfig, SourceFile, Store};

/// A store in the folder of those that do not fit.
#[derive(Clone, Debug, PartialEq)]
pub struct CachedStore {
    /// The file.
    pub path: PathBuf,
    /// The moment in seconds to open it at; none for a store that was packed for its moment.
    pub time: Option<f32>,
}

/// The store of a scene that will not fit into `control.memory` bytes, in the folder `cache`: packed there, if it is not yet, or
/// if a file of the scene is another one by now. None for a scene that fits. A store that is there is found without reading the scene.
/// One store serves all moments of a scene whose movement it keeps.
///
/// # Errors
/// Those of [`pack_input`] and [`pack_within`], and if the folder cannot be made.
pub fn cached_store(
    source: &str,
    options: &LoadOptions,
    cache: &Path,
    control: PackControl<'_>,
) -> Result<Option<CachedStore>, Error> {
    match check_fits(source, options, control.memory) {
        Ok(()) => return Ok(None),
        Err(error) if error.class == ErrorClass::Memory => {}
        Err(error) => return Err(error),
    }
    let config = PackConfig::default();
    let time = if options.time.is_some() && keeps_motion(source, options)? { options.time } else { None };
    let options = &LoadOptions { time: options.time.filter(|_| time.is_none()), ..options.clone() };
    // The same store whatever the budget is: where buckets end does not matter to a picture.
    let (given, settings) = request_of(source, options)?;
    let identity = identity(&given, &settings, &config, None)?;
    let stem = source.rsplit(['/', '\\', ':']).next().unwrap_or(source);
    let other = identity.iter().rev().copied().collect::<Vec<u8>>();
    let [a, b] = [&identity, &other].map(|bytes| crc32fast::hash(bytes));
    let path = cache.join(format!("{stem}-{a:08x}{b:08x}.vls"));
    if is_current(&path) {
        return Ok(Some(CachedStore { path, time }));
    }
    let made = std::fs::create_dir_all(cache);
    made.map_err(|e| Error::new(ErrorClass::Output, e.to_string(), cache.display().to_string(), ""))?;
    let input = pack_input(&[source.to_owned()], options, control.memory)?;
    match pack_within(input, &path, &config, control) {
        // Another process may have packed it meanwhile.
        Err(_) if is_current(&path) => Ok(Some(CachedStore { path, time })),
        packed => packed.map(|_| Some(CachedStore { path, time })),
    }
}

/// Opens a scene within `control.memory` bytes: one that does not fit is packed to the folder `cache`, if there is one.
///
/// # Errors
/// Those of [`open`] and [`cached_store`], or the scene does not fit and there is no folder.
pub fn open_within(
    source: &str,
    options: &LoadOptions,
    cache: Option<&Path>,
    control: PackControl<'_>,
) -> Result<OpenScene, Error> {
    if is_store(source) {
        return open(source, options);
    }
    let Some(cache) = cache else {
        check_fits(source, options, control.memory)?;
        return open(source, options);
    };
    let memory = control.memory;
    match cached_store(source, options, cache, control)? {
        // What options change is in the store already.
        Some(CachedStore { path, time }) => {
            open(&path.display().to_string(), &LoadOptions { time, ..LoadOptions::within(memory) })
        }
        None => open(source, options),
    }
}

/// Whether a store is there that can be read, and all that it was made of is as it was.
fn is_current(path: &Path) -> bool {
    let Ok(file) = FileSource::open(path, KernelCache::Keep) else { return false };
    let store = Store::open(Arc::new(file));
    store.is_ok_and(|store| !store.pages.sources.iter().any(SourceFile::has_changed))
}
