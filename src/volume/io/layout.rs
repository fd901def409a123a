//! Files whose arrays have more axes than space has: several numbers a voxel, several frames one after the other.
//!
//! ```text
//!  fastest                                                    slowest
//!   inner axis (channels or frames) | x | y | z | outer axes (frames, channels ...)
//! ```
//!
//! Of each axis that is not one of space, one position is read: the one that is chosen, else the first one, which is told. Three or four
//! channels that are a colour are kept together where none of them is chosen.

use super::reading::{Item, Part, Reading, pick};
use super::source::{Source, Tail};
use super::{Endian, Stored, ascii};
use crate::volume::{Grid, Volume, Voxel, VoxelType, Voxels, with_voxels};
use crate::{Error, Result};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// An axis that is none of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Axis {
    pub(super) part: Part,
    pub(super) size: usize,
}

/// How numbers are encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Binary(Endian),
    Text,
}

/// The numbers of a file, axis by axis.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    path: PathBuf,
    /// The fastest axis, where it is none of space.
    inner: Option<Axis>,
    pub(super) dims: [usize; 3],
    /// Slower axes than those of space, the fastest of them first.
    outer: Vec<Axis>,
    /// Whether the numbers along the inner axis are red, green, blue and perhaps alpha.
    color: bool,
}

impl Layout {
    /// Axes of space alone.
    pub(super) fn of_space(path: &Path, dims: [usize; 3]) -> Self {
        Self { path: path.to_path_buf(), inner: None, dims, outer: Vec::new(), color: false }
    }

    /// The same with `size` numbers a voxel; they are a colour where `color` says so and there are 3 or 4.
    #[must_use]
    pub(super) fn inner(mut self, part: Part, size: usize, color: bool) -> Self {
        self.inner = (size != 1).then_some(Axis { part, size });
        self.color = color && matches!(size, 3 | 4);
        self
    }

    /// The same with one more slow axis. One behind another of the same part counts on: 5 frames of 4 each are 20 frames.
    #[must_use]
    pub(super) fn outer(mut self, part: Part, size: usize) -> Self {
        match self.outer.last_mut() {
            Some(last) if last.part == part => last.size = last.size.saturating_mul(size),
            _ => self.outer.extend((size != 1).then_some(Axis { part, size })),
        }
        self
    }

    /// Whether a fast and a slow axis are of the same part, so that one number cannot choose both.
    pub(super) fn is_ambiguous(&self) -> bool {
        self.inner.is_some_and(|inner| self.outer.iter().any(|outer| outer.part == inner.part))
    }

    fn axes(&self) -> impl Iterator<Item = Axis> {
        self.inner.into_iter().chain(self.outer.iter().copied())
    }

    /// What there is to choose from.
    pub(super) fn list(&self, reading: &Reading) -> Result<Vec<Item>> {
        let about = |axis: Axis| {
            if self.color && Some(axis) == self.inner && chosen(reading, axis.part).is_none() {
                return Ok("together they are a colour".to_owned());
            }
            pick(&self.path, axis.part, chosen(reading, axis.part), axis.size).map(|n| format!("{} {n} is read", axis.part))
        };
        self.axes().map(|axis| Ok(Item::row(axis.part, axis.size, about(axis)?))).collect()
    }

    /// Numbers of all frames and channels together; saturates.
    pub(super) fn numbers(&self) -> u64 {
        let sizes = self.dims.into_iter().chain(self.axes().map(|axis| axis.size));
        sizes.fold(1u64, |a, n| a.saturating_mul(n as u64))
    }

    /// Refuses choices that this file does not have.
    pub(super) fn check(&self, reading: &Reading) -> Result<()> {
        for part in [Part::Frame, Part::Channel] {
            if self.axes().all(|axis| axis.part != part) {
                pick(&self.path, part, chosen(reading, part), 1)?;
            }
        }
        Ok(())
    }

