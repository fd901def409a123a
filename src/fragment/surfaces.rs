//! Level surfaces: crossings of levels between the values of neighbouring slices, shaded and blended nearest first.
//!
//! ```text
//!   entry    slice f    f+1   ...   slice l   exit      a level between the values at both ends of a piece is crossed in it
//!   --|---------|--------|------------|---------|-->
//! ```
//! The values of eight rays are compared with the levels at once. A crossing is rare, so what follows is done ray by ray in f64: where it
//! is, by bisection of the interpolated values; the normal; light. Several crossings in a piece are blended in the order of their depth.
//! Two crossings of one level between neighbouring slices are not seen. A piece with a NaN or infinite value at an end holds none.

use super::batch::{Batch, SurfaceHits};
use super::fetch::finite;
use super::frame::Frame;
use super::pair::{BEHIND, remember};
use crate::lanes::{Kernel, Lanes, SIDE, for_rows, row, spread};
use crate::proxy::Stack;
use crate::scene::{Filter, Gradient, Hit, Lighting, LitPoint, MAX_LEVELS, Scene, Surfaces, unit};
use crate::volume::Volume;
use glam::DVec3;

/// Share of a surface's colour that does not depend on its direction, where the scene has no light.
const AMBIENT: f64 = 0.2;
/// Halvings of the piece that holds a crossing.
const HALVINGS: u32 = 16;

/// What becomes of a surface's colour.
#[derive(Debug, Clone)]
enum Look {
    /// Nothing.
    Flat,
    /// It is darker where the surface turns away from the eye.
    Headlight,
    /// It is lit.
    Lit(Lighting),
}

/// A level.
#[derive(Debug, Clone, Copy)]
struct Level {
    /// As a number of the stages.
    number: f32,
    /// In the data's units.
    value: f64,
    /// Straight.
    color: [f64; 3],
    opacity: f64,
}

/// What level surfaces need.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceFrame<'v> {
    volume: &'v Volume,
    stack: Stack,
    /// Depths at which the box begins and ends.
    box_depths: (f64, f64),
    filter: Filter,
    gradient: Gradient,
    look: Look,
    hit: Hit,
    /// Whether a ray that enters above a level meets its surface there.
    capped: bool,
    /// Rising.
    levels: Vec<Level>,
}

/// A piece of a ray, in slices.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
    /// Whether values rise from its beginning to its end.
    rising: bool,
}

impl<'v> SurfaceFrame<'v> {
    /// For the `surfaces` of `scene` in slices of `stack` through `volume`; `number` gives the stages' number of a value.
    pub(crate) fn new(surfaces: &Surfaces, scene: &Scene, volume: &'v Volume, stack: &Stack, number: impl Fn(f64) -> f64) -> Self {
        let level = |&(value, color, opacity): &(f64, [f64; 3], f64)| Level { number: number(value) as f32, value, color, opacity };
        let look = match scene.lighting() {
            Some(lighting) => Look::Lit(lighting.clone()),
            None if scene.flat_surfaces() => Look::Flat,
            None => Look::Headlight,
        };
        Self {
            volume,
            // The box's own depths, whatever part of it the stack fills.
            box_depths: Stack::depth_range(volume.grid(), &stack.view).unwrap_or((stack.near, stack.far)),
            stack: stack.clone(),
            filter: scene.method().filter,
            gradient: scene.gradient(),
            look,
            hit: scene.hit(),
            capped: surfaces.capped,
            levels: surfaces.levels.iter().map(level).collect(),
        }
    }

    /// Depth of slice position `k`.
    fn depth(&self, k: f64) -> f64 {
        self.stack.near + (k + 0.5) * self.stack.spacing
    }

    /// The value at slice position `k` of the ray through `window`, data units.
    fn value(&self, k: f64, window: [f64; 2]) -> f64 {
        let index = self.stack.index_at(window[0], window[1], self.depth(k));
        match self.filter {
            Filter::Nearest => {
                let dims = self.volume.grid().dims();
                self.volume.value([0, 1, 2].map(|a: usize| libm::floor(index[a] + 0.5).clamp(0.0, (dims[a] - 1) as f64) as usize))
            }
            _ => self.volume.sample(index),
        }
    }

