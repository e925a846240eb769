//! The browser in which the interactive page is tested.

use crate::process::find_program;
use std::path::PathBuf;

/// Names of the program.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// Says in one line where the browser is, or how to get it.
pub(crate) fn report() {
    match find() {
        Some(path) => eprintln!("== browser: {}", path.display()),
        None => {
            eprintln!("== browser: missing, the page will not be tested (Debian: apt-get install chromium)");
        }
    }
}

fn find() -> Option<PathBuf> {
    let given = std::env::var_os("VASTLIGHT_CHROMIUM").map(PathBuf::from);
    given.filter(|path| path.is_file()).or_else(|| find_program(&NAMES))
}
