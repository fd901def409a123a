//! The section `[labels]`: a label map beside the volume, or the volume itself where that is one, and what becomes of its segments.

use super::Place;
use super::section::{Context, Data, choices};
use super::table::nearest;
use super::volume::SeriesKey;
use crate::scene::{Blend, Filter, Lighting, Method, Scene, SegmentEffect, SegmentStyle, Straight, TransferFunction, label_color};
use crate::volume::io::Choice;
use crate::volume::{LabelMap, Origin, Segment, VolumeSource};
use crate::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Opacity per voxel of the segments of a label map that is pictured alone.
const SOLID: f64 = 0.8;

/// More labels without names than that are told: perhaps they are values.
const MANY: usize = 128;

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LabelKeys {
    /// File of a label map that fills the volume's box (at any resolution), relative to the scene file.
    pub path: Option<String>,
    /// DICOM: the series of the label map, by its number or the beginning of its UID.
    #[schemars(schema_with = "super::volume::series_words")]
    pub series: Option<SeriesKey>,
    /// File with several arrays: the name of the one that holds the labels.
    pub array: Option<String>,
    /// Multiscale image: the level of detail, counted from 0, the finest.
    pub level: Option<usize>,
    /// Sequence: the frame, counted from 0; the first unless given.
    pub frame: Option<usize>,
    /// Voxels of several numbers: the one that is the label, counted from 0.
    pub channel: Option<usize>,
    /// Segments that are not listed, but for label 0: tint (those to which the file gives a colour, or all where it gives none; the default), show
    /// as their values give, or hide.
    pub others: Option<OthersKey>,
    /// Segments: each { value = label or name = "name in the file", mode = "show", "hide", "tint" or "replace", color = [red, green, blue], strength = 0 to 1 of
    /// the tint, opacity = per opacity unit of what replaces it, visible = true or false }.
    pub segment: Option<Vec<SegmentKeys>>,
}

/// A segment.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a segment: { value = label, color = [r, g, b], mode = \"tint\" }")]
pub(super) struct SegmentKeys {
    /// Label of its voxels.
    pub value: Option<i64>,
    /// Its name in the file of the label map, in the place of its label; beside a label, a name for the reader.
    pub name: Option<String>,
    /// What becomes of it: show as its values give, hide, tint (the default) or replace (the default with an opacity).
    pub mode: Option<ModeKey>,
    /// tint, replace: red, green, blue, each 0 to 1; the file's colour, or else one that goes with the label, unless given.
    pub color: Option<[f64; 3]>,
    /// tint: from 0, which changes nothing, to 1 (unless given): the segment's colour, as bright as the values' own.
    pub strength: Option<f64>,
    /// replace: opacity per opacity unit of the transfer function, 0 to 1; 1 unless given.
    pub opacity: Option<f64>,
    /// Whether it is to be seen; false hides it.
    pub visible: Option<bool>,
}

choices! {
    OthersKey { Tint, Show, Hide }
    ModeKey { Show, Hide, Tint, Replace }
}

impl LabelKeys {
    /// The keys that say what becomes of the segments of `scene`, and where the label map of `source` is.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a path that is not UTF-8.
    pub(super) fn of(scene: &Scene, source: Option<&VolumeSource>) -> Result<Self> {
        let map = source.and_then(|source| source.labels.as_deref());
        let text = |path: &Path| match path.to_str() {
            Some(text) => Ok(text.to_owned()),
            None => Err(Error::invalid(format!("labels.path {}: the name is not UTF-8", path.display()))),
        };
        let choice = map.map(|map| map.choice.clone()).unwrap_or_default();
        let segments: Vec<SegmentKeys> = scene.segments().iter().map(SegmentKeys::of).collect();
        Ok(Self {
            path: map.and_then(VolumeSource::path).map(text).transpose()?,
            series: choice.series.as_deref().map(SeriesKey::of),
            array: choice.array,
            level: choice.level,
            frame: choice.frame,
            channel: choice.channel,
            // What becomes of others is decided: all that is changed is listed.
            others: (map.is_some() || !segments.is_empty()).then_some(OthersKey::Show),
            segment: (!segments.is_empty()).then_some(segments),
        })
    }

