//! Reading a file from its start: with limits, and with every size that a header claims checked before memory is taken for it.
//!
//! A [`Source`] is a plain file, or what a compressed one holds. It knows how many bytes can still come (`left`: exact for a plain
//! file, an upper bound for a compressed one), and a header that claims more voxels than that is refused.

mod voxels;

pub(super) use voxels::{Tail, room, scatter_z_fastest, too_large};

use super::gzip::Members;
use crate::settings::Limits;
use crate::{Error, Result, files};
use std::fs::{File, Metadata};
use std::io::{self, BufReader, IsTerminal, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Most bytes that one byte of deflate data inflates to: a 258-byte copy takes two bits at best, and block headers cost a
/// little more (zlib's technical notes give 1032:1 as the limit).
const DEFLATE_RATIO: u64 = 1032;

/// Most bytes that one byte of bzip2 data inflates to: a block of 900,000 bytes, each run of 4 and a count standing for 259 bytes, is written
/// in no less than 32 bytes.
const BZIP2_RATIO: u64 = 1 << 21;

/// Bytes asked of the system at a time while reading headers and text.
const CHUNK: usize = 1 << 16;

enum Inner {
    File(File),
    Stream(Box<dyn Read>),
    /// Bytes that another program sends, of which nobody knows how many there are.
    Pipe(File),
}

/// A stream of bytes of which it is known how many can come at most. See the module's page.
pub(super) struct Source {
    path: PathBuf,
    inner: Inner,
    /// Bytes read ahead; those before `start` are used up.
    buffer: Vec<u8>,
    start: usize,
    left: u64,
    /// Length of the file, where it is a plain one.
    length: u64,
    /// Length of the compressed data, where there is any.
    packed: Option<u64>,
    header_left: u64,
    limits: Limits,
    /// Whether the bytes come once: from another program, or from standard input.
    once: bool,
}

impl Source {
    /// Opens `path` as it lies on disk.
    pub(super) fn open_plain(path: &Path, limits: &Limits) -> Result<Self> {
        // Opening a device may do anything, so its kind is looked at first. Opening a pipe waits until another program writes to it.
        let meta = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
        if !meta.is_file() && !is_pipe(&meta) {
            let what = if meta.is_dir() { "is a directory, not a file" } else { "is neither a file nor a pipe" };
            return Err(Error::format(path, what));
        }
        let file = File::open(path).map_err(|e| Error::io(path, e))?;
        Self::of_file(path, file, limits)
    }

    /// Standard input as it comes: a file where the shell opened one for it, else a pipe.
    pub(super) fn open_stdin(limits: &Limits) -> Result<Self> {
        let path = Path::new("standard input");
        if io::stdin().is_terminal() {
            return Err(Error::format(path, "is a terminal: let another program send the volume, or give its file"));
        }
        let file = stdin_file().map_err(|e| Error::io(path, e))?;
        Ok(Self { once: true, ..Self::of_file(path, file, limits)? })
    }

    /// What `file` still has to give.
    fn of_file(path: &Path, mut file: File, limits: &Limits) -> Result<Self> {
        files::note(&file);
        let meta = file.metadata().map_err(|e| Error::io(path, e))?;
        let place = if meta.is_file() { file.stream_position().map_err(|e| Error::io(path, e))? } else { 0 };
        let (inner, left, length) = if meta.is_file() {
            (Inner::File(file), meta.len().saturating_sub(place), meta.len())
        } else {
            // More than a volume may take is never asked for.
            (Inner::Pipe(file), limits.voxel_bytes.saturating_add(limits.header_bytes), 0)
        };
        Ok(Self {
            path: path.to_path_buf(),
            inner,
            buffer: Vec::new(),
            start: 0,
            left,
            length,
            packed: None,
            header_left: limits.header_bytes,
            limits: *limits,
            once: !meta.is_file(),
        })
    }

    /// Opens `path`, looking inside when it is a gzip file.
    pub(super) fn open(path: &Path, limits: &Limits) -> Result<Self> {
        let mut source = Self::open_plain(path, limits)?;
        if source.is_gzip()? { Ok(source.gunzip()) } else { Ok(source) }
    }

    /// A stream of bytes that is part of the file `path`, such as an entry of an archive: at most `left` bytes, from `packed` compressed ones.
    pub(super) fn from_stream(path: &Path, stream: Box<dyn Read>, left: u64, packed: Option<u64>, limits: &Limits) -> Self {
        Self {
            path: path.to_path_buf(),
            inner: Inner::Stream(stream),
            buffer: Vec::new(),
            start: 0,
            left,
            length: 0,
            packed,
            header_left: limits.header_bytes,
            limits: *limits,
            once: false,
        }
    }

    /// Whether a gzip stream starts here.
    pub(super) fn is_gzip(&mut self) -> Result<bool> {
        Ok(self.peek(2)? == [0x1f, 0x8b])
    }

    /// What comes out when the rest of this source is a gzip stream.
    pub(super) fn gunzip(self) -> Self {
        self.through(|inner| Box::new(Members::new(inner)))
    }

    /// What comes out when the rest of this source is a zlib stream.
    pub(super) fn inflate_zlib(self) -> Self {
        self.through(|inner| Box::new(flate2::bufread::ZlibDecoder::new(inner)))
    }

    /// What comes out when the rest of this source is a bzip2 stream.
    pub(super) fn bunzip2(self) -> Self {
        let (left, packed) = (self.left.saturating_mul(BZIP2_RATIO), self.left);
        Self { left, packed: Some(packed), ..self.through(|inner| Box::new(bzip2::bufread::MultiBzDecoder::new(inner))) }
    }

    /// The bytes that the rest of this source writes as two digits each, with white space between them.
    pub(super) fn unhex(self) -> Self {
        let left = self.left / 2;
        Self { left, packed: None, ..self.through(|inner| Box::new(super::hex::Hex::new(inner))) }
    }

    /// How many bytes the rest of this source has, found out by reading them; no more than a volume may take.
    pub(super) fn length_inflated(mut self) -> Result<u64> {
        let most = self.limits.voxel_bytes.saturating_add(self.limits.header_bytes);
        let mut chunk = vec![0; CHUNK];
        let mut length = 0u64;
        loop {
            match self.read(&mut chunk).map_err(|e| self.read_fault(e))? {
                0 => return Ok(length),
                n => length += n as u64,
            }
            if length > most {
                let what = format!("{}: bytes that come out of the compressed data", self.path.display());
                return Err(Error::Limit { what, needed: length.into(), limit: most.into() });
            }
        }
    }

    /// What comes out when the rest of this source is deflate data alone.
    #[cfg(feature = "dicom")]
    pub(super) fn inflate(self) -> Self {
        self.through(|inner| Box::new(flate2::bufread::DeflateDecoder::new(inner)))
    }

    fn through(self, decoder: impl FnOnce(BufReader<Self>) -> Box<dyn Read>) -> Self {
        let (path, packed, left) = (self.path.clone(), self.left, inflated_bound(self.left));
        let (header_left, limits, once) = (self.header_left, self.limits, self.once);
        let stream = decoder(BufReader::with_capacity(CHUNK, self));
        Self { header_left, once, ..Self::from_stream(&path, stream, left, Some(packed), &limits) }
    }

    /// The file's name, for messages.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The limits in force.
    pub(super) fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Bytes that can still come: exact for a plain file, an upper bound for a compressed one.
    pub(super) fn left(&self) -> u64 {
        self.left
    }

    /// Whether these bytes come out of a compressed stream.
    pub(super) fn is_packed(&self) -> bool {
        self.packed.is_some()
    }

    /// Whether another program sends these bytes: then they come once, and nobody knows how many there are.
    pub(super) fn is_pipe(&self) -> bool {
        matches!(self.inner, Inner::Pipe(_))
    }

    /// Whether the bytes come once, so that the file cannot be opened again.
    pub(super) fn is_once(&self) -> bool {
        self.once
    }

    /// The plain file behind this source, and the byte of it that comes next.
    fn plain(&self) -> Option<(&File, u64)> {
        match &self.inner {
            // What is left of a plain file is exact.
            Inner::File(file) => Some((file, self.length - self.left)),
            Inner::Stream(_) | Inner::Pipe(_) => None,
        }
    }

    /// An [`Error::Format`] about this file.
    pub(super) fn fault(&self, what: impl Into<String>) -> Error {
        Error::format(&self.path, what)
    }

    fn read_fault(&self, e: io::Error) -> Error {
        if self.is_packed() { self.fault(format!("the compressed data is damaged: {e}")) } else { Error::io(&self.path, e) }
    }

    fn read_inner(&mut self, out: &mut [u8]) -> io::Result<usize> {
        loop {
            let result = match &mut self.inner {
                Inner::File(f) | Inner::Pipe(f) => f.read(out),
                Inner::Stream(s) => s.read(out),
            };
            match result {
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                other => return other,
            }
        }
    }

    /// The next bytes, up to `n` of them (fewer only at the end), without using them up.
    pub(super) fn peek(&mut self, n: usize) -> Result<&[u8]> {
        self.fill(n).map_err(|e| self.read_fault(e))?;
        let end = self.buffer.len().min(self.start + n);
        Ok(&self.buffer[self.start..end])
    }

    /// What is read ahead already.
    pub(super) fn buffered(&self) -> &[u8] {
        &self.buffer[self.start..]
    }

    fn fill(&mut self, n: usize) -> io::Result<()> {
        while self.buffer.len() - self.start < n {
            if self.start > 0 {
                self.buffer.drain(..self.start);
                self.start = 0;
            }
            let have = self.buffer.len();
            self.buffer.resize(have + CHUNK, 0);
            let mut chunk = std::mem::take(&mut self.buffer);
            let got = self.read_inner(&mut chunk[have..]);
            self.buffer = chunk;
            self.buffer.truncate(have + got.as_ref().map_or(0, |&g| g));
            if got? == 0 {
                break;
            }
        }
        Ok(())
    }

    /// Uses up `n` bytes that were peeked at.
    pub(super) fn consume(&mut self, n: usize) {
        self.start += n;
        self.left = self.left.saturating_sub(n as u64);
    }

    fn take_header(&mut self, n: usize) -> Result<()> {
        if n as u64 > self.header_left {
            let limit = self.limits.header_bytes;
            let needed = u128::from(limit - self.header_left) + n as u128;
            let what = format!("{}: bytes of header", self.path.display());
            return Err(Error::Limit { what, needed, limit: limit.into() });
        }
        self.header_left -= n as u64;
        Ok(())
    }

    /// The next line of a header without its end, or `None` at the end of the file.
    ///
    /// # Errors
    /// When the header grows past its limit.
    pub(super) fn line(&mut self) -> Result<Option<String>> {
        let mut seen = 0;
        loop {
            let have = self.peek(seen + 1)?.len();
            if have <= seen {
                if seen == 0 {
                    return Ok(None);
                }
                return self.take_line(seen, seen).map(Some);
            }
            // `peek` promises one byte more than was seen; search all that is there.
            let fresh = &self.buffer[self.start + seen..];
            if let Some(at) = fresh.iter().position(|&b| b == b'\n') {
                return self.take_line(seen + at, seen + at + 1).map(Some);
            }
            seen += fresh.len();
            if seen as u64 > self.header_left {
                self.take_header(seen)?;
            }
        }
    }

    fn take_line(&mut self, text: usize, all: usize) -> Result<String> {
        self.take_header(all)?;
        let bytes = &self.buffer[self.start..self.start + text];
        let bytes = bytes.strip_suffix(b"\r").unwrap_or(bytes);
        let line = String::from_utf8_lossy(bytes).into_owned();
        self.consume(all);
        Ok(line)
    }

    /// Exactly `n` bytes of a header called `what`.
    ///
    /// # Errors
    /// When the file ends before, or the header grows past its limit.
    pub(super) fn header(&mut self, n: usize, what: &str) -> Result<Vec<u8>> {
        self.take_header(n)?;
        let bytes = self.peek(n)?.to_vec();
        if bytes.len() < n {
            return Err(self.fault(format!("{what} takes {n} bytes, the file ends after {}", bytes.len())));
        }
        self.consume(n);
        Ok(bytes)
    }

    /// Passes over `n` bytes.
    ///
    /// # Errors
    /// When there are fewer.
    pub(super) fn skip(&mut self, n: u64) -> Result<()> {
        if n > self.left {
            return Err(self.fault(format!("{n} bytes are to be skipped, only {} follow", self.left)));
        }
        let buffered = n.min((self.buffer.len() - self.start) as u64);
        self.consume(buffered as usize);
        let mut rest = n - buffered;
        if let Inner::File(file) = &mut self.inner {
            // `rest` is at most the file's length, which fits.
            if rest > 0 {
                file.seek(SeekFrom::Current(rest as i64)).map_err(|e| Error::io(&self.path, e))?;
                self.left -= rest;
            }
            return Ok(());
        }
        while rest > 0 {
            let want = rest.min(CHUNK as u64) as usize;
            let got = self.peek(want)?.len();
            if got == 0 {
                return Err(self.fault(format!("{n} bytes are to be skipped, only {} follow", n - rest)));
            }
            self.consume(got);
            rest -= got as u64;
        }
        Ok(())
    }
}

impl Read for Source {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let buffered = out.len().min(self.buffer.len() - self.start);
        if buffered > 0 {
            out[..buffered].copy_from_slice(&self.buffer[self.start..self.start + buffered]);
            self.consume(buffered);
            return Ok(buffered);
        }
        let n = self.read_inner(out)?;
        self.left = self.left.saturating_sub(n as u64);
        Ok(n)
    }
}

/// Whether this is what another program sends.
fn is_pipe(meta: &Metadata) -> bool {
    #[cfg(unix)]
    let pipe = std::os::unix::fs::FileTypeExt::is_fifo(&meta.file_type());
    #[cfg(not(unix))]
    let pipe = !(meta.is_file() || meta.is_dir());
    pipe
}

/// Standard input as a file of its own.
fn stdin_file() -> io::Result<File> {
    #[cfg(unix)]
    let own = std::os::fd::AsFd::as_fd(&io::stdin()).try_clone_to_owned()?;
    #[cfg(windows)]
    let own = std::os::windows::io::AsHandle::as_handle(&io::stdin()).try_clone_to_owned()?;
    Ok(File::from(own))
}

/// Most bytes that `packed` bytes of deflate data inflate to.
pub(super) fn inflated_bound(packed: u64) -> u64 {
    packed.saturating_mul(DEFLATE_RATIO)
}
