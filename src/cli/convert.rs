//! `slicestack convert`: a volume in another format, or a part of it, or with other voxels.

use super::flags::VolumeFlags;
use super::output::Sink;
use super::progress::{Bar, Phase, catch_signals, enter, rendered};
use super::scene::{ReadingArgs, load, scene_of};
use super::{Usage, complain};
use anyhow::{Result, bail};
use clap::builder::PossibleValuesParser;
use slicestack::scene::Overrides;
use slicestack::volume::VoxelType;
use slicestack::volume::edit::{Retyped, Sampling, convert_type, crop, resample};
use slicestack::volume::io::{self, WriteFormat, Writing, Written};
use slicestack::{Error, Limits, Volume};
use std::io::{ErrorKind, stdout};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `convert` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = EXAMPLES)]
pub(super) struct ConvertArgs {
    /// Volume file or folder, or a scene file whose volume is meant; - for stdin.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write: .nrrd, .nii, .mha, .npy or .raw; .nii.gz, .npy.gz or .raw.gz; - for stdout. Or .ome.zarr: a new folder with levels of detail.
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Format, where the name of OUT does not tell it; NRRD for stdout unless given.
    #[arg(long, value_name = "FORMAT", value_parser = formats())]
    format: Option<String>,
    /// Compress the voxels: gzip in NRRD, zlib in MetaImage. Other formats are compressed as a whole, which .gz behind their name says too.
    #[arg(long)]
    compress: bool,
    /// Keep these voxels, counted from 0, the ends not included; an end that is left out is the volume's.
    #[arg(long, value_name = "X0:X1,Y0:Y1,Z0:Z1")]
    crop: Option<String>,
    /// Make voxels of this size in the same box, as near as it can be filled with them; one number for all axes, or three.
    #[arg(long, value_name = "X,Y,Z", conflicts_with = "size")]
    spacing: Option<String>,
    /// Make so many voxels in the same box. Where that are fewer, each is the mean of those in its place; labels are never mixed.
    #[arg(long, value_name = "NxNxN")]
    size: Option<String>,
    /// Convert the values, slope and intercept applied, to this type: rounded to nearest, clipped to what it holds. Of colours the largest
    /// number of an integer type, and 1 in f32, stand for the same.
    #[arg(long = "type", value_name = "TYPE", value_parser = PossibleValuesParser::new(VoxelType::ALL.map(VoxelType::name)))]
    kind: Option<String>,
    /// Spread these values over all numbers of the integer type. A slope and an intercept turn them back: NIfTI and MetaImage keep them, for
    /// other formats they are told.
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true)]
    scale: Option<String>,
    /// Replace OUT even where it is no file that slicestack wrote; never the input.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    flags: VolumeFlags,
}

const EXAMPLES: &str = "\
Examples:
  slicestack convert scan.nii.gz scan.nrrd                      unpacked once: from now on it is mapped instead of read
  slicestack convert ct.nrrd part.nii.gz --crop 100:300,:,20:80
  slicestack convert ct.nrrd small.nrrd --spacing 2 --compress
  slicestack convert ct.nrrd ct8.nii --type u8 --scale -1000,1000
  slicestack convert head.mha - --format nrrd | slicestack render - -o head.png
  slicestack convert huge.nrrd huge.ome.zarr                    levels of detail: render them with --memory 1GiB

A large .nrrd, .nii, .mha, .npy or .raw file that is not compressed is mapped when it is rendered, which takes no time to read and no
memory that others cannot have. What a format does not keep is told. An older OUT gives way where slicestack wrote it; .npy and .raw carry
no such mark and need --force.";

fn formats() -> PossibleValuesParser {
    PossibleValuesParser::new(WriteFormat::ALL.map(WriteFormat::extension))
}

/// All that can be known without the volume.
struct Plan {
    crop: Option<[[Option<usize>; 2]; 3]>,
    sampling: Option<Sampling>,
    kind: Option<VoxelType>,
    scale: Option<(f64, f64)>,
}

