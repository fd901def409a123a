//! Voxels in their own type: nothing is converted on load.

use super::buffer::Buffer;
use crate::lanes::Number;
use std::fmt;

/// Number type of a voxel as it lies in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it all")]
pub enum VoxelType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

impl VoxelType {
    /// All types, smallest first.
    pub const ALL: [Self; 8] = [Self::U8, Self::I8, Self::U16, Self::I16, Self::U32, Self::I32, Self::F32, Self::F64];

    /// Bytes a voxel takes.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Whether it may be NaN or infinite.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The name used in scene files: `u8`, `i16`, `f32` ...
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// The type called `name` in a scene file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }

    /// Smallest and largest value the type holds; for floats, of finite values.
    pub fn limits(self) -> (f64, f64) {
        match self {
            Self::U8 => (0.0, f64::from(u8::MAX)),
            Self::I8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
            Self::U16 => (0.0, f64::from(u16::MAX)),
            Self::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
            Self::U32 => (0.0, f64::from(u32::MAX)),
            Self::I32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
            Self::F32 => (f64::from(f32::MIN), f64::from(f32::MAX)),
            Self::F64 => (f64::MIN, f64::MAX),
        }
    }
}

impl fmt::Display for VoxelType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

mod sealed {
    pub trait Sealed {}
}

/// A number a voxel can be. Implemented for the eight types of [`VoxelType`] and closed.
pub trait Voxel: Number + sealed::Sealed + bytemuck::Pod + PartialOrd + Send + Sync + fmt::Debug + 'static {
    /// The run-time name of this type.
    const TYPE: VoxelType;
    /// Whether it may be NaN or infinite.
    const FLOAT: bool;
    /// The value nearest to `value`, saturating.
    fn from_f64(value: f64) -> Self;
    /// The same number with its bytes in the opposite order.
    #[must_use]
    fn swap_bytes(self) -> Self;
    /// This type's slice of `voxels`, if that is what they are.
    fn slice(voxels: &Voxels) -> Option<&[Self]>;
    /// Voxels from numbers of this type.
    fn wrap(values: Buffer<Self>) -> Voxels;
    /// Whether it is neither NaN nor infinite.
    fn is_finite(self) -> bool;
}

/// A volume's voxels, x fastest, then y, then z.
#[derive(Clone, PartialEq)]
#[allow(missing_docs, reason = "the names say it all")]
pub enum Voxels {
    U8(Buffer<u8>),
    I8(Buffer<i8>),
    U16(Buffer<u16>),
    I16(Buffer<i16>),
    U32(Buffer<u32>),
    I32(Buffer<i32>),
    F32(Buffer<f32>),
    F64(Buffer<f64>),
}

macro_rules! voxel_types {
    ($($t:ty, $v:ident, $swap:expr, $f32:expr, $from:expr, $finite:expr;)*) => {
        $(
            impl sealed::Sealed for $t {}
            impl Number for $t {
                #[inline(always)]
                fn to_f32(self) -> f32 { let f: fn($t) -> f32 = $f32; f(self) }
                #[inline(always)]
                fn to_f64(self) -> f64 { f64::from(self) }
            }
            impl Voxel for $t {
                const TYPE: VoxelType = VoxelType::$v;
                const FLOAT: bool = matches!(VoxelType::$v, VoxelType::F32 | VoxelType::F64);
                #[inline(always)]
                fn is_finite(self) -> bool { let f: fn($t) -> bool = $finite; f(self) }
                #[inline]
                fn from_f64(value: f64) -> Self { let f: fn(f64) -> $t = $from; f(value) }
                #[inline]
                fn swap_bytes(self) -> Self { let f: fn($t) -> $t = $swap; f(self) }
                fn slice(voxels: &Voxels) -> Option<&[Self]> { if let Voxels::$v(v) = voxels { Some(v) } else { None } }
                fn wrap(values: Buffer<Self>) -> Voxels { Voxels::$v(values) }
            }
        )*
    };
}

voxel_types! {
    u8, U8, |v| v, |v| f32::from(v), |v| libm::rint(v) as u8, |_| true;
    i8, I8, |v| v, |v| f32::from(v), |v| libm::rint(v) as i8, |_| true;
    u16, U16, |v| v.swap_bytes(), |v| f32::from(v), |v| libm::rint(v) as u16, |_| true;
    i16, I16, |v| v.swap_bytes(), |v| f32::from(v), |v| libm::rint(v) as i16, |_| true;
    u32, U32, |v| v.swap_bytes(), |v| v as f32, |v| libm::rint(v) as u32, |_| true;
    i32, I32, |v| v.swap_bytes(), |v| v as f32, |v| libm::rint(v) as i32, |_| true;
    f32, F32, |v| f32::from_bits(v.to_bits().swap_bytes()), |v| v, |v| v as f32, f32::is_finite;
    f64, F64, |v| f64::from_bits(v.to_bits().swap_bytes()), |v| v as f32, |v| v, f64::is_finite;
}

