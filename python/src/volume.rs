//! Volumes: voxels in Python's memory or read from a file.

use crate::borrowed::Borrowed;
use crate::error::raised;
use glam::{DMat3, DVec3};
use pyo3::buffer::{Element, PyBuffer};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use slicestack::volume::{BoxConvention, Buffer, Channels, Grid, LengthUnit, Modality, Space, Voxel, Voxels};
use std::sync::Arc;

/// An expression of voxels of any type.
macro_rules! each {
    ($voxels:expr, $numbers:ident => $done:expr) => {
        match $voxels {
            Voxels::U8($numbers) => $done,
            Voxels::I8($numbers) => $done,
            Voxels::U16($numbers) => $done,
            Voxels::I16($numbers) => $done,
            Voxels::U32($numbers) => $done,
            Voxels::I32($numbers) => $done,
            Voxels::F32($numbers) => $done,
            Voxels::F64($numbers) => $done,
        }
    };
}

/// A volume, and the keys of the section `volume` that it came from.
#[pyclass(frozen, module = "slicestack._slicestack")]
pub(crate) struct Volume {
    pub(crate) inner: slicestack::Volume,
    pub(crate) keys: Vec<(String, String)>,
}

/// The numbers of `array`, without a copy.
fn shared<T: Element + Voxel>(array: &Bound<'_, PyAny>) -> PyResult<Voxels> {
    let buffer = PyBuffer::<T>::get(array)?;
    let numbers = Borrowed::new(buffer).ok_or_else(|| PyValueError::new_err("array: its numbers do not lie in C order without gaps"))?;
    Ok(T::wrap(Buffer::shared(Arc::new(numbers))))
}

/// The numbers of `array`, of the type that NumPy calls `kind`.
fn voxels(array: &Bound<'_, PyAny>, kind: &str) -> PyResult<Voxels> {
    match kind {
        "u1" => shared::<u8>(array),
        "i1" => shared::<i8>(array),
        "u2" => shared::<u16>(array),
        "i2" => shared::<i16>(array),
        "u4" => shared::<u32>(array),
        "i4" => shared::<i32>(array),
        "f4" => shared::<f32>(array),
        "f8" => shared::<f64>(array),
        _ => Err(PyValueError::new_err(format!("array: voxels of type {kind}: u1, i1, u2, i2, u4, i4, f4 and f8 are known"))),
    }
}

/// The grid of `dims` voxels (x, y, z) whose steps along x, y and z are the columns of `steps`, each three numbers, and whose first voxel is at
/// `origin`; `space` says what the world's axes mean in a body.
pub(crate) fn grid(dims: [usize; 3], origin: [f64; 3], steps: [[f64; 3]; 3], space: &str, nodes: bool) -> PyResult<Grid> {
    let columns = steps.map(DVec3::from_array);
    let grid = Grid::new(dims, DVec3::from_array(origin), DMat3::from_cols(columns[0], columns[1], columns[2])).map_err(raised)?;
    let space = match space {
        "" => Space::Unknown,
        "lps" => Space::Lps,
        "ras" => Space::Ras,
        _ => return Err(PyValueError::new_err(format!("space \"{space}\": \"lps\", \"ras\" or nothing"))),
    };
    Ok(grid.with_space(space).with_convention(if nodes { BoxConvention::Nodes } else { BoxConvention::Cells }))
}

