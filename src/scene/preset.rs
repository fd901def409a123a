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

/// Three values that divide a volume's range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landmarks {
    /// Median of the background: of all that lies below [`Landmarks::split`].
    pub background: f64,
    /// The value that best splits the histogram into background and object (Otsu 1979: largest variance between the two).
    pub split: f64,
    /// The value that 99.5 % of the object lies below.
    pub high: f64,
}

impl Landmarks {
    /// The landmarks of `statistics`; for a volume of one value they are made to rise by 1 each.
    pub fn of(statistics: &Statistics) -> Self {
        let (min, max) = (statistics.min, statistics.max);
        let counts = &statistics.histogram;
        let width = (max - min) / counts.len() as f64;
        let total: u64 = counts.iter().sum();
        if total == 0 || width.is_nan() || width <= 0.0 || width.is_infinite() {
            return Self { background: min - 1.0, split: min, high: min + 1.0 };
        }
        let moment: f64 = counts.iter().enumerate().map(|(i, &c)| i as f64 * c as f64).sum();
        let (mut below, mut below_moment, mut best, mut split_bin) = (0u64, 0.0, -1.0, 0);
        for (i, &c) in counts.iter().enumerate().take(counts.len() - 1) {
            below += c;
            below_moment += i as f64 * c as f64;
            let (w0, w1) = (below as f64, (total - below) as f64);
            let excess = moment * w0 / total as f64 - below_moment;
            let spread = excess * excess / (w0 * w1).max(1.0);
            if spread > best {
                (best, split_bin) = (spread, i + 1);
            }
        }
        let split = min + width * split_bin as f64;
        let share = counts[..split_bin].iter().sum::<u64>() as f64 / total as f64;
        let background = statistics.percentile(share * 0.5).min(split - 0.5 * width);
        let high = statistics.percentile(share + (1.0 - share) * 0.995).max(split + width);
        Self { background, split, high }
    }

    /// The value at position `t` of the scale: -1 = background, 0 = split, 1 = high.
    pub fn at(&self, t: f64) -> f64 {
        if t < 0.0 { self.split + t * (self.split - self.background) } else { self.split + t * (self.high - self.split) }
    }
}

type Colors = &'static [(f64, [f64; 3])];
type Opacities = &'static [(f64, f64)];

/// What the values of a preset's points mean, and the length that its opacities refer to.
enum Scale {
    /// Hounsfield units, opacity per mm.
    Hounsfield,
    /// Positions of [`Landmarks::at`], opacity per smallest voxel spacing.
    Voxel,
    /// Positions of [`Landmarks::at`], opacity per hundredth of the box's diagonal: the same picture at any resolution.
    Box,
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

