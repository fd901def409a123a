//! From what a pixel has gathered to its colour over the background.

use crate::fragment::{PixelBlock, project::NOTHING};
use crate::lanes::SIDE;
use crate::proxy::Stack;
use crate::scene::{Blend, Premultiplied, Straight, TransferFunction};
use crate::volume::Volume;
use glam::DVec3;

/// Share of a surface's colour that does not depend on its direction.
const AMBIENT: f64 = 0.2;

/// How gathered numbers become a colour.
pub(crate) struct Resolve<'f> {
    pub(crate) blend: Blend,
    pub(crate) background: Premultiplied,
    pub(crate) transfer: &'f TransferFunction,
    pub(crate) volume: &'f Volume,
    pub(crate) stack: &'f Stack,
    /// Value in the data's units of a gathered number v: `scale * v + offset`.
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    /// Gathered averages are relative to this number.
    pub(crate) low: f64,
    /// Whether slabs keep what is gathered between 0 and 1.
    pub(crate) bounded: bool,
    /// What sums of such slabs may come to: 1, or anything where fog is added whatever a fragment's opacity.
    pub(crate) most: f32,
}

impl Resolve<'_> {
    /// The colour of a pixel that nothing covers.
    pub(crate) fn background(&self) -> [f32; 4] {
        let [r, g, b] = self.background.rgb;
        [r as f32, g as f32, b as f32, self.background.alpha as f32]
    }

    /// The colour of a covered pixel that has gathered nothing, where colours are blended.
    pub(crate) fn untouched(&self, [red, green, blue, transmittance]: [f32; 4]) -> [f32; 4] {
        match self.blend {
            Blend::Add => self.over([red, green, blue], 1.0 - transmittance),
            _ => self.over([red, green, blue], transmittance),
        }
    }

    /// Colours of a row of pixels: of a block's pixel `i` and those to its right, at (x,y) of the picture.
    pub(crate) fn row(&self, pixels: &PixelBlock, i: usize, out: &mut [[f32; 4]], x: usize, y: usize) {
        if self.blend != Blend::Over || !self.bounded {
            for (n, out) in out.iter_mut().enumerate() {
                *out = self.pixel(pixels, i + n, x + n, y);
            }
            return;
        }
        // The same sums as `over`, in an order that vectors like: 1 - t (1 - b) is 1 + t (b - 1).
        let [r, g, b, alpha] = self.background();
        let back = [r, g, b, alpha - 1.0];
        let gathered = |at: usize| [pixels.color[0][at], pixels.color[1][at], pixels.color[2][at], 1.0];
        let resolved = |at: usize| {
            let (mut color, t) = (gathered(at), pixels.transmittance[at]);
            for (sum, back) in color.iter_mut().zip(back) {
                *sum += t * back;
                *sum = if *sum > self.most { self.most } else { *sum };
            }
            color
        };
        // Most rows are whole: a loop of known length, from a place that is a row's beginning for the compiler to see.
        if let Ok(out) = <&mut [[f32; 4]; SIDE]>::try_from(&mut *out) {
            let at = i / SIDE * SIDE;
            for (n, out) in out.iter_mut().enumerate() {
                *out = resolved(at + n);
            }
            return;
        }
        for (n, out) in out.iter_mut().enumerate() {
            *out = resolved(i + n);
        }
    }

    /// Premultiplied colour of pixel `i` of a block, at (x,y) of the picture.
    pub(crate) fn pixel(&self, pixels: &PixelBlock, i: usize, x: usize, y: usize) -> [f32; 4] {
        let [c0, c1, c2] = [0, 1, 2].map(|c: usize| pixels.color[c][i]);
        let t = pixels.transmittance[i];
        let front = match self.blend {
            // Weights add up to 1, and roundings to a hair more.
            Blend::Over if self.bounded => {
                return self.over([c0, c1, c2], t).map(|c| if c > self.most { self.most } else { c });
            }
            // Sums that grow without bound end at the largest number there is.
            Blend::Over => return self.over([c0, c1, c2], t).map(|c| if c.is_nan() { 0.0 } else { c.clamp(f32::MIN, f32::MAX) }),
            Blend::Add => {
                // `t` is the sum of opacities.
                let alpha = t.min(1.0);
                return self.over([c0, c1, c2].map(|c| c.min(1.0)), 1.0 - alpha);
            }
            Blend::Mip | Blend::Min => self.shown(c0),
            Blend::Average if c1 > 0.0 => self.shown((f64::from(c0) / f64::from(c1) + self.low) as f32),
            Blend::Average => None,
            Blend::Lmip { .. } => self.shown(if t == 0.0 { c0 } else { c1 }),
            Blend::Iso { level } => (t == 0.0).then(|| self.surface(level, f64::from(c1), x, y)),
        };
        match front {
            Some(color) => {
                let p = color.premultiply();
                self.over(p.rgb.map(|c| c as f32), (1.0 - p.alpha) as f32)
            }
            None => self.background(),
        }
    }

    /// Premultiplied colour over the background.
    fn over(&self, rgb: [f32; 3], transmittance: f32) -> [f32; 4] {
        let back = self.background();
        let [r, g, b] = [0, 1, 2].map(|c: usize| rgb[c] + transmittance * back[c]);
        [r, g, b, 1.0 - transmittance * (1.0 - back[3])]
    }

    /// Colour of a gathered value, if there is one.
    fn shown(&self, gathered: f32) -> Option<Straight> {
        (gathered > NOTHING && gathered < f32::INFINITY).then(|| self.transfer.eval(self.scale * f64::from(gathered) + self.offset))
    }

    /// The surface that the ray through pixel (x,y) meets near slice position `at`: refined by bisection on the trilinear field,
    /// lit from the eye.
    fn surface(&self, level: f64, at: f64, x: usize, y: usize) -> Straight {
        let (wx, wy) = (x as f64 + 0.5, y as f64 + 0.5);
        let depth = |k: f64| self.stack.near + (k + 0.5) * self.stack.spacing;
        let value = |k: f64| self.volume.sample(self.stack.index_at(wx, wy, depth(k)));
        let above = |k: f64| value(k) >= level;
        // Half a slice to either side of the estimate; without a change of side there, the estimate stands.
        let (mut lo, mut hi) = (at - 0.5, at + 0.5);
        let side = above(hi);
        let mut k = at;
        if above(lo) != side {
            for _ in 0..30 {
                k = 0.5 * (lo + hi);
                if above(k) == side { hi = k } else { lo = k }
            }
        }
        let index = self.stack.index_at(wx, wy, depth(k));
        // Scaled first: squares of a gradient in the data's units may leave f64.
        let gradient = self.volume.gradient(index);
        let steepest = gradient.abs().max_element();
        let gradient = if steepest > 0.0 { gradient / steepest } else { DVec3::ZERO };
        let (_, ray) = self.stack.view.ray(wx, wy);
        let facing = if gradient == DVec3::ZERO { 1.0 } else { (gradient.normalize().dot(ray.normalize())).abs() };
        let mut color = self.transfer.eval(level);
        color.alpha = 1.0;
        color.rgb = color.rgb.map(|c| c * (AMBIENT + (1.0 - AMBIENT) * facing));
        color
    }
}
