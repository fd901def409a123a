//! Types of numbers by their names, and fill values: what voxels are where no chunk is stored.

use super::json::Json;
use crate::Result;
use crate::volume::io::{Endian, Stored};
use crate::volume::{VoxelType, Voxels};
use serde_json::Value;

/// The type that version 2 calls by NumPy's code, such as `<i2`: byte order, kind, bytes.
pub(super) fn of_version_2(json: &Json) -> Result<(Stored, Endian)> {
    if json.value().is_array() {
        return Err(json.fault("records of several fields are not supported"));
    }
    let code = json.text()?;
    let (endian, kind) = match code.split_at_checked(1) {
        Some(("<" | "|", kind)) => (Endian::Little, kind),
        Some((">", kind)) => (Endian::Big, kind),
        _ => return Err(json.fault("a type starts with <, > or |")),
    };
    let stored = match kind {
        "b1" => "bool",
        "i1" => "int8",
        "u1" => "uint8",
        "i2" => "int16",
        "u2" => "uint16",
        "i4" => "int32",
        "u4" => "uint32",
        "i8" => "int64",
        "u8" => "uint64",
        "f2" => "float16",
        "f4" => "float32",
        "f8" => "float64",
        "c8" => "complex64",
        "c16" => "complex128",
        _ => "",
    };
    Ok((named(stored).ok_or_else(|| json.fault("a type that is not supported"))?, endian))
}

/// The type that version 3 calls by name, such as `int16`.
pub(super) fn of_version_3(json: &Json) -> Result<Stored> {
    let name = json.value().as_str().unwrap_or_default();
    named(name).ok_or_else(|| json.fault("a type that is not supported"))
}

fn named(name: &str) -> Option<Stored> {
    use VoxelType::{F32, F64, I8, I16, I32, U8, U16, U32};
    Some(match name {
        // One byte: 0 or 1.
        "bool" | "uint8" => U8.into(),
        "int8" => I8.into(),
        "int16" => I16.into(),
        "uint16" => U16.into(),
        "int32" => I32.into(),
        "uint32" => U32.into(),
        "int64" => Stored::I64,
        "uint64" => Stored::U64,
        "float16" => Stored::F16,
        "float32" => F32.into(),
        "float64" => F64.into(),
        "complex64" => Stored::Complex64,
        "complex128" => Stored::Complex128,
        _ => return None,
    })
}

/// The value of voxels that are not stored.
#[derive(Debug, Clone)]
pub(super) struct Fill {
    /// One voxel of it; `None` where it does not fit the type that voxels are kept in.
    pub(super) voxel: Option<Voxels>,
    /// As the metadata has it.
    pub(super) shown: String,
}

impl Fill {
    /// The fill value of voxels of `stored`; 0 where there is none.
    pub(super) fn new(stored: Stored, json: Option<&Json>) -> Result<Self> {
        let mut one = Voxels::zeros(stored.voxel_type(), 1);
        let Some(json) = json else { return Ok(Self { voxel: Some(one), shown: "0".to_owned() }) };
        let shown = json.value().to_string();
        // There are more numbers than a voxel of 16 bits tells: those are kept as f32 anyway.
        if let (Stored::F16, Some(value)) = (stored, float(json.value())) {
            return Ok(Self { voxel: Some(vec![value as f32].into()), shown });
        }
        let bytes = bytes(stored, json.value()).ok_or_else(|| json.fault(format!("no value of {stored}")))?;
        let fits = stored.put(Endian::Little, &bytes, &mut one, 0).is_ok();
        Ok(Self { voxel: fits.then_some(one), shown })
    }

    /// The bytes of one voxel in memory, where they are not all 0.
    pub(super) fn pattern(&self) -> Option<Vec<u8>> {
        let mut voxel = self.voxel.clone()?;
        let bytes = voxel.as_bytes_mut();
        bytes.iter().any(|&b| b != 0).then(|| bytes.to_vec())
    }
}

/// A number, or the name of one that is none.
fn float(value: &Value) -> Option<f64> {
    match value {
        Value::String(name) => match name.as_str() {
            "NaN" => Some(f64::NAN),
            "Infinity" => Some(f64::INFINITY),
            "-Infinity" => Some(f64::NEG_INFINITY),
            _ => None,
        },
        other => other.as_f64(),
    }
}

