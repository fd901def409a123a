//! Which algorithm draws the picture: slices, or one of those that they are compared with.
//!
//! Sources: R. Peikert, Scientific Visualization, 2008 (uniform sampling and voxel-by-voxel traversal, 3-5; ray templates, 3-6);
//! R. Yagel, Template-based volume viewing, 1991; C. Rezk-Salama et al., 2000 (stacks of 2D textures).

use crate::{Error, Result};

/// What draws a scene. All of them compute the same integral, each with errors of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Algorithm {
    /// View-aligned slices: planes of constant depth.
    #[default]
    Slices,
    /// Spherical shells about the eye: surfaces of constant distance. Along parallel rays they are planes.
    Shells,
    /// Ray casting: pixel by pixel, at equal steps along the ray.
    Rays,
    /// Ray casting from voxel to voxel, each with the length of the ray in it.
    Traversal(Connectivity),
    /// One voxelized ray, moved over the plane that rays start from. For parallel rays alone.
    Template(TemplatePlane),
    /// Stacks of 2D textures: the layers of voxels along the axis that the view is most along.
    ObjectSlices {
        /// Whether opacities are corrected for the length of a ray between two layers.
        spacing_correction: bool,
    },
    /// Rays along an axis of the volume, through the voxels of one row each.
    Grid,
    /// A game of chance: each game walks the slices of a ray, ends at one with the probability of its opacity, and pays its colour.
    CoinFlips {
        /// Games of each pixel, 1 to [`MAX_GAMES`].
        games: u32,
        /// What the flips depend on, besides pixel and game.
        seed: u32,
    },
}

/// Most games of a pixel.
pub const MAX_GAMES: u32 = 1 << 20;

/// Which voxels a voxelized ray goes through: two that follow each other share a face (6 neighbours), or at least an edge (18), or at least a
/// corner (26).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Connectivity {
    /// Every voxel that the ray passes.
    #[default]
    Six,
    /// Of two voxels that share no more than an edge, none between.
    Eighteen,
    /// One voxel of each layer along the axis that the ray is most along.
    TwentySix,
}

/// The plane that a ray template is moved over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TemplatePlane {
    /// The base plane, the outermost layer of voxels: every voxel belongs to one ray.
    #[default]
    Base,
    /// The image plane, the known mistake: voxels are missed, and others are met twice.
    Image,
}

impl Algorithm {
    /// Its word in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slices => "slices",
            Self::Shells => "shells",
            Self::Rays => "rays",
            Self::Traversal(_) => "traversal",
            Self::Template(_) => "template",
            Self::ObjectSlices { .. } => "object-slices",
            Self::Grid => "grid",
            Self::CoinFlips { .. } => "coin-flips",
        }
    }

    /// # Errors
    /// [`Error::Invalid`] for a number of games outside its range.
    pub(super) fn check(self) -> Result<()> {
        match self {
            Self::CoinFlips { games, .. } if !(1..=MAX_GAMES).contains(&games) => {
                Err(Error::invalid(format!("render games {games}: must lie between 1 and {MAX_GAMES}")))
            }
            _ => Ok(()),
        }
    }
}
