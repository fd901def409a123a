//! What searches for a number of slices share: frames asked for, blocks picked out, differences between pictures.

use crate::Result;
use crate::lanes::{BATCH, SIDE};
use crate::raster::BlockMask;
use rayon::prelude::*;

/// Part of the tolerance aimed at.
pub(super) const AIM: f64 = 0.95;
/// Fewest slices a search starts from.
const FIRST: u64 = 32;
/// Most slices a search starts from.
const FIRST_MOST: u64 = 1024;
/// Smallest voxel spacings to a slab at the start.
const SPACINGS: f64 = 2.0;
/// Most slices of a picture.
pub(super) const MOST: u64 = 1 << 16;
/// Part of the tolerance that ending pixels early may use up.
const TERMINATE: f64 = 0.25;

/// A frame that a search asks for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ask<'m> {
    pub(super) count: u64,
    /// Blocks of the picture, all of them without a mask.
    pub(super) blocks: Option<&'m BlockMask>,
    /// Whether its pixels are part of the picture.
    pub(super) kept: bool,
    /// Whether other pictures are held against it: its pixels end later, and its tables are finer where theirs do not follow the transfer
    /// function, so that it does not share their errors.
    pub(super) judge: bool,
}

/// What a search is for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goal {
    /// RMS error of red, green and blue.
    pub(super) tolerance: f64,
    /// Columns and rows.
    pub(super) size: (usize, usize),
    /// Slices to start from.
    pub(super) first: u64,
    /// Whether errors fall with the slices' number at best, and not with its square.
    pub(super) first_order: bool,
}

impl Goal {
    /// Sum of squared errors over the picture that `rms` stands for.
    pub(super) fn sum(&self, rms: f64) -> f64 {
        rms * rms * 3.0 * self.pixels() as f64
    }

    /// The RMS error that a sum of squared errors over the picture stands for.
    pub(super) fn rms(&self, sum: f64) -> f64 {
        (sum / (3 * self.pixels().max(1)) as f64).sqrt()
    }

    pub(super) fn pixels(&self) -> usize {
        self.size.0 * self.size.1
    }
}

/// What was reached.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reached {
    /// RMS error of red, green and blue over the whole picture, as estimated.
    pub(crate) error: f64,
    /// Blocks by slice count: (slices, blocks), fewest slices first.
    pub(crate) levels: Vec<(u64, usize)>,
}

/// The slice count to start from for a box `depth` deep with voxels `spacing` apart.
pub(crate) fn first_count(depth: f64, spacing: f64) -> u64 {
    (libm::ceil(depth / (SPACINGS * spacing)) as u64).clamp(FIRST, FIRST_MOST)
}

/// The transmittance at which pixels may end for a tolerance.
pub(crate) fn terminate(scene: f32, tolerance: f64) -> f32 {
    scene.min((TERMINATE * tolerance) as f32)
}

/// Some blocks of a picture: which, and their pixels one block after the other.
#[derive(Debug, Clone)]
pub(super) struct Picked {
    pub(super) mask: BlockMask,
    pub(super) blocks: Vec<usize>,
    pub(super) size: (usize, usize),
}

impl Picked {
    /// Blocks of a picture of `size`, in rising order.
    pub(super) fn new(size: (usize, usize), blocks: Vec<usize>) -> Self {
        let mut mask = BlockMask::none(size.0, size.1);
        blocks.iter().for_each(|&b| mask.set(b));
        Self { mask, blocks, size }
    }

    /// Those of the blocks that are not `nothing` all over in a picture.
    pub(super) fn that_differ(&self, pixels: &[[f32; 4]], nothing: [f32; 4]) -> Self {
        let differs = |&block: &usize| self.rows(block).any(|row| pixels[row].iter().any(|p| p[..3] != nothing[..3]));
        Self::new(self.size, self.blocks.par_iter().copied().filter(differs).collect())
    }

