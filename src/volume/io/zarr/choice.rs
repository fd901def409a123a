//! Which image or array of a hierarchy is meant, and which of its levels.

use super::axes::shown;
use super::multiscale::{self, Multiscale};
use super::node::{self, Node, join};
use super::tree::Tree;
use crate::{Error, Result};

/// The group that images of labels stand in.
const LABELS: &str = "labels";

/// Something that may be chosen as `volume.array`.
pub(super) struct Candidate {
    pub(super) way: String,
    /// What it is, in a few words.
    pub(super) about: String,
    rank: Rank,
}

/// Those first that are taken first where nothing is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    Image,
    Volume,
    Labels,
    Slice,
}

impl Candidate {
    /// What to give as `volume.array`.
    pub(super) fn name(&self) -> &str {
        if self.way.is_empty() { "." } else { &self.way }
    }
}

/// All images and arrays under the group `root`, those first that are taken first; levels of images are not among them. An array that cannot
/// be read is left out, unless there is nothing else.
pub(super) fn candidates(tree: &Tree, root: &Node) -> Result<Vec<Candidate>> {
    let mut found = Vec::new();
    let mut fault = None;
    if multiscale::is_image(root) {
        found.push(Candidate { way: String::new(), about: "image".to_owned(), rank: Rank::Image });
        // Else the levels would be walked through.
        node::walk(tree, LABELS, &mut |node| see(node, &mut found, &mut fault))?;
    } else {
        node::walk(tree, "", &mut |node| see(node, &mut found, &mut fault))?;
        let images: Vec<String> = found.iter().filter(|c| c.rank == Rank::Image).map(|c| join(&c.way, LABELS)).collect();
        for way in images {
            node::walk(tree, &way, &mut |node| see(node, &mut found, &mut fault))?;
        }
    }
    found.sort_by(|a, b| (a.rank, &a.way).cmp(&(b.rank, &b.way)));
    match fault {
        Some(fault) if found.is_empty() => Err(fault),
        _ => Ok(found),
    }
}

/// Notes `node` where it may be chosen; whether what is in it is looked at too.
fn see(node: Node, found: &mut Vec<Candidate>, fault: &mut Option<Error>) -> Result<bool> {
    let labels = node.way.split('/').rev().nth(1) == Some(LABELS);
    if multiscale::is_image(&node) {
        let (rank, about) = if labels { (Rank::Labels, "image of labels") } else { (Rank::Image, "image") };
        found.push(Candidate { way: node.way, about: about.to_owned(), rank });
        return Ok(false);
    }
    match node.array() {
        None => return Ok(true),
        Some(Err(e)) => *fault = fault.take().or(Some(e)),
        Some(Ok(array)) => {
            let more_than_one = array.shape.iter().filter(|&&n| n > 1).count();
            let rank = match array.shape.len() {
                _ if labels => Rank::Labels,
                3.. if more_than_one >= 3 => Rank::Volume,
                2.. => Rank::Slice,
                _ => return Ok(false),
            };
            found.push(Candidate { way: node.way, about: format!("array of {} numbers of {}", shown(&array.shape), array.stored), rank });
        }
    }
    Ok(false)
}

/// What is meant.
pub(super) struct Chosen {
    /// An image or an array.
    pub(super) node: Node,
    /// The level of the image, where its array was chosen by name.
    pub(super) level: Option<usize>,
    /// A sentence where there were several to choose from.
    pub(super) note: Option<String>,
}

impl Chosen {
    fn new(node: Node) -> Self {
        Self { node, level: None, note: None }
    }

    /// The array `node`, as a level of the image that it belongs to, if it does.
    fn array(tree: &Tree, node: Node) -> Result<Self> {
        let (group, name) = node.way.rsplit_once('/').unwrap_or(("", &node.way));
        if let Some(group) = Node::open(tree, group)?.filter(|_| !node.way.is_empty()) {
            let level = Multiscale::of(&group)?.and_then(|image| image.levels.iter().position(|level| level.path == name));
            if level.is_some() {
                return Ok(Self { node: group, level, note: None });
            }
        }
        Ok(Self::new(node))
    }
}

/// The image or array that is meant.
///
/// # Errors
/// When there is none.
pub(super) fn node(tree: &Tree, chosen: Option<&str>) -> Result<Chosen> {
    let Some(root) = Node::open(tree, "")? else {
        return Err(Error::format(tree.path(), format!("none of {} is in it", node::FILES.join(", "))));
    };
    if let Some(name) = chosen {
        let way = name.trim_matches('/');
        let found = if matches!(way, "" | ".") { Some(root) } else { Node::open(tree, way)? };
        return match found {
            Some(node) if node.array.is_some() => Chosen::array(tree, node),
            Some(node) if multiscale::is_image(&node) => Ok(Chosen::new(node)),
            other => {
                let what = if other.is_some() { "a group, neither an image nor an array" } else { "not there" };
                Err(Error::format(tree.path(), format!("volume.array is {name:?}: {what}; {}", names(tree)?)))
            }
        };
    }
    if root.array.is_some() || multiscale::is_image(&root) {
        return Ok(Chosen::new(root));
    }
    let candidates = candidates(tree, &root)?;
    let Some(first) = candidates.first() else {
        return Err(Error::format(tree.path(), "the Zarr group holds neither an image nor an array of two or more dimensions"));
    };
    let note =
        (candidates.len() > 1).then(|| format!("Of {} images and arrays in the group {:?} is read.", candidates.len(), first.name()));
    let node = Node::open(tree, &first.way)?;
    node.map(|node| Chosen { note, ..Chosen::new(node) })
        .ok_or_else(|| Error::format(tree.path(), format!("{:?} is not there any more", first.name())))
}

