//! Which algorithm draws the picture: slices, or one of those that they are compared with.
//!
//! Sources: R. Peikert, Scientific Visualization, 2008 (uniform sampling and voxel-by-voxel traversal, 3-5; ray templates, 3-6);
//! R. Yagel, Template-based volume viewing, 1991; C. Rezk-Salama et al., 2000 (stacks of 2D textures).

use super::{Accumulation, Blend, Ends, FogWeighting, Hit, Order, Placement, SampleAt, Scene, SlabForm, Slicing, Target};
use crate::volume::Volume;
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
    ///
    /// Along parallel rays samples lie on the slices, so the picture is theirs but for rounding. In perspective sample k of every ray lies at the distance
    /// r0 + (k + 1/2) (r1 - r0) / count from the eye: r0 is the least distance from the eye to the box (0 inside it) or the near plane's, whichever is more;
    /// r1 the greatest distance to a corner. It stands for the slab around it, the outermost samples of a ray for what is left up to the box's faces.
    Rays,
    /// Ray casting from voxel to voxel, each with the length of the ray in it.
    ///
    /// With the filter nearest a sample is the voxel's own value, so that with [`Connectivity::Six`] the picture is the exact integral of the field of
    /// blocks; else the value in the middle of the piece. The number of slices does not matter.
    Traversal(Connectivity),
    /// One voxelized ray, moved over the plane that rays start from. For parallel rays alone. Samples are voxels: their values are their own.
    Template(TemplatePlane),
    /// Stacks of 2D textures: the layers of voxels along the axis that the view is most along. A ray has a sample where it meets a layer, whole
    /// for each: at the box's faces none is shortened.
    ObjectSlices {
        /// Whether opacities are corrected for the length of a ray between two layers; else, the known mistake, they are those of a voxel
        /// whatever the angle.
        spacing_correction: bool,
    },
    /// Rays along an axis of the volume ([`Placement::Along`]), through the voxels of one row each, one pixel a row or some. Each sample stands for the
    /// distance of two voxels; where opacities refer to that very length they are the transfer function's own numbers. A level surface is met once, at the first voxel at
    /// or above its level. The depth cue ([`crate::scene::Shading::Depth`]) leaves 1 - k / (n - 1) of a colour at the kth of n voxels where the volume's box is one of nodes.
    Grid,
    /// A game of chance: each game walks the samples of [`Algorithm::Rays`], ends at one with the probability of its opacity, and pays its straight colour;
    /// without such an end it pays the background. The mean over n games differs from "over" by about 1 / sqrt(n).
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
    /// Every voxel that the ray passes for some length. A ray along a face belongs to the voxels of the higher index.
    #[default]
    Six,
    /// As with 26 neighbours, but where a step changes all three coordinates the voxel that the ray passes first is put between.
    Eighteen,
    /// One voxel of each layer along the axis that the ray is most along: the nearest to where the ray meets the layer's middle.
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

    /// Whether it goes ray by ray, each sample at a depth of its own.
    pub(crate) fn is_cast(self) -> bool {
        !matches!(self, Self::Slices | Self::Shells)
    }

    /// Whether it takes as many steps as the scene says; others go from voxel to voxel.
    pub(crate) fn has_steps(self) -> bool {
        matches!(self, Self::Slices | Self::Shells | Self::Rays | Self::CoinFlips { .. })
    }

    /// # Errors
    /// [`Error::Invalid`] for a scene that asks for what this algorithm does not have.
    pub(super) fn check_with(self, scene: &Scene) -> Result<()> {
        if !self.is_cast() {
            return Ok(());
        }
        let (m, blend) = (scene.method(), scene.blend());
        let (grid, chance) = (self == Self::Grid, matches!(self, Self::CoinFlips { .. }));
        let surfaces = matches!(blend, Blend::Iso { .. } | Blend::Surfaces);
        let literal = scene.fog().is_some_and(|f| f.weighting() == FogWeighting::Literal);
        let checks = [
            (m.is_pre_integrated(), "transfer classification", "each sample is classified by its own value"),
            (m.merge, "slices merge", "each sample is looked up"),
            (m.extrapolate, "slices extrapolate", "it is for slices"),
            (m.target != Target::F32, "render target", "rays are summed in f64"),
            (m.accumulation != Accumulation::Auto, "slices accumulation", "rays are summed in f64"),
            (
                matches!(scene.slicing(), Slicing::Tolerance(_)),
                "slices tolerance",
                if self.has_steps() {
                    "samples are not chosen for an error; give slices.count"
                } else {
                    "samples lie where voxels do, whatever error is asked for; leave it out"
                },
            ),
            (
                scene.blending_order() == Order::BackToFront && !grid,
                "slices order",
                "rays are followed from the eye on; choose front-to-back",
            ),
            (chance && blend != Blend::Over, "render blend", "what a game pays is the colour of one sample; choose over"),
            (
                matches!(blend, Blend::Under | Blend::AttenuatedMip { .. }),
                "render blend",
                "it depends on the order of slices, and rays are followed from the eye on; choose another",
            ),
            (surfaces && !grid && self != Self::Rays, "render blend", "surfaces lie between samples at equal steps; choose rays"),
            (surfaces && grid && scene.hit() != Hit::FirstSample, "render hit", "there are values at voxels alone; choose first-sample"),
            (literal && (grid || chance), "fog weighting", "a sample without opacity is none; choose alpha"),
            (m.slab != SlabForm::Exponential && (grid || chance), "slices slab", "opacities lie between 0 and 1; choose exponential"),
            (m.sample != SampleAt::Center && !self.has_steps(), "slices sample", "samples lie where voxels do"),
            (m.ends != Ends::Partial && !self.has_steps(), "slices ends", "samples lie where voxels do"),
            (
                m.filter.is_cubic() && matches!(self, Self::ObjectSlices { .. }),
                "render filter",
                "a layer is interpolated in itself; choose linear",
            ),
            (m.filter.is_cubic() && grid, "render filter", "values are the voxels' own; choose linear or nearest"),
            (scene.transfer2d().is_some() && grid, "transfer2d", "it is evaluated stage by stage; choose another algorithm"),
        ];
        match checks.iter().find(|check| check.0) {
            Some((_, key, why)) => Err(Error::invalid(format!("{key}: does not go together with render algorithm {}: {why}", self.name()))),
            None => Ok(()),
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

impl Scene {
    /// Columns and rows of the picture of [`Algorithm::Grid`] that has one pixel for each row of voxels of `volume`; `None` for other algorithms, and
    /// for cameras that do not look along an axis.
    pub fn voxel_rows(&self, volume: &Volume) -> Option<(u32, u32)> {
        let Placement::Along { axis, .. } = self.camera().placement() else { return None };
        let dims = volume.grid().dims().map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        let [across, down] = [[1, 2], [0, 2], [0, 1]][axis.min(2)];
        (self.algorithm() == Algorithm::Grid).then_some((dims[across], dims[down]))
    }
}
