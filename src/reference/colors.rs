//! Rays through a volume of colours.
//!
//! Slices interpolate premultiplied colours of slabs: with thickness D, opacity 1 - (1 - a)^(D/L0) of each voxel and its colour times that. As D
//! falls, 1 - (1 - a)^(D/L0) = k D + O(D^2) with k = -ln(1 - a) / L0, so what is interpolated comes to D times sums over the cell's corners,
//!
//! ```text
//!   extinction k(x) = sum w_i(x) k_i        emission q(x) = sum w_i(x) k_i c_i
//! ```
//!
//! and a slab's opacity and colour to k(x) D and q(x) D. So the limit of ever more slices is dT = -k T ds, dC = q T ds with k and q trilinear:
//! cubic along a ray within a cell, where the optical depth is a quartic, and the transmittance exact. Opacity itself is not interpolated in
//! the limit: halfway between an opacity of 0 and one of a it is 1 - sqrt(1 - a).
//!
//! A voxel of opacity 1 is infinitely deep. Its weight in a slab grows from 0 where a ray enters its cells, but with ever more slices the ray ends
//! ever closer to there: at the cell's face, in the colours of the cell's opaque corners by the weights with which they rise.

use super::field::{Corners, Cubic, cubic};
use super::panel::{DARK, Gathered, PieceFog, Rule};
use crate::Volume;
use crate::scene::{OpacityFrom, Scene, TransferFunction};

/// Optical depth of a panel up to which the rules resolve the exponential.
const DEEP: f64 = 4.0;
/// Error of a panel that rounding alone may cause.
const ROUNDING: f64 = 1e-15;
/// Most halvings of a piece.
const HALVINGS: u32 = 40;
/// A weight below this is rounding's.
const NO_WEIGHT: f64 = 1e-12;

/// What the colours of a volume mean to rays.
#[derive(Debug, Clone)]
pub(super) struct ColorField {
    from: OpacityFrom,
    /// Opacities over luma and maximum.
    transfer: TransferFunction,
    /// Turns the display's numbers into those that are integrated.
    turned: fn(f64) -> f64,
}

/// A voxel: straight colour, and opacity per reference length.
struct Corner {
    color: [f64; 3],
    alpha: f64,
}

impl ColorField {
    /// The colours of `volume` in `scene`, turned into the numbers that are integrated; `None` for values.
    pub(super) fn of(scene: &Scene, volume: &Volume, turned: fn(f64) -> f64) -> Option<Self> {
        Some(Self { from: scene.color_opacity(volume)?, transfer: scene.transfer().clone(), turned })
    }

    /// What a voxel of such numbers is. Transparent where one that counts is no finite number.
    fn corner(&self, numbers: [f64; 4]) -> Corner {
        let counts = if self.from == OpacityFrom::Alpha { 4 } else { 3 };
        if numbers[..counts].iter().any(|x| !x.is_finite()) {
            return Corner { color: [0.0; 3], alpha: 0.0 };
        }
        let [r, g, b, a] = numbers.map(|x| x.clamp(0.0, 1.0));
        let alpha = match self.from {
            OpacityFrom::Alpha => a,
            OpacityFrom::Luma => self.transfer.eval((0.2126 * r + 0.7152 * g + 0.0722 * b).min(1.0)).alpha,
            OpacityFrom::Maximum => self.transfer.eval(r.max(g.max(b))).alpha,
        };
        Corner { color: [r, g, b].map(self.turned), alpha }
    }

    /// The colours along a piece of ray in the cell whose lower corner is voxel `low`: from `place` in it over `way`. `None` where nothing shows.
    pub(super) fn along(&self, volume: &Volume, low: [i64; 3], place: [f64; 3], way: [f64; 3]) -> Option<ColorPiece> {
        let (colors, dims) = (volume.colors()?, volume.grid().dims());
        let (mut extinction, mut emission, mut wall) = ([0.0; 8], [[0.0; 8]; 3], [[0.0; 8]; 4]);
        for c in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| (low[axis] + (c as i64 >> axis & 1)).clamp(0, dims[axis] as i64 - 1) as usize);
            let Corner { color, alpha } = self.corner(colors.get((z * dims[1] + y) * dims[0] + x));
            if alpha >= 1.0 {
                wall[3][c] = 1.0;
                (0..3).for_each(|i| wall[i][c] = color[i]);
                continue;
            }
            extinction[c] = -libm::log1p(-alpha);
            (0..3).for_each(|i| emission[i][c] = extinction[c] * color[i]);
        }
        let field = |corners: &Corners| cubic(corners, place, way);
        let piece =
            ColorPiece { extinction: field(&extinction), emission: emission.map(|e| field(&e)), wall: rising(wall.map(|w| field(&w))) };
        let dark = extinction.iter().all(|&k| k == 0.0);
        (!dark || piece.wall.is_some()).then_some(piece)
    }
}

