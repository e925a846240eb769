//! The Python package, tested as its users have it: in an environment with NumPy alone, then with each extra.

use crate::process::{cargo, lines, root, step, together};
use crate::test::{FEATURES, Tally};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Oldest Python, minor version.
const OLDEST: u32 = 10;

/// Tests that need packages beside NumPy.
const EXTRAS: [&str; 3] = ["test_extras.py", "test_cluster.py", "test_usd.py"];

/// Builds the package with what the tests of the workspace have built already, and tests it. What cannot be had is skipped.
pub(crate) fn test(tally: &mut Tally) -> Result<(), String> {
    eprintln!("== python");
    let Some(python) = find() else {
        tally.skip(&format!("python: no python3 of at least 3.{OLDEST}"));
        return Ok(());
    };
    let folder = root().join("target/python");
    let Some(plain) = environment(&python, &folder.join("plain"), "requirements-test.txt") else {
        tally.skip("python: no environment with NumPy and pytest can be made (is PyPI reachable?)");
        return Ok(());
    };
    let package = package(&folder.join("package"))?;
    let alone = pytest(&plain, Some(&package), &without_extras(), tally);
    let extras: Vec<String> = EXTRAS.iter().map(|file| format!("python/tests/{file}")).collect();
    let with_extras = match environment(&python, &folder.join("extras"), "requirements-extras.txt") {
        Some(rich) => pytest(&rich, Some(&package), &extras, tally),
        None => {
            tally.skip("python: the extras cannot be had");
            Ok(())
        }
    };
    together([alone, with_extras])
}

/// Leaves the tests out that need packages beside NumPy.
fn without_extras() -> Vec<String> {
    EXTRAS.iter().map(|file| format!("--ignore=python/tests/{file}")).collect()
}

/// Builds the wheel as it is published, and tests it in an environment with NumPy alone.
pub(crate) fn wheel() -> Result<(), String> {
    let python = find().ok_or_else(|| format!("no python3 of at least 3.{OLDEST}"))?;
    let folder = root().join("target/python");
    let clean = environment(&python, &folder.join("wheel"), "requirements-test.txt")
        .ok_or("no environment can be made (is PyPI reachable?)")?;
    let wheels = root().join("target/wheels");
    let mut build = in_root(&clean, &["-m", "maturin", "build", "--release", "--locked", "--out"]);
    step("wheel", build.arg(&wheels))?;
    let mut install = in_root(&clean, &["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"]);
    step("installation", install.arg(newest(&wheels)?))?;
    let mut tally = Tally::default();
    pytest(&clean, None, &without_extras(), &mut tally)?;
    tally.conclude("wheel", true)
}

/// The wheel that was made last.
fn newest(folder: &Path) -> Result<PathBuf, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let wheels = entries.flatten().filter(|entry| entry.path().extension().is_some_and(|e| e == "whl"));
    let newest = wheels.max_by_key(|entry| entry.metadata().and_then(|m| m.modified()).ok());
    newest.map(|entry| entry.path()).ok_or_else(|| format!("{}: there is no wheel", folder.display()))
}

/// A Python that is new enough.
fn find() -> Option<PathBuf> {
    let check = format!("import sys, venv, ensurepip; sys.exit(sys.version_info < (3, {OLDEST}))");
    let fits = |name: &str| {
        let mut command = Command::new(name);
        command.args(["-c", &check]).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    ["python3", "python"].into_iter().find(|name| fits(name)).map(PathBuf::from)
}

/// The Python of an environment with the packages of a list, which is made if it is not there.
fn environment(python: &Path, folder: &Path, list: &str) -> Option<PathBuf> {
    let own = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let quietly = |command: &mut Command| {
        let command = command.stdin(Stdio::null()).stdout(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    if !own.exists() && !quietly(Command::new(python).args(["-m", "venv"]).arg(folder)) {
        return None;
    }
    let lists = ["requirements-test.txt", list].map(|list| format!("python/{list}"));
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1"];
    let mut install = in_root(&own, &pip);
    quietly(install.args(["-r", &lists[0], "-r", &lists[1]])).then_some(own)
}

/// A Python at work in the workspace's root.
fn in_root(python: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(python);
    command.current_dir(root()).args(arguments).stdin(Stdio::null());
    command
}

/// A folder with the package as it lies in a wheel. Its native half has the features of the workspace's tests, so that nothing else is
/// built for it.
fn package(folder: &Path) -> Result<PathBuf, String> {
    let arguments = ["build", "--workspace", "--features", FEATURES, "--lib", "--bins", "--tests"];
    step("native half", &mut cargo(&arguments, &[]))?;
    let target = root().join("target/debug");
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let built = target.join(format!("{prefix}_native{suffix}"));
    let inside = folder.join("vastlight");
    let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(failed)?;
    }
    std::fs::create_dir_all(&inside).map_err(failed)?;
    for entry in std::fs::read_dir(root().join("python/vastlight")).map_err(failed)?.flatten() {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), inside.join(entry.file_name())).map_err(failed)?;
        }
    }
    let native = if cfg!(windows) { "_native.pyd" } else { "_native.abi3.so" };
    std::fs::copy(built, inside.join(native)).map_err(failed)?;
    Ok(folder.to_owned())
}

/// Runs tests, and counts them.
fn pytest(python: &Path, package: Option<&Path>, chosen: &[String], tally: &mut Tally) -> Result<(), String> {
    let mut command = in_root(python, &["-m", "pytest", "-q", "-rs", "--color=no"]);
    command.args(chosen).env("PYTHONDONTWRITEBYTECODE", "1");
    if let Some(package) = package {
        command.env("PYTHONPATH", package);
    }
    let built = root().join("target/debug").join(format!("vastlight{}", std::env::consts::EXE_SUFFIX));
    if built.exists() {
        command.env("VASTLIGHT_COMMAND", built);
    }
    let succeeded = lines(&mut command, |line| tally.read_pytest(line))?;
    if succeeded { Ok(()) } else { Err("python: failed".into()) }
}
