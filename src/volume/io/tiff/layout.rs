//! What one directory says of its page: size, type of the numbers, and how they are cut and packed.

use super::bytes::Bytes;
use super::entry::{Entry, Table};
use crate::Result;
use crate::volume::VoxelType;
use crate::volume::io::slices::{Alpha, Color, Pixels};
use crate::volume::io::stored::Stored;

/// Codes of the tags that are read (TIFF 6.0, appendix A).
mod tag {
    pub(super) const SUBFILE: u16 = 254;
    pub(super) const WIDTH: u16 = 256;
    pub(super) const HEIGHT: u16 = 257;
    pub(super) const BITS: u16 = 258;
    pub(super) const COMPRESSION: u16 = 259;
    pub(super) const PHOTOMETRIC: u16 = 262;
    pub(super) const FILL_ORDER: u16 = 266;
    pub(super) const SAMPLES: u16 = 277;
    pub(super) const ROWS: u16 = 278;
    pub(super) const PLANAR: u16 = 284;
    pub(super) const PREDICTOR: u16 = 317;
    pub(super) const COLOR_MAP: u16 = 320;
    pub(super) const TILE_WIDTH: u16 = 322;
    pub(super) const TILE_HEIGHT: u16 = 323;
    pub(super) const EXTRA: u16 = 338;
    pub(super) const FORMAT: u16 = 339;
}

/// One page of a file.
pub(super) struct Page {
    /// Which of the file's layouts it has.
    pub(super) layout: usize,
    /// Whether it is a smaller version of another page or a mask for one.
    pub(super) left_out: bool,
    pub(super) offsets: Table,
    pub(super) lengths: Option<Table>,
}

/// What a directory says of its page, in the codes of the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Numbers of a pixel.
    pub(super) samples: usize,
    /// Bits of a number.
    pub(super) bits: usize,
    format: u64,
    photometric: u64,
    pub(super) compression: u64,
    pub(super) predictor: u64,
    fill_order: u64,
    /// Whether each number of a pixel has strips or tiles of its own.
    pub(super) planar: bool,
    /// What the first number beyond the colour is.
    extra: Option<u64>,
    /// Width and height of a strip or tile.
    pub(super) chunk: [usize; 2],
    pub(super) tiled: bool,
    pub(super) color_map: Option<Entry>,
}

/// Numbers of a pixel whose bits and formats are compared.
const ALIKE: u64 = 64;

/// Values of PhotometricInterpretation.
const WHITE_IS_ZERO: u64 = 0;
const BLACK_IS_ZERO: u64 = 1;
const RGB: u64 = 2;
const PALETTE: u64 = 3;

