//! `slicestack compare`: how far one picture is from another.

use super::output::{Sink, is_picture, print};
use super::{Differs, Usage};
use anyhow::{Result, bail};
use serde_json::json;
use slicestack::compare::{Comparison, DIFFERENCE_SCALE, Tolerance, difference_map};
use slicestack::picture::{Depth, Format};
use slicestack::reference::metrics::DEFAULT_PIXELS_PER_DEGREE;
use slicestack::{Error, Picture};
use std::path::{Path, PathBuf};

/// What `compare` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct CompareArgs {
    /// Picture: PNG, WebP, TIFF, OpenEXR, NumPy and others.
    #[arg(value_name = "A")]
    a: PathBuf,
    /// Picture of the same size.
    #[arg(value_name = "B")]
    b: PathBuf,
    #[command(flatten)]
    limits: ToleranceArgs,
    /// Write a picture of the differences: black where the pictures are equal, lighter with every doubling of the difference.
    #[arg(short, long, value_name = "DIFF")]
    output: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Pixels that the viewer sees in a degree, for FLIP: 67 is a screen 0.7 m wide of 3840 pixels, seen from 0.7 m.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_PIXELS_PER_DEGREE, hide_default_value = true)]
    pixels_per_degree: f64,
}

/// How far pictures may be apart.
#[derive(Debug, clap::Args)]
pub(super) struct ToleranceArgs {
    /// Largest root-mean-square difference of the components, 0 to 1.
    #[arg(long, value_name = "X")]
    max_rms: Option<f64>,
    /// Largest FLIP, 0 to 1.
    #[arg(long, value_name = "X")]
    max_flip: Option<f64>,
    /// Most pixels that may differ.
    #[arg(long, value_name = "N")]
    max_diff: Option<u64>,
}

const EXAMPLES: &str = "\
Exit status: 0 within the limits, or without any; 3 beyond one; 1 for files that cannot be compared; 2 for wrong usage.

Examples:
  slicestack compare before.png after.png                       RMS, PSNR, SSIM, FLIP, pixels that differ
  slicestack compare before.png after.png --max-diff 0          exit status 3 unless all pixels are the same
  slicestack compare a.exr b.npy --max-rms 1e-6 -o diff.png     and a picture of the differences";

impl ToleranceArgs {
    /// # Errors
    /// [`Usage`] for a limit below 0, or none that is a number.
    pub(super) fn tolerance(&self) -> Result<Tolerance> {
        for (flag, limit) in [("--max-rms", self.max_rms), ("--max-flip", self.max_flip)] {
            if let Some(x) = limit.filter(|x| !(*x >= 0.0)) {
                bail!(Usage(format!("{flag} {x}: must be 0 or more")));
            }
        }
        let mut tolerance = Tolerance::new();
        tolerance.max_rms = self.max_rms;
        tolerance.max_flip = self.max_flip;
        tolerance.max_diff = self.max_diff;
        Ok(tolerance)
    }
}

pub(super) fn run(args: &CompareArgs) -> Result<()> {
    let tolerance = args.limits.tolerance()?;
    if !(1.0..=1000.0).contains(&args.pixels_per_degree) {
        bail!(Usage(format!("--pixels-per-degree {}: must lie between 1 and 1000", args.pixels_per_degree)));
    }
    let output = args.output.as_deref().map(|path| Output::new(path, &[&args.a, &args.b])).transpose()?;
    if args.json && output.as_ref().is_some_and(|o| o.sink == Sink::Stdout) {
        bail!(Usage("picture and JSON cannot both go to stdout".into()));
    }
    let (a, b) = (Picture::open(&args.a)?, Picture::open(&args.b)?);
    let named = |e: Error| match e {
        Error::Invalid(what) => Error::invalid(format!("{}, {}: {what}", args.a.display(), args.b.display())),
        other => other,
    };
    let found = Comparison::at(&a, &b, args.pixels_per_degree).map_err(named)?;
    let exceeded = tolerance.exceeded(&found);
    if let Some(Output { sink, format }) = &output {
        sink.write(&difference_map(&a, &b).map_err(named)?.encode(*format, Depth::Eight)?)?;
    }
    let told = if args.json { in_json(&found, exceeded.is_none())? } else { in_words(&found, args.output.as_deref()) };
    if output.is_none_or(|o| o.sink != Sink::Stdout) {
        print(told.as_bytes())?;
    }
    match exceeded {
        Some(what) => bail!(Differs(format!("{}, {}: {what}", args.a.display(), args.b.display()))),
        None => Ok(()),
    }
}

/// Where the picture of the differences goes.
struct Output {
    sink: Sink,
    format: Format,
}

impl Output {
    fn new(path: &Path, inputs: &[&Path]) -> Result<Self> {
        let sink = Sink::new(path)?;
        let format = if sink == Sink::Stdout { Format::Png } else { Format::of_path(path).map_err(|e| Usage(e.to_string()))? };
        sink.spare("picture", is_picture, inputs)?;
        Ok(Self { sink, format })
    }
}

fn in_json(c: &Comparison, within: bool) -> Result<String> {
    let worst = c.worst.map(|(x, y)| json!({ "x": x, "y": y }));
    // JSON has no infinity: the PSNR of equal pictures is null.
    let value = json!({
        "rms": c.rms,
        "max": c.max,
        "psnr": c.psnr.is_finite().then_some(c.psnr),
        "ssim": c.ssim,
        "flip": c.flip,
        "pixels_per_degree": c.pixels_per_degree,
        "differing": c.differing,
        "pixels": c.pixels,
        "worst": worst,
        "within": within,
    });
    Ok(serde_json::to_string_pretty(&value)? + "\n")
}

fn in_words(c: &Comparison, diff: Option<&Path>) -> String {
    let worst = c.worst.map_or_else(String::new, |(x, y)| format!(", at pixel {x},{y}"));
    let share = 100.0 * c.differing as f64 / c.pixels as f64;
    let mut text = format!(
        "differing pixels  {} of {} ({share:.2} %)\nlargest           {:.6}{worst}\nRMS               {:.3e}\nPSNR              {:.2} dB\n\
         SSIM              {:.6}   (luma, 11 x 11, sigma 1.5)\nFLIP              {:.6}   ({:.0} pixels per degree)\n",
        c.differing, c.pixels, c.max, c.rms, c.psnr, c.ssim, c.flip, c.pixels_per_degree
    );
    if let Some(path) = diff {
        text += &format!("{}: {DIFFERENCE_SCALE}\n", path.display());
    }
    text
}
