#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::numbers::{roughly, round_below, said, ticks};
use super::*;
use crate::cut::{Frame, Orientation, Sheet, Window};
use crate::scene::{Camera, Placement, Projection, Straight, TransferFunction};
use crate::volume::{Grid, Space};
use glam::DVec3;

fn volume(space: Space) -> Volume {
    let grid = Grid::with_spacing([20, 24, 16], [1.0, 1.0, 2.0]).unwrap().with_space(space);
    let voxels: Vec<u8> = (0..20 * 24 * 16).map(|n| (n % 251) as u8).collect();
    Volume::new(grid, voxels.into()).unwrap()
}

fn scene(width: u32, height: u32) -> Scene {
    let transfer = TransferFunction::new(vec![(0.0, [1.0, 0.0, 0.0]), (250.0, [0.0, 0.0, 1.0])], vec![(50.0, 0.0), (200.0, 0.5)]).unwrap();
    Scene::new(transfer).with_size(width, height).unwrap()
}

/// A picture in one grey.
fn grey(width: u32, height: u32, value: f32) -> Picture {
    Picture::new(width, height, vec![[value, value, value, 1.0]; (width * height) as usize])
}

fn drawn(picture: &Picture, scene: &Scene, volume: &Volume, set: impl Fn(&mut Annotations)) -> (Picture, Vec<String>) {
    let mut annotations = Annotations::new();
    set(&mut annotations);
    annotate(picture, &annotations, scene, volume).unwrap()
}

fn everything(a: &mut Annotations) {
    (a.colorbar, a.scale_bar, a.axes, a.box_edges) = (true, true, true, true);
    a.title = Some("A title".into());
}

/// Left, top, right and bottom of the pixels that differ.
fn changed(a: &Picture, b: &Picture) -> Option<[u32; 4]> {
    let (width, height) = (a.width(), a.height());
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).filter(|&(x, y)| a.pixel(x, y) != b.pixel(x, y));
    places.fold(None, |found: Option<[u32; 4]>, (x, y)| {
        let [l, t, r, b] = found.unwrap_or([x, y, x, y]);
        Some([l.min(x), t.min(y), r.max(x), b.max(y)])
    })
}

#[test]
fn nothing_asked_for_changes_nothing_and_pixels_beside_the_ink_keep_their_bits() {
    let (volume, scene) = (volume(Space::Ras), scene(300, 200));
    let odd = |n: usize| [0.123_456_7 + n as f32 * 1e-7, 0.25, f32::from_bits(n as u32 | 0x3e00_0000), 0.987_654_3];
    let picture = Picture::new(300, 200, (0..60_000).map(odd).collect());
    assert_eq!(drawn(&picture, &scene, &volume, |_| {}), (picture.clone(), vec![]));
    let (all, warnings) = drawn(&picture, &scene, &volume, everything);
    assert!(warnings.is_empty(), "{warnings:?}");
    let same = all.pixels().iter().zip(picture.pixels()).filter(|(a, b)| a == b).count();
    assert!(same > 40_000 && same < 59_000, "{same}");
    assert!(!Annotations::new().any());
}

#[test]
fn letters_stand_at_the_sides_where_they_belong() {
    // From the front: the subject's left is at the picture's right.
    for space in [Space::Ras, Space::Lps] {
        let front = Grid::with_spacing([4, 4, 4], [1.0; 3]).unwrap().with_space(space);
        let at = |azimuth, elevation| {
            let view = Camera::orbit(azimuth, elevation).and_then(|c| c.resolve(&front, 64, 64)).unwrap();
            [view.right, -view.right, view.up, -view.up].map(|d| space.letters(d).unwrap())
        };
        assert_eq!(at(0.0, 0.0), ["L", "R", "S", "I"]);
        assert_eq!(at(90.0, 0.0), ["P", "A", "S", "I"]);
        assert_eq!(at(180.0, 0.0), ["R", "L", "S", "I"]);
        assert_eq!(at(30.0, 0.0), ["LP", "RA", "S", "I"]);
        assert_eq!(at(0.0, 90.0), ["L", "R", "P", "A"]);
    }
    assert_eq!(Space::Unknown.letters(DVec3::X), None);
    assert_eq!(Space::Ras.letters(DVec3::ZERO), None);
    assert_eq!(Space::Ras.letters(DVec3::new(-1.0, 2.0, 3.0)).as_deref(), Some("SAL"));
}

