//! The batch: 64 fragments as a structure of arrays that lives in the first-level cache.

pub(crate) use crate::lanes::for_rows;
use crate::lanes::{CellLoad, CornerPairs, Corners, LookupTable, ToF32};
use crate::raster::Spans;
use crate::scene::FogMode;
use crate::volume::Voxels;
use crate::volume::packed::Packed;
use std::sync::Arc;

/// Side of a block of pixels.
pub(crate) const SIDE: usize = 8;
/// Fragments of a batch: lane `i` is the pixel in column `i % 8`, row `i / 8` of its block.
pub(crate) const BATCH: usize = SIDE * SIDE;

/// Fog in the numbers the stages use.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameFog {
    /// Mode and parameters, for the factor of a whole slice and the radial stage.
    pub(crate) mode: FogMode,
    /// Straight colour.
    pub(crate) color: [f32; 3],
    /// Whether opacity weights the fog (premultiplied colours) or not (the literal formula).
    pub(crate) weighted: bool,
}

/// What stays the same for all batches of a frame.
#[derive(Debug, Clone)]
pub(crate) struct Frame<'v> {
    /// The voxels.
    pub(crate) voxels: &'v Voxels,
    /// Distance in voxels to the next voxel along each axis, 0 along axes of one voxel.
    pub(crate) strides: [usize; 3],
    /// The voxels packed with their neighbours along y, where they are.
    pub(crate) packed: Option<&'v Packed>,
    /// Whether texture coordinates set `far_offset` instead of `offset`.
    pub(crate) far: bool,
    /// How stored values become f32, where that takes more than a conversion.
    pub(crate) to_f32: Option<ToF32>,
    /// Colour and opacity of a slab one spacing thick.
    pub(crate) table: Arc<LookupTable>,
    /// Stored value (as f32) at the table's first entry.
    pub(crate) table_low: f32,
    /// Entries per unit of stored value, as two factors whose product may leave the range of f32.
    pub(crate) table_scale: [f32; 2],
    /// Index of the table's last entry.
    pub(crate) table_last: f32,
    /// A second table over values, and the affine map from positions in a table over pairs to its entries: offset, factor, last entry.
    pub(crate) fine: Option<(Arc<LookupTable>, [f32; 3])>,
    /// Transmittance below which a pixel takes no more.
    pub(crate) terminate: f32,
    /// Table position below which nothing shows: rows all below it are not looked up. 0 where every fragment counts.
    pub(crate) first_visible: f32,
    /// Stored integer up to which nothing shows, where packed lookups may leave rows out that have nothing above it around them.
    pub(crate) hidden_up_to: Option<i32>,
    /// Fog, if any.
    pub(crate) fog: Option<FrameFog>,
    /// Threshold or level of a projection, as a stored value.
    pub(crate) level: f32,
}

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
    pub(crate) spans: Spans,
}

/// 64 fragments on their way through the stages.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct Batch {
    /// Index of the slice.
    pub(crate) slice: i32,
    /// Depth of the slice, world units.
    pub(crate) depth: f32,
    /// Fog factor of the slice, where fog is planar.
    pub(crate) fog: f32,
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
    /// The base voxel.
    pub(crate) cells: CellLoad,
    /// Offset of each cell's lower corner from the base voxel, in voxels.
    pub(crate) offset: [i32; BATCH],
    /// Position of each fragment inside its cell, 0 to 1 along x, y, z.
    pub(crate) weight: [[f32; BATCH]; 3],
    /// Corner values of 16-bit voxels.
    pub(crate) pairs16: CornerPairs<u32>,
    /// Interpolated stored value.
    pub(crate) value: [f32; BATCH],
    /// Premultiplied red, green, blue.
    pub(crate) color: [[f32; BATCH]; 3],
    /// Opacity of the fragment's slab.
    pub(crate) alpha: [f32; BATCH],
    /// Length of the fragment's piece of the ray, in slabs.
    pub(crate) length: [f32; BATCH],
    /// The pixels behind the fragments.
    pub(crate) pixels: PixelBlock,
    /// The same for batches that span more voxels than `offset` can count.
    pub(crate) far_offset: [u64; BATCH],
    /// Corner values on their way to interpolation.
    pub(crate) corners: Corners,
    /// Corner values of 8-bit voxels.
    pub(crate) pairs8: CornerPairs<u16>,
    /// Fog factor of each fragment, where fragments of one batch lie at depths of their own.
    pub(crate) fog_each: [f32; BATCH],
}

impl Batch {
    /// A batch of nothing.
    pub(crate) fn new() -> Box<Self> {
        Box::new(Self {
            slice: 0,
            depth: 0.0,
            fog: 1.0,
            fog_each: [1.0; BATCH],
            mask: 0,
            ended: 0,
            rows: u8::MAX,
            shown: u8::MAX,
            ends: true,
            mostly_hidden: false,
            inner: false,
            origin: [0.0; 3],
            across: [0.0; 3],
            down: [0.0; 3],
            reach: [0.0; 3],
            top: [0.0; 3],
            cells: CellLoad::default(),
            offset: [0; BATCH],
            far_offset: [0; BATCH],
            weight: [[0.0; BATCH]; 3],
            corners: Corners([[0.0; BATCH]; 8]),
            pairs8: CornerPairs([[0; BATCH]; 4]),
            pairs16: CornerPairs([[0; BATCH]; 4]),
            value: [0.0; BATCH],
            color: [[0.0; BATCH]; 3],
            alpha: [0.0; BATCH],
            length: [1.0; BATCH],
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
                spans: Spans::NONE,
            },
        })
    }
}

/// The bits of all lanes of `rows`.
#[inline(always)]
pub(crate) fn spread(rows: u8) -> u64 {
    // Bit r moves to byte r in three steps, and fills it.
    let x = u64::from(rows);
    let x = (x | (x << 28)) & 0x0000_000f_0000_000f;
    let x = (x | (x << 14)) & 0x0003_0003_0003_0003;
    let x = (x | (x << 7)) & 0x0101_0101_0101_0101;
    x * 0xff
}

/// The rows that hold any of `lanes`.
#[inline(always)]
pub(crate) fn rows_of(lanes: u64) -> u8 {
    const LOW: u64 = 0x7f7f_7f7f_7f7f_7f7f;
    let highest = (((lanes & LOW) + LOW) | lanes) & !LOW;
    // The top bit of byte r moves to bit r of the top byte.
    ((highest >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

/// The eight lanes of row `at` of an array over the batch.
#[inline(always)]
pub(crate) fn row<T: bytemuck::Pod>(array: &[T; BATCH], at: usize) -> &[T; SIDE] {
    &bytemuck::cast_ref::<[T; BATCH], [[T; SIDE]; SIDE]>(array)[at]
}

/// As [`row`], to write.
#[inline(always)]
pub(crate) fn row_mut<T: bytemuck::Pod>(array: &mut [T; BATCH], at: usize) -> &mut [T; SIDE] {
    &mut bytemuck::cast_mut::<[T; BATCH], [[T; SIDE]; SIDE]>(array)[at]
}
