//! The browser in which the interactive page is tested.

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
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&folders).collect();
    let named = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    given.into_iter().chain(named).find(|path| path.is_file())
}
