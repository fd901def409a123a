//! The Python package's own half: thin classes over the library, without a decision of their own.
//!
//! ```text
//!  arrays, paths, dicts --slicestack/*.py: which volume, which scene--> _slicestack: Volume, SceneFile, Scene, Renderer, Image, Part --> library
//! ```
//! What is convenient for people lives in `slicestack/*.py`; what takes long runs here without Python's lock, on a thread of its own, while
//! the calling thread listens for Ctrl-C and tells how far the work has come (`work.rs`).

mod borrowed;
mod error;
mod image;
mod parts;
mod render;
mod scene;
mod view;
mod volume;
mod work;

use pyo3::prelude::*;

/// The functions and classes behind the package `slicestack`; use those.
#[pymodule]
mod _slicestack {
    use super::*;

    #[pymodule_export]
    use image::{Image, compare, decode};
    #[pymodule_export]
    use parts::{Domain, combine, finish, halo, kind, order, partial_size, tiles};
    #[pymodule_export]
    use render::Renderer;
    #[pymodule_export]
    use scene::{Scene, SceneFile, presets, schema};
    #[pymodule_export]
    use view::View;
    #[pymodule_export]
    use volume::Volume;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
