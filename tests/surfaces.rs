//! Level surfaces against the exact crossings of the interpolated values, and the planes beside a picture.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::DVec3;
use slicestack::picture::{Aov, Plane};
use slicestack::reference::SurfaceTracer;
use slicestack::scene::{
    Blend, Camera, ClipPlane, Gradient, Hit, LevelSurface, Light, LightSource, Lighting, Method, Order, Placement, Projection, Shading,
    Slicing, TransferFunction,
};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{Grid, Voxels};
use slicestack::{Level, Picture, Renderer, Scene, Settings, Volume};

const PARALLEL: Projection = Projection::Orthographic { height: None };
const WIDE: Projection = Projection::Perspective { fov_y: 40.0 };

fn surface(level: f64, color: [f64; 3], opacity: f64) -> LevelSurface {
    LevelSurface::new(level, Some(color), opacity).unwrap()
}

fn gray() -> TransferFunction {
    TransferFunction::new(vec![(0.0, [0.2, 0.3, 0.4]), (1.0, [1.0, 0.9, 0.8])], vec![(0.0, 1.0)]).unwrap()
}

fn scene(azimuth: f64, elevation: f64, projection: Projection) -> Scene {
    let camera = Camera::new(Placement::Orbit { azimuth, elevation, roll: 0.0, zoom: 1.2 }, projection).unwrap();
    Scene::new(gray()).with_camera(camera).with_size(46, 39).unwrap().with_slices(Slicing::Count(160)).unwrap()
}

/// A volume of cubes of 1, whose values are those of `of` at voxel centres.
fn made(n: usize, of: impl Fn(DVec3) -> f64) -> Volume {
    let voxels = (0..n * n * n).map(|i| of(DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64)) as f32).collect();
    Volume::new(Grid::with_spacing([n; 3], [1.0; 3]).unwrap(), Voxels::F32(voxels)).unwrap()
}

/// How far inside a sphere around the middle a place is.
fn sphere(n: usize, radius: f64) -> Volume {
    let middle = DVec3::splat(0.5 * (n - 1) as f64);
    made(n, |p| radius - p.distance(middle))
}

fn planes(volume: &Volume, scene: &Scene, wanted: &[Aov]) -> (Picture, u64, Vec<Plane>) {
    let (picture, stats, planes) = Renderer::new(volume, Settings::default()).render_with(scene, wanted).unwrap();
    (picture, stats.slices, planes)
}

/// Thickness of a slab, world units.
fn slab(volume: &Volume, scene: &Scene, slices: u64) -> f64 {
    let (width, height) = scene.size();
    let view = scene.camera().resolve(volume.grid(), width, height).unwrap();
    slicestack::proxy::Stack::new(volume.grid(), &view, scene.clip_planes(), slices).spacing
}

/// Scenes with every kind of light and normal, over volumes with surfaces of all shapes.
fn lit_scenes() -> Vec<(&'static str, Volume, Scene)> {
    let levels = vec![surface(0.62, [0.9, 0.4, 0.3], 1.0), surface(0.35, [0.3, 0.8, 0.4], 0.3), surface(0.5, [0.4, 0.5, 0.95], 0.5)];
    let of = |azimuth, elevation, projection| scene(azimuth, elevation, projection).with_levels(levels.clone()).unwrap();
    let light = |source, color| Light::new(source, color).unwrap();
    let lamps = vec![
        light(LightSource::Direction(DVec3::new(1.0, -2.0, 1.5)), [1.0, 0.9, 0.7]),
        light(LightSource::Position(DVec3::new(-60.0, 10.0, 40.0)), [0.4, 0.5, 1.0]),
    ];
    let mut glossy = Lighting::default().with_lights(lamps).unwrap();
    (glossy.specular, glossy.shininess, glossy.ambient, glossy.emission) = (0.6, 12.5, 0.1, 0.05);
    let mut one_sided = Lighting::default();
    (one_sided.two_sided, one_sided.gradient_floor) = (false, 0.03);
    let mut cue = Lighting::default();
    cue.shading = Shading::Depth;
    let signal = || Phantom::MarschnerLobb.volume(34).unwrap();
    let cloud = || Phantom::Cloud.volume(30).unwrap();
    let lit = |scene: Scene, light: &Lighting, gradient| scene.with_lighting(Some(light.clone())).unwrap().with_gradient(gradient);
    vec![
        ("as it is", signal(), of(30.0, 40.0, WIDE)),
        ("flat", signal(), of(30.0, 40.0, PARALLEL).with_flat_surfaces(true)),
        ("glossy", signal(), lit(of(-50.0, 35.0, WIDE), &glossy, Gradient::Central)),
        ("analytic", cloud(), lit(of(20.0, 10.0, PARALLEL), &glossy, Gradient::Analytic)),
        ("sobel", cloud(), lit(of(120.0, -30.0, WIDE), &glossy, Gradient::Sobel)),
        ("one-sided", signal(), lit(of(70.0, 20.0, PARALLEL), &one_sided, Gradient::Sobel)),
        ("depth", cloud(), lit(of(200.0, 25.0, WIDE), &cue, Gradient::Central)),
    ]
}

