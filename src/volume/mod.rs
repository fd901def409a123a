//! Volumes: typed voxels on a grid in the world, and the files and formulas they come from.

pub(crate) mod bricks;
mod buffer;
mod channels;
pub(crate) mod colors;
mod digest;
pub mod edit;
mod grid;
#[cfg(feature = "formats")]
pub mod io;
mod joint_histogram;
mod labels;
pub(crate) mod levels;
pub(crate) mod packed;
pub mod phantom;
#[cfg(feature = "scene-file")]
pub(crate) mod plausible;
#[cfg(feature = "formats")]
mod source;
pub(crate) mod spline;
mod stats;
mod voxels;

pub use crate::lanes::Number;
pub use buffer::Buffer;
pub use channels::{Channels, Colors, Segment};
pub use colors::OpacityFrom;
pub use grid::{BoxConvention, Grid, LengthUnit, Space};
pub use joint_histogram::{JOINT_BINS, JointBin, JointHistogram};
pub use labels::{LabelMap, MAX_LABELS};
pub use levels::{Level, Levels};
#[cfg(feature = "formats")]
pub use source::{Origin, VolumeSource};
pub use stats::{HISTOGRAM_BINS, Statistics};
pub use voxels::{Voxel, VoxelType, Voxels};
pub(crate) use voxels::{VoxelSlices, with_slices, with_voxels};

use crate::{Error, Result};
use bricks::Bricks;
use colors::ColorBricks;
use glam::DVec3;
use std::sync::{Arc, OnceLock};

/// What kind of numbers the voxels are, where the file or the caller says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Modality {
    /// Not stated.
    #[default]
    Unknown,
    /// Computed tomography in Hounsfield units: air -1000, water 0, bone above about 300.
    Ct,
    /// Magnetic resonance: arbitrary units, 0 and up.
    Mr,
    /// Stated, and neither of these: positron emission, ultrasound, microscopes, simulations.
    Other,
}

impl Modality {
    /// The name used in scene files: `ct`, `mr`, `other`; `None` where nobody says.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Unknown => None,
            Self::Ct => Some("ct"),
            Self::Mr => Some("mr"),
            Self::Other => Some("other"),
        }
    }
}

/// A volume: a [`Grid`] and its voxels.
///
/// What a voxel holds is told by [`Volume::channels`]: one number of a field, with the linear map to the data's units; the label of a
/// segment; or a colour. Labels are integers and are read like any scalars. A colour is no scalar: [`Volume::colors`] gives the voxels of
/// such a volume, [`Volume::scalars`] is `None`, and whatever else asks for a value gets none, which each method's page describes.
///
/// # Guarantees
/// - there are exactly as many voxels as the grid has points;
/// - slope and intercept are finite and the slope is not 0; they are 1 and 0 for labels and colours;
/// - labels are integers; colours are of type u8, u16 or f32.
///
/// Clones share voxels, and what has been found out about them: a clone costs next to nothing.
#[derive(Debug, Clone)]
pub struct Volume {
    grid: Grid,
    channels: Channels,
    /// One number a voxel; none at all where the voxels are colours.
    voxels: Voxels,
    /// Red, green, blue and alpha of one voxel after the other, where the voxels are colours.
    colors: Option<Voxels>,
    /// The segment of each voxel, where a label map lies beside it.
    labels: Option<Arc<LabelMap>>,
    slope: f64,
    intercept: f64,
    modality: Modality,
    name: String,
    unit: Option<LengthUnit>,
    notes: Vec<String>,
    details: Vec<String>,
    /// Found out once, for clones too.
    statistics: Arc<OnceLock<Statistics>>,
    bricks: Arc<OnceLock<Arc<Bricks>>>,
    color_bricks: Arc<[OnceLock<Arc<ColorBricks>>; OpacityFrom::ALL.len()]>,
}

/// Refuses a number of voxels that is not the grid's; each takes `channels` of the `numbers`.
fn check_count(grid: &Grid, numbers: usize, channels: usize) -> Result<()> {
    if grid.voxel_count().checked_mul(channels) == Some(numbers) {
        return Ok(());
    }
    let ([x, y, z], count) = (grid.dims(), grid.voxel_count());
    Err(Error::invalid(match channels {
        1 => format!("{numbers} voxels given for a grid of {x} x {y} x {z} = {count}"),
        _ => format!("{numbers} numbers given for a grid of {x} x {y} x {z} = {count} voxels of {channels} numbers each"),
    }))
}

impl Volume {
    /// A volume of `voxels` (x fastest) on `grid`, one number each, values as stored.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the number of voxels is not the grid's.
    pub fn new(grid: Grid, voxels: Voxels) -> Result<Self> {
        check_count(&grid, voxels.len(), 1)?;
        Ok(Self::of(grid, voxels))
    }

