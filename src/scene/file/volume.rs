//! The section `[volume]`: where the voxels come from, and what is changed about them.

use super::Place;
use super::schema::names;
use super::section::{Context, Data, Given, Rivals, choices};
use crate::volume::edit::CropBox;
use crate::volume::io::{Choice, Endian, RawSpec};
use crate::volume::phantom::Phantom;
use crate::volume::{BoxConvention, Channels, Modality, Origin, VolumeSource, VoxelType};
use crate::{Error, Result};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Voxels along each axis of a phantom whose size is not given.
const PHANTOM_SIZE: usize = 128;

/// Most voxels along each axis of a phantom.
const MOST_PHANTOM_SIZE: usize = 1 << 16;

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct VolumeKeys {
    /// File or folder to read (DICOM, images, Zarr, NRRD, NIfTI, MetaImage, VTK, MRC, NumPy, raw), relative to the scene file.
    pub path: Option<String>,
    /// Pictures with alpha as layers, instead of path: a folder or a pattern (layers/*.png), the first in front. They are laid over each other exactly as they
    /// are stored, unless the scene says otherwise: render.algorithm = "grid", camera.along = "z", slices.terminate = 0, and alpha is the opacity of a layer.
    pub layers: Option<String>,
    /// Built-in volume instead of a file.
    #[schemars(schema_with = "phantom_names")]
    pub phantom: Option<String>,
    /// Voxels along each axis of a built-in volume; 128 unless given.
    pub size: Option<usize>,
    /// Box that the voxels fill: cells (index -1/2 to n-1/2, the default) or nodes (0 to n-1).
    #[serde(rename = "box")]
    pub convention: Option<BoxKey>,
    /// Raw file: voxels along x, y and z.
    pub dimensions: Option<[usize; 3]>,
    /// Raw file: type of a voxel.
    #[serde(rename = "type")]
    #[schemars(schema_with = "type_names")]
    pub kind: Option<String>,
    /// Raw file: byte order, little unless given.
    pub endian: Option<EndianKey>,
    /// World units from voxel to voxel along x, y and z, instead of the file's; a negative one turns the axis around.
    pub spacing: Option<[f64; 3]>,
    /// World position of the first voxel's centre, instead of the file's.
    pub origin: Option<[f64; 3]>,
    /// Raw file: bytes before the first voxel.
    pub offset: Option<u64>,
    /// Slope of value = slope * stored + intercept, instead of the file's.
    pub slope: Option<f64>,
    /// Intercept of value = slope * stored + intercept, instead of the file's.
    pub intercept: Option<f64>,
    /// DICOM: the series, by its number in the list of `slicestack info` (counted from 0) or the beginning of its UID; the one with the most
    /// images unless given.
    #[schemars(schema_with = "series_words")]
    pub series: Option<SeriesKey>,
    /// File with several arrays: the name of the one that is meant.
    pub array: Option<String>,
    /// Multiscale image: the level of detail, counted from 0, the finest; the one that fits the picture's pixels unless given.
    pub level: Option<usize>,
    /// Sequence: the frame, counted from 0; the first unless given.
    pub frame: Option<usize>,
    /// Voxels of several numbers, such as colours or vectors: the one that is meant, counted from 0; or magnitude, the square root of the sum of their
    /// squares.
    #[schemars(schema_with = "channel_words")]
    pub channel: Option<ChannelKey>,
    /// Part of the volume that is kept, [[x0, x1], [y0, y1], [z0, z1]]: voxels counted from 0, the ends not included, or what crop_unit says.
    pub crop: Option<[[f64; 2]; 3]>,
    /// What volume.crop counts: voxels (unless given), or world units along the world's axes, of which voxels with centres in the box are kept.
    pub crop_unit: Option<CropUnitKey>,
    /// Kind of values, where the file does not say: ct (Hounsfield units), mr, labels (whole numbers that name segments) or other.
    pub modality: Option<ModalityKey>,
}

/// A series by number or UID.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "expected a number, or the beginning of a UID as text")]
pub(super) enum SeriesKey {
    Number(usize),
    Uid(String),
}

/// Text first: a flag's value is text, whatever it looks like.
pub(super) fn series_words(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["string", "integer", "null"], "minimum": 0 })
}

impl SeriesKey {
    pub(super) fn of(text: &str) -> Self {
        text.parse().map_or_else(|_| Self::Uid(text.to_owned()), Self::Number)
    }

