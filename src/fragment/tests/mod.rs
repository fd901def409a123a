//! Tests of the stages' kernels.
//!
//! - Twins (all files but `levels`): what a stage has to come to, computed fragment by fragment in plain f64 from what the stage is documented
//!   to do. A twin uses the data types of [`crate::lanes`] and none of its operations, so that a mistake in a kernel is not in its twin
//!   as well. Every kernel is held against its twin at every vector level of the machine.
//! - `levels`: a kernel gives the same bits at every vector level. It says nothing about whether those bits are right.
//!
//! Results that are indices, masks, bits or one of the inputs have to be equal. Real numbers may be off by a stated number of f32 roundings, each
//! of them at most [`ROUNDING`] of the size of what is rounded.

mod blend;
mod classify;
mod colors;
mod cubic;
mod fetch;
mod gradient;
mod levels;
mod light;
mod pair;
mod pieces;
mod place;
mod places;
mod project;
mod rays;
mod shade;
mod surfaces;
mod transfer2d;

use super::batch::Batch;
use super::fog::{FogAlong, FogEach, FogPlanar, FogRadial};
use super::frame::{FogFrame, Frame};
use super::*;
use crate::lanes::tests::Numbers;
use crate::lanes::{BATCH, Kernel, Level, LookupTable, SIDE, ToF32, rows_of, spread};
use crate::scene::FogMode;
use crate::volume::packed::{Packed, PackedPairs};
use crate::volume::{VoxelType, Voxels};
use std::ops::Range;
use std::sync::Arc;

/// Voxels along each axis, where a test has no others.
const DIMS: [usize; 3] = [23, 19, 17];

/// What rounding to f32 may change, relative to the size of the number.
const ROUNDING: f64 = f32::EPSILON as f64 / 2.0;

/// The tests that hold a stage's kernels against their twins. A new stage does not compile without an arm here.
fn twins(id: StageId) -> &'static [fn()] {
    match id {
        StageId::Span => &[place::spans, place::spans_of_slabs_between_slices],
        StageId::Texcoord => &[place::cells, place::cells_of_large_volumes, place::cells_of_parts, rays::cells_along_rays],
        StageId::Fetch => &[
            fetch::pairs_of_8_bits,
            fetch::pairs_of_16_bits,
            fetch::pairs_of_32_bits,
            fetch::packed_8_bits,
            fetch::packed_16_bits,
            fetch::single_voxels,
            fetch::nearest_voxels,
            fetch::labels,
            fetch::corners,
            cubic::values,
        ],
        StageId::Guard => &[fetch::guard],
        StageId::Keep => &[fetch::keep],
        StageId::Classify => &[
            classify::values,
            classify::corners,
            colors::slabs,
            pair::pairs,
            pair::pairs_with_a_fine_table,
            pair::pairs_of_second_order,
            pair::pairs_of_second_order_with_a_fine_table,
            pieces::thinness,
        ],
        StageId::Correct => &[shade::correct, shade::correct_riemann, pieces::correct],
        StageId::Optional(OptionalStage::Regions) => &[places::regions],
        StageId::Optional(OptionalStage::Labels) => &[places::segments, places::hidden_segments_of_projections],
        StageId::Optional(OptionalStage::Gradient) => &[
            gradient::of_slices,
            gradient::of_slices_deep_inside,
            gradient::of_pieces_at_depths_of_their_own,
            gradient::around_holes_and_on_plateaus,
            gradient::of_numbers_at_the_ends_of_f32,
        ],
        StageId::Optional(OptionalStage::GradientOpacity) => &[gradient::opacity],
        StageId::Optional(OptionalStage::Transfer2d) => &[transfer2d::regions, transfer2d::tables],
        StageId::Optional(OptionalStage::Light) => &[
            light::shades,
            light::shades_at_depths_of_their_own,
            light::shades_along_rays,
            light::darkness_by_depth,
            light::special_lights,
        ],
        StageId::Optional(OptionalStage::Fog) => {
            &[shade::fog_of_a_slice, shade::fog_by_distance, shade::fog_of_each_fragment, shade::fog_along_rays]
        }
        StageId::Mask => &[shade::mask],
        StageId::Blend => &[
            blend::front_to_back,
            blend::back_to_front,
            project::max,
            project::min,
            project::average,
            project::add,
            project::attenuated,
            project::local_maximum,
            project::surface,
            surfaces::surfaces,
        ],
    }
}

