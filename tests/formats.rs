//! What files hold beside one volume of numbers: colours, channels, frames, several arrays, voxels in many files, transforms that cannot be used.

#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

mod files;

use files::{gz, npy_raw, put_f32, put_i16, zlib};
use slicestack::Volume;
use slicestack::volume::io::{self, Choice, Endian, Part, Reading};
use slicestack::volume::{Channels, Colors, LengthUnit, Space, Voxels};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder of files.
struct Dir(TempDir);

impl Dir {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn save(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

/// The volume in a file of that name and content.
fn volume_of(name: &str, bytes: impl AsRef<[u8]>) -> Volume {
    chosen(name, bytes, Choice::new()).unwrap()
}

fn chosen(name: &str, bytes: impl AsRef<[u8]>, choice: Choice) -> slicestack::Result<Volume> {
    io::read_as(Dir::new().save(name, bytes), &Reading::new().choice(choice))
}

fn refused(name: &str, bytes: impl AsRef<[u8]>, choice: Choice) -> String {
    chosen(name, bytes, choice).unwrap_err().to_string()
}

fn stored(volume: &Volume) -> Vec<f64> {
    (0..volume.voxels().len()).map(|i| volume.voxels().get(i)).collect()
}

fn spacing(volume: &Volume) -> [f64; 3] {
    volume.grid().spacing()
}

fn noted(volume: &Volume, words: &[&str]) {
    let notes = volume.notes().join("\n");
    for word in words {
        assert!(notes.contains(word), "{word:?} is not in {notes:?}");
    }
}

fn nrrd(fields: &str, data: &[u8]) -> Vec<u8> {
    [format!("NRRD0005\n{fields}\n\n").as_bytes(), data].concat()
}

/// 0, 1, 2 ...
fn counting(n: usize) -> Vec<u8> {
    (0..n).map(|i| i as u8).collect()
}

fn bzip2(bytes: &[u8]) -> Vec<u8> {
    let mut out = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::best());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

#[test]
fn colours_of_nrrd_are_colours() {
    let bytes = nrrd("type: uchar\ndimension: 3\nsizes: 3 2 2\nkinds: RGB-color domain domain\nencoding: raw", &counting(12));
    let volume = volume_of("a.nrrd", &bytes);
    assert_eq!((volume.grid().dims(), volume.channels()), ([2, 2, 1], &Channels::Rgb));
    let Some(Colors::U8(colors)) = volume.colors() else { panic!("bytes") };
    assert_eq!(colors, [[0, 1, 2, 255], [3, 4, 5, 255], [6, 7, 8, 255], [9, 10, 11, 255]]);
    let green = chosen("a.nrrd", &bytes, Choice::new().channel(1)).unwrap();
    assert_eq!(stored(&green), [1.0, 4.0, 7.0, 10.0]);
    assert!(refused("a.nrrd", &bytes, Choice::new().channel(3)).contains("volume.channel is 3: there are 3, 0 to 2"));

    let four = nrrd("type: float\nendian: big\ndimension: 4\nsizes: 4 1 1 1\nkinds: RGBA-color space space space\nencoding: raw", &{
        [0.5f32, 0.25, 1.0, 0.75].into_iter().flat_map(f32::to_be_bytes).collect::<Vec<_>>()
    });
    let Some(Colors::F32(colors)) = volume_of("b.nrrd", &four).colors().map(|c| match c {
        Colors::F32(c) => Colors::F32(Box::leak(c.to_vec().into_boxed_slice())),
        other => panic!("{other:?}"),
    }) else {
        panic!("colours")
    };
    assert_eq!(colors, [[0.5, 0.25, 1.0, 0.75]]);

    let wide = nrrd("type: int\nendian: little\ndimension: 3\nsizes: 3 1 1\nkinds: RGB-color domain domain\nencoding: raw", &[0; 12]);
    assert!(refused("c.nrrd", &wide, Choice::new()).contains("colours of i32"));
    assert_eq!(stored(&chosen("c.nrrd", &wide, Choice::new().channel(0)).unwrap()), [0.0]);
}

#[test]
fn frames_and_channels_of_nrrd() {
    let head = "type: uchar\ndimension: 4\nsizes: 2 1 2 3\nkinds: space space space list\nencoding: ";
    for (encoding, data) in [
        ("raw", counting(12)),
        ("gzip", gz(&counting(12))),
        ("bzip2", bzip2(&counting(12))),
        ("hex", counting(12).iter().map(|b| format!("{b:02x}\n")).collect::<String>().into_bytes()),
        ("ascii", counting(12).iter().map(|b| format!("{b} ")).collect::<String>().into_bytes()),
    ] {
        let bytes = nrrd(&format!("{head}{encoding}"), &data);
        for frame in 0..3 {
            let volume = chosen("a.nrrd", &bytes, Choice::new().frame(frame)).unwrap();
            assert_eq!(stored(&volume), [0, 1, 2, 3].map(|i| (4 * frame + i) as f64), "{encoding}");
            assert!(volume.notes().is_empty());
        }
        noted(&volume_of("a.nrrd", &bytes), &["frame 0 of 3 is read", "volume.frame"]);
        assert!(refused("a.nrrd", &bytes, Choice::new().frame(3)).contains("volume.frame is 3: there are 3, 0 to 2"));
        assert!(refused("a.nrrd", &bytes, Choice::new().channel(1)).contains("one channel only"));
        assert!(refused("a.nrrd", &bytes, Choice::new().series("1")).contains("NRRD has no series to choose"));
    }
    // Frames first, and channels that are no colour.
    let first = nrrd("type: uchar\ndimension: 4\nsizes: 3 2 1 2\nkinds: list space space space\nencoding: raw", &counting(12));
    assert_eq!(stored(&chosen("b.nrrd", &first, Choice::new().frame(1)).unwrap()), [1.0, 4.0, 7.0, 10.0]);
    let vector = nrrd("type: uchar\ndimension: 4\nsizes: 3 2 1 2\nkinds: vector space space space\nencoding: raw", &counting(12));
    let volume = volume_of("c.nrrd", &vector);
    assert_eq!(stored(&volume), [0.0, 3.0, 6.0, 9.0]);
    noted(&volume, &["channel 0 of 3 is read"]);
    let by_direction =
        "type: uchar\ndimension: 4\nsizes: 2 1 2 3\nspace: LPS\nspace directions: (1,0,0) (0,2,0) (0,0,3) none\nencoding: raw";
    let volume = chosen("d.nrrd", nrrd(by_direction, &counting(12)), Choice::new().frame(2)).unwrap();
    assert_eq!((stored(&volume), spacing(&volume)), (vec![8.0, 9.0, 10.0, 11.0], [1.0, 2.0, 3.0]));
    // Two axes of frames count on.
    let five = nrrd("type: uchar\ndimension: 5\nsizes: 1 1 1 2 3\nkinds: space space space list time\nencoding: raw", &counting(6));
    assert_eq!(stored(&chosen("g.nrrd", &five, Choice::new().frame(5)).unwrap()), [5.0]);
    let both = nrrd("type: uchar\ndimension: 5\nsizes: 2 1 1 1 3\nkinds: list space space space list\nencoding: raw", &counting(6));
    assert!(refused("h.nrrd", &both, Choice::new()).contains("both before and behind"));
    // Nothing tells: a short first axis is one of channels, else the last one is one of frames.
    let plain = |sizes: &str| nrrd(&format!("type: uchar\ndimension: 4\nsizes: {sizes}\nencoding: raw"), &[7; 1500]);
    assert_eq!(volume_of("e.nrrd", plain("3 5 5 5")).grid().dims(), [5, 5, 5]);
    assert_eq!(volume_of("e.nrrd", plain("5 5 6 7")).grid().dims(), [5, 5, 6]);
    let middle = nrrd("type: uchar\ndimension: 4\nsizes: 2 3 1 2\nkinds: space vector space space\nencoding: raw", &counting(12));
    assert!(refused("f.nrrd", &middle, Choice::new()).contains("axis 1, of size 3, lies between axes of space"));

    let dir = Dir::new();
    let items = io::list(dir.save("a.nrrd", nrrd(&format!("{head}raw"), &counting(12))), &Reading::new()).unwrap();
    assert_eq!(items.iter().map(|i| (i.part, i.id.as_str(), i.count)).collect::<Vec<_>>(), [(Part::Frame, "0", 3)]);
}

#[test]
fn segments_of_nrrd_are_named() {
    let head = "type: uchar\ndimension: 3\nsizes: 2 1 2\nencoding: raw\nSegment0_LabelValue:=1\nSegment0_Name:=left\\\\kidney\nSegment0_Color:=0.5 0.25 1\n\
                Segment1_LabelValue:=3\nSegment1_Name:=liver\nSegment2_Name:=no label";
    let volume = volume_of("a.seg.nrrd", nrrd(head, &counting(4)));
    let Channels::Label(segments) = volume.channels() else { panic!("{:?}", volume.channels()) };
    let told: Vec<_> = segments.iter().map(|s| (s.value, s.name.as_str(), s.color)).collect();
    assert_eq!(told, [(1, "left\\kidney", Some([0.5, 0.25, 1.0])), (3, "liver", None)]);
    let twice = volume_of("b.seg.nrrd", nrrd(&head.replace(":=3", ":=1"), &counting(4)));
    assert_eq!(twice.channels(), &Channels::Scalar);
    noted(&twice, &["the names of segments are left out", "same label 1"]);
    let layers = head.replace("dimension: 3\nsizes: 2 1 2", "dimension: 4\nsizes: 2 2 1 1\nkinds: list domain domain domain")
        + "\nSegment0_Layer:=0\nSegment1_Layer:=1";
    let Channels::Label(segments) = chosen("c.seg.nrrd", nrrd(&layers, &counting(4)), Choice::new().frame(1)).unwrap().channels().clone()
    else {
        panic!("labels")
    };
    assert_eq!(segments.iter().map(|s| s.value).collect::<Vec<_>>(), [3]);
}

#[test]
fn spacings_hold_where_no_axis_has_a_direction() {
    let head = "type: uchar\ndimension: 3\nspace: RAS\nsizes: 2 1 2\nspacings: 2 3 5\nspace directions: none none none\nspace origin: (10,12,100)\n\
                kinds: space space space\nencoding: raw";
    let volume = volume_of("a.nrrd", nrrd(head, &counting(4)));
    assert_eq!(
        (spacing(&volume), volume.grid().origin().to_array(), volume.grid().space()),
        ([2.0, 3.0, 5.0], [10.0, 12.0, 100.0], Space::Ras)
    );
    let old = volume_of("b.nrrd", b"NRRD00.01\ntype: uchar\ndimension: 3\nsizes: 2 1 2\nencoding: raw\n\n\x01\x02\x03\x04");
    assert_eq!(stored(&old), [1.0, 2.0, 3.0, 4.0]);
}

#[test]
fn voxels_of_nrrd_in_other_files() {
    let dir = Dir::new();
    let head = |rest: &str| format!("NRRD0005\ntype: uchar\ndimension: 3\nsizes: 2 1 4\n{rest}");
    let open = |rest: &str| {
        let path = dir.save("a.nhdr", head(rest));
        Volume::open(path).map(|v| stored(&v)).map_err(|e| e.to_string())
    };
    let whole: Vec<f64> = (0..8).map(f64::from).collect();
    dir.save("dose 20% iter a.raw", counting(8));
    assert_eq!(open("encoding: raw\ndata file: dose 20% iter a.raw\n"), Ok(whole.clone()));
    // Skipped from the end of what is inflated.
    dir.save("tail.gz", gz(&[&[99; 5][..], &counting(8)].concat()));
    dir.save("tail.bz2", bzip2(&[&[99; 5][..], &counting(8)].concat()));
    dir.save("tail.raw", [&b"line\n99999"[..], &counting(8)].concat());
    assert_eq!(open("encoding: gzip\nbyte skip: -1\ndata file: tail.gz\n"), Ok(whole.clone()));
    assert_eq!(open("encoding: gzip\nbyte skip: 5\ndata file: tail.gz\n"), Ok(whole.clone()));
    assert_eq!(open("encoding: bzip2\nbyte skip: -1\ndata file: tail.bz2\n"), Ok(whole.clone()));
    assert_eq!(open("encoding: raw\nline skip: 1\nbyte skip: -1\ndata file: tail.raw\n"), Ok(whole.clone()));
    assert_eq!(open("encoding: raw\nline skip: 1\nbyte skip: 5\ndata file: tail.raw\n"), Ok(whole.clone()));
    assert!(open("encoding: hex\nbyte skip: -1\ndata file: tail.gz\n").unwrap_err().contains("byte skip is -1"));
    dir.save("digits.txt", [&b"zzz"[..], counting(8).iter().map(|b| format!("{b:02x}")).collect::<String>().as_bytes()].concat());
    assert_eq!(open("encoding: hex\nbyte skip: 3\ndata file: digits.txt\n"), Ok(whole.clone()));
    dir.save("LISTA.raw", counting(8));
    assert_eq!(open("data file: LISTA.raw\nencoding: raw\n"), Ok(whole.clone()));
    assert!(open("encoding: raw\nline skip: -1\ndata file: LISTA.raw\n").unwrap_err().contains("line skip is -1"));
    let short = open("encoding: gzip\nbyte skip: -1\ndata file: short.gz\n");
    assert!(short.unwrap_err().contains("short.gz"));
    // Two slices in each of two files, by a pattern and by a list; compressed too.
    for (name, bytes) in [("s01.raw", counting(4)), ("s03.raw", (4..8).collect())] {
        dir.save(name, &bytes);
        dir.save(&format!("{name}.gz"), gz(&bytes));
    }
    assert_eq!(open("encoding: raw\ndata file: s%02d.raw 1 3 2\n"), Ok(whole.clone()));
    assert_eq!(open("encoding: raw\ndata file: s%02d.raw 1 3 2 2\n"), Ok(whole.clone()));
    assert_eq!(open("encoding: gzip\ndata file: s%02d.raw.gz 1 3 2\n"), Ok(whole.clone()));
    assert_eq!(open("encoding: raw\ndata file: LIST\ns01.raw\ns03.raw\n"), Ok(whole.clone()));
    assert_eq!(open("encoding: raw\ndata file: LIST 2\ns03.raw\n\ns01.raw\n"), Ok([&whole[4..], &whole[..4]].concat()));
    assert!(open("encoding: raw\ndata file: LIST\ns01.raw\ns02.raw\n").unwrap_err().contains("s02.raw"));
    assert!(open("encoding: raw\ndata file: LIST\ns01.raw\ns03.raw\ns01.raw\n").unwrap_err().contains("evenly among 3 files"));
    dir.save("s03.raw", [1, 2, 3]);
    let line = open("encoding: raw\ndata file: LIST\ns01.raw\ns03.raw\n").unwrap_err();
    assert!(line.contains("s03.raw: 4 bytes of voxels are needed, the file holds 3"), "{line}");
    dir.save("s03.raw.gz", gz(&[1, 2, 3]));
    let line = open("encoding: gzip\ndata file: LIST\ns01.raw.gz\ns03.raw.gz\n").unwrap_err();
    assert!(line.contains("s03.raw.gz: 1 bytes of voxels are missing at its end") && !line.contains('\n'), "{line}");
}

/// A NIfTI-1 file of `dims` (as many axes as given), and what `change` makes of its header.
fn nifti(dims: &[i16], datatype: i16, bits: i16, data: &[u8], endian: Endian, change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = vec![0u8; 352];
    bytes[..4].copy_from_slice(&if endian == Endian::Big { 348u32.to_be_bytes() } else { 348u32.to_le_bytes() });
    put_i16(&mut bytes, 40, dims.len() as i16, endian);
    dims.iter().enumerate().for_each(|(i, &n)| put_i16(&mut bytes, 42 + 2 * i, n, endian));
    put_i16(&mut bytes, 70, datatype, endian);
    put_i16(&mut bytes, 72, bits, endian);
    for (i, size) in [1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
        put_f32(&mut bytes, 76 + 4 * i, size, endian);
    }
    put_f32(&mut bytes, 108, 352.0, endian);
    bytes[344..348].copy_from_slice(b"n+1\0");
    change(&mut bytes);
    bytes.extend_from_slice(data);
    bytes
}

#[test]
fn frames_channels_and_colours_of_nifti() {
    for endian in [Endian::Little, Endian::Big] {
        let four = nifti(&[2, 1, 2, 3], 2, 8, &counting(12), endian, |_| {});
        for frame in 0..3 {
            let volume = chosen("a.nii", &four, Choice::new().frame(frame)).unwrap();
            assert_eq!((stored(&volume), spacing(&volume)), ([0, 1, 2, 3].map(|i| (4 * frame + i) as f64).to_vec(), [2.0, 3.0, 4.0]));
        }
        let five = nifti(&[2, 1, 1, 2, 3], 2, 8, &counting(12), endian, |_| {});
        let volume = chosen("a.nii.gz", gz(&five), Choice::new().frame(1).channel(2)).unwrap();
        assert_eq!(stored(&volume), [10.0, 11.0]);
        noted(&volume_of("a.nii", &five), &["frame 0 of 2", "channel 0 of 3"]);
        let zero = volume_of("z.nii", nifti(&[2, 1, 2, 0], 2, 8, &counting(4), endian, |_| {}));
        assert_eq!(zero.grid().dims(), [2, 1, 2]);
        noted(&zero, &["dim[4] is 0: it is taken for 1"]);
        let rgb = volume_of("rgb.nii", nifti(&[2, 1, 1], 128, 24, &counting(6), endian, |_| {}));
        assert!(matches!(rgb.colors(), Some(Colors::U8([[0, 1, 2, 255], [3, 4, 5, 255]]))));
        let rgba = volume_of("rgba.nii", nifti(&[2, 1, 1], 2304, 32, &counting(8), endian, |_| {}));
        assert!(matches!(rgba.colors(), Some(Colors::U8([[0, 1, 2, 3], [4, 5, 6, 7]]))));
        let numbers = |bytes: fn(f32) -> [u8; 4]| [3.0, -4.0, 0.0, 2.0].into_iter().flat_map(bytes).collect::<Vec<u8>>();
        let data = if endian == Endian::Big { numbers(f32::to_be_bytes) } else { numbers(f32::to_le_bytes) };
        assert_eq!(stored(&volume_of("c.nii", nifti(&[2, 1, 1], 32, 64, &data, endian, |_| {}))), [5.0, 2.0]);
    }
}

#[test]
fn transforms_of_nifti_that_cannot_be_used_give_way() {
    let endian = Endian::Little;
    let of = |change: fn(&mut Vec<u8>)| volume_of("a.nii", nifti(&[2, 1, 2], 2, 8, &counting(4), endian, change));
    // A turn by half around z.
    let qform = |b: &mut Vec<u8>| {
        put_i16(b, 252, 1, LE);
        put_f32(b, 264, 1.0, LE);
        put_f32(b, 268, 7.0, LE);
    };
    const LE: Endian = Endian::Little;
    let none = of(|_| {});
    assert_eq!((none.grid().space(), spacing(&none)), (Space::Unknown, [2.0, 3.0, 4.0]));
    noted(&none, &["sform_code and qform_code are 0"]);
    let by_qform = volume_of("a.nii", nifti(&[2, 1, 2], 2, 8, &counting(4), endian, |b| qform(b)));
    assert_eq!((by_qform.grid().space(), by_qform.grid().origin().x, by_qform.notes().len()), (Space::Ras, 7.0, 0));
    for flat in [0.0, f32::NAN] {
        let both = volume_of(
            "a.nii",
            nifti(&[2, 1, 2], 2, 8, &counting(4), endian, |b| {
                qform(b);
                put_i16(b, 254, 1, LE);
                put_f32(b, 280, flat, LE);
            }),
        );
        assert_eq!(both.grid(), by_qform.grid());
        noted(&both, &["the sform cannot be used", "the qform is taken"]);
    }
    let sizes = of(|b| {
        put_i16(b, 254, 1, LE);
        put_i16(b, 252, 1, LE);
        put_f32(b, 256, 3.0, LE);
    });
    assert_eq!((sizes.grid().space(), spacing(&sizes)), (Space::Unknown, [2.0, 3.0, 4.0]));
    noted(&sizes, &["the sform cannot be used", "the qform cannot be used (quatern 3"]);
    let zero = of(|b| put_f32(b, 84, 0.0, LE));
    assert_eq!(spacing(&zero), [2.0, 1.0, 4.0]);
    let zero = of(|b| put_f32(b, 88, 0.0, LE));
    noted(&zero, &["pixdim[3] is 0: it is taken for 1"]);
}

#[test]
fn nifti_2_and_analyze_are_read() {
    for endian in [Endian::Little, Endian::Big] {
        let mut bytes = vec![0u8; 544];
        let big = endian == Endian::Big;
        let mut put = |at: usize, number: &[u8]| {
            let mut number = number.to_vec();
            if big {
                number.reverse();
            }
            bytes[at..at + number.len()].copy_from_slice(&number);
        };
        put(0, &540i32.to_le_bytes());
        put(12, &4i16.to_le_bytes());
        put(14, &16i16.to_le_bytes());
        for (i, n) in [4i64, 2, 1, 2, 2, 0, 0, 0].into_iter().enumerate() {
            put(16 + 8 * i, &n.to_le_bytes());
        }
        put(168, &544i64.to_le_bytes());
        put(176, &2f64.to_le_bytes());
        put(184, &(-1f64).to_le_bytes());
        put(348, &1i32.to_le_bytes());
        for (i, x) in [0.5, 0.0, 0.0, 10.0, 0.0, 0.25, 0.0, 20.0, 0.0, 0.0, 2.0, 30.0].into_iter().enumerate() {
            put(400 + 8 * i, &f64::to_le_bytes(x));
        }
        put(500, &3i32.to_le_bytes());
        bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
        for i in 0..8i16 {
            bytes.extend(if big { (i - 3).to_be_bytes() } else { (i - 3).to_le_bytes() });
        }
        let volume = chosen("a.nii", &bytes, Choice::new().frame(1)).unwrap();
        assert_eq!((stored(&volume), volume.rescale()), (vec![1.0, 2.0, 3.0, 4.0], (2.0, -1.0)));
        assert_eq!((spacing(&volume), volume.grid().origin().to_array()), ([0.5, 0.25, 2.0], [10.0, 20.0, 30.0]));
        assert_eq!(volume.unit(), Some(LengthUnit::Micrometre));

        let mut head = nifti(&[2, 1, 2, 1], 4, 16, &[], endian, |b| b[344..348].fill(0));
        head.truncate(348);
        put_f32(&mut head, 108, 0.0, endian);
        let dir = Dir::new();
        let path = dir.save("old.hdr", &head);
        dir.save("old.img", (0..4i16).flat_map(|i| if big { i.to_be_bytes() } else { i.to_le_bytes() }).collect::<Vec<_>>());
        for name in [path, dir.0.path().join("old.img")] {
            let volume = Volume::open(name).unwrap();
            assert_eq!(
                (stored(&volume), spacing(&volume), volume.grid().space()),
                (vec![0.0, 1.0, 2.0, 3.0], [2.0, 3.0, 4.0], Space::Unknown)
            );
            noted(&volume, &["ANALYZE 7.5", "left and right"]);
        }
    }
}

#[test]
fn headers_of_metaimage_with_colons_comments_channels_frames_and_lists() {
    let dir = Dir::new();
    let open = |header: &str, data: &[u8], choice: Choice| {
        let path = dir.save("a.mhd", [header.as_bytes(), data].concat());
        io::read_as(path, &Reading::new().choice(choice))
    };
    let plain = "# written by hand\nNDims: 3\nDimSize: 2 1 2\n# a comment = in between\nElementType: MET_UCHAR\nElementDataFile: LOCAL\n";
    assert_eq!(stored(&open(plain, &counting(4), Choice::new()).unwrap()), [0.0, 1.0, 2.0, 3.0]);
    let head = |dims: &str, rest: &str, file: &str| {
        format!("NDims = {}\nDimSize = {dims}\nElementType = MET_UCHAR\n{rest}ElementDataFile = {file}\n", dims.split(' ').count())
    };
    let rgb = open(&head("2 1 1", "ElementNumberOfChannels = 3\n", "LOCAL"), &counting(6), Choice::new()).unwrap();
    assert!(matches!(rgb.colors(), Some(Colors::U8([[0, 1, 2, 255], [3, 4, 5, 255]]))));
    let two = open(&head("2 1 1", "ElementNumberOfChannels = 2\n", "LOCAL"), &counting(4), Choice::new().channel(1)).unwrap();
    assert_eq!(stored(&two), [1.0, 3.0]);
    for (rest, data) in [("", counting(8)), ("CompressedData = True\n", zlib(&counting(8)))] {
        let frame = open(&head("2 1 2 2", rest, "LOCAL"), &data, Choice::new().frame(1)).unwrap();
        assert_eq!(stored(&frame), [4.0, 5.0, 6.0, 7.0]);
    }
    for (name, bytes) in [("s1.raw", [0, 1, 2]), ("s2.raw", [3, 4, 5])] {
        dir.save(name, [&b"xx"[..], &bytes].concat());
    }
    let all = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    for header in [
        head("3 1 2", "HeaderSize = -1\n", "LIST") + "s1.raw\ns2.raw\n",
        head("3 1 2", "HeaderSize = 2\n", "LIST 2D") + "s1.raw\ns2.raw\n",
        head("3 1 2", "HeaderSize = 2\n", "s%d.raw 1 2 1"),
    ] {
        assert_eq!(stored(&open(&header, &[], Choice::new()).unwrap()), all, "{header}");
    }
    assert!(open(&(head("3 1 2", "", "LIST") + "s1.raw\ns9.raw\n"), &[], Choice::new()).unwrap_err().to_string().contains("s9.raw"));
}

fn vtk(encoding: &str, rest: &[&[u8]]) -> Vec<u8> {
    [format!("# vtk DataFile Version 3.0\nt\n{encoding}\nDATASET STRUCTURED_POINTS\n").as_bytes(), &rest.concat()].concat()
}

#[test]
fn sections_of_vtk_may_stand_anywhere() {
    let text = vtk(
        "ASCII",
        &[b"FIELD FieldData 2\nTIME 1 1 double\n1.5\nCYCLE 1 1 int\n7\nDIMENSIONS 2 2 1\nORIGIN 1 2 3\nSPACING 0.5 0.25 0\n\
                  POINT_DATA 4\nSCALARS d float 1\n\nLOOKUP_TABLE default\n\n0 1\n2 3\n"],
    );
    let volume = volume_of("a.vtk", &text);
    assert_eq!((stored(&volume), spacing(&volume)), (vec![0.0, 1.0, 2.0, 3.0], [0.5, 0.25, 1.0]));
    assert_eq!(volume.grid().origin().to_array(), [1.0, 2.0, 3.0]);
    noted(&volume, &["spacing along axis 2, of one point, is 0"]);
    let colors =
        vtk("BINARY", &[b"DIMENSIONS 2 1 1\nSPACING 1 1 1\nORIGIN 0 0 0\nPOINT_DATA 2\nCOLOR_SCALARS rgb 3\n", &counting(6), b"\n"]);
    assert!(matches!(volume_of("b.vtk", &colors).colors(), Some(Colors::U8([[0, 1, 2, 255], [3, 4, 5, 255]]))));
    let colors = vtk("ASCII", &[b"DIMENSIONS 2 1 1\nPOINT_DATA 2\nCOLOR_SCALARS rgba 4\n0 0.2 0.4 1 1 0.6 0 0\n"]);
    assert!(matches!(volume_of("c.vtk", &colors).colors(), Some(Colors::U8([[0, 51, 102, 255], [255, 153, 0, 0]]))));
    assert_eq!(stored(&chosen("c.vtk", &colors, Choice::new().channel(1)).unwrap()), [51.0, 153.0]);
    // VTK writes every array of bytes so that is active, of however many components; in other sections bytes are whole numbers.
    let mask = vtk("ASCII", &[b"DIMENSIONS 3 1 1\nPOINT_DATA 3\nCOLOR_SCALARS mask 1\n0 1 0.501961\n"]);
    assert_eq!(stored(&volume_of("d.vtk", &mask)), [0.0, 255.0, 128.0]);
    let whole = vtk("ASCII", &[b"DIMENSIONS 2 1 1\nPOINT_DATA 2\nSCALARS rgb unsigned_char 3\nLOOKUP_TABLE default\n0 128 255 1 2 3\n"]);
    assert!(matches!(volume_of("e.vtk", &whole).colors(), Some(Colors::U8([[0, 128, 255, 255], [1, 2, 3, 255]]))));
    let fields = vtk("ASCII", &[b"DIMENSIONS 2 1 1\nPOINT_DATA 2\nFIELD FieldData 2\na 1 2 float\n1.5 2\nb 1 2 int\n3 4\n"]);
    assert_eq!(stored(&volume_of("f.vtk", &fields)), [1.5, 2.0]);
    assert_eq!(stored(&chosen("f.vtk", &fields, Choice::new().array("b")).unwrap()), [3.0, 4.0]);
}

#[test]
fn claims_that_would_take_long_end_soon() {
    let start = std::time::Instant::now();
    let texts = vtk("ASCII", &[b"DIMENSIONS 2 2 2\nFIELD f 1\nnames 1 999999999999999 string\nx\n"]);
    assert!(refused("a.vtk", &texts, Choice::new()).contains("999999999999999 texts are announced, only 1 are there"));
    let huge = vtk("ASCII", &[b"DIMENSIONS 2 1 1\nPOINT_DATA 2\nSCALARS a int 9223372036854775808\n1 2\n"]);
    assert!(refused("b.vtk", &huge, Choice::new()).starts_with('/'));
    let axes = "2 ".repeat(100_000);
    let line = refused("c.nrrd", nrrd(&format!("type: uchar\ndimension: 100000\nsizes: {axes}\nencoding: raw"), &[]), Choice::new());
    assert!(line.contains("100000 dimensions: at most 16"), "{line}");
    let segments: String = (0..30_000).map(|i| format!("Segment{i}_LabelValue:={i}\n")).collect();
    let head = format!("type: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n{}", segments.trim_end());
    assert!(volume_of("d.nrrd", nrrd(&head, &[1])).notes()[0].contains("does not fit u8"));
    let many = npy_raw(2, &format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({}), }}", "1,".repeat(300_000)), &[1]);
    assert!(refused("e.npy", &many, Choice::new()).contains("more than 64 dimensions"));
    let wide = nrrd(
        "type: uchar\ndimension: 4\nsizes: 80000000 1 1 1\nkinds: vector domain domain domain\nencoding: bzip2",
        &bzip2(&vec![0; 1 << 20]),
    );
    assert!(refused("f.nrrd", &wide, Choice::new()).contains("80000000 numbers of u8 a voxel"));
    assert!(start.elapsed() < std::time::Duration::from_secs(5), "{:?}", start.elapsed());
}

#[test]
fn arrays_of_vtk_are_chosen_by_name() {
    let metadata = b"METADATA\nINFORMATION 1\nNAME X LOCATION y\nDATA 1\n\n";
    let float = |x: f32| x.to_be_bytes();
    let cells: Vec<u8> = [10.0, 11.0].into_iter().flat_map(float).collect();
    let vectors: Vec<u8> = (0..18).flat_map(|i| float(i as f32)).collect();
    let bytes = vtk(
        "BINARY",
        &[
            b"DIMENSIONS 3 2 1\nSPACING 1 1 1\nORIGIN 0 0 0\nCELL_DATA 2\nSCALARS c float\nLOOKUP_TABLE default\n",
            &cells,
            b"\n",
            metadata,
            b"POINT_DATA 6\nVECTORS v float\n",
            &vectors,
            b"\nFIELD f 2\nother 1 6 unsigned_char\n",
            &[9; 6],
            b"\nmore 1 6 short\n",
            &[0, 7, 0, 7, 0, 7, 0, 7, 0, 7, 0, 8],
            b"\nSCALARS s unsigned_char 1\nLOOKUP_TABLE own\n",
            &counting(6),
            b"\nLOOKUP_TABLE own 2\n",
            &[1; 8],
            b"\n",
        ],
    );
    let volume = volume_of("a.vtk", &bytes);
    assert_eq!(stored(&volume), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    noted(&volume, &["array \"s\" of 5 is read", "volume.array"]);
    let array = |name: &str| chosen("a.vtk", &bytes, Choice::new().array(name)).unwrap();
    assert_eq!(stored(&array("other")), [9.0; 6]);
    assert_eq!(stored(&array("more")), [7.0, 7.0, 7.0, 7.0, 7.0, 8.0]);
    let of_cells = array("c");
    assert_eq!((stored(&of_cells), of_cells.grid().dims(), of_cells.grid().origin().x), (vec![10.0, 11.0], [2, 1, 1], 0.5));
    let x = array("v");
    assert_eq!(stored(&x), [0.0, 3.0, 6.0, 9.0, 12.0, 15.0]);
    noted(&x, &["channel 0 of 3"]);
    let z = chosen("a.vtk", &bytes, Choice::new().array("v").channel(2)).unwrap();
    assert_eq!(stored(&z), [2.0, 5.0, 8.0, 11.0, 14.0, 17.0]);
    let line = refused("a.vtk", &bytes, Choice::new().array("t"));
    assert!(line.contains("volume.array is \"t\": there are \"c\", \"v\", \"other\", \"more\", \"s\""), "{line}");
    let dir = Dir::new();
    let items = io::list(dir.save("a.vtk", &bytes), &Reading::new()).unwrap();
    let taken: Vec<&str> = items.iter().filter(|i| i.taken).map(|i| i.id.as_str()).collect();
    assert_eq!((items.len(), taken), (5, vec!["s"]));
}

#[test]
fn numpy_arrays_of_frames_colours_and_other_numbers() {
    let array = |descr: &str, shape: &str, data: &[u8]| {
        npy_raw(1, &format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"), data)
    };
    let four = array("|u1", "(3, 2, 2, 2)", &counting(24));
    assert_eq!(stored(&chosen("a.npy", &four, Choice::new().frame(2)).unwrap()), (16..24).map(f64::from).collect::<Vec<_>>());
    noted(&volume_of("a.npy", &four), &["frame 0 of 3"]);
    let colors = array("|u1", "(1, 1, 2, 3)", &counting(6));
    assert!(matches!(volume_of("b.npy", &colors).colors(), Some(Colors::U8([[0, 1, 2, 255], [3, 4, 5, 255]]))));
    let half = array(">f2", "(1, 1, 3)", &[0x3c, 0, 0xc0, 0, 0x7c, 0]);
    // Of other numbers too, unless a frame is asked for.
    let words: Vec<u8> = (0..24u16).flat_map(u16::to_le_bytes).collect();
    let image = array("<u2", "(1, 2, 3, 4)", &words);
    assert!(matches!(volume_of("u.npy", &image).colors(), Some(Colors::U16([[0, 1, 2, 3], .., [20, 21, 22, 23]]))));
    assert_eq!(stored(&chosen("u.npy", &image, Choice::new().frame(0)).unwrap()), (0..24).map(f64::from).collect::<Vec<_>>());
    let floats: Vec<u8> = (0..24u16).flat_map(|n| f32::from(n).to_le_bytes()).collect();
    let colors = volume_of("f.npy", array("<f4", "(1, 2, 3, 4)", &floats));
    assert!(matches!(colors.colors(), Some(Colors::F32(list)) if list.len() == 6 && list[1] == [4.0, 5.0, 6.0, 7.0]));
    let vectors = volume_of("g.npy", array("<f4", "(2, 2, 2, 3)", &floats));
    assert_eq!(stored(&vectors), (0..8).map(|n| f64::from(3 * n)).collect::<Vec<_>>());
    noted(&vectors, &["channel 0 of 3 is read"]);
    assert_eq!(volume_of("c.npy", &half).voxels(), &Voxels::F32(vec![1.0, -2.0, f32::INFINITY].into()));
    let complex: Vec<u8> = [3f64, 4.0].into_iter().flat_map(f64::to_le_bytes).collect();
    assert_eq!(volume_of("d.npy", array("<c16", "(1, 1, 1)", &complex)).voxels(), &Voxels::F64(vec![5.0].into()));
}

#[test]
fn several_files_by_a_pattern_are_a_folder_of_them() {
    let dir = Dir::new();
    dir.save("a1.txt", "no volume");
    let line = Volume::open(dir.0.path().join("a*.txt")).unwrap_err().to_string();
    assert!(line.contains("a*.txt"), "{line}");
    let line = Volume::open(dir.0.path().join("b?.txt")).unwrap_err().to_string();
    assert!(line.contains("no file has such a name"), "{line}");
    // A file whose own name has a star in it is that file.
    let path = dir.save("c*.nrrd", nrrd("type: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: raw", &[5]));
    assert_eq!(stored(&Volume::open(path).unwrap()), [5.0]);
}

#[cfg(unix)]
#[test]
fn a_pipe_is_read_as_it_comes() {
    let dir = Dir::new();
    let fifo = |name: &str| {
        let path = dir.0.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        path
    };
    let through = |path: &Path, bytes: Vec<u8>, choice: Choice| {
        let to = path.to_path_buf();
        // The reader may stop before the end.
        let writer = std::thread::spawn(move || drop(std::fs::write(to, bytes)));
        let volume = io::read_as(path, &Reading::new().choice(choice)).map_err(|e| e.to_string());
        writer.join().unwrap();
        volume
    };
    let path = fifo("pipe");
    let bytes = nrrd("type: uchar\ndimension: 4\nsizes: 2 1 2 3\nkinds: space space space list\nencoding: raw", &counting(12));
    assert_eq!(stored(&through(&path, bytes.clone(), Choice::new().frame(1)).unwrap()), [4.0, 5.0, 6.0, 7.0]);
    assert_eq!(stored(&through(&path, gz(&bytes), Choice::new().frame(2)).unwrap()), [8.0, 9.0, 10.0, 11.0]);
    let line = through(&path, bytes[..bytes.len() - 3].to_vec(), Choice::new().frame(2)).unwrap_err();
    assert!(line.contains("the voxels should take 4 bytes, only 1 are there"), "{line}");
    let text = vtk("ASCII", &[b"DIMENSIONS 2 1 1\nPOINT_DATA 2\nSCALARS d float\n0 1\nSCALARS e float\n2 3\n"]);
    let volume = through(&path, text.clone(), Choice::new()).unwrap();
    assert_eq!(stored(&volume), [0.0, 1.0]);
    noted(&volume, &["from a pipe the first array is read"]);
    let line = through(&path, gz(&text), Choice::new().array("e")).unwrap_err();
    assert!(line.contains("an array cannot be chosen from a pipe"), "{line}");
    let line = through(&path, files::npz(&[("a.npy", Vec::new())], true), Choice::new()).unwrap_err();
    assert!(line.contains("cannot be read from a pipe"), "{line}");
}
