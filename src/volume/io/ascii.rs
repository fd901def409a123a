//! Voxels written as text, one number after the other.

use super::Stored;
use super::field::shown;
use super::source::Source;
use crate::volume::{Voxel, Voxels, with_voxels};
use crate::{Error, Result};

/// Longest number that is read; C's `%f` of the largest f64 takes 317 characters.
const LONGEST: usize = 512;

fn is_gap(b: u8) -> bool {
    b.is_ascii_whitespace() || b == b',' || b == 0
}

/// Reads `dims` voxels, x fastest, as numbers between white space or commas.
///
/// # Errors
/// When a number is missing, cannot be parsed, or does not fit the type; when the file is too short for so many; when anything but one
/// of the words `sections` follows (`None`: anything may).
pub(super) fn voxels(source: &mut Source, dims: [usize; 3], stored: Stored, sections: Option<&[&str]>) -> Result<Voxels> {
    // Each number takes at least a digit and a space. The last space may be missing: then one byte less will do.
    let count = match source.weigh(dims, stored, 2) {
        Err(Error::Format { .. }) if exactly_one_short(source, dims) => source.weigh(dims, stored, 1)?,
        other => other?,
    };
    let mut voxels = Voxels::zeros(stored.voxel_type(), count);
    with_voxels!(&mut voxels, v => fill(source, v)?);
    let text = |token: &[u8]| String::from_utf8_lossy(token).into_owned();
    let Some(sections) = sections else { return Ok(voxels) };
    let more = token(source)?.map(|t| text(&t)).filter(|t| !sections.iter().any(|s| t.eq_ignore_ascii_case(s)));
    if let Some(more) = more {
        return Err(source.fault(format!("more than {count} numbers: {} follows the last voxel", shown(&more))));
    }
    Ok(voxels)
}

/// Passes over `count` numbers.
///
/// # Errors
/// When there are fewer.
pub(super) fn pass(source: &mut Source, count: usize) -> Result<()> {
    for at in 0..count {
        if token(source)?.is_none() {
            return Err(source.fault(format!("the header asks for {count} numbers, only {at} are there")));
        }
    }
    Ok(())
}

fn exactly_one_short(source: &Source, dims: [usize; 3]) -> bool {
    let count = dims.iter().fold(1u128, |a, &n| a.saturating_mul(n as u128));
    count.saturating_mul(2).checked_sub(1) == Some(u128::from(source.left()))
}

fn fill<T: Voxel>(source: &mut Source, out: &mut [T]) -> Result<()> {
    let count = out.len();
    for (at, voxel) in out.iter_mut().enumerate() {
        let Some(token) = token(source)? else {
            return Err(source.fault(format!("the header asks for {count} numbers, only {at} are there")));
        };
        let text = String::from_utf8_lossy(&token);
        *voxel = number(&text).ok_or_else(|| source.fault(format!("voxel {at} is {}, which is no {}", shown(&text), T::TYPE)))?;
    }
    Ok(())
}

/// The number that `text` is, where it is one that `T` can hold.
fn number<T: Voxel>(text: &str) -> Option<T> {
    use crate::volume::VoxelType::{F32, F64};
    match T::TYPE {
        // Parsed as f32 at once: by way of f64 some numbers would be rounded twice.
        F32 => text.parse::<f32>().ok().map(|v| T::from_f64(f64::from(v))),
        F64 => text.parse::<f64>().ok().map(T::from_f64),
        kind => {
            // Integers written as "1.0" or "1e3" are integers.
            let value = text.parse::<f64>().ok().filter(|v| libm::trunc(*v) == *v)?;
            let (low, high) = kind.limits();
            (low..=high).contains(&value).then(|| T::from_f64(value))
        }
    }
}

/// The next number's characters, or `None` at the end.
fn token(source: &mut Source) -> Result<Option<Vec<u8>>> {
    loop {
        let ahead = source.peek(1)?;
        if ahead.is_empty() {
            return Ok(None);
        }
        let ahead = source.buffered();
        let gaps = ahead.iter().take_while(|&&b| is_gap(b)).count();
        let more = gaps < ahead.len();
        source.consume(gaps);
        if more {
            break;
        }
    }
    // Most numbers end within the bytes read already.
    let mut length = source.buffered().iter().take(LONGEST + 1).position(|&b| is_gap(b));
    if length.is_none() {
        let ahead = source.peek(LONGEST + 1)?;
        length = ahead.iter().position(|&b| is_gap(b)).or_else(|| (ahead.len() <= LONGEST).then_some(ahead.len()));
    }
    let Some(length) = length else {
        return Err(source.fault(format!("a number of more than {LONGEST} characters among the voxels")));
    };
    let token = source.peek(length)?.to_vec();
    source.consume(length);
    Ok(Some(token))
}