#[test]
fn refined_hits_are_the_exact_crossings() {
    for (name, volume, scene) in lit_scenes() {
        // Close together: so that few levels are crossed twice within a slab.
        let scene = scene.with_slices(Slicing::Count(1500)).unwrap();
        let tracer = SurfaceTracer::new(&scene, &volume).unwrap();
        let (picture, slices, planes) = planes(&volume, &scene, &[Aov::Depth, Aov::Value, Aov::Normal, Aov::Alpha]);
        let thick = slab(&volume, &scene, slices);
        let least = volume.grid().smallest_spacing();
        let late = planes_of(&volume, &scene.clone().with_hit(Hit::FirstSample), Aov::Depth);
        let (mut met, mut other, mut early, mut worst) = (0, 0, 0, 0.0f64);
        for (x, y) in pixels(&scene) {
            let exact = tracer.crossings(x, y);
            let depth = f64::from(planes[0].pixel(x, y)[0]);
            let want = tracer.pixel(x, y);
            let alpha = f64::from(planes[3].pixel(x, y)[0]);
            let Some(first) = exact.first() else {
                assert!(depth == f64::INFINITY && alpha == 0.0 && planes[1].pixel(x, y)[0].is_nan(), "{name}: pixel {x},{y}: {depth}");
                continue;
            };
            met += 1;
            // A level that is crossed twice within a slab is not seen.
            let got = picture.pixel(x, y);
            let off = (0..3).map(|c| (f64::from(got[c]) - want.rgb[c]).abs()).fold((alpha - want.alpha).abs(), f64::max);
            if (depth - first.depth).abs() > 1e-3 * least || off > 2e-3 {
                other += 1;
                continue;
            }
            worst = worst.max(off);
            assert_eq!(planes[1].pixel(x, y)[0], first.level as f32, "{name}: pixel {x},{y}");
            let normal = planes[2].pixel(x, y).iter().map(|&c| f64::from(c)).collect::<Vec<_>>();
            assert!(first.normal.distance(DVec3::from_slice(&normal)) < 2e-3, "{name}: pixel {x},{y}: {normal:?} not {}", first.normal);
            let behind = f64::from(late.pixel(x, y)[0]) - first.depth;
            assert!((-1e-4 * least..thick * (1.0 + 1e-6) + 1e-4 * least).contains(&behind), "{name}: pixel {x},{y}: {behind} behind");
            early += usize::from(behind < 0.01 * thick);
        }
        println!("{name}: {other} of {met} pixels are others, {early} early, off by {worst:.1e}");
        assert!(met > 200 && 50 * other < met, "{name}: {other} of {met} pixels are others");
        // Hits at samples are anywhere within the slab.
        assert!(10 * early < met, "{name}: {early} of {met}");
        assert!(worst < 2e-3, "{name}: {worst}");
    }
}

fn planes_of(volume: &Volume, scene: &Scene, aov: Aov) -> Plane {
    planes(volume, scene, &[aov]).2.remove(0)
}

