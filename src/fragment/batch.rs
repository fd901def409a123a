//! The batch: 64 fragments as a structure of arrays that lives in the first-level cache.
//!
//! Arrays are grouped by the stages that use them. Those that every plain fragment goes through lie together in the first 4 KiB: two arrays
//! a multiple of 4096 bytes apart look alike to a processor that holds a load back behind earlier stores.

use super::rays::RayBatch;
use crate::lanes::{BATCH, CellLoad, CornerPairs, Corners};

/// Per-pixel numbers of a block: where its ray is in the box, and what the pixel has gathered.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct PixelBlock {
    /// Last slice that covers the pixel; below `first` when none does.
    pub(crate) last: [i32; BATCH],
    /// Gathered premultiplied red, green, blue; projections keep their value in the first.
    pub(crate) color: [[f32; BATCH]; 3],
    /// Transmittance left; projections keep the path length so far.
    pub(crate) transmittance: [f32; BATCH],
    /// First slice that covers the pixel.
    pub(crate) first: [i32; BATCH],
    /// Length of the first fragment's piece of the ray, in slabs.
    pub(crate) first_length: [f32; BATCH],
    /// Length of the last fragment's piece of the ray, in slabs.
    pub(crate) last_length: [f32; BATCH],
    /// Length of the ray per unit of depth: 1 in orthographic views.
    pub(crate) slant: [f32; BATCH],
    /// Picture-plane coordinates, squared and summed: for radial fog.
    pub(crate) plane_squared: [f32; BATCH],
    /// Values at the rays' entries: for slabs between two values.
    pub(crate) entry: [f32; BATCH],
    /// Values in the middle of the rays' first and second slabs, for those of second order; at last in the piece before the exit.
    pub(crate) middle: [[f32; BATCH]; 2],
    /// Values at the last slice and at the one before it.
    pub(crate) previous: [[f32; BATCH]; 2],
    /// What rounding has added to red, green, blue and transmittance so far: for compensated sums.
    pub(crate) excess: [[f32; BATCH]; 4],
    /// Pixels whose coverage the ray's interval leaves in doubt, one bit each: edge functions decide slice by slice.
    pub(crate) doubt: u64,
    /// Pixels that still take light, one bit each. Blending stages keep it up to date.
    pub(crate) alive: u64,
    /// What the block's rays have in common.
    pub(crate) summary: RaySummary,
}

/// What the rays of a block have in common, of those pixels whose ends a kernel has settled. Slices are counted from the nearest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RaySummary {
    /// Least and greatest first slice.
    pub(crate) first: (i32, i32),
    /// Least and greatest last slice.
    pub(crate) last: (i32, i32),
    /// Fragments on slices.
    pub(crate) fragments: u64,
    /// Sum of the last slices.
    pub(crate) lasts: i64,
    /// Pixels that are covered, one bit each.
    pub(crate) covered: u64,
    /// Pixels left to be settled one by one: an end lies within rounding of a slice, or the ray passes between two slices.
    pub(crate) close: u64,
}

impl RaySummary {
    /// No ray is covered, none is left to be settled.
    pub(crate) const NONE: Self =
        Self { first: (i32::MAX, i32::MIN), last: (i32::MAX, i32::MIN), fragments: 0, lasts: 0, covered: 0, close: 0 };
}

/// Where the fragments of a batch lie in the volume: an affine map from columns and rows to index coordinates, relative to a base voxel.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct Geometry {
    /// Whether every lookup lies inside the box of voxels: nothing to clamp.
    pub(crate) inner: bool,
    /// Index coordinates of pixel 0 relative to the base voxel.
    pub(crate) origin: [f32; 3],
    /// Step of the index coordinates from column to column.
    pub(crate) across: [f32; 3],
    /// Step of the index coordinates from row to row.
    pub(crate) down: [f32; 3],
    /// Lookups are clamped between the base voxel and these index coordinates relative to it.
    pub(crate) reach: [f32; 3],
    /// Largest lower corner of a cell, relative to the base voxel.
    pub(crate) top: [f32; 3],
    /// Of parts of a volume: the least lower corner of a cell, relative to the base voxel.
    pub(crate) floor: [f32; 3],
    /// The base voxel, and the distances to its neighbours.
    pub(crate) cells: CellLoad,
}

