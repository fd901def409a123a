//! Writers of volume files: a file per format.
//!
//! | format | files | what is kept |
//! |---|---|---|
//! | NRRD | `.nrrd` | all but slope and intercept; compressed inside where asked for |
//! | NIfTI-1 | `.nii`, `.nii.gz` | slope and intercept; the grid, in f32 and with axes to right, front and top |
//! | MetaImage | `.mha` | the grid, with axes to left, back and top; the kind of values; compressed inside where asked for |
//! | NumPy | `.npy`, `.npy.gz` | voxels alone, (z, y, x) |
//! | raw | `.raw`, `.raw.gz` | voxels alone, x fastest |
//!
//! Voxels are written bit for bit in their own type, little-endian. In a format that keeps no slope and intercept, rescaled voxels are
//! written as the values that they stand for, unless [`Writing::stored`](field@Writing::stored) says otherwise. Whatever a format does not keep is told in [`Written::notes`].
//!
//! Voxels go out a piece at a time: no second copy of a volume is made. Uncompressed ones start at a multiple of 32 bytes, so that what is
//! written can be mapped when it is read again; see [`crate::Limits::map_bytes`].

mod grids;
mod metaimage;
mod nifti;
mod npy;
mod nrrd;
mod numbers;
mod raw;

use super::field::named;
use crate::files::Whole;
use crate::lanes::{cut_file, look_for_cut};
use crate::settings::Progress;
use crate::volume::{BoxConvention, Channels, LengthUnit, Volume, VoxelType};
use crate::{Error, Result};
use flate2::write::ZlibEncoder;
use flate2::{Compression, GzBuilder};
use numbers::{Numbers, Tell};
use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The name that files carry of who wrote them, where their format has a place for it.
const AUTHOR: &str = "slicestack";

/// A format that volumes are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say it all")]
pub enum WriteFormat {
    Nrrd,
    Nifti,
    MetaImage,
    Npy,
    Raw,
}

impl WriteFormat {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Nrrd, Self::Nifti, Self::MetaImage, Self::Npy, Self::Raw];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nrrd => "NRRD",
            Self::Nifti => "NIfTI-1",
            Self::MetaImage => "MetaImage",
            Self::Npy => "NumPy",
            Self::Raw => "raw",
        }
    }

    /// The extension of its files, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Nrrd => "nrrd",
            Self::Nifti => "nii",
            Self::MetaImage => "mha",
            Self::Npy => "npy",
            Self::Raw => "raw",
        }
    }

    /// The format called by `extension`.
    pub fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.extension().eq_ignore_ascii_case(extension))
    }

    /// The format that the name of `path` asks for, and whether it asks for gzip around it.
    ///
    /// # Errors
    /// When the name ends with no extension of a format that is written.
    pub fn of_path(path: &Path) -> Result<(Self, bool)> {
        let name = path.file_name().map(|n| n.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let (stem, gzip) = name.strip_suffix(".gz").map_or((name.as_str(), false), |stem| (stem, true));
        let extension = stem.rsplit_once('.').map_or("", |(_, extension)| extension);
        match Self::from_extension(extension) {
            Some(format) if gzip && format.packs_inside() => {
                let what = format!("{format} is compressed inside the file: name it .{extension} and ask for compression");
                Err(Error::format(path, what))
            }
            Some(format) => Ok((format, gzip)),
            None => Err(Error::format(path, format!("no volumes of the extension \"{extension}\" are written: use {}", extensions()))),
        }
    }

    /// Whether compression leaves the header as it is.
    fn packs_inside(self) -> bool {
        matches!(self, Self::Nrrd | Self::MetaImage)
    }

    /// Whether a file that begins with `start` is of this format and carries the mark of this writer. Of NumPy and raw files only those
    /// inside gzip can carry it.
    pub fn wrote(self, start: &[u8]) -> bool {
        let magic: &[u8] = match self {
            Self::Nrrd => b"NRRD",
            Self::MetaImage => b"ObjectType",
            Self::Nifti if start.starts_with(&[0x5c, 1, 0, 0]) => &[],
            Self::Nifti | Self::Npy | Self::Raw => &[0x1f, 0x8b],
        };
        // NIfTI files have the name in their description, gzip files in their comment.
        let mark = match self {
            Self::Nrrd => format!("\n# written by {AUTHOR}"),
            Self::MetaImage => format!("Comment = written by {AUTHOR}"),
            Self::Nifti | Self::Npy | Self::Raw => AUTHOR.to_owned(),
        };
        start.starts_with(magic) && start.windows(mark.len()).any(|w| w == mark.as_bytes())
    }
}

