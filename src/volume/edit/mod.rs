//! Volumes made out of volumes: a part of one, other voxels for the same box, voxels of another type.
//!
//! ```
//! use slicestack::Limits;
//! use slicestack::volume::edit::{Sampling, convert_type, crop, resample};
//! use slicestack::volume::VoxelType;
//! use slicestack::volume::phantom::Phantom;
//!
//! let volume = Phantom::SheppLogan.volume(16)?;
//! let half = crop(&volume, [0..16, 0..16, 0..8], None)?;
//! let small = resample(&half, Sampling::Spacing([2.0; 3]), &Limits::default(), None)?;
//! assert_eq!(small.grid().dims(), [8, 8, 4]);
//! let bytes = convert_type(&small, VoxelType::U8, Some((0.0, 1.0)), &Limits::default(), None)?;
//! assert_eq!((bytes.volume.voxels().voxel_type(), bytes.clipped), (VoxelType::U8, 0));
//! # Ok::<(), slicestack::Error>(())
//! ```

mod crop;
mod part;
mod resample;
mod retype;
mod taps;

pub use crop::crop;
pub use part::CropBox;
pub use resample::{Sampling, resample};
pub use retype::{Retyped, convert_type};

use super::{Channels, Grid, Volume, Voxel, Voxels, check_count};
use crate::settings::{Limits, Progress};
use crate::{Error, Result};
use std::sync::atomic::{AtomicU64, Ordering};

impl Volume {
    /// The voxels' numbers as stored, whatever they mean, x fastest: of colours red, green, blue and alpha of one voxel after the other.
    pub fn numbers(&self) -> &Voxels {
        self.colors.as_ref().unwrap_or(&self.voxels)
    }

    /// A volume with `numbers` on `grid`, in all else like this one.
    fn with_numbers(&self, grid: Grid, numbers: Voxels) -> Result<Self> {
        check_count(&grid, numbers.len(), self.channels.count())?;
        let (voxels, colors) = match self.channels {
            Channels::Rgba | Channels::Rgb => (Voxels::zeros(numbers.voxel_type(), 0), Some(numbers)),
            Channels::Scalar | Channels::Label(_) => (numbers, None),
        };
        let kept = self.clone();
        Ok(Self {
            grid,
            voxels,
            colors,
            labels: None,
            statistics: Default::default(),
            bricks: Default::default(),
            color_bricks: Default::default(),
            ..kept
        })
    }
}

/// Room for `count` numbers of type `T`, filled with zeros, for what messages call `what`.
///
/// # Errors
/// [`Error::Limit`] where `limits` forbid it, [`Error::Invalid`] where the machine does not have the memory.
fn room<T: Voxel>(count: usize, limits: &Limits, what: &str) -> Result<Vec<T>> {
    let needed = count as u128 * size_of::<T>() as u128;
    if needed > u128::from(limits.voxel_bytes) {
        return Err(Error::Limit { what: format!("bytes of {what}"), needed, limit: limits.voxel_bytes.into() });
    }
    // The system's own zeros: the pages come when they are written to.
    let zeros = bytemuck::try_zeroed_vec(count);
    zeros.map_err(|()| Error::invalid(format!("{what}: this machine does not give {needed} bytes of memory")))
}

/// Runs an expression with a name bound to the type of a [`VoxelType`].
macro_rules! with_type {
    ($kind:expr, $t:ident => $body:expr) => {
        match $kind {
            $crate::volume::VoxelType::U8 => with_type!(@ $t, u8, $body),
            $crate::volume::VoxelType::I8 => with_type!(@ $t, i8, $body),
            $crate::volume::VoxelType::U16 => with_type!(@ $t, u16, $body),
            $crate::volume::VoxelType::I16 => with_type!(@ $t, i16, $body),
            $crate::volume::VoxelType::U32 => with_type!(@ $t, u32, $body),
            $crate::volume::VoxelType::I32 => with_type!(@ $t, i32, $body),
            $crate::volume::VoxelType::F32 => with_type!(@ $t, f32, $body),
            $crate::volume::VoxelType::F64 => with_type!(@ $t, f64, $body),
        }
    };
    (@ $t:ident, $type:ty, $body:expr) => {{
        type $t = $type;
        $body
    }};
}
use with_type;

/// Counts the steps of a piece of work that several threads share.
struct Steps<'p> {
    progress: Option<&'p dyn Progress>,
    what: &'static str,
    done: AtomicU64,
    total: u64,
}

impl<'p> Steps<'p> {
    fn new(progress: Option<&'p dyn Progress>, what: &'static str, total: usize) -> Self {
        Self { progress, what, done: AtomicU64::new(0), total: total as u64 }
    }

    /// One step more is over.
    ///
    /// # Errors
    /// [`Error::Stopped`] when the work is to stop.
    fn next(&self) -> Result<()> {
        let Some(progress) = self.progress else { return Ok(()) };
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if progress.step(self.what, done, self.total) { Ok(()) } else { Err(Error::Stopped) }
    }
}
