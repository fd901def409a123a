//! A renderer's ways to a picture: into memory of the caller's, coarse and then finer, as a layer, in parts, stopped.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use slicestack::proxy::Domain;
use slicestack::scene::{
    Blend, Camera, Classification, ClipPlane, Filter, Fog, FogMode, Method, OpenGl, Order, Placement, Projection, Slicing, Straight,
};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Grid, Voxels};
use slicestack::{Error, Layer, Renderer, Scene, Settings, Volume, render};
use std::ops::Range;
use std::sync::Arc;

fn head(size: usize) -> Volume {
    Phantom::SheppLogan.volume(size).unwrap()
}

fn scene() -> Scene {
    let background = Straight { rgb: [0.3, 0.5, 0.1], alpha: 0.7 };
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(24)).with_size(75, 61).unwrap();
    scene.with_slices(Slicing::Count(120)).unwrap().with_background(background).unwrap()
}

fn bits(pixels: &[[f32; 4]]) -> Vec<u32> {
    pixels.iter().flatten().map(|c| c.to_bits()).collect()
}

#[test]
fn a_callers_memory_gets_the_same_bytes_again_and_again() {
    let volume = Arc::new(head(24));
    let mut renderer = Renderer::new(Arc::clone(&volume), Settings::default());
    let want = render(&volume, &scene()).unwrap();
    let mut pixels = vec![[9.0; 4]; 75 * 61];
    for _ in 0..3 {
        let stats = renderer.render_into(&scene(), &mut pixels).unwrap();
        assert_eq!(stats.slices, 120);
        assert_eq!(bits(&pixels), bits(want.pixels()));
    }
    let said = renderer.render_into(&scene(), &mut pixels[1..]).unwrap_err().to_string();
    assert_eq!(said, "4574 pixels given for a picture of 75 x 61");
    // The renderer lives on without the volume's first owner.
    drop(volume);
    assert_eq!(renderer.render(&scene()).unwrap().0, want);
}

#[test]
fn passes_grow_finer_and_the_last_is_the_picture() {
    let mut renderer = Renderer::new(head(24), Settings::default());
    let want = renderer.render(&scene()).unwrap().0;
    let error = |pixels: &[[f32; 4]]| pixels.iter().zip(want.pixels()).map(|(a, b)| (a[3] - b[3]).abs()).sum::<f32>();
    let mut pixels = vec![[0.0; 4]; 75 * 61];
    let mut seen = Vec::new();
    renderer
        .render_progressive(&scene(), &mut pixels, |pass, pixels| {
            seen.push((pass.square, pass.last, error(pixels)));
            true
        })
        .unwrap();
    assert_eq!(bits(&pixels), bits(want.pixels()));
    assert_eq!(seen.iter().map(|s| (s.0, s.1)).collect::<Vec<_>>(), [(4, false), (2, false), (1, true)]);
    assert!(seen[0].2 > seen[1].2 && seen[1].2 > 0.0 && seen[2].2 == 0.0, "{seen:?}");
    let stopped = renderer.render_progressive(&scene(), &mut pixels, |pass, _| pass.square > 2);
    assert!(matches!(stopped, Err(Error::Stopped)));
    for other in [scene().with_slices(Slicing::Tolerance(0.01)).unwrap(), scene().with_opengl(OpenGl::default()).unwrap()] {
        let want = renderer.render(&other).unwrap().0;
        renderer.render_progressive(&other, &mut pixels, |_, _| true).unwrap();
        assert_eq!(bits(&pixels), bits(want.pixels()));
    }
}

#[test]
fn a_picture_in_the_making_is_stopped() {
    let mut renderer = Renderer::new(head(48), Settings::default());
    let slow = scene().with_slices(Slicing::Count(1 << 20)).unwrap().with_terminate(0.0).unwrap();
    let stopper = renderer.stopper();
    let asked = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(300));
        stopper.stop();
        std::time::Instant::now()
    });
    let found = renderer.render(&slow);
    let ended = std::time::Instant::now();
    assert!(matches!(found, Err(Error::Stopped)), "{:?}", found.map(|f| f.1));
    let asked = asked.join().unwrap();
    assert!(ended.duration_since(asked).as_secs_f64() < 2.0);
    // The next one is made.
    renderer.render(&scene()).unwrap();
}