impl fmt::Display for WriteFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The extensions of what is written, in words.
fn extensions() -> String {
    let all: Vec<String> = WriteFormat::ALL.into_iter().map(|f| format!(".{}", f.extension())).collect();
    format!("{}, .nii.gz, .npy.gz or .raw.gz", all.join(", "))
}

/// How a volume is written.
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct Writing {
    /// Format; `None` lets the file's name tell it.
    pub format: Option<WriteFormat>,
    /// Whether voxels are compressed. A name that ends with `.gz` asks for it too.
    pub compress: bool,
    /// Whether voxels are written as they are stored even in formats that keep no slope and intercept, or whose readers seldom heed them.
    /// NRRD, NumPy and raw files then lose these, which is told; MetaImage has them as `ElementToIntensityFunction`.
    pub stored: bool,
    /// Who is told how far it has come.
    pub progress: Option<Arc<dyn Progress>>,
}

impl Writing {
    /// In the format that the name tells, not compressed, nobody told.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same in a format of its own.
    #[must_use]
    pub fn format(mut self, format: impl Into<Option<WriteFormat>>) -> Self {
        self.format = format.into();
        self
    }

    /// The same with voxels compressed or not.
    #[must_use]
    pub fn compress(mut self, compress: bool) -> Self {
        self.compress = compress;
        self
    }

    /// The same with voxels written as they are stored in every format, or not; see [`Writing::stored`](field@Writing::stored).
    #[must_use]
    pub fn stored(mut self, stored: bool) -> Self {
        self.stored = stored;
        self
    }

    /// The same with `progress` told.
    #[must_use]
    pub fn progress(mut self, progress: Arc<dyn Progress>) -> Self {
        self.progress = Some(progress);
        self
    }
}

/// What was written.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Written {
    /// Bytes of the file.
    pub bytes: u64,
    /// Type of the numbers in the file.
    pub voxel_type: VoxelType,
    /// What the file does not keep of the volume, or keeps in another way: one sentence each.
    pub notes: Vec<String>,
}

/// Writes `volume` to the file `path`, in the format that its name tells unless `writing` does. The file appears whole or not at all: it is
/// written under another name beside, and takes the place of an older one at the end.
///
/// # Errors
/// When the name tells no format, the format cannot hold the volume, or the file cannot be written: one line that names the file.
/// [`Error::Stopped`] when it was stopped.
pub fn write(volume: &Volume, path: impl AsRef<Path>, writing: &Writing) -> Result<Written> {
    let path = path.as_ref();
    let (format, compress) = chosen(path, writing)?;
    let writing = Writing { compress, ..writing.clone() };
    let mut file = Whole::create(path)?;
    let packed = if file.is_file() { 0 } else { packed(volume, path, format, &writing)? };
    let sent = encode(volume, &mut file, path, format, &writing, packed).map_err(|e| of_cut_file(e, volume))?;
    if let Some(at) = sent.size_at.filter(|_| file.is_file()) {
        file.put(at, metaimage::size(sent.packed).as_bytes())?;
    }
    if let Some(path) = cut_file() {
        return Err(cut_short(path));
    }
    file.finish()?;
    Ok(sent.written)
}

