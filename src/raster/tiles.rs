//! Tiles: squares of the picture that threads take in turn. Each owns its pixels.

use super::block::{self, Outcome};
use super::observer::Observer;
use super::ray_intervals::RayIntervals;
use super::rays;
use super::resolve::{Finish, Resolve};
use super::work::Work;
use crate::fragment::{Batch, RayBatch};
use crate::lanes::SIDE;
use crate::lean::extra;
use crate::settings::Control;
use crate::tally::Counters;
use crate::{Error, Result};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// A tile: its first pixel, and a slice of every row it owns.
struct Tile<'p> {
    x: u32,
    y: u32,
    rows: Vec<&'p mut [[f32; 4]]>,
}

/// Some of a picture's blocks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BlockMask {
    width: usize,
    columns: usize,
    wanted: Vec<bool>,
}

impl BlockMask {
    /// None of the blocks of a picture of `width` x `height` pixels.
    pub(crate) fn none(width: usize, height: usize) -> Self {
        let columns = width.div_ceil(SIDE);
        Self { width, columns, wanted: vec![false; columns * height.div_ceil(SIDE)] }
    }

    /// Number of blocks in the picture.
    pub(crate) fn len(&self) -> usize {
        self.wanted.len()
    }

    /// Adds block `b`, counted row by row.
    pub(crate) fn set(&mut self, b: usize) {
        self.wanted[b] = true;
    }

    /// Column and row (of blocks) of block `b`.
    pub(crate) fn column_and_row(&self, b: usize) -> (usize, usize) {
        (b % self.columns, b / self.columns)
    }

    /// The block of pixel `i`, counted row by row.
    #[cfg(test)]
    pub(crate) fn block_of_pixel(&self, i: usize) -> usize {
        i / self.width / SIDE * self.columns + i % self.width / SIDE
    }

    /// Whether the block in column `bx` and row `by` of blocks is among them.
    pub(crate) fn takes(&self, bx: usize, by: usize) -> bool {
        self.wanted[by * self.columns + bx]
    }
}

/// Cuts a picture `width` pixels wide into tiles of `side` pixels, row by row of tiles.
fn cut(pixels: &mut [[f32; 4]], width: usize, side: usize) -> Vec<Tile<'_>> {
    let mut tiles = Vec::new();
    for (band, rows) in pixels.chunks_mut(width * side).enumerate() {
        let first = tiles.len();
        tiles.extend((0..width.div_ceil(side)).map(|t| Tile {
            x: (t * side) as u32,
            y: (band * side) as u32,
            rows: Vec::with_capacity(side),
        }));
        for row in rows.chunks_mut(width) {
            for (tile, part) in tiles[first..].iter_mut().zip(row.chunks_mut(side)) {
                tile.rows.push(part);
            }
        }
    }
    tiles
}

/// What rendering needs besides a plan.
pub(crate) struct Job<'j, O, F> {
    /// From gathered numbers to a layer.
    pub(crate) resolve: &'j Resolve<'j>,
    /// From a layer to what is wanted.
    pub(crate) finish: &'j F,
    /// Side of a tile in pixels.
    pub(crate) side: u32,
    /// With a mask, its blocks alone.
    pub(crate) blocks: Option<&'j BlockMask>,
    pub(crate) control: Control<'j>,
    /// Each tile's observer is made from it by [`Observer::fresh`].
    pub(crate) observer: &'j O,
}

