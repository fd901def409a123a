use super::*;
use crate::fragment::Batch;
use crate::raster::Resolve;
use crate::renderer::OverBackground;
use crate::scene::{
    Accumulation, Camera, Classification, ClipPlane, Ends, Filter, FocusRegion, FocusShape, Fog, FogDistance, FogMode, FogWeighting,
    LevelSurface, Order, Placement, Projection, SampleAt, SegmentEffect, SegmentStyle, SlabForm, Straight, Target, TransferFunction,
};
use crate::volume::phantom::Phantom;
use crate::volume::{Grid, Voxel, VoxelType, Voxels};
use glam::DVec3;
use record::Column;

pub(super) const PARALLEL: Projection = Projection::Orthographic { height: None };
pub(super) const WIDE: Projection = Projection::Perspective { fov_y: 50.0 };

fn haze() -> TransferFunction {
    let color = vec![(0.0, [0.2, 0.4, 1.0]), (0.3, [1.0, 0.8, 0.2]), (0.7, [1.0, 0.2, 0.1])];
    TransferFunction::new(color, vec![(0.05, 0.0), (0.3, 0.08), (0.5, 0.04), (0.8, 0.5)]).unwrap()
}

pub(super) fn scene(projection: Projection) -> Scene {
    let camera = Camera::new(Placement::Orbit { azimuth: 25.0, elevation: 20.0, roll: 5.0, zoom: 1.2 }, projection).unwrap();
    let scene = Scene::new(haze()).with_camera(camera).with_size(45, 38).unwrap().with_slices(Slicing::Count(60)).unwrap();
    scene.with_background(Straight { rgb: [0.1, 0.12, 0.2], alpha: 0.7 }).unwrap()
}

fn method(scene: Scene, method: Method) -> Scene {
    scene.with_method(method).unwrap()
}

fn fog(mode: FogMode) -> Fog {
    Fog::new(mode, [0.7, 0.75, 0.8]).unwrap()
}

