//! The library's errors as Python's: each with the line that the command prints.

use pyo3::PyErr;
use pyo3::exceptions::{PyFileNotFoundError, PyInterruptedError, PyOSError, PyPermissionError, PyValueError};
use slicestack::Error;
use std::io::ErrorKind;

/// What Python raises for `error`: an `OSError` for what the operating system refused, else a `ValueError`.
pub(crate) fn raised(error: Error) -> PyErr {
    let line = error.to_string();
    match error {
        Error::Io { source, .. } => match source.kind() {
            ErrorKind::NotFound => PyFileNotFoundError::new_err(line),
            ErrorKind::PermissionDenied => PyPermissionError::new_err(line),
            _ => PyOSError::new_err(line),
        },
        Error::Stopped => PyInterruptedError::new_err(line),
        _ => PyValueError::new_err(line),
    }
}