impl Plan {
    fn new(args: &ConvertArgs) -> Result<Self> {
        let crop = args
            .crop
            .as_deref()
            .map(|text| ranges(text).ok_or_else(|| Usage(format!("--crop {text}: write X0:X1,Y0:Y1,Z0:Z1, such as 100:300,:,20:80"))));
        let numbers = |text: &str| -> Option<Vec<f64>> { text.split(',').map(|n| n.trim().parse().ok()).collect() };
        let sampling = match (&args.spacing, &args.size) {
            (Some(text), _) => match numbers(text).as_deref() {
                Some([all]) => Some(Sampling::Spacing([*all; 3])),
                Some([x, y, z]) => Some(Sampling::Spacing([*x, *y, *z])),
                _ => bail!(Usage(format!("--spacing {text}: write one number, or three with commas between them"))),
            },
            (_, Some(text)) => match text.split(['x', 'X']).map(str::parse).collect::<Result<Vec<usize>, _>>().as_deref() {
                Ok([x, y, z]) => Some(Sampling::Dimensions([*x, *y, *z])),
                _ => bail!(Usage(format!("--size {text}: write three numbers of voxels, such as 256x256x128"))),
            },
            _ => None,
        };
        let scale = match args.scale.as_deref().map(|text| (text, numbers(text))) {
            None => None,
            Some((_, Some(list))) if list.len() == 2 => Some((list[0], list[1])),
            Some((text, _)) => bail!(Usage(format!("--scale {text}: write two values LOW,HIGH"))),
        };
        Ok(Self { crop: crop.transpose()?, sampling, kind: args.kind.as_deref().and_then(VoxelType::from_name), scale })
    }

    /// What is to be written of `volume`; what happens to its values is told.
    fn apply(&self, mut volume: Volume, limits: &Limits, bar: &Bar) -> Result<Volume> {
        if let Some(ends) = self.crop {
            let dims = volume.grid().dims();
            let ranges = [0, 1, 2].map(|i| ends[i][0].unwrap_or(0)..ends[i][1].unwrap_or(dims[i]));
            volume = crop(&volume, ranges, Some(bar)).map_err(flag("crop"))?;
        }
        if let Some(sampling) = self.sampling {
            let name = if matches!(sampling, Sampling::Spacing(_)) { "spacing" } else { "size" };
            volume = resample(&volume, sampling, limits, Some(bar)).map_err(flag(name))?;
            if let (Sampling::Spacing(wanted), got) = (sampling, volume.grid().spacing()) {
                if (0..3).any(|i| (got[i] - wanted[i]).abs() > 1e-6 * wanted[i]) {
                    complain("note", &format!("the box stays as it is, so the spacing became {} x {} x {}", got[0], got[1], got[2]));
                }
            }
        }
        if self.kind.is_some() || self.scale.is_some() {
            let own = volume.voxels().voxel_type();
            let done = convert_type(&volume, self.kind.unwrap_or(own), self.scale, limits, Some(bar));
            let done = done.map_err(flag(if self.scale.is_some() { "scale" } else { "type" }))?;
            self.tell(&done);
            volume = done.volume;
        }
        Ok(volume)
    }

    /// Tells what became of values.
    fn tell(&self, done: &Retyped) {
        let count = done.volume.grid().voxel_count();
        let kind = done.volume.voxels().voxel_type();
        let (low, high) = done.range;
        if done.clipped > 0 {
            complain("warning", &format!("{} of {count} voxels were outside {low} to {high} and were clipped to it", done.clipped));
        }
        if done.undefined > 0 {
            let zero = 0.0f64.clamp(low, high);
            complain("warning", &format!("{} of {count} voxels were NaN, which {kind} does not have, and became {zero}", done.undefined));
        }
        // A scale rounds on purpose.
        if done.rounded > 0 && self.scale.is_none() {
            complain("note", &format!("{} of {count} numbers were rounded to {kind}", done.rounded));
        }
    }
}

/// A range for each axis, with ends that may be left out.
fn ranges(text: &str) -> Option<[[Option<usize>; 2]; 3]> {
    let end = |text: &str| match text.trim() {
        "" => Some(None),
        number => number.parse().ok().map(Some),
    };
    let axes: Option<Vec<_>> = text
        .split(',')
        .map(|axis| {
            let (from, to) = axis.split_once(':')?;
            Some([end(from)?, end(to)?])
        })
        .collect();
    axes?.try_into().ok()
}

/// An error about what was asked for is told as that of the flag `name`.
fn flag(name: &str) -> impl Fn(Error) -> anyhow::Error {
    move |error| match error {
        Error::Invalid(what) if what.starts_with(name) => Usage(format!("--{what}")).into(),
        Error::Invalid(what) => Usage(format!("--{name}: {what}")).into(),
        other => other.into(),
    }
}

