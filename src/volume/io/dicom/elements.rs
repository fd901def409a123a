//! Elements of a data set as they lie in a file, one after the other and in sequences inside each other.
//!
//! Source of the format: DICOM PS3.5, chapter 7, <https://dicom.nema.org/medical/dicom/current/output/html/part05.html>. An element is a
//! tag, in explicit VR the type of its value (VR), its length, and its value. A sequence holds items, each a data set of its own; sequences
//! and items of undefined length end with a delimiter.

use super::tags::shown;
use crate::volume::io::Endian;
use crate::volume::io::source::Source;
use crate::{Error, Result};

/// Most sequences that stand in each other.
const DEEPEST: usize = 16;
/// A data set may be so many times larger than the header of another format: one of many frames says several kilobytes of each.
const HEADERS: u64 = 64;
/// Most bytes of a value that is kept: a palette of 65536 colours takes twice as many for each of its three tables.
const LONGEST: u64 = 1 << 18;

const ITEM: u32 = 0xfffe_e000;
const ITEM_END: u32 = 0xfffe_e00d;
const SEQUENCE_END: u32 = 0xfffe_e0dd;

/// Tags of pixels as integers, as 32-bit and as 64-bit floats.
pub(super) const PIXELS: [u32; 3] = [0x7fe0_0010, 0x7fe0_0008, 0x7fe0_0009];

/// How elements are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Encoding {
    pub(super) explicit: bool,
    pub(super) endian: Endian,
}

impl Encoding {
    pub(super) const IMPLICIT: Self = Self { explicit: false, endian: Endian::Little };
    pub(super) const EXPLICIT: Self = Self { explicit: true, endian: Endian::Little };

    fn tag(self, bytes: &[u8]) -> u32 {
        u32::from(self.endian.u16(bytes)) << 16 | u32::from(self.endian.u16(&bytes[2..]))
    }
}

/// The head of an element: all but its value.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element {
    pub(super) tag: u32,
    /// Two zeros in implicit VR.
    pub(super) vr: [u8; 2],
    /// Bytes of its value; `None` where a delimiter ends it.
    pub(super) length: Option<u64>,
}

/// What is done with the elements of a data set. `path` holds the tags of the sequences that one stands in.
pub(super) trait Elements {
    /// Whether the value is to be kept.
    fn wants(&self, path: &[u32], tag: u32) -> bool;
    /// Whether the sequence is to be entered.
    fn enters(&self, path: &[u32], tag: u32) -> bool;
    /// A value that was wanted.
    fn value(&mut self, path: &[u32], element: Element, bytes: &[u8], endian: Endian);
    /// A new item begins in the sequence that ends `path`.
    fn item(&mut self, path: &[u32]);
}

/// The bytes of a data set: counted, and bounded by the limit on headers.
pub(super) struct Bytes {
    pub(super) source: Source,
    /// How many were used up.
    pub(super) at: u64,
    left: u64,
}

impl Bytes {
    pub(super) fn new(source: Source) -> Self {
        let left = source.limits().header_bytes.saturating_mul(HEADERS);
        Self { source, at: 0, left }
    }

    fn count(&mut self, n: u64) -> Result<()> {
        let Some(left) = self.left.checked_sub(n) else {
            let limit = self.source.limits().header_bytes.saturating_mul(HEADERS);
            let what = format!("{}: bytes before the pixels", self.source.path().display());
            return Err(Error::Limit { what, needed: u128::from(limit - self.left) + u128::from(n), limit: limit.into() });
        };
        self.left = left;
        self.at += n;
        Ok(())
    }

    /// Passes over `n` bytes.
    pub(super) fn skip(&mut self, n: u64) -> Result<()> {
        self.count(n)?;
        self.source.skip(n)
    }

