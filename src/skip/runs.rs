//! Runs of slices that are asked about together.

use super::windows::{COARSE, Sides};
use crate::lanes::SIDE;
use crate::proxy::{HalfSpace, Stack};
use crate::scene::MAX_SLICES;
use crate::volume::bricks::BRICK;
use std::array;

/// Numbers of slabs that may become one: runs are made to suit them.
pub(crate) const MERGED: [i64; 2] = [THREE, NINE];
const THREE: i64 = 3;
const NINE: i64 = 9;

/// The runs of a frame's slices.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Runs {
    /// Slices of a run.
    pub(crate) slices: i64,
    /// Runs of a coarse run.
    pub(crate) coarse: i64,
    /// Slices before its first that a run's slabs reach back to: 1 where slabs lie between slices, else 0.
    pub(crate) back: i64,
    /// Whether slices lie so far apart that each is asked about alone.
    pub(crate) thick: bool,
    /// Sides of windows for the boxes of runs and of coarse runs.
    pub(crate) sides: Sides,
}

impl Runs {
    /// Runs of `stack`. With slabs `between` slices each reaches back to the slice before; where slabs `merge` they suit threes and nines.
    pub(crate) fn new(stack: &Stack, between: bool, merge: bool) -> Self {
        let (w, h) = (f64::from(stack.view.width), f64::from(stack.view.height));
        let along = |f: &HalfSpace, x: f64, y: f64| (f.g + if stack.perspective { f.b * x + f.c * y } else { 0.0 }).abs() * stack.spacing;
        let cells = stack.index.iter().map(|f| along(f, 0.5 * w, 0.5 * h)).fold(0.0, f64::max);
        // No frame has more slices than this.
        let thin = ((THIN / cells) as i64).min(MAX_SLICES as i64);
        let slices = match thin {
            _ if !merge => thin.max(1),
            NINE.. => thin / NINE * NINE,
            _ => THREE,
        };
        // Nines do not lie across coarse runs; smaller ones tell more where slices are far apart.
        let coarse = if merge && slices == THREE && thin >= 2 * THREE { 4 * THREE } else { 8 };
        let back = i64::from(between);
        let scale = if stack.perspective { stack.far } else { 1.0 };
        let sides = [1, coarse].map(|runs| {
            let planes = (slices * runs - 1 + back) as f64;
            let brick = (if runs == 1 { BRICK } else { COARSE * BRICK }) as f64;
            array::from_fn(|i| {
                let f = &stack.index[i];
                let steepest = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].iter().map(|&(x, y)| along(f, x, y)).fold(0.0, f64::max);
                let cells = scale * (SIDE - 1) as f64 * (f.b.abs() + f.c.abs()) + planes * steepest;
                // The fewest bricks that such a box and the slack around it touch, wherever they lie; one more is the most.
                let least = (((cells + WIDER) / brick) as usize).saturating_add(1).min(stack.dims[i]);
                // Nearer boxes are smaller: windows that are not too large for them, nor too small for this one.
                if stack.perspective { 1 << least.ilog2() } else { least }
            })
        });
        Self { slices, coarse, back, thick: merge && thin < THREE, sides }
    }
}

/// More cells than the slack of [`Windows`] on both sides together.
const WIDER: f64 = 1e-2;
/// Cells along the rays' main axis that a run crosses at most, if it has more than one slice: to look at fewer does not pay.
const THIN: f64 = 1.5;
