//! A folder of files that appears whole or not at all.

use super::unfinished::unfinished;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// A folder in the making, under a name of its own beside the one that it will have. Dropped before [`WholeFolder::finish`] it is taken away again
/// with all that is in it.
#[derive(Debug)]
pub struct WholeFolder {
    part: PathBuf,
    path: PathBuf,
    done: bool,
}

impl WholeFolder {
    /// Begins the folder `path`.
    ///
    /// # Errors
    /// [`Error::Format`] where it names none, and where something is there already; [`Error::Io`] where none can be made beside it;
    /// [`Error::Stopped`] after [`discard_unfinished`](super::discard_unfinished).
    pub fn create(path: &Path) -> Result<Self> {
        if path.file_name().is_none() {
            return Err(Error::format(path, "names no folder"));
        }
        match path.symlink_metadata() {
            Ok(_) => return Err(Error::format(path, "is there already; remove it or choose another name")),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => return Err(Error::io(path, e)),
        }
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let part = unfinished().create_tree(parent).map_err(|e| match e {
            // The name that the caller knows.
            Error::Io { source, .. } => Error::io(path, source),
            other => other,
        })?;
        Ok(Self { part, path: path.to_path_buf(), done: false })
    }

    /// Where it is so far: files go in here.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Gives the folder its name.
    ///
    /// # Errors
    /// When the system refuses; then nothing is left of it.
    pub fn finish(mut self) -> Result<()> {
        unfinished().rename_tree(&self.part, &self.path)?;
        self.done = true;
        Ok(())
    }
}

impl Drop for WholeFolder {
    fn drop(&mut self) {
        if !self.done {
            unfinished().remove_tree(&self.part);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_folder_appears_whole_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("tree");
        let names = || fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect::<Vec<_>>();
        for finishes in [false, true] {
            let whole = WholeFolder::create(&path).unwrap();
            fs::create_dir(whole.part().join("0")).unwrap();
            fs::write(whole.part().join("0/a"), "x").unwrap();
            assert!(!path.exists() && names().len() == 1);
            if finishes {
                whole.finish().unwrap();
            } else {
                drop(whole);
                assert!(names().is_empty());
            }
        }
        assert_eq!((names(), fs::read_to_string(path.join("0/a")).unwrap()), (vec!["tree".to_owned()], "x".to_owned()));
        let error = WholeFolder::create(&path).unwrap_err().to_string();
        assert!(error.contains("tree: is there already"), "{error}");
    }
}
