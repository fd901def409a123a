//! The pixels of a stack's frames, brought to their place in the volume.
//!
//! What is not compressed is read straight into its place. Compressed frames are gathered up to a bounded number of bytes and decoded
//! in parallel.

use super::codecs;
use super::colors;
use super::elements::Bytes;
use super::geometry::{Plan, Stack};
use super::image::{Bits, Image, Layout};
use super::resample;
use super::series::{Frame, Study, TAKE_AWAY};
use super::syntax::Codec;
use crate::volume::io::reading::Reading;
use crate::volume::io::source::{Source, room};
use crate::volume::io::tree::Tree;
use crate::volume::io::{Endian, Stored};
use crate::volume::{Voxel, VoxelType, Voxels};
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::io::Read;

/// Bytes of compressed frames and of what becomes of them that are gathered before they are decoded.
const BATCH: usize = 32 << 20;
/// Most bytes that a byte of a compressed frame becomes. Blank slices shrink far.
const RATIO: u64 = 1 << 16;

/// A stack's voxels.
pub(super) struct Loaded {
    pub(super) voxels: Voxels,
    pub(super) is_color: bool,
    /// Slope and intercept of the values.
    pub(super) rescale: (f64, f64),
    /// Whether slices had different ones, so that values were computed.
    pub(super) computed: bool,
    /// The value of pixels outside of what was scanned, where one has it.
    pub(super) padding: Option<i64>,
}

/// A frame that is to be decoded.
struct Job {
    image: usize,
    frame: usize,
    data: Vec<u8>,
}

/// Where frames go.
struct Sink<'a> {
    study: &'a Study,
    /// Frames of each image and their places among the slices, sorted.
    places: BTreeMap<usize, Vec<(usize, usize)>>,
    voxels: Voxels,
    is_color: bool,
    /// The one channel of colours that is kept.
    channel: Option<usize>,
    /// The padding value that was found in a pixel.
    padding: Option<i64>,
    /// Slope and intercept of each slice, where they differ.
    slopes: Option<Vec<(f64, f64)>>,
    jobs: Vec<Job>,
    gathered: usize,
    done: u64,
    reading: &'a Reading,
    total: u64,
}

/// Brings the bits that count to the bottom of each number, and their sign to the others.
fn align(bits: Bits, layout: &Layout, frame: &mut [u8]) {
    macro_rules! each {
        ($number:ty, $as:ty) => {{
            let width = <$number>::BITS;
            let (left, right) = (width - 1 - bits.high, width - bits.stored);
            if (left, right) != (0, 0) {
                for bytes in frame.chunks_exact_mut(size_of::<$number>()) {
                    let mut one = [0; size_of::<$number>()];
                    one.copy_from_slice(bytes);
                    let number = <$number>::from_ne_bytes(one) << left;
                    bytes.copy_from_slice(&((number as $as) >> right).to_ne_bytes());
                }
            }
        }};
    }
    match layout.kind() {
        VoxelType::U8 => each!(u8, u8),
        VoxelType::I8 => each!(u8, i8),
        VoxelType::U16 => each!(u16, u16),
        VoxelType::I16 => each!(u16, i16),
        VoxelType::U32 => each!(u32, u32),
        VoxelType::I32 => each!(u32, i32),
        VoxelType::F32 | VoxelType::F64 => {}
    }
}

/// Turns the bytes of a native frame into this machine's order.
fn turn(image: &Image, frame: &mut [u8]) {
    let size = image.layout.kind().bytes();
    if size > 1 && image.syntax.encoding.endian != Endian::NATIVE {
        frame.chunks_exact_mut(size).for_each(<[u8]>::reverse);
    }
}

