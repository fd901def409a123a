//! OME-Zarr with levels of detail, written in one pass over the voxels.
//!
//! ```text
//!   level 0   band 0 0  band 0 1        a band: all voxels along x, a chunk's along y and z
//!             band 1 0  band 1 1
//!   level 1         band 0 0            the mean of those four, once they are written
//! ```
//! A band is made of those below it, which are made of theirs: so there is one band of each level in memory at a time, and each voxel of the
//! volume is read once. Chunks that are all 0 are not stored.
//!
//! Source of the format: OME-Zarr 0.4, <https://ngff.openmicroscopy.org/0.4/>, in Zarr of version 2. Beside the levels lie the least and greatest
//! finite value of each chunk, in arrays that the group's attribute `slicestack` names: whoever reads levels knows without reading a chunk
//! whether anything in it shows.

use super::levels::OWN;
use crate::settings::Progress;
use crate::volume::bricks::{above, below};
use crate::volume::io::write::{Writing, Written};
use crate::volume::levels::coarser;
use crate::volume::levels::plain::Source;
use crate::volume::{Channels, Grid, LengthUnit, Volume, Voxel, VoxelType, Voxels, with_voxels};
use crate::{Error, Result};
use glam::DMat3;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// Voxels along the sides of a chunk.
const CHUNK: usize = 64;
/// Where the ranges of chunks lie.
const RANGES: &str = "slicestack-ranges";

/// One level in the making.
struct Level {
    dims: [usize; 3],
    /// Voxels of the finest level that one of its own stands for, along each axis.
    steps: [usize; 3],
    /// Least and greatest finite value of each chunk, x fastest.
    ranges: Vec<(f32, f32)>,
}

impl Level {
    fn chunks(&self) -> [usize; 3] {
        self.dims.map(|n| n.div_ceil(CHUNK))
    }
}

struct Pyramid<'p> {
    source: Source,
    kind: VoxelType,
    levels: Vec<Level>,
    folder: &'p Path,
    progress: Option<&'p dyn Progress>,
    done: u64,
    bytes: u64,
    /// Least and greatest finite value of the finest level.
    range: (f64, f64),
}

/// A folder in the making under a name of its own; taken away again unless it is finished.
struct Whole<'p> {
    part: PathBuf,
    path: &'p Path,
    done: bool,
}

impl Drop for Whole<'_> {
    fn drop(&mut self) {
        if !self.done {
            // What led here is the error to report.
            drop(fs::remove_dir_all(&self.part));
        }
    }
}

impl<'p> Whole<'p> {
    fn create(path: &'p Path) -> Result<Self> {
        let Some(name) = path.file_name() else { return Err(Error::format(path, "names no folder")) };
        if path.symlink_metadata().is_ok() {
            return Err(Error::format(path, "is there already; remove it or choose another name"));
        }
        let part = path.with_file_name(format!(".{}.{}.part", name.to_string_lossy(), std::process::id()));
        fs::create_dir(&part).map_err(|e| Error::io(&part, e))?;
        Ok(Self { part, path, done: false })
    }

    fn finish(mut self) -> Result<()> {
        fs::rename(&self.part, self.path).map_err(|e| Error::io(self.path, e))?;
        self.done = true;
        Ok(())
    }
}

/// Writes `volume` as an OME-Zarr image to the folder `path`, with as many levels as it takes until one chunk holds the coarsest. The folder
/// appears whole or not at all, and replaces nothing. Voxels of a mapped file are read a band at a time.
///
/// # Errors
/// [`Error::Invalid`] for colours and labels, [`Error::Format`] where something is there already, [`Error::Io`] when the folder cannot be
/// written, [`Error::Stopped`] when it was stopped; then nothing is left.
pub fn write_pyramid(volume: &Volume, path: impl AsRef<Path>, writing: &Writing) -> Result<Written> {
    let path = path.as_ref();
    if volume.channels() != &Channels::Scalar || volume.labels().is_some() {
        return Err(Error::invalid("OME-Zarr: levels are means, which neither colours nor labels have: choose another format"));
    }
    let whole = Whole::create(path)?;
    let grid = volume.grid();
    let mut steps = [1; 3];
    let mut levels = vec![Level::new(grid.dims(), steps)];
    while levels.last().is_some_and(|level| level.chunks() != [1; 3]) {
        steps = coarser(steps, grid.dims(), grid.spacing());
        levels.push(Level::new([0, 1, 2].map(|axis| grid.dims()[axis].div_ceil(steps[axis])), steps));
    }
    let mut pyramid = Pyramid {
        source: Source::of(volume),
        kind: volume.voxels().voxel_type(),
        levels,
        folder: &whole.part,
        progress: writing.progress.as_deref(),
        done: 0,
        bytes: 0,
        range: (f64::INFINITY, f64::NEG_INFINITY),
    };
    let top = pyramid.levels.len() - 1;
    pyramid.step()?;
    let [_, ny, nz] = pyramid.levels[top].chunks();
    for z in 0..nz {
        for y in 0..ny {
            pyramid.band(top, y, z)?;
        }
    }
    let notes = pyramid.describe(volume, path)?;
    let written = Written { bytes: pyramid.bytes, voxel_type: pyramid.kind, notes };
    whole.finish()?;
    Ok(written)
}

