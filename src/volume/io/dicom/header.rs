//! What is gathered while a data set is gone through: values by their tags, and those of each frame.

use super::elements::{Element, Elements};
use super::image::{Facts, key};
use super::tags::*;
use crate::volume::io::Endian;
use glam::DVec3;

/// Most frames of one file.
pub(super) const MOST_FRAMES: usize = 1 << 16;

/// Sequences inside those of all frames and of each frame that are looked into.
const MACROS: [u32; 10] = [
    DIFFUSION,
    CARDIAC,
    ECHO,
    FRAME_CONTENT,
    PLANE_POSITION,
    PLANE_ORIENTATION,
    PIXEL_MEASURES,
    PIXEL_VALUES,
    CT_FRAME_TYPE,
    MR_FRAME_TYPE,
];

/// What is taken from anywhere.
const FACTS: [u32; 26] = [
    POSITION,
    ORIENTATION,
    PIXEL_SPACING,
    IMAGER_PIXEL_SPACING,
    NOMINAL_PIXEL_SPACING,
    PIXEL_ASPECT,
    SLICE_LOCATION,
    SLICE_THICKNESS,
    SPACING_BETWEEN_SLICES,
    RESCALE_INTERCEPT,
    RESCALE_SLOPE,
    RESCALE_TYPE,
    DOSE_SCALING,
    IMAGE_TYPE,
    FRAME_TYPE,
    TEMPORAL_POSITION,
    TEMPORAL_INDEX,
    TRIGGER_TIME,
    TRIGGER_DELAY,
    ECHO_TIME,
    EFFECTIVE_ECHO_TIME,
    B_VALUE,
    GRADIENT_ORIENTATION,
    ACQUISITION_NUMBER,
    FRAME_ACQUISITION_NUMBER,
    ACQUISITION_TIME,
];
/// Of these, those that must be numbers where they are given.
const NEEDED: [u32; 6] = [POSITION, ORIENTATION, NUMBER_OF_FRAMES, PIXEL_SPACING, RESCALE_INTERCEPT, RESCALE_SLOPE];
/// What is taken from the outermost data set alone.
const ROOT: [u32; 25] = [
    SOP_CLASS,
    SOP_INSTANCE,
    MODALITY,
    SERIES_DESCRIPTION,
    SERIES,
    SERIES_NUMBER,
    INSTANCE_NUMBER,
    SAMPLES,
    PHOTOMETRIC,
    PLANAR,
    NUMBER_OF_FRAMES,
    ROWS,
    COLUMNS,
    BITS_ALLOCATED,
    BITS_STORED,
    HIGH_BIT,
    PIXEL_REPRESENTATION,
    PIXEL_PADDING,
    RED_DESCRIPTOR,
    GREEN_DESCRIPTOR,
    BLUE_DESCRIPTOR,
    RED_DATA,
    GREEN_DATA,
    BLUE_DATA,
    GRID_OFFSETS,
];

/// Where a value belongs.
#[derive(Clone, Copy)]
enum Place {
    Root,
    Shared,
    Frame,
    Nowhere,
}

fn place(path: &[u32]) -> Place {
    match *path {
        [] | [DETECTOR] => Place::Root,
        [SHARED, m] | [SHARED, m, GRADIENT] if MACROS.contains(&m) => Place::Shared,
        [FRAMES, m] | [FRAMES, m, GRADIENT] if MACROS.contains(&m) => Place::Frame,
        _ => Place::Nowhere,
    }
}

/// Text without the blanks and zeros around it.
pub(super) fn text(bytes: &[u8]) -> String {
    let trimmed = String::from_utf8_lossy(bytes);
    trimmed.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned()
}

/// Text fit to be told: one line, short, in ASCII unless it is UTF-8.
fn told(bytes: &[u8]) -> String {
    let text = text(bytes);
    text.chars().map(|c| if c.is_control() || c == char::REPLACEMENT_CHARACTER { '?' } else { c }).take(64).collect()
}

/// Type of the value of a tag in implicit VR, where it is no text.
fn implicit_vr(tag: u32) -> [u8; 2] {
    *match tag {
        EFFECTIVE_ECHO_TIME | B_VALUE | GRADIENT_ORIENTATION | TRIGGER_DELAY => b"FD",
        TEMPORAL_INDEX => b"UL",
        FRAME_ACQUISITION_NUMBER | PIXEL_PADDING | RED_DESCRIPTOR..=BLUE_DESCRIPTOR => b"US",
        PHOTOMETRIC | NUMBER_OF_FRAMES | PIXEL_SPACING => b"DS",
        SAMPLES..=PIXEL_REPRESENTATION => b"US",
        _ => b"DS",
    }
}

