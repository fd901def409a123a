//! From a file to what is known of its images: the header is gone through up to the pixels.

use super::elements::{Bytes, Element, Encoding};
use super::header::{Header, MOST_FRAMES, text};
use super::image::{Image, Photometric};
use super::syntax::{Codec, Syntax};
use super::tags::*;
use crate::volume::VoxelType;
use crate::volume::io::Endian;
use crate::volume::io::source::Source;
use crate::volume::io::tree::Leaf;
use crate::{Error, Result};
use std::path::PathBuf;
use std::sync::Arc;

/// Bytes before the magic.
const PREAMBLE: usize = 128;

/// The class of files that list the others of a folder.
const DIRECTORY: &str = "1.2.840.10008.1.3.10";

/// What one file is, and what several are.
pub(super) type Kind = (&'static str, &'static str);

pub(super) const LIST: Kind = ("a list of files (DICOMDIR)", "lists of files (DICOMDIR)");
pub(super) const SEGMENTATION: Kind = ("a segmentation", "segmentations");
pub(super) const WITHOUT_PIXELS: Kind = ("an object without pixels", "objects without pixels");
/// No DICOM file.
pub(super) const FOREIGN: Kind = ("no DICOM file", "no DICOM files");

/// What a file turned out to be.
pub(super) enum Found {
    Image(Box<Image>),
    /// A DICOM file that is no image: what it is.
    Other(Kind),
    /// A file that is damaged: the UID of its series, empty where that is not known; `None` where it may be no DICOM file at all.
    Damaged(Option<String>, Error),
    /// No DICOM file.
    Nothing,
}

/// Whether a file that starts with `head` is a DICOM file by its magic.
pub(super) fn has_magic(head: &[u8]) -> bool {
    head.get(PREAMBLE..PREAMBLE + 4) == Some(b"DICM")
}

/// Whether a file that starts with `head` may be a DICOM file without a magic: its first element is of group 2 or 8.
pub(super) fn looks_bare(head: &[u8]) -> bool {
    let [a, b, element, 0, v, w, length, high, ..] = *head else { return false };
    let little = b == 0 && matches!(a, 2 | 8);
    let explicit = v.is_ascii_uppercase() && w.is_ascii_uppercase();
    little && element <= 0x20 && (explicit || (length == 0 && high == 0 && w == 0))
}

/// Looks into one file of the tree.
///
/// # Errors
/// When it is a DICOM file and not what it claims to be.
pub(super) fn look(leaf: Leaf) -> Result<Found> {
    let Leaf { index, path, mut source } = leaf;
    let mut series = None;
    let found = source.peek(PREAMBLE + 8).map(|head| (has_magic(head), looks_bare(head))).and_then(|(magic, bare)| match (magic, bare) {
        (false, false) => Ok(Found::Nothing),
        _ => {
            series = magic.then(String::new);
            inside((index, path), source, magic, &mut series)
        }
    });
    match found {
        Err(e @ (Error::Format { .. } | Error::Limit { .. } | Error::Io { .. })) => Ok(Found::Damaged(series, e)),
        other => other,
    }
}

/// Looks into a DICOM file; tells the UID of its `series` as soon as that is known.
fn inside((index, path): (usize, PathBuf), source: Source, magic: bool, series: &mut Option<String>) -> Result<Found> {
    let fault = |what: String| Error::format(&path, what);
    let mut bytes = Bytes::new(source);
    if magic {
        bytes.skip(PREAMBLE as u64 + 4)?;
    }
    let (mut named, mut is_list) = (None, false);
    while bytes.source.peek(6)?.starts_with(&[2, 0]) {
        let explicit = seen_encoding(bytes.source.peek(6)?).explicit;
        let element = bytes.element(if explicit { Encoding::EXPLICIT } else { Encoding::IMPLICIT })?;
        match element.length {
            Some(length) if element.tag == TRANSFER_SYNTAX => named = Some(text(&bytes.value(element, length)?)),
            Some(length) if element.tag == MEDIA_CLASS => is_list = text(&bytes.value(element, length)?) == DIRECTORY,
            Some(length) => bytes.skip(length)?,
            None => return Err(fault(format!("{} has no length", shown(element.tag)))),
        }
    }
    if is_list {
        return Ok(Found::Other(LIST));
    }
    let seen = seen_encoding(bytes.source.peek(6)?);
    let mut syntax = named.filter(|uid| !uid.is_empty()).map_or_else(|| Syntax::unnamed(seen), |uid| Syntax::of(&uid));
    let mut before = 0;
    if syntax.deflated {
        before = bytes.at;
        bytes = Bytes::new(bytes.source.inflate());
    } else if bytes.source.peek(6)?.len() == 6 {
        // Some writers name the wrong one of implicit and explicit VR.
        syntax.encoding.explicit = seen.explicit;
    }
    let mut header = Header::default();
    let pixels = bytes.data_set(syntax.encoding, &mut header);
    let uid = header.text(SERIES);
    if !uid.is_empty() {
        *series = Some(uid);
    }
    described(header, pixels?, &bytes, syntax, (index, before))
}

