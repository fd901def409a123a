//! What a volume is read from: a file, read from its start or at chosen places, or a folder of files.

use super::folder::Folder;
use super::reader::Clues;
use super::source::Source;
use crate::settings::Limits;
use crate::{Error, Result, files};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// First bytes looked at; enough for the magic of the first file in a tar archive.
const HEAD: usize = 1024;

/// The path that stands for standard input.
pub(super) const STDIN: &str = "-";

/// Whether the last name of `path` stands for several.
fn is_pattern(path: &Path) -> bool {
    path.file_name().and_then(|n| n.to_str()).is_some_and(|n| n.contains(['*', '?']))
}

/// A file or a folder.
pub(super) enum Store {
    /// A file, inflated where it is a gzip file.
    File(Source),
    Folder(Folder),
}

impl Store {
    /// Opens the file or folder `path`; a name of several files (with `*` or `?` in it) is a folder of those, `-` is standard input.
    ///
    /// # Errors
    /// When it is not there or cannot be read, and when it is neither.
    pub(super) fn open(path: &Path, limits: &Limits) -> Result<Self> {
        if path == Path::new(STDIN) {
            let mut source = Source::open_stdin(limits)?;
            return Ok(Self::File(if source.is_gzip()? { source.gunzip() } else { source }));
        }
        match std::fs::metadata(path) {
            Ok(meta) if meta.is_dir() => Folder::open(path, limits).map(Self::Folder),
            Ok(_) => Source::open(path, limits).map(Self::File),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound && is_pattern(path) => Folder::matching(path, limits).map(Self::Folder),
            Err(e) => Err(Error::io(path, e)),
        }
    }

    /// Whether `path` is what another program sends: standard input, or a pipe. It cannot be read twice.
    pub(super) fn comes_once(path: &Path) -> bool {
        path == Path::new(STDIN) || std::fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir())
    }

    /// Where it is, for messages.
    pub(super) fn path(&self) -> &Path {
        match self {
            Self::File(source) => source.path(),
            Self::Folder(folder) => folder.path(),
        }
    }

    /// What tells its format.
    ///
    /// # Errors
    /// When the file cannot be read or is empty.
    pub(super) fn clues(&mut self) -> Result<Clues<'_>> {
        match self {
            Self::File(source) => {
                if source.peek(HEAD)?.is_empty() {
                    return Err(source.fault("the file is empty (0 bytes)"));
                }
                let head = source.buffered();
                let head = &head[..head.len().min(HEAD)];
                let (length, packed, once) = (source.left(), source.is_packed(), source.is_once());
                Ok(Clues { path: source.path(), head, length, packed, once, entries: None, folder: None, limits: source.limits() })
            }
            Self::Folder(folder) => {
                let (path, entries, limits) = (folder.path(), Some(folder.names()), folder.limits());
                Ok(Clues { path, head: &[], length: 0, packed: false, once: false, entries, folder: Some(folder), limits })
            }
        }
    }

    /// The file from its start on, inflated where it is a gzip file: for formats that are one file.
    ///
    /// # Errors
    /// When this is a folder.
    pub(super) fn source(self) -> Result<Source> {
        match self {
            Self::File(source) => Ok(source),
            Self::Folder(folder) => Err(Error::format(folder.path(), "is a directory, not a file")),
        }
    }

    /// The bytes of the file at chosen places: for formats that are not read from their start, here called `what`.
    ///
    /// # Errors
    /// When this is a folder, or a gzip file, whose places are not to be had.
    pub(super) fn places(self, what: &str) -> Result<Places> {
        let source = self.source()?;
        if source.is_packed() {
            return Err(source.fault(format!("{what} inside gzip is not supported: unpack it first")));
        }
        if source.is_once() {
            return Err(source.fault(format!("{what} cannot be read from a pipe: give its file")));
        }
        let path = source.path().to_path_buf();
        let file = files::open(&path).map_err(|e| Error::io(&path, e))?;
        let length = file.metadata().map_err(|e| Error::io(&path, e))?.len();
        Ok(Places { path, file, length, limits: *source.limits() })
    }
}

/// A plain file, read at chosen places.
pub(super) struct Places {
    path: PathBuf,
    file: File,
    length: u64,
    limits: Limits,
}

impl Places {
    /// The file's name, for messages.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of the file.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// The limits in force.
    pub(super) fn limits(&self) -> &Limits {
        &self.limits
    }

    /// An [`Error::Format`] about this file.
    pub(super) fn fault(&self, what: impl Into<String>) -> Error {
        Error::format(&self.path, what)
    }

    /// Whether the file has `count` bytes from byte `at` on.
    pub(super) fn holds(&self, at: u64, count: u64) -> bool {
        at.checked_add(count).is_some_and(|end| end <= self.length)
    }

    /// The `count` bytes from byte `at` on, which are `what` of the file.
    ///
    /// # Errors
    /// When the file ends before, or these are more bytes than a header may have.
    pub(super) fn bytes(&self, at: u64, count: u64, what: &str) -> Result<Vec<u8>> {
        let limit = self.limits.header_bytes;
        if count > limit {
            return Err(Error::Limit {
                what: format!("{}: bytes of {what}", self.path.display()),
                needed: count.into(),
                limit: limit.into(),
            });
        }
        if !self.holds(at, count) {
            return Err(self.fault(format!("{what} of {count} bytes at byte {at}: the file has {}", self.length)));
        }
        let mut out = vec![0; count as usize];
        let mut file = &self.file;
        file.seek(SeekFrom::Start(at)).map_err(|e| Error::io(&self.path, e))?;
        file.read_exact(&mut out).map_err(|e| Error::io(&self.path, e))?;
        Ok(out)
    }

    /// A stream of the `count` bytes from byte `at` on; shorter where the file ends before.
    ///
    /// # Errors
    /// When the file cannot be opened once more.
    pub(super) fn stream(&self, at: u64, count: u64) -> Result<impl Read + use<>> {
        let mut file = files::open(&self.path).map_err(|e| Error::io(&self.path, e))?;
        file.seek(SeekFrom::Start(at)).map_err(|e| Error::io(&self.path, e))?;
        Ok(BufReader::with_capacity(1 << 16, file.take(count)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_at_places_are_bounded() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("a");
        std::fs::write(&path, (0..200u8).collect::<Vec<_>>()).expect("file");
        let limits = Limits { header_bytes: 100, ..Limits::default() };
        let places = Store::open(&path, &limits).and_then(|s| s.places("a list")).expect("opened");
        assert_eq!((places.bytes(7, 3, "x").expect("inside"), places.length()), (vec![7, 8, 9], 200));
        assert!(places.bytes(200, 0, "x").expect("at the end").is_empty());
        let told = |at, count| places.bytes(at, count, "the list").expect_err("refused").to_string();
        assert!(told(198, 3).contains("the list of 3 bytes at byte 198: the file has 200"));
        assert!(told(u64::MAX, 3).contains("the file has 200"));
        assert!(told(0, 101).contains("a: bytes of the list: 101 is over the limit of 100"));
        let mut rest = Vec::new();
        places.stream(150, 1000).expect("opened").read_to_end(&mut rest).expect("read");
        assert_eq!(rest, (150..200).collect::<Vec<_>>());
        let folder = |s: Store| s.places("a list").err().map(|e| e.to_string()).unwrap_or_default();
        assert!(folder(Store::open(dir.path(), &limits).expect("folder")).contains("is a directory, not a file"));
    }
}
