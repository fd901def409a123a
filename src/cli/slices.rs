//! `slicestack slices`: cut pictures through a volume.

use super::flags::VolumeFlags;
use super::output::{Sink, encoding, is_picture};
use super::scene::{ReadingArgs, background, load, scene_of, sides};
use super::signals::go_on;
use super::{Usage, complain, tell};
use anyhow::{Result, bail};
use clap::builder::PossibleValuesParser;
use slicestack::Volume;
use slicestack::annotate::annotate_cuts;
use slicestack::cut::{Drawn, Frame, Orientation, Sheet, Window, occupied};
use slicestack::picture::Format;
use slicestack::scene::preset::Kind;
use slicestack::scene::{Annotations, ColorMap, Filter, Overrides, Straight};
use slicestack::volume::Grid;
use std::path::{Path, PathBuf};

/// What `slices` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = EXAMPLES)]
pub(super) struct SlicesArgs {
    /// Volume file, or a scene file whose volume is meant.
    #[arg(value_name = "VOLUME")]
    input: Option<PathBuf>,
    /// axial: anterior up; coronal: superior up; both with the patient's right at the left; sagittal: superior up, anterior left. Where the file
    /// gives no anatomy: across z, y and x. oblique: across --normal. axial unless given.
    #[arg(long, value_parser = ["axial", "coronal", "sagittal", "oblique"])]
    plane: Option<String>,
    /// Normal of an oblique cut in the world; it is seen from where the normal points to, superior up.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    normal: Option<String>,
    /// Where to cut: the world's z, y or x (oblique: the distance along the normal), or a share of the box such as 50%, towards superior,
    /// anterior, left; 50% unless given.
    #[arg(long, value_name = "MM|N%", allow_hyphen_values = true, conflicts_with_all = ["index", "montage"])]
    at: Option<String>,
    /// Where to cut: through the middle of this layer of voxels, counted from 0.
    #[arg(long, value_name = "K", conflicts_with = "montage")]
    index: Option<usize>,
    /// Several cuts, columns x rows, evenly through what is not background, each with its position in a corner.
    #[arg(long, value_name = "COLUMNSxROWS")]
    montage: Option<String>,
    /// Values from black to white; else soft tissue (40,400) for CT, 1 to 99.5 % of what is seen for others.
    #[arg(long, value_name = "CENTER,WIDTH", allow_hyphen_values = true)]
    window: Option<String>,
    /// What a lookup between voxels gives.
    #[arg(long, value_parser = ["linear", "nearest", "cubic"], default_value = "linear")]
    filter: String,
    /// Colour map instead of grey: see `slicestack presets`.
    #[arg(long, value_name = "MAP", value_parser = maps())]
    colors: Option<String>,
    /// Size of the picture in pixels; 512 a side at most unless given, 192 for each cut of a montage.
    #[arg(long, value_name = "WxH")]
    size: Option<String>,
    /// Colour beside the volume: black, white, #rrggbb, or r,g,b,a from 0 to 1; transparent unless given.
    #[arg(long, value_name = "COLOUR")]
    background: Option<String>,
    #[arg(short, long, value_name = "OUT", default_value = "slices.png", help = format!("Picture to write: {}; - for stdout", Format::choices()))]
    output: PathBuf,
    /// Format, where the name of OUT does not tell it.
    #[arg(long, value_parser = super::render::formats())]
    format: Option<String>,
    /// Bits of the components of a PNG or TIFF.
    #[arg(long, value_parser = ["8", "16"], default_value = "8")]
    depth: String,
    #[command(flatten)]
    drawn: AnnotateArgs,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    flags: VolumeFlags,
}

