//! Running other programs from the workspace's root.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The workspace's root folder.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_path_buf).unwrap_or_default()
}

/// The first of these programs on the path.
pub(crate) fn find_program(names: &[&str]) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&folders).collect();
    let file = |name: &str| format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let mut paths = names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(file(name))));
    paths.find(|path| path.is_file())
}

/// Cargo with these arguments and environment, from the root.
pub(crate) fn cargo(arguments: &[&str], environment: &[(&str, &str)]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root()).args(arguments).envs(environment.iter().copied()).stdin(Stdio::null());
    command
}

/// Runs a step to its end and says which one failed.
pub(crate) fn step(title: &str, command: &mut Command) -> Result<(), String> {
    eprintln!("== {title}");
    let status = command.status().map_err(|e| format!("{title}: cannot start {command:?}: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("{title}: failed ({status})")) }
}

/// Runs a step and hands every line of its standard output to `each`; true if it succeeded.
pub(crate) fn lines(command: &mut Command, mut each: impl FnMut(&str)) -> Result<bool, String> {
    let mut child =
        command.stdout(Stdio::piped()).spawn().map_err(|e| format!("cannot start {command:?}: {e}"))?;
    if let Some(stdout) = child.stdout.take() {
        for line in BufReader::new(stdout).split(b'\n') {
            let line = line.map_err(|e| format!("cannot read the output of {command:?}: {e}"))?;
            each(String::from_utf8_lossy(&line).trim_end());
        }
    }
    child.wait().map(|status| status.success()).map_err(|e| format!("{command:?} was lost: {e}"))
}

/// All that failed, one a line; what comes after a failure is done as well.
pub(crate) fn together(outcomes: impl IntoIterator<Item = Result<(), String>>) -> Result<(), String> {
    let failed: Vec<String> = outcomes.into_iter().filter_map(Result::err).collect();
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_failed_stops_nothing_and_is_named() {
        let mut done = Vec::new();
        let steps = ["a", "b", "c", "d"].map(|name| (name, ["b", "d"].contains(&name)));
        let outcome = together(steps.iter().map(|&(name, fails)| {
            done.push(name);
            if fails { Err(format!("{name}: failed")) } else { Ok(()) }
        }));
        assert_eq!(outcome, Err("b: failed\nd: failed".to_owned()));
        assert_eq!(done, ["a", "b", "c", "d"]);
        assert_eq!(together([Ok(()), Ok(())]), Ok(()));
    }
}
