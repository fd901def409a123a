//! From the frames of a group to a stack of slices on a grid: their order, what is missing, and which of several moments is meant.
//!
//! Source: DICOM PS3.3, section C.7.6.2.1.1: a pixel lies at position + row direction * column number * column spacing + column direction *
//! row number * row spacing. Slices are ordered by how far their positions lie along the normal, the cross product of the two directions.
//! Where directions are not given, they are ordered along the line that their positions are on (`unplaced.rs`: where those are not given).

use super::image::Facts;
use super::series::{Frame, Study};
use super::tags::{ORIENTATION, PIXEL_ASPECT, PIXEL_SPACING, shown};
use crate::volume::Space;
use crate::volume::io::reading::{Part, Reading, pick};
use crate::{Error, Result};
use glam::{DMat3, DVec3};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Distances from slice to slice may differ by so much of themselves.
pub(super) const UNEVEN: f64 = 0.01;
/// Positions nearer to each other than this are the same, in millimetres.
pub(super) const NEAREST: f64 = 1e-5;

/// Checksums of the pixels of these images. Those that are the same have the same checksum; it may be missing where that is not known.
pub(super) type Sums<'a> = &'a dyn Fn(&BTreeSet<usize>) -> Result<BTreeMap<usize, Vec<u8>>>;

/// How slices that are there become slices of the volume.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Plan {
    /// One to one.
    Direct,
    /// Each has its place among so many; those between are interpolated.
    Fill { places: Vec<usize>, count: usize },
    /// Each of the volume's lies at a place between two, counted in slices that are there.
    Resample { places: Vec<f64> },
}

impl Plan {
    /// Slices of the volume, where `there` are there.
    pub(super) fn count(&self, there: usize) -> usize {
        match self {
            Self::Direct => there,
            Self::Fill { count, .. } => *count,
            Self::Resample { places } => places.len(),
        }
    }
}

/// Slices in their order, and where they lie.
pub(super) struct Stack {
    pub(super) slices: Vec<Frame>,
    pub(super) plan: Plan,
    pub(super) origin: DVec3,
    /// Steps along a row, along a column, and to the next slice.
    pub(super) steps: DMat3,
    pub(super) space: Space,
    /// How many moments there are, and what is known of them.
    pub(super) moments: usize,
    pub(super) values: String,
    pub(super) notes: Vec<String>,
}

pub(super) struct Builder<'a> {
    pub(super) study: &'a Study,
    pub(super) path: &'a Path,
    pub(super) notes: Vec<String>,
}

/// Slices of one moment in their order, how many moments there are, and what is known of these.
type Chosen = (Vec<Frame>, usize, String);

