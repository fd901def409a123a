//! What is written of a scene reads back as that scene, to the bit.
#![cfg(feature = "scene-file")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod scenes;

use glam::{DMat4, DVec3, DVec4};
use proptest::prelude::*;
use slicestack::scene::{
    Accumulation, Algorithm, AlphaTest, Annotations, Arithmetic, Blend, BlendFunction, Camera, Classification, ClipPlane, ColorMap,
    Compare, Connectivity, CutPlane, Ends, Environment, Equation, Factor, Filter, FocusRegion, FocusShape, Fog, FogDistance, FogEvaluation,
    FogMode, FogWeighting, Gradient, Hit, LevelSurface, Light, LightSource, Lighting, Method, OpacityFrom, OpenGl, Order, Overrides,
    Placement, Projection, Region, SampleAt, SceneFile, SceneFormat, Scissor, SegmentEffect, SegmentStyle, Shading, Shape, SlabForm,
    Slicing, Straight, TableColors, Target, TemplatePlane, TextureFormat, Transfer2d, TransferFunction, Wrap, keys, write_scene,
};
use slicestack::volume::edit::CropBox;
use slicestack::volume::io::{Choice, Endian, RawSpec};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{BoxConvention, Modality, Origin, VolumeSource, VoxelType};
use slicestack::{Renderer, Scene, Settings, Volume};
use std::collections::BTreeSet;

/// Numbers from a seed.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        // splitmix64
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    fn flip(&mut self) -> bool {
        self.below(2) == 0
    }

    fn pick<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len() as u64) as usize]
    }

    /// 0 to 1, of all 53 bits.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Any size and sign.
    fn number(&mut self) -> f64 {
        let power = self.below(60) as i32 - 30;
        (self.share() - 0.5) * f64::powi(2.0, power)
    }

    fn positive(&mut self) -> f64 {
        self.number().abs() + f64::MIN_POSITIVE
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    fn rgb(&mut self) -> [f64; 3] {
        [self.share(), self.share(), self.share()]
    }

    fn rgba(&mut self) -> [f64; 4] {
        [self.share(), self.share(), self.share(), self.share()]
    }

    fn rising(&mut self, least: f64) -> Vec<f64> {
        let count = 1 + self.below(5);
        let mut values: Vec<f64> = (0..count).map(|_| self.number().max(least)).collect();
        values.sort_by(f64::total_cmp);
        values
    }
}

fn transfer(dice: &mut Dice) -> TransferFunction {
    let color = dice.rising(f64::MIN).into_iter().map(|v| (v, dice.rgb())).collect();
    let opacity = dice.rising(f64::MIN).into_iter().map(|v| (v, dice.share())).collect();
    let transfer = TransferFunction::new(color, opacity).unwrap();
    let transfer = if dice.flip() { transfer.with_unit(dice.positive()).unwrap() } else { transfer };
    if dice.below(3) > 0 {
        return transfer;
    }
    let factors = dice.rising(0.0).into_iter().map(|g| (g, dice.share())).collect();
    transfer.with_gradient_opacity(factors).unwrap()
}

fn transfer2d(dice: &mut Dice) -> Transfer2d {
    let two = |dice: &mut Dice| {
        let low = dice.positive();
        [low, low + dice.positive() + low * 0.25]
    };
    let transfer = if dice.flip() {
        let region = |dice: &mut Dice| {
            let shape = match dice.below(4) {
                0 => Shape::Box { value: two(dice), gradient: two(dice) },
                1 => Shape::Triangle { value: dice.number(), width: dice.positive(), gradient: dice.positive() },
                2 => Shape::Gaussian { value: dice.number(), width: dice.positive(), gradient: dice.positive(), height: dice.positive() },
                _ => Shape::Levoy { value: dice.number(), thickness: dice.positive() },
            };
            Region { shape, color: dice.rgb(), opacity: dice.share() }
        };
        Transfer2d::regions((0..1 + dice.below(3)).map(|_| region(dice)).collect()).unwrap()
    } else {
        let (columns, rows) = (2 + dice.below(4) as usize, 2 + dice.below(4) as usize);
        let colors: Vec<[f32; 4]> = (0..columns * rows).map(|_| dice.rgba().map(|x| x as f32)).collect();
        Transfer2d::table((columns, rows), &colors, two(dice), two(dice)).unwrap()
    };
    if dice.flip() { transfer.with_unit(dice.positive()).unwrap() } else { transfer }
}

