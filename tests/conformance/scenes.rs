//! The scenes that are compared, in groups.

use glam::{DMat3, DMat4, DVec3, DVec4};
use slicestack::scene::{
    AlphaTest, Arithmetic, BlendFunction, Camera, Classification, ClipPlane, Compare, Environment, Equation, Factor, Filter, Fog,
    FogDistance, FogEvaluation, FogMode, FogWeighting, Method, OpenGl, Order, Placement, Projection, Scissor, Slicing, Straight,
    TableColors, Target, TextureFormat, TransferFunction, Wrap,
};
use slicestack::volume::{BoxConvention, Grid, Voxels};
use slicestack::{Scene, Volume};

/// Numbers of texture and framebuffer that a scene is drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Bits {
    /// 8-bit texture, float framebuffer.
    Mixed,
    /// Floats throughout.
    Float,
    /// 8 bits throughout.
    Eight,
    /// 8-bit texture, 16-bit framebuffer.
    Sixteen,
}

impl Bits {
    pub(crate) const ALL: [Self; 4] = [Self::Mixed, Self::Float, Self::Eight, Self::Sixteen];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mixed => "texture 8, framebuffer f32",
            Self::Float => "texture f32, framebuffer f32",
            Self::Eight => "texture 8, framebuffer 8",
            Self::Sixteen => "texture 8, framebuffer 16",
        }
    }
}

/// A scene, to be drawn with several kinds of numbers.
#[derive(Clone)]
pub(crate) struct Case {
    pub(crate) group: &'static str,
    pub(crate) name: String,
    pub(crate) volume: Volume,
    pub(crate) scene: Scene,
    pub(crate) state: OpenGl,
    pub(crate) bits: Vec<Bits>,
    classification: Classification,
    filter: Filter,
}

impl Case {
    /// The scene in these numbers, 8-bit textures filtered in `arithmetic`.
    pub(crate) fn scene(&self, bits: Bits, arithmetic: Arithmetic) -> Scene {
        let texture = if bits == Bits::Float { TextureFormat::F32 } else { TextureFormat::Unorm8 };
        let target = match bits {
            Bits::Mixed | Bits::Float => Target::F32,
            Bits::Eight => Target::Unorm8,
            Bits::Sixteen => Target::Unorm16,
        };
        let order = self.scene.order();
        let method = Method::default().with_classification(self.classification).with_filter(self.filter).with_target(target);
        self.scene
            .clone()
            .with_opengl(OpenGl { texture, filter_arithmetic: arithmetic, ..self.state })
            .unwrap()
            .with_method(method)
            .unwrap()
            .with_order(order)
    }

    /// Numbers that Mesa filters this scene's 8-bit textures in, unless told otherwise: its way with 8 bits knows no borders.
    pub(crate) fn mesas_arithmetic(&self) -> Arithmetic {
        if self.state.wrap.contains(&Wrap::ClampToBorder) { Arithmetic::Float } else { Arithmetic::Fixed }
    }

    /// Whether colours jump somewhere along a slice, so that a last bit of a coordinate may decide.
    pub(crate) fn jumps(&self) -> bool {
        let nearest = [Some(self.filter), self.state.min_filter, Some(self.state.table_filter)].contains(&Some(Filter::Nearest));
        nearest || self.state.alpha_test.is_some() || self.name.contains("steps")
    }

    fn volume(mut self, volume: Volume) -> Self {
        self.volume = volume;
        self
    }

    fn map(mut self, change: impl FnOnce(Scene) -> Scene) -> Self {
        self.scene = change(self.scene);
        self
    }

    fn state(mut self, change: impl FnOnce(&mut OpenGl)) -> Self {
        change(&mut self.state);
        self
    }

    fn straight(self) -> Self {
        self.state(|s| {
            let usual = OpenGl::straight();
            (s.table_colors, s.blend, s.blend_alpha) = (usual.table_colors, usual.blend, usual.blend_alpha);
        })
    }

