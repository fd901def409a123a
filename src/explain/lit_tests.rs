//! Gradients and light on record, held against the volume and the camera alone.

use super::*;
use crate::scene::{Gradient, Light, LightSource, Lighting, LitPoint, Region, Shading, Shape, Transfer2d, TransferFunction};
use crate::volume::{BoxConvention, Grid, VoxelType, Voxels};
use glam::DVec3;
use tests::{PARALLEL, WIDE, resolved, scene, typed};

/// A material with a floor, lit from the eye, a direction and a point.
fn lamps() -> Lighting {
    let light = |source, color| Light::new(source, color).unwrap();
    let lights = vec![
        light(LightSource::Head, [0.5, 0.5, 0.4]),
        light(LightSource::Direction(DVec3::new(1.0, 2.0, 3.0)), [0.3, 0.4, 0.5]),
        light(LightSource::Position(DVec3::new(40.0, -90.0, 70.0)), [0.4, 0.2, 0.3]),
    ];
    let mut material = Lighting::default();
    (material.gradient_floor, material.specular) = (0.004, 0.3);
    material.with_lights(lights).unwrap()
}

fn lit(scene: Scene) -> Scene {
    scene.with_lighting(Some(lamps())).unwrap()
}

fn by_size() -> TransferFunction {
    scene(PARALLEL).transfer().clone().with_gradient_opacity(vec![(0.0, 0.1), (0.01, 0.6), (0.03, 1.0)]).unwrap()
}

fn plane() -> Transfer2d {
    let region = |shape, color| Region { shape, color, opacity: 0.2 };
    Transfer2d::regions(vec![
        region(Shape::Triangle { value: 0.4, width: 0.5, gradient: 0.05 }, [1.0, 0.3, 0.1]),
        region(Shape::Gaussian { value: 0.7, width: 0.2, gradient: 0.01, height: 0.01 }, [0.2, 0.5, 1.0]),
    ])
    .unwrap()
}

/// How many gradients, colours by gradients and lit colours were compared.
#[derive(Debug, Default)]
struct Compared {
    gradients: usize,
    by_gradient: usize,
    lit: usize,
    brightest: f64,
}

/// Every recorded fragment of a scene held against the public gradient of the volume and the light of surfaces, at the camera's ray.
fn check(name: &str, volume: &Volume, scene: &Scene) -> Compared {
    let e = explain(volume, scene, &Settings::default(), &Request::default()).unwrap();
    let (width, height) = scene.size();
    let (grid, view) = (volume.grid(), scene.camera().resolve(volume.grid(), width, height).unwrap());
    let mut compared = Compared::default();
    let near_face = |u: f64| (u - u.round()).abs() < 2e-3;
    for p in &e.record.pixels {
        assert_eq!(resolved(&e, volume, scene, p).map(f32::to_bits), p.picture.map(f32::to_bits), "{name}: pixel {},{}", p.x, p.y);
        if let (Some(sum), Some(t)) = (p.sum.last(), p.transmittance.last()) {
            assert_eq!([sum[0], sum[1], sum[2], *t].map(f32::to_bits), p.gathered.map(f32::to_bits), "{name}: pixel {},{}", p.x, p.y);
        }
        let column = |quantity: &str| p.stages.iter().find(|s| s.name == "gradient").and_then(|s| s.columns.get(quantity));
        for i in 0..p.slice.len() {
            let at = format!("{name}: pixel {},{} on slice {}", p.x, p.y, p.slice[i]);
            let (origin, direction) = view.ray(f64::from(p.x) + 0.5, f64::from(p.y) + 0.5);
            let position = origin + direction * f64::from(p.depth[i]);
            let index = grid.world_to_index().transform_point3(position);
            if let Some(g) = p.gradient.get(i).and_then(Option::as_ref) {
                let (Some(record::Column::Triple(n)), Some(record::Column::Number(size))) = (column("normal"), column("steepness")) else {
                    panic!("{at}: no gradient on record")
                };
                let (n, size) = (DVec3::from_array(n[i].unwrap().map(f64::from)), f64::from(size[i].unwrap()));
                let worked_out = DVec3::from_array(g.g.map(f64::from));
                let rounding = f64::from(g.rounding);
                assert!(f64::from(g.aside) < gradient::ASIDE, "{at}: {} voxels aside", g.aside);
                // What the pipeline left is what is worked out beside it, and rounding is a small part of steep gradients.
                assert!(
                    (n * -size - worked_out).abs().max_element() <= rounding,
                    "{at}: {} is not {worked_out}, within {rounding}",
                    n * -size
                );
                assert!(rounding < 1e-3 * worked_out.length().max(0.05), "{at}: rounding {rounding} of {}", worked_out.length());
                // And what another way to it gives, away from faces of cells, where the analytic gradient jumps.
                if scene.gradient() != Gradient::Analytic || !index.to_array().into_iter().any(near_face) {
                    let other = scene.gradient().at(volume, index);
                    assert!((other - worked_out).abs().max_element() <= 2.0 * rounding, "{at}: {other} is not {worked_out}");
                }
                compared.gradients += 1;
            }
            if let Some(b) = p.by_gradient.get(i).and_then(Option::as_ref) {
                let off = (0..4).map(|c| (b.left[c] - b.want[c]).abs()).fold(0.0, f32::max);
                assert!(off <= b.rounding && b.rounding < 0.02, "{at}: {:?} is not {:?}, within {}", b.left, b.want, b.rounding);
                compared.by_gradient += usize::from(b.want[3] > 0.01);
            }
            if let Some(l) = p.light.get(i).and_then(Option::as_ref) {
                let off = (0..3).map(|c| (l.left[c] - l.lit[c]).abs()).fold(0.0, f32::max);
                assert!(off <= l.rounding, "{at}: {:?} is not {:?}, within {}", l.left, l.lit, l.rounding);
                // The light of surfaces, for the same gradient.
                let alpha = f64::from(l.before[3]);
                let gradient = p.gradient.get(i).and_then(Option::as_ref).map_or(DVec3::ZERO, |g| g.exact.gradient);
                let to_eye = if view.perspective { (view.eye - position).normalize() } else { -view.forward };
                let (near, far) = Stack::depth_range(grid, &view).unwrap();
                let point = LitPoint { position, gradient, to_eye, deep: (f64::from(p.depth[i]) - near) / (far - near) };
                let color = [0, 1, 2].map(|c: usize| f64::from(l.before[c]) / alpha);
                let want = scene.lighting().unwrap().shade(color, &point).map(|c| c * alpha);
                for c in 0..3 {
                    let slack = 2.0 * f64::from(l.rounding) + 1e-6;
                    assert!((want[c] - f64::from(l.lit[c])).abs() < slack, "{at}: {:?} is not {want:?}", l.lit);
                    compared.brightest = compared.brightest.max((want[c] - f64::from(l.before[c])).abs() / alpha);
                }
                compared.lit += 1;
            }
        }
    }
    compared
}

