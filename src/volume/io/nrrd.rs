//! NRRD, "nearly raw raster data": text header, voxels in the same file or beside it.
//!
//! Source of the format: <https://teem.sourceforge.net/nrrd/format.html>. Data may be longer than the header says when it is
//! not compressed, as in Teem.
//!
//! The spaces `left-anterior-superior` and `3D-left-handed` are left-handed, the world here is right-handed: their x axis is
//! mirrored, which makes the first a right-anterior-superior space.

use super::field::{Field, complete, grid, named, shown};
use super::reader::{Certainty, Reader};
use super::reading::Reading;
use super::source::{Source, Tail};
use super::store::Store;
use super::{Endian, Stored, ascii};
use crate::volume::{Modality, Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "NRRD",
    extensions: &["nrrd", "nhdr"],
    reads: "raw, gzip and ascii; data in the file or beside it; both byte orders; oblique axes",
    parts: &[],
    probe: |clues| if clues.has(0, b"NRRD") { Certainty::Magic } else { clues.by_name(READER.extensions) },
    read,
    list: None,
};

/// The header's fields by key, keys in lower case without spaces (`space directions` = `spacedirections`).
struct Header {
    fields: Vec<(String, String)>,
    modality: Modality,
}

impl Header {
    fn read(source: &mut Source) -> Result<Self> {
        let magic = source.line()?.unwrap_or_default();
        if !matches!(magic.strip_prefix("NRRD000"), Some("1" | "2" | "3" | "4" | "5" | "6")) {
            return Err(source.fault(format!("the first line is {}, not NRRD0001 to NRRD0006", shown(&magic))));
        }
        let mut header = Self { fields: Vec::new(), modality: Modality::Unknown };
        while let Some(line) = source.line()? {
            if line.is_empty() {
                break;
            }
            if line.starts_with('#') {
                continue;
            }
            let path = source.path();
            // "key:=value" is free text of whoever wrote the file, "field: value" is defined by the format.
            match line.split_once(':') {
                Some((key, note)) if note.starts_with('=') => {
                    if matches!(key.to_ascii_lowercase().as_str(), "modality" | "dicom_0008_0060") {
                        header.modality = Field::new(path, key, &note[1..]).modality();
                    }
                }
                Some((key, value)) => {
                    let key: String = key.chars().filter(|c| !c.is_whitespace()).collect();
                    let key = key.to_ascii_lowercase();
                    let list = key == "datafile" && value.trim().starts_with("LIST");
                    header.fields.push((key, value.trim().to_owned()));
                    if list {
                        // The lines that follow are names of files.
                        break;
                    }
                }
                None => return Err(source.fault(format!("header line {} is neither a field nor a comment", shown(&line)))),
            }
        }
        Ok(header)
    }

    /// The field `key`, called as the format does in messages.
    fn get<'a>(&'a self, path: &'a Path, key: &'a str) -> Option<Field<'a>> {
        let bare: String = key.chars().filter(|&c| c != ' ').collect();
        self.fields.iter().find(|(k, _)| *k == bare).map(|(_, v)| Field::new(path, key, v))
    }

    fn need<'a>(&'a self, path: &'a Path, key: &'a str) -> Result<Field<'a>> {
        self.get(path, key).ok_or_else(|| Error::format(path, format!("the header has no field \"{key}\"")))
    }
}

fn voxel_type(field: Field) -> Result<Stored> {
    use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
    Ok(match field.value.to_ascii_lowercase().as_str() {
        "signed char" | "int8" | "int8_t" => I8.into(),
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => U8.into(),
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => I16.into(),
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => U16.into(),
        "int" | "signed int" | "int32" | "int32_t" => I32.into(),
        "uint" | "unsigned int" | "uint32" | "uint32_t" => U32.into(),
        "longlong" | "long long" | "long long int" | "signed long long" | "signed long long int" | "int64" | "int64_t" => Stored::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => Stored::U64,
        "float" => F32.into(),
        "double" => F64.into(),
        _ => return Err(field.fault("no type that is read here")),
    })
}

/// Which of the file's axes are x, y and z.
struct Axes {
    dims: [usize; 3],
    /// For x, y and z, the number of the file's axis; `None` where the file has fewer axes.
    source: [Option<usize>; 3],
    /// Number of axes in the file.
    count: usize,
}

