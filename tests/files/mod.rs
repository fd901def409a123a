//! Small volume files of every format, made in memory by writers that share nothing with the readers.

#![allow(dead_code, reason = "each test binary uses its own part")]
#![allow(clippy::unwrap_used, reason = "a test that cannot write its file shall stop")]

#[cfg(feature = "dicom")]
pub(crate) mod dicom;
pub(crate) mod tiff;

use flate2::Compression;
use flate2::write::{DeflateEncoder, GzEncoder, ZlibEncoder};
use slicestack::volume::io::Endian;
use slicestack::volume::{VoxelType, Voxels};
use std::io::Write;

/// Numbers that look random and are the same every time (xorshift).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

/// A volume to write and to expect back.
#[derive(Clone)]
pub(crate) struct Sample {
    pub(crate) dims: [usize; 3],
    pub(crate) voxels: Voxels,
}

impl Sample {
    /// Voxels all over the type's range, its ends among them.
    pub(crate) fn new(kind: VoxelType, dims: [usize; 3]) -> Self {
        let n: usize = dims.iter().product();
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        macro_rules! integers {
            ($v:ident, $t:ty) => {
                Voxels::$v((0..n).map(|i| [<$t>::MIN, <$t>::MAX].get(i).copied().unwrap_or(random.next() as $t)).collect())
            };
        }
        let voxels = match kind {
            VoxelType::U8 => integers!(U8, u8),
            VoxelType::I8 => integers!(I8, i8),
            VoxelType::U16 => integers!(U16, u16),
            VoxelType::I16 => integers!(I16, i16),
            VoxelType::U32 => integers!(U32, u32),
            VoxelType::I32 => integers!(I32, i32),
            VoxelType::F32 => Voxels::F32((0..n).map(|_| random.next() as i64 as f32 / 1e9).collect()),
            VoxelType::F64 => Voxels::F64((0..n).map(|_| random.next() as i64 as f64 / 1e9).collect()),
        };
        Self { dims, voxels }
    }

    pub(crate) fn kind(&self) -> VoxelType {
        self.voxels.voxel_type()
    }

    /// The voxels as they lie in a file, x fastest.
    pub(crate) fn bytes(&self, endian: Endian) -> Vec<u8> {
        macro_rules! each {
            ($v:expr) => {
                match endian {
                    Endian::Little => $v.iter().flat_map(|x| x.to_le_bytes()).collect(),
                    Endian::Big => $v.iter().flat_map(|x| x.to_be_bytes()).collect(),
                }
            };
        }
        match &self.voxels {
            Voxels::U8(v) => each!(v),
            Voxels::I8(v) => each!(v),
            Voxels::U16(v) => each!(v),
            Voxels::I16(v) => each!(v),
            Voxels::U32(v) => each!(v),
            Voxels::I32(v) => each!(v),
            Voxels::F32(v) => each!(v),
            Voxels::F64(v) => each!(v),
        }
    }

    /// The voxels as numbers, one a line.
    pub(crate) fn text(&self) -> String {
        let one = |i: usize| match &self.voxels {
            Voxels::F32(v) => v[i].to_string(),
            other => other.get(i).to_string(),
        };
        (0..self.voxels.len()).map(|i| one(i) + "\n").collect()
    }

    fn sizes(&self) -> String {
        let [x, y, z] = self.dims;
        format!("{x} {y} {z}")
    }
}

