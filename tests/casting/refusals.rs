//! What an algorithm does not have is refused in one line that says why.

use crate::{PARALLEL, drawn, looking, numbers, plain, telling};
use glam::DVec3;
use slicestack::scene::{
    Accumulation, Algorithm, Blend, Camera, Classification, Connectivity, Ends, Filter, Fog, FogMode, FogWeighting, Hit, Method, Order,
    Placement, Projection, SampleAt, SlabForm, Slicing, Target, TemplatePlane,
};
use slicestack::{Renderer, Scene, Settings};

const TRAVERSAL: Algorithm = Algorithm::Traversal(Connectivity::Six);
const LAYERS: Algorithm = Algorithm::ObjectSlices { spacing_correction: true };
const COINS: Algorithm = Algorithm::CoinFlips { games: 4, seed: 0 };

/// The line that refuses `scene` drawn by `algorithm`, whichever is set first.
fn refused(scene: Scene, algorithm: Algorithm) -> String {
    let line = scene.with_algorithm(algorithm).unwrap_err().to_string();
    assert!(!line.contains('\n'), "{line}");
    line
}

#[test]
fn what_rays_do_not_have_is_refused() {
    let scene = || plain(telling(), 8, 8);
    let by = |m: Method| scene().with_method(m).unwrap();
    let m = Method::default();
    let literal = Fog::new(FogMode::Exp { density: 0.1 }, [1.0; 3]).unwrap().with_weighting(FogWeighting::Literal);
    let cases = [
        (by(m.with_classification(Classification::PreIntegrated)), Algorithm::Rays, "transfer classification"),
        (by(m.with_classification(Classification::SecondOrder)), TRAVERSAL, "transfer classification"),
        (by(m.with_merge(true)), Algorithm::Rays, "slices merge"),
        (by(m.with_extrapolate(true)), COINS, "slices extrapolate"),
        (by(m.with_target(Target::Unorm8)), LAYERS, "render target"),
        (by(m.with_accumulation(Accumulation::Compensated)), Algorithm::Rays, "slices accumulation"),
        (scene().with_slices(Slicing::Tolerance(0.01)).unwrap(), Algorithm::Rays, "slices tolerance"),
        (scene().with_slices(Slicing::Tolerance(0.01)).unwrap(), Algorithm::Grid, "slices tolerance"),
        (scene().with_jitter(Some(1)).unwrap(), LAYERS, "slices jitter"),
        (scene().with_order(Order::BackToFront), Algorithm::Rays, "slices order"),
        (scene().with_blend(Blend::Mip).unwrap(), COINS, "render blend"),
        (scene().with_blend(Blend::Iso { level: 5.0 }).unwrap(), TRAVERSAL, "render blend"),
        (scene().with_blend(Blend::Iso { level: 5.0 }).unwrap(), Algorithm::Grid, "render hit"),
        (scene().with_fog(Some(literal)), COINS, "fog weighting"),
        (scene().with_fog(Some(literal)), Algorithm::Grid, "fog weighting"),
        (by(m.with_slab(SlabForm::Riemann)), COINS, "slices slab"),
        (by(m.with_sample(SampleAt::End)), TRAVERSAL, "slices sample"),
        (by(m.with_ends(Ends::Whole)), LAYERS, "slices ends"),
        (by(m.with_filter(Filter::CUBIC)), LAYERS, "render filter"),
        (by(m.with_filter(Filter::CUBIC)), Algorithm::Grid, "render filter"),
    ];
    for (scene, algorithm, key) in cases {
        let line = refused(scene, algorithm);
        let want = format!("{key}: does not go together with render algorithm {}: ", algorithm.name());
        assert!(line.starts_with(&want), "{line}");
    }
    // The other way round too.
    let rays = scene().with_algorithm(Algorithm::Rays).unwrap();
    assert!(rays.clone().with_method(m.with_merge(true)).is_err());
    assert!(rays.clone().with_slices(Slicing::Tolerance(0.1)).is_err());
    assert!(rays.with_jitter(Some(3)).is_err());
}

