//! Ready-made transfer functions in the data's units.
//!
//! CT presets stand at fixed Hounsfield units (air -1000, fat about -100, water 0, soft tissue 20 to 80, contrast-filled vessels
//! 150 to 400, bone from 250 up) with opacities per millimetre. The others are laid over the volume's own values: see [`Landmarks`].

mod guess;
mod landmarks;
mod points;
#[cfg(test)]
mod tests;

pub use guess::{Guess, Kind};
pub use landmarks::Landmarks;

use super::{ColorMap, Lighting, TransferFunction};
use crate::volume::Modality;
use crate::{Result, Volume};
use points::{Points, Scale};

/// Gradient that noise makes in CT, Hounsfield units per millimetre.
const NOISE_OF_CT: f64 = 40.0;
/// Gradient that noise makes in other data, as a share of the landmarks' range per voxel.
const NOISE: f64 = 0.04;

/// A ready-made transfer function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Preset {
    /// CT: bone, and nothing else.
    CtBone,
    /// CT: translucent skin and fat over bone.
    CtSkinBone,
    /// CT: muscles and organs.
    CtSoftTissue,
    /// CT: lungs and airways.
    CtLung,
    /// CT: contrast-filled vessels before faint bone.
    CtAngio,
    /// CT: an aorta filled with contrast agent, chalk in its wall, the spine held back.
    CtAaa,
    /// CT: surfaces of bones, seen through where they are thin.
    CtBones,
    /// CT with contrast agent: the heart's muscle as a veil over the blood in it.
    CtCardiac,
    /// CT with contrast agent: the chest's vessels, and ribs.
    CtChestContrast,
    /// CT with contrast agent: narrow vessels, wide ones as shells.
    CtCoronary,
    /// CT: fat, and bone inside it.
    CtFat,
    /// CT with contrast agent: vessels in the veil of liver and kidneys.
    CtLiverVessels,
    /// CT: a grey ramp for maximum intensity projections ([`crate::scene::Blend::Mip`]).
    CtMip,
    /// CT: muscles, bones where they come to the surface, no fat.
    CtMuscle,
    /// CT: vessels and airways in the veil of the lungs.
    CtPulmonary,
    /// CT: walls around air: lungs, airways, bowels, skin.
    CtAir,
    /// MR: head and brain.
    MrBrain,
    /// MR: bright vessels in a faint surrounding.
    MrAngio,
    /// MR: any part of the body, dense.
    MrDefault,
    /// MR: a grey ramp for maximum intensity projections ([`crate::scene::Blend::Mip`]).
    MrMip,
    /// MR, T2: water bright in the veil of the brain.
    MrT2Brain,
    /// fractional anisotropy: strands of white matter.
    DtiFa,
    /// Brighter and denser with the value.
    GreyRamp,
    /// Like a radiograph: everything adds to the path, nothing hides.
    XRay,
    /// From dark red over yellow to white.
    HotRamp,
    /// Along the viridis map.
    ViridisRamp,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 26] = [
        Self::CtBone,
        Self::CtSkinBone,
        Self::CtSoftTissue,
        Self::CtLung,
        Self::CtAngio,
        Self::CtAaa,
        Self::CtBones,
        Self::CtCardiac,
        Self::CtChestContrast,
        Self::CtCoronary,
        Self::CtFat,
        Self::CtLiverVessels,
        Self::CtMip,
        Self::CtMuscle,
        Self::CtPulmonary,
        Self::CtAir,
        Self::MrBrain,
        Self::MrAngio,
        Self::MrDefault,
        Self::MrMip,
        Self::MrT2Brain,
        Self::DtiFa,
        Self::GreyRamp,
        Self::XRay,
        Self::HotRamp,
        Self::ViridisRamp,
    ];

    /// The name used in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::CtBone => "ct-bone",
            Self::CtSkinBone => "ct-skin-bone",
            Self::CtSoftTissue => "ct-soft-tissue",
            Self::CtLung => "ct-lung",
            Self::CtAngio => "ct-angio",
            Self::CtAaa => "ct-aaa",
            Self::CtBones => "ct-bones",
            Self::CtCardiac => "ct-cardiac",
            Self::CtChestContrast => "ct-chest-contrast",
            Self::CtCoronary => "ct-coronary",
            Self::CtFat => "ct-fat",
            Self::CtLiverVessels => "ct-liver-vessels",
            Self::CtMip => "ct-mip",
            Self::CtMuscle => "ct-muscle",
            Self::CtPulmonary => "ct-pulmonary",
            Self::CtAir => "ct-air",
            Self::MrBrain => "mr-brain",
            Self::MrAngio => "mr-angio",
            Self::MrDefault => "mr-default",
            Self::MrMip => "mr-mip",
            Self::MrT2Brain => "mr-t2-brain",
            Self::DtiFa => "dti-fa",
            Self::GreyRamp => "grey-ramp",
            Self::XRay => "x-ray",
            Self::HotRamp => "hot-ramp",
            Self::ViridisRamp => "viridis-ramp",
        }
    }

    /// The preset called `name` in a scene file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// What it shows, in a few words.
    pub fn about(self) -> &'static str {
        match self {
            Self::CtBone => "CT: bone alone",
            Self::CtSkinBone => "CT: translucent skin and fat over bone",
            Self::CtSoftTissue => "CT: muscles and organs, fat left out",
            Self::CtLung => "CT: lungs and airways",
            Self::CtAngio => "CT: contrast-filled vessels, bone faintly behind",
            Self::CtAaa => "CT: an aorta filled with contrast agent, chalk in its wall, the spine held back",
            Self::CtBones => "CT: surfaces of bones, seen through where they are thin",
            Self::CtCardiac => "CT with contrast agent: the heart's muscle as a veil over the blood in it",
            Self::CtChestContrast => "CT with contrast agent: the chest's vessels, and ribs",
            Self::CtCoronary => "CT with contrast agent: narrow vessels, wide ones as shells",
            Self::CtFat => "CT: fat, and bone inside it",
            Self::CtLiverVessels => "CT with contrast agent: vessels in the veil of liver and kidneys",
            Self::CtMip => "CT: a grey ramp for maximum intensity projections (--render.blend mip)",
            Self::CtMuscle => "CT: muscles, bones where they come to the surface, no fat",
            Self::CtPulmonary => "CT: vessels and airways in the veil of the lungs",
            Self::CtAir => "CT: walls around air: lungs, airways, bowels, skin",
            Self::MrBrain => "MR: head or brain, brighter tissue denser",
            Self::MrAngio => "MR: bright vessels in a faint surrounding",
            Self::MrDefault => "MR: any part of the body, dense",
            Self::MrMip => "MR: a grey ramp for maximum intensity projections (--render.blend mip)",
            Self::MrT2Brain => "MR, T2: water bright in the veil of the brain",
            Self::DtiFa => "fractional anisotropy: strands of white matter",
            Self::GreyRamp => "any data: brighter and denser with the value",
            Self::XRay => "any data: like a radiograph, everything adds up",
            Self::HotRamp => "any data: dark red over yellow to white",
            Self::ViridisRamp => "any data: along the viridis map",
        }
    }

    /// Whether it stands at fixed Hounsfield units.
    pub fn is_ct(self) -> bool {
        matches!(self.points().scale, Scale::Hounsfield)
    }

    fn is_mr(self) -> bool {
        matches!(self, Self::MrBrain | Self::MrAngio | Self::MrDefault | Self::MrMip | Self::MrT2Brain)
    }

    /// The transfer function of a preset that stands at fixed Hounsfield units, for which no volume is needed; `None` of the others.
    pub fn at_fixed_values(self) -> Option<TransferFunction> {
        let Points { scale: Scale::Hounsfield, color, opacity, gradient } = self.points() else { return None };
        let transfer = TransferFunction::new(color.to_vec(), opacity.to_vec()).and_then(|t| t.with_unit(1.0));
        transfer.and_then(|t| t.with_gradient_opacity(gradient.to_vec())).ok()
    }

    /// The preset for `volume`: a transfer function in the data's units that knows the length its opacities refer to.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] when the volume's range leaves f64's.
    pub fn transfer(self, volume: &Volume) -> Result<TransferFunction> {
        // Hounsfield units stand where they stand: the voxels need not be looked at.
        if let Some(transfer) = self.at_fixed_values() {
            return Ok(transfer);
        }
        let Points { scale, color, opacity, .. } = self.points();
        let marks = Landmarks::of(volume.statistics());
        let color = match self {
            Self::HotRamp => ColorMap::Hot.spread(marks.at(-0.8), marks.at(1.0)),
            Self::ViridisRamp => ColorMap::Viridis.spread(marks.at(-0.8), marks.at(1.0)),
            _ => color.iter().map(|&(t, rgb)| (marks.at(t), rgb)).collect(),
        };
        let transfer = TransferFunction::new(color, opacity.iter().map(|&(t, a)| (marks.at(t), a)).collect())?;
        let unit = match scale {
            Scale::Hounsfield => Some(1.0),
            Scale::Voxel => None,
            Scale::Box => Some(volume.grid().radius() / 50.0).filter(|&r| r > 0.0 && r.is_finite()),
        };
        match unit {
            Some(length) => transfer.with_unit(length),
            None => Ok(transfer),
        }
    }

    /// The light that it comes in, for `volume`: a head light, and a gradient below which surfaces count as noise. `None` where it is meant
    /// to be seen without.
    pub fn lighting(self, volume: &Volume) -> Option<Lighting> {
        self.lighting_at_fixed_values().or_else(|| {
            let marks = Landmarks::of(volume.statistics());
            let (range, spacing) = (marks.high - marks.background, volume.grid().smallest_spacing());
            self.lit(Some(NOISE * range / spacing).filter(|g| g.is_finite()).unwrap_or(0.0))
        })
    }

    /// The light of a preset that stands at fixed Hounsfield units, for which no volume is needed; `None` of the others too.
    pub fn lighting_at_fixed_values(self) -> Option<Lighting> {
        if self.is_ct() { self.lit(NOISE_OF_CT) } else { None }
    }

    /// Its light, with a gradient below which surfaces count as noise. Projections show values, and radiographs paths: both go without.
    fn lit(self, gradient_floor: f64) -> Option<Lighting> {
        if matches!(self, Self::XRay | Self::CtMip | Self::MrMip) {
            return None;
        }
        let (specular, shininess) = match self {
            Self::CtBone | Self::CtSkinBone => (0.25, 24.0),
            Self::CtAngio | Self::MrAngio => (0.35, 30.0),
            _ => (0.15, 16.0),
        };
        let mut lighting = Lighting::default();
        (lighting.ambient, lighting.specular, lighting.shininess) = (0.3, specular, shininess);
        lighting.gradient_floor = gradient_floor;
        Some(lighting)
    }

    /// Whether the preset makes sense for `volume`.
    ///
    /// # Errors
    /// One line that says why it does not.
    pub fn suits(self, volume: &Volume) -> Result<(), String> {
        self.suits_values(volume, Kind::of(volume))
    }

    /// As [`Preset::suits`], for values of such a kind.
    fn suits_values(self, volume: &Volume, kind: Kind) -> Result<(), String> {
        let s = volume.statistics();
        let (name, range) = (self.name(), format!("this volume's values run from {} to {}", s.min, s.max));
        if s.histogram.iter().all(|&c| c == 0) {
            return Err(format!("{name}: this volume holds no finite value"));
        }
        if self.is_mr() {
            return match (volume.modality(), kind) {
                (Modality::Ct, _) => Err(format!("{name} is for MR: this volume is CT")),
                (Modality::Other, _) => Err(format!("{name} is for MR: this volume is said to be neither CT nor MR")),
                (_, Kind::Hounsfield) => Err(format!("{name} is for MR: {range}, which looks like CT")),
                _ => Ok(()),
            };
        }
        if self == Self::DtiFa {
            // Fractions; noise takes some past 1.
            let fractions = s.min >= -0.01 && s.max > 0.0 && s.max <= 1.5;
            return if fractions { Ok(()) } else { Err(format!("{name} needs fractions between 0 and 1: {range}")) };
        }
        if !self.is_ct() {
            return Ok(());
        }
        match volume.modality() {
            Modality::Mr => return Err(format!("{name} is for CT: this volume is MR")),
            Modality::Other => return Err(format!("{name} is for CT: this volume is said to be neither CT nor MR")),
            Modality::Ct | Modality::Unknown => {}
        }
        kind.admits_ct(name, &range)?;
        let (needed, there) = match self {
            Self::CtBone | Self::CtSkinBone | Self::CtBones => ("values above 300", s.max > 300.0),
            Self::CtAngio | Self::CtAaa | Self::CtCardiac | Self::CtChestContrast | Self::CtCoronary | Self::CtLiverVessels => {
                ("values above 150", s.max > 150.0)
            }
            Self::CtLung | Self::CtPulmonary | Self::CtAir => ("values below -500", s.min < -500.0),
            Self::CtFat => ("values around -100", s.min < -100.0 && s.max > -100.0),
            _ => ("values around 50", s.min < 50.0 && s.max > 50.0),
        };
        if there { Ok(()) } else { Err(format!("{name} needs Hounsfield units with {needed}: {range}")) }
    }

    /// The presets that suit `volume`, the best guess first. Never empty unless no voxel is finite.
    pub fn suggest(volume: &Volume) -> Vec<Self> {
        Self::ordered(volume, Kind::of(volume)).collect()
    }

    /// The presets that suit `volume` with values of such a kind, the best first.
    fn ordered(volume: &Volume, kind: Kind) -> impl Iterator<Item = Self> {
        const CT: &[Preset] = &[
            Preset::CtBone,
            Preset::CtSkinBone,
            Preset::CtSoftTissue,
            Preset::CtAngio,
            Preset::CtLung,
            Preset::CtBones,
            Preset::CtMuscle,
            Preset::CtFat,
            Preset::CtPulmonary,
            Preset::CtAir,
            Preset::CtChestContrast,
            Preset::CtCardiac,
            Preset::CtCoronary,
            Preset::CtAaa,
            Preset::CtLiverVessels,
            Preset::CtMip,
            Preset::XRay,
            Preset::GreyRamp,
        ];
        const MR: &[Preset] =
            &[Preset::MrBrain, Preset::MrAngio, Preset::MrDefault, Preset::MrT2Brain, Preset::MrMip, Preset::GreyRamp, Preset::XRay];
        const ANY: &[Preset] = &[Preset::HotRamp, Preset::GreyRamp, Preset::ViridisRamp, Preset::MrBrain, Preset::XRay, Preset::DtiFa];
        // Axes or values that look like a body's are no proof.
        const BODY: &[Preset] = &[
            Preset::MrBrain,
            Preset::MrAngio,
            Preset::MrDefault,
            Preset::MrT2Brain,
            Preset::MrMip,
            Preset::HotRamp,
            Preset::GreyRamp,
            Preset::ViridisRamp,
            Preset::XRay,
            Preset::DtiFa,
        ];
        let order = match (kind, volume.modality()) {
            (Kind::Hounsfield, _) => CT,
            (Kind::Mr, Modality::Mr) => MR,
            (Kind::Mr, _) => BODY,
            _ => ANY,
        };
        // CT that is not in Hounsfield units leaves only what goes with any data.
        order.iter().copied().filter(move |p| p.suits_values(volume, kind).is_ok())
    }
}
