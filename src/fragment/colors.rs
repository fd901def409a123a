//! Voxels that are colours: looked up, made premultiplied colours of slabs, and interpolated as such.
//!
//! A colour is multiplied by its slab's opacity before it is interpolated. Interpolated apart, colour and opacity would give a place halfway
//! between a voxel and nothing half the opacity and half of nothing's colour: fringes, dark ones where nothing is black.
//!
//! Products are made in f64 and rounded once, as entries of a table are: colours come out as they would from scalars and a table.

use super::batch::Batch;
use super::classify::{keep, lerp};
use super::fetch::nearest_steps;
use super::frame::Frame;
use crate::lanes::{Kernel, Lanes, Number, WIDTH, for_rows, row, spread};
use crate::volume::colors::LUMA;
use crate::volume::{Colors, OpacityFrom};
use std::sync::Arc;

/// What lookups of colours need.
#[derive(Debug, Clone)]
pub(crate) struct ColorSource<'v> {
    pub(crate) voxels: Colors<'v>,
    /// What opacity goes by.
    pub(crate) from: OpacityFrom,
    /// Opacities of slabs over the number that they go by, and the last once more.
    pub(crate) alphas: Arc<Vec<f64>>,
    /// What each number of a colour stands for, and the last once more; `None` where it stands for itself.
    pub(crate) units: Option<&'v [f64]>,
    /// Opacity from which on a row shows something: 0 where every fragment counts.
    pub(crate) least: f32,
}

/// One lookup a fragment, of eight voxels or of the `NEAREST` one: its slab's colour and opacity.
pub(crate) struct ClassifyColors<const NEAREST: bool>;

impl<'v, const NEAREST: bool> Kernel<Frame<'v>, Batch> for ClassifyColors<NEAREST> {
    #[inline(always)]
    fn run<L: Lanes>(frame: &Frame<'v>, batch: &mut Batch) {
        let Some(source) = frame.colors.as_deref() else { unreachable!("the plan chose colours for other voxels") };
        match source.voxels {
            Colors::U8(v) => rows::<L, u8, NEAREST>(frame, source, v, batch),
            Colors::U16(v) => rows::<L, u16, NEAREST>(frame, source, v, batch),
            Colors::F32(v) => rows::<L, f32, NEAREST>(frame, source, v, batch),
        }
    }
}

/// Slabs of some voxels of a row: red, green, blue and opacity of each.
type Slabs = [[f32; WIDTH]; 4];

#[inline(always)]
fn rows<L: Lanes, T: Component, const NEAREST: bool>(frame: &Frame<'_>, source: &ColorSource<'_>, voxels: &[[T; 4]], batch: &mut Batch) {
    let [dx, dy, dz] = frame.sample.strides;
    let steps = [0, dx, dy, dy + dx, dz, dz + dx, dz + dy, dz + dy + dx];
    let (base, far) = (batch.geometry.cells.base, frame.sample.far);
    let nearest = if NEAREST { Some(nearest_steps(frame, batch, spread(batch.rows))) } else { None };
    let mut shown = 0;
    for_rows!(batch.rows, r => {
        let mut corners: [Slabs; 8] = [[[0.0; WIDTH]; 4]; 8];
        for i in 0..WIDTH {
            let n = WIDTH * r + i;
            let at = base + if far { batch.rare.far_offset[n] as usize } else { batch.sample.offset[n] as usize };
            if let Some(nearest) = &nearest {
                put(&mut corners[0], i, slab(source, voxels[at + nearest[n]]));
            } else {
                for (corner, step) in corners.iter_mut().zip(steps) {
                    put(corner, i, slab(source, voxels[at + step]));
                }
            }
        }
        let color = if NEAREST { lanes::<L>(&corners[0]) } else { trilinear::<L>(&corners, batch, r) };
        keep::<L>(batch, r, color);
        // Rows in which nothing shows are left out of what follows.
        shown |= u8::from(L::bits(L::le(L::splat(source.least), color[3])) != 0) << r;
    });
    batch.shown = shown;
}

#[inline(always)]
fn put(slabs: &mut Slabs, i: usize, slab: [f32; 4]) {
    for (to, number) in slabs.iter_mut().zip(slab) {
        to[i] = number;
    }
}

#[inline(always)]
fn lanes<L: Lanes>(slabs: &Slabs) -> [L::F; 4] {
    [L::load(&slabs[0]), L::load(&slabs[1]), L::load(&slabs[2]), L::load(&slabs[3])]
}