#[test]
fn a_layer_over_the_background_is_the_picture() {
    let mut renderer = Renderer::new(head(24), Settings::default());
    let fog = Fog::new(FogMode::Exp { density: 0.02 }, [0.7; 3]).unwrap();
    let plane = ClipPlane::new(glam::DVec3::new(1.0, 0.4, 0.2), 8.0).unwrap();
    for scene in [
        scene(),
        scene().with_fog(Some(fog)),
        scene().with_order(Order::BackToFront),
        scene().with_clip_planes(vec![plane]).unwrap(),
        scene().with_blend(Blend::Mip).unwrap(),
    ] {
        let layer = renderer.render_layer(&scene).unwrap();
        let (picture, _) = renderer.render(&scene).unwrap();
        let finished = layer.finish(&scene).unwrap();
        for (a, b) in finished.pixels().iter().zip(picture.pixels()) {
            // Pixels without anything in them take the background as it is.
            assert!((0..4).all(|c| (a[c] - b[c]).abs() <= 1e-7), "{a:?} {b:?}");
        }
        let ((x, y), (w, h)) = layer.rectangle();
        assert!(w > 20 && h > 20 && x + w <= 75 && y + h <= 61 && layer.pixels().len() == (w * h) as usize);
    }
    let said = |scene: Scene, words: &str| {
        let mut renderer = Renderer::new(head(8), Settings::default());
        let error = renderer.render_layer(&scene).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    said(scene().with_opengl(OpenGl::default()).unwrap(), "the profile opengl draws over its background");
    said(scene().with_slices(Slicing::Tolerance(0.01)).unwrap(), "slices tolerance 0.01");
    said(scene().with_method(Method::default().with_extrapolate(true)).unwrap(), "slices extrapolate");
}

/// The voxels `part` of a volume, as a volume of its own.
fn cut(volume: &Volume, part: &[Range<usize>; 3]) -> Volume {
    let [nx, ny, _] = volume.grid().dims();
    let mut values: Vec<f32> = Vec::new();
    for k in part[2].clone() {
        for j in part[1].clone() {
            values.extend(part[0].clone().map(|i| volume.voxels().get((k * ny + j) * nx + i) as f32));
        }
    }
    let dims = part.clone().map(|r| r.len());
    let voxels = match volume.voxels() {
        Voxels::U8(_) => Voxels::from(values.iter().map(|&v| v as u8).collect::<Vec<u8>>()),
        Voxels::I16(_) => Voxels::from(values.iter().map(|&v| v as i16).collect::<Vec<i16>>()),
        _ => Voxels::from(values),
    };
    // Its own place in the world does not matter: the whole's grid counts.
    let (slope, intercept) = volume.rescale();
    Volume::new(Grid::with_spacing(dims, [1.0; 3]).unwrap(), voxels).unwrap().with_rescale(slope, intercept).unwrap()
}

/// A volume of noise that is nowhere transparent, in a grid of its own shape.
fn noise(dims: [usize; 3], kind: &str) -> Volume {
    let count = dims.iter().product::<usize>();
    let value = |i: usize| (i.wrapping_mul(2_654_435_761) >> 7) % 251;
    let voxels = match kind {
        "u8" => Voxels::from((0..count).map(|i| value(i) as u8).collect::<Vec<u8>>()),
        "i16" => Voxels::from((0..count).map(|i| value(i) as i16 - 100).collect::<Vec<i16>>()),
        _ => Voxels::from((0..count).map(|i| value(i) as f32 * 0.37).collect::<Vec<f32>>()),
    };
    let steps = glam::DMat3::from_cols(glam::DVec3::new(1.0, 0.1, 0.0), glam::DVec3::new(-0.1, 0.8, 0.2), glam::DVec3::new(0.0, -0.1, 1.7));
    Volume::new(Grid::new(dims, glam::DVec3::new(5.0, -3.0, 2.0), steps).unwrap(), voxels).unwrap()
}

/// Layers of all parts that `cuts` make along each axis, with the voxels around them, nearest first.
fn shares(volume: &Volume, scene: &Scene, cuts: &[Vec<usize>; 3]) -> Vec<Layer> {
    let dims = volume.grid().dims();
    let values = || (0..volume.voxels().len()).map(|i| volume.voxels().get(i));
    let range = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let view = scene.camera().resolve(volume.grid(), 75, 61).unwrap();
    let mut parts = Vec::new();
    for z in cuts[2].windows(2) {
        for y in cuts[1].windows(2) {
            for x in cuts[0].windows(2) {
                let cells = [x[0]..x[1], y[0]..y[1], z[0]..z[1]];
                let voxels: [Range<usize>; 3] = std::array::from_fn(|i| cells[i].start..(cells[i].end + 1).min(dims[i]));
                let domain = Domain::new(volume.grid().clone(), cells.clone(), voxels.clone(), range, 0).unwrap();
                parts.push((cells, Renderer::new(cut(volume, &voxels), Settings::default()).render_part(scene, &domain).unwrap()));
            }
        }
    }
    // Of two parts on both sides of a face the one on the eye's side is nearer: so along each axis in turn.
    let eye = volume.grid().world_to_index().transform_point3(view.eye);
    let towards = volume.grid().world_to_index().matrix3 * view.forward;
    let rank = |axis: usize, cells: &Range<usize>| {
        let (start, end) = (cells.start as f64, cells.end as f64);
        if view.perspective { (start - eye[axis]).max(eye[axis] - end).max(0.0) } else { start * towards[axis].signum() }
    };
    parts.sort_by(|(a, _), (b, _)| {
        let key = |c: &[Range<usize>; 3]| (0..3).map(|i| rank(i, &c[i])).collect::<Vec<f64>>();
        key(a).partial_cmp(&key(b)).unwrap()
    });
    parts.into_iter().map(|p| p.1).collect()
}

#[test]
fn parts_of_a_volume_make_up_the_whole_picture() {
    let ramp = slicestack::scene::TransferFunction::new(
        vec![(-100.0, [0.9, 0.2, 0.1]), (60.0, [0.2, 0.9, 0.4]), (250.0, [0.2, 0.3, 1.0])],
        vec![(-100.0, 0.02), (250.0, 0.3)],
    )
    .unwrap();
    let cuts = [vec![0, 7, 15, 22], vec![0, 9, 18], vec![0, 4, 12]];
    let wide = Projection::Perspective { fov_y: 40.0 };
    let fog = Fog::new(FogMode::Exp2 { density: 0.02 }, [0.6; 3]).unwrap();
    let plane = ClipPlane::new(glam::DVec3::new(0.3, 1.0, 0.2), 1.0).unwrap();
    for kind in ["u8", "i16", "f32"] {
        let volume = noise([23, 19, 13], kind);
        let plain = scene().with_transfer(ramp.clone()).with_terminate(0.0).unwrap();
        let seen = |azimuth: f64, projection: Projection| {
            let camera = Camera::new(Placement::Orbit { azimuth, elevation: 25.0, roll: 10.0, zoom: 1.1 }, projection).unwrap();
            plain.clone().with_camera(camera)
        };
        for (name, scene) in [
            ("parallel", seen(30.0, Projection::Orthographic { height: None })),
            ("from behind", seen(200.0, Projection::Orthographic { height: None })),
            ("perspective", seen(-50.0, wide)),
            ("fog", seen(120.0, wide).with_fog(Some(fog))),
            ("clipped", seen(20.0, Projection::Orthographic { height: None }).with_clip_planes(vec![plane]).unwrap()),
            ("few slices", seen(30.0, wide).with_slices(Slicing::Count(9)).unwrap()),
            ("back to front", seen(30.0, wide).with_order(Order::BackToFront)),
        ] {
            let want = Renderer::new(&volume, Settings::default()).render_layer(&scene).unwrap();
            let layers = shares(&volume, &scene, &cuts);
            assert_eq!(layers.len(), 12);
            let whole = layers.into_iter().reduce(|front, back| front.over(&back).unwrap()).unwrap();
            assert_eq!(whole.rectangle(), want.rectangle(), "{name}, {kind}");
            let worst = whole.pixels().iter().flatten().zip(want.pixels().iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst <= 2e-6, "{name}, {kind}: {worst}");
        }
    }
}

#[test]
fn one_part_that_is_the_whole_gives_the_very_same_bits() {
    let volume = noise([23, 19, 13], "u8");
    let ramp = slicestack::scene::TransferFunction::new(vec![(0.0, [0.9, 0.2, 0.1])], vec![(0.0, 0.02), (250.0, 0.3)]).unwrap();
    let scene = scene().with_transfer(ramp).with_terminate(0.0).unwrap();
    let domain = Domain::new(volume.grid().clone(), [0..22, 0..18, 0..12], [0..23, 0..19, 0..13], (0.0, 250.0), 0).unwrap();
    let mut renderer = Renderer::new(&volume, Settings::default());
    let (part, whole) = (renderer.render_part(&scene, &domain).unwrap(), renderer.render_layer(&scene).unwrap());
    assert_eq!(part.rectangle(), whole.rectangle());
    assert_eq!(bits(part.pixels()), bits(whole.pixels()));
}

#[test]
fn what_cannot_be_shared_out_is_refused() {
    let volume = head(16);
    let domain = Domain::new(volume.grid().clone(), [0..15, 0..15, 0..15], [0..16, 0..16, 0..16], (0.0, 1.0), 0).unwrap();
    let mut renderer = Renderer::new(&volume, Settings::default());
    let refused = |renderer: &mut Renderer, scene: Scene, words: &str| {
        let said = renderer.render_part(&scene, &domain).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
    };
    let pairs = Method::default().with_classification(Classification::PreIntegrated);
    refused(&mut renderer, scene().with_method(pairs).unwrap(), "transfer classification: a part of a volume");
    refused(&mut renderer, scene().with_method(Method::default().with_merge(true)).unwrap(), "slices merge");
    refused(&mut renderer, scene().with_blend(Blend::Mip).unwrap(), "render blend");
    refused(&mut renderer, scene().with_method(Method::default().with_filter(Filter::CUBIC)).unwrap(), "render filter cubic: a spline");
    let mut other = Renderer::new(head(12), Settings::default());
    refused(&mut other, scene(), "domain: voxels [16, 16, 16] along x, y, z: the volume has [12, 12, 12]");
}
