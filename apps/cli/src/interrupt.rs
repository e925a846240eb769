//! Ctrl-C: the first stops the work cleanly, the second at once. SIGUSR1: a look at the picture so far.

use std::sync::Arc;
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

/// A flag that SIGUSR1 sets, where there are such signals.
pub(crate) fn snapshot_flag() -> Result<Arc<AtomicBool>, Error> {
    let flag = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&flag))
        .map_err(|e| Error::usage(e.to_string(), "SIGUSR1", ""))?;
    Ok(flag)
}
