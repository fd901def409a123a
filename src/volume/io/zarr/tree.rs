//! Where a hierarchy lies: in a folder, or in a zip file as if that were one.

use super::node;
use crate::Result;
use crate::settings::Limits;
use crate::volume::io::folder::Folder;
use crate::volume::io::source::Source;
use crate::volume::io::store::Store;
use crate::volume::io::zip::{Archive, Entry};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Files by ways: names with `/` between.
pub(super) enum Tree {
    Folder(Folder),
    Zip(Zip),
}

/// The files of a zip file.
pub(super) struct Zip {
    path: PathBuf,
    /// One place is read at a time; what an entry holds is read by a stream of its own.
    archive: Mutex<Archive>,
    entries: BTreeMap<String, Entry>,
}

/// Whether one of the files in the zip file `path` is as `wanted`. A file that cannot be looked into is not.
pub(super) fn is_zip_of(path: &Path, limits: &Limits, wanted: impl Fn(&str) -> bool) -> bool {
    let entries = Store::open(path, limits).and_then(|store| Archive(store.places("a zip archive")?).entries());
    entries.is_ok_and(|entries| entries.iter().any(|entry| wanted(&entry.name)))
}

impl Tree {
    /// The folder or zip file that was given, or the folder of the metadata file that was.
    ///
    /// # Errors
    /// When it cannot be listed.
    pub(super) fn open(store: Store) -> Result<Self> {
        let mut source = match store {
            Store::Folder(folder) => return Ok(Self::Folder(folder)),
            Store::File(source) => source,
        };
        if !source.peek(2)?.starts_with(b"PK") {
            let parent = source.path().parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            return Folder::open(parent, source.limits()).map(Self::Folder);
        }
        let path = source.path().to_path_buf();
        let archive = Archive(Store::File(source).places("a zip archive")?);
        let mut entries: BTreeMap<String, Entry> = archive.entries()?.into_iter().map(|entry| (entry.name.clone(), entry)).collect();
        // Some writers put the folder itself into the zip file: then its name goes before all others.
        let depth = |name: &&String| name.matches('/').count();
        let first = entries.keys().filter(|name| node::FILES.contains(&last(name))).min_by_key(depth);
        if let Some(prefix) = first.and_then(|name| name.rsplit_once('/')).map(|(folder, _)| format!("{folder}/")) {
            let inside = entries.into_iter().filter_map(|(name, entry)| Some((name.strip_prefix(&prefix)?.to_owned(), entry)));
            entries = inside.collect();
        }
        Ok(Self::Zip(Zip { path, archive: Mutex::new(archive), entries }))
    }

    /// Where it is, for messages.
    pub(super) fn path(&self) -> &Path {
        match self {
            Self::Folder(folder) => folder.path(),
            Self::Zip(zip) => &zip.path,
        }
    }

    /// The file at `way`; `None` where there is none.
    ///
    /// # Errors
    /// When the way leads out of the folder or through a link, or the file cannot be read.
    pub(super) fn at(&self, way: &str) -> Result<Option<Source>> {
        match self {
            Self::Folder(folder) => folder.at(way),
            Self::Zip(zip) => {
                let Some(entry) = zip.entries.get(way) else { return Ok(None) };
                // What a thread that panicked has left is as good as before.
                let archive = zip.archive.lock().unwrap_or_else(PoisonError::into_inner);
                archive.open(entry).map(Some)
            }
        }
    }

    /// Tells `see` the name of each file and folder directly in the folder at `way` (empty for the outermost), and whether it is a folder.
    ///
    /// # Errors
    /// As [`Tree::at`]; those of `see`.
    pub(super) fn entries(&self, way: &str, mut see: impl FnMut(String, bool) -> Result<()>) -> Result<()> {
        let zip = match self {
            Self::Folder(folder) => return folder.entries(way, see),
            Self::Zip(zip) => zip,
        };
        let prefix = node::join(way, "");
        let mut before = None;
        for name in zip.entries.range(prefix.clone()..).map_while(|(name, _)| name.strip_prefix(&prefix)) {
            let (name, is_folder) = name.split_once('/').map_or((name, false), |(folder, _)| (folder, true));
            // All that is in one folder stands together.
            if !name.is_empty() && before != Some((name, is_folder)) {
                see(name.to_owned(), is_folder)?;
                before = Some((name, is_folder));
            }
        }
        Ok(())
    }
}

/// The last name of a way.
pub(super) fn last(way: &str) -> &str {
    way.rsplit('/').next().unwrap_or_default()
}