    /// Pre-classified, in few slices: Mesa rounds each filtered colour to 8 bits, and what it rounds off adds up over slices.
    fn pre(mut self) -> Self {
        self.classification = Classification::Pre;
        self.map(|s| s.with_slices(Slicing::Count(8)).unwrap())
    }

    fn filter(mut self, filter: Filter) -> Self {
        self.filter = filter;
        self
    }

    fn camera(self, eye: DVec3, projection: Projection) -> Self {
        let (c, r) = (self.volume.grid().center(), self.volume.grid().radius());
        let camera = Camera::new(Placement::LookAt { eye: c + eye * r, target: c, up: DVec3::new(0.1, 0.2, 1.0) }, projection).unwrap();
        self.map(|s| s.with_camera(camera))
    }

    /// Literal fog. Onto premultiplied colours it is dark, so that slices of nothing but fog do not add up to more than white.
    fn fog(self, mode: FogMode, distance: FogDistance) -> Self {
        let color = if self.state.table_colors == TableColors::Straight { [0.88, 0.51, 0.22] } else { [0.035, 0.02, 0.01] };
        let fog = Fog::new(mode, color).unwrap().with_distance(distance).with_weighting(FogWeighting::Literal);
        self.map(|s| s.with_fog(Some(fog)))
    }

    fn only(mut self, bits: &[Bits]) -> Self {
        self.bits = bits.to_vec();
        self
    }
}

const OBLIQUE: DVec3 = DVec3::new(1.7, 2.1, 1.3);
const NARROW: Projection = Projection::Perspective { fov_y: 40.0 };

fn parallel(case: &Case) -> Projection {
    Projection::Orthographic { height: Some(1.9 * case.volume.grid().radius()) }
}

/// A smooth volume of bytes.
fn waves(dims: [usize; 3]) -> Volume {
    let [nx, ny, nz] = dims.map(|n| n as f64);
    let mut bytes = Vec::new();
    for k in 0..dims[2] {
        for j in 0..dims[1] {
            for i in 0..dims[0] {
                let (x, y, z) = ((i as f64 + 0.5) / nx, (j as f64 + 0.5) / ny, (k as f64 + 0.5) / nz);
                let v = (5.0 * x + 2.0 * z).sin() + (4.0 * y - 3.0 * x).cos() + (6.0 * z + y).sin();
                bytes.push((127.5 + 38.0 * v).round() as u8);
            }
        }
    }
    Volume::new(Grid::with_spacing(dims, [1.0, 1.1, 0.9]).unwrap(), Voxels::U8(bytes.into())).unwrap()
}

/// Bytes without order.
fn noise(dims: [usize; 3]) -> Volume {
    let bytes = (0..dims.iter().product::<usize>()).map(|i| ((i * 7919 + 13) * 104_729 % 251) as u8).collect();
    Volume::new(Grid::with_spacing(dims, [1.0, 0.8, 1.3]).unwrap(), Voxels::U8(bytes)).unwrap()
}

fn smooth() -> TransferFunction {
    TransferFunction::new(
        vec![(0.0, [0.1, 0.2, 0.9]), (90.0, [0.2, 0.8, 0.6]), (170.0, [1.0, 0.8, 0.3]), (255.0, [0.9, 0.2, 0.1])],
        vec![(20.0, 0.0), (120.0, 0.06), (170.0, 0.02), (240.0, 0.12)],
    )
    .unwrap()
}

/// The scene that others change: smooth bytes, an oblique view in perspective, premultiplied over.
fn base(group: &'static str, name: impl Into<String>) -> Case {
    let scene = Scene::new(smooth()).with_size(128, 104).unwrap().with_slices(Slicing::Count(24)).unwrap().with_order(Order::BackToFront);
    let back = Straight { rgb: [0.2, 0.3, 0.4], alpha: 0.5 };
    Case {
        group,
        name: name.into(),
        volume: waves([20, 18, 22]),
        scene: scene.with_background(back).unwrap(),
        state: OpenGl::default(),
        bits: vec![Bits::Mixed, Bits::Float, Bits::Eight],
        classification: Classification::Post,
        filter: Filter::Linear,
    }
    .camera(OBLIQUE, NARROW)
}

