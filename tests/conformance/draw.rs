//! A scene as a program for OpenGL 1.x: state, textures, and a polygon for every slice.

use super::gl::constant::*;
use super::gl::{Context, Gl};
use super::slices::{Corner, Eye, cut, planes};
use slicestack::scene::{
    BlendFunction, Classification, Compare, Environment, Equation, Factor, Filter, FogDistance, FogEvaluation, FogMode, OpenGl, Order,
    Slicing, TableColors, Target, TextureFormat, Wrap,
};
use slicestack::volume::Voxels;
use slicestack::{Scene, Volume};

/// What fragments show.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Show {
    /// The scene.
    Picture,
    /// How many of them there are: each adds 1, without a texture.
    Count,
}

pub(crate) fn slice_count(scene: &Scene) -> usize {
    match scene.slicing() {
        Slicing::Count(n) => n as usize,
        other => panic!("{other:?}: these scenes count their slices"),
    }
}

fn wrap(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::ClampToEdge => CLAMP_TO_EDGE,
        Wrap::ClampToBorder => CLAMP_TO_BORDER,
        Wrap::Repeat => REPEAT,
    }
}

fn filter(filter: Filter) -> u32 {
    match filter {
        Filter::Linear => LINEAR,
        Filter::Nearest => NEAREST,
        other => panic!("OpenGL 1.x has no filter {other:?}"),
    }
}

/// Numbers of the OpenGL registry.
fn factor(factor: Factor) -> u32 {
    match factor {
        Factor::Zero => 0,
        Factor::One => 1,
        Factor::SrcColor => 0x300,
        Factor::OneMinusSrcColor => 0x301,
        Factor::SrcAlpha => 0x302,
        Factor::OneMinusSrcAlpha => 0x303,
        Factor::DstAlpha => 0x304,
        Factor::OneMinusDstAlpha => 0x305,
        Factor::DstColor => 0x306,
        Factor::OneMinusDstColor => 0x307,
        Factor::SrcAlphaSaturate => 0x308,
        Factor::ConstantColor => 0x8001,
        Factor::OneMinusConstantColor => 0x8002,
        Factor::ConstantAlpha => 0x8003,
        Factor::OneMinusConstantAlpha => 0x8004,
    }
}

fn equation(equation: Equation) -> u32 {
    match equation {
        Equation::Add => 0x8006,
        Equation::Min => 0x8007,
        Equation::Max => 0x8008,
        Equation::Subtract => 0x800A,
        Equation::ReverseSubtract => 0x800B,
    }
}

fn compare(compare: Compare) -> u32 {
    match compare {
        Compare::Never => 0x200,
        Compare::Less => 0x201,
        Compare::Equal => 0x202,
        Compare::LessOrEqual => 0x203,
        Compare::Greater => 0x204,
        Compare::NotEqual => 0x205,
        Compare::GreaterOrEqual => 0x206,
        Compare::Always => 0x207,
    }
}

/// The 256 colours, as the program computes them.
fn table(scene: &Scene, state: &OpenGl, volume: &Volume, spacing: f64) -> Vec<[f64; 4]> {
    let (slope, intercept) = volume.rescale();
    let unit = scene.transfer().opacity_length(volume.grid());
    let s = volume.statistics();
    (0..256)
        .map(|i| {
            let value = match volume.voxels() {
                Voxels::U8(_) => slope * f64::from(i) + intercept,
                _ => s.min + (s.max - s.min) * f64::from(i) / 255.0,
            };
            let color = scene.transfer().eval(value);
            let alpha = 1.0 - (1.0 - color.alpha).powf(spacing / unit);
            let weight = if state.table_colors == TableColors::Premultiplied { alpha } else { 1.0 };
            [color.rgb[0] * weight, color.rgb[1] * weight, color.rgb[2] * weight, alpha]
        })
        .collect()
}

fn bytes(colors: &[[f64; 4]]) -> Vec<u8> {
    colors.iter().flatten().map(|c| (c * 255.0).round() as u8).collect()
}

/// Voxels between 0 and 1.
fn values(volume: &Volume) -> Vec<f64> {
    let (slope, intercept) = volume.rescale();
    let s = volume.statistics();
    (0..volume.voxels().len())
        .map(|i| match volume.voxels() {
            Voxels::U8(v) => f64::from(v[i]) / 255.0,
            voxels => (slope * voxels.get(i) + intercept - s.min) / (s.max - s.min),
        })
        .collect()
}