/// A name for messages, a volume, a scene.
fn scenes() -> Vec<(&'static str, Volume, Scene)> {
    let head = || Phantom::SheppLogan.volume(24).unwrap();
    let plain = Method::default();
    let (far, linear) = (60.0, fog(FogMode::Linear { start: 20.0, end: 60.0 }));
    let plane = ClipPlane::new(DVec3::new(1.0, 0.4, 0.2), 8.0).unwrap();
    let strong = TransferFunction::new(vec![(0.0, [0.1, 0.3, 1.0]), (0.3, [0.9, 0.9, 0.3])], vec![(0.0, 0.1), (0.4, 0.8)]).unwrap();
    let values = (0..4 * 5 * 6).map(|i| (i * 37 % 120) as i16 - 20).collect();
    let small = Volume::new(Grid::with_spacing([4, 5, 6], [1.0, 2.0, 1.5]).unwrap(), Voxels::I16(values)).unwrap();
    let small = small.with_rescale(-0.005, 0.1).unwrap();
    let projected = |blend| scene(PARALLEL).with_transfer(strong.clone()).with_blend(blend).unwrap();
    vec![
        ("parallel", head(), scene(PARALLEL)),
        ("perspective", head(), scene(WIDE)),
        ("to the end", head(), scene(WIDE).with_terminate(0.0).unwrap()),
        ("ends early", head(), scene(PARALLEL).with_terminate(0.5).unwrap()),
        ("linear fog", head(), scene(WIDE).with_fog(Some(linear))),
        ("radial fog", head(), scene(WIDE).with_fog(Some(fog(FogMode::Exp { density: 1.0 / far }).with_distance(FogDistance::Radial)))),
        ("literal fog", head(), scene(PARALLEL).with_fog(Some(linear.with_weighting(FogWeighting::Literal)))),
        ("clipped", head(), scene(WIDE).with_clip_planes(vec![plane]).unwrap()),
        ("back to front", head(), scene(PARALLEL).with_order(Order::BackToFront)),
        ("rescaled", small, scene(PARALLEL)),
        ("by place", by_place().0, by_place().1),
        ("tolerance", head(), scene(PARALLEL).with_slices(Slicing::Tolerance(0.01)).unwrap()),
        ("riemann", head(), method(scene(WIDE), Method { slab: SlabForm::Riemann, ..plain })),
        ("nearest", head(), method(scene(WIDE), Method { filter: Filter::Nearest, ..plain })),
        ("samples at the end", head(), method(scene(WIDE), Method { sample: SampleAt::End, ..plain })),
        ("whole ends", head(), method(scene(WIDE), Method { ends: Ends::Whole, ..plain })),
        ("8 bits", head(), method(scene(WIDE), Method { target: Target::Unorm8, ..plain })),
        ("compensated", head(), method(scene(WIDE), Method { accumulation: Accumulation::Compensated, ..plain })),
        ("colours interpolated", head(), method(scene(WIDE), Method { classification: Classification::Pre, ..plain })),
        ("pre-integrated", head(), method(scene(WIDE), Method { classification: Classification::PreIntegrated, ..plain })),
        ("extrapolated", head(), method(scene(WIDE), Method { extrapolate: true, ..plain })),
        ("second order", head(), method(scene(WIDE), Method { classification: Classification::SecondOrder, ..plain })),
        ("mip", head(), projected(Blend::Mip)),
        ("min", head(), projected(Blend::Min)),
        ("add", head(), projected(Blend::Add)),
        ("under", head(), projected(Blend::Under).with_order(Order::BackToFront)),
        ("attenuated-mip", head(), projected(Blend::AttenuatedMip { attenuation: 3.0 })),
        ("lmip", head(), projected(Blend::Lmip { threshold: 0.2 })),
        ("iso", head(), projected(Blend::Iso { level: 0.25 })),
        ("surfaces", head(), projected(Blend::Iso { level: 0.25 }).with_levels(shells()).unwrap()),
    ]
}

fn shells() -> Vec<LevelSurface> {
    [(0.25, 0.3), (0.15, 0.4), (0.6, 1.0)].map(|(level, opacity)| LevelSurface::new(level, None, opacity).unwrap()).to_vec()
}

fn explained(volume: &Volume, scene: &Scene, request: &Request) -> Explanation {
    explain(volume, scene, &Settings::default(), request).unwrap()
}

/// The picture's pixel from what a pixel gathered, by the pipeline's last step.
pub(super) fn resolved(explanation: &Explanation, volume: &Volume, scene: &Scene, pixel: &PixelRecord) -> [f32; 4] {
    let counted = scene.clone().with_slices(Slicing::Count(explanation.record.stack.count)).unwrap();
    let mut renderer = Renderer::new(volume, Settings::default());
    let plan = renderer.plan(&counted).unwrap();
    let resolve = Resolve::new(&counted, &plan);
    let finish = OverBackground::new(scene, &plan.needs.method);
    let mut batch = Batch::new(true, true);
    for c in 0..3 {
        batch.pixels.color[c][0] = pixel.gathered[c];
    }
    batch.pixels.transmittance[0] = pixel.gathered[3];
    batch.pixels.excess[3][0] = pixel.excess;
    resolve.finished(&finish, &batch.pixels, (0, pixel.x as usize, pixel.y as usize))
}

