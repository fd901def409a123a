//! The same picture the slow way: every slice of every pixel in f64, by nothing but the definitions.

use glam::DVec3;
use slicestack::proxy::Stack;
use slicestack::scene::{Blend, Fog, FogDistance, FogWeighting, Order, Slicing, Straight};
use slicestack::{Scene, Volume};

/// A slice in a pixel's way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fragment {
    pub(crate) depth: f64,
    /// Index coordinates.
    pub(crate) index: DVec3,
    /// Length of the piece of ray it stands for, world units.
    pub(crate) length: f64,
    /// Distance to the eye as fog has it.
    pub(crate) distance: f64,
}

/// A scene's slices over a volume.
pub(crate) struct Oracle<'a> {
    pub(crate) volume: &'a Volume,
    pub(crate) scene: &'a Scene,
    pub(crate) stack: Stack,
    unit: f64,
}

impl<'a> Oracle<'a> {
    pub(crate) fn new(volume: &'a Volume, scene: &'a Scene) -> Self {
        let (width, height) = scene.size();
        let view = scene.camera().resolve(volume.grid(), width, height).unwrap();
        let Slicing::Count(count) = scene.slicing() else { panic!("the slow picture counts slices") };
        let stack = Stack::new(volume.grid(), &view, scene.clip_planes(), count);
        let unit = scene.transfer().opacity_length(volume.grid());
        Self { volume, scene, stack, unit }
    }

    /// Depths at which the ray through window position (x,y) enters and leaves the box, the clip planes and the stack.
    pub(crate) fn path(&self, x: f64, y: f64) -> (f64, f64) {
        let grid = self.volume.grid();
        let (origin, direction) = self.stack.view.ray(x, y);
        let (at, step) = (grid.world_to_index().transform_point3(origin), grid.world_to_index().transform_vector3(direction));
        let (lo, hi) = grid.index_bounds();
        let (mut entry, mut exit) = (self.stack.near, self.stack.far);
        let mut keep = |height: f64, rate: f64| {
            if rate > 0.0 {
                entry = entry.max(-height / rate);
            } else if rate < 0.0 {
                exit = exit.min(-height / rate);
            } else if height < 0.0 {
                exit = f64::NEG_INFINITY;
            }
        };
        for axis in 0..3 {
            keep(at[axis] - lo[axis], step[axis]);
            keep(hi[axis] - at[axis], -step[axis]);
        }
        for p in self.scene.clip_planes() {
            keep(p.distance(origin), p.normal().dot(direction));
        }
        (entry, exit)
    }

    /// Slices whose polygons cover the pixel, nearest first.
    pub(crate) fn covering(&self, x: u32, y: u32) -> Vec<u64> {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        (0..self.stack.count).filter(|&k| self.stack.covers(k, x, y)).collect()
    }

    /// Pieces of the pixel's ray, one for each slice that covers it, nearest first; one in all for a ray that passes between two slices.
    pub(crate) fn fragments(&self, x: u32, y: u32) -> Vec<Fragment> {
        let mut covered = self.covering(x, y);
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let stack = &self.stack;
        let (entry, exit) = self.path(x, y);
        if covered.is_empty() && exit > entry + 1e-9 * stack.spacing {
            let middle = (0.5 * (entry + exit) - stack.near) / stack.spacing;
            covered.push((middle as u64).min(stack.count - 1));
        }
        let (first, last) = (covered.first().copied(), covered.last().copied());
        let (_, direction) = stack.view.ray(x, y);
        let fragment = |&k: &u64| {
            let near = if Some(k) == first { entry } else { stack.near + k as f64 * stack.spacing };
            let far = if Some(k) == last { exit } else { stack.near + (k + 1) as f64 * stack.spacing };
            Fragment { length: (far - near) * direction.length(), ..self.piece((x, y), stack.depth(k), 0.0) }
        };
        covered.iter().map(fragment).collect()
    }

