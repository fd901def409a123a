//! Regions of the picture through pieces of the volume: what one thread does at a time.
//!
//! A region begins with all of its slices. Of those that come next, as many are taken as have a level in common and touch a box of voxels of
//! bounded size; where not even a few do, the region is cut in four. The box is put together from bricks, becomes a small volume of its own, and
//! the region's blocks go on through those slices. How regions and slices are cut depends on scene and volume alone: not on memory, not on
//! threads.

use super::pages::Pages;
use super::sight::{Sight, VoxelBox, Window};
use super::tables::{PieceTables, Tables};
use crate::fragment::Batch;
use crate::lanes::{Level as Vectors, SIDE};
use crate::plan::{Detail, FramePlan, Subject, VolumeData};
use crate::raster::{Finish, Gathered, RayIntervals, Resolve, Work, covered, resume};
use crate::scene::{Order, Scene};
use crate::settings::Control;
use crate::tally::Counters;
use crate::volume::levels::Levels;
use crate::volume::{Volume, Voxels};
use crate::{Error, Result};
use std::ops::Range;

/// Most voxels of a piece.
pub(super) const PIECE: usize = 1 << 21;
/// Slices that a piece should hold at least: with fewer, its region is cut.
const FEW: i64 = 16;

/// What pieces cost, besides what batches count.
#[derive(Debug, Clone, Default)]
pub(super) struct PieceCounts {
    /// Pieces rendered, by level.
    pub(super) pieces: Vec<u64>,
    /// Pieces in which nothing shows.
    pub(super) empty: u64,
}

impl PieceCounts {
    pub(super) fn add(&mut self, other: &Self) {
        self.pieces.resize(self.pieces.len().max(other.pieces.len()), 0);
        self.pieces.iter_mut().zip(&other.pieces).for_each(|(sum, n)| *sum += n);
        self.empty += other.empty;
    }

    fn at(&mut self, level: usize) {
        self.pieces.resize(self.pieces.len().max(level + 1), 0);
        self.pieces[level] += 1;
    }
}

/// What a thread has of its own.
pub(super) struct Worker {
    batch: Box<Batch>,
    pub(super) counters: Counters,
    pub(super) counts: PieceCounts,
}

impl Worker {
    pub(super) fn new(work: &Work<'_, '_>) -> Self {
        Self { batch: work.batch(), counters: Counters::default(), counts: PieceCounts::default() }
    }

    /// What it has counted.
    pub(super) fn end(mut self) -> (Counters, PieceCounts) {
        self.counters.gradients = self.batch.gradient.map_or(0, |g| g.taken);
        (self.counters, self.counts)
    }
}

/// One way to render the scene: so many slices, of such levels.
pub(super) struct Frame<'f> {
    pub(super) scene: &'f Scene,
    pub(super) levels: &'f Levels,
    pub(super) pages: &'f Pages<'f>,
    pub(super) tables: &'f Tables,
    pub(super) sight: Sight,
    /// The level of each run of slices.
    pub(super) runs: Vec<(Range<i64>, usize)>,
    pub(super) terminate: f32,
    pub(super) detail: Detail,
    pub(super) vectors: Vectors,
    /// Least and greatest stored value that tables are made for.
    pub(super) range: (f64, f64),
    /// Most voxels of a piece that cannot be cut any further.
    pub(super) most: usize,
    pub(super) control: Control<'f>,
}

/// A small volume, and what depends on it.
pub(super) struct Piece {
    volume: Volume,
    data: VolumeData,
}

/// A block on its way.
struct Block {
    first: (u32, u32),
    /// Lanes that belong to the picture.
    inside: u64,
    /// Slices that cover it.
    slices: Range<i64>,
    gathered: Gathered,
}

/// What pieces of a frame have in common.
pub(super) struct Common<'c, 'v, F> {
    pub(super) work: &'c Work<'c, 'v>,
    pub(super) intervals: &'c RayIntervals<'c>,
    pub(super) resolve: &'c Resolve<'c>,
    pub(super) finish: &'c F,
    /// Slices before its own, and behind, that a slice looks values up at.
    pub(super) around: (i64, i64),
    /// Whether what shows nothing may be passed over.
    pub(super) skips: bool,
    /// What may show, by the tables of the frame.
    pub(super) shows: &'c (dyn Fn(f64, f64) -> bool + Sync),
}

impl<'f> Frame<'f> {
    /// A piece without anything in it, to plan with.
    pub(super) fn blank(&self) -> Result<Piece> {
        let size = self.levels.grid().dims().map(|n| n.min(2));
        let voxels = Voxels::zeros(self.levels.voxel_type(), size.iter().product());
        Ok(self.piece(self.levels.volume(0, [0; 3], size, voxels)?))
    }

