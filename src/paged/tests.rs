use super::*;
use crate::Renderer;
use crate::scene::{
    Camera, Classification, ClipPlane, Fog, FogDistance, FogMode, Lighting, Method, Order, Placement, Projection, TransferFunction,
};
use crate::volume::Volume;
use crate::volume::phantom::Phantom;
use glam::DVec3;

const MEMORY: u64 = 96 << 20;

fn paged(volume: &Volume, scene: &Scene, memory: u64, threads: usize) -> (Picture, RenderStats, PageStats) {
    let levels = Levels::of_volume(volume).unwrap();
    PagedRenderer::new(levels, Settings::new().threads(threads), memory).render(scene).unwrap()
}

fn farthest(a: &Picture, b: &Picture) -> f32 {
    a.pixels().iter().zip(b.pixels()).flat_map(|(a, b)| (0..4).map(move |c| (a[c] - b[c]).abs())).fold(0.0, f32::max)
}

fn rms(a: &Picture, b: &Picture) -> f64 {
    let squares = a.pixels().iter().zip(b.pixels()).flat_map(|(a, b)| (0..3).map(move |c| f64::from(a[c] - b[c])));
    (squares.map(|d| d * d).sum::<f64>() / (3 * a.pixels().len()) as f64).sqrt()
}

fn head(size: usize) -> Volume {
    Phantom::SheppLogan.volume(size).unwrap()
}

fn scene(size: usize) -> Scene {
    Scene::new(Phantom::SheppLogan.default_transfer(size)).with_size(110, 90).unwrap()
}

fn inside(volume: &Volume) -> Camera {
    let center = volume.grid().center();
    let eye = center + DVec3::new(0.2, -0.55, 0.1) * volume.grid().radius();
    let placement = Placement::LookAt { eye, target: center + DVec3::new(0.0, 1.0, 0.4), up: DVec3::Z };
    Camera::new(placement, Projection::Perspective { fov_y: 70.0 }).unwrap()
}

/// Every scene here has pixels smaller than voxels, so that all slices are of the finest level.
fn scenes(volume: &Volume, size: usize) -> Vec<(&'static str, Scene)> {
    let base = scene(size).with_slices(Slicing::Count(190)).unwrap();
    let center = volume.grid().center();
    let orbit = |a: f64, e: f64| Camera::orbit(a, e).unwrap();
    let perspective = |a: f64, e: f64| {
        let placement = Placement::Orbit { azimuth: a, elevation: e, roll: 11.0, zoom: 1.4 };
        Camera::new(placement, Projection::Perspective { fov_y: 35.0 }).unwrap()
    };
    let plane = ClipPlane::new(DVec3::new(0.3, 1.0, -0.2), DVec3::new(0.3, 1.0, -0.2).dot(center)).unwrap();
    let fog = Fog::new(FogMode::Exp2 { density: 0.02 }, [0.3, 0.5, 0.7]).unwrap();
    let lit = || base.clone().with_lighting(Some(Lighting::default())).unwrap();
    let method = |classification| Method { classification, ..Method::default() };
    vec![
        ("straight", base.clone().with_camera(orbit(0.0, 0.0))),
        ("oblique", base.clone().with_camera(orbit(37.0, 29.0))),
        ("perspective", base.clone().with_camera(perspective(-50.0, 20.0))),
        ("inside", base.clone().with_camera(inside(volume))),
        ("clipped", base.clone().with_camera(orbit(20.0, -35.0)).with_clip_planes(vec![plane]).unwrap()),
        ("fog", base.clone().with_camera(perspective(15.0, 50.0)).with_fog(Some(fog))),
        ("radial fog", base.clone().with_camera(inside(volume)).with_fog(Some(fog.with_distance(FogDistance::Radial)))),
        ("lit", lit().with_camera(orbit(-65.0, 15.0))),
        ("lit, perspective", lit().with_camera(perspective(130.0, -25.0))),
        ("pre-integrated", base.clone().with_camera(orbit(33.0, 12.0)).with_method(method(Classification::PreIntegrated)).unwrap()),
        ("second order", base.clone().with_camera(perspective(71.0, 12.0)).with_method(method(Classification::SecondOrder)).unwrap()),
        (
            "few slabs",
            base.clone()
                .with_slices(Slicing::Count(23))
                .unwrap()
                .with_camera(orbit(33.0, 12.0))
                .with_method(method(Classification::PreIntegrated))
                .unwrap(),
        ),
        ("back to front", base.clone().with_camera(orbit(200.0, 40.0)).with_order(Order::BackToFront)),
        ("compensated", base.clone().with_slices(Slicing::Count(3000)).unwrap().with_camera(orbit(77.0, 3.0))),
        ("from voxels", base.clone().with_camera(orbit(12.0, 55.0)).with_method(method(Classification::Pre)).unwrap()),
        ("to the end", base.with_camera(orbit(140.0, 8.0)).with_terminate(0.0).unwrap()),
    ]
}

