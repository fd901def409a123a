//! Each stage against its scalar twin on random batches, over every level of the machine.

use super::batch::Batch;
use super::fog::{FogEach, FogPlanar, FogRadial};
use super::frame::{FogFrame, Frame};
use super::*;
use crate::lanes::tests::Numbers;
use crate::lanes::{BATCH, Kernel, Level, LookupTable};
use crate::scene::FogMode;
use crate::volume::packed::{Packed, PackedPairs};
use crate::volume::{VoxelType, Voxels};
use std::sync::Arc;

const DIMS: [usize; 3] = [23, 19, 17];

fn voxels(kind: VoxelType, n: &mut Numbers) -> Voxels {
    let mut voxels = Voxels::zeros(kind, DIMS.iter().product());
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

fn frame<'v>(voxels: &'v Voxels, n: &mut Numbers, mode: FogMode, weighted: bool) -> Frame<'v> {
    let colors: Vec<[f32; 4]> = (0..64).map(|_| std::array::from_fn(|_| n.unit32())).collect();
    Frame {
        sample: SampleFrame {
            voxels: voxels.slices(),
            packed: None,
            strides: [1, DIMS[0], DIMS[0] * DIMS[1]],
            far: false,
            to_f32: None,
            hidden_up_to: None,
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
        optional: OptionalFrame { fog: Some(FogFrame { mode, color: [0.2, 0.5, 0.9], weighted }) },
    }
}

/// A batch with every array filled at random, its fragments somewhere in and around the volume.
fn batch(n: &mut Numbers) -> Box<Batch> {
    let mut b = Batch::new();
    b.slice = (n.bits() % 9) as i32;
    b.depth = n.unit32() * 10.0;
    b.fog.slice = n.unit32();
    b.mask = n.bits();
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
        b.slab.length[i] = if n.bits() % 2 == 0 { 1.0 } else { n.unit32() * 1.5 };
        b.pixels.first[i] = (n.bits() % 6) as i32;
        b.pixels.last[i] = (n.bits() % 12) as i32;
        b.pixels.first_length[i] = n.unit32();
        b.pixels.last_length[i] = n.unit32();
        b.pixels.slant[i] = 1.0 + n.unit32();
        b.pixels.plane_squared[i] = n.unit32() * 5.0;
        b.pixels.transmittance[i] = n.unit32() * n.unit32() * n.unit32();
        b.fog.each[i] = n.unit32();
        b.pixels.entry[i] = n.unit32() * 300.0;
        b.pixels.middle = [b.sample.value, b.pixels.entry];
        b.pixels.previous[0][i] = n.unit32() * 300.0;
        b.pixels.previous[1][i] = n.unit32() * 300.0;
        for c in 0..3 {
            b.slab.color[c][i] = n.unit32() * b.slab.alpha[i];
            b.pixels.color[c][i] = n.unit32() * 200.0;
        }
    }
    b
}

/// Everything a stage may write, as bits.
fn bits(b: &Batch) -> Vec<u64> {
    let mut all = vec![b.mask, b.pixels.alive];
    all.extend(b.sample.offset.iter().map(|&o| o as u64));
    all.extend(b.pixels.previous.iter().flatten().map(|x| if x.is_nan() { u64::MAX } else { u64::from(x.to_bits()) }));
    all.extend(b.pixels.excess.iter().flatten().map(|x| u64::from(x.to_bits())));
    all.extend(b.rare.far_offset);
    let floats = b.sample.weight.iter().chain(&b.slab.color).chain(&b.pixels.color).chain([
        &b.sample.value,
        &b.slab.alpha,
        &b.slab.length,
        &b.pixels.transmittance,
    ]);
    all.extend(floats.flatten().map(|x: &f32| if x.is_nan() { u64::MAX } else { u64::from(x.to_bits()) }));
    all
}

