//! Directories of a TIFF file: what each page of it is.
//!
//! A file is the byte order, a version, and the place of the first directory. A directory is the number of its entries, the entries (a tag, a
//! type, how many values there are, and the values or their place), and the place of the next directory. In BigTIFF (version 43) places
//! and counts have eight bytes in place of four.

use super::bytes::{Bytes, OnDisk};
use super::entry::{Entry, Table};
use super::layout::{Layout, Page};
use crate::volume::io::Endian;
use crate::volume::io::store::Store;
use crate::{Error, Result};
use std::collections::BTreeSet;

/// Most pages of a file, and planes of an image.
pub(super) const MOST_PAGES: usize = 1 << 20;

/// A TIFF file and the pages in it.
pub(in crate::volume::io) struct Tiff {
    pub(super) places: OnDisk,
    pub(super) endian: Endian,
    /// In the file's order, with those that are left out.
    pub(super) pages: Vec<Page>,
    /// How pages are laid out: usually all of them in one way.
    pub(super) layouts: Vec<Layout>,
    /// The description of the first page, which tells what the others are.
    pub(super) description: String,
    /// Pixels per unit of length along x and y, as the first page tells.
    pub(super) resolution: [Option<f64>; 2],
}

/// Widths of the numbers that a directory is made of.
#[derive(Clone, Copy)]
struct Widths {
    /// Of the number of entries.
    count: u64,
    /// Of a place, and of how many values an entry has.
    word: u64,
    /// Of an entry.
    entry: u64,
}

/// The bytes that a TIFF file starts with.
pub(super) fn starts(head: &[u8]) -> bool {
    matches!(head, [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..])
}

impl Tiff {
    /// Reads the directories of the file in `store`.
    ///
    /// # Errors
    /// When it is no TIFF file, and when a directory is damaged.
    pub(in crate::volume::io) fn open(store: Store) -> Result<Self> {
        let places = OnDisk::new(&store.places("a TIFF file")?);
        let (endian, pages, layouts, description, resolution) = {
            let mut bytes = Bytes::open(&places, Endian::Little)?;
            let (widths, first) = header(&mut bytes)?;
            let mut walk = Walk { bytes, widths, pages: Vec::new(), layouts: Vec::new(), description: None, resolution: [None; 2] };
            walk.all(first)?;
            let description = match &walk.description {
                Some(entry) => entry.text(&mut walk.bytes)?,
                None => String::new(),
            };
            (walk.bytes.endian, walk.pages, walk.layouts, description, walk.resolution)
        };
        Ok(Self { places, endian, pages, layouts, description, resolution })
    }

    /// How page `index` is laid out.
    pub(super) fn layout(&self, index: usize) -> &Layout {
        &self.layouts[self.pages[index].layout]
    }

    /// Positions of the pages that are neither thumbnails nor masks.
    pub(super) fn images(&self) -> Vec<usize> {
        (0..self.pages.len()).filter(|&i| !self.pages[i].left_out).collect()
    }

    /// An error about this file.
    pub(super) fn fault(&self, what: impl Into<String>) -> Error {
        self.places.fault(what)
    }
}

/// Byte order, widths, and the place of the first directory.
fn header(bytes: &mut Bytes) -> Result<(Widths, u64)> {
    let head = bytes.header(0, 8, "the TIFF header")?;
    if !starts(head) {
        let what = format!("no TIFF file: it starts with \"{}\"", head[..4].escape_ascii());
        return Err(bytes.places.fault(what));
    }
    let big = head[2].max(head[3]) == 43;
    bytes.endian = if head[0] == b'M' { Endian::Big } else { Endian::Little };
    let endian = bytes.endian;
    if !big {
        let first = u64::from(endian.u32(&bytes.header(4, 4, "the TIFF header")?[..4]));
        return Ok((Widths { count: 2, word: 4, entry: 12 }, first));
    }
    let head = bytes.header(4, 12, "the BigTIFF header")?;
    let (width, first) = (endian.u16(head), endian.u64(&head[4..]));
    if width != 8 {
        return Err(bytes.places.fault(format!("BigTIFF with places of {width} bytes, not 8")));
    }
    Ok((Widths { count: 8, word: 8, entry: 20 }, first))
}