/// What texture coordinates and lookups of a value set.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct Sample {
    /// Offset of each cell's lower corner from the base voxel, in voxels.
    pub(crate) offset: [i32; BATCH],
    /// Position of each fragment inside its cell, 0 to 1 along x, y, z.
    pub(crate) weight: [[f32; BATCH]; 3],
    /// Corner values of 16-bit voxels, and of packed 8-bit ones.
    pub(crate) pairs16: CornerPairs<u32>,
    /// Interpolated value, as the number that stages compute with.
    pub(crate) value: [f32; BATCH],
}

/// Colour, opacity and length of each fragment's slab: what classification sets and later stages change.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct SlabBatch {
    /// Premultiplied red, green, blue.
    pub(crate) color: [[f32; BATCH]; 3],
    /// Opacity.
    pub(crate) alpha: [f32; BATCH],
    /// Length of the fragment's piece of the ray, in slabs.
    pub(crate) length: [f32; BATCH],
}

/// What rarer lookups set: of 32-bit voxels, of 8-bit ones that are not packed, and of batches that span 2^24 voxels and more.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct RareSample {
    /// As [`Sample::offset`], for batches that span more voxels than that can count.
    pub(crate) far_offset: [u64; BATCH],
    /// Corner values on their way to interpolation.
    pub(crate) corners: Corners,
    /// Corner values of 8-bit voxels.
    pub(crate) pairs8: CornerPairs<u16>,
}

/// What fog reads.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct FogBatch {
    /// Factor of each fragment, where fragments of one batch lie at depths of their own.
    pub(crate) each: [f32; BATCH],
    /// Factor of the slice, where fog is planar.
    pub(crate) slice: f32,
}

/// The gradients of the values.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct GradientBatch {
    /// Direction against the gradient, world space, of length 1; 0 where there is no gradient.
    pub(crate) normal: [[f32; BATCH]; 3],
    /// Size of the gradient, in units of the frame; 0 where there is none, or a voxel around is NaN or infinite.
    pub(crate) size: [f32; BATCH],
    /// Fragments that have gradients, one bit each: those that show. In their rows others have 0, and other rows what an earlier slice left.
    pub(crate) lanes: u64,
    /// Gradients taken since the batch was made.
    pub(crate) taken: u64,
    /// The fragments of `lanes` moved together (see [`crate::lanes::Packing`]): where their cells are, as in [`Sample::offset`] and
    /// [`RareSample::far_offset`], where they lie in them, their gradients and sizes.
    pub(crate) packed: PackedGradients,
}

impl GradientBatch {
    /// Of no fragment.
    fn new() -> Box<Self> {
        Box::new(Self {
            normal: [[0.0; BATCH]; 3],
            size: [0.0; BATCH],
            lanes: 0,
            taken: 0,
            packed: PackedGradients {
                offset: [0; BATCH],
                far_offset: [0; BATCH],
                weight: [[0.0; BATCH]; 3],
                normal: [[0.0; BATCH]; 3],
                size: [0.0; BATCH],
            },
        })
    }
}

/// See [`GradientBatch::packed`].
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct PackedGradients {
    pub(crate) offset: [i32; BATCH],
    pub(crate) far_offset: [u64; BATCH],
    pub(crate) weight: [[f32; BATCH]; 3],
    pub(crate) normal: [[f32; BATCH]; 3],
    pub(crate) size: [f32; BATCH],
}

/// The first level surface that each pixel's ray meets.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceHits {
    /// Window position of the first pixel's centre.
    pub(crate) window: [f64; 2],
    /// Its depth, world units; [`SurfaceHits::NONE`] where there is none.
    pub(crate) depth: [f64; BATCH],
    /// Its level, data units.
    pub(crate) level: [f64; BATCH],
}

impl SurfaceHits {
    /// The depth of no surface.
    pub(crate) const NONE: f64 = f64::INFINITY;

    /// Of no block.
    fn new() -> Box<Self> {
        Box::new(Self { window: [0.0; 2], depth: [Self::NONE; BATCH], level: [0.0; BATCH] })
    }

    /// Those of the block whose first pixel is (x,y), before anything is met.
    pub(crate) fn begin(&mut self, (x, y): (u32, u32)) {
        self.window = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        self.depth = [Self::NONE; BATCH];
    }
}