#[pymethods]
impl Volume {
    /// The volume of `array`, whose elements lie in C order, x fastest; `channels` is "scalar", "labels", "rgba" or "rgb" (four numbers a voxel).
    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "named on the other side")]
    #[pyo3(signature = (array, kind, dims, origin, steps, *, space = "", nodes = false, channels = "scalar", slope = 1.0, intercept = 0.0, modality = "", unit = "", name = ""))]
    fn of_array(
        array: &Bound<'_, PyAny>,
        kind: &str,
        dims: [usize; 3],
        origin: [f64; 3],
        steps: [[f64; 3]; 3],
        space: &str,
        nodes: bool,
        channels: &str,
        slope: f64,
        intercept: f64,
        modality: &str,
        unit: &str,
        name: &str,
    ) -> PyResult<Self> {
        let (grid, voxels) = (grid(dims, origin, steps, space, nodes)?, voxels(array, kind)?);
        let made = match channels {
            "rgba" => slicestack::Volume::with_colors(grid, voxels),
            "rgb" => slicestack::Volume::with_colors(grid, voxels).and_then(slicestack::Volume::without_alpha),
            "labels" => slicestack::Volume::new(grid, voxels).and_then(|v| v.with_segments(Vec::new())),
            _ => slicestack::Volume::new(grid, voxels),
        };
        let modality = match modality {
            "" => Modality::Unknown,
            "ct" => Modality::Ct,
            "mr" => Modality::Mr,
            "other" => Modality::Other,
            _ => return Err(PyValueError::new_err(format!("modality \"{modality}\": \"ct\", \"mr\" or \"other\""))),
        };
        let unit = match unit {
            "" => None,
            _ => Some(LengthUnit::from_word(unit).ok_or_else(|| PyValueError::new_err(format!("unit \"{unit}\": m, cm, mm, um, nm, A")))?),
        };
        let inner = made.and_then(|v| v.with_rescale(slope, intercept)).map_err(raised)?;
        Ok(Self { inner: inner.with_modality(modality).with_unit(unit).with_name(name), keys: Vec::new() })
    }

    /// Voxels along x, y and z.
    #[getter]
    fn dims(&self) -> [usize; 3] {
        self.inner.grid().dims()
    }

    /// Length of a step along x, y and z, world units.
    #[getter]
    fn spacing(&self) -> [f64; 3] {
        self.inner.grid().spacing()
    }

    /// World position of the first voxel's centre.
    #[getter]
    fn origin(&self) -> [f64; 3] {
        self.inner.grid().origin().to_array()
    }

    /// Steps along x, y and z in the world.
    #[getter]
    fn steps(&self) -> [[f64; 3]; 3] {
        self.inner.grid().index_to_world().matrix3.to_cols_array_2d()
    }

    /// "lps", "ras" or "".
    #[getter]
    fn space(&self) -> &'static str {
        match self.inner.grid().space() {
            Space::Lps => "lps",
            Space::Ras => "ras",
            Space::Unknown => "",
        }
    }

    /// Type of the numbers: "u8", "i16", ...
    #[getter]
    fn kind(&self) -> &'static str {
        self.inner.numbers().voxel_type().name()
    }

    /// "scalar", "labels", "rgba" or "rgb".
    #[getter]
    fn channels(&self) -> &'static str {
        match self.inner.channels() {
            Channels::Label(_) => "labels",
            Channels::Rgba => "rgba",
            Channels::Rgb => "rgb",
            _ => "scalar",
        }
    }

    /// Slope and intercept of value = slope * stored + intercept.
    #[getter]
    fn rescale(&self) -> (f64, f64) {
        self.inner.rescale()
    }

    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    /// What its reader chose or repaired, one sentence each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.inner.notes().to_vec()
    }

    /// Keys of the section `volume` that it came from.
    #[getter]
    fn keys(&self) -> Vec<(String, String)> {
        self.keys.clone()
    }

    /// The same volume, come from these keys.
    fn with_keys(&self, keys: Vec<(String, String)>) -> Self {
        Self { inner: self.inner.clone(), keys }
    }

    /// Whether the voxels lie in memory that Python owns.
    #[getter]
    fn is_shared(&self) -> bool {
        each!(self.inner.numbers(), numbers => numbers.is_shared())
    }

    /// SHA-256 of grid and voxels.
    fn sha256(&self, py: Python<'_>) -> String {
        py.detach(|| self.inner.sha256())
    }

    /// Range, mean and holes of the values, in the data's units.
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = py.detach(|| self.inner.statistics().clone());
        let told = PyDict::new(py);
        told.set_item("min", found.min)?;
        told.set_item("max", found.max)?;
        told.set_item("mean", found.mean)?;
        told.set_item("non_finite", found.non_finite)?;
        Ok(told)
    }

    /// Fills `array`, of the volume's own type, with the stored numbers.
    fn copy_to(&self, py: Python<'_>, array: &Bound<'_, PyAny>) -> PyResult<()> {
        each!(self.inner.numbers(), numbers => PyBuffer::get(array)?.copy_from_slice(py, numbers))
    }
}
