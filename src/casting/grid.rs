//! Rays along an axis of the volume, through the voxels of one row each: the loops of a classroom.
//!
//! ```text
//!   for each pixel (column i, row j):  for k = 0, 1, 2 ...:  value of voxel (i,j,k) --transfer function--> colour, opacity --over-->
//! ```
//! Values are the voxels' own, the transfer function is evaluated as it is, and all is computed in f64; the pixel alone is rounded to f32. A
//! sample stands for the distance of two voxels along the axis, and where opacities refer to that very length it has the transfer function's
//! own number. Voxels that are colours are samples as they are stored. A picture of another size than the voxels' shows at each pixel the voxel that its centre lies in.

use super::{Cast, Scratch, rows};
use crate::raster::Finish;
use crate::scene::{Algorithm, Blend, Fog, FogDistance, LitPoint, Order, Placement, Premultiplied, Scene, Straight, View, to_linear, unit};
use crate::settings::Control;
use crate::volume::{BoxConvention, OpacityFrom, Volume};
use crate::{Error, Result};
use glam::DVec3;

/// The axes of a picture along `axis`: that of its columns, and that of its rows.
fn others(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis.min(2)]
}

/// A sample: straight colour, and opacity of what it stands for.
type Sample = ([f64; 3], f64);

/// What a ray comes to.
enum Seen {
    /// Premultiplied colour, and the transmittance left.
    Blended([f64; 3], f64),
    /// The colour of a value, if there was one.
    Projected(Option<Straight>),
}

/// The rows of voxels of a frame.
pub(crate) struct Grid<'s> {
    scene: &'s Scene,
    volume: &'s Volume,
    view: &'s View,
    axis: usize,
    backwards: bool,
    /// Distance of two voxels along the axis, in reference lengths of the transfer function.
    ratio: f64,
    /// Level, straight colour and opacity of surfaces, rising.
    levels: Vec<(f64, [f64; 3], f64)>,
    /// What opacities go by, where voxels are colours.
    colors: Option<OpacityFrom>,
}

/// What is counted of a row of pixels.
#[derive(Default)]
struct Count(Cast);

impl Scratch for Count {
    fn done(&mut self) -> Cast {
        std::mem::take(&mut self.0)
    }
}

impl<'s> Grid<'s> {
    /// The rows of `volume` as `scene` asks for them.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a camera that looks along no axis of the volume.
    pub(crate) fn new(scene: &'s Scene, volume: &'s Volume, view: &'s View) -> Result<Self> {
        let Placement::Along { axis, backwards } = scene.camera().placement() else {
            let name = Algorithm::Grid.name();
            return Err(Error::invalid(format!("camera: render algorithm {name} looks along an axis of the volume; give camera.along")));
        };
        let grid = volume.grid();
        let levels = match (scene.surfaces(), scene.blend()) {
            (Some(surfaces), _) => surfaces.levels,
            (None, Blend::Iso { level }) => vec![(level, scene.transfer().eval(level).rgb, 1.0)],
            _ => Vec::new(),
        };
        Ok(Self {
            scene,
            volume,
            view,
            axis,
            backwards,
            ratio: grid.spacing()[axis] / scene.opacity_length(grid),
            levels,
            colors: scene.color_opacity(volume),
        })
    }

    /// Samples of each ray.
    pub(crate) fn samples(&self) -> u64 {
        self.volume.grid().dims()[self.axis] as u64
    }

    /// Fills `pixels`, on the current thread pool.
    ///
    /// # Errors
    /// [`Error::Stopped`] where `control` says so.
    pub(crate) fn draw(&self, finish: &impl Finish, control: Control<'_>, pixels: &mut [[f32; 4]]) -> Result<Cast> {
        rows(pixels, self.view.width as usize, control, Count::default, |count, x, y| {
            let first = self.first(x, y);
            let seen = match self.scene.blend() {
                Blend::Over if self.scene.order() == Order::BackToFront => self.back_to_front(first),
                Blend::Over => self.front_to_back(first),
                Blend::Add => self.sum(first),
                Blend::Iso { .. } | Blend::Surfaces => self.surfaces(first),
                _ => self.projected(first),
            };
            count.0.counters.fragments += self.samples();
            count.0.counters.looked_up += self.samples();
            count.0.counters.fetches += self.samples();
            count.0.counters.lanes += self.samples();
            count.0.most = self.samples();
            match seen {
                Seen::Blended(rgb, left) => {
                    let [r, g, b] = rgb.map(|c| c as f32);
                    finish.pixel([r, g, b, left as f32])
                }
                Seen::Projected(None) => finish.nothing(),
                Seen::Projected(Some(color)) => {
                    let Premultiplied { rgb, alpha } = color.premultiply();
                    let [r, g, b] = rgb.map(|c| c as f32);
                    finish.pixel([r, g, b, (1.0 - alpha) as f32])
                }
            }
        })
    }