/// On the way from directory to directory.
struct Walk<'a> {
    bytes: Bytes<'a>,
    widths: Widths,
    pages: Vec<Page>,
    layouts: Vec<Layout>,
    description: Option<Entry>,
    resolution: [Option<f64>; 2],
}

impl Walk<'_> {
    /// All of them from byte `at` on.
    fn all(&mut self, mut at: u64) -> Result<()> {
        let mut seen = BTreeSet::new();
        while at != 0 {
            if !seen.insert(at) {
                return Err(self.fault(format!("the directory of page {} leads back to the one at byte {at}", self.pages.len() - 1)));
            }
            if seen.len() > MOST_PAGES {
                let what = format!("{}: pages of the file", self.bytes.places.path().display());
                return Err(Error::Limit { what, needed: seen.len() as u128, limit: MOST_PAGES as u128 });
            }
            at = self.one(at)?;
        }
        if self.pages.is_empty() { Err(self.fault("TIFF file of 0 pages".to_owned())) } else { Ok(()) }
    }

    fn fault(&self, what: String) -> Error {
        self.bytes.places.fault(what)
    }

    /// The number of `width` bytes at byte `at`.
    fn number(&mut self, at: u64, width: u64, what: &str) -> Result<u64> {
        let endian = self.bytes.endian;
        let bytes = self.bytes.header(at, width, what)?;
        Ok(match width {
            2 => endian.u16(bytes).into(),
            4 => endian.u32(bytes).into(),
            _ => endian.u64(bytes),
        })
    }

    /// Reads the directory at byte `at` and returns the place of the next one, 0 after the last.
    fn one(&mut self, at: u64) -> Result<u64> {
        let Widths { count: count_width, word, entry } = self.widths;
        let what = format!("the TIFF directory of page {}", self.pages.len());
        let count = self.number(at, count_width, &what)?;
        let bytes = count.saturating_mul(entry).saturating_add(word);
        let first = at + count_width;
        // Checks at once that all of it is there.
        let endian = self.bytes.endian;
        let all = self.bytes.header(first, bytes, &what)?;
        let (entries, next) = all.split_at(all.len() - word as usize);
        let next = if word == 8 { endian.u64(next) } else { u64::from(endian.u32(next)) };
        let mut found = Vec::with_capacity(16);
        for (i, e) in entries.chunks_exact(entry as usize).enumerate() {
            let (tag, kind, rest) = (endian.u16(e), endian.u16(&e[2..]), &e[4..]);
            let (count, value) = rest.split_at(word as usize);
            let number = |b: &[u8]| if word == 8 { endian.u64(b) } else { u64::from(endian.u32(b)) };
            let count = number(count);
            // Values that fit stand in the entry itself.
            let inside = Entry::bytes(kind, count).is_some_and(|bytes| bytes <= word);
            let at = if inside { first + i as u64 * entry + 4 + word } else { number(value) };
            found.push(Entry { tag, kind, count, at });
        }
        let page = self.pages.len();
        let (layout, left_out) = Layout::read(&mut self.bytes, &found, page)?;
        let table = |tags: [u16; 2]| found.iter().find(|e| tags.contains(&e.tag)).map(|e| Table { kind: e.kind, count: e.count, at: e.at });
        let offsets = table(Table::OFFSETS).ok_or_else(|| self.fault(format!("page {page} says nowhere where its pixels are")))?;
        let lengths = table(Table::LENGTHS);
        if self.layouts.last() != Some(&layout) {
            self.layouts.push(layout);
        }
        if page == 0 {
            const DESCRIPTION: u16 = 270;
            self.description = found.iter().find(|e| e.tag == DESCRIPTION).copied();
            for (axis, tag) in [282, 283].into_iter().enumerate() {
                if let Some(e) = found.iter().find(|e| e.tag == tag) {
                    self.resolution[axis] = e.rational(&mut self.bytes)?;
                }
            }
        }
        self.pages.push(Page { layout: self.layouts.len() - 1, left_out, offsets, lengths });
        Ok(next)
    }
}