    /// Where the label map is, if there is one beside the volume.
    pub(super) fn source(&self, cx: &Context<'_>) -> Result<Option<VolumeSource>> {
        let choices = [
            ("labels.series", self.series.is_some()),
            ("labels.array", self.array.is_some()),
            ("labels.level", self.level.is_some()),
            ("labels.frame", self.frame.is_some()),
            ("labels.channel", self.channel.is_some()),
        ];
        let Some(path) = &self.path else {
            cx.refuse(&choices, "is for labels.path, which is not given")?;
            return Ok(None);
        };
        if path.is_empty() {
            return Err(cx.error("labels.path", "is empty"));
        }
        // A path given as a flag means what it means to the shell.
        let typed = cx.places.of("labels.path") == Some(Place::Flag);
        let full = if typed { Path::new(path).to_path_buf() } else { cx.base.join(path) };
        let mut choice = Choice::new();
        choice.series = self.series.as_ref().map(SeriesKey::text);
        choice.array.clone_from(&self.array);
        (choice.level, choice.frame, choice.channel) = (self.level, self.frame, self.channel);
        Ok(Some(VolumeSource::new(Origin::File(full)).with_choice(choice)))
    }

    /// Finds mistakes that need no label map to be found.
    pub(super) fn before_data(&self, cx: &Context<'_>) -> Result<()> {
        for (n, keys) in self.list().iter().enumerate() {
            if keys.value.is_none() && keys.name.is_none() {
                return Err(cx.error(&format!("labels.segment[{n}]"), "give the value of its label, or its name"));
            }
            keys.style(cx, n, 0, None)?;
        }
        Ok(())
    }

    fn list(&self) -> &[SegmentKeys] {
        self.segment.as_deref().unwrap_or_default()
    }

    /// The scene with the segments of its volume's label map as the section says.
    pub(super) fn finish(&self, cx: &Context<'_>, data: &mut Data<'_>) -> Result<()> {
        // A scene that says nothing of labels shows none, whatever lies beside its volume.
        if *self == Self::default() {
            return Ok(());
        }
        let Some(map) = data.volume.labels() else {
            let alone = matches!(data.volume.channels(), crate::volume::Channels::Label(_));
            return match self.segment {
                Some(_) if !alone => Err(cx.error("labels.segment", "there is no label map: give labels.path")),
                Some(_) if !cx.document.transfer.is_open(cx) => {
                    Err(cx.error("labels.segment", "the labels of the volume itself are coloured by the transfer function that is given"))
                }
                _ => Ok(()),
            };
        };
        if map.values().len() > MANY && map.segments().is_empty() {
            let count = map.values().len();
            data.warnings.push(format!("labels: {count} different ones, and the file names none: are these voxels values, and no labels?"));
        }
        let mut styles = Vec::new();
        for (label, n) in self.listed(cx, map, &mut data.warnings)? {
            let own = color_of(map.segments(), label);
            styles.push(self.list()[n].style(cx, n, label, own)?);
        }
        let others = self.others(map, &styles, data)?;
        let tinted = others.iter().filter(|s| matches!(s.effect(), SegmentEffect::Tint { .. })).count();
        if tinted > 0 {
            let named: Vec<&str> = others.iter().filter_map(|s| name_of(map.segments(), s.label())).take(8).collect();
            let names = if named.is_empty() {
                String::new()
            } else {
                format!(" ({}{})", named.join(", "), if tinted > named.len() { ", ..." } else { "" })
            };
            data.notes.push(format!("labels: {tinted} segments are tinted{names} (labels.others, [[labels.segment]]: otherwise)"));
        }
        styles.extend(others);
        data.scene = data.scene.clone().with_segments(styles).map_err(|e| cx.places.locate(e))?;
        Ok(())
    }

