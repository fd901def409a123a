//! A series from a scanner and a Zarr of many chunks take the voxels' memory once and little more. Alone in its process: it measures the whole.

#![cfg(all(feature = "dicom", feature = "zarr", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

mod files;
mod peak;

use files::dicom;
use peak::peak;
use slicestack::Volume;
use std::fs;
use std::path::Path;

/// Voxels along each axis.
const SIDE: usize = 384;

/// A series of as many slices, two bytes a voxel.
fn series(folder: &Path) {
    let pixels: Vec<u16> = (0..SIDE * SIDE).map(|i| (i * 7 % 4096) as u16).collect();
    for z in 0..SIDE {
        let slice = dicom::slice(SIDE as u16, SIDE as u16, "9", z as i64, z as f64, &pixels);
        fs::write(folder.join(format!("IM{}", (z * 37) % SIDE)), dicom::file(&slice, "1.2.840.10008.1.2.1", None)).unwrap();
    }
}

/// An array of version 2 in chunks of a quarter of each axis, as they are or in gzip.
fn array(folder: &Path, packed: bool) {
    let chunk = SIDE / 4;
    let compressor = if packed { "{\"id\": \"gzip\", \"level\": 1}" } else { "null" };
    let text = format!(
        "{{\"zarr_format\": 2, \"shape\": [{SIDE}, {SIDE}, {SIDE}], \"chunks\": [{chunk}, {chunk}, {chunk}], \"dtype\": \"<u2\", \
         \"compressor\": {compressor}, \"fill_value\": 0, \"order\": \"C\", \"filters\": null}}"
    );
    fs::write(folder.join(".zarray"), text).unwrap();
    let numbers: Vec<u8> = (0..chunk.pow(3)).flat_map(|i| ((i * 7 % 4096) as u16).to_le_bytes()).collect();
    let bytes = if packed { files::gz(&numbers) } else { numbers };
    for i in 0..64 {
        fs::write(folder.join(format!("{}.{}.{}", i / 16, i / 4 % 4, i % 4)), &bytes).unwrap();
    }
}

#[test]
fn series_and_chunks_are_in_memory_once() {
    let voxels = 2 * SIDE.pow(3) as u64;
    let dir = tempfile::tempdir().unwrap();
    let folder = |name: &str| {
        let path = dir.path().join(name);
        fs::create_dir(&path).unwrap();
        path
    };
    let (scan, plain, packed) = (folder("scan"), folder("plain"), folder("packed"));
    series(&scan);
    array(&plain, false);
    array(&packed, true);
    let before = peak();
    for path in [scan, plain, packed] {
        let volume = Volume::open(&path).unwrap();
        assert_eq!((volume.grid().dims(), volume.voxels().get(1)), ([SIDE; 3], 7.0), "{}", path.display());
        drop(volume);
        let grown = peak() - before;
        assert!(grown < voxels * 13 / 10 + (64 << 20), "{grown} bytes for {voxels} bytes of voxels from {}", path.display());
    }
}
