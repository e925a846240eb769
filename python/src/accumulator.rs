//! Sums of pictures under way.

use crate::errors::{OrRaise, not_encoded};
use crate::image::Image;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::json;
use std::borrow::Cow;
use std::path::PathBuf;
use vastlight::film::{self, SumsFile, decode_sums, encode_sums, write_sums};
use vastlight::{Merger, SUMS_TILE, merge_sums};

/// The sums of some passes of a picture.
#[pyclass(frozen, module = "vastlight._native")]
#[derive(Debug)]
pub(crate) struct Accumulator(pub(crate) film::Accumulator);

#[pymethods]
impl Accumulator {
    /// Reads the bytes of a file.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        let read = || Ok(decode_sums(bytes, SUMS_TILE, "accumulator")?);
        py.detach(read).or_raise(py).map(Self)
    }

    /// Reads a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = || Ok(SumsFile::open(&path)?.load(SUMS_TILE)?);
        py.detach(read).or_raise(py).map(Self)
    }

    /// The sum of several: the bits of one run, in any order.
    #[staticmethod]
    fn merge(py: Python<'_>, parts: Vec<Py<Self>>) -> PyResult<Self> {
        let parts: Vec<&film::Accumulator> = parts.iter().map(|part| &part.get().0).collect();
        let sum = || {
            let mut merger = Merger::default();
            for (number, part) in (1..).zip(parts) {
                merger.add(&format!("accumulator {number}"), Cow::Borrowed(part))?;
            }
            merger.finish()
        };
        py.detach(sum).or_raise(py).map(Self)
    }

    /// The sum of files, one after the other in memory.
    #[staticmethod]
    fn merge_files(py: Python<'_>, paths: Vec<PathBuf>, memory: Option<u64>) -> PyResult<Self> {
        py.detach(|| merge_sums(&paths, memory)).or_raise(py).map(Self)
    }

    /// The bytes of a file; equal sums are equal bytes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let written = || encode_sums(&self.0).map_err(|e| not_encoded(&e));
        Ok(PyBytes::new(py, &py.detach(written).or_raise(py)?))
    }

    /// Writes a file, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| Ok(write_sums(&path, &self.0)?)).or_raise(py)
    }

    /// The picture of these passes.
    fn develop(&self, py: Python<'_>) -> Image {
        let counters = self.0.counters;
        let stats = json!({
            "passes": self.0.samples().len(),
            "spp_done": self.0.blocks().least(),
            "samples": counters.samples,
            "non_finite": counters.non_finite,
            "rays": counters.rays,
            "shadow_rays": counters.shadow_rays,
        });
        Image::new(py.detach(|| self.0.develop()), stats.to_string())
    }

    /// Ranges of passes, from 0, the last of each excluded.
    #[getter]
    fn passes(&self) -> Vec<(u32, u32)> {
        self.0.samples().ranges().iter().map(|range| (range.start, range.end)).collect()
    }

    /// What must agree for two to be added, by name.
    #[getter]
    fn recipe(&self) -> Vec<(String, String)> {
        self.0.recipe.entries().to_vec()
    }

    /// Width and height of the part of the picture that is here.
    #[getter]
    fn size(&self) -> (u32, u32) {
        let window = self.0.film().settings().window;
        (window.width(), window.height())
    }
}