    /// The piece of the ray through a window position whose value is taken at `depth`, as long as a step in depth of `thickness`.
    pub(crate) fn piece(&self, (x, y): (f64, f64), depth: f64, thickness: f64) -> Fragment {
        let (origin, direction) = self.stack.view.ray(x, y);
        let world = origin + direction * depth;
        let radial = self.scene.fog().is_some_and(|f| f.distance() == FogDistance::Radial);
        Fragment {
            depth,
            index: self.volume.grid().world_to_index().transform_point3(world),
            length: thickness * direction.length(),
            distance: if radial { world.distance(self.stack.view.eye) } else { depth },
        }
    }

    /// Value at a fragment; NaN where its cell touches a voxel that is none.
    pub(crate) fn value(&self, index: DVec3) -> f64 {
        let dims = self.volume.grid().dims();
        let low: [usize; 3] = std::array::from_fn(|a| (index[a].max(0.0) as usize).min(dims[a].saturating_sub(2)));
        for c in 0..8usize {
            let corner = std::array::from_fn(|a| (low[a] + (c >> a & 1)).min(dims[a] - 1));
            if !self.volume.value(corner).is_finite() {
                return f64::NAN;
            }
        }
        self.volume.sample(index)
    }

    /// Straight colour at a fragment, and the opacity of its piece.
    pub(crate) fn classified(&self, fragment: &Fragment) -> Straight {
        let color = self.scene.transfer().eval(self.value(fragment.index));
        let ratio = fragment.length / self.unit;
        let alpha = if color.alpha == 1.0 { 1.0 } else { -f64::exp_m1(ratio * f64::ln_1p(-color.alpha)) };
        Straight { rgb: color.rgb, alpha }
    }

    /// Premultiplied colour in fog, and opacity.
    pub(crate) fn fogged(&self, fragment: &Fragment) -> ([f64; 3], f64) {
        let color = self.classified(fragment);
        let rgb = color.rgb.map(|c| c * color.alpha);
        let finite = self.value(fragment.index).is_finite();
        match self.scene.fog().filter(|_| finite) {
            Some(fog) => (mix(fog, fragment.distance, rgb, color.alpha), color.alpha),
            None => (rgb, color.alpha),
        }
    }

    /// Premultiplied colour of a pixel over the background.
    pub(crate) fn pixel(&self, x: u32, y: u32) -> [f64; 4] {
        self.blended(&self.fragments(x, y))
    }