/// The error of a volume whose file became shorter while it was mapped.
fn cut_short(path: PathBuf) -> Error {
    Error::format(path, "was cut short by another program while it was read")
}

/// `error`, which writing `volume` has met; where its bytes are not there any more, an error that says so.
fn of_cut_file(error: Error, volume: &Volume) -> Error {
    /// The system's number for an address that leads nowhere.
    const EFAULT: i32 = 14;
    let is_address = matches!(&error, Error::Io { source, .. } if source.raw_os_error() == Some(EFAULT));
    let stored = volume.colors.as_ref().unwrap_or(&volume.voxels);
    is_address.then(|| look_for_cut(stored.bytes_of())).flatten().map_or(error, cut_short)
}

impl Writing {
    /// Whether a file called `path` can be written so, before any work.
    ///
    /// # Errors
    /// [`Error::Format`] for a name that tells no format, and for a compression that its format does not have.
    pub fn check(&self, path: &Path) -> Result<()> {
        chosen(path, self).map(drop)
    }
}

/// The format for the file `path`, and whether it is compressed.
fn chosen(path: &Path, writing: &Writing) -> Result<(WriteFormat, bool)> {
    if let Some(format) = writing.format {
        let gzip = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) && !format.packs_inside();
        return Ok((format, gzip || writing.compress));
    }
    let (format, gzip) = WriteFormat::of_path(path)?;
    if writing.compress && !gzip && !format.packs_inside() {
        let extension = format.extension();
        return Err(Error::format(path, format!("{format} is compressed as a whole: name it .{extension}.gz")));
    }
    Ok((format, gzip || writing.compress))
}

/// Writes `volume` to `out`, in `format`. Nothing is buffered here. A MetaImage tells in its header how long its compressed voxels are, so
/// these are compressed twice.
///
/// # Errors
/// When the format cannot hold the volume, or `out` cannot be written to. [`Error::Stopped`] when it was stopped.
pub fn write_to(volume: &Volume, out: &mut dyn Write, format: WriteFormat, writing: &Writing) -> Result<Written> {
    let name = Path::new("output");
    let packed = packed(volume, name, format, writing)?;
    Ok(encode(volume, out, name, format, writing, packed).map_err(|e| of_cut_file(e, volume))?.written)
}

/// Bytes that the voxels will have where the header must tell them in advance; else 0.
fn packed(volume: &Volume, name: &Path, format: WriteFormat, writing: &Writing) -> Result<u64> {
    if format != WriteFormat::MetaImage || !writing.compress {
        return Ok(0);
    }
    Ok(encode(volume, &mut io::sink(), name, format, writing, 0)?.packed)
}

/// What a format's header is made from, and what it does not keep.
struct Page<'v> {
    volume: &'v Volume,
    /// Type of the numbers that follow it.
    kind: VoxelType,
    compress: bool,
    /// Bytes of the compressed voxels, for a header that tells them; 0 while they are not known.
    packed: u64,
    /// Slope and intercept that turn these into values, for a header that has a place for them.
    rescale: (f64, f64),
    notes: Vec<String>,
}

impl Page<'_> {
    fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Tells that the names of segments, and the kind of values, are left out.
    fn lost_names(&mut self, format: WriteFormat) {
        let keeps = matches!(format, WriteFormat::Nrrd | WriteFormat::Nifti);
        if let Some(unit) = self.volume.unit().filter(|&unit| !keeps && unit != LengthUnit::Millimetre) {
            self.note(format!("{format} keeps no unit of lengths: they are in {}s", unit.name()));
        }
        if let Channels::Label(segments) = self.volume.channels() {
            if !segments.is_empty() {
                self.note(format!("{format} keeps no names of segments: those of {} labels are left out", segments.len()));
            }
        }
        if let (Some(name), true) = (self.volume.modality().name(), format != WriteFormat::MetaImage) {
            self.note(format!("{format} does not keep the kind of values: give --volume.modality {name} where it is read"));
        }
    }
}

