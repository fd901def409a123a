//! Light and gradient opacity: closed forms, the reference, and scenes at the ends of their numbers.

use super::convergence::{errors, order, smooth_transfer, spread};
use super::methods::cell;
use super::{PARALLEL, WIDE, constant, fill, fill_as, oblique, orbit, render, smooth, telling};
use glam::{DMat3, DVec3};
use slicestack::scene::{
    Camera, Classification, ClipPlane, Gradient, Light, LightSource, Lighting, Method, Placement, Projection, Region, Shading, Shape,
    Slicing, Straight, Transfer2d, TransferFunction,
};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{BoxConvention, Grid, VoxelType, Voxels};
use slicestack::{Level, Picture, Renderer, Scene, Settings, Volume};

const KINDS: [Gradient; 3] = [Gradient::Central, Gradient::Analytic, Gradient::Sobel];

/// The default material with other numbers, in lights from `sources`.
fn material(sources: &[LightSource], change: impl Fn(&mut Lighting)) -> Lighting {
    let mut lighting = Lighting::default();
    change(&mut lighting);
    lighting.with_lights(sources.iter().map(|&s| Light::new(s, [1.0; 3]).unwrap()).collect()).unwrap()
}

fn in_light(scene: &Scene, lighting: &Lighting) -> Scene {
    scene.clone().with_lighting(Some(lighting.clone())).unwrap()
}

/// Normals of what is opaque, pixel by pixel: the brightness of white in lights along the world's axes, from either end.
fn normals(volume: &Volume, scene: &Scene) -> Vec<DVec3> {
    let sides = [1.0, -1.0].map(|sign| {
        let lamp = |axis: DVec3, color: [f64; 3]| Light::new(LightSource::Direction(axis * sign), color).unwrap();
        let lights = vec![lamp(DVec3::X, [1.0, 0.0, 0.0]), lamp(DVec3::Y, [0.0, 1.0, 0.0]), lamp(DVec3::Z, [0.0, 0.0, 1.0])];
        let mut lighting = Lighting::default();
        (lighting.ambient, lighting.diffuse, lighting.specular, lighting.two_sided) = (0.0, 1.0, 0.0, false);
        render(volume, &in_light(scene, &lighting.with_lights(lights).unwrap())).0
    });
    let pairs = sides[0].pixels().iter().zip(sides[1].pixels());
    pairs.map(|(a, b)| DVec3::from_array([0, 1, 2].map(|c: usize| f64::from(a[c]) - f64::from(b[c])))).collect()
}