/// Runs an expression with a name bound to the typed [`Buffer`] inside a [`Voxels`].
macro_rules! with_voxels {
    ($voxels:expr, $slice:ident => $body:expr) => {
        match $voxels {
            $crate::volume::Voxels::U8($slice) => $body,
            $crate::volume::Voxels::I8($slice) => $body,
            $crate::volume::Voxels::U16($slice) => $body,
            $crate::volume::Voxels::I16($slice) => $body,
            $crate::volume::Voxels::U32($slice) => $body,
            $crate::volume::Voxels::I32($slice) => $body,
            $crate::volume::Voxels::F32($slice) => $body,
            $crate::volume::Voxels::F64($slice) => $body,
        }
    };
}
pub(crate) use with_voxels;

/// The numbers of [`Voxels`] as slices, wherever they lie: found out once a frame, so that lookups need not ask.
#[derive(Debug, Clone, Copy)]
pub(crate) enum VoxelSlices<'v> {
    U8(&'v [u8]),
    I8(&'v [i8]),
    U16(&'v [u16]),
    I16(&'v [i16]),
    U32(&'v [u32]),
    I32(&'v [i32]),
    F32(&'v [f32]),
    F64(&'v [f64]),
}

/// As [`with_voxels`], for [`VoxelSlices`].
macro_rules! with_slices {
    ($slices:expr, $slice:ident => $body:expr) => {
        match $slices {
            $crate::volume::VoxelSlices::U8($slice) => $body,
            $crate::volume::VoxelSlices::I8($slice) => $body,
            $crate::volume::VoxelSlices::U16($slice) => $body,
            $crate::volume::VoxelSlices::I16($slice) => $body,
            $crate::volume::VoxelSlices::U32($slice) => $body,
            $crate::volume::VoxelSlices::I32($slice) => $body,
            $crate::volume::VoxelSlices::F32($slice) => $body,
            $crate::volume::VoxelSlices::F64($slice) => $body,
        }
    };
}
pub(crate) use with_slices;

impl Voxels {
    /// The numbers as slices.
    pub(crate) fn slices(&self) -> VoxelSlices<'_> {
        match self {
            Self::U8(v) => VoxelSlices::U8(v),
            Self::I8(v) => VoxelSlices::I8(v),
            Self::U16(v) => VoxelSlices::U16(v),
            Self::I16(v) => VoxelSlices::I16(v),
            Self::U32(v) => VoxelSlices::U32(v),
            Self::I32(v) => VoxelSlices::I32(v),
            Self::F32(v) => VoxelSlices::F32(v),
            Self::F64(v) => VoxelSlices::F64(v),
        }
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        with_voxels!(self, v => v.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Their type.
    pub fn voxel_type(&self) -> VoxelType {
        match self {
            Self::U8(_) => VoxelType::U8,
            Self::I8(_) => VoxelType::I8,
            Self::U16(_) => VoxelType::U16,
            Self::I16(_) => VoxelType::I16,
            Self::U32(_) => VoxelType::U32,
            Self::I32(_) => VoxelType::I32,
            Self::F32(_) => VoxelType::F32,
            Self::F64(_) => VoxelType::F64,
        }
    }

    /// Bytes they take in memory.
    pub fn bytes(&self) -> usize {
        self.len() * self.voxel_type().bytes()
    }

    /// The stored number at position `index`, in f64, not rescaled.
    ///
    /// # Panics
    /// When `index` is not below [`Voxels::len`].
    pub fn get(&self, index: usize) -> f64 {
        with_voxels!(self, v => v[index].to_f64())
    }

    /// `count` zeros of type `kind`.
    pub fn zeros(kind: VoxelType, count: usize) -> Self {
        match kind {
            VoxelType::U8 => Self::U8(vec![0; count].into()),
            VoxelType::I8 => Self::I8(vec![0; count].into()),
            VoxelType::U16 => Self::U16(vec![0; count].into()),
            VoxelType::I16 => Self::I16(vec![0; count].into()),
            VoxelType::U32 => Self::U32(vec![0; count].into()),
            VoxelType::I32 => Self::I32(vec![0; count].into()),
            VoxelType::F32 => Self::F32(vec![0.0; count].into()),
            VoxelType::F64 => Self::F64(vec![0.0; count].into()),
        }
    }

    /// Whether they lie in a mapped file instead of memory; see [`crate::Limits::map_bytes`].
    pub fn is_mapped(&self) -> bool {
        with_voxels!(self, v => v.is_mapped())
    }

    /// The memory itself, for a reader to fill in the file's own byte order. Voxels of a mapped file are brought into memory first.
    pub fn as_bytes_mut(&mut self) -> &mut [u8] {
        with_voxels!(self, v => bytemuck::cast_slice_mut(v))
    }

    /// The memory itself.
    pub(crate) fn bytes_of(&self) -> &[u8] {
        with_voxels!(self, v => bytemuck::cast_slice(v))
    }

    /// Turns every number's bytes around, for files of the other byte order.
    pub fn swap_bytes(&mut self) {
        with_voxels!(self, v => for x in v.iter_mut() { *x = x.swap_bytes(); });
    }
}

impl<T: Voxel> From<Vec<T>> for Voxels {
    fn from(values: Vec<T>) -> Self {
        T::wrap(values.into())
    }
}

impl fmt::Debug for Voxels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.len(), self.voxel_type())
    }
}
