//! The fog factor on one slice: one number, or one for each fragment, or linear between corners.

use crate::proxy::{SlicePolygon, Stack};
use crate::scene::{Fog, FogDistance, FogEvaluation, FogWeighting, OpenGl, TableColors, View};
use glam::DVec2;

/// The factor f of one slice: 1 = clear, 0 = nothing but fog.
pub(super) enum SliceFog {
    /// Planar distance: every fragment of a view-aligned slice has the slice's own.
    Uniform(f32),
    /// Radial distance at each fragment.
    Fragment {
        /// The slice's depth.
        depth: f64,
    },
    /// Radial distance at the corners.
    Vertex(Fan),
}

/// A slice polygon as triangles around the mean of its corners, and a function linear in each.
///
/// OpenGL leaves open how a polygon is split. This way does not depend on which corner comes first.
pub(super) struct Fan {
    center: DVec2,
    triangles: Vec<Triangle>,
}

/// One triangle: the centre, a corner and the next.
struct Triangle {
    /// From the centre to the first corner.
    first: DVec2,
    /// From the centre to the second corner.
    second: DVec2,
    /// a + b x + c y of the value, from the centre.
    value: [f64; 3],
}

impl Fan {
    fn new(polygon: &SlicePolygon, at: impl Fn(DVec2) -> f64) -> Self {
        let corners: Vec<DVec2> = polygon.vertices.iter().map(|v| v.window).collect();
        let center = corners.iter().copied().sum::<DVec2>() / corners.len() as f64;
        let middle = at(center);
        let triangles = (0..corners.len())
            .filter_map(|i| {
                let (p, q) = (corners[i], corners[(i + 1) % corners.len()]);
                let (first, second) = (p - center, q - center);
                let area = first.perp_dot(second);
                let (dp, dq) = (at(p) - middle, at(q) - middle);
                let b = (dp * second.y - dq * first.y) / area;
                let c = (dq * first.x - dp * second.x) / area;
                // A triangle without area has no fragments of its own.
                (b.is_finite() && c.is_finite()).then_some(Triangle { first, second, value: [middle, b, c] })
            })
            .collect();
        Self { center, triangles }
    }

    /// The value at window position `p`, from the triangle whose wedge it lies in.
    fn at(&self, p: DVec2) -> f64 {
        let v = p - self.center;
        // Inside the wedge both products have the sign of the triangle's area.
        let inside = |t: &&Triangle| {
            let sign = t.first.perp_dot(t.second).signum();
            t.first.perp_dot(v) * sign >= 0.0 && v.perp_dot(t.second) * sign >= 0.0
        };
        let triangle = self.triangles.iter().find(inside).or(self.triangles.first());
        triangle.map_or(1.0, |t| t.value[0] + t.value[1] * v.x + t.value[2] * v.y)
    }
}

/// Distance from the eye to the point at depth `d` behind window position (x,y).
fn radial(view: &View, d: f64, x: f64, y: f64) -> f64 {
    let (px, py) = view.plane(x, y);
    if view.perspective { d * (1.0 + px * px + py * py).sqrt() } else { (d * d + px * px + py * py).sqrt() }
}

impl SliceFog {
    /// The fog of slice `k`.
    pub(super) fn new(fog: &Fog, state: &OpenGl, stack: &Stack, k: u64) -> Self {
        let depth = stack.depth(k);
        match (fog.distance(), state.fog_evaluation) {
            (FogDistance::Planar, _) => Self::Uniform(fog.factor(depth) as f32),
            (FogDistance::Radial, FogEvaluation::Fragment) => Self::Fragment { depth },
            (FogDistance::Radial, FogEvaluation::Vertex) => match stack.polygon(k) {
                Some(polygon) => Self::Vertex(Fan::new(&polygon, |p| fog.factor(radial(&stack.view, depth, p.x, p.y)))),
                // A polygon too thin for corners.
                None => Self::Fragment { depth },
            },
        }
    }

    /// f at window position (x,y).
    #[inline]
    pub(super) fn factor(&self, fog: &Fog, view: &View, x: f64, y: f64) -> f32 {
        match self {
            Self::Uniform(f) => *f,
            Self::Fragment { depth } => fog.factor(radial(view, *depth, x, y)) as f32,
            Self::Vertex(fan) => fan.at(DVec2::new(x, y)).clamp(0.0, 1.0) as f32,
        }
    }
}