/// Any effects on any labels.
fn segments(dice: &mut Dice) -> Vec<SegmentStyle> {
    let mut labels: Vec<i64> = (0..1 + dice.below(5)).map(|_| dice.next() as i32 as i64).collect();
    labels.sort_unstable();
    labels.dedup();
    let effect = |dice: &mut Dice| match dice.below(4) {
        0 => SegmentEffect::Show,
        1 => SegmentEffect::Hide,
        2 => SegmentEffect::Tint { color: dice.rgb(), strength: dice.share() },
        _ => SegmentEffect::Replace { color: dice.rgb(), opacity: dice.share() },
    };
    labels.into_iter().map(|label| SegmentStyle::new(label, effect(dice)).unwrap()).collect()
}

fn region(dice: &mut Dice) -> FocusRegion {
    let shape = if dice.flip() {
        FocusShape::Sphere { radius: dice.positive() }
    } else {
        FocusShape::Box { size: [dice.positive(), dice.positive(), dice.positive()] }
    };
    let transfer = transfer(dice).with_gradient_opacity(Vec::new()).unwrap();
    FocusRegion::new(shape, dice.point(), transfer).unwrap()
}

fn camera(dice: &mut Dice) -> Camera {
    let projection = match dice.below(3) {
        0 => Projection::Orthographic { height: None },
        1 => Projection::Orthographic { height: Some(dice.positive()) },
        _ => Projection::Perspective { fov_y: 1.0 + 170.0 * dice.share() },
    };
    let placement = if dice.below(5) == 0 {
        Placement::Along { axis: dice.below(3) as usize, backwards: dice.flip() }
    } else if dice.flip() {
        Placement::Orbit { azimuth: dice.number(), elevation: dice.number(), roll: dice.number(), zoom: dice.positive() }
    } else {
        Placement::LookAt { eye: dice.point(), target: dice.point(), up: dice.point() }
    };
    let camera = Camera::new(placement, projection).unwrap_or_default();
    if dice.flip() { camera.with_near(dice.positive()).unwrap() } else { camera }
}

fn lighting(dice: &mut Dice) -> Lighting {
    let light = |dice: &mut Dice| {
        let source = match dice.below(3) {
            0 => LightSource::Head,
            1 => LightSource::Direction(dice.point()),
            _ => LightSource::Position(dice.point()),
        };
        Light::new(source, dice.rgb()).unwrap()
    };
    let lights = (0..1 + dice.below(4)).map(|_| light(dice)).collect();
    let mut lighting = Lighting::default().with_lights(lights).unwrap();
    lighting.shading = dice.pick(&[Shading::BlinnPhong, Shading::Depth]);
    lighting.ambient = dice.positive();
    lighting.diffuse = dice.positive();
    lighting.specular = dice.positive();
    lighting.shininess = 1.0 + 999.0 * dice.share();
    lighting.emission = dice.positive();
    lighting.two_sided = dice.flip();
    lighting.gradient_floor = dice.positive();
    lighting
}

