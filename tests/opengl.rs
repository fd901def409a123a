//! The profile `opengl` without an OpenGL: closed forms, the two classic accidents, and that no state makes a NaN.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use glam::{DMat4, DVec3, DVec4};
use slicestack::scene::{
    AlphaTest, Arithmetic, BlendFunction, Camera, Classification, Compare, Environment, Equation, Factor, Filter, Fog, FogDistance,
    FogEvaluation, FogMode, FogWeighting, Method, OpenGl, Order, Placement, Projection, Scissor, Slicing, Straight, Target, TextureFormat,
    TransferFunction, Wrap,
};
use slicestack::volume::{Grid, Voxels};
use slicestack::{Picture, Renderer, Scene, Settings, Volume};

/// A box of 8 voxels a side, all of one value.
fn even(value: u8) -> Volume {
    Volume::new(Grid::with_spacing([8; 3], [1.0; 3]).unwrap(), Voxels::U8(vec![value; 512].into())).unwrap()
}

fn ramp() -> Volume {
    let bytes = (0..512).map(|i| (i % 8 * 20 + i / 64 * 13) as u8).collect();
    Volume::new(Grid::with_spacing([8; 3], [1.0; 3]).unwrap(), Voxels::U8(bytes)).unwrap()
}

fn constant(rgb: [f64; 3], alpha: f64) -> TransferFunction {
    TransferFunction::new(vec![(0.0, rgb)], vec![(0.0, alpha)]).unwrap()
}

/// Looking along -z at the whole box, `slices` slices of the transfer function's opacity each, over opaque black.
fn scene(transfer: TransferFunction, slices: u64) -> Scene {
    let c = DVec3::splat(3.5);
    let camera = Camera::new(
        Placement::LookAt { eye: c + DVec3::Z * 20.0, target: c, up: DVec3::Y },
        Projection::Orthographic { height: Some(6.0) },
    );
    Scene::new(transfer)
        .with_camera(camera.unwrap())
        .with_size(12, 12)
        .unwrap()
        .with_background(Straight { rgb: [0.0; 3], alpha: 1.0 })
        .unwrap()
        .with_slices(Slicing::Count(slices))
        .unwrap()
        .with_opacity_unit(8.0 / slices as f64)
        .unwrap()
}

/// The scene through OpenGL, with these numbers in the framebuffer.
fn gl(scene: &Scene, state: OpenGl, target: Target) -> Scene {
    scene.clone().with_opengl(state).unwrap().with_method(Method::default().with_target(target)).unwrap()
}

fn render(volume: &Volume, scene: &Scene) -> Picture {
    Renderer::new(volume, Settings::default()).render(scene).unwrap().0
}

fn fog(mode: FogMode, weighting: FogWeighting) -> Option<Fog> {
    Some(Fog::new(mode, [0.6, 0.7, 0.8]).unwrap().with_weighting(weighting))
}

#[test]
fn equal_slices_add_up_to_the_closed_form() {
    let picture = render(&even(100), &gl(&scene(constant([1.0, 0.5, 0.25], 0.02), 100), OpenGl::default(), Target::F32));
    let want = 1.0 - 0.98f64.powi(100);
    for (c, share) in [1.0, 0.5, 0.25].into_iter().enumerate() {
        assert!((f64::from(picture.pixel(6, 6)[c]) - want * share).abs() < 1e-5, "{:?}", picture.pixel(6, 6));
    }
    assert_eq!(picture.pixel(6, 6)[3], 1.0);
}

