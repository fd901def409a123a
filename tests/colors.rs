//! Volumes whose voxels are colours: what they look like, what that equals, and what such scenes do not have.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use glam::DVec3;
use slicestack::reference::{Integrator, Region, image};
use slicestack::scene::{
    Blend, Camera, Classification, ClipPlane, Ends, Filter, Fog, FogMode, LevelSurface, Lighting, Method, OpacityFrom, OpenGl, Order,
    Placement, Projection, Scene, Slicing, Straight, TransferFunction, Visible,
};
use slicestack::volume::{Grid, Volume, Voxels};
use slicestack::{Aov, Level, Picture, Renderer, Settings, render};

const DIMS: [usize; 3] = [13, 11, 12];
const COUNT: usize = DIMS[0] * DIMS[1] * DIMS[2];

fn grid() -> Grid {
    Grid::with_spacing(DIMS, [1.0, 1.25, 0.75]).unwrap()
}

/// splitmix64.
fn noise(seed: u64, i: usize) -> u64 {
    let mut z = (seed << 32).wrapping_add(i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A colour for each of 256 values; opacities up to `most`.
fn palette(most: u64) -> Vec<[u8; 4]> {
    let color = |v: usize| {
        let n = noise(7, v);
        [n as u8, (n >> 8) as u8, (n >> 16) as u8, if v % 5 == 0 { 0 } else { ((n >> 24) % (most + 1)) as u8 }]
    };
    (0..256).map(color).collect()
}

fn rgba(numbers: impl Into<Voxels>) -> Volume {
    Volume::with_colors(grid(), numbers.into()).unwrap()
}

/// A smooth body of colours that change from place to place, in air of alpha 0.
fn body() -> Vec<[f64; 4]> {
    (0..COUNT)
        .map(|i| {
            let at = [i % DIMS[0], i / DIMS[0] % DIMS[1], i / DIMS[0] / DIMS[1]];
            let [x, y, z] = [0, 1, 2].map(|a: usize| at[a] as f64 / (DIMS[a] - 1) as f64 - 0.5);
            let r = (x * x + y * y + z * z).sqrt();
            let alpha = (1.6 * (0.45 - r)).clamp(0.0, 0.6);
            [0.5 + x, 0.5 + y, 0.5 - z * 0.8, alpha]
        })
        .collect()
}

fn of_bytes(colors: &[[f64; 4]]) -> Volume {
    rgba(colors.iter().flatten().map(|c| (c * 255.0).round() as u8).collect::<Vec<_>>())
}

fn of_floats(colors: &[[f64; 4]]) -> Volume {
    rgba(colors.iter().flatten().map(|&c| c as f32).collect::<Vec<_>>())
}

fn plain() -> TransferFunction {
    TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.0), (1.0, 1.0)]).unwrap()
}

fn orbit(projection: Projection) -> Camera {
    Camera::new(Placement::Orbit { azimuth: 33.0, elevation: 21.0, roll: 4.0, zoom: 1.0 }, projection).unwrap()
}

const PARALLEL: Projection = Projection::Orthographic { height: None };
const PERSPECTIVE: Projection = Projection::Perspective { fov_y: 35.0 };

fn scene(count: u64) -> Scene {
    Scene::new(plain()).with_camera(orbit(PARALLEL)).with_size(44, 37).unwrap().with_slices(Slicing::Count(count)).unwrap()
}

fn settings(level: Level, threads: usize, tile: u32) -> Settings {
    Settings::new().level(level).threads(threads).tile(tile)
}

/// Largest difference of two pictures.
fn apart(a: &Picture, b: &Picture) -> f64 {
    a.pixels().iter().zip(b.pixels()).flat_map(|(a, b)| (0..4).map(|c| f64::from((a[c] - b[c]).abs()))).fold(0.0, f64::max)
}