fn opengl(dice: &mut Dice, fog: bool) -> OpenGl {
    const WRAPS: [Wrap; 3] = [Wrap::ClampToEdge, Wrap::ClampToBorder, Wrap::Repeat];
    const FILTERS: [Filter; 2] = [Filter::Linear, Filter::Nearest];
    const FORMATS: [TextureFormat; 2] = [TextureFormat::Unorm8, TextureFormat::F32];
    const ARITHMETICS: [Arithmetic; 2] = [Arithmetic::Fixed, Arithmetic::Float];
    let function = |dice: &mut Dice| BlendFunction {
        equation: dice.pick(&Equation::ALL),
        source: dice.pick(&Factor::ALL),
        destination: dice.pick(&Factor::ALL),
    };
    let row = |dice: &mut Dice| DVec4::new(dice.number(), dice.number(), dice.number(), dice.number());
    let mut gl = OpenGl {
        texture: dice.pick(&FORMATS),
        min_filter: dice.flip().then(|| dice.pick(&FILTERS)),
        filter_arithmetic: dice.pick(&ARITHMETICS),
        wrap: if dice.flip() { [dice.pick(&WRAPS); 3] } else { [dice.pick(&WRAPS), dice.pick(&WRAPS), dice.pick(&WRAPS)] },
        texture_matrix: if dice.flip() { DMat4::IDENTITY } else { DMat4::from_cols(row(dice), row(dice), row(dice), row(dice)) },
        table: dice.flip().then(|| dice.pick(&FORMATS)),
        table_filter: dice.pick(&FILTERS),
        table_colors: dice.pick(&[TableColors::Premultiplied, TableColors::Straight]),
        environment: dice.pick(&[Environment::Replace, Environment::Modulate]),
        alpha_test: dice.flip().then(|| AlphaTest { compare: dice.pick(&Compare::ALL), reference: dice.share() }),
        blend_arithmetic: dice.pick(&ARITHMETICS),
        blend: function(dice),
        blend_alpha: function(dice),
        scissor: dice.flip().then(|| Scissor {
            x: dice.below(9) as u32,
            y: dice.below(9) as u32,
            width: dice.below(999) as u32,
            height: dice.below(999) as u32,
        }),
        ..OpenGl::default()
    };
    // Numbers that have an effect.
    if gl.wrap.contains(&Wrap::ClampToBorder) {
        gl.border = dice.rgba();
    }
    if gl.environment == Environment::Modulate {
        gl.primary = dice.rgba();
    }
    if fog {
        gl.fog_evaluation = dice.pick(&[FogEvaluation::Fragment, FogEvaluation::Vertex]);
    }
    if [gl.blend.source, gl.blend.destination, gl.blend_alpha.source, gl.blend_alpha.destination].iter().any(|f| f.is_constant()) {
        gl.blend_constant = dice.rgba();
    }
    gl
}

fn algorithm(dice: &mut Dice) -> Algorithm {
    match dice.below(8) {
        0 => Algorithm::Rays,
        1 => Algorithm::Shells,
        2 => Algorithm::Traversal(dice.pick(&[Connectivity::Six, Connectivity::Eighteen, Connectivity::TwentySix])),
        3 => Algorithm::Template(dice.pick(&[TemplatePlane::Base, TemplatePlane::Image])),
        4 => Algorithm::ObjectSlices { spacing_correction: dice.flip() },
        5 => Algorithm::Grid,
        6 => Algorithm::CoinFlips { games: 1 + dice.below(1 << 20) as u32, seed: dice.next() as u32 },
        _ => Algorithm::Slices,
    }
}

fn cut_plane(dice: &mut Dice) -> CutPlane {
    let plane = CutPlane::new(dice.point(), dice.number()).unwrap().with_colors(dice.pick(&ColorMap::ALL));
    if dice.flip() { plane.with_window(dice.number(), dice.positive()).unwrap_or(plane) } else { plane }
}

