//! Bricks that are in memory: the latest used, as many as a limit allows.

use crate::Result;
use crate::volume::levels::{Levels, copy_brick, for_bricks};
use crate::volume::{Volume, Voxel, Voxels, with_voxels};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A level, and a brick's place in it.
type Key = (usize, [usize; 3]);

/// Least and greatest finite stored value; least above greatest where none is finite.
pub(super) type Range = (f32, f32);

/// The range of no values.
const NONE: Range = (f32::INFINITY, f32::NEG_INFINITY);

/// A brick in memory.
struct Brick {
    bytes: Vec<u8>,
    range: Range,
}

/// A brick's place in memory: empty until it is read. Whoever needs it first reads it; others wait.
type Slot = Arc<Mutex<Option<Arc<Brick>>>>;

struct Entry {
    slot: Slot,
    /// When it was used last.
    used: u64,
    bytes: u64,
}

#[derive(Default)]
struct State {
    bricks: BTreeMap<Key, Entry>,
    /// What was used when.
    order: BTreeMap<u64, Key>,
    now: u64,
    bytes: u64,
    peak: u64,
    /// Memory of bricks that made room, for the next ones: what one thread frees another could not have.
    free: Vec<Vec<u8>>,
}

/// Most pieces of memory that wait for a brick.
const FREE: usize = 8;

/// The bricks of a volume's levels, read when they are needed.
pub(super) struct Pages<'l> {
    levels: &'l Levels,
    /// Most bytes of bricks that are kept.
    limit: u64,
    state: Mutex<State>,
    asked: AtomicU64,
    read: AtomicU64,
    bytes_read: AtomicU64,
}

/// What became of the bricks of a picture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub(super) asked: u64,
    pub(super) read: u64,
    pub(super) bytes_read: u64,
    pub(super) peak: u64,
}

impl<'l> Pages<'l> {
    pub(super) fn new(levels: &'l Levels, limit: u64) -> Self {
        let zero = AtomicU64::default;
        Self { levels, limit, state: Mutex::default(), asked: zero(), read: zero(), bytes_read: zero() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // What a thread that panicked has left is as good as before.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn counts(&self) -> Counts {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Counts { asked: of(&self.asked), read: of(&self.read), bytes_read: of(&self.bytes_read), peak: self.state().peak }
    }

    /// Bytes of the largest brick of any level, and what reading it takes besides.
    pub(super) fn largest(levels: &Levels) -> u64 {
        let each = levels.voxel_type().bytes() as u64;
        let of = |level: &crate::volume::levels::Level| {
            level.sides().iter().map(|&n| n as u64).product::<u64>() * each + level.bricks().besides()
        };
        levels.levels().iter().map(of).max().unwrap_or(0)
    }

    /// The range of a brick's values, where it is known without reading it.
    fn known(&self, key: Key) -> Option<Range> {
        if let Some(range) = self.levels.levels()[key.0].bricks().range(key.1) {
            return Some(range);
        }
        let slot = Arc::clone(&self.state().bricks.get(&key)?.slot);
        slot.try_lock().ok()?.as_ref().map(|brick| brick.range)
    }

    /// Brick `key`.
    fn brick(&self, key: Key) -> Result<Arc<Brick>> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let slot = self.slot(key);
        let mut place = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(brick) = &*place {
            return Ok(Arc::clone(brick));
        }
        let (bytes, read) = self.levels.levels()[key.0].bricks().read(key.1)?;
        self.read.fetch_add(1, Ordering::Relaxed);
        self.bytes_read.fetch_add(read, Ordering::Relaxed);
        let range = range_of(&bytes, self.levels);
        let free = self.state().free.pop().filter(|free| free.capacity() >= bytes.len());
        let bytes = match free {
            Some(mut free) => {
                free.clear();
                free.extend_from_slice(&bytes);
                free
            }
            None => bytes,
        };
        let brick = Arc::new(Brick { bytes, range });
        *place = Some(Arc::clone(&brick));
        Ok(brick)
    }

    /// The place of brick `key`; those used least lately make room for it.
    fn slot(&self, key: Key) -> Slot {
        let level = &self.levels.levels()[key.0];
        let bytes = (level.brick(key.1).1.iter().product::<usize>() * self.levels.voxel_type().bytes()) as u64;
        let mut state = self.state();
        let state = &mut *state;
        state.now += 1;
        let now = state.now;
        if let Some(entry) = state.bricks.get_mut(&key) {
            state.order.remove(&entry.used);
            entry.used = now;
            state.order.insert(now, key);
            return Arc::clone(&entry.slot);
        }
        let slot = Slot::default();
        if bytes > self.limit {
            return slot;
        }
        while state.bytes + bytes > self.limit {
            let Some((_, oldest)) = state.order.pop_first() else { break };
            let Some(entry) = state.bricks.remove(&oldest) else { continue };
            state.bytes -= entry.bytes;
            // One that is in use goes with its last user.
            let held = Arc::into_inner(entry.slot).and_then(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner));
            if let Some(brick) = held.and_then(Arc::into_inner).filter(|_| state.free.len() < FREE) {
                state.free.push(brick.bytes);
            }
        }
        state.bytes += bytes;
        state.peak = state.peak.max(state.bytes);
        state.order.insert(now, key);
        state.bricks.insert(key, Entry { slot: Arc::clone(&slot), used: now, bytes });
        slot
    }

    /// The voxels of `size` from `first` on of a level; `None` where `shows` says of the range of the values of all bricks touched that
    /// nothing in it shows: then they are read only as far as that takes.
    pub(super) fn part(
        &self,
        level: usize,
        (first, size): ([usize; 3], [usize; 3]),
        shows: &dyn Fn(Range) -> bool,
    ) -> Result<Option<Volume>> {
        let from = &self.levels.levels()[level];
        let mut known = Some(NONE);
        for_bricks(from, first, size, |at| {
            known = known.and_then(|range| Some(join(range, self.known((level, at))?)));
            Ok(())
        })?;
        if known.is_some_and(|range| !shows(range)) {
            return Ok(None);
        }
        let kind = self.levels.voxel_type();
        let mut voxels = Voxels::zeros(kind, size.iter().product());
        let mut range = NONE;
        let out = voxels.as_bytes_mut();
        for_bricks(from, first, size, |at| {
            let brick = self.brick((level, at))?;
            range = join(range, brick.range);
            copy_brick(from, at, &brick.bytes, (first, size), out, kind.bytes());
            Ok(())
        })?;
        if !shows(range) {
            return Ok(None);
        }
        self.levels.volume(level, first, size, voxels).map(Some)
    }
}

fn join(a: Range, b: Range) -> Range {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The range of the numbers in `bytes`, which are voxels of `levels`.
fn range_of(bytes: &[u8], levels: &Levels) -> Range {
    with_voxels!(Voxels::zeros(levels.voxel_type(), 0), like => extremes(&like, bytes))
}

fn extremes<T: Voxel>(_: &crate::volume::Buffer<T>, bytes: &[u8]) -> Range {
    let each = size_of::<T>();
    // Bytes of a vector need not lie aligned for the type.
    let numbers = bytes.chunks_exact(each).map(bytemuck::pod_read_unaligned::<T>).filter(|v| v.is_finite());
    let mut found: Option<(T, T)> = None;
    for v in numbers {
        found = Some(match found {
            None => (v, v),
            Some((low, high)) => (if v < low { v } else { low }, if v > high { v } else { high }),
        });
    }
    found.map_or(NONE, |(low, high)| (crate::volume::bricks::below(low.to_f64()), crate::volume::bricks::above(high.to_f64())))
}
