//! Small scenes that go through every stage, shared by tests of determinism and of golden pictures.

mod colors;
mod rays;

use glam::{DMat3, DMat4, DQuat, DVec3, DVec4};
use slicestack::scene::{
    Accumulation, Algorithm, AlphaTest, Arithmetic, Blend, BlendFunction, Camera, Classification, ClipPlane, Compare, Connectivity, Ends,
    Environment, Equation, Factor, Filter, FocusRegion, FocusShape, Fog, FogDistance, FogEvaluation, FogMode, FogWeighting, Gradient, Hit,
    LevelSurface, Light, LightSource, Lighting, Method, OpenGl, Order, Placement, Projection, Region, SampleAt, Scissor, SegmentEffect,
    SegmentStyle, Shading, Shape, SlabForm, Slicing, Straight, Target, TemplatePlane, Transfer2d, TransferFunction, Wrap, label_color,
};
use slicestack::volume::phantom::Phantom;
use slicestack::volume::{BoxConvention, Grid, VoxelType, Voxels};
use slicestack::{Limits, Scene, Volume};

/// A volume and a scene of it.
#[derive(Clone)]
pub(crate) struct Sample {
    pub(crate) name: &'static str,
    pub(crate) volume: Volume,
    pub(crate) scene: Scene,
}

fn cloud(size: usize, kind: VoxelType) -> Volume {
    Phantom::Cloud.volume_as(size, kind, &Limits::default()).unwrap()
}

fn head() -> Volume {
    Phantom::SheppLogan.volume(24).unwrap()
}

fn haze() -> TransferFunction {
    TransferFunction::new(
        vec![(0.0, [0.2, 0.4, 1.0]), (0.3, [1.0, 0.8, 0.2]), (0.7, [1.0, 0.2, 0.1])],
        vec![(0.05, 0.0), (0.3, 0.08), (0.5, 0.04), (0.8, 0.5)],
    )
    .unwrap()
}

/// For clouds: thin, so that their inside shows.
fn soft() -> TransferFunction {
    TransferFunction::new(
        vec![(0.0, [0.1, 0.2, 1.0]), (0.3, [0.2, 0.8, 0.9]), (0.6, [1.0, 0.8, 0.2]), (1.0, [1.0, 0.3, 0.1])],
        vec![(0.02, 0.0), (0.4, 0.05), (0.7, 0.02), (1.0, 0.2)],
    )
    .unwrap()
}

/// For projections and tiny boxes: every value shows.
fn strong() -> TransferFunction {
    TransferFunction::new(vec![(0.0, [0.1, 0.3, 1.0]), (0.3, [0.9, 0.9, 0.3]), (1.0, [1.0, 0.4, 0.1])], vec![(0.0, 0.1), (0.4, 0.8)])
        .unwrap()
}

fn scene(size: (u32, u32), slices: u64) -> Scene {
    let back = Straight { rgb: [0.1, 0.12, 0.2], alpha: 1.0 };
    let scene = Scene::new(haze()).with_size(size.0, size.1).unwrap().with_slices(Slicing::Count(slices)).unwrap();
    scene.with_background(back).unwrap()
}

fn looked(scene: Scene, azimuth: f64, elevation: f64, roll: f64, zoom: f64, projection: Projection) -> Scene {
    scene.with_camera(Camera::new(Placement::Orbit { azimuth, elevation, roll, zoom }, projection).unwrap())
}

const PARALLEL: Projection = Projection::Orthographic { height: None };
const WIDE: Projection = Projection::Perspective { fov_y: 60.0 };

/// Voxels 0, 1, 2 ... of a tiny box, as f32 in [0,1].
fn counted(dims: [usize; 3]) -> Volume {
    let n: usize = dims.iter().product();
    let values = (0..n).map(|i| (i * 7 % n) as f32 / n.max(2) as f32 + 0.25 / n as f32).collect();
    Volume::new(Grid::with_spacing(dims, [1.0; 3]).unwrap(), Voxels::F32(values)).unwrap()
}

fn on_oblique_grid(volume: Volume) -> Volume {
    let turn = DMat3::from_quat(DQuat::from_xyzw(0.5, 0.1, -0.3, 0.806_225_774_829_855));
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.3, -1.4, 0.0), DVec3::new(0.0, 0.4, 0.7));
    let grid = Grid::new(volume.grid().dims(), DVec3::new(5.0, -3.0, 100.0), turn * shear).unwrap();
    volume.with_grid(grid).unwrap()
}

fn foggy(scene: Scene, mode: FogMode, distance: FogDistance, weighting: FogWeighting) -> Scene {
    scene.with_fog(Some(Fog::new(mode, [0.7, 0.75, 0.8]).unwrap().with_distance(distance).with_weighting(weighting)))
}