    /// The first voxel on the ray of pixel (x,y).
    fn first(&self, x: u32, y: u32) -> [usize; 3] {
        let dims = self.volume.grid().dims();
        let [across, down] = others(self.axis);
        // The voxel that the pixel's centre lies in: floor((x + 1/2) n / width).
        let at = |x: u32, n: usize, size: u32| ((2 * u64::from(x) + 1) * n as u64 / (2 * u64::from(size))) as usize;
        let column = at(x, dims[across], self.view.width);
        let mut voxel = [0; 3];
        voxel[across] = if self.backwards { dims[across] - 1 - column } else { column };
        voxel[down] = at(y, dims[down], self.view.height);
        voxel
    }

    /// The `k`th voxel of the row of `first`, nearest first.
    fn voxel(&self, mut first: [usize; 3], k: usize) -> [usize; 3] {
        let n = self.volume.grid().dims()[self.axis];
        first[self.axis] = if self.backwards { n - 1 - k } else { k };
        first
    }

    /// The voxels of a row that are seen and their values, nearest first, each with its number on the ray.
    fn row(&self, first: [usize; 3]) -> impl DoubleEndedIterator<Item = (usize, [usize; 3], f64)> + use<'_, 's> {
        (0..self.samples() as usize).filter_map(move |k| {
            let voxel = self.voxel(first, k);
            let value = if self.colors.is_some() { 0.0 } else { self.volume.value(voxel) };
            let position = self.position(voxel);
            let kept = self.scene.clip_planes().iter().all(|p| p.normal().dot(position) >= p.offset());
            let seen = kept && self.view.depth(position) >= self.view.near;
            (seen && value.is_finite()).then_some((k, voxel, value))
        })
    }

    fn position(&self, [i, j, k]: [usize; 3]) -> DVec3 {
        self.volume.grid().index_to_world().transform_point3(DVec3::new(i as f64, j as f64, k as f64))
    }

    /// How deep in the box the `k`th voxel lies, 0 to 1: from its first voxel to its last in a box of nodes, from face to face in one of cells.
    fn deep(&self, k: usize) -> f64 {
        let n = self.samples() as f64;
        match self.volume.grid().convention() {
            BoxConvention::Nodes if n > 1.0 => k as f64 / (n - 1.0),
            BoxConvention::Nodes => 0.0,
            BoxConvention::Cells => (k as f64 + 0.5) / n,
        }
    }

    /// `color` at a voxel as it is lit, if it is.
    fn lit(&self, color: [f64; 3], k: usize, voxel: [usize; 3]) -> [f64; 3] {
        let Some(lighting) = self.scene.lighting() else { return color };
        let gradient = if lighting.needs_gradient() { self.gradient(voxel) } else { DVec3::ZERO };
        lighting.shade(color, &LitPoint { position: self.position(voxel), gradient, to_eye: -self.view.forward, deep: self.deep(k) })
    }

    fn gradient(&self, [i, j, k]: [usize; 3]) -> DVec3 {
        self.scene.gradient().at(self.volume, DVec3::new(i as f64, j as f64, k as f64))
    }

    /// `color` behind fog, if there is any.
    fn fogged(&self, color: [f64; 3], voxel: [usize; 3]) -> [f64; 3] {
        let mix = |fog: &Fog| {
            let position = self.position(voxel);
            let f = fog.factor(match fog.distance() {
                FogDistance::Planar => self.view.depth(position),
                FogDistance::Radial => position.distance(self.view.eye),
            });
            [0, 1, 2].map(|c: usize| f * color[c] + (1.0 - f) * fog.color()[c])
        };
        self.scene.fog().map_or(color, mix)
    }

    /// The colour of a voxel as it is stored, within 0 to 1; transparent where a number is none.
    fn stored(&self, [i, j, k]: [usize; 3], from: OpacityFrom) -> Straight {
        let [nx, ny, _] = self.volume.grid().dims();
        let numbers = self.volume.colors().map_or([f64::NAN; 4], |colors| colors.get((k * ny + j) * nx + i));
        if numbers.iter().any(|x| !x.is_finite()) {
            return Straight { rgb: [0.0; 3], alpha: 0.0 };
        }
        let [r, g, b, alpha] = numbers.map(|x| x.clamp(0.0, 1.0));
        let through = |number: f64| self.scene.transfer().eval(number).alpha;
        let alpha = match from {
            OpacityFrom::Alpha => alpha,
            OpacityFrom::Luma => through((0.2126 * r + 0.7152 * g + 0.0722 * b).min(1.0)),
            OpacityFrom::Maximum => through(r.max(g).max(b)),
        };
        let turned = if self.scene.linear_light() { [r, g, b].map(to_linear) } else { [r, g, b] };
        Straight { rgb: turned, alpha }
    }