#[test]
fn plane_waves_have_the_gradient_of_their_closed_form() {
    // f = sin(k.x): half the difference over a step a is sin(k.a) cos(k.x), so on any grid central differences point along the covector
    // with components sin(k.a) for the grid's axes a; Sobel's are weighted by (1 + cos(k.b)) / 2 for both other axes b.
    let dims = [14, 13, 12];
    let mirrored = Grid::with_spacing(dims, [1.0, -0.4, 2.3]).unwrap();
    for (grid, k) in [
        (oblique(dims), DVec3::new(0.09, -0.04, 0.05)),
        (oblique(dims), DVec3::new(-0.02, 0.08, 0.06)),
        (mirrored, DVec3::new(0.05, 0.1, -0.04)),
    ] {
        let axes = [0, 1, 2].map(|a: usize| grid.index_to_world().matrix3.col(a));
        let to_covector = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose().inverse();
        let center = grid.center();
        let place = |i: usize| {
            let index = DVec3::new((i % dims[0]) as f64, (i / dims[0] % dims[1]) as f64, (i / dims[0] / dims[1]) as f64);
            grid.index_to_world().transform_point3(index) - center
        };
        // Scaled and moved: light does not see that.
        let values: Vec<f64> = (0..grid.voxel_count()).map(|i| 40.0 + 25.0 * k.dot(place(i)).sin()).collect();
        assert!((0..grid.voxel_count()).all(|i| k.dot(place(i)).abs() < 1.5), "the wave has a crest in the box");
        let volume = Volume::new(grid.clone(), Voxels::F64(values.into())).unwrap();
        // Two voxels inside, where no neighbour is clamped.
        let inverse = grid.world_to_index().matrix3;
        let planes = (0..3).flat_map(|a| {
            let row = inverse.row(a);
            let offset = grid.world_to_index().translation[a];
            let (low, high) = (2.0, dims[a] as f64 - 3.0);
            let length = row.length();
            [(row / length, (low - offset) / length), (-row / length, -(high - offset) / length)]
        });
        let planes = planes.map(|(n, d)| ClipPlane::new(n, d).unwrap()).collect();
        let scene = Scene::new(constant([1.0; 3], 1.0)).with_size(24, 20).unwrap().with_slices(Slicing::Count(60)).unwrap();
        let scene = scene.with_camera(orbit(37.0, 24.0, 1.4, WIDE)).with_clip_planes(planes).unwrap();
        for kind in KINDS {
            let steps = axes.map(|a| k.dot(a));
            let factor = |a: usize| {
                let smoothed: f64 = (0..3).filter(|&b| b != a).map(|b| 0.5 * (1.0 + steps[b].cos())).product();
                steps[a].sin() * if kind == Gradient::Sobel { smoothed } else { 1.0 }
            };
            let want = -(to_covector * DVec3::new(factor(0), factor(1), factor(2))).normalize();
            let found = normals(&volume, &scene.clone().with_gradient(kind));
            let shown: Vec<DVec3> = found.into_iter().filter(|n| n.length() > 0.5).collect();
            assert!(shown.len() > 60, "{} pixels", shown.len());
            let off = shown.iter().map(|n| (*n - want).length()).fold(0.0, f64::max);
            // The analytic gradient is no difference over two steps: within a cell it turns with the wave's curvature.
            let bound = if kind == Gradient::Analytic { 0.1 } else { 2e-5 };
            assert!(off < bound, "{kind:?}: {off}");
        }
    }
}

#[test]
fn a_spheres_normals_are_within_half_a_degree() {
    for (spacing, kinds) in [([1.0; 3], &KINDS[..]), ([1.0, 0.7, 1.2], &KINDS[..])] {
        let grid = Grid::with_spacing([64; 3], spacing).unwrap();
        let center = grid.center();
        let radius = 0.3 * 64.0 * 0.7;
        let at = |i: usize| grid.index_to_world().transform_point3(DVec3::new((i % 64) as f64, (i / 64 % 64) as f64, (i / 4096) as f64));
        let values: Vec<f32> = (0..64 * 64 * 64).map(|i| (radius - at(i).distance(center)) as f32).collect();
        let volume = Volume::new(grid.clone(), Voxels::F32(values.into())).unwrap();
        let solid = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.0), (0.0, 1.0)]).unwrap();
        let way = DVec3::new(1.0, -0.4, 0.3).normalize();
        let place = Placement::LookAt { eye: center - way * 100.0, target: center, up: DVec3::Z };
        let camera = Camera::new(place, Projection::Orthographic { height: Some(2.2 * radius) }).unwrap();
        let scene = Scene::new(solid).with_camera(camera).with_size(41, 41).unwrap().with_slices(Slicing::Count(2000)).unwrap();
        let view = camera.resolve(&grid, 41, 41).unwrap();
        for &kind in kinds {
            let found = normals(&volume, &scene.clone().with_gradient(kind));
            let (mut worst, mut seen): (f64, usize) = (0.0, 0);
            for (i, n) in found.iter().enumerate() {
                let (origin, direction) = view.ray((i % 41) as f64 + 0.5, (i / 41) as f64 + 0.5);
                // Where the ray meets the sphere: rays that graze it leave the place to the slices.
                let along = (center - origin).dot(direction);
                let aside = (origin + direction * along - center).length();
                if aside > 0.9 * radius {
                    continue;
                }
                let hit = origin + direction * (along - (radius * radius - aside * aside).sqrt());
                let angle = n.normalize().dot((hit - center) / radius).clamp(-1.0, 1.0).acos().to_degrees();
                worst = worst.max(angle);
                seen += 1;
            }
            println!("{spacing:?} {kind:?}: {worst:.3} degrees of {seen} normals");
            // Within a cell the analytic gradient jumps from face to face, by about a voxel's part of the radius.
            let bound = if kind == Gradient::Analytic { 4.0 } else { 0.5 };
            assert!(worst < bound && seen > 850, "{spacing:?} {kind:?}: {worst} degrees of {seen} normals");
        }
    }
}

