//! What a frame needs whose rays have samples of their own, or end at opaque planes.

use super::{PointLookup, VolumeData};
use crate::fragment::Stage;
use crate::proxy::{HalfSpace, RaySteps, Stack};
use crate::scene::{CutColors, Scene};
use crate::volume::Volume;

/// How single rays differ from those that go through flat slices to the far side of the box.
#[derive(Debug)]
pub(crate) struct RayPlan<'v> {
    /// Where samples lie, where not on flat slices.
    pub(crate) steps: Option<RaySteps>,
    /// Opaque planes.
    pub(crate) cuts: Vec<CutFrame>,
    /// What they show.
    pub(crate) lookup: PointLookup<'v>,
    /// From their colours to pixels.
    pub(crate) stages: Vec<Stage<'v>>,
}

/// An opaque plane seen from the picture.
#[derive(Debug)]
pub(crate) struct CutFrame {
    /// Its function of window position and depth: 0 on it.
    pub(crate) plane: HalfSpace,
    pub(crate) colors: CutColors,
}

impl<'v> RayPlan<'v> {
    /// For a frame of `scene` in `stack`; `None` where rays differ in nothing. `stages` are those of opaque planes.
    pub(super) fn new(
        (scene, stack): (&Scene, &Stack),
        steps: Option<RaySteps>,
        (volume, data): (&'v Volume, &'v VolumeData),
        stages: Vec<Stage<'v>>,
    ) -> Option<Self> {
        if steps.is_none() && scene.cuts().is_empty() {
            return None;
        }
        let cut = |plane: &crate::scene::CutPlane| {
            // Windows are checked, and those of the data have a width.
            let colors = CutColors::new(plane, volume.range(), scene.linear_light()).ok()?;
            Some(CutFrame { plane: HalfSpace::of(&stack.view, plane.normal(), -plane.offset()), colors })
        };
        let cuts = scene.cuts().iter().filter_map(cut).collect();
        Some(Self { steps, cuts, lookup: PointLookup::new(volume, scene.method().filter, Some(data)), stages })
    }
}
