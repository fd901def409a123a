//! Where a volume comes from: a file, a raw file with its description, or a formula.

use super::edit::CropBox;
use super::io::{self, Choice, RawSpec};
use super::phantom::Phantom;
use super::{BoxConvention, Channels, Grid, Levels, Modality};
use crate::{Error, Limits, Progress, Result, Volume};
use glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where the voxels are.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Origin {
    /// A file that describes itself.
    File(PathBuf),
    /// Bare numbers, described here.
    Raw(PathBuf, RawSpec),
    /// A formula at so many voxels along each axis.
    Phantom(Phantom, usize),
}

/// A volume still to be loaded, and what is to be changed about it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct VolumeSource {
    /// Where the voxels are.
    pub origin: Origin,
    /// Which box the voxels fill.
    pub convention: BoxConvention,
    /// Spacing instead of the file's; a negative number also turns the axis around.
    pub spacing: Option<[f64; 3]>,
    /// World position of voxel (0,0,0) instead of the file's.
    pub position: Option<[f64; 3]>,
    /// Slope instead of the file's in value = slope * stored + intercept.
    pub slope: Option<f64>,
    /// Intercept instead of the file's.
    pub intercept: Option<f64>,
    /// Kind of values instead of the file's.
    pub modality: Option<Modality>,
    /// Whether its voxels are labels of segments, which its file need not say: see [`Volume::with_segments`].
    pub are_labels: bool,
    /// The part of the volume that is kept, where not all of it is: of its box as it stands in the world after all other changes.
    pub crop: Option<CropBox>,
    /// Which of several volumes of the file or folder is meant.
    pub choice: Choice,
    /// The label map beside it: see [`Volume::with_labels`].
    pub labels: Option<Box<VolumeSource>>,
    /// Pixels along the shorter side of the picture to be made, which choose a level of detail; see [`io::Reading::pixels`].
    pub pixels: Option<u32>,
}

impl VolumeSource {
    /// The source itself, with nothing changed.
    pub fn new(origin: Origin) -> Self {
        Self {
            origin,
            convention: BoxConvention::Cells,
            spacing: None,
            position: None,
            slope: None,
            intercept: None,
            modality: None,
            are_labels: false,
            crop: None,
            choice: Choice::new(),
            labels: None,
            pixels: None,
        }
    }

    /// The source whose voxels fill another box.
    #[must_use]
    pub fn with_convention(mut self, convention: BoxConvention) -> Self {
        self.convention = convention;
        self
    }

    /// The source with a spacing of its own (world units along x, y, z); a negative number also turns the axis around.
    #[must_use]
    pub fn with_spacing(mut self, spacing: [f64; 3]) -> Self {
        self.spacing = Some(spacing);
        self
    }

    /// The source with voxel (0,0,0) at another world position.
    #[must_use]
    pub fn with_position(mut self, position: [f64; 3]) -> Self {
        self.position = Some(position);
        self
    }

    /// The source with another slope in value = slope * stored + intercept.
    #[must_use]
    pub fn with_slope(mut self, slope: f64) -> Self {
        self.slope = Some(slope);
        self
    }

    /// The source with another intercept in value = slope * stored + intercept.
    #[must_use]
    pub fn with_intercept(mut self, intercept: f64) -> Self {
        self.intercept = Some(intercept);
        self
    }

    /// The source with another kind of values.
    #[must_use]
    pub fn with_modality(mut self, modality: Modality) -> Self {
        self.modality = Some(modality);
        self
    }

    /// The source whose voxels are labels of segments.
    #[must_use]
    pub fn with_own_labels(mut self, are_labels: bool) -> Self {
        self.are_labels = are_labels;
        self
    }

    /// The source of which a part is kept.
    #[must_use]
    pub fn with_crop(mut self, crop: impl Into<Option<CropBox>>) -> Self {
        self.crop = crop.into();
        self
    }

    /// The source with another of its file's volumes meant.
    #[must_use]
    pub fn with_choice(mut self, choice: Choice) -> Self {
        self.choice = choice;
        self
    }

    /// The source with a label map beside it, or without one.
    #[must_use]
    pub fn with_labels(mut self, labels: impl Into<Option<Self>>) -> Self {
        self.labels = labels.into().map(Box::new);
        self
    }

    /// The source for a picture of so many pixels along its shorter side; see [`io::Reading::pixels`].
    #[must_use]
    pub fn with_pixels(mut self, pixels: impl Into<Option<u32>>) -> Self {
        self.pixels = pixels.into();
        self
    }

    /// The source with its file at another path; a formula stays what it is.
    #[must_use]
    pub fn with_path(mut self, path: impl Into<PathBuf>) -> Self {
        match &mut self.origin {
            Origin::File(own) | Origin::Raw(own, _) => *own = path.into(),
            Origin::Phantom(..) => {}
        }
        self
    }

    /// The file that is read, if any.
    pub fn path(&self) -> Option<&Path> {
        match &self.origin {
            Origin::File(path) | Origin::Raw(path, _) => Some(path),
            Origin::Phantom(..) => None,
        }
    }

    /// Whether it is a file or folder that describes itself.
    pub fn is_described_by_file(&self) -> bool {
        matches!(self.origin, Origin::File(_))
    }

