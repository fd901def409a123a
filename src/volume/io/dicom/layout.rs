//! How a file's pixels lie, and what they mean, by what its header says.

use super::elements::PIXELS;
use super::header::Header;
use super::image::{Bits, Layout, Palette, Photometric};
use super::syntax::Codec;
use super::tags::*;
use crate::volume::Voxels;

impl Header {
    /// How pixels lie, as far as they can be read, and why not where they cannot.
    pub(super) fn layout(&self, pixels: u32, codec: Codec) -> Result<(Layout, Bits, Option<String>), String> {
        let (rows, columns) = (self.count(ROWS, 1, None)?, self.count(COLUMNS, 1, None)?);
        let samples = self.count(SAMPLES, 1, Some(1))?;
        let float = pixels != PIXELS[0];
        let allocated = if pixels == PIXELS[2] { 64 } else { self.count(BITS_ALLOCATED, 1, Some(16))? as u32 };
        let stored = if float { allocated } else { self.count(BITS_STORED, 1, Some(allocated))? as u32 };
        let high = if float { stored - 1 } else { self.count(HIGH_BIT, 0, Some(stored - 1))? as u32 };
        let signed = !float && self.number(PIXEL_REPRESENTATION) == Some(1.0);
        let name = self.text(PHOTOMETRIC);
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
            return Err(format!(
                "pixels of {samples} sample{} are {}, which have {colors}",
                if samples == 1 { "" } else { "s" },
                if name.is_empty() { "gray" } else { &name }
            ));
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

    /// The palette.
    pub(super) fn palette(&self) -> Result<Palette, String> {
        let mut first = 0;
        let mut tables = [const { None }; 3];
        for (i, table) in tables.iter_mut().enumerate() {
            let tag = RED_DESCRIPTOR + i as u32;
            let Some(&[count, start, bits]) = self.numbers(tag) else {
                return Err(format!("the palette has no {} of three numbers", shown(tag)));
            };
            // 65536 colours do not fit the number and are written as 0; large counts may be read as negative.
            let count = if count == 0.0 { 1 << 16 } else { count.rem_euclid(65536.0) as usize };
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
}
