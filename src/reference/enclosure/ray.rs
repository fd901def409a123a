//! The enclosure of one ray: parts of its pieces, refined where the width comes from, and put together.
//!
//! Back to front, X = C + T X' is what is seen from before a part when X' is seen from behind it. With C = c (1 - T) that lies between c and
//! X', at a share T that enters once: the two unknown numbers T of C and of T X' are the same one. So a wall whose place is not quite known
//! does not widen the colour, where wall and what is before it have nearly one colour.

use super::field::{CellField, Field, bounds, corners, cubic};
use super::fog::RayFog;
use super::interval::Interval;
use super::piece::{Medium, Part, Piece};
use super::rounding::{add_down, add_up, mul_down, mul_up};
use super::walk::{Cut, Ray};
use super::{Enclosure, Prover};

/// Most parts computed for one ray.
const BUDGET: u32 = 1 << 17;
/// Parts from which on twice as many must narrow the bounds.
const STALL: u32 = 1 << 11;
/// Most cells that a piece may lie in with its field looked at.
const MOST_CELLS: i64 = 8;

/// A part of a piece, computed.
#[derive(Debug, Clone, Copy)]
struct Leaf {
    piece: usize,
    a: f64,
    b: f64,
    part: Part,
}

/// The state of one ray's enclosure.
struct Refined<'p> {
    medium: Medium<'p>,
    pieces: Vec<Piece>,
    leaves: Vec<Leaf>,
    /// Whether the ray goes on behind the last piece, unseen.
    rest: bool,
    computed: u32,
}

/// What leaves add up to.
struct Sums {
    rgb: [Interval; 3],
    transmittance: Interval,
    pixel: [Interval; 3],
    /// For each leaf how much of the width comes from it.
    shares: Vec<f64>,
}

/// The enclosure of the ray through window position (x,y), down to `width`; `None` when `stop` says so.
pub(super) fn enclose(prover: &Prover<'_>, (x, y): (f64, f64), width: f64, stop: &dyn Fn() -> bool) -> Option<Enclosure> {
    let ray = Ray::new(&prover.view, prover.volume.grid(), x, y);
    let fog = prover.fog.as_ref().map(|fog| RayFog::new(fog, ray.from_eye, ray.direction));
    let medium = Medium { table: &prover.table, fog: fog.as_ref() };
    let mut state = Refined { medium, pieces: Vec::new(), leaves: Vec::new(), rest: false, computed: 0 };
    if !state.cut(prover, &ray, width, stop)? {
        return Some(prover.unknown());
    }
    let mut last = (STALL, f64::INFINITY);
    loop {
        let sums = state.sums(&prover.background);
        let found = Enclosure::of(sums.rgb, sums.transmittance, sums.pixel, prover.background_alpha, state.leaves.len());
        if found.width <= width || state.computed >= BUDGET {
            return Some(found);
        }
        if state.computed >= last.0 {
            // Twice the parts, and hardly anything gained: the width is of what cannot be told, such as on which side of a face a ray is.
            if found.width > 0.9 * last.1 {
                return Some(found);
            }
            last = (2 * state.computed, found.width);
        }
        if !state.refine(&sums.shares, width, stop)? {
            return Some(found);
        }
    }
}