#[test]
fn the_last_recorded_value_is_the_rendered_pixel_to_the_bit() {
    for (name, volume, scene) in scenes() {
        let e = explained(&volume, &scene, &Request::default());
        let again = Renderer::new(&volume, Settings::default()).render(&scene).unwrap().0;
        let tolerance = matches!(scene.slicing(), Slicing::Tolerance(_));
        assert!(e.record.pixels.len() > 10, "{name}: {} pixels", e.record.pixels.len());
        for p in &e.record.pixels {
            // Where blocks have slices of their own, those of the chosen pixel's block were given to all.
            if !scene.method().extrapolate && !tolerance || (tolerance && (p.x, p.y) == e.pixel()) {
                let rendered = again.pixel(p.x, p.y);
                assert_eq!(p.picture.map(f32::to_bits), rendered.map(f32::to_bits), "{name}: pixel {},{}", p.x, p.y);
            }
            let want = resolved(&e, &volume, &scene, p).map(f32::to_bits);
            assert_eq!(want, p.picture.map(f32::to_bits), "{name}: pixel {},{}: {:?} from {:?}", p.x, p.y, p.picture, p.gathered);
            if let (Some(sum), Some(t)) = (p.sum.last(), p.transmittance.last()) {
                assert_eq!([sum[0], sum[1], sum[2], *t].map(f32::to_bits), p.gathered.map(f32::to_bits), "{name}: pixel {},{}", p.x, p.y);
            }
        }
        let chosen = &e.record.pixels[e.record.chosen];
        assert!(chosen.slice.len() > 5, "{name}: {:?}", chosen.slice);
    }
}

/// The head, its upper half labelled 1, which is tinted; and a sphere in which another function holds.
fn by_place() -> (Volume, Scene) {
    let head = Phantom::SheppLogan.volume(24).unwrap();
    let labels: Vec<u8> = (0..head.voxels().len()).map(|i| u8::from(i > head.voxels().len() / 2)).collect();
    let volume = head.clone().with_labels(&Volume::new(head.grid().clone(), labels.into()).unwrap()).unwrap();
    let tint = SegmentStyle::new(1, SegmentEffect::Tint { color: [0.1, 1.0, 0.2], strength: 0.8 }).unwrap();
    let even = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.1)]).unwrap();
    let center = volume.grid().center();
    let sphere = FocusRegion::new(FocusShape::Sphere { radius: 0.3 * volume.grid().radius() }, center, even).unwrap();
    let scene = scene(WIDE).with_segments(vec![tint]).unwrap().with_regions(vec![sphere]).unwrap();
    (volume, scene)
}

#[test]
fn stages_that_go_by_place_are_on_record_before_the_correction() {
    let (volume, scene) = by_place();
    let e = explained(&volume, &scene, &Request::default());
    let p = &e.record.pixels[e.record.chosen];
    let names: Vec<&str> = p.stages.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["span", "texcoord", "fetch", "classify", "regions", "labels", "correct", "mask", "blend"]);
    let color = |n: usize| match p.stages[n].columns.get("color") {
        Some(Column::Triple(c)) => c.clone(),
        _ => panic!("the colour of {} is not on record", names[n]),
    };
    assert!(color(3) != color(4) && color(4) != color(5), "each changes colours");
}

#[test]
fn every_stage_of_a_fragment_is_on_record() {
    let (_, volume, scene) = scenes().swap_remove(4);
    let e = explained(&volume, &scene, &Request::default());
    let p = &e.record.pixels[0];
    let names: Vec<&str> = p.stages.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["span", "texcoord", "fetch", "classify", "correct", "fog", "mask", "blend"]);
    for stage in &p.stages {
        for column in stage.columns.values() {
            let len = match column {
                Column::Flag(c) => c.len(),
                Column::Number(c) => c.len(),
                Column::Triple(c) => c.len(),
                Column::Voxel(c) => c.len(),
            };
            assert_eq!(len, p.slice.len(), "{}", stage.name);
        }
    }
    assert!(!p.fog.is_empty() && p.fog.iter().any(|f| f[1] < 1.0));
    // The value looked up is the volume's own there.
    let (Some(Column::Voxel(cells)), Some(Column::Triple(weights))) = (p.stages[1].columns.get("cell"), p.stages[1].columns.get("weight"))
    else {
        panic!("texture coordinates are not on record");
    };
    for i in 0..p.slice.len() {
        let (cell, weight) = (cells[i].unwrap(), weights[i].unwrap());
        let at = DVec3::from_array([0, 1, 2].map(|a: usize| cell[a] as f64 + f64::from(weight[a])));
        let value = e.record.scale * f64::from(p.value[i]) + e.record.offset;
        assert!((volume.sample(at) - value).abs() < 1e-5, "slice {}: {value} at {at}", p.slice[i]);
    }
}

