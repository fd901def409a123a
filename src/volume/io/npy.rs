//! NumPy arrays, `.npy` versions 1 to 3: a Python dictionary in text, then the numbers.
//!
//! Source of the format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>. The axes are (z, y, x);
//! further axes of size 1 are dropped, two axes are one slice, a fourth one in front is of frames, and 3 or 4 numbers behind are those of a voxel: a colour, or a vector. An uncompressed file may be longer than its header says, as in
//! NumPy. Of the dictionary only three keys matter, all of a simple form: a scanner finds them without a parser of Python.

use super::field::{named, shown};
use super::layout::{Encoding, Layout};
use super::reader::{Certainty, Reader};
use super::reading::{Item, Part, Reading};
use super::source::{Source, Tail, scatter_z_fastest};
use super::store::Store;
use super::{Endian, Stored};
use crate::Result;
use crate::volume::{Grid, Volume, Voxel, VoxelType, Voxels, with_voxels};
use std::path::Path;

pub(super) const READER: Reader = Reader {
    name: "NumPy",
    extensions: &["npy"],
    reads: "(z, y, x), (frame, z, y, x), (z, y, x, colour), (z, y, x, vector); C and Fortran order, both byte orders",
    parts: &[Part::Frame, Part::Channel],
    probe: |clues| if clues.has(0, MAGIC) { Certainty::Magic } else { Certainty::No },
    read,
    list: Some(list),
};

const MAGIC: &[u8] = b"\x93NUMPY";

/// Most dimensions, as NumPy has it.
const MOST_DIMENSIONS: usize = 64;

/// What the header says.
pub(super) struct Header {
    /// Sizes of the axes, in the file's order.
    pub(super) shape: Vec<usize>,
    /// Bytes of the header.
    pub(super) length: u64,
    fortran: bool,
    stored: Stored,
    endian: Endian,
}

impl Header {
    /// Reads the header at the start of `source`.
    pub(super) fn read(source: &mut Source) -> Result<Self> {
        let start = source.header(8, "the NumPy header")?;
        if !start.starts_with(MAGIC) {
            return Err(source.fault(format!("no NumPy array: it starts with {}", shown(&String::from_utf8_lossy(&start)))));
        }
        let (width, length) = match start[6] {
            1 => (2, u64::from(Endian::Little.u16(&source.header(2, "the NumPy header")?))),
            2 | 3 => (4, u64::from(Endian::Little.u32(&source.header(4, "the NumPy header")?))),
            version => return Err(source.fault(format!("NumPy format version {version}: only 1, 2 and 3 are known"))),
        };
        let claimed = usize::try_from(length).unwrap_or(usize::MAX);
        let text = String::from_utf8_lossy(&source.header(claimed, "the NumPy header")?).into_owned();
        let value = |key| value_of(&text, key).ok_or_else(|| source.fault(format!("the NumPy header {} has no {key}", shown(&text))));
        let (stored, endian) = descr(source, value("'descr'")?)?;
        let fortran = match word(value("'fortran_order'")?) {
            "True" => true,
            "False" => false,
            other => return Err(source.fault(format!("fortran_order is {}, neither True nor False", shown(other)))),
        };
        let shape = shape(source, value("'shape'")?)?;
        Ok(Self { shape, length: 8 + width + length, fortran, stored, endian })
    }

    /// Type of the numbers.
    pub(super) fn stored(&self) -> Stored {
        self.stored
    }

    /// Bytes of the numbers; saturates.
    pub(super) fn data_bytes(&self) -> u64 {
        self.shape.iter().fold(self.stored.bytes() as u64, |a, &n| a.saturating_mul(n as u64))
    }

    /// The axes: x, y and z; before them 3 or 4 numbers a voxel; behind them frames. Integers without a sign of 8 and 16 bits are a colour, and so are 4
    /// floats; 3 floats may be a vector as well, so their first is taken. 2 numbers a voxel there are where a channel or their magnitude is asked for; and
    /// three axes of numbers that are no bytes are frames where one is asked for. `None` when the array is no volume.
    pub(super) fn layout(&self, path: &Path, reading: &Reading) -> Option<Layout> {
        let mut sizes = self.shape.clone();
        let is = |kind: VoxelType| self.stored == Stored::from(kind);
        let (bytes, choice) = (is(VoxelType::U8), &reading.choice);
        let asked = choice.channel.is_some() || choice.magnitude;
        // A fourth axis of bytes is never one of frames of volumes that thin, of other numbers where it is not asked for.
        let inner = |&n: &usize| match sizes.len() {
            _ if self.fortran => false,
            0..4 => false,
            4 if !bytes => choice.frame.is_none() && (matches!(n, 3 | 4) || asked && n == 2),
            _ => bytes && matches!(n, 3 | 4),
        };
        let numbers = sizes.last().copied().filter(inner);
        let color = numbers.is_some_and(|n| bytes || is(VoxelType::U16) || is(VoxelType::F32) && n == 4);
        if numbers.is_some() {
            sizes.pop();
        }
        while sizes.len() > 3 {
            let Some(single) = sizes.iter().position(|&n| n == 1) else { break };
            sizes.remove(single);
        }
        let (frames, dims) = match sizes[..] {
            [z, y, x] => (1, [x, y, z]),
            [y, x] => (1, [x, y, 1]),
            [t, z, y, x] if !self.fortran => (t, [x, y, z]),
            _ => return None,
        };
        Some(Layout::of_space(path, dims).inner(Part::Channel, numbers.unwrap_or(1), color).outer(Part::Frame, frames))
    }