/// The value of pixels outside of what was scanned, if one of `frame` has it.
fn padding(image: &Image, frame: &[u8]) -> Option<i64> {
    fn holds<T: Voxel + PartialEq>(frame: &[u8], value: T) -> bool {
        // Without a branch for each pixel.
        let any =
            |part: &[u8]| part.chunks_exact(size_of::<T>()).fold(false, |any, b| any | (bytemuck::pod_read_unaligned::<T>(b) == value));
        frame.chunks(1 << 14).any(any)
    }
    let value = image.padding?;
    let signed = i64::from(value as i16);
    let (found, shown) = match image.layout.kind() {
        VoxelType::U8 => (value <= 255 && holds(frame, value as u8), i64::from(value)),
        VoxelType::I8 => (holds(frame, value as i8), i64::from(value as i8)),
        VoxelType::U16 => (holds(frame, value), i64::from(value)),
        VoxelType::I16 => (holds(frame, value as i16), signed),
        VoxelType::U32 => (holds(frame, u32::from(value)), i64::from(value)),
        VoxelType::I32 => (holds(frame, i32::from(value as i16)), signed),
        VoxelType::F32 | VoxelType::F64 => (false, 0),
    };
    (found && !image.layout.is_color()).then_some(shown)
}

/// The samples of each native pixel one after the other.
fn arranged(image: &Image, frame: Vec<u8>) -> Vec<u8> {
    if image.layout.native_bytes() < image.layout.frame_bytes() {
        colors::unshared(&frame)
    } else if image.planar {
        colors::interleaved(&frame, &image.layout)
    } else {
        frame
    }
}

