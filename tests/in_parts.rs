//! Parts of a volume, rendered apart and put together: the picture of the whole.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat3, DVec3};
use slicestack::proxy::{Domain, order};
use slicestack::scene::{
    Algorithm, Blend, Camera, Classification, ClipPlane, Ends, Filter, Fog, FogDistance, FogMode, Light, LightSource, Lighting, Method,
    Order, Placement, Projection, SampleAt, Shading, Slicing, Straight, TransferFunction,
};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{BoxConvention, Grid, Voxels};
use slicestack::{Partial, PartialKind, Picture, Renderer, Scene, Settings, Volume, halo};

/// Random numbers, the same in every run (splitmix64).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn below(&mut self, n: usize) -> usize {
        (self.roll() % n as u64) as usize
    }

    fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.roll() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn color(&mut self) -> [f64; 3] {
        [self.between(0.0, 1.0), self.between(0.0, 1.0), self.between(0.0, 1.0)]
    }
}

/// A volume of waves and noise on an oblique grid, of any type.
fn volume(dice: &mut Dice) -> Volume {
    let dims = [6 + dice.below(30), 5 + dice.below(26), if dice.one_in(20) { 1 } else { 4 + dice.below(24) }];
    let mut tilt = || dice.between(-0.3, 0.3);
    let shear = DMat3::from_cols(DVec3::new(1.0, tilt(), tilt()), DVec3::new(tilt(), 1.0, tilt()), DVec3::new(tilt(), tilt(), 1.0));
    let mut length = || dice.between(0.4, 2.5);
    let mut spacing = DVec3::new(length(), length(), length());
    if dice.one_in(3) {
        spacing.z = -spacing.z;
    }
    let origin = DVec3::new(dice.between(-50.0, 50.0), dice.between(-50.0, 50.0), 3.0);
    let steps = if dice.one_in(4) { DMat3::from_diagonal(spacing) } else { shear * DMat3::from_diagonal(spacing) };
    let mut grid = Grid::new(dims, origin, steps).unwrap();
    if dice.one_in(4) {
        grid = grid.with_convention(BoxConvention::Nodes);
    }
    let waves = [dice.between(0.1, 0.9), dice.between(0.1, 0.9), dice.between(0.1, 0.9)];
    let noise = dice.between(0.0, 0.5);
    let count = dims.iter().product::<usize>();
    // 0 to 1.
    let values: Vec<f64> = (0..count)
        .map(|i| {
            let at = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]].map(|x| x as f64);
            let wave = 0.5 + 0.5 * libm::sin(at[0] * waves[0]) * libm::cos(at[1] * waves[1] + at[2] * waves[2]);
            wave * (1.0 - noise) + noise * dice.between(0.0, 1.0)
        })
        .collect();
    let to = |scale: f64, shift: f64| values.iter().map(move |v| v * scale + shift);
    let voxels = match dice.below(8) {
        0 => Voxels::from(to(255.0, 0.0).map(|v| v as u8).collect::<Vec<u8>>()),
        1 => Voxels::from(to(255.0, -128.0).map(|v| v as i8).collect::<Vec<i8>>()),
        2 => Voxels::from(to(60000.0, 0.0).map(|v| v as u16).collect::<Vec<u16>>()),
        3 => Voxels::from(to(4000.0, -1000.0).map(|v| v as i16).collect::<Vec<i16>>()),
        4 => Voxels::from(to(4e9, 0.0).map(|v| v as u32).collect::<Vec<u32>>()),
        5 => Voxels::from(to(4e9, -2e9).map(|v| v as i32).collect::<Vec<i32>>()),
        6 => Voxels::from(to(7.0, -3.0).collect::<Vec<f64>>()),
        _ => {
            let mut floats: Vec<f32> = to(1.7, 0.1).map(|v| v as f32).collect();
            if dice.one_in(3) {
                (0..3).for_each(|_| floats[dice.below(count)] = f32::NAN);
            }
            Voxels::from(floats)
        }
    };
    let volume = Volume::new(grid, voxels).unwrap();
    if dice.one_in(4) { volume.with_rescale(dice.between(-2.0, -0.5), 10.0).unwrap() } else { volume }
}

