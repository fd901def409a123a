//! Which scene a command is about: its file, its volume, and the flags that override its keys.

use super::flags::{SceneFlags, color_list};
use super::progress::Bar;
use super::{Usage, complain};
use anyhow::{Result, bail};
use clap::builder::{PossibleValue, PossibleValuesParser};
use slicestack::scene::{Overrides, Preset, SceneFile};
use slicestack::volume::VolumeSource;
use slicestack::{Level, Limits, Volume};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is rendered when nothing is named: three rings, no two of them linked; their surface is at 0, their core below it.
const DEFAULT_SCENE: &str = "
[volume]
phantom = \"distance-field\"
[transfer]
color = [[-0.15, 1, 1, 0.9], [-0.05, 0.9, 0.5, 0.15], [0.02, 0.3, 0.1, 0.2]]
opacity = [[-0.1, 0.9], [-0.02, 0.3], [0.01, 0]]
";

/// What every command that makes pictures takes.
#[derive(Debug, clap::Args)]
pub(super) struct SceneArgs {
    /// Scene file (.toml, .json) or volume file; a built-in volume when left out.
    #[arg(value_name = "SCENE|VOLUME")]
    pub(super) input: Option<PathBuf>,
    /// Ready-made transfer function: see `slicestack presets`.
    #[arg(long, value_name = "NAME", value_parser = presets(), hide_possible_values = true)]
    preset: Option<String>,
    /// Size of the picture in pixels, such as 800x600.
    #[arg(long, value_name = "WxH", allow_hyphen_values = true)]
    size: Option<String>,
    /// Number of slices; as many as an error of one of 256 levels takes, unless given.
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    count: Option<String>,
    /// Degrees around the box.
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    azimuth: Option<String>,
    /// Degrees upwards.
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    elevation: Option<String>,
    /// 1 fits what shows into the picture, 2 shows it twice as large.
    #[arg(long, value_name = "FACTOR", allow_hyphen_values = true)]
    zoom: Option<String>,
    /// Colour behind the volume: a name of CSS, #rgb, #rrggbb, or r,g,b,a from 0 to 1; transparent unless given.
    #[arg(long, value_name = "COLOUR")]
    background: Option<String>,
    /// For `render`: hold no more than about so many bytes, such as 1GiB, the picture among them. Of the volume's file those voxels are read that the
    /// picture needs, as fine as it needs them; the picture is the same for any size.
    #[arg(long, value_name = "SIZE", value_parser = super::paged::bytes)]
    pub(super) memory: Option<u64>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    flags: SceneFlags,
}

/// Names of presets, which shells complete.
fn presets() -> PossibleValuesParser {
    Preset::ALL.map(|p| PossibleValue::new(p.name()).help(p.about())).into()
}

/// How volume files are read.
#[derive(Debug, clap::Args)]
pub(super) struct ReadingArgs {
    /// Read the volume into memory instead of mapping its file: for files that others rewrite meanwhile, and disks that may go away.
    #[arg(long)]
    no_mmap: bool,
}

impl ReadingArgs {
    pub(super) fn limits(&self) -> Limits {
        let limits = Limits::default();
        if self.no_mmap { limits.map_bytes(u64::MAX) } else { limits }
    }
}

impl SceneArgs {
    /// Whether a scene or a volume is named.
    pub(super) fn names_a_volume(&self) -> bool {
        self.input.is_some() || ["volume.path", "volume.layers", "volume.phantom"].into_iter().any(|key| self.flags.has(key))
    }

    /// Whether a flag of this key was given.
    pub(super) fn has(&self, path: &str) -> bool {
        self.flags.has(path)
    }

    /// Limits for the volume, and how its file is read.
    pub(super) fn limits(&self) -> Limits {
        self.reading.limits()
    }

    /// As [`SceneArgs::read_for_pieces`], for what needs the whole volume.
    ///
    /// # Errors
    /// [`Usage`] for a flag that cannot be meant, `--memory` among them.
    pub(super) fn read(&self) -> Result<(SceneText<'_>, Overrides)> {
        if self.memory.is_some() {
            bail!(Usage(
                "--memory: `render` alone reads a volume piece by piece; animations, records, reports and views keep all of it at hand"
                    .into()
            ));
        }
        self.read_for_pieces()
    }

    /// The scene to read, and what overrides its keys.
    ///
    /// # Errors
    /// [`Usage`] for a flag that cannot be meant.
    pub(super) fn read_for_pieces(&self) -> Result<(SceneText<'_>, Overrides)> {
        let mut overrides = Overrides::default();
        let text = if self.names_a_volume() { scene_of(self.input.as_deref(), &mut overrides)? } else { SceneText::Text(DEFAULT_SCENE) };
        shorthands(self, &mut overrides)?;
        self.flags.apply(&mut overrides)?;
        Ok((text, overrides))
    }
}

