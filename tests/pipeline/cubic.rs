//! The tricubic spline, from file of voxels to picture.

use super::convergence::{errors, island, order, smooth_transfer};
use super::{PARALLEL, WIDE, cameras, difference, fill_as, grids, oblique, orbit, render, smooth, telling};
use slicestack::reference::{Region, image};
use slicestack::scene::{Blend, Classification, Filter, Method, Slicing};
use slicestack::volume::{Grid, VoxelType, Voxels};
use slicestack::{Error, Limits, Renderer, Scene, Settings, Volume};

const SMOOTHED: Filter = Filter::Cubic { prefilter: false };

fn cubic(scene: Scene, filter: Filter) -> Scene {
    scene.with_method(Method::default().with_filter(filter)).unwrap()
}

#[test]
fn errors_fall_with_the_square_of_the_number_of_slices() {
    let volume = island();
    let counts = [24, 34, 48, 68, 96];
    for (what, filter, camera) in [
        ("cubic, parallel", Filter::CUBIC, orbit(33.0, 21.0, 1.2, PARALLEL)),
        ("smoothed, perspective", SMOOTHED, orbit(110.0, -35.0, 1.2, WIDE)),
    ] {
        let scene = Scene::new(smooth_transfer(0.0)).with_opacity_unit(4.0).unwrap().with_camera(camera);
        let scene = cubic(scene.with_terminate(0.0).unwrap().with_size(24, 20).unwrap(), filter);
        let found = errors(&volume, &scene, &counts);
        let order = order(&counts, &found);
        println!("{what}: order {order:.3}, errors {found:?}");
        // The field is so smooth that few slices are better than their order.
        assert!((1.85..2.35).contains(&order), "{what}: order {order}, errors {found:?}");
    }
}

#[test]
fn slabs_of_second_order_see_the_spline_s_smoothness() {
    // Cells about as large as slabs: between them the trilinear field has kinks, the spline has none.
    let field = |[x, y, z]: [f64; 3]| 2048.0 * (1.0 + (2.0 * x + 0.3).sin() * (1.5 * y - z).cos());
    let volume = Volume::new(oblique([20, 18, 16]), fill_as(VoxelType::F64, [20, 18, 16], &field)).unwrap();
    let scene = Scene::new(smooth_transfer(0.0)).with_opacity_unit(4.0).unwrap().with_camera(orbit(33.0, 21.0, 3.0, PARALLEL));
    let scene = scene.with_size(24, 20).unwrap().with_terminate(0.0).unwrap();
    let counts = [24, 48, 96];
    let second = |filter| {
        let method = Method::default().with_classification(Classification::SecondOrder).with_filter(filter);
        let found = errors(&volume, &scene.clone().with_method(method).unwrap(), &counts);
        (order(&counts, &found), found)
    };
    let (spline, kinks) = (second(Filter::CUBIC), second(Filter::Linear));
    println!("second order: spline {spline:?}, trilinear {kinks:?}");
    assert!(spline.0 > 2.5, "{spline:?}");
}

