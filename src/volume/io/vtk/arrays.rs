//! The sections of a legacy VTK file, one after the other: geometry, and arrays of points and cells.

use super::{one, statement, words};
use crate::Result;
use crate::volume::io::Stored;
use crate::volume::io::ascii;
use crate::volume::io::field::{Field, shown};
use crate::volume::io::source::Source;
use crate::volume::{VoxelType, Voxels};
use glam::DVec3;
use std::ops::Range;

/// Most arrays of one file.
const MOST_ARRAYS: usize = 4096;

/// One array of numbers of the points or of the cells.
#[derive(Debug, Clone)]
pub(super) struct Array {
    pub(super) name: String,
    /// Whether its voxels are the cells between the points.
    pub(super) cells: bool,
    /// Whether it is what VTK shows: SCALARS.
    pub(super) active: bool,
    /// Whether it stands in a FIELD, among others.
    pub(super) in_field: bool,
    /// Whether its components are a colour.
    pub(super) color: bool,
    /// Whether they are written as fractions of 1 where they stand as text: COLOR_SCALARS.
    pub(super) fractions: bool,
    pub(super) components: usize,
    /// Type in the file's word; [`Array::stored`] is `None` where it is not read.
    pub(super) kind: String,
    pub(super) stored: Option<Stored>,
    /// Voxels that the file says there are.
    pub(super) count: usize,
}

impl Array {
    /// What it is, in a few words.
    pub(super) fn about(&self) -> String {
        let of = if self.cells { "cells" } else { "points" };
        match self.components {
            1 => format!("{} of {of}", self.kind),
            n => format!("{n} components of {}, of {of}", self.kind),
        }
    }
}