/// A scene of `volume`, by any of the methods that parts can render.
fn scene(dice: &mut Dice, volume: &Volume) -> Scene {
    let statistics = volume.statistics();
    let (min, max) = (statistics.min, statistics.max);
    let at = |share: f64| min + share * (max - min);
    let unit = volume.grid().smallest_spacing();
    let (strength, empty) = (if dice.one_in(5) { 0.95 } else { 0.25 }, if dice.one_in(2) { dice.between(0.1, 0.5) } else { -0.1 });
    let colors = vec![(at(0.0), dice.color()), (at(0.4), dice.color()), (at(1.0), dice.color())];
    let opacity = vec![(at(empty), 0.0), (at(0.6), dice.between(0.0, strength)), (at(1.0), dice.between(0.0, strength))];
    let transfer = TransferFunction::new(colors, opacity).unwrap().with_unit(unit).unwrap();
    let mut scene = Scene::new(transfer).with_size(20 + dice.below(50) as u32, 20 + dice.below(40) as u32).unwrap();
    let projection = if dice.one_in(2) {
        Projection::Orthographic { height: None }
    } else {
        Projection::Perspective { fov_y: dice.between(20.0, 90.0) }
    };
    let placement = if dice.one_in(4) {
        // Inside the box.
        let (low, high) = volume.grid().index_bounds();
        let inside = |dice: &mut Dice| {
            let index = DVec3::from_array([0, 1, 2].map(|i| dice.between(low[i], high[i])));
            volume.grid().index_to_world().transform_point3(index)
        };
        Placement::LookAt { eye: inside(dice), target: inside(dice), up: DVec3::new(0.3, 1.0, 0.7) }
    } else {
        Placement::Orbit {
            azimuth: dice.between(-180.0, 180.0),
            elevation: dice.between(-80.0, 80.0),
            roll: dice.between(0.0, 90.0),
            zoom: dice.between(0.7, 2.0),
        }
    };
    scene = scene.with_camera(Camera::new(placement, projection).unwrap());
    let most = if dice.one_in(10) { 400 } else { 90 };
    scene = scene.with_slices(Slicing::Count(1 + dice.below(most) as u64)).unwrap();
    let background = Straight { rgb: dice.color(), alpha: dice.between(0.0, 1.0) };
    scene = scene.with_background(background).unwrap();
    let blend = match dice.below(10) {
        0 => Blend::Mip,
        1 => Blend::Min,
        2 => Blend::Average,
        3 => Blend::Add,
        _ => Blend::Over,
    };
    let mut method = Method::default();
    if matches!(blend, Blend::Over | Blend::Add) {
        match dice.below(6) {
            0 => method = method.with_classification(Classification::Pre),
            1 => method = method.with_classification(Classification::PreIntegrated),
            2 => method = method.with_classification(Classification::SecondOrder),
            3 => method = method.with_sample(SampleAt::End),
            4 => method = method.with_filter(Filter::Nearest),
            _ => {}
        }
    }
    if dice.one_in(6) {
        method = method.with_ends(Ends::Whole);
    }
    scene = scene.with_method(method).unwrap().with_blend(blend).unwrap();
    if dice.one_in(4) {
        scene = scene.with_order(Order::BackToFront);
    }
    if blend == Blend::Over && dice.one_in(3) {
        let fog = Fog::new(FogMode::Exp { density: dice.between(0.001, 0.05) }, dice.color()).unwrap();
        scene = scene.with_fog(Some(if dice.one_in(2) { fog.with_distance(FogDistance::Radial) } else { fog }));
    }
    if dice.one_in(3) {
        let normal = DVec3::new(dice.between(-1.0, 1.0), dice.between(-1.0, 1.0), 0.3);
        let plane = ClipPlane::new(normal, normal.normalize().dot(volume.grid().center()) + dice.between(-2.0, 2.0)).unwrap();
        scene = scene.with_clip_planes(vec![plane]).unwrap();
    }
    if blend == Blend::Over && dice.one_in(2) {
        let mut lighting = Lighting::default();
        lighting.shading = if dice.one_in(5) { Shading::Depth } else { Shading::BlinnPhong };
        lighting.specular = dice.between(0.0, 1.0);
        lighting.two_sided = dice.one_in(2);
        if dice.one_in(2) {
            let place = volume.grid().center() + DVec3::new(dice.between(-40.0, 40.0), 30.0, dice.between(-40.0, 40.0));
            let other = Light::new(LightSource::Position(place), dice.color()).unwrap();
            lighting = lighting.with_lights(vec![other, Light::default()]).unwrap();
        }
        let kinds = [slicestack::scene::Gradient::Central, slicestack::scene::Gradient::Analytic, slicestack::scene::Gradient::Sobel];
        scene = scene.with_gradient(kinds[dice.below(3)]);
        scene = scene.clone().with_lighting(Some(lighting)).unwrap_or(scene);
    }
    scene
}

