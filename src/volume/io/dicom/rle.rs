//! RLE, the run-length coding of DICOM: PS3.5, annex G. Each byte of each sample is a plane of its own, the most significant byte first.

use super::image::Layout;
use crate::volume::io::Endian;

/// Bytes of the header: how many segments there are, and where each of up to 15 starts.
const HEADER: usize = 64;

/// The frame that `data` holds, in this machine's byte order, the samples of a pixel one after the other.
pub(super) fn decode(data: &[u8], layout: &Layout) -> Result<Vec<u8>, String> {
    let (size, pixels) = (layout.kind().bytes(), layout.pixels());
    let wanted = layout.samples * size;
    let Some(header) = data.get(..HEADER) else {
        return Err(format!("an RLE frame of {} bytes is shorter than its header of {HEADER}", data.len()));
    };
    let word = |i: usize| Endian::Little.u32(&header[4 * i..]) as usize;
    if word(0) != wanted {
        return Err(format!("an RLE frame has {} segments, pixels of {} x {} bytes have {wanted}", word(0), layout.samples, size));
    }
    let mut out = vec![0; layout.frame_bytes()];
    for segment in 0..wanted {
        let start = word(1 + segment);
        let end = if segment + 1 < wanted { word(2 + segment) } else { data.len() };
        let Some(bytes) = data.get(start..end).filter(|_| start >= HEADER) else {
            return Err(format!("RLE segment {segment} lies at bytes {start} to {end}, the frame has {}", data.len()));
        };
        let (sample, byte) = (segment / size, segment % size);
        let within = if cfg!(target_endian = "big") { byte } else { size - 1 - byte };
        let got = unpack(bytes, &mut out, sample * size + within, layout.samples * size);
        if got < pixels {
            return Err(format!("RLE segment {segment} holds {got} bytes, a frame has {pixels} pixels"));
        }
    }
    Ok(out)
}

/// Fills every `step`th byte of `out` from `first` on; how many there were.
fn unpack(mut data: &[u8], out: &mut [u8], first: usize, step: usize) -> usize {
    let mut to = out.iter_mut().skip(first).step_by(step);
    let mut count = 0;
    while let [control, rest @ ..] = data {
        data = rest;
        let control = *control as i8;
        if control >= 0 {
            let run = (control as usize + 1).min(data.len());
            let (now, later) = data.split_at(run);
            data = later;
            // In this order no place is lost at the end of the run.
            for (byte, to) in now.iter().zip(to.by_ref()) {
                *to = *byte;
                count += 1;
            }
        } else if control != i8::MIN {
            let [byte, rest @ ..] = data else { break };
            data = rest;
            for to in to.by_ref().take((1 - isize::from(control)) as usize) {
                *to = *byte;
                count += 1;
            }
        }
        if to.len() == 0 {
            break;
        }
    }
    count
}
