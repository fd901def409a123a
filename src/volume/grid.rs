//! Where the voxels are: index space, world space and the box.
//!
//! ```text
//!  index space (x fastest)                 world space (right-handed, the file's unit)
//!   voxel centres at integers               world = origin + D * diag(spacing) * index
//!
//!   cells:  -1/2 |--o-----o-----o--| n-1/2      o = voxel centre
//!   nodes:       0  o-----o-----o  n-1          | = face of the box
//! ```

use crate::{Error, Result};
use glam::{DAffine3, DMat3, DVec3};

/// Which box a grid of voxels fills.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BoxConvention {
    /// Index -1/2 to n-1/2 along each axis: a voxel is a cell with an extent (OpenGL's textures). The default.
    #[default]
    Cells,
    /// Index 0 to n-1: voxels are the corners of cells (the dual grid, VTK's convention).
    Nodes,
}

/// What the world axes mean in a body, where the file says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Space {
    /// The file does not say.
    #[default]
    Unknown,
    /// x to the subject's right, y to the front (anterior), z up (superior): NIfTI.
    Ras,
    /// x to the subject's left, y to the back (posterior), z up (superior): DICOM, most NRRD and MetaImage files.
    Lps,
}

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say it all")]
pub enum LengthUnit {
    Metre,
    Centimetre,
    Millimetre,
    Micrometre,
    Nanometre,
    Angstrom,
}

impl LengthUnit {
    const ALL: [Self; 6] = [Self::Metre, Self::Centimetre, Self::Millimetre, Self::Micrometre, Self::Nanometre, Self::Angstrom];

    /// Its name, in the singular.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "metre",
            Self::Centimetre => "centimetre",
            Self::Millimetre => "millimetre",
            Self::Micrometre => "micrometre",
            Self::Nanometre => "nanometre",
            Self::Angstrom => "angstrom",
        }
    }

    /// Its symbol: m, cm, mm, um, nm, or A for angstrom.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Micrometre => "um",
            Self::Nanometre => "nm",
            Self::Angstrom => "A",
        }
    }

    /// The unit that `word` is: a name in British or American spelling, a plural, or a symbol.
    pub fn from_word(word: &str) -> Option<Self> {
        let word = word.trim();
        if let Some(unit) = Self::ALL.into_iter().find(|u| u.symbol() == word) {
            return Some(unit);
        }
        let lower = word.to_lowercase();
        let name = lower.strip_suffix('s').unwrap_or(&lower).replace("meter", "metre");
        match name.as_str() {
            "micron" | "\u{b5}m" | "\u{3bc}m" | "\\u00b5m" => Some(Self::Micrometre),
            "\u{e5}" | "\u{e5}ngstr\u{f6}m" | "\u{212b}" => Some(Self::Angstrom),
            name => Self::ALL.into_iter().find(|u| u.name() == name),
        }
    }
}

impl Space {
    /// Unit vectors of the world that point to the subject's front and up.
    ///
    /// An unknown space is treated as [`Space::Lps`]: seen from -y, with z upwards.
    pub fn front_and_up(self) -> (DVec3, DVec3) {
        match self {
            Self::Ras => (DVec3::Y, DVec3::Z),
            Self::Lps | Self::Unknown => (DVec3::NEG_Y, DVec3::Z),
        }
    }

    /// The letters that radiologists write where a picture ends in `direction` (a world vector of any length but 0): R, L for the subject's
    /// right and left, A, P for front and back, S, I for up and down. Up to three, the nearest direction first; directions more than about 75
    /// degrees away are left out. `None` for an unknown space and the vector 0.
    pub fn letters(self, direction: DVec3) -> Option<String> {
        let unit = direction.try_normalize()?;
        let names = match self {
            Self::Unknown => return None,
            Self::Ras => [['R', 'L'], ['A', 'P'], ['S', 'I']],
            Self::Lps => [['L', 'R'], ['P', 'A'], ['S', 'I']],
        };
        let mut parts: Vec<(f64, char)> =
            (0..3).map(|axis| (unit[axis].abs(), names[axis][usize::from(unit[axis] < 0.0)])).filter(|part| part.0 > 0.25).collect();
        // Stable: of equal parts the earlier axis comes first.
        parts.sort_by(|a, b| b.0.total_cmp(&a.0));
        Some(parts.into_iter().map(|part| part.1).collect())
    }
}

/// Geometry of a regular grid of voxels.
///
/// # Guarantees
/// - every dimension is at least 1 and their product fits in `usize`;
/// - the map from index to world space is finite and invertible.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    dims: [usize; 3],
    index_to_world: DAffine3,
    world_to_index: DAffine3,
    convention: BoxConvention,
    space: Space,
}

