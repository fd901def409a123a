//! What the data set of one file says of its images, as far as it is needed.
//!
//! Source: DICOM PS3.3 (sections C.7.6 and C.8, <https://dicom.nema.org/medical/dicom/current/output/html/part03.html>). What tells who was
//! examined, when and where is not read at all.

use super::syntax::Syntax;
use crate::volume::{VoxelType, Voxels};
use glam::DVec3;
use std::path::PathBuf;
use std::sync::Arc;

/// What images at one position may differ in, as numbers: see [`Facts::keys`].
pub(super) const KEYS: usize = 9;
/// Positions in [`Facts::keys`].
pub(super) mod key {
    pub(in super::super) const TEMPORAL: usize = 0;
    pub(in super::super) const TRIGGER: usize = 1;
    pub(in super::super) const ECHO: usize = 2;
    pub(in super::super) const B_VALUE: usize = 3;
    /// And the two behind it.
    pub(in super::super) const GRADIENT: usize = 4;
    pub(in super::super) const ACQUISITION: usize = 7;
    pub(in super::super) const TIME: usize = 8;
}

/// What is said of one frame, or of all frames of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Facts {
    /// Centre of the first pixel, in millimetres.
    pub(super) position: Option<DVec3>,
    /// Directions of a row and of a column.
    pub(super) orientation: Option<[DVec3; 2]>,
    /// From row to row and from column to column.
    pub(super) spacing: Option<[f64; 2]>,
    /// Height and width of a pixel, without a unit.
    pub(super) aspect: Option<[f64; 2]>,
    /// Where a slice lies along an axis that is not said.
    pub(super) location: Option<f64>,
    pub(super) thickness: Option<f64>,
    pub(super) between: Option<f64>,
    pub(super) slope: Option<f64>,
    pub(super) intercept: Option<f64>,
    /// Whether rescaled values are Hounsfield units; `None` where nothing is said.
    pub(super) hounsfield: Option<bool>,
    /// Moment, trigger time, echo time, strength and direction of diffusion, number and time of the acquisition.
    pub(super) keys: [Option<f64>; KEYS],
    /// What kind of image it is: original, a localizer, a phase or a magnitude.
    pub(super) kind: Option<Arc<str>>,
}

impl Facts {
    /// These facts, and those of `other` where nothing is said here.
    pub(super) fn or(&self, other: &Self) -> Self {
        let mut keys = self.keys;
        keys.iter_mut().zip(other.keys).for_each(|(mine, theirs)| *mine = mine.or(theirs));
        Self {
            position: self.position.or(other.position),
            orientation: self.orientation.or(other.orientation),
            spacing: self.spacing.or(other.spacing),
            aspect: self.aspect.or(other.aspect),
            location: self.location.or(other.location),
            thickness: self.thickness.or(other.thickness),
            between: self.between.or(other.between),
            slope: self.slope.or(other.slope),
            intercept: self.intercept.or(other.intercept),
            hounsfield: self.hounsfield.or(other.hounsfield),
            keys,
            kind: self.kind.clone().or_else(|| other.kind.clone()),
        }
    }
}

/// What a pixel's numbers mean: the photometric interpretation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Photometric {
    /// One number, bright where it is large.
    Gray,
    /// One number, dark where it is large.
    Inverted,
    Rgb,
    /// Brightness and two differences of colour.
    Ybr,
    /// The same, with differences for every second pixel of a row.
    Ybr422,
    /// Colours that the codec turns into red, green and blue.
    Coded,
    /// The position of a colour in three tables.
    Palette,
}

/// How pixels lie in memory, and what they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Layout {
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// Numbers of a pixel.
    pub(super) samples: usize,
    /// Bits that a number takes in the file.
    pub(super) allocated: u32,
    pub(super) signed: bool,
    pub(super) float: bool,
    pub(super) photometric: Photometric,
}

impl Layout {
    /// The type of one number.
    pub(super) fn kind(&self) -> VoxelType {
        match (self.allocated, self.signed, self.float) {
            (..=8, false, _) => VoxelType::U8,
            (..=8, true, _) => VoxelType::I8,
            (..=16, false, _) => VoxelType::U16,
            (..=16, true, _) => VoxelType::I16,
            (64.., ..) => VoxelType::F64,
            (_, _, true) => VoxelType::F32,
            (_, false, _) => VoxelType::U32,
            (_, true, _) => VoxelType::I32,
        }
    }

    pub(super) fn pixels(&self) -> usize {
        self.rows * self.columns
    }

    /// Bytes of a frame, once decoded.
    pub(super) fn frame_bytes(&self) -> usize {
        self.pixels() * self.samples * self.kind().bytes()
    }

    /// Bytes of a frame in a file that does not compress it.
    pub(super) fn native_bytes(&self) -> usize {
        // Two pixels share their differences of colour: four numbers instead of six.
        if self.photometric == Photometric::Ybr422 { self.frame_bytes() / 3 * 2 } else { self.frame_bytes() }
    }

    pub(super) fn is_color(&self) -> bool {
        !matches!(self.photometric, Photometric::Gray | Photometric::Inverted)
    }
}

/// Colours of a palette: three tables of so many numbers, and the pixel that stands for the first of them.
#[derive(Debug, PartialEq)]
pub(super) struct Palette {
    pub(super) first: i64,
    /// Red, green and blue, as u8 or u16.
    pub(super) tables: [Voxels; 3],
}

/// Which bits of a number count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Bits {
    pub(super) stored: u32,
    pub(super) high: u32,
}

/// One file with images.
#[derive(Debug)]
pub(super) struct Image {
    /// Its number in the tree.
    pub(super) leaf: usize,
    /// What messages call it.
    pub(super) path: PathBuf,
    /// UID of its series, and of the image itself.
    pub(super) series: String,
    pub(super) object: String,
    pub(super) series_number: Option<i64>,
    pub(super) instance: Option<i64>,
    pub(super) modality: String,
    pub(super) description: String,
    pub(super) layout: Layout,
    pub(super) bits: Bits,
    /// Whether all red numbers come first, then all green ones, then all blue ones.
    pub(super) planar: bool,
    pub(super) palette: Option<Arc<Palette>>,
    /// Pixels outside of what was scanned have this number.
    pub(super) padding: Option<u16>,
    /// Whether pixels have a table of values instead of a slope.
    pub(super) has_table: bool,
    pub(super) syntax: Syntax,
    /// Bytes before the part that is deflated, if one is.
    pub(super) before: u64,
    /// Byte that the pixels start at, in the deflated part if there is one.
    pub(super) at: u64,
    /// Bytes that can come from there on.
    pub(super) held: u64,
    /// Whether the bytes of a big-endian file are turned around in pairs.
    pub(super) words: bool,
    /// What is said of each frame.
    pub(super) frames: Vec<Facts>,
    /// Why it cannot be read, if it cannot.
    pub(super) unread: Option<String>,
}

impl Image {
    /// Whether it only shows where others lie.
    pub(super) fn is_localizer(&self) -> bool {
        self.frames.first().and_then(|f| f.kind.as_deref()).is_some_and(|kind| kind.contains("LOCALIZER"))
    }
}
