//! Numbers as files store them: byte order, and which type they are kept in.

use crate::volume::VoxelType;
use std::fmt;

/// Order of the bytes of a number in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Endian {
    /// Least significant byte first.
    #[default]
    Little,
    /// Most significant byte first.
    Big,
}

impl Endian {
    /// This machine's.
    pub(super) const NATIVE: Self = if cfg!(target_endian = "big") { Self::Big } else { Self::Little };

    /// The order called `little` or `big` in a scene file.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "little" => Some(Self::Little),
            "big" => Some(Self::Big),
            _ => None,
        }
    }

    /// The number in `bytes`; missing bytes count as zeros.
    fn number(self, bytes: &[u8]) -> u64 {
        let fold = |n: u64, &b: &u8| n << 8 | u64::from(b);
        match self {
            Self::Little => bytes.iter().rev().fold(0, fold),
            Self::Big => bytes.iter().fold(0, fold),
        }
    }

    pub(super) fn u16(self, bytes: &[u8]) -> u16 {
        self.number(&bytes[..2]) as u16
    }

    pub(super) fn u32(self, bytes: &[u8]) -> u32 {
        self.number(&bytes[..4]) as u32
    }

    pub(super) fn u64(self, bytes: &[u8]) -> u64 {
        self.number(&bytes[..8])
    }

    pub(super) fn f32(self, bytes: &[u8]) -> f32 {
        f32::from_bits(self.u32(bytes))
    }
}

/// Type of a voxel in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stored {
    /// Kept as it is.
    Native(VoxelType),
    /// Kept as i32 when every value fits.
    I64,
    /// Kept as u32 when every value fits.
    U64,
}

impl Stored {
    /// Bytes a voxel takes in the file.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Native(kind) => kind.bytes(),
            Self::I64 | Self::U64 => 8,
        }
    }

    /// The type it is kept in.
    pub(super) fn voxel_type(self) -> VoxelType {
        match self {
            Self::Native(kind) => kind,
            Self::I64 => VoxelType::I32,
            Self::U64 => VoxelType::U32,
        }
    }
}

impl From<VoxelType> for Stored {
    fn from(kind: VoxelType) -> Self {
        Self::Native(kind)
    }
}

impl fmt::Display for Stored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Native(kind) => kind.fmt(f),
            Self::I64 => f.write_str("i64"),
            Self::U64 => f.write_str("u64"),
        }
    }
}