    fn piece(&self, volume: Volume) -> Piece {
        let data = VolumeData::of_piece(&volume, self.range);
        Piece { volume, data }
    }

    /// The plan for `piece`, whose slices are those of `stack`.
    pub(super) fn plan<'p>(&self, piece: &'p Piece, level: usize, held: VoxelBox) -> FramePlan<'p> {
        let subject = Subject {
            scene: self.scene,
            volume: &piece.volume,
            data: &piece.data,
            stack: self.sight.stack_of(level, held),
            terminate: self.terminate,
            detail: self.detail,
            level: self.vectors,
            observed: false,
            domain: None,
        };
        FramePlan::new(subject, &mut PieceTables { tables: self.tables, volume: &piece.volume, data: &piece.data })
    }

    /// Renders the blocks in columns and rows `columns`, `rows` of blocks: their pixels, row by row.
    pub(super) fn render<F: Finish>(
        &self,
        common: &Common<'_, '_, F>,
        (columns, rows): (Range<u32>, Range<u32>),
        worker: &mut Worker,
    ) -> Result<Vec<[f32; 4]>> {
        let (width, height) = (self.sight.stack.view.width, self.sight.stack.view.height);
        let side = SIDE as u32;
        let mut blocks = Vec::new();
        for by in rows.clone() {
            for bx in columns.clone() {
                let first = (bx * side, by * side);
                let (right, down) = ((width - first.0).min(side), (height - first.1).min(side));
                let row = (1u64 << right) - 1;
                let inside = (0..down).fold(0, |lanes, r| lanes | row << (side * r));
                let slices = covered(common.intervals, first, inside, &mut worker.batch, &mut worker.counters);
                blocks.push(Block { first, inside, slices, gathered: Gathered::nothing(common.work.start_values()) });
            }
        }
        let all = 0..self.sight.stack.count as i64;
        self.region(common, &mut blocks, all, worker)?;
        let columns_of_pixels = ((columns.end * side).min(width) - columns.start * side) as usize;
        let rows_of_pixels = ((rows.end * side).min(height) - rows.start * side) as usize;
        let mut pixels = vec![common.finish.nothing(); columns_of_pixels * rows_of_pixels];
        for block in &blocks {
            if block.slices.is_empty() {
                continue;
            }
            block.gathered.put(&mut worker.batch.pixels);
            let (x, y) = ((block.first.0 - columns.start * side) as usize, (block.first.1 - rows.start * side) as usize);
            let wide = (columns_of_pixels - x).min(SIDE);
            for row in 0..(rows_of_pixels - y).min(SIDE) {
                let out = &mut pixels[(y + row) * columns_of_pixels + x..][..wide];
                let place = (block.first.0 as usize, block.first.1 as usize + row);
                common.resolve.row(common.finish, &worker.batch.pixels, row * SIDE, out, place.0, place.1);
            }
        }
        Ok(pixels)
    }

    /// Takes `blocks` through the slices `left`.
    fn region<F: Finish>(&self, common: &Common<'_, '_, F>, blocks: &mut [Block], mut left: Range<i64>, worker: &mut Worker) -> Result<()> {
        let ahead = common.work.order() == Order::FrontToBack;
        loop {
            if self.control.is_stopped() {
                return Err(Error::Stopped);
            }
            let live = |block: &&mut Block| !block.gathered.is_finished() && !meet(&block.slices, &left).is_empty();
            let mut live: Vec<&mut Block> = blocks.iter_mut().filter(live).collect();
            let Some(covered) = live.iter().map(|block| meet(&block.slices, &left)).reduce(|a, b| a.start.min(b.start)..a.end.max(b.end))
            else {
                return Ok(());
            };
            // The run of slices that come next.
            let next = if ahead { covered.start } else { covered.end - 1 };
            let Some((run, level)) = self.runs.iter().find(|(run, _)| run.contains(&next)) else { return Ok(()) };
            let (run, level) = (meet(run, &covered), *level);
            let window = window_of(&live);
            let taken = |count: i64| if ahead { run.start..run.start + count } else { run.end - count..run.end };
            let held = |count: i64| self.sight.voxels(level, window, self.depths(&taken(count), common.around));
            let fits = |count: i64| held(count).1.iter().product::<usize>() <= PIECE;
            let length = run.end - run.start;
            let mut count = largest(length, fits);
            if count < FEW.min(length) && live.len() > 1 {
                drop(live);
                return self.cut(common, blocks, left, worker);
            }
            if count == 0 {
                count = 1;
                let needed = held(1).1.iter().product::<usize>();
                if needed > self.most {
                    let what = "--memory: voxels behind 8 x 8 pixels, which one thread needs at a time (a larger picture needs fewer)";
                    return Err(Error::Limit { what: what.into(), needed: needed as u128, limit: self.most as u128 });
                }
            }
            let slices = taken(count);
            self.go_on(common, &mut live, (level, held(count)), slices.clone(), worker)?;
            if ahead { left.start = slices.end } else { left.end = slices.start }
        }
    }

    /// Takes `blocks` through `left` in up to four parts of the region.
    fn cut<F: Finish>(&self, common: &Common<'_, '_, F>, blocks: &mut [Block], left: Range<i64>, worker: &mut Worker) -> Result<()> {
        let ends = |of: fn(&Block) -> u32| {
            let (low, high) = blocks.iter().map(of).fold((u32::MAX, 0), |(low, high), n| (low.min(n), high.max(n)));
            // Blocks from here on are in the second half.
            low + ((high - low) / SIDE as u32 + 1).div_ceil(2) * SIDE as u32
        };
        let (x, y) = (ends(|block| block.first.0), ends(|block| block.first.1));
        let part = |block: &Block| (block.first.1 >= y, block.first.0 >= x);
        blocks.sort_by_key(part);
        for blocks in blocks.chunk_by_mut(|a, b| part(a) == part(b)) {
            self.region(common, blocks, left.clone(), worker)?;
        }
        Ok(())
    }

    /// Takes `blocks` through `slices` of `level`, which touch the voxels of `held`.
    fn go_on<F: Finish>(
        &self,
        common: &Common<'_, '_, F>,
        blocks: &mut [&mut Block],
        (level, held): (usize, VoxelBox),
        slices: Range<i64>,
        worker: &mut Worker,
    ) -> Result<()> {
        let shows = |(low, high): (f32, f32)| !common.skips || low <= high && (common.shows)(f64::from(low), f64::from(high));
        let Some(volume) = self.pages.part(level, held, &shows)? else {
            worker.counts.empty += 1;
            return Ok(());
        };
        worker.counts.at(level);
        let piece = self.piece(volume);
        let plan = self.plan(&piece, level, held);
        if plan.skip_table.as_ref().is_some_and(|table| !table.any) {
            return Ok(());
        }
        let work = Work::new(&plan);
        for block in blocks {
            if self.control.is_stopped() {
                return Err(Error::Stopped);
            }
            let slices = meet(&block.slices, &slices);
            if !slices.is_empty() {
                resume(
                    &work,
                    common.intervals,
                    block.first,
                    block.inside,
                    slices,
                    &mut block.gathered,
                    (&mut worker.batch, &mut worker.counters),
                );
            }
        }
        Ok(())
    }

    /// Least and greatest depth at which `slices` look values up.
    fn depths(&self, slices: &Range<i64>, (before, behind): (i64, i64)) -> (f64, f64) {
        let stack = &self.sight.stack;
        // Wherever in its slab a value is taken.
        let near = stack.near + (slices.start - before) as f64 * stack.spacing;
        let far = stack.near + (slices.end + behind) as f64 * stack.spacing;
        (near.max(stack.near), far.min(stack.far))
    }
}