    /// Premultiplied colour of pieces, nearest first, over the background.
    pub(crate) fn blended(&self, fragments: &[Fragment]) -> [f64; 4] {
        let values: Vec<f64> = fragments.iter().map(|f| self.value(f.index)).filter(|v| v.is_finite()).collect();
        let shown = |value: Option<f64>| {
            value.map_or(([0.0; 3], 1.0), |v| {
                let color = self.scene.transfer().eval(v).premultiply();
                (color.rgb, 1.0 - color.alpha)
            })
        };
        let (rgb, transmittance) = match self.scene.blend() {
            Blend::Under => {
                let (mut sum, mut left) = ([0.0; 3], 1.0);
                let mut add = |f: &Fragment| {
                    let (rgb, alpha) = self.fogged(f);
                    sum = std::array::from_fn(|c| sum[c] + left * rgb[c]);
                    left *= 1.0 - alpha;
                };
                match self.scene.order() {
                    Order::FrontToBack => fragments.iter().for_each(&mut add),
                    Order::BackToFront => fragments.iter().rev().for_each(&mut add),
                }
                (sum, left)
            }
            Blend::AttenuatedMip { attenuation } => {
                let grid = self.volume.grid();
                let ((from, to), spacing) = (grid.index_bounds(), grid.spacing());
                let longest = (0..3).map(|a| (to[a] - from[a]) * spacing[a]).fold(0.0, f64::max);
                let (min, max) = (self.volume.statistics().min, self.volume.statistics().max);
                let [low, width] = self.scene.window().map_or([min, max - min], |[center, width]| [center - 0.5 * width, width]);
                let (mut best, mut sum) = (None, 0.0);
                for f in fragments.iter().filter(|f| self.value(f.index).is_finite()) {
                    let n = ((self.value(f.index) - low) / width).clamp(0.0, 1.0);
                    let seen = n * f64::exp(-attenuation * sum);
                    best = Some(best.map_or(seen, |b: f64| b.max(seen)));
                    sum += n * f.length / longest;
                }
                shown(best.map(|n| low + n * width))
            }
            Blend::Over => {
                // The closed sum over k of C_k times the product over j < k of (1 - A_j).
                let mut sum = [0.0; 3];
                let mut product = 1.0;
                for (rgb, alpha) in fragments.iter().map(|f| self.fogged(f)) {
                    sum = std::array::from_fn(|c| sum[c] + rgb[c] * product);
                    product *= 1.0 - alpha;
                }
                (sum, product)
            }
            Blend::Add => {
                let all = fragments.iter().map(|f| self.fogged(f));
                let (rgb, alpha) = all.fold(([0.0; 3], 0.0), |(s, t), (rgb, a)| (std::array::from_fn(|c| s[c] + rgb[c]), t + a));
                let end = |sum: f64| match self.scene.window() {
                    None => sum.min(1.0),
                    Some([center, width]) => ((sum - (center - width / 2.0)) / width).clamp(0.0, 1.0),
                };
                (rgb.map(end), 1.0 - end(alpha))
            }
            Blend::Mip => shown(values.iter().copied().reduce(f64::max)),
            Blend::Min => shown(values.iter().copied().reduce(f64::min)),
            Blend::Average => {
                let weighted = fragments.iter().map(|f| (self.value(f.index), f.length)).filter(|p| p.0.is_finite());
                let (sum, length) = weighted.fold((0.0, 0.0), |(s, l), (v, d)| (s + v * d, l + d));
                shown((length > 0.0).then(|| sum / length))
            }
            Blend::Lmip { threshold } => {
                let peak = values.windows(2).find(|w| w[0] >= threshold && w[1] < w[0]).map(|w| w[0]);
                shown(peak.or_else(|| values.iter().copied().reduce(f64::max)))
            }
            Blend::Iso { level } => match self.surface(fragments, level) {
                Some(rgb) => (rgb, 0.0),
                None => ([0.0; 3], 1.0),
            },
            other => panic!("the slow picture does not know the blend {other:?}"),
        };
        let back = self.scene.background().premultiply();
        let [r, g, b] = std::array::from_fn(|c| rgb[c] + transmittance * back.rgb[c]);
        [r, g, b, 1.0 - transmittance * (1.0 - back.alpha)]
    }

    /// The first crossing of `level`, found by bisection between two slices, lit from the eye.
    fn surface(&self, fragments: &[Fragment], level: f64) -> Option<[f64; 3]> {
        let above = |index: DVec3| self.value(index) >= level;
        let at = fragments.iter().enumerate().find_map(|(i, f)| {
            if i == 0 {
                return above(f.index).then_some(f.index);
            }
            let (mut a, mut b) = (fragments[i - 1].index, f.index);
            if above(a) == above(b) {
                return None;
            }
            for _ in 0..60 {
                let middle = (a + b) * 0.5;
                if above(middle) == above(a) { a = middle } else { b = middle }
            }
            Some((a + b) * 0.5)
        })?;
        let gradient = self.volume.gradient(at);
        let gradient = gradient / gradient.abs().max_element().max(f64::MIN_POSITIVE);
        let grid = self.volume.grid();
        let world = grid.index_to_world().transform_point3(at);
        let view = &self.stack.view;
        let ray = if view.perspective { (world - view.eye).normalize() } else { view.forward };
        let facing = gradient.try_normalize().map_or(1.0, |g| g.dot(ray).abs());
        Some(self.scene.transfer().eval(level).rgb.map(|c| c * (0.2 + 0.8 * facing)))
    }

    pub(crate) fn picture(&self) -> Vec<[f64; 4]> {
        let (width, height) = self.scene.size();
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| self.pixel(x, y)).collect()
    }
}

fn mix(fog: &Fog, z: f64, rgb: [f64; 3], alpha: f64) -> [f64; 3] {
    let f = fog.factor(z);
    let weight = if fog.weighting() == FogWeighting::Alpha { alpha } else { 1.0 };
    std::array::from_fn(|c| f * rgb[c] + (1.0 - f) * weight * fog.color()[c])
}

/// Thickness of the scene's slabs: with opacities meant for it, tables of straight lines are exact.
pub(crate) fn slab(volume: &Volume, scene: &Scene) -> f64 {
    Oracle::new(volume, scene).stack.spacing
}