/// Uploads the 3D texture to unit 0, and the table to unit 1 where it is looked up.
fn textures(gl: &Context<'_>, scene: &Scene, state: &OpenGl, volume: &Volume, spacing: f64) {
    gl.glPixelStorei(UNPACK_ALIGNMENT, 1);
    let colors = table(scene, state, volume, spacing);
    let eight = state.table.unwrap_or(if scene.method().target == Target::F32 { TextureFormat::F32 } else { TextureFormat::Unorm8 })
        == TextureFormat::Unorm8;
    let dims = volume.grid().dims();
    gl.glActiveTexture(TEXTURE0);
    gl.new_texture(TEXTURE_3D);
    let levels: Vec<u8> = values(volume).iter().map(|v| (v * 255.0).round() as u8).collect();
    match (scene.method().classification, state.texture) {
        (Classification::Pre, TextureFormat::Unorm8) => {
            let entries = bytes(&colors);
            let texels: Vec<u8> = levels.iter().flat_map(|&l| entries[usize::from(l) * 4..][..4].to_vec()).collect();
            gl.image_3d(RGBA8, dims, RGBA, &texels);
        }
        (Classification::Pre, TextureFormat::F32) => {
            let round = |c: f64| if eight { (c * 255.0).round() / 255.0 } else { c };
            let texels: Vec<f32> = values(volume)
                .iter()
                .flat_map(|v| {
                    let (x, i) = (v * 255.0, (v * 255.0) as usize);
                    let (a, b, w) = (colors[i], colors[(i + 1).min(255)], x.fract());
                    std::array::from_fn::<f32, 4, _>(|c| (round(a[c]) * (1.0 - w) + round(b[c]) * w) as f32)
                })
                .collect();
            gl.image_3d(RGBA32F, dims, RGBA, &texels);
        }
        (_, TextureFormat::Unorm8) => gl.image_3d(R8, dims, RED, &levels),
        (_, TextureFormat::F32) => {
            let texels: Vec<f32> = values(volume).iter().map(|&v| v as f32).collect();
            gl.image_3d(R32F, dims, RED, &texels);
        }
    }
    let mag = scene.method().filter;
    gl.glTexParameteri(TEXTURE_3D, TEXTURE_MAG_FILTER, filter(mag) as i32);
    gl.glTexParameteri(TEXTURE_3D, TEXTURE_MIN_FILTER, filter(state.min_filter.unwrap_or(mag)) as i32);
    for (key, mode) in [TEXTURE_WRAP_S, TEXTURE_WRAP_T, TEXTURE_WRAP_R].into_iter().zip(state.wrap) {
        gl.glTexParameteri(TEXTURE_3D, key, wrap(mode) as i32);
    }
    gl.border_color(TEXTURE_3D, state.border.map(|c| c as f32));
    gl.glEnable(TEXTURE_3D);
    let environment = if state.environment == Environment::Modulate { MODULATE } else { REPLACE };
    gl.glTexEnvi(TEXTURE_ENV, TEXTURE_ENV_MODE, environment as i32);
    let [r, g, b, a] = state.primary;
    gl.glColor4d(r, g, b, a);
    if scene.method().classification == Classification::Post {
        gl.glActiveTexture(TEXTURE0 + 1);
        gl.new_texture(TEXTURE_1D);
        if eight {
            gl.image_1d(RGBA8, RGBA, &bytes(&colors));
        } else {
            let entries: Vec<f32> = colors.iter().flatten().map(|&c| c as f32).collect();
            gl.image_1d(RGBA32F, RGBA, &entries);
        }
        for key in [TEXTURE_MIN_FILTER, TEXTURE_MAG_FILTER] {
            gl.glTexParameteri(TEXTURE_1D, key, filter(state.table_filter) as i32);
        }
        gl.glTexParameteri(TEXTURE_1D, TEXTURE_WRAP_S, CLAMP_TO_EDGE as i32);
        gl.glActiveTexture(TEXTURE0);
    }
}