/// What two ranges have in common.
fn meet(a: &Range<i64>, b: &Range<i64>) -> Range<i64> {
    let start = a.start.max(b.start);
    start..a.end.min(b.end).max(start)
}

/// The part of the window in which the pixels' centres of `blocks` lie.
fn window_of(blocks: &[&mut Block]) -> Window {
    let ends = |of: fn(&Block) -> u32| {
        let (low, high) = blocks.iter().map(|block| of(block)).fold((u32::MAX, 0), |(low, high), n| (low.min(n), high.max(n)));
        (f64::from(low) + 0.5, f64::from(high) + SIDE as f64 - 0.5)
    };
    [ends(|block| block.first.0), ends(|block| block.first.1)]
}

/// The largest number up to `most` that `fits`, of which a smaller one fits wherever a larger does; 0 where none does.
fn largest(most: i64, fits: impl Fn(i64) -> bool) -> i64 {
    if fits(most) {
        return most;
    }
    let (mut low, mut high) = (0, most);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}

/// Slices before its own, and behind, that the slices of a plan look values up at.
pub(super) fn around(plan: &FramePlan<'_>) -> (i64, i64) {
    match &plan.stages.pairs {
        // Entries and exits of rays lie up to a slab beyond their slices.
        Some(pairs) => (pairs.lookback, 1),
        None => (0, 0),
    }
}