#[test]
fn letters_are_drawn_at_the_four_sides_and_nowhere_else() {
    let (volume, scene) = (volume(Space::Lps), scene(256, 256).with_camera(Camera::orbit(0.0, 0.0).unwrap()));
    let picture = grey(256, 256, 0.1);
    let (with, _) = drawn(&picture, &scene, &volume, |a| a.axes = true);
    let mut count = [0; 4];
    for y in 0..256u32 {
        for x in 0..256u32 {
            if with.pixel(x, y) != picture.pixel(x, y) {
                let middle = |p: u32| p.abs_diff(128) < 14;
                let side = [middle(y) && x > 228, middle(y) && x < 28, middle(x) && y < 28, middle(x) && y > 228];
                let n = side.iter().position(|s| *s).unwrap_or_else(|| unreachable!("ink at {x},{y}"));
                count[n] += 1;
            }
        }
    }
    assert!(count.iter().all(|c| *c > 30), "{count:?}");
}

#[test]
fn ink_is_light_on_dark_and_dark_on_light() {
    let (volume, scene) = (volume(Space::Ras), scene(256, 256));
    for (ground, light) in [(0.0, true), (0.3, true), (0.8, false), (1.0, false)] {
        let picture = grey(256, 256, ground);
        let (with, _) = drawn(&picture, &scene, &volume, |a| a.title = Some("Xylophone".into()));
        let strongest = with.pixels().iter().map(|p| p[0]).fold(ground, |a, b| if (b - ground).abs() > (a - ground).abs() { b } else { a });
        assert_eq!(strongest > ground, light, "{ground}: {strongest}");
        assert!((strongest - ground).abs() > 0.55, "{ground}: {strongest}");
    }
}

#[test]
fn everything_fits_small_and_large_pictures_without_touching() {
    let volume = volume(Space::Ras);
    let parts: [fn(&mut Annotations); 4] =
        [|a| a.colorbar = true, |a| a.scale_bar = true, |a| a.axes = true, |a| a.title = Some("Head of a patient".into())];
    for space in [Space::Ras, Space::Unknown] {
        let volume = volume.clone().with_grid(volume.grid().clone().with_space(space)).unwrap();
        for (width, height) in [(256, 256), (256, 192), (800, 600), (2048, 2048)] {
            let (scene, picture) = (scene(width, height), grey(width, height, 0.0));
            let (all, warnings) = drawn(&picture, &scene, &volume, |a| {
                everything(a);
                (a.title, a.box_edges) = (Some("Head of a patient".into()), false);
            });
            assert!(warnings.is_empty(), "{width} x {height}: {warnings:?}");
            // As much ink as the parts have by themselves: none lies on another's.
            let ink = |p: &Picture| p.pixels().iter().map(|p| f64::from(p[0] + p[1] + p[2])).sum::<f64>();
            let each: f64 = parts.iter().map(|set| ink(&drawn(&picture, &scene, &volume, set).0)).sum();
            assert!((ink(&all) / each - 1.0).abs() < 2e-3, "{width} x {height}: {} of {each}", ink(&all));
        }
    }
}

