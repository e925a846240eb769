//! Errors and warnings as values: what, where, and a hint.

use serde::{Deserialize, Serialize};
use std::fmt;

/// How bad a [`Diagnostic`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Severity {
    /// Something was repaired or ignored; the picture is still what the file means, but for what is named.
    Warning,
    /// The file is wrong here; a render must not go on.
    Error,
}

/// One finding about a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// What was found, one sentence without a full stop.
    pub what: String,
    /// Where: a file, a JSON pointer, a line, an object's name.
    pub place: String,
    /// What the user can do; empty if there is nothing to say.
    pub hint: String,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_line(f, &self.what, &self.place, &self.hint)
    }
}

fn write_line(f: &mut fmt::Formatter<'_>, what: &str, place: &str, hint: &str) -> fmt::Result {
    if place.is_empty() {
        f.write_str(what)?;
    } else {
        write!(f, "{place}: {what}")?;
    }
    if hint.is_empty() { Ok(()) } else { write!(f, " ({hint})") }
}

/// Findings in order of discovery; the same finding is kept once.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Diagnostics {
    items: Vec<Diagnostic>,
}

impl Diagnostics {
    /// Adds a warning unless the same words stand for the same place already.
    pub fn warn(&mut self, what: impl Into<String>, place: impl Into<String>, hint: impl Into<String>) {
        self.push(Diagnostic {
            severity: Severity::Warning,
            what: what.into(),
            place: place.into(),
            hint: hint.into(),
        });
    }

    /// Adds an error: the scene is then refused by [`crate::Scene::new`].
    pub fn error(&mut self, what: impl Into<String>, place: impl Into<String>, hint: impl Into<String>) {
        self.push(Diagnostic {
            severity: Severity::Error,
            what: what.into(),
            place: place.into(),
            hint: hint.into(),
        });
    }

    /// Adds a finding unless it is there already.
    pub fn push(&mut self, item: Diagnostic) {
        if !self.items.contains(&item) {
            self.items.push(item);
        }
    }

    /// All findings.
    #[must_use]
    pub fn items(&self) -> &[Diagnostic] {
        &self.items
    }

    /// The first error, if there is one.
    #[must_use]
    pub fn first_error(&self) -> Option<&Diagnostic> {
        self.items.iter().find(|d| d.severity == Severity::Error)
    }
}

/// Why a scene cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    /// What is wrong, one sentence without a full stop.
    pub what: String,
    /// Where: a file, a JSON pointer, a line, an object's name.
    pub place: String,
    /// What the user can do; empty if there is nothing to say.
    pub hint: String,
}

impl SceneError {
    /// An error with its three parts.
    pub fn new(what: impl Into<String>, place: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { what: what.into(), place: place.into(), hint: hint.into() }
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_line(f, &self.what, &self.place, &self.hint)
    }
}

impl From<Diagnostic> for SceneError {
    fn from(d: Diagnostic) -> Self {
        Self { what: d.what, place: d.place, hint: d.hint }
    }
}
