//! Ctrl-C: the first stops the work cleanly, the second at once.

use std::sync::atomic::{AtomicBool, Ordering};
use vastlight::Error;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// A flag that Ctrl-C and termination requests set.
pub(crate) fn flag() -> Result<&'static AtomicBool, Error> {
    let handler = || {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    };
    ctrlc::set_handler(handler).map_err(|e| Error::usage(e.to_string(), "Ctrl-C", ""))?;
    Ok(&INTERRUPTED)
}
