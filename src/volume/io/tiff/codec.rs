//! Packed numbers to plain ones: LZW, deflate and PackBits, and the predictors that are applied before packing.
//!
//! TIFF 6.0, sections 9 (PackBits), 13 (LZW) and 14 (differencing); Adobe's technical notes of 2002 (deflate) and of 2005 (the
//! floating-point predictor).

use crate::volume::io::Endian;
use std::io::Read;

/// Unpacks `packed` into `out`.
///
/// # Errors
/// When the data is damaged or does not fill `out`: what is wrong, in words.
pub(super) fn unpack(compression: u64, packed: &[u8], out: &mut [u8]) -> Result<(), String> {
    let total = out.len();
    let got = match compression {
        5 => lzw(packed, out)?,
        32773 => pack_bits(packed, out),
        _ => inflate(packed, out)?,
    };
    if got < total { Err(format!("they end after {got} of {total} bytes")) } else { Ok(()) }
}

/// A zlib stream; returns how many bytes came.
fn inflate(packed: &[u8], out: &mut [u8]) -> Result<usize, String> {
    let mut decoder = flate2::bufread::ZlibDecoder::new(packed);
    let mut done = 0;
    while done < out.len() {
        match decoder.read(&mut out[done..]) {
            Ok(0) => break,
            Ok(n) => done += n,
            Err(e) => return Err(format!("they are damaged after {done} bytes: {e}")),
        }
    }
    Ok(done)
}

/// A byte `n` below 128 announces `n + 1` bytes as they are, one above 128 a byte that is repeated `257 - n` times.
fn pack_bits(mut packed: &[u8], out: &mut [u8]) -> usize {
    let mut done = 0;
    while let (Some((&n, rest)), true) = (packed.split_first(), done < out.len()) {
        let room = out.len() - done;
        packed = rest;
        match n {
            0..128 => {
                let count = (usize::from(n) + 1).min(packed.len());
                let kept = count.min(room);
                out[done..done + kept].copy_from_slice(&packed[..kept]);
                packed = &packed[count..];
                done += kept;
            }
            128 => {}
            _ => {
                let Some((&value, rest)) = packed.split_first() else { break };
                let count = (257 - usize::from(n)).min(room);
                out[done..done + count].fill(value);
                packed = rest;
                done += count;
            }
        }
    }
    done
}

/// Most codes of LZW.
const CODES: usize = 4096;
/// The code that empties the table, and the one that ends the data.
const CLEAR: usize = 256;
const END: usize = 257;

/// Codes of 9 to 12 bits, most significant bit first. Each stands for bytes that came before: those of the code before it and one more.
fn lzw(packed: &[u8], out: &mut [u8]) -> Result<usize, String> {
    if let [0, second, ..] = packed {
        if second & 1 == 1 {
            return Err("they are LZW data of before 1988: not supported".to_owned());
        }
    }
    // Where in `out` the bytes of a code are, and how many.
    let mut strings = [(0usize, 0usize); CODES];
    let (mut next, mut width) = (END + 1, 9);
    let mut before: Option<(usize, usize)> = None;
    let (mut held, mut bits) = (0u32, 0);
    let mut rest = packed.iter();
    let mut done = 0;
    while done < out.len() {
        while bits < width {
            let Some(&byte) = rest.next() else { return Ok(done) };
            held = held << 8 | u32::from(byte);
            bits += 8;
        }
        bits -= width;
        let code = (held >> bits) as usize & ((1 << width) - 1);
        match code {
            CLEAR => {
                (next, width, before) = (END + 1, 9, None);
                continue;
            }
            END => break,
            _ => {}
        }
        if let Some((at, length)) = before {
            if next < CODES {
                // One byte more than the code before: the first of this code, which follows it in `out`.
                strings[next] = (at, length + 1);
                next += 1;
            }
        }
        let start = done;
        if code < CLEAR {
            out[done] = code as u8;
            done += 1;
        } else {
            let Some(&(at, length)) = strings[..next].get(code) else {
                return Err(format!("they are damaged after {done} bytes: code {code} of {next}"));
            };
            let length = length.min(out.len() - done);
            if at + length <= done {
                out.copy_within(at..at + length, done);
            } else {
                // The string of this very code ends with the byte it starts with.
                for i in 0..length {
                    out[done + i] = out[at + i];
                }
            }
            done += length;
        }
        before = Some((start, done - start));
        // One code earlier than needed, as the format has it.
        if next + 1 >= 1 << width && width < 12 {
            width += 1;
        }
    }
    Ok(done)
}

/// Turns numbers of `size` bytes from the order `endian` to this machine's.
pub(super) fn to_native(row: &mut [u8], size: usize, endian: Endian) {
    if endian == Endian::NATIVE {
        return;
    }
    match size {
        1 => {}
        2 => row.chunks_exact_mut(2).for_each(|b| b.swap(0, 1)),
        _ => row.chunks_exact_mut(size).for_each(<[u8]>::reverse),
    }
}

/// Undoes differences between neighbours in a row of numbers in this machine's order, `samples` a pixel.
pub(super) fn sum(row: &mut [u8], size: usize, samples: usize) {
    macro_rules! sum {
        ($t:ty) => {{
            const SIZE: usize = size_of::<$t>();
            let number = |b: &[u8]| <$t>::from_ne_bytes(std::array::from_fn(|i| b[i]));
            for at in (samples * SIZE..row.len() / SIZE * SIZE).step_by(SIZE) {
                let sum = number(&row[at - samples * SIZE..]).wrapping_add(number(&row[at..]));
                row[at..at + SIZE].copy_from_slice(&sum.to_ne_bytes());
            }
        }};
    }
    match size {
        1 => sum!(u8),
        2 => sum!(u16),
        4 => sum!(u32),
        _ => sum!(u64),
    }
}

/// Undoes the floating-point predictor in a row of `samples` numbers a pixel: first all most significant bytes are there, then all of the
/// next ones, and so on, as differences. `room` is used for the row as it was.
pub(super) fn gather(row: &mut [u8], size: usize, samples: usize, room: &mut Vec<u8>) {
    for at in samples..row.len() {
        row[at] = row[at].wrapping_add(row[at - samples]);
    }
    room.clear();
    room.extend_from_slice(row);
    let count = row.len() / size;
    for (i, number) in row.chunks_exact_mut(size).enumerate() {
        for (k, byte) in number.iter_mut().enumerate() {
            let place = if Endian::NATIVE == Endian::Big { k } else { size - 1 - k };
            *byte = room[place * count + i];
        }
    }
}

/// Numbers of `bits` bits behind each other, most significant bit first, into bytes or 16-bit numbers of this machine's order.
pub(super) fn spread(packed: &[u8], bits: usize, out: &mut [u8]) {
    let size = if bits > 8 { 2 } else { 1 };
    let (mut held, mut count) = (0u32, 0);
    let mut rest = packed.iter();
    for number in out.chunks_exact_mut(size) {
        while count < bits {
            held = held << 8 | u32::from(rest.next().copied().unwrap_or(0));
            count += 8;
        }
        count -= bits;
        let value = held >> count & ((1 << bits) - 1);
        if size == 1 {
            number[0] = value as u8;
        } else {
            number.copy_from_slice(&(value as u16).to_ne_bytes());
        }
    }
}
