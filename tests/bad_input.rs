//! Files that are cut short, lie, or are nonsense: each gives one line that names the file and what is wrong with it, quickly,
//! without a panic and without the memory that it claims.

#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

mod files;

use files::{
    Random, Sample, dat, gz, join, meta, meta_header, nifti, nifti_header, npy, npy_raw, npz, nrrd, put_f32, put_i16, vtk, zip, zlib,
};
use slicestack::volume::VoxelType;
use slicestack::volume::io::{self, Endian, RawSpec};
use slicestack::{Limits, Volume};
use std::path::Path;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const LE: Endian = Endian::Little;

/// A file, how it is read, and what the message must say beside the file's name.
struct Case {
    file: &'static str,
    bytes: Vec<u8>,
    says: &'static [&'static str],
    beside: Vec<(&'static str, Vec<u8>)>,
    raw: Option<RawSpec>,
    limits: Limits,
}

impl Case {
    fn beside(mut self, file: &'static str, bytes: &[u8]) -> Self {
        self.beside.push((file, bytes.to_vec()));
        self
    }

    fn raw(mut self, dims: [usize; 3], kind: VoxelType) -> Self {
        self.raw = Some(RawSpec::new(dims, kind));
        self
    }

    fn spec(mut self, change: impl Fn(&mut RawSpec)) -> Self {
        self.raw.iter_mut().for_each(change);
        self
    }

    fn limits(mut self, voxel_bytes: u64, header_bytes: u64) -> Self {
        self.limits = Limits::new().voxel_bytes(voxel_bytes).header_bytes(header_bytes);
        self
    }
}

