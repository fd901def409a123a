//! One slice: a plane of constant depth cut with the box and the clip planes.

use super::Stack;
use glam::{DVec2, DVec3};

/// One side of a slice polygon as an edge function a + b x + c y of window position: inside where it is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Constant part.
    pub a: f64,
    /// Part along window x.
    pub b: f64,
    /// Part along window y.
    pub c: f64,
}

impl Edge {
    /// The edge with coefficients (a,b,c).
    pub fn new([a, b, c]: [f64; 3]) -> Self {
        Self { a, b, c }
    }

    /// The edge function at window position (x,y).
    pub fn eval(&self, x: f64, y: f64) -> f64 {
        self.a + (self.b * x + self.c * y)
    }

    /// Whether (x,y) is inside. A position on the edge itself is inside if this is a left edge (what is inside lies towards
    /// larger x) or a top edge (horizontal, inside below): of two polygons that share an edge exactly one has it.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        let e = self.eval(x, y);
        e > 0.0 || (e == 0.0 && (self.b > 0.0 || (self.b == 0.0 && self.c >= 0.0)))
    }
}

/// A corner of a slice polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Window position in pixels, y down.
    pub window: DVec2,
    /// Texture coordinates (s,t,p) in `[0,1]` across the box of cells; q is 1.
    pub texture: DVec3,
    /// Index coordinates.
    pub index: DVec3,
}

/// A convex polygon of 3 or more vertices, counter-clockwise as seen on the screen (y up).
///
/// Edge `i` leads from vertex `i` to the next and lies on half-space [`SlicePolygon::sides`]`[i]` of the stack.
#[derive(Debug, Clone, PartialEq)]
pub struct SlicePolygon {
    /// Depth of the plane, world units.
    pub depth: f64,
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Edge functions.
    pub edges: Vec<Edge>,
    /// Which half-space of the stack each edge lies on.
    pub sides: Vec<usize>,
}

/// A polygon under construction: corners, and the half-space of the side that leaves each.
type Outline = Vec<(DVec2, usize)>;

impl SlicePolygon {
    /// Cuts the plane at depth `d`: a rectangle around the box's shadow, clipped by one half-space after the other.
    ///
    /// Half-spaces are affine in window coordinates on the plane, so corners come from two of them each, and corners where three
    /// meet (the plane through an edge or a vertex of the box) are merged.
    pub(super) fn cut(stack: &Stack, d: f64) -> Option<Self> {
        let edges: Vec<Edge> = stack.half_spaces.iter().map(|h| Edge::new(h.at_depth(stack.perspective, d))).collect();
        let mut outline = start(&edges)?;
        let size = outline.iter().map(|(p, _)| p.abs().max_element()).fold(1.0, f64::max);
        for (side, edge) in edges.iter().enumerate() {
            outline = clip(&outline, edge, side);
            if outline.len() < 3 {
                return None;
            }
        }
        merge(&mut outline, size * 1e-13);
        if outline.len() < 3 || outline.iter().any(|&(_, side)| side == usize::MAX) {
            return None;
        }
        let dims = DVec3::from_array(stack.dims.map(|n| n as f64));
        let vertices = outline
            .iter()
            .map(|&(window, _)| {
                let index = stack.index_at(window.x, window.y, d);
                Vertex { window, texture: (index + 0.5) / dims, index }
            })
            .collect();
        let sides: Vec<usize> = outline.iter().map(|&(_, side)| side).collect();
        Some(Self { depth: d, vertices, edges: sides.iter().map(|&s| edges[s]).collect(), sides })
    }

    /// Area in square pixels.
    pub fn area(&self) -> f64 {
        let n = self.vertices.len();
        let twice: f64 = (0..n).map(|i| self.vertices[i].window.perp_dot(self.vertices[(i + 1) % n].window)).sum();
        0.5 * twice.abs()
    }

    /// Whether window position (x,y) is inside, by edge functions and fill rule.
    pub fn covers(&self, x: f64, y: f64) -> bool {
        self.edges.iter().all(|e| e.contains(x, y))
    }
}

/// A rectangle in the window that holds the whole cut: where opposite faces of the box meet the plane.
fn start(edges: &[Edge]) -> Option<Outline> {
    // Solve for the corners of the parallelogram of each pair of axes; the cut lies within every one that exists.
    let mut best: Option<(DVec2, DVec2)> = None;
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let corners: Option<Vec<DVec2>> =
            [(0, 0), (0, 1), (1, 0), (1, 1)].iter().map(|&(p, q)| meet(&edges[2 * i + p], &edges[2 * j + q])).collect();
        if let Some(c) = corners {
            let lo = c.iter().copied().fold(DVec2::INFINITY, DVec2::min);
            let hi = c.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
            if best.is_none_or(|(l, h)| (hi - lo).element_product() < (h - l).element_product()) {
                best = Some((lo, hi));
            }
        }
    }
    let (lo, hi) = best?;
    let margin = (hi - lo) * 0.5 + 1.0;
    let (lo, hi) = (lo - margin, hi + margin);
    // Counter-clockwise with y up is clockwise with y down.
    let corners = [lo, DVec2::new(lo.x, hi.y), hi, DVec2::new(hi.x, lo.y)];
    corners.iter().all(|c| c.is_finite()).then(|| corners.map(|c| (c, usize::MAX)).to_vec())
}

/// Where two edges' lines meet.
fn meet(e: &Edge, f: &Edge) -> Option<DVec2> {
    let det = e.b * f.c - e.c * f.b;
    let scale = (e.b.abs() + e.c.abs()) * (f.b.abs() + f.c.abs());
    (det.abs() > 1e-12 * scale).then(|| DVec2::new((e.c * f.a - e.a * f.c) / det, (e.a * f.b - e.b * f.a) / det))
}

/// Keeps what lies inside `edge`; the new side is marked `side`.
fn clip(outline: &Outline, edge: &Edge, side: usize) -> Outline {
    let mut kept = Outline::with_capacity(outline.len() + 1);
    for (i, &(p, from)) in outline.iter().enumerate() {
        let (q, _) = outline[(i + 1) % outline.len()];
        let (ep, eq) = (edge.eval(p.x, p.y), edge.eval(q.x, q.y));
        if ep >= 0.0 {
            kept.push((p, from));
        }
        if (ep >= 0.0) != (eq >= 0.0) {
            let x = p + (q - p) * (ep / (ep - eq));
            // Leaving: the new side starts here. Entering: the old side goes on from here.
            kept.push((x, if ep >= 0.0 { side } else { from }));
        }
    }
    kept
}

/// Merges corners closer than `tolerance`; the side between them has no length.
fn merge(outline: &mut Outline, tolerance: f64) {
    let mut i = 0;
    while i < outline.len() && outline.len() > 1 {
        let next = (i + 1) % outline.len();
        if (outline[i].0 - outline[next].0).abs().max_element() <= tolerance {
            // The side that leaves `next` is the one that goes on.
            outline[i].1 = outline[next].1;
            outline.remove(next);
        } else {
            i += 1;
        }
    }
}