fn plane(volume: &Volume, normal: DVec3, at: f64) -> ClipPlane {
    let n = normal.normalize();
    ClipPlane::new(n, n.dot(volume.grid().center()) + at * volume.grid().radius()).unwrap()
}

/// A look-at camera: eye and target in radii of the box from its centre.
fn from(volume: &Volume, scene: Scene, eye: DVec3, target: DVec3, projection: Projection) -> Scene {
    let (c, r) = (volume.grid().center(), volume.grid().radius());
    scene.with_camera(Camera::new(Placement::LookAt { eye: c + eye * r, target: c + target * r, up: DVec3::Z }, projection).unwrap())
}

/// Labels 0 to 4 on `grid`: four sectors of the ball about its centre.
pub(crate) fn sectors(grid: &Grid) -> Volume {
    let [nx, ny, nz] = grid.dims();
    let labels = (0..nx * ny * nz).map(|i| {
        let at = [(i % nx, nx), (i / nx % ny, ny), (i / (nx * ny), nz)].map(|(i, n)| (2 * i + 1) as f64 / n as f64 - 1.0);
        let [x, y, z] = at;
        if x * x + y * y + z * z > 0.7 { 0 } else { 1 + u8::from(x > 0.0) + 2 * u8::from(y + z > 0.0) }
    });
    Volume::new(grid.clone(), labels.collect::<Vec<_>>().into()).unwrap()
}

/// A volume with [`sectors`] beside it.
fn labelled(volume: Volume) -> Volume {
    let labels = sectors(volume.grid());
    volume.with_labels(&labels).unwrap()
}

/// The sectors hidden, tinted, replaced.
fn styles() -> Vec<SegmentStyle> {
    let tint = SegmentEffect::Tint { color: [0.2, 1.0, 0.4], strength: 0.8 };
    let replace = SegmentEffect::Replace { color: [0.9, 0.3, 0.9], opacity: 0.06 };
    [(1, SegmentEffect::Hide), (2, tint), (3, replace)].map(|(label, effect)| SegmentStyle::new(label, effect).unwrap()).to_vec()
}

/// A sphere and a box across each other.
fn focus(volume: &Volume) -> Vec<FocusRegion> {
    let (c, r) = (volume.grid().center(), volume.grid().radius());
    let sphere = FocusRegion::new(FocusShape::Sphere { radius: 0.35 * r }, c - 0.1 * r, strong().with_unit(0.2 * r).unwrap()).unwrap();
    let size = [0.9, 0.5, 0.7].map(|x| x * r);
    vec![sphere, FocusRegion::new(FocusShape::Box { size }, c + DVec3::X * 0.3 * r, soft()).unwrap()]
}