    /// The next `N` bytes, which are `what`.
    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let mut out = [0; N];
        let have = self.source.peek(N)?;
        if have.len() < N {
            return Err(self.source.fault(format!("{what} at byte {} is cut short", self.at)));
        }
        out.copy_from_slice(have);
        self.source.consume(N);
        self.count(N as u64)?;
        Ok(out)
    }

    /// The value of `element`, of `length` bytes.
    pub(super) fn value(&mut self, element: Element, length: u64) -> Result<Vec<u8>> {
        let tag = shown(element.tag);
        if length > LONGEST {
            return Err(self.source.fault(format!("{tag} at byte {} takes {length} bytes, it may take {LONGEST}", self.at)));
        }
        let bytes = self.source.peek(length as usize)?.to_vec();
        if (bytes.len() as u64) < length {
            return Err(self.source.fault(format!("{tag} at byte {} takes {length} bytes, {} follow", self.at, bytes.len())));
        }
        self.source.consume(length as usize);
        self.count(length)?;
        Ok(bytes)
    }

    pub(super) fn is_at_end(&mut self) -> Result<bool> {
        Ok(self.source.peek(1)?.is_empty())
    }

    /// The head of the next element.
    pub(super) fn element(&mut self, encoding: Encoding) -> Result<Element> {
        let head: [u8; 8] = self.take("an element")?;
        let endian = encoding.endian;
        let tag = encoding.tag(&head);
        let undefined = |length: u32| (length != u32::MAX).then_some(u64::from(length));
        // Items and delimiters have no VR in either encoding.
        if !encoding.explicit || tag >> 16 == 0xfffe {
            return Ok(Element { tag, vr: [0; 2], length: undefined(endian.u32(&head[4..])) });
        }
        let vr = [head[4], head[5]];
        if !vr.iter().all(u8::is_ascii_uppercase) {
            let what = format!("{} at byte {} has no type of value: \"{}\"", shown(tag), self.at - 8, vr.escape_ascii());
            return Err(self.source.fault(what));
        }
        let long = matches!(&vr, b"OB" | b"OD" | b"OF" | b"OL" | b"OV" | b"OW" | b"SQ" | b"SV" | b"UC" | b"UN" | b"UR" | b"UT" | b"UV");
        let length = if long { undefined(endian.u32(&self.take::<4>("a length")?)) } else { Some(endian.u16(&head[6..]).into()) };
        Ok(Element { tag, vr, length })
    }

    /// Goes through a data set and tells `to` of it; the element of the pixels where one comes, whose value is what follows.
    ///
    /// # Errors
    /// When it is cut short, or is no data set.
    pub(super) fn data_set(&mut self, encoding: Encoding, to: &mut impl Elements) -> Result<Option<Element>> {
        self.level(encoding, None, &mut Vec::new(), to)
    }

    /// One data set, up to byte `end`, or to a delimiter; the outermost one up to the pixels or the end of the file.
    fn level(&mut self, encoding: Encoding, end: Option<u64>, path: &mut Vec<u32>, to: &mut impl Elements) -> Result<Option<Element>> {
        loop {
            if end.is_some_and(|end| self.at >= end) || (path.is_empty() && self.is_at_end()?) {
                return Ok(None);
            }
            // Zeros at the end of a file are padding.
            if path.is_empty() && self.source.peek(4)? == [0; 4] {
                return Ok(None);
            }
            let element = self.element(encoding)?;
            if element.tag == ITEM_END && end.is_none() && !path.is_empty() {
                return Ok(None);
            }
            if path.is_empty() && (PIXELS.contains(&element.tag) || element.tag > PIXELS[0]) {
                return Ok(PIXELS.contains(&element.tag).then_some(element));
            }
            match element.length {
                Some(length) if to.wants(path, element.tag) => {
                    let bytes = self.value(element, length)?;
                    to.value(path, element, &bytes, encoding.endian);
                }
                Some(length) if !to.enters(path, element.tag) => self.skip(length)?,
                length => {
                    let end = length.map(|n| self.at.saturating_add(n));
                    // What is of unknown type and undefined length is a sequence in implicit VR.
                    let inner = if &element.vr == b"UN" { Encoding::IMPLICIT } else { encoding };
                    self.sequence(inner, element.tag, end, path, to)?;
                }
            }
        }
    }

    fn sequence(&mut self, encoding: Encoding, tag: u32, end: Option<u64>, path: &mut Vec<u32>, to: &mut impl Elements) -> Result<()> {
        if path.len() == DEEPEST {
            return Err(self.source.fault(format!("{} at byte {}: more than {DEEPEST} sequences in each other", shown(tag), self.at)));
        }
        path.push(tag);
        while end.is_none_or(|end| self.at < end) {
            let item = self.element(encoding)?;
            match (item.tag, item.length) {
                (SEQUENCE_END, _) => break,
                (ITEM, length) => {
                    to.item(path);
                    let end = length.map(|n| self.at.saturating_add(n));
                    self.level(encoding, end, path, to)?;
                }
                (other, _) => {
                    let what = format!("{} at byte {} should be an item of {}", shown(other), self.at - 8, shown(tag));
                    return Err(self.source.fault(what));
                }
            }
        }
        path.pop();
        Ok(())
    }

    /// The head of the next fragment of encapsulated pixels; `None` at their end.
    pub(super) fn fragment(source: &mut Source) -> Result<Option<u64>> {
        let head = source.peek(8)?;
        if head.len() < 8 {
            // Some writers leave out the delimiter.
            return Ok(None);
        }
        let encoding = Encoding::EXPLICIT;
        let (tag, length) = (encoding.tag(head), encoding.endian.u32(&head[4..]));
        match tag {
            ITEM if u64::from(length) <= source.left().saturating_sub(8) => {
                source.consume(8);
                Ok(Some(length.into()))
            }
            ITEM => Err(source.fault(format!("a fragment of the pixels should take {length} bytes, {} follow", source.left() - 8))),
            SEQUENCE_END => Ok(None),
            other => Err(source.fault(format!("{} stands where a fragment of the pixels should", shown(other)))),
        }
    }
}
