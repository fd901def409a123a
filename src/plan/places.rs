//! What depends on where in the volume a sample lies: regions with transfer functions of their own, and segments of a label map.

use super::prepared::{Prepared, TransferData, TransferKey};
use super::scaling::value_range;
use super::{Scaling, color_frame};
use crate::classify::{By, Measure, Slab, of_straight};
use crate::fragment::{Effect, FocusFrame, RegionsFrame, SegmentsFrame};
use crate::scene::{ByPlace, FocusRegion, Scene, SegmentEffect, SegmentStyle, Straight, slab_ratio};
use crate::skip::BrickClasses;
use crate::volume::Volume;
use crate::volume::bricks::Bricks;
use std::sync::Arc;

/// By how many voxels faces of regions count as thick: more than the rounding of positions.
const MARGIN: f64 = 1e-2;

/// What a frame's regions are classified by.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    /// Tables of the regions, in their order.
    pub(super) regions: Vec<Arc<TransferData>>,
    /// Opacity of the strongest slab that replaces a segment's.
    replaced: f32,
}

impl Places {
    /// The places of `scene`, whose slabs by the main transfer function are like `slab`, and `thickness` world units thick.
    pub(super) fn new(scene: &Scene, volume: &Volume, (slab, thickness): (Slab, f64), by: By, kept: &mut impl Prepared) -> Self {
        let region = |region: &FocusRegion| {
            let slab = Slab { ratio: slab_ratio(thickness, region.transfer().opacity_length(volume.grid())), ..slab };
            // Values that are told apart exactly stand beside their positions as numbers.
            let by = if by == By::Label { By::Voxel } else { by };
            kept.region(TransferKey { transfer: region.transfer().clone(), slab, by, transfer2d: None })
        };
        let regions = scene.regions().iter().map(region).collect();
        let replaced = scene.segments().iter().map(|style| effect(style.effect(), slab).add_alpha).fold(0.0, f32::max);
        Self { regions, replaced }
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self, scene: &Scene) -> bool {
        self.regions.is_empty() && !scene.uses_labels()
    }

    /// What the strongest slab's opacity is, of all that there are besides the main transfer function's.
    pub(super) fn strongest(&self) -> f32 {
        self.regions.iter().map(|data| data.strongest).fold(self.replaced, f32::max)
    }

    /// The regions' part of a frame. `leave_out`: whether rows in which nothing shows may be left out.
    pub(super) fn regions_frame(
        &self,
        scene: &Scene,
        volume: &Volume,
        scaling: &Scaling,
        (deep, leave_out): (bool, bool),
        kept: &mut impl Prepared,
    ) -> Option<RegionsFrame> {
        if self.regions.is_empty() {
            return None;
        }
        let regions = scene.regions().iter().zip(&self.regions).map(|(region, data)| {
            let thinness = deep.then(|| kept.thinness(data).table.clone());
            FocusFrame::new(region, volume.grid(), color_frame(scaling, data, false).0, thinness)
        });
        Some(RegionsFrame { regions: regions.collect(), leave_out })
    }
}

/// The labels' part of a frame of slabs like `slab`.
pub(super) fn segments_frame<'v>(scene: &Scene, volume: &'v Volume, slab: Slab, leave_out: bool) -> Option<SegmentsFrame<'v>> {
    let map = volume.labels().filter(|_| scene.uses_labels())?;
    let [nx, ny, _] = volume.grid().dims();
    let effects = scene.effects(map).into_iter().map(|of| effect(of, slab)).collect();
    Some(SegmentsFrame { places: map.places(), strides: [nx, nx * ny], effects, leave_out })
}

/// What becomes of slabs like `slab`.
fn effect(effect: SegmentEffect, slab: Slab) -> Effect {
    match effect {
        SegmentEffect::Show => Effect::SHOW,
        SegmentEffect::Hide => Effect::HIDE,
        SegmentEffect::Tint { color, strength } => {
            Effect { keep: (1.0 - strength) as f32, mix: color.map(|c| (strength * c) as f32), ..Effect::SHOW }
        }
        SegmentEffect::Replace { color, opacity } => {
            let straight = Straight { rgb: color, alpha: opacity };
            let [r, g, b, alpha] = of_straight(straight, slab).map(|x| x as f32);
            let [.., thinness] = of_straight(straight, Slab { measure: Measure::Thinness, ..slab }).map(|x| x as f32);
            Effect { add: [r, g, b], add_alpha: alpha, thinness, ..Effect::HIDE }
        }
    }
}

/// What bricks show where that depends on their place too.
#[derive(Debug)]
pub(crate) struct PlaceBricks {
    /// The main transfer function's tables, then the regions'.
    data: Vec<Arc<TransferData>>,
    regions: Vec<FocusRegion>,
    segments: Vec<SegmentStyle>,
    pub(crate) classes: BrickClasses,
}

impl PlaceBricks {
    /// What `bricks` of `volume` show of `scene`, whose tables are `data`.
    pub(crate) fn new(scene: &Scene, data: &[Arc<TransferData>], volume: &Volume, bricks: &Bricks) -> Self {
        let places = ByPlace::new(scene, volume, f64::MIN_POSITIVE, MARGIN);
        let classes = BrickClasses::by_place(bricks, |at, low, high| {
            let (low, high) = value_range(volume, low, high);
            // The tables of regions stand behind that of the function around them.
            let table = |n: usize| data.get(if n + 1 == data.len() { 0 } else { n + 1 });
            u8::from(places.show(at, volume, bricks, |n| table(n).is_some_and(|data| data.classifier.may_show(low, high))))
        });
        Self { data: data.to_vec(), regions: scene.regions().to_vec(), segments: scene.segments().to_vec(), classes }
    }

    /// Whether they serve for `scene`, whose tables are `data`: the thickness of slabs does not matter.
    pub(crate) fn serves(&self, scene: &Scene, data: &[Arc<TransferData>]) -> bool {
        let same = |(a, b): (&Arc<TransferData>, &Arc<TransferData>)| a.classifier == b.classifier && a.key.transfer == b.key.transfer;
        self.data.len() == data.len()
            && self.data.iter().zip(data).all(same)
            && self.regions == scene.regions()
            && self.segments == scene.segments()
    }
}
