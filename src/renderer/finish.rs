//! The last step: layers over the background, or left as they are; then warnings and statistics, which are the same for every backend.

use super::{Drawn, RenderStats};
use crate::raster::Finish;
use crate::scene::{Blend, Fog, FogWeighting, Method, Premultiplied, Scene, SlabForm, Straight, to_display};
use crate::volume::Volume;
use std::array;

/// A layer with nothing in it.
const EMPTY: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// Layers stay layers.
pub(super) struct AsLayer;

impl Finish for AsLayer {
    fn nothing(&self) -> [f32; 4] {
        EMPTY
    }

    #[inline(always)]
    fn pixel(&self, layer: [f32; 4]) -> [f32; 4] {
        layer
    }
}

/// Gathered numbers stay as they are.
pub(super) struct AsGathered {
    /// Those of a pixel that has gathered nothing.
    pub(super) nothing: [f32; 4],
}

impl Finish for AsGathered {
    fn nothing(&self) -> [f32; 4] {
        self.nothing
    }

    #[inline(always)]
    fn pixel(&self, gathered: [f32; 4]) -> [f32; 4] {
        gathered
    }
}

/// What sums of slabs may come to.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Most {
    /// This: weights of slabs add up to 1, and their roundings to a hair more.
    Bounded(f32),
    /// No bound: infinities become the largest f32, NaN becomes 0.
    Unbounded,
}

impl Most {
    /// What a sum counts as.
    #[inline(always)]
    fn of(self, sum: f32) -> f32 {
        match self {
            Self::Bounded(most) => {
                if sum > most {
                    most
                } else {
                    sum
                }
            }
            Self::Unbounded if sum.is_nan() => 0.0,
            Self::Unbounded => sum.clamp(f32::MIN, f32::MAX),
        }
    }
}

/// Layers become pictures over the scene's background.
pub(crate) struct OverBackground {
    /// What is behind, premultiplied, in the numbers that layers have.
    background: [f32; 4],
    /// The same as a pixel of a picture.
    nothing: [f32; 4],
    most: Most,
    /// Whether layers hold amounts of light, and pictures sRGB.
    light: bool,
}

impl OverBackground {
    /// The background of `scene`, whose rays are integrated by `method`.
    pub(crate) fn new(scene: &Scene, method: &Method) -> Self {
        let Premultiplied { rgb, alpha } = background(scene);
        let [r, g, b] = rgb.map(|c| c as f32);
        let literal = has_literal_fog(scene);
        let most = match scene.blend() {
            Blend::Over | Blend::Under if method.slab != SlabForm::Exponential => Most::Unbounded,
            Blend::Over | Blend::Under if !literal => Most::Bounded(1.0),
            _ => Most::Bounded(f32::INFINITY),
        };
        let background = [r, g, b, alpha as f32];
        let light = scene.linear_light();
        let mut over = Self { background, nothing: background, most, light };
        // What no slice covers comes out as where slices show nothing: of a translucent background 1 + (b - 1) is not always b.
        over.nothing = over.pixel(EMPTY);
        over
    }
}

/// Whether `scene` has fog that is added whatever a fragment's opacity.
fn has_literal_fog(scene: &Scene) -> bool {
    scene.fog().is_some_and(|f| f.weighting() == FogWeighting::Literal)
}

/// Whether no colour of the pictures of `scene` by `method` is above its opacity.
pub(super) fn is_bounded(scene: &Scene, method: &Method) -> bool {
    method.slab == SlabForm::Exponential && !has_literal_fog(scene)
}

impl Finish for OverBackground {
    fn nothing(&self) -> [f32; 4] {
        self.nothing
    }

    fn pixel(&self, layer: [f32; 4]) -> [f32; 4] {
        let mut out = [[0.0; 4]];
        self.row(|_| layer, &mut out);
        out[0]
    }

    #[inline(always)]
    fn row(&self, layer: impl Fn(usize) -> [f32; 4], out: &mut [[f32; 4]]) {
        // Opacity 1 - t (1 - b) as 1 + t (b - 1): the same sum as the colours', which vectors like.
        let [r, g, b, alpha] = self.background;
        let back = [r, g, b, alpha - 1.0];
        let over = |[r, g, b, t]: [f32; 4]| {
            let mut sums = [r, g, b, 1.0];
            for (sum, back) in sums.iter_mut().zip(back) {
                *sum += t * back;
            }
            sums
        };
        match self.most {
            Most::Bounded(most) => {
                for (n, out) in out.iter_mut().enumerate() {
                    *out = over(layer(n)).map(|c| if c > most { most } else { c });
                }
            }
            Most::Unbounded => {
                for (n, out) in out.iter_mut().enumerate() {
                    *out = over(layer(n)).map(|c| if c.is_nan() { 0.0 } else { c.clamp(f32::MIN, f32::MAX) });
                }
            }
        }
        if self.light {
            out.iter_mut().for_each(|pixel| *pixel = displayed(*pixel));
        }
    }