/// Two lights of which none turns away within the picture, so that no kink is left.
fn smooth_light() -> Lighting {
    let sources = [LightSource::Head, LightSource::Direction(DVec3::new(4.0, 3.2, 2.0))];
    material(&sources, |m| (m.ambient, m.diffuse, m.specular, m.shininess) = (0.2, 0.35, 0.15, 6.0))
}

#[test]
fn lit_slabs_have_their_orders() {
    let (volume, scene) = cell();
    let lit = in_light(&scene, &smooth_light());
    let base = Method::default();
    let weighted = scene.transfer().clone().with_gradient_opacity(vec![(0.0, 0.1), (400.0, 1.0)]).unwrap();
    let both = lit.clone().with_transfer(weighted.clone());
    let by_gradient = scene.clone().with_transfer(weighted);
    let deep = in_light(&scene, &material(&[LightSource::Head], |m| m.shading = Shading::Depth));
    let pairs = base.with_classification(Classification::PreIntegrated);
    let second = base.with_classification(Classification::SecondOrder);
    for (what, scene, method, counts, expected) in [
        ("midpoint", &lit, base, [16, 24, 32, 48, 64], 2.0),
        ("midpoint, depth", &deep, base, [16, 24, 32, 48, 64], 2.0),
        ("midpoint, gradient opacity", &by_gradient, base, [16, 24, 32, 48, 64], 2.0),
        ("midpoint, light and gradient opacity", &both, base, [16, 24, 32, 48, 64], 2.0),
        // Light is taken at the slice a slab ends at: that is what sets the order, whatever the slab's own is.
        ("pre-integrated", &lit, pairs, [32, 48, 64, 96, 128], 1.0),
        ("second order", &lit, second, [32, 48, 64, 96, 128], 1.0),
        // Depth is that of the slab's middle.
        ("pre-integrated, depth", &deep, pairs, [16, 24, 32, 48, 64], 2.0),
    ] {
        let errors = errors(&volume, &scene.clone().with_method(method).unwrap(), &counts);
        let order = order(&counts, &errors);
        println!("{what}: order {order:.3}, errors {errors:?}");
        assert!((order - expected).abs() < 0.15, "{what}: order {order}, errors {errors:?}");
    }
}

#[test]
fn lit_scenes_of_many_cells_converge() {
    // A smooth wave with matter up to the faces, seen through the three kinds of gradient; kinks at cell faces alone.
    let field = |[x, y, z]: [f64; 3]| 0.5 + 0.4 * (1.5 * x + 0.4).sin() * (1.2 * y - z).cos();
    let grid = Grid::with_spacing([20; 3], [1.0; 3]).unwrap().with_convention(BoxConvention::Nodes);
    let volume = spread(grid.clone(), &field);
    let eye = grid.center() + DVec3::new(40.0, 9.0, 14.0);
    for (name, projection) in
        [("parallel", Projection::Orthographic { height: Some(10.0) }), ("perspective", Projection::Perspective { fov_y: 14.0 })]
    {
        let camera = Camera::new(Placement::LookAt { eye, target: grid.center(), up: DVec3::Z }, projection).unwrap();
        let scene = Scene::new(smooth_transfer(0.01)).with_camera(camera).with_size(24, 20).unwrap().with_terminate(0.0).unwrap();
        let near = LightSource::Position(grid.center() + DVec3::new(15.0, 20.0, 25.0));
        let lit = in_light(&scene, &material(&[LightSource::Head, near], |m| (m.diffuse, m.gradient_floor) = (0.3, 80.0)));
        for kind in KINDS {
            let counts = [48, 96, 192, 384];
            let errors = errors(&volume, &lit.clone().with_gradient(kind), &counts);
            let order = order(&counts, &errors);
            println!("{name}, {kind:?}: order {order:.3}, errors {errors:?}");
            // Jumps at the cells' faces make the analytic gradient's error one of their number, not of the slabs' square.
            let least = if kind == Gradient::Analytic { 0.7 } else { 1.85 };
            assert!(order > least && order < 2.15 && errors[3] < 2e-4, "{name}, {kind:?}: order {order}, errors {errors:?}");
        }
    }
}