impl Sink<'_> {
    /// Puts a frame of pixels in this machine's order into its place.
    fn put(&mut self, index: usize, number: usize, frame: &mut [u8]) {
        let image = &self.study.images[index];
        align(image.bits, &image.layout, frame);
        let each = image.layout.pixels();
        let Some(place) = self.place(index, number) else { return };
        self.padding = self.padding.or_else(|| padding(image, frame));
        if let Some(channel) = self.channel {
            colors::put_channel(image, frame, &mut self.voxels, place * each, channel);
        } else if self.is_color {
            colors::put(image, frame, &mut self.voxels, place * each);
        } else if let (Some(slopes), Voxels::F32(out)) = (&self.slopes, &mut self.voxels) {
            values(&image.layout, frame, slopes[place], &mut out[place * each..(place + 1) * each]);
        } else {
            let size = frame.len();
            self.voxels.as_bytes_mut()[place * size..(place + 1) * size].copy_from_slice(frame);
        }
    }

    /// Which slice a frame becomes; `None` where it is not wanted.
    fn place(&self, index: usize, number: usize) -> Option<usize> {
        let places = self.places.get(&index)?;
        places.binary_search_by_key(&number, |p| p.0).ok().map(|at| places[at].1)
    }

    fn step(&mut self) -> Result<()> {
        self.done += 1;
        self.reading.step(self.total + self.done, 2 * self.total)
    }

    /// Decodes what is gathered.
    fn flush(&mut self) -> Result<()> {
        let jobs = std::mem::take(&mut self.jobs);
        self.gathered = 0;
        let study = self.study;
        let decoded: Vec<Result<Vec<u8>, String>> =
            jobs.par_iter().map(|job| codecs::decode(&study.images[job.image], &job.data)).collect();
        for (job, frame) in jobs.into_iter().zip(decoded) {
            let image = &study.images[job.image];
            let mut frame = frame.map_err(|what| Error::format(&image.path, frame_fault(image, job.frame, &what)))?;
            self.put(job.image, job.frame, &mut frame);
            self.step()?;
        }
        Ok(())
    }

    /// Reads frames that are not compressed, one after the other.
    fn native(&mut self, index: usize, source: &mut Source) -> Result<()> {
        let image = &self.study.images[index];
        let (layout, bytes) = (image.layout, image.layout.native_bytes());
        let straight = !layout.is_color() && self.slopes.is_none();
        let wanted = self.places.get(&index).cloned().unwrap_or_default();
        let total = bytes as u64 * image.frames.len() as u64;
        if image.words {
            // Frames may begin in the middle of a word.
            let mut all = vec![0; (bytes * image.frames.len()).next_multiple_of(2)];
            source.read_exact_into(&mut all, 0, total)?;
            all.chunks_exact_mut(2).for_each(<[u8]>::reverse);
            for (number, _) in wanted {
                self.put(index, number, &mut arranged(image, all[number * bytes..(number + 1) * bytes].to_vec()));
                self.step()?;
            }
            return Ok(());
        }
        let mut at = 0;
        for (number, place) in wanted {
            source.skip((number - at) as u64 * bytes as u64)?;
            at = number + 1;
            let before = number as u64 * bytes as u64;
            if straight {
                let out = &mut self.voxels.as_bytes_mut()[place * bytes..(place + 1) * bytes];
                source.read_exact_into(out, before, total)?;
                turn(image, out);
                align(image.bits, &layout, out);
                self.padding = self.padding.or_else(|| padding(image, out));
            } else {
                let mut frame = vec![0; bytes];
                source.read_exact_into(&mut frame, before, total)?;
                turn(image, &mut frame);
                self.put(index, number, &mut arranged(image, frame));
            }
            self.step()?;
        }
        Ok(())
    }

    /// Takes a compressed frame.
    fn take(&mut self, index: usize, number: usize, data: Vec<u8>) -> Result<()> {
        let image = &self.study.images[index];
        if self.place(index, number).is_none() {
            return Ok(());
        }
        if image.syntax.codec == Codec::Bare {
            let mut frame = data;
            // A fragment has an even number of bytes.
            if frame.len() < image.layout.native_bytes() || frame.len() > image.layout.native_bytes() + 1 {
                let what = format!("holds {} bytes, {} are needed", frame.len(), image.layout.native_bytes());
                return Err(Error::format(&image.path, frame_fault(image, number, &what)));
            }
            frame.truncate(image.layout.native_bytes());
            turn(image, &mut frame);
            self.put(index, number, &mut arranged(image, frame));
            return self.step();
        }
        self.gathered += data.len() + image.layout.frame_bytes();
        self.jobs.push(Job { image: index, frame: number, data });
        if self.gathered >= BATCH { self.flush() } else { Ok(()) }
    }

    /// Reads the fragments of compressed pixels and puts them together to frames.
    fn encapsulated(&mut self, index: usize, source: &mut Source) -> Result<()> {
        let image = &self.study.images[index];
        let count = image.frames.len();
        // The first fragment lists where frames start, or is empty.
        let Some(length) = Bytes::fragment(source)? else {
            return Err(source.fault("the pixels have no fragment"));
        };
        let mut starts = Vec::new();
        if length / 4 == count as u64 && count > 1 {
            let list = fragment(source, length)?;
            starts.extend(list.chunks_exact(4).map(|start| u64::from(Endian::Little.u32(start))));
        } else {
            source.skip(length)?;
        }
        // A list that cannot be one is not followed.
        let listed = starts.first() == Some(&0) && starts.windows(2).all(|pair| pair[0] < pair[1]);
        // A frame that is much larger than its pixels is none.
        let most = image.layout.frame_bytes() as u64 * 4 + (1 << 20);
        let (mut number, mut at, mut frame) = (0, 0u64, Vec::new());
        while let Some(length) = Bytes::fragment(source)? {
            if frame.len() as u64 + length > most {
                let what = format!("takes more than {most} bytes, {} are those of its pixels", image.layout.frame_bytes());
                return Err(Error::format(&image.path, frame_fault(image, number, &what)));
            }
            let data = fragment(source, length)?;
            let begins = !frame.is_empty()
                && count > 1
                && match image.syntax.codec {
                    Codec::Rle | Codec::Bare => true,
                    _ if listed => starts.get(number + 1) == Some(&at),
                    _ => data.starts_with(&[0xff, 0xd8]) || data.starts_with(&[0xff, 0x4f, 0xff, 0x51]) || data.starts_with(&[0, 0, 0, 12]),
                };
            if begins {
                self.take(index, number, std::mem::take(&mut frame))?;
                number += 1;
            }
            frame.extend_from_slice(&data);
            at += 8 + length;
            if number >= count {
                break;
            }
        }
        if !frame.is_empty() {
            self.take(index, number, frame)?;
            number += 1;
        }
        if number != count {
            return Err(Error::format(&image.path, format!("frames claimed: {count}, frames there: {number}")));
        }
        Ok(())
    }
}

