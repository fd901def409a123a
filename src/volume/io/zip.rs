//! Zip files: the directory at their end, and entries stored or deflated, each read as a stream of its own.
//!
//! Source of the format: PKWARE's APPNOTE.TXT, sections 4.3 and 4.5 (with the 64-bit sizes that are used past 4 GiB). Only this is needed
//! of it. Reading it here keeps the directory within the header limit, which the usual library does not: it takes memory by the number of
//! entries the file claims.

use super::Endian;
use super::source::{Source, inflated_bound};
use super::store::Places;
use crate::Result;
use flate2::Crc;
use flate2::read::DeflateDecoder;
use std::io::{self, Read};

const LE: Endian = Endian::Little;

/// Bytes of the record that ends a zip file, without its comment.
const END: usize = 22;
/// Bytes of the record before it that says where the 64-bit one is.
const LOCATOR: usize = 20;

/// Methods of compression that are not read, by their numbers.
const METHODS: [(u16, &str); 8] =
    [(1, "shrink"), (6, "implode"), (9, "deflate64"), (12, "bzip2"), (14, "LZMA"), (93, "Zstandard"), (95, "xz"), (98, "PPMd")];

/// One file in the archive.
pub(super) struct Entry {
    pub(super) name: String,
    /// 0 stored, 8 deflated.
    method: u16,
    encrypted: bool,
    crc: u32,
    packed: u64,
    pub(super) unpacked: u64,
    /// Where its own header starts.
    at: u64,
}

/// Reads what the directory of the archive and its entries need.
pub(super) struct Archive(pub(super) Places);

impl Archive {
    /// Place and size of the directory.
    fn directory(&self) -> Result<(u64, u64)> {
        // The end record is the last thing but for a comment of up to 65535 bytes.
        let window = (END + LOCATOR + usize::from(u16::MAX)) as u64;
        let window = window.min(self.0.length()).min(self.0.limits().header_bytes);
        let tail = self.0.bytes(self.0.length() - window, window, "the end")?;
        let found = tail.windows(END).rposition(|w| w.starts_with(b"PK\x05\x06"));
        let Some(found) = found else {
            return Err(self.0.fault("the zip archive has no directory at its end: cut short?"));
        };
        let end = &tail[found..];
        let (mut size, mut at) = (u64::from(LE.u32(&end[12..])), u64::from(LE.u32(&end[16..])));
        let locator = found.checked_sub(LOCATOR).map(|l| &tail[l..found]).filter(|l| l.starts_with(b"PK\x06\x07"));
        if let Some(locator) = locator {
            let record = self.0.bytes(LE.u64(&locator[8..]), 56, "the 64-bit end record")?;
            if !record.starts_with(b"PK\x06\x06") {
                return Err(self.0.fault("the zip archive's 64-bit end record is not where it should be"));
            }
            (size, at) = (LE.u64(&record[40..]), LE.u64(&record[48..]));
        }
        Ok((at, size))
    }

    /// What the directory lists, in its order.
    ///
    /// # Errors
    /// When there is no directory, or it is damaged or over the header limit.
    pub(super) fn entries(&self) -> Result<Vec<Entry>> {
        let (at, size) = self.directory()?;
        let directory = self.0.bytes(at, size, "the zip archive's directory")?;
        let mut rest = &directory[..];
        let mut entries = Vec::new();
        while rest.starts_with(b"PK\x01\x02") && rest.len() >= 46 {
            let [name, extra, comment] = [28, 30, 32].map(|at| usize::from(LE.u16(&rest[at..])));
            let Some(fields) = rest.get(46..46 + name + extra + comment) else {
                return Err(self.0.fault(format!("entry {} of the zip archive's directory is cut short", entries.len())));
            };
            let mut entry = Entry {
                name: String::from_utf8_lossy(&fields[..name]).into_owned(),
                method: LE.u16(&rest[10..]),
                encrypted: LE.u16(&rest[8..]) & 1 == 1,
                crc: LE.u32(&rest[16..]),
                packed: LE.u32(&rest[20..]).into(),
                unpacked: LE.u32(&rest[24..]).into(),
                at: LE.u32(&rest[42..]).into(),
            };
            entry.widen(&fields[name..name + extra]);
            entries.push(entry);
            rest = &rest[46 + name + extra + comment..];
        }
        if !rest.is_empty() && !rest.starts_with(b"PK\x05\x05") {
            return Err(self.0.fault(format!("entry {} of the zip archive's directory is damaged", entries.len())));
        }
        Ok(entries)
    }