/// A whole number; some writers put a point and a zero behind it.
fn whole(value: &Value) -> Option<i128> {
    match value {
        Value::Bool(truth) => Some((*truth).into()),
        Value::Number(n) if n.is_u64() || n.is_i64() => n.as_u64().map(i128::from).or_else(|| n.as_i64().map(i128::from)),
        other => other.as_f64().filter(|v| libm::trunc(*v) == *v && v.abs() < 1e18).map(|v| v as i128),
    }
}

/// The bytes of a number in hexadecimal, such as `0x7fc00000`, least significant first.
fn hexadecimal(value: &Value, size: usize) -> Option<Vec<u8>> {
    let digits = value.as_str()?.strip_prefix("0x")?;
    let bits = u64::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 2 * size)?;
    Some(bits.to_le_bytes()[..size].to_vec())
}

/// The bytes of `value` as a voxel of `stored`, least significant first; `None` where it is no such value.
fn bytes(stored: Stored, value: &Value) -> Option<Vec<u8>> {
    let part = |value: &Value, size: usize| {
        hexadecimal(value, size).or_else(|| {
            let value = float(value)?;
            Some(if size == 4 { (value as f32).to_le_bytes().to_vec() } else { value.to_le_bytes().to_vec() })
        })
    };
    macro_rules! integer {
        ($t:ty) => {
            whole(value).and_then(|v| <$t>::try_from(v).ok()).map(|v| v.to_le_bytes().to_vec())
        };
    }
    match stored {
        Stored::Native(VoxelType::U8) => integer!(u8),
        Stored::Native(VoxelType::I8) => integer!(i8),
        Stored::Native(VoxelType::U16) => integer!(u16),
        Stored::Native(VoxelType::I16) => integer!(i16),
        Stored::Native(VoxelType::U32) => integer!(u32),
        Stored::Native(VoxelType::I32) => integer!(i32),
        Stored::I64 => integer!(i64),
        Stored::U64 => integer!(u64),
        Stored::Native(VoxelType::F32) => part(value, 4),
        Stored::Native(VoxelType::F64) => part(value, 8),
        Stored::F16 => hexadecimal(value, 2),
        Stored::Complex64 | Stored::Complex128 => {
            let size = stored.bytes() / 2;
            match value.as_array().map(Vec::as_slice) {
                Some([re, im]) => Some([part(re, size)?, part(im, size)?].concat()),
                Some(_) => None,
                None => Some([part(value, size)?, vec![0; size]].concat()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::path::Path;

    #[test]
    fn fill_values_are_of_the_type() {
        let found = |stored: Stored, value: Value| {
            Fill::new(stored, Some(&Json::new(Path::new("a"), &value))).ok().map(|f| f.voxel.map(|v| v.get(0)))
        };
        use VoxelType::{F32, F64, I16, U8};
        assert_eq!(found(I16.into(), json!(-7)), Some(Some(-7.0)));
        assert_eq!(found(I16.into(), json!(3.0)), Some(Some(3.0)));
        assert_eq!(found(U8.into(), json!(true)), Some(Some(1.0)));
        assert_eq!(found(U8.into(), json!(256)), None);
        assert_eq!(found(U8.into(), json!("NaN")), None);
        assert_eq!(found(I16.into(), json!(0.5)), None);
        assert_eq!(found(F32.into(), json!("-Infinity")), Some(Some(f64::NEG_INFINITY)));
        assert_eq!(found(F32.into(), json!("0x40490fdb")), Some(Some(f64::from(f32::from_bits(0x4049_0fdb)))));
        assert_eq!(found(F32.into(), json!("0x4049")), None);
        assert!(found(F64.into(), json!("NaN")).flatten().is_some_and(f64::is_nan));
        assert_eq!(found(Stored::F16, json!("0x3c00")), Some(Some(1.0)));
        assert_eq!(found(Stored::F16, json!(-2)), Some(Some(-2.0)));
        assert_eq!(found(Stored::Complex64, json!([3, 4.0])), Some(Some(5.0)));
        assert_eq!(found(Stored::I64, json!(i64::MIN)), Some(None));
        assert_eq!(found(Stored::U64, json!(u64::from(u32::MAX))), Some(Some(f64::from(u32::MAX))));
    }
}
