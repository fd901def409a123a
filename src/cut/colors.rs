//! Cuts through volumes of colours: the colours themselves, as much of them as their alpha says.

use crate::scene::Filter;
use crate::volume::{Channels, Colors, Volume};
use glam::DVec3;

/// Looks colours up.
pub(super) struct ColorLookup<'v> {
    colors: Colors<'v>,
    dims: [usize; 3],
    /// Whether colours have an alpha.
    alpha: bool,
    nearest: bool,
}

impl<'v> ColorLookup<'v> {
    /// Those of `volume`, by the filter nearest or linear; `None` where its voxels are values.
    pub(super) fn new(volume: &'v Volume, filter: Filter) -> Option<Self> {
        let alpha = *volume.channels() == Channels::Rgba;
        Some(Self { colors: volume.colors()?, dims: volume.grid().dims(), alpha, nearest: filter == Filter::Nearest })
    }

    /// The premultiplied colour of a voxel: numbers clamped to `[0,1]`, nothing where one is NaN or infinite.
    fn voxel(&self, [i, j, k]: [usize; 3]) -> [f64; 4] {
        let [r, g, b, a] = self.colors.get((k * self.dims[1] + j) * self.dims[0] + i);
        let a = if self.alpha { a } else { 1.0 };
        if ![r, g, b, a].iter().all(|x| x.is_finite()) {
            return [0.0; 4];
        }
        let a = a.clamp(0.0, 1.0);
        let [r, g, b] = [r, g, b].map(|c| c.clamp(0.0, 1.0) * a);
        [r, g, b, a]
    }

    /// The premultiplied colour at index coordinates `at`, clamped to the outermost voxels.
    pub(super) fn color(&self, at: DVec3) -> [f64; 4] {
        if self.nearest {
            // Halfway between two voxels the upper one counts, as in the pipeline.
            return self.voxel([0, 1, 2].map(|axis| (libm::floor(at[axis] + 0.5).max(0.0) as usize).min(self.dims[axis] - 1)));
        }
        let (mut low, mut t) = ([0; 3], [0.0; 3]);
        for axis in 0..3 {
            let last = self.dims[axis] - 1;
            let u = at[axis].clamp(0.0, last as f64);
            low[axis] = (u as usize).min(last.saturating_sub(1));
            t[axis] = u - low[axis] as f64;
        }
        let corner = |c: usize| self.voxel([0, 1, 2].map(|axis: usize| (low[axis] + (c >> axis & 1)).min(self.dims[axis] - 1)));
        let lerp = |a: [f64; 4], b: [f64; 4], t: f64| [0, 1, 2, 3].map(|i: usize| a[i] + t * (b[i] - a[i]));
        let along_x = [0, 2, 4, 6].map(|c| lerp(corner(c), corner(c + 1), t[0]));
        lerp(lerp(along_x[0], along_x[1], t[1]), lerp(along_x[2], along_x[3], t[1]), t[2])
    }
}