#[test]
fn what_only_the_camera_tells_is_refused_when_a_picture_is_made() {
    let volume = numbers([6, 6, 6]);
    let line = |scene: Scene, settings: Settings| Renderer::new(&volume, settings).render(&scene).unwrap_err().to_string();
    let wide = looking(DVec3::new(9.0, 5.0, 4.0), &volume, Projection::Perspective { fov_y: 60.0 });
    let template = plain(telling(), 8, 8).with_camera(wide).with_algorithm(Algorithm::Template(TemplatePlane::Base)).unwrap();
    let said = line(template, Settings::new());
    assert_eq!(said, "camera projection perspective: render algorithm template moves one ray, and rays of it are not parallel");
    let grid = plain(telling(), 8, 8).with_algorithm(Algorithm::Grid).unwrap();
    let said = line(grid, Settings::new());
    assert_eq!(said, "camera: render algorithm grid looks along an axis of the volume; give camera.along");
    let rays = plain(telling(), 8, 8).with_algorithm(Algorithm::Rays).unwrap();
    assert!(line(rays.clone(), Settings::new().estimate(true)).starts_with("estimate: render algorithm rays "));
    let layer = Renderer::new(&volume, Settings::new()).render_layer(&rays).unwrap_err().to_string();
    assert!(layer.contains("the algorithm rays makes whole pictures"), "{layer}");
    let planes = Renderer::new(&volume, Settings::new()).render_with(&rays, &[slicestack::Aov::Depth]).unwrap_err().to_string();
    assert_eq!(planes, "aov depth: render algorithm rays makes pictures alone; choose slices");
}

#[test]
fn cameras_along_an_axis_are_orthographic_and_see_it_straight_on() {
    let along = |axis| Placement::Along { axis, backwards: false };
    assert!(Camera::new(along(3), PARALLEL).is_err());
    let said = Camera::new(along(0), Projection::Perspective { fov_y: 30.0 }).unwrap_err().to_string();
    assert_eq!(said, "camera along: looks along parallel rays; choose the orthographic projection");
    let sheared = glam::DMat3::from_cols(DVec3::X, DVec3::new(0.3, 1.0, 0.0), DVec3::Z);
    let grid = slicestack::volume::Grid::new([4, 5, 6], DVec3::ZERO, sheared).unwrap();
    let said = Camera::new(along(2), PARALLEL).unwrap().resolve(&grid, 8, 8).unwrap_err().to_string();
    assert_eq!(said, "camera along: the volume's axes are not at right angles, so none is seen straight on");
    // The other algorithms see what the grid sees.
    let volume = numbers([8, 8, 8]).with_grid(slicestack::volume::Grid::with_spacing([8; 3], [1.0; 3]).unwrap()).unwrap();
    for axis in 0..3 {
        let scene = plain(telling(), 8, 8).with_camera(Camera::new(along(axis), PARALLEL).unwrap());
        let difference = crate::largest(&drawn(&volume, &scene), &drawn(&volume, &crate::with(&scene, Algorithm::Grid)));
        assert!(difference < 2e-5, "axis {axis}: {difference}");
    }
    let hit = plain(telling(), 8, 8).with_blend(Blend::Iso { level: 5.0 }).unwrap().with_hit(Hit::FirstSample);
    assert!(hit.with_algorithm(Algorithm::Grid).is_ok());
}

/// Scenes as files say them.
#[cfg(feature = "scene-file")]
mod files {
    use slicestack::scene::{Overrides, SceneFile, Slicing};
    use slicestack::volume::phantom::Phantom;

    fn resolved(text: &str) -> slicestack::Result<slicestack::scene::ResolvedScene> {
        let volume = Phantom::Cloud.volume_as(12, slicestack::volume::VoxelType::U8, &Default::default()).unwrap();
        SceneFile::parse(&format!("[volume]\nphantom = \"cloud\"\nsize = 12\n{text}"), "", &Overrides::default())?.resolve(&volume)
    }