#[test]
fn rounds_of_interpolation_end_at_the_value_looked_up() {
    for (name, volume, scene) in scenes() {
        let method = scene.method();
        if method.filter != Filter::Linear || method.classification != Classification::Post {
            continue;
        }
        let e = explained(&volume, &scene, &Request::default());
        let rounds: Vec<_> = e.record.pixels.iter().flat_map(|p| &p.rounds).collect();
        assert!(rounds.len() > 100 && rounds.iter().all(|r| r.is_some()), "{name}");
    }
}

#[test]
fn both_orders_and_the_closed_sum_agree() {
    for (name, volume, scene) in scenes().into_iter().take(9) {
        let e = explained(&volume, &scene, &Request::default());
        for p in e.record.pixels.iter().filter(|p| p.span.is_some()) {
            let (front, back) = (&p.twins["front-to-back"], &p.twins["back-to-front"]);
            let closed = front.closed.unwrap();
            for c in 0..4 {
                // Literal fog gathers more than 1.
                let close = 2e-6 * front.gathered[c].abs().max(1.0);
                assert!((front.gathered[c] - back.gathered[c]).abs() < close, "{name}: {:?} {:?}", front.gathered, back.gathered);
                assert!((f64::from(front.gathered[c]) - closed[c]).abs() < close.into(), "{name}: {:?} {closed:?}", front.gathered);
            }
        }
    }
}

#[test]
fn twins_are_other_renderings_of_the_same_pixel() {
    let (_, volume, weighted) = scenes().swap_remove(4);
    let e = explained(&volume, &weighted, &Request::default());
    let p = &e.record.pixels[0];
    assert_eq!(p.twins["fog-weighted"].gathered, p.gathered);
    assert_ne!(p.twins["fog-literal"].gathered, p.gathered);
    assert_ne!(p.twins["riemann"].gathered, p.twins["front-to-back"].gathered);
    // A literal twin is the picture of the literal scene.
    let literal = weighted.clone().with_fog(weighted.fog().map(|f| f.with_weighting(FogWeighting::Literal)));
    let other = explained(&volume, &literal, &Request { pixel: Some((p.x, p.y)), slices: None });
    assert_eq!(other.record.pixels[0].gathered, p.twins["fog-literal"].gathered);
    // Empty fragments gather light there, and only there.
    let lit = |t: &Twin| (0..t.slice.len()).any(|i| t.covered[i] && t.alpha[i] == 0.0 && t.color[i] != [0.0; 3]);
    assert!(e.record.pixels.iter().any(|p| p.twins.get("fog-literal").is_some_and(lit)));
    assert!(!e.record.pixels.iter().any(|p| p.twins.get("fog-weighted").is_some_and(lit)));
}

#[test]
fn slices_are_those_asked_for() {
    let (_, volume, scene) = scenes().swap_remove(0);
    let part = explained(&volume, &scene, &Request { pixel: Some((22, 19)), slices: Some(20..33) });
    let whole = explained(&volume, &scene, &Request { pixel: Some((22, 19)), slices: None });
    assert_eq!(part.record.stack.slices.len(), 13);
    let (p, w) = (&part.record.pixels[0], &whole.record.pixels[0]);
    assert!(!p.slice.is_empty() && p.slice.iter().all(|k| (20..33).contains(k)));
    let first = w.slice.iter().position(|k| *k == p.slice[0]).unwrap();
    assert_eq!(p.sum, w.sum[first..first + p.slice.len()]);
    assert_eq!(p.gathered, w.gathered);
    let many = scene.clone().with_slices(Slicing::Count(5000)).unwrap();
    let narrowed = explained(&volume, &many, &Request { pixel: Some((22, 19)), slices: None });
    assert_eq!(narrowed.record.stack.slices.len() as u64, MAX_SLICES);
    assert!(narrowed.record.notes[0].contains("5000 slices"), "{:?}", narrowed.record.notes);
    for (scene, range, word) in [(&scene, 50..61, "60 slices"), (&scene, 5..5, "range is empty"), (&many, 0..1025, "at most 1024")] {
        let asked = Request { pixel: None, slices: Some(range) };
        let error = explain(&volume, scene, &Settings::default(), &asked).unwrap_err().to_string();
        assert!(error.contains(word) && !error.contains('\n'), "{error}");
    }
}