/// Writes the levels of a volume of any size to a new folder.
fn pyramid(args: &ConvertArgs, plan: &Plan) -> Result<()> {
    for (flag, given) in [("compress", args.compress), ("format", args.format.is_some()), ("force", args.force)] {
        if given {
            bail!(Usage(format!("--{flag}: an .ome.zarr folder is new, and its chunks are as large as their voxels; leave it out")));
        }
    }
    catch_signals()?;
    let mut overrides = Overrides::default();
    let text = scene_of(Some(&args.input), &mut overrides)?;
    args.flags.apply(&mut overrides)?;
    let source = text.open(&overrides)?;
    let limits = args.reading.limits().mapped_bytes(u64::MAX);
    let volume = load(source.volume(), &limits)?;
    let bar = Arc::new(Bar::new());
    enter(Phase::Rendering);
    let volume = plan.apply(volume, &limits, &bar);
    bar.clear();
    let volume = volume?;
    rendered()?;
    enter(Phase::Streaming);
    let written = io::write_pyramid(&volume, &args.output, &Writing::new().progress(bar.clone()));
    bar.clear();
    enter(Phase::Idle);
    let written = written?;
    written.notes.iter().for_each(|note| complain("note", note));
    let [x, y, z] = volume.grid().dims();
    eprintln!(
        "{}: {x} x {y} x {z} voxels of {} and coarser levels in {} bytes of OME-Zarr",
        args.output.display(),
        written.voxel_type,
        written.bytes
    );
    Ok(())
}

pub(super) fn run(args: &ConvertArgs) -> Result<()> {
    let plan = Plan::new(args)?;
    if args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("zarr")) {
        return pyramid(args, &plan);
    }
    let sink = Sink::new(&args.output)?;
    let named = args.format.as_deref().and_then(WriteFormat::from_extension);
    let format = match (named, &sink) {
        (Some(format), _) => format,
        (None, Sink::Stdout) => WriteFormat::Nrrd,
        (None, Sink::File(path)) => WriteFormat::of_path(path).map_err(|e| Usage(e.to_string()))?.0,
    };
    if let Sink::File(path) = &sink {
        Writing::new().format(named).compress(args.compress).check(path).map_err(|e| Usage(e.to_string()))?;
    }
    spare(args, &sink, format, &args.input)?;
    catch_signals()?;
    let mut overrides = Overrides::default();
    let text = scene_of(Some(&args.input), &mut overrides)?;
    args.flags.apply(&mut overrides)?;
    let source = text.open(&overrides)?;
    if let Some(path) = source.volume().path() {
        spare(args, &sink, format, path)?;
    }
    let limits = args.reading.limits();
    let volume = load(source.volume(), &limits)?;

    let bar = Arc::new(Bar::new());
    enter(Phase::Rendering);
    let volume = plan.apply(volume, &limits, &bar);
    bar.clear();
    let volume = volume?;
    rendered()?;
    let writing = Writing::new().format(named).compress(args.compress).stored(args.scale.is_some()).progress(bar.clone());
    let written = write(&volume, &sink, format, &writing);
    bar.clear();
    enter(Phase::Idle);
    let Some(written) = written? else { return Ok(()) };
    written.notes.iter().for_each(|note| complain("note", note));
    let [x, y, z] = volume.grid().dims();
    let what = if volume.channels().is_color() { "colours" } else { "voxels" };
    let name = if let Sink::File(path) = &sink { format!("{}: ", path.display()) } else { String::new() };
    eprintln!("{name}{x} x {y} x {z} {what} of {} in {} bytes of {format}", written.voxel_type, written.bytes);
    Ok(())
}

/// Refuses to replace the input, and without --force what was not written by this command.
fn spare(args: &ConvertArgs, sink: &Sink, format: WriteFormat, input: &Path) -> Result<()> {
    let is: fn(&[u8]) -> bool = match format {
        _ if args.force => |_| true,
        WriteFormat::Nrrd => |start| WriteFormat::Nrrd.wrote(start),
        WriteFormat::Nifti => |start| WriteFormat::Nifti.wrote(start),
        WriteFormat::MetaImage => |start| WriteFormat::MetaImage.wrote(start),
        _ => |start| WriteFormat::Raw.wrote(start),
    };
    sink.spare(&format!("{format} volume that slicestack is known to have written (--force replaces it)"), is, &[input])
}

/// Writes `volume`; `None` where nobody reads on.
fn write(volume: &Volume, sink: &Sink, format: WriteFormat, writing: &Writing) -> Result<Option<Written>> {
    match sink {
        Sink::File(path) => {
            // A pipe or a device is no file to finish.
            let whole = path.is_file() || !path.exists();
            enter(if whole { Phase::Streaming } else { Phase::Idle });
            Ok(Some(io::write(volume, path, writing)?))
        }
        Sink::Stdout => {
            enter(Phase::Idle);
            match io::write_to(volume, &mut stdout().lock(), format, writing) {
                Err(Error::Io { source, .. }) if source.kind() == ErrorKind::BrokenPipe => Ok(None),
                written => Ok(Some(written?)),
            }
        }
    }
}