    /// Loads the volume; nobody is told how far that has come.
    ///
    /// # Errors
    /// As [`VolumeSource::load_told`].
    pub fn load(&self, limits: &Limits) -> Result<Volume> {
        self.load_told(limits, None)
    }

    /// How the file is read.
    pub fn reading(&self, limits: &Limits) -> io::Reading {
        io::Reading::new().limits(*limits).choice(self.choice.clone()).pixels(self.pixels)
    }

    /// Loads the volume, and tells `progress` how far that has come.
    ///
    /// # Errors
    /// Whatever the reader says, [`crate::Error::Limit`] when the voxels would exceed `limits`, [`crate::Error::Invalid`] for a
    /// spacing, position or rescale that makes no grid and for a crop box beyond the volume, [`crate::Error::Format`] for labels that are none or not
    /// the volume's, [`crate::Error::Stopped`] where `progress` stops it.
    pub fn load_told(&self, limits: &Limits, progress: Option<Arc<dyn Progress>>) -> Result<Volume> {
        let mut volume = match &self.origin {
            Origin::File(path) => io::read_as(path, &io::Reading { progress: progress.clone(), ..self.reading(limits) })?,
            Origin::Raw(path, spec) => io::read_raw(path, spec, limits)?,
            Origin::Phantom(phantom, size) => phantom.volume_as(*size, phantom.voxel_type(), limits)?,
        };
        if self.spacing.is_some() || self.position.is_some() {
            let grid = self.regrid(volume.grid())?;
            volume = volume.with_grid(grid)?;
            if self.spacing.is_some() {
                volume.notes.retain(|note| note != io::NO_SIZES);
            }
        }
        if self.slope.is_some() || self.intercept.is_some() {
            let (slope, intercept) = volume.rescale();
            volume = volume.with_rescale(self.slope.unwrap_or(slope), self.intercept.unwrap_or(intercept))?;
        }
        if let Some(modality) = self.modality {
            volume = volume.with_modality(modality);
        }
        if self.are_labels {
            let name = self.path().unwrap_or(Path::new("the volume")).to_path_buf();
            let volume_of_labels = match volume.channels() {
                Channels::Label(_) => Ok(volume),
                _ => volume.with_segments(Vec::new()),
            };
            volume = volume_of_labels.map_err(|e| Error::format(name, e.to_string()))?;
        }
        let volume = volume.with_convention(self.convention);
        let volume = match &self.labels {
            Some(labels) => {
                let map = labels.load_told(limits, progress.clone()).map_err(of_labels)?;
                let name = labels.path().unwrap_or(Path::new("labels"));
                volume.with_labels(&map).map_err(|e| Error::format(name, e.to_string()))?
            }
            None => volume,
        };
        // Labels are cut with it.
        match &self.crop {
            Some(crop) => crop.part(&volume, progress.as_deref()).map_err(|e| match (e, self.path()) {
                (Error::Invalid(what), Some(path)) => Error::format(path, format!("volume.crop: {what}")),
                (Error::Invalid(what), None) => Error::invalid(format!("volume.crop: {what}")),
                (e, _) => e,
            }),
            None => Ok(volume),
        }
    }

    /// The volume's levels of detail, for pictures within a limit of memory: voxels of files that can be mapped stay there, and so do the chunks of
    /// an OME-Zarr image. Whatever else there is is read into memory, within `limits`.
    ///
    /// # Errors
    /// As [`VolumeSource::load_told`]; [`crate::Error::Invalid`] for labels, and for what is to be changed about an OME-Zarr image.
    pub fn load_levels(&self, limits: &Limits, progress: Option<Arc<dyn Progress>>) -> Result<Levels> {
        if self.labels.is_some() || self.are_labels {
            return Err(Error::invalid("labels: there are no levels of detail of them"));
        }
        if let Some(crop) = &self.crop {
            return Err(Error::invalid(format!(
                "volume.crop {crop:?}: levels of detail are of the whole volume; leave it out, or cut with [[clip]]"
            )));
        }
        let changed = self.spacing.is_some() || self.position.is_some() || self.slope.is_some() || self.intercept.is_some();
        if let Origin::File(path) = &self.origin {
            let reading = io::Reading { progress: progress.clone(), ..self.reading(limits) };
            if path.is_dir() && !changed && self.modality.is_none() {
                return Ok(io::read_levels(path, &reading)?.with_convention(self.convention));
            }
        }
        Levels::of_volume(&Self { pixels: None, ..self.clone() }.load_told(limits, progress)?)
    }

    fn regrid(&self, grid: &Grid) -> Result<Grid> {
        let spacing = self.spacing.unwrap_or_else(|| grid.spacing());
        let origin = self.position.map_or(grid.origin(), DVec3::from_array);
        let steps = grid.directions() * DMat3::from_diagonal(DVec3::from_array(spacing));
        Ok(Grid::new(grid.dims(), origin, steps)?.with_space(grid.space()))
    }
}

/// What is at fault in the file of a label map, which keys of its own choose from.
fn of_labels(error: Error) -> Error {
    match error {
        Error::Format { path, what } => Error::Format { path, what: what.replace("volume.", "labels.") },
        other => other,
    }
}
