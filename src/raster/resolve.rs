//! From what a pixel has gathered to a layer: premultiplied red, green, blue, and the transmittance left to what is behind.

use super::surface::Surface;
use crate::fragment::PixelBlock;
use crate::fragment::project::NOTHING;
use crate::lanes::SIDE;
use crate::plan::{FramePlan, KnotTable};
use crate::scene::{Blend, Scene, Straight, TransferFunction};

/// What becomes of a layer's pixels once a block is done.
pub(crate) trait Finish: Sync {
    /// A pixel in which there is nothing of the volume.
    fn nothing(&self) -> [f32; 4];

    /// A pixel of premultiplied red, green, blue and transmittance.
    fn pixel(&self, layer: [f32; 4]) -> [f32; 4];

    /// A pixel whose opacity is 1 - transmittance + `lost`: what the transmittance, rounded to f32, does not tell of it.
    fn faint(&self, layer: [f32; 4], lost: f32) -> [f32; 4] {
        let _ = lost;
        self.pixel(layer)
    }

    /// A row of them; `layer` tells the pixel at each place.
    #[inline(always)]
    fn row(&self, layer: impl Fn(usize) -> [f32; 4], out: &mut [[f32; 4]]) {
        for (n, out) in out.iter_mut().enumerate() {
            *out = self.pixel(layer(n));
        }
    }
}

/// Opacities of finished pixels up to which what their transmittance has lost of them is told. An f32 transmittance tells larger ones to 3e-5 of
/// them.
const FAINT: f32 = 1.0 / 1024.0;

/// What gathered numbers stand for, where they are no blended colours.
pub(crate) struct Sums<'f> {
    pub(crate) blend: Blend,
    pub(crate) transfer: &'f TransferFunction,
    /// Value in the data's units of a gathered number v: `scale * v + offset`.
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    /// Where gathered numbers are positions in a table: that.
    pub(crate) labels: Option<&'f KnotTable>,
    /// Gathered averages are relative to this number.
    pub(crate) low: f64,
    /// Where the window of sums or of attenuated values begins, and its width.
    pub(crate) window: Option<[f64; 2]>,
}

impl<'f> Sums<'f> {
    /// Where the window of the sums of `scene` begins, and its width.
    pub(crate) fn window_of(scene: &Scene) -> Option<[f64; 2]> {
        scene.window().map(|[center, width]| [center - 0.5 * width, width])
    }
}

/// How gathered numbers become a layer.
pub(crate) struct Resolve<'f> {
    sums: Sums<'f>,
    /// Whether pixels hold what rounding has added to their sums.
    compensated: bool,
    surface: Surface<'f>,
}

impl<'f> Resolve<'f> {
    /// For a frame of `scene` by `plan`.
    pub(crate) fn new(scene: &'f Scene, plan: &'f FramePlan<'_>) -> Self {
        let transfer = scene.transfer();
        Self {
            sums: Sums {
                // Surfaces are blended as they are met.
                blend: match scene.blend() {
                    _ if scene.surfaces().is_some() => Blend::Over,
                    Blend::Under => Blend::Over,
                    other => other,
                },
                transfer,
                scale: plan.data.scaling.scale,
                offset: plan.data.scaling.offset,
                labels: plan.labels(),
                low: f64::from(plan.frame.color.low),
                window: match &plan.frame.attenuation {
                    Some(attenuation) => Some(attenuation.window),
                    None => Sums::window_of(scene),
                },
            },
            compensated: plan.needs.compensated,
            surface: Surface { volume: plan.volume, stack: &plan.stack, transfer },
        }
    }

    /// The same, but for gathered numbers to be left as they are: four of them a pixel, as blended colours and their transmittance are.
    pub(crate) fn gathered(mut self) -> Self {
        self.sums.blend = Blend::Over;
        self
    }

    /// A pixel that no slice covers, as `finish` makes it: the same as one that they cover and that gathers nothing.
    pub(super) fn missed(&self, finish: &impl Finish) -> [f32; 4] {
        if self.compensated { finish.faint([0.0, 0.0, 0.0, 1.0], 0.0) } else { finish.nothing() }
    }

    /// A covered pixel that has gathered nothing since it began with `start`, where colours are blended, as `finish` makes it.
    pub(super) fn untouched(&self, finish: &impl Finish, [red, green, blue, left]: [f32; 4]) -> [f32; 4] {
        // Sums begin with an opacity of 0.
        let layer = [red, green, blue, if self.sums.blend == Blend::Add { 1.0 - left } else { left }];
        self.made(finish, Some((layer, 0.0)))
    }

    /// A row of pixels: a block's pixel `i` and those to its right, at (x,y) of the picture.
    pub(crate) fn row(&self, finish: &impl Finish, pixels: &PixelBlock, i: usize, out: &mut [[f32; 4]], x: usize, y: usize) {
        if self.sums.blend == Blend::Over && !self.compensated {
            let layer = |at: usize| [pixels.color[0][at], pixels.color[1][at], pixels.color[2][at], pixels.transmittance[at]];
            // Most rows are whole: a loop of known length, from a place that is a row's beginning for the compiler to see.
            if let Ok(out) = <&mut [[f32; 4]; SIDE]>::try_from(&mut *out) {
                let at = i / SIDE * SIDE;
                finish.row(|n| layer(at + n), out);
            } else {
                finish.row(|n| layer(i + n), out);
            }
            return;
        }
        for (n, out) in out.iter_mut().enumerate() {
            *out = self.finished(finish, pixels, (i + n, x + n, y));
        }
    }

