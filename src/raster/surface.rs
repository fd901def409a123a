//! Level surfaces: where a ray meets one between two slices, and how it is lit.

use crate::proxy::Stack;
use crate::scene::{Straight, TransferFunction};
use crate::volume::Volume;
use glam::DVec3;

/// Share of a surface's colour that does not depend on its direction.
const AMBIENT: f64 = 0.2;
/// Halvings of the slab that holds the hit.
const HALVINGS: usize = 30;

/// The surface at one value of a volume, seen from the eye.
pub(crate) struct Surface<'f> {
    pub(crate) volume: &'f Volume,
    pub(crate) stack: &'f Stack,
    pub(crate) transfer: &'f TransferFunction,
}

impl Surface<'_> {
    /// Colour of the surface at value `level` that the ray through pixel (x,y) meets near slice position `at`.
    pub(crate) fn color(&self, level: f64, at: f64, x: usize, y: usize) -> Straight {
        let (wx, wy) = (x as f64 + 0.5, y as f64 + 0.5);
        let position = self.refined(level, at, wx, wy);
        let mut color = self.transfer.eval(level);
        color.alpha = 1.0;
        let facing = self.facing(self.index_at(wx, wy, position), wx, wy);
        color.rgb = color.rgb.map(|c| c * (AMBIENT + (1.0 - AMBIENT) * facing));
        color
    }

    /// Index coordinates at slice position `k` of the ray through window position (wx,wy).
    fn index_at(&self, wx: f64, wy: f64, k: f64) -> DVec3 {
        self.stack.index_at(wx, wy, self.stack.near + (k + 0.5) * self.stack.spacing)
    }

    /// The slice position at which the trilinear field crosses `level` within half a slice of `at`, by bisection; `at` where it does not.
    pub(crate) fn refined(&self, level: f64, at: f64, wx: f64, wy: f64) -> f64 {
        let above = |k: f64| self.volume.sample(self.index_at(wx, wy, k)) >= level;
        let (mut lo, mut hi) = (at - 0.5, at + 0.5);
        let side = above(hi);
        let mut k = at;
        if above(lo) != side {
            for _ in 0..HALVINGS {
                k = 0.5 * (lo + hi);
                if above(k) == side { hi = k } else { lo = k }
            }
        }
        k
    }

    /// Cosine between the ray and the field's gradient at `index`, 0 to 1; 1 where there is no gradient.
    fn facing(&self, index: DVec3, wx: f64, wy: f64) -> f64 {
        // Scaled first: squares of a gradient in the data's units may leave f64.
        let gradient = self.volume.gradient(index);
        let steepest = gradient.abs().max_element();
        let gradient = if steepest > 0.0 { gradient / steepest } else { DVec3::ZERO };
        let (_, ray) = self.stack.view.ray(wx, wy);
        if gradient == DVec3::ZERO { 1.0 } else { (gradient.normalize().dot(ray.normalize())).abs() }
    }
}