impl Layout {
    /// The layout that `entries` tell, and whether the page is one to leave out.
    ///
    /// # Errors
    /// When something is missing or cannot be.
    pub(super) fn read(bytes: &mut Bytes, entries: &[Entry], page: usize) -> Result<(Self, bool)> {
        let find = |tag: u16| entries.iter().find(|e| e.tag == tag).copied();
        let fault = |bytes: &Bytes, what: String| bytes.places.fault(format!("page {page}: {what}"));
        let mut one = |tag: u16, otherwise: Option<u64>| -> Result<u64> {
            let value = match find(tag) {
                Some(entry) => entry.first(1).integers(bytes)?.first().copied(),
                None => otherwise,
            };
            value.ok_or_else(|| fault(bytes, format!("tag {tag} is missing or has no value")))
        };
        let (width, height) = (one(tag::WIDTH, None)?, one(tag::HEIGHT, None)?);
        let samples = one(tag::SAMPLES, Some(1))?;
        let compression = one(tag::COMPRESSION, Some(1))?;
        let photometric = one(tag::PHOTOMETRIC, Some(BLACK_IS_ZERO))?;
        let predictor = one(tag::PREDICTOR, Some(1))?;
        let fill_order = one(tag::FILL_ORDER, Some(1))?;
        let planar = one(tag::PLANAR, Some(1))? == 2;
        let subfile = one(tag::SUBFILE, Some(0))?;
        let tiled = find(tag::TILE_WIDTH).is_some();
        let chunk = if tiled {
            [one(tag::TILE_WIDTH, None)?, one(tag::TILE_HEIGHT, None)?]
        } else {
            [width, one(tag::ROWS, Some(height))?.min(height)]
        };
        for (what, number) in
            [("width", width), ("height", height), ("samples", samples), ("rows of a strip", chunk[1]), ("tile", chunk[0])]
        {
            if number == 0 || number > u64::from(u32::MAX) {
                return Err(fault(bytes, format!("{what} of {number}: it must be 1 to {}", u32::MAX)));
            }
        }
        let alike = |bytes: &mut Bytes, entry: Option<Entry>, otherwise: u64| -> Result<u64> {
            let all = entry.map_or(Ok(vec![otherwise]), |e| e.first(ALIKE).integers(bytes))?;
            let Some(&first) = all.first() else { return Ok(otherwise) };
            match all.iter().find(|&&n| n != first) {
                Some(other) => Err(fault(bytes, format!("numbers of {first} and {other} (bits or formats): they must be alike"))),
                None => Ok(first),
            }
        };
        let bits = alike(bytes, find(tag::BITS), 1)?;
        let format = alike(bytes, find(tag::FORMAT), 1)?;
        let extra = match find(tag::EXTRA) {
            Some(entry) => entry.first(1).integers(bytes)?.first().copied(),
            None => None,
        };
        let layout = Self {
            width: width as usize,
            height: height as usize,
            samples: samples as usize,
            bits: bits.min(1 << 16) as usize,
            format,
            photometric,
            compression,
            predictor,
            fill_order,
            planar: planar && samples > 1,
            extra,
            chunk: chunk.map(|n| n as usize),
            tiled,
            color_map: if photometric == PALETTE { find(tag::COLOR_MAP) } else { None },
        };
        // Bit 0: a smaller version of another page; bit 2: a mask.
        Ok((layout, subfile & 5 != 0))
    }

    /// Type of the numbers as they are kept; an error says which are not read.
    fn stored(&self) -> Result<Stored, String> {
        use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
        Ok(match (self.format, self.bits) {
            (1 | 4, 1..=8) => U8.into(),
            (1 | 4, 9..=16) => U16.into(),
            (1 | 4, 32) => U32.into(),
            (1 | 4, 64) => Stored::U64,
            (2, 8) => I8.into(),
            (2, 16) => I16.into(),
            (2, 32) => I32.into(),
            (2, 64) => Stored::I64,
            (3, 16) => Stored::F16,
            (3, 32) => F32.into(),
            (3, 64) => F64.into(),
            (6, 64) => Stored::Complex64,
            (6, 128) => Stored::Complex128,
            (format, bits) => {
                let name = match format {
                    1 | 4 => "integers",
                    2 => "signed integers",
                    3 => "floats",
                    5 => "complex integers",
                    6 => "complex floats",
                    _ => return Err(format!("SampleFormat is {format}: it is none of TIFF")),
                };
                return Err(format!("{name} of {bits} bits are not supported"));
            }
        })
    }