/// The first accident: fog onto premultiplied slices of nothing.
#[test]
fn literal_fog_lights_up_empty_space_and_straight_colours_do_not() {
    let empty = scene(constant([1.0; 3], 0.0), 10).with_fog(fog(FogMode::Exp { density: 0.01 }, FogWeighting::Literal));
    for target in [Target::F32, Target::Unorm8, Target::Unorm16] {
        let literal = render(&even(100), &gl(&empty, OpenGl::default(), target)).pixel(6, 6);
        // Every slice adds (1 - f) of the fog's colour, and hides nothing.
        let depth = |k: i32| 16.0 + (f64::from(k) + 0.5) * 0.8;
        let want: f64 = (0..10).map(|k| 1.0 - (-0.01 * depth(k)).exp()).sum::<f64>() * 0.6;
        let want = if target == Target::F32 { want } else { want.min(1.0) };
        assert!((f64::from(literal[0]) - want).abs() < 1e-2, "{target:?}: {literal:?} instead of {want}");
        assert!(literal[0] > 0.9);

        let straight = render(&even(100), &gl(&empty, OpenGl::straight(), target)).pixel(6, 6);
        assert_eq!(straight[..3], [0.0; 3], "{target:?}");

        let weighted = empty.clone().with_fog(fog(FogMode::Exp { density: 0.01 }, FogWeighting::Alpha));
        let weighted = render(&even(100), &gl(&weighted, OpenGl::default(), target)).pixel(6, 6);
        assert_eq!(weighted, [0.0, 0.0, 0.0, 1.0], "{target:?}");
    }
}

/// The second accident: 8 bits between slices.
#[test]
fn a_framebuffer_of_8_bits_loses_a_thousand_thin_slices() {
    let thin = scene(constant([1.0; 3], 0.001), 1000);
    let at = |state: OpenGl, target| f64::from(render(&even(100), &gl(&thin, state, target)).pixel(6, 6)[0]);
    let want = 1.0 - 0.999f64.powi(1000);
    assert!((at(OpenGl::default(), Target::F32) - want).abs() < 1e-4);
    let exact_table = OpenGl { table: Some(TextureFormat::F32), ..OpenGl::default() };
    assert!((at(exact_table, Target::Unorm16) - want).abs() < 2e-2);
    // A table of floats does not help, nor does blending in floats: what is stored between slices is 0.
    let float = OpenGl { blend_arithmetic: Arithmetic::Float, ..exact_table };
    for state in [OpenGl::default(), exact_table, float, OpenGl { table: Some(TextureFormat::F32), ..OpenGl::straight() }] {
        assert_eq!(at(state, Target::Unorm8), 0.0);
    }
}

fn warnings(scene: &Scene) -> Vec<String> {
    Renderer::new(ramp(), Settings::default()).render(scene).unwrap().1.warnings
}

#[test]
fn fog_that_lights_up_empty_slices_is_told() {
    let ramp = || TransferFunction::new(vec![(0.0, [0.5; 3])], vec![(0.0, 0.0), (200.0, 0.3)]).unwrap();
    let told = |color: [f64; 3], weighting, state: OpenGl| {
        let fog = Fog::new(FogMode::Exp { density: 0.01 }, color).unwrap().with_weighting(weighting);
        let lines = warnings(&gl(&scene(ramp(), 10).with_fog(Some(fog)), state, Target::F32));
        lines.iter().filter(|l| l.contains("fog.weighting = \"alpha\"")).count()
    };
    let (gray, usual) = ([0.5; 3], OpenGl::default());
    assert_eq!(told(gray, FogWeighting::Literal, usual), 1);
    assert_eq!(told(gray, FogWeighting::Alpha, usual), 0);
    assert_eq!(told([0.0; 3], FogWeighting::Literal, usual), 0, "black adds nothing");
    assert_eq!(told(gray, FogWeighting::Literal, OpenGl::straight_separate()), 0);
    let discards = OpenGl { alpha_test: Some(AlphaTest { compare: Compare::Greater, reference: 0.0 }), ..usual };
    assert_eq!(told(gray, FogWeighting::Literal, discards), 0, "empty fragments are discarded");
}

