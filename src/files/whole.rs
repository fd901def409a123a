//! One file that appears whole or not at all.

use super::unfinished::{Unfinished, unfinished};
use crate::{Error, Result};
use std::fs::{self, File};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file in the making, under a name of its own beside the one that it will have. Dropped before [`Whole::finish`] it is taken away again, and
/// an earlier file of that name stays as it was.
///
/// A device or a pipe cannot be replaced: it is written to as bytes come.
#[derive(Debug)]
pub struct Whole {
    path: PathBuf,
    file: File,
    /// `None` for a device or a pipe, and once the file has its name.
    names: Option<Names>,
}

/// What a file is called.
#[derive(Debug)]
struct Names {
    /// So far.
    part: PathBuf,
    /// At last: a link stays one, and what it points to is replaced.
    real: PathBuf,
}

/// Where a file goes.
enum Place {
    /// To be made beside this name.
    Beside(PathBuf),
    /// A device or a pipe.
    Device,
}

impl Whole {
    /// Begins the file `path`.
    ///
    /// # Errors
    /// [`Error::Format`] where it names no file, a folder, or a file that may only be read; [`Error::Io`] where none can be made beside it;
    /// [`Error::Stopped`] after [`discard_unfinished`](super::discard_unfinished).
    pub fn create(path: &Path) -> Result<Self> {
        let path = path.to_path_buf();
        let real = match place(&path)? {
            Place::Beside(real) => real,
            Place::Device => {
                let file = File::options().write(true).open(&path).map_err(|e| Error::io(&path, e))?;
                return Ok(Self { path, file, names: None });
            }
        };
        let folder = real.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let (file, part) = unfinished().create(folder, "part").map_err(|e| match e {
            // The name that the caller knows.
            Error::Io { source, .. } => Error::io(&path, source),
            other => other,
        })?;
        Ok(Self { path, file, names: Some(Names { part, real }) })
    }

    /// Whether it is a file of its own, not a device or a pipe.
    pub fn is_file(&self) -> bool {
        self.names.is_some()
    }

    /// Replaces the bytes from byte `at` on.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn put(&mut self, at: u64, bytes: &[u8]) -> Result<()> {
        let done = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.write_all(bytes));
        done.map_err(|e| Error::io(&self.path, e))
    }

    /// Goes on with `bytes`, all of them.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn put_all(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_all(bytes).map_err(|e| Error::io(&self.path, e))
    }

    /// Gives the file its name. It may be read and written by whoever could do so with an earlier file of that name.
    ///
    /// # Errors
    /// When the system refuses; then nothing is left of it.
    pub fn finish(self) -> Result<()> {
        finish_all(vec![self])
    }

    /// As [`Whole::finish`]; tells the earlier file, kept under another name, where `keep` says so and there was one.
    fn rename(&self, all: &mut Unfinished, keep: bool) -> Result<Option<PathBuf>> {
        let Some(Names { part, real }) = &self.names else { return Ok(None) };
        let fault = |e| Error::io(&self.path, e);
        let earlier = real.metadata().ok();
        if let Some(earlier) = &earlier {
            fs::set_permissions(part, earlier.permissions()).map_err(fault)?;
        }
        let old = if keep && earlier.is_some() { Some(all.keep(real)?) } else { None };
        if let Err(e) = fs::rename(part, real) {
            if let Some(old) = &old {
                drop(fs::rename(old, real));
                all.forget(old);
            }
            return Err(fault(e));
        }
        Ok(old)
    }
}

/// Gives all `files` their names, or none of them.
///
/// # Errors
/// When the system refuses; then the earlier files are where they were.
pub(super) fn finish_all(mut files: Vec<Whole>) -> Result<()> {
    let mut guard = unfinished();
    let all = &mut *guard;
    let done = if all.is_discarded() { Err(Error::Stopped) } else { renamed(&files, all) };
    for file in &mut files {
        if let Some(names) = file.names.take() {
            match done {
                Ok(()) => all.forget(&names.part),
                Err(_) => all.remove(&names.part),
            }
        }
    }
    done
}

/// Renames `files`; where that fails takes all of it back.
fn renamed(files: &[Whole], all: &mut Unfinished) -> Result<()> {
    let keep = files.len() > 1;
    let mut done: Vec<(&Whole, Option<PathBuf>)> = Vec::new();
    let mut fault = None;
    for file in files {
        match file.rename(all, keep) {
            Ok(old) => done.push((file, old)),
            Err(e) => {
                fault = Some(e);
                break;
            }
        }
    }
    let Some(fault) = fault else {
        done.iter().filter_map(|(_, old)| old.as_ref()).for_each(|old| all.remove(old));
        return Ok(());
    };
    for (file, old) in done.into_iter().rev() {
        let Some(Names { real, .. }) = &file.names else { continue };
        // The first fault is the one to report.
        match old {
            Some(old) => {
                drop(fs::rename(&old, real));
                all.forget(&old);
            }
            None => drop(fs::remove_file(real)),
        }
    }
    Err(fault)
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
        if let Some(names) = self.names.take() {
            unfinished().remove(&names.part);
        }
    }
}

/// Writes `bytes` to `path` through a file beside it, so that `path` holds all of them or stays as it was.
///
/// # Errors
/// [`Error::Io`] naming `path`; as [`Whole::create`].
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut whole = Whole::create(path)?;
    whole.put_all(bytes)?;
    whole.finish()
}

/// Finds out whether a file can be written at `path`, without writing one: better told before long work than after.
///
/// # Errors
/// As [`Whole::create`].
pub fn check(path: &Path) -> Result<()> {
    match place(path)? {
        // To open a pipe would wait for its reader.
        Place::Device => Ok(()),
        Place::Beside(_) => Whole::create(path).map(drop),
    }
}

/// Where the file `path` goes.
fn place(path: &Path) -> Result<Place> {
    if path.file_name().is_none() {
        return Err(Error::format(path, "names no file"));
    }
    let real = match path.symlink_metadata() {
        Err(e) if e.kind() == io::ErrorKind::NotFound => path.to_path_buf(),
        Err(e) => return Err(Error::io(path, e)),
        Ok(link) if link.is_symlink() => match path.canonicalize() {
            Err(e) => return Err(Error::io(path, e)),
            Ok(real) => real,
        },
        Ok(_) => path.to_path_buf(),
    };
    let Ok(there) = real.metadata() else { return Ok(Place::Beside(real)) };
    if there.is_dir() {
        return Err(Error::format(path, "is a directory"));
    }
    if !there.is_file() {
        return Ok(Place::Device);
    }
    if there.permissions().readonly() {
        return Err(Error::format(path, "is there already and may only be read: remove it or choose another name"));
    }
    Ok(Place::Beside(real))
}
