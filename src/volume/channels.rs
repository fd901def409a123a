//! What the numbers of a voxel mean: one value, a colour, or the label of a segment.

use super::voxels::Voxels;
use super::{Volume, VoxelType};
use crate::lanes::Number;
use crate::{Error, Result};
use std::collections::BTreeMap;

/// What a [`Volume`] holds at each of its voxels.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub enum Channels {
    /// One number, the sample of a field: it is interpolated, and classified by a transfer function.
    #[default]
    Scalar,
    /// Four numbers: red, green, blue and alpha, in this order. The colour is straight (not premultiplied by alpha), and alpha is the
    /// opacity of a layer as thick as the reference length. See [`Volume::with_colors`].
    Rgba,
    /// Red, green and blue, in this order, and no alpha. They are kept as four numbers, of which the fourth is not looked at. See
    /// [`Volume::without_alpha`].
    Rgb,
    /// One integer: the label of the segment that the voxel belongs to. Labels are names, not quantities: between 1 and 3 there is no 2.
    /// Not every label needs a segment here. See [`Volume::with_segments`].
    Label(Vec<Segment>),
}

impl Channels {
    /// Numbers that a voxel takes in memory: 4 for colours, with and without alpha, else 1.
    pub fn count(&self) -> usize {
        match self {
            Self::Scalar | Self::Label(_) => 1,
            Self::Rgba | Self::Rgb => 4,
        }
    }

    /// Whether voxels are colours, with or without alpha.
    pub fn is_color(&self) -> bool {
        matches!(self, Self::Rgba | Self::Rgb)
    }

    /// The segment of the label `value`; `None` where it has no name, and where voxels are no labels.
    pub fn segment(&self, value: i64) -> Option<&Segment> {
        match self {
            Self::Label(segments) => segments.iter().find(|s| s.value == value),
            Self::Scalar | Self::Rgba | Self::Rgb => None,
        }
    }
}

/// One named part of a segmentation.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Segment {
    /// Label of its voxels, as stored.
    pub value: i64,
    /// What it is called; may be empty.
    pub name: String,
    /// Red, green and blue, each in `[0,1]`, where the file gives it a colour.
    pub color: Option<[f64; 3]>,
}

impl Segment {
    /// The segment of the voxels labelled `value`, without a colour of its own.
    pub fn new(value: i64, name: impl Into<String>) -> Self {
        Self { value, name: name.into(), color: None }
    }

    /// The same segment in a colour: red, green and blue, each in `[0,1]`.
    #[must_use]
    pub fn with_color(mut self, color: [f64; 3]) -> Self {
        self.color = Some(color);
        self
    }
}

/// The voxels of a colour volume in their own type: an array of red, green, blue and alpha for each voxel, x fastest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Colors<'a> {
    /// Each number stands for itself divided by 255.
    U8(&'a [[u8; 4]]),
    /// Each number stands for itself divided by 65535.
    U16(&'a [[u16; 4]]),
    /// Each number stands for itself, 0 to 1 as a rule.
    F32(&'a [[f32; 4]]),
}

impl<'a> Colors<'a> {
    /// `None` for types that are not kept as colours.
    ///
    /// # Panics
    /// When the numbers are not a multiple of 4.
    pub(super) fn of(numbers: &'a Voxels) -> Option<Self> {
        match numbers {
            Voxels::U8(v) => Some(Self::U8(bytemuck::cast_slice(v))),
            Voxels::U16(v) => Some(Self::U16(bytemuck::cast_slice(v))),
            Voxels::F32(v) => Some(Self::F32(bytemuck::cast_slice(v))),
            _ => None,
        }
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::F32(v) => v.len(),
        }
    }

    /// Whether there are no voxels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Straight red, green, blue and alpha of the voxel at position `index`: 1 is full.
    ///
    /// # Panics
    /// When `index` is not below [`Colors::len`].
    pub fn get(&self, index: usize) -> [f64; 4] {
        match self {
            Self::U8(v) => v[index].map(|c| c.to_f64() / f64::from(u8::MAX)),
            Self::U16(v) => v[index].map(|c| c.to_f64() / f64::from(u16::MAX)),
            Self::F32(v) => v[index].map(f64::from),
        }
    }
}

/// Refuses types that colours are not kept in.
pub(super) fn check_colors(kind: VoxelType) -> Result<()> {
    match kind {
        VoxelType::U8 | VoxelType::U16 | VoxelType::F32 => Ok(()),
        other => Err(Error::invalid(format!("RGBA voxels of {other}: only u8, u16 and f32 are kept as colours"))),
    }
}

/// Refuses segments that voxels of `kind` cannot have.
pub(super) fn check_segments(kind: VoxelType, segments: &[Segment]) -> Result<()> {
    if kind.is_float() {
        return Err(Error::invalid(format!("labels of {kind}: a label is an integer")));
    }
    let (low, high) = kind.limits();
    let mut names = BTreeMap::new();
    for Segment { value, name, color } in segments {
        if !(low as i64..=high as i64).contains(value) {
            return Err(Error::invalid(format!("segment {name:?}: label {value} does not fit {kind}")));
        }
        if let Some(c) = color.iter().flatten().find(|c| !(0.0..=1.0).contains(*c)) {
            return Err(Error::invalid(format!("segment {name:?}: colour {c} is outside [0,1]")));
        }
        if let Some(other) = names.insert(value, name) {
            return Err(Error::invalid(format!("segments {other:?} and {name:?} have the same label {value}")));
        }
    }
    Ok(())
}

impl Volume {
    /// Refuses `what`, which needs a value at each voxel, for a volume of colours.
    pub(crate) fn check_scalars(&self, what: &str) -> Result<()> {
        if self.scalars().is_some() {
            return Ok(());
        }
        let file = if self.name().is_empty() { String::new() } else { format!("{}: ", self.name()) };
        Err(Error::invalid(format!(
            "{file}{what}: needs one number a voxel, and these voxels are colours (volume.channel = 0 reads the first of their numbers from a file)"
        )))
    }
}
