//! Samples that every ray has at depths of its own: on spherical shells about the eye, and in stacks that are shifted pixel by pixel.
//!
//! ```text
//!        r0                      r1        shells: slab k = [r0 + k D, r0 + (k+1) D] of the distance from the eye, D = (r1 - r0) / N
//!   eye o )--.--)--.--)--.--)--.--)        shifted: slab k = [d0 + (k + j) D, d0 + (k + 1 + j) D] of the depth, j in [-1/2,1/2)
//!            k=0   k=1   k=2   k=3
//! ```

use super::Stack;
use crate::scene::{Algorithm, Scene, View};
use crate::volume::Grid;
use glam::DVec3;

/// How samples lie along the rays of a frame, where not on flat slices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RaySteps {
    /// Distance from the eye at which the first shell's slab begins, and the slabs' thickness; none for flat slices.
    shells: Option<(f64, f64)>,
    /// What shifts depend on, where rays are shifted.
    jitter: Option<u32>,
}

/// The slabs of one ray: slab k begins at depth near + k spacing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RaySlabs {
    pub(crate) near: f64,
    pub(crate) spacing: f64,
}

impl RaySteps {
    /// Those of `scene` in as many slabs as `stack` has through the box of `grid`; `None` where all samples lie on flat slices.
    pub(crate) fn of(scene: &Scene, grid: &Grid, stack: &Stack) -> Option<Self> {
        let shells = is_in_shells(scene, &stack.view).then(|| {
            let (near, far) = shell_range(grid, &stack.view);
            (near, (far - near) / stack.count.max(1) as f64)
        });
        let jitter = scene.jitter();
        (shells.is_some() || jitter.is_some()).then_some(Self { shells, jitter })
    }

    /// Whether slabs lie between shells.
    pub(crate) fn in_shells(&self) -> bool {
        self.shells.is_some()
    }

    /// Thickness of a slab of `stack`, world units: along the rays where it lies between shells, along the depth else.
    pub(crate) fn thickness(&self, stack: &Stack) -> f64 {
        self.shells.map_or(stack.spacing, |(_, thickness)| thickness)
    }

    /// The slabs of the ray through pixel (x,y), which has a length of `slant` per unit of depth.
    pub(crate) fn slabs(&self, stack: &Stack, (x, y): (u32, u32), slant: f64) -> RaySlabs {
        let (near, spacing) = match self.shells {
            Some((near, thickness)) => (near / slant, thickness / slant),
            None => (stack.near, stack.spacing),
        };
        RaySlabs { near: near + self.jitter.map_or(0.0, |seed| shift(x, y, seed)) * spacing, spacing }
    }

    /// More than the index coordinates of samples of one number in a block of 8 x 8 pixels of `stack` may differ by along each axis.
    pub(crate) fn reach(&self, stack: &Stack) -> [f64; 3] {
        let view = &stack.view;
        let away = self.shells.map_or(stack.far, |(near, thickness)| near + thickness * stack.count as f64);
        // Between pixels at the far ends of a block's diagonal, and a slab of shift.
        let wide = 10.0 * view.scale * if stack.perspective { away } else { 1.0 };
        let deep = if self.jitter.is_some() { self.thickness(stack) * Self::steepest(stack) } else { 0.0 };
        stack.index.map(|f| {
            let middle = if stack.perspective { 0.5 * (f.b * f64::from(view.width) + f.c * f64::from(view.height)) } else { 0.0 };
            DVec3::new(f.b / view.scale, f.c / view.scale, f.g + middle).length() * (wide + deep)
        })
    }

    /// The greatest length of a ray per unit of depth.
    fn steepest(stack: &Stack) -> f64 {
        let (px, py) = stack.view.plane(0.0, 0.0);
        if stack.perspective { (1.0 + (px * px + py * py)).sqrt() } else { 1.0 }
    }
}

/// Whether `scene` is drawn in spherical shells: along parallel rays those are flat slices.
pub(crate) fn is_in_shells(scene: &Scene, view: &View) -> bool {
    scene.algorithm() == Algorithm::Shells && view.perspective
}

/// Distances from the eye between which shells fill the box of `grid`: from its nearest point, or from the near plane, to its farthest corner.
pub(crate) fn shell_range(grid: &Grid, view: &View) -> (f64, f64) {
    let farthest = grid.corners().iter().map(|c| c.distance(view.eye)).fold(0.0, f64::max);
    (nearest(grid, view.eye).max(view.near), farthest)
}

