//! What kind of values a volume holds, where its file does not say; and the preset to begin with.

use super::Preset;
use crate::volume::{Modality, Number, Space, with_voxels};
use crate::{Result, Volume};

/// Most values that are looked at.
const SAMPLE: usize = 1 << 16;

/// Least share of the voxels that air and that soft tissue make up in CT.
const CROWD: f64 = 0.03;
/// How much denser soft tissue lies in the histogram of CT than what is between it and air.
const ABOVE_GAP: f64 = 2.0;
/// Most voxels of CT below air.
const BELOW_AIR: f64 = 0.02;
/// Least share of the voxels at the least value, and least gap above it, for that value to be padding.
const PADDED: f64 = 0.005;
const GAP: f64 = 400.0;
/// Share of the voxels that a body part fills of its box at least.
const BODY: f64 = 0.12;

/// What kind of values a volume holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// Hounsfield units: air near -1000, soft tissue near 40.
    Hounsfield,
    /// Hounsfield units with 1024 added.
    HounsfieldPlus1024,
    /// Perhaps Hounsfield units of which those below 0 were cut off.
    HounsfieldCut,
    /// Magnetic resonance: brighter and darker tissue without a fixed scale.
    Mr,
    /// Anything else.
    Other,
}

/// A guess at what a volume is, and why.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Guess {
    /// What its values are taken for.
    pub kind: Kind,
    /// The preset that suits it best.
    pub preset: Preset,
    /// Why, in a few words.
    pub reason: String,
    /// What to do where the guess may be mended by a flag; one line.
    pub advice: Option<String>,
}

/// Some of a volume's values, in order.
struct Sorted(Vec<f64>);

impl Sorted {
    /// Every n-th finite voxel, in data units, n odd so that it falls on every column.
    fn of(volume: &Volume) -> Self {
        let (slope, intercept) = volume.rescale();
        let mut values: Vec<f64> = with_voxels!(volume.voxels(), v => {
            let step = v.len().div_ceil(SAMPLE) | 1;
            v.iter().step_by(step).map(|x| slope * Number::to_f64(*x) + intercept).filter(|x| x.is_finite()).collect()
        });
        values.sort_by(f64::total_cmp);
        Self(values)
    }

    /// Share of the values from `low` to below `high`.
    fn share(&self, low: f64, high: f64) -> f64 {
        let below = |x: f64| self.0.partition_point(|&v| v < x);
        below(high).saturating_sub(below(low)) as f64 / self.0.len().max(1) as f64
    }

    /// Share of soft tissue, where values look like Hounsfield units with 1024 added: none below 0, a crowd near 1024 + 40, few between it and air.
    fn plus_1024(&self) -> Option<f64> {
        let (&min, &max) = (self.0.first()?, self.0.last()?);
        let tissue = self.share(924.0, 1174.0);
        let looks = min >= -100.0 && (1500.0..=40000.0).contains(&max) && tissue > 0.05 && tissue > 2.0 * self.share(400.0, 800.0);
        looks.then_some(tissue)
    }

    /// Without what fills the space around: a least value of its own, far below all others and below air.
    fn without_padding(mut self) -> (Self, Option<f64>) {
        let Some(&least) = self.0.first() else { return (self, None) };
        let count = self.0.partition_point(|&v| v <= least);
        let next = self.0.get(count).copied().unwrap_or(least);
        let padded = least < -1100.0 && next - least >= GAP && count as f64 >= PADDED * self.0.len() as f64;
        if padded {
            self.0.drain(..count);
        }
        (self, padded.then_some(least))
    }
}

