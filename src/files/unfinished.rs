//! The temporary files of this process.

use crate::{Error, Result};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What this process has made and not finished.
pub(super) struct Unfinished {
    files: BTreeSet<PathBuf>,
    /// Folders that go with the last file in them.
    folders: BTreeSet<PathBuf>,
    /// Folders that go with all that is in them.
    trees: BTreeSet<PathBuf>,
    /// Names given so far.
    names: u64,
    /// Whether everything was discarded: nothing is begun or finished any more.
    discarded: bool,
}

static UNFINISHED: Mutex<Unfinished> =
    Mutex::new(Unfinished { files: BTreeSet::new(), folders: BTreeSet::new(), trees: BTreeSet::new(), names: 0, discarded: false });

/// Names that are tried before it is given up.
const TRIES: u32 = 1000;

/// The files, for as long as the guard lives; nobody renames or discards meanwhile.
pub(super) fn unfinished() -> MutexGuard<'static, Unfinished> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes away every temporary file of this process, and the folders made for them; waits for what is being renamed. From then on no file is
/// begun, and none gets its name: their makers meet [`Error::Stopped`]. For a process that is about to end, by a signal for one.
pub fn discard_unfinished() {
    unfinished().discard();
}

/// As [`discard_unfinished`], but waits for nobody and asks for no memory: for a thread that may be in the midst of it itself.
pub(crate) fn discard_unfinished_now() {
    if let Ok(mut all) = UNFINISHED.try_lock() {
        all.discard();
    }
}

impl Unfinished {
    fn discard(&mut self) {
        self.discarded = true;
        // Whoever ends the process has nothing to tell about a file that does not go.
        std::mem::take(&mut self.files).iter().for_each(|file| drop(fs::remove_file(file)));
        std::mem::take(&mut self.folders).iter().rev().for_each(|folder| drop(fs::remove_dir(folder)));
        std::mem::take(&mut self.trees).iter().for_each(|tree| {
            // Whoever still writes into it finds it gone, and does not fill it while it is emptied.
            let away = tree.with_extension("gone");
            drop(fs::remove_dir_all(if fs::rename(tree, &away).is_ok() { &away } else { tree }));
        });
    }

    /// A new folder in `folder`, which goes again with all that is in it.
    ///
    /// # Errors
    /// As [`Unfinished::create`].
    pub(super) fn create_tree(&mut self, folder: &Path) -> Result<PathBuf> {
        for _ in 0..TRIES {
            let path = self.name(folder, "part")?;
            match fs::create_dir(&path) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                made => {
                    made.map_err(|e| Error::io(folder, e))?;
                    self.trees.insert(path.clone());
                    return Ok(path);
                }
            }
        }
        Err(Error::io(folder, ErrorKind::AlreadyExists.into()))
    }

    /// The folder `tree` is called `path` from now on, and stays.
    ///
    /// # Errors
    /// When the system refuses; [`Error::Stopped`] after [`discard_unfinished`].
    pub(super) fn rename_tree(&mut self, tree: &Path, path: &Path) -> Result<()> {
        if self.discarded {
            return Err(Error::Stopped);
        }
        fs::rename(tree, path).map_err(|e| Error::io(path, e))?;
        self.trees.remove(tree);
        Ok(())
    }

    /// Takes the folder `tree` away with all that is in it.
    pub(super) fn remove_tree(&mut self, tree: &Path) {
        if self.trees.remove(tree) {
            // The error that ended the work is the one to report.
            drop(fs::remove_dir_all(tree));
        }
    }

    /// A new file in `folder`, which nobody else has, and its path; its name ends with `.part`, or with another `ending`.
    ///
    /// # Errors
    /// When the system refuses; [`Error::Stopped`] after [`discard_unfinished`].
    pub(super) fn create(&mut self, folder: &Path, ending: &str) -> Result<(File, PathBuf)> {
        for _ in 0..TRIES {
            let path = self.name(folder, ending)?;
            match File::options().write(true).create_new(true).open(&path) {
                // Left by another process of that number.
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                made => {
                    let file = made.map_err(|e| Error::io(folder, e))?;
                    self.files.insert(path.clone());
                    return Ok((file, path));
                }
            }
        }
        Err(Error::io(folder, ErrorKind::AlreadyExists.into()))
    }

    /// A second name for the file `real`, beside it.
    ///
    /// # Errors
    /// As [`Unfinished::create`].
    pub(super) fn keep(&mut self, real: &Path) -> Result<PathBuf> {
        let folder = real.parent().unwrap_or(Path::new("."));
        for _ in 0..TRIES {
            let path = self.name(folder, "old")?;
            match fs::hard_link(real, &path) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => continue,
                Ok(()) => {}
                // File systems without links: for a moment the name is nobody's.
                Err(_) => fs::rename(real, &path).map_err(|e| Error::io(real, e))?,
            }
            self.files.insert(path.clone());
            return Ok(path);
        }
        Err(Error::io(folder, ErrorKind::AlreadyExists.into()))
    }

    /// A name that this process has not used yet. It is short: the file's own name may be as long as names can be.
    fn name(&mut self, folder: &Path, ending: &str) -> Result<PathBuf> {
        if self.discarded {
            return Err(Error::Stopped);
        }
        self.names += 1;
        Ok(folder.join(format!(".slicestack-{}-{}.{ending}", std::process::id(), self.names)))
    }

    /// Whether nothing is finished any more.
    pub(super) fn is_discarded(&self) -> bool {
        self.discarded
    }

    /// The file `path` has another name now, or is gone.
    pub(super) fn forget(&mut self, path: &Path) {
        self.files.remove(path);
    }

    /// Takes the file `path` away.
    pub(super) fn remove(&mut self, path: &Path) {
        if self.files.remove(path) {
            // The error that ended the work is the one to report.
            drop(fs::remove_file(path));
        }
    }

    /// Makes the folder `path`, which goes again unless [`Unfinished::keep_folder`] is told.
    ///
    /// # Errors
    /// As [`Unfinished::create`].
    pub(super) fn create_folder(&mut self, path: &Path) -> Result<()> {
        if self.discarded {
            return Err(Error::Stopped);
        }
        fs::create_dir(path).map_err(|e| Error::io(path, e))?;
        self.folders.insert(path.to_path_buf());
        Ok(())
    }

    /// The folder `path` stays.
    pub(super) fn keep_folder(&mut self, path: &Path) {
        self.folders.remove(path);
    }

    /// Takes the folder `path` away, if nothing is in it.
    pub(super) fn remove_folder(&mut self, path: &Path) {
        if self.folders.remove(path) {
            drop(fs::remove_dir(path));
        }
    }
}
