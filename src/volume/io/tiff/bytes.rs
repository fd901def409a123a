//! Bytes of a TIFF file at chosen places. Each thread has a handle of its own.

use crate::settings::Limits;
use crate::volume::io::Endian;
use crate::volume::io::store::Places;
use crate::{Error, Result, files};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bytes read ahead of a header, so that a directory and its values take one read.
const AHEAD: u64 = 4096;

/// A file that is not kept open: a volume may lie in more files than a program may open.
pub(super) struct OnDisk {
    path: PathBuf,
    length: u64,
    limits: Limits,
}

impl OnDisk {
    pub(super) fn new(places: &Places) -> Self {
        Self { path: places.path().to_path_buf(), length: places.length(), limits: *places.limits() }
    }

    /// The file's name.
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

    /// Whether the file has `count` bytes from byte `at` on.
    pub(super) fn holds(&self, at: u64, count: u64) -> bool {
        at.checked_add(count).is_some_and(|end| end <= self.length)
    }

    /// An [`Error::Format`] about this file.
    pub(super) fn fault(&self, what: impl Into<String>) -> Error {
        Error::format(&self.path, what)
    }
}

/// A handle on a file, and the part of it that was read last.
pub(super) struct Bytes<'a> {
    pub(super) places: &'a OnDisk,
    pub(super) endian: Endian,
    file: File,
    start: u64,
    window: Vec<u8>,
}

impl<'a> Bytes<'a> {
    /// A handle on the file of `places`, whose numbers are in the order `endian`.
    ///
    /// # Errors
    /// When the file cannot be opened once more.
    pub(super) fn open(places: &'a OnDisk, endian: Endian) -> Result<Self> {
        let file = files::open(&places.path).map_err(|e| Error::io(&places.path, e))?;
        Ok(Self { places, endian, file, start: 0, window: Vec::new() })
    }

    /// The part of the window that holds `count` bytes from byte `at` of the file on.
    fn within(&self, at: u64, count: u64) -> Option<Range<usize>> {
        let first = at.checked_sub(self.start)?;
        let end = first.checked_add(count).filter(|&end| end <= self.window.len() as u64)?;
        Some(first as usize..end as usize)
    }

    /// The `count` bytes from byte `at` on, which are `what` of the file.
    ///
    /// # Errors
    /// When the file ends before, or these are more bytes than a header may have.
    pub(super) fn header(&mut self, at: u64, count: u64, what: &str) -> Result<&[u8]> {
        if self.within(at, count).is_none() {
            let limit = self.places.limits().header_bytes;
            if count > limit {
                let what = format!("{}: bytes of {what}", self.places.path().display());
                return Err(Error::Limit { what, needed: count.into(), limit: limit.into() });
            }
            if !self.places.holds(at, count) {
                let length = self.places.length();
                return Err(self.places.fault(format!("{what} of {count} bytes at byte {at}: the file has {length}")));
            }
            let ahead = count.max(AHEAD.min(limit)).min(self.places.length() - at);
            let mut window = std::mem::take(&mut self.window);
            window.resize(ahead as usize, 0);
            let read = self.exactly(at, &mut window);
            (self.window, self.start) = (window, at);
            read.inspect_err(|_| self.window.clear())?;
        }
        Ok(self.within(at, count).map_or(&[], |range| &self.window[range]))
    }

    /// Fills `out` from byte `at` of the file on, where so many bytes are.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(super) fn exactly(&mut self, at: u64, out: &mut [u8]) -> Result<()> {
        let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(out));
        read.map_err(|e| Error::io(self.places.path(), e))
    }
}
