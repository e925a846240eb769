//! Builds the stand-in for the library.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::print_stdout, reason = "what is skipped is named")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// A library that stands in for Open Image Denoise.
pub(crate) struct Fake {
    folder: tempfile::TempDir,
}

impl Fake {
    /// Builds one in which this fails ("device", "execute", or "" for nothing); none without a compiler, which is said.
    pub(crate) fn new(fails: &str) -> Option<Self> {
        let fake = Self { folder: tempfile::tempdir().expect("temporary folder") };
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the workspace");
        let mut compiler = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
        compiler.args(["--edition", "2024", "--crate-type", "cdylib", "--crate-name", "fake_oidn", "-o"]);
        compiler.arg(fake.library()).arg(source.join("crates/denoise/tests/fake/oidn.rs"));
        compiler.env("FAKE_LOG", fake.log_file()).env("FAKE_FAIL", fails);
        match compiler.output() {
            Ok(output) => {
                assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
                Some(fake)
            }
            Err(error) => {
                println!("skipped: the stand-in for Open Image Denoise: rustc cannot be started ({error})");
                None
            }
        }
    }

    /// The library's file.
    pub(crate) fn library(&self) -> PathBuf {
        self.folder.path().join(format!("fake{}", std::env::consts::DLL_SUFFIX))
    }

    fn log_file(&self) -> PathBuf {
        self.folder.path().join("log")
    }

    /// What it was told so far.
    pub(crate) fn log(&self) -> Vec<String> {
        let text = std::fs::read_to_string(self.log_file()).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }
}
