//! What a frame takes of a volume of colours.

use super::prepared::VolumeData;
use crate::classify::By;
use crate::fragment::{ColorSource, FINE};
use crate::scene::{Scene, TransferFunction, to_linear};
use crate::volume::{Colors, OpacityFrom, Volume};
use std::sync::{Arc, OnceLock};

/// What depends on a volume of colours, and on what opacities go by.
#[derive(Debug)]
pub(crate) struct ColorData {
    /// What opacities go by.
    pub(crate) from: OpacityFrom,
    /// Voxels with a number outside `[0,1]`, which is clamped.
    pub(crate) clamped: usize,
    /// What the numbers of colours stand for, as the display's numbers and as amounts of light.
    units: [OnceLock<Vec<f64>>; 2],
}

impl ColorData {
    pub(super) fn new(from: OpacityFrom, clamped: usize) -> Self {
        Self { from, clamped, units: Default::default() }
    }

    /// What each number of `colors` stands for, and the last once more: sRGB numbers as they are, or the light of them. `None` where numbers stand
    /// for themselves.
    fn units(&self, colors: Colors<'_>, light: bool) -> Option<&[f64]> {
        let entries = match colors {
            Colors::U8(_) => 1 << 8,
            Colors::U16(_) => FINE,
            Colors::F32(_) if light => FINE,
            Colors::F32(_) => return None,
        };
        let unit = |i: usize| {
            let number = i.min(entries - 1) as f64 / (entries - 1) as f64;
            if light { to_linear(number) } else { number }
        };
        Some(self.units[usize::from(light)].get_or_init(|| (0..=entries).map(unit).collect()))
    }

    /// What opacities are told apart by.
    pub(super) fn by(&self, volume: &Volume) -> By {
        let bytes = matches!(volume.colors(), Some(Colors::U8(_)));
        By::Color(if bytes && self.from != OpacityFrom::Luma { 1 << 8 } else { FINE })
    }
}

/// From the number that opacities of `scene` go by to those opacities: its transfer function's, or the number itself where that is an alpha.
pub(super) fn opacities(scene: &Scene, from: OpacityFrom) -> TransferFunction {
    match from {
        OpacityFrom::Alpha => scene.transfer().with_own_alpha(),
        OpacityFrom::Luma | OpacityFrom::Maximum => scene.transfer().clone(),
    }
}

/// Where the colours of `volume` and their opacities `alphas` come from. Where nothing may be `hidden`, every row counts.
pub(super) fn source<'v>(
    (volume, data): (&'v Volume, &'v VolumeData),
    alphas: Option<&Arc<Vec<f64>>>,
    scene: &Scene,
    hidden: bool,
) -> Option<Box<ColorSource<'v>>> {
    let (colors, voxels, alphas) = (data.colors.as_ref()?, volume.colors()?, alphas?);
    let least = if hidden { f32::from_bits(1) } else { 0.0 };
    let units = colors.units(voxels, scene.linear_light());
    Some(Box::new(ColorSource { voxels, from: colors.from, alphas: Arc::clone(alphas), units, least }))
}