impl Builder<'_> {
    pub(super) fn facts(&self, frame: &Frame) -> &Facts {
        &self.study.images[frame.image].frames[frame.frame]
    }

    /// What messages call a frame.
    pub(super) fn name(&self, frame: &Frame) -> String {
        let image = &self.study.images[frame.image];
        let path = image.path.display();
        if image.frames.len() > 1 { format!("frame {} of {path}", frame.frame) } else { path.to_string() }
    }

    fn position(&self, frame: &Frame) -> DVec3 {
        self.facts(frame).position.unwrap_or_default()
    }

    /// Sizes of a pixel along a row and along a column.
    pub(super) fn pixel(&mut self, first: &Frame) -> [f64; 2] {
        let facts = self.facts(first);
        let (size, note) = match (facts.spacing, facts.aspect) {
            (Some([y, x]), _) if y > 0.0 && x > 0.0 => return [x, y],
            (Some([y, x]), _) => ([1.0, 1.0], format!("{} is {y} {x}: it is taken for 1 1.", shown(PIXEL_SPACING))),
            (None, Some([y, x])) if y > 0.0 && x > 0.0 => {
                let ratio = y / x;
                ([1.0, ratio], format!("Of pixels {} alone is given, {y} to {x}: taken for 1 x {ratio} mm.", shown(PIXEL_ASPECT)))
            }
            _ => ([1.0, 1.0], "The size of a pixel is not given: taken for 1 x 1 mm.".to_owned()),
        };
        self.notes.push(note);
        size
    }

    /// Distance of slices where positions do not tell it.
    pub(super) fn thickness(&mut self, first: &Frame) -> f64 {
        let facts = self.facts(first);
        let said = [(facts.between, "spacing between slices"), (facts.thickness, "slice thickness")];
        let found = said.into_iter().find_map(|(value, name)| Some((value.filter(|v| *v > 0.0)?, name)));
        match found {
            Some((value, name)) => {
                self.notes.push(format!("Slices are {value} mm apart by the {name}."));
                value
            }
            None => {
                self.notes.push("The distance of slices is not given: taken for 1 mm.".to_owned());
                1.0
            }
        }
    }

    /// Slices of one moment, in their order, from the frames of every position.
    fn one_each(&mut self, clusters: Vec<Vec<Frame>>, normal: DVec3, sums: Sums, reading: &Reading) -> Result<Chosen> {
        let is_single = |clusters: &[Vec<Frame>]| clusters.iter().all(|c| c.len() == 1);
        let mut clusters = clusters;
        let mut found = if is_single(&clusters) { None } else { self.moments(&clusters) };
        if found.is_none() && !is_single(&clusters) {
            let mut unique = clusters.clone();
            let several: BTreeSet<usize> = clusters.iter().filter(|c| c.len() > 1).flatten().map(|f| f.image).collect();
            let sums = sums(&several)?;
            for cluster in &mut unique {
                let mut seen = BTreeSet::new();
                cluster.retain(|f| sums.get(&f.image).is_none_or(|sum| seen.insert((sum, f.frame))));
            }
            // Of a scan that was repeated some slices may be the same, blank ones for example: copies they are where all others have gone.
            if !is_single(&unique) {
                found = self.repeats(&clusters);
            }
            let count = |clusters: &[Vec<Frame>]| clusters.iter().map(Vec::len).sum::<usize>();
            let copies = count(&clusters) - count(&unique);
            if found.is_none() && copies > 0 {
                self.notes.push(format!("Images left out since they have the same position and pixels as others: {copies}."));
                clusters = unique;
                if !is_single(&clusters) {
                    found = self.moments(&clusters).or_else(|| self.repeats(&clusters));
                }
            }
        }
        let Some(found) = found else {
            if let Some(several) = clusters.iter().find(|c| c.len() > 1) {
                return Err(self.same_place(&several[0], &several[1], normal));
            }
            pick(self.path, Part::Frame, reading.choice.frame, 1)?;
            return Ok((clusters.into_iter().flatten().collect(), 1, String::new()));
        };
        let count = found.sorted[0].len();
        let left_out = clusters.iter().map(Vec::len).sum::<usize>() - count * clusters.len();
        if left_out > 0 {
            self.notes.push(format!("Images left out: {left_out}, of moments that were not taken at every position."));
        }
        let chosen = pick(self.path, Part::Frame, reading.choice.frame, count)?;
        if count > 1 {
            let how = if reading.choice.frame.is_some() { "as chosen" } else { "the first" };
            let name = &found.name;
            self.notes.push(format!("There are {count} images at each position, which differ in {name}: frame {chosen} is read, {how}."));
        }
        Ok((found.sorted.into_iter().map(|c| c[chosen]).collect(), count, found.values))
    }

    /// What is said of two images that lie in the same place and that nothing tells apart.
    fn same_place(&self, first: &Frame, second: &Frame, normal: DVec3) -> Error {
        let at = self.position(first);
        let place =
            format!("({}, {}, {}), which is {} mm along the normal, and nothing tells them apart", at.x, at.y, at.z, at.dot(normal));
        if first.image == second.image {
            let what = format!("frames {} and {} lie at the same position, {place}: they make no volume", first.frame, second.frame);
            return Error::format(&self.study.images[first.image].path, what);
        }
        let what = format!("lies at the same position as {}, {place}: take one of them away", self.name(second));
        Error::format(self.name(first), what)
    }

    /// The direction that positions differ in, where directions of rows and columns are not given: along its largest part it rises.
    fn line(&self, frames: &[Frame]) -> Option<DVec3> {
        let farthest = |from: DVec3| {
            let distance = |f: &Frame| (self.position(f) - from).length();
            // Of several that are as far, the first.
            let found = frames.iter().rev().max_by(|a, b| distance(a).total_cmp(&distance(b)));
            found.map_or(from, |f| self.position(f))
        };
        let one = farthest(self.position(&frames[0]));
        let between = farthest(one) - one;
        let largest = between.to_array().into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        (between.length() > NEAREST).then(|| between.normalize() * largest.signum())
    }
}

/// A length with as many digits as are of use.
pub(super) fn short(millimetres: f64) -> f64 {
    libm::rint(millimetres * 1e4) / 1e4 + 0.0
}