#[test]
fn pictures_equal_those_of_the_whole() {
    let size = 48;
    let volume = head(size);
    for (name, scene) in scenes(&volume, size) {
        let (plain, stats) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
        let (pieces, paged_stats, pages) = paged(&volume, &scene, MEMORY, 2);
        let far = farthest(&plain, &pieces);
        assert!(far < 2e-6, "{name}: {far:e}");
        assert!(plain.pixels().iter().any(|p| *p != plain.pixels()[0]), "{name}: nothing in it");
        assert_eq!(stats.fragments, paged_stats.fragments, "{name}");
        assert_eq!(pages.pieces.len(), 1, "{name}: {pages:?}");
        assert_eq!(paged_stats.error_estimate, None, "{name}");
    }
}

#[test]
fn every_voxel_type_is_rendered() {
    let size = 40;
    let head = head(size);
    let scene = scene(size).with_camera(Camera::orbit(25.0, 40.0).unwrap());
    for kind in crate::volume::VoxelType::ALL {
        let volume = crate::volume::edit::convert_type(&head, kind, None, &crate::Limits::default(), None).unwrap().volume;
        let (plain, _) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
        let (pieces, ..) = paged(&volume, &scene, MEMORY, 2);
        let far = farthest(&plain, &pieces);
        assert!(far < 2e-6, "{kind}: {far:e}");
    }
}

#[test]
fn neither_memory_nor_threads_change_a_byte() {
    let size = 200;
    let volume = head(size);
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(size)).with_size(90, 80).unwrap();
    for (name, scene) in [
        ("orthographic", scene.clone().with_camera(Camera::orbit(40.0, 25.0).unwrap())),
        ("inside", scene.clone().with_camera(inside(&volume))),
        ("tolerance", scene.with_slices(Slicing::Tolerance(0.004)).unwrap()),
    ] {
        let (first, stats, pages) = paged(&volume, &scene, 1 << 30, 1);
        assert_eq!(pages.bricks_read, distinct(&pages), "{name}: all were kept, so none was read twice");
        for (memory, threads) in [(46 << 20, 1), (64 << 20, 3), (256 << 20, 2)] {
            let (picture, again, some) = paged(&volume, &scene, memory, threads);
            assert_eq!(first.sha256(), picture.sha256(), "{name}: {memory} bytes, {threads} threads");
            assert_eq!((stats.slices, stats.error_estimate), (again.slices, again.error_estimate), "{name}");
            assert!(some.peak_bytes <= some.limit_bytes, "{name}: {some:?}");
        }
    }
}

/// Bricks read where none is read twice: those that were ever in memory.
fn distinct(pages: &PageStats) -> u64 {
    assert!(pages.bricks_read < pages.bricks_asked && pages.peak_bytes > 0);
    pages.bricks_read
}

#[test]
fn levels_follow_the_pixels_and_their_error_is_estimated() {
    let size = 256;
    let mut coarse = 0;
    for phantom in [Phantom::SheppLogan, Phantom::Cloud, Phantom::MarschnerLobb, Phantom::Hydrogen, Phantom::DistanceField] {
        let volume = phantom.volume(size).unwrap();
        let scene = Scene::new(phantom.default_transfer(size)).with_size(72, 64).unwrap();
        let scene = scene.with_camera(Camera::orbit(35.0, 20.0).unwrap());
        let (plain, _) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
        let (picture, stats, pages) = paged(&volume, &scene, MEMORY, 2);
        let is = rms(&plain, &picture);
        assert!(is < USUAL_TOLERANCE, "{phantom:?}: {is:e}, {pages:?}");
        assert_eq!(pages.level_error, stats.error_estimate.unwrap_or(0.0));
        // What needed the finest level has no error of levels.
        let Some(told) = stats.error_estimate else {
            assert!(is < 2e-6, "{phantom:?}: {is:e}");
            continue;
        };
        coarse += 1;
        assert!(told <= USUAL_TOLERANCE && told > 0.4 * is, "{phantom:?}: {is:e}, told {told:e}");
        assert!(pages.pieces.len() > 1, "{phantom:?}: {pages:?}");
    }
    assert!(coarse >= 2, "{coarse} pictures of coarser levels");
}

