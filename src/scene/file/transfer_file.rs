//! Files that hold a transfer function: those of other programs, and the sections `[transfer]` and `[light]` of scene files.

use super::section::Context;
use super::table::{self, Places};
use super::{Document, MAX_BYTES, Overrides, text_of_file};
use crate::scene::property::beyond_material;
use crate::scene::{Lighting, Preset, Scene, TransferFunction};
use crate::transfer_io::{self, Contents, FileKind, VolumeProperty};
use crate::volume::VolumeSource;
use crate::{Error, Result, Volume};
use std::path::{Path, PathBuf};

/// A transfer function, its light, and what the user should hear about them, one line each.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FoundTransfer {
    /// The transfer function.
    pub transfer: TransferFunction,
    /// The light it comes in, if any.
    pub lighting: Option<Lighting>,
    /// What the file asks for and does not get.
    pub warnings: Vec<String>,
}

/// A file that holds a transfer function.
///
/// It is a volume property or a file of presets of 3D Slicer (`.vp`, `.xml`), a colour map of ParaView (`.json`), a table (`.csv`), or a scene
/// file (`.toml`, `.json`), of which the sections `[transfer]`, `[light]` and `[[lights]]` count. See [`crate::transfer_io`].
#[derive(Debug, Clone)]
pub struct TransferFile(Kind);

#[derive(Debug, Clone)]
enum Kind {
    Property(Contents),
    Scene(Box<SceneSections>),
}

#[derive(Debug, Clone)]
struct SceneSections {
    document: Document,
    places: Places,
    base: PathBuf,
    volume: Option<VolumeSource>,
}

impl SceneSections {
    fn context(&self) -> Context<'_> {
        Context { document: &self.document, places: &self.places, base: &self.base }
    }
}

impl TransferFile {
    /// Reads the file at `path`, and takes the transfer function called `name` where it holds several.
    ///
    /// # Errors
    /// [`Error::Io`] when it cannot be read, [`Error::Format`] when it is none of the kinds above, is longer than 16 MiB or holds nonsense, and
    /// when the name is needed and missing, or is not there: then the line lists the names.
    pub fn open(path: impl AsRef<Path>, name: Option<&str>) -> Result<Self> {
        Self::open_at(path.as_ref(), name, true)
    }

    /// As [`TransferFile::open`]; the scene file may name a further `transfer.file` or not.
    pub(super) fn open_at(path: &Path, name: Option<&str>, further: bool) -> Result<Self> {
        let kind = FileKind::of_path(path);
        let toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        if !toml && kind.is_none() {
            return Err(Error::format(path, "the extension tells no kind of transfer function; .vp, .xml, .json, .csv and .toml do"));
        }
        if let Some(kind) = kind {
            let bytes = transfer_io::bytes_of(path)?;
            if kind != FileKind::ParaView || transfer_io::is_paraview(&bytes) {
                return Ok(Self(Kind::Property(transfer_io::parse(&bytes, path, kind, name)?)));
            }
        }
        if let Some(name) = name {
            return Err(Error::format(path, format!("a scene file holds one transfer function: leave the name {name:?} out")));
        }
        let (document, places) = table::document(&text_of_file(path, MAX_BYTES)?, Some(path), &Overrides::default())?;
        if places.first_in("transfer").is_none() {
            return Err(Error::format(path, "has no section [transfer]"));
        }
        let base = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut sections = SceneSections { document, places, base, volume: None };
        let cx = sections.context();
        if !further && sections.document.transfer.file.is_some() {
            return Err(cx.error("transfer.file", "this file is a transfer.file itself and cannot name another"));
        }
        let scene = Scene::new(sections.document.transfer.before_data(&cx)?);
        sections.document.light.apply(&sections.document.lights, None, &cx, scene)?;
        let volume = sections.places.first_in("volume").map(|_| sections.document.volume.source(&cx)).transpose()?;
        sections.volume = volume;
        Ok(Self(Kind::Scene(Box::new(sections))))
    }

    /// The volume that a scene file names beside its transfer function.
    pub fn volume(&self) -> Option<&VolumeSource> {
        match &self.0 {
            Kind::Property(_) => None,
            Kind::Scene(sections) => sections.volume.as_ref(),
        }
    }

    /// The name that the transfer function has in the file, where it has one.
    pub fn name(&self) -> Option<&str> {
        match &self.0 {
            Kind::Property(contents) => Some(contents.property.name.as_str()).filter(|n| !n.is_empty()),
            Kind::Scene(_) => None,
        }
    }

    /// Whether the transfer function is laid over the values of a volume, so that there is none without one.
    ///
    /// # Errors
    /// As [`TransferFile::open`], for a scene file's own `transfer.file`.
    pub fn needs_volume(&self) -> Result<bool> {
        match &self.0 {
            Kind::Property(_) => Ok(false),
            Kind::Scene(sections) => sections.document.transfer.needs_volume(&sections.context()),
        }
    }

    /// The transfer function, for `volume` where it needs one.
    ///
    /// # Errors
    /// [`Error::Invalid`] where it needs a volume and none is given, and where the volume's range leaves f64's.
    pub fn transfer(&self, volume: Option<&Volume>) -> Result<FoundTransfer> {
        let sections = match &self.0 {
            Kind::Property(Contents { property, warnings, .. }) => {
                let (transfer, lighting) = (property.transfer()?, property.lighting());
                return Ok(FoundTransfer { transfer, lighting, warnings: warnings.clone() });
            }
            Kind::Scene(sections) => sections,
        };
        let (cx, document) = (sections.context(), &sections.document);
        let FoundTransfer { transfer, lighting, warnings } = document.transfer.found(&cx, volume)?;
        let scene = document.light.apply(&document.lights, lighting, &cx, Scene::new(transfer))?;
        Ok(FoundTransfer { transfer: scene.transfer().clone(), lighting: scene.lighting().cloned(), warnings })
    }
}

impl Preset {
    /// The preset and its light, for `volume` where it needs one: those at fixed Hounsfield units do without.
    ///
    /// # Errors
    /// [`Error::Invalid`] where it needs a volume and none is given, and when the volume's range leaves f64's.
    pub fn found(self, volume: Option<&Volume>) -> Result<FoundTransfer> {
        let Some(volume) = volume else {
            let needed = || Error::invalid(format!("{}: is laid over a volume's values, and there is no volume", self.name()));
            let (transfer, lighting) = (self.at_fixed_values().ok_or_else(needed)?, self.lighting_at_fixed_values());
            return Ok(FoundTransfer { transfer, lighting, warnings: Vec::new() });
        };
        let warnings = self.suits(volume).err().into_iter().collect();
        Ok(FoundTransfer { transfer: self.transfer(volume)?, lighting: self.lighting(volume), warnings })
    }
}

/// `transfer` and `lighting` as a file of `kind`, and what of them the format has no place for, one line each.
///
/// The formats hold opacities per one world unit; others are converted. See [`transfer_io::write`].
pub fn write_transfer(name: &str, transfer: &TransferFunction, lighting: Option<&Lighting>, kind: FileKind) -> (String, Vec<String>) {
    let property = VolumeProperty { name: name.to_owned(), ..VolumeProperty::of(transfer, lighting) };
    let (text, mut lost) = transfer_io::write(&property, kind);
    let beyond = lighting.map(beyond_material).unwrap_or_default();
    if !beyond.is_empty() && matches!(kind, FileKind::SlicerProperty | FileKind::SlicerPresets) {
        lost.push(format!(
            "of the light, {} cannot be written: the format has ambient, diffuse, specular and its power",
            beyond.join(", ")
        ));
    }
    (text, lost)
}
