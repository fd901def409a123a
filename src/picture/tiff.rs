//! TIFF with straight alpha.
//!
//! The crate `image` writes no tag that says what the fourth component is, so that some programs take colours for premultiplied and others
//! leave the alpha out; and it does not tell what the tag of a file says. Both are done here.

use super::{Depth, Picture};
use crate::{Error, Result};
use std::io::Cursor;
use std::path::Path;
use tiff::TiffResult;
use tiff::decoder::Decoder;
use tiff::encoder::colortype::{ColorType, RGBA8, RGBA16};
use tiff::encoder::{TiffEncoder, TiffValue};
use tiff::tags::Tag;

/// Values of the tag ExtraSamples: colours are premultiplied by alpha, or straight.
const ASSOCIATED_ALPHA: u16 = 1;
const UNASSOCIATED_ALPHA: u16 = 2;

/// The picture as an uncompressed TIFF.
pub(super) fn encode(picture: &Picture, depth: Depth) -> TiffResult<Vec<u8>> {
    match depth {
        Depth::Eight => write::<RGBA8>(picture, &picture.to_rgba8()),
        Depth::Sixteen => write::<RGBA16>(picture, &picture.to_rgba16()),
    }
}

fn write<C: ColorType>(picture: &Picture, components: &[C::Inner]) -> TiffResult<Vec<u8>>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out)?;
    let mut image = encoder.new_image::<C>(picture.width(), picture.height())?;
    image.encoder().write_tag(Tag::ExtraSamples, UNASSOCIATED_ALPHA)?;
    image.write_data(components)?;
    Ok(out.into_inner())
}

/// Checks that no entry of the first directory is empty, on which the decoder would panic.
///
/// A file is the byte order, a version, and the place of a directory: the number of its entries, then for each a tag, a type, how many
/// values it has, and the values or their place. Version 43 has eight bytes where 42 has four.
///
/// # Errors
/// [`Error::Format`] naming `path` when the directory lies beyond the file's end or an entry has no values.
pub(super) fn check(bytes: &[u8], path: &Path) -> Result<()> {
    let number = |at: u64, size: usize| {
        let at = usize::try_from(at).ok()?;
        let digits = bytes.get(at..at.checked_add(size)?)?.iter();
        let add = |n: u64, &b: &u8| n << 8 | u64::from(b);
        Some(if bytes[0] == b'I' { digits.rev().fold(0, add) } else { digits.fold(0, add) })
    };
    let short = || Error::format(path, format!("TIFF of {} bytes: it ends within its directory", bytes.len()));
    let big = number(2, 2) == Some(43);
    let (place, count_size, word, entry) = if big { (8, 8, 8, 20) } else { (4, 2, 4, 12) };
    let directory = number(place, word).ok_or_else(short)?;
    let count = number(directory, count_size).ok_or_else(short)?;
    for i in 0..count {
        // A directory that ends within the file has no place that overflows.
        let at = directory.saturating_add(count_size as u64).saturating_add(entry * i);
        let tag = number(at, 2).ok_or_else(short)?;
        if number(at + 4, word).ok_or_else(short)? == 0 {
            return Err(Error::format(path, format!("TIFF: tag {tag} has 0 values")));
        }
    }
    Ok(())
}

/// Whether the colours of this TIFF are premultiplied by alpha. A file that does not say, or cannot be read, counts as straight.
pub(super) fn is_premultiplied(bytes: &[u8]) -> bool {
    let extra = Decoder::new(Cursor::new(bytes)).and_then(|mut d| d.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples));
    matches!(extra, Ok(Some(kinds)) if kinds.first() == Some(&ASSOCIATED_ALPHA))
}