    /// Pixel `i` of a block, at (x,y) of the picture, as `finish` makes it.
    pub(crate) fn finished(&self, finish: &impl Finish, pixels: &PixelBlock, (i, x, y): (usize, usize, usize)) -> [f32; 4] {
        self.made(finish, self.pixel(pixels, i, x, y))
    }

    /// A pixel at (x,y) of the picture whose `color` and transmittance `t` hold what a block's pixels would, but are no colours blended over each
    /// other.
    pub(crate) fn of_sums(&self, finish: &impl Finish, color: [f32; 3], t: f32, (x, y): (usize, usize)) -> [f32; 4] {
        self.made(finish, self.projected(color, t, x, y))
    }

    /// A layer's pixel, if there is one, and what its transmittance has lost, as `finish` makes it.
    #[inline(always)]
    fn made(&self, finish: &impl Finish, pixel: Option<([f32; 4], f32)>) -> [f32; 4] {
        made(finish, pixel, self.compensated)
    }

    /// Pixel `i` of a block, at (x,y) of the picture, and what its transmittance has lost of its opacity (see [`Finish::faint`]); `None` where
    /// nothing of the volume is in it.
    fn pixel(&self, pixels: &PixelBlock, i: usize, x: usize, y: usize) -> Option<([f32; 4], f32)> {
        let [c0, c1, c2] = [0, 1, 2].map(|c: usize| pixels.color[c][i]);
        let t = pixels.transmittance[i];
        if matches!(self.sums.blend, Blend::Over | Blend::Surfaces) {
            let lost = if self.compensated { pixels.excess[3][i] } else { 0.0 };
            return Some(([c0, c1, c2, t], lost));
        }
        self.projected([c0, c1, c2], t, x, y)
    }

    /// As [`Resolve::pixel`], where slabs are not blended over each other.
    #[inline(always)]
    fn projected(&self, [c0, c1, c2]: [f32; 3], t: f32, x: usize, y: usize) -> Option<([f32; 4], f32)> {
        match self.sums.blend {
            Blend::Iso { level } => (t == 0.0).then(|| drawn(self.surface.color(level, f64::from(c1), x, y))),
            _ => self.sums.pixel([c0, c1, c2], t),
        }
    }
}

/// A layer's pixel, if there is one, and what its transmittance has lost, as `finish` makes it; of sums that are `compensated` or not.
#[inline(always)]
fn made(finish: &impl Finish, pixel: Option<([f32; 4], f32)>, compensated: bool) -> [f32; 4] {
    match pixel {
        None => finish.nothing(),
        Some((layer, 0.0)) if !compensated => finish.pixel(layer),
        Some((layer, lost)) => finish.faint(layer, lost),
    }
}

/// A layer's pixel of one colour, and what its transmittance has lost.
#[inline(always)]
fn drawn(color: Straight) -> ([f32; 4], f32) {
    let p = color.premultiply();
    through(p.rgb.map(|c| c as f32), p.alpha as f32, (1.0 - p.alpha) as f32)
}

impl Sums<'_> {
    /// A pixel of these sums, as `finish` makes it.
    pub(crate) fn finished(&self, finish: &impl Finish, [c0, c1, c2, t]: [f32; 4]) -> [f32; 4] {
        made(finish, self.pixel([c0, c1, c2], t), false)
    }

    /// The layer's pixel of gathered numbers, and what its transmittance has lost; `None` where nothing of the volume is in it. Hits of a level are
    /// told elsewhere.
    #[inline(always)]
    fn pixel(&self, [c0, c1, c2]: [f32; 3], t: f32) -> Option<([f32; 4], f32)> {
        let front = match self.blend {
            Blend::Over | Blend::Under | Blend::Surfaces => return Some(([c0, c1, c2, t], 0.0)),
            // `t` is the sum of opacities.
            Blend::Add => {
                let [r, g, b, opacity] = [c0, c1, c2, t].map(|sum| self.of_sum(sum));
                return Some(through([r, g, b], opacity, 1.0 - opacity));
            }
            Blend::Mip | Blend::Min => self.shown(c0),
            Blend::Average if c1 > 0.0 => self.shown((f64::from(c0) / f64::from(c1) + self.low) as f32),
            Blend::Average => None,
            // No pixel has gathered less than 0, where it has gathered anything.
            Blend::AttenuatedMip { .. } => {
                let [low, width] = self.window.unwrap_or([0.0, 1.0]);
                (c0 >= 0.0).then(|| self.transfer.eval(low + f64::from(c0) * width))
            }
            Blend::Lmip { .. } => self.shown(if t == 0.0 { c0 } else { c1 }),
            Blend::Iso { .. } => None,
        };
        front.map(drawn)
    }

    /// What a sum of colours or opacities counts as, 0 to 1.
    fn of_sum(&self, sum: f32) -> f32 {
        match self.window {
            None => sum.min(1.0),
            Some([low, width]) => ((f64::from(sum) - low) / width).clamp(0.0, 1.0) as f32,
        }
    }

    /// Colour of a gathered number, if there is one.
    fn shown(&self, gathered: f32) -> Option<Straight> {
        (gathered > NOTHING && gathered < f32::INFINITY).then(|| match self.labels {
            Some(labels) => labels.straight(f64::from(gathered)),
            None => self.transfer.eval(self.scale * f64::from(gathered) + self.offset),
        })
    }
}

/// A layer's pixel of an `opacity` that leaves `left`, and what that has lost of a faint one.
fn through([r, g, b]: [f32; 3], opacity: f32, left: f32) -> ([f32; 4], f32) {
    ([r, g, b, left], if opacity < FAINT { opacity - (1.0 - left) } else { 0.0 })
}
