//! What a scene did not need, and why: first from the plan, then from what the frame counted.

use super::{BlendKind, Needs};
use crate::raster::Counters;
use crate::scene::{FogDistance, Order, Scene};
use crate::volume::{Volume, VoxelType};

/// Stages and checks that are not in the plan.
pub(crate) fn planned(scene: &Scene, volume: &Volume, needs: &Needs) -> Vec<(String, String)> {
    let mut list: Vec<(&str, String)> = Vec::new();
    let colors = matches!(needs.blend, BlendKind::Over | BlendKind::Add);
    match needs.fog {
        None if scene.fog().is_none() => list.push(("fog", "the scene has none".into())),
        None => list.push(("fog", "values are projected, colours are not blended".into())),
        Some(FogDistance::Planar) => {
            list.push(("fog factor per fragment", "planar fog on view-aligned slices is one number a slice".into()))
        }
        Some(FogDistance::Radial) => {}
    }
    if scene.clip_planes().is_empty() {
        list.push(("clip planes", "the scene has none".into()));
    }
    list.push(("division by q", "texture coordinates are affine on a view-aligned slice".into()));
    list.push(("gradient and lighting", "the scene has no light".into()));
    if !colors {
        list.push(("classification per fragment", "the projected value is classified once a pixel".into()));
        list.push(("opacity correction", "values are projected, opacities are not".into()));
    } else if !needs.perspective {
        list.push((
            "opacity correction of whole slabs",
            "parallel rays cross every whole slab at the same length: the table holds it".into(),
        ));
    }
    if !needs.guard {
        let why = if matches!(volume.voxels().voxel_type(), VoxelType::F32 | VoxelType::F64) {
            "every voxel is finite"
        } else {
            "integers are always finite"
        };
        list.push(("check for NaN and infinity", why.into()));
    }
    if !needs.far {
        list.push(("64-bit voxel offsets", "a batch spans fewer than 2^24 voxels".into()));
    }
    if needs.blend == BlendKind::Over && !needs.terminate {
        let why = if needs.order == Order::BackToFront { "the farthest slice comes first" } else { "terminate = 0" };
        list.push(("early termination", why.into()));
    }
    if !needs.skip {
        let why = if colors { "literal fog lights up empty slices too" } else { "every value counts in this projection" };
        list.push(("skipping of empty space", why.into()));
    }
    list.into_iter().map(|(what, why)| (what.to_owned(), why)).collect()
}

/// Work that the frame passed over, in numbers.
pub(crate) fn counted(c: &Counters, visible_share: Option<f64>, blocks: u64) -> Vec<(String, String)> {
    let mut list = Vec::new();
    let all = c.batches + c.empty + c.finished;
    let percent = |n: u64, of: u64| 100.0 * n as f64 / (of.max(1)) as f64;
    let mut note = |what: &str, n: u64, of: u64, why: String| {
        if n > 0 {
            list.push((what.to_owned(), format!("{n} of {of} ({:.1} %): {why}", percent(n, of))));
        }
    };
    let share = visible_share.map_or(String::new(), |s| format!(" ({:.1} % of all bricks show)", 100.0 * s));
    note("empty batches", c.empty, all, format!("the transfer function shows nothing in their bricks{share}"));
    note("finished batches", c.finished, all, "their pixels let no more light through, or have left the box".into());
    note("coverage and masking of batches", c.whole, c.batches, "every pixel is covered by a whole slab".into());
    note("blocks of 8 x 8 pixels", c.missed_blocks, blocks, "no slice covers any of their pixels".into());
    list
}
