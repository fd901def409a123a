//! The numbers of an array: text, base64 or bytes, whole or in compressed blocks.
//!
//! Before the numbers stands how many bytes they take. Compressed ones have a table there: how many blocks there are, how many bytes each of
//! them takes decoded, how many the last one takes if it is smaller, and how many each takes compressed.

use super::super::Endian;
use super::super::source::Source;
use super::base64::Base64;
use super::blocks::{Blocks, Compressor, Table};
use super::image::{Array, Content};
use crate::settings::Limits;
use crate::{Error, Result};
use std::io::Read;
use std::path::{Path, PathBuf};

/// How the numbers of a file are written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coding {
    pub(super) endian: Endian,
    /// Bytes of the numbers in front of an array.
    pub(super) word: usize,
    pub(super) compressor: Option<Compressor>,
    /// Where the appended data starts, and whether it is bytes, not base64.
    pub(super) appended: Option<u64>,
    pub(super) raw: bool,
}

/// The file, to be read from chosen places on.
pub(super) struct Contents {
    path: PathBuf,
    limits: Limits,
    /// The file as it was opened, and its byte that comes next.
    first: Option<(Source, u64)>,
}

impl Contents {
    /// The file `source` of which `place` bytes are passed.
    pub(super) fn new(source: Source, place: u64) -> Self {
        Self { path: source.path().to_path_buf(), limits: *source.limits(), first: Some((source, place)) }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn limits(&self) -> &Limits {
        &self.limits
    }

    pub(super) fn fault(&self, what: impl Into<String>) -> Error {
        Error::format(&self.path, what)
    }

    /// The file from byte `place` on. It is opened once more where more of it than that is passed.
    fn at(&mut self, place: u64) -> Result<Source> {
        let (mut source, passed) = match self.first.take() {
            Some((source, passed)) if passed <= place => (source, passed),
            _ => {
                // What another program sends comes once.
                if !self.path.is_file() {
                    return Err(
                        self.fault("its arrays cannot be read from a pipe, but for the first of those that are appended: give its file")
                    );
                }
                (Source::open(&self.path, &self.limits)?, 0)
            }
        };
        source.skip(place - passed)?;
        Ok(source)
    }

    /// The `want` bytes of numbers of `array`, or their text.
    ///
    /// # Errors
    /// When there are not exactly so many, or not so many can be there.
    pub(super) fn open(&mut self, array: &Array, coding: &Coding, want: u64) -> Result<Source> {
        let about = || format!("array {}", array.shown());
        let (place, length) = match &array.content {
            Content::Text(range) | Content::Base64(range) => (range.start, Some(range.end - range.start)),
            Content::Appended(offset) => {
                let Some(start) = coding.appended else {
                    return Err(self.fault(format!("{} is appended, but the file has no AppendedData", about())));
                };
                (start.saturating_add(*offset), None)
            }
            Content::Missing => return Err(self.fault(format!("{} has no content", about()))),
        };
        let mut source = self.at(place).map_err(|e| match (e, length) {
            (Error::Format { path, what }, None) => Error::format(path, format!("{} at byte {place}: {what}", about())),
            (e, _) => e,
        })?;
        if let (Content::Text(_), Some(length)) = (&array.content, length) {
            return Ok(Source::from_stream(&self.path, Box::new(source.take(length)), length, None, &self.limits));
        }
        let raw = length.is_none() && coding.raw;
        if raw && coding.compressor.is_none() {
            let said = word(&mut source, coding).map_err(|e| self.fault(format!("{}: {e}", about())))?;
            self.check(array, said.into(), want)?;
            return Ok(source);
        }
        let (stream, most): (Box<dyn Read>, u64) = if raw {
            let left = source.left();
            (Box::new(source), left)
        } else {
            let characters = length.unwrap_or(source.left());
            (Box::new(Base64::new(source, characters)), characters / 4 * 3 + 3)
        };
        self.unpack(stream, most, array, coding, want)
    }

    fn check(&self, array: &Array, said: u128, want: u64) -> Result<()> {
        if said == u128::from(want) {
            return Ok(());
        }
        Err(self.fault(format!("array {} has {said} bytes, but its extent and type take {want}", array.shown())))
    }

    /// The numbers behind what `stream` says of them; at most `most` bytes can come from it.
    fn unpack(&self, mut stream: Box<dyn Read>, most: u64, array: &Array, coding: &Coding, want: u64) -> Result<Source> {
        let mut next = || word(&mut stream, coding).map_err(|e| self.fault(format!("array {}: {e}", array.shown())));
        let Some(compressor) = coding.compressor else {
            self.check(array, next()?.into(), want)?;
            return Ok(Source::from_stream(&self.path, stream, want.min(most), None, &self.limits));
        };
        let (count, size, last) = (next()?, next()?, next()?);
        // A last block of no size is as large as the others.
        let last = if last == 0 { size } else { last };
        let total = u128::from(count).saturating_sub(1) * u128::from(size) + u128::from(if count == 0 { 0 } else { last });
        self.check(array, total, want)?;
        let table = count.saturating_mul(8);
        if count.saturating_mul(coding.word as u64) > most || table > self.limits.header_bytes.max(want.min(self.limits.voxel_bytes)) {
            return Err(self.fault(format!("array {} cannot have {count} compressed blocks of {size} bytes", array.shown())));
        }
        if last > size {
            return Err(self.fault(format!("array {} has a last block of {last} bytes, the others have {size}", array.shown())));
        }
        let mut packed = Vec::new();
        let mut sum = 0u64;
        for block in 0..count {
            let bytes = next()?;
            // What does not get smaller gets little larger.
            if bytes > size + size / 64 + 1024 {
                return Err(self.fault(format!("block {block} of array {} takes {bytes} bytes for {size}", array.shown())));
            }
            sum = sum.saturating_add(bytes);
            packed.push(bytes);
        }
        let bound = sum.min(most).saturating_mul(compressor.ratio());
        if want > bound {
            return Err(self.fault(format!(
                "array {} takes {want} bytes, but {} compressed bytes cannot hold more than {bound}",
                array.shown(),
                sum.min(most)
            )));
        }
        let blocks = Blocks::new(stream, Table { packed, size, last }, compressor);
        Ok(Source::from_stream(&self.path, Box::new(blocks), want, Some(sum), &self.limits))
    }
}

/// The next number in front of an array.
fn word(stream: &mut impl Read, coding: &Coding) -> std::io::Result<u64> {
    let mut bytes = [0; 8];
    stream.read_exact(&mut bytes[..coding.word])?;
    Ok(match coding.word {
        4 => coding.endian.u32(&bytes).into(),
        _ => coding.endian.u64(&bytes),
    })
}
