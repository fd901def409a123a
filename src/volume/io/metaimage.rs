//! MetaImage: `Key = Value` lines, voxels in the same file (`.mha`) or beside it (`.mhd`).
//!
//! Source of the format: the MetaIO documentation, <https://itk.org/Wiki/MetaIO/Documentation>. Uncompressed binary data may be longer
//! than the header says, as in MetaIO. `TransformMatrix` holds the direction of the first axis, then of the second, then of the
//! third, as ITK reads it; a file that carries one is in the left-posterior-superior space of DICOM. A `:` may stand for the `=`, and lines that
//! begin with `#` are comments, as MetaIO's own reader has it. A fourth dimension is one of frames.

use super::field::{Field, complete, grid, named, shown};
use super::layout::{Encoding, Layout};
use super::reader::{Certainty, Reader};
use super::reading::{Item, Part, Reading};
use super::source::{Source, Tail};
use super::spread::{self, Pattern};
use super::store::Store;
use super::{Endian, Stored};
use crate::volume::{Grid, Modality, Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::DVec3;
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "MetaImage",
    extensions: &["mha", "mhd"],
    reads: "raw, zlib and ascii; data in the file, beside it or in many; both byte orders; oblique axes; colours, channels, frames",
    parts: &[Part::Frame, Part::Channel],
    probe: |clues| if starts(clues.head) { Certainty::Magic } else { clues.by_name(READER.extensions) },
    read,
    list: Some(list),
};

/// Keys a header may start with; one of them and a `=` or `:` behind it in the first line that is no comment show that it is a MetaImage.
const FIRST_KEYS: [&str; 10] =
    ["ObjectType", "ObjectSubType", "NDims", "Comment", "Name", "ID", "ParentID", "TransformType", "DimSize", "BinaryData"];

/// Whether the first line of a file is one of a MetaImage header.
fn starts(head: &[u8]) -> bool {
    let text = |line| std::str::from_utf8(line).unwrap_or_default();
    let mut lines = head.split(|&b| b == b'\n').map(text).filter(|line| !is_gap(line));
    lines.next().and_then(key_value).is_some_and(|(key, _)| FIRST_KEYS.contains(&key))
}

/// Whether a line of the header says nothing.
fn is_gap(line: &str) -> bool {
    line.trim().is_empty() || line.trim_start().starts_with('#')
}

/// `Key = Value` or `Key: Value`.
fn key_value(line: &str) -> Option<(&str, &str)> {
    let (key, value) = line.split_once(['=', ':'])?;
    Some((key.trim(), value.trim()))
}

struct Header {
    fields: Vec<(String, String)>,
}

impl Header {
    /// Reads up to and with `ElementDataFile`, which is the last line.
    fn read(source: &mut Source) -> Result<Self> {
        let mut fields = Vec::new();
        while let Some(line) = source.line()? {
            if is_gap(&line) {
                continue;
            }
            let Some((key, value)) = key_value(&line) else {
                return Err(source.fault(format!("header line {} is not of the form Key = Value", shown(&line))));
            };
            fields.push((key.to_owned(), value.to_owned()));
            if key == "ElementDataFile" {
                break;
            }
        }
        Ok(Self { fields })
    }

    /// The first of `keys` that is there.
    fn any<'a>(&'a self, path: &'a Path, keys: &[&str]) -> Option<Field<'a>> {
        keys.iter().find_map(|key| self.fields.iter().find(|(k, _)| k == key)).map(|(k, v)| Field::new(path, k, v))
    }

    fn need<'a>(&'a self, path: &'a Path, key: &str) -> Result<Field<'a>> {
        self.any(path, &[key]).ok_or_else(|| Error::format(path, format!("the header has no {key}")))
    }

    fn truth(&self, path: &Path, keys: &[&str], default: bool) -> Result<bool> {
        self.any(path, keys).map_or(Ok(default), |f| f.truth())
    }
}