    fn table(self) -> (Scale, Colors, Opacities) {
        match self {
            Self::CtBone => (Scale::Hounsfield, BONE_COLOR, &[(150.0, 0.0), (250.0, 0.06), (450.0, 0.3), (900.0, 0.5), (1500.0, 0.7)]),
            Self::CtSkinBone => (
                Scale::Hounsfield,
                SKIN_BONE_COLOR,
                &[
                    (-620.0, 0.0),
                    (-400.0, 0.06),
                    (-180.0, 0.05),
                    (-100.0, 0.003),
                    (120.0, 0.004),
                    (200.0, 0.02),
                    (450.0, 0.25),
                    (1000.0, 0.6),
                ],
            ),
            Self::CtSoftTissue => {
                (Scale::Hounsfield, SOFT_COLOR, &[(-30.0, 0.0), (10.0, 0.008), (50.0, 0.03), (120.0, 0.06), (250.0, 0.1), (1000.0, 0.2)])
            }
            Self::CtLung => (
                Scale::Hounsfield,
                LUNG_COLOR,
                &[(-960.0, 0.0), (-900.0, 0.012), (-750.0, 0.02), (-600.0, 0.05), (-450.0, 0.0), (0.0, 0.0), (300.0, 0.01)],
            ),
            Self::CtAngio => {
                (Scale::Hounsfield, ANGIO_COLOR, &[(110.0, 0.0), (170.0, 0.04), (300.0, 0.2), (420.0, 0.15), (600.0, 0.06), (1500.0, 0.12)])
            }
            Self::MrBrain => (Scale::Voxel, BRAIN_COLOR, &[(-0.5, 0.0), (-0.1, 0.02), (0.2, 0.06), (0.6, 0.15), (1.0, 0.35)]),
            Self::MrAngio => (Scale::Voxel, VESSEL_COLOR, &[(-0.6, 0.0), (0.0, 0.002), (0.45, 0.006), (0.7, 0.1), (1.0, 0.5)]),
            Self::GreyRamp => (Scale::Box, GREY_COLOR, RAMP),
            Self::XRay => (Scale::Box, WHITE, &[(-1.0, 0.0), (0.0, 0.004), (0.3, 0.007), (1.0, 0.05)]),
            Self::HotRamp => (Scale::Box, &[], &[(-0.85, 0.0), (0.0, 0.05), (0.5, 0.18), (1.0, 0.5)]),
            Self::ViridisRamp => (Scale::Box, &[], RAMP),
        }
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

const RAMP: Opacities = &[(-0.6, 0.0), (0.0, 0.04), (0.5, 0.18), (1.0, 0.5)];
const WHITE: Colors = &[(0.0, [1.0, 1.0, 1.0])];
const GREY_COLOR: Colors = &[(-0.8, [0.05, 0.05, 0.05]), (0.0, [0.4, 0.4, 0.4]), (1.0, [1.0, 1.0, 1.0])];
const BONE_COLOR: Colors = &[
    (150.0, [0.25, 0.11, 0.06]),
    (280.0, [0.55, 0.36, 0.23]),
    (500.0, [0.84, 0.70, 0.53]),
    (1000.0, [0.98, 0.93, 0.84]),
    (1800.0, [1.0, 1.0, 0.97]),
];
const SKIN_BONE_COLOR: Colors = &[
    (-600.0, [0.30, 0.10, 0.06]),
    (-350.0, [0.80, 0.45, 0.32]),
    (-100.0, [0.95, 0.68, 0.52]),
    (60.0, [0.75, 0.28, 0.20]),
    (200.0, [0.60, 0.42, 0.28]),
    (450.0, [0.90, 0.78, 0.60]),
    (1000.0, [1.0, 0.97, 0.90]),
];
const SOFT_COLOR: Colors = &[
    (-30.0, [0.45, 0.15, 0.10]),
    (40.0, [0.72, 0.28, 0.20]),
    (110.0, [0.92, 0.52, 0.38]),
    (250.0, [0.95, 0.80, 0.62]),
    (1000.0, [1.0, 0.98, 0.92]),
];
const LUNG_COLOR: Colors = &[
    (-960.0, [0.15, 0.30, 0.55]),
    (-800.0, [0.35, 0.55, 0.80]),
    (-600.0, [0.90, 0.60, 0.50]),
    (-450.0, [0.95, 0.75, 0.65]),
    (300.0, [0.95, 0.92, 0.85]),
];
const ANGIO_COLOR: Colors = &[
    (110.0, [0.40, 0.05, 0.04]),
    (200.0, [0.75, 0.12, 0.08]),
    (350.0, [0.95, 0.35, 0.20]),
    (500.0, [0.90, 0.78, 0.60]),
    (1500.0, [1.0, 0.97, 0.90]),
];
const BRAIN_COLOR: Colors = &[
    (-0.5, [0.18, 0.08, 0.07]),
    (0.0, [0.46, 0.26, 0.22]),
    (0.45, [0.82, 0.62, 0.52]),
    (0.8, [0.95, 0.87, 0.78]),
    (1.0, [1.0, 1.0, 0.97]),
];
const VESSEL_COLOR: Colors = &[(-0.6, [0.20, 0.20, 0.28]), (0.45, [0.45, 0.42, 0.50]), (0.7, [0.90, 0.25, 0.15]), (1.0, [1.0, 0.85, 0.60])];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Grid, Voxels};

    fn volume(values: Vec<i16>) -> Volume {
        let n = values.len();
        Volume::new(Grid::with_spacing([n, 1, 1], [1.0, 1.0, 1.0]).expect("grid"), Voxels::I16(values.into())).expect("volume")
    }