#[test]
fn functions_of_value_and_gradient_come_close_to_the_reference() {
    let volume = spread(oblique([14, 12, 13]), &smooth);
    let region = |shape, color, opacity| Region { shape, color, opacity };
    let soft = [
        region(Shape::Triangle { value: 2000.0, width: 1500.0, gradient: 900.0 }, [0.9, 0.5, 0.2], 0.3),
        region(Shape::Gaussian { value: 1000.0, width: 400.0, gradient: 200.0, height: 150.0 }, [0.2, 0.6, 1.0], 0.4),
        region(Shape::Levoy { value: 2800.0, thickness: 1.5 }, [1.0, 0.9, 0.8], 0.6),
    ];
    let sharp = [region(Shape::Box { value: [800.0, 2500.0], gradient: [100.0, 600.0] }, [0.3, 0.9, 0.4], 0.3)];
    let colors: Vec<[f32; 4]> = (0..5 * 4).map(|i| [0.1 * (i % 5) as f32, 0.5, 0.2 * (i / 5) as f32, 0.03 * (i % 7) as f32]).collect();
    let table = Transfer2d::table((5, 4), &colors, [500.0, 3500.0], [50.0, 800.0]).unwrap();
    let of = |regions: &[Region]| Transfer2d::regions(regions.to_vec()).unwrap();
    for (what, transfer, most) in [("soft", of(&soft), 5e-4), ("sharp", of(&sharp), 5e-3), ("table", table, 5e-4)] {
        for (kind, light) in [(Gradient::Central, false), (Gradient::Sobel, true)] {
            let scene = Scene::new(TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap())
                .with_camera(orbit(30.0, 20.0, 1.4, WIDE))
                .with_size(24, 20)
                .unwrap()
                .with_terminate(0.0)
                .unwrap()
                .with_gradient(kind)
                .with_transfer2d(Some(transfer.clone()))
                .unwrap();
            let scene = if light { in_light(&scene, &smooth_light()) } else { scene };
            let errors = errors(&volume, &scene, &[100, 1600]);
            println!("{what}, {kind:?}: errors {errors:?}");
            assert!(errors[1] < most && errors[1] < 0.5 * errors[0] && errors[0] > 0.0, "{what}, {kind:?}: {errors:?}");
        }
    }
}

/// Bricks that are passed over because nothing in them is steep enough show nothing: a factor of next to nothing in the place of 0 keeps them all.
#[test]
fn bricks_passed_over_by_gradient_change_nothing() {
    let dims = [60, 56, 58];
    // Even all around, and steep towards the middle.
    let ball = |[x, y, z]: [f64; 3]| (220.0 - 900.0 * (x * x + y * y + z * z)).max(20.0);
    let volume = Volume::new(oblique(dims), fill_as(VoxelType::U8, dims, &ball)).unwrap();
    let scene = |least: f64| {
        let transfer = telling(0.0, 255.0).with_gradient_opacity(vec![(4.0, least), (16.0, 1.0)]).unwrap();
        let scene = Scene::new(transfer).with_camera(orbit(30.0, 20.0, 1.3, WIDE)).with_size(48, 40).unwrap();
        render(&volume, &scene.with_slices(Slicing::Count(90)).unwrap())
    };
    let ((few, passed), (all, looked)) = (scene(0.0), scene(1e-30));
    let off = few.pixels().iter().flatten().zip(all.pixels().iter().flatten()).fold(0.0, |most: f32, (a, b)| most.max((a - b).abs()));
    assert!(off < 1e-7, "{off}");
    assert!(passed.tally.empty > looked.tally.empty + 1000, "{} {}", passed.tally.empty, looked.tally.empty);
    assert!(few.pixels().iter().any(|p| p[3] > 0.01));
}

