//! The interactive page.

use crate::arguments::arguments;
use crate::errors::{OrRaise, usage};
use pyo3::prelude::*;
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use vastlight::CameraChoice;
use vastlight_viewer::Viewer;

/// A page's server, on threads of its own.
#[pyclass(frozen, module = "vastlight._native")]
#[derive(Debug)]
pub(crate) struct Server {
    url: String,
    server: Mutex<Option<vastlight_viewer::Server>>,
}

impl Server {
    /// Shows a scene.
    pub(crate) fn start(py: Python<'_>, viewer: Viewer) -> PyResult<Self> {
        let server = py.detach(|| vastlight_viewer::Server::start(viewer)).or_raise(py)?;
        Ok(Self { url: server.url().to_owned(), server: Mutex::new(Some(server)) })
    }
}

arguments! {
    /// Where a page is, and from where it looks.
    pub(crate) struct Page {
        host: String,
        port: u16,
        spp: u32,
        camera: Option<String>,
    }
}

impl Page {
    /// Puts it into what is shown.
    pub(crate) fn apply(self, py: Python<'_>, viewer: Viewer) -> PyResult<Viewer> {
        let host: IpAddr = self
            .host
            .parse()
            .map_err(|_| usage(py, "this is no address", &self.host, "such as 127.0.0.1"))?;
        let camera = CameraChoice { name: self.camera, ..CameraChoice::default() };
        Ok(Viewer { host, port: self.port, spp: self.spp, camera, ..viewer })
    }
}

#[pymethods]
impl Server {
    /// The page's address, with its token.
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    /// Ends it.
    fn close(&self, py: Python<'_>) {
        let server = self.server.lock().unwrap_or_else(PoisonError::into_inner).take();
        py.detach(|| drop(server));
    }
}
