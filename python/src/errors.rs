//! Errors as exceptions of `vastlight._errors`.

use pyo3::prelude::*;
use pyo3::types::PyType;
use vastlight::{Error, ErrorClass};

/// The exception's name.
fn name(class: ErrorClass) -> &'static str {
    match class {
        ErrorClass::Usage => "UsageError",
        ErrorClass::Scene | ErrorClass::NonFinite => "SceneError",
        ErrorClass::Memory => "MemoryBudgetError",
        ErrorClass::Device => "DeviceError",
        ErrorClass::Output => "OutputError",
        ErrorClass::Interrupted => "Error",
    }
}

/// The exception of an error.
pub(crate) fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let of_class = || -> PyResult<PyErr> {
        let class = py.import("vastlight._errors")?.getattr(name(error.class))?.cast_into::<PyType>()?;
        Ok(PyErr::from_type(class, (error.what.clone(), shown(&error.place), shown(&error.hint))))
    };
    of_class().unwrap_or_else(|e| e)
}

/// A part of a message in the words of Python: arguments, not flags of the command line.
fn shown(text: &str) -> String {
    let words = text.split(' ').map(|word| match word.strip_prefix("--") {
        Some(flag) if flag.starts_with(|c: char| c.is_ascii_lowercase()) => flag.replace('-', "_"),
        _ => word.to_owned(),
    });
    words.collect::<Vec<_>>().join(" ")
}

/// An error of the caller.
pub(crate) fn usage(py: Python<'_>, what: impl Into<String>, place: &str, hint: &str) -> PyErr {
    exception(py, &Error::usage(what, place, hint))
}

/// A result whose error is an exception.
pub(crate) trait OrRaise<T> {
    /// Raises the error.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for Result<T, Error> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, &error))
    }
}

/// The error of bytes that cannot be made.
pub(crate) fn not_encoded(error: &std::io::Error) -> Error {
    Error::new(ErrorClass::Output, error.to_string(), "memory", "")
}
