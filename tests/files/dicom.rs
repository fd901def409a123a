//! Small DICOM files, made in memory by a writer that shares nothing with the reader.

use super::{Random, join};
use slicestack::volume::io::Endian;
use std::fmt::Write;

/// UIDs of transfer syntaxes.
pub(crate) const IMPLICIT: &str = "1.2.840.10008.1.2";
pub(crate) const EXPLICIT: &str = "1.2.840.10008.1.2.1";
pub(crate) const DEFLATED: &str = "1.2.840.10008.1.2.1.99";
pub(crate) const BIG: &str = "1.2.840.10008.1.2.2";
pub(crate) const RLE: &str = "1.2.840.10008.1.2.5";
pub(crate) const JPEG_LOSSLESS: &str = "1.2.840.10008.1.2.4.70";
pub(crate) const JPEG_BASELINE: &str = "1.2.840.10008.1.2.4.50";
pub(crate) const JPEG_LS: &str = "1.2.840.10008.1.2.4.80";

/// A value of an element.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    Text(&'static str, String),
    Words(&'static str, Vec<u16>),
    Doubles(Vec<f64>),
    Bytes(&'static str, Vec<u8>),
    /// A sequence of items; whether lengths are left undefined.
    Items(Vec<Set>, bool),
}

/// The elements of a data set, to be sorted by their tags.
#[derive(Clone, Debug, Default)]
pub(crate) struct Set(pub(crate) Vec<(u32, Value)>);

impl Set {
    /// The set with `tag` set anew.
    pub(crate) fn with(mut self, tag: u32, value: Value) -> Self {
        self.0.retain(|(t, _)| *t != tag);
        self.0.push((tag, value));
        self
    }

    pub(crate) fn without(mut self, tag: u32) -> Self {
        self.0.retain(|(t, _)| *t != tag);
        self
    }

    pub(crate) fn text(self, tag: u32, vr: &'static str, text: impl ToString) -> Self {
        self.with(tag, Value::Text(vr, text.to_string()))
    }

    pub(crate) fn numbers(self, tag: u32, numbers: &[f64]) -> Self {
        let text: Vec<String> = numbers.iter().map(f64::to_string).collect();
        self.text(tag, "DS", text.join("\\"))
    }

    pub(crate) fn word(self, tag: u32, word: u16) -> Self {
        self.with(tag, Value::Words("US", vec![word]))
    }

    fn bytes(&self, explicit: bool, endian: Endian) -> Vec<u8> {
        let mut sorted = self.0.clone();
        sorted.sort_by_key(|(tag, _)| *tag);
        sorted.iter().flat_map(|(tag, value)| element(*tag, value, explicit, endian)).collect()
    }
}

fn u16s(value: u16, endian: Endian) -> [u8; 2] {
    if endian == Endian::Big { value.to_be_bytes() } else { value.to_le_bytes() }
}

fn u32s(value: u32, endian: Endian) -> [u8; 4] {
    if endian == Endian::Big { value.to_be_bytes() } else { value.to_le_bytes() }
}

fn tag_bytes(tag: u32, endian: Endian) -> Vec<u8> {
    [u16s((tag >> 16) as u16, endian), u16s(tag as u16, endian)].concat()
}

pub(crate) fn element(tag: u32, value: &Value, explicit: bool, endian: Endian) -> Vec<u8> {
    let (vr, bytes, undefined) = match value {
        Value::Text(vr, text) => {
            let mut bytes = text.clone().into_bytes();
            if bytes.len() % 2 == 1 {
                bytes.push(if *vr == "UI" { 0 } else { b' ' });
            }
            (*vr, bytes, false)
        }
        Value::Words(vr, words) => (*vr, words.iter().flat_map(|&w| u16s(w, endian)).collect(), false),
        Value::Doubles(numbers) => {
            let one = |n: &f64| if endian == Endian::Big { n.to_be_bytes() } else { n.to_le_bytes() };
            ("FD", numbers.iter().flat_map(one).collect(), false)
        }
        Value::Bytes(vr, bytes) => {
            let mut bytes = bytes.clone();
            bytes.resize(bytes.len().next_multiple_of(2), 0);
            (*vr, bytes, false)
        }
        Value::Items(items, undefined) => {
            let mut bytes = Vec::new();
            for item in items {
                let inner = item.bytes(explicit, endian);
                bytes.extend(tag_bytes(0xfffe_e000, endian));
                bytes.extend(u32s(if *undefined { u32::MAX } else { inner.len() as u32 }, endian));
                bytes.extend(inner);
                if *undefined {
                    bytes.extend(tag_bytes(0xfffe_e00d, endian));
                    bytes.extend([0; 4]);
                }
            }
            if *undefined {
                bytes.extend(tag_bytes(0xfffe_e0dd, endian));
                bytes.extend([0; 4]);
            }
            ("SQ", bytes, *undefined)
        }
    };
    let length = if undefined { u32::MAX } else { bytes.len() as u32 };
    let mut out = tag_bytes(tag, endian);
    if !explicit {
        out.extend(u32s(length, endian));
    } else if ["OB", "OW", "OF", "SQ", "UN", "UT"].contains(&vr) {
        out.extend(vr.bytes().chain([0, 0]));
        out.extend(u32s(length, endian));
    } else {
        out.extend(vr.bytes());
        out.extend(u16s(length as u16, endian));
    }
    out.extend(bytes);
    out
}

/// Pixels in fragments behind a list of where frames start, which may be left empty.
pub(crate) fn encapsulated(fragments: &[Vec<u8>], starts: &[u32]) -> Vec<u8> {
    let item = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(2), 0);
        join(&[&[0xfe, 0xff, 0, 0xe0], &(bytes.len() as u32).to_le_bytes(), &bytes])
    };
    let mut out = item(&starts.iter().flat_map(|s| s.to_le_bytes()).collect::<Vec<_>>());
    fragments.iter().for_each(|f| out.extend(item(f)));
    out.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
    out
}