    pub(super) fn text(&self) -> String {
        match self {
            Self::Number(n) => n.to_string(),
            Self::Uid(uid) => uid.clone(),
        }
    }
}

/// The word for the magnitude of all numbers of a voxel.
const MAGNITUDE: &str = "magnitude";

/// A channel by number, or all together.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "expected a number, or \"magnitude\"")]
pub(super) enum ChannelKey {
    Number(usize),
    Word(String),
}

/// Text first, as [`series_words`].
fn channel_words(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["string", "integer", "null"], "minimum": 0, "pattern": "^(magnitude|[0-9]+)$" })
}

choices! {
    CropUnitKey { Voxels, World }
    BoxKey => BoxConvention { Cells, Nodes }
    EndianKey => Endian { Little, Big }
    ModalityKey { Ct, Mr, Labels, Other }
}

impl ModalityKey {
    /// Labels are no kind of values.
    fn modality(self) -> Option<Modality> {
        match self {
            Self::Ct => Some(Modality::Ct),
            Self::Mr => Some(Modality::Mr),
            Self::Other => Some(Modality::Other),
            Self::Labels => None,
        }
    }

    fn of(modality: Modality) -> Option<Self> {
        [Self::Ct, Self::Mr, Self::Other].into_iter().find(|key| key.modality() == Some(modality))
    }
}

fn phantom_names(_: &mut SchemaGenerator) -> Schema {
    names(Phantom::ALL.into_iter().map(Phantom::name))
}

fn type_names(_: &mut SchemaGenerator) -> Schema {
    names(VoxelType::ALL.into_iter().map(VoxelType::name))
}

pub(super) const RIVALS: &[Rivals] = &[
    (&["volume.path"], &["volume.layers", "volume.phantom", "volume.size"]),
    (&["volume.layers"], &["volume.path", "volume.phantom", "volume.size"]),
    (
        &["volume.phantom"],
        &[
            "volume.path",
            "volume.layers",
            "volume.dimensions",
            "volume.type",
            "volume.endian",
            "volume.offset",
            "volume.series",
            "volume.array",
            "volume.level",
            "volume.frame",
            "volume.channel",
        ],
    ),
];

impl VolumeKeys {
    /// The keys that say what `source` is.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a path that is not UTF-8.
    pub(super) fn of(source: &VolumeSource) -> Result<Self> {
        let text = |path: &Path| match path.to_str() {
            Some(text) => Ok(text.to_owned()),
            None => Err(Error::invalid(format!("volume.path {}: the name is not UTF-8", path.display()))),
        };
        let path = source.path().map(text).transpose()?;
        let raw = match &source.origin {
            Origin::Raw(_, spec) => Some(spec),
            Origin::File(_) | Origin::Phantom(..) => None,
        };
        // A spacing beside that of a raw file keeps the directions of its axes.
        let spacing = match (source.spacing, raw) {
            (Some(s), Some(raw)) => Some(std::array::from_fn(|i| s[i].copysign(s[i] * raw.spacing[i]))),
            (s, raw) => s.or(raw.map(|r| r.spacing)),
        };
        let phantom = match source.origin {
            Origin::Phantom(phantom, size) => Some((phantom, size)),
            Origin::File(_) | Origin::Raw(..) => None,
        };
        Ok(Self {
            layers: None,
            path,
            phantom: phantom.map(|(p, _)| p.name().to_owned()),
            size: phantom.map(|(_, size)| size),
            convention: Some(source.convention.into()),
            dimensions: raw.map(|r| r.dimensions),
            kind: raw.map(|r| r.voxel_type.name().to_owned()),
            endian: raw.map(|r| r.endian.into()),
            spacing,
            origin: source.position.or(raw.map(|r| r.origin)),
            offset: raw.map(|r| r.offset),
            slope: source.slope,
            intercept: source.intercept,
            modality: if source.are_labels { Some(ModalityKey::Labels) } else { source.modality.and_then(ModalityKey::of) },
            series: source.choice.series.as_deref().map(SeriesKey::of),
            array: source.choice.array.clone(),
            level: source.choice.level,
            frame: source.choice.frame,
            channel: match source.choice.channel {
                _ if source.choice.magnitude => Some(ChannelKey::Word(MAGNITUDE.to_owned())),
                n => n.map(ChannelKey::Number),
            },
            crop: source.crop.as_ref().map(|crop| match crop {
                CropBox::Voxels(ranges) => ranges.clone().map(|range| [range.start as f64, range.end as f64]),
                CropBox::World(bounds) => *bounds,
            }),
            crop_unit: matches!(source.crop, Some(CropBox::World(_))).then_some(CropUnitKey::World),
        })
    }

