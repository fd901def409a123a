//! MetaImage: `Key = Value` lines, voxels in the same file (`.mha`) or beside it (`.mhd`).
//!
//! Source of the format: the MetaIO documentation, <https://itk.org/Wiki/MetaIO/Documentation>. Uncompressed data may be longer
//! than the header says, as in MetaIO. `TransformMatrix` holds the direction of the first axis, then of the second, then of the
//! third, as ITK reads it; a file that carries one is in the left-posterior-superior space of DICOM.

use super::field::{Field, complete, grid, named, shown};
use super::reader::{Certainty, Reader};
use super::reading::Reading;
use super::source::{Source, Tail};
use super::store::Store;
use super::{Endian, Stored, ascii};
use crate::volume::{Grid, Modality, Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::DVec3;
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "MetaImage",
    extensions: &["mha", "mhd"],
    reads: "raw, zlib and ascii; data in the file or beside it; both byte orders; oblique axes",
    parts: &[],
    probe: |clues| if starts(clues.head) { Certainty::Magic } else { clues.by_name(READER.extensions) },
    read,
    list: None,
};

/// Keys a header may start with; one of them and a `=` in the first line show that it is a MetaImage.
const FIRST_KEYS: [&str; 10] =
    ["ObjectType", "ObjectSubType", "NDims", "Comment", "Name", "ID", "ParentID", "TransformType", "DimSize", "BinaryData"];

/// Whether the first line of a file is one of a MetaImage header.
fn starts(head: &[u8]) -> bool {
    let line = head.split(|&b| b == b'\n').next().unwrap_or_default();
    let Ok(line) = std::str::from_utf8(line) else { return false };
    line.split_once('=').is_some_and(|(key, _)| FIRST_KEYS.contains(&key.trim()))
}

struct Header {
    fields: Vec<(String, String)>,
}

impl Header {
    /// Reads up to and with `ElementDataFile`, which is the last line.
    fn read(source: &mut Source) -> Result<Self> {
        let mut fields = Vec::new();
        while let Some(line) = source.line()? {
            if line.trim().is_empty() {
                continue;
            }
            let Some((key, value)) = line.split_once('=') else {
                return Err(source.fault(format!("header line {} is not of the form Key = Value", shown(&line))));
            };
            fields.push((key.trim().to_owned(), value.trim().to_owned()));
            if key.trim() == "ElementDataFile" {
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
        "MET_CHAR" => I8.into(),
        "MET_UCHAR" => U8.into(),
        "MET_SHORT" => I16.into(),
        "MET_USHORT" => U16.into(),
        // MetaIO's long is 4 bytes on every machine.
        "MET_INT" | "MET_LONG" => I32.into(),
        "MET_UINT" | "MET_ULONG" => U32.into(),
        "MET_LONG_LONG" => Stored::I64,
        "MET_ULONG_LONG" => Stored::U64,
        "MET_FLOAT" => F32.into(),
        "MET_DOUBLE" => F64.into(),
        _ => return Err(field.fault("no type that is read here")),
    })
}

/// x, y, z and how many dimensions the file has.
fn dimensions(header: &Header, path: &Path) -> Result<([usize; 3], usize)> {
    let field = header.need(path, "DimSize")?;
    let sizes = field.sizes()?;
    let count = header.need(path, "NDims")?;
    if count.integer()? != sizes.len() as i64 {
        return Err(count.fault(format!("but DimSize has {} numbers", sizes.len())));
    }
    if let Some(axis) = (3..sizes.len()).find(|&a| sizes[a] != 1) {
        return Err(field.fault(format!(
            "{} dimensions; dimension {} has size {}, only 3 may be over 1",
            sizes.len(),
            axis + 1,
            sizes[axis]
        )));
    }
    Ok((std::array::from_fn(|i| sizes.get(i).copied().unwrap_or(1)), sizes.len()))
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

fn read(store: Store, _: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    let path = source.path().to_path_buf();
    let path = path.as_path();
    let header = Header::read(&mut source)?;
    if let Some(field) = header.any(path, &["ObjectType"]).filter(|f| f.value != "Image") {
        return Err(field.fault("only an Image holds voxels"));
    }
    let (dims, count) = dimensions(&header, path)?;
    let stored = voxel_type(header.need(path, "ElementType")?)?;
    if let Some(field) = header.any(path, &["ElementNumberOfChannels"]) {
        if field.integer()? != 1 {
            return Err(field.fault("voxels of several channels are not supported"));
        }
    }
    let grid = geometry(&header, path, dims, count)?;
    let modality = header.any(path, &["Modality"]).map_or(Modality::Unknown, |f| f.modality());
    let number = |key, default| header.any(path, &[key]).map_or(Ok(default), |f| f.number());
    let slope = number("ElementToIntensityFunctionSlope", 1.0)?;
    let intercept = number("ElementToIntensityFunctionOffset", 0.0)?;
    let big = header.truth(path, &["BinaryDataByteOrderMSB", "ElementByteOrderMSB"], false)?;
    let binary = header.truth(path, &["BinaryData"], true)?;
    let compressed = header.truth(path, &["CompressedData"], false)?;
    let bytes = (grid.voxel_count() as u64).saturating_mul(stored.bytes() as u64);

    let file = header.need(path, "ElementDataFile")?;
    let local = matches!(file.value, "LOCAL" | "Local" | "local");
    if !local {
        if file.value.is_empty() {
            return Err(file.fault("it must name the file of the voxels, or be LOCAL"));
        }
        if file.value.split_ascii_whitespace().next() == Some("LIST") || file.value.contains('%') {
            return Err(file.fault("voxels spread over several files are not supported, join them into one"));
        }
        let limits = *source.limits();
        source = Source::open_plain(&file.sibling(), &limits).map_err(|e| file.fault(e))?;
    }
    if let Some(field) = header.any(path, &["HeaderSize"]).filter(|_| !local) {
        match field.integer()? {
            -1 if compressed => return Err(field.fault("the end of compressed data is not known")),
            -1 => {
                let left = source.left();
                let before = left.checked_sub(bytes);
                source.skip(
                    before.ok_or_else(|| source.fault(format!("the voxels should take the last {bytes} bytes, the file holds {left}")))?,
                )?;
            }
            n => source.skip(u64::try_from(n).map_err(|_| field.fault("it must be 0 or more, or -1"))?)?,
        }
    }
    let endian = if big { Endian::Big } else { Endian::Little };
    let voxels = match (compressed, binary) {
        (true, _) => {
            // MetaIO writes zlib streams and reads both kinds.
            let mut inflated = if source.is_gzip()? { source.gunzip() } else { source.inflate_zlib() };
            inflated.voxels(dims, stored, endian, Tail::Nothing)?
        }
        (false, true) => source.voxels(dims, stored, endian, Tail::Ignored)?,
        (false, false) => ascii::voxels(&mut source, dims, stored, &[])?,
    };
    Ok(named(path, named(path, Volume::new(grid, voxels))?.with_rescale(slope, intercept))?.with_modality(modality))
}