pub(crate) fn gz(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

pub(crate) fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut out = ZlibEncoder::new(Vec::new(), Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut out = DeflateEncoder::new(Vec::new(), Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

pub(crate) fn join(parts: &[&[u8]]) -> Vec<u8> {
    parts.concat()
}

fn endian_name(endian: Endian) -> &'static str {
    if endian == Endian::Big { "big" } else { "little" }
}

pub(crate) fn nrrd(sample: &Sample, endian: Endian, encoding: &str) -> Vec<u8> {
    let kind = match sample.kind() {
        VoxelType::U8 => "unsigned char",
        VoxelType::I8 => "int8",
        VoxelType::U16 => "ushort",
        VoxelType::I16 => "signed short int",
        VoxelType::U32 => "uint32_t",
        VoxelType::I32 => "int",
        VoxelType::F32 => "float",
        VoxelType::F64 => "double",
    };
    let head = format!(
        "NRRD0005\n# a test\ntype: {kind}\ndimension: 3\nsizes: {}\nendian: {}\nencoding: {encoding}\nspacings: 1 2 3\n\n",
        sample.sizes(),
        endian_name(endian)
    );
    let data = match encoding {
        "raw" => sample.bytes(endian),
        "gzip" => gz(&sample.bytes(endian)),
        _ => sample.text().into_bytes(),
    };
    join(&[head.as_bytes(), &data])
}

/// A header of 348 bytes with room for nothing but the essential fields.
pub(crate) fn nifti_header(sample: &Sample, endian: Endian, magic: &[u8; 4]) -> Vec<u8> {
    let mut head = vec![0u8; 348];
    let (code, bits) = match sample.kind() {
        VoxelType::U8 => (2, 8),
        VoxelType::I8 => (256, 8),
        VoxelType::U16 => (512, 16),
        VoxelType::I16 => (4, 16),
        VoxelType::U32 => (768, 32),
        VoxelType::I32 => (8, 32),
        VoxelType::F32 => (16, 32),
        VoxelType::F64 => (64, 64),
    };
    let [x, y, z] = sample.dims.map(|n| n as i16);
    put_i32(&mut head, 0, 348, endian);
    for (i, n) in [3, x, y, z, 1, 1, 1, 1].into_iter().enumerate() {
        put_i16(&mut head, 40 + 2 * i, n, endian);
    }
    put_i16(&mut head, 70, code, endian);
    put_i16(&mut head, 72, bits, endian);
    for (i, size) in [1.0, 1.0, 2.0, 3.0].into_iter().enumerate() {
        put_f32(&mut head, 76 + 4 * i, size, endian);
    }
    put_f32(&mut head, 108, if magic == b"n+1\0" { 352.0 } else { 0.0 }, endian);
    head[344..].copy_from_slice(magic);
    head
}

pub(crate) fn put_i16(head: &mut [u8], at: usize, value: i16, endian: Endian) {
    head[at..at + 2].copy_from_slice(&if endian == Endian::Big { value.to_be_bytes() } else { value.to_le_bytes() });
}

pub(crate) fn put_i32(head: &mut [u8], at: usize, value: i32, endian: Endian) {
    head[at..at + 4].copy_from_slice(&if endian == Endian::Big { value.to_be_bytes() } else { value.to_le_bytes() });
}

pub(crate) fn put_f32(head: &mut [u8], at: usize, value: f32, endian: Endian) {
    head[at..at + 4].copy_from_slice(&if endian == Endian::Big { value.to_be_bytes() } else { value.to_le_bytes() });
}

pub(crate) fn nifti(sample: &Sample, endian: Endian) -> Vec<u8> {
    join(&[&nifti_header(sample, endian, b"n+1\0"), &[0; 4], &sample.bytes(endian)])
}

/// `data` is `LOCAL` or a file name; only the header is written.
pub(crate) fn meta_header(sample: &Sample, endian: Endian, extra: &str, data: &str) -> String {
    let kind = match sample.kind() {
        VoxelType::U8 => "UCHAR",
        VoxelType::I8 => "CHAR",
        VoxelType::U16 => "USHORT",
        VoxelType::I16 => "SHORT",
        VoxelType::U32 => "UINT",
        VoxelType::I32 => "INT",
        VoxelType::F32 => "FLOAT",
        VoxelType::F64 => "DOUBLE",
    };
    let msb = if endian == Endian::Big { "True" } else { "False" };
    format!(
        "ObjectType = Image\nNDims = 3\nBinaryDataByteOrderMSB = {msb}\nDimSize = {}\nElementSpacing = 1 2 3\nElementType = MET_{kind}\n{extra}ElementDataFile = {data}\n",
        sample.sizes()
    )
}

pub(crate) fn meta(sample: &Sample, endian: Endian, encoding: &str) -> Vec<u8> {
    let (extra, data) = match encoding {
        "zlib" => ("CompressedData = True\n", zlib(&sample.bytes(endian))),
        "ascii" => ("BinaryData = False\n", sample.text().into_bytes()),
        _ => ("BinaryData = True\n", sample.bytes(endian)),
    };
    join(&[meta_header(sample, endian, extra, "LOCAL").as_bytes(), &data])
}

pub(crate) fn vtk(sample: &Sample, encoding: &str, version: &str) -> Vec<u8> {
    let kind = match sample.kind() {
        VoxelType::U8 => "unsigned_char",
        VoxelType::I8 => "char",
        VoxelType::U16 => "unsigned_short",
        VoxelType::I16 => "short",
        VoxelType::U32 => "unsigned_int",
        VoxelType::I32 => "int",
        VoxelType::F32 => "float",
        VoxelType::F64 => "double",
    };
    let count = sample.voxels.len();
    let head = format!(
        "# vtk DataFile Version {version}\na test\n{encoding}\nDATASET STRUCTURED_POINTS\nDIMENSIONS {}\nSPACING 1 2 3\nORIGIN 0 0 0\nPOINT_DATA {count}\nSCALARS density {kind} 1\nLOOKUP_TABLE default\n",
        sample.sizes()
    );
    let data = if encoding == "BINARY" { sample.bytes(Endian::Big) } else { sample.text().into_bytes() };
    join(&[head.as_bytes(), &data, b"\nMETADATA\nINFORMATION 0\n\n"])
}

/// A `.npy` file from its dictionary and numbers.
pub(crate) fn npy_raw(version: u8, dictionary: &str, data: &[u8]) -> Vec<u8> {
    let mut text = dictionary.to_owned();
    let before = if version == 1 { 10 } else { 12 };
    while (before + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut out = b"\x93NUMPY".to_vec();
    out.extend([version, 0]);
    match version {
        1 => out.extend((text.len() as u16).to_le_bytes()),
        _ => out.extend((text.len() as u32).to_le_bytes()),
    }
    out.extend(text.bytes());
    out.extend(data);
    out
}

pub(crate) fn npy(sample: &Sample, endian: Endian, fortran: bool, version: u8) -> Vec<u8> {
    let order = if endian == Endian::Big { '>' } else { '<' };
    let code = match sample.kind() {
        VoxelType::U8 => "|u1".to_owned(),
        VoxelType::I8 => "|i1".to_owned(),
        VoxelType::U16 => format!("{order}u2"),
        VoxelType::I16 => format!("{order}i2"),
        VoxelType::U32 => format!("{order}u4"),
        VoxelType::I32 => format!("{order}i4"),
        VoxelType::F32 => format!("{order}f4"),
        VoxelType::F64 => format!("{order}f8"),
    };
    let [nx, ny, nz] = sample.dims;
    let mut data = sample.bytes(endian);
    if fortran {
        // The first axis, z, varies fastest.
        let size = sample.kind().bytes();
        let plain = std::mem::take(&mut data);
        for x in 0..nx {
            for y in 0..ny {
                for z in 0..nz {
                    let at = ((z * ny + y) * nx + x) * size;
                    data.extend(&plain[at..at + size]);
                }
            }
        }
    }
    let fortran = if fortran { "True" } else { "False" };
    npy_raw(version, &format!("{{'descr': '{code}', 'fortran_order': {fortran}, 'shape': ({nz}, {ny}, {nx}), }}"), &data)
}

/// A VolVis file that says `dims` before `voxels`.
pub(crate) fn dat(dims: [u16; 3], voxels: &[u8]) -> Vec<u8> {
    join(&[dims.map(u16::to_le_bytes).as_flattened(), voxels])
}

/// A zip file of `entries`; `change` may falsify (packed, unpacked, crc) in the directory.
pub(crate) fn zip(entries: &[(&str, Vec<u8>)], deflated: bool, change: impl Fn(&mut (u32, u32, u32))) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in entries {
        let data = if deflated { deflate(bytes) } else { bytes.clone() };
        let mut crc = flate2::Crc::new();
        crc.update(bytes);
        let mut fields = (data.len() as u32, bytes.len() as u32, crc.sum());
        let at = out.len() as u32;
        let common = |f: (u32, u32, u32)| {
            let mut part = vec![20, 0, 0, 0, if deflated { 8 } else { 0 }, 0, 0, 0, 0, 0];
            for n in [f.2, f.0, f.1] {
                part.extend(n.to_le_bytes());
            }
            part.extend((name.len() as u16).to_le_bytes());
            part.extend([0, 0]);
            part
        };
        out.extend(b"PK\x03\x04");
        out.extend(common(fields));
        out.extend(name.bytes());
        out.extend(data);
        change(&mut fields);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(common(fields));
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.bytes());
    }
    let at = out.len() as u32;
    out.extend(&directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend([(entries.len() as u16).to_le_bytes(); 2].concat());
    out.extend((directory.len() as u32).to_le_bytes());
    out.extend(at.to_le_bytes());
    out.extend([0, 0]);
    out
}

pub(crate) fn npz(entries: &[(&str, Vec<u8>)], deflated: bool) -> Vec<u8> {
    zip(entries, deflated, |_| {})
}
