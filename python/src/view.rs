//! The live view.

use crate::error::raised;
use crate::scene::SceneFile;
use crate::volume::Volume;
use pyo3::prelude::*;
use slicestack::Settings;
use slicestack::view::Server;
use std::sync::{Mutex, PoisonError};

/// A server of the live view, for browsers of this machine.
#[pyclass(frozen, module = "slicestack._slicestack")]
pub(crate) struct View {
    server: Mutex<Option<Server>>,
    url: String,
    port: u16,
    notes: Vec<String>,
    warnings: Vec<String>,
}

#[pymethods]
impl View {
    /// Starts it; its page may be shown in frames of the origins `ancestors`.
    #[new]
    #[pyo3(signature = (scene, volume, *, port = 0, threads = None, ancestors = Vec::new(), title = None))]
    fn new(
        py: Python<'_>,
        scene: &SceneFile,
        volume: &Volume,
        port: u16,
        threads: Option<usize>,
        ancestors: Vec<String>,
        title: Option<String>,
    ) -> PyResult<Self> {
        let builder = Server::builder(scene.0.clone(), volume.inner.clone()).port(port).frame_ancestors(ancestors);
        let builder = builder.settings(Settings::new().threads(threads));
        let builder = match title {
            Some(title) => builder.title(title),
            None => builder,
        };
        let server = py.detach(|| builder.start()).map_err(raised)?;
        let (url, port) = (server.url(), server.port());
        let (notes, warnings) = (server.notes().to_vec(), server.warnings().to_vec());
        Ok(Self { server: Mutex::new(Some(server)), url, port, notes, warnings })
    }

    /// Its address, with the token in it.
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    #[getter]
    fn port(&self) -> u16 {
        self.port
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Ends it.
    fn stop(&self, py: Python<'_>) {
        let server = self.server.lock().unwrap_or_else(PoisonError::into_inner).take();
        py.detach(|| server.map(Server::stop));
    }
}
