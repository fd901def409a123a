//! Texture slicing by a real OpenGL on the CPU: Mesa's llvmpipe, drawing into floats.

use super::case::{Case, SIDE};
use super::gl::constant::*;
use super::gl::{Context, Gl};
use super::slices::{Corner, Eye, cut, planes};
use std::time::Instant;

/// Value to colour by a lookup in the table: value 0 at its first texel's centre, 1 at its last one's.
const PROGRAM: &str = "!!ARBfp1.0\nTEMP c;\nTEX c, fragment.texcoord[0], texture[0], 3D;\n\
    MAD c.x, c.x, 0.99609375, 0.001953125;\nTEX result.color, c, texture[1], 1D;\nEND\n";

/// A scene in so many slices.
struct Stack {
    table: u32,
    /// Polygons, the farthest first.
    polygons: Vec<Vec<Corner>>,
}

/// OpenGL with the volume and the program loaded, and what it takes for several slice counts.
pub(crate) struct Llvmpipe<'g> {
    gl: Context<'g>,
    stacks: Vec<Stack>,
}

impl<'g> Llvmpipe<'g> {
    /// Everything that is done once: textures, the program, and where the polygons are.
    pub(crate) fn new(library: &'g Gl, case: &Case, counts: &[usize]) -> Self {
        let gl = library.context(FLOAT, SIDE as usize, SIDE as usize);
        gl.glViewport(0, 0, SIDE as i32, SIDE as i32);
        gl.glDisable(DITHER);
        gl.glPixelStorei(UNPACK_ALIGNMENT, 1);
        gl.glActiveTexture(TEXTURE0);
        gl.new_texture(TEXTURE_3D);
        gl.image_3d(R8, case.volume.grid().dims(), RED, case.bytes());
        smooth(&gl, TEXTURE_3D, &[TEXTURE_WRAP_S, TEXTURE_WRAP_T, TEXTURE_WRAP_R]);
        gl.fragment_program(PROGRAM);
        // Premultiplied over.
        gl.glEnable(BLEND);
        gl.glBlendEquationSeparate(0x8006, 0x8006);
        gl.glBlendFuncSeparate(1, 0x303, 1, 0x303);
        let eye = Eye::new(&case.scene);
        let stacks: Vec<Stack> = counts.iter().map(|&n| Stack::new(&gl, case, &eye, n)).collect();
        let outer = planes(&case.volume, &eye, 1);
        gl.glMatrixMode(PROJECTION);
        gl.glLoadIdentity();
        gl.glOrtho(-eye.half.x, eye.half.x, -eye.half.y, eye.half.y, outer.near - 1.0, outer.far + 1.0);
        gl.glMatrixMode(MODELVIEW);
        gl.load_matrix(eye.modelview.to_cols_array());
        Self { gl, stacks }
    }

    /// What draws, in its own words.
    pub(crate) fn driver(&self) -> String {
        format!("{}, {}", self.gl.text(RENDERER), self.gl.text(VERSION))
    }

    /// Seconds for a frame in the `i`-th slice count.
    pub(crate) fn frame(&self, i: usize) -> f64 {
        let (gl, stack) = (&self.gl, &self.stacks[i]);
        gl.glActiveTexture(TEXTURE0 + 1);
        gl.glBindTexture(TEXTURE_1D, stack.table);
        gl.glActiveTexture(TEXTURE0);
        gl.glFinish();
        let start = Instant::now();
        gl.glClearColor(0.0, 0.0, 0.0, 0.0);
        gl.glClear(COLOR_BUFFER_BIT);
        for polygon in &stack.polygons {
            gl.glBegin(POLYGON);
            for c in polygon {
                gl.glTexCoord3d(c.texture.x, c.texture.y, c.texture.z);
                gl.glVertex3d(c.world.x, c.world.y, c.world.z);
            }
            gl.glEnd();
        }
        gl.glFinish();
        start.elapsed().as_secs_f64()
    }

    /// The last frame, row 0 on top.
    pub(crate) fn picture(&self) -> Vec<[f32; 4]> {
        self.gl.finish()
    }
}

impl Stack {
    fn new(gl: &Context<'_>, case: &Case, eye: &Eye, count: usize) -> Self {
        let planes = planes(&case.volume, eye, count);
        let slabs = planes.spacing / case.unit();
        let entry = |[r, g, b, a]: [f64; 4]| {
            let alpha = -f64::exp_m1(slabs * f64::ln_1p(-a));
            [r * alpha, g * alpha, b * alpha, alpha].map(|c| c as f32)
        };
        let entries: Vec<f32> = case.table().into_iter().flat_map(entry).collect();
        gl.glActiveTexture(TEXTURE0 + 1);
        let table = gl.new_texture(TEXTURE_1D);
        gl.image_1d(RGBA32F, RGBA, &entries);
        smooth(gl, TEXTURE_1D, &[TEXTURE_WRAP_S]);
        gl.glActiveTexture(TEXTURE0);
        let polygons = planes.depths.iter().rev().map(|&d| cut(&case.volume, eye, d)).filter(|p| !p.is_empty()).collect();
        Self { table, polygons }
    }
}

fn smooth(gl: &Context<'_>, target: u32, wraps: &[u32]) {
    for key in [TEXTURE_MIN_FILTER, TEXTURE_MAG_FILTER] {
        gl.glTexParameteri(target, key, LINEAR as i32);
    }
    for &key in wraps {
        gl.glTexParameteri(target, key, CLAMP_TO_EDGE as i32);
    }
}
