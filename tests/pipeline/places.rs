//! Segments of a label map and regions of space: closed forms, the reference, crops, and what is passed over.

use super::{PARALLEL, WIDE, constant, difference, field, fill, oblique, orbit, render, simple, smooth};
use glam::{DMat3, DVec3};
use slicestack::reference::{self, Integrator};
use slicestack::scene::{
    Blend, Camera, Classification, ClipPlane, Filter, FocusRegion, FocusShape, Fog, FogMode, Lighting, Method, Placement, Projection,
    SegmentEffect, SegmentStyle, SlabForm, Slicing, TransferFunction,
};
use slicestack::volume::{Grid, edit};
use slicestack::{Level, Renderer, Scene, Settings, Volume};

fn style(label: i64, effect: SegmentEffect) -> SegmentStyle {
    SegmentStyle::new(label, effect).unwrap()
}

/// Labels of a place in [-1,1]^3: 0 outside a ball, then four sectors of it.
fn sectors([x, y, z]: [f64; 3]) -> f64 {
    if x * x + y * y + z * z > 0.8 { 0.0 } else { 1.0 + f64::from(u8::from(x > 0.1)) + 2.0 * f64::from(u8::from(y + z > 0.05)) }
}

/// The smooth field, and labels beside it.
fn labelled(dims: [usize; 3]) -> Volume {
    let volume = field(dims);
    let labels = Volume::new(volume.grid().clone(), fill::<u8>(dims, &sectors)).unwrap();
    volume.with_labels(&labels).unwrap()
}

/// One of every effect.
fn styles() -> Vec<SegmentStyle> {
    vec![
        style(1, SegmentEffect::Hide),
        style(2, SegmentEffect::Tint { color: [0.1, 1.0, 0.4], strength: 0.7 }),
        style(3, SegmentEffect::Replace { color: [1.0, 0.6, 0.1], opacity: 0.12 }),
    ]
}

/// Two regions across each other in the box of `grid`.
fn regions(grid: &Grid) -> Vec<FocusRegion> {
    let (center, radius) = (grid.center(), grid.radius());
    let faint = TransferFunction::new(vec![(0.0, [0.2, 1.0, 0.9])], vec![(0.2, 0.0), (0.6, 0.1)]).unwrap().with_unit(0.7).unwrap();
    let even = constant([1.0, 0.9, 0.2], 0.04);
    vec![
        FocusRegion::new(FocusShape::Sphere { radius: 0.4 * radius }, center + DVec3::new(0.1, 0.05, -0.1) * radius, faint).unwrap(),
        FocusRegion::new(FocusShape::Box { size: [radius, 0.5 * radius, 0.7 * radius] }, center + DVec3::X * 0.4 * radius, even).unwrap(),
    ]
}

fn scene(transfer: TransferFunction, camera: Camera, slices: u64) -> Scene {
    let scene = Scene::new(transfer).with_camera(camera).with_size(24, 20).unwrap();
    scene.with_slices(Slicing::Count(slices)).unwrap().with_terminate(0.0).unwrap()
}

/// Along z from below, so that a pixel is a voxel wide: columns of the picture are columns of a grid of spacing 1 that begins at index 0.
fn along_z(dims: [usize; 3]) -> Camera {
    let center = DVec3::new(dims[0] as f64, dims[1] as f64, dims[2] as f64) * 0.5 - 0.5;
    let place = Placement::LookAt { eye: center.with_z(-50.0), target: center, up: -DVec3::Y };
    Camera::new(place, Projection::Orthographic { height: Some(dims[1] as f64) }).unwrap()
}