/// What is drawn on the picture.
#[derive(Debug, clap::Args)]
struct AnnotateArgs {
    /// Draw a bar of a round length.
    #[arg(long = "annotate.scale_bar", value_name = "true|false", num_args = 0..=1, default_value = "false", default_missing_value = "true", hide_default_value = true, hide_possible_values = true)]
    scale_bar: bool,
    /// Write letters at the sides (R L A P S I) where the file gives anatomy; else draw a cross of x, y, z.
    #[arg(long = "annotate.axes", value_name = "true|false", num_args = 0..=1, default_value = "false", default_missing_value = "true", hide_default_value = true, hide_possible_values = true)]
    axes: bool,
    /// Write each cut's position in its corner; a montage has them unless this is false.
    #[arg(long = "annotate.position", value_name = "true|false", num_args = 0..=1, default_missing_value = "true", hide_possible_values = true)]
    position: Option<bool>,
    /// Write a line of text at the top.
    #[arg(long = "annotate.title", value_name = "TEXT")]
    title: Option<String>,
}

const EXAMPLES: &str = "\
Examples:
  slicestack slices head.nii.gz                                     an axial cut through the middle
  slicestack slices head.nii.gz --plane sagittal --at -12.5 --annotate.axes
  slicestack slices ct.nrrd --montage 4x5 --window -600,1500        twenty cuts in a lung window
  slicestack slices ct.nrrd --normal 1,1,0.5 --filter cubic --colors viridis --size 800x600";

fn maps() -> PossibleValuesParser {
    PossibleValuesParser::new(ColorMap::ALL.map(ColorMap::name))
}

/// As many finite numbers as are wanted, with commas between them.
fn numbers<const N: usize>(flag: &str, text: &str, what: &str) -> Result<[f64; N]> {
    let list: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match list.and_then(|l| <[f64; N]>::try_from(l).ok()) {
        Some(numbers) => Ok(numbers),
        None => bail!(Usage(format!("--{flag} {text}: write {what}"))),
    }
}

/// All that can be known without the volume.
struct Plan {
    orientation: Orientation,
    place: Place,
    window: Option<Window>,
    filter: Filter,
    size: Option<(u32, u32)>,
    background: Straight,
    annotations: Annotations,
}

/// Where to cut.
enum Place {
    At(f64),
    Share(f64),
    Layer(usize),
    Montage(u32, u32),
}

impl Plan {
    fn new(args: &SlicesArgs) -> Result<Self> {
        let orientation = match (args.plane.as_deref(), &args.normal) {
            (None | Some("oblique"), Some(normal)) => {
                let n = numbers::<3>("normal", normal, "three numbers X,Y,Z")?;
                if n == [0.0; 3] {
                    bail!(Usage("--normal 0,0,0: points nowhere; write X,Y,Z of which one is not 0".into()));
                }
                Orientation::Oblique(n.into())
            }
            (Some("oblique"), None) => bail!(Usage("--plane oblique: give its --normal X,Y,Z".into())),
            (Some(other), Some(_)) => bail!(Usage(format!("--normal: is for --plane oblique, not {other}"))),
            (Some("coronal"), None) => Orientation::Coronal,
            (Some("sagittal"), None) => Orientation::Sagittal,
            (_, None) => Orientation::Axial,
        };
        let place = match (&args.at, args.index, &args.montage) {
            (Some(text), ..) => at(text)?,
            (_, Some(layer), _) => Place::Layer(layer),
            (.., Some(text)) => match sides(text).filter(|(c, r)| *c > 0 && *r > 0) {
                Some((columns, rows)) => Place::Montage(columns, rows),
                None => bail!(Usage(format!("--montage {text}: write COLUMNSxROWS, such as 4x5"))),
            },
            _ => Place::Share(0.5),
        };
        let window = args.window.as_deref().map(|text| -> Result<Window> {
            let [center, width] = numbers("window", text, "two numbers CENTER,WIDTH")?;
            Ok(Window::new(center, width).map_err(|e| Usage(format!("--{e}")))?)
        });
        let size = args.size.as_deref().map(|text| match sides(text) {
            Some(size) => Ok(size),
            None => bail!(Usage(format!("--size {text}: write WIDTHxHEIGHT, such as 800x600"))),
        });
        let background = match &args.background {
            Some(text) => {
                let [r, g, b, alpha] = numbers("background", &background(text)?, "black, white, #rrggbb, or r,g,b,a from 0 to 1")?;
                Straight { rgb: [r, g, b], alpha }
            }
            None => Straight::default(),
        };
        let filter = match args.filter.as_str() {
            "nearest" => Filter::Nearest,
            "cubic" => Filter::CUBIC,
            _ => Filter::Linear,
        };
        let mut annotations = Annotations::new();
        annotations.scale_bar = args.drawn.scale_bar;
        annotations.axes = args.drawn.axes;
        annotations.position = args.drawn.position.unwrap_or(args.montage.is_some());
        annotations.title = args.drawn.title.clone().filter(|t| !t.trim().is_empty());
        Ok(Self { orientation, place, window: window.transpose()?, filter, size: size.transpose()?, background, annotations })
    }