#[test]
fn every_voxel_type_and_grid_is_lit_like_the_reference() {
    let dims = [12, 11, 13];
    let lights = [LightSource::Head, LightSource::Direction(DVec3::new(-1.0, 0.3, 2.0))];
    for (i, kind) in VoxelType::ALL.into_iter().enumerate() {
        let top = if kind.bytes() == 1 { 120.0 } else { 4000.0 };
        let volume = Volume::new(oblique(dims), fill_as(kind, dims, &|p| top * smooth(p))).unwrap();
        // Turned around and stretched: gradients are those of the data's units.
        let volume = volume.with_rescale(if i % 2 == 0 { 1.0 / top } else { -1.0 / top }, if i % 2 == 0 { 0.0 } else { 1.0 }).unwrap();
        let camera = orbit(40.0 * i as f64, 25.0, 1.2, if i % 2 == 0 { PARALLEL } else { WIDE });
        let scene = Scene::new(telling(0.0, 1.0)).with_camera(camera).with_size(20, 16).unwrap().with_terminate(0.0).unwrap();
        let scene = in_light(&scene, &material(&lights, |m| m.gradient_floor = 0.05)).with_gradient(KINDS[i % 3]);
        let error = errors(&volume, &scene, &[600])[0];
        assert!(error < 1e-3, "{kind}: {error}");
    }
}

/// Bytes at every vector level.
fn same_at_every_level(volume: &Volume, scene: &Scene) -> Picture {
    let of = |level: Level| Renderer::new(volume, Settings::new().level(level)).render(scene).unwrap().0;
    let want = of(Level::SCALAR);
    for level in Level::available() {
        assert_eq!(of(level).sha256(), want.sha256(), "{}", level.name());
    }
    want
}

#[test]
fn volumes_without_a_slope_keep_their_colors() {
    let lights = [LightSource::Head, LightSource::Position(DVec3::new(1.0, 2.0, 3.0))];
    for value in [0.0, 1.0, -3e38, 1e30, 1e300, 1e-310, 16_777_217.25] {
        let transfer = TransferFunction::new(vec![(value, [0.25, 0.5, 0.75])], vec![(value, 0.3)]).unwrap();
        for dims in [[4, 4, 4], [1, 5, 3], [1, 1, 1]] {
            let volume = Volume::new(oblique(dims), Voxels::F64(vec![value; dims.iter().product()].into())).unwrap();
            for (kind, method) in KINDS.into_iter().zip([Classification::Post, Classification::PreIntegrated, Classification::SecondOrder])
            {
                let plain = Scene::new(transfer.clone()).with_camera(orbit(30.0, 20.0, 1.2, WIDE)).with_size(16, 12).unwrap();
                let plain = plain.with_method(Method::default().with_classification(method)).unwrap().with_gradient(kind);
                for floor in [0.0, 1e-300, 1.0, 1e300] {
                    let lit = in_light(&plain, &material(&lights, |m| m.gradient_floor = floor));
                    assert_eq!(render(&volume, &lit).0.sha256(), render(&volume, &plain).0.sha256(), "{value}, {dims:?}, {kind:?}");
                }
            }
        }
    }
}