    #[test]
    fn steps_are_chosen_and_told_where_the_file_leaves_them_open() {
        let found = resolved("[render]\nalgorithm = \"rays\"\n").unwrap();
        assert!(matches!(found.scene.slicing(), Slicing::Spacing(s) if s > 0.0), "{:?}", found.scene.slicing());
        assert!(found.notes.iter().any(|n| n.contains("\"rays\" does not choose them for an error")), "{:?}", found.notes);
        let found = resolved("[render]\nalgorithm = \"traversal\"\n[slices]\ncount = 9\n").unwrap();
        let said = "slices.count is not heeded: render.algorithm = \"traversal\" goes from voxel to voxel";
        assert!(found.notes.iter().any(|n| n == said), "{:?}", found.notes);
        let line = resolved("[render]\nalgorithm = \"rays\"\n[slices]\ntolerance = 0.01\n").unwrap_err().to_string();
        assert!(line.starts_with("line 7: slices tolerance: does not go together") && !line.contains('\n'), "{line}");
    }

    #[test]
    fn a_picture_of_voxels_has_a_pixel_for_each_unless_the_file_says_otherwise() {
        let along = |more: &str| resolved(&format!("[render]\nalgorithm = \"grid\"\n[camera]\nalong = \"-y\"\n{more}")).unwrap().scene;
        assert_eq!(along("").size(), (12, 12));
        assert_eq!(along("[image]\nwidth = 30\n").size(), (30, 12));
        let line = resolved("[camera]\nalong = \"y\"\nazimuth = 3\n").unwrap_err().to_string();
        assert_eq!(line, "line 6: camera.azimuth: camera.along looks along an axis; give one of them");
        let line = resolved("[camera]\nalong = \"y\"\neye = [1, 2, 3]\n").unwrap_err().to_string();
        assert_eq!(line, "line 6: camera.eye: camera.along looks along an axis; give one of them");
        assert!(resolved("[camera]\nalong = \"w\"\n").is_err());
    }
}

#[test]
#[cfg(feature = "explain")]
fn the_teaching_page_is_for_slices() {
    use slicestack::explain::{Request, explain};
    let scene = plain(telling(), 8, 8).with_algorithm(Algorithm::Rays).unwrap();
    let said = explain(&numbers([6, 6, 6]), &scene, &Settings::new(), &Request::new()).unwrap_err().to_string();
    assert_eq!(said, "render algorithm rays: a page shows flat slices, at one depth for all pixels; choose slices without jitter");
}

#[test]
#[cfg(feature = "study")]
fn a_report_draws_the_algorithms_beside_each_other() {
    use slicestack::study::{NamedMethod, Options, study};
    let options = Options::new().budget(2.0).methods(vec![NamedMethod::named("midpoint").unwrap()]);
    let volume = slicestack::volume::phantom::Phantom::Cloud.volume(16).unwrap();
    let transfer = slicestack::scene::TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.2])], vec![(0.0, 0.0), (1.0, 0.3)]).unwrap();
    let scene = plain(transfer, 24, 64);
    let rows = study(&volume, &scene, &options).unwrap().record.algorithms;
    let error = |name: &str| rows.iter().find(|r| r.algorithm == name).unwrap_or_else(|| panic!("{name} is missing")).rms;
    for row in &rows {
        println!("{}: {} samples, rms {:.1e}, largest {:.1e}", row.algorithm, row.samples, row.rms, row.max);
    }
    assert!((error("rays") / error("slices") - 1.0).abs() < 1e-2, "{} for {}", error("rays"), error("slices"));
    assert!(error("object-slices") < error("object-slices, spacing_correction false"));
    assert!(error("slices") < error("coin-flips, 64 games") && error("template") > 0.0);
    let said = study(&volume, &scene.with_algorithm(Algorithm::Rays).unwrap(), &options).unwrap_err().to_string();
    assert!(said.starts_with("render algorithm rays: a report compares ways to integrate slices"), "{said}");
}