#[test]
fn pictures_converge_to_the_reference() {
    let volume = labelled([22, 19, 24]);
    let fog = Fog::new(FogMode::Exp { density: 0.02 }, [0.4, 0.5, 0.7]).unwrap();
    for (n, camera) in [orbit(30.0, 20.0, 1.2, PARALLEL), orbit(200.0, -40.0, 1.3, WIDE)].into_iter().enumerate() {
        for (what, places) in [("labels", (true, false)), ("regions", (false, true)), ("both", (true, true))] {
            let mut plain = scene(simple(0.0, 1.0), camera, 64);
            if places.0 {
                plain = plain.with_segments(styles()).unwrap();
            }
            if places.1 {
                plain = plain.with_regions(regions(volume.grid())).unwrap();
            }
            let lit = plain.clone().with_lighting(Some(Lighting::default())).unwrap().with_fog(Some(fog));
            for (how, scene) in [("plain", plain.clone()), ("lit, in fog", lit), ("in light", plain.with_linear_light(true).unwrap())] {
                let truth = reference::image(&scene, &volume, reference::Region::whole(&scene)).unwrap();
                let mut errors = Vec::new();
                for slices in [64, 256, 1024] {
                    let (picture, _) = render(&volume, &scene.clone().with_slices(Slicing::Count(slices)).unwrap());
                    let squares = picture
                        .pixels()
                        .iter()
                        .zip(truth.pixels())
                        .flat_map(|(a, b)| (0..4).map(move |c| (f64::from(a[c]) - b[c]) * (f64::from(a[c]) - b[c])));
                    errors.push((squares.sum::<f64>() / (4 * 24 * 20) as f64).sqrt());
                }
                assert!(errors[2] < 4e-4 && errors[2] < errors[0] / 8.0, "{what}, {how}, view {n}: {errors:?}");
            }
        }
    }
}

#[test]
fn a_sphere_in_a_constant_volume_has_a_closed_form() {
    let volume = Volume::new(Grid::with_spacing([21; 3], [1.0; 3]).unwrap(), vec![5u8; 9261].into()).unwrap();
    let (inner, outer) = ([0.9, 0.2, 0.1], [0.1, 0.3, 0.8]);
    let (a, b, radius) = (0.03, 0.1, 6.0);
    let region = FocusRegion::new(FocusShape::Sphere { radius }, DVec3::splat(10.0), constant(inner, b).with_unit(2.0).unwrap()).unwrap();
    let scene = scene(constant(outer, a), along_z([21; 3]), 2000).with_size(21, 21).unwrap().with_regions(vec![region]).unwrap();
    let (picture, _) = render(&volume, &scene);
    let integrator = Integrator::new(&scene, &volume).unwrap();
    for (x, y) in [(10, 10), (7, 12), (13, 14), (2, 3), (0, 10)] {
        let aside = (f64::from(x) - 10.0).hypot(f64::from(y) - 10.0);
        let half = (radius * radius - aside * aside).max(0.0).sqrt();
        // Opacities per unit length and per two of them.
        let clear = |a: f64, length: f64, unit: f64| (1.0 - a).powf(length / unit);
        let (before, within) = (clear(a, 10.5 - half, 1.0), clear(b, 2.0 * half, 2.0));
        let want: [f64; 4] = std::array::from_fn(|c| {
            let [o, i] = if c < 3 { [outer[c], inner[c]] } else { [1.0, 1.0] };
            o * (1.0 - before) + before * (i * (1.0 - within) + within * o * (1.0 - before))
        });
        let (truth, _) = integrator.pixel(x, y);
        let got = picture.pixel(x, y);
        for c in 0..4 {
            let truth = if c < 3 { truth.rgb[c] } else { truth.alpha };
            assert!((truth - want[c]).abs() < 1e-9, "{x},{y}: {truth} not {}", want[c]);
            // A slab at each face may count on the wrong side.
            assert!((f64::from(got[c]) - want[c]).abs() < 3e-4, "{x},{y}: {} not {}", got[c], want[c]);
        }
    }
}

