//! What bricks of a volume show where that depends on where they lie: on regions with transfer functions of their own, and on labels.

use super::{FocusRegion, Scene, SegmentEffect, Share};
use crate::Volume;
use crate::volume::bricks::Bricks;

/// A brick holds voxels that look as their values give.
const BY_VALUE: u8 = 1;
/// A brick holds voxels that show whatever their values.
const BY_LABEL: u8 = 2;

/// What bricks of one volume show by place.
pub(crate) struct ByPlace<'s> {
    regions: &'s [FocusRegion],
    /// Of each brick, where labels count.
    kinds: Option<Vec<u8>>,
    /// By how much faces of regions count as thick, world units.
    margin: f64,
}

impl<'s> ByPlace<'s> {
    /// For `scene` of `volume`: segments that are replaced show from an opacity of `least` on, faces of regions count as `margin` voxels thick.
    pub(crate) fn new(scene: &'s Scene, volume: &Volume, least: f64, margin: f64) -> Self {
        let kind = |effect: SegmentEffect| match effect {
            SegmentEffect::Show | SegmentEffect::Tint { .. } => BY_VALUE,
            SegmentEffect::Replace { opacity, .. } if opacity >= least => BY_LABEL,
            SegmentEffect::Replace { .. } | SegmentEffect::Hide => 0,
        };
        let kinds = volume.labels().filter(|_| scene.uses_labels()).map(|map| {
            let kinds: Vec<u8> = scene.effects(map).into_iter().map(kind).collect();
            map.bricks(volume.grid().dims(), &kinds)
        });
        let steps = volume.grid().index_to_world().matrix3;
        let longest = steps.x_axis.length().max(steps.y_axis.length()).max(steps.z_axis.length());
        Self { regions: scene.regions(), kinds, margin: margin * longest }
    }

    /// Whether brick `at` shows something. `shows` tells whether its values do by the function of a region, counted from 0, or by that around all of
    /// them, whose number is the count of regions.
    pub(crate) fn show(&self, at: usize, volume: &Volume, bricks: &Bricks, shows: impl Fn(usize) -> bool) -> bool {
        match self.kinds.as_ref().map(|kinds| kinds[at]) {
            Some(kinds) if kinds & BY_LABEL != 0 => return true,
            Some(kinds) if kinds & BY_VALUE == 0 => return false,
            _ => {}
        }
        if !self.regions.is_empty() {
            let corners = bricks.corners(at, volume.grid());
            for (n, region) in self.regions.iter().enumerate() {
                match region.share(&corners, self.margin) {
                    Share::None => {}
                    Share::Some if shows(n) => return true,
                    Share::Some => {}
                    // No later one counts there, nor the function around them.
                    Share::All => return shows(n),
                }
            }
        }
        shows(self.regions.len())
    }
}