fn pixels(scene: &Scene) -> impl Iterator<Item = (u32, u32)> + use<> {
    let (width, height) = scene.size();
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

#[test]
fn a_sphere_is_where_and_what_it_should_be() {
    let (n, radius) = (41, 14.0);
    let volume = sphere(n, radius);
    let middle = DVec3::splat(20.0);
    for projection in [PARALLEL, WIDE] {
        let scene = scene(33.0, 21.0, projection).with_levels(vec![surface(0.0, [1.0; 3], 1.0)]).unwrap();
        let (_, _, planes) = planes(&volume, &scene, &[Aov::Depth, Aov::Normal]);
        let view = scene.camera().resolve(volume.grid(), 46, 39).unwrap();
        let mut met = 0;
        for (x, y) in pixels(&scene) {
            let (origin, direction) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let d = direction.normalize();
            let along = (middle - origin).dot(d);
            let miss = (middle - origin - d * along).length();
            let depth = f64::from(planes[0].pixel(x, y)[0]);
            if miss > radius + 0.1 {
                assert_eq!(depth, f64::INFINITY, "pixel {x},{y}");
            } else if miss < 0.9 * radius {
                met += 1;
                let want = (along - (radius * radius - miss * miss).sqrt()) / direction.length();
                // Values interpolated between voxels lie up to 1/(8 r) of a voxel and a bit beside the sphere's.
                assert!((depth - want).abs() < 0.04, "pixel {x},{y}: {depth} not {want}");
                let place = origin + direction * depth;
                let normal = planes[1].pixel(x, y);
                let normal = DVec3::new(f64::from(normal[0]), f64::from(normal[1]), f64::from(normal[2]));
                let angle = normal.angle_between(place - middle).to_degrees();
                assert!(angle < 0.5, "pixel {x},{y}: {angle} degrees");
            }
        }
        assert!(met > 150, "{met}");
    }
}

#[test]
fn nested_translucent_spheres_come_to_the_closed_form() {
    let volume = sphere(41, 15.0);
    let (outer, inner) = ([0.9, 0.3, 0.2], [0.2, 0.5, 1.0]);
    let (a, b) = (0.3, 0.55);
    // In any order of levels.
    for turned in [false, true] {
        let mut levels = vec![surface(0.0, outer, a), surface(6.0, inner, b)];
        if turned {
            levels.reverse();
        }
        let scene = scene(12.0, 8.0, PARALLEL).with_levels(levels).unwrap().with_flat_surfaces(true);
        let (picture, _, _) = planes(&volume, &scene, &[]);
        let [r, g, bl, alpha] = picture.pixel(23, 19);
        // In, in, out, out.
        let want = |c: usize| {
            let left = [1.0, 1.0 - a, (1.0 - a) * (1.0 - b), (1.0 - a) * (1.0 - b) * (1.0 - b)];
            a * outer[c] * (left[0] + left[3]) + b * inner[c] * (left[1] + left[2])
        };
        for (got, want) in [(r, want(0)), (g, want(1)), (bl, want(2)), (alpha, 1.0 - ((1.0 - a) * (1.0 - b)).powi(2))] {
            assert!((f64::from(got) - want).abs() < 1e-6, "{got} not {want}");
        }
    }
}

#[test]
fn faces_are_no_surfaces_and_nan_parts_values() {
    let ramp = made(16, |p| p.x);
    // From where values are high: the ray enters above the level.
    let from = |azimuth: f64| {
        let eye = DVec3::new(7.5 - 60.0 * azimuth.cos(), 7.5, 7.5);
        let camera = Camera::new(Placement::LookAt { eye, target: DVec3::splat(7.5), up: DVec3::Z }, PARALLEL).unwrap();
        scene(0.0, 0.0, PARALLEL).with_camera(camera).with_flat_surfaces(true)
    };
    let level = vec![surface(5.25, [0.5; 3], 0.4)];
    for (azimuth, depth) in [(0.0, 60.0 - 7.5 + 5.25), (std::f64::consts::PI, 60.0 + 7.5 - 5.25)] {
        let scene = from(azimuth).with_levels(level.clone()).unwrap();
        let (_, _, seen) = planes(&ramp, &scene, &[Aov::Depth, Aov::Alpha]);
        assert!((f64::from(seen[0].pixel(23, 19)[0]) - depth).abs() < 1e-4, "{:?}", seen[0].pixel(23, 19));
        assert!((seen[1].pixel(23, 19)[0] - 0.4).abs() < 1e-6);
        // A clip plane that leaves values above the level is no surface either.
        let plane = ClipPlane::new(DVec3::X, 8.0).unwrap();
        let cut = scene.with_clip_planes(vec![plane]).unwrap();
        assert_eq!(planes_of(&ramp, &cut, Aov::Alpha).pixel(23, 19)[0], 0.0);
    }
    // The short form has a surface where its ray enters above the level.
    let short = from(std::f64::consts::PI).with_blend(Blend::Iso { level: 5.25 }).unwrap().with_hit(Hit::FirstSample);
    assert!((planes_of(&ramp, &short, Aov::Depth).pixel(23, 19)[0] - 52.0).abs() < 1e-4);
    // Few slices: the level is crossed before the first of them, and behind the last.
    for count in [1, 2] {
        let low = from(0.0).with_levels(vec![surface(1.0, [1.0; 3], 1.0)]).unwrap().with_slices(Slicing::Count(count)).unwrap();
        assert!((f64::from(planes_of(&ramp, &low, Aov::Depth).pixel(23, 19)[0]) - 53.5).abs() < 1e-3);
        let high = from(0.0).with_levels(vec![surface(14.5, [1.0; 3], 1.0)]).unwrap().with_slices(Slicing::Count(count)).unwrap();
        assert!((f64::from(planes_of(&ramp, &high, Aov::Depth).pixel(23, 19)[0]) - 67.0).abs() < 1e-3);
    }
    // A layer of NaN where the level would be crossed.
    let parted = made(16, |p| if p.x == 5.0 || p.x == 6.0 { f64::NAN } else { p.x });
    let scene = from(0.0).with_levels(level).unwrap();
    assert!(planes_of(&parted, &scene, Aov::Alpha).numbers().iter().all(|&a| a == 0.0));
    assert!(SurfaceTracer::new(&scene, &parted).unwrap().crossings(23, 19).is_empty());
}

#[test]
fn planes_have_the_same_bits_in_any_settings_and_leave_the_picture_alone() {
    let mut list = lit_scenes();
    list.truncate(4);
    let (_, head, _) = list.remove(0);
    let over = scene(10.0, 20.0, WIDE).with_transfer(TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.3, 0.0), (0.6, 0.4)]).unwrap());
    list.push(("over", head.clone(), over.clone()));
    list.push(("back to front", head.clone(), over.clone().with_order(Order::BackToFront)));
    list.push(("merged", head.clone(), over.clone().with_method(Method::default().with_merge(true)).unwrap()));
    list.push(("tolerance", head.clone(), over.with_slices(Slicing::Tolerance(0.01)).unwrap()));
    list.push(("short", head.clone(), scene(30.0, 40.0, WIDE).with_blend(Blend::Iso { level: 0.5 }).unwrap()));
    list.push(("short, lit", head, scene(30.0, 40.0, WIDE).with_blend(Blend::Iso { level: 0.5 }).unwrap().with_gradient(Gradient::Sobel)));
    for (name, volume, scene) in list {
        let bits = |threads: usize, tile: u32, level: Level| {
            let settings = Settings::new().threads(threads).tile(tile).level(level);
            let mut renderer = Renderer::new(&volume, settings);
            let alone = renderer.render(&scene).unwrap().0.sha256();
            let (picture, _, planes) = renderer.render_with(&scene, &Aov::ALL).unwrap();
            assert_eq!(picture.sha256(), alone, "{name}");
            planes.iter().flat_map(|p| p.numbers().iter().map(|x| x.to_bits())).collect::<Vec<_>>()
        };
        let want = bits(1, 64, Level::SCALAR);
        assert!(want.iter().any(|&x| f32::from_bits(x) > 0.5 && f32::from_bits(x) < 1e3), "{name}");
        for (n, level) in Level::available().into_iter().enumerate() {
            for (threads, tile) in [(2, 8), (3, 13 + n as u32)] {
                assert!(bits(threads, tile, level) == want, "{name} at {threads} threads, tiles of {tile}, {}", level.name());
            }
        }
    }
}

