#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;
use crate::volume::{BoxConvention, Grid, Space, Voxel, Voxels};
use glam::DMat3;

fn volume_of<T: Voxel>(grid: Grid, f: impl Fn([usize; 3]) -> T) -> Volume {
    let [nx, ny, nz] = grid.dims();
    let voxels: Vec<T> = (0..nx * ny * nz).map(|n| f([n % nx, n / nx % ny, n / (nx * ny)])).collect();
    Volume::new(grid, voxels.into()).unwrap()
}

/// Numbers without a pattern, 0 to 1.
fn noise(n: usize) -> f64 {
    (n.wrapping_mul(2_654_435_761) >> 7) as f64 % 1009.0 / 1008.0
}

/// The grey that `value` has in a window from `low` to `high`.
fn grey(value: f64, low: f64, high: f64) -> f32 {
    let colors = TransferFunction::new(ColorMap::Gray.spread(low, high), vec![(low, 1.0)]).unwrap();
    colors.eval(value).rgb[0] as f32
}

#[test]
fn a_cut_through_voxel_centres_shows_the_voxels_of_every_type_themselves() {
    fn check<T: Voxel>(scale: f64, offset: f64) {
        let grid = Grid::with_spacing([7, 5, 6], [0.5, 2.0, 3.0]).unwrap();
        let volume = volume_of(grid.clone(), |[i, j, k]| T::from_f64(offset + scale * noise(i + 7 * j + 35 * k)));
        let volume = volume.with_rescale(-0.5, 3.0).unwrap();
        let (low, high) = (-0.5 * (offset + 0.8 * scale) + 3.0, -0.5 * (offset + 0.1 * scale) + 3.0);
        let window = Window::new(0.5 * low + 0.5 * high, high - low).unwrap();
        let (low, high) = window.range();
        for (orientation, layers) in [(Orientation::Axial, 6), (Orientation::Coronal, 5), (Orientation::Sagittal, 7)] {
            for layer in 0..layers {
                let frame = Frame::new(&grid, orientation).unwrap();
                let offset = frame.offset_of_layer(&grid, layer).unwrap();
                let sheet = Sheet::new(&grid, orientation, vec![offset]).unwrap().with_filter(Filter::Nearest).with_window(window);
                // Voxels are as many times half a unit long as this.
                let size = match orientation {
                    Orientation::Axial => (7, 20),
                    Orientation::Coronal => (7, 36),
                    _ => (20, 36),
                };
                let drawn = sheet.with_size(size.0, size.1).unwrap().draw(&volume).unwrap();
                assert_eq!(drawn.layout.scale(), 0.5);
                for y in 0..size.1 {
                    for x in 0..size.0 {
                        let (x3, y3) = (x as usize, y as usize);
                        let voxel = match orientation {
                            Orientation::Axial => [x3, y3 / 4, layer],
                            Orientation::Coronal => [x3, layer, 5 - y3 / 6],
                            _ => [layer, x3 / 4, 5 - y3 / 6],
                        };
                        let want = grey(volume.value(voxel), low, high);
                        assert_eq!(drawn.picture.pixel(x, y), [want, want, want, 1.0], "{} {orientation:?} {x},{y}", T::TYPE);
                    }
                }
            }
        }
    }
    check::<u8>(255.0, 0.0);
    check::<i8>(250.0, -125.0);
    check::<u16>(65_535.0, 0.0);
    check::<i16>(60_000.0, -30_000.0);
    check::<u32>(4e9, 0.0);
    check::<i32>(4e9, -2e9);
    check::<f32>(1.0, -0.5);
    check::<f64>(1e-3, 1e6);
}

/// A grid askew in the world, each axis with a spacing of its own.
fn askew() -> Grid {
    let (s, c) = libm::sincos(0.6);
    let turn = DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z);
    let (s, c) = libm::sincos(-0.4);
    let tilt = DMat3::from_cols(DVec3::X, DVec3::new(0.0, c, s), DVec3::new(0.0, -s, c));
    let steps = turn * tilt * DMat3::from_diagonal(DVec3::new(0.5, 1.25, 2.0));
    Grid::new([33, 17, 12], DVec3::new(3.0, -20.0, 7.0), steps).unwrap()
}

