//! Several files that appear together or not at all.

use super::unfinished::unfinished;
use super::whole::{Whole, finish_all};
use crate::Result;
use std::path::{Path, PathBuf};

/// The results of one piece of work. Each is written beside its name at once; all get their names in [`Staged::finish`], or none does. Dropped
/// before, everything is taken away again, with the folders made for it.
#[derive(Debug, Default)]
pub struct Staged {
    files: Vec<Whole>,
    /// What goes to devices and pipes, which cannot be taken back: written once all files are there, before they get their names.
    devices: Vec<(Whole, Vec<u8>)>,
    folders: Vec<PathBuf>,
}

impl Staged {
    /// Nothing so far.
    pub fn new() -> Self {
        Self::default()
    }

    /// Makes the folder `path`, unless it is there.
    ///
    /// # Errors
    /// [`crate::Error::Io`] where none can be made.
    pub fn folder(&mut self, path: &Path) -> Result<()> {
        if !path.is_dir() {
            unfinished().create_folder(path)?;
            self.folders.push(path.to_path_buf());
        }
        Ok(())
    }

    /// One more file, `path`, of `bytes`.
    ///
    /// # Errors
    /// As [`Whole::create`], and where the bytes cannot be written.
    pub fn add(&mut self, path: &Path, bytes: &[u8]) -> Result<()> {
        let mut whole = Whole::create(path)?;
        if whole.is_file() {
            whole.put_all(bytes)?;
            self.files.push(whole);
        } else {
            self.devices.push((whole, bytes.to_vec()));
        }
        Ok(())
    }

    /// One more file, written elsewhere.
    pub fn push(&mut self, whole: Whole) {
        self.files.push(whole);
    }

    /// Gives every file its name.
    ///
    /// # Errors
    /// [`crate::Error::Io`] where a device cannot be written to or a file cannot be renamed; then every earlier file is as it was.
    pub fn finish(mut self) -> Result<()> {
        for (device, bytes) in &mut self.devices {
            device.put_all(bytes)?;
        }
        finish_all(std::mem::take(&mut self.files))?;
        let mut all = unfinished();
        std::mem::take(&mut self.folders).iter().for_each(|folder| all.keep_folder(folder));
        Ok(())
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // Folders go once nothing is in them.
        self.files.clear();
        let mut all = unfinished();
        self.folders.iter().rev().for_each(|folder| all.remove_folder(folder));
    }
}
