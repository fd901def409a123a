//! `slicestack tf`: a transfer function as a picture, a table, or a file of another program.

use super::flags::VolumeFlags;
use super::output::{Sink, print};
use super::scene::{ReadingArgs, load, scene_of};
use super::{Usage, complain};
use anyhow::{Result, bail};
use slicestack::Volume;
use slicestack::scene::{FoundTransfer, Overrides, Preset, TransferFile, transfer_sections, write_transfer};
use slicestack::study::{Units, transfer_png};
use slicestack::transfer_io::FileKind;
use slicestack::volume::Modality;
use std::path::{Path, PathBuf};

/// What `tf` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct TfArgs {
    /// Preset (see `slicestack presets`), scene file (.toml, .json), or a file of 3D Slicer (.vp, presets .xml), of ParaView (.json), or a table (.csv).
    #[arg(value_name = "SOURCE")]
    source: PathBuf,
    /// Which transfer function of a file that holds several.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Volume whose histogram is drawn, and over whose values presets are laid that are not for CT; the one of a scene file unless given.
    #[arg(long, value_name = "FILE")]
    volume: Option<PathBuf>,
    /// File to write: .png draws it, .vp, .xml, .json (ParaView), .toml and .csv hold it; CSV to stdout unless given.
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    flags: VolumeFlags,
}

const EXAMPLES: &str = "\
Examples:
  slicestack tf ct-bone                                       a table of its points
  slicestack tf ct-bone --volume ct.nii.gz -o bone.png        drawn over the data's histogram
  slicestack tf presets.xml --name CT-Chest -o chest.toml     3D Slicer's, as the sections of a scene file
  slicestack tf scene.toml -o mine.vp                         a scene's, for 3D Slicer
  slicestack tf mr-brain --volume head.nrrd -o map.json       a preset laid over a volume, for ParaView";

/// What is to be written.
#[derive(Clone, Copy, PartialEq)]
enum Output {
    Png,
    Toml,
    File(FileKind),
}

impl Output {
    fn of(path: &Path) -> Result<Self> {
        if path == Path::new("-") {
            return Ok(Self::File(FileKind::Csv));
        }
        let is = |extension: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
        match FileKind::of_path(path) {
            Some(kind) => Ok(Self::File(kind)),
            None if is("png") => Ok(Self::Png),
            None if is("toml") => Ok(Self::Toml),
            None => bail!(Usage(format!("{}: write .png, .vp, .xml, .json, .toml or .csv", path.display()))),
        }
    }

    /// Whether a file that begins with `start` is one like those written here.
    fn like(self) -> fn(&[u8]) -> bool {
        fn has(start: &[u8], word: &str) -> bool {
            String::from_utf8_lossy(start).contains(word)
        }
        match self {
            Self::Png => |start| start.starts_with(b"\x89PNG\r\n\x1a\n"),
            Self::Toml => |start| start.starts_with(b"[transfer]"),
            Self::File(FileKind::SlicerProperty) => |start| start.starts_with(b"0\n") || start.starts_with(b"1\n"),
            Self::File(FileKind::SlicerPresets) => |start| has(start, "<VolumeProperty") || has(start, "<MRML"),
            Self::File(FileKind::ParaView) => |start| has(start, "\"RGBPoints\"") || has(start, "\"ColorSpace\""),
            Self::File(_) => |start| start.to_ascii_lowercase().starts_with(b"value,"),
        }
    }
}

/// Where the transfer function comes from.
enum Source {
    Preset(Preset),
    File(TransferFile),
}

