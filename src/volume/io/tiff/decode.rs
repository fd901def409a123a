//! One page of a file to numbers: its strips or tiles, unpacked and put into place.

use super::bytes::Bytes;
use super::codec;
use super::directory::Tiff;
use super::entry::Table;
use super::layout::Layout;
use crate::volume::io::slices::Pixels;
use crate::{Error, Result};

/// Most bytes of an unpacked tile, unless the whole page is larger.
const LARGEST_TILE: usize = 64 << 20;

/// Strips or tiles of a page.
pub(super) struct Chunks {
    pub(super) offsets: Vec<u64>,
    pub(super) lengths: Vec<u64>,
}

/// Colours of a palette: red, green and blue.
pub(super) type Palette = Vec<[u8; 3]>;

impl Layout {
    /// Numbers a pixel within one chunk.
    fn together(&self) -> usize {
        if self.planar { 1 } else { self.samples }
    }

    /// Chunks of a page along x, along y, and one behind the other for numbers of a pixel that are kept apart.
    fn counts(&self) -> [usize; 3] {
        let [x, y] = self.chunk;
        [self.width.div_ceil(x), self.height.div_ceil(y), if self.planar { self.samples } else { 1 }]
    }

    /// Bytes of a row of a chunk.
    fn row(&self) -> Option<usize> {
        Some(self.chunk[0].checked_mul(self.together())?.checked_mul(self.bits)?.div_ceil(8))
    }

    /// Rows of the chunks in row `y` of chunks: the last strip is cut short, tiles are whole.
    fn rows(&self, y: usize) -> usize {
        if self.tiled { self.chunk[1] } else { self.chunk[1].min(self.height - y * self.chunk[1]) }
    }

    /// Bytes that stand in the file's order: a number, or one of the two of a complex one.
    pub(super) fn word(&self) -> usize {
        if self.is_complex() { self.size() / 2 } else { self.size() }
    }

    /// Bytes of a number once read.
    fn size(&self) -> usize {
        self.bits.div_ceil(8).next_power_of_two()
    }
}