    /// The volume's origin, and what to change about it.
    pub(super) fn source(&self, cx: &Context<'_>) -> Result<VolumeSource> {
        let origin = self.origin(cx)?;
        if let Some(s) = self.spacing.filter(|s| s.iter().any(|x| !x.is_finite() || *x == 0.0)) {
            return Err(cx.error("volume.spacing", format!("{s:?}: every number must be finite and not 0")));
        }
        if let Some(o) = self.origin.filter(|o| o.iter().any(|x| !x.is_finite())) {
            return Err(cx.error("volume.origin", format!("{o:?}: every number must be finite")));
        }
        if let Some(s) = self.slope.filter(|s| !s.is_finite() || *s == 0.0) {
            return Err(cx.error("volume.slope", format!("{s}: must be finite and not 0")));
        }
        if let Some(i) = self.intercept.filter(|i| !i.is_finite()) {
            return Err(cx.error("volume.intercept", format!("{i}: must be finite")));
        }
        let mut source = VolumeSource::new(origin);
        source.convention = self.convention.map_or(BoxConvention::Cells, BoxConvention::from);
        source.modality = self.modality.and_then(ModalityKey::modality);
        source.are_labels = self.modality == Some(ModalityKey::Labels);
        (source.slope, source.intercept) = (self.slope, self.intercept);
        source.choice = self.choice(cx)?;
        source.crop = self.crop_box(cx)?;
        // A raw file's description holds these already.
        if !self.is_raw() {
            (source.spacing, source.position) = (self.spacing, self.origin);
        }
        Ok(source)
    }

    /// Alpha of a layer is its opacity: opacities refer to the distance of two layers.
    pub(super) fn finish(&self, cx: &Context<'_>, data: &mut Data<'_>) -> Result<()> {
        if self.layers.is_none() {
            return Ok(());
        }
        if *data.volume.channels() != Channels::Rgba {
            return Err(cx.error(
                "volume.layers",
                "the pictures have no alpha, so the first would hide all others; volume.path reads them as a volume",
            ));
        }
        if cx.document.transfer.opacity_unit.is_none() {
            data.scene = data.scene.clone().with_opacity_unit(data.volume.grid().spacing()[2])?;
        }
        Ok(())
    }

    /// Which of several volumes is meant.
    ///
    /// # Errors
    /// For a channel that is neither a number nor all of them.
    fn choice(&self, cx: &Context<'_>) -> Result<Choice> {
        let mut choice = Choice::new();
        choice.series = self.series.as_ref().map(SeriesKey::text);
        choice.array.clone_from(&self.array);
        (choice.level, choice.frame) = (self.level, self.frame);
        match &self.channel {
            Some(ChannelKey::Number(n)) => choice.channel = Some(*n),
            Some(ChannelKey::Word(word)) if word == MAGNITUDE => choice.magnitude = true,
            Some(ChannelKey::Word(word)) => match word.parse() {
                Ok(n) => choice.channel = Some(n),
                Err(_) => return Err(cx.error("volume.channel", format!("\"{word}\": write a number, counted from 0, or \"{MAGNITUDE}\""))),
            },
            None => {}
        }
        Ok(choice)
    }

    /// The part of the volume that is kept.
    fn crop_box(&self, cx: &Context<'_>) -> Result<Option<CropBox>> {
        let Some(bounds) = self.crop else {
            cx.refuse(&[("volume.crop_unit", self.crop_unit.is_some())], "is for volume.crop, which is not given")?;
            return Ok(None);
        };
        if self.crop_unit == Some(CropUnitKey::World) {
            if let Some([from, to]) = bounds.iter().find(|[from, to]| !(from.is_finite() && to.is_finite() && from <= to)) {
                return Err(cx.error("volume.crop", format!("[{from}, {to}]: finite numbers in rising order are needed")));
            }
            return Ok(Some(CropBox::World(bounds)));
        }
        // As far as numbers of voxels are whole in f64.
        let whole = |x: f64| (0.0..=9_007_199_254_740_992.0).contains(&x) && libm::trunc(x) == x;
        if let Some([from, to]) = bounds.iter().find(|[from, to]| !(whole(*from) && whole(*to) && from < to)) {
            return Err(
                cx.error("volume.crop", format!("[{from}, {to}]: two whole numbers of voxels are needed, 0 or more, the first smaller"))
            );
        }
        Ok(Some(CropBox::Voxels(bounds.map(|[from, to]| from as usize..to as usize))))
    }

