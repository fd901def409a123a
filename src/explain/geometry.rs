//! The box, the slice planes and their polygons, in numbers and as a drawing seen from the side.

use super::labels::{Label, LabelSize, Layout, SIZES};
use crate::proxy::{SlicePolygon, Stack};
use crate::scene::{Camera, Fog, FogDistance, Placement, Projection, View};
use crate::volume::Grid;
use crate::{Error, Result};
use glam::DVec3;
use serde::Serialize;
use std::ops::Range;
use tiny_skia::{Color, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

/// Size of the drawing in pixels.
pub(super) const WIDTH: u32 = 720;
pub(super) const HEIGHT: u32 = 560;
/// Outlines of slices in the drawing, at most.
const OUTLINES: u64 = 24;

/// A corner of a slice polygon.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct VertexRecord {
    /// Window position, pixels.
    pub(super) window: [f64; 2],
    /// Texture coordinates s, t, p.
    pub(super) texture: [f64; 3],
    /// The sides of the stack that meet here: an edge of the box where both are its faces.
    pub(super) on: [usize; 2],
    /// Position in the drawing, pixels.
    pub(super) drawn: [f64; 2],
    /// Where its number stands in the drawing, at each size of labels; none where there is no room.
    pub(super) labels: [Option<[f64; 2]>; 2],
}

/// Eight by eight pixels at a corner of the polygon, and which of them it covers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct CornerRecord {
    pub(super) x: i64,
    pub(super) y: i64,
    /// One bit a pixel in hex, the first in the lowest.
    pub(super) covered: String,
}

/// One slice.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SliceRecord {
    pub(super) slice: u64,
    pub(super) depth: f64,
    /// Fog factor of the whole slice, where fog is planar.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) fog: Option<f64>,
    /// Empty where clip planes leave nothing.
    pub(super) vertices: Vec<VertexRecord>,
    /// Edge functions a + b x + c y, edge i from vertex i to the next.
    pub(super) edges: Vec<[f64; 3]>,
    /// The side of the stack that each edge lies on.
    pub(super) sides: Vec<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) corner: Option<CornerRecord>,
}

/// The stack and the drawing of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct StackRecord {
    pub(super) count: u64,
    pub(super) near: f64,
    pub(super) far: f64,
    pub(super) spacing: f64,
    pub(super) perspective: bool,
    /// Names of the half-spaces: faces of the box, then clip planes.
    pub(super) sides: Vec<String>,
    /// Size of the drawing.
    pub(super) drawing: [u32; 2],
    /// The arrow of the view direction in the drawing.
    pub(super) arrow: [[f64; 2]; 2],
    /// Corners of the box in the drawing, x fastest.
    pub(super) corners: Vec<[f64; 2]>,
    /// Sizes of labels: on wide and on narrow windows.
    pub(super) sizes: [LabelSize; 2],
    /// The drawing's labels at each of these sizes.
    pub(super) labels: [Vec<Label>; 2],
    pub(super) slices: Vec<SliceRecord>,
}

/// The drawing's camera: parallel rays from the side, so that the stack runs from left to right.
pub(super) struct Side {
    view: View,
}

impl Side {
    pub(super) fn new(grid: &Grid, view: &View) -> Result<Self> {
        let direction = (-view.forward * 0.42 + view.right * 0.78 + view.up * 0.46).normalize();
        let center = grid.center();
        let eye = center + direction * (4.0 * grid.radius());
        // The sphere around the box, and room for labels.
        let height = 2.1 * grid.radius();
        let camera =
            Camera::new(Placement::LookAt { eye, target: center, up: view.up }, Projection::Orthographic { height: Some(height) })?;
        Ok(Self { view: camera.resolve(grid, WIDTH, HEIGHT)? })
    }

    /// Where a point of the world is drawn.
    pub(super) fn at(&self, world: DVec3) -> [f64; 2] {
        let (x, y) = self.view.window(world);
        [x, y]
    }
}

fn polygon_record(stack: &Stack, grid: &Grid, side: &Side, k: u64, fog: Option<&Fog>, layouts: &[Layout; 2]) -> SliceRecord {
    let depth = stack.depth(k);
    let planar = fog.filter(|f| f.distance() == FogDistance::Planar);
    let mut record = SliceRecord {
        slice: k,
        depth,
        fog: planar.map(|f| f.factor(depth)),
        vertices: Vec::new(),
        edges: Vec::new(),
        sides: Vec::new(),
        corner: None,
    };
    let Some(SlicePolygon { vertices, edges, sides, .. }) = stack.polygon(k) else { return record };
    let n = vertices.len();
    let drawn: Vec<[f64; 2]> = vertices.iter().map(|v| side.at(grid.index_to_world().transform_point3(v.index))).collect();
    let numbers = layouts.each_ref().map(|layout| layout.numbers(&drawn));
    record.vertices = (0..n)
        .map(|i| VertexRecord {
            window: vertices[i].window.to_array(),
            texture: vertices[i].texture.to_array(),
            on: [sides[(i + n - 1) % n], sides[i]],
            drawn: drawn[i],
            labels: numbers.each_ref().map(|places| places[i]),
        })
        .collect();
    record.edges = edges.iter().map(|e| [e.a, e.b, e.c]).collect();
    record.sides = sides;
    // The first corner inside the picture, with its block's grid around it.
    let (w, h) = (f64::from(stack.view.width), f64::from(stack.view.height));
    let inside = vertices.iter().find(|v| v.window.x >= 0.0 && v.window.y >= 0.0 && v.window.x < w && v.window.y < h);
    record.corner = inside.map(|v| {
        let (x, y) = (v.window.x as i64 - 4, v.window.y as i64 - 4);
        let covered = (0..64).filter(|i| stack.covers(k, (x + i % 8) as f64 + 0.5, (y + i / 8) as f64 + 0.5));
        CornerRecord { x, y, covered: format!("{:016x}", covered.fold(0u64, |bits, i| bits | 1 << i)) }
    });
    record
}