impl Refined<'_> {
    /// Cuts the ray into pieces, up to where next to nothing shines through; false where it cannot be cut.
    fn cut(&mut self, prover: &Prover<'_>, ray: &Ray, width: f64, stop: &dyn Fn() -> bool) -> Option<bool> {
        let mut through = 1.0;
        let mut stopped = false;
        let done = ray.walk(&prover.view, prover.volume.grid(), &prover.planes, |cut| {
            if through <= width / 32.0 || self.computed >= BUDGET {
                self.rest = true;
                return false;
            }
            if let Some(piece) = piece(prover, ray, cut) {
                self.pieces.push(piece);
                let before = self.leaves.len();
                self.add(self.pieces.len() - 1, 0.0, 1.0);
                for leaf in &self.leaves[before..] {
                    through = mul_up(through, leaf.part.transmittance.hi());
                }
            }
            stopped = stop();
            !stopped
        });
        (!stopped).then_some(done)
    }

    /// Computes the part [a,b] of a piece.
    fn add(&mut self, piece: usize, a: f64, b: f64) {
        self.computed += 1;
        if let Some(part) = self.medium.part(&self.pieces[piece], a, b) {
            self.leaves.push(Leaf { piece, a, b, part });
        }
    }

    /// Puts the leaves together.
    fn sums(&self, background: &[Interval; 3]) -> Sums {
        let behind = if self.rest { Interval::UNIT } else { Interval::ZERO };
        let mut rgb = [behind; 3];
        let mut pixel = background.map(|c| if self.rest { Interval::UNIT } else { c });
        let mut transmittance = if self.rest { Interval::UNIT } else { Interval::ONE };
        let mut shares = vec![0.0; self.leaves.len()];
        for (leaf, share) in self.leaves.iter().zip(&mut shares).rev() {
            let part = &leaf.part;
            let own = (0..3).map(|i| spread(part, i, rgb[i].middle())).fold(0.0, f64::max);
            *share = own.max(part.transmittance.width() * transmittance.hi());
            for i in 0..3 {
                rgb[i] = seen(part, i, rgb[i]);
                pixel[i] = seen(part, i, pixel[i]);
            }
            transmittance = (transmittance * part.transmittance).meet(Interval::UNIT);
        }
        // What is before a leaf dims its share.
        let mut through = 1.0;
        for (leaf, share) in self.leaves.iter().zip(&mut shares) {
            *share *= through;
            through *= leaf.part.transmittance.hi();
        }
        Sums { rgb, transmittance, pixel, shares }
    }

    /// Halves the leaves from which most of the width comes; false where none can be halved.
    fn refine(&mut self, shares: &[f64], width: f64, stop: &dyn Fn() -> bool) -> Option<bool> {
        let largest = shares.iter().fold(0.0, |a: f64, &b| a.max(b));
        let least = (0.5 * width / self.leaves.len() as f64).max(largest / 64.0);
        let leaves = std::mem::take(&mut self.leaves);
        let mut halved = false;
        for (leaf, &share) in leaves.iter().zip(shares) {
            let middle = 0.5 * (leaf.a + leaf.b);
            // Places are kept to multiples of 2^-50, whose sums and differences are exact.
            if share >= least && share > 0.0 && leaf.b - leaf.a > f64::EPSILON * 8.0 && self.computed < BUDGET {
                self.add(leaf.piece, leaf.a, middle);
                self.add(leaf.piece, middle, leaf.b);
                halved = true;
                if stop() {
                    return None;
                }
            } else {
                self.leaves.push(*leaf);
            }
        }
        Some(halved)
    }
}

/// How wide the colour before a part is when the colour behind it is a number.
fn spread(part: &Part, i: usize, behind: f64) -> f64 {
    seen(part, i, Interval::point(behind)).width()
}

/// The colour seen from before a part, from the one seen behind it: c (1 - T) + T X for T and X in their intervals, least and greatest at ends.
fn seen(part: &Part, i: usize, behind: Interval) -> Interval {
    let t = part.transmittance;
    let low = |c: f64, t: f64| add_down(mul_down(c, add_down(1.0, -t)), mul_down(t, behind.lo()));
    let high = |c: f64, t: f64| add_up(mul_up(c, add_up(1.0, -t)), mul_up(t, behind.hi()));
    let color = part.color[i];
    let (mut lo, mut hi) = (low(color.lo(), t.lo()).min(low(color.lo(), t.hi())), high(color.hi(), t.lo()).max(high(color.hi(), t.hi())));
    if let Some(mean) = part.mean {
        let (m, e) = mean[i];
        lo = lo.max(add_down(low(m, t.lo()).min(low(m, t.hi())), e.lo()));
        hi = hi.min(add_up(high(m, t.lo()).max(high(m, t.hi())), e.hi()));
    }
    Interval::new(lo.max(0.0), hi.min(1.0).max(lo.max(0.0)))
}

/// The piece of ray that a cut is; `None` where it is transparent.
fn piece(prover: &Prover<'_>, ray: &Ray, cut: &Cut) -> Option<Piece> {
    let depths = Interval::point(cut.far) - Interval::point(cut.near);
    let mut piece = Piece {
        field: None,
        maybe_clear: !cut.inside,
        near: cut.near,
        far: cut.far,
        length: depths * ray.stretch / Interval::point(prover.opacity_unit),
    };
    let count = cut.cells.iter().fold(1i64, |n, (first, last)| n.saturating_mul(last - first + 1));
    if count > MOST_CELLS {
        piece.maybe_clear = true;
        return Some(piece);
    }
    let mut cells = Vec::with_capacity(count as usize);
    for z in cut.cells[2].0..=cut.cells[2].1 {
        for y in cut.cells[1].0..=cut.cells[1].1 {
            for x in cut.cells[0].0..=cut.cells[0].1 {
                match corners(prover.volume, [x, y, z]) {
                    Some(found) => cells.push(([x, y, z], found, bounds(&found))),
                    None => piece.maybe_clear = true,
                }
            }
        }
    }
    let all = cells.iter().map(|cell| cell.2).reduce(Interval::hull)?;
    if prover.table.transparent(all) {
        return None;
    }
    let way = ray.way(depths);
    let fields: Vec<CellField> = cells
        .iter()
        .map(|(low, found, corners)| CellField { cubic: cubic(found, ray.place(cut.near, *low), way), corners: *corners })
        .collect();
    piece.field = Field::new(&fields);
    Some(piece)
}