    /// The label of each segment of the list, with its place there.
    fn listed(&self, cx: &Context<'_>, map: &LabelMap, warnings: &mut Vec<String>) -> Result<Vec<(i64, usize)>> {
        let mut found: Vec<(i64, usize)> = Vec::new();
        for (n, keys) in self.list().iter().enumerate() {
            let path = format!("labels.segment[{n}]");
            let label = match (keys.value, &keys.name) {
                (Some(value), name) => {
                    // A name of the reader's own may stand beside a label, but not that of another.
                    let other = name.as_ref().and_then(|name| map.segments().iter().find(|s| s.name == *name && s.value != value));
                    if let Some(other) = other {
                        let text = format!("\"{}\" is label {} in the label map, not {value}; give one of them", other.name, other.value);
                        return Err(cx.error(&format!("{path}.name"), text));
                    }
                    value
                }
                (None, Some(name)) => by_name(cx, &path, name, map.segments())?,
                (None, None) => return Err(cx.error(&path, "give the value of its label, or its name")),
            };
            if found.iter().any(|&(other, _)| other == label) {
                return Err(cx.error(&path, format!("label {label} is given twice")));
            }
            if map.values().binary_search(&label).is_err() {
                warnings.push(format!("labels.segment {label}: no voxel has that label"));
            }
            found.push((label, n));
        }
        Ok(found)
    }

    /// What becomes of labels that are not listed, but for 0.
    fn others(&self, map: &LabelMap, listed: &[SegmentStyle], data: &mut Data<'_>) -> Result<Vec<SegmentStyle>> {
        let labels = map.values().iter().copied().filter(|&l| l != 0 && listed.iter().all(|s| s.label() != l));
        let blend = data.scene.blend();
        let tints = matches!(blend, Blend::Over | Blend::Add);
        match self.others {
            Some(OthersKey::Show) => Ok(Vec::new()),
            Some(OthersKey::Hide) => labels.map(|label| SegmentStyle::new(label, SegmentEffect::Hide)).collect(),
            Some(OthersKey::Tint) | None if !tints => {
                data.notes.push("labels: tints are left out, projections of values and surfaces have none".into());
                Ok(Vec::new())
            }
            Some(OthersKey::Tint) | None => {
                let colored = map.segments().iter().any(|s| s.color.is_some());
                let tint = |label: i64| {
                    let color = color_of(map.segments(), label).or_else(|| (!colored).then(|| label_color(label)))?;
                    Some(SegmentStyle::new(label, SegmentEffect::Tint { color, strength: 1.0 }))
                };
                labels.filter_map(tint).collect()
            }
        }
    }

    /// Colours and a light for a volume that is a label map itself, where the scene gives no transfer function: each label in a colour of its own,
    /// 0 transparent, the nearest voxel looked up. Nothing for other volumes.
    pub(super) fn alone(&self, cx: &Context<'_>, data: &mut Data<'_>) -> Result<Option<(TransferFunction, Lighting)>> {
        let Some(map) = data.volume.own_labels()? else { return Ok(None) };
        let mine = data.volume.labels().is_none();
        let listed = if mine { self.listed(cx, &map, &mut data.warnings)? } else { Vec::new() };
        let straight = |label: i64| -> Result<Straight> {
            let keys = listed.iter().find(|l| l.0 == label).map(|&(_, n)| (n, &self.list()[n]));
            let hidden = label == 0 || mine && self.others == Some(OthersKey::Hide);
            let own = color_of(map.segments(), label).unwrap_or_else(|| label_color(label));
            let Some((n, keys)) = keys else { return Ok(Straight { rgb: own, alpha: if hidden { 0.0 } else { SOLID } }) };
            let path = format!("labels.segment[{n}]");
            let tint = keys.strength.is_some() || keys.mode == Some(ModeKey::Tint);
            cx.refuse(&[(&path, tint)], "the volume is a label map itself, and has no values whose colours could be tinted")?;
            let seen = keys.visible != Some(false) && keys.mode != Some(ModeKey::Hide);
            Ok(Straight { rgb: keys.color.unwrap_or(own), alpha: if seen { keys.opacity.unwrap_or(SOLID) } else { 0.0 } })
        };
        let labels: Vec<(i64, Straight)> = map.values().iter().map(|&l| Ok((l, straight(l)?))).collect::<Result<_>>()?;
        let shown = labels.iter().filter(|l| l.1.alpha > 0.0).count();
        data.notes
            .push(format!("a label map: {shown} segments in colours of their own ([[labels.segment]], or a transfer function: otherwise)"));
        if cx.document.render.filter.is_none() {
            let method = data.scene.method();
            // Between two labels there is nothing.
            data.scene = data.scene.clone().with_method(Method { filter: Filter::Nearest, ..method })?;
            data.notes.push("filter nearest: labels are names, and are not interpolated (--render.filter linear: otherwise)".into());
        }
        let mut lighting = Lighting::default();
        (lighting.ambient, lighting.diffuse, lighting.specular) = (0.35, 0.65, 0.1);
        Ok(Some((TransferFunction::of_labels(&labels)?, lighting)))
    }
}