#[test]
fn a_pixel_that_no_slice_covers_has_a_record_that_says_so() {
    let volume = Phantom::SheppLogan.volume(24).unwrap();
    // Everything to the left of the middle is cut away.
    let view = scene(PARALLEL).camera().resolve(volume.grid(), 45, 38).unwrap();
    let middle = volume.grid().center();
    let right = ClipPlane::new(view.right, view.right.dot(middle)).unwrap();
    let cut = scene(PARALLEL).with_clip_planes(vec![right]).unwrap();
    let e = explained(&volume, &cut, &Request { pixel: Some((12, 19)), slices: None });
    let p = &e.record.pixels[0];
    assert_eq!((p.x, p.y, p.span), (12, 19, None));
    assert!(p.through.is_some() && p.slice.is_empty());
    assert_eq!(p.picture, e.picture.pixel(12, 19));
    assert!(e.page().unwrap().contains("No slice covers pixel"));
    // Beside the box, and beside the picture.
    for (pixel, word) in [((0, 0), "passes the box by"), ((45, 3), "45 x 38")] {
        let request = Request { pixel: Some(pixel), slices: None };
        let error = explain(&volume, &cut, &Settings::default(), &request).unwrap_err().to_string();
        assert!(error.contains(word) && error.starts_with(&format!("pixel {},{}", pixel.0, pixel.1)), "{error}");
    }
}

#[test]
fn nothing_to_explain_is_told() {
    let volume = Phantom::SheppLogan.volume(8).unwrap();
    let look = |eye: f64, to: f64| {
        let placement = Placement::LookAt { eye: DVec3::new(eye, 0.0, 0.0), target: DVec3::new(to, 0.0, 0.0), up: DVec3::Z };
        scene(WIDE).with_camera(Camera::new(placement, WIDE).unwrap())
    };
    for (scene, word) in [(look(100.0, 200.0), "behind the eye"), (look(30.0, 0.0), "")] {
        let answer = explain(&volume, &scene, &Settings::default(), &Request::default());
        match word {
            "" => assert!(answer.is_ok()),
            _ => assert!(answer.unwrap_err().to_string().contains(word)),
        }
    }
    let away = ClipPlane::new(DVec3::X, 1e6).unwrap();
    let nothing = scene(WIDE).with_clip_planes(vec![away]).unwrap();
    let error = explain(&volume, &nothing, &Settings::default(), &Request::default()).unwrap_err().to_string();
    assert!(error.contains("no slice covers"), "{error}");
}

#[test]
fn the_page_is_complete_in_itself_and_names_are_only_text() {
    let volume = Phantom::SheppLogan.volume(12).unwrap().with_name("a/<script>alert(1)</script><!--");
    let e = explained(&volume, &scene(PARALLEL), &Request::default());
    let page = e.page().unwrap();
    assert!(page.starts_with("<!doctype html>\n") && page.ends_with("</html>\n"));
    assert!(!page.contains("alert(1)</script>") && !page.contains("<!--"));
    // The one address is SVG's name, which nothing fetches.
    assert_eq!(page.matches("http").count(), page.matches("http://www.w3.org/2000/svg").count() + page.matches("http-equiv").count());
    let opened = page.split_once("id=\"record\">").unwrap().1;
    let record: serde_json::Value = serde_json::from_str(opened.split_once("</script>").unwrap().0).unwrap();
    let json: serde_json::Value = serde_json::from_str(&e.json().unwrap()).unwrap();
    assert_eq!(record, json);
    assert_eq!(json["scene"]["volume"], "a/<script>alert(1)</script><!--");
}

