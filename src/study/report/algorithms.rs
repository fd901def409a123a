//! The part of a scene's page that compares algorithms.

use super::super::record::AlgorithmRow;
use super::page::{Cell, table};
use super::{error, time};

/// Heading, table, and what it shows; nothing where there are no rows.
pub(super) fn section(list: &[AlgorithmRow]) -> String {
    let Some(first) = list.first() else { return String::new() };
    let row = |a: &AlgorithmRow| {
        vec![
            Cell::Text(a.algorithm.clone()),
            Cell::Number(a.samples.to_string()),
            Cell::Number(time(a.seconds)),
            Cell::Number(a.fetches.to_string()),
            Cell::Number(error(a.rms)),
            Cell::Number(error(a.max)),
        ]
    };
    let rows: Vec<Vec<Cell>> = list.iter().map(row).collect();
    format!(
        "<h2>Algorithms</h2>\n{}<p class=\"soft\">The scene in {} pixels, against the reference. Slices, rays and coin flips take as many samples as the \
         scene has slices; the others go from voxel to voxel, and the most voxels of a ray are told. Templates show a field of blocks, object slices one that is \
         interpolated within layers alone: more samples do not make those the reference. Only slices are made to be fast.</p>\n",
        table(&["algorithm", "samples", "frame", "lookups", "RMS", "largest"], &rows),
        first.reference_pixels
    )
}