/// What is gathered while the data set is gone through.
#[derive(Default)]
pub(super) struct Header {
    root: Facts,
    shared: Facts,
    frames: Vec<Facts>,
    /// Numbers of [`ROOT`] tags, the first of each.
    numbers: Vec<(u32, Vec<f64>)>,
    texts: Vec<(u32, String)>,
    pub(super) tables: [Vec<u8>; 3],
    pub(super) table_endian: Endian,
    pub(super) has_table: bool,
    /// The first value that is not what it should be.
    pub(super) fault: Option<String>,
}

impl Elements for Header {
    fn wants(&self, path: &[u32], tag: u32) -> bool {
        match *path {
            [] => FACTS.contains(&tag) || ROOT.contains(&tag),
            [DETECTOR] => matches!(tag, POSITION | ORIENTATION),
            _ => !matches!(place(path), Place::Nowhere) && FACTS.contains(&tag),
        }
    }

    fn enters(&self, path: &[u32], tag: u32) -> bool {
        match *path {
            [] => matches!(tag, SHARED | FRAMES | DETECTOR | MODALITY_LUT),
            [SHARED | FRAMES] => MACROS.contains(&tag),
            [SHARED | FRAMES, DIFFUSION] => tag == GRADIENT,
            _ => false,
        }
    }

    fn item(&mut self, path: &[u32]) {
        self.has_table |= *path == [MODALITY_LUT];
        if *path == [FRAMES] {
            if self.frames.len() == MOST_FRAMES {
                self.fault.get_or_insert_with(|| format!("more than {MOST_FRAMES} frames are described"));
            } else {
                self.frames.push(Facts::default());
            }
        }
    }

    fn value(&mut self, path: &[u32], element: Element, bytes: &[u8], endian: Endian) {
        let tag = element.tag;
        match tag {
            RED_DATA..=BLUE_DATA if path.is_empty() => {
                self.tables[(tag - RED_DATA) as usize] = bytes.to_vec();
                self.table_endian = endian;
            }
            SOP_CLASS | SOP_INSTANCE | MODALITY | SERIES_DESCRIPTION | SERIES | PHOTOMETRIC => self.texts.push((tag, told(bytes))),
            IMAGE_TYPE | FRAME_TYPE => self.facts(path, |facts| facts.kind = Some(told(bytes).into())),
            RESCALE_TYPE => self.facts(path, |facts| facts.hounsfield = Some(matches!(text(bytes).as_str(), "HU" | ""))),
            _ => match numbers(element, bytes, endian) {
                Ok(numbers) if numbers.is_empty() => {}
                Ok(numbers) if ROOT.contains(&tag) => self.numbers.push((tag, numbers)),
                Ok(numbers) => self.fact(path, tag, &numbers),
                Err(what) if NEEDED.contains(&tag) => drop(self.fault.get_or_insert(what)),
                // What only helps to tell images apart may be left out.
                Err(_) => {}
            },
        }
    }
}

/// The numbers of a value, be they text or not; none where it is empty.
fn numbers(element: Element, bytes: &[u8], endian: Endian) -> Result<Vec<f64>, String> {
    let vr = if element.vr == [0; 2] { implicit_vr(element.tag) } else { element.vr };
    Ok(match &vr {
        b"US" => bytes.chunks_exact(2).map(|b| f64::from(endian.u16(b))).collect(),
        b"SS" => bytes.chunks_exact(2).map(|b| f64::from(endian.u16(b) as i16)).collect(),
        b"UL" => bytes.chunks_exact(4).map(|b| f64::from(endian.u32(b))).collect(),
        b"SL" => bytes.chunks_exact(4).map(|b| f64::from(endian.u32(b) as i32)).collect(),
        b"FL" => bytes.chunks_exact(4).map(|b| f64::from(endian.f32(b))).collect(),
        b"FD" => bytes.chunks_exact(8).map(|b| endian.f64(b)).collect(),
        _ => {
            let text = text(bytes);
            if text.is_empty() {
                return Ok(Vec::new());
            }
            let number = |part: &str| match part.trim().parse::<f64>() {
                Ok(v) if v.is_finite() => Ok(v),
                _ => Err(format!("{} is \"{}\": not a number", shown(element.tag), part.escape_debug().take(40).collect::<String>())),
            };
            text.split('\\').map(number).collect::<Result<_, _>>()?
        }
    })
}

impl Header {
    fn facts(&mut self, path: &[u32], set: impl FnOnce(&mut Facts)) {
        match place(path) {
            Place::Root => set(&mut self.root),
            Place::Shared => set(&mut self.shared),
            Place::Frame => drop(self.frames.last_mut().map(set)),
            Place::Nowhere => {}
        }
    }