impl StackRecord {
    /// The stack with its slices in `range`.
    pub(super) fn new(stack: &Stack, grid: &Grid, side: &Side, range: Range<u64>, fog: Option<&Fog>) -> Self {
        let faces = ["x low", "x high", "y low", "y high", "z low", "z high"].map(str::to_owned);
        let clips = (6..stack.half_spaces.len()).map(|i| format!("clip plane {}", i - 5));
        let (center, radius, forward) = (grid.center(), grid.radius(), stack.view.forward);
        let arrow = [side.at(center - forward * (1.45 * radius)), side.at(center - forward * (1.02 * radius))];
        let corners: Vec<[f64; 2]> = grid.corners().iter().map(|&c| side.at(c)).collect();
        let mut layouts = SIZES.map(Layout::new);
        let labels = layouts.each_mut().map(|layout| {
            layout.keep_clear(arrow[0], arrow[1]);
            box_edges(grid, side).iter().for_each(|&(a, b, _)| layout.keep_clear(a, b));
            layout.still(arrow, &corners)
        });
        Self {
            count: stack.count,
            near: stack.near,
            far: stack.far,
            spacing: stack.spacing,
            perspective: stack.perspective,
            sides: faces.into_iter().chain(clips).collect(),
            drawing: [WIDTH, HEIGHT],
            arrow,
            corners,
            sizes: SIZES,
            labels,
            slices: range.map(|k| polygon_record(stack, grid, side, k, fog, &layouts)).collect(),
        }
    }

    /// The box and outlines of its slices, over nothing.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the drawing has no memory.
    pub(super) fn draw(&self, grid: &Grid, side: &Side) -> Result<Pixmap> {
        let mut map = Pixmap::new(WIDTH, HEIGHT).ok_or_else(|| Error::invalid("no memory for a drawing"))?;
        let box_edges = box_edges(grid, side);
        let line = |map: &mut Pixmap, path: &Option<Path>, rgba: [u8; 4], width: f32, dashed: bool| {
            let Some(path) = path else { return };
            let mut paint = Paint::default();
            paint.set_color(Color::from_rgba8(rgba[0], rgba[1], rgba[2], rgba[3]));
            let dash = if dashed { StrokeDash::new(vec![5.0, 5.0], 0.0) } else { None };
            let stroke = Stroke { width, dash, ..Stroke::default() };
            map.stroke_path(path, &paint, &stroke, Transform::identity(), None);
        };
        let segment = |a: [f64; 2], b: [f64; 2]| {
            let mut path = PathBuilder::new();
            path.move_to(a[0] as f32, a[1] as f32);
            path.line_to(b[0] as f32, b[1] as f32);
            path.finish()
        };
        // Greys that show on white and on black.
        for &(a, b, _) in box_edges.iter().filter(|e| !e.2) {
            line(&mut map, &segment(a, b), [128, 128, 128, 190], 1.2, true);
        }
        let step = (self.slices.len() as u64).div_ceil(OUTLINES).max(1) as usize;
        for slice in self.slices.iter().skip(step / 2).step_by(step) {
            line(&mut map, &outline(slice), [96, 130, 170, 150], 1.0, false);
        }
        for &(a, b, _) in box_edges.iter().filter(|e| e.2) {
            line(&mut map, &segment(a, b), [128, 128, 128, 255], 2.0, false);
        }
        Ok(map)
    }
}

fn outline(slice: &SliceRecord) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (i, v) in slice.vertices.iter().enumerate() {
        let (x, y) = (v.drawn[0] as f32, v.drawn[1] as f32);
        if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    path.close();
    path.finish()
}

/// The box's edges in the drawing, and whether they lie on its visible side.
fn box_edges(grid: &Grid, side: &Side) -> Vec<([f64; 2], [f64; 2], bool)> {
    let corners = grid.corners();
    let center = grid.center();
    // Whether the face at the lower or upper end of an axis looks at the eye.
    let visible = |axis: usize, upper: bool| {
        let at = if upper { 1 << axis } else { 0 };
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let normal = (corners[at | u] - corners[at]).cross(corners[at | v] - corners[at]);
        let outward = normal * normal.dot(corners[at] - center);
        outward.dot(side.view.forward) < 0.0
    };
    let mut edges = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for c in 0..4 {
            let (bu, bv) = (c & 1 == 1, c & 2 == 2);
            let from = usize::from(bu) << u | usize::from(bv) << v;
            edges.push((side.at(corners[from]), side.at(corners[from | 1 << axis]), visible(u, bu) || visible(v, bv)));
        }
    }
    edges
}
