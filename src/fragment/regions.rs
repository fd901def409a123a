//! Classification by place: fragments in a region of space are classified by the transfer function of that region.
//!
//! Whether a fragment lies in a region is decided by where it lies from the region's centre, world space: affine in columns and rows of a block, as
//! index coordinates are. Of several regions that hold a fragment the first counts. Fragments outside all of them keep what they have.

use super::Run;
use super::batch::{Batch, SlabBatch};
use super::classify::of_table;
use super::frame::{ColorFrame, Frame};
use super::gradient::index_of;
use crate::lanes::{Kernel, Lanes, Level, LookupTable, SIDE, for_rows, row, row_mut};
use crate::scene::{FocusRegion, FocusShape};
use crate::volume::Grid;
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// One region.
#[derive(Debug, Clone)]
pub(crate) struct FocusFrame {
    /// From steps in index space to steps in the world.
    to_world: DMat3,
    /// Its centre, index space.
    center: DVec3,
    reach: Reach,
    color: ColorFrame,
    /// Thinness of slabs by the same table, where pieces of them may be short and whole ones opaque: see `pieces.rs`.
    thinness: Option<Arc<LookupTable>>,
}

/// How far it reaches from its centre, world units.
#[derive(Debug, Clone, Copy)]
enum Reach {
    /// Square of a sphere's radius.
    Squared(f32),
    /// Half of a box's lengths.
    Half([f32; 3]),
}

impl FocusFrame {
    /// `region` of a volume on `grid`, through the table of `color`.
    pub(crate) fn new(region: &FocusRegion, grid: &Grid, color: ColorFrame, thinness: Option<Arc<LookupTable>>) -> Self {
        let reach = match region.shape() {
            FocusShape::Sphere { radius } => Reach::Squared((radius * radius).min(f64::from(f32::MAX)) as f32),
            FocusShape::Box { size } => Reach::Half(size.map(|x| (0.5 * x) as f32)),
        };
        let center = grid.world_to_index().transform_point3(region.center());
        Self { to_world: grid.index_to_world().matrix3, center, reach, color, thinness }
    }

    /// Where the fragments of a batch whose base voxel is `base` lie from the centre: those of rows' first fragments, and the way from there to each
    /// column, along each axis of the world.
    #[inline(always)]
    fn places<L: Lanes>(&self, batch: &Batch, base: [usize; 3]) -> ([[f32; SIDE]; 3], [L::F; 3]) {
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        let g = &batch.geometry;
        let first = self.to_world * (wide(g.origin) + (DVec3::from_array(base.map(|n| n as f64)) - self.center));
        let (across, down) = (self.to_world * wide(g.across), self.to_world * wide(g.down));
        let numbers = L::load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let mut rows = [[0.0; SIDE]; 3];
        for axis in 0..3 {
            let along = L::add(L::splat(first[axis] as f32), L::mul(numbers, L::splat(down[axis] as f32)));
            L::store(along, &mut rows[axis]);
        }
        (rows, [0, 1, 2].map(|axis: usize| L::mul(numbers, L::splat(across[axis] as f32))))
    }

    /// Whether fragments so far from the centre lie in it.
    #[inline(always)]
    fn holds<L: Lanes>(&self, [x, y, z]: [L::F; 3]) -> L::M {
        match self.reach {
            Reach::Squared(most) => {
                let squared = L::add(L::add(L::mul(x, x), L::mul(y, y)), L::mul(z, z));
                L::le(squared, L::splat(most))
            }
            Reach::Half([a, b, c]) => {
                let within = |v: L::F, half: f32| L::le(L::max(v, L::sub(L::splat(0.0), v)), L::splat(half));
                L::and(L::and(within(x, a), within(y, b)), within(z, c))
            }
        }
    }
}

/// All regions of a scene.
#[derive(Debug, Clone)]
pub(crate) struct RegionsFrame {
    /// The first that holds a fragment counts.
    pub(crate) regions: Vec<FocusFrame>,
    /// Whether rows in which nothing shows may be left out of what follows.
    pub(crate) leave_out: bool,
}

/// The kernel.
pub(super) fn kernel<'v>(level: Level) -> Run<'v> {
    level.kernel::<ClassifyRegions, _, _>()
}

/// Row `r` as nothing, where an earlier slice has left something there.
#[inline(always)]
pub(super) fn clear<L: Lanes>(slab: &mut SlabBatch, r: usize) {
    for channel in slab.color.iter_mut().chain([&mut slab.alpha]) {
        L::store(L::splat(0.0), row_mut(channel, r));
    }
}

/// `shown` with row `r` in it where any of its opacities is above 0; where rows may be left out, and none is, without it.
#[inline(always)]
pub(super) fn shown<L: Lanes>(slab: &SlabBatch, r: usize, shown: u8, leave_out: bool) -> u8 {
    let some = L::bits(L::lt(L::splat(0.0), L::load(row(&slab.alpha, r)))) != 0;
    if some {
        shown | 1 << r
    } else if leave_out {
        shown & !(1 << r)
    } else {
        shown
    }
}

/// Fragments in regions take colour and opacity from the tables of those.
pub(super) struct ClassifyRegions;

impl<'v> Kernel<Frame<'v>, Batch> for ClassifyRegions {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(RegionsFrame { regions, leave_out }) = &frame.optional.regions else { return };
        let base = index_of(batch.geometry.cells.base, frame.sample.strides);
        let mut found = [0u8; SIDE];
        for region in regions {
            let (rows, across) = region.places::<L>(batch, base);
            for_rows!(batch.rows, r => {
                let place = [0, 1, 2].map(|axis: usize| L::add(L::splat(rows[axis][r]), across[axis]));
                let here = L::bits(region.holds::<L>(place)) & !found[r];
                if here == 0 {
                    continue;
                }
                found[r] |= here;
                // Rows that are not shown hold what an earlier slice left.
                if batch.shown >> r & 1 == 0 {
                    clear::<L>(&mut batch.slab, r);
                    batch.shown |= 1 << r;
                }
                // Where values are positions in a table of labels, numbers stand beside them.
                let values = batch.numbers.as_deref().filter(|_| frame.sample.labels.is_some()).unwrap_or(&batch.sample.value);
                let value = L::load(row(values, r));
                let color = of_table::<L>(&region.color, &region.color.table, value);
                let here = L::from_bits(here);
                let [red, green, blue] = &mut batch.slab.color;
                for (old, new) in [red, green, blue, &mut batch.slab.alpha].into_iter().zip(color) {
                    let old = row_mut(old, r);
                    L::store(L::select(here, new, L::load(old)), old);
                }
                if let (Some(table), Some(thinness)) = (&region.thinness, batch.thinness.as_deref_mut()) {
                    let [_, _, _, thin] = of_table::<L>(&region.color, table, value);
                    let old = row_mut(thinness, r);
                    L::store(L::select(here, thin, L::load(old)), old);
                }
            });
        }
        let rows = batch.rows;
        for_rows!(rows, r => {
            if found[r] != 0 {
                batch.shown = shown::<L>(&batch.slab, r, batch.shown, *leave_out);
            }
        });
    }
}