    /// Mostly air, then fat, tissue and bone, in Hounsfield units plus `offset`.
    fn ct(offset: i16) -> Volume {
        let mut v = vec![-1000 + offset; 1000];
        v.extend((0..400).map(|i| 20 + i % 60 + offset));
        v.extend((0..100).map(|i| 300 + 12 * i + offset));
        volume(v)
    }

    /// Two thirds background noise, one third signal around 150 of 255.
    fn mr() -> Volume {
        volume((0..2000).map(|i| i % 8).chain((0..1000).map(|i| 100 + i % 120)).collect())
    }

    #[test]
    fn every_preset_that_is_suggested_shows_something() {
        for v in [ct(0), mr(), volume(vec![0, 255]), volume(vec![7; 30]), volume((0..4000).collect())] {
            let s = v.statistics();
            let suggested = Preset::suggest(&v);
            assert!(!suggested.is_empty());
            for p in suggested {
                let t = p.transfer(&v).expect("transfer");
                assert!(t.opaque_within(s.min, s.max), "{} on {} to {}", p.name(), s.min, s.max);
            }
        }
    }

    #[test]
    fn background_stays_empty() {
        let v = mr();
        for p in [Preset::MrBrain, Preset::MrAngio, Preset::GreyRamp, Preset::HotRamp, Preset::ViridisRamp] {
            let t = p.transfer(&v).expect("transfer");
            assert_eq!(t.eval(4.0).alpha, 0.0, "{}", p.name());
            assert!(t.eval(200.0).alpha > 0.0, "{}", p.name());
        }
        for p in Preset::ALL.into_iter().filter(|p| p.is_ct()) {
            let t = p.transfer(&ct(0)).expect("transfer");
            assert_eq!(t.eval(-1000.0).alpha, 0.0, "{}: air", p.name());
        }
        let bone = Preset::CtBone.transfer(&ct(0)).expect("transfer");
        assert_eq!(bone.eval(60.0).alpha, 0.0, "muscle");
        assert!(bone.eval(900.0).alpha > 0.2, "bone");
    }

    #[test]
    fn senseless_presets_say_why() {
        let why = |p: Preset, v: &Volume| p.suits(v).expect_err("senseless");
        assert!(Preset::CtBone.suits(&ct(0)).is_ok());
        assert!(why(Preset::CtBone, &ct(1024)).contains("set volume.intercept = -1024"), "{}", why(Preset::CtBone, &ct(1024)));
        assert!(why(Preset::CtBone, &mr()).contains("run from 0 to 219"));
        assert!(why(Preset::MrBrain, &ct(0)).contains("looks like CT"));
        assert!(why(Preset::MrBrain, &mr().with_modality(Modality::Ct)).contains("is CT"));
        assert!(why(Preset::CtLung, &ct(0).with_modality(Modality::Mr)).contains("is MR"));
        assert!(Preset::MrBrain.suits(&mr()).is_ok());
        for p in Preset::ALL {
            if let Err(line) = p.suits(&mr()) {
                assert!(!line.contains('\n') && line.starts_with(p.name()));
            }
        }
    }

    #[test]
    fn suggestions_follow_the_data() {
        assert!(Preset::suggest(&ct(0))[0].is_ct());
        assert!(!Preset::suggest(&ct(1024)).iter().any(|p| p.is_ct()));
        assert_eq!(Preset::suggest(&mr().with_modality(Modality::Mr))[0], Preset::MrBrain);
        assert!(!Preset::suggest(&mr())[0].is_ct());
    }

    #[test]
    fn landmarks_split_background_from_object() {
        let m = Landmarks::of(mr().statistics());
        assert!(m.background < 8.0 && m.split > 7.0 && m.split <= 101.0 && m.high > 200.0, "{m:?}");
        let one = Landmarks::of(volume(vec![7; 30]).statistics());
        assert!(one.background < one.split && one.split < one.high);
    }

    #[test]
    fn names_are_found_again() {
        for p in Preset::ALL {
            assert_eq!(Preset::from_name(p.name()), Some(p));
            assert!(!p.about().is_empty());
        }
    }
}