impl Level {
    fn new(dims: [usize; 3], steps: [usize; 3]) -> Self {
        let chunks = dims.iter().map(|n| n.div_ceil(CHUNK)).product();
        Self { dims, steps, ranges: vec![(f32::INFINITY, f32::NEG_INFINITY); chunks] }
    }
}

impl Pyramid<'_> {
    /// Tells how far it has come.
    fn step(&self) -> Result<()> {
        let [_, ny, nz] = self.levels[0].chunks();
        match self.progress {
            Some(progress) if !progress.step("writing", self.done, (ny * nz) as u64) => Err(Error::Stopped),
            _ => Ok(()),
        }
    }

    /// Voxels along x, y and z of a band.
    fn size(&self, level: usize, y: usize, z: usize) -> [usize; 3] {
        let [nx, ny, nz] = self.levels[level].dims;
        [nx, (ny - y * CHUNK).min(CHUNK), (nz - z * CHUNK).min(CHUNK)]
    }

    /// The voxels of band (y,z) of `level`, after their chunks are written.
    fn band(&mut self, level: usize, y: usize, z: usize) -> Result<Voxels> {
        let size = self.size(level, y, z);
        let mut voxels = Voxels::zeros(self.kind, size.iter().product());
        if level == 0 {
            let [nx, ny, _] = self.levels[0].dims;
            let plane = size[0] * size[1] * self.kind.bytes();
            for (k, out) in voxels.as_bytes_mut().chunks_exact_mut(plane).enumerate() {
                let from = ((z * CHUNK + k) * ny + y * CHUNK) * nx * self.kind.bytes();
                out.copy_from_slice(self.source.bytes(from..from + out.len()));
                self.source.looked_at(out.len());
            }
        } else {
            let (own, under) = (self.levels[level].steps, self.levels[level - 1].steps);
            let factor = [0, 1, 2].map(|axis| own[axis] / under[axis]);
            let [_, ny, nz] = self.levels[level - 1].chunks();
            for cz in 0..factor[2] {
                for cy in 0..factor[1] {
                    let (y, z) = (y * factor[1] + cy, z * factor[2] + cz);
                    if y < ny && z < nz {
                        let fine = self.band(level - 1, y, z)?;
                        let from = self.size(level - 1, y, z);
                        let first = [cy * CHUNK / factor[1], cz * CHUNK / factor[2]];
                        with_voxels!(&fine, v => mean(v, from, factor, voxels.as_bytes_mut(), size, first));
                    }
                }
            }
        }
        self.put(level, (y, z), &voxels)?;
        if level == 0 {
            self.done += 1;
            self.step()?;
        }
        Ok(voxels)
    }

    /// Writes the chunks of a band.
    fn put(&mut self, level: usize, (y, z): (usize, usize), voxels: &Voxels) -> Result<()> {
        let size = self.size(level, y, z);
        let folder = self.folder.join(level.to_string()).join(z.to_string()).join(y.to_string());
        fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, e))?;
        let [nx, ny, _] = self.levels[level].chunks();
        let chunks: Vec<Result<((f64, f64), u64)>> =
            (0..nx).into_par_iter().map(|x| with_voxels!(voxels, v => chunk(v, size, x, &folder.join(x.to_string())))).collect();
        for (x, written) in chunks.into_iter().enumerate() {
            let ((low, high), bytes) = written?;
            self.bytes += bytes;
            if low <= high {
                self.levels[level].ranges[(z * ny + y) * nx + x] = (below(low), above(high));
                if level == 0 {
                    self.range = (self.range.0.min(low), self.range.1.max(high));
                }
            }
        }
        Ok(())
    }

    /// Writes what describes the levels; what the format does not keep.
    fn describe(&mut self, volume: &Volume, path: &Path) -> Result<Vec<String>> {
        let grid = volume.grid();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let unit = volume.unit().map(|unit| match unit {
            LengthUnit::Metre => "meter",
            LengthUnit::Centimetre => "centimeter",
            LengthUnit::Millimetre => "millimeter",
            LengthUnit::Micrometre => "micrometer",
            LengthUnit::Nanometre => "nanometer",
            LengthUnit::Angstrom => "angstrom",
        });
        let axis = |name: &str| match unit {
            Some(unit) => json!({ "name": name, "type": "space", "unit": unit }),
            None => json!({ "name": name, "type": "space" }),
        };
        let mut datasets = Vec::new();
        for (i, level) in self.levels.iter().enumerate() {
            let place = place(grid, level.steps);
            let backwards = |v: [f64; 3]| [v[2], v[1], v[0]];
            datasets.push(json!({
                "path": i.to_string(),
                "coordinateTransformations": [
                    { "type": "scale", "scale": backwards(place.0) },
                    { "type": "translation", "translation": backwards(place.1) },
                ],
            }));
        }
        let shape = |n: [usize; 3]| vec![n[2], n[1], n[0]];
        let (mut files, mut ranges) = (Vec::new(), Vec::new());
        let code = numpy(self.kind);
        for (i, level) in self.levels.iter().enumerate() {
            files.push((format!("{i}/.zarray"), array(shape(level.dims), vec![CHUNK; 3], &code)));
            let [nx, ny, nz] = level.chunks();
            let way = format!("{RANGES}/{i}");
            files.push((format!("{way}/.zarray"), array(vec![nz, ny, nx, 2], vec![nz, ny, nx, 2], "<f4")));
            let bytes: Vec<u8> = level.ranges.iter().flat_map(|&(low, high)| [low.to_le_bytes(), high.to_le_bytes()].concat()).collect();
            self.bytes += write(&self.folder.join(format!("{way}/0/0/0/0")), &bytes)?;
            ranges.push(way);
        }
        let (slope, intercept) = volume.rescale();
        let mut own = json!({ "writer": env!("CARGO_PKG_VERSION"), "ranges": ranges });
        if let Some(map) = own.as_object_mut() {
            if self.range.0 <= self.range.1 {
                map.insert("range".into(), json!([self.range.0, self.range.1]));
            }
            if (slope, intercept) != (1.0, 0.0) {
                map.insert("rescale".into(), json!([slope, intercept]));
            }
        }
        let image = json!({
            "version": "0.4",
            "name": name,
            "axes": [axis("z"), axis("y"), axis("x")],
            "datasets": datasets,
            "type": "mean",
        });
        files.push((".zattrs".into(), json!({ "multiscales": [image], OWN: own })));
        for group in ["".to_owned(), format!("{RANGES}/")] {
            files.push((format!("{group}.zgroup"), json!({ "zarr_format": 2 })));
        }
        for (way, value) in &files {
            let text = serde_json::to_vec_pretty(value).map_err(|e| Error::invalid(format!("{way}: {e}")))?;
            self.bytes += write(&self.folder.join(way), &text)?;
        }
        let mut notes = Vec::new();
        if grid.directions() != DMat3::IDENTITY {
            notes.push("OME-Zarr keeps no directions of axes: they are taken as x, y and z where it is read".to_owned());
        }
        if (slope, intercept) != (1.0, 0.0) {
            notes.push(format!(
                "OME-Zarr keeps no slope and intercept, {slope} and {intercept}: numbers are written as stored, and both beside them"
            ));
        }
        if let Some(name) = volume.modality().name() {
            notes.push(format!("OME-Zarr does not keep the kind of values: give --volume.modality {name} where it is read"));
        }
        Ok(notes)
    }
}

