//! Transfer syntaxes: how a file's elements and pixels are written.
//!
//! Source: DICOM PS3.6, table A-1, and PS3.5, chapter 10 and annex A.

use super::elements::Encoding;
use crate::volume::io::Endian;

/// How pixels are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Codec {
    /// Not at all, one frame after the other.
    Native,
    /// Not at all, each frame in a fragment of its own.
    Bare,
    Rle,
    Jpeg,
    JpegLs,
    Jpeg2000,
    /// In a way that is not read here.
    Unread,
}

/// A transfer syntax.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Syntax {
    pub(super) uid: String,
    pub(super) name: &'static str,
    pub(super) encoding: Encoding,
    pub(super) deflated: bool,
    pub(super) codec: Codec,
}

/// UIDs of all of them start so.
const ROOT: &str = "1.2.840.10008.1.2";

const TABLE: [(&str, &str, Codec); 39] = [
    ("", "implicit VR, little endian", Codec::Native),
    (".1", "explicit VR, little endian", Codec::Native),
    (".1.98", "encapsulated uncompressed", Codec::Bare),
    (".1.99", "deflated", Codec::Native),
    (".2", "explicit VR, big endian", Codec::Native),
    (".5", "RLE", Codec::Rle),
    (".4.50", "JPEG baseline", Codec::Jpeg),
    (".4.51", "JPEG extended", Codec::Jpeg),
    (".4.57", "JPEG lossless", Codec::Jpeg),
    (".4.70", "JPEG lossless", Codec::Jpeg),
    (".4.80", "JPEG-LS lossless", Codec::JpegLs),
    (".4.81", "JPEG-LS near-lossless", Codec::JpegLs),
    (".4.90", "JPEG 2000 lossless", Codec::Jpeg2000),
    (".4.91", "JPEG 2000", Codec::Jpeg2000),
    (".4.53", "JPEG spectral selection", Codec::Unread),
    (".4.55", "JPEG full progression", Codec::Unread),
    (".4.58", "JPEG lossless hierarchical", Codec::Unread),
    (".4.92", "JPEG 2000 of several components, lossless", Codec::Unread),
    (".4.93", "JPEG 2000 of several components", Codec::Unread),
    (".4.94", "JPIP, pixels that lie on a server", Codec::Unread),
    (".4.95", "JPIP, pixels that lie on a server", Codec::Unread),
    (".4.100", "MPEG-2", Codec::Unread),
    (".4.100.1", "MPEG-2", Codec::Unread),
    (".4.101", "MPEG-2", Codec::Unread),
    (".4.101.1", "MPEG-2", Codec::Unread),
    (".4.102", "MPEG-4", Codec::Unread),
    (".4.102.1", "MPEG-4", Codec::Unread),
    (".4.103", "MPEG-4", Codec::Unread),
    (".4.104", "MPEG-4", Codec::Unread),
    (".4.105", "MPEG-4", Codec::Unread),
    (".4.106", "MPEG-4", Codec::Unread),
    (".4.107", "HEVC", Codec::Unread),
    (".4.108", "HEVC", Codec::Unread),
    (".4.110", "JPEG XL lossless", Codec::Unread),
    (".4.111", "JPEG XL of a JPEG", Codec::Unread),
    (".4.112", "JPEG XL", Codec::Unread),
    (".4.201", "high-throughput JPEG 2000 lossless", Codec::Unread),
    (".4.202", "high-throughput JPEG 2000 lossless", Codec::Unread),
    (".4.203", "high-throughput JPEG 2000", Codec::Unread),
];

impl Syntax {
    /// The syntax `uid`; one that is not known is taken for compressed, in explicit VR, as all newer ones are.
    pub(super) fn of(uid: &str) -> Self {
        let found = TABLE.iter().find(|row| uid.strip_prefix(ROOT) == Some(row.0));
        let &(rest, name, codec) = found.unwrap_or(&("?", "a transfer syntax that is not known", Codec::Unread));
        let encoding = match rest {
            "" => Encoding::IMPLICIT,
            ".2" => Encoding { explicit: true, endian: Endian::Big },
            _ => Encoding::EXPLICIT,
        };
        // One line of message is made of it.
        let uid = uid.chars().filter(|c| c.is_ascii_graphic()).take(64).collect();
        Self { uid, name, encoding, deflated: rest == ".1.99", codec }
    }

    /// The syntax of a file that does not name any.
    pub(super) fn unnamed(encoding: Encoding) -> Self {
        Self::of(match encoding {
            Encoding { explicit: false, .. } => ROOT,
            Encoding { endian: Endian::Big, .. } => "1.2.840.10008.1.2.2",
            _ => "1.2.840.10008.1.2.1",
        })
    }
}