#[test]
fn many_slices_come_close_to_the_reference() {
    let stiff = |kind, dims, scale: f64, offset: f64| {
        let voxels = fill_as(kind, dims, &|p| offset + scale * smooth(p));
        (Volume::new(oblique(dims), voxels).unwrap(), telling(offset, offset + scale))
    };
    let mut holes = match fill_as(VoxelType::F32, [12, 11, 10], &smooth) {
        Voxels::F32(v) => v,
        _ => unreachable!(),
    };
    holes[5 * 132 + 4 * 12 + 6] = f32::NAN;
    holes[2 * 132..2 * 132 + 12].fill(f32::INFINITY);
    let grid = Grid::with_spacing([12, 11, 10], [1.0, 0.8, 1.1]).unwrap();
    let cases = [
        ("u8", stiff(VoxelType::U8, [12, 11, 10], 255.0, 0.0)),
        ("i16, far from 0", stiff(VoxelType::I16, [9, 8, 7], 900.0, 30_000.0)),
        ("u32", stiff(VoxelType::U32, [8, 9, 7], 4e9, 1e8)),
        ("f32, huge", stiff(VoxelType::F32, [8, 9, 7], 3e38, 0.0)),
        ("f64, far from 0", stiff(VoxelType::F64, [8, 9, 7], 1.0, 1e4)),
        ("f64, huge", stiff(VoxelType::F64, [8, 9, 7], 1e300, -5e299)),
        ("one voxel along x", stiff(VoxelType::F32, [1, 9, 8], 1.0, 0.0)),
        ("one voxel along z", stiff(VoxelType::U16, [9, 8, 1], 60_000.0, 0.0)),
        ("two voxels along each axis", stiff(VoxelType::F32, [2, 2, 2], 1.0, 0.0)),
        ("a single voxel", stiff(VoxelType::F32, [1, 1, 1], 1.0, 0.0)),
        ("holes", (Volume::new(grid, Voxels::F32(holes)).unwrap(), telling(0.0, 1.0))),
    ];
    for (i, (what, (volume, transfer))) in cases.into_iter().enumerate() {
        for (filter, camera) in
            [(Filter::CUBIC, orbit(30.0 + 10.0 * i as f64, 20.0, 1.2, PARALLEL)), (SMOOTHED, orbit(200.0, -50.0, 1.3, WIDE))]
        {
            let scene = Scene::new(transfer.clone()).with_camera(camera).with_size(14, 12).unwrap().with_terminate(0.0).unwrap();
            let scene = cubic(scene.with_slices(Slicing::Count(1500)).unwrap(), filter);
            let want = image(&scene, &volume, Region::whole(&scene)).unwrap();
            assert!(want.error_bound() < 1e-9, "{what}: {}", want.error_bound());
            let off = difference(&render(&volume, &scene).0, want.pixels());
            println!("{what} {filter:?}: off by {off:.1e}");
            // The field ends at once where a cell mixes a hole.
            let most = if what == "holes" { 3e-3 } else { 1e-4 };
            assert!(off < most, "{what}, {filter:?}: off by {off}");
        }
    }
}

#[test]
fn every_camera_and_clip_plane_meets_the_spline() {
    for grid in grids() {
        let volume = Volume::new(grid.clone(), fill_as(VoxelType::F32, grid.dims(), &smooth)).unwrap();
        for camera in cameras(&grid) {
            let scene = Scene::new(telling(0.0, 1.0)).with_camera(camera).with_size(16, 12).unwrap().with_terminate(0.0).unwrap();
            let scene = cubic(scene.with_slices(Slicing::Count(1500)).unwrap(), Filter::CUBIC);
            let want = image(&scene, &volume, Region::whole(&scene)).unwrap();
            let off = difference(&render(&volume, &scene).0, want.pixels());
            assert!(off < 1e-3, "{camera:?}: off by {off}");
        }
    }
}

/// What kind of voxels hold the numbers, and whether they would be packed for other lookups, changes no bit.
#[test]
fn equal_numbers_of_every_type_give_the_same_picture() {
    let dims = [17, 13, 11];
    let scene = Scene::new(telling(0.0, 100.0)).with_camera(orbit(30.0, 20.0, 1.2, WIDE)).with_size(40, 30).unwrap();
    let values = |p: [f64; 3]| (100.0 * smooth(p)).round();
    for method in [
        Method::default().with_filter(Filter::CUBIC),
        Method::default().with_filter(SMOOTHED).with_classification(Classification::PreIntegrated),
    ] {
        let scene = scene.clone().with_method(method).unwrap();
        let of = |kind| render(&Volume::new(oblique(dims), fill_as(kind, dims, &values)).unwrap(), &scene).0;
        let want = of(VoxelType::F64);
        assert!(want.pixels().iter().any(|p| p[3] > 0.2));
        for kind in VoxelType::ALL {
            assert!(of(kind) == want, "{kind} {method:?}");
        }
        // Voxels the other way round, turned back by a negative slope.
        let negative = fill_as(VoxelType::I16, dims, &|p| -values(p));
        let turned = Volume::new(oblique(dims), negative).unwrap().with_rescale(-1.0, 0.0).unwrap();
        let off = difference(&render(&turned, &scene).0, &want.pixels().iter().map(|p| p.map(f64::from)).collect::<Vec<_>>());
        assert!(off < 1e-5, "{off}");
    }
}