/// Sizes of voxels that stand for `steps` of a grid's, and the place of the first one.
fn place(grid: &Grid, steps: [usize; 3]) -> ([f64; 3], [f64; 3]) {
    let (spacing, origin) = (grid.spacing(), grid.origin());
    let middle = |axis: usize| origin[axis] + 0.5 * (steps[axis] - 1) as f64 * spacing[axis];
    ([0, 1, 2].map(|axis| spacing[axis] * steps[axis] as f64), [middle(0), middle(1), middle(2)])
}

/// The metadata of an array that is not compressed.
fn array(shape: Vec<usize>, chunks: Vec<usize>, code: &str) -> Value {
    json!({
        "zarr_format": 2,
        "shape": shape,
        "chunks": chunks,
        "dtype": code,
        "compressor": null,
        "fill_value": 0,
        "order": "C",
        "filters": null,
        "dimension_separator": "/",
    })
}

/// NumPy's code of a type, in this machine's byte order.
fn numpy(kind: VoxelType) -> String {
    let order = if kind.bytes() == 1 {
        '|'
    } else if cfg!(target_endian = "little") {
        '<'
    } else {
        '>'
    };
    let letter = match kind {
        VoxelType::U8 | VoxelType::U16 | VoxelType::U32 => 'u',
        VoxelType::I8 | VoxelType::I16 | VoxelType::I32 => 'i',
        VoxelType::F32 | VoxelType::F64 => 'f',
    };
    format!("{order}{letter}{}", kind.bytes())
}