    fn of(grid: Grid, voxels: Voxels) -> Self {
        Self {
            grid,
            channels: Channels::Scalar,
            voxels,
            colors: None,
            labels: None,
            slope: 1.0,
            intercept: 0.0,
            modality: Modality::Unknown,
            name: String::new(),
            unit: None,
            notes: Vec::new(),
            details: Vec::new(),
            statistics: Arc::default(),
            bricks: Arc::default(),
            color_bricks: Arc::default(),
        }
    }

    /// A volume of colours on `grid`: `numbers` are red, green, blue and alpha of the first voxel, then of the next one, x fastest.
    ///
    /// Colours are straight, not premultiplied by alpha; alpha is the opacity of a layer as thick as the reference length. In u8 and u16
    /// the largest number of the type stands for 1; numbers of f32 stand for themselves and are not checked against `[0,1]`.
    ///
    /// # Errors
    /// [`Error::Invalid`] when there are not four numbers for each of the grid's voxels, or their type is none of u8, u16 and f32.
    pub fn with_colors(grid: Grid, numbers: Voxels) -> Result<Self> {
        let kind = numbers.voxel_type();
        channels::check_colors(kind)?;
        check_count(&grid, numbers.len(), Channels::Rgba.count())?;
        Ok(Self { channels: Channels::Rgba, colors: Some(numbers), ..Self::of(grid, Voxels::zeros(kind, 0)) })
    }

    /// The same colours without an alpha, as files of red, green and blue have them: [`Channels::Rgb`]. The fourth number of each voxel is not
    /// looked at; readers make it 1.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the voxels are no colours.
    pub fn without_alpha(mut self) -> Result<Self> {
        if self.colors.is_none() {
            return Err(Error::invalid("no alpha: is for volumes of colours"));
        }
        self.channels = Channels::Rgb;
        self.color_bricks = Arc::default();
        Ok(self)
    }

    /// The same volume with its voxels taken for labels, of which `segments` tells some by name. May be empty: labels without names.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the voxels are colours, floats or rescaled; when a segment's label does not fit the voxels' type or is that
    /// of another segment; when a colour is outside `[0,1]`.
    pub fn with_segments(mut self, segments: Vec<Segment>) -> Result<Self> {
        if self.colors.is_some() {
            return Err(Error::invalid("labels of voxels that are colours: a label is one integer"));
        }
        channels::check_segments(self.voxels.voxel_type(), &segments)?;
        if self.rescale() != (1.0, 0.0) {
            return Err(Error::invalid(format!("labels with slope {} and intercept {}: labels are as stored", self.slope, self.intercept)));
        }
        self.channels = Channels::Label(segments);
        Ok(self)
    }

    /// The same volume with value = slope * stored + intercept (NIfTI `scl_slope`, DICOM rescale).
    ///
    /// # Errors
    /// [`Error::Invalid`] when either is not finite or the slope is 0; for labels and colours, when they change anything.
    pub fn with_rescale(mut self, slope: f64, intercept: f64) -> Result<Self> {
        if self.channels != Channels::Scalar && (slope, intercept) != (1.0, 0.0) {
            let what = if self.colors.is_some() { "colours" } else { "labels" };
            return Err(Error::invalid(format!("rescale slope {slope}, intercept {intercept}: {what} are not rescaled")));
        }
        if !slope.is_finite() || !intercept.is_finite() || slope == 0.0 {
            return Err(Error::invalid(format!("rescale slope {slope}, intercept {intercept}: both must be finite and the slope not 0")));
        }
        self.slope = slope;
        self.intercept = intercept;
        self.statistics = Arc::default();
        Ok(self)
    }

    /// The same volume with its kind of values stated.
    #[must_use]
    pub fn with_modality(mut self, modality: Modality) -> Self {
        self.modality = modality;
        self
    }

    /// The same volume with a name for messages: usually the file's path.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// The same volume with the unit of lengths in its world stated, or not.
    #[must_use]
    pub fn with_unit(mut self, unit: impl Into<Option<LengthUnit>>) -> Self {
        self.unit = unit.into();
        self
    }

    /// The same volume with one more [note](Volume::notes).
    #[must_use]
    pub fn with_note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// The same volume with one more [detail](Volume::details).
    #[must_use]
    pub fn with_detail(mut self, detail: impl Into<String>) -> Self {
        self.details.push(detail.into());
        self
    }

    /// The same voxels on another grid.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the number of voxels is not the grid's.
    pub fn with_grid(mut self, grid: Grid) -> Result<Self> {
        check_count(&grid, self.colors.as_ref().unwrap_or(&self.voxels).len(), self.channels.count())?;
        self.grid = grid;
        self.bricks = Arc::default();
        self.color_bricks = Arc::default();
        Ok(self)
    }

    /// The same voxels filling their box by another convention.
    #[must_use]
    pub fn with_convention(mut self, convention: BoxConvention) -> Self {
        self.grid = self.grid.with_convention(convention);
        self
    }

