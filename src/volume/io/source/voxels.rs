//! Voxels out of a [`Source`]: first their claimed size is checked, then the file is mapped, or memory taken once and the bytes read into
//! it, and at last what follows the voxels is checked.

use super::{CHUNK, Source};
use crate::lanes::Mapped;
use crate::settings::Limits;
use crate::volume::io::stored::TooLarge;
use crate::volume::io::{Endian, Stored};
use crate::volume::{Buffer, Voxel, VoxelType, Voxels};
use crate::{Error, Result};
use std::fs::File;
use std::ops::Range;
use std::path::Path;

/// Most bytes of zeros or line ends that may follow voxels that ought to end the file.
const PADDING: usize = 4096;

/// Most bytes of one voxel of several numbers.
const MOST_OF_A_VOXEL: u64 = 64 << 20;

/// What may follow the last voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::volume::io) enum Tail {
    /// Nothing at all: only the length tells whether a description fits.
    Exact,
    /// Nothing but padding (a few zeros or line ends).
    Nothing,
    /// Anything, if the file is not compressed: the format's own tools read what they need and ignore the rest.
    Ignored,
    /// The reader looks itself.
    Unchecked,
}

impl Source {
    /// Refuses `dims` voxels of `stored` that cannot be here, each taking at least `smallest` bytes of the file.
    /// Returns how many voxels there are.
    pub(in crate::volume::io) fn weigh(&self, dims: [usize; 3], stored: Stored, smallest: u64) -> Result<usize> {
        let count = self.claim(dims, stored, smallest, self.limits.voxel_bytes)?;
        with_memory(&self.path, count, dims, stored)
    }

    /// As [`Source::weigh`], for voxels that need no memory; `limit` is the most bytes that they may take.
    fn claim(&self, dims: [usize; 3], stored: Stored, smallest: u64, limit: u64) -> Result<usize> {
        let count = within_limit(&self.path, limit, dims, stored)?;
        let [x, y, z] = dims;
        let shown = format!("{x} x {y} x {z} voxels of {stored}");
        let needed = count as u128 * u128::from(smallest);
        if needed > u128::from(self.left) {
            return Err(self.fault(match self.packed {
                Some(packed) => {
                    format!("{shown} take {needed} bytes, but {packed} compressed bytes cannot hold more than {}", self.left)
                }
                None => format!("{shown} take {needed} bytes, the file holds {} after its header", self.left),
            }));
        }
        Ok(count)
    }

    /// `dims` voxels, x fastest: mapped where the file and the limits allow it, else read straight into their place.
    ///
    /// # Errors
    /// When they are over the limit, more than the file holds, damaged, or followed by what `tail` does not allow.
    pub(in crate::volume::io) fn voxels(&mut self, dims: [usize; 3], stored: Stored, endian: Endian, tail: Tail) -> Result<Voxels> {
        if let Some(voxels) = self.map(dims, stored, endian)? {
            self.skip(voxels.bytes() as u64)?;
            self.check_tail(voxels.bytes() as u64, tail)?;
            return Ok(voxels);
        }
        let count = self.weigh(dims, stored, stored.bytes() as u64)?;
        let voxels = match stored {
            Stored::Native(kind) => {
                let mut voxels = Voxels::zeros(kind, count);
                self.read_exact_into(voxels.as_bytes_mut(), 0, count as u64 * kind.bytes() as u64)?;
                if endian != Endian::NATIVE {
                    voxels.swap_bytes();
                }
                voxels
            }
            _ => self.converted(count, stored, endian)?,
        };
        self.check_tail(count as u64 * stored.bytes() as u64, tail)?;
        Ok(voxels)
    }

    /// The next voxels where they lie, if they are as they are needed and enough of them to pay.
    fn map(&self, dims: [usize; 3], stored: Stored, endian: Endian) -> Result<Option<Voxels>> {
        let (Stored::Native(kind), Some((file, first))) = (stored, self.plain()) else { return Ok(None) };
        if kind.bytes() > 1 && endian != Endian::NATIVE {
            return Ok(None);
        }
        let count = self.claim(dims, stored, kind.bytes() as u64, self.limits.mapped_bytes.max(self.limits.voxel_bytes))?;
        if ((count * kind.bytes()) as u64) < self.limits.map_bytes {
            return Ok(None);
        }
        let path = self.path();
        // A file system that cannot map can still be read.
        Ok(match kind {
            VoxelType::U8 => mapped::<u8>(path, file, first, count),
            VoxelType::I8 => mapped::<i8>(path, file, first, count),
            VoxelType::U16 => mapped::<u16>(path, file, first, count),
            VoxelType::I16 => mapped::<i16>(path, file, first, count),
            VoxelType::U32 => mapped::<u32>(path, file, first, count),
            VoxelType::I32 => mapped::<i32>(path, file, first, count),
            VoxelType::F32 => mapped::<f32>(path, file, first, count),
            VoxelType::F64 => mapped::<f64>(path, file, first, count),
        })
    }

