//! What the opacity of a colour goes by, and which bricks of a volume of colours hold how much of that.

use super::bricks::{Bricks, above, below};
use super::{Channels, Colors, Volume, Voxel, Voxels};
use rayon::prelude::*;
use std::sync::Arc;

/// What the opacity of a colour goes by: a number from 0 to 1 of its voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum OpacityFrom {
    /// Its alpha, which is the opacity of a layer as thick as the reference length.
    Alpha,
    /// Its luma, 0.2126 R + 0.7152 G + 0.0722 B of the numbers as stored (the weights of ITU-R BT.709), through the points of the transfer
    /// function's opacity.
    Luma,
    /// The largest of red, green and blue, through the points of the transfer function's opacity.
    Maximum,
}

impl OpacityFrom {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Alpha, Self::Luma, Self::Maximum];

    /// The name used in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alpha => "alpha",
            Self::Luma => "luma",
            Self::Maximum => "maximum",
        }
    }

    /// What it is for voxels of `channels` unless somebody says so; `None` for voxels that are no colours.
    pub fn usual(channels: &Channels) -> Option<Self> {
        match channels {
            Channels::Rgba => Some(Self::Alpha),
            Channels::Rgb => Some(Self::Luma),
            Channels::Scalar | Channels::Label(_) => None,
        }
    }
}

/// Shares of red, green and blue in luma (ITU-R BT.709).
pub(crate) const LUMA: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// What bricks of colours hold of the number that their opacity goes by.
#[derive(Debug)]
pub(crate) struct ColorBricks {
    /// Least and greatest of those numbers, 0 to 1, rounded outwards. Voxels with a number that is NaN or infinite are left out.
    pub(crate) bricks: Arc<Bricks>,
    /// Voxels with a number outside `[0,1]`, which is clamped.
    pub(crate) clamped: usize,
}

impl ColorBricks {
    /// Those of `colors` on a grid of `dims`.
    fn new(colors: Colors<'_>, dims: [usize; 3], from: OpacityFrom) -> Self {
        match colors {
            Colors::U8(v) => Self { bricks: of_integers(v, f64::from(u8::MAX), dims, from), clamped: 0 },
            Colors::U16(v) => Self { bricks: of_integers(v, f64::from(u16::MAX), dims, from), clamped: 0 },
            Colors::F32(v) => {
                let read = if from == OpacityFrom::Alpha { 4 } else { 3 };
                let is_clamped =
                    |c: &&[f32; 4]| c[..read].iter().all(|x| x.is_finite()) && c[..read].iter().any(|x| !(0.0..=1.0).contains(x));
                let number = |c: &[f32; 4]| {
                    let finite = c[..read].iter().all(|x| x.is_finite());
                    if finite { opacity_number(c.map(|x| f64::from(x).clamp(0.0, 1.0)), from) as f32 } else { f32::NAN }
                };
                let numbers: Vec<f32> = v.par_iter().map(number).collect();
                Self { bricks: Arc::new(Bricks::new(&numbers.into(), dims)), clamped: v.par_iter().filter(is_clamped).count() }
            }
        }
    }
}

/// The number, 0 to 1, that the opacity of a straight colour goes by.
fn opacity_number([r, g, b, alpha]: [f64; 4], from: OpacityFrom) -> f64 {
    match from {
        OpacityFrom::Alpha => alpha,
        OpacityFrom::Luma => (LUMA[0] * r + LUMA[1] * g + LUMA[2] * b).min(1.0),
        OpacityFrom::Maximum => r.max(g).max(b),
    }
}

/// Bricks of colours of integers, of which `full` stands for 1.
fn of_integers<T: Voxel + Ord>(colors: &[[T; 4]], full: f64, dims: [usize; 3], from: OpacityFrom) -> Arc<Bricks> {
    if from == OpacityFrom::Luma {
        let luma = |c: &[T; 4]| opacity_number(c.map(|x| x.to_f64() / full), from) as f32;
        return Arc::new(Bricks::new(&colors.par_iter().map(luma).collect::<Vec<f32>>().into(), dims));
    }
    let number = |c: &[T; 4]| if from == OpacityFrom::Alpha { c[3] } else { c[0].max(c[1]).max(c[2]) };
    let mut bricks = Bricks::new(&Voxels::from(colors.par_iter().map(number).collect::<Vec<T>>()), dims);
    bricks.ranges.iter_mut().for_each(|(low, high)| (*low, *high) = (below(f64::from(*low) / full), above(f64::from(*high) / full)));
    bricks.range = (bricks.range.0 / full, bricks.range.1 / full);
    Arc::new(bricks)
}

impl Volume {
    /// What bricks hold of the number that the opacity of colours goes by, computed once for each; `None` for scalars and labels.
    pub(crate) fn color_bricks(&self, from: OpacityFrom) -> Option<&Arc<ColorBricks>> {
        let colors = self.colors()?;
        Some(self.color_bricks[from as usize].get_or_init(|| Arc::new(ColorBricks::new(colors, self.grid.dims(), from))))
    }
}
