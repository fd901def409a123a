//! What becomes of the segments of a label map, and colours for labels that have none.
//!
//! Each sample has the label of the nearest voxel. By its label, what its value gives (straight colour c, opacity a per reference length) is
//!
//! | effect | colour | opacity |
//! |---|---|---|
//! | show | c | a |
//! | hide | - | 0 |
//! | tint towards t, strength s | (1 - s) c + s Y(c) t | a |
//! | replace by t and b | t | b |
//!
//! Y(c) = 0.2126 R + 0.7152 G + 0.0722 B is the luminance of a colour (Rec. ITU-R BT.709): a tinted segment keeps what is bright and dark of it. Light
//! and fog come after.

use super::linear_light::to_linear;
use super::{Blend, Scene, Straight, TransferFunction};
use crate::volume::{LabelMap, MAX_LABELS};
use crate::{Error, Result, Volume};
use std::collections::BTreeSet;

/// Shares of red, green and blue in the luminance of a colour.
pub(crate) const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// What becomes of a segment's samples. Colours are straight red, green and blue, each in `[0,1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SegmentEffect {
    /// They look as their values give.
    Show,
    /// Nothing of them shows.
    Hide,
    /// Their colours are mixed towards one of the same luminance.
    Tint {
        /// The segment's colour.
        color: [f64; 3],
        /// From 0, which changes nothing, to 1.
        strength: f64,
    },
    /// Colour and opacity do not depend on their values.
    Replace {
        /// The segment's colour.
        color: [f64; 3],
        /// Opacity per reference length, that of the scene's transfer function, in `[0,1]`.
        opacity: f64,
    },
}

/// A segment, by its label, and what becomes of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentStyle {
    label: i64,
    effect: SegmentEffect,
}

impl SegmentStyle {
    /// The segment of the voxels labelled `label`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a number outside `[0,1]`.
    pub fn new(label: i64, effect: SegmentEffect) -> Result<Self> {
        let (color, share, name) = match effect {
            SegmentEffect::Show | SegmentEffect::Hide => ([0.0; 3], 0.0, ""),
            SegmentEffect::Tint { color, strength } => (color, strength, "strength"),
            SegmentEffect::Replace { color, opacity } => (color, opacity, "opacity"),
        };
        let numbers = ["red", "green", "blue"].into_iter().zip(color).chain([(name, share)]);
        match numbers.into_iter().find(|(_, x)| !(0.0..=1.0).contains(x)) {
            Some((name, x)) => Err(Error::invalid(format!("labels segment {label}: {name} {x} is outside [0,1]"))),
            None => Ok(Self { label, effect }),
        }
    }

    /// The label of its voxels.
    pub fn label(&self) -> i64 {
        self.label
    }

    /// What becomes of it.
    pub fn effect(&self) -> SegmentEffect {
        self.effect
    }

    /// The same with its colour turned into another within `[0,1]`.
    fn with_color_turned(self, turn: impl Fn(f64) -> f64) -> Self {
        let turned = |color: [f64; 3]| color.map(|c| turn(c).clamp(0.0, 1.0));
        let effect = match self.effect {
            SegmentEffect::Tint { color, strength } => SegmentEffect::Tint { color: turned(color), strength },
            SegmentEffect::Replace { color, opacity } => SegmentEffect::Replace { color: turned(color), opacity },
            other => other,
        };
        Self { effect, ..self }
    }
}