    /// Numbers that are kept in another type; one that does not fit it is an error.
    fn converted(&mut self, count: usize, stored: Stored, endian: Endian) -> Result<Voxels> {
        let mut voxels = Voxels::zeros(stored.voxel_type(), count);
        let size = stored.bytes();
        let mut chunk = [0u8; 16 * 1024];
        let whole = chunk.len() / size;
        let total = count as u64 * size as u64;
        for first in (0..count).step_by(whole) {
            let bytes = &mut chunk[..(count - first).min(whole) * size];
            self.read_exact_into(bytes, (first * size) as u64, total)?;
            stored.put(endian, bytes, &mut voxels, first).map_err(|e| too_large(&self.path, stored, first, e))?;
        }
        Ok(voxels)
    }

    /// The numbers of `dims` voxels of `components` each, one voxel after the other: those in `keep`, the others are passed over. Where they are
    /// `colors` and only three, an alpha of 1 is put behind them.
    ///
    /// # Errors
    /// As [`Source::voxels`].
    pub(in crate::volume::io) fn interleaved(
        &mut self,
        dims: [usize; 3],
        stored: Stored,
        endian: Endian,
        (components, keep, colors): (usize, Range<usize>, bool),
        tail: Tail,
    ) -> Result<Voxels> {
        let size = stored.bytes();
        let each = components.saturating_mul(size);
        let opaque = if colors && keep.len() == 3 { opaque(stored, endian) } else { Vec::new() };
        let kept = keep.len() + usize::from(!opaque.is_empty());
        let count = self.weigh([dims[0].saturating_mul(kept), dims[1], dims[2]], stored, 0)? / kept;
        let needed = count as u128 * each as u128;
        if needed > u128::from(self.left) {
            let [x, y, z] = dims;
            let what = format!(
                "{x} x {y} x {z} voxels of {components} {stored} take {needed} bytes, the file holds {} after its header",
                self.left
            );
            return Err(self.fault(what));
        }
        // A voxel of all its numbers is in memory at a time.
        if each as u64 > self.limits.voxel_bytes.min(MOST_OF_A_VOXEL) {
            return Err(self.fault(format!("{components} numbers of {stored} a voxel: at most {MOST_OF_A_VOXEL} bytes a voxel are read")));
        }
        let mut voxels = Voxels::zeros(stored.voxel_type(), count * kept);
        let total = count as u64 * each as u64;
        let whole = (CHUNK / each).max(1);
        let mut chunk = vec![0u8; whole * each];
        let mut picked = Vec::with_capacity(whole * kept * size);
        for first in (0..count).step_by(whole) {
            let bytes = &mut chunk[..(count - first).min(whole) * each];
            self.read_exact_into(bytes, first as u64 * each as u64, total)?;
            picked.clear();
            for voxel in bytes.chunks_exact(each) {
                picked.extend_from_slice(&voxel[keep.start * size..keep.end * size]);
                picked.extend_from_slice(&opaque);
            }
            stored.put(endian, &picked, &mut voxels, first * kept).map_err(|e| too_large(&self.path, stored, first * kept, e))?;
        }
        self.check_tail(total, tail)?;
        Ok(voxels)
    }

    /// Fills `out`; `before` of the `total` bytes of voxels came earlier.
    pub(in crate::volume::io) fn read_exact_into(&mut self, out: &mut [u8], before: u64, total: u64) -> Result<()> {
        let buffered = out.len().min(self.buffer.len() - self.start);
        out[..buffered].copy_from_slice(&self.buffer[self.start..self.start + buffered]);
        self.consume(buffered);
        let mut done = buffered;
        while done < out.len() {
            let fault = match self.read_inner(&mut out[done..]) {
                Ok(0) => None,
                Ok(n) => {
                    done += n;
                    self.left = self.left.saturating_sub(n as u64);
                    continue;
                }
                Err(e) if self.is_packed() => Some(e),
                Err(e) => return Err(Error::io(&self.path, e)),
            };
            let got = before + done as u64;
            return Err(self.fault(match fault {
                Some(e) => format!("the compressed voxels are damaged or cut short after {got} of {total} bytes: {e}"),
                None => format!("the voxels should take {total} bytes, only {got} are there"),
            }));
        }
        Ok(())
    }

    /// Looks at what follows `total` bytes of voxels. In a compressed stream this also has the checksum verified.
    pub(in crate::volume::io) fn check_tail(&mut self, total: u64, tail: Tail) -> Result<()> {
        if tail == Tail::Unchecked || (tail == Tail::Ignored && !self.is_packed()) {
            return Ok(());
        }
        let padding = if tail == Tail::Exact { 0 } else { PADDING };
        let rest = self.peek(padding + 1)?;
        let blank = |b: &u8| matches!(b, 0 | b'\n' | b'\r');
        if rest.len() <= padding && rest.iter().all(blank) {
            return Ok(());
        }
        let held = if self.is_packed() || self.is_pipe() {
            // Only a part is inflated: a small file may have been made to inflate to gigabytes.
            let more = self.peek(1 << 20)?.len() as u64;
            let least = if more >= 1 << 20 { "at least " } else { "" };
            format!("{least}{}", total.saturating_add(more))
        } else {
            total.saturating_add(self.left).to_string()
        };
        Err(self.fault(format!("the voxels should take {total} bytes, there are {held}: wrong dimensions or type?")))
    }
}