/// A whole file of `set` in the transfer syntax `uid`, with a preamble and a group of its own before it. Pixels in fragments are given apart.
pub(crate) fn file(set: &Set, uid: &str, fragments: Option<&[u8]>) -> Vec<u8> {
    let meta = Set::default().with(0x0002_0001, Value::Bytes("OB", vec![0, 1])).text(0x0002_0010, "UI", uid);
    let meta = meta.bytes(true, Endian::Little);
    let (explicit, endian) = (uid != IMPLICIT, if uid == BIG { Endian::Big } else { Endian::Little });
    let mut body = set.bytes(explicit, endian);
    if let Some(fragments) = fragments {
        body.extend([0xe0, 0x7f, 0x10, 0, b'O', b'B', 0, 0, 0xff, 0xff, 0xff, 0xff]);
        body.extend(fragments);
    }
    if uid == DEFLATED {
        body = super::deflate(&body);
    }
    let length = element(0x0002_0000, &Value::Bytes("UL", (meta.len() as u32).to_le_bytes().to_vec()), true, Endian::Little);
    join(&[&[0; 128], b"DICM", &length, &meta, &body])
}

/// A slice of `columns` x `rows` pixels of 16 bits: series `series`, at `z` mm, of instance number `instance`. Things are in it that must be
/// passed over.
pub(crate) fn slice(columns: u16, rows: u16, series: &str, instance: i64, z: f64, pixels: &[u16]) -> Set {
    let inner = Set::default().text(0x0008_0100, "SH", "code").numbers(0x0020_0032, &[9.0, 9.0, 9.0]);
    Set::default()
        .with(0x0008_0000, Value::Bytes("UL", vec![4, 0, 0, 0]))
        .text(0x0008_0018, "UI", format!("1.2.3.{series}.{instance}"))
        .text(0x0008_0060, "CS", "CT")
        .text(0x0008_103e, "LO", "chest")
        .with(0x0008_1140, Value::Items(vec![inner.clone(), inner.clone()], true))
        .with(0x0009_1001, Value::Items(vec![inner], false))
        .text(0x0010_0010, "PN", "Somebody^Known")
        .text(0x0010_0020, "LO", "ID-4711")
        .numbers(0x0018_0050, &[1.5])
        .text(0x0020_000e, "UI", format!("1.2.3.{series}"))
        .text(0x0020_0013, "IS", instance)
        .numbers(0x0020_0032, &[-10.0, 20.0, z])
        .numbers(0x0020_0037, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
        .word(0x0028_0002, 1)
        .text(0x0028_0004, "CS", "MONOCHROME2")
        .word(0x0028_0010, rows)
        .word(0x0028_0011, columns)
        .numbers(0x0028_0030, &[0.75, 0.5])
        .word(0x0028_0100, 16)
        .word(0x0028_0101, 16)
        .word(0x0028_0102, 15)
        .word(0x0028_0103, 0)
        .numbers(0x0028_1052, &[-1000.0])
        .numbers(0x0028_1053, &[1.0])
        .with(0x7fe0_0010, Value::Words("OW", pixels.to_vec()))
}

/// `count` pixels that look random.
pub(crate) fn noise(count: usize, seed: u64) -> Vec<u16> {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    (0..count).map(|_| random.next() as u16).collect()
}

/// One frame in RLE: `bytes` of `planes` planes, in the order that the format wants.
pub(crate) fn rle(planes: &[Vec<u8>]) -> Vec<u8> {
    let mut segments = Vec::new();
    for plane in planes {
        let (mut out, mut at) = (Vec::new(), 0);
        while at < plane.len() {
            let run = plane[at..].iter().take(128).take_while(|&&b| b == plane[at]).count();
            if run >= 3 {
                out.extend([(1 - run as i32) as u8, plane[at]]);
                at += run;
            } else {
                let literal = (plane.len() - at).min(5);
                out.push(literal as u8 - 1);
                out.extend(&plane[at..at + literal]);
                at += literal;
            }
        }
        // A control byte that means nothing.
        out.push(0x80);
        out.resize(out.len().next_multiple_of(2), 0x80);
        segments.push(out);
    }
    let mut header = [0u32; 16];
    header[0] = planes.len() as u32;
    let mut at = 64;
    for (i, segment) in segments.iter().enumerate() {
        header[1 + i] = at;
        at += segment.len() as u32;
    }
    join(&[&header.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<_>>(), &segments.concat()])
}

/// One frame of 16 bits in lossless JPEG, first-order prediction: each difference takes a code of 5 bits for its size, then its bits.
pub(crate) fn jpeg_lossless(columns: u16, rows: u16, pixels: &[u16]) -> Vec<u8> {
    let mut out = vec![0xff, 0xd8, 0xff, 0xc3, 0, 11, 16];
    out.extend([rows.to_be_bytes(), columns.to_be_bytes()].concat());
    out.extend([1, 1, 0x11, 0]);
    // 17 codes of 5 bits: the sizes 0 to 16 in their order.
    out.extend([0xff, 0xc4, 0, 19 + 17, 0, 0, 0, 0, 0, 17, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    out.extend(0..17u8);
    out.extend([0xff, 0xda, 0, 8, 1, 1, 0, 1, 0, 0]);
    let mut bits = String::new();
    for (i, &pixel) in pixels.iter().enumerate() {
        let (x, y) = (i % usize::from(columns), i / usize::from(columns));
        let before = match (x, y) {
            (0, 0) => 1 << 15,
            (0, _) => pixels[i - usize::from(columns)],
            _ => pixels[i - 1],
        };
        let difference = i32::from(pixel.wrapping_sub(before) as i16);
        let size = if difference == -32768 { 16 } else { (32 - difference.unsigned_abs().leading_zeros()) as usize };
        write!(bits, "{size:05b}").unwrap();
        if (1..16).contains(&size) {
            let value = if difference < 0 { difference + (1 << size) - 1 } else { difference };
            write!(bits, "{value:0size$b}").unwrap();
        }
    }
    out.extend(stuffed(bits));
    out.extend([0xff, 0xd9]);
    out
}

/// Bits as bytes, filled up with ones; a zero follows each byte FF.
fn stuffed(mut bits: String) -> Vec<u8> {
    while bits.len() % 8 != 0 {
        bits.push('1');
    }
    let mut out = Vec::new();
    for at in (0..bits.len()).step_by(8) {
        let byte = u8::from_str_radix(&bits[at..at + 8], 2).unwrap();
        out.push(byte);
        if byte == 0xff {
            out.push(0);
        }
    }
    out
}

/// A tar archive of `entries`; a name that ends with `/` is a folder.
pub(crate) fn tar(entries: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut out = Vec::new();
    for (name, bytes) in entries {
        let mut block = vec![0; 512];
        block[..name.len()].copy_from_slice(name.as_bytes());
        block[124..135].copy_from_slice(format!("{:011o}", bytes.len()).as_bytes());
        block[156] = if name.ends_with('/') { b'5' } else { b'0' };
        block[257..265].copy_from_slice(b"ustar\x0000");
        out.extend(block);
        out.extend(bytes);
        out.resize(out.len().next_multiple_of(512), 0);
    }
    out.resize(out.len() + 1024, 0);
    out
}

/// A picture of blocks of 8 x 8 pixels, each of one value (`blocks` has one for each sample), in baseline JPEG: nothing but the mean of each
/// block is coded.
pub(crate) fn jpeg_blocks(columns: u16, rows: u16, blocks: &[Vec<u8>]) -> Vec<u8> {
    let samples = blocks[0].len() as u8;
    // Quantized by 8, the mean is coded as it is.
    let mut out = vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0];
    out.extend([8; 64]);
    out.extend([0xff, 0xc0, 0, 8 + 3 * samples, 8]);
    out.extend([rows.to_be_bytes(), columns.to_be_bytes()].concat());
    out.push(samples);
    (1..=samples).for_each(|i| out.extend([i, 0x11, 0]));
    out.extend([0xff, 0xc4, 0, 19 + 12, 0, 0, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    out.extend(0..12u8);
    // The end of a block is the one code of its table.
    out.extend([0xff, 0xc4, 0, 19 + 1, 0x10, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    out.extend([0xff, 0xda, 0, 6 + 2 * samples, samples]);
    (1..=samples).for_each(|i| out.extend([i, 0]));
    out.extend([0, 63, 0]);
    let mut bits = String::new();
    let mut before = vec![128i32; samples.into()];
    for block in blocks {
        for (mean, before) in block.iter().zip(&mut before) {
            let difference = i32::from(*mean) - *before;
            *before = (*mean).into();
            let size = (32 - difference.unsigned_abs().leading_zeros()) as usize;
            write!(bits, "{size:05b}").unwrap();
            if size > 0 {
                let value = if difference < 0 { difference + (1 << size) - 1 } else { difference };
                write!(bits, "{value:0size$b}").unwrap();
            }
            bits.push('0');
        }
    }
    out.extend(stuffed(bits));
    out.extend([0xff, 0xd9]);
    out
}