    fn faint(&self, [r, g, b, t]: [f32; 4], lost: f32) -> [f32; 4] {
        let [back_r, back_g, back_b, behind] = self.background;
        // 1 - t is exact where t is at least a half.
        let opacity = ((1.0 - t) + lost).clamp(0.0, 1.0);
        let sums = [r + t * back_r, g + t * back_g, b + t * back_b, behind + opacity * (1.0 - behind)];
        let pixel = sums.map(|c| self.most.of(c));
        if self.light { displayed(pixel) } else { pixel }
    }
}

/// A premultiplied colour of amounts of light as one of sRGB numbers.
fn displayed([r, g, b, alpha]: [f32; 4]) -> [f32; 4] {
    let a = f64::from(alpha);
    let turn = |c: f32| if a > 0.0 { (to_display((f64::from(c) / a).clamp(0.0, 1.0)) * a) as f32 } else { 0.0 };
    [turn(r), turn(g), turn(b), alpha]
}

/// The background, fogged as from infinitely far where the scene asks for it.
pub(super) fn background(scene: &Scene) -> Premultiplied {
    let color = scene.background();
    let straight = match scene.fog().filter(|_| scene.fogged_background()) {
        Some(fog) => fogged(color, fog),
        None => color,
    };
    straight.premultiply()
}

fn fogged(color: Straight, fog: &Fog) -> Straight {
    let f = fog.factor(f64::MAX);
    let rgb = array::from_fn(|c| f * color.rgb[c] + (1.0 - f) * fog.color()[c]);
    Straight { rgb, alpha: color.alpha }
}

/// Share of the pixels that show something from which on a picture of sums counts as saturated.
const SATURATED: f64 = 0.05;

/// A warning where many of the pixels that show something have a sum of colours that ends at 1.
pub(super) fn saturation(background: &OverBackground, pixels: &[[f32; 4]]) -> Option<String> {
    let nothing = background.nothing();
    let (mut shown, mut full) = (0u64, 0u64);
    for pixel in pixels.iter().filter(|&&pixel| pixel != nothing) {
        shown += 1;
        // Over a component of 1 every sum looks full.
        full += u64::from((0..3).any(|c| pixel[c] >= 1.0 && nothing[c] < 1.0));
    }
    let share = full as f64 / shown.max(1) as f64;
    (share > SATURATED).then(|| {
        format!(
            "the picture saturates: sums of colours reach 1 in {:.0} % of its pixels (render.window = [center, width] spreads them)",
            100.0 * share
        )
    })
}

/// What the user should hear about a picture, one line each: first what the backend has to say.
fn warnings(drawn: &mut Drawn, volume: &Volume, pixels: &[[f32; 4]]) -> Vec<String> {
    let mut warnings = std::mem::take(&mut drawn.warnings);
    let fragments = drawn.tally.fragments;
    if drawn.slices == 0 {
        warnings.push("the whole box lies behind the eye: nothing to see".to_owned());
    } else if fragments + drawn.tally.corners == 0 {
        warnings.push("no ray through a pixel meets what camera and clip planes leave of the box: the picture is empty".to_owned());
    } else if fragments > 0 && pixels.len() > 1 && pixels.iter().all(|&p| p == pixels[0]) {
        warnings.push("the picture is of one colour: nothing of the volume shows in it".to_owned());
    }
    if drawn.non_finite > 0 {
        let (count, all) = (drawn.non_finite, volume.grid().voxel_count());
        warnings.push(format!("{count} of {all} voxels are NaN or infinite: {}", drawn.non_finite_become));
    }
    warnings.append(&mut drawn.late_warnings);
    warnings
}

/// The statistics of a picture.
pub(super) fn statistics(mut drawn: Drawn, (prepare_seconds, seconds): (f64, f64), volume: &Volume, pixels: &[[f32; 4]]) -> RenderStats {
    let warnings = warnings(&mut drawn, volume, pixels);
    RenderStats {
        prepare_seconds,
        render_seconds: seconds - prepare_seconds,
        slices: drawn.slices,
        method: drawn.method,
        fragments: drawn.tally.fragments,
        fetches: drawn.fetches,
        threads: rayon::current_num_threads(),
        simd: drawn.simd,
        tally: drawn.tally,
        left_out: drawn.left_out,
        error_estimate: drawn.error_estimate,
        non_finite_voxels: drawn.non_finite,
        warnings,
    }
}
