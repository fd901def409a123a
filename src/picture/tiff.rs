//! TIFF with straight alpha.
//!
//! The crate `image` writes no tag that says what the fourth component is, so that some programs take colours for premultiplied and others
//! leave the alpha out; and it does not tell what the tag of a file says. Both are done here.

use super::{Depth, Picture};
use std::io::Cursor;
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

/// Whether the colours of this TIFF are premultiplied by alpha. A file that does not say, or cannot be read, counts as straight.
pub(super) fn is_premultiplied(bytes: &[u8]) -> bool {
    let extra = Decoder::new(Cursor::new(bytes)).and_then(|mut d| d.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples));
    matches!(extra, Ok(Some(kinds)) if kinds.first() == Some(&ASSOCIATED_ALPHA))
}