#[test]
fn every_stage_has_twins_of_its_own() {
    let mut seen: Vec<usize> = Vec::new();
    for id in StageId::ALL {
        assert!(!twins(id).is_empty(), "stage {} has no twin", id.name());
        seen.extend(twins(id).iter().map(|&test| test as usize));
    }
    let count = seen.len();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), count, "two stages name the same test");
}

/// What stages write in a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Mask,
    Ended,
    Shown,
    Offset,
    FarOffset,
    Weight,
    Corners,
    Value,
    Color,
    Alpha,
    Length,
    Previous,
    Sum,
    Transmittance,
    Excess,
    Alive,
    Normal,
    Size,
    GradientLanes,
    GradientsTaken,
    Thinness,
    Place,
}

impl Part {
    const ALL: [Self; 22] = [
        Self::Mask,
        Self::Ended,
        Self::Shown,
        Self::Offset,
        Self::FarOffset,
        Self::Weight,
        Self::Corners,
        Self::Value,
        Self::Color,
        Self::Alpha,
        Self::Length,
        Self::Previous,
        Self::Sum,
        Self::Transmittance,
        Self::Excess,
        Self::Alive,
        Self::Normal,
        Self::Size,
        Self::GradientLanes,
        Self::GradientsTaken,
        Self::Thinness,
        Self::Place,
    ];

    /// Its bits; one number for all NaN, because no bits of NaN are promised.
    fn bits(self, b: &Batch) -> Vec<u64> {
        fn floats<'a>(arrays: impl IntoIterator<Item = &'a [f32; BATCH]>) -> Vec<u64> {
            arrays.into_iter().flatten().map(|x| if x.is_nan() { u64::MAX } else { u64::from(x.to_bits()) }).collect()
        }
        match self {
            Self::Mask => vec![b.mask],
            Self::Ended => vec![b.ended],
            Self::Shown => vec![u64::from(b.shown)],
            Self::Offset => b.sample.offset.iter().map(|&o| o as u64).collect(),
            Self::FarOffset => b.rare.far_offset.to_vec(),
            Self::Weight => floats(&b.sample.weight),
            Self::Corners => floats(&b.rare.corners.0),
            Self::Value => floats([&b.sample.value]),
            Self::Color => floats(&b.slab.color),
            Self::Alpha => floats([&b.slab.alpha]),
            Self::Length => floats([&b.slab.length]),
            Self::Previous => floats(&b.pixels.previous),
            Self::Sum => floats(&b.pixels.color),
            Self::Transmittance => floats([&b.pixels.transmittance]),
            Self::Excess => floats(&b.pixels.excess),
            Self::Alive => vec![b.pixels.alive],
            Self::Normal => floats(&b.gradient().normal),
            Self::Size => floats([&b.gradient().size]),
            Self::GradientLanes => vec![b.gradient().lanes],
            Self::GradientsTaken => vec![b.gradient().taken],
            Self::Thinness => floats(b.thinness.as_deref()),
            Self::Place => floats(b.rays.as_deref().iter().flat_map(|rays| &rays.place)),
        }
    }
}

/// Takes a copy of `before` through kernel `K` at every vector level, and hands what became of it to `check` with the level's name.
///
/// What is not in `sets` has to stay as it was.
fn run<K: for<'v> Kernel<Frame<'v>, Batch>>(frame: &Frame<'_>, before: &Batch, sets: &[Part], mut check: impl FnMut(&Batch, &'static str)) {
    for level in Level::available() {
        let mut after = before.clone();
        level.kernel::<K, Frame<'_>, Batch>()(frame, &mut after);
        for part in Part::ALL.into_iter().filter(|part| !sets.contains(part)) {
            assert_eq!(part.bits(&after), part.bits(before), "{part:?} is not this stage's, at {}", level.name());
        }
        check(&after, level.name());
    }
}