/// What is said of a frame that cannot be decoded.
fn frame_fault(image: &Image, number: usize, what: &str) -> String {
    if image.frames.len() > 1 { format!("frame {number}: {what}") } else { what.to_owned() }
}

/// The `length` bytes of a fragment. They are taken as they come, so that none are taken for more than there are.
fn fragment(source: &mut Source, length: u64) -> Result<Vec<u8>> {
    let mut data = Vec::new();
    let path = source.path().to_path_buf();
    source.by_ref().take(length).read_to_end(&mut data).map_err(|e| Error::format(&path, format!("the pixels are damaged: {e}")))?;
    if (data.len() as u64) < length {
        return Err(source.fault(format!("a fragment of the pixels should take {length} bytes, {} follow", data.len())));
    }
    Ok(data)
}

/// Values of pixels: slope times the number, and the intercept.
fn values(layout: &Layout, frame: &[u8], (slope, intercept): (f64, f64), out: &mut [f32]) {
    fn each<T: Voxel>(frame: &[u8], slope: f64, intercept: f64, out: &mut [f32]) {
        for (out, bytes) in out.iter_mut().zip(frame.chunks_exact(size_of::<T>())) {
            *out = (slope * bytemuck::pod_read_unaligned::<T>(bytes).to_f64() + intercept) as f32;
        }
    }
    match layout.kind() {
        VoxelType::U8 => each::<u8>(frame, slope, intercept, out),
        VoxelType::I8 => each::<i8>(frame, slope, intercept, out),
        VoxelType::U16 => each::<u16>(frame, slope, intercept, out),
        VoxelType::I16 => each::<i16>(frame, slope, intercept, out),
        VoxelType::U32 => each::<u32>(frame, slope, intercept, out),
        VoxelType::I32 => each::<i32>(frame, slope, intercept, out),
        VoxelType::F32 => each::<f32>(frame, slope, intercept, out),
        VoxelType::F64 => each::<f64>(frame, slope, intercept, out),
    }
}

/// Slope and intercept of each slice; a slope that is not given is 1.
fn rescales(study: &Study, stack: &Stack) -> Result<Vec<(f64, f64)>> {
    let rescale = |frame: &Frame| {
        let image = &study.images[frame.image];
        let facts = &image.frames[frame.frame];
        let (slope, intercept) = (facts.slope.unwrap_or(1.0), facts.intercept.unwrap_or(0.0));
        if slope == 0.0 || !slope.is_finite() || !intercept.is_finite() {
            let what = format!("rescale slope {slope}, intercept {intercept}: both must be finite and the slope not 0");
            return Err(Error::format(&image.path, what));
        }
        Ok((slope, intercept))
    };
    stack.slices.iter().map(rescale).collect()
}

/// The pixels of `image`, whose file `source` stands at the start of.
pub(super) fn source(image: &Image, mut source: Source) -> Result<Source> {
    source.skip(image.before)?;
    if image.syntax.deflated {
        source = source.inflate();
    }
    source.skip(image.at)?;
    Ok(source)
}

