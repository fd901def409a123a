//! TIFF files of every kind, made in memory: both byte orders, BigTIFF, strips and tiles, packed or not.

use super::{Sample, zlib};
use slicestack::volume::VoxelType;
use slicestack::volume::io::Endian;
use std::collections::HashMap;

/// What is written. Pages are the slices of a sample, `samples` numbers a pixel.
#[derive(Clone)]
pub(crate) struct Tiff {
    pub(crate) endian: Endian,
    pub(crate) big: bool,
    /// 1 as they are, 5 LZW, 8 deflate, 32773 PackBits.
    pub(crate) compression: u64,
    /// 1 none, 2 differences, 3 for floats.
    pub(crate) predictor: u64,
    pub(crate) photometric: u64,
    pub(crate) samples: usize,
    pub(crate) planar: bool,
    pub(crate) tile: Option<[usize; 2]>,
    pub(crate) rows: usize,
    pub(crate) description: String,
    /// Pixels per unit.
    pub(crate) resolution: Option<[u32; 2]>,
    /// Further entries with numbers of 16 bits, in every page.
    pub(crate) more: Vec<(u16, Vec<u16>)>,
    /// Whether there is one directory only, that of the first page.
    pub(crate) alone: bool,
    /// SampleFormat and bits, where they are not those of the sample.
    pub(crate) kind: Option<(u64, usize)>,
}

impl Tiff {
    pub(crate) fn new() -> Self {
        Self {
            endian: Endian::Little,
            big: false,
            compression: 1,
            predictor: 1,
            photometric: 1,
            samples: 1,
            planar: false,
            tile: None,
            rows: 3,
            description: String::new(),
            resolution: None,
            more: Vec::new(),
            alone: false,
            kind: None,
        }
    }

    fn number(&self, value: u64, size: usize) -> Vec<u8> {
        let mut bytes = value.to_le_bytes()[..size].to_vec();
        if self.endian == Endian::Big {
            bytes.reverse();
        }
        bytes
    }