/// Fails where `got` is more than `bound` away from `want`, or NaN.
#[track_caller]
fn assert_near(got: f32, want: f64, bound: f64, level: &str, fragment: usize) {
    assert!((f64::from(got) - want).abs() <= bound, "{got} not {want} within {bound:e}, at {level}, fragment {fragment}");
}

/// Fails where `got` has other bits than `want`. All NaN are alike.
#[track_caller]
fn assert_same(got: f32, want: f32, level: &str, fragment: usize) {
    assert!(got.to_bits() == want.to_bits() || got.is_nan() && want.is_nan(), "{got} not {want}, at {level}, fragment {fragment}");
}

/// Whether fragment `i` lies in one of `rows`.
fn listed(rows: u8, i: usize) -> bool {
    rows >> (i / SIDE) & 1 == 1
}

/// Whether bit `i` is set.
fn bit(mask: u64, i: usize) -> bool {
    mask >> i & 1 == 1
}

/// Some rows; all of them every third time.
fn some_rows(n: &mut Numbers) -> u8 {
    if n.bits() % 3 == 0 { u8::MAX } else { n.bits() as u8 }
}

/// Lanes of a row of a batch, for each of about one row in `every`.
fn lanes_of_rows(n: &mut Numbers, every: u64) -> Vec<Range<usize>> {
    (0..SIDE).filter(|_| n.bits() % every == 0).map(|row| row * SIDE..(row + 1) * SIDE).collect()
}

/// Random voxels of type `kind` on a grid of `dims`. A few f32 are NaN.
fn voxels(kind: VoxelType, dims: [usize; 3], n: &mut Numbers) -> Voxels {
    let mut voxels = Voxels::zeros(kind, dims.iter().product());
    voxels.as_bytes_mut().iter_mut().for_each(|b| *b = n.bits() as u8);
    match &mut voxels {
        // Random bits would be NaN too often to test anything else.
        Voxels::F32(v) => v.iter_mut().for_each(|x| *x = if n.bits() % 50 == 0 { f32::NAN } else { n.unit32() * 300.0 }),
        // Others are rescaled, and looked up another way.
        Voxels::U32(v) => v.iter_mut().for_each(|x| *x >>= 8),
        Voxels::F64(v) => v.iter_mut().for_each(|x| *x = f64::from(n.unit32()) * 300.0),
        _ => {}
    }
    voxels
}

/// Distances between voxels of a grid, 0 along axes of one voxel.
fn strides([nx, ny, nz]: [usize; 3]) -> [usize; 3] {
    [usize::from(nx > 1), if ny > 1 { nx } else { 0 }, if nz > 1 { nx * ny } else { 0 }]
}

/// Random colours, `count` of them; the first `hidden` are transparent.
fn colors(n: &mut Numbers, count: usize, hidden: usize) -> Vec<[f32; 4]> {
    (0..count).map(|k| if k < hidden { [0.0; 4] } else { std::array::from_fn(|_| n.unit32()) }).collect()
}

/// A frame of unpacked `voxels` on a grid of [`DIMS`], with a random table of 64 colours.
fn frame<'v>(voxels: &'v Voxels, n: &mut Numbers) -> Frame<'v> {
    let colors = colors(n, 64, 0);
    Frame {
        sample: SampleFrame {
            voxels: voxels.slices(),
            packed: None,
            coefficients: None,
            strides: [1, DIMS[0], DIMS[0] * DIMS[1]],
            far: false,
            to_f32: None,
            hidden_up_to: None,
            labels: None,
        },
        color: ColorFrame {
            table: Arc::new(LookupTable::new(&colors)),
            low: 3.0,
            scale: [0.21, 1.0],
            last: 63.0,
            fine: Some((Arc::new(LookupTable::new(&colors[..40])), [3.0, 0.7, 39.0])),
            first_visible: 0.0,
        },
        blend: BlendFrame { terminate: 0.01, level: 100.0 },
        optional: OptionalFrame { regions: None, segments: None, gradient: None, opacity: None, transfer2d: None, light: None, fog: None },
        surfaces: None,
        pieces: None,
        colors: None,
        attenuation: Some(Box::new(AttenuationFrame { low: -300.0, per_unit: 0.001, per_slab: 0.2, window: [0.0, 1.0] })),
    }
}