#[test]
fn the_cut_of_a_ramp_is_a_ramp_for_linear_and_cubic_lookups() {
    let grid = askew();
    let (slope, at_origin) = (DVec3::new(0.3, -0.7, 0.2), 4.0);
    let to_world = grid.index_to_world();
    let ramp = |p: DVec3| at_origin + slope.dot(p);
    let volume = volume_of(grid.clone(), |v| ramp(to_world.transform_point3(DVec3::from_array(v.map(|n| n as f64)))));
    for filter in [Filter::Linear, Filter::CUBIC] {
        // Off the middle, where the spline's mirrored border is felt no more.
        let inner = if filter == Filter::Linear { 0.0 } else { 4.0 };
        for orientation in
            [Orientation::Axial, Orientation::Coronal, Orientation::Sagittal, Orientation::Oblique(DVec3::new(1.0, -2.0, 3.0))]
        {
            let offset = Frame::new(&grid, orientation).unwrap().offset_at(&grid, 0.5);
            let sheet = Sheet::new(&grid, orientation, vec![offset]).unwrap().with_filter(filter);
            let window = Window::new(ramp(grid.center()), 100.0).unwrap();
            let drawn = sheet.with_window(window).with_size(60, 50).unwrap().draw(&volume).unwrap();
            let (low, high) = window.range();
            let mut seen = 0;
            for y in 0..50 {
                for x in 0..60 {
                    let world = drawn.layout.world(f64::from(x) + 0.5, f64::from(y) + 0.5).unwrap();
                    let index = grid.world_to_index().transform_point3(world);
                    let last = DVec3::new(32.0, 16.0, 11.0);
                    let got = drawn.picture.pixel(x, y);
                    if index.cmpge(DVec3::splat(inner)).all() && index.cmple(last - inner).all() {
                        seen += 1;
                        assert!((got[0] - grey(ramp(world), low, high)).abs() < 2e-6 + 1e-4 * inner as f32, "{filter:?} {orientation:?}");
                        assert_eq!(got[3], 1.0);
                    } else if index.cmplt(DVec3::splat(-0.5)).any() || index.cmpgt(last + 0.5).any() {
                        assert_eq!(got, [0.0; 4]);
                    }
                }
            }
            assert!(seen > 30, "{filter:?} {orientation:?}: {seen}");
        }
    }
}

#[test]
fn an_oblique_cut_across_a_plane_wave_is_of_one_value_and_along_it_a_wave() {
    let grid = Grid::with_spacing([48, 40, 44], [0.5, 0.6, 0.55]).unwrap();
    let direction = DVec3::new(1.0, 2.0, -2.0) / 3.0;
    let wave = |p: DVec3| libm::sin(0.5 * direction.dot(p));
    let to_world = grid.index_to_world();
    let volume = volume_of(grid.clone(), |v| wave(to_world.transform_point3(DVec3::from_array(v.map(|n| n as f64)))));
    let window = Window::new(0.0, 2.0).unwrap();
    let cut = |normal: DVec3, offset: f64| {
        let sheet = Sheet::new(&grid, Orientation::Oblique(normal), vec![offset]).unwrap().with_window(window).with_filter(Filter::CUBIC);
        sheet.with_size(40, 40).unwrap().draw(&volume).unwrap()
    };
    let (across, along) = (cut(direction * 7.0, 5.0), cut(DVec3::new(2.0, 1.0, 2.0), grid.center().dot(DVec3::new(2.0, 1.0, 2.0) / 3.0)));
    let mut values = Vec::new();
    for (drawn, flat) in [(&across, true), (&along, false)] {
        for y in 0..40 {
            for x in 0..40 {
                let world = drawn.layout.world(f64::from(x) + 0.5, f64::from(y) + 0.5).unwrap();
                let index = grid.world_to_index().transform_point3(world);
                if index.cmpge(DVec3::splat(4.0)).all() && index.cmple(DVec3::new(43.0, 35.0, 39.0)).all() {
                    let got = f64::from(drawn.picture.pixel(x, y)[0]) * 2.0 - 1.0;
                    assert!((got - if flat { libm::sin(2.5) } else { wave(world) }).abs() < 2e-4, "{x},{y}: {got}");
                    values.push(got);
                }
            }
        }
    }
    assert!(values.len() > 500 && values.iter().any(|v| *v < -0.9) && values.iter().any(|v| *v > 0.9));
}

