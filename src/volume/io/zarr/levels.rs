//! The levels of an image, of which chunks are read when they are needed.

use super::array::Array;
use super::axes::Axes;
use super::choice;
use super::chunks::Wanted;
use super::fetch;
use super::image::{FinestFirst, Image};
use super::json::Json;
use super::node::join;
use super::tree::Tree;
use crate::volume::io::field;
use crate::volume::io::reading::Reading;
use crate::volume::io::store::Store;
use crate::volume::levels::{Bricks, Level, Levels};
use crate::{Error, Result};
use std::sync::Arc;

/// The attribute of an image's group in which this crate notes what others do not need.
pub(super) const OWN: &str = "slicestack";

/// The chunks of one level.
struct Chunks {
    tree: Arc<Tree>,
    array: Array,
    axes: Axes,
    frame: usize,
    channel: usize,
    /// Chunks along x, y and z.
    counts: [usize; 3],
    /// Least and greatest finite value of each, x fastest, where they are noted.
    ranges: Option<Vec<(f32, f32)>>,
}

impl Bricks for Chunks {
    fn read(&self, at: [usize; 3]) -> Result<(Vec<u8>, u64)> {
        fetch::chunk(&self.tree, &Wanted::new(&self.array, &self.axes, self.frame, self.channel), at)
    }

    fn besides(&self) -> u64 {
        // A chunk as it is stored, and as it is decoded.
        2 * u64::try_from(self.array.chunk_bytes()).unwrap_or(u64::MAX / 4)
    }

    fn range(&self, [x, y, z]: [usize; 3]) -> Option<(f32, f32)> {
        let [nx, ny, _] = self.counts;
        self.ranges.as_ref()?.get((z * ny + y) * nx + x).copied()
    }
}

/// The levels of the image or array in `store` that `reading` chooses, the one chosen and those that are coarser.
///
/// # Errors
/// As reading it as a volume has them; for labels.
pub(in crate::volume::io) fn levels(store: Store, reading: &Reading) -> Result<Levels> {
    let name = store.path().display().to_string();
    let tree = Arc::new(Tree::open(store)?);
    let chosen = choice::node(&tree, reading.choice.array.as_deref())?;
    let (path, way, attributes) = (chosen.node.path.clone(), chosen.node.way.clone(), chosen.node.attributes.clone());
    let finest = Reading {
        pixels: None,
        choice: crate::volume::io::Choice { level: reading.choice.level.or(Some(0)), ..reading.choice.clone() },
        ..reading.clone()
    };
    let image = Image::open(&tree, chosen, &finest)?;
    let FinestFirst { levels: all, frame, channel, like } = image.finest_first()?;
    let own = Json::new(&path, &attributes).get(OWN);
    let noted = own.as_ref().and_then(|own| own.get("ranges")?.list().ok());
    let first = reading.choice.level.unwrap_or(0);
    let mut levels = Vec::new();
    for (i, (array, axes, grid)) in all.into_iter().enumerate() {
        let wanted = Wanted::new(array, axes, frame, channel);
        let (counts, sides) = (wanted.grid(), wanted.along(&array.chunk_shape));
        let limit = u128::from(reading.limits.voxel_bytes);
        if array.chunk_bytes() > limit {
            let what = format!("{}: bytes of a chunk", array.path.display());
            return Err(Error::Limit { what, needed: array.chunk_bytes(), limit });
        }
        let place = noted.as_ref().and_then(|list| list.get(first + i)?.value().as_str());
        let ranges = place.map(|place| ranges(&tree, &join(&way, place), counts)).transpose()?.flatten();
        let chunks = Chunks { tree: Arc::clone(&tree), array: array.clone(), axes: axes.clone(), frame, channel, counts, ranges };
        levels.push(Level::new(grid, sides, Arc::new(chunks)));
    }
    let pair = |key: &str| own.as_ref().and_then(|own| own.get(key)?.numbers(2).ok()).map(|n| (n[0], n[1]));
    let like = match pair("rescale") {
        Some((slope, intercept)) => field::named(&path, like.with_rescale(slope, intercept))?,
        None => like,
    };
    // The range is that of the finest level of all.
    let range = pair("range").filter(|range| range.0 <= range.1);
    Ok(Levels::new(levels, &like.with_name(name), range))
}

/// The ranges in the file of one chunk at `way`: pairs of little-endian f32, as many as there are chunks.
fn ranges(tree: &Tree, way: &str, counts: [usize; 3]) -> Result<Option<Vec<(f32, f32)>>> {
    let Some(mut source) = tree.at(&join(way, "0/0/0/0"))? else { return Ok(None) };
    let count = counts.iter().fold(1u128, |a, &n| a.saturating_mul(n as u128));
    if u128::from(source.left()) != 8 * count {
        let what = format!("{} bytes of ranges: {count} chunks take {}", source.left(), 8 * count);
        return Err(source.fault(what));
    }
    let mut bytes = vec![0; 8 * count as usize];
    let total = bytes.len() as u64;
    source.read_exact_into(&mut bytes, 0, total)?;
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    Ok(Some(bytes.chunks_exact(8).map(|pair| (number(&pair[..4]), number(&pair[4..]))).collect()))
}