    /// What is wrong with an array that has no [`Header::layout`].
    pub(super) fn no_volume(&self) -> String {
        if self.fortran && self.shape.len() == 4 {
            return format!("an array of 4 dimensions {:?} in Fortran order: frames are read in C order alone", self.shape);
        }
        let axis = if self.shape.len() > 3 { format!(", axis 0 has size {}", self.shape[0]) } else { String::new() };
        format!("an array of {} dimensions {:?}{axis}: 3 are needed (z, y, x), or 4 (frame, z, y, x)", self.shape.len(), self.shape)
    }

    /// Reads the numbers that follow the header.
    pub(super) fn volume(&self, source: &mut Source, reading: &Reading) -> Result<Volume> {
        let layout = self.layout(source.path(), reading).ok_or_else(|| source.fault(self.no_volume()))?;
        let dims = layout.dims;
        let grid = named(source.path(), Grid::with_spacing(dims, [1.0; 3]))?;
        if !self.fortran {
            return layout.volume(source, (self.stored, Encoding::Binary(self.endian)), Tail::Ignored, grid, reading);
        }
        layout.check(reading)?;
        let voxels = match self.stored {
            Stored::Native(kind) => {
                let voxels = scatter_z_fastest(source, dims, kind, self.endian)?;
                source.check_tail(self.data_bytes(), Tail::Ignored)?;
                voxels
            }
            _ => {
                // Numbers that are kept in another type are read as they come, then put in their order.
                let [x, y, z] = dims;
                let turned = source.voxels([z, y, x], self.stored, self.endian, Tail::Ignored)?;
                with_voxels!(&turned, v => turn(v, dims))
            }
        };
        named(source.path(), Volume::new(grid, voxels))
    }
}

/// Numbers with z fastest, put in the order with x fastest.
fn turn<T: Voxel>(values: &[T], [nx, ny, nz]: [usize; 3]) -> Voxels {
    let mut out = Vec::with_capacity(values.len());
    for z in 0..nz {
        for y in 0..ny {
            out.extend((0..nx).map(|x| values[(x * ny + y) * nz + z]));
        }
    }
    T::wrap(out.into())
}

/// The text after `key:`.
fn value_of<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    // NumPy writes the keys in single quotes; the format allows any Python literal.
    let at = text.find(key).or_else(|| text.find(&key.replace('\'', "\"")))?;
    text[at + key.len()..].trim_start().strip_prefix(':').map(str::trim_start)
}

/// The letters at the start of `text`.
fn word(text: &str) -> &str {
    text.split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default()
}

fn descr(source: &Source, text: &str) -> Result<(Stored, Endian)> {
    use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
    let quoted = text.strip_prefix(['\'', '"']).and_then(|t| t.split(['\'', '"']).next());
    let Some(quoted) = quoted else {
        return Err(source.fault(format!("descr is {}: arrays of records are not supported", shown(text))));
    };
    let (endian, code) = match quoted.split_at_checked(1) {
        Some((">", code)) => (Endian::Big, code),
        Some(("<", code)) => (Endian::Little, code),
        Some(("|" | "=", code)) => (Endian::NATIVE, code),
        _ => (Endian::NATIVE, quoted),
    };
    let stored = match code {
        // A bool is one byte, 0 or 1.
        "u1" | "b1" | "?" => U8.into(),
        "i1" => I8.into(),
        "u2" => U16.into(),
        "i2" => I16.into(),
        "u4" => U32.into(),
        "i4" => I32.into(),
        "u8" => Stored::U64,
        "i8" => Stored::I64,
        "f2" => Stored::F16,
        "c8" => Stored::Complex64,
        "c16" => Stored::Complex128,
        "f4" => F32.into(),
        "f8" => F64.into(),
        _ => return Err(source.fault(format!("descr is {}: numbers of this type are not supported", shown(quoted)))),
    };
    Ok((stored, endian))
}

fn shape(source: &Source, text: &str) -> Result<Vec<usize>> {
    let tuple = text.find(')').map_or(text.trim_end(), |end| &text[..=end]);
    let fault = |what: &str| source.fault(format!("shape is {}: {what}", shown(tuple)));
    let inside = text.strip_prefix('(').and_then(|t| t.split_once(')')).ok_or_else(|| fault("not a tuple of sizes"))?.0;
    // A tuple of one ends with a comma; Python 2 wrote an L behind long integers.
    let words = inside.split(',').map(|w| w.trim().trim_end_matches('L')).filter(|w| !w.is_empty());
    if words.clone().nth(MOST_DIMENSIONS).is_some() {
        return Err(fault(&format!("more than {MOST_DIMENSIONS} dimensions")));
    }
    words
        .map(|w| match w.parse::<usize>() {
            Ok(0) => Err(fault("every size must be at least 1")),
            Ok(n) => Ok(n),
            Err(_) => Err(fault(&format!("{} is no size", shown(w)))),
        })
        .collect()
}

fn list(store: Store, reading: &Reading) -> Result<Vec<Item>> {
    let mut source = store.source()?;
    let header = Header::read(&mut source)?;
    header.layout(source.path(), reading).ok_or_else(|| source.fault(header.no_volume()))?.list(reading)
}

fn read(store: Store, reading: &Reading) -> Result<Volume> {
    let mut source = store.source()?;
    Header::read(&mut source)?.volume(&mut source, reading)
}