fn method(dice: &mut Dice) -> Method {
    const CLASSIFICATIONS: [Classification; 4] =
        [Classification::Post, Classification::Pre, Classification::PreIntegrated, Classification::SecondOrder];
    let mut m = Method::default();
    // Few changes at a time: many of them exclude each other.
    for _ in 0..dice.below(4) {
        m = match dice.below(8) {
            0 => m.with_classification(dice.pick(&CLASSIFICATIONS)),
            1 => m.with_filter(dice.pick(&[Filter::Linear, Filter::Nearest, Filter::CUBIC, Filter::Cubic { prefilter: false }])),
            2 => m.with_slab(dice.pick(&[SlabForm::Exponential, SlabForm::Riemann])),
            3 => m.with_sample(dice.pick(&[SampleAt::Center, SampleAt::End])),
            4 => m.with_ends(dice.pick(&[Ends::Partial, Ends::Whole])),
            5 => m.with_target(dice.pick(&[Target::F32, Target::Unorm8, Target::Unorm16])),
            6 => m.with_accumulation(dice.pick(&[Accumulation::Auto, Accumulation::Plain, Accumulation::Compensated])),
            _ => m.with_extrapolate(dice.flip()),
        };
    }
    m
}

/// What a setter makes of `scene`, or `scene` itself where it refuses.
fn tried(scene: Scene, set: impl FnOnce(Scene) -> slicestack::Result<Scene>) -> Scene {
    set(scene.clone()).unwrap_or(scene)
}

/// A scene of every kind that has only what shows.
fn random(seed: u64) -> Scene {
    let dice = &mut Dice(seed);
    let size = |dice: &mut Dice| 1 + dice.below(1 << 15) as u32;
    let [r, g, b, alpha] = dice.rgba();
    let mut s = Scene::new(transfer(dice)).with_camera(camera(dice)).with_size(size(dice), size(dice)).unwrap();
    s = s.with_background(Straight { rgb: [r, g, b], alpha }).unwrap().with_fogged_background(dice.flip());
    if dice.flip() {
        let mode = match dice.below(3) {
            0 => FogMode::Linear { start: dice.number(), end: dice.number() },
            1 => FogMode::Exp { density: dice.positive() },
            _ => FogMode::Exp2 { density: dice.positive() },
        };
        let distance = dice.pick(&[FogDistance::Planar, FogDistance::Radial]);
        let weighting = dice.pick(&[FogWeighting::Alpha, FogWeighting::Literal]);
        s = s.with_fog(Some(Fog::new(mode, dice.rgb()).unwrap().with_distance(distance).with_weighting(weighting)));
    }
    let planes = (0..dice.below(7)).map(|_| ClipPlane::new(dice.point(), dice.number()).unwrap()).collect();
    s = s.with_clip_planes(planes).unwrap();
    if dice.below(3) == 0 {
        let segments = segments(dice);
        s = tried(s, |s| s.with_segments(segments));
    }
    if dice.below(4) == 0 {
        let regions = (0..1 + dice.below(8)).map(|_| region(dice)).collect();
        s = tried(s, |s| s.with_regions(regions));
    }
    if dice.below(4) == 0 {
        let gl = opengl(dice, s.fog().is_some());
        s = tried(s, |s| s.with_opengl(gl));
    }
    // Merged slabs go together with little else.
    let merged = dice.below(6) == 0 && s.opengl().is_none();
    if !merged {
        s = s.with_order(dice.pick(&[Order::FrontToBack, Order::BackToFront]));
    }
    let m = if merged { Method::default().with_merge(true) } else { method(dice) };
    s = tried(s, |s| s.with_method(m));
    let slicing = match dice.below(3) {
        0 => Slicing::Count(1 + dice.below(1 << 24)),
        1 => Slicing::Spacing(dice.positive()),
        _ => Slicing::Tolerance(dice.positive()),
    };
    s = tried(s, |s| s.with_slices(slicing));
    if s.opengl().is_none() {
        s = s.with_terminate(dice.share() as f32 * 0.9).unwrap();
    }
    s = s.with_gradient(dice.pick(&[Gradient::Central, Gradient::Analytic, Gradient::Sobel]));
    let linear = dice.flip();
    s = tried(s, |s| s.with_linear_light(linear));
    let level = dice.number();
    let surface = |dice: &mut Dice| LevelSurface::new(dice.number(), dice.flip().then(|| dice.rgb()), dice.share()).unwrap();
    let center = dice.number();
    let width = dice.positive();
    s = match dice.below(15) {
        _ if merged => s,
        0 => tried(s, |s| s.with_blend(Blend::Mip)),
        1 => tried(s, |s| s.with_blend(Blend::Min)),
        2 => tried(s, |s| s.with_blend(Blend::Average)),
        3 => tried(s, |s| s.with_blend(Blend::Add)),
        10 => tried(s, |s| s.with_blend(Blend::Under)),
        11 => {
            let attenuation = dice.positive();
            tried(s, |s| s.with_blend(Blend::AttenuatedMip { attenuation })?.with_window(dice.flip().then_some([center, width])))
        }
        12 => tried(s, |s| s.with_blend(Blend::Add)?.with_window(Some([center.abs() + 0.5 * width, width]))),
        4 => tried(s, |s| s.with_blend(Blend::Lmip { threshold: level })),
        5 => tried(s, |s| s.with_blend(Blend::Lmip { threshold: f64::MIN })),
        6 | 7 => tried(s, |s| s.with_blend(Blend::Iso { level })),
        8 | 9 => {
            let levels = (0..1 + dice.below(4)).map(|_| surface(dice)).collect();
            tried(s, |s| s.with_levels(levels))
        }
        _ => s,
    };
    if matches!(s.blend(), Blend::Iso { .. } | Blend::Surfaces) {
        s = s.with_hit(dice.pick(&[Hit::Refined, Hit::FirstSample]));
    }
    match dice.below(3) {
        0 => {
            let light = lighting(dice);
            s = tried(s, |s| s.with_lighting(Some(light)));
        }
        1 => s = s.with_flat_surfaces(true),
        _ => {}
    }
    if dice.below(4) == 0 {
        let t = transfer2d(dice);
        s = tried(s, |s| s.with_transfer2d(Some(t)));
    }
    if dice.below(4) == 0 {
        let algorithm = algorithm(dice);
        s = tried(s, |s| s.with_algorithm(algorithm));
    }
    if dice.below(4) == 0 {
        let seed = dice.next() as u32;
        s = tried(s, |s| s.with_jitter(Some(seed)));
    }
    if dice.below(3) == 0 {
        let planes = (0..1 + dice.below(6)).map(|_| cut_plane(dice)).collect();
        s = tried(s, |s| s.with_cuts(planes));
    }
    if dice.below(8) == 0 {
        return of_colors(dice, &s);
    }
    if s.check().is_ok() { s } else { s.with_transfer(TransferFunction::new(vec![(0.5, [1.0; 3])], vec![(0.5, 1.0)]).unwrap()) }
}

