//! `key: value` lines of text headers, parsed with errors that name the key and the number at fault.

use crate::volume::{Grid, Modality, Space, Volume, Voxels};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};

/// One field of a header, with the file it stands in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Field<'a> {
    path: &'a Path,
    key: &'a str,
    /// What the file says.
    pub(super) value: &'a str,
}

/// The start of `text`, quoted on one line.
pub(super) fn shown(text: &str) -> String {
    let start: String = text.chars().take(60).collect();
    if start.len() < text.len() { format!("{start:?}...") } else { format!("{start:?}") }
}

impl<'a> Field<'a> {
    pub(super) fn new(path: &'a Path, key: &'a str, value: &'a str) -> Self {
        Self { path, key, value: value.trim() }
    }

    /// An error about this field.
    pub(super) fn fault(&self, what: impl std::fmt::Display) -> Error {
        Error::format(self.path, format!("{} is {}: {what}", self.key, shown(self.value)))
    }

    fn words(&self) -> impl Iterator<Item = &'a str> {
        self.value.split_ascii_whitespace()
    }

    fn finite(&self, word: &str) -> Result<f64> {
        match word.parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            Ok(_) => Err(self.fault(format!("{word} is not a finite number"))),
            Err(_) => Err(self.fault(format!("{} is not a number", shown(word)))),
        }
    }

    /// Finite numbers between spaces.
    pub(super) fn numbers(&self) -> Result<Vec<f64>> {
        self.words().map(|w| self.finite(w)).collect()
    }

    /// Exactly `count` finite numbers.
    pub(super) fn exactly(&self, count: usize) -> Result<Vec<f64>> {
        let numbers = self.numbers()?;
        if numbers.len() != count {
            return Err(self.fault(format!("{} numbers, {count} are needed", numbers.len())));
        }
        Ok(numbers)
    }

    /// One finite number.
    pub(super) fn number(&self) -> Result<f64> {
        Ok(self.exactly(1)?[0])
    }

    /// One integer.
    pub(super) fn integer(&self) -> Result<i64> {
        self.value.parse().map_err(|_| self.fault("not an integer"))
    }

    /// Sizes: integers of at least 1.
    pub(super) fn sizes(&self) -> Result<Vec<usize>> {
        self.words()
            .map(|w| match w.parse::<i128>() {
                Ok(n) if n < 1 => Err(self.fault(format!("size {n} must be at least 1"))),
                Ok(n) => usize::try_from(n).map_err(|_| self.fault(format!("size {n} is too large"))),
                Err(_) => Err(self.fault(format!("{} is not an integer", shown(w)))),
            })
            .collect()
    }

    /// True or false.
    pub(super) fn truth(&self) -> Result<bool> {
        match self.value.to_ascii_lowercase().as_str() {
            "true" | "1" | "yes" | "t" => Ok(true),
            "false" | "0" | "no" | "f" => Ok(false),
            _ => Err(self.fault("neither True nor False")),
        }
    }

    /// Numbers in parentheses, as NRRD writes vectors: `(1,0,0) none (0,0,1)`; `none` gives `None`.
    pub(super) fn vectors(&self) -> Result<Vec<Option<Vec<f64>>>> {
        let mut out = Vec::new();
        let mut rest = self.value.trim_start();
        while !rest.is_empty() {
            if let Some(after) = rest.strip_prefix("none").or_else(|| rest.strip_prefix("???")) {
                out.push(None);
                rest = after.trim_start();
                continue;
            }
            let Some((inside, after)) = rest.strip_prefix('(').and_then(|r| r.split_once(')')) else {
                return Err(self.fault(format!("{} is neither a vector (x,y,z) nor none", shown(rest))));
            };
            out.push(Some(inside.split(',').map(|w| self.finite(w.trim())).collect::<Result<_>>()?));
            rest = after.trim_start();
        }
        Ok(out)
    }

    /// The file of that name, relative to the header's folder.
    pub(super) fn sibling(&self) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(self.value)
    }

    /// The kind of values that a modality's DICOM code stands for, alone or after MetaImage's prefix.
    pub(super) fn modality(&self) -> Modality {
        match self.value.trim_start_matches("MET_MOD_") {
            "CT" => Modality::Ct,
            "MR" => Modality::Mr,
            "OT" | "PT" | "NM" | "US" | "XA" | "CR" | "DX" | "MG" | "RTDOSE" | "SM" | "OTHER" => Modality::Other,
            _ => Modality::Unknown,
        }
    }
}

/// Steps of three axes. One that is `None` becomes one unit long and stands at right angles to the others.
pub(super) fn complete(steps: [Option<DVec3>; 3]) -> DMat3 {
    let free = |v: DVec3| if v.is_finite() && v.length() > 0.0 { v.normalize() } else { DVec3::X };
    let [x, y, z] = match steps {
        [Some(x), Some(y), Some(z)] => [x, y, z],
        [Some(x), Some(y), None] => [x, y, free(x.cross(y))],
        [Some(x), None, Some(z)] => [x, free(z.cross(x)), z],
        [None, Some(y), Some(z)] => [free(y.cross(z)), y, z],
        [Some(x), None, None] => {
            let (y, z) = free(x).any_orthonormal_pair();
            [x, y, z]
        }
        [None, Some(y), None] => {
            let (z, x) = free(y).any_orthonormal_pair();
            [x, y, z]
        }
        [None, None, Some(z)] => {
            let (x, y) = free(z).any_orthonormal_pair();
            [x, y, z]
        }
        [None, None, None] => [DVec3::X, DVec3::Y, DVec3::Z],
    };
    DMat3::from_cols(x, y, z)
}

/// A grid, with the file's name in front of what is wrong with it.
pub(super) fn grid(path: &Path, dims: [usize; 3], origin: DVec3, steps: DMat3, space: Space) -> Result<Grid> {
    named(path, Grid::new(dims, origin, steps)).map(|g| g.with_space(space))
}

/// Colours on `grid`, red, green, blue and alpha one after the other; the file has an `alpha`, or its reader made one of 1.
///
/// # Errors
/// [`Error::Invalid`] when the numbers are not the grid's, or of a type that colours are not kept in.
pub(super) fn colors(grid: Grid, numbers: Voxels, alpha: bool) -> Result<Volume> {
    let volume = Volume::with_colors(grid, numbers)?;
    if alpha { Ok(volume) } else { volume.without_alpha() }
}

/// The same result, with the file's name in front of what is invalid.
pub(super) fn named<T>(path: &Path, result: Result<T>) -> Result<T> {
    result.map_err(|e| match e {
        Error::Invalid(what) => Error::format(path, what),
        other => other,
    })
}