fn voxel_type(field: Field) -> Result<Stored> {
    use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
    Ok(match field.value {
        "MET_CHAR" | "MET_CHAR_ARRAY" => I8.into(),
        "MET_UCHAR" | "MET_UCHAR_ARRAY" => U8.into(),
        "MET_SHORT" | "MET_SHORT_ARRAY" => I16.into(),
        "MET_USHORT" | "MET_USHORT_ARRAY" => U16.into(),
        // MetaIO's long is 4 bytes on every machine.
        "MET_INT" | "MET_LONG" => I32.into(),
        "MET_UINT" | "MET_ULONG" => U32.into(),
        "MET_LONG_LONG" => Stored::I64,
        "MET_ULONG_LONG" => Stored::U64,
        "MET_FLOAT" | "MET_FLOAT_ARRAY" => F32.into(),
        "MET_DOUBLE" | "MET_DOUBLE_ARRAY" => F64.into(),
        _ => return Err(field.fault("no type that is read here")),
    })
}

/// The axes, and how many dimensions the file has.
fn dimensions(header: &Header, path: &Path) -> Result<(Layout, usize)> {
    let field = header.need(path, "DimSize")?;
    let sizes = field.sizes()?;
    let count = header.need(path, "NDims")?;
    if count.integer()? != sizes.len() as i64 {
        return Err(count.fault(format!("but DimSize has {} numbers", sizes.len())));
    }
    if let Some(axis) = (4..sizes.len()).find(|&a| sizes[a] != 1) {
        return Err(field.fault(format!(
            "{} dimensions; dimension {} has size {}, only 4 may be over 1",
            sizes.len(),
            axis + 1,
            sizes[axis]
        )));
    }
    let channels = match header.any(path, &["ElementNumberOfChannels"]) {
        None => 1,
        Some(field) => match field.sizes()?[..] {
            [n] => n,
            _ => return Err(field.fault("one number is needed")),
        },
    };
    // Three or four bytes a voxel are a colour, as ITK has it.
    let color = matches!(header.need(path, "ElementType")?.value, "MET_UCHAR" | "MET_UCHAR_ARRAY");
    let size = |axis: usize| sizes.get(axis).copied().unwrap_or(1);
    let layout = Layout::of_space(path, [size(0), size(1), size(2)]).inner(Part::Channel, channels, color).outer(Part::Frame, size(3));
    Ok((layout, sizes.len()))
}

fn geometry(header: &Header, path: &Path, dims: [usize; 3], count: usize) -> Result<Grid> {
    let spacing = match header.any(path, &["ElementSpacing", "ElementSize"]) {
        Some(field) => field.exactly(count)?,
        None => vec![1.0; count],
    };
    let origin = match header.any(path, &["Offset", "Position", "Origin"]) {
        Some(field) => field.exactly(count)?,
        None => vec![0.0; count],
    };
    let matrix = header.any(path, &["TransformMatrix", "Rotation", "Orientation"]);
    let matrix = matrix.map(|f| f.exactly(count * count)).transpose()?;
    let component = |v: &[f64], i: usize| v.get(i).copied().unwrap_or(0.0);
    let steps = std::array::from_fn(|axis| {
        let direction = match &matrix {
            _ if axis >= count => return None,
            Some(m) => DVec3::from_array(std::array::from_fn(|i| if i < count { m[axis * count + i] } else { 0.0 })),
            None => DVec3::AXES[axis],
        };
        Some(direction * component(&spacing, axis))
    });
    let says = matrix.is_some() || header.any(path, &["AnatomicalOrientation"]).is_some();
    let space = if says { Space::Lps } else { Space::Unknown };
    grid(path, dims, DVec3::from_array(std::array::from_fn(|i| component(&origin, i))), complete(steps), space)
}