#[test]
fn json_gives_the_same_f32_back() {
    let (_, volume, scene) = scenes().swap_remove(1);
    let e = explained(&volume, &scene, &Request::default());
    let json: serde_json::Value = serde_json::from_str(&e.json().unwrap()).unwrap();
    let p = &e.record.pixels[0];
    let read: Vec<f32> = json["pixels"][0]["transmittance"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap() as f32).collect();
    assert_eq!(read, p.transmittance);
}

#[test]
fn pictures_build_up_to_the_picture() {
    for (name, volume, scene) in scenes() {
        let mut frames = Vec::new();
        let bytes = build_up(&volume, &scene, &Settings::default(), 5, |_, frame| {
            frames.push(frame.clone());
            Ok(())
        });
        let bytes = bytes.unwrap();
        assert_eq!(frames.len(), 5, "{name}");
        if !matches!(scene.slicing(), Slicing::Tolerance(_)) && !scene.method().extrapolate {
            let whole = Renderer::new(&volume, Settings::default()).render(&scene).unwrap().0;
            assert_eq!(frames[4].sha256(), whole.sha256(), "{name}");
        }
        assert!(frames.windows(2).filter(|w| w[0] != w[1]).count() >= 2, "{name}");
        assert_eq!(png::frames(&bytes), Some(5), "{name}");
        // What shows where animations are not known is the first frame.
        assert_eq!(Picture::decode(&bytes, name).unwrap().to_rgba8(), frames[0].to_rgba8(), "{name}");
    }
}

/// A volume of numbers of `kind`, large enough that packed voxels have gaps behind rows and layers.
pub(super) fn typed(kind: VoxelType) -> Volume {
    let dims = [64, 64, 18];
    let mut voxels = Voxels::zeros(kind, dims.iter().product());
    crate::volume::with_voxels!(&mut voxels, v => for (i, x) in v.iter_mut().enumerate() {
        let [x0, y0, z0] = [i % 64, i / 64 % 64, i / 4096].map(|n| n as f64);
        *x = Voxel::from_f64((40.0 + 1.1 * x0 + 0.31 * y0 * 1.0 + 2.0 * z0 + (i * 7 % 5) as f64).min(120.0));
    });
    let steps = glam::DMat3::from_cols(DVec3::new(1.0, 0.05, 0.0), DVec3::new(0.0, -0.9, 0.1), DVec3::new(0.1, 0.0, 2.5));
    let volume = Volume::new(Grid::new(dims, DVec3::new(3.0, 1.0, -2.0), steps).unwrap(), voxels).unwrap();
    volume.with_rescale(0.01, -0.2).unwrap()
}

