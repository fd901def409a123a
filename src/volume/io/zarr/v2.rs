//! Metadata of version 2: `.zarray`, beside it `.zattrs`.
//!
//! Source of the format: "Zarr storage specification version 2", <https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html>, section
//! "Arrays". Compressors and filters are those of numcodecs, <https://numcodecs.readthedocs.io>.

use super::array::{self, Array, Keys};
use super::codecs::Codec;
use super::json::Json;
use super::types::{self, Fill};
use crate::Result;
use serde_json::Value;
use std::path::Path;

/// The array in the folder `way` whose `.zarray` is the file `path`, which holds `value`.
pub(super) fn array(path: &Path, way: &str, value: &Value, attributes: &Value) -> Result<Array> {
    let json = Json::new(path, value);
    let version = json.need("zarr_format")?;
    if version.count()? != 2 {
        return Err(version.fault("a .zarray file is of version 2"));
    }
    let shape = array::shape(&json.need("shape")?)?;
    let chunk_shape = array::chunk_shape(&json.need("chunks")?, &shape)?;
    let (stored, endian) = types::of_version_2(&json.need("dtype")?)?;
    let fill = Fill::new(stored, json.get("fill_value").as_ref())?;
    let order = json.need("order")?;
    let order = match order.text()? {
        "C" => (0..shape.len()).collect(),
        "F" => (0..shape.len()).rev().collect(),
        _ => return Err(order.fault("neither C nor F")),
    };
    let nested = match json.get("dimension_separator") {
        None => false,
        Some(separator) => match separator.text()? {
            "/" => true,
            "." => false,
            _ => return Err(separator.fault("neither . nor /")),
        },
    };
    let mut codecs = Vec::new();
    if let Some(filters) = json.get("filters") {
        for filter in filters.list()? {
            codecs.push(Codec::filter(&filter, filter.need("id")?.text()?, &filter, stored)?);
        }
    }
    if let Some(compressor) = json.get("compressor") {
        codecs.push(Codec::compressor(&compressor, compressor.need("id")?.text()?)?);
    }
    // What the library xarray writes.
    let names = attributes.get("_ARRAY_DIMENSIONS").and_then(Value::as_array).map_or(&[][..], |n| n);
    let names = names.iter().map(|n| n.as_str().map(str::to_owned)).collect();
    let (path, way, file_shape) = (path.to_path_buf(), way.to_owned(), chunk_shape.clone());
    let keys = Keys { prefix: false, nested };
    Ok(Array { path, way, shape, names, stored, endian, fill, file_shape, chunk_shape, keys, order, codecs, shard: None })
}
