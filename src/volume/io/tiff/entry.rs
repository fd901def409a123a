//! Entries of a directory, and the values that they tell the place of.

use super::bytes::Bytes;
use crate::Result;

/// One entry of a directory: values of one type, from byte `at` of the file on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) tag: u16,
    pub(super) kind: u16,
    pub(super) count: u64,
    pub(super) at: u64,
}

impl Entry {
    /// Bytes of one value of the type with the code `kind`.
    fn width(kind: u16) -> Option<u64> {
        match kind {
            1 | 2 | 6 | 7 => Some(1),
            3 | 8 => Some(2),
            4 | 9 | 11 | 13 => Some(4),
            5 | 10 | 12 | 16 | 17 | 18 => Some(8),
            _ => None,
        }
    }

    /// Bytes of `count` values; `None` for a type that TIFF does not know.
    pub(super) fn bytes(kind: u16, count: u64) -> Option<u64> {
        Self::width(kind)?.checked_mul(count)
    }

    /// The values, which are integers without a sign.
    pub(super) fn integers(&self, bytes: &mut Bytes) -> Result<Vec<u64>> {
        let what = format!("tag {}", self.tag);
        let size = match self.kind {
            1 | 7 => 1,
            3 => 2,
            4 | 13 => 4,
            16 | 18 => 8,
            other => return Err(bytes.places.fault(format!("{what} is of type {other}, not a whole number"))),
        };
        let endian = bytes.endian;
        let raw = bytes.header(self.at, self.count.saturating_mul(size), &what)?;
        Ok(raw
            .chunks_exact(size as usize)
            .map(|b| match size {
                1 => b[0].into(),
                2 => endian.u16(b).into(),
                4 => endian.u32(b).into(),
                _ => endian.u64(b),
            })
            .collect())
    }

    /// The same entry with its first values alone, `most` of them.
    pub(super) fn first(self, most: u64) -> Self {
        Self { count: self.count.min(most), ..self }
    }

    /// The text, up to its first zero.
    pub(super) fn text(&self, bytes: &mut Bytes) -> Result<String> {
        if Self::width(self.kind) != Some(1) {
            return Ok(String::new());
        }
        let raw = bytes.header(self.at, self.count, &format!("tag {}", self.tag))?;
        Ok(String::from_utf8_lossy(raw.split(|&b| b == 0).next().unwrap_or_default()).into_owned())
    }

    /// The quotient of two integers, where it is one and a number above 0.
    pub(super) fn rational(&self, bytes: &mut Bytes) -> Result<Option<f64>> {
        if self.kind != 5 || self.count != 1 {
            return Ok(None);
        }
        let endian = bytes.endian;
        let raw = bytes.header(self.at, 8, &format!("tag {}", self.tag))?;
        let value = f64::from(endian.u32(raw)) / f64::from(endian.u32(&raw[4..]));
        Ok(Some(value).filter(|v| v.is_finite() && *v > 0.0))
    }
}

/// Where the numbers of a table are: offsets or lengths of the strips or tiles of a page. They are read when the page is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Table {
    pub(super) kind: u16,
    pub(super) count: u64,
    pub(super) at: u64,
}

impl Table {
    /// Tags of the offsets of strips and of tiles.
    pub(super) const OFFSETS: [u16; 2] = [273, 324];
    /// Tags of their lengths.
    pub(super) const LENGTHS: [u16; 2] = [279, 325];

    /// The numbers.
    pub(super) fn read(&self, bytes: &mut Bytes, tags: [u16; 2]) -> Result<Vec<u64>> {
        Entry { tag: tags[0], kind: self.kind, count: self.count, at: self.at }.integers(bytes)
    }
}
