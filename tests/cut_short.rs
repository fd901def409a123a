//! A file that another program cuts short while it is mapped: what is missing reads as zeros, and the file is named. Alone in its process: the
//! handler is the whole process's.

#![cfg(all(feature = "formats", unix))]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

use slicestack::volume::Voxels;
use slicestack::volume::io::{self, WriteFormat, Writing, cut_file, survive_cut_files};
use slicestack::{Error, Limits};
use std::fs::{File, OpenOptions};
use std::io::Write;

#[test]
fn a_mapped_file_that_is_cut_short_is_told() {
    const SIDE: usize = 128;
    let dir = tempfile::TempDir::new().unwrap();
    let volume = |name: &str| {
        let path = dir.path().join(name);
        let mut file = File::create(&path).unwrap();
        write!(file, "NRRD0004\ntype: uchar\ndimension: 3\nsizes: {SIDE} {SIDE} {SIDE}\nencoding: raw\n\n").unwrap();
        file.write_all(&vec![7; SIDE * SIDE * SIDE]).unwrap();
        (io::read(&path, &Limits::new().map_bytes(0)).unwrap(), path)
    };
    let cut = |path: &std::path::Path, to: u64| OpenOptions::new().write(true).open(path).unwrap().set_len(to).unwrap();
    survive_cut_files().unwrap();
    let (whole, _) = volume("whole.nrrd");
    let (mapped, path) = volume("cut.nrrd");
    assert!(mapped.voxels().is_mapped());
    assert_eq!(cut_file(), None);

    cut(&path, 64 * 1024);
    let Voxels::U8(voxels) = mapped.voxels() else { unreachable!("bytes were written") };
    // The system fills the last page up with zeros itself; far behind it there is none.
    assert_eq!((voxels[0], voxels[32 * 1024], voxels[SIDE * SIDE * SIDE - 1], voxels[SIDE * SIDE * SIDE / 2]), (7, 7, 0, 0));
    assert_eq!(cut_file(), Some(path.clone()));
    // No file comes of it.
    let out = dir.path().join("out.nrrd");
    let error = io::write(&mapped, &out, &Writing::new().format(WriteFormat::Nrrd)).unwrap_err();
    assert!(matches!(&error, Error::Format { path: named, what } if *named == path && what.contains("cut short")), "{error}");
    assert!(!out.exists() && std::fs::read_dir(dir.path()).unwrap().count() == 2);
    // It is remembered after the volume has gone; others are as they were.
    drop(mapped);
    assert_eq!(cut_file(), Some(path));
    let Voxels::U8(voxels) = whole.voxels() else { unreachable!("bytes were written") };
    assert!(voxels.iter().all(|&v| v == 7));
}
