//! TIFF files of ImageJ: stacks and hyperstacks.
//!
//! Source: the classes `FileSaver` and `TiffDecoder` of ImageJ 1.x, <https://imagej.net/ij/developer/source/>. The description of the
//! first page is lines of `key=value`. Pages are in the order channel, slice, frame, the first one fastest. In files over 4 GB there is one
//! directory, and the other planes lie behind its strip, uncompressed.

use super::directory::{MOST_PAGES, Tiff};
use super::series::{Plane, Series};
use crate::Result;
use crate::volume::LengthUnit;
use crate::volume::io::field::shown;

/// Whether a description is one of ImageJ.
pub(super) fn is_it(description: &str) -> bool {
    description.starts_with("ImageJ=")
}

/// Value of `key` in the description.
fn value<'a>(description: &'a str, key: &str) -> Option<&'a str> {
    description.lines().find_map(|line| line.trim().strip_prefix(key)?.strip_prefix('='))
}

/// The planes that the description of `tiff` tells.
///
/// # Errors
/// When a number in it cannot be.
pub(super) fn series(tiff: &Tiff) -> Result<Series> {
    let text = tiff.description.as_str();
    let count = |key: &str| -> Result<Option<usize>> {
        let Some(value) = value(text, key) else { return Ok(None) };
        match value.trim().parse() {
            Ok(n) if n > 0 => Ok(Some(n)),
            _ => Err(tiff.fault(format!("ImageJ's {key} is {}: it must be a whole number of at least 1", shown(value)))),
        }
    };
    let (images, pages) = (count("images")?.unwrap_or(1), tiff.images());
    let mut series = Series { plain_palette: true, ..Series::plain(tiff) };
    if images > pages.len() && pages.len() == 1 {
        if let Some(planes) = behind(tiff, pages[0], images)? {
            series.planes = planes;
        }
    }
    let found = series.planes.len();
    if images > found {
        return Err(tiff.fault(format!("ImageJ's images is {images}, the file has {found} pages")));
    }
    let [mut channels, mut slices, frames] = [count("channels")?, count("slices")?, count("frames")?].map(|n| n.unwrap_or(1));
    if [channels, slices, frames] == [1; 3] {
        slices = found;
    }
    if channels.saturating_mul(slices).saturating_mul(frames) != found {
        series.notes.push(format!(
            "ImageJ's description tells of {channels} channels x {slices} slices x {frames} frames, the file has {found} pages: all were taken for slices."
        ));
        (channels, slices, series.frames) = (1, found, 1);
    } else {
        series.frames = frames;
    }
    series.planes = Series::sorted(&series.planes, ['c', 'z', 't'], [slices, channels, series.frames]);
    (series.slices, series.channels) = (slices, channels);
    (series.spacing, series.unit) = spacing(tiff, &mut series.notes);
    series.rescale = calibration(tiff, &mut series.notes)?;
    Ok(series)
}

/// The planes of a file of one directory that announces `images`, where they lie behind each other.
fn behind(tiff: &Tiff, page: usize, images: usize) -> Result<Option<Vec<Plane>>> {
    if images > MOST_PAGES {
        return Err(tiff.fault(format!("ImageJ's images is {images}: more than {MOST_PAGES} are not supported")));
    }
    let mut bytes = tiff.bytes()?;
    let Some((first, each)) = tiff.run(&mut bytes, page)? else { return Ok(None) };
    let Some(needed) = each.checked_mul(images as u64).filter(|&needed| tiff.places.holds(first, needed)) else {
        let held = (tiff.places.length() - first) / each;
        return Err(tiff.fault(format!("ImageJ's images is {images}, the file holds {held} behind its one directory: cut short?")));
    };
    Ok(Some((first..first + needed).step_by(each as usize).map(|at| Plane { file: 0, page, raw: Some(at) }).collect()))
}

/// Slope and intercept, where the values are calibrated along a straight line (`cf=0`): ImageJ writes signed 16-bit numbers so.
fn calibration(tiff: &Tiff, notes: &mut Vec<String>) -> Result<Option<(f64, f64)>> {
    let text = tiff.description.as_str();
    let (Some(function), Some(intercept), Some(slope)) = (value(text, "cf"), value(text, "c0"), value(text, "c1")) else { return Ok(None) };
    if function.trim() != "0" {
        notes.push("The calibration in ImageJ's description is no straight line: numbers were taken as they are stored.".to_owned());
        return Ok(None);
    }
    match (slope.trim().parse::<f64>(), intercept.trim().parse::<f64>()) {
        (Ok(slope), Ok(intercept)) if slope.is_finite() && intercept.is_finite() && slope != 0.0 => Ok(Some((slope, intercept))),
        _ => Err(tiff.fault(format!(
            "ImageJ's calibration is {} + {} x: both must be finite and the second not 0",
            shown(intercept),
            shown(slope)
        ))),
    }
}

/// Voxel sizes: the resolution of the page where the description names a unit, and the distance of slices.
fn spacing(tiff: &Tiff, notes: &mut Vec<String>) -> ([f64; 3], Option<LengthUnit>) {
    let text = tiff.description.as_str();
    let unit = value(text, "unit").map(str::trim).filter(|unit| !unit.is_empty() && !matches!(*unit, "pixel" | "pixels"));
    // ImageJ writes no distance of 1.
    let distance = value(text, "spacing").and_then(|v| v.trim().parse::<f64>().ok()).map_or(1.0, f64::abs);
    let distance = if distance.is_finite() && distance > 0.0 { distance } else { 1.0 };
    let [x, y] = match unit {
        Some(_) => tiff.resolution.map(|per_unit| per_unit.map_or(1.0, |r| 1.0 / r)),
        None => [1.0; 2],
    };
    if let Some(unit) = unit {
        // Characters beyond ASCII are written as escapes.
        let unit = unit.replace("\\u00B5", "\u{b5}").replace("\\u00b5", "\u{b5}");
        let unit: String = unit.chars().filter(|c| !c.is_control()).take(20).collect();
        notes.push(format!("Voxel sizes are in {unit}, as ImageJ's description says."));
        return ([x, y, distance], LengthUnit::from_word(&unit));
    }
    ([x, y, distance], None)
}
