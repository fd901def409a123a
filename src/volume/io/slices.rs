//! Volumes out of slices that are decoded one by one, several at a time: images of a folder, pages of a file.

use super::reading::Reading;
use super::source::{room, too_large};
use super::stored::{Endian, Stored};
use crate::volume::{Grid, Volume, VoxelType, Voxels};
use crate::{Error, Result};
use rayon::prelude::*;
use std::fmt;
use std::path::Path;

/// Memory for slices in the making, beside a quarter of the voxels.
const BESIDE: usize = 32 << 20;

/// What the fourth number of a colour means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Alpha {
    /// There is none, or it is no alpha.
    None,
    Straight,
    /// The colour is multiplied by it.
    Premultiplied,
}

/// What the numbers of a pixel mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Color {
    /// Each is a value of its own; usually there is one.
    Grey,
    /// A value and an alpha.
    GreyAlpha,
    /// Red, green and blue, and perhaps more.
    Rgb(Alpha),
}

/// What the pixels of a slice are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pixels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) stored: Stored,
    /// Numbers of a pixel.
    pub(super) samples: usize,
    pub(super) color: Color,
}

impl fmt::Display for Pixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {} pixels of ", self.width, self.height)?;
        match (self.samples, self.color) {
            (1, _) => {}
            (n, Color::Rgb(_)) => write!(f, "{n} (RGB) ")?,
            (n, _) => write!(f, "{n} ")?,
        }
        self.stored.fmt(f)
    }
}

/// What of a pixel is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Take {
    /// One of its numbers.
    Sample(usize),
    /// All of it, as a colour.
    Colors,
}

impl Take {
    /// Numbers that a voxel takes.
    pub(super) fn count(self) -> usize {
        if self == Self::Colors { 4 } else { 1 }
    }
}

impl Pixels {
    /// Bytes of one slice.
    pub(super) fn bytes(&self) -> usize {
        self.width * self.height * self.samples * self.stored.bytes()
    }

    /// What is kept of a pixel where nothing is chosen.
    ///
    /// # Errors
    /// For colours of numbers that no volume keeps.
    pub(super) fn whole(&self, path: &Path) -> Result<Take> {
        if !matches!(self.color, Color::Rgb(_)) {
            return Ok(Take::Sample(0));
        }
        match self.stored.voxel_type() {
            VoxelType::U8 | VoxelType::U16 | VoxelType::F32 => Ok(Take::Colors),
            _ => Err(Error::format(
                path,
                format!("colours of {}: not supported, choose volume.channel 0 to {}", self.stored, self.samples - 1),
            )),
        }
    }

    /// What number `sample` of a pixel is called; empty where it has no name.
    pub(super) fn name(&self, sample: usize) -> &'static str {
        match (self.color, sample) {
            (Color::Rgb(_), 0) => "red",
            (Color::Rgb(_), 1) => "green",
            (Color::Rgb(_), 2) => "blue",
            (Color::Rgb(Alpha::Straight | Alpha::Premultiplied), 3) | (Color::GreyAlpha, 1) => "alpha",
            (Color::GreyAlpha, 0) => "grey",
            _ => "",
        }
    }

    /// What is to be told of what was `taken` of each pixel.
    pub(super) fn note(&self, taken: Take) -> Option<String> {
        match (taken, self.color) {
            (Take::Colors, Color::Rgb(Alpha::Premultiplied)) => Some("The colours were divided by their alpha.".to_owned()),
            (Take::Colors, Color::Rgb(Alpha::None)) if self.samples > 3 => {
                Some(format!("Of {} numbers a pixel the first three were taken for red, green and blue.", self.samples))
            }
            _ => None,
        }
    }

    /// Puts `numbers` (in this machine's order, type [`Stored`]) of one slice into `out`.
    fn put(&self, path: &Path, take: Take, numbers: &[u8], out: &mut [u8]) -> Result<()> {
        let converted;
        let numbers = match self.stored {
            Stored::Native(_) => numbers,
            stored => {
                let mut voxels = Voxels::zeros(stored.voxel_type(), numbers.len() / stored.bytes());
                stored.put(Endian::NATIVE, numbers, &mut voxels, 0).map_err(|e| too_large(path, stored, 0, e))?;
                converted = voxels;
                converted.bytes_of()
            }
        };
        let size = self.stored.voxel_type().bytes();
        let each = self.samples * size;
        match (take, self.color) {
            (Take::Sample(n), _) => {
                for (voxel, pixel) in out.chunks_exact_mut(size).zip(numbers.chunks_exact(each)) {
                    voxel.copy_from_slice(&pixel[n * size..(n + 1) * size]);
                }
            }
            (Take::Colors, Color::Rgb(Alpha::Straight | Alpha::Premultiplied)) => {
                for (voxel, pixel) in out.chunks_exact_mut(4 * size).zip(numbers.chunks_exact(each)) {
                    voxel.copy_from_slice(&pixel[..4 * size]);
                }
                if self.color == Color::Rgb(Alpha::Premultiplied) {
                    straighten(self.stored.voxel_type(), out);
                }
            }
            (Take::Colors, _) => {
                let opaque: &[u8] = match self.stored.voxel_type() {
                    VoxelType::F32 => &1f32.to_ne_bytes(),
                    _ => &[0xff; 2],
                };
                for (voxel, pixel) in out.chunks_exact_mut(4 * size).zip(numbers.chunks_exact(each)) {
                    voxel[..3 * size].copy_from_slice(&pixel[..3 * size]);
                    voxel[3 * size..].copy_from_slice(&opaque[..size]);
                }
            }
        }
        Ok(())
    }
}