    /// Columns of cuts, and the offset of each.
    fn offsets(&self, volume: &Volume) -> Result<(u32, Vec<f64>)> {
        let grid = volume.grid();
        let frame = Frame::new(grid, self.orientation)?;
        Ok(match self.place {
            Place::At(offset) => (1, vec![offset]),
            Place::Share(share) => (1, vec![frame.offset_at(grid, share)]),
            Place::Layer(layer) => (1, vec![frame.offset_of_layer(grid, layer).map_err(|e| Usage(format!("--index: {e}")))?]),
            Place::Montage(columns, rows) => {
                let count = columns as u64 * u64::from(rows);
                if count > slicestack::cut::MAX_CUTS as u64 {
                    bail!(Usage(format!("--montage {columns}x{rows}: {count} cuts, {} are the most", slicestack::cut::MAX_CUTS)));
                }
                let (low, high) = occupied(volume, &frame);
                let (from, to) = if frame.onward.dot(frame.axis) < 0.0 { (high, low) } else { (low, high) };
                (columns, (0..count).map(|n| from + (to - from) * ((n as f64 + 0.5) / count as f64)).collect())
            }
        })
    }
}

/// A place in world units, or a share of the box.
fn at(text: &str) -> Result<Place> {
    let refused = || Usage(format!("--at {text}: write a number, or a share of the box from 0% to 100%"));
    let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    match text.trim().strip_suffix('%') {
        Some(percent) => {
            let percent = number(percent).filter(|p| (0.0..=100.0).contains(p)).ok_or_else(refused)?;
            Ok(Place::Share(percent / 100.0))
        }
        None => Ok(Place::At(number(text).ok_or_else(refused)?)),
    }
}