#[test]
fn a_tolerance_bounds_levels_and_slices_together() {
    let size = 192;
    let volume = head(size);
    let scene = Scene::new(Phantom::SheppLogan.default_transfer(size)).with_size(96, 96).unwrap();
    let scene = scene.with_camera(Camera::orbit(10.0, 30.0).unwrap());
    let truth = scene.clone().with_slices(Slicing::Count(4000)).unwrap().with_terminate(0.0).unwrap();
    let (truth, _) = Renderer::new(&volume, Settings::default()).render(&truth).unwrap();
    for tolerance in [0.02, 0.004, 0.001] {
        let (picture, stats, _) = paged(&volume, &scene.clone().with_slices(Slicing::Tolerance(tolerance)).unwrap(), MEMORY, 2);
        let is = rms(&truth, &picture);
        assert!(is < tolerance, "{tolerance}: {is:e}, told {:?}, {} slices", stats.error_estimate, stats.slices);
        assert!(stats.error_estimate.unwrap() < tolerance);
        assert!(stats.warnings.is_empty());
    }
}

#[test]
fn what_lies_behind_an_opaque_front_is_not_read() {
    let [side, depth] = [64, 4000];
    let mut values = vec![0u8; side * side * depth];
    values[200 * side * side..220 * side * side].fill(200);
    let grid = crate::volume::Grid::with_spacing([side, side, depth], [1.0; 3]).unwrap();
    let volume = Volume::new(grid, values.into()).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(100.0, 0.0), (150.0, 1.0)]).unwrap();
    let placement = Placement::Along { axis: 2, backwards: false };
    let camera = Camera::new(placement, Projection::Orthographic { height: None }).unwrap();
    let scene = Scene::new(transfer).with_size(side as u32, side as u32).unwrap().with_camera(camera);
    let scene = scene.with_slices(Slicing::Spacing(1.0)).unwrap();
    let (picture, _, pages) = paged(&volume, &scene, MEMORY, 2);
    assert!(picture.pixels().iter().all(|p| p[3] > 0.99));
    assert!(pages.bytes_read < (volume.voxels().bytes() / 2) as u64, "{pages:?}");
    // Where nothing shows at all everything is read once, and no piece is rendered.
    let nothing = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(210.0, 0.0), (220.0, 1.0)]).unwrap();
    let (picture, _, pages) = paged(&volume, &scene.with_transfer(nothing), MEMORY, 2);
    assert!(picture.pixels().iter().all(|p| *p == [0.0; 4]));
    assert_eq!((pages.pieces.iter().sum::<u64>(), pages.bytes_read), (0, volume.voxels().bytes() as u64));
}

#[test]
fn what_is_not_made_in_pieces_is_refused_in_one_line() {
    let base = scene(20);
    let refused = |scene: Scene| PagedRenderer::check(&scene).unwrap_err().to_string();
    for (scene, word) in [
        (base.clone().with_blend(Blend::Mip).unwrap(), "blend"),
        (base.clone().with_algorithm(Algorithm::Rays).unwrap(), "algorithm slices"),
        (base.clone().with_jitter(Some(1)).unwrap(), "jitter"),
        (base.clone().with_method(Method::default().with_filter(crate::scene::Filter::CUBIC)).unwrap(), "cubic"),
        (base.clone().with_method(Method { merge: true, ..Method::default() }).unwrap(), "merge"),
    ] {
        let said = refused(scene);
        assert!(said.contains(word) && !said.contains('\n'), "{said}");
    }
    let levels = Levels::of_volume(&head(20)).unwrap();
    let said = PagedRenderer::new(levels, Settings::new().threads(2), 1 << 20).render(&base).unwrap_err().to_string();
    assert!(said.starts_with("1048576 bytes of memory: a picture of 110 x 90 in 2 threads takes "), "{said}");
}

#[test]
fn nothing_to_see_is_a_picture_of_the_background() {
    let volume = head(20);
    let placement = Placement::LookAt { eye: DVec3::splat(1e4), target: DVec3::splat(2e4), up: DVec3::Z };
    let camera = Camera::new(placement, Projection::Perspective { fov_y: 30.0 }).unwrap();
    let (picture, stats, _) = paged(&volume, &scene(20).with_camera(camera), MEMORY, 2);
    assert!(picture.pixels().iter().all(|p| *p == [0.0; 4]));
    assert_eq!(stats.warnings.len(), 1);
}
