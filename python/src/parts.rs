//! Parts of a volume, and putting together what they leave.

use crate::error::raised;
use crate::image::Image;
use crate::scene::Scene;
use crate::volume::grid;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use slicestack::{Partial, PartialKind};

/// Which part of a whole volume another volume holds.
#[pyclass(frozen, module = "slicestack._slicestack")]
pub(crate) struct Domain(pub(crate) slicestack::proxy::Domain);

#[pymethods]
impl Domain {
    /// The part of a volume of `dims` voxels that owns `cells` (first, and the one behind the last, along x, y and z): see `tiles`.
    #[new]
    #[allow(clippy::too_many_arguments, reason = "named on the other side")]
    fn new(
        dims: [usize; 3],
        origin: [f64; 3],
        steps: [[f64; 3]; 3],
        space: &str,
        nodes: bool,
        cells: [(usize, usize); 3],
        halo: [usize; 3],
        range: (f64, f64),
        non_finite: usize,
    ) -> PyResult<Self> {
        let whole = grid(dims, origin, steps, space, nodes)?;
        let cells = cells.map(|(start, end)| start..end);
        slicestack::proxy::Domain::with_halo(whole, cells, halo, range, non_finite).map(Self).map_err(raised)
    }

    /// First of its own cells and the one behind the last, along x, y and z.
    #[getter]
    fn cells(&self) -> [(usize, usize); 3] {
        let last = self.0.whole().dims().map(|n| n.saturating_sub(1).max(1));
        std::array::from_fn(|axis| {
            let (low, high) = self.0.owned()[axis];
            (if low.is_finite() { low as usize } else { 0 }, if high.is_finite() { high as usize } else { last[axis] })
        })
    }

    /// First voxel and the one behind the last that the part holds, along x, y and z of the whole.
    #[getter]
    fn voxels(&self) -> [(usize, usize); 3] {
        self.0.voxels().clone().map(|r| (r.start, r.end))
    }

    /// World position of its first voxel.
    #[getter]
    fn origin(&self) -> PyResult<[f64; 3]> {
        Ok(self.0.grid().map_err(raised)?.origin().to_array())
    }
}

/// The parts that `cuts` along x, y and z make of a volume of `dims` voxels, each with `halo` voxels around; `range` is the least and the
/// greatest finite stored value of the whole, `non_finite` the number of its voxels that are NaN or infinite.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "named on the other side")]
pub(crate) fn tiles(
    dims: [usize; 3],
    origin: [f64; 3],
    steps: [[f64; 3]; 3],
    space: &str,
    nodes: bool,
    cuts: [Vec<usize>; 3],
    halo: [usize; 3],
    range: (f64, f64),
    non_finite: usize,
) -> PyResult<Vec<Domain>> {
    let whole = grid(dims, origin, steps, space, nodes)?;
    let tiles = slicestack::proxy::Domain::tiles(&whole, &cuts, halo, range, non_finite).map_err(raised)?;
    Ok(tiles.into_iter().map(Domain).collect())
}

/// Voxels beyond its own cells that a part takes for `scene`, along x, y and z.
#[pyfunction]
pub(crate) fn halo(
    scene: &Scene,
    dims: [usize; 3],
    origin: [f64; 3],
    steps: [[f64; 3]; 3],
    space: &str,
    nodes: bool,
) -> PyResult<[usize; 3]> {
    slicestack::halo(&scene.scene, &grid(dims, origin, steps, space, nodes)?).map_err(raised)
}

/// The places of `parts`, nearest first as the camera of `scene` sees them.
#[pyfunction]
pub(crate) fn order(py: Python<'_>, scene: &Scene, parts: Vec<Py<Domain>>) -> PyResult<Vec<usize>> {
    let parts: Vec<slicestack::proxy::Domain> = parts.iter().map(|part| part.borrow(py).0.clone()).collect();
    let Some(first) = parts.first() else { return Ok(Vec::new()) };
    let (width, height) = scene.scene.size();
    let view = scene.scene.camera().resolve(first.whole(), width, height).map_err(raised)?;
    Ok(slicestack::proxy::order(&parts, &view))
}

/// Partial pictures, nearest first, as one.
#[pyfunction]
pub(crate) fn combine<'py>(py: Python<'py>, partials: Vec<PyBackedBytes>) -> PyResult<Bound<'py, PyBytes>> {
    let work = || {
        let mut read = partials.iter().map(|bytes| Partial::from_bytes(bytes));
        let first = read.next().ok_or_else(|| slicestack::Error::invalid("no partial picture to combine"))??;
        read.try_fold(first, |front, back| front.over(&back?)).map(|whole| whole.to_bytes())
    };
    Ok(PyBytes::new(py, &py.detach(work).map_err(raised)?))
}

/// The picture of `scene` that a partial picture of all parts comes to.
#[pyfunction]
pub(crate) fn finish(py: Python<'_>, partial: PyBackedBytes, scene: &Scene) -> PyResult<Image> {
    let picture = py.detach(|| Partial::from_bytes(&partial)?.finish(&scene.scene)).map_err(raised)?;
    Ok(Image::bare(picture))
}

/// What the pixels of a partial picture hold: "over", "largest", "smallest", "mean" or "sum".
#[pyfunction]
pub(crate) fn kind(partial: PyBackedBytes) -> PyResult<&'static str> {
    Ok(match Partial::from_bytes(&partial).map_err(raised)?.kind() {
        PartialKind::Largest => "largest",
        PartialKind::Smallest => "smallest",
        PartialKind::Mean => "mean",
        PartialKind::Sum => "sum",
        _ => "over",
    })
}

/// Columns and rows of a partial picture's rectangle, and the fragments that went into it.
#[pyfunction]
pub(crate) fn partial_size(partial: PyBackedBytes) -> PyResult<(u32, u32, u64)> {
    let partial = Partial::from_bytes(&partial).map_err(raised)?;
    let (_, (width, height)) = partial.rectangle();
    Ok((width, height, partial.fragments()))
}