/// Every scene.
pub(crate) fn samples() -> Vec<Sample> {
    let mut list = Vec::new();
    let mut add = |name, volume: Volume, scene: Scene| list.push(Sample { name, volume, scene });
    let s = || scene((48, 40), 50);

    let shown = |s: Scene| s.with_transfer(strong());
    let thin = |s: Scene| s.with_transfer(soft());
    // Every type of voxel, cameras all around.
    for (i, kind) in VoxelType::ALL.into_iter().enumerate() {
        let view = if i % 2 == 0 { PARALLEL } else { WIDE };
        add(
            ["u8", "i8", "u16", "i16", "u32", "i32", "f32", "f64"][i],
            cloud(20, kind),
            thin(looked(s(), 45.0 * i as f64, 20.0, 0.0, 1.2, view)),
        );
    }
    // Every blend.
    add("back-to-front", head(), looked(s(), 40.0, 25.0, 0.0, 1.3, WIDE).with_order(Order::BackToFront));
    add("to-the-end", head(), looked(s(), -20.0, 5.0, 0.0, 1.3, PARALLEL).with_terminate(0.0).unwrap());
    add("mip", head(), shown(looked(s(), 10.0, 30.0, 0.0, 1.3, PARALLEL).with_blend(Blend::Mip).unwrap()));
    add(
        "min",
        Phantom::DistanceField.volume(20).unwrap(),
        looked(s(), 20.0, 30.0, 0.0, 1.3, WIDE).with_blend(Blend::Min).unwrap().with_transfer(Phantom::DistanceField.default_transfer(20)),
    );
    add("average", head(), shown(looked(s(), 60.0, 10.0, 0.0, 1.3, WIDE).with_blend(Blend::Average).unwrap()));
    add("add", head(), looked(s(), 80.0, 10.0, 0.0, 1.3, PARALLEL).with_blend(Blend::Add).unwrap());
    let added = || looked(s(), 80.0, 10.0, 0.0, 1.3, PARALLEL).with_blend(Blend::Add).unwrap();
    add("add-windowed", head(), added().with_window(Some([1.2, 2.0])).unwrap());
    let behind = || looked(s(), 40.0, 25.0, 0.0, 1.3, WIDE).with_blend(Blend::Under).unwrap().with_order(Order::BackToFront);
    add("under-back-to-front", head(), behind());
    let faded = || looked(s(), 10.0, 30.0, 0.0, 1.3, PARALLEL).with_blend(Blend::AttenuatedMip { attenuation: 6.0 }).unwrap();
    add("attenuated-mip", head(), shown(faded()));
    add(
        "lmip",
        cloud(20, VoxelType::U16),
        shown(looked(s(), 80.0, 40.0, 0.0, 1.3, PARALLEL).with_blend(Blend::Lmip { threshold: 0.3 }).unwrap()),
    );
    add(
        "iso",
        Phantom::MarschnerLobb.volume(32).unwrap(),
        looked(s(), 30.0, 40.0, 0.0, 1.2, WIDE).with_blend(Blend::Iso { level: 0.5 }).unwrap(),
    );
    // Fog.
    let (alpha, literal) = (FogWeighting::Alpha, FogWeighting::Literal);
    let fog_view = || looked(s(), 30.0, 20.0, 0.0, 1.2, WIDE);
    add("fog-linear", head(), foggy(fog_view(), FogMode::Linear { start: 25.0, end: 55.0 }, FogDistance::Planar, alpha));
    add("fog-exp", head(), foggy(fog_view(), FogMode::Exp { density: 0.02 }, FogDistance::Planar, alpha));
    add(
        "fog-exp2-radial",
        head(),
        foggy(fog_view(), FogMode::Exp2 { density: 0.025 }, FogDistance::Radial, alpha).with_fogged_background(true),
    );
    add(
        "fog-linear-radial",
        head(),
        foggy(looked(s(), 0.0, 10.0, 0.0, 1.2, PARALLEL), FogMode::Linear { start: 38.0, end: 46.0 }, FogDistance::Radial, alpha),
    );
    add(
        "fog-exp-radial",
        head(),
        foggy(fog_view(), FogMode::Exp { density: 0.03 }, FogDistance::Radial, alpha).with_order(Order::BackToFront),
    );
    add("fog-literal", head(), foggy(fog_view(), FogMode::Exp { density: 0.0005 }, FogDistance::Planar, literal));
    add("fog-step", head(), foggy(fog_view(), FogMode::Linear { start: 41.0, end: 41.0 }, FogDistance::Planar, alpha));
    // Clip planes.
    let v = head();
    let planes = vec![plane(&v, DVec3::new(0.2, 1.0, 0.3), 0.0)];
    add("clip-one", head(), looked(s(), 20.0, 20.0, 0.0, 1.3, PARALLEL).with_clip_planes(planes).unwrap());
    let planes = [DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 1.0), -DVec3::X, -DVec3::Y, -DVec3::Z].map(|n| plane(&v, n, -0.35)).to_vec();
    add(
        "clip-six",
        cloud(20, VoxelType::U8),
        thin({
            let c = cloud(20, VoxelType::U8);
            let planes = planes.iter().map(|p| plane(&c, p.normal(), -0.3)).collect();
            looked(s(), 25.0, 30.0, 0.0, 1.3, WIDE).with_clip_planes(planes).unwrap()
        }),
    );
    // Cameras.
    add("axis", head(), looked(s(), 0.0, 0.0, 0.0, 1.0, PARALLEL));
    add(
        "corners",
        cloud(16, VoxelType::U8),
        thin(from(&v, scene((49, 49), 3), DVec3::ONE, DVec3::ZERO, Projection::Orthographic { height: Some(30.0) })),
    );
    let c = cloud(32, VoxelType::U8);
    add(
        "inside",
        c.clone(),
        thin(from(&c, s(), DVec3::new(-0.05, -0.3, 0.0), DVec3::new(0.3, 1.0, 0.1), Projection::Perspective { fov_y: 90.0 })),
    );
    add("near-plane", head(), {
        let camera = Camera::new(Placement::Orbit { azimuth: 10.0, elevation: 60.0, roll: 0.0, zoom: 1.2 }, PARALLEL).unwrap();
        s().with_camera(camera.with_near(1.9 * v.grid().radius()).unwrap())
    });
    add("rolled", head(), looked(s(), 10.0, 20.0, 33.0, 1.5, Projection::Perspective { fov_y: 20.0 }));
    // Sizes.
    add("1x1", head(), looked(scene((1, 1), 50), 30.0, 20.0, 0.0, 1.0, PARALLEL));
    add("63x65", head(), looked(scene((63, 65), 64), 30.0, 20.0, 0.0, 1.2, PARALLEL));
    add("1x500", head(), looked(scene((1, 500), 30), 30.0, 20.0, 0.0, 1.2, Projection::Orthographic { height: Some(36.0) }));
    add("500x3", head(), looked(scene((500, 3), 30), 30.0, 20.0, 0.0, 30.0, PARALLEL));
    add("one-slice", head(), looked(scene((32, 32), 1), 30.0, 20.0, 0.0, 1.2, PARALLEL));
    // Volumes.
    add("single-voxel", counted([1, 1, 1]), shown(looked(scene((32, 32), 16), 30.0, 20.0, 0.0, 1.2, WIDE)));
    add("2x3x5", counted([2, 3, 5]), shown(looked(scene((32, 32), 40), 30.0, 20.0, 0.0, 1.2, PARALLEL)));
    add("1x1x9", counted([1, 1, 9]), shown(looked(scene((32, 32), 40), 60.0, 20.0, 0.0, 1.2, WIDE)));
    add(
        "nodes",
        counted([4, 4, 4]).with_convention(BoxConvention::Nodes),
        shown(looked(scene((32, 32), 40), 30.0, 20.0, 0.0, 1.2, PARALLEL)),
    );
    add("oblique", on_oblique_grid(head()), looked(s(), 50.0, 10.0, 0.0, 1.2, PARALLEL));
    add(
        "negative-slope",
        cloud(16, VoxelType::I16).with_rescale(-0.5 / 32768.0, 0.5).unwrap(),
        thin(looked(s(), 30.0, 20.0, 0.0, 1.2, PARALLEL)),
    );
    add(
        "holes",
        {
            let Voxels::F32(mut v) = head().voxels().clone() else { unreachable!("the head is f32") };
            v.iter_mut().step_by(37).for_each(|x| *x = f32::NAN);
            Volume::new(head().grid().clone(), Voxels::F32(v)).unwrap()
        },
        looked(s(), 30.0, 20.0, 0.0, 1.3, PARALLEL),
    );
    add(
        "huge-numbers",
        {
            let Voxels::F32(v) = head().voxels().clone() else { unreachable!("the head is f32") };
            Volume::new(head().grid().clone(), Voxels::F64(v.iter().map(|&x| f64::from(x) * 1e300).collect()))
                .unwrap()
                .with_rescale(1e-300, 0.0)
                .unwrap()
        },
        looked(s(), 30.0, 20.0, 0.0, 1.3, WIDE),
    );
    // Ways to integrate.
    let by = |scene: Scene, method: Method| scene.with_method(method).unwrap();
    let base = Method::default();
    let pairs = base.with_classification(Classification::PreIntegrated);
    let second = base.with_classification(Classification::SecondOrder);
    let few = || scene((48, 40), 20);
    let near = |s: Scene| looked(s, 30.0, 20.0, 0.0, 1.3, WIDE);
    add("pre-integrated", head(), by(looked(few(), 40.0, 25.0, 0.0, 1.3, PARALLEL), pairs));
    add("pre-integrated-fog", head(), by(foggy(near(few()), FogMode::Exp { density: 0.02 }, FogDistance::Planar, alpha), pairs));
    add("pre-integrated-fog-radial", head(), by(foggy(near(few()), FogMode::Exp2 { density: 0.02 }, FogDistance::Radial, alpha), second));
    add("pre-integrated-add", head(), by(near(few()).with_blend(Blend::Add).unwrap(), pairs));
    add("pre-integrated-whole-ends", cloud(20, VoxelType::U8), thin(by(near(few()), second.with_ends(Ends::Whole))));
    add("second-order", cloud(20, VoxelType::I16), thin(by(looked(few(), 70.0, 30.0, 0.0, 1.2, PARALLEL), second)));
    add("second-order-clip", head(), {
        let planes = vec![plane(&v, DVec3::new(0.2, 1.0, 0.3), 0.0), plane(&v, DVec3::new(1.0, 0.1, -0.3), -0.2)];
        by(looked(few(), 20.0, 20.0, 0.0, 1.3, PARALLEL).with_clip_planes(planes).unwrap(), second)
    });
    add(
        "second-order-holes",
        {
            let Voxels::F32(mut v) = head().voxels().clone() else { unreachable!("the head is f32") };
            v.iter_mut().step_by(37).for_each(|x| *x = f32::NAN);
            Volume::new(head().grid().clone(), Voxels::F32(v)).unwrap()
        },
        by(looked(few(), 30.0, 20.0, 0.0, 1.3, PARALLEL), second),
    );
    add("second-order-tiny", counted([1, 1, 9]), shown(by(looked(scene((32, 32), 9), 60.0, 20.0, 0.0, 1.2, WIDE), second)));
    add("pre-classified", head(), by(near(s()), base.with_classification(Classification::Pre)));
    add("pre-classified-16", cloud(20, VoxelType::U16), thin(by(near(s()), base.with_classification(Classification::Pre))));
    add("nearest", cloud(20, VoxelType::U8), thin(by(looked(s(), 30.0, 20.0, 0.0, 1.3, PARALLEL), base.with_filter(Filter::Nearest))));
    add("nearest-pairs", cloud(20, VoxelType::I32), thin(by(near(few()), pairs.with_filter(Filter::Nearest))));
    add("cubic", cloud(20, VoxelType::U8), thin(by(near(s()), base.with_filter(Filter::CUBIC))));
    add(
        "cubic-smooth-holes",
        {
            let Voxels::F32(mut v) = head().voxels().clone() else { unreachable!("the head is f32") };
            v.iter_mut().step_by(337).for_each(|x| *x = f32::NAN);
            Volume::new(head().grid().clone(), Voxels::F32(v)).unwrap()
        },
        by(looked(few(), 30.0, 20.0, 0.0, 1.3, PARALLEL), second.with_filter(Filter::Cubic { prefilter: false })),
    );
    add("linear-light", head(), near(s()).with_linear_light(true).unwrap());
    add("riemann", head(), by(near(s()), base.with_slab(SlabForm::Riemann)));
    add("riemann-coarse", head(), by(near(scene((48, 40), 3)).with_opacity_unit(0.2).unwrap(), base.with_slab(SlabForm::Riemann)));
    add("sampled-at-the-end", head(), by(near(few()), base.with_sample(SampleAt::End)));
    add("whole-ends", cloud(20, VoxelType::U8), thin(by(near(few()), base.with_ends(Ends::Whole))));
    add("eight-bits", cloud(20, VoxelType::U8), thin(by(near(s()), base.with_target(Target::Unorm8))));
    add(
        "eight-bits-back-to-front",
        cloud(20, VoxelType::U8),
        thin(by(near(s()).with_order(Order::BackToFront), base.with_target(Target::Unorm8))),
    );
    let merged = base.with_merge(true);
    add("merged", head(), by(near(s()), merged));
    let fog = |s: Scene| foggy(s, FogMode::Exp { density: 0.02 }, FogDistance::Planar, FogWeighting::Alpha);
    add("merged-fog", cloud(20, VoxelType::U16), fog(thin(by(near(scene((48, 40), 200)), merged))));
    // Two plateaus: nine become one on either, in runs of three slices and of nine, and fewer between them.
    let plateaus = TransferFunction::new(vec![(0.4, [0.3, 0.6, 1.0]), (0.5, [1.0, 0.7, 0.2])], vec![(0.4, 0.04), (0.5, 0.4)])
        .expect("a transfer function");
    let stepped = |count| by(looked(scene((48, 40), count), 30.0, 20.0, 0.0, 3.0, PARALLEL).with_transfer(plateaus.clone()), merged);
    add("merged-nines", cloud(20, VoxelType::U8), stepped(90));
    add("merged-runs-of-nines", cloud(20, VoxelType::U8), stepped(400));
    add("merged-thick", head(), by(looked(few(), 30.0, 20.0, 0.0, 1.3, PARALLEL), merged));
    let kept = base.with_accumulation(Accumulation::Compensated);
    add("compensated", head(), by(near(s()), kept));
    add("compensated-back-to-front", head(), by(near(s()).with_order(Order::BackToFront), kept));
    add("compensated-to-the-end", head(), by(looked(s(), 30.0, 20.0, 0.0, 1.3, PARALLEL).with_terminate(0.0).unwrap(), kept));
    add("many-slices", cloud(16, VoxelType::U8), thin(looked(scene((12, 10), 2500), 30.0, 20.0, 0.0, 1.3, PARALLEL)));
    add("extrapolated", head(), by(near(few()), base.with_extrapolate(true)));
    add("extrapolated-pairs", head(), by(near(few()), pairs.with_extrapolate(true)));
    add("transparent-background", head(), looked(s(), 30.0, 50.0, 0.0, 1.3, WIDE).with_background(Straight::default()).unwrap());
    // Level surfaces.
    let surface = |level, color, opacity| LevelSurface::new(level, color, opacity).unwrap();
    let shells = vec![
        surface(0.55, Some([0.9, 0.85, 0.7]), 1.0),
        surface(0.2, Some([0.9, 0.4, 0.3]), 0.4),
        surface(0.35, Some([0.3, 0.6, 0.9]), 0.5),
    ];
    let lit_by = |s: Scene, gradient| s.with_lighting(Some(Lighting::default())).unwrap().with_gradient(gradient);
    let through = |s: Scene| s.with_levels(shells.clone()).unwrap();
    add("surfaces", cloud(20, VoxelType::U16), through(looked(s(), 30.0, 20.0, 0.0, 1.3, WIDE)));
    add("surfaces-lit", cloud(20, VoxelType::F32), lit_by(through(looked(s(), 80.0, -20.0, 0.0, 1.3, PARALLEL)), Gradient::Sobel));
    add("surfaces-first-sample", cloud(20, VoxelType::U8), through(near(s())).with_hit(Hit::FirstSample));
    add("iso-lit", Phantom::MarschnerLobb.volume(32).unwrap(), {
        lit_by(looked(s(), 30.0, 40.0, 0.0, 1.2, WIDE).with_blend(Blend::Iso { level: 0.5 }).unwrap(), Gradient::Analytic)
    });
    opengl(&mut list);
    lit(&mut list);
    cast(&mut list);
    rays::rays(&mut list);
    colors::samples(&mut list);
    by_place(&mut list);
    list
}