/// The stream of the voxels: the rest of this file, or the files that the header names.
fn open_data(header: &Header, mut source: Source, data: u64, compressed: bool) -> Result<Source> {
    let path = source.path().to_path_buf();
    let limits = *source.limits();
    let file = header.need(&path, "ElementDataFile")?;
    // MetaIO writes zlib streams and reads both kinds.
    let inflated = move |mut source: Source| -> Result<Source> {
        Ok(match compressed {
            false => source,
            true if source.is_gzip()? => source.gunzip(),
            true => source.inflate_zlib(),
        })
    };
    if matches!(file.value, "LOCAL" | "Local" | "local") {
        return inflated(source);
    }
    if file.value.is_empty() {
        return Err(file.fault("it must name the file of the voxels, or be LOCAL"));
    }
    let size = header.any(&path, &["HeaderSize"]).map(|f| f.integer().map(|n| (f, n))).transpose()?;
    if let Some((field, n)) = size.filter(|(_, n)| *n < -1 || (*n == -1 && compressed)) {
        let what = if n == -1 { "the end of compressed data is not known" } else { "it must be 0 or more, or -1" };
        return Err(field.fault(what));
    }
    let header_size = size.map_or(0, |(_, n)| n);
    // A file of `each` bytes of voxels, at the first of them.
    let prepare = move |mut source: Source, each: u64| -> Result<Source> {
        let left = source.left();
        let before = u64::try_from(header_size).ok().or_else(|| left.checked_sub(each));
        source.skip(before.ok_or_else(|| source.fault(format!("the voxels should take the last {each} bytes, the file holds {left}")))?)?;
        inflated(source)
    };
    let mut words = file.value.split_ascii_whitespace();
    let names = match Pattern::of(file.value, false) {
        _ if words.next() == Some("LIST") => {
            // Behind it stands of how many dimensions each file is: only their number of bytes matters.
            if let Some(word) = words.next().filter(|w| w.trim_end_matches('D').parse::<u8>().is_err()) {
                return Err(file.fault(format!("{} is no number of dimensions", shown(word))));
            }
            spread::listed(&mut source)?
        }
        Some((pattern, _)) => pattern.names(file)?,
        None => return prepare(Source::open_plain(&file.sibling(), &limits).map_err(|e| file.fault(e))?, data),
    };
    let each = data / names.len() as u64;
    spread::joined(&path, &names, data, &limits, Box::new(move |source| prepare(source, each)))
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let mut source = store.source()?;
    let path = source.path().to_path_buf();
    dimensions(&Header::read(&mut source)?, &path)?.0.list(reading)
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    let path = source.path().to_path_buf();
    let path = path.as_path();
    let header = Header::read(&mut source)?;
    if let Some(field) = header.any(path, &["ObjectType"]).filter(|f| f.value != "Image") {
        return Err(field.fault("only an Image holds voxels"));
    }
    let (layout, count) = dimensions(&header, path)?;
    let stored = voxel_type(header.need(path, "ElementType")?)?;
    let grid = geometry(&header, path, layout.dims, count)?;
    let modality = header.any(path, &["Modality"]).map_or(Modality::Unknown, |f| f.modality());
    let number = |key, default| header.any(path, &[key]).map_or(Ok(default), |f| f.number());
    let slope = number("ElementToIntensityFunctionSlope", 1.0)?;
    let intercept = number("ElementToIntensityFunctionOffset", 0.0)?;
    let big = header.truth(path, &["BinaryDataByteOrderMSB", "ElementByteOrderMSB"], false)?;
    let binary = header.truth(path, &["BinaryData"], true)?;
    let compressed = header.truth(path, &["CompressedData"], false)?;
    let bytes = layout.numbers().saturating_mul(stored.bytes() as u64);
    let mut data = open_data(&header, source, bytes, compressed)?;
    let encoding = match (binary || compressed, big) {
        (false, _) => Encoding::Text,
        (true, true) => Encoding::Binary(Endian::Big),
        (true, false) => Encoding::Binary(Endian::Little),
    };
    let tail = if compressed { Tail::Nothing } else { Tail::Ignored };
    let volume = layout.volume(&mut data, (stored, encoding), tail, grid, reading)?;
    let volume = if volume.scalars().is_some() { named(path, volume.with_rescale(slope, intercept))? } else { volume };
    Ok(volume.with_modality(modality))
}
