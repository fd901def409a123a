//! Tar archives: one file after the other, each behind a block of 512 bytes that says its name and size.
//!
//! Source of the format: POSIX.1-2017, `pax`, "ustar Interchange Format"
//! (<https://pubs.opengroup.org/onlinepubs/9699919799/utilities/pax.html>), and the base-256 sizes of GNU tar. Folders, links and the
//! records of long names are passed over; a file's name here is the one that its own block gives.

use crate::Result;
use crate::volume::io::source::Source;
use std::cell::{Cell, RefCell};
use std::io::{self, Read};
use std::rc::Rc;

/// Bytes of a block.
const BLOCK: usize = 512;

/// Whether `head` starts with a block of a tar archive.
pub(in crate::volume::io) fn is_tar(head: &[u8]) -> bool {
    head.get(257..262) == Some(b"ustar")
}

/// The archive, read from its start.
pub(super) struct Tar {
    outer: Rc<RefCell<Source>>,
    /// Bytes of the file before that have not been read.
    rest: Rc<Cell<u64>>,
    /// Bytes that fill its last block.
    padding: u64,
}

/// A stream of one file's bytes.
struct File {
    outer: Rc<RefCell<Source>>,
    left: Rc<Cell<u64>>,
}

impl Read for File {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let want = out.len().min(usize::try_from(self.left.get()).unwrap_or(usize::MAX));
        let n = self.outer.borrow_mut().read(&mut out[..want])?;
        self.left.set(self.left.get() - n as u64);
        Ok(n)
    }
}

/// Text up to its first zero.
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes.split(|&b| b == 0).next().unwrap_or_default()).into_owned()
}

/// A size: octal digits, or a number of bytes behind one whose highest bit is set.
fn size(bytes: &[u8]) -> Option<u64> {
    if bytes[0] & 0x80 != 0 {
        let fold = |n: Option<u64>, &b: &u8| n?.checked_mul(256)?.checked_add(b.into());
        return bytes[1..].iter().fold(Some(u64::from(bytes[0] & 0x7f)), fold);
    }
    let text = text(bytes);
    let digits = text.trim();
    if digits.is_empty() { Some(0) } else { u64::from_str_radix(digits, 8).ok() }
}

impl Tar {
    pub(super) fn new(source: Source) -> Self {
        Self { outer: Rc::new(RefCell::new(source)), rest: Rc::default(), padding: 0 }
    }

    /// The next regular file; `None` at the end. What was not read of the one before is passed over.
    ///
    /// # Errors
    /// When a block is no block of an archive, or a file is longer than what follows.
    pub(super) fn next(&mut self) -> Result<Option<(String, Source)>> {
        loop {
            let mut outer = self.outer.borrow_mut();
            outer.skip(self.rest.get())?;
            // The last file may lack its padding.
            let padding = self.padding.min(outer.left());
            if outer.peek(padding as usize)?.len() < padding as usize {
                return Ok(None);
            }
            outer.consume(padding as usize);
            (self.padding, self.rest) = (0, Rc::default());
            let block = outer.peek(BLOCK)?.to_vec();
            if block.len() < BLOCK || block.iter().all(|&b| b == 0) {
                return Ok(None);
            }
            if !is_tar(&block) {
                return Err(outer.fault("the tar archive is damaged: a file's block does not say \"ustar\""));
            }
            outer.consume(BLOCK);
            let Some(length) = size(&block[124..136]) else {
                return Err(outer.fault(format!("the tar archive gives {:?} as a file's size", text(&block[124..136]))));
            };
            let name = text(&block[..100]);
            if length > outer.left() {
                return Err(outer.fault(format!("{name:?} should take {length} bytes of the tar archive, {} follow", outer.left())));
            }
            self.rest = Rc::new(Cell::new(length));
            self.padding = length.next_multiple_of(BLOCK as u64) - length;
            if !matches!(block[156], 0 | b'0') {
                continue;
            }
            let prefix = if block[262] == 0 { text(&block[345..500]) } else { String::new() };
            let name = if prefix.is_empty() { name } else { format!("{prefix}/{name}") };
            let packed = outer.is_packed().then(|| outer.left());
            let stream = Box::new(File { outer: Rc::clone(&self.outer), left: Rc::clone(&self.rest) });
            return Ok(Some((name, Source::from_stream(outer.path(), stream, length, packed, outer.limits()))));
        }
    }
}