/// Reads the pixels of `stack`; of colours one channel alone where one is chosen.
///
/// # Errors
/// When they are over the limits, damaged, or not of the size that headers say.
pub(super) fn load(tree: &Tree, study: &Study, stack: &Stack, channel: Option<usize>, reading: &Reading) -> Result<Loaded> {
    let first = &study.images[stack.slices[0].image];
    let mut places: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
    for (slice, frame) in stack.slices.iter().enumerate() {
        let place = if let Plan::Fill { places, .. } = &stack.plan { places[slice] } else { slice };
        places.entry(frame.image).or_default().push((frame.frame, place));
    }
    places.values_mut().for_each(|p| p.sort_unstable());
    if let Some((image, what)) = places.keys().find_map(|&i| Some((&study.images[i], study.images[i].unread.as_ref()?))) {
        let others = places.keys().any(|&i| study.images[i].unread.is_none());
        return Err(Error::format(&image.path, format!("{what}{}", if others { TAKE_AWAY } else { "" })));
    }
    let is_color = first.layout.is_color() && channel.is_none();
    if is_color && stack.plan != Plan::Direct {
        return Err(Error::format(tree.path(), "slices of colours are missing or unevenly spaced: colours are not interpolated"));
    }
    let rescales = rescales(study, stack)?;
    let computed = !first.layout.is_color() && rescales.iter().any(|r| *r != rescales[0]);
    let there = stack.slices.len();
    let [columns, rows] = [first.layout.columns, first.layout.rows];
    let (kind, across) = match () {
        () if is_color => (colors::kind(first), columns.saturating_mul(4)),
        () if channel.is_some() => (colors::kind(first), columns),
        () if computed => (VoxelType::F32, columns),
        () => (first.layout.kind(), columns),
    };
    if let Some(other) = places.keys().map(|&i| &study.images[i]).find(|i| i.layout.is_color() && colors::kind(i) != kind) {
        return Err(Error::format(&other.path, "its palette has colours of another number of bits than those of other slices"));
    }
    let made = |count: usize| {
        // What is made up needs no bytes of files.
        let held = places.keys().map(|&i| study.images[i].held).fold(0u64, u64::saturating_add);
        let most = held.saturating_mul(RATIO).saturating_mul((count / there + 1) as u64);
        room(tree.path(), &reading.limits, [across, rows, count], Stored::from(kind), most)
    };
    let all = if matches!(stack.plan, Plan::Resample { .. }) { there } else { stack.plan.count(there) };
    let voxels = made(all)?;
    let wanted: BTreeMap<usize, usize> = places.keys().map(|&i| (study.images[i].leaf, i)).collect();
    let total = there as u64;
    let slopes = computed.then(|| {
        let mut by_place = vec![(1.0, 0.0); all];
        for (slice, rescale) in rescales.iter().enumerate() {
            let place = if let Plan::Fill { places, .. } = &stack.plan { places[slice] } else { slice };
            by_place[place] = *rescale;
        }
        by_place
    });
    let mut sink = Sink {
        study,
        places: places.clone(),
        voxels,
        is_color,
        channel,
        padding: None,
        slopes,
        jobs: Vec::new(),
        gathered: 0,
        done: 0,
        reading,
        total,
    };
    // A file that cannot be decoded is named, and what to do where others can.
    let alone = |e: Error| match e {
        Error::Format { path, what } if places.len() > 1 && places.keys().any(|&i| study.images[i].path == path) => {
            Error::format(path, format!("{what}{TAKE_AWAY}"))
        }
        other => other,
    };
    let visited = tree.visit(&|leaf| wanted.contains_key(&leaf), &mut |leaf| {
        let Some(&index) = wanted.get(&leaf.index) else { return Ok(true) };
        let image = &study.images[index];
        let mut source = source(image, leaf.source)?;
        if image.syntax.codec == Codec::Native {
            sink.native(index, &mut source)?
        } else {
            sink.encapsulated(index, &mut source)?
        }
        // The checksum of a compressed file is looked at where it ends.
        if source.is_packed() && !image.syntax.deflated {
            while !source.peek(1 << 16)?.is_empty() {
                let n = source.buffered().len();
                source.consume(n);
            }
        }
        Ok(true)
    });
    visited.and_then(|()| sink.flush()).map_err(alone)?;
    if sink.done < total {
        return Err(Error::format(tree.path(), format!("{} of {total} images went away while they were read", total - sink.done)));
    }
    let each = first.layout.pixels();
    let voxels = resample::apply(&stack.plan, each, sink.voxels, || made(stack.plan.count(there)))?;
    let rescale = if computed || first.layout.is_color() { (1.0, 0.0) } else { rescales[0] };
    Ok(Loaded { voxels, is_color, rescale, computed, padding: sink.padding })
}