/// A fragment program for what fixed functions cannot do: a lookup in a table, and a distance of each fragment from the eye.
fn program(scene: &Scene, state: &OpenGl) -> Option<String> {
    let post = scene.method().classification == Classification::Post;
    let radial = scene.fog().filter(|f| f.distance() == FogDistance::Radial && state.fog_evaluation == FogEvaluation::Fragment);
    if !post && radial.is_none() {
        return None;
    }
    let option = match scene.fog().map(|f| f.mode()) {
        _ if radial.is_some() => "",
        None => "",
        Some(_) if by_vertex(scene, state) => "OPTION ARB_fog_linear;\n",
        Some(FogMode::Linear { .. }) => "OPTION ARB_fog_linear;\n",
        Some(FogMode::Exp { .. }) => "OPTION ARB_fog_exp;\n",
        Some(FogMode::Exp2 { .. }) => "OPTION ARB_fog_exp2;\n",
    };
    let mut text = format!("!!ARBfp1.0\n{option}TEMP c, z;\nTXP c, fragment.texcoord[0], texture[0], 3D;\n");
    if post {
        // 255/256 and 0.5/256: value 0 at the first texel's centre, 1 at the last one's.
        text += "MAD c.x, c.x, 0.99609375, 0.001953125;\nTEX c, c, texture[1], 1D;\n";
    }
    if state.environment == Environment::Modulate {
        text += "MUL c, c, fragment.color;\n";
    }
    if let Some(fog) = radial {
        text += "DP3 z.x, fragment.texcoord[2], fragment.texcoord[2];\nRSQ z.y, z.x;\nMUL z.x, z.x, z.y;\n";
        text += &match fog.mode() {
            FogMode::Linear { start, end } => {
                format!("MAD_SAT z.x, z.x, {:.9}, {:.9};\n", -1.0 / (end - start), end / (end - start))
            }
            FogMode::Exp { density } => format!("MUL z.x, z.x, {:.9};\nEX2_SAT z.x, z.x;\n", -density * std::f64::consts::LOG2_E),
            FogMode::Exp2 { density } => {
                let scale = density * std::f64::consts::LOG2_E.sqrt();
                format!("MUL z.x, z.x, {scale:.9};\nMUL z.x, z.x, -z.x;\nEX2_SAT z.x, z.x;\n")
            }
        };
        let [r, g, b] = fog.color();
        text += &format!("LRP c.xyz, z.x, c, {{{r:.9}, {g:.9}, {b:.9}, 1.0}};\n");
    }
    Some(text + "MOV result.color, c;\nEND\n")
}

/// Whether radial fog is computed by the program at corners: OpenGL gets 1 - f as the coordinate of linear fog from 0 to 1, so that
/// the factor itself is what it interpolates.
fn by_vertex(scene: &Scene, state: &OpenGl) -> bool {
    scene.fog().is_some_and(|f| f.distance() == FogDistance::Radial) && state.fog_evaluation == FogEvaluation::Vertex
}

fn fog(gl: &Context<'_>, scene: &Scene, state: &OpenGl) {
    let Some(fog) = scene.fog() else { return };
    let [r, g, b] = fog.color().map(|c| c as f32);
    gl.fog_color([r, g, b, 1.0]);
    if by_vertex(scene, state) {
        gl.glFogi(FOG_COORDINATE_SOURCE, FOG_COORDINATE as i32);
        gl.glFogi(FOG_MODE, LINEAR as i32);
        gl.glFogf(FOG_START, 0.0);
        gl.glFogf(FOG_END, 1.0);
    } else {
        match fog.mode() {
            FogMode::Linear { start, end } => {
                gl.glFogi(FOG_MODE, LINEAR as i32);
                gl.glFogf(FOG_START, start as f32);
                gl.glFogf(FOG_END, end as f32);
            }
            FogMode::Exp { density } => {
                gl.glFogi(FOG_MODE, EXP as i32);
                gl.glFogf(FOG_DENSITY, density as f32);
            }
            FogMode::Exp2 { density } => {
                gl.glFogi(FOG_MODE, EXP2 as i32);
                gl.glFogf(FOG_DENSITY, density as f32);
            }
        }
    }
    gl.glEnable(FOG);
}

fn fog_factor(mode: FogMode, z: f64) -> f64 {
    let f = match mode {
        FogMode::Linear { start, end } => (end - z) / (end - start),
        FogMode::Exp { density } => (-density * z).exp(),
        FogMode::Exp2 { density } => (-(density * z).powi(2)).exp(),
    };
    f.clamp(0.0, 1.0)
}

fn camera(gl: &Context<'_>, eye: &Eye, near: f64, far: f64) {
    gl.glMatrixMode(PROJECTION);
    gl.glLoadIdentity();
    if eye.perspective {
        let near = (near * 0.5).max(far * 1e-3);
        let (w, h) = (eye.half.x * near, eye.half.y * near);
        gl.glFrustum(-w, w, -h, h, near, far * 1.5);
    } else {
        gl.glOrtho(-eye.half.x, eye.half.x, -eye.half.y, eye.half.y, near - 1.0, far + 1.0);
    }
    gl.glMatrixMode(MODELVIEW);
    gl.load_matrix(eye.modelview.to_cols_array());
}

