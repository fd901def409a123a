//! What stays the same for all batches of a frame, grouped by the stages that use it.

use super::{ColorSource, LabelFrame, OptionalFrame, PieceFrame, SurfaceFrame};
use crate::lanes::{LookupTable, ToF32};
use crate::scene::{FogMode, FogWeighting, Scene};
use crate::volume::VoxelSlices;
use crate::volume::packed::Packed;
use crate::volume::spline::Coefficients;
use std::sync::Arc;

/// What texture coordinates and lookups need.
#[derive(Debug, Clone)]
pub(crate) struct SampleFrame<'v> {
    /// The voxels.
    pub(crate) voxels: VoxelSlices<'v>,
    /// The voxels packed with their neighbours along y, where lookups read those.
    pub(crate) packed: Option<&'v Packed>,
    /// The coefficients of the spline, where lookups read those: numbers already.
    pub(crate) coefficients: Option<&'v Coefficients>,
    /// Distance to the next voxel along each axis, in voxels of what lookups read; 0 along axes of one voxel.
    pub(crate) strides: [usize; 3],
    /// Whether texture coordinates set `far_offset` instead of `offset`.
    pub(crate) far: bool,
    /// How stored values become f32, where that takes more than a conversion.
    pub(crate) to_f32: Option<ToF32>,
    /// Stored integer up to which nothing shows, where packed lookups may leave rows out that have nothing above it around them.
    pub(crate) hidden_up_to: Option<i32>,
    /// How values become positions in the table, where lookups tell them apart exactly.
    pub(crate) labels: Option<Arc<LabelFrame>>,
}

/// What classification needs.
#[derive(Debug, Clone)]
pub(crate) struct ColorFrame {
    /// Colour and opacity of a slab one spacing thick.
    pub(crate) table: Arc<LookupTable>,
    /// Number (see [`SampleFrame::to_f32`]) at the table's first entry.
    pub(crate) low: f32,
    /// Entries per unit of such numbers, as two factors whose product may leave the range of f32.
    pub(crate) scale: [f32; 2],
    /// Index of the table's last entry.
    pub(crate) last: f32,
    /// A second table over values, and the affine map from positions in a table over pairs to its entries: offset, factor, last entry.
    pub(crate) fine: Option<(Arc<LookupTable>, [f32; 3])>,
    /// Table position below which nothing shows: rows all below it are not classified. 0 where every fragment counts.
    pub(crate) first_visible: f32,
}

/// What blending needs.
#[derive(Debug, Clone)]
pub(crate) struct BlendFrame {
    /// Transmittance below which a pixel takes no more.
    pub(crate) terminate: f32,
    /// Threshold or level of a projection, as a number (see [`SampleFrame::to_f32`]).
    pub(crate) level: f32,
}

/// What a projection of attenuated values needs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AttenuationFrame {
    /// Number (see [`SampleFrame::to_f32`]) at which the window begins.
    pub(crate) low: f32,
    /// Windows in one such number.
    pub(crate) per_unit: f32,
    /// Attenuation by a whole slab of the window's largest value.
    pub(crate) per_slab: f32,
    /// Least value of the window and its width, in the data's units.
    pub(crate) window: [f64; 2],
}

/// Fog in the numbers its stage uses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FogFrame {
    /// Mode and parameters, for the factor of a whole slice and the radial stage.
    pub(crate) mode: FogMode,
    /// Straight colour.
    pub(crate) color: [f32; 3],
    /// Whether opacity weights the fog (premultiplied colours) or not (the literal formula).
    pub(crate) weighted: bool,
}

impl FogFrame {
    /// The fog of `scene`, if it has any.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        scene.fog().map(|f| Self { mode: f.mode(), color: f.color().map(|c| c as f32), weighted: f.weighting() == FogWeighting::Alpha })
    }
}

/// What stays the same for all batches of a frame.
#[derive(Debug, Clone)]
pub(crate) struct Frame<'v> {
    /// What is looked up.
    pub(crate) sample: SampleFrame<'v>,
    /// What values look like.
    pub(crate) color: ColorFrame,
    /// How fragments add up.
    pub(crate) blend: BlendFrame,
    /// What stages need that scenes may ask for.
    pub(crate) optional: OptionalFrame<'v>,
    /// Level surfaces, where rays are followed through them.
    pub(crate) surfaces: Option<Box<SurfaceFrame<'v>>>,
    /// Thinness of slabs, where pieces of them may be short and whole ones opaque.
    pub(crate) pieces: Option<Box<PieceFrame<'v>>>,
    /// Where colours and opacities come from, where voxels are colours.
    pub(crate) colors: Option<Box<ColorSource<'v>>>,
    /// How values fade behind others, where they do.
    pub(crate) attenuation: Option<Box<AttenuationFrame>>,
}