/// Divides colours by their alpha.
fn straighten(kind: VoxelType, out: &mut [u8]) {
    match kind {
        VoxelType::U8 => {
            for c in out.chunks_exact_mut(4) {
                let alpha = u32::from(c[3]).max(1);
                c[..3].iter_mut().for_each(|b| *b = ((u32::from(*b) * 255 + alpha / 2) / alpha).min(255) as u8);
            }
        }
        VoxelType::U16 => {
            let number = |b: &[u8]| u64::from(u16::from_ne_bytes([b[0], b[1]]));
            for c in out.chunks_exact_mut(8) {
                let alpha = number(&c[6..]).max(1);
                for b in c[..6].chunks_exact_mut(2) {
                    let value = ((number(b) * 65535 + alpha / 2) / alpha).min(65535) as u16;
                    b.copy_from_slice(&value.to_ne_bytes());
                }
            }
        }
        _ => {
            let number = |b: &[u8]| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]);
            for c in out.chunks_exact_mut(16) {
                let alpha = number(&c[12..]);
                let scale = if alpha > 0.0 { alpha } else { 1.0 };
                for b in c[..12].chunks_exact_mut(4) {
                    b.copy_from_slice(&(number(b) / scale).to_ne_bytes());
                }
            }
        }
    }
}

/// The numbers of `count` slices alike. `decode` reads slice `n` into the bytes given: this machine's order, all numbers of a pixel.
///
/// # Errors
/// When they are over the limits; when a slice cannot be decoded, of several such the first one tells.
pub(super) fn stacked(
    path: &Path,
    reading: &Reading,
    (pixels, take, count): (&Pixels, Take, usize),
    decode: impl Fn(usize, &mut [u8]) -> Result<()> + Sync,
) -> Result<Voxels> {
    let (needed, limit) = (pixels.bytes() as u128, u128::from(reading.limits.voxel_bytes));
    if needed > limit {
        return Err(Error::Limit { what: format!("{}: bytes of a slice of {pixels}", path.display()), needed, limit });
    }
    let dims = [pixels.width.saturating_mul(take.count()), pixels.height, count];
    let mut voxels = room(path, &reading.limits, dims, pixels.stored, u64::MAX)?;
    let slice = pixels.width * pixels.height * take.count() * pixels.stored.voxel_type().bytes();
    let direct = matches!(pixels.stored, Stored::Native(_)) && pixels.samples == 1 && take == Take::Sample(0);
    let most = rayon::current_num_threads() * 4;
    let batch = ((slice * count / 4 + BESIDE) / (2 * pixels.bytes().max(1))).clamp(1, most);
    let one = |n: usize, out: &mut [u8]| {
        if direct {
            return decode(n, out);
        }
        let mut numbers = vec![0; pixels.bytes()];
        decode(n, &mut numbers)?;
        pixels.put(path, take, &numbers, out)
    };
    for (b, group) in voxels.as_bytes_mut().chunks_mut(slice * batch).enumerate() {
        reading.step((b * batch) as u64, count as u64)?;
        let results: Vec<Result<()>> = group.par_chunks_mut(slice).enumerate().map(|(i, out)| one(b * batch + i, out)).collect();
        results.into_iter().collect::<Result<()>>()?;
    }
    reading.step(count as u64, count as u64)?;
    Ok(voxels)
}

/// The first numbers of colours that are all grey and opaque.
fn greys(colors: &Voxels) -> Option<Voxels> {
    fn pick<T: Copy + PartialEq>(all: &[T], opaque: T) -> Option<Vec<T>> {
        let colors = all.chunks_exact(4);
        colors.clone().all(|c| c[0] == c[1] && c[0] == c[2] && c[3] == opaque).then(|| colors.map(|c| c[0]).collect())
    }
    match colors {
        Voxels::U8(v) => pick(v, u8::MAX).map(Voxels::from),
        Voxels::U16(v) => pick(v, u16::MAX).map(Voxels::from),
        Voxels::F32(v) => pick(v, 1.0).map(Voxels::from),
        _ => None,
    }
}

/// The volume of `numbers` of such `pixels` on `grid`; colours that are all grey become scalars.
///
/// # Errors
/// When the numbers are not the grid's.
pub(super) fn volume(grid: Grid, (pixels, take): (&Pixels, Take), numbers: Voxels) -> Result<Volume> {
    if take != Take::Colors {
        return Volume::new(grid, numbers);
    }
    match greys(&numbers) {
        Some(scalars) => Ok(Volume::new(grid, scalars)?.with_note("All colours are opaque greys: each was taken for one number.")),
        None => super::field::colors(grid, numbers, matches!(pixels.color, Color::Rgb(Alpha::Straight | Alpha::Premultiplied))),
    }
}