impl Tiff {
    /// A handle for one thread.
    pub(super) fn bytes(&self) -> Result<Bytes<'_>> {
        Bytes::open(&self.places, self.endian)
    }

    /// Where the strips or tiles of page `index` are.
    ///
    /// # Errors
    /// When there are not as many as its size asks for, or one is not within the file.
    pub(super) fn chunks(&self, bytes: &mut Bytes, index: usize) -> Result<Chunks> {
        let (page, layout) = (&self.pages[index], self.layout(index));
        let fault = |what: String| self.fault(format!("page {index}: {what}"));
        let [across, down, planes] = layout.counts();
        let count = across.saturating_mul(down).saturating_mul(planes);
        if page.offsets.count < count as u64 {
            return Err(fault(format!("{} strips or tiles, {count} are needed", page.offsets.count)));
        }
        let row = layout.row().ok_or_else(|| fault(format!("rows of {} pixels are too long", layout.chunk[0])))?;
        let page_bytes = layout.width.saturating_mul(layout.height).saturating_mul(layout.samples).saturating_mul(layout.size());
        if row.saturating_mul(layout.chunk[1]) > page_bytes.saturating_mul(2).max(LARGEST_TILE) {
            let [x, y] = layout.chunk;
            return Err(fault(format!("tiles of {x} x {y} pixels for an image of {} x {}", layout.width, layout.height)));
        }
        let mut offsets = page.offsets.read(bytes, Table::OFFSETS)?;
        offsets.truncate(count);
        let mut lengths = match &page.lengths {
            Some(table) => table.read(bytes, Table::LENGTHS)?,
            None if layout.compression == 1 => vec![u64::MAX; count],
            None => return Err(fault("no lengths of its compressed strips or tiles".to_owned())),
        };
        lengths.truncate(count);
        if lengths.len() < count {
            return Err(fault(format!("{} lengths of strips or tiles, {count} are needed", lengths.len())));
        }
        for (chunk, (&at, length)) in offsets.iter().zip(&mut lengths).enumerate() {
            let rows = layout.rows(chunk / across % down);
            let whole = row as u64 * rows as u64;
            if layout.compression == 1 {
                if *length < whole {
                    return Err(fault(format!("strip or tile {chunk} has {length} bytes, {whole} are needed")));
                }
                *length = whole;
            }
            if !self.places.holds(at, *length) {
                return Err(fault(format!("strip or tile {chunk} of {length} bytes at byte {at}: the file has {}", self.places.length())));
            }
            if layout.most(*length) < whole {
                return Err(fault(format!("strip or tile {chunk} has {length} bytes, which cannot hold {whole}")));
            }
            // No packing makes more of it; more is read for nothing.
            *length = (*length).min(whole.saturating_mul(2).saturating_add(1024));
        }
        Ok(Chunks { offsets, lengths })
    }

    /// First byte and length of page `index`, where its numbers are one run of bytes.
    pub(super) fn run(&self, bytes: &mut Bytes, index: usize) -> Result<Option<(u64, u64)>> {
        let layout = self.layout(index);
        if !layout.is_plain() || layout.counts()[0] > 1 || layout.chunk[0] != layout.width {
            return Ok(None);
        }
        let chunks = self.chunks(bytes, index)?;
        let first = chunks.offsets.first().copied().unwrap_or(0);
        let mut end = first;
        for (&at, &length) in chunks.offsets.iter().zip(&chunks.lengths) {
            if at != end {
                return Ok(None);
            }
            end += length;
        }
        let whole = (layout.width * layout.height) as u64 * (layout.samples * layout.size()) as u64;
        // The last tile may be longer than the image.
        Ok((end - first == whole).then_some((first, whole)))
    }

    /// Reads the numbers of page `index` into `out`: this machine's order, one pixel after the other. With `expand` colours of a palette come
    /// in place of their positions in it.
    ///
    /// # Errors
    /// When the data is damaged.
    pub(super) fn page(&self, index: usize, pixels: &Pixels, expand: bool, out: &mut [u8]) -> Result<()> {
        let layout = self.layout(index);
        let mut bytes = self.bytes()?;
        let palette = if expand { self.palette(index)? } else { None };
        let Some(palette) = palette else { return self.fill(&mut bytes, index, out) };
        let mut positions = vec![0; pixels.width * pixels.height * layout.size()];
        self.fill(&mut bytes, index, &mut positions)?;
        let color = |position: usize| palette.get(position).copied().unwrap_or_default();
        for (i, rgb) in out.chunks_exact_mut(3).enumerate() {
            rgb.copy_from_slice(&match layout.size() {
                1 => color(positions[i].into()),
                _ => color(u16::from_ne_bytes([positions[2 * i], positions[2 * i + 1]]).into()),
            });
        }
        Ok(())
    }

    fn fill(&self, bytes: &mut Bytes, index: usize, out: &mut [u8]) -> Result<()> {
        let layout = self.layout(index);
        let chunks = self.chunks(bytes, index)?;
        let [across, down, _] = layout.counts();
        let (size, together) = (layout.size(), layout.together());
        let row_bytes = layout.row().unwrap_or(0);
        let numbers = layout.chunk[0] * together;
        let (mut packed, mut plain, mut room) = (Vec::new(), Vec::new(), Vec::new());
        let is_whole = layout.bits == 8 * size;
        let mut wide = vec![0; if is_whole { 0 } else { numbers * size }];
        for (chunk, (&at, &length)) in chunks.offsets.iter().zip(&chunks.lengths).enumerate() {
            let (x, y, sample) = (chunk % across, chunk / across % down, chunk / (across * down));
            let rows = layout.rows(y);
            plain.resize(row_bytes * rows, 0);
            if layout.compression == 1 {
                bytes.exactly(at, &mut plain)?;
            } else {
                packed.resize(length as usize, 0);
                bytes.exactly(at, &mut packed)?;
                codec::unpack(layout.compression, &packed, &mut plain)
                    .map_err(|e| self.fault(format!("page {index}, bytes of strip or tile {chunk}: {e}")))?;
            }
            let first = x * layout.chunk[0];
            let columns = layout.chunk[0].min(layout.width - first);
            let shown = rows.min(layout.height - y * layout.chunk[1]);
            for (r, row) in plain.chunks_exact_mut(row_bytes).take(shown).enumerate() {
                let row = if is_whole {
                    match layout.predictor {
                        3 => codec::gather(row, size, together, &mut room),
                        _ => codec::to_native(row, layout.word(), self.endian),
                    }
                    if layout.predictor == 2 {
                        codec::sum(row, size, together);
                    }
                    &row[..columns * together * size]
                } else {
                    codec::spread(row, layout.bits, &mut wide);
                    &wide[..columns * together * size]
                };
                let at = ((y * layout.chunk[1] + r) * layout.width + first) * layout.samples * size;
                if together == layout.samples {
                    out[at..at + row.len()].copy_from_slice(row);
                } else {
                    let each = layout.samples * size;
                    for (pixel, number) in out[at + sample * size..].chunks_mut(each).zip(row.chunks_exact(size)) {
                        pixel[..size].copy_from_slice(number);
                    }
                }
            }
        }
        if layout.is_inverted() {
            invert(out, layout.bits);
        } else if layout.is_stretched() {
            stretch(out, layout.bits);
        }
        Ok(())
    }

    /// The colours of the palette of page `index`.
    pub(super) fn palette(&self, index: usize) -> Result<Option<Palette>> {
        let layout = self.layout(index);
        let Some(entry) = layout.color_map else { return Ok(None) };
        let count = 1 << layout.bits.min(16);
        if entry.count != 3 * count as u64 {
            return Err(self.fault(format!(
                "page {index}: a palette of {} numbers for {} bits, not {}",
                entry.count,
                layout.bits,
                3 * count
            )));
        }
        let numbers = entry.integers(&mut self.bytes()?)?;
        // Some writers give numbers of 8 bits where the format has 16.
        let shift = if numbers.iter().all(|&n| n < 256) { 0 } else { 8 };
        Ok(Some((0..count).map(|i| [0, 1, 2].map(|c| (numbers[c * count + i] >> shift) as u8)).collect()))
    }
}

