//! Structured points of VTK's legacy format, versions 1.0 to 5.x: text header, voxels as text or in big-endian binary.
//!
//! Source of the format: "VTK File Formats", <https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html>. The first
//! scalars of the points or cells are read, whether they stand as SCALARS or as an array of one component in a FIELD; what
//! follows them is another array, metadata, or padding, or else an error.

use super::field::{Field, grid, named, shown};
use super::reader::{Certainty, Reader};
use super::reading::Reading;
use super::source::{Source, Tail};
use super::store::Store;
use super::{Endian, Stored, ascii};
use crate::volume::{Space, Volume, VoxelType};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "VTK legacy",
    extensions: &["vtk"],
    reads: "structured points, binary and ascii, scalars of points or cells",
    parts: &[],
    probe: |clues| if clues.has(0, b"# vtk DataFile") { Certainty::Magic } else { Certainty::No },
    read,
    list: None,
};

/// What may start a section after the voxels.
const SECTIONS: [&str; 13] = [
    "METADATA",
    "SCALARS",
    "COLOR_SCALARS",
    "LOOKUP_TABLE",
    "VECTORS",
    "NORMALS",
    "TEXTURE_COORDINATES",
    "TENSORS",
    "FIELD",
    "POINT_DATA",
    "CELL_DATA",
    "GLOBAL_IDS",
    "PEDIGREE_IDS",
];

/// The next line that is not blank, its first word in capitals, and the rest.
fn statement(source: &mut Source) -> Result<Option<(String, String)>> {
    while let Some(line) = source.line()? {
        let line = line.trim();
        if !line.is_empty() {
            let (word, rest) = line.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((line, ""));
            return Ok(Some((word.to_ascii_uppercase(), rest.trim().to_owned())));
        }
    }
    Ok(None)
}

fn voxel_type(path: &Path, name: &str) -> Result<Stored> {
    use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
    Ok(match name.to_ascii_lowercase().as_str() {
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
        _ => return Err(Error::format(path, format!("voxels of type {} are not supported", shown(name)))),
    })
}

#[derive(Default)]
struct Header {
    points: Option<[usize; 3]>,
    spacing: Option<DVec3>,
    origin: DVec3,
    /// Whether the voxels are the points or the cells between them, and how many the file says there are.
    data: Option<(bool, usize)>,
}

impl Header {
    fn count(&mut self, field: Field, cells: bool) -> Result<()> {
        match field.sizes()?[..] {
            [n] => self.data = Some((cells, n)),
            _ => return Err(field.fault("one number of voxels is needed")),
        }
        Ok(())
    }

    /// Reads up to the line that names the voxels' type, which is returned.
    fn read(&mut self, source: &mut Source) -> Result<Stored> {
        let path = source.path().to_path_buf();
        while let Some((key, rest)) = statement(source)? {
            let field = Field::new(&path, &key, &rest);
            let vector = || field.exactly(3).map(|v| DVec3::new(v[0], v[1], v[2]));
            match key.as_str() {
                "DATASET" if rest.eq_ignore_ascii_case("STRUCTURED_POINTS") => {}
                "DATASET" => return Err(field.fault("only STRUCTURED_POINTS is a regular grid of voxels")),
                "DIMENSIONS" => match field.sizes()?[..] {
                    [x, y, z] => self.points = Some([x, y, z]),
                    _ => return Err(field.fault("three sizes are needed")),
                },
                "SPACING" | "ASPECT_RATIO" => self.spacing = Some(vector()?),
                "ORIGIN" => self.origin = vector()?,
                "POINT_DATA" => self.count(field, false)?,
                "CELL_DATA" => self.count(field, true)?,
                "SCALARS" => return self.scalars(source, field),
                "FIELD" if self.data.is_some() => return self.field(source, field),
                _ => return Err(source.fault(format!("{} stands where structured points have no such section", shown(&key)))),
            }
        }
        Err(source.fault("the file ends before any SCALARS"))
    }

    /// `SCALARS name type [components]`, then usually `LOOKUP_TABLE name`.
    fn scalars(&self, source: &mut Source, field: Field) -> Result<Stored> {
        let mut words = field.value.split_ascii_whitespace().skip(1);
        let stored = voxel_type(source.path(), words.next().unwrap_or_default())?;
        if let Some(components) = words.next().filter(|c| *c != "1") {
            return Err(field.fault(format!("{components} components a voxel, only 1 is supported")));
        }
        if source.peek(12)?.eq_ignore_ascii_case(b"LOOKUP_TABLE") {
            source.line()?;
        }
        Ok(stored)
    }

    /// `FIELD name arrays`, then for each array `name components tuples type`.
    fn field(&self, source: &mut Source, field: Field) -> Result<Stored> {
        let line = source.line()?.unwrap_or_default();
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [_, components, tuples, kind] = words[..] else {
            return Err(field.fault(format!("{} does not describe an array", shown(&line))));
        };
        if components != "1" {
            return Err(field.fault(format!("{components} components a voxel, only 1 is supported")));
        }
        let wanted = self.data.map_or(0, |d| d.1);
        if tuples.parse() != Ok(wanted) {
            return Err(field.fault(format!("its first array has {} values for {wanted} voxels", shown(tuples))));
        }
        voxel_type(source.path(), kind)
    }
}

/// Only another section or padding may follow voxels in binary.
fn check_rest(source: &mut Source, bytes: u64) -> Result<()> {
    let rest = source.peek(64)?;
    let text = String::from_utf8_lossy(rest).trim_start().to_ascii_uppercase();
    if SECTIONS.iter().any(|s| text.starts_with(s)) { Ok(()) } else { source.check_tail(bytes, Tail::Nothing) }
}

fn read(store: Store, _: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    let path = source.path().to_path_buf();
    source.line()?;
    source.line()?;
    // Blank lines may stand before this one.
    let encoding = statement(&mut source)?.map(|s| s.0).unwrap_or_default();
    let binary = match encoding.as_str() {
        "BINARY" => true,
        "ASCII" => false,
        _ => return Err(source.fault(format!("the third line is {}, neither ASCII nor BINARY", shown(&encoding)))),
    };
    let mut header = Header::default();
    let stored = header.read(&mut source)?;
    let points = header.points.ok_or_else(|| source.fault("the header has no DIMENSIONS"))?;
    let (cells, said) = header.data.ok_or_else(|| source.fault("SCALARS come before POINT_DATA or CELL_DATA"))?;
    let spacing = header.spacing.unwrap_or(DVec3::ONE);
    // Along an axis of one point the cells are flat: they keep its place.
    let dims = points.map(|n| if cells { n.max(2) - 1 } else { n });
    let shift = DVec3::from_array(points.map(|n| if cells && n > 1 { 0.5 } else { 0.0 }));
    let grid = grid(&path, dims, header.origin + shift * spacing, DMat3::from_diagonal(spacing), Space::Unknown)?;
    if grid.voxel_count() != said {
        let [x, y, z] = dims;
        return Err(source.fault(format!("data for {said} voxels, but the dimensions give {x} x {y} x {z} = {}", grid.voxel_count())));
    }
    let voxels = if binary {
        let voxels = source.voxels(dims, stored, Endian::Big, Tail::Unchecked)?;
        check_rest(&mut source, said as u64 * stored.bytes() as u64)?;
        voxels
    } else {
        ascii::voxels(&mut source, dims, stored, &SECTIONS)?
    };
    named(&path, Volume::new(grid, voxels))
}
