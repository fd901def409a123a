//! Scenes: as a file or a dict describes them, and with everything decided.

use crate::error::raised;
use crate::volume::Volume;
use crate::work::{Watch, run};
use pyo3::prelude::*;
use slicestack::Limits;
use slicestack::scene::{Annotations, Overrides, Preset, ResolvedScene, SceneFormat, write_scene};
use slicestack::volume::VolumeSource;
use std::path::PathBuf;
use std::sync::Arc;

/// A scene as text describes it: still without the data that presets and the camera's defaults need.
#[pyclass(frozen, module = "slicestack._slicestack")]
pub(crate) struct SceneFile(pub(crate) slicestack::scene::SceneFile);

/// A scene with everything decided.
#[pyclass(frozen, module = "slicestack._slicestack")]
pub(crate) struct Scene {
    pub(crate) scene: slicestack::Scene,
    pub(crate) source: VolumeSource,
    pub(crate) annotations: Annotations,
    warnings: Vec<String>,
    notes: Vec<String>,
}

fn overrides(keys: Vec<(String, String)>) -> Overrides {
    let mut overrides = Overrides::default();
    keys.into_iter().for_each(|(path, text)| overrides.set(path, text));
    overrides
}

#[pymethods]
impl SceneFile {
    /// Reads the scene file at `path`, with `keys` laid over it.
    #[staticmethod]
    fn read(path: PathBuf, keys: Vec<(String, String)>) -> PyResult<Self> {
        slicestack::scene::SceneFile::read(path, &overrides(keys)).map(Self).map_err(raised)
    }

    /// The scene that `text` describes, TOML or JSON, with paths relative to the folder `base`, and with `keys` laid over it.
    #[staticmethod]
    fn parse(text: &str, base: PathBuf, keys: Vec<(String, String)>) -> PyResult<Self> {
        slicestack::scene::SceneFile::parse(text, base, &overrides(keys)).map(Self).map_err(raised)
    }

    /// Loads its volume.
    #[pyo3(signature = (progress = None, *, map_files = true))]
    fn load(&self, py: Python<'_>, progress: Option<Py<PyAny>>, map_files: bool) -> PyResult<Volume> {
        let limits = if map_files { Limits::default() } else { Limits::default().map_bytes(u64::MAX) };
        let watch = Arc::new(Watch::default());
        let source = self.0.volume();
        let told = watch.clone();
        let inner = run(py, &watch, progress.as_ref(), || source.load_told(&limits, Some(told)))?;
        Ok(Volume { inner, keys: Vec::new() })
    }

    /// The scene for `volume`.
    fn resolve(&self, py: Python<'_>, volume: &Volume) -> PyResult<Scene> {
        let watch = Arc::new(Watch::default());
        let ResolvedScene { scene, warnings, notes, .. } = run(py, &watch, None, || self.0.resolve(&volume.inner))?;
        Ok(Scene { scene, source: self.0.volume().clone(), annotations: self.0.annotations(), warnings, notes })
    }

    /// Scenes once around `volume` in `count` pictures, for `scene`, which came from it.
    fn turntable(&self, scene: &Scene, volume: &Volume, count: u32) -> PyResult<Vec<Scene>> {
        let cameras = self.0.turntable(&scene.scene, &volume.inner, count).map_err(raised)?;
        Ok(cameras.into_iter().map(|camera| scene.with(scene.scene.clone().with_camera(camera))).collect())
    }
}

impl Scene {
    /// Its warnings and notes.
    pub(crate) fn told(&self) -> (&[String], &[String]) {
        (&self.warnings, &self.notes)
    }

    /// Another scene of the same volume.
    fn with(&self, scene: slicestack::Scene) -> Self {
        Self { scene, source: self.source.clone(), annotations: self.annotations.clone(), warnings: Vec::new(), notes: Vec::new() }
    }
}

#[pymethods]
impl Scene {
    /// Columns and rows of its picture.
    #[getter]
    fn size(&self) -> (u32, u32) {
        self.scene.size()
    }

    /// What is likely not meant, one line each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// What was decided, and why, one line each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Whether the number of its slices follows from an error asked for.
    #[getter]
    fn to_tolerance(&self) -> bool {
        matches!(self.scene.slicing(), slicestack::scene::Slicing::Tolerance(_))
    }

    /// As the text of a scene file, TOML or JSON, without its volume.
    #[pyo3(signature = (format = "toml"))]
    fn text(&self, format: &str) -> PyResult<String> {
        let format = if format == "json" { SceneFormat::Json } else { SceneFormat::Toml };
        write_scene(&self.scene, None, &self.annotations, format).map_err(raised)
    }

    /// The scene as parts of a volume are rendered: see `render_part`.
    fn in_parts(&self) -> PyResult<Self> {
        Ok(self.with(self.scene.in_parts().map_err(raised)?))
    }
}

/// The presets: name, and what each is for.
#[pyfunction]
pub(crate) fn presets() -> Vec<(&'static str, &'static str)> {
    Preset::ALL.map(|p| (p.name(), p.about())).into()
}

/// The JSON schema of a scene.
#[pyfunction]
pub(crate) fn schema() -> String {
    serde_json::to_string_pretty(&slicestack::scene::schema()).unwrap_or_default()
}
