//! The documents as a site, by mdBook.

use crate::process::{find_program, root, step};
use crate::test::Tally;
use std::path::PathBuf;
use std::process::Command;

const MISSING: &str = "mdbook is missing (cargo install mdbook --locked)";

/// Builds target/book from docs.
pub(crate) fn run() -> Result<(), String> {
    let mdbook = find().ok_or(MISSING)?;
    build(mdbook)?;
    println!("{}", root().join("target/book/index.html").display());
    Ok(())
}

/// The same where mdBook is there; else it is skipped.
pub(crate) fn test(tally: &mut Tally) -> Result<(), String> {
    match find() {
        Some(mdbook) => build(mdbook),
        None => {
            tally.skip(&format!("book: {MISSING}"));
            Ok(())
        }
    }
}

fn build(mdbook: PathBuf) -> Result<(), String> {
    step("book", Command::new(mdbook).args(["build", "docs"]).current_dir(root()))
}

/// On the path, or where cargo installs programs.
fn find() -> Option<PathBuf> {
    let cargo = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let cargo = cargo.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let installed =
        cargo.map(|folder| folder.join("bin").join(format!("mdbook{}", std::env::consts::EXE_SUFFIX)));
    find_program(&["mdbook"]).or(installed.filter(|path| path.is_file()))
}