    /// What its pixels are once read, or what is not supported.
    pub(super) fn pixels(&self) -> Result<Pixels, String> {
        let unsupported = |what: &str| Err(format!("{what}: not supported"));
        match self.compression {
            1 | 5 | 8 | 32773 | 32946 => {}
            code => {
                let name = match code {
                    2..=4 => "of fax machines",
                    6 | 7 => "JPEG",
                    33003..=33005 | 34712 => "JPEG 2000",
                    34661 => "JBIG",
                    34887 => "LERC",
                    34925 => "LZMA",
                    50000 => "Zstandard",
                    50001 => "WebP",
                    50002 => "JPEG XL",
                    _ => "unknown",
                };
                return unsupported(&format!("Compression is {code} ({name})"));
            }
        }
        let mut stored = self.stored()?;
        match (self.predictor, self.format) {
            (1, _) => {}
            (2, 1..=3) if matches!(self.bits, 8 | 16 | 32 | 64) => {}
            (3, 3) => {}
            (code, format) => return Err(format!("Predictor is {code} for {} bits of SampleFormat {format}: not supported", self.bits)),
        }
        if self.fill_order != 1 {
            return unsupported(&format!("FillOrder is {}", self.fill_order));
        }
        let (mut samples, mut color) = (self.samples, Color::Grey);
        match self.photometric {
            WHITE_IS_ZERO | BLACK_IS_ZERO => {
                if samples == 2 && matches!(self.extra, Some(1 | 2)) {
                    color = Color::GreyAlpha;
                }
            }
            RGB if samples < 3 => return Err(format!("RGB of {samples} numbers a pixel: 3 are needed")),
            RGB => {
                // Without a tag a fourth number is alpha for most writers.
                let alpha = match (samples, self.extra) {
                    (3, _) | (_, Some(0)) => Alpha::None,
                    (_, Some(1)) => Alpha::Premultiplied,
                    _ => Alpha::Straight,
                };
                color = Color::Rgb(alpha);
            }
            PALETTE => {
                if samples != 1 || !matches!(stored, Stored::Native(VoxelType::U8 | VoxelType::U16)) || self.color_map.is_none() {
                    return Err(format!("a palette for {samples} numbers of {} bits: not supported", self.bits));
                }
                (samples, color, stored) = (3, Color::Rgb(Alpha::None), VoxelType::U8.into());
            }
            code => {
                let name = match code {
                    4 => "a mask",
                    5 => "CMYK",
                    6 => "YCbCr",
                    8..=10 => "CIE L*a*b*",
                    32803 => "a camera's colour filters",
                    _ => "unknown",
                };
                return unsupported(&format!("PhotometricInterpretation is {code} ({name})"));
            }
        }
        Ok(Pixels { width: self.width, height: self.height, stored, samples, color })
    }

    /// Whether the numbers lie in the file as they are kept, but for their byte order.
    pub(super) fn is_plain(&self) -> bool {
        let whole = matches!(self.bits, 8 | 16 | 32 | 64 | 128);
        whole && self.compression == 1 && self.predictor == 1 && !self.planar && !self.is_inverted()
    }

    /// Whether a number is a real and an imaginary part.
    pub(super) fn is_complex(&self) -> bool {
        self.format == 6
    }

    /// Whether the numbers are turned around when they are read, so that the largest is the brightest.
    pub(super) fn is_inverted(&self) -> bool {
        self.photometric == WHITE_IS_ZERO && matches!(self.format, 1 | 4)
    }

    /// Whether the numbers are colours of so few bits that they are stretched to those of their type, where its largest number stands for 1.
    pub(super) fn is_stretched(&self) -> bool {
        self.photometric == RGB && !matches!(self.bits, 8 | 16 | 32 | 64)
    }

    /// What is to be told of how the numbers are read, where a palette is applied if `expand` says so.
    pub(super) fn notes(&self, expand: bool) -> Vec<String> {
        let mut notes = Vec::new();
        if self.is_inverted() {
            notes.push("White is stored as 0: numbers were turned around, so that the largest is the brightest.".to_owned());
        }
        if self.is_stretched() {
            let wide = if self.bits > 8 { 16 } else { 8 };
            notes.push(format!("Colours of {} bits were stretched to {wide} bits.", self.bits));
        }
        if self.color_map.is_some() && !expand {
            notes.push("The palette is one for display: numbers were taken as they are stored.".to_owned());
        }
        notes
    }

    /// Most bytes of numbers that `packed` bytes of the file can hold.
    pub(super) fn most(&self, packed: u64) -> u64 {
        let ratio = match self.compression {
            1 => 1,
            // A pair of bytes stands for 128 at most.
            32773 => 64,
            // A code of 12 bits stands for 4096 bytes at most.
            5 => 4096,
            _ => return crate::volume::io::source::inflated_bound(packed),
        };
        packed.saturating_mul(ratio)
    }
}