#[test]
fn a_framebuffer_that_is_no_premultiplied_picture_is_told() {
    let transfer = || TransferFunction::new(vec![(0.0, [1.0, 0.8, 0.2])], vec![(0.0, 0.0), (200.0, 0.1)]).unwrap();
    let clear = |state: OpenGl, target| {
        let s = scene(transfer(), 20).with_background(Straight { rgb: [0.0; 3], alpha: 0.0 }).unwrap();
        let s = gl(&s, state, target);
        (render(&ramp(), &s), warnings(&s).into_iter().filter(|l| l.contains("no premultiplied picture")).collect::<Vec<_>>())
    };
    for target in [Target::F32, Target::Unorm8, Target::Unorm16] {
        let (squared, lines) = clear(OpenGl::straight(), target);
        assert_eq!(lines.len(), 1, "{target:?}");
        assert!(lines[0].contains("opengl.blend_source_alpha = \"one\"") && lines[0].contains(".npy"), "{}", lines[0]);
        let (separate, lines) = clear(OpenGl::straight_separate(), target);
        assert!(lines.is_empty(), "{target:?}: {lines:?}");
        assert!(separate.pixels().iter().all(|p| p[0] <= p[3] + 1e-6) && squared.pixels().iter().any(|p| p[0] > p[3] + 0.01));
        // Alpha alone is another one.
        assert!(separate.pixels().iter().zip(squared.pixels()).all(|(a, b)| a[..3] == b[..3]));
        assert!(clear(OpenGl::default(), target).1.is_empty(), "{target:?}");
    }
    // Colours that an opaque background stays under.
    let opaque = gl(&scene(transfer(), 20), OpenGl::straight_separate(), Target::Unorm8);
    assert!(warnings(&opaque).is_empty());
    let stats = Renderer::new(ramp(), Settings::default()).render(&opaque).unwrap().1;
    assert_eq!(stats.simd, "scalar");
}