/// Largest difference of a picture to the reference.
fn off(picture: &Picture, scene: &Scene, volume: &Volume) -> f64 {
    let truth = image(scene, volume, Region::whole(scene)).unwrap();
    assert!(truth.error_bound() < 1e-9, "{}", truth.error_bound());
    let pairs = picture.pixels().iter().zip(truth.pixels());
    pairs.flat_map(|(a, b)| (0..4).map(|c| (f64::from(a[c]) - b[c]).abs())).fold(0.0, f64::max)
}

#[track_caller]
fn refused<T>(result: slicestack::Result<T>, words: &[&str]) {
    let line = result.err().unwrap().to_string();
    assert!(!line.contains('\n') && words.iter().all(|w| line.contains(w)), "{line}");
}

#[test]
fn colours_are_what_scalars_through_a_table_are_to_the_bit() {
    let fog = Fog::new(FogMode::Exp { density: 0.02 }, [0.6, 0.7, 0.9]).unwrap();
    for most in [200, 255] {
        let palette = palette(most);
        let values: Vec<u8> = (0..COUNT).map(|i| if i < 256 { i as u8 } else { (noise(3, i / 3) >> 9) as u8 }).collect();
        let unit = |c: u8| f64::from(c) / 255.0;
        let color = (0..256).map(|v| (v as f64, [0, 1, 2].map(|c: usize| unit(palette[v][c])))).collect();
        let opacity = (0..256).map(|v| (v as f64, unit(palette[v][3]))).collect();
        let transfer = TransferFunction::new(color, opacity).unwrap();
        let scalars = Volume::new(grid(), values.clone().into()).unwrap();
        let colors = rgba(values.iter().flat_map(|&v| palette[usize::from(v)]).collect::<Vec<u8>>());
        let clip = ClipPlane::new(DVec3::new(1.0, 0.2, 0.1), -2.0).unwrap();
        let mut shown = 0;
        for (projection, unit) in [(PARALLEL, None), (PERSPECTIVE, None), (PARALLEL, Some(0.1)), (PERSPECTIVE, Some(20.0))] {
            let of = |transfer: &TransferFunction| match unit {
                Some(length) => transfer.clone().with_unit(length).unwrap(),
                None => transfer.clone(),
            };
            let base = scene(70).with_camera(orbit(projection));
            let scenes = [
                base.clone(),
                base.clone().with_order(Order::BackToFront),
                base.clone().with_blend(Blend::Add).unwrap(),
                base.clone().with_fog(Some(fog)).with_clip_planes(vec![clip]).unwrap(),
                base.clone().with_method(Method::default().with_ends(Ends::Whole)).unwrap(),
                base.clone().with_linear_light(true).unwrap().with_terminate(0.0).unwrap(),
                base.with_slices(Slicing::Count(2300)).unwrap().with_size(9, 8).unwrap(),
            ];
            for (n, scene) in scenes.iter().enumerate() {
                for filter in [Filter::Linear, Filter::Nearest] {
                    let method = scene.method().with_filter(filter);
                    let pre = scene.clone().with_method(method.with_classification(Classification::Pre)).unwrap();
                    let want = render(&scalars, &pre.with_transfer(of(&transfer))).unwrap();
                    let got = render(&colors, &scene.clone().with_method(method).unwrap().with_transfer(of(&plain()))).unwrap();
                    assert!(got == want, "{projection:?} {unit:?} scene {n} {filter:?}: {}", apart(&got, &want));
                    shown += got.pixels().iter().filter(|p| p[3] > 0.01).count();
                }
            }
        }
        assert!(shown > 10_000, "{shown}");
    }
}

/// The opacity of a colour.
type Opacity<'a> = &'a dyn Fn([f64; 4]) -> f64;

/// How voxels are combined by hand.
#[derive(Clone, Copy, PartialEq)]
enum By {
    /// Premultiplied colours of slabs are interpolated.
    Premultiplied,
    /// Colour and opacity are interpolated each on its own: wrong.
    Apart,
    Nearest,
}

