//! A kernel gives the same bits at every vector level of the machine: what decides which level runs decides nothing of a picture.
//!
//! All levels run the same generic code. A mistake in that code is in all of them, and these tests pass; the twins beside this file are there to
//! find it.

use super::*;
use crate::fragment::gradient::TakeGradient;
use crate::fragment::gradient_opacity::WeighByGradient;
use crate::fragment::light::{CueDepth, CueEach, Shade, ShadeAlong, ShadeEach};
use crate::fragment::regions::ClassifyRegions;
use crate::fragment::segments::{ApplySegments, HideSegments};
use crate::proxy::Stack;
use crate::scene::{Camera, FocusRegion, FocusShape, Gradient, Light, LightSource, Lighting, Placement, Projection, TransferFunction};
use crate::volume::Grid;
use glam::DVec3;

/// Everything a stage may write, as bits.
fn bits(b: &Batch) -> Vec<u64> {
    Part::ALL.into_iter().flat_map(|part| part.bits(b)).collect()
}

/// Runs stage `K` after those that it needs, at every level, and asks for the bits that it gives one number at a time.
fn levels_agree<K: for<'v> Kernel<Frame<'v>, Batch>>(name: &str, before: &[fn(&Frame<'_>, &mut Batch)], kinds: &[VoxelType]) {
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
        let voxels = voxels(kind, DIMS, &mut n);
        let mut frame = frame(&voxels, &mut n);
        let (mode, weighted) = (modes[round % modes.len()], round % 3 != 0);
        frame.optional.fog = Some(FogFrame { mode, color: [0.2, 0.5, 0.9], weighted });
        light_up(&mut frame, round);
        let places = Voxels::U8((0..voxels.len()).map(|_| (n.bits() % 5) as u8).collect());
        by_place(&mut frame, &places, &mut n);
        let mut start = batch(&mut n);
        for stage in before {
            stage(&frame, &mut start);
        }
        let untouched = bits(&start);
        let run = |level: Level| {
            let mut b = start.clone();
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

/// Two regions, and labels of which most change something.
fn by_place<'v>(frame: &mut Frame<'v>, places: &'v Voxels, n: &mut Numbers) {
    let grid = Grid::with_spacing(DIMS, [0.7, 1.3, 0.2]).expect("a grid");
    let any = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).expect("a function");
    let regions = [FocusShape::Sphere { radius: 2.5 }, FocusShape::Box { size: [6.0, 9.0, 1.5] }].map(|shape| {
        let region = FocusRegion::new(shape, DVec3::new(5.0, 9.0, 1.2), any.clone()).expect("a region");
        let table = Arc::new(LookupTable::new(&colors(n, 64, 9)));
        let color = ColorFrame { table: table.clone(), ..frame.color.clone() };
        FocusFrame::new(&region, &grid, color, Some(table))
    });
    frame.optional.regions = Some(RegionsFrame { regions: regions.to_vec(), leave_out: true });
    let tint = Effect { keep: 0.3, mix: [0.1, 0.7, 0.4], ..Effect::SHOW };
    let replace = Effect { add: [0.2, 0.3, 0.1], add_alpha: 0.4, thinness: 0.7, ..Effect::HIDE };
    let effects = vec![Effect::SHOW, Effect::HIDE, tint, replace, Effect::HIDE];
    frame.optional.segments =
        Some(SegmentsFrame { places: places.slices(), strides: [DIMS[0], DIMS[0] * DIMS[1]], effects, leave_out: true });
}

/// Gradients of some kind, opacity that depends on them, and light of some kind on them.
fn light_up(frame: &mut Frame<'_>, round: usize) {
    let grid = Grid::with_spacing(DIMS, [0.7, 1.3, 0.2]).expect("a grid");
    let kind = [Gradient::Central, Gradient::Analytic, Gradient::Sobel][round % 3];
    let gradient = GradientFrame::new(kind, &grid, 1.7);
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).expect("a function");
    let transfer = transfer.with_gradient_opacity(vec![(3.0, 0.0), (20.0, 0.7), (20.0, 0.2), (90.0, 1.0)]).expect("points in order");
    frame.optional.opacity = OpacityFrame::of(&transfer, &gradient);
    let mut lighting = Lighting::default();
    lighting.shininess = [1.0, 20.0, 7.5, 1000.0][round % 4];
    lighting.two_sided = round % 2 == 0;
    lighting.gradient_floor = if round % 5 < 2 { 12.0 } else { 0.0 };
    let sources =
        [LightSource::Head, LightSource::Direction(DVec3::ONE), LightSource::Position(grid.center()), LightSource::Position(DVec3::Y)];
    let lights = sources[..1 + round % 4].iter().map(|&source| Light::new(source, [0.9, 0.4, 0.7]).expect("a light")).collect();
    let lighting = lighting.with_lights(lights).expect("four at most");
    // From within the box: depths are those of the batches then.
    let place = Placement::LookAt { eye: grid.center(), target: grid.center() + DVec3::new(3.0, 1.0, round as f64), up: DVec3::Y };
    let projection = if round % 2 == 0 { Projection::Perspective { fov_y: 50.0 } } else { Projection::Orthographic { height: None } };
    let camera = Camera::new(place, projection).expect("a camera");
    let view = camera.resolve(&grid, 64, 48).expect("numbers within f64");
    frame.optional.light = Some(LightingFrame::new(&lighting, Some(&gradient), &grid, &Stack::new(&grid, &view, &[], 30)));
    frame.optional.gradient = Some(gradient);
}

fn texcoord(frame: &Frame<'_>, batch: &mut Batch) {
    Level::SCALAR.kernel::<Texcoord, Frame<'_>, Batch>()(frame, batch);
}
fn texcoord_far(frame: &Frame<'_>, batch: &mut Batch) {
    Level::SCALAR.kernel::<TexcoordFar, Frame<'_>, Batch>()(frame, batch);
}

/// Some values are NaN or infinite, some slices lie behind all others.
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
fn every_kernel_gives_the_same_bits_at_every_level() {
    use VoxelType::*;
    levels_agree::<Span>("span", &[], &[U8]);
    levels_agree::<ClassifyRegions>("regions", &[], &[U8]);
    levels_agree::<ApplySegments>("labels", &[], &[U8]);
    levels_agree::<HideSegments>("labels of projections", &[], &[U8]);
    levels_agree::<Texcoord>("texcoord", &[], &[U8]);
    levels_agree::<TexcoordFar>("texcoord far", &[], &[U8]);
    levels_agree::<FetchPairs8>("fetch 8", &[texcoord], &[U8, I8]);
    levels_agree::<FetchPairs16>("fetch 16", &[texcoord], &[U16, I16]);
    levels_agree::<FetchPairs32>("fetch 32", &[texcoord], &[U32, I32, F32]);
    levels_agree::<FetchAny<false>>("fetch any", &[texcoord], &VoxelType::ALL);
    levels_agree::<FetchAny<true>>("fetch far", &[texcoord_far], &VoxelType::ALL);
    levels_agree::<Guard>("guard", &[pairs], &[U8]);
    levels_agree::<TexcoordPart<false>>("texcoord of a part", &[], &[U8]);
    levels_agree::<TexcoordPart<true>>("texcoord far of a part", &[], &[U8]);
    levels_agree::<FetchCorners<false>>("fetch corners", &[texcoord], &VoxelType::ALL);
    levels_agree::<FetchCorners<true>>("fetch corners far", &[texcoord_far], &VoxelType::ALL);
    levels_agree::<Classify<false>>("classify", &[], &[U8]);
    levels_agree::<Classify<true>>("classify in two steps", &[], &[U8]);
    levels_agree::<Correct<false>>("correct", &[], &[U8]);
    levels_agree::<Correct<true>>("correct some", &[], &[U8]);
    levels_agree::<CorrectPieces>("correct pieces", &[], &[U8]);
    levels_agree::<FogPlanar>("planar fog", &[], &[U8]);
    levels_agree::<FogRadial>("radial fog", &[], &[U8]);
    levels_agree::<MaskStage>("mask", &[], &[U8]);
    levels_agree::<BlendFront<Plain, true>>("front to back", &[], &[U8]);
    levels_agree::<BlendFront<Plain, false>>("front to back to the end", &[], &[U8]);
    levels_agree::<BlendBack<Plain>>("back to front", &[], &[U8]);
    levels_agree::<BlendFront<Compensated, true>>("front to back, compensated", &[], &[U8]);
    levels_agree::<BlendFront<Compensated, false>>("front to back to the end, compensated", &[], &[U8]);
    levels_agree::<BlendBack<Compensated>>("back to front, compensated", &[], &[U8]);
    levels_agree::<BlendFront<Unorm8, true>>("front to back in 8 bits", &[], &[U8]);
    levels_agree::<BlendFront<Unorm8, false>>("front to back to the end in 8 bits", &[], &[U8]);
    levels_agree::<BlendBack<Unorm8>>("back to front in 8 bits", &[], &[U8]);
    levels_agree::<SpanPair>("span of pairs", &[], &[U8]);
    levels_agree::<KeepValue>("keep", &[], &[U8]);
    levels_agree::<FogEach>("fog of each", &[], &[U8]);
    levels_agree::<ClassifyPair<false, false, false>>("classify pairs", &[pairs], &[U8]);
    levels_agree::<ClassifyPair<false, true, false>>("classify pairs, second order", &[pairs], &[U8]);
    levels_agree::<ClassifyPair<true, false, true>>("classify pairs in two steps, fine", &[pairs], &[U8]);
    levels_agree::<ClassifyPair<true, true, true>>("classify pairs in two steps, second order, fine", &[pairs], &[U8]);
    levels_agree::<FetchNearest<false>>("fetch nearest", &[texcoord], &VoxelType::ALL);
    levels_agree::<FetchNearest<true>>("fetch nearest far", &[texcoord_far], &VoxelType::ALL);
    levels_agree::<CorrectRiemann>("correct riemann", &[], &[U8]);
    levels_agree::<ClassifyCorners<false>>("classify corners", &[texcoord, corners], &VoxelType::ALL);
    levels_agree::<ClassifyCorners<true>>("classify corners in two steps", &[texcoord_far, corners_far], &VoxelType::ALL);
    levels_agree::<ProjectMax>("max", &[], &[U8]);
    levels_agree::<ProjectMin>("min", &[], &[U8]);
    levels_agree::<ProjectAverage>("average", &[], &[U8]);
    levels_agree::<ProjectAdd>("add", &[], &[U8]);
    levels_agree::<ProjectAttenuated>("attenuated", &[], &[U8]);
    levels_agree::<ProjectLmip>("lmip", &[], &[U8]);
    levels_agree::<ProjectIso>("iso", &[], &[U8]);
    levels_agree::<TakeGradient>("gradient", &[texcoord], &VoxelType::ALL);
    levels_agree::<WeighByGradient>("gradient opacity", &[], &[U8]);
    levels_agree::<Shade>("light", &[], &[U8]);
    levels_agree::<ShadeEach<false>>("light at own depths", &[texcoord], &[U8]);
    levels_agree::<ShadeAlong>("light along rays", &[], &[U8]);
    levels_agree::<FogAlong>("fog along rays", &[], &[U8]);
    levels_agree::<TexcoordRays<false>>("texcoord along rays", &[], &[U8]);
    levels_agree::<TexcoordRays<true>>("texcoord far along rays", &[], &[U8]);
    levels_agree::<CueDepth>("depth", &[], &[U8]);
    levels_agree::<CueEach<false>>("depth of each", &[texcoord], &[U8]);
}

/// The values that lookup `run` gives the batch `start`, as bits.
fn values_by<'v>(start: &Batch, frame: &Frame<'v>, run: Run<'v>) -> Vec<u64> {
    let mut b = start.clone();
    run(frame, &mut b);
    Part::Value.bits(&b)
}

