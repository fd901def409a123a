//! The stack of view-aligned slice planes, and the box as half-spaces along the rays of the picture.
//!
//! ```text
//!   eye      d0   D                     d1
//!    o ------|--+--|--+--|--+--|--+--|--+-|-----> depth d
//!               k=0   k=1   k=2            slab k = [d0 + kD, d0 + (k+1)D], plane k in its middle
//! ```

use super::polygon::{Edge, SlicePolygon};
use crate::lean::extra;
use crate::scene::{ClipPlane, View};
use crate::volume::Grid;
use glam::DVec3;

/// A face of the box or a clip plane as a function of window position (x,y) and depth d: inside where it is not negative.
///
/// `a + b x + c y + g d` in orthographic views, `a + d (g + b x + c y)` in perspective. Affine in (x,y) on every slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// Constant part.
    pub a: f64,
    /// Part along window x.
    pub b: f64,
    /// Part along window y.
    pub c: f64,
    /// Part along depth.
    pub g: f64,
}

impl HalfSpace {
    /// The linear function n . p + e of world space, seen through `view`.
    pub(crate) fn of(view: &View, n: DVec3, e: f64) -> Self {
        let (w, h) = (0.5 * f64::from(view.width), 0.5 * f64::from(view.height));
        // A world direction as it changes with window x and y, and the offset of the window's corner.
        let (across, down) = (view.right * view.scale, -view.up * view.scale);
        let corner = -across * w - down * h;
        let (b, c) = (n.dot(across), n.dot(down));
        if view.perspective {
            Self { a: n.dot(view.eye) + e, b, c, g: n.dot(view.forward) + n.dot(corner) }
        } else {
            Self { a: n.dot(view.eye) + n.dot(corner) + e, b, c, g: n.dot(view.forward) }
        }
    }

    /// The function along the ray through window position (x,y): its value at depth 0, and its change per unit of depth.
    pub(crate) fn along(&self, perspective: bool, x: f64, y: f64) -> (f64, f64) {
        let plane = self.b * x + self.c * y;
        if perspective { (self.a, self.g + plane) } else { (self.a + plane, self.g) }
    }

    /// Coefficients (a,b,c) of the edge function a + b x + c y on the slice at depth `d`.
    pub fn at_depth(&self, perspective: bool, d: f64) -> [f64; 3] {
        if perspective { [self.a + self.g * d, self.b * d, self.c * d] } else { [self.a + self.g * d, self.b, self.c] }
    }
}

/// A stack of view-aligned slices through a box, cut by clip planes.
///
/// # Guarantees
/// `count` >= 1 and `spacing` > 0, unless [`Stack::is_empty`].
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    /// Whether rays meet in the eye.
    pub perspective: bool,
    /// Depth of the first slab's near side, world units.
    pub near: f64,
    /// Depth of the last slab's far side, world units.
    pub far: f64,
    /// Distance between planes, world units.
    pub spacing: f64,
    /// Number of planes.
    pub count: u64,
    /// Faces of the box (lower then upper, x, y, z), then the clip planes.
    pub half_spaces: Vec<HalfSpace>,
    /// Index coordinates as functions of window position and depth, of the form of [`HalfSpace`].
    pub index: [HalfSpace; 3],
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
    /// The view the stack is aligned to.
    pub view: View,
}

impl Stack {
    /// The depths [near, far] of a grid's box before the view's near plane is passed; `None` when nothing of it is before the eye.
    pub fn depth_range(grid: &Grid, view: &View) -> Option<(f64, f64)> {
        let depths = grid.corners().map(|c| view.depth(c));
        let near = depths.iter().copied().fold(f64::INFINITY, f64::min).max(view.near);
        let far = depths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (far > near).then_some((near, far))
    }

    /// `count` slices through the box of `grid` as `view` sees it.
    pub fn new(grid: &Grid, view: &View, clip_planes: &[ClipPlane], count: u64) -> Self {
        match Self::depth_range(grid, view) {
            Some(range) => Self::between(grid, view, clip_planes, range, count),
            None => Self::between(grid, view, clip_planes, (0.0, 0.0), 0),
        }
    }

    /// `count` slices whose slabs fill the depths from `near` to `far`, world units, whatever the box of `grid` takes of them: a stack that
    /// is given from outside.
    pub fn between(grid: &Grid, view: &View, clip_planes: &[ClipPlane], (near, far): (f64, f64), count: u64) -> Self {
        let to_index = grid.world_to_index();
        let compose = |n: DVec3, e: f64| HalfSpace::of(view, n, e);
        let row = |axis: usize| (to_index.matrix3.row(axis), to_index.translation[axis]);
        let index = [0, 1, 2].map(|axis| {
            let (n, e) = row(axis);
            compose(n, e)
        });
        let (lo, hi) = grid.index_bounds();
        let mut half_spaces = Vec::with_capacity(6 + clip_planes.len());
        for axis in 0..3 {
            let f = index[axis];
            half_spaces.push(HalfSpace { a: f.a - lo[axis], ..f });
            half_spaces.push(HalfSpace { a: hi[axis] - f.a, b: -f.b, c: -f.c, g: -f.g });
        }
        half_spaces.extend(extra(Some(clip_planes)).into_iter().flatten().map(|p| compose(p.normal(), -p.offset())));
        let spacing = if count == 0 { 0.0 } else { (far - near) / count as f64 };
        Self { perspective: view.perspective, near, far, spacing, count, half_spaces, index, dims: grid.dims(), view: *view }
    }

    /// Whether there is nothing to slice: the box lies behind the eye.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Depth of plane `k`.
    #[inline]
    pub fn depth(&self, k: u64) -> f64 {
        self.near + (k as f64 + 0.5) * self.spacing
    }

    /// Index coordinates of window position (x,y) at depth `d`.
    pub fn index_at(&self, x: f64, y: f64, d: f64) -> DVec3 {
        DVec3::from_array(self.index.map(|f| {
            let [a, b, c] = f.at_depth(self.perspective, d);
            a + b * x + c * y
        }))
    }

    /// Whether window position (x,y) lies in the polygon of slice `k`, by its edge functions and the fill rule.
    pub fn covers(&self, k: u64, x: f64, y: f64) -> bool {
        let d = self.depth(k);
        self.half_spaces.iter().all(|h| Edge::new(h.at_depth(self.perspective, d)).contains(x, y))
    }

    /// The polygon of slice `k`; `None` where the plane misses what the clip planes leave of the box.
    pub fn polygon(&self, k: u64) -> Option<SlicePolygon> {
        SlicePolygon::cut(self, self.depth(k))
    }
}