    /// The built-in volume and its size, where its values are left as they are.
    pub(super) fn unscaled_phantom(&self) -> Option<(Phantom, usize)> {
        let phantom = self.phantom.as_deref().filter(|_| self.slope.is_none() && self.intercept.is_none());
        Some((Phantom::from_name(phantom?)?, self.phantom_size()))
    }

    fn phantom_size(&self) -> usize {
        self.size.unwrap_or(PHANTOM_SIZE)
    }

    /// Whether a raw file is described.
    fn is_raw(&self) -> bool {
        self.dimensions.is_some() || self.kind.is_some()
    }

    fn origin(&self, cx: &Context<'_>) -> Result<Origin> {
        let raw_keys: [Given; 4] = [
            ("volume.dimensions", self.dimensions.is_some()),
            ("volume.type", self.kind.is_some()),
            ("volume.endian", self.endian.is_some()),
            ("volume.offset", self.offset.is_some()),
        ];
        let choices: [Given; 5] = [
            ("volume.series", self.series.is_some()),
            ("volume.array", self.array.is_some()),
            ("volume.level", self.level.is_some()),
            ("volume.frame", self.frame.is_some()),
            ("volume.channel", self.channel.is_some()),
        ];
        if self.layers.is_some() {
            let others = [("volume.path", self.path.is_some()), ("volume.phantom", self.phantom.is_some())];
            cx.refuse(&others, "volume.layers is given too; a scene has one volume")?;
        }
        let key = if self.layers.is_some() { "volume.layers" } else { "volume.path" };
        match (self.layers.as_ref().or(self.path.as_ref()), &self.phantom) {
            (Some(_), Some(_)) => Err(cx.error("volume.phantom", "volume.path is given too; a scene has one volume")),
            (None, None) => Err(cx.error("volume", "give volume.path (a file) or volume.phantom (a built-in volume)")),
            (None, Some(name)) => {
                cx.refuse(&raw_keys, "belongs to raw files, not to built-in volumes")?;
                cx.refuse(&choices, "belongs to files with several volumes, not to built-in volumes")?;
                let size = self.phantom_size();
                if !(1..=MOST_PHANTOM_SIZE).contains(&size) {
                    return Err(cx.error("volume.size", format!("{size}: must lie between 1 and {MOST_PHANTOM_SIZE}")));
                }
                Ok(Origin::Phantom(cx.named("volume.phantom", name, &Phantom::ALL, Phantom::name)?, size))
            }
            (Some(path), None) => {
                cx.refuse(&[("volume.size", self.size.is_some())], "belongs to built-in volumes (volume.phantom), not to files")?;
                // A path given as a flag means what it means to the shell.
                let typed = cx.places.of(key) == Some(Place::Flag);
                let full = if typed { Path::new(path).to_path_buf() } else { cx.base.join(path) };
                if path.is_empty() {
                    return Err(cx.error(key, "is empty"));
                }
                if self.is_raw() {
                    cx.refuse(&choices, "belongs to files with several volumes, not to raw files")?;
                    return Ok(Origin::Raw(full, self.raw(cx)?));
                }
                cx.refuse(&raw_keys, "belongs to raw files, which volume.dimensions and volume.type describe")?;
                Ok(Origin::File(full))
            }
        }
    }

    fn raw(&self, cx: &Context<'_>) -> Result<RawSpec> {
        let needs = |key: &str, example: &str| cx.error(key, format!("a raw file needs it, for example {key} = {example}"));
        let dimensions = self.dimensions.ok_or_else(|| needs("volume.dimensions", "[256, 256, 113]"))?;
        let kind = self.kind.as_deref().ok_or_else(|| needs("volume.type", "\"u8\""))?;
        if dimensions.contains(&0) {
            return Err(cx.error("volume.dimensions", format!("{dimensions:?}: every dimension must be at least 1")));
        }
        let mut spec = RawSpec::new(dimensions, cx.named("volume.type", kind, &VoxelType::ALL, VoxelType::name)?);
        spec.endian = self.endian.map_or(spec.endian, Endian::from);
        spec.spacing = self.spacing.unwrap_or(spec.spacing);
        spec.origin = self.origin.unwrap_or(spec.origin);
        spec.offset = self.offset.unwrap_or(spec.offset);
        Ok(spec)
    }
}