/// The number that stands for an alpha of 1, as a file stores it: u8, u16 or f32.
fn opaque(stored: Stored, endian: Endian) -> Vec<u8> {
    match (stored, endian) {
        (Stored::Native(VoxelType::F32), Endian::Big) => 1f32.to_be_bytes().to_vec(),
        (Stored::Native(VoxelType::F32), Endian::Little) => 1f32.to_le_bytes().to_vec(),
        _ => vec![0xff; stored.bytes()],
    }
}

/// How many voxels `dims` of `stored` are, where the limit allows what they take in memory.
fn within_limit(path: &Path, limit: u64, dims: [usize; 3], stored: Stored) -> Result<usize> {
    // Three factors of at most 2^64 do not fit in u128 either: saturate, any limit is far below.
    let count = dims.iter().fold(1u128, |a, &n| a.saturating_mul(n as u128));
    let memory = count.saturating_mul(stored.voxel_type().bytes() as u128);
    let limit = u128::from(limit);
    if memory > limit || usize::try_from(memory).is_err() {
        let [x, y, z] = dims;
        let what = format!("{}: bytes of {x} x {y} x {z} voxels of {stored}", path.display());
        return Err(Error::Limit { what, needed: memory, limit });
    }
    Ok(count as usize)
}

/// `count`, where the machine has the memory for so many voxels; else an error, where the allocator would end the process.
fn with_memory(path: &Path, count: usize, [x, y, z]: [usize; 3], stored: Stored) -> Result<usize> {
    let memory = count * stored.voxel_type().bytes();
    let mut probe: Vec<u8> = Vec::new();
    if crate::memory::reserve(&mut probe, memory).is_err() {
        let what = format!("{x} x {y} x {z} voxels of {stored} take {memory} bytes: this machine does not give that much memory");
        return Err(Error::format(path, what));
    }
    Ok(count)
}

/// Zeros for `dims` voxels of `stored`, whose bytes come from several places (`path` and others): checked against the limits, and against the
/// `most` bytes that those places can give at all.
///
/// # Errors
/// [`Error::Limit`] when they would take too much memory, [`Error::Format`] when there are not so many bytes.
pub(in crate::volume::io) fn room(path: &Path, limits: &Limits, dims: [usize; 3], stored: Stored, most: u64) -> Result<Voxels> {
    let count = within_limit(path, limits.voxel_bytes, dims, stored)?;
    let needed = count as u128 * stored.bytes() as u128;
    if needed > u128::from(most) {
        let [x, y, z] = dims;
        return Err(Error::format(
            path,
            format!("{x} x {y} x {z} voxels of {stored} take {needed} bytes, there cannot be more than {most}"),
        ));
    }
    Ok(Voxels::zeros(stored.voxel_type(), with_memory(path, count, dims, stored)?))
}

/// What is said of a number that does not fit; `first` came before those that were put.
pub(in crate::volume::io) fn too_large(path: &Path, stored: Stored, first: usize, TooLarge { index, value }: TooLarge) -> Error {
    Error::format(path, format!("voxel {} is {value} ({stored}): it does not fit {}", first + index, stored.voxel_type()))
}

/// `count` voxels from byte `first` of `file` on, whose name is `path`, where it can be mapped so.
fn mapped<T: Voxel>(path: &Path, file: &File, first: u64, count: usize) -> Option<Voxels> {
    Mapped::<T>::new(path, file, first, count).ok().flatten().map(|mapped| T::wrap(Buffer::mapped(mapped)))
}

/// Voxels that arrive in another order than they are kept: `dims` of `kind`, z fastest in the file.
pub(in crate::volume::io) fn scatter_z_fastest(source: &mut Source, dims: [usize; 3], kind: VoxelType, endian: Endian) -> Result<Voxels> {
    let count = source.weigh(dims, Stored::Native(kind), kind.bytes() as u64)?;
    let [nx, ny, nz] = dims;
    let size = kind.bytes();
    let total = count as u64 * size as u64;
    let mut voxels = Voxels::zeros(kind, count);
    let bytes = voxels.as_bytes_mut();
    let mut column = vec![0u8; nz * size];
    let mut before = 0;
    for x in 0..nx {
        for y in 0..ny {
            source.read_exact_into(&mut column, before, total)?;
            before += column.len() as u64;
            for (z, value) in column.chunks_exact(size).enumerate() {
                let at = ((z * ny + y) * nx + x) * size;
                bytes[at..at + size].copy_from_slice(value);
            }
        }
    }
    if endian != Endian::NATIVE {
        voxels.swap_bytes();
    }
    Ok(voxels)
}