impl Grid {
    /// A grid of `dims` voxels whose voxel (0,0,0) has its centre at `origin` (world units) and whose axis `i` steps by
    /// column `i` of `steps` (direction cosine times spacing, world units).
    ///
    /// # Errors
    /// [`Error::Invalid`] when a dimension is 0, the count overflows, a number is not finite, or `steps` is singular.
    pub fn new(dims: [usize; 3], origin: DVec3, steps: DMat3) -> Result<Self> {
        if dims.contains(&0) {
            return Err(Error::invalid(format!(
                "volume of {} x {} x {} voxels: every dimension must be at least 1",
                dims[0], dims[1], dims[2]
            )));
        }
        if dims.iter().try_fold(1usize, |a, &n| a.checked_mul(n)).is_none() {
            return Err(Error::invalid(format!("volume of {} x {} x {} voxels: the count overflows", dims[0], dims[1], dims[2])));
        }
        // Later stages keep voxel positions of one axis in i32 and f32.
        if let Some(&n) = dims.iter().find(|&&n| n > 1 << 24) {
            return Err(Error::invalid(format!(
                "volume of {} x {} x {} voxels: {n} along one axis is over the limit of {}",
                dims[0],
                dims[1],
                dims[2],
                1 << 24
            )));
        }
        if !origin.is_finite() || !steps.is_finite() {
            return Err(Error::invalid(format!("origin {origin} or axes {steps} are not finite")));
        }
        for (axis, step) in [steps.x_axis, steps.y_axis, steps.z_axis].into_iter().enumerate() {
            if step.length() == 0.0 {
                return Err(Error::invalid(format!("spacing along axis {axis} is 0")));
            }
        }
        // Test the directions, not the steps: 1 x 1 x 1e-9 spacing is fine, two parallel axes are not.
        let cosines = DMat3::from_cols(steps.x_axis.normalize(), steps.y_axis.normalize(), steps.z_axis.normalize());
        let index_to_world = DAffine3::from_mat3_translation(steps, origin);
        let world_to_index = index_to_world.inverse();
        // `!(a > b)` also refuses NaN.
        let independent = cosines.determinant().abs() > 1e-9;
        if !independent || !world_to_index.is_finite() {
            return Err(Error::invalid(format!("axes {} {} {} do not span space", steps.x_axis, steps.y_axis, steps.z_axis)));
        }
        Ok(Self { dims, index_to_world, world_to_index, convention: BoxConvention::Cells, space: Space::Unknown })
    }

    /// A grid with axes along the world's, `spacing` apart (negative spacing mirrors), voxel (0,0,0) at the world's origin.
    ///
    /// # Errors
    /// As [`Grid::new`].
    pub fn with_spacing(dims: [usize; 3], spacing: [f64; 3]) -> Result<Self> {
        Self::new(dims, DVec3::ZERO, DMat3::from_diagonal(DVec3::from_array(spacing)))
    }

    /// The same grid filling its box by another convention.
    #[must_use]
    pub fn with_convention(mut self, convention: BoxConvention) -> Self {
        self.convention = convention;
        self
    }

    /// The same grid with the meaning of its world axes stated.
    #[must_use]
    pub fn with_space(mut self, space: Space) -> Self {
        self.space = space;
        self
    }

    /// Voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Number of voxels.
    pub fn voxel_count(&self) -> usize {
        self.dims.iter().product()
    }

    /// Which box the voxels fill.
    pub fn convention(&self) -> BoxConvention {
        self.convention
    }

    /// What the world axes mean in a body.
    pub fn space(&self) -> Space {
        self.space
    }

    /// Length of one index step along each axis, world units, always positive.
    pub fn spacing(&self) -> [f64; 3] {
        let m = self.index_to_world.matrix3;
        [m.x_axis.length(), m.y_axis.length(), m.z_axis.length()]
    }

    /// Smallest of [`Grid::spacing`]: the default reference length of opacity.
    pub fn smallest_spacing(&self) -> f64 {
        let s = self.spacing();
        s[0].min(s[1]).min(s[2])
    }

    /// World position of the centre of voxel (0,0,0).
    pub fn origin(&self) -> DVec3 {
        self.index_to_world.translation
    }

    /// Direction cosines: unit vectors of the index axes in the world.
    pub fn directions(&self) -> DMat3 {
        let m = self.index_to_world.matrix3;
        DMat3::from_cols(m.x_axis.normalize(), m.y_axis.normalize(), m.z_axis.normalize())
    }

    /// Map from index to world space.
    pub fn index_to_world(&self) -> DAffine3 {
        self.index_to_world
    }

    /// Map from world to index space.
    pub fn world_to_index(&self) -> DAffine3 {
        self.world_to_index
    }

    /// Lower and upper corner of the box in index space.
    pub fn index_bounds(&self) -> (DVec3, DVec3) {
        let n = DVec3::new(self.dims[0] as f64, self.dims[1] as f64, self.dims[2] as f64);
        match self.convention {
            BoxConvention::Cells => (DVec3::splat(-0.5), n - 0.5),
            BoxConvention::Nodes => (DVec3::ZERO, n - 1.0),
        }
    }

    /// The box's eight corners in world space; corner `c` takes the upper bound of axis `i` where bit `i` of `c` is set.
    pub fn corners(&self) -> [DVec3; 8] {
        let (lo, hi) = self.index_bounds();
        std::array::from_fn(|c| {
            let pick = |axis: usize| if c >> axis & 1 == 1 { hi[axis] } else { lo[axis] };
            self.index_to_world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        })
    }

    /// Centre of the box in world space.
    pub fn center(&self) -> DVec3 {
        let (lo, hi) = self.index_bounds();
        self.index_to_world.transform_point3((lo + hi) * 0.5)
    }

    /// Radius of the box's bounding sphere about [`Grid::center`], world units.
    pub fn radius(&self) -> f64 {
        let center = self.center();
        self.corners().iter().map(|c| c.distance(center)).fold(0.0, f64::max)
    }
}
