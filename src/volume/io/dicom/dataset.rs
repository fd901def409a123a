//! From a file to what is known of its images: the header is gone through up to the pixels.

use super::elements::{Bytes, Element, Elements, Encoding, PIXELS, shown};
use super::image::{Bits, Facts, Image, Layout, Palette, Photometric, key};
use super::syntax::{Codec, Syntax};
use crate::Result;
use crate::volume::io::Endian;
use crate::volume::io::tree::Leaf;
use crate::volume::{VoxelType, Voxels};
use glam::DVec3;
use std::sync::Arc;

/// Bytes before the magic.
const PREAMBLE: usize = 128;
/// Most frames of one file.
const MOST_FRAMES: usize = 1 << 18;

/// Sequences that say something of all frames, of each frame, and of the detector.
const SHARED: u32 = 0x5200_9229;
const FRAMES: u32 = 0x5200_9230;
const DETECTOR: u32 = 0x0054_0022;
/// Those in the first two that are looked into: diffusion, cardiac trigger, echo, frame content, position and orientation of the plane, pixel
/// measures, transformation of values, and types of the frame (CT and MR).
const MACROS: [u32; 10] =
    [DIFFUSION, 0x0018_9118, 0x0018_9114, 0x0020_9111, 0x0020_9113, 0x0020_9116, 0x0028_9110, 0x0028_9145, 0x0018_9329, 0x0018_9226];
const DIFFUSION: u32 = 0x0018_9117;
const GRADIENT: u32 = 0x0018_9076;

const POSITION: u32 = 0x0020_0032;
const ORIENTATION: u32 = 0x0020_0037;
/// What is taken from anywhere.
const FACTS: [u32; 24] = [
    POSITION,
    ORIENTATION,
    0x0028_0030,
    0x0018_1164,
    0x0018_2010,
    0x0018_0050,
    0x0018_0088,
    0x0028_1052,
    0x0028_1053,
    0x0028_1054,
    0x3004_000e,
    0x0008_0008,
    0x0008_9007,
    0x0020_0100,
    0x0020_9128,
    0x0018_1060,
    0x0020_9153,
    0x0018_0081,
    0x0018_9082,
    0x0018_9087,
    0x0018_9089,
    0x0020_0012,
    0x0020_9156,
    0x0008_0032,
];
/// Of these, those that must be numbers where they are given.
const NEEDED: [u32; 6] = [POSITION, ORIENTATION, 0x0028_0008, 0x0028_0030, 0x0028_1052, 0x0028_1053];
/// The table of values that may stand in place of a slope.
const VALUES: u32 = 0x0028_3000;
/// What is taken from the outermost data set alone.
const ROOT: [u32; 25] = [
    0x0008_0016,
    0x0008_0018,
    0x0008_0060,
    0x0008_103e,
    0x0020_000e,
    0x0020_0011,
    0x0020_0013,
    0x0028_0002,
    0x0028_0004,
    0x0028_0006,
    0x0028_0008,
    0x0028_0010,
    0x0028_0011,
    0x0028_0100,
    0x0028_0101,
    0x0028_0102,
    0x0028_0103,
    0x0028_0120,
    0x0028_1101,
    0x0028_1102,
    0x0028_1103,
    0x0028_1201,
    0x0028_1202,
    0x0028_1203,
    0x3004_000c,
];

/// What a file turned out to be.
pub(super) enum Found {
    Image(Box<Image>),
    /// A DICOM file that is no image: what it is.
    Other(&'static str),
    /// No DICOM file.
    Nothing,
}

/// Whether a file that starts with `head` is a DICOM file by its magic.
pub(super) fn has_magic(head: &[u8]) -> bool {
    head.get(PREAMBLE..PREAMBLE + 4) == Some(b"DICM")
}

/// Whether a file that starts with `head` may be a DICOM file without a magic: its first element is of group 2 or 8.
pub(super) fn looks_bare(head: &[u8]) -> bool {
    let [a, b, element, 0, v, w, length, high, ..] = *head else { return false };
    let little = b == 0 && matches!(a, 2 | 8);
    let explicit = v.is_ascii_uppercase() && w.is_ascii_uppercase();
    little && element <= 0x20 && (explicit || (length == 0 && high == 0 && w == 0))
}

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
fn text(bytes: &[u8]) -> String {
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
        0x0018_9082 | 0x0018_9087 | 0x0018_9089 | 0x0020_9153 => b"FD",
        0x0020_9128 => b"UL",
        0x0020_9156 | 0x0028_0120 | 0x0028_1101..=0x0028_1103 => b"US",
        0x0028_0004 | 0x0028_0008 | 0x0028_0030 => b"DS",
        0x0028_0002..=0x0028_0103 => b"US",
        _ => b"DS",
    }
}

