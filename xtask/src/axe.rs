//! axe-core, which looks for what people cannot use on the interactive page. It is under the MPL and no part of this repository: npm
//! fetches it where it is there.

use crate::process::root;
use std::path::Path;
use std::process::{Command, Stdio};

/// The version, and what its archive must be.
const VERSION: &str = "4.10.3";
const INTEGRITY: &str =
    "sha512-Xm7bpRXnDSX2YE2YFfBk2FnF0ep6tmG7xPh8iHee8MIcrgq762Nkce856dYtJYLkuIoYZvGfTs/PbZhideTcEg==";

/// Fetches it to where the page's tests look for it; says in one line how that went.
pub(crate) fn find_or_fetch() {
    let folder = root().join("target/axe");
    let is_there = || folder.join("node_modules/axe-core/axe.min.js").is_file();
    let is_known =
        std::fs::read_to_string(folder.join("package-lock.json")).is_ok_and(|known| known == lock());
    if (is_known && is_there()) || (fetch(&folder).is_ok_and(|succeeded| succeeded) && is_there()) {
        eprintln!("== axe-core: {VERSION}, {}", folder.display());
    } else {
        eprintln!(
            "== axe-core: missing, the page's accessibility will not be tested with it (npm fetches it)"
        );
    }
}

/// Lets npm install what is locked, without running anything of it.
fn fetch(folder: &Path) -> std::io::Result<bool> {
    std::fs::create_dir_all(folder)?;
    std::fs::write(
        folder.join("package.json"),
        format!("{{\"dependencies\":{{\"axe-core\":\"{VERSION}\"}}}}\n"),
    )?;
    std::fs::write(folder.join("package-lock.json"), lock())?;
    let mut npm = Command::new("npm");
    npm.current_dir(folder).args(["ci", "--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=1"]);
    npm.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    Ok(npm.status()?.success())
}

fn lock() -> String {
    let archive = format!("https://registry.npmjs.org/axe-core/-/axe-core-{VERSION}.tgz");
    let package =
        format!("\"version\":\"{VERSION}\",\"resolved\":\"{archive}\",\"integrity\":\"{INTEGRITY}\"");
    format!(
        "{{\"lockfileVersion\":3,\"packages\":{{\"\":{{\"dependencies\":{{\"axe-core\":\"{VERSION}\"}}}},\
         \"node_modules/axe-core\":{{{package}}}}}}}\n"
    )
}