/// Cuts along each axis, uneven ones: into up to 4 parts.
fn cuts(dice: &mut Dice, dims: [usize; 3], most: usize) -> [Vec<usize>; 3] {
    dims.map(|n| {
        let mut cuts: Vec<usize> = (0..dice.below(most)).filter(|_| n > 2).map(|_| 1 + dice.below(n - 2)).collect();
        cuts.sort_unstable();
        cuts.dedup();
        cuts
    })
}

fn domains(volume: &Volume, scene: &Scene, cuts: &[Vec<usize>; 3]) -> Vec<Domain> {
    let voxels = volume.voxels();
    let values = || (0..voxels.len()).map(|i| voxels.get(i)).filter(|v| v.is_finite());
    let range = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let holes = voxels.len() - values().count();
    let halo = halo(scene, volume.grid()).unwrap();
    Domain::tiles(volume.grid(), cuts, halo, range, holes).unwrap()
}

/// What the parts leave, nearest first.
fn shares(volume: &Volume, scene: &Scene, cuts: &[Vec<usize>; 3]) -> Vec<Partial> {
    let domains = domains(volume, scene, cuts);
    let (width, height) = scene.size();
    let view = scene.camera().resolve(volume.grid(), width, height).unwrap();
    let part = |domain: &Domain| Renderer::new(domain.window(volume).unwrap(), Settings::default()).render_part(scene, domain).unwrap();
    order(&domains, &view).into_iter().map(|at| part(&domains[at])).collect()
}

/// In a tree of neighbours.
fn composed(mut partials: Vec<Partial>) -> Partial {
    while partials.len() > 1 {
        partials = partials.chunks(2).map(|pair| if let [a, b] = pair { a.over(b).unwrap() } else { pair[0].clone() }).collect();
    }
    partials.remove(0)
}