fn blending(gl: &Context<'_>, color: BlendFunction, alpha: BlendFunction, constant: [f64; 4]) {
    gl.glEnable(BLEND);
    gl.glBlendEquationSeparate(equation(color.equation), equation(alpha.equation));
    gl.glBlendFuncSeparate(factor(color.source), factor(color.destination), factor(alpha.source), factor(alpha.destination));
    let [r, g, b, a] = constant.map(|c| c as f32);
    gl.glBlendColor(r, g, b, a);
}

/// OpenGL's picture, row 0 on top.
pub(crate) fn draw(library: &Gl, volume: &Volume, scene: &Scene, show: Show) -> Vec<[f32; 4]> {
    let state = scene.opengl().expect("these scenes are for OpenGL");
    let (width, height) = scene.size();
    let kind = match scene.method().target {
        _ if show == Show::Count => FLOAT,
        Target::F32 => FLOAT,
        Target::Unorm8 => UNSIGNED_BYTE,
        Target::Unorm16 => UNSIGNED_SHORT,
        other => panic!("there is no framebuffer of {other:?} here"),
    };
    let gl = library.context(kind, width as usize, height as usize);
    let eye = Eye::new(scene);
    let planes = planes(volume, &eye, slice_count(scene));
    gl.glDisable(DITHER);
    gl.glViewport(0, 0, width as i32, height as i32);
    let background = scene.background();
    let [r, g, b] = background.rgb.map(|c| (c * background.alpha) as f32);
    if show == Show::Count {
        gl.glClearColor(0.0, 0.0, 0.0, 0.0);
    } else {
        gl.glClearColor(r, g, b, background.alpha as f32);
    }
    gl.glClear(COLOR_BUFFER_BIT);
    camera(&gl, &eye, planes.near, planes.far);
    for (i, plane) in scene.clip_planes().iter().enumerate() {
        let n = plane.normal();
        gl.clip_plane(i, [n.x, n.y, n.z, -plane.offset()]);
        gl.glEnable(CLIP_PLANE0 + i as u32);
    }
    if let Some(s) = state.scissor {
        gl.glScissor(s.x as i32, s.y as i32, s.width as i32, s.height as i32);
        gl.glEnable(SCISSOR_TEST);
    }
    if show == Show::Count {
        gl.glColor4d(1.0, 1.0, 1.0, 1.0);
        let sum = BlendFunction::add(Factor::One, Factor::One);
        blending(&gl, sum, sum, [0.0; 4]);
    } else {
        textures(&gl, scene, state, volume, planes.spacing);
        gl.glMatrixMode(TEXTURE);
        gl.load_matrix(state.texture_matrix.to_cols_array());
        gl.glMatrixMode(MODELVIEW);
        fog(&gl, scene, state);
        if let Some(test) = state.alpha_test {
            gl.glAlphaFunc(compare(test.compare), test.reference as f32);
            gl.glEnable(ALPHA_TEST);
        }
        blending(&gl, state.blend, state.blend_alpha, state.blend_constant);
        if let Some(text) = program(scene, state) {
            gl.fragment_program(&text);
        }
    }
    let by_vertex = by_vertex(scene, state) && show == Show::Picture;
    let corner = |c: &Corner| {
        if let Some(fog) = scene.fog().filter(|_| by_vertex) {
            gl.glFogCoordd(1.0 - fog_factor(fog.mode(), c.eye.length()));
        }
        gl.glMultiTexCoord3d(TEXTURE0 + 2, c.eye.x, c.eye.y, c.eye.z);
        gl.glTexCoord3d(c.texture.x, c.texture.y, c.texture.z);
        gl.glVertex3d(c.world.x, c.world.y, c.world.z);
    };
    let mut order: Vec<f64> = planes.depths.clone();
    if scene.order() == Order::BackToFront {
        order.reverse();
    }
    for d in order {
        let corners = cut(volume, &eye, d);
        let Some(first) = corners.first() else { continue };
        if by_vertex {
            // The triangles are ours to choose: around the mean.
            gl.glBegin(TRIANGLE_FAN);
            corner(&Corner::mean(&corners));
            corners.iter().for_each(&corner);
            corner(first);
        } else {
            gl.glBegin(POLYGON);
            corners.iter().for_each(&corner);
        }
        gl.glEnd();
    }
    gl.finish()
}