#[test]
fn blended_slabs_end_where_half_of_the_light_is_taken() {
    let volume = made(16, |_| 1.0);
    let eye = DVec3::new(-60.0, 7.5, 7.5);
    let camera = Camera::new(Placement::LookAt { eye, target: DVec3::splat(7.5), up: DVec3::Z }, PARALLEL).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.13)]).unwrap().with_unit(1.0).unwrap();
    let scene = scene(0.0, 0.0, PARALLEL).with_camera(camera).with_transfer(transfer).with_terminate(0.0).unwrap();
    for count in [3, 16, 200] {
        let scene = scene.clone().with_slices(Slicing::Count(count)).unwrap();
        let (_, _, seen) = planes(&volume, &scene, &[Aov::Depth, Aov::Alpha, Aov::Value]);
        // The box begins half a voxel before the first one.
        let want = 60.0 - 0.5 + 0.5f64.ln() / 0.87f64.ln();
        let depth = f64::from(seen[0].pixel(23, 19)[0]);
        assert!((depth - want).abs() < 1e-3, "{count} slices: {depth} not {want}");
        assert!((f64::from(seen[1].pixel(23, 19)[0]) - (1.0 - 0.87f64.powi(16))).abs() < 1e-5);
        assert_eq!(seen[2].pixel(23, 19)[0], 1.0);
    }
    // Too thin for a half.
    let thin = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.01)]).unwrap();
    assert!(planes_of(&volume, &scene.with_transfer(thin), Aov::Depth).numbers().iter().all(|&d| d == f32::INFINITY));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let said = |r: slicestack::Result<Scene>| r.unwrap_err().to_string();
    let one = || surface(0.5, [1.0; 3], 1.0);
    assert!(said(scene(0.0, 0.0, WIDE).with_levels(Vec::new())).contains("0 are given, there can be 1 to 16"));
    assert!(
        said(scene(0.0, 0.0, WIDE).with_levels((0..17).map(|n| surface(f64::from(n), [1.0; 3], 1.0)).collect())).contains("17 are given")
    );
    assert!(said(scene(0.0, 0.0, WIDE).with_levels(vec![one(), one()])).contains("0.5 is given twice"));
    assert!(said(scene(0.0, 0.0, WIDE).with_blend(Blend::Surfaces)).contains("none are given"));
    for (level, color, opacity, what) in
        [(f64::NAN, None, 1.0, "level NaN"), (0.0, Some([0.0, 1.5, 0.0]), 1.0, "color 1.5"), (0.0, None, -0.25, "opacity -0.25")]
    {
        assert!(LevelSurface::new(level, color, opacity).unwrap_err().to_string().contains(what));
    }
    let volume = sphere(9, 3.0);
    let mip = scene(0.0, 0.0, WIDE).with_blend(Blend::Mip).unwrap();
    let error = Renderer::new(&volume, Settings::default()).render_with(&mip, &[Aov::Depth]).unwrap_err().to_string();
    assert!(error.contains("aov depth: is for render.blend"), "{error}");
}