/// A scene of a volume of colours with some of what `s` has.
fn of_colors(dice: &mut Dice, s: &Scene) -> Scene {
    let from = dice.pick(&OpacityFrom::ALL);
    let opacity = match from {
        OpacityFrom::Alpha => vec![(0.0, 0.0), (1.0, 1.0)],
        _ => dice.rising(f64::MIN).into_iter().map(|v| (v, dice.share())).collect(),
    };
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], opacity).unwrap();
    let transfer = if dice.flip() { transfer.with_unit(dice.positive()).unwrap() } else { transfer };
    let scene = Scene::new(transfer).with_opacity_from(Some(from)).with_camera(*s.camera()).with_fog(s.fog().copied());
    let scene = scene.with_order(s.order()).with_clip_planes(s.clip_planes().to_vec()).unwrap().with_gradient(s.gradient());
    let scene = scene.with_linear_light(dice.flip()).unwrap().with_slices(s.slicing()).unwrap();
    scene.with_blend(dice.pick(&[Blend::Over, Blend::Add])).unwrap()
}

/// A volume that `scene` can be of.
fn volume(scene: &Scene) -> Volume {
    let cloud = Phantom::Cloud.volume(8).unwrap();
    match scene.opacity_from() {
        Some(_) => Volume::with_colors(cloud.grid().clone(), vec![90u8; 4 * 512].into()).unwrap(),
        None => {
            let labels = Volume::new(cloud.grid().clone(), vec![0u8; 512].into()).unwrap();
            cloud.with_labels(&labels).unwrap()
        }
    }
}