/// Up to one decimal.
fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// What `volume` holds by its header, and else by its values; with the reason, and the value of its padding where it has some.
fn kind(volume: &Volume) -> (Kind, String, Option<f64>) {
    match volume.modality() {
        Modality::Ct => {
            let values = Sorted::of(volume);
            return match values.plus_1024() {
                Some(tissue) => {
                    (Kind::HounsfieldPlus1024, format!("it is said to be CT, with 1024 added: {} near 1064", percent(tissue)), None)
                }
                None => (Kind::Hounsfield, "it is said to be CT".into(), None),
            };
        }
        Modality::Mr => return (Kind::Mr, "it is said to be MR".into(), None),
        Modality::Other => return (Kind::Other, "it is said to be neither CT nor MR".into(), None),
        Modality::Unknown => {}
    }
    let (values, padding) = Sorted::of(volume).without_padding();
    let (Some(&min), Some(&max)) = (values.0.first(), values.0.last()) else {
        return (Kind::Other, "it holds no finite value".into(), None);
    };
    let (air, soft) = (values.share(-1100.0, -850.0), values.share(-150.0, 200.0));
    let gap = values.share(-700.0, -300.0) / 400.0;
    let below = values.share(f64::NEG_INFINITY, -1150.0);
    let body = body_share(volume);
    if (100.0..=40000.0).contains(&max) && air >= CROWD && soft >= CROWD && below <= BELOW_AIR && soft / 350.0 >= ABOVE_GAP * gap {
        let padded = padding.map_or(String::new(), |p| format!(", {p} around it taken for padding"));
        return (
            Kind::Hounsfield,
            format!("values as of CT: {} air near -1000, {} soft tissue near 40{padded}", percent(air), percent(soft)),
            padding,
        );
    }
    if let Some(tissue) = values.plus_1024() {
        return (Kind::HounsfieldPlus1024, format!("values as of CT with 1024 added: {} near 1064", percent(tissue)), None);
    }
    let integers = values.0.iter().all(|v| libm::floor(*v) == *v);
    let least = values.share(min, min + 0.5);
    if integers && min == 0.0 && least > 0.5 && (1000.0..=4095.0).contains(&max) {
        return (Kind::HounsfieldCut, format!("values from 0 to {max}, {} of them 0", percent(least)), None);
    }
    // Axes that are named after a body, and a box that one fills: medical more often than not.
    let named = volume.grid().space() != Space::Unknown;
    // Phases lie on both sides of 0; rings beside edges a little below it.
    let signed = -min > 0.5 * max && values.share(f64::NEG_INFINITY, 0.0) > 0.25;
    if named && body >= BODY && !signed {
        return (Kind::Mr, format!("axes of a body, {} of the box filled, values not those of CT", percent(body)), None);
    }
    let why = match (named, signed) {
        (true, true) => "values on both sides of 0, not those of CT".to_owned(),
        (true, false) => format!("only {} of the box is filled, and values are not those of CT", percent(body)),
        (false, _) => "nothing says what it is, and values are not those of CT".to_owned(),
    };
    (Kind::Other, why, None)
}

/// Share of the voxels above the value that best divides the histogram into background and object.
fn body_share(volume: &Volume) -> f64 {
    let s = volume.statistics();
    let split = super::Landmarks::of(s).split;
    let width = (s.max - s.min) / s.histogram.len() as f64;
    let first = if width > 0.0 { ((split - s.min) / width).max(0.0) as usize } else { 0 };
    let above: u64 = s.histogram.iter().skip(first).sum();
    above as f64 / s.histogram.iter().sum::<u64>().max(1) as f64
}

impl Guess {
    /// What `volume` is taken for: by its header where that says, else by its values and its axes.
    pub fn of(volume: &Volume) -> Self {
        let (kind, reason, _) = kind(volume);
        let preset = Preset::ordered(volume, kind).next().unwrap_or(Preset::GreyRamp);
        let advice = match kind {
            Kind::HounsfieldPlus1024 => Some("the values look like HU + 1024: set volume.intercept = -1024 to use the ct presets".into()),
            Kind::HounsfieldCut => Some(
                "the values may be Hounsfield units with those below 0 cut off: if so, set volume.modality = \"ct\" to use the ct presets"
                    .into(),
            ),
            _ => None,
        };
        Self { kind, preset, reason, advice }
    }
}

impl Kind {
    /// The kind of `volume`'s values.
    pub fn of(volume: &Volume) -> Self {
        kind(volume).0
    }

    /// Why a preset for CT does not suit values of this kind in `range`, if it does not.
    ///
    /// # Errors
    /// One line.
    pub(super) fn admits_ct(self, name: &str, range: &str) -> Result<(), String> {
        match self {
            Self::Hounsfield => Ok(()),
            Self::HounsfieldPlus1024 => {
                Err(format!("{name} needs Hounsfield units: {range}, which looks like HU + 1024: set volume.intercept = -1024"))
            }
            Self::HounsfieldCut => Err(format!(
                "{name} needs Hounsfield units: {range}; if they are, with those below 0 cut off, set volume.modality = \"ct\""
            )),
            Self::Mr | Self::Other => Err(format!(
                "{name} needs Hounsfield units, with air near -1000 and soft tissue near 40: {range}; if it is CT all the same, set volume.modality = \"ct\""
            )),
        }
    }
}