/// The colour of weights that rise from the piece's beginning; `None` where there is no weight.
fn rising([r, g, b, weight]: [Cubic; 4]) -> Option<[f64; 3]> {
    let most = weight.0.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    let power = weight.0.iter().position(|c| most > NO_WEIGHT && c.abs() > 1e-9 * most)?;
    Some([r, g, b].map(|c| (c.0[power] / weight.0[power]).clamp(0.0, 1.0)))
}

/// Extinction and emission per reference length along a piece of ray, s from 0 to 1.
pub(super) struct ColorPiece {
    extinction: Cubic,
    emission: [Cubic; 3],
    /// The colour of opaque corners, at which the ray ends.
    wall: Option<[f64; 3]>,
}

/// What one rule finds of a panel: the light, were it the first of its ray.
type Light = [f64; 3];

/// The two rules whose difference tells the error.
#[derive(Debug, Clone)]
pub(super) struct ColorQuadrature {
    coarse: Rule<5>,
    fine: Rule<8>,
}

impl ColorQuadrature {
    pub(super) fn new() -> Self {
        Self { coarse: Rule::new(), fine: Rule::new() }
    }

    /// Adds a piece of ray, `length` reference lengths long, to what is gathered, with an error of at most `tolerance`.
    pub(super) fn gather(&self, piece: &ColorPiece, (length, fog): (f64, Option<PieceFog>), tolerance: f64, g: &mut Gathered) {
        if let Some(color) = piece.wall {
            let (f, color_of_fog) = fog.map_or((1.0, [0.0; 3]), |fog| (fog.factor(0.0).0, fog.color));
            (0..3).for_each(|i| g.rgb[i] += g.transmittance * (f * color[i] + (1.0 - f) * color_of_fog[i]));
            g.transmittance = 0.0;
            g.panels += 1;
            return;
        }
        self.halve(&Panel { piece, length, fog }, (0.0, 1.0), (tolerance, HALVINGS), g);
    }

    fn halve(&self, panel: &Panel<'_>, (a, b): (f64, f64), (tolerance, left): (f64, u32), g: &mut Gathered) {
        if g.transmittance <= DARK {
            return;
        }
        let (rough, good) = (panel.apply(&self.coarse, a, b), panel.apply(&self.fine, a, b));
        let error = (0..3).map(|i| (rough[i] - good[i]).abs()).fold(0.0, f64::max) * g.transmittance;
        let depth = panel.depth(a, b);
        if left > 0 && (depth > DEEP || (error > tolerance * (b - a) && error > ROUNDING)) {
            let middle = 0.5 * (a + b);
            self.halve(panel, (a, middle), (tolerance, left - 1), g);
            self.halve(panel, (middle, b), (tolerance, left - 1), g);
            return;
        }
        g.rgb.iter_mut().zip(good).for_each(|(sum, c)| *sum += g.transmittance * c);
        g.error += error + 4.0 * f64::EPSILON * g.transmittance;
        g.transmittance *= libm::exp(-depth);
        g.panels += 1;
    }
}

/// A piece and what it takes to integrate a part of it.
struct Panel<'p> {
    piece: &'p ColorPiece,
    /// In reference lengths.
    length: f64,
    fog: Option<PieceFog>,
}

impl Panel<'_> {
    /// The optical depth from `a` to `b`: Gauss's rule of two points is exact for cubics.
    fn depth(&self, a: f64, b: f64) -> f64 {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let off = half / 3f64.sqrt();
        let k = |s: f64| self.piece.extinction.at(s).max(0.0);
        half * (k(middle - off) + k(middle + off)) * self.length
    }

    fn apply<const M: usize>(&self, rule: &Rule<M>, a: f64, b: f64) -> Light {
        let mut light = [0.0; 3];
        for (point, weight) in rule.points.iter().zip(&rule.weights) {
            let s = a + (b - a) * point;
            let share = weight * (b - a) * self.length * libm::exp(-self.depth(a, s));
            let f = self.fog.map_or(1.0, |fog| fog.factor(s).0);
            for i in 0..3 {
                let own = self.piece.emission[i].at(s).max(0.0);
                let fogged = self.fog.map_or(0.0, |fog| (1.0 - f) * self.piece.extinction.at(s).max(0.0) * fog.color[i]);
                light[i] += share * (f * own + fogged);
            }
        }
        light
    }
}
