//! A writer of VTK's XML format with every way to write an array.

use crate::files::{join, zlib};
use slicestack::volume::VoxelType;
use slicestack::volume::io::Endian;

/// Where an array's numbers are put.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    Text,
    Base64,
    AppendedRaw,
    AppendedBase64,
}

/// What blocks are compressed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pack {
    None,
    Zlib,
    Lz4,
}

/// How a file is written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Style {
    pub(crate) way: Way,
    pub(crate) pack: Pack,
    pub(crate) endian: Endian,
    pub(crate) wide: bool,
    pub(crate) block: usize,
}

/// An array: attributes (type, name, components), its bytes in the file's order and its numbers as text.
pub(crate) struct Array {
    pub(crate) kind: &'static str,
    pub(crate) name: String,
    pub(crate) components: usize,
    pub(crate) bytes: Vec<u8>,
    pub(crate) text: String,
}

pub(crate) fn kind_name(kind: VoxelType) -> &'static str {
    match kind {
        VoxelType::U8 => "UInt8",
        VoxelType::I8 => "Int8",
        VoxelType::U16 => "UInt16",
        VoxelType::I16 => "Int16",
        VoxelType::U32 => "UInt32",
        VoxelType::I32 => "Int32",
        VoxelType::F32 => "Float32",
        VoxelType::F64 => "Float64",
    }
}

pub(crate) fn base64(bytes: &[u8]) -> Vec<u8> {
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = Vec::new();
    for part in bytes.chunks(3) {
        let word = part.iter().fold(0u32, |w, &b| w << 8 | u32::from(b)) << (8 * (3 - part.len()));
        out.extend((0..4).map(|i| if i <= part.len() { alphabet[(word >> (18 - 6 * i)) as usize & 63] } else { b'=' }));
    }
    out
}

impl Style {
    pub(crate) fn new(way: Way, pack: Pack) -> Self {
        Self { way, pack, endian: Endian::Little, wide: false, block: 96 }
    }

    fn words(&self, words: &[usize]) -> Vec<u8> {
        let mut out = Vec::new();
        for &n in words {
            match (self.endian, self.wide) {
                (Endian::Little, false) => out.extend((n as u32).to_le_bytes()),
                (Endian::Big, false) => out.extend((n as u32).to_be_bytes()),
                (Endian::Little, true) => out.extend((n as u64).to_le_bytes()),
                (Endian::Big, true) => out.extend((n as u64).to_be_bytes()),
            }
        }
        out
    }

    /// What stands in the file for these bytes, in front of them what describes them.
    fn packed(&self, bytes: &[u8]) -> Vec<u8> {
        let text = matches!(self.way, Way::Base64 | Way::AppendedBase64);
        if self.pack == Pack::None {
            let all = join(&[&self.words(&[bytes.len()]), bytes]);
            return if text { base64(&all) } else { all };
        }
        let blocks: Vec<Vec<u8>> =
            bytes.chunks(self.block).map(|b| if self.pack == Pack::Zlib { zlib(b) } else { lz4_flex::block::compress(b) }).collect();
        let mut words = vec![blocks.len(), self.block, bytes.len() % self.block];
        words.extend(blocks.iter().map(Vec::len));
        let (head, data) = (self.words(&words), blocks.concat());
        // Table and blocks are encoded each for itself.
        if text { join(&[&base64(&head), &base64(&data)]) } else { join(&[&head, &data]) }
    }

    /// One array's element; appended ones go to `appended`.
    pub(crate) fn array(&self, array: &Array, appended: &mut Vec<u8>) -> Vec<u8> {
        let Array { kind, name, components, bytes, text } = array;
        let attributes = format!("type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
        let element = |format: &str, data: &[u8]| {
            join(&[format!("<DataArray {attributes} format=\"{format}\">\n").as_bytes(), data, b"\n</DataArray>\n"])
        };
        match self.way {
            Way::Text => element("ascii", text.as_bytes()),
            Way::Base64 => element("binary", &self.packed(bytes)),
            Way::AppendedRaw | Way::AppendedBase64 => {
                let offset = appended.len();
                appended.extend(self.packed(bytes));
                format!("<DataArray {attributes} format=\"appended\" RangeMin=\"0\" offset=\"{offset}\"/>\n").into_bytes()
            }
        }
    }

    /// A file of `kind` around `inside`, which is what its element holds.
    pub(crate) fn file(&self, kind: &str, attributes: &str, inside: &[u8], appended: &[u8]) -> Vec<u8> {
        let order = if self.endian == Endian::Big { "BigEndian" } else { "LittleEndian" };
        let header = if self.wide { "UInt64" } else { "UInt32" };
        let pack = match self.pack {
            Pack::None => "",
            Pack::Zlib => " compressor=\"vtkZLibDataCompressor\"",
            Pack::Lz4 => " compressor=\"vtkLZ4DataCompressor\"",
        };
        let head = format!(
            "<?xml version=\"1.0\"?>\n<!-- a test > of <DataArray> -->\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"{order}\" header_type=\"{header}\"{pack}>\n<{kind} {attributes}>\n"
        );
        let encoding = if self.way == Way::AppendedRaw { "raw" } else { "base64" };
        let tail = match self.way {
            Way::Text | Way::Base64 => b"</VTKFile>\n".to_vec(),
            _ => join(&[format!("<AppendedData encoding=\"{encoding}\">\n _").as_bytes(), appended, b"\n</AppendedData>\n</VTKFile>\n"]),
        };
        join(&[head.as_bytes(), inside, format!("</{kind}>\n").as_bytes(), &tail])
    }

    /// Image data of one piece with these arrays of points and of cells; `dims` points.
    pub(crate) fn image(&self, dims: [usize; 3], attributes: &str, points: &[Array], cells: &[Array]) -> Vec<u8> {
        let mut appended = Vec::new();
        let mut inside = Vec::new();
        let extent = format!("0 {} 0 {} 0 {}", dims[0] - 1, dims[1] - 1, dims[2] - 1);
        inside.extend(format!("<Piece Extent=\"{extent}\">\n<PointData>\n").bytes());
        points.iter().for_each(|a| inside.extend(self.array(a, &mut appended)));
        inside.extend(b"</PointData>\n<CellData>\n");
        cells.iter().for_each(|a| inside.extend(self.array(a, &mut appended)));
        inside.extend(b"</CellData>\n</Piece>\n");
        self.file("ImageData", &format!("WholeExtent=\"{extent}\" {attributes}"), &inside, &appended)
    }
}