    /// Where in `piece` the value crosses `level`.
    fn refined(&self, level: f64, piece: Piece, window: [f64; 2]) -> f64 {
        let above = |k: f64| self.value(k, window) >= level;
        let (mut low, mut high) = (piece.from, piece.to);
        // The stages' numbers are rounded: where the level is as good as met at an end, the crossing is there.
        if above(low) == piece.rising {
            return low;
        }
        if above(high) != piece.rising {
            return high;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if above(middle) == piece.rising { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    }

    /// The colour of `level` at slice position `k` of the ray through `window`.
    fn color(&self, level: &Level, k: f64, window: [f64; 2]) -> [f64; 3] {
        if matches!(self.look, Look::Flat) {
            return level.color;
        }
        let depth = self.depth(k);
        let index = self.stack.index_at(window[0], window[1], depth);
        let (_, ray) = self.stack.view.ray(window[0], window[1]);
        let to_eye = -unit(ray);
        let gradient = || self.gradient.at(self.volume, index);
        match &self.look {
            Look::Flat => level.color,
            Look::Headlight => {
                let normal = unit(gradient());
                let facing = if normal == DVec3::ZERO { 1.0 } else { normal.dot(to_eye).abs() };
                level.color.map(|c| c * (AMBIENT + (1.0 - AMBIENT) * facing))
            }
            Look::Lit(lighting) => {
                let (near, far) = self.box_depths;
                let gradient = if lighting.needs_gradient() { gradient() } else { DVec3::ZERO };
                let position = self.volume.grid().index_to_world().transform_point3(index);
                lighting.shade(level.color, &LitPoint { position, gradient, to_eye, deep: ((depth - near) / (far - near)).clamp(0.0, 1.0) })
            }
        }
    }

    /// Pixel `i` of `batch` meets the surfaces whose bits are set in `crossed` within `piece`.
    #[inline(never)]
    fn meet(&self, batch: &mut Batch, i: usize, crossed: u32, piece: Piece) {
        let Some(hits) = batch.hits.as_deref_mut() else { return };
        let [x, y] = hits.window;
        let window = [x + (i % SIDE) as f64, y + (i / SIDE) as f64];
        let mut met = [(0.0, 0); MAX_LEVELS];
        let mut count = 0;
        for n in 0..self.levels.len() {
            // In the order in which a value that rises or falls throughout meets them.
            let level = if piece.rising { n } else { self.levels.len() - 1 - n };
            if crossed >> level & 1 == 1 {
                let at = if self.hit == Hit::Refined && piece.from < piece.to {
                    self.refined(self.levels[level].value, piece, window)
                } else {
                    piece.to
                };
                met[count] = (at, level);
                count += 1;
            }
        }
        met[..count].sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut left = batch.pixels.transmittance[i];
        for &(at, level) in &met[..count] {
            let level = &self.levels[level];
            if hits.depth[i] == SurfaceHits::NONE {
                hits.depth[i] = self.depth(at);
                hits.level[i] = level.value;
            }
            let color = self.color(level, at, window);
            for (sum, c) in batch.pixels.color.iter_mut().zip(color) {
                sum[i] += left * (level.opacity * c) as f32;
            }
            left *= (1.0 - level.opacity) as f32;
            if left == 0.0 {
                break;
            }
        }
        batch.pixels.transmittance[i] = left;
    }
}

/// Compares the values at both ends of each piece with the levels, and blends the surfaces between.
pub(crate) struct BlendSurfaces;

impl<'v> Kernel<Frame<'v>, Batch> for BlendSurfaces {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(surfaces) = frame.surfaces.as_deref() else { return };
        let slice = L::splat_i(batch.slice);
        let (zero, threshold) = (L::splat(0.0), L::splat(frame.blend.terminate));
        let mut alive = batch.pixels.alive & !spread(batch.rows);
        for_rows!(batch.rows, r => {
            let back = L::load(row(&batch.sample.value, r));
            let first = L::load_i(row(&batch.pixels.first, r));
            let entry = L::load(row(&batch.pixels.entry, r));
            let entered = L::eq_i(slice, first);
            let front = L::select(entered, entry, L::load(row(&batch.pixels.previous[0], r)));
            let left = L::load(row(&batch.pixels.transmittance, r));
            let whole = L::and(finite::<L>(front), finite::<L>(back));
            let entered = L::bits(entered);
            let takes = (batch.mask >> (8 * r)) as u8 & L::bits(L::and(L::lt(zero, left), L::le(threshold, left)));
            let open = takes & L::bits(whole);
            let mut crossed = [0u8; MAX_LEVELS];
            let (mut any, mut capped) = (0, 0);
            for (crossed, level) in crossed.iter_mut().zip(&surfaces.levels) {
                let level = L::splat(level.number);
                *crossed = open & (L::bits(L::le(level, front)) ^ L::bits(L::le(level, back)));
                any |= *crossed;
                if surfaces.capped {
                    capped |= takes & entered & L::bits(L::and(finite::<L>(entry), L::le(level, entry)));
                }
            }
            let mut lanes = any | capped;
            if lanes != 0 {
                let rising = L::bits(L::le(front, back));
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    let (i, bit) = (SIDE * r + lane, 1 << lane);
                    let piece = piece(batch, i, entered & bit != 0, rising & bit != 0);
                    if capped & bit != 0 {
                        surfaces.meet(batch, i, 1, Piece { to: piece.from, ..piece });
                    } else {
                        let crossed = crossed.iter().enumerate().fold(0, |all, (n, crossed)| all | u32::from(crossed & bit != 0) << n);
                        surfaces.meet(batch, i, crossed, piece);
                    }
                }
            }
            remember::<L>(batch, r);
            let left = L::load(row(&batch.pixels.transmittance, r));
            let more = L::gt_i(L::load_i(row(&batch.pixels.last, r)), slice);
            let now = L::bits(L::and(L::and(L::lt(zero, left), L::le(threshold, left)), more));
            alive |= u64::from(now) << (8 * r);
        });
        batch.pixels.alive = alive;
    }
}

/// The piece of pixel `i` that ends at the batch's slice, or behind the pixel's last.
fn piece(batch: &Batch, i: usize, entered: bool, rising: bool) -> Piece {
    let slice = f64::from(batch.slice);
    let (from, to) = if batch.slice == BEHIND {
        let last = f64::from(batch.pixels.last[i]);
        (last, last + f64::from(batch.pixels.last_length[i]).max(0.0))
    } else if entered {
        (slice - f64::from(batch.pixels.first_length[i]), slice)
    } else {
        (slice - 1.0, slice)
    };
    Piece { from, to, rising }
}