/// Three rounds of linear interpolation, as pre-classified voxels have them.
#[inline(always)]
fn trilinear<L: Lanes>(corners: &[Slabs; 8], batch: &Batch, r: usize) -> [L::F; 4] {
    let x = L::load(row(&batch.sample.weight[0], r));
    let y = L::load(row(&batch.sample.weight[1], r));
    let z = L::load(row(&batch.sample.weight[2], r));
    let e00 = lerp::<L>(lanes::<L>(&corners[0]), lanes::<L>(&corners[1]), x);
    let e10 = lerp::<L>(lanes::<L>(&corners[2]), lanes::<L>(&corners[3]), x);
    let near = lerp::<L>(e00, e10, y);
    let e01 = lerp::<L>(lanes::<L>(&corners[4]), lanes::<L>(&corners[5]), x);
    let e11 = lerp::<L>(lanes::<L>(&corners[6]), lanes::<L>(&corners[7]), x);
    let far = lerp::<L>(e01, e11, y);
    lerp::<L>(near, far, z)
}

/// The slab of a voxel: red, green and blue times its opacity, and the opacity. Transparent where a number that counts is NaN or infinite.
#[inline(always)]
fn slab<T: Component>(source: &ColorSource<'_>, color: [T; 4]) -> [f32; 4] {
    let [r, g, b, a] = color;
    let by_alpha = source.from == OpacityFrom::Alpha;
    if !(r.is_number() && g.is_number() && b.is_number() && (a.is_number() || !by_alpha)) {
        return [0.0; 4];
    }
    let alpha = match source.from {
        OpacityFrom::Alpha => a.alpha(&source.alphas),
        OpacityFrom::Maximum => r.greater(g).greater(b).alpha(&source.alphas),
        OpacityFrom::Luma => between(&source.alphas, LUMA[0] * r.position() + LUMA[1] * g.position() + LUMA[2] * b.position()),
    };
    let product = |c: T| (c.unit(source.units) * alpha) as f32;
    [product(r), product(g), product(b), alpha as f32]
}

/// What a table holds at position `x`, from 0 on: the last entry is there twice.
#[inline(always)]
fn between(table: &[f64], x: f64) -> f64 {
    let i = (x as usize).min(table.len() - 2);
    let (a, b) = (table[i], table[i + 1]);
    a + (b - a) * (x - i as f64)
}

/// The last position in a table of [`FINE`] entries.
const LAST: f64 = (FINE - 1) as f64;
/// Entries of tables that numbers lie between.
pub(crate) const FINE: usize = 1 << 16;

/// A number of a colour.
trait Component: Number {
    /// Whether it is neither NaN nor infinite.
    fn is_number(self) -> bool;
    /// The greater of two.
    fn greater(self, other: Self) -> Self;
    /// Its position in a table of [`FINE`] entries from 0 to 1, within it.
    fn position(self) -> f64;
    /// The opacity that goes by it.
    fn alpha(self, alphas: &[f64]) -> f64;
    /// What it stands for, 0 to 1.
    fn unit(self, units: Option<&[f64]>) -> f64;
}

impl Component for u8 {
    #[inline(always)]
    fn is_number(self) -> bool {
        true
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn position(self) -> f64 {
        f64::from(self) * (LAST / 255.0)
    }

    #[inline(always)]
    fn alpha(self, alphas: &[f64]) -> f64 {
        alphas[usize::from(self)]
    }

    #[inline(always)]
    fn unit(self, units: Option<&[f64]>) -> f64 {
        units.map_or(0.0, |units| units[usize::from(self)])
    }
}

impl Component for u16 {
    #[inline(always)]
    fn is_number(self) -> bool {
        true
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn position(self) -> f64 {
        f64::from(self)
    }

    #[inline(always)]
    fn alpha(self, alphas: &[f64]) -> f64 {
        alphas[usize::from(self)]
    }

    #[inline(always)]
    fn unit(self, units: Option<&[f64]>) -> f64 {
        units.map_or(0.0, |units| units[usize::from(self)])
    }
}

impl Component for f32 {
    #[inline(always)]
    fn is_number(self) -> bool {
        self.is_finite()
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn position(self) -> f64 {
        f64::from(self).clamp(0.0, 1.0) * LAST
    }

    #[inline(always)]
    fn alpha(self, alphas: &[f64]) -> f64 {
        between(alphas, self.position())
    }

    #[inline(always)]
    fn unit(self, units: Option<&[f64]>) -> f64 {
        match units {
            Some(units) => between(units, self.position()),
            None => f64::from(self).clamp(0.0, 1.0),
        }
    }
}
