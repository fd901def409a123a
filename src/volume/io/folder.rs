//! A folder as a place that a volume is read from: its files by name, and nothing outside it.

use super::store::Store;
use crate::settings::Limits;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// Most files and folders that a folder may hold.
const MOST_ENTRIES: usize = 1 << 16;

/// The files of one folder.
///
/// # Guarantees
/// - each name is that of a regular file directly in the folder: no folder, no link, no name with a separator;
/// - names are UTF-8, sorted by their bytes, and there are at most [`MOST_ENTRIES`].
pub(super) struct Folder {
    path: PathBuf,
    names: Vec<String>,
    limits: Limits,
}

impl Folder {
    /// Lists the folder `path`.
    ///
    /// # Errors
    /// When it cannot be listed or holds too many entries.
    pub(super) fn open(path: &Path, limits: &Limits) -> Result<Self> {
        let fault = |e| Error::io(path, e);
        let mut names = Vec::new();
        for (count, entry) in std::fs::read_dir(path).map_err(fault)?.enumerate() {
            if count == MOST_ENTRIES {
                let what = format!("{}: entries of the folder", path.display());
                return Err(Error::Limit { what, needed: count as u128 + 1, limit: count as u128 });
            }
            let entry = entry.map_err(fault)?;
            // The type of the entry itself: a link is not followed.
            if entry.file_type().map_err(fault)?.is_file() {
                names.extend(entry.file_name().into_string());
            }
        }
        names.sort_unstable();
        Ok(Self { path: path.to_path_buf(), names, limits: *limits })
    }

    /// Where it is, for messages.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Names of its files, sorted.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// The limits in force.
    pub(super) fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Opens the file `name` of the folder.
    ///
    /// # Errors
    /// When it is none of [`Folder::names`] or is no regular file any more; as [`Store::open`].
    pub(super) fn file(&self, name: &str) -> Result<Store> {
        let path = self.path.join(name);
        let listed = self.names.iter().any(|n| n == name);
        // It may have been replaced by a link since the folder was listed.
        if !listed || !std::fs::symlink_metadata(&path).map_err(|e| Error::io(&path, e))?.is_file() {
            return Err(Error::format(&self.path, format!("{name:?} is no file of this folder")));
        }
        Store::open(&path, &self.limits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn names_are_sorted_and_of_files_in_the_folder_alone() {
        let dir = tempfile::tempdir().expect("folder");
        let inner = dir.path().join("inner");
        fs::create_dir_all(inner.join("deep")).expect("folder");
        for (name, text) in [("inner/b", "bee"), ("inner/B", "Bee"), ("inner/a10", "ten"), ("inner/a9", "nine"), ("outside", "secret")] {
            fs::write(dir.path().join(name), text).expect("file");
        }
        #[cfg(unix)]
        for target in ["../outside", "b", "nowhere"] {
            std::os::unix::fs::symlink(target, inner.join(format!("link-{}", target.len()))).expect("link");
        }
        let folder = Folder::open(&inner, &Limits::default()).expect("listed");
        assert_eq!(folder.names(), ["B", "a10", "a9", "b"]);
        let Ok(Store::File(mut source)) = folder.file("b") else { panic!("b is a file") };
        assert_eq!(source.peek(9).expect("read"), b"bee");
        for name in ["../outside", "link-10", "link-1", "deep", "./b", "", ".", "..", "c"] {
            let line = folder.file(name).err().map(|e| e.to_string()).unwrap_or_default();
            assert!(line.contains("no file of this folder"), "{name:?}: {line:?}");
        }
        // Replaced since it was listed.
        fs::remove_file(inner.join("b")).expect("removed");
        assert!(folder.file("b").is_err());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../outside", inner.join("b")).expect("link");
            assert!(folder.file("b").is_err());
        }
    }

    #[test]
    fn a_folder_of_too_many_entries_is_refused() {
        let dir = tempfile::tempdir().expect("folder");
        for i in 0..=MOST_ENTRIES {
            fs::File::create(dir.path().join(i.to_string())).expect("file");
            if i + 1 == MOST_ENTRIES {
                assert_eq!(Folder::open(dir.path(), &Limits::default()).expect("just as many").names().len(), MOST_ENTRIES);
            }
        }
        let line = Folder::open(dir.path(), &Limits::default()).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(line.contains("65537 is over the limit of 65536"), "{line}");
    }
}