/// The algorithms that go ray by ray.
fn cast(list: &mut Vec<Sample>) {
    let mut add = |name, volume: Volume, scene: Scene, algorithm| {
        list.push(Sample { name, volume, scene: scene.with_algorithm(algorithm).unwrap() });
    };
    let s = || scene((48, 40), 40);
    let (parallel, wide) = (|| looked(s(), 30.0, 20.0, 0.0, 1.3, PARALLEL), || looked(s(), 30.0, 20.0, 0.0, 1.3, WIDE));
    let along = |axis, backwards| s().with_camera(Camera::new(Placement::Along { axis, backwards }, PARALLEL).unwrap());
    let nearest = |s: Scene| s.with_method(Method::default().with_filter(Filter::Nearest)).unwrap().with_transfer(soft());
    let light = || Some(Lighting::default());
    let fog = |s| foggy(s, FogMode::Exp2 { density: 0.02 }, FogDistance::Radial, FogWeighting::Alpha);
    add("rays", head(), fog(wide()).with_lighting(light()).unwrap(), Algorithm::Rays);
    add("rays-parallel-16", cloud(20, VoxelType::U16), parallel().with_transfer(soft()), Algorithm::Rays);
    add("rays-mip", head(), wide().with_transfer(strong()).with_blend(Blend::Mip).unwrap(), Algorithm::Rays);
    let surfaces =
        vec![LevelSurface::new(0.4, Some([1.0, 0.3, 0.2]), 0.4).unwrap(), LevelSurface::new(0.6, Some([0.2, 0.4, 1.0]), 1.0).unwrap()];
    add(
        "rays-surfaces",
        Phantom::MarschnerLobb.volume(32).unwrap(),
        wide().with_levels(surfaces).unwrap().with_lighting(light()).unwrap(),
        Algorithm::Rays,
    );
    add("traversal-6", cloud(20, VoxelType::U8), nearest(wide()), Algorithm::Traversal(Connectivity::Six));
    add("traversal-18", head(), parallel(), Algorithm::Traversal(Connectivity::Eighteen));
    add("traversal-26", cloud(20, VoxelType::I8), nearest(parallel()), Algorithm::Traversal(Connectivity::TwentySix));
    add("template", cloud(20, VoxelType::U8), nearest(parallel()), Algorithm::Template(TemplatePlane::Base));
    add("template-image-plane", cloud(20, VoxelType::U8), nearest(parallel()), Algorithm::Template(TemplatePlane::Image));
    add("object-slices", head(), wide(), Algorithm::ObjectSlices { spacing_correction: true });
    add("object-slices-uncorrected", head(), wide(), Algorithm::ObjectSlices { spacing_correction: false });
    add("grid", head(), along(1, false).with_size(24, 24).unwrap().with_lighting(light()).unwrap(), Algorithm::Grid);
    let depth = |s: Scene| {
        let mut cue = Lighting::default();
        cue.shading = Shading::Depth;
        s.with_lighting(Some(cue)).unwrap()
    };
    add(
        "grid-depth",
        head(),
        depth(along(2, true).with_size(24, 24).unwrap().with_blend(Blend::Iso { level: 0.3 }).unwrap().with_hit(Hit::FirstSample)),
        Algorithm::Grid,
    );
    add("coin-flips", head(), wide(), Algorithm::CoinFlips { games: 64, seed: 7 });
}

