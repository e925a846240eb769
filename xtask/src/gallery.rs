//! Renders the pictures of docs/gallery again, from the commands that its README lists.

use crate::process::{cargo, root, step};

/// Runs every `cargo run --release -- render ...` line of docs/gallery/README.md.
pub(crate) fn run() -> Result<(), String> {
    let list = root().join("docs/gallery/README.md");
    let text = std::fs::read_to_string(&list).map_err(|e| format!("{}: {e}", list.display()))?;
    let commands: Vec<Vec<&str>> = text
        .lines()
        .filter_map(|line| line.trim().strip_prefix("cargo run --release -- render "))
        .map(|arguments| arguments.split_whitespace().collect())
        .collect();
    if commands.is_empty() {
        return Err(format!("{}: lists no command", list.display()));
    }
    for arguments in commands {
        let command = [&["run", "--quiet", "--release", "--", "render"], arguments.as_slice()].concat();
        step(&arguments.join(" "), &mut cargo(&command, &[]))?;
    }
    Ok(())
}