/// Three axes out of `sizes`. Where there are more, axes of size 1 are dropped: first those without a direction, then the last ones.
fn three_axes(field: Field, directions: Option<&[Option<Vec<f64>>]>) -> Result<Axes> {
    let sizes = field.sizes()?;
    let mut kept: Vec<usize> = (0..sizes.len()).collect();
    while kept.len() > 3 {
        let single = |a: &usize| sizes[*a] == 1;
        let spatial = |a: &usize| directions.is_none_or(|d| d.get(*a).is_some_and(Option::is_some));
        let out = kept.iter().rposition(|a| single(a) && !spatial(a)).or_else(|| kept.iter().rposition(single));
        let Some(out) = out else {
            let extra = kept.iter().rev().find(|a| !spatial(a)).or(kept.last()).copied().unwrap_or(0);
            let what = format!("{} dimensions; axis {extra} has size {}, only 3 may be over 1", sizes.len(), sizes[extra]);
            return Err(field.fault(what));
        };
        kept.remove(out);
    }
    let source = std::array::from_fn(|i| kept.get(i).copied());
    Ok(Axes { dims: source.map(|a| a.map_or(1, |a| sizes[a])), source, count: sizes.len() })
}

fn vector(field: Field, numbers: &[f64]) -> Result<DVec3> {
    match *numbers {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        [x, y] => Ok(DVec3::new(x, y, 0.0)),
        _ => Err(field.fault(format!("a vector of {} numbers, 3 are needed", numbers.len()))),
    }
}

fn geometry(header: &Header, path: &Path, axes: &Axes, directions: Option<Vec<Option<Vec<f64>>>>) -> Result<(DVec3, DMat3, Space)> {
    let space = header.get(path, "space");
    let (space, left_handed) = match space.map(|s| s.value.to_ascii_lowercase()).as_deref() {
        None | Some("scanner-xyz" | "3d-right-handed") => (Space::Unknown, false),
        Some("3d-left-handed") => (Space::Unknown, true),
        Some("right-anterior-superior" | "ras") => (Space::Ras, false),
        Some("left-posterior-superior" | "lps") => (Space::Lps, false),
        Some("left-anterior-superior" | "las") => (Space::Ras, true),
        Some(other) => return Err(Error::format(path, format!("space is {}: no three-dimensional space that is known", shown(other)))),
    };
    let per_axis = |key| -> Result<Option<Vec<Option<f64>>>> {
        let Some(field) = header.get(path, key) else { return Ok(None) };
        // "nan" stands for an axis without the property; only axes longer than 1 must have it.
        let of = |axis: Option<usize>| -> Result<Option<f64>> {
            let Some(axis) = axis else { return Ok(None) };
            let word = field.value.split_ascii_whitespace().nth(axis).unwrap_or_default();
            if word.eq_ignore_ascii_case("nan") && axes.count > 3 {
                return Ok(None);
            }
            Field::new(path, key, word).number().map(Some)
        };
        let found = field.value.split_ascii_whitespace().count();
        if found != axes.count {
            return Err(field.fault(format!("{found} numbers for {} dimensions", axes.count)));
        }
        axes.source.into_iter().map(of).collect::<Result<Vec<_>>>().map(Some)
    };
    let mut origin = DVec3::ZERO;
    let mut steps = [None; 3];
    if let (Some(field), Some(directions)) = (header.get(path, "space directions"), directions) {
        if directions.len() != axes.count {
            return Err(field.fault(format!("{} directions for {} dimensions", directions.len(), axes.count)));
        }
        for (step, axis) in steps.iter_mut().zip(axes.source) {
            if let Some(Some(numbers)) = axis.map(|a| directions[a].as_ref()) {
                *step = Some(vector(field, numbers)?);
            }
        }
    } else if let Some(spacings) = per_axis("spacings")? {
        for (i, s) in spacings.into_iter().enumerate() {
            steps[i] = s.map(|s| DVec3::AXES[i] * s);
        }
    } else if let (Some(low), Some(high)) = (per_axis("axis mins")?, per_axis("axis maxs")?) {
        let nodes = header.get(path, "centers").or(header.get(path, "centerings")).is_some_and(|c| c.value.contains("node"));
        for i in 0..3 {
            if let (Some(low), Some(high)) = (low[i], high[i]) {
                let n = axes.dims[i] as f64;
                let step = if nodes { (high - low) / (n - 1.0).max(1.0) } else { (high - low) / n };
                steps[i] = Some(DVec3::AXES[i] * step);
                origin[i] = if nodes { low } else { low + step / 2.0 };
            }
        }
    }
    if let Some(field) = header.get(path, "space origin") {
        if let Some(Some(numbers)) = field.vectors()?.first() {
            origin = vector(field, numbers)?;
        }
    }
    let mut steps = complete(steps);
    if left_handed {
        origin.x = -origin.x;
        steps = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)) * steps;
    }
    Ok((origin, steps, space))
}