pub(super) fn run(args: &SlicesArgs) -> Result<()> {
    let plan = Plan::new(args)?;
    let sink = Sink::new(&args.output)?;
    let (format, depth) = encoding(&sink, args.format.as_deref(), &args.depth)?;
    if plan.annotations.any() {
        super::render::refuse_numbers(format)?;
    }
    let inputs: Vec<&Path> = args.input.as_deref().into_iter().collect();
    sink.spare("picture", is_picture, &inputs)?;
    if args.input.is_none() && !args.flags.any() {
        bail!(Usage("slices: name a volume file".into()));
    }
    let mut overrides = Overrides::default();
    let text = scene_of(args.input.as_deref(), &mut overrides);
    args.flags.apply(&mut overrides)?;
    let source = text.open(&overrides)?;
    if let Some(path) = source.volume().path() {
        sink.spare("picture", is_picture, &[path])?;
    }
    let volume = load(source.volume(), &args.reading.limits())?;
    let (columns, offsets) = plan.offsets(&volume)?;
    let mut sheet = Sheet::new(volume.grid(), plan.orientation, offsets)?
        .with_columns(columns)?
        .with_filter(plan.filter)
        .with_background(plan.background)
        .map_err(|e| Usage(format!("--{e}")))?;
    if let Some((width, height)) = plan.size {
        sheet = sheet.with_size(width, height).map_err(|e| Usage(format!("--size: {e}")))?;
    }
    if let Some(map) = args.colors.as_deref().and_then(ColorMap::from_name) {
        sheet = sheet.with_colors(map);
    }
    let (window, why) = match plan.window {
        Some(window) => (Some(window), ""),
        None if volume.colors().is_some() => (None, ""),
        None if Kind::of(&volume) == Kind::Hounsfield => (Some(Window::SOFT_TISSUE), ", for soft tissue"),
        None => (None, ", 1 to 99.5 % of what is seen"),
    };
    if let Some(window) = window {
        sheet = sheet.with_window(window);
    }
    let drawn = sheet.draw(&volume)?;
    let picture = if plan.annotations.any() {
        let (picture, warnings) = annotate_cuts(&drawn, &plan.annotations)?;
        warnings.iter().for_each(|w| complain("warning", w));
        picture
    } else {
        drawn.picture.clone()
    };
    if drawn.picture.pixels().iter().all(|p| *p == drawn.picture.pixels()[0]) {
        complain("warning", &format!("the picture is of one colour: {}", beside(&drawn, volume.grid())));
    }
    go_on()?;
    let bytes = picture.encode(format, depth)?;
    sink.write(&bytes)?;
    let seen = drawn.window.map_or_else(|| "colours as they are".to_owned(), |window| format!("window {}{why}", centre_and_width(window)));
    tell!("{}; {seen}", said(plan.orientation, &drawn));
    Ok(())
}

/// Why a picture may show nothing.
fn beside(drawn: &Drawn, grid: &Grid) -> String {
    let (low, high) = drawn.layout.frame().extent(grid);
    match drawn.layout.offsets() {
        [offset] if *offset < low || *offset > high => format!("the cut at {offset} lies beside the box, from {low} to {high}"),
        _ => "nothing of the volume differs in it, or all of it lies beyond the window".into(),
    }
}

fn centre_and_width(window: Window) -> String {
    let (center, width) = window.center_and_width();
    let round = |x: f64| format!("{x:.3}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let number = |x: f64| if x != 0.0 && !(1e-2..1e7).contains(&x.abs()) { format!("{x:.3e}") } else { round(x) };
    format!("{},{}", number(center), number(width))
}

/// Which cuts were made, and how they are turned.
fn said(orientation: Orientation, drawn: &Drawn) -> String {
    let (frame, offsets) = (drawn.layout.frame(), drawn.layout.offsets());
    let where_to = match offsets {
        [.., last] if offsets.len() > 1 => {
            format!("{} {} cuts from {} to {}", offsets.len(), orientation.name(), frame.position(offsets[0]), frame.position(*last))
        }
        _ => format!("{} cut at {}", orientation.name(), frame.position(offsets[0])),
    };
    let side = |direction: [f64; 3]| {
        let parts = ["x", "y", "z"].iter().zip(direction).filter(|p| p.1.abs() > 0.05);
        parts.map(|(name, part)| format!("{}{name}", if part < 0.0 { '-' } else { '+' })).collect::<Vec<_>>().join("")
    };
    let turned = match (frame.space.letters(-frame.right), frame.space.letters(frame.up)) {
        (Some(left), Some(top)) => format!("{} at the left, {} at the top", words(&left), words(&top)),
        _ => format!("world {} to the right, {} to the top", side(frame.right.to_array()), side(frame.up.to_array())),
    };
    format!("{where_to}, {turned}")
}

/// Letters of directions as words.
fn words(letters: &str) -> String {
    let word = |c: char| match c {
        'R' => "patient's right",
        'L' => "patient's left",
        'A' => "anterior",
        'P' => "posterior",
        'S' => "superior",
        _ => "inferior",
    };
    letters.chars().map(word).collect::<Vec<_>>().join(" and ")
}
