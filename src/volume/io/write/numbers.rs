//! The numbers of a file: voxels as they are stored, or the values that they stand for, sent out piece by piece.

use super::WriteFormat;
use crate::settings::Progress;
use crate::volume::{Volume, Voxel, VoxelType, Voxels, with_voxels};
use crate::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Numbers that go out at a time: so few that stopping takes no time, so many that telling takes none.
const PIECE: usize = 1 << 15;

/// Whole numbers up to here are exact in f64.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Who is told how far the writing has come, and which file errors name.
#[derive(Clone, Copy)]
pub(super) struct Tell<'t> {
    pub(super) progress: Option<&'t dyn Progress>,
    pub(super) name: &'t Path,
}

/// The numbers that a file gets.
pub(super) struct Numbers<'v> {
    voxels: &'v Voxels,
    /// The type that values are turned into by slope and intercept; `None` for voxels as they are stored.
    values: Option<(VoxelType, f64, f64)>,
}

impl<'v> Numbers<'v> {
    /// The voxels as they are stored; of colours their components.
    pub(super) fn as_stored(volume: &'v Volume) -> Self {
        Self { voxels: volume.colors.as_ref().unwrap_or(&volume.voxels), values: None }
    }

    /// What the voxels stand for, for a `format` that keeps no slope and intercept. Where these change something, `notes` says how.
    pub(super) fn as_values(volume: &'v Volume, format: WriteFormat, notes: &mut Vec<String>) -> Self {
        let (slope, intercept) = volume.rescale();
        let stored = Self::as_stored(volume);
        if (slope, intercept) == (1.0, 0.0) {
            return stored;
        }
        let kind = kind_of_values(volume);
        let why = match format {
            WriteFormat::Nifti => "keeps slope and intercept in f32, which cannot hold these",
            WriteFormat::MetaImage => "has a slope and an intercept that few programs heed",
            _ => "keeps no slope and intercept",
        };
        notes.push(format!(
            "{format} {why}: the voxels of {} were written as the values that they stand for, {slope} x stored + {intercept}, in {kind}",
            stored.kind()
        ));
        Self { values: Some((kind, slope, intercept)), ..stored }
    }

    /// Their type in the file.
    pub(super) fn kind(&self) -> VoxelType {
        self.values.map_or(self.voxels.voxel_type(), |(kind, ..)| kind)
    }

    /// Whether they are the voxels as they are stored.
    pub(super) fn is_stored(&self) -> bool {
        self.values.is_none()
    }

    /// Sends all of them to `out`, little-endian.
    pub(super) fn send(&self, out: &mut dyn Write, tell: Tell) -> Result<()> {
        match self.values {
            None => with_voxels!(self.voxels, v => send_stored(v, out, tell)),
            Some(values) => with_voxels!(self.voxels, v => send_values(v, values, out, tell)),
        }
    }
}

/// The smallest type that holds the values of `volume`: exactly where they are whole numbers, else with the precision of the voxels.
fn kind_of_values(volume: &Volume) -> VoxelType {
    let (slope, intercept) = volume.rescale();
    let kind = volume.voxels().voxel_type();
    let (low, high) = kind.limits();
    let whole = libm::trunc(slope) == slope && libm::trunc(intercept) == intercept;
    if whole && !kind.is_float() && (slope * low).abs().max((slope * high).abs()) + intercept.abs() < EXACT {
        let statistics = volume.statistics();
        let holds = |kind: &VoxelType| !kind.is_float() && kind.limits().0 <= statistics.min && statistics.max <= kind.limits().1;
        return VoxelType::ALL.into_iter().find(holds).unwrap_or(VoxelType::F64);
    }
    match kind {
        VoxelType::U32 | VoxelType::I32 | VoxelType::F64 => VoxelType::F64,
        _ => VoxelType::F32,
    }
}

/// Goes through `voxels` piece by piece, and tells how far that has come.
fn pieces<T: Voxel>(voxels: &[T], tell: Tell, mut send: impl FnMut(&[T]) -> std::io::Result<()>) -> Result<()> {
    let mut done = 0;
    for piece in voxels.chunks(PIECE) {
        if tell.progress.is_some_and(|p| !p.step("writing", done, voxels.len() as u64)) {
            return Err(Error::Stopped);
        }
        send(piece).map_err(|e| Error::io(tell.name, e))?;
        done += piece.len() as u64;
    }
    Ok(())
}

fn send_stored<T: Voxel>(voxels: &[T], out: &mut dyn Write, tell: Tell) -> Result<()> {
    let mut turned: Vec<T> = Vec::new();
    pieces(voxels, tell, |piece| out.write_all(bytemuck::cast_slice(little(piece, &mut turned))))
}

/// `numbers` in little-endian order; `turned` is room for them.
fn little<'a, T: Voxel>(numbers: &'a [T], turned: &'a mut Vec<T>) -> &'a [T] {
    if cfg!(target_endian = "little") {
        return numbers;
    }
    turned.clear();
    turned.extend(numbers.iter().map(|n| n.swap_bytes()));
    turned
}

fn send_values<T: Voxel>(voxels: &[T], (kind, slope, intercept): (VoxelType, f64, f64), out: &mut dyn Write, tell: Tell) -> Result<()> {
    let mut room = Voxels::zeros(kind, PIECE.min(voxels.len()));
    let mut values = Vec::with_capacity(PIECE.min(voxels.len()));
    pieces(voxels, tell, |piece| {
        values.clear();
        values.extend(piece.iter().map(|v| slope * v.to_f64() + intercept));
        with_voxels!(&mut room, room => {
            room.iter_mut().zip(&values).for_each(|(to, &from)| *to = Voxel::from_f64(from));
            out.write_all(bytemuck::cast_slice(little(&room[..values.len()], &mut Vec::new())))
        })
    })
}