fn linear(start: f64, end: f64) -> FogMode {
    FogMode::Linear { start, end }
}

fn projections(list: &mut Vec<Case>) {
    let b = |name: &str| base("projection", name);
    let ortho = |c: Case| {
        let p = parallel(&c);
        c.camera(OBLIQUE, p)
    };
    list.push(ortho(b("orthographic")));
    list.push(b("perspective"));
    list.push(b("perspective, wide").camera(OBLIQUE * 0.75, Projection::Perspective { fov_y: 95.0 }));
    list.push(b("orthographic along z").camera(DVec3::new(0.0, 0.0, 3.0), Projection::Orthographic { height: Some(31.3) }));
    list.push(b("perspective along x").camera(DVec3::new(-2.6, 0.0, 0.0), NARROW));
    list.push(ortho(b("sheared and turned grid").volume({
        let v = waves([20, 18, 22]);
        let steps = DMat3::from_cols(DVec3::new(0.9, 0.3, 0.1), DVec3::new(-0.2, 1.0, 0.3), DVec3::new(0.3, 0.1, -0.8));
        let grid = Grid::new(v.grid().dims(), DVec3::new(40.0, -7.0, 3.0), steps).unwrap();
        v.with_grid(grid).unwrap()
    })));
    list.push(b("box of nodes").volume(waves([9, 8, 10]).with_convention(BoxConvention::Nodes)).camera(OBLIQUE, NARROW));
    list.push(b("pre-classified").pre());
    list.push(ortho(b("pre-classified, orthographic").pre()));
    list.push(b("16-bit framebuffer").only(&[Bits::Sixteen]));
    list.push(b("16-bit framebuffer, straight").straight().only(&[Bits::Sixteen]));
    list.push(b("16-bit framebuffer, pre-classified").pre().only(&[Bits::Sixteen]));
}

fn fogs(list: &mut Vec<Case>) {
    // The eye stands 3 radii off: about 29 to 67 world units before the box's near and far end.
    let modes = [
        ("linear", linear(35.0, 65.0)),
        ("linear, clear everywhere", linear(500.0, 900.0)),
        ("linear, fog everywhere", linear(1.0, 10.0)),
        ("linear, start behind end", linear(65.0, 35.0)),
        ("linear, start below 0", linear(-40.0, 80.0)),
        ("exp", FogMode::Exp { density: 0.02 }),
        ("exp, density 0", FogMode::Exp { density: 0.0 }),
        ("exp, density 1e6", FogMode::Exp { density: 1e6 }),
        ("exp2", FogMode::Exp2 { density: 0.018 }),
        ("exp2, density 0", FogMode::Exp2 { density: 0.0 }),
        ("exp2, density 1e6", FogMode::Exp2 { density: 1e6 }),
    ];
    for (name, mode) in modes {
        list.push(base("fog", format!("{name}, straight")).straight().fog(mode, FogDistance::Planar));
        list.push(base("fog", format!("{name}, premultiplied")).fog(mode, FogDistance::Planar));
    }
    for (name, mode) in [("linear", modes[0].1), ("exp", modes[5].1), ("exp2", modes[8].1)] {
        list.push(base("fog", format!("{name}, pre-classified")).pre().fog(mode, FogDistance::Planar));
        let c = base("fog", format!("{name}, orthographic"));
        let p = parallel(&c);
        list.push(c.straight().camera(OBLIQUE, p).fog(mode, FogDistance::Planar));
        let wide = Projection::Perspective { fov_y: 70.0 };
        list.push(base("fog", format!("{name}, radial")).straight().camera(OBLIQUE * 0.7, wide).fog(mode, FogDistance::Radial));
        let by_vertex = |s: &mut OpenGl| s.fog_evaluation = FogEvaluation::Vertex;
        let c = base("fog", format!("{name}, radial, by vertex")).straight().camera(OBLIQUE * 0.7, wide);
        list.push(c.fog(mode, FogDistance::Radial).state(by_vertex));
    }
}

