//! Which page of a file, or of several, is which slice, channel and frame.

use super::directory::Tiff;
use crate::volume::LengthUnit;

/// Numbers of a slice, and where they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Plane {
    /// Which file, 0 for the one that was opened.
    pub(super) file: usize,
    pub(super) page: usize,
    /// First byte of the plane, where it is one of those behind the only page of a file.
    pub(super) raw: Option<u64>,
}

impl Plane {
    pub(super) fn page(page: usize) -> Self {
        Self { file: 0, page, raw: None }
    }
}

/// Planes of one volume, or of several told apart by channel and frame.
#[derive(Default)]
pub(super) struct Series {
    pub(super) slices: usize,
    pub(super) channels: usize,
    pub(super) frames: usize,
    /// All of them: slices of a channel behind each other, then channels, then frames.
    pub(super) planes: Vec<Plane>,
    /// Names of channels, as far as there are any.
    pub(super) names: Vec<String>,
    pub(super) spacing: [f64; 3],
    /// What the spacing is in, where the file says it.
    pub(super) unit: Option<LengthUnit>,
    /// Slope and intercept of the values.
    pub(super) rescale: Option<(f64, f64)>,
    /// What is to be told.
    pub(super) notes: Vec<String>,
    /// Files beside the one that was opened.
    pub(super) others: Vec<Tiff>,
    /// Whether the colours of a palette are for display alone.
    pub(super) plain_palette: bool,
}

impl Series {
    /// The pages of a file that says no more about them: one slice each.
    pub(super) fn plain(tiff: &Tiff) -> Self {
        let planes: Vec<Plane> = tiff.images().into_iter().map(Plane::page).collect();
        Self { slices: planes.len(), channels: 1, frames: 1, planes, spacing: [1.0; 3], ..Self::default() }
    }

    /// The planes of one channel and frame.
    pub(super) fn of(&self, channel: usize, frame: usize) -> &[Plane] {
        let first = (frame * self.channels + channel) * self.slices;
        &self.planes[first..first + self.slices]
    }

    /// `planes` in the order that `axes` tells (of z, c and t the fastest first), put into the order that is kept.
    pub(super) fn sorted(planes: &[Plane], axes: [char; 3], [z, c, t]: [usize; 3]) -> Vec<Plane> {
        let count = |axis| match axis {
            'z' => z,
            'c' => c,
            _ => t,
        };
        let step = |axis| axes.iter().take_while(|&&a| a != axis).map(|&a| count(a)).product::<usize>();
        let steps = ['z', 'c', 't'].map(step);
        let mut out = Vec::with_capacity(planes.len());
        for frame in 0..t {
            for channel in 0..c {
                out.extend((0..z).map(|slice| planes[slice * steps[0] + channel * steps[1] + frame * steps[2]]));
            }
        }
        out
    }
}