/// Runs stage `K` after those that it needs, at every level, and asks for the scalar bits.
fn twin<K: for<'v> Kernel<Frame<'v>, Batch>>(name: &str, before: &[fn(&Frame<'_>, &mut Batch)], kinds: &[VoxelType]) {
    let mut n = Numbers::new(99);
    let modes = [
        FogMode::Linear { start: 1.0, end: 4.0 },
        FogMode::Linear { start: 2.0, end: 2.0 },
        FogMode::Exp { density: 0.3 },
        FogMode::Exp2 { density: 0.2 },
    ];
    let mut changed = false;
    for round in 0..200 {
        let kind = kinds[round % kinds.len()];
        let voxels = voxels(kind, &mut n);
        let frame = frame(&voxels, &mut n, modes[round % modes.len()], round % 3 != 0);
        let mut start = batch(&mut n);
        for stage in before {
            stage(&frame, &mut start);
        }
        let untouched = bits(&start);
        let run = |level: Level| {
            let mut b = Batch::new();
            clone_into(&start, &mut b);
            level.kernel::<K, Frame<'_>, Batch>()(&frame, &mut b);
            bits(&b)
        };
        let want = run(Level::SCALAR);
        changed |= want != untouched;
        for level in Level::available() {
            assert_eq!(run(level), want, "{name} at {} in round {round} of {kind}", level.name());
        }
    }
    assert!(changed, "{name} never did anything");
}

fn clone_into(from: &Batch, to: &mut Batch) {
    (to.slice, to.depth, to.fog.slice, to.mask) = (from.slice, from.depth, from.fog.slice, from.mask);
    (to.geometry.origin, to.geometry.across, to.geometry.down, to.geometry.top, to.geometry.reach) =
        (from.geometry.origin, from.geometry.across, from.geometry.down, from.geometry.top, from.geometry.reach);
    (to.geometry.cells, to.sample.offset, to.rare.far_offset, to.sample.weight) =
        (from.geometry.cells, from.sample.offset, from.rare.far_offset, from.sample.weight);
    (to.sample.value, to.slab.color, to.slab.alpha, to.slab.length) =
        (from.sample.value, from.slab.color, from.slab.alpha, from.slab.length);
    to.pixels = from.pixels.clone();
    to.rare.corners = from.rare.corners.clone();
    to.fog.each = from.fog.each;
}

fn texcoord(frame: &Frame<'_>, batch: &mut Batch) {
    Level::SCALAR.kernel::<Texcoord, Frame<'_>, Batch>()(frame, batch);
}
fn texcoord_far(frame: &Frame<'_>, batch: &mut Batch) {
    Level::SCALAR.kernel::<TexcoordFar, Frame<'_>, Batch>()(frame, batch);
}

/// Some values that are none, some slices behind all others.
fn pairs(_: &Frame<'_>, batch: &mut Batch) {
    for i in (0..BATCH).step_by(11) {
        (batch.sample.value[i], batch.pixels.previous[0][i + i % 2], batch.pixels.previous[1][i]) = (f32::NAN, f32::INFINITY, f32::NAN);
    }
    if batch.mask % 4 == 0 {
        batch.slice = BEHIND;
    }
}
fn corners(frame: &Frame<'_>, batch: &mut Batch) {
    Level::SCALAR.kernel::<FetchCorners<false>, Frame<'_>, Batch>()(frame, batch);
}
fn corners_far(frame: &Frame<'_>, batch: &mut Batch) {
    Level::SCALAR.kernel::<FetchCorners<true>, Frame<'_>, Batch>()(frame, batch);
}

#[test]
fn every_stage_equals_its_scalar_twin() {
    use VoxelType::*;
    twin::<Span>("span", &[], &[U8]);
    twin::<Texcoord>("texcoord", &[], &[U8]);
    twin::<TexcoordFar>("texcoord far", &[], &[U8]);
    twin::<FetchPairs8>("fetch 8", &[texcoord], &[U8, I8]);
    twin::<FetchPairs16>("fetch 16", &[texcoord], &[U16, I16]);
    twin::<FetchPairs32>("fetch 32", &[texcoord], &[U32, I32, F32]);
    twin::<FetchAny<false>>("fetch any", &[texcoord], &VoxelType::ALL);
    twin::<FetchAny<true>>("fetch far", &[texcoord_far], &VoxelType::ALL);
    twin::<Classify<false>>("classify", &[], &[U8]);
    twin::<Classify<true>>("classify in two steps", &[], &[U8]);
    twin::<Correct<false>>("correct", &[], &[U8]);
    twin::<Correct<true>>("correct some", &[], &[U8]);
    twin::<FogPlanar>("planar fog", &[], &[U8]);
    twin::<FogRadial>("radial fog", &[], &[U8]);
    twin::<MaskStage>("mask", &[], &[U8]);
    twin::<BlendFront<Plain, true>>("front to back", &[], &[U8]);
    twin::<BlendFront<Plain, false>>("front to back to the end", &[], &[U8]);
    twin::<BlendBack<Plain>>("back to front", &[], &[U8]);
    twin::<BlendFront<Compensated, true>>("front to back, compensated", &[], &[U8]);
    twin::<BlendFront<Compensated, false>>("front to back to the end, compensated", &[], &[U8]);
    twin::<BlendBack<Compensated>>("back to front, compensated", &[], &[U8]);
    twin::<BlendFront<Unorm8, true>>("front to back in 8 bits", &[], &[U8]);
    twin::<BlendFront<Unorm8, false>>("front to back to the end in 8 bits", &[], &[U8]);
    twin::<BlendBack<Unorm8>>("back to front in 8 bits", &[], &[U8]);
    twin::<SpanPair>("span of pairs", &[], &[U8]);
    twin::<KeepValue>("keep", &[], &[U8]);
    twin::<FogEach>("fog of each", &[], &[U8]);
    twin::<ClassifyPair<false, false, false>>("classify pairs", &[pairs], &[U8]);
    twin::<ClassifyPair<false, true, false>>("classify pairs, second order", &[pairs], &[U8]);
    twin::<ClassifyPair<true, false, true>>("classify pairs in two steps, fine", &[pairs], &[U8]);
    twin::<ClassifyPair<true, true, true>>("classify pairs in two steps, second order, fine", &[pairs], &[U8]);
    twin::<FetchNearest<false>>("fetch nearest", &[texcoord], &VoxelType::ALL);
    twin::<FetchNearest<true>>("fetch nearest far", &[texcoord_far], &VoxelType::ALL);
    twin::<CorrectRiemann>("correct riemann", &[], &[U8]);
    twin::<ClassifyCorners<false>>("classify corners", &[texcoord, corners], &VoxelType::ALL);
    twin::<ClassifyCorners<true>>("classify corners in two steps", &[texcoord_far, corners_far], &VoxelType::ALL);
    twin::<ProjectMax>("max", &[], &[U8]);
    twin::<ProjectMin>("min", &[], &[U8]);
    twin::<ProjectAverage>("average", &[], &[U8]);
    twin::<ProjectAdd>("add", &[], &[U8]);
    twin::<ProjectLmip>("lmip", &[], &[U8]);
    twin::<ProjectIso>("iso", &[], &[U8]);
}

#[test]
fn guard_uncovers_fragments_without_a_finite_value() {
    let voxels = Voxels::U8(vec![0; DIMS.iter().product()].into());
    let mut n = Numbers::new(5);
    let frame = frame(&voxels, &mut n, FogMode::Exp { density: 0.0 }, true);
    for level in Level::available() {
        let mut b = Batch::new();
        b.mask = u64::MAX;
        (b.sample.value[3], b.sample.value[20], b.sample.value[63]) = (f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
        level.kernel::<Guard, Frame<'_>, Batch>()(&frame, &mut b);
        assert_eq!(b.mask, !(1 << 3 | 1 << 20 | 1 << 63), "{}", level.name());
        assert!(b.sample.value.iter().all(|v| v.is_finite()));
    }
}

#[test]
fn lookups_of_pairs_and_of_corners_agree_with_f64() {
    let mut n = Numbers::new(11);
    for kind in VoxelType::ALL {
        let voxels = voxels(kind, &mut n);
        let frame = frame(&voxels, &mut n, FogMode::Exp { density: 0.0 }, true);
        for _ in 0..30 {
            let mut b = batch(&mut n);
            texcoord(&frame, &mut b);
            Level::SCALAR.kernel::<FetchAny<false>, Frame<'_>, Batch>()(&frame, &mut b);
            let any = b.sample.value;
            for i in 0..BATCH {
                let at = b.geometry.cells.base + b.sample.offset[i] as usize;
                let corner = |c: usize| voxels.get(at + (c & 1) + (c >> 1 & 1) * DIMS[0] + (c >> 2) * DIMS[0] * DIMS[1]);
                let w = [b.sample.weight[0][i], b.sample.weight[1][i], b.sample.weight[2][i]].map(f64::from);
                let want: f64 =
                    (0..8).map(|c| corner(c) * (0..3).map(|a| if c >> a & 1 == 1 { w[a] } else { 1.0 - w[a] }).product::<f64>()).sum();
                let size = (0..8).map(|c| corner(c).abs()).fold(0.0, f64::max);
                assert!((f64::from(any[i]) - want).abs() <= 1e-6 * size + 1e-30 || want.is_nan(), "{kind}: {} not {want}", any[i]);
            }
            // NaN has no bits that are promised.
            let bits = |b: &Batch| b.sample.value.map(|x| if x.is_nan() { u32::MAX } else { x.to_bits() });
            let want = bits(&b);
            if let Some(packed) = Packed::new(&voxels, DIMS) {
                let [row, layer] = packed.strides;
                assert_eq!([row, layer], [DIMS[0], DIMS[0] * DIMS[1]], "offsets of the other lookups serve");
                let plain = self::frame(&voxels, &mut n, FogMode::Exp { density: 0.0 }, true);
                let frame = Frame { sample: SampleFrame { packed: Some(&packed), ..plain.sample.clone() }, ..plain };
                for level in Level::available() {
                    b.sample.value = [0.0; BATCH];
                    match packed.pairs {
                        PackedPairs::Of8(_) => level.kernel::<FetchPacked8, Frame<'_>, Batch>()(&frame, &mut b),
                        PackedPairs::Of16(_) => level.kernel::<FetchPacked16, Frame<'_>, Batch>()(&frame, &mut b),
                    }
                    assert_eq!(bits(&b), want, "packed {kind} at {}", level.name());
                }
            }
            b.sample.value = [0.0; BATCH];
            match kind {
                VoxelType::U8 | VoxelType::I8 => Level::SCALAR.kernel::<FetchPairs8, Frame<'_>, Batch>()(&frame, &mut b),
                VoxelType::U16 | VoxelType::I16 => Level::SCALAR.kernel::<FetchPairs16, Frame<'_>, Batch>()(&frame, &mut b),
                VoxelType::U32 | VoxelType::I32 | VoxelType::F32 => {
                    Level::SCALAR.kernel::<FetchPairs32, Frame<'_>, Batch>()(&frame, &mut b);
                }
                VoxelType::F64 => continue,
            }
            assert_eq!(bits(&b), want, "{kind}");
        }
    }
}
