//! What there is to say of each picture format, in one table: names, first bytes, what it holds.

use crate::{Error, Result};
use image::ImageFormat;
use std::path::Path;

/// A picture file format that can be written. All of them can be read too, and so can GIF and PNM: see
/// [`Picture::open`](super::Picture::open).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// PNG with straight alpha, 8 or 16 bits a component. Numbers are stored as they are: no gamma chunk, no conversion.
    Png,
    /// NumPy array: height x width x 4, little-endian f32, C order, premultiplied RGBA, row 0 on top.
    Npy,
    /// OpenEXR: premultiplied RGBA in f32, lossless.
    Exr,
    /// JPEG: 8-bit RGB at quality 92, lossy, for opaque pictures alone.
    Jpeg,
    /// WebP: 8-bit RGBA with straight alpha, lossless, at most 16383 pixels a side.
    WebP,
    /// TIFF with straight alpha, 8 or 16 bits a component, not compressed.
    Tiff,
}

/// Bits of the components of a PNG or TIFF.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Depth {
    /// 8 bits, rounded to nearest.
    #[default]
    Eight,
    /// 16 bits, rounded to nearest.
    Sixteen,
}

/// All that is to be said of a format.
pub(super) struct Entry {
    /// The name in messages.
    pub(super) title: &'static str,
    /// File name extensions, the usual one first.
    extensions: &'static [&'static str],
    /// Whether these first bytes of a file, at least 12 unless the file is shorter, are the format's.
    starts: fn(&[u8]) -> bool,
    /// The format's name in the crate `image`; `None` for NumPy, which is read and written here.
    pub(super) codec: Option<ImageFormat>,
    /// Most pixels a side that a file can hold.
    pub(super) largest_side: u32,
    /// What a component is stored as.
    components: Components,
    /// What a file holds, for the command's help.
    about: &'static str,
}

/// What a colour component is stored as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Components {
    /// 8 bits.
    Eight,
    /// 8 or 16 bits, as [`Depth`] says.
    Chosen,
    /// 32-bit floats.
    Float,
}

const PNG: Entry = Entry {
    title: "PNG",
    extensions: &["png"],
    starts: |b| b.starts_with(b"\x89PNG"),
    codec: Some(ImageFormat::Png),
    largest_side: i32::MAX as u32,
    components: Components::Chosen,
    about: "8 or 16 bits a component, straight alpha",
};
const NPY: Entry = Entry {
    title: "NumPy",
    extensions: &["npy"],
    starts: |b| b.starts_with(super::npy::MAGIC),
    codec: None,
    largest_side: u32::MAX,
    components: Components::Float,
    about: "NumPy array: height x width x 4, 32-bit floats, premultiplied RGBA",
};
const EXR: Entry = Entry {
    title: "OpenEXR",
    extensions: &["exr"],
    starts: |b| b.starts_with(b"\x76\x2f\x31\x01"),
    codec: Some(ImageFormat::OpenExr),
    largest_side: i32::MAX as u32,
    components: Components::Float,
    about: "OpenEXR: 32-bit floats, premultiplied RGBA",
};
const JPEG: Entry = Entry {
    title: "JPEG",
    extensions: &["jpg", "jpeg"],
    starts: |b| b.starts_with(b"\xff\xd8\xff"),
    codec: Some(ImageFormat::Jpeg),
    largest_side: u16::MAX as u32,
    components: Components::Eight,
    about: "8 bits a component, lossy, for opaque pictures",
};
const WEBP: Entry = Entry {
    title: "WebP",
    extensions: &["webp"],
    starts: |b| b.starts_with(b"RIFF") && b.get(8..12) == Some(b"WEBP"),
    codec: Some(ImageFormat::WebP),
    largest_side: (1 << 14) - 1,
    components: Components::Eight,
    about: "8 bits a component, straight alpha, lossless",
};
const TIFF: Entry = Entry {
    title: "TIFF",
    extensions: &["tif", "tiff"],
    starts: |b| [b"II\x2a\0", b"MM\0\x2a", b"II\x2b\0", b"MM\0\x2b"].iter().any(|s| b.starts_with(*s)),
    codec: Some(ImageFormat::Tiff),
    largest_side: u32::MAX,
    components: Components::Chosen,
    about: "8 or 16 bits a component, straight alpha, not compressed",
};
const GIF: Entry = Entry {
    title: "GIF",
    extensions: &["gif"],
    starts: |b| b.starts_with(b"GIF87a") || b.starts_with(b"GIF89a"),
    codec: Some(ImageFormat::Gif),
    largest_side: u16::MAX as u32,
    components: Components::Eight,
    about: "the first frame of it; read, not written",
};
const PNM: Entry = Entry {
    title: "PNM",
    extensions: &["pnm", "pbm", "pgm", "ppm", "pam"],
    starts: |b| matches!(b, [b'P', b'1'..=b'7', b' ' | b'\t' | b'\r' | b'\n' | b'#', ..]),
    codec: Some(ImageFormat::Pnm),
    largest_side: u32::MAX,
    components: Components::Chosen,
    about: "opaque pictures; read, not written",
};