    fn fact(&mut self, path: &[u32], tag: u32, numbers: &[f64]) {
        let first = numbers[0];
        let needed = match tag {
            POSITION | GRADIENT_ORIENTATION => 3,
            ORIENTATION => 6,
            PIXEL_SPACING | IMAGER_PIXEL_SPACING | NOMINAL_PIXEL_SPACING | PIXEL_ASPECT => 2,
            _ => 1,
        };
        if numbers.len() < needed || numbers[..needed].iter().any(|n| !n.is_finite()) {
            if NEEDED.contains(&tag) {
                let count = match numbers.len() {
                    1 => "one number".to_owned(),
                    n => format!("{n} numbers"),
                };
                let wanted = if needed == 1 { "a finite one is needed".to_owned() } else { format!("{needed} finite ones are needed") };
                self.fault.get_or_insert_with(|| format!("{} has {count}, {wanted}", shown(tag)));
            }
            return;
        }
        let vector = |at: usize| DVec3::new(numbers[at], numbers[at + 1], numbers[at + 2]);
        self.facts(path, |facts| {
            let mut set = |at: usize| facts.keys[at] = Some(first);
            match tag {
                TEMPORAL_POSITION | TEMPORAL_INDEX => set(key::TEMPORAL),
                TRIGGER_TIME | TRIGGER_DELAY => set(key::TRIGGER),
                ECHO_TIME | EFFECTIVE_ECHO_TIME => set(key::ECHO),
                B_VALUE => set(key::B_VALUE),
                ACQUISITION_NUMBER | FRAME_ACQUISITION_NUMBER => set(key::ACQUISITION),
                ACQUISITION_TIME => set(key::TIME),
                GRADIENT_ORIENTATION => (0..3).for_each(|i| facts.keys[key::GRADIENT + i] = Some(numbers[i])),
                POSITION => facts.position = facts.position.or(Some(vector(0))),
                ORIENTATION => facts.orientation = facts.orientation.or(Some([vector(0), vector(3)])),
                PIXEL_SPACING => facts.spacing = Some([first, numbers[1]]),
                // Other sizes of a pixel count where its size in the patient is not given; it comes later.
                IMAGER_PIXEL_SPACING | NOMINAL_PIXEL_SPACING => facts.spacing = facts.spacing.or(Some([first, numbers[1]])),
                PIXEL_ASPECT => facts.aspect = Some([first, numbers[1]]),
                SLICE_LOCATION => facts.location = Some(first),
                SLICE_THICKNESS => facts.thickness = Some(first),
                SPACING_BETWEEN_SLICES => facts.between = Some(first),
                RESCALE_INTERCEPT => facts.intercept = Some(first),
                _ => facts.slope = Some(first),
            }
        });
    }

    pub(super) fn numbers(&self, tag: u32) -> Option<&[f64]> {
        self.numbers.iter().find(|(t, _)| *t == tag).map(|(_, n)| n.as_slice())
    }

    pub(super) fn number(&self, tag: u32) -> Option<f64> {
        self.numbers(tag).map(|n| n[0])
    }

    /// A count of at least `least`; `missing` where nothing is said.
    pub(super) fn count(&self, tag: u32, least: u32, missing: Option<u32>) -> Result<usize, String> {
        match self.number(tag) {
            None => missing.map(|n| n as usize).ok_or_else(|| format!("there are pixels and no {}", shown(tag))),
            Some(n) if n >= f64::from(least) && n <= f64::from(u32::MAX) && n.fract() == 0.0 => Ok(n as usize),
            Some(n) => Err(format!("{} is {n}: it must be a whole number of at least {least}", shown(tag))),
        }
    }

    pub(super) fn text(&self, tag: u32) -> String {
        self.texts.iter().find(|(t, _)| *t == tag).map(|(_, text)| text.clone()).unwrap_or_default()
    }

    /// What is known of each of `count` frames. Empty positions of a dose grid are filled in from its list of offsets.
    pub(super) fn into_frames(mut self, count: usize) -> Result<Vec<Facts>, String> {
        let common = self.shared.or(&self.root);
        let offsets = self.numbers(GRID_OFFSETS).map(<[f64]>::to_vec).filter(|o| o.len() == count && count > 1);
        if !self.frames.is_empty() && self.frames.len() != count {
            return Err(format!("frames described: {}, frames there: {count}", self.frames.len()));
        }
        if self.frames.is_empty() {
            // A position that is said once is that of the first frame: without more it says nothing of the others.
            let position = common.position.filter(|_| count == 1);
            let mut frames = vec![Facts { position, ..common.clone() }; count];
            if let (Some(offsets), Some(position), Some([row, column])) = (offsets, common.position, common.orientation) {
                let normal = row.cross(column);
                frames.iter_mut().zip(&offsets).for_each(|(frame, o)| frame.position = Some(position + normal * (o - offsets[0])));
            } else if let (Some(between), Some(position), Some([row, column]), true) =
                (common.between, common.position, common.orientation, count > 1)
            {
                let normal = row.cross(column);
                frames.iter_mut().enumerate().for_each(|(i, frame)| frame.position = Some(position + normal * (between * i as f64)));
            }
            return Ok(frames);
        }
        self.frames.iter_mut().for_each(|frame| *frame = frame.or(&common));
        Ok(self.frames)
    }
}