/// Counts what goes through.
struct Counter<'w> {
    out: &'w mut dyn Write,
    bytes: u64,
}

impl Write for Counter<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.out.write(bytes)?;
        self.bytes += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// What went out.
struct Sent {
    written: Written,
    /// Bytes of compressed voxels, where they are compressed inside the file.
    packed: u64,
    /// Where the header tells how many these are.
    size_at: Option<u64>,
}

fn encode(volume: &Volume, out: &mut dyn Write, name: &Path, format: WriteFormat, writing: &Writing, packed: u64) -> Result<Sent> {
    let mut notes = Vec::new();
    let numbers = match format {
        WriteFormat::Nifti if nifti::keeps_rescale(volume) => Numbers::as_stored(volume),
        WriteFormat::Nifti => Numbers::as_values(volume, format, &mut notes),
        _ if writing.stored => Numbers::as_stored(volume),
        _ => Numbers::as_values(volume, format, &mut notes),
    };
    let rescale = if numbers.is_stored() { volume.rescale() } else { (1.0, 0.0) };
    if rescale != (1.0, 0.0) && !matches!(format, WriteFormat::Nifti | WriteFormat::MetaImage) {
        let (slope, intercept) = rescale;
        notes.push(format!(
            "{format} keeps no slope and intercept: give --volume.slope {slope:?} --volume.intercept {intercept:?} where it is read"
        ));
    }
    if *volume.channels() == Channels::Rgb {
        notes.push(
            "colours are written with an alpha of 1, as they are kept: give --transfer.opacity_from luma where they are rendered".into(),
        );
    }
    let mut page = Page { volume, kind: numbers.kind(), compress: writing.compress, packed, rescale, notes };
    let header = named(
        name,
        match format {
            WriteFormat::Nrrd => Ok(nrrd::header(&page)),
            WriteFormat::Nifti => nifti::header(&mut page),
            WriteFormat::MetaImage => Ok(metaimage::header(&mut page)),
            WriteFormat::Npy => Ok(npy::header(&mut page)),
            WriteFormat::Raw => raw::header(&mut page),
        },
    )?;
    let io = |e| Error::io(name, e);
    let tell = Tell { progress: writing.progress.as_deref(), name };
    let mut out = Counter { out, bytes: 0 };
    // A mark that says who wrote it, and no time: the same volume gives the same bytes.
    let gzip = GzBuilder::new().comment(AUTHOR);
    match (writing.compress, format) {
        (false, _) => {
            out.write_all(&header).map_err(io)?;
            numbers.send(&mut out, tell)?;
        }
        (true, WriteFormat::MetaImage) => {
            out.write_all(&header).map_err(io)?;
            let mut packed = ZlibEncoder::new(&mut out, Compression::default());
            numbers.send(&mut packed, tell)?;
            packed.finish().map_err(io)?;
        }
        (true, _) => {
            if format.packs_inside() {
                out.write_all(&header).map_err(io)?;
            }
            let mut packed = gzip.write(&mut out, Compression::default());
            if !format.packs_inside() {
                packed.write_all(&header).map_err(io)?;
            }
            numbers.send(&mut packed, tell)?;
            packed.finish().map_err(io)?;
        }
    }
    out.flush().map_err(io)?;
    let packed = if writing.compress { out.bytes.saturating_sub(header.len() as u64) } else { 0 };
    let size_at = if writing.compress && format == WriteFormat::MetaImage { metaimage::size_at(&header) } else { None };
    if volume.grid().convention() == BoxConvention::Nodes {
        page.note("which box the voxels fill is not kept: give --volume.box nodes where the file is read");
    }
    Ok(Sent { written: Written { bytes: out.bytes, voxel_type: page.kind, notes: page.notes }, packed, size_at })
}