    /// How rough a picture is in each of the blocks: the sum of squared second differences, along rows and columns, of its red, green and blue
    /// together.
    pub(super) fn roughness(&self, pixels: &[[f32; 4]]) -> Vec<f64> {
        let of = |&block: &usize| {
            let mut light = [[0.0f32; SIDE]; SIDE];
            let (mut width, mut height) = (0, 0);
            for (to, row) in light.iter_mut().zip(self.rows(block)) {
                (width, height) = (row.len(), height + 1);
                to.iter_mut().zip(&pixels[row]).for_each(|(to, p)| *to = p[0] + p[1] + p[2]);
            }
            let bend = |a: f32, b: f32, c: f32| (a - b + (c - b)) * (a - b + (c - b));
            let mut sum = 0.0;
            for y in 0..height {
                for x in 2..width {
                    sum += bend(light[y][x - 2], light[y][x - 1], light[y][x]);
                }
            }
            for y in 2..height {
                for x in 0..width {
                    sum += bend(light[y - 2][x], light[y - 1][x], light[y][x]);
                }
            }
            f64::from(sum)
        };
        self.blocks.par_iter().map(of).collect()
    }

    /// Their pixels, block after block; black where a block leaves the picture.
    pub(super) fn gathered(&self, pixels: &[[f32; 4]]) -> Vec<[f32; 4]> {
        let mut all = vec![[0.0; 4]; self.blocks.len() * BATCH];
        for (to, &block) in all.chunks_exact_mut(BATCH).zip(&self.blocks) {
            for (to, from) in to.chunks_exact_mut(SIDE).zip(self.rows(block)) {
                to[..from.len()].copy_from_slice(&pixels[from]);
            }
        }
        all
    }

    /// Copies their pixels from one picture into another.
    pub(super) fn copy(&self, from: &[[f32; 4]], to: &mut [[f32; 4]]) {
        for &block in &self.blocks {
            for row in self.rows(block) {
                to[row.clone()].copy_from_slice(&from[row]);
            }
        }
    }

    /// Sums of squared differences of red, green and blue between two pictures, block by block of these.
    pub(super) fn differences(&self, a: &[[f32; 4]], b: &[[f32; 4]]) -> Vec<f64> {
        let of = |&block: &usize| {
            self.rows(block).flat_map(|row| a[row.clone()].iter().zip(&b[row])).map(|(a, b)| squared_difference(a, b)).sum()
        };
        self.blocks.iter().map(of).collect()
    }

    /// Rows of pixels of a block, as ranges of a picture's.
    fn rows(&self, block: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let (bx, by) = self.mask.column_and_row(block);
        let (width, height) = self.size;
        let (x, end) = (bx * SIDE, ((bx + 1) * SIDE).min(width));
        (by * SIDE..((by + 1) * SIDE).min(height)).map(move |y| y * width + x..y * width + end)
    }
}

/// Squared difference of red, green and blue.
pub(super) fn squared_difference(a: &[f32; 4], b: &[f32; 4]) -> f64 {
    (0..3).map(|c| f64::from(a[c]) - f64::from(b[c])).map(|d| d * d).sum()
}

/// Sum of squared differences of red, green and blue.
pub(super) fn squared(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| squared_difference(a, b)).sum()
}

/// Where a quantity that is a power of the count falls to `wanted`, between (count, quantity) pairs.
pub(super) fn between((a, above): (u64, f64), (b, under): (u64, f64), wanted: f64) -> f64 {
    let t = libm::log(above / wanted) / libm::log(above / under.max(1e-3 * wanted));
    a as f64 * libm::pow(b as f64 / a as f64, t.clamp(0.0, 1.0))
}

/// Asks for a frame into pixels of the whole picture's size.
pub(super) type Frames<'f> = dyn FnMut(Ask<'_>, &mut [[f32; 4]]) -> Result<()> + 'f;

/// Asks for the sum of squared differences, over some blocks, that another method leaves between so many slices and half as many; nothing
/// where there is no other method.
pub(super) type Other<'f> = dyn FnMut(u64, &BlockMask) -> Result<Option<f64>> + 'f;

/// Slices of the first method that cost as much as one of the other: its slabs take more lookups, and are never merged.
const DEARER: f64 = 6.0;

/// Whether another method is worth beginning again with. `before` and `now` are a method's errors at half of `count` slices and at `count`, `others`
/// that of the other at `count`.
pub(super) fn is_better(count: u64, (before, now): (f64, f64), others: f64, wanted: f64) -> bool {
    let slices = |error: f64, order: f64| count as f64 * libm::pow((error / wanted).max(1e-6), 1.0 / order);
    let order = libm::log2(before / now.max(f64::MIN_POSITIVE)).clamp(0.5, 2.0);
    slices(now, order) > DEARER * slices(others, 1.9)
}