/// Which lookup a plan takes for voxels (packed, pairs or single ones) changes no bit of their values.
#[test]
fn all_lookups_of_a_voxel_type_give_the_same_bits() {
    let mut n = Numbers::new(11);
    for kind in VoxelType::ALL {
        let voxels = voxels(kind, DIMS, &mut n);
        let mut frame = frame(&voxels, &mut n);
        let packed = Packed::new(&voxels, DIMS);
        for _ in 0..30 {
            let mut start = batch(&mut n);
            texcoord(&frame, &mut start);
            let want = values_by(&start, &frame, Level::SCALAR.kernel::<FetchAny<false>, Frame<'_>, Batch>());
            for level in Level::available() {
                let pairs: Option<Run<'_>> = match kind {
                    VoxelType::U8 | VoxelType::I8 => Some(level.kernel::<FetchPairs8, Frame<'_>, Batch>()),
                    VoxelType::U16 | VoxelType::I16 => Some(level.kernel::<FetchPairs16, Frame<'_>, Batch>()),
                    VoxelType::U32 | VoxelType::I32 | VoxelType::F32 => Some(level.kernel::<FetchPairs32, Frame<'_>, Batch>()),
                    VoxelType::F64 => None,
                };
                if let Some(pairs) = pairs {
                    assert_eq!(values_by(&start, &frame, pairs), want, "pairs of {kind} at {}", level.name());
                }
                if let Some(packed) = &packed {
                    let [row, layer] = packed.strides;
                    assert_eq!([row, layer], [DIMS[0], DIMS[0] * DIMS[1]], "offsets of the other lookups serve");
                    let run: Run<'_> = match packed.pairs {
                        PackedPairs::Of8(_) => level.kernel::<FetchPacked8, Frame<'_>, Batch>(),
                        PackedPairs::Of16(_) => level.kernel::<FetchPacked16, Frame<'_>, Batch>(),
                    };
                    frame.sample.packed = Some(packed);
                    assert_eq!(values_by(&start, &frame, run), want, "packed {kind} at {}", level.name());
                    frame.sample.packed = None;
                }
            }
        }
    }
}

/// Which loads a gradient takes, those of packed voxels or single ones, changes no bit of it.
#[test]
fn all_loads_of_a_gradient_give_the_same_bits() {
    let mut n = Numbers::new(12);
    let mut deep = 0;
    for kind in [VoxelType::U8, VoxelType::I8, VoxelType::U16, VoxelType::I16] {
        let voxels = voxels(kind, DIMS, &mut n);
        let packed = Packed::new(&voxels, DIMS).expect("small enough");
        let strides = [1, packed.strides[0], packed.strides[1]];
        assert_eq!(strides, [1, DIMS[0], DIMS[0] * DIMS[1]], "offsets of the other loads serve");
        for _ in 0..40 {
            let mut frame = frame(&voxels, &mut n);
            light_up(&mut frame, 0);
            let mut start = batch(&mut n);
            // Small steps: most batches lie inside.
            start.geometry.across = start.geometry.across.map(|x| 0.5 * x.abs());
            start.geometry.down = start.geometry.down.map(|x| 0.5 * x.abs());
            start.geometry.origin = start.geometry.origin.map(f32::abs);
            texcoord(&frame, &mut start);
            let of = |frame: &Frame<'_>, level: Level| {
                let mut b = start.clone();
                level.kernel::<TakeGradient, Frame<'_>, Batch>()(frame, &mut b);
                [Part::Normal, Part::Size].map(|part| part.bits(&b))
            };
            let want = of(&frame, Level::SCALAR);
            frame.sample.packed = Some(&packed);
            for level in Level::available() {
                assert_eq!(of(&frame, level), want, "packed {kind} at {}", level.name());
            }
            let inside = |i: usize| {
                let at = start.geometry.cells.base + start.sample.offset[i] as usize;
                let cell = [at % DIMS[0], at / DIMS[0] % DIMS[1], at / (DIMS[0] * DIMS[1])];
                (0..3).all(|a| cell[a] >= 1 && cell[a] + 3 <= DIMS[a])
            };
            deep += u32::from((0..BATCH).all(inside));
        }
    }
    assert!(deep > 20, "{deep}");
}
