//! NRRD, "nearly raw raster data": text header, voxels in the same file or beside it.
//!
//! Source of the format: <https://teem.sourceforge.net/nrrd/format.html>. Binary data may be longer than the header says when it
//! is not compressed, as in Teem.
//!
//! The spaces `left-anterior-superior` and `3D-left-handed` are left-handed, the world here is right-handed: their x axis is
//! mirrored, which makes the first a right-anterior-superior space.

use super::field::{Field, complete, grid, shown};
use super::layout::{Encoding, Layout};
use super::reader::{Certainty, Reader};
use super::reading::{Item, Part, Reading};
use super::source::{Source, Tail};
use super::spread::{self, Pattern};
use super::store::Store;
use super::{Endian, Stored};
use crate::volume::{Grid, LengthUnit, Modality, Segment, Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "NRRD",
    extensions: &["nrrd", "nhdr"],
    reads: "raw, gzip, bzip2, hex and ascii; data in the file, beside it or in many; oblique axes; colours, channels, frames",
    parts: &[Part::Frame, Part::Channel],
    probe: |clues| if clues.has(0, b"NRRD") { Certainty::Magic } else { clues.by_name(READER.extensions) },
    read,
    list: Some(list),
};

/// The header's fields by key, keys in lower case without spaces (`space directions` = `spacedirections`).
struct Header {
    fields: Vec<(String, String)>,
    modality: Modality,
    /// Number of a segment, what is said of it, and the value: keys such as `Segment0_Name`, which 3D Slicer writes.
    segments: Vec<(usize, String, String)>,
}

impl Header {
    fn read(source: &mut Source) -> Result<Self> {
        let magic = source.line()?.unwrap_or_default();
        // The format's first version was called so.
        let known = magic.trim_end() == "NRRD00.01";
        if !known && !matches!(magic.trim_end().strip_prefix("NRRD000"), Some("1" | "2" | "3" | "4" | "5" | "6")) {
            return Err(source.fault(format!("the first line is {}, not NRRD0001 to NRRD0006", shown(&magic))));
        }
        let mut header = Self { fields: Vec::new(), modality: Modality::Unknown, segments: Vec::new() };
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
                    let parts = key.strip_prefix("Segment").and_then(|k| k.split_once('_'));
                    if let Some((number, what)) = parts.and_then(|(n, what)| Some((n.parse().ok()?, what))) {
                        header.segments.push((number, what.to_owned(), unescaped(note[1..].trim())));
                    }
                }
                Some((key, value)) => {
                    let key: String = key.chars().filter(|c| !c.is_whitespace()).collect();
                    let key = key.to_ascii_lowercase();
                    let list = key == "datafile" && value.split_ascii_whitespace().next() == Some("LIST");
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

    /// The segments of layer `layer` whose labels are told, by number.
    fn segments(&self, layer: usize) -> Vec<Segment> {
        let mut words: BTreeMap<(usize, &str), &str> = BTreeMap::new();
        for (number, what, value) in &self.segments {
            words.entry((*number, what)).or_insert(value);
        }
        let said = |number: usize, what: &'static str| words.get(&(number, what)).copied();
        let numbers: Vec<usize> = words.keys().filter(|key| key.1 == "LabelValue").map(|key| key.0).collect();
        let segment = |number: usize| {
            let label = said(number, "LabelValue")?.parse().ok()?;
            if said(number, "Layer").is_some_and(|l| l.parse() != Ok(layer)) {
                return None;
            }
            let segment = Segment::new(label, said(number, "Name").unwrap_or_default());
            let color: Option<Vec<f64>> = said(number, "Color").and_then(|c| c.split_ascii_whitespace().map(|w| w.parse().ok()).collect());
            Some(match color.as_deref() {
                Some(&[r, g, b]) => segment.with_color([r, g, b]),
                _ => segment,
            })
        };
        numbers.into_iter().filter_map(segment).collect()
    }

    /// The unit of lengths, where it is one for all axes.
    fn unit(&self, path: &Path) -> Option<LengthUnit> {
        let field = self.get(path, "space units").or(self.get(path, "units"))?;
        let mut words = field.value.split('"').skip(1).step_by(2).filter(|word| !word.trim().is_empty()).map(LengthUnit::from_word);
        let first = words.next()??;
        words.all(|word| word == Some(first)).then_some(first)
    }

    fn need<'a>(&'a self, path: &'a Path, key: &'a str) -> Result<Field<'a>> {
        self.get(path, key).ok_or_else(|| Error::format(path, format!("the header has no field \"{key}\"")))
    }
}