fn farthest(a: &Picture, b: &Picture) -> f32 {
    a.pixels().iter().flatten().zip(b.pixels().iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn parts_make_up_the_picture_of_the_whole_in_random_scenes() {
    let mut worst = [(0.0f32, 0); 5];
    let (mut most_parts, mut shown) = (0, 0);
    for case in 0..260 {
        let mut dice = Dice(case);
        let volume = volume(&mut dice);
        let scene = scene(&mut dice, &volume);
        let cuts = cuts(&mut dice, volume.grid().dims(), if case % 10 == 0 { 1 } else { 5 });
        let want = Renderer::new(&volume, Settings::default()).render(&scene.in_parts().unwrap()).unwrap().0;
        let partials = shares(&volume, &scene, &cuts);
        most_parts = most_parts.max(partials.len());
        let one = partials.len() == 1;
        let whole = composed(partials);
        let got = whole.finish(&scene).unwrap();
        let far = farthest(&got, &want);
        shown += usize::from(want.pixels().iter().any(|p| *p != want.pixels()[0]));
        let kind = whole.kind();
        let at = &mut worst[[PartialKind::Over, PartialKind::Largest, PartialKind::Smallest, PartialKind::Mean, PartialKind::Sum]
            .iter()
            .position(|k| *k == kind)
            .unwrap()];
        if far > at.0 {
            *at = (far, case);
        }
        // Comparisons do not round; a single part sums as the whole does.
        let exact = one || matches!(kind, PartialKind::Largest | PartialKind::Smallest);
        let bound = if exact { 1.2e-7 } else { 2e-6 };
        assert!(far <= bound, "case {case}: {far:e} apart, {kind:?}, {cuts:?}\n{:?}\n{scene:?}", volume.grid());
    }
    println!("largest differences: over, largest, smallest, mean, sum: {worst:?}");
    assert!(most_parts > 40 && shown > 200, "{most_parts} parts, {shown} pictures show something");
}

#[test]
fn fragments_add_up_to_those_of_the_whole() {
    let mut compared = 0;
    for case in 0..60 {
        let mut dice = Dice(1000 + case);
        let volume = volume(&mut dice);
        let scene = scene(&mut dice, &volume);
        // A projection passes over nothing.
        if matches!(scene.blend(), Blend::Over | Blend::Add) {
            continue;
        }
        let cuts = cuts(&mut dice, volume.grid().dims(), 5);
        let (_, stats) = Renderer::new(&volume, Settings::default()).render(&scene.in_parts().unwrap()).unwrap();
        let whole = composed(shares(&volume, &scene, &cuts));
        // The largest value of the whole may pass over bricks that show nothing new.
        let all = stats.tally.fragments + stats.tally.corners;
        assert_eq!(whole.fragments(), all, "case {case}");
        compared += 1;
    }
    assert!(compared > 10, "{compared}");
}

#[test]
fn one_part_that_is_the_whole_gives_the_very_same_bits() {
    for case in [3, 5, 8, 13, 21] {
        let mut dice = Dice(case);
        let volume = volume(&mut dice);
        let scene = scene(&mut dice, &volume);
        if scene.blend() != Blend::Over {
            continue;
        }
        let part = composed(shares(&volume, &scene, &Default::default()));
        let whole = Renderer::new(&volume, Settings::default()).render_layer(&scene.in_parts().unwrap()).unwrap();
        assert_eq!(part.rectangle(), whole.rectangle());
        let bits = |pixels: &[[f32; 4]]| pixels.iter().flatten().map(|c| c.to_bits()).collect::<Vec<u32>>();
        assert_eq!(bits(part.pixels()), bits(whole.pixels()), "case {case}");
    }
}

#[test]
fn partial_pictures_travel_as_bytes() {
    for case in 0..12 {
        let mut dice = Dice(500 + case);
        let volume = volume(&mut dice);
        let scene = scene(&mut dice, &volume);
        let partial = composed(shares(&volume, &scene, &cuts(&mut dice, volume.grid().dims(), 2)));
        let bytes = partial.to_bytes();
        assert_eq!(Partial::from_bytes(&bytes).unwrap(), partial);
        for bad in [&bytes[..bytes.len() - 1], &bytes[..20], &bytes[1..], &[bytes.as_slice(), &[0]].concat()] {
            let said = Partial::from_bytes(bad).unwrap_err().to_string();
            assert!(said.starts_with("partial picture of") && !said.contains('\n'), "{said}");
        }
        let mut lying = bytes.clone();
        lying[32..36].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(Partial::from_bytes(&lying).is_err());
    }
}

#[test]
fn what_cannot_be_shared_out_is_refused() {
    let volume = Phantom::SheppLogan.volume(16).unwrap();
    let plain = || Scene::new(Phantom::SheppLogan.default_transfer(16)).with_slices(Slicing::Count(40)).unwrap().with_size(20, 20).unwrap();
    let domain = Domain::with_halo(volume.grid().clone(), [0..7, 0..15, 0..15], [1; 3], (0.0, 1.0), 0).unwrap();
    let mut renderer = Renderer::new(domain.window(&volume).unwrap(), Settings::default());
    renderer.render_part(&plain(), &domain).unwrap();
    let refused = |renderer: &mut Renderer, scene: Scene, words: &str| {
        let said = renderer.render_part(&scene, &domain).unwrap_err().to_string();
        assert!(said.contains(words) && !said.contains('\n'), "{said}");
    };
    let blend = |blend: Blend| plain().with_blend(blend).unwrap();
    for (scene, words) in [
        (plain().with_method(Method::default().with_filter(Filter::CUBIC)).unwrap(), "render filter cubic: a spline"),
        (blend(Blend::Lmip { threshold: 0.2 }), "render blend lmip"),
        (blend(Blend::AttenuatedMip { attenuation: 0.2 }), "render blend attenuated-mip"),
        (blend(Blend::Iso { level: 0.2 }), "render blend iso"),
        (plain().with_order(Order::BackToFront).with_blend(Blend::Under).unwrap(), "render blend under"),
        (plain().with_algorithm(Algorithm::Rays).unwrap(), "the algorithm rays makes whole pictures"),
        (plain().with_slices(Slicing::Tolerance(0.01)).unwrap(), "slices tolerance 0.01"),
        (plain().with_lighting(Some(Lighting::default())).unwrap(), "domain: voxels 0..9 along x: this scene takes voxels 0..10"),
    ] {
        refused(&mut renderer, scene, words);
    }
    let mut other = Renderer::new(Phantom::SheppLogan.volume(12).unwrap(), Settings::default());
    refused(&mut other, plain(), "domain: voxels [9, 16, 16] along x, y, z: the volume has [12, 12, 12]");
    let stretched = Grid::with_spacing([9, 16, 16], [2.0; 3]).unwrap();
    let mut other = Renderer::new(domain.window(&volume).unwrap().with_grid(stretched).unwrap(), Settings::default());
    refused(&mut other, plain(), "domain: the volume's axes");

    // What does not belong together does not combine.
    let a = renderer.render_part(&plain(), &domain).unwrap();
    let b = renderer.render_part(&blend(Blend::Mip), &domain).unwrap();
    assert!(a.over(&b).unwrap_err().to_string().contains("kind Over over one of kind Largest"));
    assert!(b.finish(&plain()).unwrap_err().to_string().contains("another blend"));
    let c = renderer.render_part(&plain().with_size(21, 20).unwrap(), &domain).unwrap();
    assert!(a.over(&c).unwrap_err().to_string().contains("20 x 20 pixels over one of 21 x 20"));
}
