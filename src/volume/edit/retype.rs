//! Voxels of another type.

use super::{Steps, room, with_type};
use crate::settings::{Limits, Progress};
use crate::volume::channels::check_colors;
use crate::volume::{Channels, Volume, Voxel, VoxelType, with_voxels};
use crate::{Error, Result};
use rayon::prelude::*;

/// Voxels that one task converts.
const CHUNK: usize = 1 << 16;

/// A volume of another type, and what that did to its values.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Retyped {
    /// The volume.
    pub volume: Volume,
    /// Smallest and largest value that it can hold.
    pub range: (f64, f64),
    /// Voxels whose value lay outside this range: they have the nearer end of it.
    pub clipped: u64,
    /// Voxels that were NaN, which integers do not have: their value is 0, or the end of the range that is nearer to it.
    pub undefined: u64,
    /// Voxels within the range whose value is another one now, rounded to the nearest that the type has.
    pub rounded: u64,
}

/// How voxels of a task fared.
#[derive(Clone, Copy, Default)]
struct Counts {
    clipped: u64,
    undefined: u64,
    rounded: u64,
}

impl Counts {
    fn plus(self, other: Self) -> Self {
        Self { clipped: self.clipped + other.clipped, undefined: self.undefined + other.undefined, rounded: self.rounded + other.rounded }
    }
}

/// The linear map from stored numbers to those of the new type, and the smallest and largest of these.
#[derive(Clone, Copy)]
struct Map {
    /// Value = slope x stored + intercept.
    from: (f64, f64),
    /// The same of the new volume.
    to: (f64, f64),
    ends: (f64, f64),
}

/// The volume with voxels of type `kind`.
///
/// Without `scale` the values themselves (slope and intercept applied) are converted, and the new volume has neither. With it the values
/// from its first to its second number are spread over all numbers of an integer type, and the new volume's slope and intercept turn them
/// back, so that values mean what they did. Numbers are rounded to nearest, ties to even; values outside the range are clipped to it.
///
/// Labels keep their numbers and names, which `kind` must be able to hold. Colours keep what they look like: the largest number of an
/// integer type, and 1 in f32, stand for the same.
///
/// # Errors
/// [`Error::Invalid`] for a scale that is empty or not finite, one for floats, labels or colours, and for types that labels or colours
/// cannot have; [`Error::Limit`] when the voxels would take more memory than `limits` allow; [`Error::Stopped`].
pub fn convert_type(
    volume: &Volume,
    kind: VoxelType,
    scale: Option<(f64, f64)>,
    limits: &Limits,
    progress: Option<&dyn Progress>,
) -> Result<Retyped> {
    let map = map(volume, kind, scale)?;
    let range = (map.to.0 * map.ends.0 + map.to.1, map.to.0 * map.ends.1 + map.to.1);
    let old = volume.numbers();
    if kind == old.voxel_type() && map.from == map.to {
        return Ok(Retyped { volume: volume.clone(), range, clipped: 0, undefined: 0, rounded: 0 });
    }
    let (numbers, counts) = with_voxels!(old, v => with_type!(kind, To => {
        let mut out = room::<To>(v.len(), limits, "the converted volume")?;
        let counts = convert(v, &mut out, map, progress)?;
        (To::wrap(out.into()), counts)
    }));
    if matches!(volume.channels(), Channels::Label(_)) && counts.clipped > 0 {
        let (low, high) = map.ends;
        return Err(Error::invalid(format!("labels of {} voxels are outside {low} to {high}, all that {kind} holds", counts.clipped)));
    }
    let new = volume.with_numbers(volume.grid().clone(), numbers)?;
    let new = match volume.channels() {
        Channels::Scalar => new.with_rescale(map.to.0, map.to.1)?,
        Channels::Label(segments) => new.with_segments(segments.clone())?,
        Channels::Rgba => new,
        Channels::Rgb => new.without_alpha()?,
    };
    Ok(Retyped { volume: new, range, clipped: counts.clipped, undefined: counts.undefined, rounded: counts.rounded })
}

fn map(volume: &Volume, kind: VoxelType, scale: Option<(f64, f64)>) -> Result<Map> {
    let ends = kind.limits();
    let what = match volume.channels() {
        Channels::Scalar => None,
        Channels::Label(_) => Some("labels"),
        Channels::Rgba | Channels::Rgb => Some("colours"),
    };
    if let (Some(what), Some((low, high))) = (what, scale) {
        return Err(Error::invalid(format!("scale {low},{high}: {what} are not scaled")));
    }
    match volume.channels() {
        Channels::Label(_) if kind.is_float() => return Err(Error::invalid(format!("labels of {kind}: a label is an integer"))),
        Channels::Rgba | Channels::Rgb => {
            check_colors(kind)?;
            let full = |kind: VoxelType| if kind.is_float() { 1.0 } else { 1.0 / kind.limits().1 };
            return Ok(Map { from: (full(volume.numbers().voxel_type()), 0.0), to: (full(kind), 0.0), ends });
        }
        Channels::Scalar | Channels::Label(_) => {}
    }
    let from = volume.rescale();
    let Some((low, high)) = scale else { return Ok(Map { from, to: (1.0, 0.0), ends }) };
    if kind.is_float() {
        return Err(Error::invalid(format!("scale {low},{high}: {kind} holds values as they are, a scale is for integers")));
    }
    let slope = (high - low) / (ends.1 - ends.0);
    if !slope.is_finite() || !(low < high) || slope <= 0.0 {
        return Err(Error::invalid(format!("scale {low},{high}: two finite numbers are needed, the smaller one first")));
    }
    Ok(Map { from, to: (slope, low - slope * ends.0), ends })
}

fn convert<From: Voxel, To: Voxel>(old: &[From], new: &mut [To], map: Map, progress: Option<&dyn Progress>) -> Result<Counts> {
    let steps = Steps::new(progress, "converting", old.len().div_ceil(CHUNK));
    let tasks = new.par_chunks_mut(CHUNK).zip(old.par_chunks(CHUNK));
    tasks
        .map(|(new, old)| {
            let mut counts = Counts::default();
            new.iter_mut().zip(old).for_each(|(to, from)| *to = one(from.to_f64(), map, &mut counts));
            steps.next().map(|()| counts)
        })
        .try_reduce(Counts::default, |a, b| Ok(a.plus(b)))
}

/// One number of the new type.
#[inline(always)]
fn one<To: Voxel>(stored: f64, Map { from, to, ends }: Map, counts: &mut Counts) -> To {
    let place = |value: f64| if to == (1.0, 0.0) { value } else { (value - to.1) / to.0 };
    let value = from.0 * stored + from.1;
    let exact = place(value);
    if exact.is_nan() {
        if To::FLOAT {
            return To::from_f64(exact);
        }
        counts.undefined += 1;
        return To::from_f64(place(0.0).clamp(ends.0, ends.1));
    }
    // Infinity is a float like others.
    if To::FLOAT && exact.is_infinite() {
        return To::from_f64(exact);
    }
    // Just outside the range is what rounds to its end.
    let rounded = if To::FLOAT { exact } else { libm::rint(exact) };
    if rounded < ends.0 || rounded > ends.1 {
        counts.clipped += 1;
        return To::from_f64(rounded.clamp(ends.0, ends.1));
    }
    let new = To::from_f64(rounded);
    if new.to_f64() != exact {
        counts.rounded += 1;
    }
    new
}