/// A colour for a label that has none of its own: the same in every file, and far from those of the labels next to it.
///
/// Hues of labels that follow each other lie a golden section of the circle apart, so any few of them are spread out; every three labels
/// run through three kinds of brightness.
pub fn label_color(label: i64) -> [f64; 3] {
    // The golden section as a share of 2^64: its multiples are exact, whatever the label.
    let turn = (label as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let hue = (turn >> 11) as f64 / (1u64 << 53) as f64 * 6.0;
    let (value, least) = [(0.95, 0.30), (0.80, 0.10), (1.0, 0.55)][label.rem_euclid(3) as usize];
    [5.0, 3.0, 1.0].map(|first: f64| {
        let at = first + hue;
        let at = if at >= 6.0 { at - 6.0 } else { at };
        value - (value - least) * at.min(4.0 - at).clamp(0.0, 1.0)
    })
}

impl TransferFunction {
    /// Colours for labels: each of `labels`, which rise, has a colour and an opacity of its own, with steps halfway between them. For lookups of
    /// the nearest voxel: between two labels there is none.
    ///
    /// # Errors
    /// [`Error::Invalid`] for no labels, labels that do not rise, and as [`TransferFunction::new`].
    pub fn of_labels(labels: &[(i64, Straight)]) -> Result<Self> {
        let (mut color, mut opacity) = (Vec::new(), Vec::new());
        for (n, &(label, Straight { rgb, alpha })) in labels.iter().enumerate() {
            let ends = match labels.get(n + 1) {
                Some(&(next, _)) if next <= label => {
                    return Err(Error::invalid(format!("label {next} comes after {label}; labels must rise")));
                }
                Some(&(next, _)) => 0.5 * label as f64 + 0.5 * next as f64,
                None => label as f64 + 0.5,
            };
            let begins = if n == 0 { label as f64 - 0.5 } else { color.last().map_or(0.0, |last: &(f64, [f64; 3])| last.0) };
            color.extend([(begins, rgb), (ends, rgb)]);
            opacity.extend([(begins, alpha), (ends, alpha)]);
        }
        Self::new(color, opacity)
    }
}

impl Scene {
    /// The scene in which some segments of the volume's label map ([`Volume::with_labels`]) are hidden, tinted or replaced; voxels of other
    /// labels look as their values give.
    ///
    /// # Errors
    /// [`Error::Invalid`] for two styles of one label or more than [`MAX_LABELS`], and together with what has no labels: functions of value and
    /// gradient, pre-integrated slabs, [`super::Method::merge`], level surfaces, the profile `opengl`; in projections of values segments can be hidden and
    /// nothing else, and a segment that is replaced has no opacity by gradient.
    pub fn with_segments(mut self, segments: Vec<SegmentStyle>) -> Result<Self> {
        if segments.len() > MAX_LABELS {
            return Err(Error::invalid(format!("{} labels segments: at most {MAX_LABELS} are allowed", segments.len())));
        }
        let mut seen = BTreeSet::new();
        if let Some(twice) = segments.iter().find(|s| !seen.insert(s.label)) {
            return Err(Error::invalid(format!("labels segment {}: is given twice", twice.label)));
        }
        self.segments = segments;
        self.agreed()
    }

    /// What becomes of some segments of the volume's label map.
    pub fn segments(&self) -> &[SegmentStyle] {
        &self.segments
    }

    /// Whether the volume's labels change what values look like.
    pub(crate) fn uses_labels(&self) -> bool {
        self.segments.iter().any(|s| s.effect != SegmentEffect::Show)
    }

    /// Whether something may show where the transfer function shows nothing: in regions with one of their own, and in replaced segments.
    #[cfg(feature = "scene-file")]
    pub(crate) fn shows_by_place(&self) -> bool {
        let replaced = |s: &SegmentStyle| matches!(s.effect, SegmentEffect::Replace { opacity, .. } if opacity > 0.0);
        !self.regions.is_empty() || self.segments.iter().any(replaced)
    }

    /// The effect on each label of `map`, in the order of its values.
    pub(crate) fn effects(&self, map: &LabelMap) -> Vec<SegmentEffect> {
        let mut styles: Vec<&SegmentStyle> = self.segments.iter().collect();
        styles.sort_by_key(|s| s.label);
        let effect = |label: &i64| styles.binary_search_by_key(label, |s| s.label).map_or(SegmentEffect::Show, |at| styles[at].effect);
        map.values().iter().map(effect).collect()
    }

    /// Styles in amounts of light.
    pub(super) fn segments_in_light(&self) -> Vec<SegmentStyle> {
        self.segments.iter().map(|s| s.with_color_turned(to_linear)).collect()
    }

    /// Whether `volume` has the labels that the scene asks for.
    ///
    /// # Errors
    /// [`Error::Invalid`] where it has not.
    pub(crate) fn check_labels(&self, volume: &Volume) -> Result<()> {
        match self.segments.iter().find(|s| s.effect != SegmentEffect::Show) {
            Some(style) if volume.labels().is_none() => {
                Err(Error::invalid(format!("labels segment {}: the volume has no label map", style.label)))
            }
            _ => Ok(()),
        }
    }

    /// Refuses effects on segments that do not go together with the rest of the scene.
    pub(super) fn check_segments(&self) -> Result<()> {
        let no = |label: i64, what: &str| Err(Error::invalid(format!("labels segment {label}: {what}")));
        for &SegmentStyle { label, effect } in &self.segments {
            let (tinted, replaced) = (matches!(effect, SegmentEffect::Tint { .. }), matches!(effect, SegmentEffect::Replace { .. }));
            if (tinted || replaced) && self.blend.projects_values() {
                return no(label, "values are projected, and colours are not: hide it, or show it as it is");
            }
            if effect != SegmentEffect::Show && matches!(self.blend, Blend::Iso { .. } | Blend::Surfaces) {
                return no(label, "does not go together with level surfaces (render blend iso), which are found between samples");
            }
            if effect != SegmentEffect::Show && self.transfer2d.is_some() {
                return no(label, "does not go together with a function of value and gradient (transfer2d)");
            }
            if replaced && self.opacity_by_gradient() {
                return no(label, "opacity by gradient would thin out what replaces it; tint it, or hide it");
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn labels_next_to_each_other_have_colors_far_apart() {
        let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| (a[c] - b[c]) * (a[c] - b[c])).sum::<f64>().sqrt();
        for first in [0, 1, 1000, -50, i64::MAX - 20] {
            let colors: Vec<[f64; 3]> = (0..12).map(|n| label_color(first + n)).collect();
            assert!(colors.iter().flatten().all(|c| (0.0..=1.0).contains(c)), "{colors:?}");
            for (i, a) in colors.iter().enumerate() {
                assert!(colors[..i].iter().all(|b| apart(*a, *b) > 0.15), "{first}: {i} of {colors:?}");
                assert!(i == 0 || apart(*a, colors[i - 1]) > 0.4, "{first}: {i} of {colors:?}");
            }
        }
        assert_eq!(label_color(7), label_color(7));
    }

    #[test]
    fn every_label_has_its_own_color_in_a_transfer_function() {
        let labels = [-7, 0, 1, 2, 900, i64::from(u32::MAX)].map(|l| (l, Straight { rgb: label_color(l), alpha: (l & 3) as f64 / 4.0 }));
        let transfer = TransferFunction::of_labels(&labels).unwrap();
        for (label, straight) in labels {
            assert_eq!(transfer.eval(label as f64), straight, "{label}");
        }
        assert!(TransferFunction::of_labels(&[]).is_err() && TransferFunction::of_labels(&[labels[2], labels[1]]).is_err());
    }

    #[test]
    fn styles_are_checked() {
        let line = |effect| SegmentStyle::new(3, effect).unwrap_err().to_string();
        assert_eq!(line(SegmentEffect::Tint { color: [0.0; 3], strength: 1.5 }), "labels segment 3: strength 1.5 is outside [0,1]");
        assert!(line(SegmentEffect::Replace { color: [0.0, f64::NAN, 0.0], opacity: 0.5 }).contains("green NaN"));
        let hide = SegmentStyle::new(3, SegmentEffect::Hide).unwrap();
        let scene = Scene::new(TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap());
        assert!(scene.clone().with_segments(vec![hide, hide]).unwrap_err().to_string().contains("given twice"));
        let tint = SegmentStyle::new(4, SegmentEffect::Tint { color: [1.0; 3], strength: 1.0 }).unwrap();
        let mip = scene.clone().with_blend(Blend::Mip).unwrap();
        assert!(mip.clone().with_segments(vec![hide]).is_ok());
        assert!(mip.with_segments(vec![tint]).unwrap_err().to_string().contains("labels segment 4: values are projected"));
        let surface = scene.with_segments(vec![hide]).unwrap().with_blend(Blend::Iso { level: 0.5 });
        assert!(surface.unwrap_err().to_string().contains("level surfaces"));
    }
}