/// What the elements of a data set say, of which `bytes` were read up to the pixels.
fn described(header: Header, pixels: Option<Element>, bytes: &Bytes, syntax: Syntax, (index, before): (usize, u64)) -> Result<Found> {
    let path = bytes.source.path().to_path_buf();
    let fault = |what: String| Error::format(&path, what);
    if let Some(what) = header.fault {
        return Err(fault(what));
    }
    let class = header.text(SOP_CLASS);
    let Some(pixels) = pixels else {
        return Ok(Found::Other(WITHOUT_PIXELS));
    };
    let segments = ["1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7"].contains(&class.as_str());
    if segments || header.number(BITS_ALLOCATED) == Some(1.0) {
        return Ok(Found::Other(SEGMENTATION));
    }
    let (layout, bits, mut unread) = header.layout(pixels.tag, syntax.codec).map_err(fault)?;
    let count = header.count(NUMBER_OF_FRAMES, 0, Some(1)).map_err(fault)?.max(1);
    if count > MOST_FRAMES {
        let what = format!("{}: frames", path.display());
        return Err(Error::Limit { what, needed: count as u128, limit: MOST_FRAMES as u128 });
    }
    let held = bytes.source.left();
    let whole = (layout.rows as u128) * (layout.columns as u128) * (layout.samples as u128) * u128::from(layout.allocated.div_ceil(8));
    let each = match (syntax.codec, pixels.length) {
        (Codec::Native, Some(length)) if unread.is_none() => {
            let whole = if layout.photometric == Photometric::Ybr422 { whole / 3 * 2 } else { whole };
            let needed = whole * count as u128;
            if needed > u128::from(length.min(held)) {
                let what = format!(
                    "{} of {} x {} pixels of {} x {} bits: {needed} bytes are needed, there are {}",
                    frames_of(count),
                    layout.columns,
                    layout.rows,
                    layout.samples,
                    layout.allocated,
                    length.min(held)
                );
                unread = Some(what);
            }
            whole
        }
        (Codec::Native, None) => return Err(fault("the pixels are in fragments, the transfer syntax says that they are not".to_owned())),
        // Each frame has at least the head of a fragment.
        _ => 8,
    };
    if count as u128 * each > u128::from(held) && unread.is_none() {
        return Err(fault(format!("frames claimed: {count}, {held} bytes follow, where each takes at least {each}")));
    }
    if syntax.codec == Codec::Unread {
        unread = Some(format!(
            "{} ({}) cannot be read here: convert the file with a tool such as dcmdjpeg or gdcmconv",
            syntax.name, syntax.uid
        ));
    }
    if syntax.codec != Codec::Native && pixels.length.is_some() {
        unread = unread.or_else(|| Some(format!("the pixels are not in fragments, as those of {} are", syntax.name)));
    }
    let palette = match layout.photometric {
        Photometric::Palette if unread.is_none() => Some(Arc::new(header.palette().map_err(fault)?)),
        _ => None,
    };
    let whole_number = |tag: u32| header.number(tag).map(|n| n as i64);
    Ok(Found::Image(Box::new(Image {
        leaf: index,
        series: header.text(SERIES),
        object: header.text(SOP_INSTANCE),
        series_number: whole_number(SERIES_NUMBER),
        instance: whole_number(INSTANCE_NUMBER),
        modality: header.text(MODALITY).chars().filter(char::is_ascii_alphanumeric).take(16).collect(),
        description: header.text(SERIES_DESCRIPTION),
        layout,
        bits,
        planar: header.number(PLANAR) == Some(1.0) && layout.samples > 1,
        palette,
        held,
        padding: header.number(PIXEL_PADDING).map(|n| n as i64 as u16),
        has_table: header.has_table,
        before,
        at: bytes.at,
        words: syntax.encoding.endian == Endian::Big && &pixels.vr == b"OW" && layout.kind() == VoxelType::U8,
        syntax,
        unread,
        frames: header.into_frames(count).map_err(fault)?,
        path: path.clone(),
    })))
}

/// So many frames, in words.
fn frames_of(count: usize) -> String {
    if count == 1 { "one frame".to_owned() } else { format!("{count} frames") }
}

/// How elements are written, judged by the first of them.
fn seen_encoding(head: &[u8]) -> Encoding {
    let explicit = head.get(4..6).is_some_and(|vr| vr.iter().all(u8::is_ascii_uppercase));
    // Groups are small numbers.
    let endian = if head.starts_with(&[0]) && head.get(1) != Some(&0) { Endian::Big } else { Endian::Little };
    Encoding { explicit, endian }
}