/// The stack of one group's `frames`.
///
/// # Errors
/// When directions are no directions, or images at one position cannot be told apart.
pub(super) fn stack(study: &Study, path: &Path, frames: &[Frame], sums: Sums, reading: &Reading) -> Result<Stack> {
    let mut builder = Builder { study, path, notes: Vec::new() };
    let first = builder.facts(&frames[0]).clone();
    let directions = first.orientation.map(|[row, column]| (row, column));
    if let Some((row, column)) = directions.filter(|_| first.position.is_some()) {
        if (row.length() - 1.0).abs() > 0.01 || (column.length() - 1.0).abs() > 0.01 || row.dot(column).abs() > 0.01 {
            let what = format!("directions of rows {row} and columns {column} are not of length 1 and at right angles to each other");
            return Err(Error::format(builder.name(&frames[0]), what));
        }
    }
    let directions = directions.map(|(row, column)| (row.normalize(), column.normalize()));
    let normal = match (first.position, directions) {
        (Some(_), Some((row, column))) => Some(row.cross(column).normalize()),
        (Some(_), None) => builder.line(frames),
        (None, _) => None,
    };
    let Some(normal) = normal else { return builder.unplaced(frames, reading) };
    let mut sorted: Vec<(f64, Frame)> = frames.iter().map(|f| (builder.position(f).dot(normal), *f)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    // A few slices far away from the others do not make these the same.
    let apart = sorted.len().div_ceil(20).min((sorted.len() - 1) / 2);
    let inner = &sorted[apart..sorted.len() - apart];
    let near = NEAREST.max(UNEVEN * (inner[inner.len() - 1].0 - inner[0].0) / (inner.len() - 1).max(1) as f64);
    let mut clusters: Vec<Vec<Frame>> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for (along, frame) in sorted {
        match clusters.last_mut() {
            Some(cluster) if along - last <= near => cluster.push(frame),
            _ => clusters.push(vec![frame]),
        }
        last = along;
    }
    let (mut slices, moments, values) = builder.one_each(clusters, normal, sums, reading)?;
    let [x, y] = builder.pixel(&slices[0]);
    let (mut plan, mut z) = (Plan::Direct, normal);
    if slices.len() == 1 {
        z *= builder.thickness(&slices[0]);
    } else {
        let mut along: Vec<f64> = slices.iter().map(|f| builder.position(f).dot(normal)).collect();
        plan = builder.plan(&mut slices, &mut along)?;
        z = builder.step(&slices, &along, normal, plan.count(slices.len()));
    }
    let origin = builder.position(&slices[0]);
    let Some((row, column)) = directions else {
        let step = short(z.length());
        builder.notes.push(format!(
            "Files do not say which way rows and columns lie, {}: slices are ordered by their positions along ({}, {}, {}), {step} mm apart.",
            shown(ORIENTATION),
            short(normal.x),
            short(normal.y),
            short(normal.z)
        ));
        let steps = DMat3::from_diagonal(DVec3::new(x, y, z.length()));
        return Ok(Stack { slices, plan, origin: DVec3::ZERO, steps, space: Space::Unknown, moments, values, notes: builder.notes });
    };
    let steps = DMat3::from_cols(row * x, column * y, z);
    Ok(Stack { slices, plan, origin, steps, space: Space::Lps, moments, values, notes: builder.notes })
}

impl Builder<'_> {
    /// The step from slice to slice, of which there are `count`: from the first position to the last one, unless these stand on no line.
    fn step(&mut self, slices: &[Frame], along: &[f64], normal: DVec3, count: usize) -> DVec3 {
        let n = slices.len();
        let positions: Vec<DVec3> = slices.iter().map(|f| self.position(f)).collect();
        let whole = positions[n - 1] - positions[0];
        let range = along[n - 1] - along[0];
        let straight = normal * range;
        let off = |(p, a): (&DVec3, &f64)| (*p - positions[0] - whole * ((a - along[0]) / range)).length();
        let most = positions.iter().zip(along).map(off).fold(0.0, f64::max);
        let spacing = range / (count - 1) as f64;
        let is_line = most <= (UNEVEN * spacing).max(1e-4);
        if !is_line {
            let what = format!("Positions do not lie on a straight line: some lie {} mm beside it, which is not followed.", short(most));
            self.notes.push(what);
        }
        // A tilt is what is left of the way beside the normal when positions go to and fro.
        if !is_line && (whole - straight).length() < 2.0 * most {
            return straight / (count - 1) as f64;
        }
        let step = whole / (count - 1) as f64;
        let lean = libm::acos((step.dot(normal) / step.length()).clamp(-1.0, 1.0)).to_degrees();
        if lean > 0.1 {
            self.notes
                .push(format!("Slices are shifted against each other by {} degrees (gantry tilt): the grid is sheared.", short(lean)));
        }
        step
    }
}