fn lookups(list: &mut Vec<Case>) {
    let beyond = DMat4::from_scale_rotation_translation(DVec3::new(2.3, 1.7, 2.9), glam::DQuat::IDENTITY, DVec3::new(-0.63, -0.31, -0.87));
    let filters = [("linear", Filter::Linear), ("nearest", Filter::Nearest)];
    let wraps = [("clamp to edge", Wrap::ClampToEdge), ("clamp to border", Wrap::ClampToBorder), ("repeat", Wrap::Repeat)];
    for (filter_name, filter) in filters {
        for (wrap_name, wrap) in wraps {
            for pre in [false, true] {
                let name = format!("{filter_name}, {wrap_name}{}", if pre { ", pre-classified" } else { "" });
                let c = base("filter and wrap", name).filter(filter).state(|s| {
                    s.texture_matrix = beyond;
                    s.wrap = [wrap; 3];
                    s.border = [0.4, 0.1, 0.05, 0.1];
                });
                list.push(if pre { c.pre() } else { c });
            }
        }
    }
    list.push(base("filter and wrap", "another mode for each axis").state(|s| {
        s.texture_matrix = beyond;
        s.wrap = [Wrap::Repeat, Wrap::ClampToBorder, Wrap::ClampToEdge];
        s.border = [0.7, 0.0, 0.0, 0.0];
    }));
    // Texels about half a pixel wide, and five pixels wide: far from where either filter could be meant.
    let small = base("filter and wrap", "linear, nearest where smaller, texels small").volume(waves([160, 144, 176]));
    list.push(small.camera(OBLIQUE, NARROW).state(|s| s.min_filter = Some(Filter::Nearest)));
    let large = base("filter and wrap", "linear, nearest where smaller, texels large").volume(waves([10, 9, 11]));
    list.push(large.camera(OBLIQUE, NARROW).state(|s| s.min_filter = Some(Filter::Nearest)));
    for (name, dims) in [("5 x 7 x 3", [5, 7, 3]), ("1 x 1 x 1", [1, 1, 1]), ("2 x 1 x 9", [2, 1, 9]), ("33 x 1 x 1", [33, 1, 1])] {
        for (filter_name, filter) in filters {
            let c = base("texture size", format!("{name}, {filter_name}")).volume(noise(dims)).filter(filter).camera(OBLIQUE, NARROW);
            // The same path through every box.
            let unit = c.volume.grid().radius() / 16.0;
            list.push(c.map(|s| s.with_opacity_unit(unit).unwrap()));
        }
    }
    list.push(base("texture size", "5 x 7 x 3, pre-classified").volume(noise([5, 7, 3])).pre().camera(OBLIQUE, NARROW));
}