/// What is gathered while the data set is gone through.
#[derive(Default)]
struct Header {
    root: Facts,
    shared: Facts,
    frames: Vec<Facts>,
    /// Numbers of [`ROOT`] tags, the first of each.
    numbers: Vec<(u32, Vec<f64>)>,
    texts: Vec<(u32, String)>,
    tables: [Vec<u8>; 3],
    table_endian: Endian,
    has_table: bool,
    /// The first value that is not what it should be.
    fault: Option<String>,
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
            [] => matches!(tag, SHARED | FRAMES | DETECTOR | VALUES),
            [SHARED | FRAMES] => MACROS.contains(&tag),
            [SHARED | FRAMES, DIFFUSION] => tag == GRADIENT,
            _ => false,
        }
    }

    fn item(&mut self, path: &[u32]) {
        self.has_table |= *path == [VALUES];
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
            0x0028_1201..=0x0028_1203 if path.is_empty() => {
                self.tables[(tag - 0x0028_1201) as usize] = bytes.to_vec();
                self.table_endian = endian;
            }
            0x0008_0016 | 0x0008_0018 | 0x0008_0060 | 0x0008_103e | 0x0020_000e | 0x0028_0004 => self.texts.push((tag, told(bytes))),
            0x0008_0008 | 0x0008_9007 => self.facts(path, |facts| facts.kind = Some(told(bytes).into())),
            0x0028_1054 => self.facts(path, |facts| facts.hounsfield = Some(matches!(text(bytes).as_str(), "HU" | "US" | ""))),
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
            POSITION | 0x0018_9089 => 3,
            ORIENTATION => 6,
            0x0028_0030 | 0x0018_1164 | 0x0018_2010 => 2,
            _ => 1,
        };
        if numbers.len() < needed || numbers[..needed].iter().any(|n| !n.is_finite()) {
            let what = format!("{} has {} numbers, {needed} finite ones are needed", shown(tag), numbers.len());
            self.fault.get_or_insert(what);
            return;
        }
        let vector = |at: usize| DVec3::new(numbers[at], numbers[at + 1], numbers[at + 2]);
        self.facts(path, |facts| {
            let mut set = |at: usize| facts.keys[at] = Some(first);
            match tag {
                0x0020_0100 | 0x0020_9128 => set(key::TEMPORAL),
                0x0018_1060 | 0x0020_9153 => set(key::TRIGGER),
                0x0018_0081 | 0x0018_9082 => set(key::ECHO),
                0x0018_9087 => set(key::B_VALUE),
                0x0020_0012 | 0x0020_9156 => set(key::ACQUISITION),
                0x0008_0032 => set(key::TIME),
                0x0018_9089 => (0..3).for_each(|i| facts.keys[key::GRADIENT + i] = Some(numbers[i])),
                POSITION => facts.position = facts.position.or(Some(vector(0))),
                ORIENTATION => facts.orientation = facts.orientation.or(Some([vector(0), vector(3)])),
                0x0028_0030 => facts.spacing = Some([first, numbers[1]]),
                // Other sizes of a pixel count where its size in the patient is not given; it comes later.
                0x0018_1164 | 0x0018_2010 => facts.spacing = facts.spacing.or(Some([first, numbers[1]])),
                0x0018_0050 => facts.thickness = Some(first),
                0x0018_0088 => facts.between = Some(first),
                0x0028_1052 => facts.intercept = Some(first),
                _ => facts.slope = Some(first),
            }
        });
    }

    fn numbers(&self, tag: u32) -> Option<&[f64]> {
        self.numbers.iter().find(|(t, _)| *t == tag).map(|(_, n)| n.as_slice())
    }

    fn number(&self, tag: u32) -> Option<f64> {
        self.numbers(tag).map(|n| n[0])
    }

    /// A count of at least `least`; `missing` where nothing is said.
    fn count(&self, tag: u32, name: &str, least: u32, missing: Option<u32>) -> Result<usize, String> {
        match self.number(tag) {
            None => missing.map(|n| n as usize).ok_or_else(|| format!("there are pixels and no {name} {}", shown(tag))),
            Some(n) if n >= f64::from(least) && n <= f64::from(u32::MAX) && n.fract() == 0.0 => Ok(n as usize),
            Some(n) => Err(format!("{name} {} is {n}: it must be a whole number of at least {least}", shown(tag))),
        }
    }

    fn text(&self, tag: u32) -> String {
        self.texts.iter().find(|(t, _)| *t == tag).map(|(_, text)| text.clone()).unwrap_or_default()
    }

    /// How pixels lie, as far as they can be read, and why not where they cannot.
    fn layout(&self, pixels: u32, codec: Codec) -> Result<(Layout, Bits, Option<String>), String> {
        let (rows, columns) = (self.count(0x0028_0010, "number of rows", 1, None)?, self.count(0x0028_0011, "number of columns", 1, None)?);
        let samples = self.count(0x0028_0002, "number of samples", 1, Some(1))?;
        let float = pixels != PIXELS[0];
        let allocated = if pixels == PIXELS[2] { 64 } else { self.count(0x0028_0100, "number of bits allocated", 1, Some(16))? as u32 };
        let stored = if float { allocated } else { self.count(0x0028_0101, "number of bits stored", 1, Some(allocated))? as u32 };
        let high = if float { stored - 1 } else { self.count(0x0028_0102, "high bit", 0, Some(stored - 1))? as u32 };
        let signed = !float && self.number(0x0028_0103) == Some(1.0);
        let name = self.text(0x0028_0004);
        let (photometric, colors) = match name.as_str() {
            "MONOCHROME2" | "" => (Photometric::Gray, 1),
            "MONOCHROME1" => (Photometric::Inverted, 1),
            "RGB" => (Photometric::Rgb, 3),
            "YBR_FULL" => (Photometric::Ybr, 3),
            "YBR_FULL_422" if matches!(codec, Codec::Native | Codec::Bare) => (Photometric::Ybr422, 3),
            "YBR_FULL_422" => (Photometric::Ybr, 3),
            "YBR_ICT" | "YBR_RCT" => (Photometric::Coded, 3),
            "PALETTE COLOR" => (Photometric::Palette, 1),
            _ => (Photometric::Gray, samples),
        };
        let unread = if !matches!((allocated, float), (8 | 16 | 32, false) | (32 | 64, true)) {
            Some(format!("pixels of {allocated} bits are not supported"))
        } else if stored > allocated || high >= allocated || high + 1 < stored {
            return Err(format!("of {allocated} bits allocated {stored} are stored, up to bit {high}: that is not possible"));
        } else if samples != colors {
            return Err(format!("pixels of {samples} samples are {}, which have {colors}", if name.is_empty() { "gray" } else { &name }));
        } else if photometric == Photometric::Gray && !matches!(name.as_str(), "MONOCHROME2" | "") {
            Some(format!("pixels of photometric interpretation {name:?} are not supported"))
        } else if (colors == 3 && signed) || ((colors == 3 || photometric == Photometric::Palette) && (allocated > 16 || float)) {
            Some(format!("colours of {allocated} bits{} are not supported", if signed { " with a sign" } else { "" }))
        } else if photometric == Photometric::Ybr422 && columns % 2 == 1 {
            return Err(format!("YBR_FULL_422 needs an even number of columns, there are {columns}"));
        } else if matches!(photometric, Photometric::Ybr | Photometric::Ybr422) && allocated != 8 {
            Some(format!("colours {name} of {allocated} bits are not supported"))
        } else {
            None
        };
        Ok((Layout { rows, columns, samples, allocated, signed, float, photometric }, Bits { stored, high }, unread))
    }

    fn palette(&self) -> Result<Palette, String> {
        let mut first = 0;
        let mut tables = [const { None }; 3];
        for (i, table) in tables.iter_mut().enumerate() {
            let tag = 0x0028_1101 + i as u32;
            let Some(&[count, start, bits]) = self.numbers(tag) else {
                return Err(format!("the palette has no description {} of three numbers", shown(tag)));
            };
            let count = if count == 0.0 { 1 << 16 } else { count as usize };
            first = start as i64;
            let bytes = &self.tables[i];
            let wide = bits > 8.0;
            if bytes.len() < count * if wide { 2 } else { 1 } {
                return Err(format!("a palette of {count} colours of {bits} bits has {} bytes", bytes.len()));
            }
            // Some writers keep 8 bits in words.
            *table = Some(if wide || bytes.len() >= 2 * count {
                let words = bytes.chunks_exact(2).take(count).map(|b| self.table_endian.u16(b));
                if wide { Voxels::from(words.collect::<Vec<u16>>()) } else { Voxels::from(words.map(|w| w as u8).collect::<Vec<u8>>()) }
            } else {
                Voxels::from(bytes[..count].to_vec())
            });
        }
        match tables {
            [Some(r), Some(g), Some(b)]
                if r.len() == g.len() && g.len() == b.len() && r.voxel_type() == b.voxel_type() && g.voxel_type() == b.voxel_type() =>
            {
                Ok(Palette { first, tables: [r, g, b] })
            }
            _ => Err("the three tables of the palette are of different sizes".to_owned()),
        }
    }

    /// What is known of each of `count` frames. Empty positions of a dose grid are filled in from its list of offsets.
    fn into_frames(mut self, count: usize) -> Result<Vec<Facts>, String> {
        let common = self.shared.or(&self.root);
        let offsets = self.numbers(0x3004_000c).map(<[f64]>::to_vec).filter(|o| o.len() == count && count > 1);
        if !self.frames.is_empty() && self.frames.len() != count {
            return Err(format!("{} frames are described, there are {count}", self.frames.len()));
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

/// Looks into one file of the tree.
///
/// # Errors
/// When it is a DICOM file and not what it claims to be.
pub(super) fn look(leaf: Leaf) -> Result<Found> {
    let Leaf { index, path, mut source } = leaf;
    let head = source.peek(PREAMBLE + 8)?;
    let magic = has_magic(head);
    if !magic && !looks_bare(head) {
        return Ok(Found::Nothing);
    }
    let fault = |what: String| crate::Error::format(&path, what);
    let mut bytes = Bytes::new(source);
    if magic {
        bytes.skip(PREAMBLE as u64 + 4)?;
    }
    let mut named = None;
    while bytes.source.peek(6)?.starts_with(&[2, 0]) {
        let explicit = seen_encoding(bytes.source.peek(6)?).explicit;
        let element = bytes.element(if explicit { Encoding::EXPLICIT } else { Encoding::IMPLICIT })?;
        match element.length {
            Some(length) if element.tag == 0x0002_0010 => named = Some(text(&bytes.value(element, length)?)),
            Some(length) => bytes.skip(length)?,
            None => return Err(fault(format!("{} has no length", shown(element.tag)))),
        }
    }
    let seen = seen_encoding(bytes.source.peek(6)?);
    let mut syntax = named.filter(|uid| !uid.is_empty()).map_or_else(|| Syntax::unnamed(seen), |uid| Syntax::of(&uid));
    let mut before = 0;
    if syntax.deflated {
        before = bytes.at;
        bytes = Bytes::new(bytes.source.inflate());
    } else if bytes.source.peek(6)?.len() == 6 {
        // Some writers name the wrong one of implicit and explicit VR.
        syntax.encoding.explicit = seen.explicit;
    }
    let mut header = Header::default();
    let pixels = bytes.data_set(syntax.encoding, &mut header)?;
    if let Some(what) = header.fault {
        return Err(fault(what));
    }
    let class = header.text(0x0008_0016);
    let Some(pixels) = pixels else {
        return Ok(Found::Other(if header.text(0x0008_0060).is_empty() { "no image" } else { "an object without pixels" }));
    };
    let segments = ["1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7"].contains(&class.as_str());
    if segments || header.number(0x0028_0100) == Some(1.0) {
        return Ok(Found::Other("a segmentation"));
    }
    let (layout, bits, mut unread) = header.layout(pixels.tag, syntax.codec).map_err(fault)?;
    let count = header.count(0x0028_0008, "number of frames", 0, Some(1)).map_err(fault)?.max(1);
    let held = bytes.source.left();
    let whole = (layout.rows as u128) * (layout.columns as u128) * (layout.samples as u128) * u128::from(layout.allocated.div_ceil(8));
    let each = match (syntax.codec, pixels.length) {
        (Codec::Native, Some(length)) if unread.is_none() => {
            let whole = if layout.photometric == Photometric::Ybr422 { whole / 3 * 2 } else { whole };
            let needed = whole * count as u128;
            if needed > u128::from(length.min(held)) {
                let what = format!(
                    "{count} frames of {} x {} pixels of {} x {} bits take {needed} bytes, there are {}",
                    layout.columns,
                    layout.rows,
                    layout.samples,
                    layout.allocated,
                    length.min(held)
                );
                unread = Some(what);
            }
            whole
        }
        (Codec::Native, None) => return Err(fault("the pixels are in fragments, the transfer syntax says that they are not".to_owned())),
        // Each frame has at least the head of a fragment.
        _ => 8,
    };
    if count > MOST_FRAMES || (count as u128 * each > u128::from(held) && unread.is_none()) {
        return Err(fault(format!("{count} frames are claimed, {held} bytes follow, of at least {each} bytes each")));
    }
    if syntax.codec == Codec::Unread {
        unread = Some(format!(
            "{} ({}) cannot be read here: convert the file with a tool such as dcmdjpeg or gdcmconv",
            syntax.name, syntax.uid
        ));
    }
    if syntax.codec != Codec::Native && pixels.length.is_some() {
        unread = unread.or_else(|| Some(format!("the pixels are not in fragments, as those of {} are", syntax.name)));
    }
    let palette = match layout.photometric {
        Photometric::Palette if unread.is_none() => Some(Arc::new(header.palette().map_err(fault)?)),
        _ => None,
    };
    let whole_number = |tag: u32| header.number(tag).map(|n| n as i64);
    Ok(Found::Image(Box::new(Image {
        leaf: index,
        series: header.text(0x0020_000e),
        object: header.text(0x0008_0018),
        series_number: whole_number(0x0020_0011),
        instance: whole_number(0x0020_0013),
        modality: header.text(0x0008_0060).chars().filter(char::is_ascii_alphanumeric).take(16).collect(),
        description: header.text(0x0008_103e),
        layout,
        bits,
        planar: header.number(0x0028_0006) == Some(1.0) && layout.samples > 1,
        palette,
        held,
        padding: header.number(0x0028_0120).map(|n| n as i64 as u16),
        has_table: header.has_table,
        before,
        at: bytes.at,
        words: syntax.encoding.endian == Endian::Big && &pixels.vr == b"OW" && layout.kind() == VoxelType::U8,
        syntax,
        unread,
        frames: header.into_frames(count).map_err(fault)?,
        path: path.clone(),
    })))
}

/// How elements are written, judged by the first of them.
fn seen_encoding(head: &[u8]) -> Encoding {
    let explicit = head.get(4..6).is_some_and(|vr| vr.iter().all(u8::is_ascii_uppercase));
    // Groups are small numbers.
    let endian = if head.starts_with(&[0]) && head.get(1) != Some(&0) { Endian::Big } else { Endian::Little };
    Encoding { explicit, endian }
}