/// Largest number becomes 0 and 0 the largest: numbers of `bits` bits.
fn invert(out: &mut [u8], bits: usize) {
    if bits % 8 == 0 {
        out.iter_mut().for_each(|b| *b = !*b);
    } else {
        let most = (1u16 << bits) - 1;
        each(out, bits, |value| most - value);
    }
}

/// The largest number of `bits` bits becomes the largest of 8 or 16 bits.
fn stretch(out: &mut [u8], bits: usize) {
    let (most, full) = ((1u32 << bits) - 1, if bits > 8 { u32::from(u16::MAX) } else { u32::from(u8::MAX) });
    each(out, bits, |value| ((u32::from(value) * full + most / 2) / most) as u16);
}

/// Changes all numbers of at most 16 bits.
fn each(out: &mut [u8], bits: usize, change: impl Fn(u16) -> u16) {
    if bits > 8 {
        out.chunks_exact_mut(2).for_each(|b| b.copy_from_slice(&change(u16::from_ne_bytes([b[0], b[1]])).to_ne_bytes()));
    } else {
        out.iter_mut().for_each(|b| *b = change((*b).into()) as u8);
    }
}

/// The error that page `index` is unlike the first one.
pub(super) fn unlike(tiff: &Tiff, index: usize, first: &Pixels, found: &Pixels) -> Error {
    tiff.fault(format!("page {index} is {found}, the first one is {first}: they must be alike"))
}
