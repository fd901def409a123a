//! Where fragments lie in space: for light, which may come from a place, and shines towards an eye at a place.

use super::batch::Batch;
use super::frame::Frame;
use super::gradient::{index_of, weighted};
use super::light::{LightingFrame, unit};
use crate::lanes::{BATCH, Lanes, row};
use glam::DVec3;

/// Distance, in lengths of about the box, from which on rays of a light or to the eye are parallel to the last bit.
const FAR_AWAY: f64 = 1e12;

/// Index coordinates of fragments relative to a batch's base voxel. (A trait and no closures: those are not inlined.)
pub(super) trait Places {
    /// Whether the batch is one of a part of a volume: places are those of the whole.
    const PART: bool = false;
    /// Before rows are asked for.
    fn of(frame: &Frame<'_>, batch: &Batch) -> Self;
    fn row<L: Lanes>(&self, batch: &Batch, r: usize) -> [L::F; 3];
}

/// Index coordinates of a batch's base voxel; of a `PART` of a volume, in the whole.
#[inline(always)]
pub(super) fn base_voxel<const PART: bool>(frame: &Frame<'_>, batch: &Batch) -> [usize; 3] {
    if PART { batch.whole_base } else { index_of(batch.geometry.cells.base, frame.sample.strides) }
}

/// On a slice they are affine in columns and rows; in a `PART` of a volume or not.
pub(super) struct OnSlice<const PART: bool>;

impl<const PART: bool> Places for OnSlice<PART> {
    const PART: bool = PART;

    #[inline(always)]
    fn of(_: &Frame<'_>, _: &Batch) -> Self {
        Self
    }

    #[inline(always)]
    fn row<L: Lanes>(&self, batch: &Batch, r: usize) -> [L::F; 3] {
        let g = &batch.geometry;
        let numbers = L::load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let mut place = [L::splat(0.0); 3];
        for axis in 0..3 {
            let first = g.origin[axis] + r as f32 * g.down[axis];
            place[axis] = L::add(L::splat(first), L::mul(numbers, L::splat(g.across[axis])));
        }
        place
    }
}

/// Each is at a depth of its own; in a `PART` of a volume or not.
pub(super) struct Each<const PART: bool>([[f32; BATCH]; 3]);

impl<const PART: bool> Places for Each<PART> {
    const PART: bool = PART;

    fn of(frame: &Frame<'_>, batch: &Batch) -> Self {
        let first = base_voxel::<PART>(frame, batch);
        let mut places = [[0.0; BATCH]; 3];
        let lanes = batch.gradient.as_deref().map_or(0, |g| g.lanes);
        for i in (0..BATCH).filter(|i| lanes >> i & 1 == 1) {
            let place = place(frame, batch, first, i);
            (0..3).for_each(|axis| places[axis][i] = place[axis]);
        }
        Self(places)
    }

    #[inline(always)]
    fn row<L: Lanes>(&self, _: &Batch, r: usize) -> [L::F; 3] {
        load::<L>(&self.0, r)
    }
}

/// Along rays with samples of their own they are there already.
pub(super) struct AlongRays;

impl Places for AlongRays {
    #[inline(always)]
    fn of(_: &Frame<'_>, _: &Batch) -> Self {
        Self
    }

    #[inline(always)]
    fn row<L: Lanes>(&self, batch: &Batch, r: usize) -> [L::F; 3] {
        match batch.rays.as_deref() {
            Some(rays) => load::<L>(&rays.place, r),
            None => [L::splat(0.0); 3],
        }
    }
}

/// Index coordinates of fragment `i` relative to the base voxel, whose own are `base`.
pub(super) fn place(frame: &Frame<'_>, batch: &Batch, base: [usize; 3], i: usize) -> [f32; 3] {
    if let Some(places) = batch.places.as_deref() {
        return [0, 1, 2].map(|axis: usize| (places[axis][i] - base[axis] as f64) as f32);
    }
    let offset = if frame.sample.far { batch.rare.far_offset[i] as usize } else { batch.sample.offset[i] as usize };
    let cell = index_of(batch.geometry.cells.base + offset, frame.sample.strides);
    [0, 1, 2].map(|axis: usize| ((cell[axis] as f64 - base[axis] as f64) + f64::from(batch.sample.weight[axis][i])) as f32)
}

/// From the base voxel of a batch to points in space, in lengths of about the box.
pub(super) struct Corner {
    at: DVec3,
    per_box: f64,
    /// Rows of the map from index to world space.
    steps: [[f32; 3]; 3],
}

impl Corner {
    pub(super) fn of<const PART: bool>(frame: &Frame<'_>, light: &LightingFrame, batch: &Batch) -> Self {
        let base = base_voxel::<PART>(frame, batch).map(|x| x as f64);
        let m = light.to_world.matrix3 * light.per_box;
        Self {
            per_box: light.per_box,
            at: light.to_world.transform_point3(DVec3::from_array(base)),
            steps: [m.row(0).as_vec3().to_array(), m.row(1).as_vec3().to_array(), m.row(2).as_vec3().to_array()],
        }
    }

    /// From the base voxel to `point`, shortened where it is far beyond the box: only its direction counts then.
    pub(super) fn way(&self, point: DVec3) -> [f32; 3] {
        let way = (point - self.at) * self.per_box;
        let far = way.abs().max_element();
        (if far > FAR_AWAY { way * (FAR_AWAY / far) } else { way }).as_vec3().to_array()
    }

    /// From fragments at `place` to the end of `way`, of length 1: from the base voxel there, less the way to the fragment.
    #[inline(always)]
    pub(super) fn towards<L: Lanes>(&self, way: &[f32; 3], place: [L::F; 3]) -> [L::F; 3] {
        let [x, y, z] = &self.steps;
        unit::<L>([
            L::sub(L::splat(way[0]), weighted::<L>(x, place)),
            L::sub(L::splat(way[1]), weighted::<L>(y, place)),
            L::sub(L::splat(way[2]), weighted::<L>(z, place)),
        ])
    }
}

/// Row `r` of a vector.
#[inline(always)]
pub(super) fn load<L: Lanes>(v: &[[f32; BATCH]; 3], r: usize) -> [L::F; 3] {
    [L::load(row(&v[0], r)), L::load(row(&v[1], r)), L::load(row(&v[2], r))]
}

/// Where the base voxel of a batch of such places is.
pub(super) fn corner<P: Places>(frame: &Frame<'_>, light: &LightingFrame, batch: &Batch) -> Corner {
    if P::PART { Corner::of::<true>(frame, light, batch) } else { Corner::of::<false>(frame, light, batch) }
}