#[test]
fn pictures_are_turned_as_radiologists_expect() {
    for (space, to_left, to_front) in [(Space::Lps, DVec3::X, DVec3::NEG_Y), (Space::Ras, DVec3::NEG_X, DVec3::Y)] {
        let grid = Grid::with_spacing([4, 4, 4], [1.0; 3]).unwrap().with_space(space);
        let axes = |o| Frame::new(&grid, o).map(|f| (f.right, f.up, f.onward)).unwrap();
        assert_eq!(axes(Orientation::Axial), (to_left, to_front, DVec3::Z));
        assert_eq!(axes(Orientation::Coronal), (to_left, DVec3::Z, to_front));
        assert_eq!(axes(Orientation::Sagittal), (-to_front, DVec3::Z, to_left));
        // Seen from the feet: the axial picture. Seen from the front: the coronal one.
        let same = |a: (DVec3, DVec3, DVec3), b: (DVec3, DVec3, DVec3)| a.0.distance(b.0) + a.1.distance(b.1) < 1e-12;
        assert!(same(axes(Orientation::Oblique(DVec3::NEG_Z)), axes(Orientation::Axial)));
        assert!(same(axes(Orientation::Oblique(to_front)), axes(Orientation::Coronal)));
        assert!(same(axes(Orientation::Oblique(to_left)), axes(Orientation::Sagittal)));
    }
    let unknown = Grid::with_spacing([4, 4, 4], [1.0; 3]).unwrap();
    let frame = Frame::new(&unknown, Orientation::Coronal).unwrap();
    assert_eq!((frame.right, frame.up, frame.axis, frame.onward), (DVec3::X, DVec3::Z, DVec3::Y, DVec3::Y));
    assert_eq!((frame.position(-1.25), frame.position(-0.01)), ("y -1.2".to_owned(), "y 0.0".to_owned()));
    let ras = Frame::new(&unknown.with_space(Space::Ras), Orientation::Coronal).unwrap();
    assert_eq!((ras.position(-3.0), ras.position(2.5)), ("P 3.0 mm".to_owned(), "A 2.5 mm".to_owned()));
}

#[test]
fn shares_run_towards_superior_anterior_and_left() {
    let grid = Grid::with_spacing([10, 20, 30], [1.0; 3]).unwrap();
    let at = |space, o, share| {
        let grid = grid.clone().with_space(space);
        Frame::new(&grid, o).unwrap().offset_at(&grid, share)
    };
    assert_eq!(at(Space::Lps, Orientation::Coronal, 0.0), 19.5);
    assert_eq!(at(Space::Ras, Orientation::Coronal, 0.0), -0.5);
    assert_eq!(at(Space::Unknown, Orientation::Coronal, 0.25), 4.5);
    assert_eq!(at(Space::Ras, Orientation::Sagittal, 1.0), -0.5);
    assert_eq!(at(Space::Lps, Orientation::Axial, 0.5), 14.5);
    let frame = Frame::new(&grid, Orientation::Axial).unwrap();
    assert_eq!(frame.offset_of_layer(&grid, 29).unwrap(), 29.0);
    let why = frame.offset_of_layer(&grid, 30).unwrap_err().to_string();
    assert_eq!(why, "layer 30: the volume has 30 along its z axis, counted from 0");
}

#[test]
fn many_cuts_stand_side_by_side_and_are_each_the_single_one() {
    let grid = Grid::with_spacing([12, 10, 9], [1.0; 3]).unwrap();
    let volume = volume_of(grid.clone(), |[i, j, k]| (i * j + 7 * k) as u8);
    let window = Window::new(60.0, 120.0).unwrap();
    let sheet = |offsets: Vec<f64>| Sheet::new(&grid, Orientation::Axial, offsets).unwrap().with_window(window);
    let many =
        sheet(vec![0.0, 3.3, 4.0, 8.0, 8.5]).with_columns(3).unwrap().with_size(3 * 24 + 4, 2 * 20 + 2).unwrap().draw(&volume).unwrap();
    assert_eq!(many.layout.cells(), (3, 2));
    for (n, &offset) in many.layout.offsets().iter().enumerate() {
        let [left, top, width, height] = many.layout.cell(n);
        let one = sheet(vec![offset]).with_size(width, height).unwrap().draw(&volume).unwrap();
        for y in 0..height {
            for x in 0..width {
                assert_eq!(many.picture.pixel(left + x, top + y), one.picture.pixel(x, y), "cut {n}");
            }
        }
    }
    // Between the cuts, and where the sixth would stand.
    assert_eq!((many.picture.pixel(24, 5), many.picture.pixel(70, 30)), ([0.0; 4], [0.0; 4]));
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let grid = askew();
    let volume = volume_of(grid.clone(), |[i, j, k]| noise(i + 33 * j + 561 * k) as f32);
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let frame = Frame::new(&grid, Orientation::Coronal).unwrap();
            let (low, high) = occupied(&volume, &frame);
            let sheet = Sheet::new(&grid, Orientation::Coronal, vec![low, 0.5 * (low + high), high]).unwrap().with_filter(Filter::CUBIC);
            sheet.with_colors(ColorMap::Viridis).with_columns(2).unwrap().draw(&volume).unwrap()
        })
    };
    let one = draw(1);
    assert_eq!((draw(2), draw(5)), (one.clone(), one));
}

