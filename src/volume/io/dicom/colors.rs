//! Colours of pixels as red, green, blue and alpha.
//!
//! Source: DICOM PS3.3, section C.7.6.3.1.2 (photometric interpretations; the numbers are those of ITU-R BT.601 over the whole range) and
//! section C.7.6.3.1.5 (palettes).

use super::image::{Bits, Image, Layout, Palette, Photometric};
use crate::volume::{VoxelType, Voxels};

/// The type of the four numbers that a pixel becomes.
pub(super) fn kind(image: &Image) -> VoxelType {
    match &image.palette {
        Some(palette) => palette.tables[0].voxel_type(),
        None => image.layout.kind(),
    }
}

/// All red numbers, then all green ones, then all blue ones: brought together pixel by pixel.
pub(super) fn interleaved(planes: &[u8], layout: &Layout) -> Vec<u8> {
    let size = layout.kind().bytes();
    let each = layout.pixels() * size;
    let mut out = Vec::with_capacity(planes.len());
    for at in (0..each).step_by(size) {
        (0..layout.samples).for_each(|s| out.extend_from_slice(&planes[s * each + at..s * each + at + size]));
    }
    out
}

/// Pairs of pixels that share their differences (y, y, b, r): each pixel's own three numbers.
pub(super) fn unshared(pairs: &[u8]) -> Vec<u8> {
    pairs.chunks_exact(4).flat_map(|p| [p[0], p[2], p[3], p[1], p[2], p[3]]).collect()
}

/// Red, green and blue of a brightness and two differences.
fn rgb([y, b, r]: [u8; 3]) -> [u8; 3] {
    let [y, b, r] = [f64::from(y), f64::from(b) - 128.0, f64::from(r) - 128.0];
    [y + 1.402 * r, y - 0.344_136 * b - 0.714_136 * r, y + 1.772 * b].map(|v| libm::rint(v.clamp(0.0, 255.0)) as u8)
}

/// Scales a number of so many bits to all bits of its type.
fn full(value: u16, bits: Bits) -> u16 {
    let most = (1u32 << bits.stored) - 1;
    (u32::from(value) * 65535 / most).min(65535) as u16
}

/// Puts the colours of a frame into `out`, whose first pixel is `first`. `frame` holds the pixels' numbers in this machine's byte order.
pub(super) fn put(image: &Image, frame: &[u8], out: &mut Voxels, first: usize) {
    if let Some(palette) = &image.palette {
        return put_palette(image, palette, frame, out, first);
    }
    let ybr = matches!(image.layout.photometric, Photometric::Ybr | Photometric::Ybr422);
    let range = 4 * first..4 * (first + image.layout.pixels());
    match out {
        Voxels::U8(v) => {
            for (to, from) in v[range].chunks_exact_mut(4).zip(frame.chunks_exact(3)) {
                let from = [from[0], from[1], from[2]];
                let [r, g, b] = if ybr { rgb(from) } else { from };
                to.copy_from_slice(&[r, g, b, u8::MAX]);
            }
        }
        Voxels::U16(v) => {
            for (to, from) in v[range].chunks_exact_mut(4).zip(frame.chunks_exact(6)) {
                let number = |i: usize| full(u16::from_ne_bytes([from[2 * i], from[2 * i + 1]]), image.bits);
                to.copy_from_slice(&[number(0), number(1), number(2), u16::MAX]);
            }
        }
        _ => {}
    }
}

/// Puts one channel of a frame's colours into `out`, whose first pixel is `first`.
pub(super) fn put_channel(image: &Image, frame: &[u8], out: &mut Voxels, first: usize, channel: usize) {
    fn pick<T: Copy>(out: &mut [T], all: &[T], channel: usize) {
        out.iter_mut().zip(all.chunks_exact(4)).for_each(|(to, from)| *to = from[channel]);
    }
    let count = image.layout.pixels();
    let mut all = match out {
        Voxels::U8(_) => Voxels::from(vec![0u8; 4 * count]),
        _ => Voxels::from(vec![0u16; 4 * count]),
    };
    put(image, frame, &mut all, 0);
    match (out, &all) {
        (Voxels::U8(out), Voxels::U8(all)) => pick(&mut out[first..first + count], all, channel),
        (Voxels::U16(out), Voxels::U16(all)) => pick(&mut out[first..first + count], all, channel),
        _ => {}
    }
}

fn put_palette(image: &Image, palette: &Palette, frame: &[u8], out: &mut Voxels, first: usize) {
    let range = 4 * first..4 * (first + image.layout.pixels());
    let size = image.layout.kind().bytes();
    let last = palette.tables[0].len() as i64 - 1;
    // Pixels before the first colour have that, those behind the last one have the last.
    let entry = |bytes: &[u8]| {
        let pixel = match (bytes, image.layout.signed) {
            (&[a], false) => i64::from(a),
            (&[a], true) => i64::from(a as i8),
            (&[a, b], false) => u16::from_ne_bytes([a, b]).into(),
            (&[a, b], true) => i16::from_ne_bytes([a, b]).into(),
            _ => 0,
        };
        (pixel - palette.first).clamp(0, last) as usize
    };
    match (out, &palette.tables) {
        (Voxels::U8(v), [Voxels::U8(r), Voxels::U8(g), Voxels::U8(b)]) => {
            for (to, from) in v[range].chunks_exact_mut(4).zip(frame.chunks_exact(size)) {
                let i = entry(from);
                to.copy_from_slice(&[r[i], g[i], b[i], u8::MAX]);
            }
        }
        (Voxels::U16(v), [Voxels::U16(r), Voxels::U16(g), Voxels::U16(b)]) => {
            for (to, from) in v[range].chunks_exact_mut(4).zip(frame.chunks_exact(size)) {
                let i = entry(from);
                to.copy_from_slice(&[r[i], g[i], b[i], u16::MAX]);
            }
        }
        _ => {}
    }
}
