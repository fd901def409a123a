//! Numbers as files store them: byte order, and which type they are kept in.

use crate::volume::{VoxelType, Voxels};
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

    pub(super) fn f64(self, bytes: &[u8]) -> f64 {
        f64::from_bits(self.u64(bytes))
    }
}

/// Type of a number in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stored {
    /// Kept as it is.
    Native(VoxelType),
    /// Kept as i32 when every value fits.
    I64,
    /// Kept as u32 when every value fits.
    U64,
    /// 16-bit IEEE float: kept as f32, exactly.
    F16,
    /// Real and imaginary part of 32 bits each: the magnitude is kept, as f32.
    Complex64,
    /// Real and imaginary part of 64 bits each: the magnitude is kept, as f64.
    Complex128,
}

/// A number that does not fit the type that its kind is kept in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TooLarge {
    /// Which of the numbers, counted from the first one given.
    pub(super) index: usize,
    pub(super) value: i128,
}

/// The f32 of the same value as the f16 with these bits (IEEE 754-2019, 3.6: binary16).
fn from_f16(bits: u16) -> f32 {
    let (sign, exponent, fraction) = (u32::from(bits >> 15) << 31, u32::from(bits >> 10) & 31, u32::from(bits) & 0x3ff);
    match exponent {
        // Subnormal: so many times 2^-24, which f32 holds exactly.
        0 => f32::from_bits(sign | (fraction as f32 * f32::from_bits(0x3380_0000)).to_bits()),
        31 => f32::from_bits(sign | 0x7f80_0000 | fraction << 13),
        _ => f32::from_bits(sign | (exponent + 112) << 23 | fraction << 13),
    }
}

/// Length of (re, im). In f64 that of f32 numbers neither overflows nor vanishes; that of f64 numbers is scaled.
fn magnitude(re: f64, im: f64) -> f64 {
    let scale = re.abs().max(im.abs());
    // Of no length, infinite, or not a number: nothing to divide by.
    if scale == 0.0 || !scale.is_finite() || re.is_nan() || im.is_nan() {
        return if re.is_nan() || im.is_nan() { f64::NAN } else { scale };
    }
    let (a, b) = (re / scale, im / scale);
    scale * (a * a + b * b).sqrt()
}

