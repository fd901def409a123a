//! What a scene did not need, and why: from the plan first, with the work it saved once the frame has counted.

use super::needs::{BlendKind, Needs};
use crate::lanes::BATCH;
use crate::scene::{Algorithm, Fits, FogDistance, OptionalStage, Order, Scene, SlabForm};
use crate::tally::{Counters, LeftOut, Tally};
use crate::volume::{Colors, Volume, VoxelType};

/// How the work saved by something follows from what a frame counted.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Saving {
    /// No number says it.
    Unknown,
    /// `saved` units for each lane that went through the stages, where `done` units were done.
    Lanes { saved: u64, done: u64, unit: &'static str },
    /// `saved` units for each lane in a row where something shows, where `done` units were done for each lane looked up.
    Shown { saved: u64, done: u64, unit: &'static str },
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
            Saving::Shown { saved, done, unit } => {
                let shown = lanes - c.hidden.min(lanes);
                ((saved * shown, saved * shown + done * lanes), unit)
            }
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
    let shells = needs.along_rays && scene.algorithm() == Algorithm::Shells;
    let (colors, surfaces) = (needs.colors(), needs.blend == BlendKind::Surfaces);
    for (id, stage, option) in OptionalStage::ALL.map(|stage| (stage, stage.info(), stage.option())) {
        // What could not have run saves nothing: where values are projected, on level surfaces, and beside what it does not go together with.
        let saving = if colors && !surfaces && could_run(id, scene) { saving(id) } else { Saving::Unknown };
        match option.projections.left_out() {
            _ if !(option.wanted)(scene) => add(stage.name, option.absent, saving),
            Some(_) if surfaces => add(stage.name, without_slabs(id), saving),
            Some(why) if !colors => add(stage.name, why, saving),
            _ => {}
        }
    }
    if needs.fog == Some(FogDistance::Planar) && !needs.along_rays {
        let why = "planar fog on view-aligned slices is one number a slice";
        add("fog factor per fragment", why, Saving::AllButOne("factors"));
    }
    if scene.clip_planes().is_empty() {
        add("clip planes", "the scene has none", Saving::Unknown);
    }
    if scene.cuts().is_empty() {
        add("cut planes", "the scene has none", Saving::Unknown);
    }
    let why = if needs.along_rays {
        "texture coordinates are affine along a ray"
    } else {
        "texture coordinates are affine on a view-aligned slice"
    };
    add("division by q", why, lanes("divisions"));
    if surfaces {
        add("classification per fragment", "surfaces have colours of their own", lanes("lanes"));
        add("opacity correction", "a surface's opacity does not depend on the distance of slices", lanes("lanes"));
    } else if !colors {
        add("classification per fragment", "the projected value is classified once a pixel", lanes("lanes"));
        add("opacity correction", "values are projected, opacities are not", lanes("lanes"));
    } else {
        let why = match volume.colors() {
            Some(_) => "folded into a table over the numbers that opacities go by",
            None => "folded into the table, and colours times opacity with it",
        };
        add("opacity of a slab's thickness", why, lanes("powers"));
        if !needs.slanted {
            let rays = if shells { "all rays" } else { "parallel rays" };
            let why = format!("{rays} cross every whole slab at the same length: the table holds it");
            let why = why.as_str();
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
    // Colours of floats are looked at one by one.
    if !needs.guard && !matches!(volume.colors(), Some(Colors::F32(_))) {
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
    if !needs.skip && !needs.peaks(false, false) {
        let stages = || OptionalStage::wanted(scene).find_map(|stage| (stage.option().shows_in_empty_space)(scene));
        let why = if colors { stages().unwrap_or("every fragment counts") } else { "every value counts in this projection" };
        add("skipping of empty space", why, Saving::Unknown);
    }
    list
}

/// What a stage costs where it runs. Gradients, and what depends on them, are taken of fragments that show; fog lies on every lane.
fn saving(stage: OptionalStage) -> Saving {
    match stage {
        OptionalStage::Gradient => Saving::Shown { saved: 6, done: 1, unit: "lookups" },
        OptionalStage::Light | OptionalStage::GradientOpacity | OptionalStage::Transfer2d => {
            Saving::Shown { saved: 1, done: 0, unit: "lanes" }
        }
        OptionalStage::Fog | OptionalStage::Regions | OptionalStage::Labels => lanes("lanes"),
    }
}

/// Whether a stage goes together with the scene's way to integrate. A gradient is taken for the stages that need one.
fn could_run(stage: OptionalStage, scene: &Scene) -> bool {
    use OptionalStage::{Fog, Gradient, GradientOpacity, Labels, Light, Regions, Transfer2d};
    match stage {
        Gradient => [Light, GradientOpacity, Transfer2d].into_iter().any(|s| could_run(s, scene)),
        Light | GradientOpacity | Transfer2d | Fog | Regions | Labels => {
            let (option, method) = (stage.option(), scene.method());
            let asked = [
                (method.is_pre_integrated(), option.pairs),
                (method.merge, option.merging),
                (method.slab == SlabForm::Riemann, option.riemann),
            ];
            asked.iter().all(|(asked, fits)| !asked || *fits == Fits::Yes)
        }
    }
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
pub(crate) fn passed_over(t: &Tally, visible_share: Option<f64>, peaks: bool) -> Vec<LeftOut> {
    let all = t.batches + t.empty_batches + t.finished_batches + t.merged_batches;
    let share = visible_share.map_or(String::new(), |s| format!(" ({:.1} % of all bricks show)", 100.0 * s));
    let list = [
        match peaks {
            true => LeftOut::counted(
                "batches of lesser values",
                "no value in their bricks reaches farther than what their pixels have seen",
                (t.empty_batches, all),
                "batches",
            ),
            false => LeftOut::counted(
                "empty batches",
                format!("nothing shows of the values in their bricks{share}"),
                (t.empty_batches, all),
                "batches",
            ),
        },
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