/// A value with its `\\n` and `\\\\` turned back into a line end and a backslash.
fn unescaped(value: &str) -> String {
    let mut out = String::with_capacity(value.len());
    let mut rest = value.chars();
    while let Some(c) = rest.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match rest.next() {
            Some('n') => out.push('\n'),
            Some(c) => out.push(c),
            None => out.push('\\'),
        }
    }
    out
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

/// Most dimensions, as Teem has it.
const MOST_DIMENSIONS: usize = 16;

/// What the file's axes are.
struct Axes {
    layout: Layout,
    /// For x, y and z, the number of the file's axis; `None` where the file has fewer axes.
    source: [Option<usize>; 3],
    /// Number of axes in the file.
    count: usize,
}

/// What the word in `kinds` says of an axis: `Some(true)` for a colour, `Some(false)` for other numbers that a voxel has several of; `None` for
/// an axis of space or time, or where it says nothing.
fn of_channels(kind: &str) -> Option<bool> {
    match kind.to_ascii_lowercase().as_str() {
        "rgb-color" | "rgba-color" | "3-color" | "4-color" => Some(true),
        "domain" | "space" | "time" | "none" | "???" | "" | "list" | "stub" | "scalar" => None,
        // Vectors, complex numbers, matrices, quaternions, colours that are not red, green and blue.
        _ => Some(false),
    }
}