/// A batch with every array filled at random, its fragments somewhere in and around a volume of [`DIMS`]; some rows take part.
fn batch(n: &mut Numbers) -> Box<Batch> {
    let mut b = Batch::new(true, true);
    b.slice = (n.bits() % 9) as i32;
    b.depth = n.unit32() * 10.0;
    b.fog.slice = n.unit32();
    b.mask = n.bits();
    b.rows = some_rows(n);
    b.shown = b.rows & some_rows(n);
    let base = [n.bits() as usize % 10, n.bits() as usize % 9, n.bits() as usize % 8];
    b.geometry.cells.strides = [1, DIMS[0], DIMS[0] * DIMS[1]];
    b.geometry.cells.base = base[0] + base[1] * DIMS[0] + base[2] * DIMS[0] * DIMS[1];
    for axis in 0..3 {
        b.geometry.origin[axis] = n.unit32() * 9.0 - 3.0;
        b.geometry.across[axis] = n.unit32() * 2.0 - 1.0;
        b.geometry.down[axis] = n.unit32() * 2.0 - 1.0;
        b.geometry.top[axis] = (DIMS[axis] - 2 - base[axis]) as f32;
        b.geometry.reach[axis] = b.geometry.top[axis] + 1.0;
    }
    for i in 0..BATCH {
        b.sample.value[i] = n.unit32() * 400.0 - 50.0;
        b.slab.alpha[i] = if n.bits() % 4 == 0 { 0.0 } else { n.unit32() };
        b.slab.length[i] = if n.bits() % 2 == 0 { 1.0 } else { 1e-3 + n.unit32() * 1.5 };
        b.pixels.first[i] = (n.bits() % 6) as i32;
        b.pixels.last[i] = (n.bits() % 12) as i32;
        b.pixels.first_length[i] = n.unit32();
        b.pixels.last_length[i] = n.unit32();
        b.pixels.slant[i] = 1.0 + n.unit32();
        b.pixels.plane_squared[i] = n.unit32() * 5.0;
        b.pixels.transmittance[i] = n.unit32() * n.unit32() * n.unit32();
        b.fog.each[i] = n.unit32();
        b.pixels.entry[i] = n.unit32() * 300.0;
        for k in 0..2 {
            b.pixels.middle[k][i] = n.unit32() * 300.0;
            b.pixels.previous[k][i] = n.unit32() * 300.0;
        }
        for c in 0..3 {
            b.slab.color[c][i] = n.unit32() * b.slab.alpha[i];
            b.pixels.color[c][i] = n.unit32() * 200.0;
        }
    }
    // Numbers of their own: those above stay what they are.
    let mut n = Numbers::new(b.mask);
    b.gradient_mut().lanes = spread(b.shown & some_rows(&mut n)) & (n.bits() | n.bits());
    for i in 0..BATCH {
        let normal = [0; 3].map(|_| n.between(-1.0, 1.0));
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let there = n.bits() % 8 != 0 && length > 0.0 && bit(b.gradient().lanes, i);
        b.gradient_mut().size[i] = if there { n.unit32() * 50.0 } else { 0.0 };
        (0..3).for_each(|a| b.gradient_mut().normal[a][i] = if there { (normal[a] / length) as f32 } else { 0.0 });
    }
    b.thinness = Some(Box::new(std::array::from_fn(|_| if n.bits() % 9 == 0 { 0.0 } else { n.unit32() })));
    let mut rays = RayBatch::new();
    for axis in 0..3 {
        (rays.top[axis], rays.last[axis]) = ((DIMS[axis] - 2) as f64, (DIMS[axis] - 1) as f64);
        for i in 0..BATCH {
            rays.start[axis][i] = n.between(-2.0, DIMS[axis] as f64);
            rays.step[axis][i] = n.between(-0.5, 0.5);
            rays.place[axis][i] = n.unit32() * 9.0;
        }
    }
    for i in 0..BATCH {
        (rays.along[i], rays.along_step[i], rays.aside_squared[i]) = (n.unit32() * 9.0, n.unit32(), n.unit32() * 5.0);
    }
    b.rays = Some(rays);
    b
}