/// Some names that may be chosen.
fn names(tree: &Tree) -> Result<String> {
    let candidates = match Node::open(tree, "")? {
        Some(root) if root.array.is_none() => candidates(tree, &root)?,
        _ => Vec::new(),
    };
    let names: Vec<String> = candidates.iter().take(8).map(|c| format!("{:?}", c.name())).collect();
    Ok(match candidates.len() {
        0 => "there is nothing to choose from".to_owned(),
        1..=8 => format!("there are {}", names.join(", ")),
        n => format!("there are {} and {} more", names.join(", "), n - 8),
    })
}

/// What is known of a level of detail before it is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Detail {
    pub(super) dims: [usize; 3],
    /// Sizes of a voxel along x, y and z.
    pub(super) spacing: [f64; 3],
    /// Bytes of all voxels in memory.
    pub(super) bytes: u128,
}

/// The level to be read where none is chosen: the coarsest whose voxels are not larger than the pixels of a picture of so many along its
/// shorter side, when the box fills it; the finest where nothing is known of the picture. Along an axis that is no finer in the finest level,
/// voxels may be as large as they are there. Where that level is over the `limit` of bytes, the next coarser one within it is taken. `None`
/// where nothing is known of any level.
pub(super) fn level(details: &[Option<Detail>], pixels: Option<u32>, limit: u64) -> Option<usize> {
    let finest = details.iter().flatten().next()?;
    let longest = (0..3).map(|axis| finest.dims[axis] as f64 * finest.spacing[axis].abs()).fold(0.0, f64::max);
    // Levels are often halves of each other: rounding shall not decide.
    let most = |pixels: u32| longest / f64::from(pixels.max(1)) * (1.0 + 1e-6);
    let fine_enough = |detail: &Detail| match pixels {
        None => false,
        Some(pixels) => (0..3).all(|axis| {
            let size = detail.spacing[axis].abs();
            size <= most(pixels) || size <= finest.spacing[axis].abs() * (1.0 + 1e-6)
        }),
    };
    let known = |i: &usize| details[*i].is_some();
    let first = (0..details.len()).find(known)?;
    let best = (first..details.len()).rfind(|&i| details[i].as_ref().is_some_and(fine_enough)).unwrap_or(first);
    let fits = |i: &usize| details[*i].as_ref().is_some_and(|d| d.bytes <= u128::from(limit));
    Some((best..details.len()).find(fits).unwrap_or(best))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn details(spacings: &[[f64; 3]]) -> Vec<Option<Detail>> {
        let detail = |spacing: &[f64; 3]| {
            let dims = spacing.map(|s| (512.0 / s) as usize);
            Detail { dims, spacing: *spacing, bytes: dims.iter().product::<usize>() as u128 }
        };
        spacings.iter().map(|spacing| Some(detail(spacing))).collect()
    }

    #[test]
    fn the_coarsest_level_fine_enough_is_taken() {
        let cube = details(&[[1.0; 3], [2.0; 3], [4.0; 3], [8.0; 3]]);
        for (pixels, expected) in
            [(None, 0), (Some(1024), 0), (Some(512), 0), (Some(511), 0), (Some(256), 1), (Some(200), 1), (Some(64), 3), (Some(1), 3)]
        {
            assert_eq!(level(&cube, pixels, u64::MAX), Some(expected), "{pixels:?}");
        }
        // Slices 8 apart at every level do not keep the finest one.
        let slices = details(&[[1.0, 1.0, 8.0], [2.0, 2.0, 8.0], [4.0, 4.0, 8.0], [8.0, 8.0, 16.0]]);
        assert_eq!(level(&slices, Some(128), u64::MAX), Some(2));
    }

    #[test]
    fn a_level_over_the_limit_gives_way_to_a_coarser_one() {
        let mut cube = details(&[[1.0; 3], [2.0; 3], [4.0; 3]]);
        assert_eq!(level(&cube, None, 256 * 256 * 256), Some(1));
        assert_eq!(level(&cube, Some(512), 128 * 128 * 128), Some(2));
        assert_eq!(level(&cube, None, 1), Some(0));
        cube[0] = None;
        assert_eq!(level(&cube, None, u64::MAX), Some(1));
        assert_eq!(level(&[None, None], None, u64::MAX), None);
    }
}