#[test]
fn the_empty_ends_are_found() {
    let grid = Grid::with_spacing([20, 20, 40], [1.0, 1.0, 2.0]).unwrap();
    let volume = volume_of(grid.clone(), |[i, j, k]| {
        let body = (10..30).contains(&k) && (5..15).contains(&i) && (5..15).contains(&j);
        if body { 100u8 } else { (i % 3) as u8 }
    });
    let (low, high) = occupied(&volume, &Frame::new(&grid, Orientation::Axial).unwrap());
    assert!((low - 20.0).abs() < 0.5 && (high - 58.0).abs() < 0.5, "{low} {high}");
    let flat = Volume::new(grid.clone(), Voxels::U8(vec![3; 16_000].into())).unwrap();
    assert_eq!(occupied(&flat, &Frame::new(&grid, Orientation::Axial).unwrap()), (-1.0, 79.0));
}

#[test]
fn windows_leave_out_the_rare_ends() {
    let values = (0..=1000).map(f64::from);
    assert_eq!(Window::of_seen(values).range(), (10.0, 995.0));
    assert_eq!(Window::of_seen([f64::NAN, 7.0, 7.0].into_iter()).range(), (6.5, 7.5));
    assert_eq!(Window::of_seen([f64::NAN].into_iter()).range(), (0.0, 1.0));
    // A bright spot in the dark is not lost.
    assert_eq!(Window::of_seen((0..1000).map(|n| if n == 3 { 9.0 } else { 0.0 })).range(), (0.0, 9.0));
    assert_eq!(Window::SOFT_TISSUE, Window::new(40.0, 400.0).unwrap());
    let (low, high) = Window::of_seen([-f64::MAX, f64::MAX].into_iter()).range();
    assert!(low < high);
    for (center, width) in [(0.0, 0.0), (0.0, -1.0), (f64::NAN, 1.0), (1e20, 1.0), (0.0, f64::INFINITY)] {
        assert!(Window::new(center, width).is_err());
    }
}

#[test]
fn thin_volumes_and_holes_are_drawn() {
    let nodes = Grid::with_spacing([6, 5, 1], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = volume_of(nodes.clone(), |[i, j, _]| if (i, j) == (2, 2) { f32::NAN } else { i as f32 });
    let sheet = |o| Sheet::new(&nodes, o, vec![Frame::new(&nodes, o).unwrap().offset_at(&nodes, 0.5)]).unwrap();
    let drawn = sheet(Orientation::Axial).with_filter(Filter::Nearest).with_size(50, 40).unwrap().draw(&volume).unwrap();
    assert_eq!((drawn.picture.pixel(20, 20)[3], drawn.picture.pixel(40, 20)[3]), (0.0, 1.0));
    let edge_on = sheet(Orientation::Coronal).with_size(30, 9).unwrap().draw(&volume).unwrap();
    assert!(edge_on.picture.pixels().iter().any(|p| p[3] == 1.0));
    let one = Grid::with_spacing([1, 1, 1], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = volume_of(one.clone(), |_| 5u8);
    assert!(Sheet::new(&one, Orientation::Axial, vec![0.0]).unwrap().with_size(8, 8).unwrap().draw(&volume).is_ok());
}

#[test]
fn what_cannot_be_cut_is_told_in_one_line() {
    let grid = Grid::with_spacing([4, 4, 4], [1.0; 3]).unwrap();
    let refused = |o, offsets: Vec<f64>| Sheet::new(&grid, o, offsets).unwrap_err().to_string();
    assert_eq!(refused(Orientation::Axial, vec![f64::NAN]), "cut at NaN: must be finite");
    assert_eq!(refused(Orientation::Axial, vec![]), "cuts: there must be at least one");
    assert_eq!(refused(Orientation::Oblique(DVec3::ZERO), vec![0.0]), "cut normal [0, 0, 0]: it must be finite and not 0");
    assert_eq!(refused(Orientation::Axial, vec![0.0; 1025]), "cuts of one picture: 1025 is over the limit of 1024");
    let volume = volume_of(grid.clone(), |_| 1u8);
    let sheet = Sheet::new(&grid, Orientation::Axial, vec![0.0; 9]).unwrap().with_columns(3).unwrap();
    let why = sheet.clone().with_size(6, 90).unwrap().draw(&volume).unwrap_err().to_string();
    assert_eq!(why, "image 6 x 90: too small for 3 x 3 cuts");
    assert!(sheet.with_size(0, 9).is_err());
}