    /// Reads what is chosen from `source`, which stands at the first number, and puts it on `grid`.
    ///
    /// # Errors
    /// As [`Source::voxels`]; when there is nothing of what is chosen, or colours are of a type that colours are not kept in.
    pub(super) fn volume(
        &self,
        source: &mut Source,
        (stored, encoding): (Stored, Encoding),
        tail: Tail,
        grid: Grid,
        reading: &Reading,
    ) -> Result<Volume> {
        self.check(reading)?;
        let mut notes = Vec::new();
        let mut place = |axis: Axis| -> Result<usize> {
            let picked = chosen(reading, axis.part);
            if picked.is_none() {
                notes.push(format!("{} 0 of {} is read (volume.{} chooses another)", axis.part, axis.size, axis.part));
            }
            pick(&self.path, axis.part, picked, axis.size)
        };
        let block = self.dims.iter().fold(self.inner.map_or(1, |a| a.size) as u64, |a, &n| a.saturating_mul(n as u64));
        let (mut before, mut blocks) = (0u64, 1u64);
        for &axis in &self.outer {
            before = before.saturating_add((place(axis)? as u64).saturating_mul(blocks));
            blocks = blocks.saturating_mul(axis.size as u64);
        }
        let colors = self.color && chosen(reading, Part::Channel).is_none();
        if colors && !matches!(stored, Stored::Native(VoxelType::U8 | VoxelType::U16 | VoxelType::F32)) {
            let what = format!("colours of {stored}: they are read as u8, u16 and f32; volume.channel chooses one of their numbers");
            return Err(Error::format(&self.path, what));
        }
        let keep = match self.inner {
            None => 0..1,
            Some(axis) if colors => 0..axis.size,
            Some(axis) => place(axis).map(|n| n..n + 1)?,
        };
        let numbers = match encoding {
            Encoding::Binary(endian) => {
                self.check_length(source, stored)?;
                source.skip(before.saturating_mul(block).saturating_mul(stored.bytes() as u64))?;
                // What is behind the frame that is read is another one.
                let tail = if before + 1 < blocks { Tail::Unchecked } else { tail };
                match self.inner {
                    None => source.voxels(self.dims, stored, endian, tail)?,
                    Some(axis) => source.interleaved(self.dims, stored, endian, (axis.size, keep, colors), tail)?,
                }
            }
            Encoding::Text => {
                let inner = self.inner.map_or(1, |a| a.size);
                let [x, y, z] = self.dims;
                let all = [x.saturating_mul(inner), y, z.saturating_mul(usize::try_from(blocks).unwrap_or(usize::MAX))];
                let all = ascii::voxels(source, all, stored, Some(&[]))?;
                let frame = if blocks == 1 { all } else { part_of(&all, (before * block) as usize, block as usize) };
                if inner == 1 { frame } else { picked(&frame, (inner, keep, colors)) }
            }
        };
        let three = self.inner.is_some_and(|axis| axis.size == 3);
        let volume = if colors { super::field::colors(grid, numbers, !three) } else { Volume::new(grid, numbers) };
        let volume = super::field::named(&self.path, volume)?;
        if matches!(stored, Stored::Complex64 | Stored::Complex128) {
            notes.push("complex numbers: their magnitude is read".to_owned());
        }
        Ok(notes.into_iter().fold(volume, Volume::with_note))
    }

    /// Refuses a plain file that is too short for all of its frames.
    fn check_length(&self, source: &Source, stored: Stored) -> Result<()> {
        if self.axes().next().is_none() || source.is_packed() || source.is_pipe() {
            return Ok(());
        }
        let (needed, left) = (self.numbers().saturating_mul(stored.bytes() as u64), source.left());
        if needed <= left {
            return Ok(());
        }
        let [x, y, z] = self.dims;
        let more: String = self.axes().map(|axis| format!(" x {} {}s", axis.size, axis.part)).collect();
        Err(source.fault(format!("{x} x {y} x {z} voxels of {stored}{more} take {needed} bytes, the file holds {left} after its header")))
    }
}

/// What is chosen of `part`.
fn chosen(reading: &Reading, part: Part) -> Option<usize> {
    match part {
        Part::Frame => reading.choice.frame,
        Part::Channel => reading.choice.channel,
        Part::Level => reading.choice.level,
        Part::Series | Part::Array => None,
    }
}

/// Of `all` numbers, `inner` a voxel, those that are kept; with an alpha of 1 behind three that are `colors`.
pub(super) fn picked(all: &Voxels, (inner, keep, colors): (usize, Range<usize>, bool)) -> Voxels {
    fn of<T: Voxel>(all: &[T], inner: usize, keep: Range<usize>, colors: bool) -> Voxels {
        let full = if T::FLOAT { 1.0 } else { T::TYPE.limits().1 };
        let alpha = (colors && keep.len() == 3).then(|| T::from_f64(full));
        let out: Vec<T> = all.chunks_exact(inner).flat_map(|voxel| voxel[keep.clone()].iter().copied().chain(alpha)).collect();
        out.into()
    }
    with_voxels!(all, v => of(v, inner, keep, colors))
}

/// The `count` numbers of `all` from position `first` on.
fn part_of(all: &Voxels, first: usize, count: usize) -> Voxels {
    with_voxels!(all, v => Voxels::from(v[first..first + count].to_vec()))
}