#[test]
fn effects_on_a_constant_volume_have_closed_forms() {
    let dims = [6, 5, 9];
    let volume = Volume::new(Grid::with_spacing(dims, [1.0; 3]).unwrap(), vec![3u8; 270].into()).unwrap();
    // Columns of labels 10 to 15 along x.
    let labels = Volume::new(volume.grid().clone(), (0..270).map(|i| 10 + (i % 6) as u16).collect::<Vec<_>>().into()).unwrap();
    let volume = volume.with_labels(&labels).unwrap();
    let (own, a) = ([0.8, 0.4, 0.2], 0.15);
    let (tint, strength, other, b) = ([0.2, 0.9, 1.0], 0.75, [0.3, 0.1, 0.9], 0.4);
    let list = vec![
        style(11, SegmentEffect::Hide),
        style(12, SegmentEffect::Tint { color: tint, strength }),
        style(13, SegmentEffect::Tint { color: tint, strength: 1.0 }),
        style(14, SegmentEffect::Replace { color: other, opacity: b }),
        style(15, SegmentEffect::Replace { color: other, opacity: 1.0 }),
        style(99, SegmentEffect::Hide),
    ];
    let scene = scene(constant(own, a), along_z(dims), 12).with_size(6, 5).unwrap().with_segments(list).unwrap();
    let bright = 0.2126 * own[0] + 0.7152 * own[1] + 0.0722 * own[2];
    let mixed = |s: f64| [0, 1, 2].map(|c: usize| (1.0 - s) * own[c] + s * bright * tint[c]);
    let slab = |color: [f64; 3], a: f64| {
        let alpha = 1.0 - (1.0 - a).powi(9);
        [color[0] * alpha, color[1] * alpha, color[2] * alpha, alpha]
    };
    let want = [slab(own, a), [0.0; 4], slab(mixed(strength), a), slab(mixed(1.0), a), slab(other, b), slab(other, 1.0)];
    for classification in [Classification::Post, Classification::Pre] {
        let scene = scene.clone().with_method(Method::default().with_classification(classification)).unwrap();
        let (picture, _) = render(&volume, &scene);
        let truth = Integrator::new(&scene, &volume).unwrap();
        for (x, want) in want.iter().enumerate() {
            let (exact, _) = truth.pixel(x as u32, 2);
            for c in 0..4 {
                assert!((f64::from(picture.pixel(x as u32, 2)[c]) - want[c]).abs() < 2e-6, "column {x}, {classification:?}");
                let exact = if c < 3 { exact.rgb[c] } else { exact.alpha };
                assert!((exact - want[c]).abs() < 1e-9, "column {x}: {exact} not {}", want[c]);
            }
        }
    }
}

#[test]
fn what_is_hidden_around_a_box_of_voxels_is_as_if_it_were_cropped() {
    let dims = [16, 16, 12];
    let grid = Grid::with_spacing(dims, [1.0; 3]).unwrap();
    let volume = Volume::new(grid.clone(), fill::<f32>(dims, &smooth)).unwrap();
    let ranges = [3..11, 5..14, 0..12];
    let inside = |i: usize| ranges[0].contains(&(i % 16)) && ranges[1].contains(&(i / 16 % 16));
    let labels = Volume::new(grid.clone(), (0..3072).map(|i| u8::from(inside(i))).collect::<Vec<_>>().into()).unwrap();
    let both = volume.clone().with_labels(&labels).unwrap();
    let hidden = vec![style(0, SegmentEffect::Hide)];
    // Of the nearest voxels it is the cropped volume, to the bit, wherever the slices are the same ones: along z nothing is cropped.
    let cropped = edit::crop(&volume, ranges.clone(), None).unwrap();
    let nearest = Method::default().with_filter(Filter::Nearest);
    // All knots lie among the values of the part.
    let transfer = TransferFunction::new(vec![(0.3, [1.0, 0.5, 0.1]), (0.5, [0.1, 0.4, 1.0])], vec![(0.3, 0.0), (0.5, 0.3)]).unwrap();
    let (least, most) = (cropped.statistics().min, cropped.statistics().max);
    assert!(least < 0.3 && most > 0.5, "{least} to {most}");
    let view = scene(transfer.clone(), along_z(dims), 36).with_size(64, 64).unwrap().with_method(nearest).unwrap();
    let (want, _) = render(&cropped, &view);
    let (got, _) = render(&both, &view.clone().with_segments(hidden.clone()).unwrap());
    assert!(want.pixels().iter().filter(|p| p[3] > 0.01).count() > 500);
    assert_eq!(got.sha256(), want.sha256());
    // Interpolated it is the volume cut by planes halfway between voxels: the same integral on every ray.
    let planes = [(DVec3::X, 2.5), (-DVec3::X, -10.5), (DVec3::Y, 4.5), (-DVec3::Y, -13.5)];
    let planes: Vec<ClipPlane> = planes.into_iter().map(|(n, d)| ClipPlane::new(n, d).unwrap()).collect();
    let view = scene(transfer, orbit(40.0, 25.0, 1.1, WIDE), 36);
    let cut = view.clone().with_clip_planes(planes).unwrap();
    let view = view.with_segments(hidden).unwrap();
    let (cut, hidden) = (Integrator::new(&cut, &volume).unwrap(), Integrator::new(&view, &both).unwrap());
    let mut seen = 0;
    for (x, y) in (0..20).flat_map(|y| (0..24).map(move |x| (x, y))) {
        let (a, b) = (cut.pixel(x, y).1, hidden.pixel(x, y).1);
        let apart = (0..3).map(|c| (a.rgb[c] - b.rgb[c]).abs()).fold((a.transmittance - b.transmittance).abs(), f64::max);
        assert!(apart < 1e-9, "{x},{y}: {apart:e}");
        seen += usize::from(a.transmittance < 0.9);
    }
    assert!(seen > 40, "{seen}");
}

