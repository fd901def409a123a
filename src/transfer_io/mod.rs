//! Transfer functions as other programs keep them, read and written.
//!
//! ```text
//!  .vp    3D Slicer: one volume property          --.
//!  .xml   3D Slicer: presets, several by name     --+-->  VolumeProperty  -->  the same four formats
//!  .json  ParaView: colour maps, several by name  --+
//!  .csv   value, red, green, blue, opacity        --'
//! ```
//! A [`VolumeProperty`] is what VTK means by that word: the curves of colour, opacity and gradient opacity, and the material that light
//! falls on. It holds plain lists; [`crate::scene::TransferFunction`] is made of it.
//!
//! Opacities in these files belong to a length that most of the formats do not name. VTK's own default is one world unit, and that is what
//! they are taken to mean.
//!
//! What is read is held against the same rules everywhere: every number is finite, values never fall from point to point, colours and
//! opacities lie in `[0,1]` (to 0.001, for files that were rounded), no list has more than [`MAX_POINTS`] points, and no file more than
//! [`MAX_BYTES`] bytes. Breaches give one line that names the file, the place in it and the number at fault.

mod color_space;
mod csv;
mod numbers;
mod paraview;
mod presets_xml;
mod resample;
#[cfg(test)]
mod tests;
mod vp;

use crate::{Error, Result};
use std::path::Path;

/// Most points of one curve.
pub const MAX_POINTS: usize = 1 << 16;

/// Largest file that is read.
pub const MAX_BYTES: u64 = 16 << 20;

/// Points of colour: value, then straight red, green and blue in `[0,1]`.
pub type ColorPoints = Vec<(f64, [f64; 3])>;

/// Points of a curve: position, then a number in `[0,1]`.
pub type Points = Vec<(f64, f64)>;

/// What light does to a volume, in the terms of OpenGL 1.x and VTK.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Share of colour that shows without light from a direction.
    pub ambient: f64,
    /// Share of colour that falls with the angle between normal and light.
    pub diffuse: f64,
    /// Strength of highlights.
    pub specular: f64,
    /// Exponent of highlights: the greater, the smaller they are.
    pub shininess: f64,
}

impl Default for Material {
    /// Ambient 0.2, diffuse 0.9, specular 0.2, shininess 10.
    fn default() -> Self {
        Self { ambient: 0.2, diffuse: 0.9, specular: 0.2, shininess: 10.0 }
    }
}

/// A transfer function and a material, as a file holds them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VolumeProperty {
    /// Its name in the file; empty where there is none.
    pub name: String,
    /// Points of colour, values in the data's units, rising.
    pub color: ColorPoints,
    /// Points of opacity per [`VolumeProperty::opacity_unit`], values in the data's units, rising.
    pub opacity: Points,
    /// Points of the factor on opacity, by the gradient's magnitude (data units per world unit), rising; empty where there is no such factor.
    pub gradient_opacity: Points,
    /// Length that opacities belong to, world units; `None` is the smallest voxel spacing of the volume that is shown. What is read from a
    /// file has 1 where the file does not say.
    pub opacity_unit: Option<f64>,
    /// The material; `None` where the volume is not lit.
    pub material: Option<Material>,
}

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileKind {
    /// 3D Slicer's volume property, `.vp`: a number or a list of numbers a line.
    SlicerProperty,
    /// 3D Slicer's presets, `.xml`: elements `VolumeProperty`, each with a name.
    SlicerPresets,
    /// ParaView's colour maps, `.json`: a list of objects, each with a name.
    ParaView,
    /// A table, `.csv`: columns value, red, green, blue, opacity.
    Csv,
}

impl FileKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::SlicerProperty, Self::SlicerPresets, Self::ParaView, Self::Csv];

    /// The extension of its files, without a dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::SlicerProperty => "vp",
            Self::SlicerPresets => "xml",
            Self::ParaView => "json",
            Self::Csv => "csv",
        }
    }

    /// The kind whose extension `path` has, in upper or lower case.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        Self::ALL.into_iter().find(|kind| extension.eq_ignore_ascii_case(kind.extension()))
    }
}

/// What was read, and what of it is not honoured, one line each.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Contents {
    /// The transfer function and the material.
    pub property: VolumeProperty,
    /// What the file asks for and does not get.
    pub warnings: Vec<String>,
}

/// Reads the transfer function called `name` from the file at `path`; a file that holds one alone needs no name.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read, and as [`parse`]. [`Error::Format`] for an extension that is not known here.
pub fn read(path: &Path, name: Option<&str>) -> Result<Contents> {
    let Some(kind) = FileKind::of_path(path) else {
        return Err(Error::format(path, "the extension tells no kind of transfer function; .vp, .xml, .json and .csv do"));
    };
    parse(&bytes_of(path)?, path, kind, name)
}

