//! Media whose colour has a closed form.

use super::oracle::Oracle;
use super::{PARALLEL, cameras, constant, fill, grids, orbit, render};
use glam::DVec3;
use slicestack::reference::closed::{constant_color, equal_slices, extinction, linear_color, opacity, ramp_depth};
use slicestack::scene::{Camera, ClipPlane, Order, Placement, Projection, Slicing, Straight, TransferFunction};
use slicestack::volume::{BoxConvention, Grid, VoxelType, Voxels};
use slicestack::{Scene, Volume};

#[test]
fn constant_media_are_exact_in_every_view() {
    let rgb = [0.2, 0.9, 0.55];
    let mut pixels = 0;
    for grid in grids() {
        let cut = ClipPlane::new(DVec3::new(0.4, -0.7, 0.6), DVec3::new(0.4, -0.7, 0.6).dot(grid.center()) - 0.2 * grid.radius()).unwrap();
        let volume = Volume::new(grid.clone(), Voxels::zeros(VoxelType::U8, grid.voxel_count())).unwrap();
        for camera in cameras(&grid) {
            for (a, count, order, planes) in [
                (0.0, 7, Order::FrontToBack, vec![]),
                (1e-5, 500, Order::FrontToBack, vec![]),
                (0.1, 1, Order::FrontToBack, vec![]),
                (0.2, 37, Order::BackToFront, vec![cut]),
                (0.35, 20, Order::FrontToBack, vec![cut]),
                (0.6, 300, Order::FrontToBack, vec![]),
                (1.0, 11, Order::BackToFront, vec![]),
                (1.0, 64, Order::FrontToBack, vec![cut]),
            ] {
                let scene = Scene::new(constant(rgb, a)).with_camera(camera).with_size(26, 19).unwrap();
                let scene = scene.with_opacity_unit(0.3 * grid.radius()).unwrap().with_slices(Slicing::Count(count)).unwrap();
                let scene = scene.with_terminate(0.0).unwrap().with_order(order).with_clip_planes(planes).unwrap();
                let oracle = Oracle::new(&volume, &scene);
                let (picture, stats) = render(&volume, &scene);
                let mut fragments = 0;
                for y in 0..19 {
                    for x in 0..26 {
                        let covered = oracle.covering(x, y).len();
                        fragments += covered as u64;
                        let (wx, wy) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                        let (entry, exit) = oracle.path(wx, wy);
                        let length = (exit - entry) * oracle.stack.view.ray(wx, wy).1.length();
                        let tau = if exit > entry { extinction(a, 0.3 * grid.radius()) * length } else { 0.0 };
                        let tau = if a == 0.0 { 0.0 } else { tau };
                        let want = [constant_color(rgb[0], tau), constant_color(rgb[1], tau), constant_color(rgb[2], tau), opacity(tau)];
                        // Every slab rounds its opacity, every blend its sum.
                        let rounding = 2e-6 + count as f64 * 1.2e-7;
                        for (got, want) in picture.pixel(x, y).iter().zip(want) {
                            let e = (f64::from(*got) - want).abs();
                            assert!(e <= rounding, "({x},{y}): {got} not {want}, a = {a}, {count} slices, {:?}", oracle.stack.view);
                        }
                        pixels += u64::from(covered > 0);
                    }
                }
                assert_eq!((stats.fragments, stats.slices), (fragments, count));
            }
        }
    }
    assert!(pixels > 20_000, "{pixels}");
}

/// A camera that looks along +x at a box with its node faces across the view.
fn along_x(grid: &Grid) -> Camera {
    let eye = grid.center() - DVec3::X * 2.0 * grid.radius();
    let placement = Placement::LookAt { eye, target: grid.center(), up: DVec3::Z };
    Camera::new(placement, Projection::Orthographic { height: Some(2.0) }).unwrap()
}

