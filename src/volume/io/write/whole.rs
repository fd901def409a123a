//! A file that appears whole or not at all.

use crate::{Error, Result};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file in the making, under a name of its own beside the one that it will have. Dropped before [`Whole::finish`] it is taken away again.
pub(super) struct Whole {
    path: PathBuf,
    file: File,
    /// Its name so far, and the one that it will have; `None` where the path is a device or a pipe, and once it is finished.
    renamed: Option<(PathBuf, PathBuf)>,
}

impl Whole {
    /// Starts the file `path`.
    ///
    /// # Errors
    /// When it names no file, or none can be made there.
    pub(super) fn create(path: &Path) -> Result<Self> {
        let fault = |e| Error::io(path, e);
        let Some(name) = path.file_name() else { return Err(Error::format(path, "names no file")) };
        // A device or a pipe cannot be replaced, only written to.
        if path.exists() && !path.is_file() {
            let file = File::options().write(true).open(path).map_err(fault)?;
            return Ok(Self { path: path.to_path_buf(), file, renamed: None });
        }
        // A link stays one: what it points to is replaced.
        let real = if path.is_symlink() { path.canonicalize().map_err(fault)? } else { path.to_path_buf() };
        let mut hidden = OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}.part", std::process::id()));
        let part = real.with_file_name(hidden);
        // No file that is there already is written to.
        let file = File::options().write(true).create_new(true).open(&part).map_err(|e| Error::io(&part, e))?;
        Ok(Self { path: path.to_path_buf(), file, renamed: Some((part, real)) })
    }

    /// Whether it is a file of its own, not a device or a pipe.
    pub(super) fn is_new(&self) -> bool {
        self.renamed.is_some()
    }

    /// Replaces the bytes from byte `at` on.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn put(&mut self, at: u64, bytes: &[u8]) -> Result<()> {
        let done = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.write_all(bytes));
        done.map_err(|e| Error::io(&self.path, e))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// When the system refuses; then nothing is left of it.
    pub(super) fn finish(mut self) -> Result<()> {
        if let Some((part, real)) = &self.renamed {
            // Who may read the older file may read this one, and nobody else.
            if let Ok(older) = real.metadata() {
                fs::set_permissions(part, older.permissions()).map_err(|e| Error::io(&self.path, e))?;
            }
            fs::rename(part, real).map_err(|e| Error::io(&self.path, e))?;
        }
        self.renamed = None;
        Ok(())
    }
}

impl Write for Whole {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for Whole {
    fn drop(&mut self) {
        if let Some((part, _)) = &self.renamed {
            // The error that ended the work is the one to report.
            drop(fs::remove_file(part));
        }
    }
}