/// All bytes of the file at `path`.
///
/// # Errors
/// [`Error::Io`] when it cannot be read, [`Error::Format`] when it has more than [`MAX_BYTES`].
pub(crate) fn bytes_of(path: &Path) -> Result<Vec<u8>> {
    use std::io::Read;
    let mut bytes = Vec::new();
    let file = crate::files::open(path).map_err(|e| Error::io(path, e))?;
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok(bytes)
}

/// The transfer function called `name` in `bytes`, which are a file of `kind`; `path` is for messages alone.
///
/// # Errors
/// [`Error::Format`] for text that is not of this kind or breaks the rules above; when a name is needed and missing, or given and not there:
/// then the line lists the names.
pub fn parse(bytes: &[u8], path: &Path, kind: FileKind, name: Option<&str>) -> Result<Contents> {
    let made = text_of(bytes).and_then(|text| match kind {
        FileKind::SlicerProperty => vp::parse(text).and_then(|c| unnamed(c, name)),
        FileKind::SlicerPresets => presets_xml::parse(text, name),
        FileKind::ParaView => paraview::parse(text, name),
        FileKind::Csv => csv::parse(text).and_then(|c| unnamed(c, name)),
    });
    let mut contents = made.map_err(|what| Error::format(path, what))?;
    contents.property.opacity_unit.get_or_insert(1.0);
    Ok(contents)
}

/// Whether `bytes`, a file in JSON, are colour maps of ParaView and not a scene.
pub(crate) fn is_paraview(bytes: &[u8]) -> bool {
    text_of(bytes).is_ok_and(paraview::is_map)
}

/// `property` as a file of `kind`, and what of it the format has no place for, one line each.
///
/// The formats hold opacities per one world unit: those of another [`VolumeProperty::opacity_unit`] are converted, with further points between
/// its own where the curve needs them to stay within 1/2000. Those per voxel spacing are written as they are.
pub fn write(property: &VolumeProperty, kind: FileKind) -> (String, Vec<String>) {
    let mut lost = Vec::new();
    if property.opacity_unit.is_none() {
        lost.push("opacities are per smallest voxel spacing, which is not known here: they are written as those per one world unit".into());
    }
    let property = resample::per_unit_length(property);
    if matches!(kind, FileKind::ParaView | FileKind::Csv) {
        let format = if kind == FileKind::Csv { "a CSV table" } else { "ParaView's format" };
        if !property.gradient_opacity.is_empty() {
            lost.push(format!("gradient opacity is left out: {format} has no place for it"));
        }
        if property.material.is_some() {
            lost.push(format!("light is left out: {format} has no place for it"));
        }
    }
    let text = match kind {
        FileKind::SlicerProperty => vp::write(&property),
        FileKind::SlicerPresets => presets_xml::write(&property),
        FileKind::ParaView => paraview::write(&property),
        FileKind::Csv => csv::write(&property),
    };
    (text, lost)
}

/// What is wrong with a file, without its name.
type Parsed<T> = std::result::Result<T, String>;

fn text_of(bytes: &[u8]) -> Parsed<&str> {
    if bytes.len() as u64 > MAX_BYTES {
        return Err(format!("longer than the {MAX_BYTES} bytes a transfer function may have"));
    }
    let text = std::str::from_utf8(bytes).map_err(|e| format!("byte {} is no text", e.valid_up_to()))?;
    // Some editors put a byte order mark in front.
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// `contents` of a file that holds one transfer function without a name.
fn unnamed(contents: Contents, name: Option<&str>) -> Parsed<Contents> {
    match name {
        Some(name) => Err(format!("holds one transfer function without a name: leave the name {name:?} out")),
        None => Ok(contents),
    }
}

/// Which of the transfer functions called `names` is meant by `name`.
fn choose(names: &[String], name: Option<&str>) -> Parsed<usize> {
    /// Names that a message lists.
    const LISTED: usize = 60;
    let list = || {
        let mut text = names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
        if names.len() > LISTED {
            text += &format!(" and {} more", names.len() - LISTED);
        }
        text
    };
    match (name, names) {
        (_, []) => Err("holds no transfer function".into()),
        (None, [_]) => Ok(0),
        (None, _) => Err(format!("holds {} transfer functions, name one of them: {}", names.len(), list())),
        (Some(name), _) => names.iter().position(|n| n == name).ok_or_else(|| format!("holds no {name:?}; there are {}", list())),
    }
}

/// The shortest text that reads back as `x`.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-5..1e15).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}

/// The numbers in one line, a space between two.
fn spaced(numbers: impl Iterator<Item = f64>) -> String {
    numbers.map(number).collect::<Vec<_>>().join(" ")
}