#[test]
fn equal_slices_multiply_what_they_let_through() {
    let grid = Grid::with_spacing([5, 5, 5], [1.0; 3]).unwrap();
    let volume = Volume::new(grid.clone(), Voxels::zeros(VoxelType::I16, 125)).unwrap();
    for (count, a) in [(1, 0.3), (10, 0.05), (5, 0.999), (4000, 0.0005), (5, 1.0)] {
        let scene = Scene::new(constant([1.0, 0.5, 0.25], a)).with_camera(along_x(&grid)).with_size(3, 3).unwrap();
        let scene = scene.with_slices(Slicing::Count(count)).unwrap().with_opacity_unit(5.0 / count as f64).unwrap();
        let (picture, _) = render(&volume, &scene.with_terminate(0.0).unwrap());
        let want = equal_slices(a, count);
        for p in picture.pixels() {
            for (got, want) in p.iter().zip([want, 0.5 * want, 0.25 * want, want]) {
                assert!((f64::from(*got) - want).abs() < 2e-7 + count as f64 * 6e-8, "{count} slices of {a}: {got} not {want}");
            }
        }
    }
}

#[test]
fn a_ramp_of_extinction_has_the_depth_of_its_mean() {
    // Value x from 0 to 16 between nodes; the extinction k0 + k1 x as finely spaced opacities: the midpoint rule is exact.
    let grid = Grid::with_spacing([17, 3, 3], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = Volume::new(grid.clone(), fill::<f64>([17, 3, 3], &|[x, ..]| 8.0 + 8.0 * x)).unwrap();
    let (k0, k1) = (0.02, 0.03);
    let points = (0..=512).map(|i| f64::from(i) / 32.0).map(|x| (x, opacity(k0 + k1 * x))).collect();
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], points).unwrap();
    for count in [1, 4, 16, 100] {
        let scene = Scene::new(transfer.clone()).with_camera(along_x(&grid)).with_size(4, 4).unwrap();
        let scene = scene.with_slices(Slicing::Count(count)).unwrap().with_terminate(0.0).unwrap();
        let (picture, _) = render(&volume, &scene);
        let want = opacity(ramp_depth(k0, k1, 16.0));
        for p in picture.pixels() {
            assert!(p.iter().all(|c| (f64::from(*c) - want).abs() < 1e-5), "{count} slices: {p:?} not {want}");
        }
    }
}

#[test]
fn an_even_change_of_colour_has_its_closed_form() {
    let grid = Grid::with_spacing([9, 3, 3], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = Volume::new(grid.clone(), fill::<f32>([9, 3, 3], &|[x, ..]| x)).unwrap();
    let transfer = TransferFunction::new(vec![(-1.0, [0.1, 0.9, 0.5]), (1.0, [1.0, 0.2, 0.5])], vec![(0.0, 0.2)]).unwrap();
    let tau = extinction(0.2, 1.0) * 8.0;
    let want = [linear_color(0.1, 1.0, tau), linear_color(0.9, 0.2, tau), linear_color(0.5, 0.5, tau), opacity(tau)];
    let scene = Scene::new(transfer).with_camera(along_x(&grid)).with_size(4, 4).unwrap().with_terminate(0.0).unwrap();
    let (picture, _) = render(&volume, &scene.with_slices(Slicing::Count(512)).unwrap());
    for p in picture.pixels() {
        assert!((0..4).all(|c| (f64::from(p[c]) - want[c]).abs() < 2e-5), "{p:?} not {want:?}");
    }
}

#[test]
fn media_are_composed_over_the_background() {
    let grid = Grid::with_spacing([4, 4, 4], [1.0; 3]).unwrap();
    let volume = Volume::new(grid, Voxels::zeros(VoxelType::U16, 64)).unwrap();
    let scene = Scene::new(constant([0.8, 0.1, 0.4], 0.1)).with_camera(orbit(20.0, 10.0, 0.7, PARALLEL)).with_size(16, 16).unwrap();
    let alone = render(&volume, &scene).0;
    let back = Straight { rgb: [0.3, 0.6, 1.0], alpha: 0.5 };
    let over = render(&volume, &scene.with_background(back).unwrap()).0;
    for (a, b) in alone.pixels().iter().zip(over.pixels()) {
        let t = 1.0 - a[3];
        for c in 0..3 {
            assert!((b[c] - (a[c] + t * (back.rgb[c] * 0.5) as f32)).abs() < 1e-6);
        }
        assert!((b[3] - (1.0 - t * 0.5)).abs() < 1e-6);
    }
}