fn of_some_volume() -> Overrides {
    let mut overrides = Overrides::default();
    overrides.set("volume.phantom", "cloud");
    overrides
}

/// The scene that `text` says, for `volume`.
fn read(text: &str, volume: &Volume) -> Scene {
    let file = SceneFile::parse(text, "", &of_some_volume()).unwrap_or_else(|e| panic!("{e} in\n{text}"));
    file.to_scene(volume).unwrap_or_else(|e| panic!("{e} in\n{text}")).0
}

/// `scene` with the transfer function that stands unused behind one of value and gradient taken from `other`.
fn with_unused_from(scene: &Scene, other: &Scene) -> Scene {
    if scene.transfer2d().is_some() && !matches!(scene.blend(), Blend::Iso { .. } | Blend::Surfaces) {
        return scene.clone().with_transfer(other.transfer().clone());
    }
    scene.clone()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    #[test]
    fn any_scene_reads_back_as_it_is(seed in any::<u64>()) {
        let scene = random(seed);
        let volume = volume(&scene);
        for format in [SceneFormat::Toml, SceneFormat::Json] {
            let text = write_scene(&scene, None, &Annotations::new(), format).unwrap();
            let back = read(&text, &volume);
            prop_assert_eq!(&back, &with_unused_from(&scene, &back), "{}", text);
            // A text written again is the same text.
            prop_assert_eq!(write_scene(&back, None, &Annotations::new(), format).unwrap(), text);
        }
    }
}

#[test]
fn scenes_on_record_give_the_same_pictures() {
    let mut rendered = 0;
    for sample in scenes::samples() {
        let text = write_scene(&sample.scene, None, &Annotations::new(), SceneFormat::Toml).unwrap();
        let back = read(&text, &sample.volume);
        if back == sample.scene {
            continue;
        }
        // Something of it has no effect; the picture tells.
        rendered += 1;
        let picture = |scene: &Scene| Renderer::new(&sample.volume, Settings::new()).render(scene).unwrap().0.sha256();
        assert_eq!(picture(&back), picture(&sample.scene), "{}: {text}", sample.name);
    }
    assert!(rendered < scenes::samples().len() / 2, "{rendered} scenes differ");
}

fn sources() -> Vec<VolumeSource> {
    let spec = RawSpec::new([3, 4, 5], VoxelType::I16).with_endian(Endian::Big).with_offset(7);
    let spec = spec.with_spacing([0.1, -0.3, 1e-9]).with_origin([0.1, 0.2, 1.0 / 3.0]);
    vec![
        VolumeSource::new(Origin::Phantom(Phantom::Hydrogen, 21)).with_convention(BoxConvention::Nodes),
        VolumeSource::new(Origin::File("a b/\"c\".nrrd".into()))
            .with_spacing([0.7, -1.0 / 3.0, 2.0])
            .with_position([1e-3, 0.1, -7.0])
            .with_slope(0.1)
            .with_intercept(-1024.5)
            .with_modality(Modality::Ct),
        VolumeSource::new(Origin::Raw("v.raw".into(), spec)).with_modality(Modality::Mr),
        VolumeSource::new(Origin::File("study".into()))
            .with_choice(Choice::new().series("1.2.840").array("a b").level(2).frame(3).channel(1)),
        VolumeSource::new(Origin::File("study".into())).with_choice(Choice::new().series("3")).with_modality(Modality::Other),
        VolumeSource::new(Origin::File("flow.vti".into())).with_choice(Choice::new().magnitude()).with_crop(CropBox::Voxels([
            0..3,
            2..9,
            1..2,
        ])),
        VolumeSource::new(Origin::Phantom(Phantom::Cloud, 16)).with_crop(CropBox::World([[-1.5, 2.25], [0.0, 1e-3], [-3.0, 7.0]])),
        VolumeSource::new(Origin::File("head.nrrd".into())).with_labels(
            VolumeSource::new(Origin::File("a \"b\".seg.nrrd".into()))
                .with_choice(Choice::new().series("1.2.840").array("c d").level(1).frame(2).channel(4)),
        ),
    ]
}