/// A picture of whole slabs along parallel rays, computed slice by slice.
fn by_hand(volume: &Volume, scene: &Scene, count: u64, by: By, alpha: impl Fn([f64; 4]) -> f64) -> Vec<[f64; 4]> {
    let grid = volume.grid();
    let view = scene.camera().resolve(grid, scene.size().0, scene.size().1).unwrap();
    let depths = grid.corners().map(|c| view.depth(c));
    let (near, far) = (depths.iter().copied().fold(f64::MAX, f64::min), depths.iter().copied().fold(f64::MIN, f64::max));
    let spacing = (far - near) / count as f64;
    let colors = volume.colors().unwrap();
    let slab = |at: [usize; 3]| {
        let c = colors.get((at[2] * DIMS[1] + at[1]) * DIMS[0] + at[0]);
        let a = 1.0 - (1.0 - alpha(c)).powf(spacing / grid.smallest_spacing());
        let factor = if by == By::Apart { 1.0 } else { a };
        [c[0] * factor, c[1] * factor, c[2] * factor, a]
    };
    let (low, high) = grid.index_bounds();
    let mut pixels = Vec::new();
    for y in 0..scene.size().1 {
        for x in 0..scene.size().0 {
            let (origin, direction) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (mut rgb, mut through) = ([0.0; 3], 1.0);
            for k in 0..count {
                let at = grid.world_to_index().transform_point3(origin + direction * (near + (k as f64 + 0.5) * spacing));
                if (at.cmplt(low) | at.cmpgt(high)).any() {
                    continue;
                }
                let at = at.to_array();
                let u: [f64; 3] = std::array::from_fn(|i| at[i].clamp(0.0, (DIMS[i] - 1) as f64));
                let mut sum = [0.0; 4];
                for corner in 0..8 {
                    let mut place = [0; 3];
                    let mut weight = 1.0;
                    for i in 0..3 {
                        let cell = (u[i] as usize).min(DIMS[i] - 2);
                        let w = u[i] - cell as f64;
                        let w = if by == By::Nearest { f64::from(u8::from(w >= 0.5)) } else { w };
                        place[i] = cell + (corner >> i & 1);
                        weight *= if corner >> i & 1 == 1 { w } else { 1.0 - w };
                    }
                    let c = slab(place);
                    (0..4).for_each(|i| sum[i] += weight * c[i]);
                }
                let factor = if by == By::Apart { sum[3] } else { 1.0 };
                (0..3).for_each(|i| rgb[i] += through * factor * sum[i]);
                through *= 1.0 - sum[3];
            }
            pixels.push([rgb[0], rgb[1], rgb[2], 1.0 - through]);
        }
    }
    pixels
}

#[test]
fn every_type_and_number_is_what_it_is_by_hand() {
    let body = body();
    let words: Vec<u16> = body.iter().flatten().map(|c| (c * 65535.0).round() as u16).collect();
    let volumes = [of_bytes(&body), rgba(words), of_floats(&body)];
    let ramp = TransferFunction::new(vec![(0.0, [0.0; 3])], vec![(0.3, 0.0), (0.6, 0.3), (1.0, 0.1)]).unwrap();
    let through = |x: f64| ramp.eval(x).alpha;
    let method = Method::default().with_ends(Ends::Whole);
    for volume in &volumes {
        for nearest in [false, true] {
            let method = method.with_filter(if nearest { Filter::Nearest } else { Filter::Linear });
            let scene = scene(61).with_method(method).unwrap().with_terminate(0.0).unwrap().with_transfer(ramp.clone());
            let cases: [(OpacityFrom, Opacity<'_>); 3] = [
                (OpacityFrom::Alpha, &|c| c[3]),
                (OpacityFrom::Luma, &|c| through(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2])),
                (OpacityFrom::Maximum, &|c| through(c[0].max(c[1]).max(c[2]))),
            ];
            for (from, alpha) in cases {
                let scene = scene.clone().with_opacity_from(Some(from));
                let picture = render(volume, &scene).unwrap();
                let want = by_hand(volume, &scene, 61, if nearest { By::Nearest } else { By::Premultiplied }, alpha);
                let all = || picture.pixels().iter().zip(&want);
                let wrong = all().filter(|(a, b)| (0..4).any(|c| (f64::from(a[c]) - b[c]).abs() > 2e-5)).count();
                // A nearest voxel may be another one where a sample lies within rounding of the middle between two.
                assert!(wrong <= if nearest { 4 } else { 0 }, "{from:?} nearest {nearest}: {wrong} of {} pixels", want.len());
                assert!(want.iter().filter(|p| p[3] > 0.05).count() > 200);
                assert!(all().count() == 44 * 37);
            }
        }
    }
}

