//! Files in a tree: those of a folder and the folders in it, of a zip archive or of a tar archive, visited one after the other.
//!
//! An archive is never unpacked on disk: each of its files is a bounded stream while it is visited. A tar archive inside gzip is inflated
//! anew by each visit.

mod tar;

use super::folder::Folder;
use super::source::Source;
use super::store::Store;
use super::zip::{Archive, Entry};
use crate::settings::Limits;
use crate::{Error, Result};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tar::Tar;

pub(super) use tar::is_tar;

/// Most files that an archive may hold, as many as a folder.
const MOST_FILES: usize = 1 << 16;

/// A file of the tree while it is visited.
pub(super) struct Leaf {
    /// Its number, the same in every visit.
    pub(super) index: usize,
    /// What messages call it: its path, in an archive behind that of the archive.
    pub(super) path: PathBuf,
    pub(super) source: Source,
}

enum Kind {
    Folder(Folder, Vec<String>),
    Zip(Archive, Vec<Entry>),
    Tar,
    /// One file.
    File,
    /// One file that another program sent.
    Sent(Arc<[u8]>),
}

/// See the module's page.
pub(super) struct Tree {
    kind: Kind,
    path: PathBuf,
    limits: Limits,
}

/// Bytes of one file that was sent through a pipe.
struct Sent {
    bytes: Arc<[u8]>,
    at: usize,
}

impl Read for Sent {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let n = (&self.bytes[self.at..]).read(out)?;
        self.at += n;
        Ok(n)
    }
}

/// `name` of an archive's file, fit for one line of a message.
fn shown(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}

impl Tree {
    /// The files that `store` holds: those of a folder or an archive, else the one file itself.
    ///
    /// # Errors
    /// When the folder or archive cannot be listed, holds too many files, or comes through a pipe (one file alone may).
    pub(super) fn of(store: Store) -> Result<Self> {
        let path = store.path().to_path_buf();
        let mut source = match store {
            Store::Folder(folder) => {
                let (names, limits) = (folder.walk()?, *folder.limits());
                return Ok(Self { kind: Kind::Folder(folder, names), path, limits });
            }
            Store::File(source) => source,
        };
        let limits = *source.limits();
        let (zip, tar) = {
            let head = source.peek(512)?;
            // What stands before the magic of a DICOM file may be anything.
            let plain = head.get(128..132) == Some(b"DICM");
            (!plain && head.starts_with(b"PK\x03\x04"), !plain && is_tar(head))
        };
        let kind = if zip {
            let archive = Archive(Store::File(source).places("a zip archive")?);
            let entries = archive.entries()?;
            Kind::Zip(archive, entries)
        } else if tar {
            if source.is_pipe() || path == Path::new("standard input") {
                return Err(source.fault("a tar archive cannot be read from a pipe: give its file"));
            }
            Kind::Tar
        } else if path.is_file() {
            Kind::File
        } else {
            let mut bytes = Vec::new();
            let most = limits.voxel_bytes.saturating_add(limits.header_bytes);
            source.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(|e| Error::io(&path, e))?;
            if bytes.len() as u64 > most {
                let what = format!("{}: bytes sent", path.display());
                return Err(Error::Limit { what, needed: bytes.len() as u128, limit: most.into() });
            }
            Kind::Sent(bytes.into())
        };
        Ok(Self { kind, path, limits })
    }

    /// Where it is, for messages.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it is one file, not a folder or an archive of files.
    pub(super) fn is_one(&self) -> bool {
        matches!(self.kind, Kind::File | Kind::Sent(_))
    }

    /// How many files there are; `None` for a tar archive, which has no list of its files.
    pub(super) fn count(&self) -> Option<usize> {
        match &self.kind {
            Kind::Folder(_, names) => Some(names.len()),
            Kind::Zip(_, entries) => Some(entries.len()),
            Kind::Tar => None,
            Kind::File | Kind::Sent(_) => Some(1),
        }
    }

    /// Calls `each` for every file whose number `wanted` holds, in the order of their numbers, until it returns false.
    ///
    /// # Errors
    /// Those of `each`; when a file cannot be opened or the archive is damaged.
    pub(super) fn visit(&self, wanted: &dyn Fn(usize) -> bool, each: &mut dyn FnMut(Leaf) -> Result<bool>) -> Result<()> {
        let one = |source| Leaf { index: 0, path: self.path.clone(), source };
        match &self.kind {
            Kind::Folder(folder, names) => {
                for (index, name) in names.iter().enumerate().filter(|&(i, _)| wanted(i)) {
                    // One that went away since the folder was listed is not there.
                    let Some(source) = folder.at(name)? else { continue };
                    let source = gunzipped(source)?;
                    if !each(Leaf { index, path: source.path().to_path_buf(), source })? {
                        return Ok(());
                    }
                }
            }
            Kind::Zip(archive, entries) => {
                for (index, entry) in entries.iter().enumerate().filter(|&(i, e)| wanted(i) && !e.name.ends_with('/')) {
                    let path = self.path.join(shown(&entry.name));
                    if !each(Leaf { index, source: archive.open(entry)?, path })? {
                        return Ok(());
                    }
                }
            }
            Kind::Tar => {
                let mut tar = Tar::new(Source::open(&self.path, &self.limits)?);
                let mut index = 0;
                while let Some((name, source)) = tar.next()? {
                    if index == MOST_FILES {
                        let what = format!("{}: files in the archive", self.path.display());
                        return Err(Error::Limit { what, needed: index as u128 + 1, limit: MOST_FILES as u128 });
                    }
                    if wanted(index) && !each(Leaf { index, path: self.path.join(shown(&name)), source })? {
                        return Ok(());
                    }
                    index += 1;
                }
            }
            Kind::File if wanted(0) => {
                each(one(Source::open(&self.path, &self.limits)?))?;
            }
            Kind::Sent(bytes) if wanted(0) => {
                let stream = Box::new(Sent { bytes: Arc::clone(bytes), at: 0 });
                each(one(Source::from_stream(&self.path, stream, bytes.len() as u64, None, &self.limits)))?;
            }
            Kind::File | Kind::Sent(_) => {}
        }
        Ok(())
    }
}

/// The file, looked into where it is a gzip file.
fn gunzipped(mut source: Source) -> Result<Source> {
    if source.is_gzip()? { Ok(source.gunzip()) } else { Ok(source) }
}