/// Every recorded fragment of a scene held against where its ray is on its slice, and against the voxels of the volume there.
fn check_lookups(name: &str, volume: &Volume, scene: &Scene) {
    let e = explained(volume, scene, &Request::default());
    let (width, height) = scene.size();
    let (grid, view) = (volume.grid(), scene.camera().resolve(volume.grid(), width, height).unwrap());
    let mut fragments = 0;
    for p in &e.record.pixels {
        let stage = |name: &str| p.stages.iter().find(|s| s.name == name).unwrap();
        let Some(Column::Voxel(cells)) = stage("texcoord").columns.get("cell") else { panic!("{name}: no cells") };
        let Some(Column::Triple(weights)) = stage("texcoord").columns.get("weight") else { panic!("{name}: no weights") };
        let Some(Column::Number(values)) = stage("fetch").columns.get("value") else { panic!("{name}: no values") };
        for i in 0..p.slice.len() {
            let (Some(cell), Some(weight), Some(value)) = (cells[i], weights[i], values[i]) else { continue };
            if !p.covered[i] {
                continue;
            }
            fragments += 1;
            let at = format!("{name}: pixel {},{} on slice {}", p.x, p.y, p.slice[i]);
            // Where the ray is, by the camera and the grid alone.
            let (origin, direction) = view.ray(f64::from(p.x) + 0.5, f64::from(p.y) + 0.5);
            let index = grid.world_to_index().transform_point3(origin + direction * f64::from(p.depth[i]));
            for axis in 0..3 {
                let want = index[axis].clamp(0.0, (grid.dims()[axis] - 1) as f64);
                let got = cell[axis] as f64 + f64::from(weight[axis]);
                assert!((got - want).abs() < 1e-3, "{at}, axis {axis}: cell {cell:?} and weight {weight:?}, not {index}");
            }
            // The voxels there, by the volume's own access, interpolated by hand.
            let mut sum = 0.0;
            for c in 0..8 {
                let voxel: [usize; 3] = std::array::from_fn(|a| (cell[a] as usize + (c >> a & 1)).min(grid.dims()[a] - 1));
                let share: f64 = (0..3).map(|a| f64::from(if c >> a & 1 == 1 { weight[a] } else { 1.0 - weight[a] })).product();
                sum += share * volume.value(voxel);
                let shown = f64::from(p.corners[i][c]) * e.record.scale + e.record.offset;
                assert!((shown - volume.value(voxel)).abs() < 1e-5, "{at}: corner {c} shows {shown}, not {}", volume.value(voxel));
            }
            let told = e.record.scale * f64::from(value) + e.record.offset;
            assert!((told - sum).abs() < 1e-5 * (1.0 + sum.abs()), "{at}: value {told}, not {sum}");
            // And in the numbers of the stage, to the bit.
            assert_eq!(p.rounds[i].map(|r| r[6].to_bits()), Some(value.to_bits()), "{at}");
        }
    }
    assert!(fragments > 200, "{name}: {fragments} fragments");
}

#[test]
fn recorded_cells_voxels_and_values_belong_together_for_every_type() {
    for kind in VoxelType::ALL {
        let volume = typed(kind);
        for (view, projection) in [("parallel", PARALLEL), ("perspective", WIDE)] {
            check_lookups(&format!("{kind}, {view}"), &volume, &scene(projection));
        }
    }
    // One voxel along an axis; the box of nodes; slabs between slices.
    let flat = Volume::new(
        Grid::with_spacing([64, 1, 40], [1.0; 3]).unwrap(),
        Voxels::from((0..2560u16).map(|i| (i % 97) as u8).collect::<Vec<u8>>()),
    );
    let flat = flat.unwrap().with_rescale(0.01, 0.0).unwrap();
    check_lookups("flat", &flat, &scene(PARALLEL));
    let nodes = typed(VoxelType::U8).with_convention(crate::volume::BoxConvention::Nodes);
    check_lookups("nodes", &nodes, &scene(WIDE));
}

#[test]
#[cfg(feature = "formats")]
fn recorded_cells_are_right_in_mapped_files() {
    let volume = typed(VoxelType::I16);
    let Voxels::I16(values) = volume.voxels() else { panic!("16-bit voxels") };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.raw");
    std::fs::write(&path, bytemuck::cast_slice::<i16, u8>(values)).unwrap();
    let mut spec = crate::volume::io::RawSpec::new([64, 64, 18], VoxelType::I16);
    if cfg!(target_endian = "big") {
        spec.endian = crate::volume::io::Endian::Big;
    }
    let limits = crate::Limits { map_bytes: 0, ..Default::default() };
    let mapped = crate::volume::io::read_raw(&path, &spec, &limits).unwrap().with_rescale(0.01, -0.2).unwrap();
    assert!(mapped.voxels().is_mapped());
    check_lookups("mapped", &mapped, &scene(PARALLEL));
}