/// OpenGL's fixed functions.
fn opengl(list: &mut Vec<Sample>) {
    let mut add = |name, volume: Volume, scene: Scene| list.push(Sample { name, volume, scene });
    let gl = |s: Scene, state: OpenGl, method: Method| s.with_opengl(state).unwrap().with_method(method).unwrap();
    let view = |s: Scene| looked(s, 30.0, 20.0, 0.0, 2.0, WIDE);
    let s = || scene((48, 40), 50);
    let eight = Method::default().with_target(Target::Unorm8);
    add("opengl", head(), gl(view(s()), OpenGl::default(), eight));
    add("opengl-f32", cloud(20, VoxelType::I16), gl(view(s()), OpenGl::default(), Method::default()).with_transfer(soft()));
    add(
        "opengl-16",
        cloud(20, VoxelType::F32),
        gl(view(s()), OpenGl::straight(), eight.with_target(Target::Unorm16)).with_transfer(soft()),
    );
    let fixed = OpenGl { filter_arithmetic: Arithmetic::Fixed, ..OpenGl::default() };
    add("opengl-pre", cloud(20, VoxelType::U8), gl(view(s()), fixed, eight.with_classification(Classification::Pre)));
    let nearest = eight.with_filter(Filter::Nearest);
    let bordered = OpenGl {
        texture_matrix: DMat4::from_cols(
            DVec4::new(1.7, 0.2, 0.0, 0.4),
            DVec4::new(0.0, 1.5, 0.3, 0.0),
            DVec4::new(-0.2, 0.0, 1.6, -0.3),
            DVec4::new(-0.3, -0.2, 0.1, 1.0),
        ),
        wrap: [Wrap::Repeat, Wrap::ClampToBorder, Wrap::ClampToEdge],
        border: [0.5, 0.0, 0.0, 0.0],
        scissor: Some(Scissor { x: 3, y: 5, width: 40, height: 30 }),
        ..OpenGl::default()
    };
    add("opengl-projective", head(), gl(view(s()), bordered, nearest));
    let vertex = OpenGl {
        fog_evaluation: FogEvaluation::Vertex,
        environment: Environment::Modulate,
        primary: [0.9, 0.8, 1.0, 0.7],
        alpha_test: Some(AlphaTest { compare: Compare::Greater, reference: 0.004 }),
        min_filter: Some(Filter::Nearest),
        ..OpenGl::straight()
    };
    let fogged = foggy(view(s()), FogMode::Exp2 { density: 0.02 }, FogDistance::Radial, FogWeighting::Literal);
    add("opengl-fog", head(), gl(fogged, vertex, Method::default()));
    let highest = OpenGl::default().with_blend(BlendFunction { equation: Equation::Max, source: Factor::One, destination: Factor::One });
    add("opengl-max", head(), gl(view(s()), highest, eight).with_transfer(strong()));
}