#[test]
fn literal_fog_on_straight_colours_is_weighted_fog_on_premultiplied_ones() {
    let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.5, 0.9]), (200.0, [1.0, 0.2, 0.0])], vec![(0.0, 0.0), (200.0, 0.3)]).unwrap();
    // Entries are not interpolated: between them premultiplied and straight colours differ.
    let nearest = |state: OpenGl| OpenGl { table_filter: Filter::Nearest, ..state };
    for mode in [FogMode::Linear { start: 15.0, end: 26.0 }, FogMode::Exp { density: 0.05 }, FogMode::Exp2 { density: 0.04 }] {
        for distance in [FogDistance::Planar, FogDistance::Radial] {
            let with = |weighting, state| {
                let fog = fog(mode, weighting).map(|f| f.with_distance(distance));
                render(&ramp(), &gl(&scene(transfer.clone(), 20).with_fog(fog), nearest(state), Target::F32))
            };
            let literal = with(FogWeighting::Literal, OpenGl::straight());
            let weighted = with(FogWeighting::Alpha, OpenGl::default());
            for (a, b) in literal.pixels().iter().zip(weighted.pixels()) {
                assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-5), "{mode:?}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn nearest_texels_and_entries_come_out_as_they_went_in() {
    // One slice through the middle of the fifth layer of voxels, which it replaces the background with.
    let transfer = TransferFunction::new(vec![(0.0, [0.0; 3]), (255.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap();
    let volume = ramp();
    let state = OpenGl { table_filter: Filter::Nearest, ..OpenGl::default() }.with_blend(BlendFunction::add(Factor::One, Factor::Zero));
    let c = DVec3::splat(3.5);
    let camera = Camera::new(
        Placement::LookAt { eye: c + DVec3::Z * 20.0, target: c, up: DVec3::Y },
        Projection::Orthographic { height: Some(8.0) },
    );
    let planes =
        vec![slicestack::scene::ClipPlane::new(DVec3::Z, 3.6).unwrap(), slicestack::scene::ClipPlane::new(DVec3::NEG_Z, -4.4).unwrap()];
    let scene = scene(transfer, 8).with_size(8, 8).unwrap().with_camera(camera.unwrap()).with_clip_planes(planes).unwrap();
    let method = Method::default().with_target(Target::Unorm8).with_filter(Filter::Nearest);
    let picture = render(&volume, &scene.with_opengl(state).unwrap().with_method(method).unwrap());
    for y in 0..8 {
        for x in 0..8 {
            let level = volume.value([x, 7 - y, 4]) as f32;
            assert_eq!(picture.pixel(x as u32, y as u32), [level / 255.0, level / 255.0, level / 255.0, 1.0], "{x},{y}");
        }
    }
}

#[test]
fn a_scissor_leaves_the_rest_as_it_was() {
    let s = scene(constant([1.0; 3], 0.5), 4);
    let all = render(&even(100), &gl(&s, OpenGl::default(), Target::Unorm8));
    let scissor = Some(Scissor { x: 2, y: 1, width: 5, height: 3 });
    let part = render(&even(100), &gl(&s, OpenGl { scissor, ..OpenGl::default() }, Target::Unorm8));
    for y in 0..12 {
        for x in 0..12 {
            // From the lower left corner.
            let inside = (2..7).contains(&x) && (1..4).contains(&(11 - y));
            assert_eq!(part.pixel(x, y), if inside { all.pixel(x, y) } else { [0.0, 0.0, 0.0, 1.0] }, "{x},{y}");
        }
    }
}

#[test]
fn the_alpha_test_discards_whole_fragments() {
    let s = scene(constant([1.0; 3], 0.5), 1);
    for compare in Compare::ALL {
        for reference in [0.25, 128.0 / 255.0, 0.75] {
            let state = OpenGl { alpha_test: Some(AlphaTest { compare, reference }), ..OpenGl::default() };
            let drawn = render(&even(100), &gl(&s, state, Target::Unorm8)).pixel(6, 6)[0] > 0.0;
            assert_eq!(drawn, compare.passes(128.0 / 255.0, reference), "{compare:?} {reference}");
        }
    }
}

#[test]
fn no_state_puts_a_nan_or_an_infinity_into_a_picture() {
    let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.5, 0.9]), (120.0, [1.0, 0.2, 0.0])], vec![(0.0, 0.0), (120.0, 1.0)]).unwrap();
    let floats = {
        let Voxels::U8(bytes) = ramp().voxels().clone() else { panic!("the ramp is of bytes") };
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN];
        let values = bytes.iter().enumerate().map(|(i, &b)| if i % 9 == 0 { odd[i / 9 % 5] } else { f32::from(b) });
        Volume::new(ramp().grid().clone(), Voxels::F32(values.collect())).unwrap()
    };
    let modes = [
        None,
        fog(FogMode::Linear { start: 20.0, end: 20.0 }, FogWeighting::Literal),
        fog(FogMode::Linear { start: 1e300, end: -1e300 }, FogWeighting::Alpha),
        fog(FogMode::Exp { density: 1e300 }, FogWeighting::Literal),
        fog(FogMode::Exp2 { density: 0.0 }, FogWeighting::Literal).map(|f| f.with_distance(FogDistance::Radial)),
    ];
    let project = DMat4::from_cols(DVec4::new(1e8, 0.0, 0.0, 1e4), DVec4::Y, DVec4::Z, DVec4::new(-1e8, 0.0, 0.0, 1.1));
    let mut i = 0;
    for source in Factor::ALL {
        for destination in Factor::ALL {
            let equation = Equation::ALL[i % 5];
            let state = OpenGl {
                texture: if i % 2 == 0 { TextureFormat::F32 } else { TextureFormat::Unorm8 },
                texture_matrix: if i % 3 == 0 { project } else { DMat4::IDENTITY },
                wrap: [[Wrap::Repeat, Wrap::ClampToBorder, Wrap::ClampToEdge][i % 3]; 3],
                environment: if i % 4 == 0 { Environment::Modulate } else { Environment::Replace },
                fog_evaluation: if i % 7 < 3 { FogEvaluation::Vertex } else { FogEvaluation::Fragment },
                filter_arithmetic: if i % 11 < 5 { Arithmetic::Fixed } else { Arithmetic::Float },
                min_filter: (i % 5 == 0).then_some(Filter::Nearest),
                ..OpenGl::default().with_blend(BlendFunction { equation, source, destination })
            };
            let classification = if i % 13 < 6 { Classification::Pre } else { Classification::Post };
            let target = [Target::F32, Target::Unorm8, Target::Unorm16][i % 3];
            let s = scene(transfer.clone(), 300).with_fog(modes[i % modes.len()]).with_size(4, 4).unwrap().with_opengl(state).unwrap();
            let s = s.with_method(Method::default().with_classification(classification).with_target(target)).unwrap();
            let s = if i % 2 == 0 { s.with_order(Order::FrontToBack) } else { s };
            for volume in [&ramp(), &floats] {
                let picture = render(volume, &s);
                assert!(picture.pixels().iter().flatten().all(|c| c.is_finite()), "{state:?}");
            }
            i += 1;
        }
    }
}