    /// What a voxel looks like.
    fn sample(&self, (k, voxel, value): (usize, [usize; 3], f64)) -> Sample {
        let Straight { rgb, alpha } = match self.colors {
            Some(from) => self.stored(voxel, from),
            None => self.scene.transfer().eval(value),
        };
        if alpha == 0.0 {
            return (rgb, 0.0);
        }
        let by_gradient = !self.scene.transfer().gradient_opacity().is_empty();
        let factor = if by_gradient { self.scene.transfer().gradient_factor(self.gradient(voxel).length()) } else { 1.0 };
        let length = self.ratio * factor;
        // 1 - (1 - a)^length; the number itself where that is what it is.
        let opacity = if length == 1.0 { alpha } else { -libm::expm1(length * libm::log1p(-alpha)) };
        // Of infinite extinction nothing is left, but for no length.
        let opacity = if alpha == 1.0 { f64::from(u8::from(length > 0.0)) } else { opacity };
        (self.fogged(self.lit(rgb, k, voxel), voxel), opacity)
    }

    fn front_to_back(&self, first: [usize; 3]) -> Seen {
        let (mut sum, mut left) = ([0.0; 3], 1.0);
        for voxel in self.row(first) {
            let (color, opacity) = self.sample(voxel);
            for (sum, c) in sum.iter_mut().zip(color) {
                *sum += left * (opacity * c);
            }
            left *= 1.0 - opacity;
            if left < f64::from(self.scene.terminate()) {
                break;
            }
        }
        Seen::Blended(sum, left)
    }

    fn back_to_front(&self, first: [usize; 3]) -> Seen {
        let (mut sum, mut left) = ([0.0; 3], 1.0);
        for voxel in self.row(first).rev() {
            let (color, opacity) = self.sample(voxel);
            for (sum, c) in sum.iter_mut().zip(color) {
                *sum = opacity * c + (1.0 - opacity) * *sum;
            }
            left *= 1.0 - opacity;
        }
        Seen::Blended(sum, left)
    }

    fn sum(&self, first: [usize; 3]) -> Seen {
        let (mut sum, mut opacities) = ([0.0; 3], 0.0);
        for voxel in self.row(first) {
            let (color, opacity) = self.sample(voxel);
            for (sum, c) in sum.iter_mut().zip(color) {
                *sum += opacity * c;
            }
            opacities += opacity;
        }
        Seen::Blended(sum.map(|c: f64| c.min(1.0)), 1.0 - f64::min(opacities, 1.0))
    }

    /// Each surface is met once, at the first voxel at or above its level.
    fn surfaces(&self, first: [usize; 3]) -> Seen {
        let (mut sum, mut left) = ([0.0; 3], 1.0);
        let mut met = 0;
        for (k, voxel, value) in self.row(first) {
            while let Some(&(_, color, opacity)) = self.levels.get(met).filter(|l| l.0 <= value) {
                met += 1;
                let color = self.surface(color, k, voxel);
                for (sum, c) in sum.iter_mut().zip(color) {
                    *sum += left * (opacity * c);
                }
                left *= 1.0 - opacity;
            }
            if met == self.levels.len() || left == 0.0 {
                break;
            }
        }
        Seen::Blended(sum, left)
    }

    /// The colour of a surface at a voxel: lit where the scene has light; else from the eye, unless surfaces are flat.
    fn surface(&self, color: [f64; 3], k: usize, voxel: [usize; 3]) -> [f64; 3] {
        if self.scene.lighting().is_some() || self.scene.flat_surfaces() {
            return self.lit(color, k, voxel);
        }
        super::surfaces::headlight(color, unit(self.gradient(voxel)), -self.view.forward)
    }

    /// The colour of one number of the values.
    fn projected(&self, first: [usize; 3]) -> Seen {
        let mut values = self.row(first).map(|voxel| voxel.2);
        let value = match self.scene.blend() {
            Blend::Min => values.reduce(f64::min),
            Blend::Average => {
                let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
                (count > 0.0).then(|| sum / count)
            }
            Blend::Lmip { threshold } => {
                let (mut last, mut most): (Option<f64>, Option<f64>) = (None, None);
                let peak = values.find_map(|value| {
                    let peak = last.filter(|&last| value < last && last >= threshold);
                    (last, most) = (Some(value), Some(most.map_or(value, |most| most.max(value))));
                    peak
                });
                peak.or(most)
            }
            _ => values.reduce(f64::max),
        };
        Seen::Projected(value.map(|value| self.scene.transfer().eval(value)))
    }
}
