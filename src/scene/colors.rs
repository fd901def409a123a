//! Scenes of volumes of colours: what opacities go by, and what such scenes do not have.

use super::{Algorithm, Blend, Classification, Scene};
use crate::volume::{Channels, OpacityFrom, Volume};
use crate::{Error, Result};

impl Scene {
    /// The scene of a volume of colours, whose opacities go by `from`; `None`, as in a new scene, leaves it to the volume: alpha where colours
    /// have one, else luma.
    ///
    /// With [`OpacityFrom::Luma`] and [`OpacityFrom::Maximum`] opacities are those of [`Scene::transfer`], over numbers from 0 to 1. Its
    /// colours do not count, and with [`OpacityFrom::Alpha`] its opacities do not either, but for the length that they refer to.
    #[must_use]
    pub fn with_opacity_from(mut self, from: Option<OpacityFrom>) -> Self {
        self.opacity_from = from;
        self
    }

    /// What opacities of colours go by, where the scene says so.
    pub fn opacity_from(&self) -> Option<OpacityFrom> {
        self.opacity_from
    }

    /// What opacities go by in `volume`; `None` where its voxels are no colours.
    pub(crate) fn color_opacity(&self, volume: &Volume) -> Option<OpacityFrom> {
        OpacityFrom::usual(volume.channels()).map(|usual| self.opacity_from.unwrap_or(usual))
    }

    /// Refuses what a scene cannot have of `volume`: of colours what needs a value at each voxel, of values what is for colours.
    ///
    /// # Errors
    /// [`Error::Invalid`] with one line that says why.
    pub fn check_with(&self, volume: &Volume) -> Result<()> {
        let file = if volume.name().is_empty() { String::new() } else { format!("{}: ", volume.name()) };
        match self.refusal(volume.channels()) {
            Some(why) => Err(Error::invalid(format!("{file}{why}"))),
            None => Ok(()),
        }
    }

    /// Whether no colour of `volume` has an opacity above 0; never of values.
    #[cfg(feature = "scene-file")]
    pub(crate) fn shows_nothing_of(&self, volume: &Volume) -> bool {
        let Some(from) = self.color_opacity(volume) else { return false };
        let Some((low, high)) = volume.color_bricks(from).map(|found| found.bricks.range) else { return false };
        low > high || if from == OpacityFrom::Alpha { high <= 0.0 } else { !self.transfer().opaque_within(low, high) }
    }

    fn refusal(&self, channels: &Channels) -> Option<String> {
        if !channels.is_color() {
            let from = self.opacity_from?;
            return Some(format!("transfer.opacity_from {}: is for voxels that are colours; these are values", from.name()));
        }
        if *channels == Channels::Rgb && self.opacity_from == Some(OpacityFrom::Alpha) {
            return Some("transfer.opacity_from alpha: the voxels are red, green and blue without alpha; choose luma or maximum".into());
        }
        let method = self.method();
        let needs_values = "needs one number a voxel, and these voxels are colours";
        let blend = match self.blend() {
            Blend::Over | Blend::Under | Blend::Add => None,
            Blend::Mip => Some("mip"),
            Blend::Min => Some("min"),
            Blend::Average => Some("average"),
            Blend::Lmip { .. } => Some("lmip"),
            Blend::AttenuatedMip { .. } => Some("attenuated-mip"),
            Blend::Iso { .. } | Blend::Surfaces => Some("iso"),
        };
        if let Some(blend) = blend {
            return Some(format!("render.blend {blend}: {needs_values}; choose over or add"));
        }
        if !matches!(self.algorithm(), Algorithm::Slices | Algorithm::Grid) {
            let name = self.algorithm().name();
            return Some(format!("render.algorithm {name}: looks values up, and these voxels are colours; choose slices or grid"));
        }
        let refused = [
            (
                self.opengl().is_some(),
                "render.profile opengl: its texture is made of values, and these voxels are colours; choose accurate",
            ),
            (self.jitter().is_some(), "slices.jitter: shifted slices look values up, and these voxels are colours"),
            (
                self.uses_labels() || !self.regions().is_empty(),
                "labels and regions: change what values look like, and these voxels are colours",
            ),
            (!self.cuts().is_empty(), "cut: planes inside the picture show values through a colour map, and these voxels are colours"),
            (self.transfer2d().is_some(), "transfer2d: goes by value and gradient, and these voxels are colours"),
            (
                !self.transfer().gradient_opacity().is_empty(),
                "transfer.gradient_opacity: goes by the gradient of values, and these voxels are colours",
            ),
            (
                method.classification != Classification::Post,
                "transfer.classification: voxels that are colours are not classified; leave it out",
            ),
            (self.lighting().is_some(), "light: normals come from the gradient of values, and these voxels are colours"),
            (method.filter.is_cubic(), "render.filter cubic: the spline is one of values, and these voxels are colours; choose linear"),
            (method.merge, "slices.merge: is decided by the range of values in bricks, and these voxels are colours"),
        ];
        refused.into_iter().find(|r| r.0).map(|r| r.1.to_owned())
    }
}