/// Writes a new file, and the folders that it lies in.
fn write(path: &Path, bytes: &[u8]) -> Result<u64> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    }
    fs::write(path, bytes).map_err(|e| Error::io(path, e))?;
    Ok(bytes.len() as u64)
}

/// Writes chunk `x` of a band of `size` voxels to `path`, unless it is all 0: the range of its finite values, and the bytes written.
fn chunk<T: Voxel>(band: &[T], [nx, ny, nz]: [usize; 3], x: usize, path: &Path) -> Result<((f64, f64), u64)> {
    let wide = (nx - x * CHUNK).min(CHUNK);
    let mut out = vec![<T as bytemuck::Zeroable>::zeroed(); CHUNK * CHUNK * CHUNK];
    let mut range: Option<(T, T)> = None;
    for z in 0..nz {
        for y in 0..ny {
            let row = &band[(z * ny + y) * nx + x * CHUNK..][..wide];
            out[(z * CHUNK + y) * CHUNK..][..wide].copy_from_slice(row);
            for &v in row.iter().filter(|v| v.is_finite()) {
                range = Some(range.map_or((v, v), |(low, high)| (if v < low { v } else { low }, if v > high { v } else { high })));
            }
        }
    }
    let bytes: &[u8] = bytemuck::cast_slice(&out);
    let range = range.map_or((f64::INFINITY, f64::NEG_INFINITY), |(low, high)| (low.to_f64(), high.to_f64()));
    if bytes.iter().all(|&b| b == 0) {
        return Ok((range, 0));
    }
    fs::write(path, bytes).map_err(|e| Error::io(path, e))?;
    Ok((range, bytes.len() as u64))
}

/// Puts the means of boxes of `factor` voxels of `from`, a band of `size`, into `out`, a band of `whole` voxels, from row `first[0]` and
/// plane `first[1]` on. Boxes at the upper border may be smaller.
fn mean<T: Voxel>(from: &[T], size: [usize; 3], factor: [usize; 3], out: &mut [u8], whole: [usize; 3], first: [usize; 2]) {
    let out: &mut [T] = bytemuck::cast_slice_mut(out);
    let [nx, ny, _] = whole;
    let [_, rows, planes] = [0, 1, 2].map(|axis| size[axis].div_ceil(factor[axis]));
    out.par_chunks_mut(nx * ny).skip(first[1]).take(planes).enumerate().for_each(|(k, plane)| {
        for j in 0..rows {
            let to = &mut plane[(first[0] + j) * nx..][..nx];
            let range = |n: usize, axis: usize| n * factor[axis]..((n + 1) * factor[axis]).min(size[axis]);
            let lines: Vec<&[T]> =
                range(k, 2).flat_map(|z| range(j, 1).map(move |y| &from[(z * size[1] + y) * size[0]..][..size[0]])).collect();
            for (i, to) in to.iter_mut().enumerate() {
                let cells = range(i, 0);
                let count = cells.len() * lines.len();
                let sum: f64 = lines.iter().map(|line| line[cells.clone()].iter().map(|v| v.to_f64()).sum::<f64>()).sum();
                *to = T::from_f64(sum / count as f64);
            }
        }
    });
}