/// Formats that are read and not written.
const READ_ONLY: [&Entry; 2] = [&GIF, &PNM];

impl Format {
    /// All formats that can be written.
    pub const ALL: [Self; 6] = [Self::Png, Self::Npy, Self::Exr, Self::Jpeg, Self::WebP, Self::Tiff];

    pub(super) fn entry(self) -> &'static Entry {
        match self {
            Self::Png => &PNG,
            Self::Npy => &NPY,
            Self::Exr => &EXR,
            Self::Jpeg => &JPEG,
            Self::WebP => &WEBP,
            Self::Tiff => &TIFF,
        }
    }

    /// The usual file name extension, without the dot: also the format's name on a command line.
    pub fn name(self) -> &'static str {
        self.entry().extensions[0]
    }

    /// The name in messages: "PNG", "OpenEXR".
    pub fn title(self) -> &'static str {
        self.entry().title
    }

    /// All file name extensions, without the dot, the usual one first.
    pub fn extensions(self) -> &'static [&'static str] {
        self.entry().extensions
    }

    /// What a file of this format holds, in a few words.
    pub fn about(self) -> &'static str {
        self.entry().about
    }

    /// Whether [`Depth`] says how many bits a component has. The other formats hold 8 bits, or 32-bit floats.
    pub fn takes_depth(self) -> bool {
        self.entry().components == Components::Chosen
    }

    /// What a component is stored as: "8 or 16 bits", "8 bits", "32-bit floats".
    pub fn components(self) -> &'static str {
        match self.entry().components {
            Components::Chosen => "8 or 16 bits",
            Components::Eight => "8 bits",
            Components::Float => "32-bit floats",
        }
    }

    /// The format with this extension, upper or lower case, without the dot.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.extensions().iter().any(|e| name.eq_ignore_ascii_case(e)))
    }

    /// The format that `path`'s extension asks for.
    ///
    /// # Errors
    /// [`Error::Format`] that lists the known extensions.
    pub fn of_path(path: &Path) -> Result<Self> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        Self::of_name(extension).ok_or_else(|| {
            let read_only = READ_ONLY.iter().find(|e| e.extensions.iter().any(|e| extension.eq_ignore_ascii_case(e)));
            let fault = match read_only {
                Some(entry) => format!("{} is read but not written", entry.title),
                None => format!("unknown picture extension \"{extension}\""),
            };
            Error::format(path, format!("{fault}: use {}", Self::choices()))
        })
    }

    /// The format of a file that begins with `start`, 12 bytes of it or more.
    pub fn of_start(start: &[u8]) -> Option<Self> {
        Self::ALL.into_iter().find(|f| (f.entry().starts)(start))
    }

    /// The usual extensions of all formats as words: ".png, .npy, ... or .tif".
    pub fn choices() -> String {
        let names = Self::ALL.map(|f| format!(".{}", f.name()));
        let (last, others) = names.split_last().map_or(("", &[][..]), |(last, others)| (last, others));
        format!("{} or {last}", others.join(", "))
    }
}

/// The format, written or not, of a file that begins with `start`.
pub(super) fn recognized(start: &[u8]) -> Option<&'static Entry> {
    let written = Format::ALL.into_iter().map(Format::entry);
    written.chain(READ_ONLY).find(|e| (e.starts)(start))
}

/// The titles of all formats that are read: "PNG, NumPy, ... and PNM".
pub(super) fn readable() -> String {
    let mut titles: Vec<&str> = Format::ALL.map(Format::title).into();
    titles.extend(READ_ONLY.map(|e| e.title));
    let last = titles.pop().unwrap_or_default();
    format!("{} and {last}", titles.join(", "))
}