#[test]
fn what_does_not_fit_is_left_out_and_said() {
    let (volume, scene) = (volume(Space::Ras), scene(16, 12));
    let (_, warnings) = drawn(&grey(16, 12, 0.0), &scene, &volume, everything);
    assert!(warnings.iter().any(|w| w == "annotate.colorbar: no room for it in 16 x 12 pixels, left out"), "{warnings:?}");
    let long = "x".repeat(100);
    let large = scene.with_size(256, 256).unwrap();
    let (_, warnings) = drawn(&grey(256, 256, 0.0), &large, &volume, |a| a.title = Some(long.clone()));
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].starts_with("annotate.title: only ") && warnings[0].ends_with(" of its 100 letters fit"), "{warnings:?}");
    let (_, warnings) = drawn(&grey(256, 256, 0.0), &large, &volume, |a| a.title = Some("a \u{4e00}".into()));
    assert_eq!(warnings, ["annotate.title: the font has no '\u{4e00}', a question mark stands there"]);
}

#[test]
fn the_scale_bar_is_as_long_as_it_says() {
    let volume = volume(Space::Lps);
    let bar = |camera: Camera| {
        let scene = scene(400, 400).with_camera(camera);
        let picture = grey(400, 400, 0.0);
        let (with, _) = drawn(&picture, &scene, &volume, |a| a.scale_bar = true);
        let [_, _, _, bottom] = changed(&picture, &with).unwrap();
        // The lowest row of the bar, with its edge and without.
        let lit = |y: u32| (0..400).filter(|x| with.pixel(*x, y)[0] > 0.9).count();
        (bottom - 6..=bottom).map(lit).max().unwrap() as f64
    };
    let placement = Placement::Orbit { azimuth: 0.0, elevation: 0.0, roll: 0.0, zoom: 1.0 };
    // 80 units over 400 pixels: a fifth of a unit each, and 20 units under a quarter.
    let parallel = Camera::new(placement, Projection::Orthographic { height: Some(80.0) }).unwrap();
    assert!((bar(parallel) - 50.0).abs() <= 2.0, "{}", bar(parallel));
    let perspective = Camera::new(placement, Projection::Perspective { fov_y: 30.0 }).unwrap();
    let view = perspective.resolve(volume.grid(), 400, 400).unwrap();
    let pixel = view.scale * view.depth(volume.grid().center());
    let want = round_below(0.24 * 400.0 * pixel).unwrap() / pixel;
    assert!((bar(perspective) - want).abs() <= 2.0, "{} of {want}", bar(perspective));
}

#[test]
fn ticks_are_round_and_stand_where_their_values_are() {
    let of = |low, high, most| {
        let (list, step) = ticks(low, high, most);
        list.into_iter().map(|t| said(t, step)).collect::<Vec<_>>()
    };
    assert_eq!(of(-1000.0, 3000.0, 5), ["-1000", "0", "1000", "2000", "3000"]);
    assert_eq!(of(0.0, 255.0, 6), ["0", "50", "100", "150", "200", "250"]);
    assert_eq!(of(-0.15, 0.32, 5), ["-0.1", "0.0", "0.1", "0.2", "0.3"].map(|t| if t == "0.0" { "0" } else { t }));
    assert_eq!(of(12.0, 12.9, 3), ["12.0", "12.5"]);
    assert_eq!(of(0.0, 3e-7, 3), ["0", "1e-7", "2e-7", "3e-7"].map(str::to_owned)[..].to_vec());
    for (low, high) in [(-f64::MAX, f64::MAX), (0.0, 5e-324), (1e300, 1.1e300)] {
        let (list, _) = ticks(low, high, 5);
        assert!(!list.is_empty() && list.len() <= 7 && list.iter().all(|t| t.is_finite()), "{list:?}");
    }
    assert_eq!((colorbar::place(10.0, 10.0, 30.0, 100.0, 50.0), colorbar::place(25.0, 10.0, 30.0, 100.0, 50.0)), (150.0, 112.5));
    assert_eq!([0.05, 0.123, 1.0, 0.999, 3e-7].map(roughly), ["0.05", "0.12", "1", "1", "3e-7"]);
    assert_eq!([7.3, 0.0501, 20.0, 1999.0].map(|x| round_below(x).unwrap()), [5.0, 0.05, 20.0, 1000.0]);
    assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(round_below), [None; 4]);
}

