//! A folder as a place that a volume is read from: its files by name, and nothing outside it.

use super::source::Source;
use super::store::Store;
use crate::settings::Limits;
use crate::{Error, Result};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Most files and folders that a folder may hold.
const MOST_ENTRIES: usize = 1 << 16;
/// Most folders that are entered, one in the other.
const DEEPEST: usize = 16;

/// Whether `pattern`, where `*` stands for any characters and `?` for one, stands for `name`.
fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    // The last star, and what of the name it stands for so far: a mismatch lets it stand for one more.
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p, n));
                p += 1;
            }
            Some(&c) if c == '?' || c == name[n] => (p, n) = (p + 1, n + 1),
            _ => {
                let Some((at, from)) = star else { return false };
                star = Some((at, from + 1));
                (p, n) = (at + 1, from + 1);
            }
        }
    }
    pattern[p..].iter().all(|&c| c == '*')
}

/// The files of one folder.
///
/// # Guarantees
/// - each name is that of a regular file directly in the folder: no folder, no link, no name with a separator;
/// - names are UTF-8, sorted by their bytes, and there are at most [`MOST_ENTRIES`].
pub(super) struct Folder {
    root: PathBuf,
    /// The path as given: the folder's, or a pattern of names in it.
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
        Ok(Self { root: path.to_path_buf(), path: path.to_path_buf(), names, limits: *limits })
    }

    /// The files of a folder whose names `pattern` stands for: its last name may have `*` for any characters and `?` for one.
    ///
    /// # Errors
    /// As [`Folder::open`]; when no file has such a name.
    pub(super) fn matching(pattern: &Path, limits: &Limits) -> Result<Self> {
        let name = pattern.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let parent = pattern.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut folder = Self::open(parent, limits)?;
        folder.names.retain(|n| matches(&name, n));
        if folder.names.is_empty() {
            return Err(Error::format(pattern, "no file has such a name"));
        }
        folder.path = pattern.to_path_buf();
        Ok(folder)
    }

    /// Names of all files in the folder and the folders in it, with `/` between, sorted; links are not followed.
    ///
    /// # Errors
    /// When a folder cannot be listed, when there are too many entries in all, or folders too deep in each other.
    pub(super) fn walk(&self) -> Result<Vec<String>> {
        let mut found = self.names.clone();
        // A pattern stands for files alone.
        let mut open = if self.path == self.root { vec![String::new()] } else { Vec::new() };
        let mut count = 0;
        while let Some(inner) = open.pop() {
            if inner.matches('/').count() > DEEPEST {
                return Err(Error::format(&self.path, format!("folders more than {DEEPEST} deep in each other: {inner}")));
            }
            let at = self.root.join(&inner);
            let fault = |e| Error::io(&at, e);
            for entry in std::fs::read_dir(&at).map_err(fault)? {
                count += 1;
                if count > MOST_ENTRIES {
                    let what = format!("{}: entries of the folder and those in it", self.path.display());
                    return Err(Error::Limit { what, needed: count as u128, limit: MOST_ENTRIES as u128 });
                }
                let entry = entry.map_err(fault)?;
                let (kind, Ok(name)) = (entry.file_type().map_err(fault)?, entry.file_name().into_string()) else { continue };
                if kind.is_dir() {
                    open.push(format!("{inner}{name}/"));
                } else if kind.is_file() && !inner.is_empty() {
                    found.push(format!("{inner}{name}"));
                }
            }
        }
        found.sort_unstable();
        Ok(found)
    }

    /// Opens the file at `way` (names with `/` between) as it lies on disk; `None` where there is none.
    ///
    /// # Errors
    /// When the way leads out of the folder or through a link, or the file cannot be read.
    pub(super) fn at(&self, way: &str) -> Result<Option<Source>> {
        self.inside(way)?.map(|path| Source::open_plain(&path, &self.limits)).transpose()
    }

    /// Tells `see` the name of each file and folder directly in the folder at `way` (empty for this folder itself), and whether it is a
    /// folder, in no order; nothing where there is no such folder. Links and names that are not UTF-8 are left out.
    ///
    /// # Errors
    /// As [`Folder::at`]; those of `see`.
    #[cfg(feature = "zarr")]
    pub(super) fn entries(&self, way: &str, mut see: impl FnMut(String, bool) -> Result<()>) -> Result<()> {
        let found = if way.is_empty() { Some(self.root.clone()) } else { self.inside(way)? };
        let Some(path) = found.filter(|path| path.is_dir()) else { return Ok(()) };
        let fault = |e| Error::io(&path, e);
        for entry in std::fs::read_dir(&path).map_err(fault)? {
            let entry = entry.map_err(fault)?;
            let (kind, Ok(name)) = (entry.file_type().map_err(fault)?, entry.file_name().into_string()) else { continue };
            if kind.is_dir() || kind.is_file() {
                see(name, kind.is_dir())?;
            }
        }
        Ok(())
    }

    /// The path that `way` leads to; `None` where nothing is there.
    fn inside(&self, way: &str) -> Result<Option<PathBuf>> {
        let mut path = self.root.clone();
        for name in way.split('/') {
            if name.is_empty() || name == "." || name == ".." || name.contains(['\\', '\0', ':']) {
                return Err(Error::format(&self.path, format!("{way:?} is no way to a file of this folder")));
            }
            path.push(name);
            match std::fs::symlink_metadata(&path) {
                Ok(meta) if meta.is_symlink() => return Err(Error::format(&path, "is a link: links in a folder are not followed")),
                Ok(_) => {}
                Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Ok(None),
                Err(e) => return Err(Error::io(&path, e)),
            }
        }
        Ok(Some(path))
    }

    /// Where it is, for messages; the pattern where one was given.
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

    /// Where the file `name` of the folder is, for messages.
    #[cfg(feature = "stacks")]
    pub(super) fn place(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// Opens the file `name` of the folder.
    ///
    /// # Errors
    /// When it is none of [`Folder::names`] or is no regular file any more; as [`Store::open`].
    pub(super) fn file(&self, name: &str) -> Result<Store> {
        let path = self.root.join(name);
        let listed = self.names.iter().any(|n| n == name);
        // It may have been replaced by a link since the folder was listed.
        if !listed || !std::fs::symlink_metadata(&path).map_err(|e| Error::io(&path, e))?.is_file() {
            return Err(Error::format(&self.root, format!("{name:?} is no file of this folder")));
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
