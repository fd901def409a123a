//! Pictures.

use crate::error::raised;
use pyo3::buffer::PyBuffer;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use slicestack::compare::Comparison;
use slicestack::files::write_whole;
use slicestack::picture::Metadata;
use slicestack::proof::Provenance;
use slicestack::{Depth, Error, Format, Picture};
use std::path::{Path, PathBuf};

/// A finished picture.
#[pyclass(frozen, module = "slicestack._slicestack")]
pub(crate) struct Image {
    pub(crate) picture: Picture,
    /// The picture with what is drawn on it, where the scene asks for that.
    pub(crate) annotated: Option<Picture>,
    /// What it was made of, for files that carry that.
    pub(crate) provenance: Option<Provenance>,
    /// The statistics, as JSON.
    pub(crate) stats: String,
    pub(crate) warnings: Vec<String>,
    pub(crate) notes: Vec<String>,
}

impl Image {
    /// A picture without a word on its making.
    pub(crate) fn bare(picture: Picture) -> Self {
        Self { picture, annotated: None, provenance: None, stats: "{}".into(), warnings: Vec::new(), notes: Vec::new() }
    }

    fn encoded(&self, format: Format, depth: Depth, metadata: bool) -> Result<Vec<u8>, Error> {
        let carried = match &self.provenance {
            Some(provenance) if metadata && format.carries_metadata() && self.annotated.is_none() => provenance.metadata()?,
            _ => Metadata::new(),
        };
        if self.annotated.is_some() && format == Format::Npy {
            return Err(Error::invalid(
                "annotate: a .npy file holds numbers to compute with, nothing is drawn on them; write .png, .exr or another picture",
            ));
        }
        self.annotated.as_ref().unwrap_or(&self.picture).encode_with(format, depth, &carried)
    }
}

fn depth(bits: u8) -> Result<Depth, Error> {
    match bits {
        8 => Ok(Depth::Eight),
        16 => Ok(Depth::Sixteen),
        _ => Err(Error::invalid(format!("depth {bits}: 8 or 16"))),
    }
}

#[pymethods]
impl Image {
    /// The picture of `pixels`, an array of f32 in C order: rows, columns, premultiplied RGBA.
    #[staticmethod]
    fn of_array(py: Python<'_>, pixels: &Bound<'_, PyAny>, width: u32, height: u32) -> PyResult<Self> {
        let numbers = PyBuffer::<f32>::get(pixels)?.to_vec(py)?;
        let pixels = numbers.chunks_exact(4);
        if !pixels.remainder().is_empty() {
            return Err(raised(Error::invalid(format!("a picture of {} numbers: a pixel has four", numbers.len()))));
        }
        let pixels = pixels.map(|p| [p[0], p[1], p[2], p[3]]).collect();
        Picture::from_pixels(width, height, pixels).map(Self::bare).map_err(raised)
    }

    #[getter]
    fn width(&self) -> u32 {
        self.picture.width()
    }

    #[getter]
    fn height(&self) -> u32 {
        self.picture.height()
    }

    #[getter]
    fn stats(&self) -> &str {
        &self.stats
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Fills `array` of height x width x 4 f32 with the pixels, premultiplied RGBA.
    fn copy_to(&self, py: Python<'_>, array: &Bound<'_, PyAny>) -> PyResult<()> {
        PyBuffer::<f32>::get(array)?.copy_from_slice(py, self.picture.pixels().as_flattened())
    }

    /// SHA-256 of the pixels in f32.
    fn sha256(&self, py: Python<'_>) -> String {
        py.detach(|| self.picture.sha256())
    }

    /// As a file of the format called `format`, of 8 or 16 bits a component.
    fn encode<'py>(&self, py: Python<'py>, format: &str, bits: u8, metadata: bool) -> PyResult<Bound<'py, PyBytes>> {
        let format =
            Format::of_name(format).ok_or_else(|| raised(Error::invalid(format!("format \"{format}\": {}", Format::choices()))))?;
        let bytes = py.detach(|| self.encoded(format, depth(bits)?, metadata)).map_err(raised)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes it to `path`, whose extension tells the format: all of it or nothing.
    fn save(&self, py: Python<'_>, path: PathBuf, bits: u8, metadata: bool) -> PyResult<()> {
        let write = || {
            let format = Format::of_path(&path)?;
            write_whole(&path, &self.encoded(format, depth(bits)?, metadata)?)
        };
        py.detach(write).map_err(raised)
    }
}

/// The picture in the file at `path`.
#[pyfunction]
pub(crate) fn decode(py: Python<'_>, path: PathBuf) -> PyResult<Image> {
    py.detach(|| Picture::open(Path::new(&path))).map(Image::bare).map_err(raised)
}

/// How far two pictures are apart.
#[pyfunction]
pub(crate) fn compare<'py>(py: Python<'py>, a: &Image, b: &Image) -> PyResult<Bound<'py, PyDict>> {
    let found = py.detach(|| Comparison::of(&a.picture, &b.picture)).map_err(raised)?;
    let told = PyDict::new(py);
    told.set_item("rms", found.rms)?;
    told.set_item("max", found.max)?;
    told.set_item("psnr", found.psnr)?;
    told.set_item("ssim", found.ssim)?;
    told.set_item("flip", found.flip)?;
    told.set_item("differing", found.differing)?;
    told.set_item("pixels", found.pixels)?;
    told.set_item("worst", found.worst)?;
    Ok(told)
}
