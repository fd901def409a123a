//! What a format's file declares about its reader, and the clues by which a file or folder is recognised.

use super::folder::Folder;
use super::reading::{Item, Part, Reading};
use super::source::Source;
use super::store::Store;
use crate::Result;
use crate::settings::Limits;
use crate::volume::Volume;
use std::path::Path;

/// How sure it is that a file or folder is of a format. Of all formats the surest one is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Certainty {
    /// Nothing speaks for it.
    No,
    /// The name's extension alone. The reader then says what is wrong with the content.
    Name,
    /// Content that files of other formats may have by chance.
    Hint,
    /// The extension, and a length that agrees to the byte with what the first bytes claim.
    Length,
    /// Content that no other format has: a magic number, or an entry that marks a folder.
    Magic,
    /// A magic number behind bytes that may be anything, the magic number of another format among them.
    Inner,
}

/// Lists what there is to choose from.
type List = fn(Store, &Reading) -> Result<Vec<Item>>;

/// All that is to be said about a format, in one place.
pub(super) struct Reader {
    /// What the format is called.
    pub(super) name: &'static str,
    /// Extensions of its files, in lower case, without the dot.
    pub(super) extensions: &'static [&'static str],
    /// What of the format is read, in a few words, for docs and help.
    pub(super) reads: &'static str,
    /// What its volumes are told apart by, where there may be several. Other choices are refused before [`Reader::read`] is called.
    pub(super) parts: &'static [Part],
    /// How sure it is that something is of this format.
    pub(super) probe: fn(&Clues) -> Certainty,
    /// Reads the volume in a file or folder that was found to be of this format.
    pub(super) read: fn(Store, &Reading) -> Result<Volume>,
    /// What there is to choose from, without reading voxels; `None` for formats of one volume.
    pub(super) list: Option<List>,
}

/// A kind of file or folder that is recognised and not read.
pub(super) struct Refusal {
    /// How sure it is that something is of this kind.
    pub(super) probe: fn(&Clues) -> Certainty,
    /// What it is, and what to do instead.
    pub(super) says: &'static str,
}

/// What is known of a file or folder before it is read.
pub(super) struct Clues<'a> {
    pub(super) path: &'a Path,
    /// First bytes of a file, inflated where it is a gzip file; none of a folder.
    pub(super) head: &'a [u8],
    /// Bytes of a file that can come, inflated: exact, or an upper bound where it is `packed`.
    pub(super) length: u64,
    /// Whether the file is a gzip file.
    pub(super) packed: bool,
    /// Whether its bytes come once, through a pipe.
    pub(super) once: bool,
    /// Names of a folder's files, sorted; `None` for a file.
    pub(super) entries: Option<&'a [String]>,
    /// The folder itself, for those who must look into its files.
    pub(super) folder: Option<&'a Folder>,
    pub(super) limits: &'a Limits,
}

impl Clues<'_> {
    /// Whether the file holds `magic` from byte `at` on.
    pub(super) fn has(&self, at: usize, magic: &[u8]) -> bool {
        self.head.get(at..).is_some_and(|h| h.starts_with(magic))
    }

    /// Whether a folder has a file called `name`.
    pub(super) fn has_entry(&self, name: &str) -> bool {
        self.entries.is_some_and(|e| e.iter().any(|e| e == name))
    }

    /// [`Certainty::Name`] where a file's name ends with one of `extensions` (in lower case); `.gz` behind it is passed over.
    pub(super) fn by_name(&self, extensions: &[&str]) -> Certainty {
        let name = self.path.to_string_lossy().to_ascii_lowercase();
        let name = name.strip_suffix(".gz").unwrap_or(&name);
        let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
        if self.entries.is_none() && extensions.contains(&extension) { Certainty::Name } else { Certainty::No }
    }

    /// Whether the file is exactly `bytes` long. To find out, a gzip file is inflated once more, up to there and without being kept; not
    /// past the limit on voxels.
    pub(super) fn is_long(&self, bytes: u64) -> bool {
        if !self.packed {
            return bytes == self.length;
        }
        if self.once || bytes > self.length || bytes > self.limits.voxel_bytes.saturating_add(self.limits.header_bytes) {
            return false;
        }
        // A file that cannot be inflated so far is not so long; its reader says why.
        Source::open(self.path, self.limits)
            .and_then(|mut source| {
                source.skip(bytes)?;
                Ok(source.peek(1)?.is_empty())
            })
            .unwrap_or(false)
    }
}