    /// Where the voxels are.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// What a voxel holds.
    pub fn channels(&self) -> &Channels {
        &self.channels
    }

    /// The scalars or labels as stored, x fastest. Empty for a volume of colours: ask [`Volume::scalars`] where it may be one.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// The scalars or labels as stored, as many as the grid has points, x fastest; `None` for a volume of colours.
    pub fn scalars(&self) -> Option<&Voxels> {
        self.colors.is_none().then_some(&self.voxels)
    }

    /// The colours as stored, as many as the grid has points, x fastest; `None` for scalars and labels.
    pub fn colors(&self) -> Option<Colors<'_>> {
        self.colors.as_ref().and_then(Colors::of)
    }

    /// (slope, intercept) of value = slope * stored + intercept.
    pub fn rescale(&self) -> (f64, f64) {
        (self.slope, self.intercept)
    }

    /// Kind of values.
    pub fn modality(&self) -> Modality {
        self.modality
    }

    /// Name for messages; may be empty.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The unit of lengths in its world, where the file or the caller says so.
    pub fn unit(&self) -> Option<LengthUnit> {
        self.unit
    }

    /// What its reader chose or repaired, one sentence each, to be told to whoever looks at the volume: which of several series it is, that a
    /// transform in the file was unusable and what was taken instead.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// What its reader went by, one sentence each, for those who want to know: which of two transforms in the file, by which code.
    pub fn details(&self) -> &[String] {
        &self.details
    }

    /// The value at voxel (i,j,k) in the data's units; NaN in a volume of colours.
    ///
    /// # Panics
    /// When the voxel is outside the grid.
    pub fn value(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [nx, ny, nz] = self.grid.dims();
        assert!(i < nx && j < ny && k < nz, "voxel {i},{j},{k} outside {nx} x {ny} x {nz}");
        if self.colors.is_some() {
            return f64::NAN;
        }
        self.slope * self.voxels.get((k * ny + j) * nx + i) + self.intercept
    }

    /// Trilinear value at index coordinates `p` in the data's units, in f64, clamped to the edge; NaN in a volume of colours.
    pub fn sample(&self, p: DVec3) -> f64 {
        let mut low = [0usize; 3];
        let mut high = [0usize; 3];
        let mut t = [0.0; 3];
        for axis in 0..3 {
            let last = self.grid.dims()[axis] - 1;
            let u = p[axis].clamp(0.0, last as f64);
            low[axis] = (u as usize).min(last.saturating_sub(1));
            high[axis] = (low[axis] + 1).min(last);
            t[axis] = u - low[axis] as f64;
        }
        let at = |c: usize| {
            let pick = |axis: usize| if c >> axis & 1 == 1 { high[axis] } else { low[axis] };
            self.value([pick(0), pick(1), pick(2)])
        };
        let lerp = |a: f64, b: f64, t: f64| a + t * (b - a);
        let along_x = [0, 2, 4, 6].map(|c: usize| lerp(at(c), at(c + 1), t[0]));
        lerp(lerp(along_x[0], along_x[1], t[1]), lerp(along_x[2], along_x[3], t[1]), t[2])
    }

    /// Gradient at index coordinates `p` by central differences one voxel wide, per world unit, in world directions; NaN in a volume of
    /// colours.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        let difference = |axis: usize| {
            let mut step = DVec3::ZERO;
            step[axis] = 1.0;
            0.5 * (self.sample(p + step) - self.sample(p - step))
        };
        // The gradient is a covector: it goes through the transpose of the map from world to index.
        self.grid.world_to_index().matrix3.transpose() * DVec3::new(difference(0), difference(1), difference(2))
    }

    /// Range, mean and histogram, computed once. Those of no voxel at all in a volume of colours.
    pub fn statistics(&self) -> &Statistics {
        self.statistics.get_or_init(|| Statistics::of(&self.voxels, self.slope, self.intercept))
    }

    /// Range of stored values brick by brick, computed once. For scalars alone: see [`Volume::check_scalars`].
    pub(crate) fn bricks(&self) -> &Arc<Bricks> {
        self.bricks.get_or_init(|| Arc::new(Bricks::new(&self.voxels, self.grid.dims())))
    }

    /// Smallest and largest finite value in the data's units; zeros when there is none. They come from the bricks, which are
    /// made in the same pass over the voxels where they are not there yet.
    pub(crate) fn range(&self) -> (f64, f64) {
        if let Some(s) = self.statistics.get() {
            return (s.min, s.max);
        }
        if self.colors.is_some() {
            return (0.0, 0.0);
        }
        let (low, high) = self.bricks().range;
        let value = |stored: f64| self.slope * stored + self.intercept;
        match (value(low), value(high)) {
            _ if low > high => (0.0, 0.0),
            (a, b) if a > b => (b, a),
            range => range,
        }
    }
}