impl Source {
    fn of(args: &TfArgs) -> Result<Self> {
        let name = args.source.to_str().unwrap_or_default();
        if let Some(preset) = Preset::from_name(name).filter(|_| !args.source.is_file()) {
            if let Some(name) = &args.name {
                bail!(Usage(format!("--name {name}: is for files that hold several transfer functions")));
            }
            return Ok(Self::Preset(preset));
        }
        if args.source.extension().is_none() && !args.source.exists() {
            let nearest =
                Preset::ALL.into_iter().map(Preset::name).min_by_key(|n| strsim::damerau_levenshtein(n, name)).unwrap_or_default();
            bail!(Usage(format!("{name}: neither a file nor a preset; the nearest preset is {nearest}")));
        }
        Ok(Self::File(TransferFile::open(&args.source, args.name.as_deref())?))
    }

    fn needs_volume(&self) -> Result<bool> {
        match self {
            Self::Preset(preset) => Ok(!preset.is_ct()),
            Self::File(file) => Ok(file.needs_volume()?),
        }
    }

    fn found(&self, volume: Option<&Volume>) -> Result<FoundTransfer> {
        Ok(match (self, volume) {
            (Self::File(file), volume) => file.transfer(volume)?,
            (Self::Preset(preset), volume) => preset.found(volume)?,
        })
    }
}

pub(super) fn run(args: &TfArgs) -> Result<()> {
    let output = Output::of(&args.output)?;
    let sink = Sink::new(&args.output)?;
    let inputs: Vec<&Path> = args.volume.as_deref().into_iter().chain([args.source.as_path()]).collect();
    sink.spare("transfer function like that", output.like(), &inputs)?;
    let source = Source::of(args)?;
    let volume = volume(args, &source, output)?;
    let FoundTransfer { mut transfer, lighting, mut warnings, .. } = source.found(volume.as_ref())?;
    // The volume is known here, and nowhere later.
    if let (None, Some(volume)) = (transfer.unit(), &volume) {
        transfer = transfer.with_unit(volume.grid().smallest_spacing())?;
    }
    let name = match &source {
        Source::Preset(preset) => preset.name().to_owned(),
        Source::File(file) => {
            let stem = args.source.file_stem().map(|s| s.to_string_lossy().into_owned());
            file.name().map(str::to_owned).or(stem).unwrap_or_default()
        }
    };
    let bytes = match output {
        Output::Png => {
            let ct = volume.as_ref().is_some_and(|v| v.modality() == Modality::Ct) || matches!(&source, Source::Preset(p) if p.is_ct());
            let units = if ct { Units::Hounsfield } else { Units::Unknown };
            // Without its folder, which may say something about people.
            let title = match volume.as_ref().and_then(|v| Path::new(v.name()).file_name()) {
                Some(of) => format!("{name} over {}", of.to_string_lossy()),
                None => name,
            };
            transfer_png(&title, &transfer, volume.as_ref().map(Volume::statistics), units)?
        }
        Output::Toml => transfer_sections(&transfer, lighting.as_ref())?.into_bytes(),
        Output::File(kind) => {
            let (text, lost) = write_transfer(&name, &transfer, lighting.as_ref(), kind);
            warnings.extend(lost);
            text.into_bytes()
        }
    };
    warnings.iter().for_each(|w| complain("warning", w));
    match sink {
        Sink::Stdout => print(&bytes),
        Sink::File(_) => sink.write(&bytes),
    }
}

/// The volume that is named, or else that of the scene where it is needed or its histogram drawn.
fn volume(args: &TfArgs, source: &Source, output: Output) -> Result<Option<Volume>> {
    let limits = args.reading.limits();
    if args.volume.is_some() || args.flags.any() {
        let mut overrides = Overrides::default();
        let text = scene_of(args.volume.as_deref(), &mut overrides);
        args.flags.apply(&mut overrides)?;
        return Ok(Some(load(text.open(&overrides)?.volume(), &limits)?));
    }
    let needed = source.needs_volume()?;
    if let Source::File(file) = source {
        if let Some(volume) = file.volume().filter(|_| needed || output == Output::Png) {
            return Ok(Some(load(volume, &limits)?));
        }
    }
    if needed {
        bail!(Usage(format!("{}: is laid over the values of a volume: name one with --volume FILE", args.source.display())));
    }
    Ok(None)
}
