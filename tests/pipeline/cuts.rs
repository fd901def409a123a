//! Opaque planes inside the picture: against voxels, pictures without a volume before them, and the reference.

use super::convergence::{errors, order, smooth_transfer, spread};
use super::{PARALLEL, WIDE, constant, difference, field, orbit, render, telling};
use glam::DVec3;
use slicestack::picture::Aov;
use slicestack::reference::{Integrator, Region, image};
use slicestack::scene::{
    Algorithm, Blend, Camera, Classification, ClipPlane, ColorMap, CutPlane, Fog, FogDistance, FogMode, Method, Order, Placement,
    Projection, Slicing, TransferFunction,
};
use slicestack::volume::{BoxConvention, Grid, Voxels};
use slicestack::{Renderer, Scene, Settings, Volume};

fn nothing() -> TransferFunction {
    constant([1.0; 3], 0.0)
}

fn through(volume: &Volume, normal: DVec3, at: f64) -> CutPlane {
    CutPlane::new(normal, normal.dot(volume.grid().center()) + at * normal.length() * volume.grid().radius()).unwrap()
}

/// Three planes at right angles through the middle, each in colours of its own.
fn three(volume: &Volume) -> Vec<CutPlane> {
    vec![
        through(volume, DVec3::X, 0.05),
        through(volume, DVec3::Y, -0.1).with_colors(ColorMap::Viridis),
        through(volume, DVec3::Z, 0.02).with_colors(ColorMap::Coolwarm).with_window(0.5, 0.6).unwrap(),
    ]
}