#[test]
fn pictures_are_the_same_at_every_level_in_any_tiles_and_threads() {
    let body = body();
    let mut holes = body.clone();
    holes.iter_mut().step_by(7).for_each(|c| c[1] = f64::NAN);
    holes.iter_mut().step_by(11).for_each(|c| c[0] = 1.7);
    let fog = Fog::new(FogMode::Exp2 { density: 0.03 }, [0.2, 0.3, 0.4]).unwrap();
    for (n, volume) in [of_bytes(&body), of_floats(&holes)].iter().enumerate() {
        for filter in [Filter::Linear, Filter::Nearest] {
            for projection in [PARALLEL, PERSPECTIVE] {
                let method = Method::default().with_filter(filter);
                let scene = scene(50).with_camera(orbit(projection)).with_fog(Some(fog)).with_method(method).unwrap();
                let tolerant = scene.clone().with_slices(Slicing::Tolerance(3e-3)).unwrap();
                for scene in [scene, tolerant] {
                    let want = Renderer::new(volume, settings(Level::SCALAR, 1, 8)).render(&scene).unwrap().0;
                    for level in Level::available() {
                        for (threads, tile) in [(1, 64), (3, 5), (2, 32)] {
                            let got = Renderer::new(volume, settings(level, threads, tile)).render(&scene).unwrap().0;
                            assert!(got == want, "volume {n}, {}, {threads} threads, tiles of {tile}", level.name());
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn one_colour_comes_to_its_closed_form() {
    let (a, color) = (0.3, [0.9, 0.5, 0.2]);
    let numbers = [color[0], color[1], color[2], a].map(|c| c as f32);
    let volume = rgba(numbers.repeat(COUNT));
    let a = f64::from(numbers[3]);
    for (projection, unit) in [(PARALLEL, None), (PERSPECTIVE, Some(2.5))] {
        let transfer = unit.map_or(plain(), |length| plain().with_unit(length).unwrap());
        let scene = scene(40).with_camera(orbit(projection)).with_transfer(transfer).with_terminate(0.0).unwrap();
        let picture = render(&volume, &scene).unwrap();
        let integrator = Integrator::new(&scene, &volume).unwrap();
        let mut seen = 0;
        for (n, pixel) in picture.pixels().iter().enumerate() {
            let (x, y) = ((n % 44) as u32, (n / 44) as u32);
            let (at, way) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (_, direction) = integrator.view().ray(at, way);
            let Some((near, far)) = integrator.ray(at, way).span else { continue };
            let length = (far - near) * direction.length() / unit.unwrap_or(0.75);
            let opacity = 1.0 - (1.0 - a).powf(length);
            let (truth, _) = integrator.pixel(x, y);
            assert!(
                (f64::from(pixel[3]) - opacity).abs() < 3e-6 && (truth.alpha - opacity).abs() < 1e-9,
                "{x},{y}: {} {opacity}",
                pixel[3]
            );
            for c in 0..3 {
                let want = opacity * f64::from(numbers[c]);
                assert!((f64::from(pixel[c]) - want).abs() < 3e-6 && (truth.rgb[c] - want).abs() < 1e-9);
            }
            seen += 1;
        }
        assert!(seen > 300);
    }
}

#[test]
fn pictures_converge_to_the_reference() {
    let fog = Fog::new(FogMode::Linear { start: 5.0, end: 40.0 }, [0.1, 0.2, 0.9]).unwrap();
    let body = body();
    let ramp = TransferFunction::new(vec![(0.0, [0.0; 3])], vec![(0.2, 0.0), (1.0, 0.5)]).unwrap();
    for volume in [of_bytes(&body), of_floats(&body)] {
        let base = scene(1).with_terminate(0.0).unwrap().with_transfer(ramp.clone()).with_camera(orbit(PERSPECTIVE));
        let background = Straight { rgb: [0.2, 0.9, 0.4], alpha: 0.5 };
        let scenes = [
            base.clone(),
            base.clone().with_opacity_from(Some(OpacityFrom::Luma)),
            base.clone().with_opacity_from(Some(OpacityFrom::Maximum)).with_fog(Some(fog)),
            base.with_linear_light(true).unwrap().with_background(background).unwrap(),
        ];
        for (n, scene) in scenes.iter().enumerate() {
            let error = |count: u64| {
                let scene = scene.clone().with_slices(Slicing::Count(count)).unwrap();
                off(&render(&volume, &scene).unwrap(), &scene, &volume)
            };
            let (coarse, fine, finest) = (error(40), error(160), error(640));
            // Between voxels slabs of thickness D are interpolated, extinction in the limit: that is of first order in D.
            assert!(fine < 0.4 * coarse && finest < 0.4 * fine && finest < 2e-3, "scene {n}: {coarse} {fine} {finest}");
        }
    }
}

#[test]
fn rays_end_at_opaque_voxels_in_the_limit() {
    // An opaque ball of two colours.
    let ball: Vec<[f64; 4]> =
        body().iter().enumerate().map(|(i, c)| [if i % 2 == 0 { 1.0 } else { 0.5 }, c[1], c[2], f64::from(u8::from(c[3] > 0.2))]).collect();
    let volume = of_bytes(&ball);
    let scene = |count| scene(count).with_terminate(0.0).unwrap();
    let mean = |count: u64| {
        let picture = render(&volume, &scene(count)).unwrap();
        let truth = image(&scene(count), &volume, Region::whole(&scene(count))).unwrap();
        let off = picture.pixels().iter().zip(truth.pixels()).map(|(a, b)| (f64::from(a[0]) - b[0]).abs() + (f64::from(a[3]) - b[3]).abs());
        off.sum::<f64>() / f64::from(44 * 37)
    };
    // The place where a ray ends moves towards the cell's face with the root of D.
    let (coarse, fine, finest) = (mean(100), mean(1600), mean(25_600));
    assert!(fine < 0.4 * coarse && finest < 0.4 * fine, "{coarse} {fine} {finest}");
    let truth = image(&scene(1), &volume, Region::whole(&scene(1))).unwrap();
    assert!(truth.pixels().iter().all(|p| p[3] == 0.0 || p[3] == 1.0) && truth.pixels().iter().any(|p| p[3] == 1.0));
}

#[test]
fn a_tolerance_is_kept_and_slabs_are_neither_merged_nor_pre_integrated() {
    let volume = of_floats(&body());
    let scene = scene(1).with_slices(Slicing::Tolerance(2e-3)).unwrap().with_size(120, 100).unwrap();
    let (picture, stats) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
    let truth = image(&scene, &volume, Region::whole(&scene)).unwrap();
    let squares = picture.pixels().iter().zip(truth.pixels()).flat_map(|(a, b)| (0..3).map(|c| (f64::from(a[c]) - b[c]).powi(2)));
    let rms = (squares.sum::<f64>() / (3.0 * 120.0 * 100.0)).sqrt();
    assert!(rms < 2e-3 && stats.error_estimate.unwrap() <= 2e-3, "{rms} {:?}", stats.error_estimate);
    assert_eq!((stats.method, stats.tally.merged_batches), (Method::default(), 0));
}

#[test]
fn numbers_out_of_range_are_clamped_and_those_that_are_none_are_transparent() {
    let body = body();
    let (mut wild, mut tame) = (body.clone(), body);
    for i in (0..COUNT).step_by(5) {
        (wild[i][0], tame[i][0]) = (1.5, 1.0);
        (wild[i][3], tame[i][3]) = (-2.0, 0.0);
    }
    for i in (1..COUNT).step_by(10) {
        wild[i][i % 4] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][i % 3];
        tame[i] = [0.0; 4];
    }
    let (clamped, none) = ((0..COUNT).step_by(5).count(), (1..COUNT).step_by(10).count());
    for from in [OpacityFrom::Alpha, OpacityFrom::Maximum] {
        let scene = scene(40).with_opacity_from(Some(from));
        let (picture, stats) = Renderer::new(of_floats(&wild), Settings::default()).render(&scene).unwrap();
        let all = COUNT;
        let told = |line: String| assert!(stats.warnings.contains(&line), "{:?}", stats.warnings);
        told(format!("{clamped} of {all} voxels have a colour or an alpha outside 0 to 1: clamped"));
        if from == OpacityFrom::Alpha {
            told(format!("{none} of {all} voxels are NaN or infinite: transparent"));
            assert_eq!(stats.non_finite_voxels, none);
            assert!(picture == render(&of_floats(&tame), &scene).unwrap());
        } else {
            // Its alpha does not count there.
            let counting = (1..COUNT).step_by(10).filter(|i| i % 4 != 3).count();
            assert_eq!(stats.non_finite_voxels, counting);
        }
        let fine = scene.with_slices(Slicing::Count(600)).unwrap().with_terminate(0.0).unwrap();
        let error = off(&render(&of_floats(&wild), &fine).unwrap(), &fine, &of_floats(&wild));
        assert!(from == OpacityFrom::Maximum || error < 0.02, "{from:?}: {error}");
    }
}

#[test]
fn empty_bricks_are_passed_over_and_change_nothing() {
    let mut colors = body();
    for (i, c) in colors.iter_mut().enumerate() {
        let at = [i % DIMS[0], i / DIMS[0] % DIMS[1], i / DIMS[0] / DIMS[1]];
        if at[0] > 4 || at[1] > 5 {
            c[3] = 0.0;
        }
    }
    let volume = of_bytes(&colors);
    let scene = scene(60);
    let (picture, stats) = Renderer::new(&volume, Settings::default()).render(&scene).unwrap();
    assert!(stats.tally.empty_batches > 100, "{:?}", stats.tally);
    // An observer sees every row.
    let (observed, ..) = Renderer::new(&volume, Settings::default()).render_with(&scene, &[Aov::Depth, Aov::Alpha]).unwrap();
    assert!(observed == picture && picture.pixels().iter().any(|p| p[3] > 0.1));
    // What shows is framed by alpha.
    let [low, high] = Visible::of(&scene, &volume).unwrap().extent(DVec3::X);
    assert!(low <= 1.0 && high < 9.0, "{low} {high}");
    assert!(Visible::of(&scene, &rgba(vec![0u8; 4 * COUNT])).is_none());
}

#[test]
fn interpolated_apart_colour_and_opacity_make_fringes() {
    // A translucent white wall, and nothing beside it, which files keep as black of alpha 0.
    let wall: Vec<[f64; 4]> = (0..COUNT).map(|i| if i % DIMS[0] < 6 { [1.0, 1.0, 1.0, 0.2] } else { [0.0; 4] }).collect();
    let volume = of_bytes(&wall);
    let (eye, target) = (DVec3::new(6.0, 6.0, -40.0), DVec3::new(6.0, 6.0, 0.0));
    let camera = Camera::new(Placement::LookAt { eye, target, up: DVec3::Y }, Projection::Orthographic { height: Some(8.0) }).unwrap();
    let method = Method::default().with_ends(Ends::Whole);
    let scene = scene(24).with_camera(camera).with_size(160, 80).unwrap().with_method(method).unwrap().with_terminate(0.0).unwrap();
    let picture: Vec<[f64; 4]> = render(&volume, &scene).unwrap().pixels().iter().map(|p| p.map(f64::from)).collect();
    let own = by_hand(&volume, &scene, 24, By::Premultiplied, |c| c[3]);
    let wrong = by_hand(&volume, &scene, 24, By::Apart, |c| c[3]);
    // Straight brightness, where anything is seen; and over white, where a white wall should not be seen at all.
    let darkest = |pixels: &[[f64; 4]]| pixels.iter().filter(|p| p[3] > 1e-3).map(|p| p[0] / p[3]).fold(1.0, f64::min);
    let over_white = |pixels: &[[f64; 4]]| pixels.iter().map(|p| p[0] + 1.0 - p[3]).fold(1.0, f64::min);
    let grey = |pixels: &[[f64; 4]]| pixels.iter().filter(|p| p[0] + 1.0 - p[3] < 0.98).count();
    for pixels in [&picture, &own] {
        assert!(darkest(pixels) > 1.0 - 1e-4 && over_white(pixels) > 1.0 - 1e-5 && grey(pixels) == 0, "{}", darkest(pixels));
    }
    // Opacities are the same; their colours are not.
    assert!(wrong.iter().zip(&own).all(|(a, b)| (a[3] - b[3]).abs() < 1e-12));
    // The edge is a voxel wide: 10 of 160 columns.
    assert!(darkest(&wrong) < 0.06 && over_white(&wrong) < 0.65 && grey(&wrong) == 800, "{} {}", darkest(&wrong), over_white(&wrong));
}

#[test]
fn what_needs_values_is_refused_in_a_line() {
    let volume = of_bytes(&body()).with_name("tissue.nrrd");
    let base = scene(20);
    let with = |scene: slicestack::Result<Scene>, words: &[&str]| {
        let scene = scene.unwrap();
        let all: Vec<&str> = words.iter().copied().chain(["tissue.nrrd: "]).collect();
        refused(render(&volume, &scene), &all);
        refused(scene.check_with(&volume), &all);
        refused(Integrator::new(&scene, &volume), &[]);
    };
    let method = |change: &dyn Fn(&mut Method)| {
        let mut method = Method::default();
        change(&mut method);
        base.clone().with_method(method)
    };
    for blend in [Blend::Mip, Blend::Min, Blend::Average, Blend::Lmip { threshold: 1.0 }, Blend::Iso { level: 1.0 }] {
        with(base.clone().with_blend(blend), &["render.blend", "choose over or add"]);
    }
    with(base.clone().with_levels(vec![LevelSurface::new(1.0, None, 0.5).unwrap()]), &["render.blend iso"]);
    for classification in [Classification::Pre, Classification::PreIntegrated, Classification::SecondOrder] {
        with(base.clone().with_method(Method::default().with_classification(classification)), &["transfer.classification"]);
    }
    with(method(&|m| m.filter = Filter::CUBIC), &["render.filter cubic"]);
    with(method(&|m| m.merge = true), &["slices.merge"]);
    with(base.clone().with_lighting(Some(Lighting::default())), &["light"]);
    with(base.clone().with_opengl(OpenGl::default()), &["render.profile opengl"]);
    with(Ok(base.clone().with_transfer(plain().with_gradient_opacity(vec![(0.0, 1.0)]).unwrap())), &["transfer.gradient_opacity"]);
    let mut renderer = Renderer::new(&volume, Settings::default());
    refused(renderer.render_with(&base, &[Aov::Value]), &["aov value", "colours"]);
    refused(renderer.render_with(&base, &[Aov::Normal]), &["aov normal", "colours"]);
    renderer.render_layer(&base).unwrap();
    // What is for colours alone.
    let scalars = Volume::new(grid(), vec![1u8; COUNT].into()).unwrap();
    refused(render(&scalars, &base.clone().with_opacity_from(Some(OpacityFrom::Luma))), &["transfer.opacity_from luma"]);
    let rgb = volume.without_alpha().unwrap();
    refused(render(&rgb, &base.clone().with_opacity_from(Some(OpacityFrom::Alpha))), &["opacity_from alpha", "without alpha"]);
    assert!(render(&rgb, &base).unwrap() == render(&rgb, &base.with_opacity_from(Some(OpacityFrom::Luma))).unwrap());
    refused(scalars.without_alpha(), &["colours"]);
}
