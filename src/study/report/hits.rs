//! The part of a scene's page that compares the kinds of hit of level surfaces.

use super::super::record::HitKind;
use super::page::{Cell, table};
use super::{error, or_dash, time};

/// Why there is no distance.
const NOWHERE: &str = "no pixel meets the same surface in the picture and in the reference";

/// Heading, table, and what it shows; nothing where there are no rows.
pub(super) fn section(list: &[HitKind]) -> String {
    let (Some(first), Some(last)) = (list.first(), list.last()) else { return String::new() };
    let row = |h: &HitKind| {
        vec![
            Cell::Text(h.kind.clone()),
            Cell::Number(h.slices.to_string()),
            Cell::Number(time(h.seconds)),
            Cell::Number(error(h.rms)),
            Cell::Number(error(h.max)),
            Cell::number(h.mean_distance, error, NOWHERE),
            Cell::number(h.max_distance, error, NOWHERE),
            Cell::Number(h.elsewhere.to_string()),
        ]
    };
    let rows: Vec<Vec<Cell>> = list.iter().map(row).collect();
    let head = ["hit", "slices", "frame", "RMS", "largest", "mean distance, slabs", "largest distance, slabs", "pixels elsewhere"];
    let told: Vec<String> = ["refined", "first-sample"].into_iter().filter_map(|kind| change(list, kind)).collect();
    format!(
        "<h2>Kinds of hit</h2>\n{}<p>From {} to {} slices, {}.</p>\n<p class=\"soft\">The scene's level surfaces against the exact crossings of \
         linearly interpolated values, on {} pixels. Distances are those of a pixel's nearest hit along the view direction, in thicknesses of a \
         slab: one that stays the same in slabs falls in proportion to their thickness. Pixels elsewhere meet another surface than the reference, \
         or only one of the two meets any, as where a level is crossed twice within a slab; their distances are left out, their errors are not.\
         </p>\n",
        table(&head, &rows),
        first.slices,
        last.slices,
        told.join("; "),
        first.reference_pixels
    )
}

/// How error and distance of a kind change from its fewest to its most slices, in words.
fn change(list: &[HitKind], kind: &str) -> Option<String> {
    let of_kind = || list.iter().filter(|h| h.kind == kind);
    let (first, last) = (of_kind().next()?, of_kind().next_back()?);
    let distance = |h: &HitKind| or_dash(h.mean_distance, error);
    Some(format!(
        "the RMS error of {kind} hits goes from {} to {} and their mean distance from the exact crossings from {} to {} of a slab",
        error(first.rms),
        error(last.rms),
        distance(first),
        distance(last)
    ))
}