#[test]
fn a_plane_of_voxels_shows_exactly_their_colors() {
    let dims = [6, 5, 4];
    let values: Vec<u8> = (0..120u32).map(|i| (i * 37 % 251) as u8).collect();
    let grid = Grid::with_spacing(dims, [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = Volume::new(grid, Voxels::U8(values.into())).unwrap();
    // Pixels lie on voxels; the sixth column and the fifth row on the box's faces belong to nobody or to it.
    let eye = Placement::LookAt { eye: DVec3::new(2.5, 2.0, 10.0), target: DVec3::new(2.5, 2.0, 0.0), up: DVec3::Y };
    let camera = Camera::new(eye, Projection::Orthographic { height: Some(5.0) }).unwrap();
    for layer in 0..dims[2] {
        let plane = CutPlane::new(DVec3::Z, layer as f64).unwrap().with_window(127.5, 255.0).unwrap();
        // What lies behind the plane may be anything; before it there is nothing of opacity.
        let scene = Scene::new(nothing()).with_camera(camera).with_size(6, 5).unwrap().with_cuts(vec![plane]).unwrap();
        let (picture, _) = render(&volume, &scene.with_slices(Slicing::Count(7)).unwrap());
        for y in 1..4u32 {
            for x in 1..5u32 {
                let voxel = volume.value([x as usize, 4 - y as usize, layer]) / 255.0;
                let [r, g, b, a] = picture.pixel(x, y);
                assert!([r, g, b].iter().all(|c| (f64::from(*c) - voxel).abs() < 1e-7) && a == 1.0, "({x},{y},{layer}): {r} not {voxel}");
            }
        }
    }
}

#[test]
fn pictures_are_those_of_the_reference() {
    let volume = spread(Grid::with_spacing([26, 24, 22], [1.0, 0.9, 1.2]).unwrap(), &|[x, y, z]| {
        0.5 + 0.3 * (1.5 * x + 0.4).sin() * (1.2 * y - z).cos()
    });
    let planes: Vec<CutPlane> = three(&volume).into_iter().map(|p| p.with_window(2048.0, 4096.0).unwrap()).collect();
    let fog = |distance| Some(Fog::new(FogMode::Exp { density: 0.02 }, [0.7, 0.8, 0.9]).unwrap().with_distance(distance));
    let clip = vec![ClipPlane::new(DVec3::new(-1.0, 0.2, 0.4), -12.0).unwrap()];
    let counts = [48, 96, 192];
    for (camera, haze, clip) in [
        (orbit(30.0, 30.0, 1.2, PARALLEL), None, vec![]),
        (orbit(-40.0, 20.0, 1.2, WIDE), fog(FogDistance::Planar), vec![]),
        (orbit(130.0, -30.0, 1.2, PARALLEL), fog(FogDistance::Radial), clip.clone()),
        (orbit(70.0, 10.0, 1.2, WIDE), fog(FogDistance::Radial), clip),
    ] {
        let scene = Scene::new(smooth_transfer(0.01)).with_opacity_unit(4.0).unwrap().with_camera(camera).with_terminate(0.0).unwrap();
        let scene = scene.with_size(26, 22).unwrap().with_fog(haze).with_clip_planes(clip).unwrap().with_cuts(planes.clone()).unwrap();
        for scene in [
            scene.clone(),
            scene.clone().with_order(Order::BackToFront),
            scene.clone().with_algorithm(Algorithm::Shells).unwrap(),
            scene.with_linear_light(true).unwrap(),
        ] {
            let errors = errors(&volume, &scene, &counts);
            let order = order(&counts, &errors);
            assert!(errors[2] < 1e-4 && order > 1.6, "{camera:?} {haze:?}: order {order:.2}, {errors:?}");
            let hidden = |&(x, y): &(u32, u32)| Integrator::new(&scene, &volume).unwrap().pixel(x, y).1.transmittance == 0.0;
            assert!([(13, 11), (12, 10)].iter().all(hidden), "a plane is in the middle of the picture");
        }
    }
}

#[test]
fn rays_that_pass_a_plane_outside_the_box_are_not_changed() {
    let volume = field([20, 18, 16]);
    let scene = Scene::new(telling(0.0, 1.0)).with_camera(orbit(35.0, 25.0, 1.1, WIDE)).with_size(48, 40).unwrap();
    let scene = scene.with_slices(Slicing::Count(40)).unwrap().with_terminate(0.0).unwrap();
    let (plain, plain_stats) = render(&volume, &scene);
    let want: Vec<[f64; 4]> = plain.pixels().iter().map(|p| p.map(f64::from)).collect();
    // A plane beyond the box, and none at all.
    let beyond = scene.clone().with_cuts(vec![through(&volume, DVec3::X, 1.5)]).unwrap();
    let (picture, stats) = render(&volume, &beyond);
    assert!(difference(&picture, &want) < 1e-6 && stats.fragments == plain_stats.fragments);
    assert_eq!(render(&volume, &scene.clone().with_cuts(Vec::new()).unwrap()).0.sha256(), plain.sha256());
    // A plane near a corner of the box: some rays end there, and others do not although they pass it further on.
    let corner = scene.with_cuts(vec![through(&volume, DVec3::new(1.0, -0.3, 1.2), -0.15)]).unwrap();
    let (picture, _) = render(&volume, &corner);
    let (mut ended, mut same) = (0, 0);
    for (i, (p, w)) in picture.pixels().iter().zip(&want).enumerate() {
        let (x, y) = ((i % 48) as u32, (i / 48) as u32);
        if Integrator::new(&corner, &volume).unwrap().pixel(x, y).1.transmittance == 0.0 {
            assert_eq!(p[3], 1.0);
            ended += 1;
        } else {
            assert!((0..4).all(|c| (f64::from(p[c]) - w[c]).abs() < 1e-6), "pixel ({x},{y})");
            same += usize::from(p[3] > 0.0);
        }
    }
    assert!(ended > 50 && same > 100, "{ended} rays end at the plane, {same} do not");
}

#[test]
fn through_a_transparent_volume_three_planes_are_seen_alone() {
    let volume = field([20, 18, 16]);
    let planes = three(&volume);
    let scene = Scene::new(nothing()).with_camera(orbit(30.0, 30.0, 1.2, WIDE)).with_size(48, 40).unwrap();
    let scene = scene.with_slices(Slicing::Count(20)).unwrap().with_cuts(planes.clone()).unwrap();
    let (picture, stats) = render(&volume, &scene);
    let want = image(&scene, &volume, Region::whole(&scene)).unwrap();
    let off = difference(&picture, want.pixels());
    assert!(off < 1e-6 && picture.pixels().iter().filter(|p| p[3] == 1.0).count() > 250, "{off:.2e}");
    // However many slices, and whatever lies between the planes: nothing of it is looked up.
    assert_eq!(stats.tally.looked_up, 0);
    let other = scene.clone().with_slices(Slicing::Count(3)).unwrap();
    assert_eq!(render(&volume, &other).0.sha256(), picture.sha256());
    // The planes in another order are the same planes.
    let turned = scene.with_cuts(planes.into_iter().rev().collect()).unwrap();
    assert_eq!(render(&volume, &turned).0.sha256(), picture.sha256());
}

#[test]
fn a_plane_has_a_hole_where_the_data_has_none() {
    let dims = [12, 12, 12];
    let Voxels::F32(mut v) = super::fill::<f32>(dims, &|[x, ..]| 0.5 + 0.4 * x) else { unreachable!() };
    v[6 * 144 + 5 * 12 + 6] = f32::NAN;
    let volume = Volume::new(Grid::with_spacing(dims, [1.0; 3]).unwrap(), Voxels::F32(v)).unwrap();
    let eye = Placement::LookAt { eye: DVec3::new(5.5, 5.5, 40.0), target: DVec3::new(5.5, 5.5, 0.0), up: DVec3::Y };
    let camera = Camera::new(eye, Projection::Orthographic { height: Some(12.0) }).unwrap();
    let front = CutPlane::new(DVec3::Z, 6.3).unwrap().with_window(0.5, 1.0).unwrap();
    let scene = |cuts: Vec<CutPlane>| {
        let scene = Scene::new(nothing()).with_camera(camera).with_size(48, 48).unwrap();
        scene.with_slices(Slicing::Count(9)).unwrap().with_cuts(cuts).unwrap()
    };
    let (one, _) = render(&volume, &scene(vec![front]));
    let clear = one.pixels().iter().filter(|p| p[3] == 0.0).count();
    // Two cells along each axis, four pixels a voxel.
    assert_eq!(clear, 64);
    // A plane behind is seen through the hole.
    let back = CutPlane::new(DVec3::Z, 1.0).unwrap().with_window(0.5, 1.0).unwrap().with_colors(ColorMap::Hot);
    let (two, _) = render(&volume, &scene(vec![front, back]));
    assert!(two.pixels().iter().all(|p| p[3] == 1.0));
    assert_eq!(one.pixels().iter().zip(two.pixels()).filter(|(a, b)| a != b).count(), 64);
}

#[test]
fn a_tolerance_and_planes_beside_the_picture_go_with_cuts() {
    let volume = field([40, 36, 32]);
    let scene = Scene::new(telling(0.0, 1.0)).with_camera(orbit(30.0, 30.0, 1.2, PARALLEL)).with_size(64, 48).unwrap();
    let scene = scene.with_cuts(three(&volume)).unwrap();
    let tolerant = scene.clone().with_slices(Slicing::Tolerance(0.004)).unwrap();
    let want = image(&tolerant, &volume, Region::every(&tolerant, 2)).unwrap();
    let (picture, stats) = render(&volume, &tolerant);
    let mut sum = 0.0;
    for (n, truth) in want.pixels().iter().enumerate() {
        let (x, y) = want.place(n);
        sum += (0..3).map(|c| (f64::from(picture.pixel(x, y)[c]) - truth[c]).powi(2)).sum::<f64>();
    }
    let rms = (sum / (3 * want.pixels().len()) as f64).sqrt();
    assert!(rms <= 0.004, "{rms:.2e} in {} slices", stats.slices);
    // Depth where the plane is, for rays that come to it half clear.
    let clear = scene.with_transfer(nothing()).with_slices(Slicing::Count(20)).unwrap();
    let planes = [Aov::Depth, Aov::Value, Aov::Alpha];
    let (picture, _, seen) = Renderer::new(&volume, Settings::default()).render_with(&clear, &planes).unwrap();
    let truth = Integrator::new(&clear, &volume).unwrap();
    let mut checked = 0;
    for i in (0..64 * 48).step_by(5).filter(|&i| picture.pixels()[i][3] == 1.0) {
        let (_, ray) = truth.pixel(i as u32 % 64, i as u32 / 64);
        let (_, exit) = ray.span.unwrap();
        let off = (f64::from(seen[0].numbers()[i]) - exit).abs();
        assert!(off < 1e-5 * exit && seen[2].numbers()[i] == 1.0 && seen[1].numbers()[i].is_finite(), "pixel {i}: {off:.2e}");
        checked += 1;
    }
    assert!(checked > 50, "{checked}");
}

#[test]
fn work_beside_planes_adds_up() {
    let volume = field([24, 22, 20]);
    for (camera, end) in
        [(orbit(30.0, 20.0, 1.2, PARALLEL), 0.0), (orbit(0.0, 0.0, 1.0, PARALLEL), 0.2), (orbit(200.0, -40.0, 1.1, WIDE), 0.2)]
    {
        for cuts in [three(&volume), Vec::new()] {
            for jitter in [None, Some(3)] {
                let scene = Scene::new(telling(0.0, 1.0)).with_camera(camera).with_size(45, 38).unwrap().with_terminate(end).unwrap();
                let scene = scene.with_slices(Slicing::Count(40)).unwrap().with_cuts(cuts.clone()).unwrap().with_jitter(jitter).unwrap();
                let (_, stats) = render(&volume, &scene);
                let t = &stats.tally;
                assert_eq!(t.fragments + t.corners, t.looked_up + t.empty + t.finished + t.merged, "{t:?}");
                assert_eq!(stats.fetches, t.looked_up + t.beside + t.between, "{t:?}");
                assert!(t.empty == 0 && (end == 0.0 || t.finished > 0), "every value shows: {t:?}");
            }
        }
    }
}

#[test]
fn what_has_no_place_for_planes_is_refused() {
    let volume = field([8, 8, 8]);
    let scene = || Scene::new(telling(0.0, 1.0)).with_cuts(three(&volume)).unwrap();
    let said = |scene: slicestack::Result<Scene>| scene.unwrap_err().to_string();
    assert!(said(scene().with_blend(Blend::Mip)).contains("are for render.blend \"over\" alone"));
    assert!(said(scene().with_algorithm(Algorithm::Rays)).contains("slices and shells, not for rays"));
    assert!(said(scene().with_method(Method::default().with_merge(true))).contains("slabs do not merge"));
    let pairs = Method::default().with_classification(Classification::PreIntegrated);
    assert!(said(scene().with_method(pairs)).contains("choose post"));
    let seven = vec![three(&volume)[0]; 7];
    assert!(said(Scene::new(nothing()).with_cuts(seven)).contains("7 cut planes: at most 6"));
}
