//! What a scene did not need, and why: from the plan first, with the work it saved once the frame has counted.

use super::needs::{BlendKind, Needs};
use crate::lanes::BATCH;
use crate::scene::{FogDistance, OptionalStage, Order, Scene};
use crate::tally::{Counters, LeftOut, Tally};
use crate::volume::{Volume, VoxelType};

/// How the work saved by something follows from what a frame counted.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Saving {
    /// No number says it.
    Unknown,
    /// `saved` units for each lane that went through the stages, where `done` units were done.
    Lanes { saved: u64, done: u64, unit: &'static str },
    /// All lanes of a slice's batch but one.
    AllButOne(&'static str),
    /// The lanes of batches covered by whole slabs.
    Whole(&'static str),
    /// `saved` units for each lookup, where `done` units were done.
    Lookups { saved: u64, done: u64, unit: &'static str },
}

/// Something left out by plan.
#[derive(Debug, Clone)]
pub(crate) struct Planned {
    pub(crate) what: String,
    pub(crate) why: String,
    saving: Saving,
}

impl Planned {
    pub(crate) fn new(what: impl Into<String>, why: impl Into<String>, saving: Saving) -> Self {
        Self { what: what.into(), why: why.into(), saving }
    }

    /// With the numbers of a finished picture.
    pub(crate) fn counted(self, c: &Counters) -> LeftOut {
        let exits = BATCH as u64 * c.exits;
        let lanes = c.lanes + exits;
        let (numbers, unit) = match self.saving {
            Saving::Unknown => return LeftOut::uncounted(self.what, self.why),
            Saving::Lanes { saved, done, unit } => ((saved * lanes, (saved + done) * lanes), unit),
            Saving::AllButOne(unit) => ((c.lanes - (c.batches - c.exits).min(c.lanes), lanes), unit),
            Saving::Whole(unit) => ((c.whole_lanes, lanes), unit),
            Saving::Lookups { saved, done, unit } => ((saved * c.fetches, (saved + done) * c.fetches), unit),
        };
        LeftOut::counted(self.what, self.why, numbers, unit)
    }
}

/// Every lane.
fn lanes(unit: &'static str) -> Saving {
    Saving::Lanes { saved: 1, done: 0, unit }
}

/// Stages and checks that are not in the plan. A lookup loads `loads` numbers for the eight voxels around it, if it is eight.
pub(crate) fn planned(scene: &Scene, volume: &Volume, needs: &Needs, loads: Option<u64>) -> Vec<Planned> {
    let mut list: Vec<Planned> = Vec::new();
    let mut add = |what: &str, why: &str, saving: Saving| list.push(Planned::new(what, why, saving));
    let (colors, surfaces) = (needs.colors(), needs.blend == BlendKind::Surfaces);
    for (id, stage, option) in OptionalStage::ALL.map(|stage| (stage, stage.info(), stage.option())) {
        let saving = if id == OptionalStage::Gradient { Saving::Lanes { saved: 6, done: 1, unit: "lookups" } } else { lanes("lanes") };
        match option.projections.left_out() {
            _ if !(option.wanted)(scene) => add(stage.name, option.absent, saving),
            Some(_) if surfaces => add(stage.name, without_slabs(id), saving),
            Some(why) if !colors => add(stage.name, why, saving),
            _ => {}
        }
    }
    if needs.fog == Some(FogDistance::Planar) {
        let why = "planar fog on view-aligned slices is one number a slice";
        add("fog factor per fragment", why, Saving::AllButOne("factors"));
    }
    if scene.clip_planes().is_empty() {
        add("clip planes", "the scene has none", Saving::Unknown);
    }
    add("division by q", "texture coordinates are affine on a view-aligned slice", lanes("divisions"));
    if surfaces {
        add("classification per fragment", "surfaces have colours of their own", lanes("lanes"));
        add("opacity correction", "a surface's opacity does not depend on the distance of slices", lanes("lanes"));
    } else if !colors {
        add("classification per fragment", "the projected value is classified once a pixel", lanes("lanes"));
        add("opacity correction", "values are projected, opacities are not", lanes("lanes"));
    } else {
        add("opacity of a slab's thickness", "folded into the table, and colours times opacity with it", lanes("powers"));
        if !needs.perspective {
            let why = "parallel rays cross every whole slab at the same length: the table holds it";
            add("opacity correction of whole slabs", why, Saving::Whole("lanes"));
        }
    }
    if let Some(loads) = loads.filter(|&loads| loads < 8) {
        let why = match loads {
            2 => "voxels lie packed with their neighbours: two loads bring all eight",
            _ => "neighbours along x are loaded together",
        };
        add("loads of single voxels", why, Saving::Lookups { saved: 8 - loads, done: loads, unit: "loads" });
    }
    if !needs.guard {
        let floats = matches!(volume.voxels().voxel_type(), VoxelType::F32 | VoxelType::F64);
        let why = if floats { "every voxel is finite" } else { "integers are always finite" };
        add("check for NaN and infinity", why, lanes("lanes"));
    }
    if !needs.far {
        add("64-bit voxel offsets", "a batch spans fewer than 2^24 voxels", lanes("offsets"));
    }
    if needs.blend == BlendKind::Over && !needs.terminate {
        let why = if needs.order == Order::BackToFront { "the farthest slice comes first" } else { "terminate = 0" };
        add("early termination", why, Saving::Unknown);
    }
    if !needs.skip {
        let stages = || OptionalStage::wanted(scene).find_map(|stage| (stage.option().shows_in_empty_space)(scene));
        let why = if colors { stages().unwrap_or("every fragment counts") } else { "every value counts in this projection" };
        add("skipping of empty space", why, Saving::Unknown);
    }
    list
}

/// Why a stage does not run where level surfaces are drawn.
fn without_slabs(stage: OptionalStage) -> &'static str {
    match stage {
        OptionalStage::Gradient | OptionalStage::Light => "surfaces are lit where rays meet them, not slice by slice",
        OptionalStage::GradientOpacity | OptionalStage::Transfer2d => "surfaces have opacities of their own",
        OptionalStage::Fog => "surfaces are drawn without fog",
        OptionalStage::Regions | OptionalStage::Labels => "surfaces have colours of their own",
    }
}

/// Work that the picture passed over.
pub(crate) fn passed_over(t: &Tally, visible_share: Option<f64>) -> Vec<LeftOut> {
    let all = t.batches + t.empty_batches + t.finished_batches + t.merged_batches;
    let share = visible_share.map_or(String::new(), |s| format!(" ({:.1} % of all bricks show)", 100.0 * s));
    let list = [
        LeftOut::counted("empty batches", format!("nothing shows of the values in their bricks{share}"), (t.empty_batches, all), "batches"),
        LeftOut::counted(
            "finished batches",
            "their pixels let no more light through, or have left the box",
            (t.finished_batches, all),
            "batches",
        ),
        LeftOut::counted(
            "batches of merged slabs",
            "one slab stands for three or nine where colour and opacity hardly change, or hardly any light comes from",
            (t.merged_batches, all),
            "batches",
        ),
        LeftOut::counted(
            "rows of 8 pixels",
            "every pixel in them is finished, or not covered",
            (BATCH as u64 * t.batches - t.lanes, BATCH as u64 * t.batches),
            "lanes",
        ),
        LeftOut::counted(
            "classification and blending of rows",
            "nothing shows at the values looked up in them",
            (t.hidden, t.lanes),
            "lanes",
        ),
        LeftOut::counted(
            "gradients and light of fragments",
            "nothing of them shows",
            (if t.gradients > 0 { t.lanes - t.gradients.min(t.lanes) } else { 0 }, t.lanes),
            "lanes",
        ),
        LeftOut::counted(
            "coverage and masking of batches",
            "every pixel is covered by a whole slab",
            (t.whole_batches, t.batches),
            "batches",
        ),
        LeftOut::counted("blocks of 8 x 8 pixels", "no slice covers any of their pixels", (t.missed_blocks, t.blocks), "blocks"),
    ];
    list.into_iter().filter(|l| l.saved.is_some_and(|s| s.count > 0)).collect()
}