/// A spline goes through its voxels: rays along a row of them see their values, also where those leave the range between them.
#[test]
fn projections_show_the_spline_s_own_values() {
    // A step: the spline swings past both sides.
    let dims = [16, 3, 3];
    let voxels = fill_as(VoxelType::U8, dims, &|[x, _, _]| if x > 0.0 { 200.0 } else { 100.0 });
    let volume = Volume::new(Grid::with_spacing(dims, [1.0; 3]).unwrap(), voxels).unwrap();
    let grey = slicestack::scene::TransferFunction::new(vec![(0.0, [0.0; 3]), (256.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap();
    let scene = Scene::new(grey).with_size(9, 9).unwrap().with_slices(Slicing::Count(4000)).unwrap();
    // Along x.
    let scene = scene.with_camera(orbit(-90.0, 0.0, 1.0, PARALLEL));
    let shown = |filter, blend| {
        let scene = cubic(scene.clone(), filter).with_blend(blend).unwrap();
        f64::from(render(&volume, &scene).0.pixel(4, 4)[0]) * 256.0
    };
    assert!((shown(Filter::Linear, Blend::Mip) - 200.0).abs() < 0.1);
    let (most, least) = (shown(Filter::CUBIC, Blend::Mip), shown(Filter::CUBIC, Blend::Min));
    println!("the spline through a step from 100 to 200 runs from {least} to {most}");
    assert!(most > 205.0 && most < 215.0 && (most + least - 300.0).abs() < 0.5, "{least} to {most}");
    assert!((shown(SMOOTHED, Blend::Mip) - 200.0).abs() < 0.1);
}

#[test]
fn a_renderer_keeps_the_coefficients_it_last_used() {
    let dims = [40, 36, 32];
    let volume = Volume::new(oblique(dims), fill_as(VoxelType::U16, dims, &|p| 1000.0 * smooth(p))).unwrap();
    let scene = Scene::new(telling(0.0, 1000.0)).with_camera(orbit(30.0, 20.0, 1.2, WIDE)).with_size(40, 30).unwrap();
    let mut renderer = Renderer::new(&volume, Settings::default());
    let mut shown = Vec::new();
    for filter in [Filter::Linear, Filter::CUBIC, SMOOTHED, Filter::Linear, Filter::CUBIC, Filter::CUBIC, Filter::Nearest, SMOOTHED] {
        let scene = cubic(scene.clone(), filter);
        let (kept, stats) = renderer.render(&scene).unwrap();
        assert!(kept == render(&volume, &scene).0, "{filter:?} after {shown:?}");
        if shown.last() == Some(&filter) {
            assert_eq!(stats.prepare_seconds, 0.0, "made anew");
        }
        shown.push(filter);
    }
}

#[test]
fn coefficients_over_the_limit_are_refused_in_one_line() {
    let volume = Volume::new(Grid::with_spacing([10; 3], [1.0; 3]).unwrap(), Voxels::U8(vec![3; 1000].into())).unwrap();
    let scene = Scene::new(telling(0.0, 10.0)).with_size(8, 8).unwrap();
    // 12 coefficients along each axis, of four bytes.
    let settings = |bytes| Settings::new().limits(Limits::new().voxel_bytes(bytes));
    let error = Renderer::new(&volume, settings(6911)).render(&cubic(scene.clone(), Filter::CUBIC)).unwrap_err();
    assert!(matches!(error, Error::Limit { needed: 6912, limit: 6911, .. }), "{error}");
    assert_eq!(error.to_string(), "render filter cubic: bytes of coefficients: 6912 is over the limit of 6911");
    Renderer::new(&volume, settings(6912)).render(&cubic(scene.clone(), Filter::CUBIC)).unwrap();
    Renderer::new(&volume, settings(1)).render(&scene).unwrap();
}