#[test]
fn bricks_of_hidden_segments_are_passed_over_and_those_of_others_are_not() {
    let dims = [48, 40, 44];
    let volume = Volume::new(oblique(dims), fill::<u8>(dims, &|[x, ..]| if x > 0.0 { 200.0 } else { 0.0 })).unwrap();
    // Wider by more than a brick: none holds both of what shows and of what is not labelled.
    let labels = fill::<u8>(dims, &|[x, y, _]| {
        if x > -0.25 {
            if y > 0.0 { 1.0 } else { 2.0 }
        } else if y > 0.5 {
            3.0
        } else {
            0.0
        }
    });
    let volume = volume.clone().with_labels(&Volume::new(volume.grid().clone(), labels).unwrap()).unwrap();
    let step = TransferFunction::new(vec![(100.0, [1.0, 0.5, 0.1])], vec![(60.0, 0.0), (60.0, 0.02)]).unwrap();
    let plain = scene(step, orbit(30.0, 20.0, 1.2, PARALLEL), 80).with_size(64, 64).unwrap();
    let looked_up = |scene: &Scene| render(&volume, scene).1.tally.looked_up;
    let all = looked_up(&plain);
    let with = |list: Vec<SegmentStyle>| plain.clone().with_segments(list).unwrap();
    let some = looked_up(&with(vec![style(1, SegmentEffect::Hide)]));
    let none = looked_up(&with(vec![style(1, SegmentEffect::Hide), style(2, SegmentEffect::Hide)]));
    let more = looked_up(&with(vec![style(3, SegmentEffect::Replace { color: [1.0; 3], opacity: 0.01 })]));
    let tinted = looked_up(&with(vec![style(1, SegmentEffect::Tint { color: [1.0; 3], strength: 0.5 })]));
    assert!(some > all / 3 && some < all * 2 / 3 && none == 0, "{all}, {some}, {none}");
    assert!(more > all * 11 / 10 && more < all * 15 / 10, "{all}, {more}");
    assert_eq!(tinted, all);
    // A region in which nothing shows, and one in which everything does.
    let radius = volume.grid().radius();
    let ball = |a: f64, at: DVec3| FocusRegion::new(FocusShape::Sphere { radius: 0.4 * radius }, at, constant([1.0; 3], a)).unwrap();
    let at = |share: f64| volume.grid().index_to_world().transform_point3(DVec3::new(47.0 * share, 19.5, 21.5));
    let clear = looked_up(&plain.clone().with_regions(vec![ball(0.0, at(0.75))]).unwrap());
    let dense = looked_up(&plain.clone().with_regions(vec![ball(0.01, at(0.2))]).unwrap());
    assert!(clear < all * 19 / 20, "{all}, {clear}");
    assert!(dense > all * 11 / 10, "{all}, {dense}");
}

#[test]
fn nothing_is_passed_over_that_shows() {
    // Literal fog makes every fragment count; of density 0 it changes none.
    let volume = labelled([30, 27, 33]);
    let still = Fog::new(FogMode::Exp { density: 0.0 }, [1.0; 3]).unwrap().with_weighting(slicestack::scene::FogWeighting::Literal);
    let sparse = TransferFunction::new(vec![(0.5, [1.0, 0.3, 0.1]), (0.9, [1.0; 3])], vec![(0.7, 0.0), (0.9, 0.6)]).unwrap();
    let deep = TransferFunction::new(vec![(0.5, [0.1, 0.3, 1.0])], vec![(0.55, 0.0), (0.55, 1.0)]).unwrap();
    for camera in [orbit(30.0, 20.0, 1.2, PARALLEL), orbit(120.0, -40.0, 1.3, WIDE)] {
        for transfer in [sparse.clone(), deep.clone()] {
            let scene = scene(transfer, camera, 90).with_size(160, 132).unwrap();
            let scene = scene.with_segments(styles()).unwrap().with_regions(regions(volume.grid())).unwrap();
            let (picture, stats) = render(&volume, &scene);
            let (all, counted) = render(&volume, &scene.with_fog(Some(still)));
            assert!(stats.tally.empty > 5000 && counted.tally.empty == 0, "{:?}", stats.tally);
            assert_eq!(picture.sha256(), all.sha256());
        }
    }
}