fn tables(list: &mut Vec<Case>) {
    let b = |name: &str| base("table", name);
    let steps = TransferFunction::new(
        vec![
            (0.0, [0.2, 0.3, 0.9]),
            (100.0, [0.2, 0.3, 0.9]),
            (100.0, [0.9, 0.7, 0.1]),
            (180.0, [0.9, 0.7, 0.1]),
            (180.0, [0.8, 0.1, 0.2]),
        ],
        vec![(0.0, 0.0), (60.0, 0.0), (60.0, 0.012), (140.0, 0.012), (140.0, 0.0), (180.0, 0.0), (180.0, 0.016)],
    )
    .unwrap();
    let stepped = |c: Case| c.map(|s| s.with_transfer(steps.clone()).with_slices(Slicing::Count(48)).unwrap());
    list.push(stepped(b("steps")));
    list.push(stepped(b("steps, nearest entry")).state(|s| s.table_filter = Filter::Nearest));
    list.push(stepped(b("steps, straight")).straight());
    list.push(stepped(b("steps, pre-classified").pre()));
    list.push(b("straight colours").straight());
    list.push(b("straight colours, pre-classified").straight().pre());
    list.push(b("8-bit entries").state(|s| s.table = Some(TextureFormat::Unorm8)).only(&[Bits::Mixed, Bits::Eight]));
    list.push(b("float entries").state(|s| s.table = Some(TextureFormat::F32)));
    list.push(b("nearest entry").state(|s| s.table_filter = Filter::Nearest));
    let opaque = TransferFunction::new(vec![(0.0, [0.0; 3]), (255.0, [1.0; 3])], vec![(0.0, 0.0), (210.0, 0.03), (255.0, 1.0)]).unwrap();
    list.push(b("up to opacity 1").map(|s| s.with_transfer(opaque)));
    let spread = |v: Volume, of: fn(f64) -> Voxels| {
        let values: Vec<Voxels> = (0..v.voxels().len()).map(|i| of(v.voxels().get(i))).collect();
        (v.grid().clone(), values)
    };
    let v = waves([20, 18, 22]);
    let (grid, _) = spread(v.clone(), |x| Voxels::F64(vec![x].into()));
    let shorts = (0..v.voxels().len()).map(|i| (v.voxels().get(i) * 100.0) as i16 - 9000).collect();
    let shorts = Volume::new(grid.clone(), Voxels::I16(shorts)).unwrap().with_rescale(0.01, 90.0).unwrap();
    list.push(b("16-bit voxels with a rescale").volume(shorts));
    let floats = (0..v.voxels().len()).map(|i| (v.voxels().get(i) as f32) - 0.37 * (i % 3) as f32).collect();
    list.push(b("float voxels").volume(Volume::new(grid, Voxels::F32(floats)).unwrap()));
    list.push(b("bytes with a negative slope").volume(v.with_rescale(-1.0, 255.0).unwrap()));
}

fn matrices(list: &mut Vec<Case>) {
    let about = DVec3::splat(0.5);
    let centred = |m: DMat3| DMat4::from_translation(about) * DMat4::from_mat3(m) * DMat4::from_translation(-about);
    let turn = DMat3::from_cols(DVec3::new(0.8, 0.6, 0.0), DVec3::new(-0.6, 0.8, 0.0), DVec3::Z);
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.2), DVec3::new(-0.3, 0.0, 1.0));
    let project = |q: [f64; 4]| {
        let mut m = DMat4::IDENTITY;
        (m.x_axis.w, m.y_axis.w, m.z_axis.w, m.w_axis.w) = (q[0], q[1], q[2], q[3]);
        m
    };
    let flat = DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::ZERO, DVec4::new(0.0, 0.0, 0.37, 1.0));
    let point = DMat4::from_cols(DVec4::ZERO, DVec4::ZERO, DVec4::ZERO, DVec4::new(0.31, 0.62, 0.47, 1.0));
    let all = [
        ("scale", DMat4::from_scale(DVec3::new(0.5, 0.8, 0.3))),
        ("rotation", centred(turn)),
        ("shear", centred(shear)),
        ("mirror", centred(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0)))),
        ("projective, q from 0.7 to 1.5", project([0.5, -0.3, 0.0, 1.0])),
        ("projective, q from 0.2 to 2.2", project([0.8, 0.7, 0.5, 0.2])),
        ("projective, q below 0", project([0.5, -0.3, 0.2, 1.0]) * -1.0),
        ("q = 2 everywhere", DMat4::IDENTITY * 2.0),
        ("singular: one slice of the texture", flat),
        ("singular: one point of the texture", point),
    ];
    for (name, matrix) in all {
        list.push(base("texture matrix", name).state(|s| s.texture_matrix = matrix));
        list.push(base("texture matrix", format!("{name}, pre-classified")).pre().state(|s| s.texture_matrix = matrix));
    }
    let repeat = |s: &mut OpenGl| (s.texture_matrix, s.wrap) = (project([0.8, 0.7, 0.5, 0.2]), [Wrap::Repeat; 3]);
    list.push(base("texture matrix", "projective, repeat").state(repeat));
}