fn case(file: &'static str, bytes: impl AsRef<[u8]>, says: &'static [&'static str]) -> Case {
    Case { file, bytes: bytes.as_ref().to_vec(), says, beside: Vec::new(), raw: None, limits: Limits::default() }
}

fn nrrd_cases(s: &Sample) -> Vec<Case> {
    let head = |fields: &str| format!("NRRD0004\n{fields}\n\n");
    let plain = |sizes: &str, rest: &str| {
        let rest = if rest.is_empty() { String::new() } else { format!("\n{rest}") };
        head(&format!("type: uchar\ndimension: 3\nsizes: {sizes}\nencoding: raw{rest}"))
    };
    let good = nrrd(s, LE, "raw");
    let packed = nrrd(s, LE, "gzip");
    let (cut, short) = (good.len() - 1, packed.len() - 12);
    let lying = |sizes: &str| format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: {sizes}\nencoding: gzip\n\n");
    let mut flipped = packed.clone();
    flipped[packed.len() - 6] ^= 1;
    let vector = |v: &str| plain("2 2 2", &format!("space: RAS\nspace directions: {v}")) + "12345678";
    let ascii = |text: &str| head("type: short\ndimension: 3\nsizes: 2 2 1\nencoding: ascii") + text;
    let big = zlib(&vec![b'a'; 4 << 20]);
    vec![
        case("empty.nrrd", "", &["empty", "0 bytes"]),
        case("magic.nrrd", "NRRX0004\n", &["NRRX0004"]),
        case("version.nrrd", "NRRD0009\n\n", &["NRRD0009"]),
        case("alone.nrrd", "NRRD0004\n", &["type"]),
        case("cut.nrrd", &good[..cut], &["120 bytes", "119"]),
        case("no-data.nrrd", plain("2 2 2", ""), &["8 bytes", "holds 0"]),
        case("no-sizes.nrrd", head("type: uchar\ndimension: 3\nencoding: raw"), &["sizes"]),
        case("no-endian.nrrd", head("type: short\ndimension: 3\nsizes: 1 1 1\nencoding: raw") + "xx", &["endian", "i16"]),
        case("endian.nrrd", head("type: short\ndimension: 3\nsizes: 1 1 1\nencoding: raw\nendian: middle") + "xx", &["middle"]),
        case("no-encoding.nrrd", head("type: uchar\ndimension: 3\nsizes: 1 1 1") + "x", &["encoding"]),
        case("zero.nrrd", plain("0 2 2", ""), &["size 0"]),
        case("negative.nrrd", plain("2 -7 2", ""), &["-7"]),
        case("word.nrrd", plain("2 two 2", ""), &["\"two\"", "integer"]),
        case("dimension.nrrd", plain("2 2", ""), &["dimension", "2 sizes"]),
        case("overflow.nrrd", plain("4294967296 4294967296 4294967296", ""), &["4294967296"]),
        case("huge.nrrd", plain("99999999999999999999999 1 1", ""), &["99999999999999999999999"]),
        case("claims.nrrd", plain("2000 2000 2000", "") + "few", &["8000000000", "holds 3"]),
        case("limit.nrrd", plain("2000 2000 2000", "") + "few", &["8000000000", "1000"]).limits(1000, 1 << 20),
        case("header.nrrd", plain("1 1 1", &"#".repeat(5000)), &["header", "limit of 2000"]).limits(1 << 20, 2000),
        case("bomb.nrrd", join(&[lying("2000 2000 1000").as_bytes(), &gz(&[0; 5000])]), &["4000000000", "compressed bytes"]),
        case("gz-short.nrrd", join(&[lying("10 10 10").as_bytes(), &gz(&[0; 999])]), &["1000", "999"]),
        case("gz-long.nrrd", join(&[lying("10 10 10").as_bytes(), &gz(&[1; 1001])]), &["1000", "1001"]),
        case("gz-much.nrrd", join(&[lying("10 10 10").as_bytes(), &gz(&vec![0; 8 << 20])]), &["1000", "at least 1049576"]),
        case("gz-none.nrrd", join(&[lying("2 2 2").as_bytes(), b"not gzip at all"]), &["damaged", "8 bytes"]),
        case("gz-cut.nrrd", &packed[..short], &["damaged or cut short", "120 bytes"]),
        case("gz-checksum.nrrd", flipped, &["damaged", "checksum"]),
        case("gz-junk.nrrd", join(&[&packed, b"junk"]), &["follow its end"]),
        case("endless.nrrd.gz", gz(&vec![b'x'; 8 << 20]), &["header", "1048576"]),
        case("endless2.nrrd.gz", gz(&join(&[b"NRRD0004\n", &vec![b'#'; 8 << 20]])), &["header", "1048576"]),
        case("nan.nrrd", plain("2 2 2", "spacings: 1 nan 1") + "12345678", &["spacings", "nan"]),
        case("infinite.nrrd", plain("2 2 2", "spacings: 1 inf 1") + "12345678", &["spacings", "inf"]),
        case("zero-spacing.nrrd", plain("2 2 2", "spacings: 1 0 1") + "12345678", &["spacing", "axis 1", "0"]),
        case("spacings.nrrd", plain("2 2 2", "spacings: 1 1") + "12345678", &["spacings", "2 numbers"]),
        case("parallel.nrrd", vector("(1,0,0) (2,0,0) (0,0,1)"), &["do not span"]),
        case("vector-nan.nrrd", vector("(1,0,0) (0,NaN,0) (0,0,1)"), &["NaN"]),
        case("vector-open.nrrd", vector("(1,0,0) (0,1,0 (0,0,1"), &["space directions"]),
        case("vector-long.nrrd", vector("(1,0,0,0) (0,1,0,0) (0,0,1,0)"), &["4 numbers"]),
        case("vector-few.nrrd", vector("(1,0,0) (0,1,0)"), &["2 directions"]),
        case("origin.nrrd", plain("2 2 2", "space origin: (0,up,0)") + "12345678", &["space origin", "\"up\""]),
        case("space.nrrd", plain("2 2 2", "space: inside-out") + "12345678", &["inside-out"]),
        case("four.nrrd", head("type: uchar\ndimension: 4\nsizes: 3 4 5 6\nencoding: raw"), &["6 frames", "360 bytes", "holds 0"]),
        case("block.nrrd", head("type: block\ndimension: 3\nsizes: 1 1 1\nencoding: raw"), &["block"]),
        case("bzip2.nrrd", head("type: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: bzip2"), &["bzip2"]),
        case("skip.nrrd", plain("1 1 1", "byte skip: 99") + "x", &["99", "1 follow"]),
        case("skip-back.nrrd", plain("1 1 1", "byte skip: -2") + "x", &["-2"]),
        case("skip-lines.nrrd", plain("1 1 1", "line skip: 1000000000000") + "x", &["1000000000000"]),
        case("missing.nhdr", plain("1 1 1", "data file: nowhere.raw"), &["nowhere.raw", "No such file"]),
        case("above.nhdr", plain("1 1 1", "data file: ../../../../nowhere.raw"), &["nowhere.raw", "No such file"]),
        case("folder.nhdr", plain("1 1 1", "data file: ."), &["directory"]),
        case("list.nhdr", plain("1 1 1", "data file: LIST\na.raw"), &["a.raw", "No such file"]),
        case("pattern.nhdr", plain("1 1 1", "data file: a%03d.raw 1 9 1"), &["1 bytes", "9 files"]),
        case("ascii-word.nrrd", ascii("1 2 three 4"), &["voxel 2", "three", "i16"]),
        case("ascii-range.nrrd", ascii("1 2 70000 4"), &["voxel 2", "70000"]),
        case("ascii-half.nrrd", ascii("1 2 3.5 4"), &["voxel 2", "3.5"]),
        case("ascii-few.nrrd", ascii("1 2 3     "), &["4 numbers", "only 3"]),
        case("ascii-more.nrrd", ascii("1 2 3 4 5"), &["more than 4", "5"]),
        case("ascii-long.nrrd", ascii(&"9".repeat(2000)), &["512"]),
        case("line.nrrd", head("this is no field"), &["this is no field"]),
        case("zlib.nrrd", join(&[lying("100 100 400").as_bytes(), &big]), &["damaged"]),
    ]
}

fn nifti_cases(s: &Sample) -> Vec<Case> {
    let good = nifti(s, LE);
    let short = |at: usize, value: i16| {
        let mut bytes = good.clone();
        put_i16(&mut bytes, at, value, LE);
        bytes
    };
    let float = |at: usize, value: f32| {
        let mut bytes = good.clone();
        put_f32(&mut bytes, at, value, LE);
        bytes
    };
    let magic = |m: &[u8; 4]| join(&[&nifti_header(s, LE, m), &[0; 200]]);
    let mut huge = good.clone();
    (1..4).for_each(|i| put_i16(&mut huge, 40 + 2 * i, 2500, LE));
    let mut inter = float(112, 2.0);
    put_f32(&mut inter, 116, f32::INFINITY, LE);
    vec![
        case("header.nii", &good[..100], &["348 bytes", "100"]),
        case("short.nii", &good[..400], &["120 bytes", "48"]),
        case("magic.nii", magic(b"n+9\0"), &["n+9"]),
        case("analyze.hdr", magic(b"\0\0\0\0"), &["analyze.img", "No such file"]),
        case("nothing.nii", [7; 400], &["348", "117901063"]),
        case("dim0.nii", short(40, 9), &["dim[0]", "9"]),
        case("dim-zero.nii", short(44, 0), &["dim[2]", "0"]),
        case("dim-negative.nii", short(44, -5), &["dim[2]", "-5"]),
        case(
            "four.nii",
            {
                let mut bytes = short(40, 4);
                put_i16(&mut bytes, 48, 20, LE);
                bytes
            },
            &["20 frames", "2400 bytes", "holds 120"],
        ),
        case("claims.nii", &huge, &["15625000000", "holds 120"]),
        case("claims.nii.gz", gz(&huge), &["15625000000", "compressed bytes"]),
        case("type.nii", short(70, 128), &["bitpix is 8", "24 bits"]),
        case("complex.nii", short(70, 32), &["bitpix", "complex64", "64 bits"]),
        case("bitpix.nii", short(72, 16), &["bitpix", "16"]),
        case("pixdim.nii", float(80, f32::NAN), &["pixdim[1]", "NaN"]),
        case("offset.nii", float(108, f32::NAN), &["vox_offset", "NaN"]),
        case("offset-in.nii", float(108, 10.0), &["vox_offset", "10"]),
        case("offset-part.nii", float(108, 352.5), &["vox_offset", "352.5"]),
        case("offset-far.nii", float(108, 1e9), &["999999652", "124"]),
        case("offset-absurd.nii", float(108, 1e30), &["vox_offset"]),
        case("inter.nii", inter, &["scl_inter", "inf"]),
        case("pair.hdr", magic(b"ni1\0"), &["pair.img", "No such file"]),
        case("pair.nii", magic(b"ni1\0"), &[".img", ".hdr"]),
        case("short-pair.hdr", magic(b"ni1\0"), &["120 bytes", "5"]).beside("short-pair.img", b"short"),
        case("two.nii", join(&[&[28, 2, 0, 0], b"n+2\0", &[0; 540]]), &["datatype is 0"]),
    ]
}

fn text_cases(s: &Sample) -> Vec<Case> {
    let local = |extra: &str| join(&[meta_header(s, LE, extra, "LOCAL").as_bytes(), &s.bytes(LE)]);
    let header = |sizes: &str| format!("NDims = 3\nDimSize = {sizes}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n");
    let good = meta(s, LE, "raw");
    let packed = |n: usize| join(&[meta_header(s, LE, "CompressedData = True\n", "LOCAL").as_bytes(), &zlib(&vec![7; n])]);
    let points = |middle: &str| format!("# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\n{middle}");
    let scalars = |n: &str, kind: &str| points(&format!("DIMENSIONS 2 2 2\nPOINT_DATA {n}\nSCALARS s {kind}\nLOOKUP_TABLE default\n"));
    let binary = vtk(s, "BINARY", "3.0");
    vec![
        case("cut.mha", &good[..good.len() - 1], &["240 bytes", "239"]),
        case("words.mha", "NDims = 3\nnonsense\n", &["nonsense"]),
        case("text.mha", "just a text", &["just a text"]),
        case("end.mha", "NDims = 3\nDimSize = 1 1 1\nElementType = MET_UCHAR\n", &["ElementDataFile"]),
        case("zero.mha", header("2 0 2"), &["size 0"]),
        case("negative.mha", header("2 2 -2"), &["-2"]),
        case("sizes.mha", header("2 2"), &["NDims", "2 numbers"]),
        case("claims.mha", header("2000 2000 3000"), &["12000000000", "holds 0"]),
        case("overflow.mha", header("16777216 16777216 16777216"), &["16777216"]),
        case("axis.mha", header("1000000000 1 1"), &["1000000000"]),
        case("type.mha", meta_header(s, LE, "", "LOCAL").replace("MET_SHORT", "MET_STRING"), &["ElementType", "MET_STRING"]),
        case("channels.mha", local("ElementNumberOfChannels = 3\n"), &["3 channels", "720 bytes", "holds 240"]),
        case("object.mha", "ObjectType = Tube\nNDims = 3\nElementDataFile = LOCAL\n", &["Tube"]),
        case("nan.mha", local("Offset = 0 nan 0\n"), &["Offset", "nan"]),
        case("matrix.mha", local("TransformMatrix = 1 0 0 0 1 0 0 0\n"), &["TransformMatrix", "8 numbers"]),
        case("flat.mha", local("TransformMatrix = 1 0 0 1 0 0 0 0 1\n"), &["do not span"]),
        case("truth.mha", local("CompressedData = maybe\n"), &["CompressedData", "maybe"]),
        case("short.mha", packed(239), &["240", "239"]),
        case("long.mha", packed(241), &["240", "241"]),
        case(
            "bomb.mha",
            {
                let head = "NDims = 3\nDimSize = 2000 2000 2000\nElementType = MET_UCHAR\nCompressedData = True\nElementDataFile = LOCAL\n";
                join(&[head.as_bytes(), &zlib(&[0; 9000])])
            },
            &["8000000000", "compressed bytes"],
        ),
        case("slope.mha", local("ElementToIntensityFunctionSlope = 0\n"), &["slope 0"]),
        case("missing.mhd", meta_header(s, LE, "", "nowhere.raw"), &["nowhere.raw", "No such file"]),
        case("list.mhd", meta_header(s, LE, "", "LIST"), &["LIST"]),
        case("folder.mhd", meta_header(s, LE, "", "/"), &["directory"]),
        case("short.mhd", meta_header(s, LE, "", "short.raw"), &["240 bytes", "5"]).beside("short.raw", b"short"),
        case("end.mhd", meta_header(s, LE, "HeaderSize = -1\n", "end.raw"), &["240 bytes", "5"]).beside("end.raw", b"short"),
        case("skip.mhd", meta_header(s, LE, "HeaderSize = -5\n", "skip.raw"), &["HeaderSize", "-5"]).beside("skip.raw", b"short"),
        case("four.mha", "NDims = 4\nDimSize = 2 2 2 5\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n", &["5 frames", "40 bytes"]),
        case("alone.vtk", "# vtk DataFile Version 3.0\n", &["ASCII", "BINARY"]),
        case("encoding.vtk", "# vtk DataFile Version 3.0\nt\nMORSE\n", &["MORSE"]),
        case("grid.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n", &["UNSTRUCTURED_GRID"]),
        case("nothing.vtk", points("DIMENSIONS 2 2 2\n"), &["SCALARS"]),
        case("order.vtk", points("DIMENSIONS 2 2 2\nSCALARS s char\n"), &["POINT_DATA"]),
        case("dimensions.vtk", points("DIMENSIONS 2 2\n"), &["DIMENSIONS", "three"]),
        case("no-dimensions.vtk", points("POINT_DATA 8\nSCALARS s char\n"), &["no DIMENSIONS"]),
        case("zero.vtk", points("DIMENSIONS 2 0 2\n"), &["size 0"]),
        case("count.vtk", scalars("9", "char") + "123456789", &["9 voxels", "= 8"]),
        case("short.vtk", scalars("8", "short") + "12345678", &["16 bytes", "holds 8"]),
        case("long.vtk", scalars("8", "char") + "123456789", &["8 bytes", "9"]),
        case("cut.vtk", &binary[..binary.len() - 30], &["240 bytes"]),
        case("bit.vtk", scalars("8", "bit") + "1", &["bit"]),
        case("colours.vtk", points("DIMENSIONS 2 2 2\nPOINT_DATA 8\nSCALARS s float 3\n"), &["3 f32 take 96 bytes", "holds 0"]),
        case("vectors.vtk", points("DIMENSIONS 2 2 2\nPOINT_DATA 8\nVECTORS v float\n"), &["voxels", "holds 0"]),
        case("spacing.vtk", points("SPACING 1 nan 1\n"), &["SPACING", "nan"]),
        case("claims.vtk", points("DIMENSIONS 2000 2000 2000\nPOINT_DATA 8000000000\nSCALARS s char\n") + "x", &["8000000000", "holds 1"]),
    ]
}

fn numpy_cases(s: &Sample) -> Vec<Case> {
    let good = npy(s, LE, false, 1);
    let with =
        |descr: &str, shape: &str| npy_raw(1, &format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"), &[0; 24]);
    let archive = npz(&[("a.npy", good.clone())], true);
    let stored = npz(&[("a.npy", good.clone())], false);
    let falsified = |deflated, change: fn(&mut (u32, u32, u32))| zip(&[("a.npy", good.clone())], deflated, change);
    let mut version = good.clone();
    version[6] = 9;
    let mut damaged = archive.clone();
    let middle = archive.len() - 22 - 51 - 100;
    damaged[middle] ^= 0xff;
    let mut method = stored.clone();
    let directory = stored.len() - 22 - 46 - 5;
    method[directory + 10] = 14;
    let mut encrypted = stored.clone();
    encrypted[directory + 8] = 1;
    let mut place = stored.clone();
    place[directory + 42] = 99;
    let mut end = stored.clone();
    let n = end.len();
    end[n - 6..n - 2].copy_from_slice(&0x7fff_ffffu32.to_le_bytes());
    let mut wide = stored.clone();
    wide[n - 10..n - 6].copy_from_slice(&0x7fff_ffffu32.to_le_bytes());
    let far = npy_raw(1, "{'descr': '<i8', 'fortran_order': False, 'shape': (1, 1, 2)}", &[[0xff; 8], [1; 8]].concat());
    vec![
        case("header.npy", b"\x93NUMPY\x01\x00\xff\xff{", &["65535", "1"]),
        case("header2.npy", b"\x93NUMPY\x02\x00\xff\xff\xff\xff{", &["header", "4294967"]),
        case("stub.npy", b"\x93NUM", &["known"]),
        case("cut.npy", &good[..good.len() - 1], &["240 bytes", "239"]),
        case("version.npy", version, &["version 9"]),
        case("no-shape.npy", npy_raw(1, "{'descr': '<i2', 'fortran_order': False}", &[]), &["'shape'"]),
        case("no-descr.npy", npy_raw(1, "{'shape': (1, 1, 1), 'fortran_order': False}", &[]), &["'descr'"]),
        case("order.npy", npy_raw(1, "{'descr': '<i2', 'fortran_order': Perhaps, 'shape': (1, 1, 1)}", &[]), &["Perhaps"]),
        case("long-double.npy", with("'<f16'", "(1, 2, 3)"), &["<f16"]),
        case("object.npy", with("'|O'", "(1, 2, 3)"), &["|O"]),
        case("text.npy", with("'<U3'", "(1, 2, 3)"), &["<U3"]),
        case("record.npy", with("[('a', '<i2')]", "(1, 2, 3)"), &["records"]),
        case("vector.npy", with("'<i2'", "(12,)"), &["1 dimensions", "12"]),
        case("point.npy", with("'<i2'", "()"), &["0 dimensions"]),
        case("five.npy", with("'|u1'", "(2, 2, 3, 2, 1, 2)"), &["6 dimensions", "axis 0 has size 2"]),
        case("zero.npy", with("'<i2'", "(1, 0, 3)"), &["at least 1", "(1, 0, 3)"]),
        case("negative.npy", with("'<i2'", "(1, -2, 3)"), &["-2"]),
        case("claims.npy", with("'<i2'", "(1000, 2000, 3000)"), &["12000000000", "holds 24"]),
        case("overflow.npy", with("'<f8'", "(9999999999, 9999999999, 9999999999)"), &["9999999999"]),
        case("huge.npy", with("'<f8'", "(99999999999999999999, 1, 1)"), &["99999999999999999999"]),
        case("open.npy", with("'<i2'", "(1, 2"), &["shape"]),
        case("wide.npy", far, &["voxel 1", "72340172838076673", "i32"]),
        case(
            "fortran.npy",
            npy_raw(1, "{'descr': '<i2', 'fortran_order': True, 'shape': (100, 2000, 30000)}", &[0; 24]),
            &["12000000000", "holds 24"],
        ),
        case("empty.npz", zip(&[], false, |_| {}), &["0 files", "no .npy"]),
        case("none.npz", zip(&[("readme.txt", vec![1])], false, |_| {}), &["readme.txt", "no .npy"]),
        case("flat.npz", zip(&[("a.npy", with("'<i2'", "(12,)")), ("b.npy", with("'|O'", "(1,)"))], true, |_| {}), &["a [12]", "|O"]),
        case("cut.npz", &archive[..archive.len() - 30], &["no directory"]),
        case("head.npz", &archive[..100], &["no directory"]),
        case("damaged.npz", damaged, &["compressed", "damaged"]),
        case("crc.npz", falsified(true, |f| f.2 ^= 1), &["checksum"]),
        case("bomb.npz", falsified(true, |f| f.1 = 0xf000_0000), &["4026531840", "compressed bytes"]),
        case("packed.npz", falsified(true, |f| f.0 = 0xf000_0000), &["4026531840"]),
        case("short.npz", falsified(true, |f| f.1 -= 1), &["368", "367"]),
        case("long.npz", falsified(true, |f| f.1 += 1), &["368", "369"]),
        case("stored.npz", falsified(false, |f| f.1 += 1), &["369", "368"]),
        case("method.npz", method, &["method 14"]),
        case("encrypted.npz", encrypted, &["encrypted"]),
        case("place.npz", place, &["byte 99"]),
        case("directory.npz", end, &["2147483647"]),
        case("wide.npz", wide, &["2147483647", "limit"]),
        case("packed.npz.gz", gz(&archive), &["inside gzip"]),
        case("lies.npz", zip(&[("a.npy", with("'|u1'", "(2000, 2000, 1000)"))], true, |_| {}), &["4000000", "by the zip directory"]),
    ]
}

fn other_cases() -> Vec<Case> {
    let raw = |n: usize| vec![1u8; n];
    let mut dicom = vec![0; 200];
    dicom[128..132].copy_from_slice(b"DICM");
    let mut random = Random(5);
    let noise: Vec<u8> = (0..120_000).map(|_| random.next() as u8).collect();
    let mut tar = vec![0; 1024];
    tar[257..262].copy_from_slice(b"ustar");
    vec![
        case("short.raw", raw(7), &["8 bytes", "holds 7"]).raw([2, 2, 2], VoxelType::U8),
        case("long.raw", raw(9), &["8 bytes", "9"]).raw([2, 2, 2], VoxelType::U8),
        case("empty.raw", raw(0), &["empty"]).raw([2, 2, 2], VoxelType::U8),
        case("zero.raw", raw(8), &["0 x 2 x 2"]).raw([0, 2, 2], VoxelType::U8),
        case("claims.raw", raw(8), &["12000000000", "holds 8"]).raw([1000, 1000, 1500], VoxelType::F64),
        case("overflow.raw", raw(8), &["18446744073709551615"]).raw([usize::MAX, 2, 2], VoxelType::U8),
        case("memory.raw", raw(8), &["limit"]).raw([1 << 24, 1 << 24, 1 << 15], VoxelType::F64),
        case("offset.raw", raw(8), &["99", "8"]).raw([2, 2, 2], VoxelType::U8).spec(|s| s.offset = 99),
        case("far.raw", raw(8), &["18446744073709551615"]).raw([2, 2, 2], VoxelType::U8).spec(|s| s.offset = u64::MAX),
        case("nan.raw", raw(8), &["NaN"]).raw([2, 2, 2], VoxelType::U8).spec(|s| s.spacing[1] = f64::NAN),
        case("flat.raw", raw(8), &["axis 2 is 0"]).raw([2, 2, 2], VoxelType::U8).spec(|s| s.spacing[2] = 0.0),
        case("origin.raw", raw(8), &["inf"]).raw([2, 2, 2], VoxelType::U8).spec(|s| s.origin[0] = f64::INFINITY),
        case("short.raw.gz", gz(&raw(7)), &["8 bytes", "7"]).raw([2, 2, 2], VoxelType::U8),
        case("bomb.raw.gz", gz(&vec![0; 1 << 20]), &["8 bytes", "1048576"]).raw([2, 2, 2], VoxelType::U8),
        case("claims.raw.gz", gz(&raw(7)), &["8000000000", "compressed"]).raw([2000, 2000, 2000], VoxelType::U8),
        case("skip.raw.gz", gz(&raw(7)), &["2000"]).raw([2, 2, 2], VoxelType::U8).spec(|s| s.offset = 2000),
        case("undescribed.raw", raw(50), &["dimensions and type"]),
        case("image.dcm", dicom, &["a DICOM file"]),
        case("bare.dcm", join(&[&[8, 0, 5, 0, b'C', b'S'], &[0; 200]]), &["a DICOM file"]),
        case("volume.h5", b"\x89HDF\r\n\x1a\n", &["HDF5"]),
        case("series.tar", tar.clone(), &["tar archive", "not supported"]),
        case("series.tgz", gz(&tar), &["tar archive", "not supported"]),
        case("short.dat", dat([3, 4, 5], &[0; 119]), &["3 x 4 x 5", "126 bytes", "not 125", "a raw file needs"]),
        case("long.dat", dat([3, 4, 5], &[0; 121]), &["3 x 4 x 5", "126 bytes", "not 127"]),
        case("zero.dat", dat([3, 0, 5], &[]), &["3 x 0 x 5", "6 bytes"]),
        case("zero-long.dat", dat([3, 0, 5], &[0; 60]), &["3 x 0 x 5", "not 66"]),
        case("claims.dat", dat([65535; 3], &[0; 60]), &["65535 x 65535 x 65535", "562924184010756 bytes", "not 66"]),
        case("stub.dat", [3, 0, 4], &["6 bytes", "after 3"]),
        case("text.dat", b"1 2 3\n4 5 6\n", &["8241 x 8242 x 2611", "a raw file needs"]),
        case("short.dat.gz", gz(&dat([3, 4, 5], &[0; 119])), &["120 bytes", "119"]),
        case("long.dat.gz", gz(&dat([3, 4, 5], &[0; 121])), &["120 bytes", "121"]),
        case("zero.dat.gz", gz(&dat([0, 4, 5], &[0; 40])), &["0 x 4 x 5"]),
        case("claims.dat.gz", gz(&dat([60000; 3], &[0; 60])), &["432000000000000", "limit"]),
        case("bomb.dat.gz", gz(&dat([2000, 2000, 1000], &[0; 60])), &["8000000000", "compressed bytes"]),
        case("much.dat.gz", gz(&dat([3, 4, 5], &vec![0; 8 << 20])), &["120", "at least 1048696"]),
        case("cut.dat.gz", &gz(&dat([30, 40, 50], &noise))[..60_000], &["120000 bytes", "cut short"]),
        case("limit.dat", dat([3, 4, 5], &[0; 120]), &["120", "limit of 119"]).limits(119, 1 << 20),
        case("picture.tif", b"II*\0\x08\0\0\0", &["TIFF"]),
        case("volume.vti", b"<?xml version=\"1.0\"?>", &["XML"]),
        case("stub.gz", [0x1f, 0x8b], &["damaged"]),
    ]
}

/// Peak of this process's address space in bytes: memory that was asked for, used or not.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmPeak:"));
    line.and_then(|l| l.split_whitespace().nth(1)?.parse::<u64>().ok()).map_or(0, |kib| kib * 1024)
}

/// Writes the case's files, reads them, and tells how long reading took.
fn run(case: &Case, dir: &Path) -> (Result<Volume, slicestack::Error>, Duration) {
    let path = dir.join(case.file);
    std::fs::write(&path, &case.bytes).unwrap();
    for (name, bytes) in &case.beside {
        std::fs::write(dir.join(name), bytes).unwrap();
    }
    let start = Instant::now();
    let result = match &case.raw {
        Some(spec) => io::read_raw(&path, spec, &case.limits),
        None => io::read(&path, &case.limits),
    };
    (result, start.elapsed())
}

#[test]
fn every_bad_file_gets_one_clear_line() {
    let (small, wide) = (Sample::new(VoxelType::U8, [4, 5, 6]), Sample::new(VoxelType::I16, [4, 5, 6]));
    let all = [nrrd_cases(&small), nifti_cases(&small), text_cases(&wide), numpy_cases(&wide), other_cases()];
    let all: Vec<Case> = all.into_iter().flatten().collect();
    assert!(all.len() >= 60, "{}", all.len());
    let before = peak();
    let mut wrong = Vec::new();
    for case in &all {
        let dir = TempDir::new().unwrap();
        let (result, took) = run(case, dir.path());
        let message = match result {
            Ok(v) => {
                wrong.push(format!("{}: read as {:?}", case.file, v.grid().dims()));
                continue;
            }
            Err(e) => e.to_string(),
        };
        // The file itself, or the one beside it.
        let named = std::iter::once(case.file).chain(case.beside.iter().map(|b| b.0)).any(|f| message.contains(f));
        let says = case.says.iter().all(|s| message.contains(s));
        if message.contains('\n') || message.len() > 400 || !named || !says || took > Duration::from_secs(1) {
            wrong.push(format!("{}: {message:?} in {took:?}, should say {:?}", case.file, case.says));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), all.len(), wrong.join("\n"));
    // Many of the files claim gigabytes; no claim may be believed. Threads' own arenas are far below this.
    let grown = peak() - before;
    assert!(grown < 1 << 30, "address space grew by {grown} bytes");
}

#[test]
fn absent_files_and_folders_are_named() {
    let dir = TempDir::new().unwrap();
    let message = Volume::open(dir.path().join("absent.nrrd")).unwrap_err().to_string();
    assert!(message.contains("absent.nrrd") && message.contains("No such file"), "{message}");
    let message = Volume::open(dir.path()).unwrap_err().to_string();
    assert!(message.contains("is a directory"), "{message}");
}

#[test]
fn folders_are_refused_with_what_may_be_given() {
    let dir = TempDir::new().unwrap();
    let folder = dir.path().join("scan");
    std::fs::create_dir(&folder).unwrap();
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    let told = || {
        let line = Volume::open(&folder).unwrap_err().to_string();
        assert_eq!(line, io::detect(&folder).unwrap_err().to_string());
        assert!(line.starts_with(&format!("{}: is a directory", folder.display())) && !line.contains('\n'), "{line}");
        line
    };
    assert!(told().ends_with("is a directory, not a volume: there are no files in it"), "{}", told());
    put("notes.txt", b"nothing to see");
    assert!(told().ends_with("the one file in it is of no format that is known"), "{}", told());
    put("empty.nrrd", b"");
    assert!(told().ends_with("the 2 files in it are of no format that is known"), "{}", told());
    // A file that is recognised and not read is told, unless there is one that is.
    put("IM2", b"\x89HDF\r\n\x1a\n");
    put("IM1", b"\x89HDF\r\n\x1a\n");
    assert!(told().contains("\"IM1\" in it is an HDF5 file: not supported"), "{}", told());
    let sample = Sample::new(VoxelType::U8, [4, 5, 6]);
    // Outside the folder nothing is looked into, be it by a link or in a folder below.
    std::fs::create_dir(folder.join("below")).unwrap();
    put("below/A.nrrd", &nrrd(&sample, LE, "raw"));
    #[cfg(unix)]
    std::os::unix::fs::symlink("below/A.nrrd", folder.join("B.nrrd")).unwrap();
    assert!(told().contains("\"IM1\""), "{}", told());
    put("head.nrrd", &nrrd(&sample, LE, "raw"));
    assert!(told().ends_with("is a directory, not a volume: give one volume file, such as \"head.nrrd\" in it"), "{}", told());
    // Some kinds of folders are known as such.
    if !cfg!(feature = "zarr") {
        put(".zarray", b"{}");
        assert!(told().contains("is a directory of Zarr arrays: this build has no feature zarr"), "{}", told());
    }
    // A described file must be a file.
    let line = io::read_raw(&folder, &RawSpec::new([2, 2, 2], VoxelType::U8), &Limits::default()).unwrap_err().to_string();
    assert!(line.ends_with("is a directory, not a file"), "{line}");
}

#[cfg(not(feature = "dicom"))]
#[test]
fn dicom_files_are_named_by_builds_that_do_not_read_them() {
    let dir = TempDir::new().unwrap();
    let mut dicom = vec![0; 200];
    // What stands before the magic looks like NIfTI.
    dicom[..4].copy_from_slice(&[0x5c, 1, 0, 0]);
    dicom[128..132].copy_from_slice(b"DICM");
    let mut tar = vec![0; 512];
    tar[257..262].copy_from_slice(b"ustar");
    std::fs::create_dir(dir.path().join("folder")).unwrap();
    for (name, bytes) in [("a", dicom.clone()), ("b", [tar, dicom].concat()), ("folder/DICOMDIR", vec![0; 4])] {
        std::fs::write(dir.path().join(name), bytes).unwrap();
    }
    for (name, says) in [("a", "a DICOM file: "), ("b", "a tar archive of DICOM files: "), ("folder", "is a directory of DICOM files: ")] {
        let line = Volume::open(dir.path().join(name)).unwrap_err().to_string();
        assert!(line.contains(&format!("{says}this build was made without the feature `dicom`")), "{line}");
    }
}

#[test]
fn damaged_files_never_panic_or_dawdle() {
    let s = Sample::new(VoxelType::I16, [4, 5, 6]);
    let seeds = [
        nrrd(&s, LE, "raw"),
        nrrd(&s, Endian::Big, "gzip"),
        nrrd(&s, LE, "ascii"),
        nifti(&s, LE),
        gz(&nifti(&s, Endian::Big)),
        meta(&s, LE, "raw"),
        meta(&s, LE, "zlib"),
        meta(&s, LE, "ascii"),
        vtk(&s, "BINARY", "2.0"),
        vtk(&s, "ASCII", "5.1"),
        npy(&s, LE, true, 1),
        npy(&s, Endian::Big, false, 3),
        npz(&[("a.npy", npy(&s, LE, false, 1))], true),
        npz(&[("a.npy", npy(&s, LE, false, 2)), ("b.npy", npy(&s, LE, true, 1))], false),
    ];
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("damaged");
    let mut random = Random(42);
    let (mut read, mut refused) = (0, 0);
    for seed in &seeds {
        for _ in 0..350 {
            let mut bytes = seed.clone();
            for _ in 0..1 + random.below(4) {
                // Headers come first: half of the damage goes there.
                let reach = if random.below(2) == 0 { bytes.len().min(360) } else { bytes.len() };
                let at = random.below(reach.max(1));
                match random.below(6) {
                    _ if bytes.is_empty() => {}
                    0 => bytes[at] ^= 1 << random.below(8),
                    1 => bytes[at] = random.next() as u8,
                    2 => bytes.truncate(at),
                    3 => bytes.insert(at, b"0123456789 -.\n\xff"[random.below(15)]),
                    4 => drop(bytes.drain(at..(at + 1 + random.below(9)).min(bytes.len()))),
                    _ => {
                        let copy = bytes[at..(at + 8).min(bytes.len())].to_vec();
                        bytes.splice(at..at, copy);
                    }
                }
            }
            std::fs::write(&path, &bytes).unwrap();
            let start = Instant::now();
            match Volume::open(&path) {
                Ok(v) => {
                    read += 1;
                    assert_eq!(v.voxels().len(), v.grid().voxel_count());
                }
                Err(e) => {
                    refused += 1;
                    let message = e.to_string();
                    assert!(!message.contains('\n') && message.contains("damaged"), "{message:?}");
                }
            }
            assert!(start.elapsed() < Duration::from_secs(1), "{:?} for {:?}", start.elapsed(), bytes.escape_ascii().to_string());
        }
    }
    // Damage among the voxels is often harmless, damage in a header seldom: both must have happened.
    assert!(read > 100 && refused > 1000, "{read} read, {refused} refused");
}