#[test]
fn the_colour_bar_shows_the_colours_of_its_values() {
    let (volume, scene) = (volume(Space::Ras), scene(512, 512));
    let picture = grey(512, 512, 0.0);
    let (with, _) = drawn(&picture, &scene, &volume, |a| a.colorbar = true);
    // Data from 0 to 250, shown from 50 on; a twentieth more.
    let (low, high) = (40.0, 250.0);
    let column = (300..512).find(|&x| {
        let p = with.pixel(x, 256);
        p[1] < 0.02 && p[0] > 0.2 && p[2] > 0.2
    });
    let column = column.unwrap() + 4;
    for y in [140u32, 200, 256, 300, 360] {
        let value = high + (low - high) * (f64::from(y) + 0.5 - 128.0) / 256.0;
        let want = scene.transfer().eval(value).rgb;
        let got = with.pixel(column, y);
        assert!((0..3).all(|c| (f64::from(got[c]) - want[c]).abs() < 0.01), "{y}: {got:?} not {want:?}");
    }
}

#[test]
fn cuts_have_letters_scale_and_positions() {
    let volume = volume(Space::Lps);
    let frame = Frame::new(volume.grid(), Orientation::Axial).unwrap();
    let offsets = [0.2, 0.4, 0.6, 0.8].map(|s| frame.offset_at(volume.grid(), s)).to_vec();
    let sheet = Sheet::new(volume.grid(), Orientation::Axial, offsets).unwrap().with_columns(2).unwrap();
    let sheet = sheet.with_window(Window::new(1000.0, 1.0).unwrap()).with_background(Straight { rgb: [0.0; 3], alpha: 1.0 }).unwrap();
    let cuts = sheet.with_size(402, 402).unwrap().draw(&volume).unwrap();
    let with = |set: fn(&mut Annotations)| {
        let mut annotations = Annotations::new();
        set(&mut annotations);
        annotate_cuts(&cuts, &annotations)
    };
    let (position, warnings) = with(|a| a.position = true).unwrap();
    assert!(warnings.is_empty());
    for n in 0..4 {
        let [left, top, ..] = cuts.layout.cell(n);
        let ink = (0..20).flat_map(|y| (0..90).map(move |x| (x, y))).filter(|(x, y)| position.pixel(left + x, top + y)[0] > 0.5).count();
        assert!(ink > 50, "cut {n}: {ink}");
    }
    let (bar, _) = with(|a| a.scale_bar = true).unwrap();
    let [left, top, right, bottom] = changed(&cuts.picture, &bar).unwrap();
    assert!(left > 250 && top > 350 && right < 402 && bottom < 402);
    let (letters, _) = with(|a| a.axes = true).unwrap();
    let [.., right, bottom] = changed(&cuts.picture, &letters).unwrap();
    assert!(right < 200 && bottom < 200);
    assert_eq!(with(|a| a.colorbar = true).unwrap_err().to_string(), "annotate.colorbar: cut pictures have none");
}

#[test]
fn a_bar_that_would_mislead_is_refused() {
    use crate::scene::LevelSurface;
    let mut annotations = Annotations::new();
    annotations.colorbar = true;
    let own = scene(8, 8).with_levels(vec![LevelSurface::new(3.0, Some([1.0, 0.0, 0.0]), 1.0).unwrap()]).unwrap();
    assert!(check(&annotations, &own).unwrap_err().to_string().starts_with("annotate.colorbar: surfaces have colours of their own"));
    let taken = scene(8, 8).with_levels(vec![LevelSurface::new(3.0, None, 1.0).unwrap()]).unwrap();
    assert!(check(&annotations, &taken).is_ok() && check(&Annotations::new(), &own).is_ok());
}