fn blends(list: &mut Vec<Case>) {
    // A dark background: where a factor lets it through or not, an outline's fragment makes all the difference.
    let dark = Straight { rgb: [0.2, 0.3, 0.4], alpha: 0.15 };
    let b = |name: String| base("blend", name).map(|s| s.with_slices(Slicing::Count(12)).unwrap().with_background(dark).unwrap());
    let constant = |s: &mut OpenGl| s.blend_constant = [0.3, 0.5, 0.7, 0.4];
    for f in Factor::ALL {
        let destination = Factor::OneMinusSrcAlpha;
        list.push(b(format!("source {f:?}")).state(constant).state(|s| *s = s.with_blend(BlendFunction::add(f, destination))));
        list.push(b(format!("destination {f:?}")).state(constant).state(|s| *s = s.with_blend(BlendFunction::add(Factor::SrcAlpha, f))));
    }
    for equation in Equation::ALL {
        let function = BlendFunction { equation, source: Factor::SrcAlpha, destination: Factor::OneMinusSrcAlpha };
        // Straight colours are as bright as they are, and these two show them without their opacity.
        let bare = matches!(equation, Equation::Min | Equation::Max);
        let c = b(format!("equation {equation:?}"));
        list.push(if bare { c } else { c.straight() }.state(|s| *s = s.with_blend(function)));
    }
    list.push(b("maximum intensity".into()).state(|s| {
        *s = s.with_blend(BlendFunction { equation: Equation::Max, source: Factor::One, destination: Factor::One });
    }));
    list.push(b("alpha apart: straight over with its alpha right".into()).straight().state(|s| s.blend_alpha = BlendFunction::OVER));
    let under = BlendFunction::add(Factor::OneMinusDstAlpha, Factor::One);
    list.push(b("under, front to back".into()).map(|s| s.with_order(Order::FrontToBack)).state(|s| *s = s.with_blend(under)));
    let saturate = BlendFunction::add(Factor::SrcAlphaSaturate, Factor::One);
    // Alpha fills up from 0.85 to about 1, so that the factor is the one and then the other of its two.
    let full = Straight { rgb: [0.2, 0.3, 0.4], alpha: 0.85 };
    let thin = |s: Scene| s.with_order(Order::FrontToBack).with_opacity_unit(14.0).unwrap().with_background(full).unwrap();
    list.push(b("saturate, front to back".into()).straight().map(thin).state(|s| *s = s.with_blend(saturate)));
}