#[test]
fn every_level_thread_and_tile_gives_the_same_bytes() {
    let volume = labelled([18, 21, 17]);
    let opaque = TransferFunction::new(vec![(0.2, [1.0, 0.2, 0.1]), (0.8, [0.1, 0.5, 1.0])], vec![(0.2, 0.0), (0.6, 1.0)]).unwrap();
    let base = scene(opaque, orbit(50.0, 30.0, 1.2, WIDE), 40).with_segments(styles()).unwrap();
    let lit = base.clone().with_lighting(Some(Lighting::default())).unwrap();
    let with = |method: Method| base.clone().with_method(method).unwrap();
    let mut hidden = vec![style(1, SegmentEffect::Hide), style(4, SegmentEffect::Hide)];
    hidden.push(style(2, SegmentEffect::Show));
    let scenes = [
        base.clone().with_regions(regions(volume.grid())).unwrap(),
        lit.with_regions(regions(volume.grid())).unwrap(),
        with(Method::default().with_filter(Filter::CUBIC)).with_regions(regions(volume.grid())).unwrap(),
        with(Method::default().with_filter(Filter::Nearest)).with_regions(regions(volume.grid())).unwrap(),
        with(Method::default().with_classification(Classification::Pre)),
        with(Method::default().with_slab(SlabForm::Riemann)),
        base.clone().with_blend(Blend::Add).unwrap(),
        base.clone().with_slices(Slicing::Tolerance(0.01)).unwrap(),
        scene(simple(0.0, 1.0), orbit(10.0, 60.0, 1.2, PARALLEL), 40).with_blend(Blend::Mip).unwrap().with_segments(hidden).unwrap(),
    ];
    for (n, scene) in scenes.iter().enumerate() {
        let sha = |threads: usize, tile: u32, level: Level| {
            let settings = Settings::new().threads(threads).tile(tile).level(level);
            Renderer::new(&volume, settings).render(scene).unwrap().0.sha256()
        };
        let want = sha(1, 64, Level::SCALAR);
        for level in Level::available() {
            for (threads, tile) in [(2, 8), (3, 5), (1, 1 << 20)] {
                assert_eq!(sha(threads, tile, level), want, "scene {n}: {threads} threads, tiles of {tile}, {}", level.name());
            }
        }
    }
}

#[test]
fn a_renderer_keeps_what_places_need_and_makes_anew_what_changes() {
    let volume = labelled([20, 20, 20]);
    let base = scene(simple(0.0, 1.0), orbit(30.0, 20.0, 1.2, PARALLEL), 50);
    let first = base.clone().with_segments(styles()).unwrap().with_regions(regions(volume.grid())).unwrap();
    let turned = first.clone().with_camera(orbit(80.0, -20.0, 1.1, WIDE));
    let fewer = first.clone().with_segments(styles()[..1].to_vec()).unwrap();
    let one = first.clone().with_regions(regions(volume.grid())[1..].to_vec()).unwrap();
    let thinner = first.clone().with_slices(Slicing::Count(70)).unwrap();
    let denser = first.clone().with_transfer(constant([1.0, 0.2, 0.2], 0.1));
    let mut kept = Renderer::new(&volume, Settings::default());
    let scenes = [&first, &turned, &fewer, &one, &thinner, &denser, &base, &first];
    for (n, scene) in scenes.into_iter().enumerate() {
        assert_eq!(kept.render(scene).unwrap().0.sha256(), render(&volume, scene).0.sha256(), "scene {n}");
    }
    // The same once more prepares nothing.
    assert_eq!(kept.render(&first).unwrap().1.prepare_seconds, 0.0);
}