impl Stored {
    /// Bytes a voxel takes in the file.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Native(kind) => kind.bytes(),
            Self::F16 => 2,
            Self::I64 | Self::U64 | Self::Complex64 => 8,
            Self::Complex128 => 16,
        }
    }

    /// The type it is kept in.
    pub(super) fn voxel_type(self) -> VoxelType {
        match self {
            Self::Native(kind) => kind,
            Self::I64 => VoxelType::I32,
            Self::U64 => VoxelType::U32,
            Self::F16 | Self::Complex64 => VoxelType::F32,
            Self::Complex128 => VoxelType::F64,
        }
    }

    /// Puts the numbers in `bytes` into `out`, from position `first` on.
    ///
    /// # Errors
    /// For a 64-bit integer that does not fit; the numbers before it are in place.
    ///
    /// # Panics
    /// When `out` is not of [`Stored::voxel_type`], has not so much room, or `bytes` end within a number.
    pub(super) fn put(self, endian: Endian, bytes: &[u8], out: &mut Voxels, first: usize) -> Result<(), TooLarge> {
        let size = self.bytes();
        assert!(bytes.len() % size == 0 && out.voxel_type() == self.voxel_type(), "{} bytes of {self} into {out:?}", bytes.len());
        let count = bytes.len() / size;
        match self {
            Self::Native(kind) => {
                let place = &mut out.as_bytes_mut()[first * size..][..bytes.len()];
                place.copy_from_slice(bytes);
                if endian != Endian::NATIVE && kind.bytes() > 1 {
                    place.chunks_exact_mut(size).for_each(<[u8]>::reverse);
                }
                return Ok(());
            }
            Self::I64 | Self::U64 => {
                for (index, word) in bytes.chunks_exact(8).map(|b| endian.u64(b)).enumerate() {
                    let value = if self == Self::U64 { i128::from(word) } else { i128::from(word as i64) };
                    let fits = match out {
                        Voxels::U32(v) => u32::try_from(value).map(|x| v[first + index] = x).is_ok(),
                        Voxels::I32(v) => i32::try_from(value).map(|x| v[first + index] = x).is_ok(),
                        _ => false,
                    };
                    if !fits {
                        return Err(TooLarge { index, value });
                    }
                }
            }
            Self::F16 | Self::Complex64 => {
                let Voxels::F32(v) = out else { return Ok(()) };
                let place = &mut v[first..first + count];
                for (x, b) in place.iter_mut().zip(bytes.chunks_exact(size)) {
                    *x = match self {
                        Self::F16 => from_f16(endian.u16(b)),
                        _ => magnitude(endian.f32(b).into(), endian.f32(&b[4..]).into()) as f32,
                    };
                }
            }
            Self::Complex128 => {
                let Voxels::F64(v) = out else { return Ok(()) };
                let place = &mut v[first..first + count];
                for (x, b) in place.iter_mut().zip(bytes.chunks_exact(size)) {
                    *x = magnitude(endian.f64(b), endian.f64(&b[8..]));
                }
            }
        }
        Ok(())
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
            Self::F16 => f.write_str("f16"),
            Self::Complex64 => f.write_str("complex64"),
            Self::Complex128 => f.write_str("complex128"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_f16_is_read_exactly() {
        for bits in 0..=u16::MAX {
            let (sign, exponent, fraction) = (bits >> 15, i32::from(bits >> 10 & 31), f64::from(bits & 0x3ff));
            let size = match exponent {
                31 if fraction == 0.0 => f64::INFINITY,
                31 => f64::NAN,
                0 => fraction * libm::exp2(-24.0),
                _ => (1024.0 + fraction) * libm::exp2(f64::from(exponent - 25)),
            };
            let expected = if sign == 1 { -size } else { size };
            let found = f64::from(from_f16(bits));
            assert!(found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan(), "{bits:#x}: {found}, not {expected}");
        }
    }

    #[test]
    fn magnitudes_neither_overflow_nor_vanish() {
        for scale in [1.0, 1e300, 1e-300, f64::MIN_POSITIVE] {
            assert!((magnitude(3.0 * scale, -4.0 * scale) / scale - 5.0).abs() < 1e-15, "{scale}");
        }
        assert_eq!((magnitude(0.0, -0.0), magnitude(f64::NEG_INFINITY, 1.0)), (0.0, f64::INFINITY));
        assert!(magnitude(f64::NAN, 1.0).is_nan() && magnitude(f64::INFINITY, f64::NAN).is_nan());
    }

    #[test]
    fn numbers_are_put_in_their_place() {
        let mut out = Voxels::zeros(VoxelType::I16, 4);
        Stored::from(VoxelType::I16).put(Endian::Big, &[1, 2, 0xff, 0xfe], &mut out, 1).expect("fits");
        assert_eq!(out, Voxels::I16(vec![0, 0x102, -2, 0].into()));
        let mut out = Voxels::zeros(VoxelType::I32, 3);
        let bytes: Vec<u8> = [-7i64, 1 << 31].into_iter().flat_map(i64::to_le_bytes).collect();
        assert_eq!(Stored::I64.put(Endian::Little, &bytes, &mut out, 1), Err(TooLarge { index: 1, value: 1 << 31 }));
        assert_eq!(out, Voxels::I32(vec![0, -7, 0].into()));
        let mut out = Voxels::zeros(VoxelType::F32, 2);
        let bytes: Vec<u8> = [3f32, -4.0].into_iter().flat_map(f32::to_be_bytes).collect();
        Stored::Complex64.put(Endian::Big, &bytes, &mut out, 1).expect("fits");
        assert_eq!(out, Voxels::F32(vec![0.0, 5.0].into()));
    }
}