#[test]
fn light_without_effect_is_the_unlit_picture() {
    let volume = Phantom::SheppLogan.volume(24).unwrap();
    for projection in [PARALLEL, WIDE] {
        let scene = Scene::new(Phantom::SheppLogan.default_transfer(24)).with_size(40, 32).unwrap();
        let scene = scene.with_camera(orbit(30.0, 20.0, 1.2, projection));
        let plain = render(&volume, &scene).0;
        for floor in [0.0, 0.3] {
            let none = material(&[LightSource::Head], |m| {
                (m.ambient, m.diffuse, m.specular, m.gradient_floor) = (1.0, 0.0, 0.0, floor);
            });
            let lit = render(&volume, &in_light(&scene, &none)).0;
            let most = lit.pixels().iter().flatten().zip(plain.pixels().iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(most <= 1e-6, "{most}");
        }
        // A factor of 1 is none, but for the table's own error: it holds optical depths then.
        let whole = scene.transfer().clone().with_gradient_opacity(vec![(0.0, 1.0)]).unwrap();
        let weighted = render(&volume, &scene.clone().with_transfer(whole)).0;
        let most = weighted.pixels().iter().flatten().zip(plain.pixels().iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(most <= 1e-3, "{most}");
        let nothing = scene.transfer().clone().with_gradient_opacity(vec![(0.0, 0.0)]).unwrap();
        assert!(render(&volume, &scene.with_transfer(nothing)).0.pixels().iter().all(|p| *p == [0.0; 4]));
    }
}

/// Finite, premultiplied colours within [0,1] and not above their opacity, the same bytes at every vector level.
fn well_formed(what: &str, volume: &Volume, scene: &Scene) -> Picture {
    let picture = same_at_every_level(volume, scene);
    for p in picture.pixels() {
        let sound = p.iter().all(|c| (0.0..=1.0).contains(c)) && (0..3).all(|c| p[c] <= p[3] + 4e-6);
        assert!(sound, "{what}: {p:?}");
    }
    picture
}

#[test]
fn extreme_lights_leave_pictures_well_formed() {
    let dims = [9, 8, 10];
    let volume = Volume::new(oblique(dims), fill::<f32>(dims, &smooth)).unwrap();
    let (center, radius) = (volume.grid().center(), volume.grid().radius());
    for (i, camera) in super::cameras(volume.grid()).into_iter().enumerate() {
        let scene = Scene::new(telling(0.0, 1.0)).with_camera(camera).with_size(17, 13).unwrap().with_slices(Slicing::Count(40)).unwrap();
        let view = camera.resolve(volume.grid(), 17, 13).unwrap();
        let sources = [
            ("head", LightSource::Head),
            ("along the view", LightSource::Direction(view.forward)),
            ("against the view", LightSource::Direction(-view.forward)),
            ("long direction", LightSource::Direction(DVec3::new(1e300, -1e300, 3e299))),
            ("short direction", LightSource::Direction(DVec3::splat(1e-300))),
            ("at the eye", LightSource::Position(view.eye)),
            ("behind the eye", LightSource::Position(view.eye - view.forward * radius)),
            ("inside", LightSource::Position(center)),
            ("on a voxel", LightSource::Position(volume.grid().index_to_world().transform_point3(DVec3::splat(3.0)))),
            ("very far", LightSource::Position(DVec3::splat(1e300))),
        ];
        for (name, source) in sources {
            for (floor, shininess, two_sided) in [(0.0, 1.0, true), (1e300, 1000.0, false), (0.1, 20.5, true)] {
                let lighting = material(&[source], |m| {
                    (m.gradient_floor, m.shininess, m.two_sided, m.specular) = (floor, shininess, two_sided, 2.0);
                });
                let lit = in_light(&scene, &lighting).with_gradient(KINDS[i % 3]);
                well_formed(&format!("{name}, camera {i}, floor {floor}"), &volume, &lit);
            }
        }
        let bright = material(&[LightSource::Head], |m| {
            (m.ambient, m.diffuse, m.specular, m.emission) = (f64::MAX, 1e300, 1e30, f64::MAX);
        });
        well_formed("brightest", &volume, &in_light(&scene, &bright));
        let dark = material(&[LightSource::Head], |m| (m.ambient, m.diffuse, m.specular, m.emission) = (0.0, 0.0, 0.0, 0.0));
        well_formed("darkest", &volume, &in_light(&scene, &dark));
        well_formed("depth", &volume, &in_light(&scene, &material(&[LightSource::Head], |m| m.shading = Shading::Depth)));
        for points in [
            vec![(0.0, 1.0), (0.0, 0.0)],
            vec![(0.0, 0.0), (1e300, 1.0)],
            vec![(1e-310, 0.0), (2e-310, 1.0)],
            vec![(0.1, 0.0), (0.1 + 1e-15, 1.0)],
        ] {
            let transfer = scene.transfer().clone().with_gradient_opacity(points.clone()).unwrap();
            well_formed(&format!("{points:?}"), &volume, &scene.clone().with_transfer(transfer));
        }
    }
}

#[test]
fn extreme_values_leave_lit_pictures_well_formed() {
    let dims = [9, 8, 10];
    let lights = [LightSource::Head, LightSource::Direction(DVec3::new(1.0, -2.0, 0.5))];
    for (low, high) in [(0.0, 1e-38), (0.0, 1e-44), (-1e38, 1e38), (-3.4e38, 3.4e38), (0.0, 1e30), (1e20, 3e20)] {
        let stored = |p: [f64; 3]| low * (1.0 - smooth(p)) + high * smooth(p);
        let volume = Volume::new(oblique(dims), fill::<f32>(dims, &stored)).unwrap();
        extreme(&format!("f32 {low:e} to {high:e}"), &volume, low, high, &lights);
    }
    for (low, high) in [(0.0, 1e300), (-1e300, 1e300), (0.0, 1e-300), (0.0, 1e30), (1e9, 1e9 + 1.0), (1e300, 1.0001e300)] {
        let stored = |p: [f64; 3]| low * (1.0 - smooth(p)) + high * smooth(p);
        let volume = Volume::new(oblique(dims), fill::<f64>(dims, &stored)).unwrap();
        extreme(&format!("f64 {low:e} to {high:e}"), &volume, low, high, &lights);
    }
    // Holes beside values, and nothing but holes.
    for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let Voxels::F32(mut v) = fill::<f32>(dims, &smooth) else { unreachable!("filled as f32") };
        v.iter_mut().step_by(37).for_each(|x| *x = odd);
        // The box of nodes: in the outer halves of voxels lookups see the second voxel too, and the reference the first alone.
        let volume = Volume::new(oblique(dims).with_convention(BoxConvention::Nodes), Voxels::F32(v)).unwrap();
        extreme(&format!("with {odd}"), &volume, 0.0, 1.0, &lights);
        let volume = Volume::new(oblique(dims), Voxels::F32(vec![odd; 720].into())).unwrap();
        extreme(&format!("nothing but {odd}"), &volume, 0.0, 1.0, &lights);
    }
    // Grids whose units are far from 1, and axes of one voxel.
    for spacing in [1e-30, 1e-6, 1e6, 1e30] {
        let grid = Grid::with_spacing(dims, [spacing, -spacing, 2.0 * spacing]).unwrap();
        extreme(&format!("spacing {spacing:e}"), &Volume::new(grid, fill::<f32>(dims, &smooth)).unwrap(), 0.0, 1.0, &lights);
    }
    for dims in [[1, 8, 8], [8, 1, 8], [8, 8, 1], [1, 1, 9], [1, 1, 1], [2, 2, 2]] {
        extreme(&format!("{dims:?}"), &Volume::new(oblique(dims), fill::<f32>(dims, &smooth)).unwrap(), 0.0, 1.0, &lights);
    }
}

/// The same well-formed picture by every kind of gradient and every way to classify, near the reference where values are.
fn extreme(what: &str, volume: &Volume, low: f64, high: f64, lights: &[LightSource]) {
    for (i, kind) in KINDS.into_iter().enumerate() {
        let camera = orbit(25.0, 35.0, 1.2, if i == 1 { PARALLEL } else { WIDE });
        let scene = Scene::new(telling(low, high)).with_camera(camera).with_size(18, 16).unwrap().with_terminate(0.0).unwrap();
        let scene = scene.with_slices(Slicing::Count(300)).unwrap().with_gradient(kind);
        let lit = in_light(&scene, &material(lights, |m| m.gradient_floor = if i == 2 { 0.1 * (high - low) } else { 0.0 }));
        well_formed(what, volume, &lit);
        let pairs = Method::default().with_classification(Classification::PreIntegrated);
        well_formed(what, volume, &lit.clone().with_method(pairs).unwrap());
        // Gradients below the normal numbers of f32 count as none; and where values differ in their last digits alone, the reference has few
        // digits itself.
        let normal = high - low > 1e-35 || volume.voxels().voxel_type() == VoxelType::F64;
        if normal && high - low > 1e-3 * low.abs().max(high.abs()) {
            // A hole begins and ends at once: an error of the first order.
            let count = if what.starts_with("with ") { 4000 } else { 300 };
            let error = errors(volume, &lit, &[count])[0];
            assert!(error < 4e-3, "{what}, {kind:?}: {error}");
        }
    }
}

#[test]
fn linear_light_and_backgrounds_follow_the_reference() {
    let (volume, scene) = cell();
    let background = Straight { rgb: [0.3, 0.6, 0.1], alpha: 0.8 };
    let colored = vec![Light::new(LightSource::Head, [0.9, 0.5, 0.3]).unwrap()];
    let lighting = smooth_light().with_lights(colored).unwrap();
    let scene = in_light(&scene, &lighting).with_background(background).unwrap().with_linear_light(true).unwrap();
    let found = errors(&volume, &scene, &[32, 256]);
    assert!(found[1] < 2e-4 && found[1] < 0.2 * found[0], "{found:?}");
}