/// 64 fragments on their way through the stages.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct Batch {
    /// Index of the slice.
    pub(crate) slice: i32,
    /// Depth of the slice, world units.
    pub(crate) depth: f32,
    /// Bit i: fragment i is covered.
    pub(crate) mask: u64,
    /// Pixels whose last slice lies before this one, one bit each. Set with the mask of partial batches.
    pub(crate) ended: u64,
    /// Bit r: row r goes through the stages; in others every pixel is finished or uncovered.
    pub(crate) rows: u8,
    /// Bit r: something shows in row r, or may, before classification.
    pub(crate) shown: u8,
    /// Whether so little of the batch before showed that it is worth finding out what does before interpolation.
    pub(crate) mostly_hidden: bool,
    /// Whether this slice is the last of any pixel.
    pub(crate) ends: bool,
    /// Where the fragments lie.
    pub(crate) geometry: Geometry,
    /// The values looked up there.
    pub(crate) sample: Sample,
    /// What those values look like.
    pub(crate) slab: SlabBatch,
    /// The pixels behind the fragments.
    pub(crate) pixels: PixelBlock,
    /// What rarer lookups need.
    pub(crate) rare: RareSample,
    /// What fog needs.
    pub(crate) fog: FogBatch,
    /// The values' gradients, in frames that need them: others do not even pay for setting them to zero.
    pub(crate) gradient: Option<Box<GradientBatch>>,
    /// What rays meet of level surfaces, in frames that have any.
    pub(crate) hits: Option<Box<SurfaceHits>>,
    /// Thinness of each fragment's whole slab, 1 / (1 + optical depth), where a batch had pieces shorter than that and slabs may be opaque.
    pub(crate) thinness: Option<Box<[f32; BATCH]>>,
    /// Where fragments lie along rays with samples of their own, in frames that have such.
    pub(crate) rays: Option<Box<RayBatch>>,
    /// Numbers that stand for the values looked up, where [`Sample::value`] holds positions in a table instead: see `labels.rs`.
    pub(crate) numbers: Option<Box<[f32; BATCH]>>,
    /// Index coordinates of fragments that each lie at a place of their own, where light needs them: cells and weights are those of the lookups, which end
    /// at the outermost voxels' centres.
    pub(crate) places: Option<Box<[[f64; BATCH]; 3]>>,
    /// Of parts of a volume: the base voxel, in the whole.
    pub(crate) whole_base: [usize; 3],
}

impl Batch {
    /// A batch of nothing, with room for gradients and for hits of level surfaces where a frame needs them.
    pub(crate) fn new(gradients: bool, hits: bool) -> Box<Self> {
        Box::new(Self {
            slice: 0,
            depth: 0.0,
            mask: 0,
            ended: 0,
            rows: u8::MAX,
            shown: u8::MAX,
            mostly_hidden: false,
            ends: true,
            geometry: Geometry {
                inner: false,
                origin: [0.0; 3],
                across: [0.0; 3],
                down: [0.0; 3],
                reach: [0.0; 3],
                top: [0.0; 3],
                floor: [0.0; 3],
                cells: CellLoad::default(),
            },
            sample: Sample { offset: [0; BATCH], weight: [[0.0; BATCH]; 3], pairs16: CornerPairs([[0; BATCH]; 4]), value: [0.0; BATCH] },
            slab: SlabBatch { color: [[0.0; BATCH]; 3], alpha: [0.0; BATCH], length: [1.0; BATCH] },
            pixels: PixelBlock {
                first: [0; BATCH],
                last: [-1; BATCH],
                first_length: [0.0; BATCH],
                last_length: [0.0; BATCH],
                slant: [1.0; BATCH],
                plane_squared: [0.0; BATCH],
                color: [[0.0; BATCH]; 3],
                transmittance: [1.0; BATCH],
                entry: [0.0; BATCH],
                middle: [[0.0; BATCH]; 2],
                previous: [[0.0; BATCH]; 2],
                excess: [[0.0; BATCH]; 4],
                doubt: 0,
                alive: u64::MAX,
                summary: RaySummary::NONE,
            },
            rare: RareSample { far_offset: [0; BATCH], corners: Corners([[0.0; BATCH]; 8]), pairs8: CornerPairs([[0; BATCH]; 4]) },
            fog: FogBatch { each: [1.0; BATCH], slice: 1.0 },
            gradient: gradients.then(GradientBatch::new),
            hits: hits.then(SurfaceHits::new),
            thinness: None,
            rays: None,
            numbers: None,
            places: None,
            whole_base: [0; 3],
        })
    }

    /// The gradients, of which tests know that there are.
    #[cfg(test)]
    pub(crate) fn gradient(&self) -> &GradientBatch {
        self.gradient.as_deref().expect("the batch has gradients")
    }

    /// As [`Batch::gradient`].
    #[cfg(test)]
    pub(crate) fn gradient_mut(&mut self) -> &mut GradientBatch {
        self.gradient.as_deref_mut().expect("the batch has gradients")
    }
}