/// Light, and opacity that depends on the gradient.
fn lit(list: &mut Vec<Sample>) {
    let mut add = |name, volume: Volume, scene: Scene| list.push(Sample { name, volume, scene });
    let in_light = |scene: Scene, lights: &[(LightSource, [f64; 3])], change: &dyn Fn(&mut Lighting)| {
        let mut lighting = Lighting::default();
        change(&mut lighting);
        let lights = lights.iter().map(|&(source, color)| Light::new(source, color).unwrap()).collect();
        scene.with_lighting(Some(lighting.with_lights(lights).unwrap())).unwrap()
    };
    let head_light = [(LightSource::Head, [1.0; 3])];
    let s = || looked(scene((48, 40), 50), 30.0, 20.0, 0.0, 1.3, PARALLEL);
    let near = || looked(scene((48, 40), 50), 30.0, 20.0, 0.0, 1.3, WIDE);
    let weighted = |points: &[(f64, f64)]| haze().with_gradient_opacity(points.to_vec()).unwrap();
    let regions = vec![
        Region { shape: Shape::Levoy { value: 0.35, thickness: 1.5 }, color: [1.0, 0.9, 0.8], opacity: 0.5 },
        Region { shape: Shape::Gaussian { value: 0.15, width: 0.05, gradient: 0.04, height: 0.03 }, color: [0.3, 0.5, 1.0], opacity: 0.2 },
        Region { shape: Shape::Triangle { value: 0.5, width: 0.2, gradient: 0.2 }, color: [0.9, 0.4, 0.2], opacity: 0.3 },
        Region { shape: Shape::Box { value: [0.6, 0.9], gradient: [0.0, 0.05] }, color: [0.2, 0.9, 0.3], opacity: 0.1 },
    ];
    add("transfer2d", cloud(20, VoxelType::U16), near().with_transfer2d(Some(Transfer2d::regions(regions).unwrap())).unwrap());
    add("lit", head(), in_light(s(), &head_light, &|_| {}));
    add("lit-u8", cloud(20, VoxelType::U8), in_light(s(), &head_light, &|m| m.shininess = 7.5).with_transfer(soft()));
    add("lit-i16", cloud(20, VoxelType::I16), in_light(near(), &head_light, &|m| m.two_sided = false).with_transfer(soft()));
    let two = [
        (LightSource::Position(head().grid().center() + DVec3::new(30.0, -40.0, 50.0)), [1.0, 0.8, 0.6]),
        (LightSource::Direction(DVec3::new(-1.0, -1.0, 0.5)), [0.3, 0.5, 1.0]),
    ];
    add(
        "lit-two-lights",
        head(),
        in_light(near(), &two, &|m| {
            (m.ambient, m.diffuse, m.specular, m.shininess) = (0.1, 0.9, 0.5, 40.0);
            (m.gradient_floor, m.two_sided) = (0.1, false);
        }),
    );
    add("lit-sobel", head(), in_light(near(), &head_light, &|_| {}).with_gradient(Gradient::Sobel));
    add("lit-analytic", cloud(20, VoxelType::F64), in_light(s(), &two, &|_| {}).with_transfer(soft()).with_gradient(Gradient::Analytic));
    add("lit-depth", head(), in_light(near(), &head_light, &|m| m.shading = Shading::Depth));
    add("lit-oblique", on_oblique_grid(head()), in_light(s(), &two, &|m| m.specular = 0.6));
    add("lit-negative-slope", cloud(16, VoxelType::I16).with_rescale(-0.5 / 32768.0, 0.5).unwrap(), {
        in_light(s(), &two, &|m| m.two_sided = false).with_transfer(soft())
    });
    add("gradient-opacity", head(), s().with_transfer(weighted(&[(0.02, 0.0), (0.3, 1.0)])));
    add(
        "gradient-opacity-lit",
        cloud(20, VoxelType::U16),
        in_light(near(), &head_light, &|_| {})
            .with_transfer(soft().with_gradient_opacity(vec![(0.0, 0.2), (0.05, 0.2), (0.05, 1.0)]).unwrap()),
    );
    let fog = foggy(near(), FogMode::Exp { density: 0.02 }, FogDistance::Radial, FogWeighting::Alpha);
    add("lit-fog-linear-light", head(), in_light(fog, &two, &|_| {}).with_linear_light(true).unwrap());
    let pairs = |c: Classification| Method::default().with_classification(c);
    let few = || looked(scene((48, 40), 20), 30.0, 20.0, 0.0, 1.3, WIDE);
    add("lit-pre-integrated", head(), in_light(few(), &two, &|_| {}).with_method(pairs(Classification::PreIntegrated)).unwrap());
    let second = pairs(Classification::SecondOrder);
    add("lit-second-order-depth", head(), in_light(few(), &head_light, &|m| m.shading = Shading::Depth).with_method(second).unwrap());
    add("lit-tiny", counted([1, 1, 9]), in_light(s(), &two, &|_| {}).with_transfer(strong()));
    add(
        "lit-holes",
        {
            let Voxels::F32(mut v) = head().voxels().clone() else { unreachable!("the head is f32") };
            v.iter_mut().step_by(37).for_each(|x| *x = f32::NAN);
            Volume::new(head().grid().clone(), Voxels::F32(v)).unwrap()
        },
        in_light(s(), &head_light, &|_| {}),
    );
    let v = head();
    let planes = vec![plane(&v, DVec3::new(0.2, 1.0, 0.3), 0.0)];
    add("lit-clip-back-to-front", v, in_light(s(), &two, &|_| {}).with_clip_planes(planes).unwrap().with_order(Order::BackToFront));
}

