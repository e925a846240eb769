//! The native half of the Python package `vastlight`: conversions between Python and the facade crate. What users see is in
//! `python/vastlight`.

mod accumulator;
mod arguments;
mod arrays;
mod changes;
mod errors;
mod image;
mod pool;
mod rays;
mod render;
mod scene;
mod view;
mod work;

/// The module `vastlight._native`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::accumulator::Accumulator;
    #[pymodule_export]
    use crate::image::Image;
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::view::Server;

    /// Bytes of a size in words; `name` is the argument.
    #[pyo3::pyfunction]
    fn parse_bytes(py: pyo3::Python<'_>, text: &str, name: &str) -> pyo3::PyResult<u64> {
        vastlight::parse_bytes(text).map_err(|what| crate::errors::usage(py, what, name, ""))
    }

    /// The package's version.
    #[pyo3::pyfunction]
    fn version() -> &'static str {
        env!("CARGO_PKG_VERSION")
    }
}
