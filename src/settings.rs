//! How to run: threads, tiles, vector level, limits, progress. Nothing here may change a pixel.

use crate::lanes::Level;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What may be taken from the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most bytes the voxels of one volume may take.
    pub voxel_bytes: u64,
    /// Most bytes of a header.
    pub header_bytes: u64,
    /// Files of at least so many bytes of voxels are mapped into memory instead of read, where they hold the voxels as they are
    /// needed: not compressed, in this machine's byte order, in a type that is kept, x fastest, aligned. 0 maps all of them,
    /// `u64::MAX` none.
    ///
    /// A mapped file must not be cut short while the volume lives: the system then ends the process with SIGBUS (on Windows it
    /// refuses the cut). Have files read that others rewrite in place, or that lie on a network's disk that may go away.
    pub map_bytes: u64,
}

impl Default for Limits {
    /// 16 GiB of voxels, 1 MiB of header; files of 16 MiB of voxels and more are mapped.
    fn default() -> Self {
        Self { voxel_bytes: 16 << 30, header_bytes: 1 << 20, map_bytes: 16 << 20 }
    }
}

/// Hears how far a long task is, and may stop it. Called from any thread.
pub trait Progress: Send + Sync {
    /// `done` of `total` steps of the task `what` are over. Returning `false` stops the work with [`crate::Error::Stopped`].
    fn step(&self, what: &str, done: u64, total: u64) -> bool;
}

/// How a picture is made. No field changes a byte of it.
#[derive(Clone, Default)]
pub struct Settings {
    /// Worker threads; `None` takes one per core.
    pub threads: Option<usize>,
    /// Side of the square screen tiles that threads take in turn, in pixels; `None` lets the plan choose.
    pub tile: Option<u32>,
    /// Vector level; `None` takes the fastest this machine has.
    pub level: Option<Level>,
    /// Limits on memory.
    pub limits: Limits,
    /// Whether the error of a picture of a given slice count is estimated, from a second picture of twice as many slices.
    pub estimate: bool,
    /// Who hears about progress.
    pub progress: Option<Arc<dyn Progress>>,
}

impl std::fmt::Debug for Settings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Settings")
            .field("threads", &self.threads)
            .field("tile", &self.tile)
            .field("level", &self.level)
            .field("limits", &self.limits)
            .field("estimate", &self.estimate)
            .field("progress", &self.progress.is_some())
            .finish()
    }
}

/// Stops the picture in the making, from any thread: see [`crate::Renderer::stopper`].
#[derive(Debug, Clone, Default)]
pub struct Stopper(Arc<AtomicBool>);

impl Stopper {
    /// The picture in the making ends with [`crate::Error::Stopped`] before long; where none is, the next one does at once.
    pub fn stop(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Forgets that somebody wanted to stop.
    pub(crate) fn reset(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

/// Who hears of the work, and who may stop it.
#[derive(Clone, Copy)]
pub(crate) struct Control<'c> {
    pub(crate) progress: Option<&'c dyn Progress>,
    pub(crate) stopper: &'c Stopper,
}

impl Control<'_> {
    /// `done` of `total` steps of `what` are over; false where the work is to stop.
    pub(crate) fn step(&self, what: &str, done: u64, total: u64) -> bool {
        self.progress.is_none_or(|p| p.step(what, done, total)) && !self.is_stopped()
    }

    /// Whether somebody wants to stop.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stopper.0.load(Ordering::Relaxed)
    }
}