    /// The entry's bytes, inflated and checked.
    ///
    /// # Errors
    /// When it is encrypted, compressed by another method, or not where the directory says.
    pub(super) fn open(&self, entry: &Entry) -> Result<Source> {
        let name = &entry.name;
        if entry.encrypted {
            return Err(self.0.fault(format!("{name:?} is encrypted: not supported")));
        }
        let header = self.0.bytes(entry.at, 30, "an entry's header")?;
        if !header.starts_with(b"PK\x03\x04") {
            return Err(self.0.fault(format!("{name:?} should start at byte {}, no zip entry is there", entry.at)));
        }
        let data = entry.at + 30 + u64::from(LE.u16(&header[26..])) + u64::from(LE.u16(&header[28..]));
        if !self.0.holds(data, entry.packed) {
            return Err(self.0.fault(format!(
                "{name:?} should take {} bytes from byte {data}: the file has {}",
                entry.packed,
                self.0.length()
            )));
        }
        let packed = self.0.stream(data, entry.packed)?;
        let (stream, bound): (Box<dyn Read>, u64) = match entry.method {
            0 => (Box::new(packed), entry.packed),
            8 => (Box::new(DeflateDecoder::new(packed)), inflated_bound(entry.packed)),
            other => {
                let how = METHODS
                    .iter()
                    .find(|m| m.0 == other)
                    .map_or_else(|| format!("method {other}"), |m| format!("{} (method {other})", m.1));
                return Err(self.0.fault(format!("entries are compressed by {how}, which is not read: unpack it ({name:?} for one)")));
            }
        };
        if entry.unpacked > bound {
            let what =
                format!("{name:?} claims {} bytes, but {} compressed bytes cannot hold more than {bound}", entry.unpacked, entry.packed);
            return Err(self.0.fault(what));
        }
        let stream = Box::new(Checked { inner: stream, crc: Crc::new(), left: entry.unpacked, want: entry.crc });
        Ok(Source::from_stream(self.0.path(), stream, entry.unpacked, Some(entry.packed), self.0.limits()))
    }
}

impl Entry {
    /// Takes 64-bit sizes and places from the directory's extra fields, for those that are all ones.
    fn widen(&mut self, mut extra: &[u8]) {
        while extra.len() >= 4 {
            let (id, size) = (LE.u16(extra), usize::from(LE.u16(&extra[2..])));
            let Some(mut field) = extra.get(4..4 + size) else { return };
            if id == 1 {
                for value in [&mut self.unpacked, &mut self.packed, &mut self.at] {
                    if *value == u64::from(u32::MAX) && field.len() >= 8 {
                        *value = LE.u64(field);
                        field = &field[8..];
                    }
                }
            }
            extra = &extra[4 + size..];
        }
    }
}

/// A stream that must be `left` bytes long and have the checksum `want`.
struct Checked {
    inner: Box<dyn Read>,
    crc: Crc,
    left: u64,
    want: u32,
}

impl Read for Checked {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let fault = |what: &str| Err(io::Error::new(io::ErrorKind::InvalidData, what));
        if out.is_empty() {
            return Ok(0);
        }
        if self.left == 0 {
            if self.inner.read(&mut [0])? > 0 {
                return fault("the zip entry is longer than its directory says");
            }
            return if self.crc.sum() == self.want { Ok(0) } else { fault("the zip entry's checksum does not match") };
        }
        let want = out.len().min(usize::try_from(self.left).unwrap_or(usize::MAX));
        let n = self.inner.read(&mut out[..want])?;
        if n == 0 {
            return fault(&format!("the zip entry is {} bytes shorter than its directory says", self.left));
        }
        self.crc.update(&out[..n]);
        self.left -= n as u64;
        Ok(n)
    }
}
