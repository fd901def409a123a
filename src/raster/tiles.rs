//! Tiles: squares of the picture that threads take in turn. Each owns its pixels.

use super::block::{self, Outcome, Work};
use super::observer::Observer;
use super::ray_intervals::RayIntervals;
use super::resolve::Resolve;
use crate::fragment::Batch;
use crate::lanes::SIDE;
use crate::settings::Progress;
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

/// Renders all tiles of `side` pixels into `pixels` on the current thread pool; with a mask, its blocks alone.
/// Observers are made after `observer`.
pub(crate) fn render_tiles<W: Observer>(
    work: &Work<'_, '_>,
    resolve: &Resolve<'_>,
    side: u32,
    pixels: &mut [[f32; 4]],
    blocks: Option<&BlockMask>,
    progress: Option<&dyn Progress>,
    observer: &W,
) -> Result<(Counters, W)> {
    let intervals = RayIntervals::new(work.stack, work.radial, work.outer, work.level);
    let tiles = cut(pixels, work.stack.view.width as usize, side as usize);
    let (total, done, stopped) = (tiles.len() as u64, AtomicU64::new(0), AtomicBool::new(false));
    // Whoever is free takes the next tile: no thread is left with a row of them while another has none.
    let queue = Mutex::new(tiles.into_iter().enumerate());
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
    let parts = rayon::broadcast(|_| {
        let (mut batch, mut counters, mut seen) = (Batch::new(), Counters::default(), Vec::new());
        while let Some((at, mut tile)) = next() {
            let mut observer = observer.fresh();
            render_tile(work, &intervals, resolve, blocks, &mut tile, &mut batch, &mut counters, &mut observer);
            observer.over();
            seen.push((at, observer));
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if stopped.load(Ordering::Relaxed) || progress.is_some_and(|p| !p.step("rendering", done, total)) {
                stopped.store(true, Ordering::Relaxed);
                break;
            }
        }
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
    let mut all: Option<W> = None;
    for (_, part) in seen {
        match &mut all {
            Some(all) => all.merge(part),
            None => all = Some(part),
        }
    }
    Ok((counters, all.unwrap_or_else(|| observer.fresh())))
}

#[allow(clippy::too_many_arguments, reason = "what all tiles share, and what a thread has of its own")]
fn render_tile<W: Observer>(
    work: &Work<'_, '_>,
    intervals: &RayIntervals<'_>,
    resolve: &Resolve<'_>,
    blocks: Option<&BlockMask>,
    tile: &mut Tile<'_>,
    batch: &mut Batch,
    counters: &mut Counters,
    observer: &mut W,
) {
    let (x0, y0) = (tile.x as usize, tile.y as usize);
    let (x1, y1) = (x0 + tile.rows.first().map_or(0, |r| r.len()), y0 + tile.rows.len());
    let (background, untouched) = (resolve.background(), resolve.untouched(work.start));
    for by in (y0 / SIDE * SIDE..y1).step_by(SIDE) {
        for bx in (x0 / SIDE * SIDE..x1).step_by(SIDE) {
            if blocks.is_some_and(|m| !m.takes(bx / SIDE, by / SIDE)) || !observer.wants(bx as u32, by as u32) {
                continue;
            }
            let (left, right) = (bx.max(x0), (bx + SIDE).min(x1));
            let (top, bottom) = (by.max(y0), (by + SIDE).min(y1));
            let inside = lanes(left - bx..right - bx, top - by..bottom - by);
            let outcome = block::render(work, intervals, (bx as u32, by as u32), inside, batch, counters, observer);
            for y in top..bottom {
                let pixels = &mut tile.rows[y - y0][left - x0..right - x0];
                match outcome {
                    Outcome::Missed => pixels.fill(background),
                    Outcome::Empty => pixels.fill(untouched),
                    Outcome::Rendered => resolve.row(&batch.pixels, (y - by) * SIDE + (left - bx), pixels, left, y),
                }
            }
        }
    }
}

/// The lanes of a block in some of its columns and rows, one bit each.
fn lanes(columns: Range<usize>, rows: Range<usize>) -> u64 {
    let row = (1u64 << columns.end) - (1u64 << columns.start);
    rows.fold(0, |lanes, r| lanes | row << (SIDE * r))
}