/// How fog meets a colour.
pub(super) struct Mix {
    color: [f32; 3],
    /// Whether the fog's share is multiplied by the fragment's opacity: what premultiplied colours need.
    weighted: bool,
}

impl Mix {
    pub(super) fn new(fog: &Fog, state: &OpenGl) -> Self {
        // Straight colours meet their opacity in the blend function, and the fog with them.
        let weighted = fog.weighting() == FogWeighting::Alpha && state.table_colors == TableColors::Premultiplied;
        Self { color: fog.color().map(|c| c as f32), weighted }
    }

    /// C' = f C + (1-f) C_fog, the fog weighted by opacity where that is asked for. Opacity stays.
    #[inline(always)]
    pub(super) fn apply(&self, f: f32, [r, g, b, a]: [f32; 4]) -> [f32; 4] {
        let w = if self.weighted { (1.0 - f) * a } else { 1.0 - f };
        let k = &self.color;
        [f * r + w * k[0], f * g + w * k[1], f * b + w * k[2], a]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, FogMode, Placement, Projection};
    use crate::volume::Grid;
    use glam::DVec3;

    #[test]
    fn fog_is_mixed_with_or_without_the_opacity() {
        let fog = Fog::new(FogMode::Exp { density: 1.0 }, [1.0, 0.5, 0.0]).expect("fog");
        let literal = fog.with_weighting(FogWeighting::Literal);
        let color = [0.2, 0.2, 0.2, 0.5];
        let premultiplied = OpenGl::default();
        assert_eq!(Mix::new(&fog, &premultiplied).apply(0.5, color), [0.35, 0.225, 0.1, 0.5]);
        assert_eq!(Mix::new(&literal, &premultiplied).apply(0.5, color), [0.6, 0.35, 0.1, 0.5]);
        assert_eq!(Mix::new(&fog, &OpenGl::straight()).apply(0.5, color), [0.6, 0.35, 0.1, 0.5]);
        assert_eq!(Mix::new(&literal, &premultiplied).apply(1.0, color), color);
    }

    #[test]
    fn fog_by_vertex_is_exact_at_corners_and_linear_between() {
        let grid = Grid::with_spacing([8; 3], [1.0; 3]).expect("grid");
        let c = grid.center();
        let camera = Camera::new(
            Placement::LookAt { eye: c + DVec3::new(3.0, 4.0, 12.0), target: c, up: DVec3::Y },
            Projection::Perspective { fov_y: 60.0 },
        );
        let view = camera.expect("camera").resolve(&grid, 64, 64).expect("view");
        let stack = Stack::new(&grid, &view, &[], 8);
        let fog = Fog::new(FogMode::Exp { density: 0.1 }, [1.0; 3]).expect("fog").with_distance(FogDistance::Radial);
        let state = OpenGl { fog_evaluation: FogEvaluation::Vertex, ..OpenGl::default() };
        let mut differ = 0.0f32;
        for k in 0..8 {
            let polygon = stack.polygon(k).expect("polygon");
            let (vertex, fragment) = (SliceFog::new(&fog, &state, &stack, k), SliceFog::new(&fog, &OpenGl::default(), &stack, k));
            let at = |f: &SliceFog, p: DVec2| f.factor(&fog, &view, p.x, p.y);
            let n = polygon.vertices.len();
            for i in 0..n {
                let (p, q) = (polygon.vertices[i].window, polygon.vertices[(i + 1) % n].window);
                assert!((at(&vertex, p) - at(&fragment, p)).abs() < 1e-6);
                let mean = 0.5 * (at(&vertex, p) + at(&vertex, q));
                assert!((at(&vertex, (p + q) * 0.5) - mean).abs() < 1e-6);
                differ = differ.max((at(&vertex, (p + q) * 0.5) - at(&fragment, (p + q) * 0.5)).abs());
            }
        }
        assert!(differ > 1e-3, "{differ}");
        // The point in the middle of the picture lies straight ahead: its distance is its depth.
        assert!((radial(&view, 7.0, 32.0, 32.0) - 7.0).abs() < 1e-12);
    }
}