/// Renders all tiles into `pixels` on the current thread pool.
pub(crate) fn render_tiles<O: Observer, F: Finish>(
    work: &Work<'_, '_>,
    job: &Job<'_, O, F>,
    pixels: &mut [[f32; 4]],
) -> Result<(Counters, O)> {
    let intervals = work.ray_intervals();
    let tiles = cut(pixels, work.stack.view.width as usize, job.side as usize);
    let (total, done, stopped) = (tiles.len() as u64, AtomicU64::new(0), AtomicBool::new(false));
    // Whoever is free takes the next tile: no thread is left with a row of them while another has none.
    let queue = Mutex::new(tiles.into_iter().enumerate());
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
    let parts = rayon::broadcast(|_| {
        let (mut batch, mut counters, mut seen) = (work.batch(), Counters::default(), Vec::new());
        batch.rays = work.rays.map(|_| RayBatch::new());
        while let Some((at, mut tile)) = next() {
            let mut observer = job.observer.fresh();
            let whole = render_tile(work, &intervals, job, &mut tile, &mut batch, &mut counters, &mut observer);
            observer.over();
            seen.push((at, observer));
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if !whole || stopped.load(Ordering::Relaxed) || !job.control.step("rendering", done, total) {
                stopped.store(true, Ordering::Relaxed);
                break;
            }
        }
        counters.gradients = batch.gradient.map_or(0, |g| g.taken);
        (counters, seen)
    });
    if stopped.into_inner() {
        return Err(Error::Stopped);
    }
    let (mut counters, mut seen) = (Counters::default(), Vec::new());
    for (count, part) in parts {
        counters.add(&count);
        seen.extend(part);
    }
    // In the order of tiles, whoever rendered them.
    seen.sort_unstable_by_key(|part| part.0);
    let mut all: Option<O> = None;
    for (_, part) in seen {
        match &mut all {
            Some(all) => all.merge(part),
            None => all = Some(part),
        }
    }
    Ok((counters, all.unwrap_or_else(|| job.observer.fresh())))
}

/// Renders one tile; false where it was stopped between two rows of blocks.
fn render_tile<O: Observer, F: Finish>(
    work: &Work<'_, '_>,
    intervals: &RayIntervals<'_>,
    job: &Job<'_, O, F>,
    tile: &mut Tile<'_>,
    batch: &mut Batch,
    counters: &mut Counters,
    observer: &mut O,
) -> bool {
    let (x0, y0) = (tile.x as usize, tile.y as usize);
    let (x1, y1) = (x0 + tile.rows.first().map_or(0, |r| r.len()), y0 + tile.rows.len());
    let (nothing, untouched) = (job.resolve.missed(job.finish), job.resolve.untouched(job.finish, work.start));
    for by in (y0 / SIDE * SIDE..y1).step_by(SIDE) {
        if job.control.is_stopped() {
            return false;
        }
        for bx in (x0 / SIDE * SIDE..x1).step_by(SIDE) {
            if job.blocks.is_some_and(|m| !m.takes(bx / SIDE, by / SIDE)) || !observer.wants(bx as u32, by as u32) {
                continue;
            }
            let (left, right) = (bx.max(x0), (bx + SIDE).min(x1));
            let (top, bottom) = (by.max(y0), (by + SIDE).min(y1));
            let inside = lanes(left - bx..right - bx, top - by..bottom - by);
            let first = (bx as u32, by as u32);
            let outcome = match extra(work.rays) {
                Some(plan) => rays::render((work, plan), intervals, first, inside, batch, counters, observer),
                None => block::render(work, intervals, first, inside, batch, counters, observer),
            };
            for y in top..bottom {
                let pixels = &mut tile.rows[y - y0][left - x0..right - x0];
                match outcome {
                    Outcome::Missed => pixels.fill(nothing),
                    Outcome::Empty => pixels.fill(untouched),
                    Outcome::Rendered => job.resolve.row(job.finish, &batch.pixels, (y - by) * SIDE + (left - bx), pixels, left, y),
                }
            }
        }
    }
    true
}

/// The lanes of a block in some of its columns and rows, one bit each.
fn lanes(columns: Range<usize>, rows: Range<usize>) -> u64 {
    let row = (1u64 << columns.end) - (1u64 << columns.start);
    rows.fold(0, |lanes, r| lanes | row << (SIDE * r))
}