impl Axes {
    fn of(path: &Path, sizes: Field, kinds: Option<Field>, directions: Option<&[Option<Vec<f64>>]>) -> Result<Self> {
        let given = sizes.sizes()?;
        if given.len() > MOST_DIMENSIONS {
            return Err(sizes.fault(format!("{} dimensions: at most {MOST_DIMENSIONS} are read", given.len())));
        }
        let words: Vec<&str> = kinds.map(|k| k.value.split_ascii_whitespace().collect()).unwrap_or_default();
        if let Some(kinds) = kinds.filter(|_| words.len() != given.len()) {
            return Err(kinds.fault(format!("{} kinds for {} dimensions", words.len(), given.len())));
        }
        let kind = |axis: usize| words.get(axis).copied().unwrap_or_default();
        let listed = |axis: usize| kind(axis).eq_ignore_ascii_case("list") || kind(axis).eq_ignore_ascii_case("time");
        // Directions, where there are any, tell the axes of space from others.
        let placed = directions.is_some_and(|d| d.iter().any(Option::is_some));
        let aside = |axis: usize| {
            let spatial = kind(axis).eq_ignore_ascii_case("space") || kind(axis).eq_ignore_ascii_case("domain");
            let unplaced = placed && !spatial && directions.is_some_and(|d| d.get(axis).is_some_and(Option::is_none));
            of_channels(kind(axis)).is_some() || listed(axis) || unplaced
        };
        let mut kept: Vec<usize> = (0..given.len()).filter(|&axis| !(aside(axis) && given.len() > 1)).collect();
        let mut others: Vec<usize> = (0..given.len()).filter(|axis| !kept.contains(axis)).collect();
        // More than three are left where nothing tells: axes of size 1 go first, then a short first axis, then the last one.
        while kept.len() > 3 {
            let out = kept.iter().rposition(|&a| given[a] == 1).unwrap_or_else(|| {
                let short = given[kept[0]] <= 4 && kept[1..].iter().all(|&a| given[a] > 4);
                if short { 0 } else { kept.len() - 1 }
            });
            others.push(kept.remove(out));
        }
        others.sort_unstable();
        let source: [Option<usize>; 3] = std::array::from_fn(|i| kept.get(i).copied());
        let mut layout = Layout::of_space(path, source.map(|a| a.map_or(1, |a| given[a])));
        let (first, last) = (kept.first().copied().unwrap_or(0), kept.last().copied().unwrap_or(0));
        let mut fast = 0;
        for &axis in others.iter().filter(|&&a| given[a] > 1) {
            let part = match of_channels(kind(axis)) {
                Some(_) => Part::Channel,
                None if !listed(axis) && axis < first => Part::Channel,
                None => Part::Frame,
            };
            if axis < first {
                fast += 1;
                // Without a word three or four bytes in front of the axes of space are not known to be a colour.
                layout = layout.inner(part, given[axis], of_channels(kind(axis)) == Some(true));
            } else if axis > last {
                layout = layout.outer(part, given[axis]);
            } else {
                return Err(sizes.fault(format!("axis {axis}, of size {}, lies between axes of space: not supported", given[axis])));
            }
        }
        if fast > 1 {
            return Err(sizes.fault(format!("{fast} axes stand before those of space: only one is supported")));
        }
        if layout.is_ambiguous() {
            return Err(sizes.fault("channels or frames stand both before and behind the axes of space: not supported"));
        }
        Ok(Self { layout, source, count: given.len() })
    }
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
    let given = header.get(path, "space directions").zip(directions);
    if let Some((field, directions)) = given.as_ref().filter(|(_, d)| d.len() != axes.count) {
        return Err(field.fault(format!("{} directions for {} dimensions", directions.len(), axes.count)));
    }
    // Where no axis has a direction the spacings hold.
    if let Some((field, directions)) = given.filter(|(_, d)| d.iter().any(Option::is_some)) {
        for (step, axis) in steps.iter_mut().zip(axes.source) {
            if let Some(Some(numbers)) = axis.map(|a| directions[a].as_ref()) {
                *step = Some(vector(field, numbers)?);
            }
        }
    } else if let Some(spacings) = per_axis("spacings")? {
        let mins = per_axis("axis mins")?;
        let nodes = header.get(path, "centers").or(header.get(path, "centerings")).is_some_and(|c| c.value.contains("node"));
        for (i, s) in spacings.into_iter().enumerate() {
            steps[i] = s.map(|s| DVec3::AXES[i] * s);
            if let (Some(s), Some(low)) = (s, mins.as_ref().and_then(|mins| mins[i])) {
                origin[i] = if nodes { low } else { low + s / 2.0 };
            }
        }
    } else if let (Some(low), Some(high)) = (per_axis("axis mins")?, per_axis("axis maxs")?) {
        let nodes = header.get(path, "centers").or(header.get(path, "centerings")).is_some_and(|c| c.value.contains("node"));
        for i in 0..3 {
            if let (Some(low), Some(high)) = (low[i], high[i]) {
                let n = axes.layout.dims[i] as f64;
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

/// How the bytes of the voxels are wrapped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wrapping {
    Raw,
    Gzip,
    Bzip2,
    Hex,
    Ascii,
}

impl Wrapping {
    fn of(field: Field) -> Result<Self> {
        Ok(match field.value.to_ascii_lowercase().as_str() {
            "raw" => Self::Raw,
            "gz" | "gzip" => Self::Gzip,
            "bz2" | "bzip2" => Self::Bzip2,
            "hex" => Self::Hex,
            "txt" | "text" | "ascii" => Self::Ascii,
            _ => return Err(field.fault("only raw, gzip, bzip2, hex and ascii are read")),
        })
    }

    fn unwrap(self, source: Source) -> Source {
        match self {
            Self::Raw | Self::Ascii => source,
            Self::Gzip => source.gunzip(),
            Self::Bzip2 => source.bunzip2(),
            Self::Hex => source.unhex(),
        }
    }
}

/// What is passed over in front of the voxels of a file.
#[derive(Debug, Clone, Copy)]
struct Skips {
    lines: i64,
    /// -1: all but as many bytes as the voxels take.
    bytes: i64,
}

impl Skips {
    fn of(header: &Header, path: &Path, wrapping: Wrapping) -> Result<Self> {
        let skip = |key| header.get(path, key).map_or(Ok(0), |f| f.integer());
        let skips = Self { lines: skip("line skip")?, bytes: skip("byte skip")? };
        if skips.lines < 0 {
            return Err(Error::format(path, format!("line skip is {}: it must be 0 or more", skips.lines)));
        }
        let back = skips.bytes == -1 && matches!(wrapping, Wrapping::Raw | Wrapping::Gzip | Wrapping::Bzip2);
        if skips.bytes < 0 && !back {
            let what = format!("byte skip is {}: it must be 0 or more, or -1 with raw, gzip or bzip2 encoding", skips.bytes);
            return Err(Error::format(path, what));
        }
        Ok(skips)
    }

    /// `source` at its first voxel of `data` bytes of them. `again` opens the same file anew.
    fn apply(self, mut source: Source, wrapping: Wrapping, data: u64, again: Option<&dyn Fn() -> Result<Source>>) -> Result<Source> {
        for _ in 0..self.lines {
            if source.line()?.is_none() {
                return Err(source.fault(format!("line skip is {}, the file has fewer lines", self.lines)));
            }
        }
        if let Ok(bytes) = u64::try_from(self.bytes) {
            // Of compressed data the bytes that come out are skipped, else those of the file.
            if matches!(wrapping, Wrapping::Gzip | Wrapping::Bzip2) {
                source = wrapping.unwrap(source);
                source.skip(bytes)?;
                return Ok(source);
            }
            source.skip(bytes)?;
            return Ok(wrapping.unwrap(source));
        }
        let length = match again {
            _ if wrapping == Wrapping::Raw && !source.is_packed() && !source.is_pipe() => source.left(),
            // Only inflating tells how many bytes there are.
            Some(again) => {
                let length = wrapping.unwrap(source).length_inflated()?;
                source = again()?;
                for _ in 0..self.lines {
                    source.line()?;
                }
                length
            }
            None => return Err(source.fault("byte skip is -1: the end of what follows is not known here; give the file itself, unpacked")),
        };
        let mut source = wrapping.unwrap(source);
        let before = length
            .checked_sub(data)
            .ok_or_else(|| source.fault(format!("the voxels should take the last {data} bytes, the file holds {length}")))?;
        source.skip(before)?;
        Ok(source)
    }
}

/// The stream of the voxels: the rest of this file, or the files that the header names.
fn open_data(header: &Header, mut source: Source, wrapping: Wrapping, data: u64) -> Result<Source> {
    let path = source.path().to_path_buf();
    let limits = *source.limits();
    let skips = Skips::of(header, &path, wrapping)?;
    let Some(field) = header.get(&path, "data file").or(header.get(&path, "datafile")) else {
        return skips.apply(source, wrapping, data, None);
    };
    let list = field.value.split_ascii_whitespace().next() == Some("LIST");
    let names = match Pattern::of(field.value, true) {
        _ if list => spread::listed(&mut source)?,
        Some((pattern, _)) => pattern.names(field)?,
        None => {
            let sibling = field.sibling();
            let open = || Source::open_plain(&sibling, &limits);
            return skips.apply(open().map_err(|e| field.fault(e))?, wrapping, data, Some(&open));
        }
    };
    let each = data / names.len() as u64;
    let prepare = move |source: Source| {
        let path = source.path().to_path_buf();
        let again = || Source::open_plain(&path, &limits);
        skips.apply(source, wrapping, each, Some(&again))
    };
    spread::joined(&path, &names, data, &limits, Box::new(prepare))
}

/// What the header says, up to the voxels.
struct Parsed {
    header: Header,
    stored: Stored,
    axes: Axes,
    grid: Grid,
}

impl Parsed {
    fn read(source: &mut Source) -> Result<Self> {
        let path = source.path().to_path_buf();
        let path = path.as_path();
        let header = Header::read(source)?;
        let stored = voxel_type(header.need(path, "type")?)?;
        let sizes = header.need(path, "sizes")?;
        let dimension = header.need(path, "dimension")?;
        let given = sizes.sizes()?.len();
        if dimension.integer()? != given as i64 {
            return Err(dimension.fault(format!("but there are {given} sizes")));
        }
        let directions = header.get(path, "space directions").map(|f| f.vectors()).transpose()?;
        let axes = Axes::of(path, sizes, header.get(path, "kinds"), directions.as_deref())?;
        let (origin, steps, space) = geometry(&header, path, &axes, directions)?;
        let grid = grid(path, axes.layout.dims, origin, steps, space)?;
        Ok(Self { header, stored, axes, grid })
    }
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    Parsed::read(&mut store.source()?)?.axes.layout.list(reading)
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    let path = source.path().to_path_buf();
    let path = path.as_path();
    let Parsed { header, stored, axes, grid } = Parsed::read(&mut source)?;
    let wrapping = Wrapping::of(header.need(path, "encoding")?)?;
    let endian = match header.get(path, "endian").map(|f| (f, f.value.to_ascii_lowercase())) {
        Some((_, e)) if e == "little" => Endian::Little,
        Some((_, e)) if e == "big" => Endian::Big,
        Some((field, _)) => return Err(field.fault("neither little nor big")),
        None if stored.bytes() == 1 || wrapping == Wrapping::Ascii => Endian::NATIVE,
        None => return Err(Error::format(path, format!("the header has no field \"endian\", {stored} needs it"))),
    };
    let bytes = axes.layout.numbers().saturating_mul(stored.bytes() as u64);
    let mut data = open_data(&header, source, wrapping, bytes)?;
    let encoding = if wrapping == Wrapping::Ascii { Encoding::Text } else { Encoding::Binary(endian) };
    let volume = axes.layout.volume(&mut data, (stored, encoding), Tail::Ignored, grid, reading)?;
    let volume = volume.with_modality(header.modality).with_unit(header.unit(path));
    let segments = header.segments(reading.choice.frame.unwrap_or(0));
    if segments.is_empty() || volume.scalars().is_none() {
        return Ok(volume);
    }
    Ok(match volume.clone().with_segments(segments) {
        Ok(labelled) => labelled,
        Err(e) => volume.with_note(format!("the names of segments are left out: {e}")),
    })
}