/// Distance of `eye` to the box of `grid`, 0 in it.
fn nearest(grid: &Grid, eye: DVec3) -> f64 {
    let (low, high) = grid.index_bounds();
    let at = grid.world_to_index().transform_point3(eye);
    if at.cmpge(low).all() && at.cmple(high).all() {
        return 0.0;
    }
    // The nearest point lies in a face, where its foot is in that, or else on an edge. Axes may be oblique.
    let corners = grid.corners();
    let mut least = f64::INFINITY;
    for face in 0..6 {
        let (axis, side) = (face / 2, face % 2);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let first = side << axis;
        let (origin, a, b) = (corners[first], corners[first | 1 << u] - corners[first], corners[first | 1 << v] - corners[first]);
        let way = eye - origin;
        let (aa, ab, bb, wa, wb) = (a.dot(a), a.dot(b), b.dot(b), way.dot(a), way.dot(b));
        let det = aa * bb - ab * ab;
        let (s, t) = ((wa * bb - wb * ab) / det, (wb * aa - wa * ab) / det);
        if det > 0.0 && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            least = least.min((way - a * s - b * t).length());
        }
        for (from, along) in [(origin, a), (origin, b), (origin + b, a), (origin + a, b)] {
            let length = along.dot(along);
            let share = if length > 0.0 { ((eye - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
            least = least.min((eye - from - along * share).length());
        }
    }
    least
}

/// The shift of the pixel in column `x` and row `y`, in slabs, -1/2 up to but without 1/2: a hash of both and of `seed`, by integer operations alone.
///
/// Each number goes through the finalizer "lowbias32" (C. Wellons, Hash Function Prospector, 2018), which turns every bit of the
/// hash for half of all changes of one bit of the number: neighbours have nothing in common.
fn shift(x: u32, y: u32, seed: u32) -> f64 {
    let hash = mixed(x.wrapping_add(mixed(y.wrapping_add(mixed(seed ^ 0x9e37_79b9)))));
    f64::from(hash) / 4_294_967_296.0 - 0.5
}

/// "lowbias32".
fn mixed(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use glam::DMat3;

    #[test]
    fn shifts_fill_the_slab_evenly_and_neighbours_do_not_go_together() {
        const SIDE: u32 = 256;
        for seed in [0, 1, 77, u32::MAX] {
            let at = |x: u32, y: u32| shift(x, y, seed);
            let mut bins = [0u32; 16];
            let (mut sum, mut squares) = (0.0, 0.0);
            let mut products = [0.0; 5];
            for y in 0..SIDE {
                for x in 0..SIDE {
                    let j = at(x, y);
                    assert!((-0.5..0.5).contains(&j));
                    bins[((j + 0.5) * 16.0) as usize] += 1;
                    (sum, squares) = (sum + j, squares + j * j);
                    let others = [at(x + 1, y), at(x, y + 1), at(x + 1, y + 1), at(x + 8, y), shift(x, y, seed.wrapping_add(1))];
                    products.iter_mut().zip(others).for_each(|(p, other)| *p += j * other);
                }
            }
            let count = f64::from(SIDE * SIDE);
            // Five standard deviations of what chance does.
            let rough = 5.0 / count.sqrt();
            assert!((sum / count).abs() < rough * 0.29 && (12.0 * squares / count - 1.0).abs() < rough, "{sum} {squares}");
            assert!(products.iter().all(|p| (12.0 * p / count).abs() < rough), "{products:?}");
            assert!(bins.iter().all(|&b| (f64::from(b) - count / 16.0).abs() < 5.0 * (count / 16.0).sqrt()), "{bins:?}");
        }
        // Numbers that no version may change: pictures on record depend on them.
        let known = [shift(0, 0, 0), shift(1, 0, 0), shift(0, 1, 0), shift(511, 300, 7)];
        assert_eq!(known.map(|j| ((j + 0.5) * 4_294_967_296.0) as u32), KNOWN);
    }

    /// See the test above: worked out by a program of its own.
    const KNOWN: [u32; 4] = [2_488_251_732, 516_850_854, 3_330_041_933, 442_813_609];

    #[test]
    fn shells_begin_at_the_boxs_nearest_point() {
        let shear = DMat3::from_cols(DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.3, -1.4, 0.1), DVec3::new(0.0, 0.4, 0.7));
        for axes in [DMat3::IDENTITY, shear] {
            let grid = Grid::new([5, 4, 3], DVec3::new(1.0, -2.0, 3.0), axes).unwrap();
            let (low, high) = grid.index_bounds();
            for n in 0..40 {
                let turn = |k: f64| f64::from(n) * k % 1.0;
                let eye = grid.center() + DVec3::new(turn(0.37) - 0.5, turn(0.71) - 0.5, turn(0.23) - 0.5) * 20.0;
                // All points of a fine lattice over the box.
                let mut least = f64::INFINITY;
                for i in 0..=30 {
                    for j in 0..=30 {
                        for k in 0..=30 {
                            let share = DVec3::new(f64::from(i), f64::from(j), f64::from(k)) / 30.0;
                            let point = grid.index_to_world().transform_point3(low + (high - low) * share);
                            least = least.min(point.distance(eye));
                        }
                    }
                }
                let got = nearest(&grid, eye);
                assert!(got <= least + 1e-12 && least - got < 0.2, "{n}: {got}, not {least}");
            }
            assert_eq!(nearest(&grid, grid.center()), 0.0);
        }
    }
}