#[test]
fn a_q_that_passes_through_0_is_refused() {
    let with = |q: [f64; 4]| {
        let mut m = DMat4::IDENTITY;
        (m.x_axis.w, m.y_axis.w, m.z_axis.w, m.w_axis.w) = (q[0], q[1], q[2], q[3]);
        let scene = scene(constant([1.0; 3], 0.5), 4).with_opengl(OpenGl { texture_matrix: m, ..OpenGl::default() });
        scene.and_then(|s| Renderer::new(even(100), Settings::default()).render(&s)).map_err(|e| e.to_string())
    };
    let refusal = with([2.0, 0.0, 0.0, -1.0]).unwrap_err();
    assert!(refusal.contains("q runs from -1 to 1") && refusal.contains("texture_matrix"), "{refusal}");
    assert!(with([1.0, 0.0, 0.0, 0.0]).unwrap_err().contains("q runs from 0 to 1"));
    assert!(with([0.0; 4]).unwrap_err().contains("singular"));
    assert!(with([0.0, 0.0, 0.0, 1e-12]).unwrap_err().contains("over the limit"));
    assert!(with([f64::NAN, 0.0, 0.0, 1.0]).unwrap_err().contains("must be finite"));
    assert!(with([0.0, 0.0, 0.0, 1e300]).unwrap_err().contains("at most 1e30"));
    // Below 0 throughout is what OpenGL divides by.
    assert!(with([0.5, 0.0, 0.0, -2.0]).is_ok());
}

#[test]
fn a_singular_texture_matrix_shows_what_it_maps_to() {
    // Every fragment looks up the centre of voxel (3, 2, 5).
    let at = DVec4::new(3.5 / 8.0, 2.5 / 8.0, 5.5 / 8.0, 1.0);
    let point = DMat4::from_cols(DVec4::ZERO, DVec4::ZERO, DVec4::ZERO, at);
    let transfer = TransferFunction::new(vec![(0.0, [0.0; 3]), (255.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap();
    let picture = render(&ramp(), &gl(&scene(transfer, 3), OpenGl { texture_matrix: point, ..OpenGl::default() }, Target::Unorm8));
    let want = ramp().value([3, 2, 5]) as f32 / 255.0;
    assert!(picture.pixels().iter().all(|p| *p == [want, want, want, 1.0]));
}

#[test]
fn states_outside_their_range_are_refused_by_name() {
    let refusal = |state: OpenGl| scene(constant([1.0; 3], 0.5), 4).with_opengl(state).unwrap_err().to_string();
    let usual = OpenGl::default();
    for (state, says) in [
        (OpenGl { border: [0.0, 2.0, 0.0, 0.0], ..usual }, "opengl border_color 2: outside [0,1]"),
        (OpenGl { primary: [f64::NAN; 4], ..usual }, "opengl primary_color NaN"),
        (OpenGl { blend_constant: [-1.0; 4], ..usual }, "opengl blend_color -1"),
        (OpenGl { alpha_test: Some(AlphaTest { compare: Compare::Less, reference: 1.5 }), ..usual }, "opengl alpha_reference 1.5"),
    ] {
        assert!(refusal(state).contains(says), "{}", refusal(state));
    }
    assert!(Fog::new(FogMode::Exp2 { density: -0.5 }, [0.0; 3]).unwrap_err().to_string().contains("density -0.5"));
    let drawn = scene(constant([1.0; 3], 0.5), 4).with_opengl(usual).unwrap();
    let unsuited = [
        drawn.clone().with_method(Method::default()).and_then(|s| s.with_slices(Slicing::Tolerance(0.1))),
        drawn.clone().with_blend(slicestack::scene::Blend::Mip),
        drawn.clone().with_method(Method::default().with_classification(Classification::PreIntegrated)),
        drawn.clone().with_method(Method::default().with_extrapolate(true)),
        scene(constant([1.0; 3], 0.5), 4).with_method(Method::default().with_target(Target::Unorm16)),
    ];
    for refused in unsuited {
        let says = refused.unwrap_err().to_string();
        assert!(says.contains("profile opengl"), "{says}");
    }
}