#[cfg(feature = "encoders")]
#[test]
fn planes_are_files_that_others_read() {
    use slicestack::picture::PlaneFormat;
    let volume = sphere(17, 6.0);
    let scene = scene(33.0, 21.0, WIDE).with_levels(vec![surface(0.0, [1.0; 3], 1.0)]).unwrap();
    let (_, _, planes) = planes(&volume, &scene, &Aov::ALL);
    for plane in &planes {
        let npy = plane.encode(PlaneFormat::Npy).unwrap();
        let header = String::from_utf8_lossy(&npy[10..npy.len() - 4 * plane.numbers().len()]).into_owned();
        let shape = if plane.aov() == Aov::Normal { "(39, 46, 3)" } else { "(39, 46)" };
        assert!(header.contains(shape) && header.ends_with('\n') && (10 + header.len()) % 64 == 0, "{header}");
        let numbers = npy[10 + header.len()..].chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap()));
        assert!(numbers.eq(plane.numbers().iter().map(|x| x.to_bits())));
        let exr = plane.encode(PlaneFormat::Exr).unwrap();
        assert!(Plane::is_exr(&exr) && !Plane::is_exr(&npy));
    }
    // Red, green and blue are what every decoder knows.
    let folder = std::env::temp_dir().join(format!("slicestack-planes-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("normal.exr");
    std::fs::write(&path, planes[1].encode(PlaneFormat::Exr).unwrap()).unwrap();
    let read = Picture::open(&path);
    std::fs::remove_dir_all(&folder).unwrap();
    let read = read.unwrap();
    assert_eq!((read.width(), read.height()), (46, 39));
    for (x, y) in pixels(&scene) {
        assert_eq!(read.pixel(x, y)[..3], planes[1].pixel(x, y)[..], "pixel {x},{y}");
    }
}