fn expect(name: &str, volume: &Volume, scene: &Scene) {
    let compared = check(name, volume, scene);
    assert!(compared.gradients > 200 && compared.lit > 200 && compared.brightest > 0.05, "{name}: {compared:?}");
}

#[test]
fn recorded_gradients_and_lit_colours_are_those_of_the_volume_for_every_type() {
    for kind in VoxelType::ALL {
        let volume = typed(kind);
        expect(&format!("{kind}, parallel"), &volume, &lit(scene(PARALLEL)));
        expect(&format!("{kind}, perspective"), &volume, &lit(scene(WIDE)));
    }
}

#[test]
fn recorded_gradients_are_right_of_every_kind_and_box() {
    for kind in [Gradient::Central, Gradient::Analytic, Gradient::Sobel] {
        expect(&format!("{kind:?}"), &typed(VoxelType::U8), &lit(scene(WIDE)).with_gradient(kind));
        expect(&format!("{kind:?}, floats"), &typed(VoxelType::F32), &lit(scene(PARALLEL)).with_gradient(kind));
    }
    let nodes = typed(VoxelType::U8).with_convention(BoxConvention::Nodes);
    expect("nodes", &nodes, &lit(scene(WIDE)));
    let values = (0..2560u32).map(|i| (20 + i % 64 + (i / 64) % 40) as u8).collect::<Vec<u8>>();
    let flat = Volume::new(Grid::with_spacing([64, 1, 40], [1.0; 3]).unwrap(), Voxels::from(values)).unwrap();
    expect("flat", &flat.with_rescale(0.01, 0.0).unwrap(), &lit(scene(PARALLEL)));
}

#[test]
fn recorded_colours_by_gradient_and_depth_are_worked_out_alike() {
    let volume = typed(VoxelType::U16);
    for projection in [PARALLEL, WIDE] {
        let sized = scene(projection).with_transfer(by_size());
        let two = scene(projection).with_transfer2d(Some(plane())).unwrap();
        for (name, scene) in [("factor", sized), ("regions", two)] {
            let compared = check(name, &volume, &scene);
            assert!(compared.gradients > 200 && compared.by_gradient > 50 && compared.lit == 0, "{name}: {compared:?}");
            let compared = check(name, &volume, &lit(scene));
            assert!(compared.by_gradient > 50 && compared.lit > 50, "{name}: {compared:?}");
        }
        let mut cued = Lighting::default();
        cued.shading = Shading::Depth;
        let compared = check("depth", &volume, &scene(projection).with_lighting(Some(cued)).unwrap());
        assert!(compared.gradients == 0 && compared.lit > 200 && compared.brightest > 0.05, "{compared:?}");
    }
}

#[test]
#[cfg(feature = "formats")]
fn recorded_gradients_are_right_in_mapped_files() {
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
    expect("mapped", &mapped, &lit(scene(PARALLEL)));
}

#[test]
fn only_scenes_with_gradients_or_light_have_them_on_record() {
    let volume = typed(VoxelType::U8);
    let json = |scene: &Scene| {
        let e = explain(&volume, scene, &Settings::default(), &Request::default()).unwrap();
        (serde_json::from_str::<serde_json::Value>(&e.json().unwrap()).unwrap(), e.page().unwrap())
    };
    let (plain, page) = json(&scene(PARALLEL));
    for key in ["gradient", "by_gradient", "light"] {
        assert!(plain.get(key).is_none() && plain["pixels"][0].get(key).is_none(), "{key}");
    }
    assert!(!page.contains("gradientPanel") && !page.contains("lightPanel"));
    let (lit, page) = json(&lit(scene(PARALLEL)));
    assert_eq!(lit["gradient"]["kind"], "central");
    assert!(lit["gradient"]["taken"].as_u64().unwrap() > 0 && lit["gradient"]["taken"].as_u64() <= lit["gradient"]["lanes"].as_u64());
    assert_eq!(lit["light"]["lights"].as_array().unwrap().len(), 3);
    assert!(page.contains("gradientPanel") && page.contains("lightPanel"));
}