/// A name with what VTK writes as `%20` and the like turned back: spaces, and characters beyond ASCII.
fn decoded(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let hex = after.get(..2).and_then(|h| std::str::from_utf8(h).ok()).filter(|_| first == b'%');
        match hex.and_then(|h| u8::from_str_radix(h, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn voxel_type(name: &str) -> Option<Stored> {
    use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
    Some(match name.to_ascii_lowercase().as_str() {
        "unsigned_char" => U8.into(),
        "char" | "signed_char" => I8.into(),
        "unsigned_short" => U16.into(),
        "short" => I16.into(),
        "unsigned_int" => U32.into(),
        "int" | "vtkidtype" => I32.into(),
        // `long` is as wide as on the writer's machine; where that was 4 bytes, the file is too short and says so.
        "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => Stored::U64,
        "long" | "long_long" | "vtktypeint64" => Stored::I64,
        "float" => F32.into(),
        "double" => F64.into(),
        _ => return None,
    })
}

/// What a file says, section by section.
#[derive(Debug, Default)]
pub(super) struct Scan {
    pub(super) binary: bool,
    pub(super) points: Option<[usize; 3]>,
    pub(super) spacing: Option<DVec3>,
    pub(super) origin: DVec3,
    /// The arrays found, in the file's order; the last one is that whose numbers come next, where the scan was to stop there.
    pub(super) arrays: Vec<Array>,
    /// Whether sections are of cells (else of points), and how many of them there are; `None` before the first such section.
    data: Option<(bool, usize)>,
    /// Number of the array at whose first number the scan stops.
    until: Option<usize>,
}

impl Scan {
    /// Goes through the file from its start: to its end, or to the first number of array `until`.
    pub(super) fn of(source: &mut Source, until: Option<usize>) -> Result<Self> {
        source.line()?;
        source.line()?;
        // Blank lines may stand before this one.
        let encoding = statement(source)?.map(|s| s.0).unwrap_or_default();
        let binary = match encoding.as_str() {
            "BINARY" => true,
            "ASCII" => false,
            _ => return Err(source.fault(format!("the third line is {}, neither ASCII nor BINARY", shown(&encoding)))),
        };
        let mut scan = Self { binary, until, ..Self::default() };
        while let Some((key, rest)) = statement(source)? {
            match scan.section(source, &key, &rest) {
                Ok(false) => {}
                Ok(true) => break,
                // Behind an array that is known nothing is needed; whoever reads that array says what is wrong with it.
                Err(_) if until.is_none() && !scan.arrays.is_empty() => break,
                Err(e) => return Err(e),
            }
        }
        Ok(scan)
    }

    /// Goes through one section; true where the scan stops.
    fn section(&mut self, source: &mut Source, key: &str, rest: &str) -> Result<bool> {
        let path = source.path().to_path_buf();
        let field = Field::new(&path, key, rest);
        let vector = || field.exactly(3).map(|v| DVec3::new(v[0], v[1], v[2]));
        let words: Vec<&str> = rest.split_ascii_whitespace().collect();
        let word = |n: usize| words.get(n).copied().unwrap_or_default();
        match key {
            "DATASET" if rest.eq_ignore_ascii_case("STRUCTURED_POINTS") => {}
            "DATASET" => return Err(field.fault("only STRUCTURED_POINTS is a regular grid of voxels")),
            "DIMENSIONS" => match field.sizes()?[..] {
                [x, y, z] => self.points = Some([x, y, z]),
                _ => return Err(field.fault("three sizes are needed")),
            },
            "SPACING" | "ASPECT_RATIO" => self.spacing = Some(vector()?),
            "ORIGIN" => self.origin = vector()?,
            "POINT_DATA" => self.data = Some((false, one(field)?)),
            "CELL_DATA" => self.data = Some((true, one(field)?)),
            // Lines up to a blank one.
            "METADATA" => while source.line()?.is_some_and(|line| !line.trim().is_empty()) {},
            "FIELD" => return self.field(source, field, word(1)),
            "SCALARS" => {
                let components = if word(2).is_empty() { 1 } else { self.components(field, word(2))? };
                // Blank lines may stand before the name of the colours, which itself may be missing.
                while source.peek(1)?.first().is_some_and(|b| matches!(b, b'\n' | b'\r')) && !self.binary {
                    source.line()?;
                }
                if source.peek(12)?.eq_ignore_ascii_case(b"LOOKUP_TABLE") {
                    source.line()?;
                }
                return self.array(source, field, (word(0), word(1)), components, (true, false));
            }
            "COLOR_SCALARS" => {
                let components = self.components(field, word(1))?;
                // Bytes in binary; fractions of 1 as text.
                return self.array(source, field, (word(0), "unsigned_char"), components, (true, true));
            }
            "VECTORS" | "NORMALS" => return self.array(source, field, (word(0), word(1)), 3, (false, false)),
            "TENSORS" => return self.array(source, field, (word(0), word(1)), 9, (false, false)),
            "TENSORS6" => return self.array(source, field, (word(0), word(1)), 6, (false, false)),
            "TEXTURE_COORDINATES" => {
                let components = self.components(field, word(1))?;
                return self.array(source, field, (word(0), word(2)), components, (false, false));
            }
            "GLOBAL_IDS" | "PEDIGREE_IDS" => return self.array(source, field, (word(0), word(1)), 1, (false, false)),
            // A table of colours: four bytes each, or four numbers as text.
            "LOOKUP_TABLE" => {
                let entries = self.components(field, word(1))?;
                self.pass(source, entries.saturating_mul(4), 1)?;
            }
            _ => return Err(source.fault(format!("{} stands where structured points have no such section", shown(key)))),
        }
        Ok(false)
    }

    fn components(&self, field: Field, word: &str) -> Result<usize> {
        match word.parse() {
            Ok(n) if n > 0 => Ok(n),
            _ => Err(field.fault(format!("{} is no number of components", shown(word)))),
        }
    }

    /// An array in a section of its own, of `components` a voxel: notes it, and passes over its numbers unless it is the one to stop at.
    fn array(
        &mut self,
        source: &mut Source,
        field: Field,
        (name, kind): (&str, &str),
        components: usize,
        (active, color): (bool, bool),
    ) -> Result<bool> {
        let Some((cells, count)) = self.data else { return Err(field.fault("it comes before POINT_DATA or CELL_DATA")) };
        let stored = voxel_type(kind);
        let fractions = color;
        let color = matches!(components, 3 | 4) && (color || active && stored == Some(VoxelType::U8.into()));
        let (name, kind) = (decoded(name), kind.to_owned());
        let array = Array { name, cells, active, in_field: false, color, fractions, components, kind, stored, count };
        self.add(source, array, count.saturating_mul(components))
    }

    /// `FIELD name arrays`, then for each array `name components tuples type` and its numbers. In front of the geometry, or with another number
    /// of tuples than there are voxels, they say something about the whole, such as the time.
    fn field(&mut self, source: &mut Source, field: Field, count: &str) -> Result<bool> {
        let Ok(count) = count.parse::<usize>() else { return Err(field.fault("no number of arrays")) };
        for _ in 0..count {
            let Some((name, rest)) = words(source)? else {
                return Err(field.fault(format!("the file ends before its {count} arrays do")));
            };
            let words: Vec<&str> = rest.split_ascii_whitespace().collect();
            let [components, tuples, kind] = words[..] else {
                return Err(field.fault(format!("{} does not describe an array", shown(&format!("{name} {rest}")))));
            };
            let size = |word: &str| {
                word.parse::<usize>().map_err(|_| field.fault(format!("{} is no size of its array {}", shown(word), shown(&name))))
            };
            let (components, tuples) = (size(components)?, size(tuples)?);
            let stored = voxel_type(kind);
            let numbers = components.saturating_mul(tuples);
            let name = decoded(&name);
            match self.data.filter(|d| d.1 == tuples && components > 0) {
                Some((cells, count)) => {
                    let color = matches!(components, 3 | 4) && stored == Some(VoxelType::U8.into());
                    let kind = kind.to_owned();
                    if self.add(
                        source,
                        Array { name, cells, active: false, in_field: true, color, fractions: false, components, kind, stored, count },
                        numbers,
                    )? {
                        return Ok(true);
                    }
                }
                None => self.pass_kind(source, field, &name, kind, numbers)?,
            }
            // Every array may have metadata of its own.
            while source.peek(1)?.first().is_some_and(|b| matches!(b, b'\n' | b'\r')) {
                source.line()?;
            }
            if source.peek(8)?.eq_ignore_ascii_case(b"METADATA") {
                while source.line()?.is_some_and(|line| !line.trim().is_empty()) {}
            }
        }
        Ok(false)
    }

    /// Notes an array; true where the scan is to stop at its numbers, else they are passed over.
    fn add(&mut self, source: &mut Source, array: Array, numbers: usize) -> Result<bool> {
        if self.arrays.len() == MOST_ARRAYS {
            return Err(source.fault(format!("more than {MOST_ARRAYS} arrays")));
        }
        let stop = self.until == Some(self.arrays.len());
        let (name, kind, in_field, fractions) = (array.name.clone(), array.kind.clone(), array.in_field, array.fractions);
        self.arrays.push(array);
        if stop {
            return Ok(true);
        }
        let path = source.path().to_path_buf();
        let key = if in_field { "FIELD" } else { "SCALARS" };
        let field = Field::new(&path, key, &name);
        if fractions && !self.binary {
            self.pass(source, numbers, 1)?;
        } else {
            self.pass_kind(source, field, &name, &kind, numbers)?;
        }
        Ok(false)
    }

    /// Passes over numbers of the type called `kind`.
    fn pass_kind(&self, source: &mut Source, field: Field, name: &str, kind: &str, numbers: usize) -> Result<()> {
        let size = match kind.to_ascii_lowercase().as_str() {
            // One byte for eight of them.
            "bit" if self.binary => return source.skip((numbers as u64).div_ceil(8)),
            // Texts, a line each.
            "string" | "utf8_string" if !self.binary => {
                for at in 0..numbers {
                    if source.line()?.is_none() {
                        return Err(field.fault(format!("{numbers} texts are announced, only {at} are there")));
                    }
                }
                return Ok(());
            }
            "bit" => 1,
            _ => voxel_type(kind)
                .ok_or_else(|| field.fault(format!("array {} is of type {}, which is not known", shown(name), shown(kind))))?
                .bytes(),
        };
        self.pass(source, numbers, size)
    }

    /// Passes over so many numbers of `size` bytes each, or as text.
    fn pass(&self, source: &mut Source, numbers: usize, size: usize) -> Result<()> {
        if self.binary {
            return source.skip((numbers as u64).saturating_mul(size as u64));
        }
        if (numbers as u64).saturating_mul(2) > source.left().saturating_add(1) {
            return Err(source.fault(format!("the header asks for {numbers} numbers, {} bytes follow", source.left())));
        }
        ascii::pass(source, numbers)
    }
}

/// Of fractions of 1, `components` a voxel: those in `keep` as bytes, with an alpha of 255 behind three that are colours.
pub(super) fn bytes_of(fractions: &Voxels, components: usize, keep: Range<usize>, colors: bool) -> Voxels {
    let Voxels::F32(all) = fractions else { return Voxels::zeros(VoxelType::U8, 0) };
    let alpha = (colors && keep.len() == 3).then_some(255);
    let byte = |x: &f32| libm::rint(f64::from(*x).clamp(0.0, 1.0) * 255.0) as u8;
    let bytes: Vec<u8> = all.chunks_exact(components).flat_map(|v| v[keep.clone()].iter().map(byte).chain(alpha)).collect();
    Voxels::U8(bytes.into())
}