#[test]
fn volumes_read_back_too() {
    let scene = random(1);
    for source in sources() {
        for format in [SceneFormat::Toml, SceneFormat::Json] {
            let text = write_scene(&scene, Some(&source), &Annotations::new(), format).unwrap();
            let file = SceneFile::parse(&text, "", &Overrides::default()).unwrap();
            // The picture's size belongs to the scene.
            assert_eq!(file.volume().clone().with_pixels(None), source, "{text}");
        }
    }
    let mixed = VolumeSource::new(Origin::Raw("v.raw".into(), RawSpec::new([1; 3], VoxelType::U8).with_spacing([1.0, -2.0, 3.0])));
    let text = write_scene(&scene, Some(&mixed.with_spacing([5.0, 6.0, -7.0])), &Annotations::new(), SceneFormat::Toml).unwrap();
    assert!(text.contains("spacing = [5.0, -6.0, -7.0]"), "{text}");
}

/// Keys that stand for others, which are written in their place.
const RESOLVED: [&str; 6] = ["volume.layers", "transfer.preset", "transfer.file", "transfer.name", "transfer.colormap", "transfer.range"];

#[test]
fn every_key_is_written_when_it_is_set() {
    let mut written: BTreeSet<String> = BTreeSet::new();
    let mut note = |text: &str| {
        let table: toml::Table = toml::from_str(text).unwrap();
        for (section, value) in table {
            match value {
                toml::Value::Table(inner) => written.extend(inner.keys().map(|k| format!("{section}.{k}"))),
                _ => drop(written.insert(section)),
            }
        }
    };
    (0..2000).for_each(|seed| note(&write_scene(&random(seed), None, &Annotations::new(), SceneFormat::Toml).unwrap()));
    sources().iter().for_each(|source| note(&write_scene(&random(0), Some(source), &Annotations::new(), SceneFormat::Toml).unwrap()));
    let mut all = Annotations::new();
    (all.colorbar, all.scale_bar, all.axes, all.box_edges, all.title) = (true, true, true, true, Some("a title".into()));
    note(&write_scene(&random(0), None, &all, SceneFormat::Toml).unwrap());
    let known: BTreeSet<String> = keys().iter().map(|k| k.path.clone()).filter(|k| !RESOLVED.contains(&k.as_str())).collect();
    let missing: Vec<_> = known.difference(&written).collect();
    let unknown: Vec<_> = written.difference(&known).collect();
    assert!(missing.is_empty() && unknown.is_empty(), "missing: {missing:?}, unknown: {unknown:?}");
}

#[test]
fn tables_too_large_for_a_scene_file_are_refused() {
    let colors = vec![[0.1f32, 0.2, 0.3, 0.4]; 1024 * 1024];
    let table = Transfer2d::table((1024, 1024), &colors, [0.0, 1.0], [0.0, 1.0]).unwrap();
    let scene = Scene::new(transfer(&mut Dice(1))).with_transfer2d(Some(table)).unwrap();
    let line = write_scene(&scene, None, &Annotations::new(), SceneFormat::Toml).unwrap_err().to_string();
    assert!(line.starts_with("scene: bytes of its file: ") && line.contains("over the limit of 16777216"), "{line}");
    let uneven = "[transfer2d]\ntable = [[[0, 0, 0, 0], [1, 1, 1, 1]], [[0, 0, 0, 0]]]\nrange = [0, 1]\ngradient_range = [0, 1]\n";
    let line = SceneFile::parse(uneven, "", &of_some_volume()).unwrap_err().to_string();
    assert_eq!(line, "line 2: transfer2d.table: row 1 has 1 colours, the first one 2");
}