#[test]
fn projections_leave_hidden_segments_out() {
    let dims = [8, 6, 10];
    let grid = Grid::new(dims, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let volume = Volume::new(grid.clone(), (0..480).map(|i| (i * 7 % 101) as u8).collect::<Vec<_>>().into()).unwrap();
    let labels = Volume::new(grid, (0..480).map(|i| (i * 5 % 7 % 3) as u8).collect::<Vec<_>>().into()).unwrap();
    let both = volume.clone().with_labels(&labels).unwrap();
    let grey = TransferFunction::new(vec![(0.0, [0.0; 3]), (100.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap();
    let nearest = Method::default().with_filter(Filter::Nearest);
    for (blend, most) in [(Blend::Mip, true), (Blend::Min, false)] {
        let scene =
            scene(grey.clone(), along_z(dims), 10).with_size(8, 6).unwrap().with_method(nearest).unwrap().with_blend(blend).unwrap();
        let scene = scene.with_segments(vec![style(1, SegmentEffect::Hide)]).unwrap();
        let (picture, _) = render(&both, &scene);
        for (x, y) in (0..6).flat_map(|y| (0..8).map(move |x| (x, y))) {
            let column = (0..10).map(|z| (z * 6 + y) * 8 + x).filter(|&i| labels.voxels().get(i) != 1.0).map(|i| volume.voxels().get(i));
            let want = if most { column.fold(0.0, f64::max) } else { column.fold(100.0, f64::min) };
            let got = f64::from(picture.pixel(x as u32, y as u32)[0]);
            assert!((got - want / 100.0).abs() < 1e-5, "{blend:?} at {x},{y}: {got} not {want}");
        }
    }
}

#[test]
fn what_does_not_go_together_is_said_in_one_line() {
    let volume = labelled([8, 8, 8]);
    let base = scene(simple(0.0, 1.0), orbit(30.0, 20.0, 1.2, PARALLEL), 8);
    let labels = base.clone().with_segments(styles()).unwrap();
    let places = base.clone().with_regions(regions(volume.grid())).unwrap();
    let line = |result: slicestack::Result<Scene>, words: &[&str]| {
        let line = result.unwrap_err().to_string();
        assert!(!line.contains('\n') && words.iter().all(|w| line.contains(w)), "{line}");
    };
    let by = |c| Method::default().with_classification(c);
    line(labels.clone().with_method(by(Classification::PreIntegrated)), &["labels", "pre-integrated", "choose post"]);
    line(places.clone().with_method(by(Classification::SecondOrder)), &["region", "pre-integrated"]);
    line(places.clone().with_method(by(Classification::Pre)), &["region", "post"]);
    line(labels.clone().with_method(Method::default().with_merge(true)), &["labels", "slices merge"]);
    line(places.clone().with_blend(Blend::Mip), &["region", "a projection of values"]);
    line(places.clone().with_blend(Blend::Iso { level: 0.5 }), &["region", "level surfaces"]);
    line(labels.clone().with_opengl(slicestack::scene::OpenGl::default()), &["labels", "opengl"]);
    line(places.clone().with_opengl(slicestack::scene::OpenGl::default()), &["region", "opengl"]);
    let thin = simple(0.0, 1.0).with_gradient_opacity(vec![(0.0, 0.0), (1.0, 1.0)]).unwrap();
    assert!(places.with_transfer(thin.clone()).check().unwrap_err().to_string().contains("opacity by gradient"));
    assert!(labels.clone().with_transfer(thin).check().unwrap_err().to_string().contains("labels segment 3"));
    // Labels that are asked for have to be there.
    let bare = field([8, 8, 8]);
    let error = Renderer::new(&bare, Settings::default()).render(&labels).unwrap_err().to_string();
    assert_eq!(error, "labels segment 1: the volume has no label map");
    assert!(Integrator::new(&labels, &bare).unwrap_err().to_string().contains("no label map"));
    let error = reference::Prover::new(&labels, &volume).unwrap_err().to_string();
    assert!(error.contains("labels: no bounds can be proven"), "{error}");
    // What only shows needs no labels.
    let shown = base.clone().with_segments(vec![style(1, SegmentEffect::Show)]).unwrap();
    assert_eq!(render(&bare, &shown).0.sha256(), render(&bare, &base).0.sha256());
    assert!(difference(&render(&volume, &labels).0, &vec![[0.0; 4]; 480]) > 0.05);
}
