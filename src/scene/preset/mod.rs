//! Ready-made transfer functions in the data's units.
//!
//! CT presets stand at fixed Hounsfield units (air -1000, fat about -100, water 0, soft tissue 20 to 80, contrast-filled vessels
//! 150 to 400, bone from 250 up) with opacities per millimetre. The others are laid over the volume's own values: see [`Landmarks`].

use super::{ColorMap, Lighting, TransferFunction};
use crate::volume::{Modality, Space, Statistics};
use crate::{Result, Volume};

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
    /// MR: head and brain.
    MrBrain,
    /// MR: bright vessels in a faint surrounding.
    MrAngio,
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
    pub const ALL: [Self; 11] = [
        Self::CtBone,
        Self::CtSkinBone,
        Self::CtSoftTissue,
        Self::CtLung,
        Self::CtAngio,
        Self::MrBrain,
        Self::MrAngio,
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
            Self::MrBrain => "mr-brain",
            Self::MrAngio => "mr-angio",
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
            Self::MrBrain => "MR: head or brain, brighter tissue denser",
            Self::MrAngio => "MR: bright vessels in a faint surrounding",
            Self::GreyRamp => "any data: brighter and denser with the value",
            Self::XRay => "any data: like a radiograph, everything adds up",
            Self::HotRamp => "any data: dark red over yellow to white",
            Self::ViridisRamp => "any data: along the viridis map",
        }
    }

    /// Whether it stands at fixed Hounsfield units.
    pub fn is_ct(self) -> bool {
        matches!(self.table().0, Scale::Hounsfield)
    }

    fn is_mr(self) -> bool {
        matches!(self, Self::MrBrain | Self::MrAngio)
    }

    /// The transfer function of a preset that stands at fixed Hounsfield units, for which no volume is needed; `None` of the others.
    pub fn at_fixed_values(self) -> Option<TransferFunction> {
        let (Scale::Hounsfield, color, opacity) = self.table() else { return None };
        TransferFunction::new(color.to_vec(), opacity.to_vec()).and_then(|t| t.with_unit(1.0)).ok()
    }

    /// The preset for `volume`: a transfer function in the data's units that knows the length its opacities refer to.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] when the volume's range leaves f64's.
    pub fn transfer(self, volume: &Volume) -> Result<TransferFunction> {
        let (scale, color, opacity) = self.table();
        // Hounsfield units stand where they stand: the voxels need not be looked at.
        let marks = (!matches!(scale, Scale::Hounsfield)).then(|| Landmarks::of(volume.statistics()));
        let place = |t: f64| marks.map_or(t, |marks| marks.at(t));
        let color = match self {
            Self::HotRamp => ColorMap::Hot.spread(place(-0.8), place(1.0)),
            Self::ViridisRamp => ColorMap::Viridis.spread(place(-0.8), place(1.0)),
            _ => color.iter().map(|&(t, rgb)| (place(t), rgb)).collect(),
        };
        let transfer = TransferFunction::new(color, opacity.iter().map(|&(t, a)| (place(t), a)).collect())?;
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

    /// The light that it comes in, for `volume`; `None` where it is meant to be seen without.
    pub fn lighting(self, volume: &Volume) -> Option<Lighting> {
        let _ = volume;
        None
    }

    /// Whether the preset makes sense for `volume`.
    ///
    /// # Errors
    /// One line that says why it does not.
    pub fn suits(self, volume: &Volume) -> Result<(), String> {
        let s = volume.statistics();
        let (name, range) = (self.name(), format!("this volume's values run from {} to {}", s.min, s.max));
        if s.histogram.iter().all(|&c| c == 0) {
            return Err(format!("{name}: this volume holds no finite value"));
        }
        if self.is_mr() {
            return match volume.modality() {
                Modality::Ct => Err(format!("{name} is for MR: this volume is CT")),
                Modality::Unknown if looks_hounsfield(s) => Err(format!("{name} is for MR: {range}, which looks like CT")),
                _ => Ok(()),
            };
        }
        if !self.is_ct() {
            return Ok(());
        }
        if volume.modality() == Modality::Mr {
            return Err(format!("{name} is for CT: this volume is MR"));
        }
        if looks_hounsfield_plus_1024(s) {
            return Err(format!("{name} needs Hounsfield units: {range}, which looks like HU + 1024: set volume.intercept = -1024"));
        }
        let (needed, there) = match self {
            Self::CtBone | Self::CtSkinBone => ("values above 300", s.max > 300.0),
            Self::CtAngio => ("values above 150", s.max > 150.0),
            Self::CtLung => ("values below -500", s.min < -500.0),
            _ => ("values around 50", s.min < 50.0 && s.max > 50.0),
        };
        // Air is what tells Hounsfield units from any other scale, unless somebody vouches for them.
        let vouched = volume.modality() == Modality::Ct;
        if !there || !(vouched || s.min < -150.0) || s.max > 40000.0 {
            return Err(format!("{name} needs Hounsfield units with {needed}: {range}"));
        }
        Ok(())
    }

    /// The presets that suit `volume`, the best guess first. Never empty unless no voxel is finite.
    pub fn suggest(volume: &Volume) -> Vec<Self> {
        let s = volume.statistics();
        let ct = [Self::CtBone, Self::CtSkinBone, Self::CtSoftTissue, Self::CtAngio, Self::CtLung, Self::XRay, Self::GreyRamp];
        let mr = [Self::MrBrain, Self::MrAngio, Self::GreyRamp, Self::XRay];
        let any = [Self::HotRamp, Self::GreyRamp, Self::ViridisRamp, Self::MrBrain, Self::XRay];
        let body = [Self::MrBrain, Self::MrAngio, Self::HotRamp, Self::GreyRamp, Self::ViridisRamp, Self::XRay];
        let order: &[Self] = match volume.modality() {
            Modality::Ct => &ct,
            Modality::Mr => &mr,
            Modality::Unknown if looks_hounsfield(s) => &ct,
            // Axes that are named after a body: medical more often than not.
            Modality::Unknown if volume.grid().space() != Space::Unknown => &body,
            Modality::Unknown => &any,
        };
        // CT that is not in Hounsfield units leaves only what goes with any data.
        order.iter().copied().filter(|p| p.suits(volume).is_ok()).collect()
    }
}

/// Whether the values span what Hounsfield units do: air below -500 and tissue or bone above 100, nothing absurd.
pub fn looks_hounsfield(s: &Statistics) -> bool {
    s.min <= -500.0 && s.min >= -5000.0 && s.max >= 100.0 && s.max <= 40000.0
}

/// Whether the values look like Hounsfield units stored with 1024 added: nothing below 0, a crowd around 1024 + 40 (soft
/// tissue) and few between it and air.
pub fn looks_hounsfield_plus_1024(s: &Statistics) -> bool {
    let total: u64 = s.histogram.iter().sum();
    let width = (s.max - s.min) / s.histogram.len() as f64;
    let share = |lo: f64, hi: f64| -> f64 {
        let inside = s.histogram.iter().enumerate().filter(|(i, _)| {
            let v = s.min + (*i as f64 + 0.5) * width;
            v >= lo && v < hi
        });
        inside.map(|(_, &c)| c).sum::<u64>() as f64 / total.max(1) as f64
    };
    let tissue = share(924.0, 1174.0);
    s.min >= -100.0 && (1500.0..=40000.0).contains(&s.max) && tissue > 0.05 && tissue > 2.0 * share(400.0, 800.0)
}