fn operations(list: &mut Vec<Case>) {
    for compare in Compare::ALL {
        let test = AlphaTest { compare, reference: 0.05 };
        list.push(base("alpha test", format!("{compare:?} 0.05")).filter(Filter::Nearest).state(|s| s.alpha_test = Some(test)));
    }
    let greater = |reference| move |s: &mut OpenGl| s.alpha_test = Some(AlphaTest { compare: Compare::Greater, reference });
    list.push(base("alpha test", "Greater 0").state(greater(0.0)));
    list.push(base("alpha test", "Greater 0.02, pre-classified").pre().state(greater(0.02)));
    let clip = |c: Case, normals: &[[f64; 3]], at: f64| {
        let (center, r) = (c.volume.grid().center(), c.volume.grid().radius());
        let planes = normals.iter().map(|&n| {
            let n = DVec3::from_array(n).normalize();
            ClipPlane::new(n, n.dot(center) + at * r).unwrap()
        });
        let planes = planes.collect();
        c.map(|s| s.with_clip_planes(planes).unwrap())
    };
    let six = [[1.0, 0.2, 0.0], [0.1, 1.0, 0.3], [1.0, 1.0, 1.0], [-1.0, 0.1, 0.2], [0.0, -1.0, 0.4], [0.2, 0.1, -1.0]];
    list.push(clip(base("clip planes and scissor", "one plane"), &six[2..3], -0.1));
    list.push(clip(base("clip planes and scissor", "two planes, pre-classified").pre(), &six[..2], 0.0));
    list.push(clip(base("clip planes and scissor", "six planes"), &six, -0.4));
    let c = base("clip planes and scissor", "six planes, orthographic");
    let p = parallel(&c);
    list.push(clip(c.camera(OBLIQUE, p), &six, -0.45));
    let scissor = |x, y, width, height| move |s: &mut OpenGl| s.scissor = Some(Scissor { x, y, width, height });
    list.push(base("clip planes and scissor", "scissor").state(scissor(20, 30, 41, 27)));
    list.push(base("clip planes and scissor", "scissor past the picture").state(scissor(50, 11, 4000, 4000)));
    list.push(base("clip planes and scissor", "scissor of nothing").state(scissor(10, 10, 0, 20)));
    let primary = |s: &mut OpenGl| (s.environment, s.primary) = (Environment::Modulate, [0.9, 0.6, 0.3, 0.7]);
    list.push(base("environment", "modulate").state(primary));
    list.push(base("environment", "modulate, straight").straight().state(primary));
    list.push(base("environment", "modulate, pre-classified").pre().state(primary));
    list.push(base("environment", "modulate, fog").straight().state(primary).fog(linear(35.0, 65.0), FogDistance::Planar));
}

fn depths(list: &mut Vec<Case>) {
    let thin = TransferFunction::new(smooth().color().to_vec(), vec![(20.0, 0.0), (120.0, 0.03), (240.0, 0.06)]).unwrap();
    for count in [1, 2, 64, 256] {
        // The same opacity for each slice, however many there are.
        let unit = 40.0 / count as f64;
        let many = |s: Scene| s.with_slices(Slicing::Count(count)).unwrap().with_transfer(thin.clone()).with_opacity_unit(unit).unwrap();
        list.push(base("number of slices", format!("{count} slices of low alpha")).map(many));
        list.push(base("number of slices", format!("{count} slices of low alpha, straight")).straight().map(many));
        list.push(base("number of slices", format!("{count} slices of low alpha, pre-classified")).pre().map(many));
    }
    let back = |rgb, alpha| move |s: Scene| s.with_background(Straight { rgb, alpha }).unwrap();
    list.push(base("background", "transparent").map(back([0.0; 3], 0.0)));
    list.push(base("background", "white").map(back([1.0; 3], 1.0)));
}

/// Every scene.
pub(crate) fn cases() -> Vec<Case> {
    let mut list = Vec::new();
    for add in [projections, fogs, lookups, tables, matrices, blends, operations, depths] {
        add(&mut list);
    }
    list
}

/// Premultiplied colours with fog weighted by their opacity, which no OpenGL has, and the straight colours with literal fog that
/// must give the same.
pub(crate) fn weighted() -> Vec<(Case, Case)> {
    let modes = [linear(35.0, 65.0), FogMode::Exp { density: 0.02 }, FogMode::Exp2 { density: 0.018 }];
    let pair = |mode| {
        let literal = base("fog", "").straight().fog(mode, FogDistance::Planar).state(|s| {
            s.blend_alpha = BlendFunction::OVER;
            s.table_filter = Filter::Nearest;
        });
        let mut weighted = literal.clone().state(|s| {
            (s.table_colors, s.blend) = (TableColors::Premultiplied, BlendFunction::OVER);
        });
        weighted.scene = weighted.scene.clone().with_fog(weighted.scene.fog().map(|f| f.with_weighting(FogWeighting::Alpha)));
        (weighted, literal)
    };
    modes.into_iter().map(pair).collect()
}
