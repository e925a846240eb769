//! Running the command in a folder of its own.
#![allow(dead_code, reason = "each test file uses a part")]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// A temporary folder in which the command runs.
pub(crate) struct Workspace(tempfile::TempDir);

/// How a run ended.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Outcome {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Outcome {
    /// Runs to the end.
    pub(crate) fn of(command: &mut Command) -> Self {
        let output = command.output().expect("started");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
        Self {
            code: output.status.code().unwrap_or_else(|| panic!("{command:?}: {}", output.status)),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// It is one line of an error with that exit code, which says `text`.
    #[track_caller]
    pub(crate) fn is_refusal(&self, code: i32, text: &str) {
        let is_line = self.stderr.starts_with("error: ") && self.stderr.lines().count() == 1;
        assert!(self.code == code && is_line && self.stderr.contains(text), "{code}, {text}: {self:?}");
        assert_eq!(self.stdout, "", "{self:?}");
    }
}

impl Workspace {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("temporary folder"))
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vastlight"));
        command.current_dir(self.0.path()).args(arguments.split_whitespace());
        command
    }

    /// Runs to the end.
    pub(crate) fn run(&self, arguments: &str) -> Outcome {
        Outcome::of(&mut self.command(arguments))
    }

    /// Runs to the end, which must be one line of an error with that exit code; the line.
    #[track_caller]
    pub(crate) fn refused(&self, arguments: &str, code: i32, text: &str) -> String {
        println!("{arguments}");
        let outcome = self.run(arguments);
        outcome.is_refusal(code, text);
        outcome.stderr
    }

    /// Runs to the end with a variable in the environment.
    pub(crate) fn run_with(&self, variable: &str, value: &Path, arguments: &str) -> Outcome {
        Outcome::of(self.command(arguments).env(variable, value))
    }

    /// Runs to the end in a shell that does something before.
    pub(crate) fn in_shell(&self, before: &str, arguments: &str) -> Outcome {
        let script = format!("{before}; exec {} {arguments}", env!("CARGO_BIN_EXE_vastlight"));
        Outcome::of(Command::new("sh").current_dir(self.0.path()).args(["-c", &script]))
    }

    /// Starts with stderr piped.
    pub(crate) fn spawn(&self, arguments: &str) -> Child {
        self.command(arguments).stderr(Stdio::piped()).spawn().expect("started")
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).expect("written")
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.bytes(name)).expect("JSON")
    }

    /// Names of all files, hidden ones too, sorted.
    pub(crate) fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).expect("listed");
        let mut names: Vec<String> =
            entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

/// Reads stderr until a line contains `text`.
pub(crate) fn wait_for_line(child: &mut Child, text: &str) {
    let stderr = child.stderr.as_mut().expect("piped");
    let found = BufReader::new(stderr).lines().any(|line| line.is_ok_and(|l| l.contains(text)));
    assert!(found, "no line with {text}");
}

/// Sends what Ctrl-C sends.
pub(crate) fn interrupt(child: &Child) {
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("started");
    assert!(status.success());
}