impl SegmentKeys {
    fn of(style: &SegmentStyle) -> Self {
        let plain = |mode| Self { value: Some(style.label()), mode: Some(mode), ..Self::default() };
        match style.effect() {
            SegmentEffect::Show => plain(ModeKey::Show),
            SegmentEffect::Hide => plain(ModeKey::Hide),
            SegmentEffect::Tint { color, strength } => Self { color: Some(color), strength: Some(strength), ..plain(ModeKey::Tint) },
            SegmentEffect::Replace { color, opacity } => Self { color: Some(color), opacity: Some(opacity), ..plain(ModeKey::Replace) },
        }
    }

    /// What becomes of the segment, whose label is `label` and to which the file gives the colour `own`.
    fn style(&self, cx: &Context<'_>, n: usize, label: i64, own: Option<[f64; 3]>) -> Result<SegmentStyle> {
        let key = |name: &str| format!("labels.segment[{n}].{name}");
        let mode = match (self.mode, self.visible) {
            (Some(ModeKey::Hide), Some(true)) | (Some(ModeKey::Show | ModeKey::Tint | ModeKey::Replace), Some(false)) => {
                return Err(cx.error(&key("visible"), "contradicts the mode; give one of them"));
            }
            (Some(mode), _) => mode,
            (None, Some(false)) => ModeKey::Hide,
            (None, _) if self.opacity.is_some() => ModeKey::Replace,
            (None, _) => ModeKey::Tint,
        };
        let only = |name: &str, given: bool, of: &[ModeKey], what: &str| {
            cx.refuse(&[(&key(name), given && !of.contains(&mode))], &format!("is for a segment that is {what}"))
        };
        // A colour may stand beside visible = false, to be there when that changes.
        only("color", self.color.is_some() && self.mode.is_some(), &[ModeKey::Tint, ModeKey::Replace], "tinted or replaced")?;
        only("strength", self.strength.is_some(), &[ModeKey::Tint, ModeKey::Hide], "tinted")?;
        only("opacity", self.opacity.is_some(), &[ModeKey::Replace, ModeKey::Hide], "replaced")?;
        let color = self.color.or(own).unwrap_or_else(|| label_color(label));
        let effect = match mode {
            ModeKey::Show => SegmentEffect::Show,
            ModeKey::Hide => SegmentEffect::Hide,
            ModeKey::Tint => SegmentEffect::Tint { color, strength: self.strength.unwrap_or(1.0) },
            ModeKey::Replace => SegmentEffect::Replace { color, opacity: self.opacity.unwrap_or(1.0) },
        };
        SegmentStyle::new(label, effect).map_err(|e| {
            let (text, known) = (e.to_string(), format!("labels segment {label}: "));
            cx.error(&format!("labels.segment[{n}]"), text.strip_prefix(&known).unwrap_or(&text))
        })
    }
}

/// The label of the segment called `name`.
fn by_name(cx: &Context<'_>, path: &str, name: &str, segments: &[Segment]) -> Result<i64> {
    if let Some(segment) = segments.iter().find(|s| s.name == name) {
        return Ok(segment.value);
    }
    let names: Vec<&str> = segments.iter().map(|s| s.name.as_str()).filter(|n| !n.is_empty()).collect();
    let path = format!("{path}.name");
    match nearest(name, &names) {
        Some(best) => {
            Err(cx.error(&path, format!("unknown \"{name}\"; the nearest known one is \"{best}\", all are {}", names.join(", "))))
        }
        None => Err(cx.error(&path, format!("unknown \"{name}\": the label map names no segments; give the value of its label"))),
    }
}

fn color_of(segments: &[Segment], label: i64) -> Option<[f64; 3]> {
    segments.iter().find(|s| s.value == label)?.color
}

fn name_of(segments: &[Segment], label: i64) -> Option<&str> {
    segments.iter().find(|s| s.value == label).map(|s| s.name.as_str()).filter(|name| !name.is_empty())
}