/// By place: segments of a label map, regions with functions of their own.
fn by_place(list: &mut Vec<Sample>) {
    let mut add = |name, volume: Volume, scene: Scene| list.push(Sample { name, volume, scene });
    let s = || scene((48, 40), 50);
    let lit = |s: Scene| s.with_lighting(Some(Lighting::default())).unwrap();
    let all_around = labelled(on_oblique_grid(cloud(24, VoxelType::U8)));
    let view = || looked(s(), 35.0, 25.0, 0.0, 1.2, WIDE).with_transfer(soft());
    add("labels", all_around.clone(), lit(view().with_segments(styles()).unwrap()));
    let places = focus(&all_around);
    add("regions", all_around.clone(), view().with_regions(places.clone()).unwrap());
    let both = view().with_segments(styles()).unwrap().with_regions(places).unwrap();
    add("labels-in-regions", all_around, both.with_fog(Some(Fog::new(FogMode::Exp { density: 0.005 }, [0.7, 0.75, 0.8]).unwrap())));
    let hidden = styles()[..1].to_vec();
    add(
        "mip-hidden",
        labelled(head()),
        looked(s(), 10.0, 30.0, 0.0, 1.3, PARALLEL).with_transfer(strong()).with_blend(Blend::Mip).unwrap().with_segments(hidden).unwrap(),
    );
    let alone: Vec<(i64, Straight)> =
        (0..5).map(|l| (l, Straight { rgb: label_color(l), alpha: if l == 0 { 0.0 } else { 0.8 } })).collect();
    let nearest = Method::default().with_filter(Filter::Nearest);
    let colors = lit(looked(s(), 35.0, 25.0, 0.0, 1.2, WIDE).with_transfer(TransferFunction::of_labels(&alone).unwrap()));
    add("labels-alone", sectors(head().grid()), colors.with_method(nearest).unwrap());
}