/// The stream the voxels are in: the rest of this file, or the one the header names.
fn open_data(header: &Header, mut source: Source, encoding: &str, data_bytes: Option<u64>) -> Result<Source> {
    let path = source.path().to_path_buf();
    if let Some(field) = header.get(&path, "data file").or(header.get(&path, "datafile")) {
        let list = field.value.split_ascii_whitespace().next() == Some("LIST");
        if list || (field.value.contains('%') && field.value.split_ascii_whitespace().count() > 3) {
            return Err(field.fault("voxels spread over several files are not supported, join them into one"));
        }
        let limits = *source.limits();
        source = Source::open_plain(&field.sibling(), &limits).map_err(|e| field.fault(e))?;
    }
    let skip = |key| header.get(&path, key).map_or(Ok(0), |f| f.integer());
    let (lines, bytes) = (skip("line skip")?, skip("byte skip")?);
    for _ in 0..lines {
        if source.line()?.is_none() {
            return Err(source.fault(format!("line skip is {lines}, the file has fewer lines")));
        }
    }
    if encoding == "gzip" {
        source = source.gunzip();
    }
    match (u64::try_from(bytes), data_bytes) {
        (Ok(n), _) => source.skip(n)?,
        (Err(_), Some(data)) if bytes == -1 && encoding == "raw" => {
            let before = source
                .left()
                .checked_sub(data)
                .ok_or_else(|| source.fault(format!("the voxels should take the last {data} bytes, the file holds {}", source.left())))?;
            source.skip(before)?;
        }
        _ => return Err(source.fault(format!("byte skip is {bytes}: it must be 0 or more, or -1 with raw encoding"))),
    }
    Ok(source)
}

fn read(store: Store, _: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    let path = source.path().to_path_buf();
    let path = path.as_path();
    let header = Header::read(&mut source)?;
    let stored = voxel_type(header.need(path, "type")?)?;
    let sizes = header.need(path, "sizes")?;
    let dimension = header.need(path, "dimension")?;
    let given = sizes.sizes()?.len();
    if dimension.integer()? != given as i64 {
        return Err(dimension.fault(format!("but there are {given} sizes")));
    }
    let directions = header.get(path, "space directions").map(|f| f.vectors()).transpose()?;
    let axes = three_axes(sizes, directions.as_deref())?;
    let (origin, steps, space) = geometry(&header, path, &axes, directions)?;
    let grid = grid(path, axes.dims, origin, steps, space)?;

    let encoding = header.need(path, "encoding")?;
    let kind = match encoding.value.to_ascii_lowercase().as_str() {
        "raw" => "raw",
        "gz" | "gzip" => "gzip",
        "txt" | "text" | "ascii" => "ascii",
        _ => return Err(encoding.fault("only raw, gzip and ascii are read")),
    };
    let endian = match header.get(path, "endian").map(|f| (f, f.value.to_ascii_lowercase())) {
        Some((_, e)) if e == "little" => Endian::Little,
        Some((_, e)) if e == "big" => Endian::Big,
        Some((field, _)) => return Err(field.fault("neither little nor big")),
        None if stored.bytes() == 1 || kind == "ascii" => Endian::NATIVE,
        None => return Err(Error::format(path, format!("the header has no field \"endian\", {stored} needs it"))),
    };
    let data_bytes = (grid.voxel_count() as u64).checked_mul(stored.bytes() as u64);
    let mut data = open_data(&header, source, kind, data_bytes)?;
    let voxels = match kind {
        "ascii" => ascii::voxels(&mut data, axes.dims, stored, &[])?,
        _ => data.voxels(axes.dims, stored, endian, Tail::Ignored)?,
    };
    Ok(named(path, Volume::new(grid, voxels))?.with_modality(header.modality))
}