/// A scene still to be read.
pub(super) enum SceneText<'a> {
    File(&'a Path),
    Text(&'static str),
}

impl SceneText<'_> {
    /// Whether it is a file.
    pub(super) fn is_file(&self) -> bool {
        matches!(self, Self::File(_))
    }

    /// Reads it with `overrides` laid over it.
    ///
    /// # Errors
    /// As [`SceneFile::read`]; [`Usage`] where a flag is at fault.
    pub(super) fn open(&self, overrides: &Overrides) -> Result<SceneFile> {
        let scene = match self {
            Self::File(path) => SceneFile::read(path, overrides),
            Self::Text(text) => SceneFile::parse(text, "", overrides),
        };
        scene.map_err(|e| {
            let text = e.to_string();
            // Without a file it is the flags that do not go together.
            let flags = matches!(self, Self::Text(_)) && matches!(e, slicestack::Error::Invalid(_));
            if flags || text.starts_with("--") { Usage(text).into() } else { e.into() }
        })
    }
}

/// Loads the volume of `source`: a bar shows how far it has come where that takes long, and what the reader chose or repaired is told.
///
/// # Errors
/// As [`VolumeSource::load_told`].
pub(super) fn load(source: &VolumeSource, limits: &Limits) -> Result<Volume> {
    let bar = Arc::new(Bar::new());
    let volume = source.load_told(limits, Some(bar.clone()));
    bar.clear();
    let volume = volume?;
    volume.notes().iter().for_each(|note| complain("note", note));
    Ok(volume)
}

/// The scene that `input` names: a scene file by its name, else a volume, which is set in `overrides`; without an input,
/// an empty scene for flags to fill.
///
/// # Errors
/// [`Usage`] for a name that is no text.
pub(super) fn scene_of<'a>(input: Option<&'a Path>, overrides: &mut Overrides) -> Result<SceneText<'a>> {
    let Some(path) = input else { return Ok(SceneText::Text("")) };
    // The metadata of a Zarr ends like a scene.
    let zarr = path.file_name().is_some_and(|n| n == "zarr.json");
    let scene = !zarr && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml") || e.eq_ignore_ascii_case("json"));
    if scene {
        return Ok(SceneText::File(path));
    }
    let Some(name) = path.to_str() else { bail!(Usage(format!("{}: the name is not UTF-8", path.display()))) };
    overrides.set("volume.path", name);
    Ok(SceneText::Text(""))
}

/// The vector level called `name`; `None` for the fastest.
///
/// # Errors
/// [`Usage`] for one that this machine does not have.
pub(super) fn level(name: &str) -> Result<Option<Level>> {
    if name == "auto" {
        return Ok(None);
    }
    let levels = Level::available();
    match levels.iter().find(|l| l.name() == name) {
        Some(&level) => Ok(Some(level)),
        None => {
            let names: Vec<&str> = levels.iter().map(|l| l.name()).collect();
            bail!(Usage(format!("--simd {name}: this machine has auto, {}", names.join(", "))))
        }
    }
}

/// Short flags, as the keys they stand for.
fn shorthands(args: &SceneArgs, overrides: &mut Overrides) -> Result<()> {
    let direct = [
        ("preset", "transfer.preset", &args.preset),
        ("count", "slices.count", &args.count),
        ("azimuth", "camera.azimuth", &args.azimuth),
        ("elevation", "camera.elevation", &args.elevation),
        ("zoom", "camera.zoom", &args.zoom),
    ];
    let others =
        [("size", "image.width", &args.size), ("size", "image.height", &args.size), ("background", "image.background", &args.background)];
    // Whichever won, half of the readers would expect the other.
    if let Some((short, path, _)) = direct.iter().chain(&others).find(|(_, path, value)| value.is_some() && args.flags.has(path)) {
        bail!(Usage(format!("--{short} and --{path} say the same thing: leave one of them out")));
    }
    for (_, path, value) in direct {
        if let Some(value) = value {
            overrides.set(path, value);
        }
    }
    if let Some(size) = &args.size {
        let Some((width, height)) = sides(size) else {
            bail!(Usage(format!("--size {size}: write WIDTHxHEIGHT, such as 800x600")));
        };
        overrides.set("image.width", width.to_string());
        overrides.set("image.height", height.to_string());
    }
    if let Some(text) = &args.background {
        overrides.set("image.background", background(text)?);
    }
    Ok(())
}

/// Two whole numbers with an x between them.
pub(super) fn sides(text: &str) -> Option<(u32, u32)> {
    let (width, height) = text.split_once(['x', 'X'])?;
    Some((width.parse().ok()?, height.parse().ok()?))
}

/// A background as the list that a scene file has: opaque unless it says otherwise.
pub(super) fn background(text: &str) -> Result<String> {
    let list = color_list("background", text)?;
    let refused = || Usage(format!("--background {text}: write a colour's name, #rgb, #rrggbb, or r,g,b,a from 0 to 1"));
    let numbers: Vec<f64> = list.split(',').map(|n| n.trim().parse().map_err(|_| refused())).collect::<Result<_, _>>()?;
    match numbers.as_slice() {
        [r, g, b] => Ok(format!("{r},{g},{b},1")),
        [r, g, b, a] => Ok(format!("{r},{g},{b},{a}")),
        _ => bail!(refused()),
    }
}