    fn value(&self, bytes: &[u8]) -> u64 {
        let fold = |n: u64, b: &u8| n << 8 | u64::from(*b);
        if self.endian == Endian::Big { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) }
    }

    /// The file of `sample`, whose x dimension counts numbers: `samples` a pixel.
    pub(crate) fn file(&self, sample: &Sample) -> Vec<u8> {
        let size = sample.kind().bytes();
        let [x, y, z] = sample.dims;
        let slice = x * y * size;
        let bytes = sample.bytes(self.endian);
        let pages: Vec<&[u8]> = (0..z).map(|k| &bytes[k * slice..(k + 1) * slice]).collect();
        let format = match sample.kind() {
            VoxelType::U8 | VoxelType::U16 | VoxelType::U32 => 1,
            VoxelType::I8 | VoxelType::I16 | VoxelType::I32 => 2,
            VoxelType::F32 | VoxelType::F64 => 3,
        };
        let (format, bits) = self.kind.unwrap_or((format, 8 * size));
        self.pages(&pages, [x / self.samples, y], size, (format, bits))
    }

    /// The file of `pages`, each of numbers of `size` bytes.
    pub(crate) fn pages(&self, pages: &[&[u8]], [width, height]: [usize; 2], size: usize, (format, bits): (u64, usize)) -> Vec<u8> {
        let word = if self.big { 8 } else { 4 };
        let mut out = if self.endian == Endian::Big { b"MM".to_vec() } else { b"II".to_vec() };
        out.extend(self.number(if self.big { 43 } else { 42 }, 2));
        if self.big {
            out.extend(self.number(8, 2));
            out.extend(self.number(0, 2));
        }
        let mut link = out.len();
        out.extend(vec![0; word]);
        // Voxels first and behind each other, then the directories.
        let places: Vec<(Vec<u64>, Vec<u64>)> = pages.iter().map(|page| self.chunks(&mut out, page, [width, height], size)).collect();
        for (offsets, lengths) in places.iter().take(if self.alone { 1 } else { places.len() }) {
            let mut entries: Vec<(u16, u16, Vec<u8>, usize)> = Vec::new();
            let mut put = |tag: u16, kind: u16, values: &[u64]| {
                let size = match kind {
                    3 => 2,
                    4 => 4,
                    _ => 8,
                };
                entries.push((tag, kind, values.iter().flat_map(|&v| self.number(v, size)).collect(), values.len()));
            };
            let table = if self.big { 16 } else { 4 };
            put(256, 4, &[width as u64]);
            put(257, 3, &[height as u64]);
            put(258, 3, &vec![bits as u64; self.samples]);
            put(259, 3, &[self.compression]);
            put(262, 3, &[self.photometric]);
            put(277, 3, &[self.samples as u64]);
            put(284, 3, &[if self.planar { 2 } else { 1 }]);
            put(317, 3, &[self.predictor]);
            put(339, 3, &vec![format; self.samples]);
            match self.tile {
                Some([x, y]) => {
                    put(322, 3, &[x as u64]);
                    put(323, 4, &[y as u64]);
                    put(324, table, offsets);
                    put(325, table, lengths);
                }
                None => {
                    put(278, 4, &[self.rows as u64]);
                    put(273, table, offsets);
                    put(279, table, lengths);
                }
            }
            for (tag, values) in &self.more {
                put(*tag, 3, &values.iter().map(|&v| v.into()).collect::<Vec<u64>>());
            }
            if let Some([x, y]) = self.resolution {
                for (tag, n) in [(282, x), (283, y)] {
                    entries.push((tag, 5, [self.number(n.into(), 4), self.number(1, 4)].concat(), 1));
                }
            }
            if !self.description.is_empty() {
                let text = [self.description.as_bytes(), &[0]].concat();
                entries.push((270, 2, text.clone(), text.len()));
            }
            entries.sort_by_key(|e| e.0);
            let mut directory = self.number(entries.len() as u64, if self.big { 8 } else { 2 });
            for (tag, kind, values, count) in entries {
                directory.extend(self.number(tag.into(), 2));
                directory.extend(self.number(kind.into(), 2));
                directory.extend(self.number(count as u64, word));
                if values.len() <= word {
                    directory.extend(&values);
                    directory.extend(vec![0; word - values.len()]);
                } else {
                    directory.extend(self.number(out.len() as u64, word));
                    out.extend(values);
                }
            }
            let at = self.number(out.len() as u64, word);
            out[link..link + word].copy_from_slice(&at);
            link = out.len() + directory.len();
            out.extend(directory);
            out.extend(vec![0; word]);
        }
        out
    }

    /// Appends the strips or tiles of one page and tells where they are.
    fn chunks(&self, out: &mut Vec<u8>, page: &[u8], [width, height]: [usize; 2], size: usize) -> (Vec<u64>, Vec<u64>) {
        let (planes, together) = if self.planar { (self.samples, 1) } else { (1, self.samples) };
        let [cx, cy] = self.tile.unwrap_or([width, self.rows]);
        let (mut offsets, mut lengths) = (Vec::new(), Vec::new());
        for plane in 0..planes {
            for top in (0..height).step_by(cy) {
                for left in (0..width).step_by(cx) {
                    let rows = if self.tile.is_some() { cy } else { cy.min(height - top) };
                    let mut chunk = Vec::new();
                    for y in top..top + rows {
                        let mut row = Vec::new();
                        for x in left..left + cx {
                            let at = ((y * width + x) * self.samples + plane) * size;
                            let pixel =
                                if x < width && y < height { page[at..at + together * size].to_vec() } else { vec![7; together * size] };
                            row.extend(pixel);
                        }
                        chunk.extend(self.predicted(&row, size, together));
                    }
                    let packed = match self.compression {
                        5 => lzw(&chunk),
                        8 => zlib(&chunk),
                        32773 => pack_bits(&chunk),
                        _ => chunk,
                    };
                    offsets.push(out.len() as u64);
                    lengths.push(packed.len() as u64);
                    out.extend(packed);
                }
            }
        }
        (offsets, lengths)
    }

    fn predicted(&self, row: &[u8], size: usize, together: usize) -> Vec<u8> {
        match self.predictor {
            2 => {
                let numbers: Vec<u64> = row.chunks(size).map(|b| self.value(b)).collect();
                let before = |i: usize| if i < together { 0 } else { numbers[i - together] };
                (0..numbers.len()).flat_map(|i| self.number(numbers[i].wrapping_sub(before(i)), size)).collect()
            }
            3 => {
                let numbers: Vec<u64> = row.chunks(size).map(|b| self.value(b)).collect();
                let bytes: Vec<u8> = (0..size).rev().flat_map(|k| numbers.iter().map(move |n| (n >> (8 * k)) as u8)).collect();
                (0..bytes.len()).map(|i| if i < together { bytes[i] } else { bytes[i].wrapping_sub(bytes[i - together]) }).collect()
            }
            _ => row.to_vec(),
        }
    }
}

/// Runs of a byte, and all else as it is.
fn pack_bits(bytes: &[u8]) -> Vec<u8> {
    let mut out = vec![128];
    let mut rest = bytes;
    while let Some(&first) = rest.first() {
        let run = rest.iter().take(128).take_while(|&&b| b == first).count();
        if run > 1 {
            out.extend([(257 - run) as u8, first]);
            rest = &rest[run..];
        } else {
            let count = rest.windows(2).take(127).take_while(|w| w[0] != w[1]).count().max(1);
            out.push((count - 1) as u8);
            out.extend(&rest[..count]);
            rest = &rest[count..];
        }
    }
    out
}

/// Codes of 9 to 12 bits, most significant bit first, each one wider a code early.
fn lzw(bytes: &[u8]) -> Vec<u8> {
    let (mut out, mut held, mut bits) = (Vec::new(), 0u64, 0);
    let mut emit = |code: usize, width: usize| {
        held = held << width | code as u64;
        bits += width;
        while bits >= 8 {
            bits -= 8;
            out.push((held >> bits) as u8);
        }
        held &= (1 << bits) - 1;
    };
    let mut table: HashMap<(usize, u8), usize> = HashMap::new();
    let (mut next, mut width) = (258, 9);
    emit(256, width);
    let mut current: Option<usize> = None;
    for &byte in bytes {
        let Some(code) = current else {
            current = Some(byte.into());
            continue;
        };
        if let Some(&longer) = table.get(&(code, byte)) {
            current = Some(longer);
            continue;
        }
        emit(code, width);
        table.insert((code, byte), next);
        next += 1;
        if next == 4094 {
            emit(256, width);
            table.clear();
            (next, width) = (258, 9);
        } else if next == 1 << width {
            width += 1;
        }
        current = Some(byte.into());
    }
    emit(current.unwrap_or(256), width);
    if next + 1 == 1 << width {
        width += 1;
    }
    emit(257, width);
    emit(0, 7);
    out
}
