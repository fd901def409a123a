//! Reading takes the voxels' memory once and a small buffer, compressed or not. Alone in its process: it measures the whole of it.

#![cfg(all(feature = "formats", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

mod peak;

use flate2::Compression;
use flate2::write::GzEncoder;
use peak::peak;
use slicestack::Volume;
use slicestack::volume::Voxels;
use std::fs::File;
use std::io::{BufWriter, Write};

#[test]
fn voxels_are_in_memory_once() {
    const SIDE: usize = 320;
    let bytes = SIDE * SIDE * SIDE * 2;
    let dir = tempfile::TempDir::new().unwrap();
    let head = |encoding| {
        let fields = format!("type: short\ndimension: 3\nsizes: {SIDE} {SIDE} {SIDE}\nendian: big\nencoding: {encoding}");
        format!("NRRD0004\n{fields}\n\n").into_bytes()
    };
    let slice: Vec<u8> = (0..SIDE * SIDE).flat_map(|i| ((i % 3000) as i16).to_be_bytes()).collect();
    let fill = |out: &mut dyn Write| (0..SIDE).for_each(|_| out.write_all(&slice).unwrap());
    let (raw, packed) = (dir.path().join("raw.nrrd"), dir.path().join("packed.nrrd"));
    let mut file = BufWriter::new(File::create(&raw).unwrap());
    file.write_all(&head("raw")).unwrap();
    fill(&mut file);
    file.flush().unwrap();
    let mut file = File::create(&packed).unwrap();
    file.write_all(&head("gzip")).unwrap();
    let mut encoder = GzEncoder::new(file, Compression::fast());
    fill(&mut encoder);
    encoder.finish().unwrap();

    // One after the other: the second may use what the first gave back.
    let before = peak();
    for path in [packed, raw] {
        let volume = Volume::open(&path).unwrap();
        assert!(matches!(volume.voxels(), Voxels::I16(v) if v[2999] == 2999 && v[SIDE * SIDE * (SIDE - 1) + 7] == 7));
        drop(volume);
        let grown = peak() - before;
        assert!(grown < bytes as u64 + (4 << 20), "{grown} bytes for {bytes} bytes of voxels from {}", path.display());
    }
}
