//! Making pictures of a volume.

use crate::error::raised;
use crate::image::Image;
use crate::scene::Scene;
use crate::volume::Volume;
use crate::work::{Watch, run};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::json;
use slicestack::annotate::{annotate, check};
use slicestack::proof::Provenance;
use slicestack::{Error, Level, Picture, RenderStats, Settings};
use std::sync::{Arc, Mutex, PoisonError};

/// Makes pictures of one volume, and keeps what they share.
#[pyclass(frozen, module = "slicestack._slicestack")]
pub(crate) struct Renderer {
    renderer: Mutex<slicestack::Renderer>,
    watch: Arc<Watch>,
    volume: slicestack::Volume,
}

/// What a picture cost.
fn statistics(stats: &RenderStats, picture: &Picture, volume: &slicestack::Volume, warnings: &[String], notes: &[String]) -> String {
    let t = &stats.tally;
    let left_out: Vec<_> = stats.left_out.iter().map(|l| json!({ "stage": l.what, "why": l.why })).collect();
    json!({
        "seconds": { "prepare": stats.prepare_seconds, "render": stats.render_seconds },
        "slices": stats.slices,
        "fragments": stats.fragments,
        "fetches": stats.fetches,
        "threads": stats.threads,
        "simd": stats.simd,
        "tally": { "fragments": t.fragments, "corners": t.corners, "looked_up": t.looked_up, "empty": t.empty, "finished": t.finished, "gradients": t.gradients },
        "left_out": left_out,
        "sha256": picture.sha256(),
        "error_estimate": stats.error_estimate,
        "non_finite_voxels": stats.non_finite_voxels,
        "warnings": warnings,
        "notes": notes,
        "image": { "width": picture.width(), "height": picture.height() },
        "volume": { "name": volume.name(), "dimensions": volume.grid().dims(), "type": volume.numbers().voxel_type().name() },
        "version": env!("CARGO_PKG_VERSION"),
    })
    .to_string()
}

#[pymethods]
impl Renderer {
    /// A renderer of `volume`: worker threads (one a core unless given), the side of a tile, the vector level by name.
    #[new]
    #[pyo3(signature = (volume, *, threads = None, tile = None, simd = "auto"))]
    fn new(volume: &Volume, threads: Option<usize>, tile: Option<u32>, simd: &str) -> PyResult<Self> {
        let levels = Level::available();
        let level = match simd {
            "auto" => None,
            name => Some(*levels.iter().find(|l| l.name() == name).ok_or_else(|| {
                let names: Vec<&str> = levels.iter().map(|l| l.name()).collect();
                raised(Error::invalid(format!("simd {name}: this machine has auto, {}", names.join(", "))))
            })?),
        };
        let watch = Arc::new(Watch::default());
        let settings = Settings::new().threads(threads).tile(tile).level(level).progress(watch.clone());
        let renderer = Mutex::new(slicestack::Renderer::new(&volume.inner, settings));
        Ok(Self { renderer, watch, volume: volume.inner.clone() })
    }

    /// The picture of `scene`.
    #[pyo3(signature = (scene, progress = None))]
    fn render(&self, py: Python<'_>, scene: &Scene, progress: Option<Py<PyAny>>) -> PyResult<Image> {
        let volume = &self.volume;
        let work = || {
            let (mut warnings, mut notes) = (scene.told().0.to_vec(), volume.notes().to_vec());
            notes.extend(scene.told().1.iter().cloned());
            check(&scene.annotations, &scene.scene)?;
            let (picture, stats) = self.renderer.lock().unwrap_or_else(PoisonError::into_inner).render(&scene.scene)?;
            warnings.extend(stats.warnings.iter().cloned());
            let annotated = if scene.annotations.any() {
                let (drawn, left_out) = annotate(&picture, &scene.annotations, &scene.scene, volume)?;
                warnings.extend(left_out);
                Some(drawn)
            } else {
                None
            };
            let provenance = match Provenance::of(&scene.scene, &scene.source, volume, &picture) {
                Err(Error::Limit { .. }) => None,
                other => Some(other?),
            };
            let stats = statistics(&stats, &picture, volume, &warnings, &notes);
            Ok(Image { picture, annotated, provenance, stats, warnings, notes })
        };
        run(py, &self.watch, progress.as_ref(), work)
    }

    /// What this volume, a part of a larger one, leaves of the picture of `scene`: bytes of a partial picture.
    #[pyo3(signature = (scene, domain, progress = None))]
    fn render_part<'py>(
        &self,
        py: Python<'py>,
        scene: &Scene,
        domain: &crate::parts::Domain,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let work = || {
            let partial = self.renderer.lock().unwrap_or_else(PoisonError::into_inner).render_part(&scene.scene, &domain.0)?;
            Ok(partial.to_bytes())
        };
        Ok(PyBytes::new(py, &run(py, &self.watch, progress.as_ref(), work)?))
    }
}
