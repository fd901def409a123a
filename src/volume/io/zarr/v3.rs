//! Metadata of version 3: `zarr.json`.
//!
//! Source of the format: "Zarr core specification version 3.1", <https://zarr-specs.readthedocs.io/en/latest/v3/core/index.html>, sections
//! "Array metadata", "Regular grids", "Chunk key encoding"; its codecs bytes, transpose and sharding_indexed,
//! <https://zarr-specs.readthedocs.io/en/latest/v3/codecs/index.html>. Codecs of numcodecs are known as `numcodecs.NAME`.

use super::array::{self, Array, Keys, ShardIndex};
use super::codecs::Codec;
use super::json::Json;
use super::types::{self, Fill};
use crate::Result;
use crate::volume::io::{Endian, Stored};
use serde_json::Value;
use std::path::Path;

/// Something that has a name and is configured; without a configuration the name may stand alone.
struct Named<'a> {
    json: Json<'a>,
    name: &'a str,
}

impl<'a> Named<'a> {
    fn new(json: Json<'a>) -> Result<Self> {
        let name = match json.value().as_str() {
            Some(name) => name,
            None => json.need("name")?.text()?,
        };
        Ok(Self { json, name })
    }

    /// What it is configured by, at `key`.
    fn get(&self, key: &str) -> Option<Json<'a>> {
        self.json.get("configuration")?.get(key)
    }

    fn need(&self, key: &str) -> Result<Json<'a>> {
        self.json.need("configuration")?.need(key)
    }
}

/// What a list of codecs says.
struct Chain {
    endian: Endian,
    order: Vec<usize>,
    chunk_shape: Vec<usize>,
    codecs: Vec<Codec>,
    shard: Option<ShardIndex>,
}

/// The array in the folder `way` whose `zarr.json` is the file `path`, which holds `value`.
pub(super) fn array(path: &Path, way: &str, value: &Value) -> Result<Array> {
    let json = Json::new(path, value);
    let shape = array::shape(&json.need("shape")?)?;
    let stored = types::of_version_3(&json.need("data_type")?)?;
    let fill = Fill::new(stored, json.get("fill_value").as_ref())?;
    let grid = Named::new(json.need("chunk_grid")?)?;
    if grid.name != "regular" {
        return Err(grid.json.fault("a grid of chunks that is not regular is not supported"));
    }
    let file_shape = array::chunk_shape(&grid.need("chunk_shape")?, &shape)?;
    let keys = keys(&Named::new(json.need("chunk_key_encoding")?)?)?;
    if let Some(transformers) = json.get("storage_transformers") {
        if !transformers.list()?.is_empty() {
            return Err(transformers.fault("storage transformers are not supported"));
        }
    }
    let chain = chain(&json.need("codecs")?, &file_shape, stored, true)?;
    let mut names = Vec::new();
    if let Some(list) = json.get("dimension_names") {
        names = list.list()?.iter().map(|n| n.value().as_str().map(str::to_owned)).collect();
    }
    let Chain { endian, order, chunk_shape, codecs, shard } = chain;
    let (path, way) = (path.to_path_buf(), way.to_owned());
    Ok(Array { path, way, shape, names, stored, endian, fill, file_shape, chunk_shape, keys, order, codecs, shard })
}

fn keys(encoding: &Named) -> Result<Keys> {
    let prefix = match encoding.name {
        "default" => true,
        "v2" => false,
        _ => return Err(encoding.json.fault("an encoding of chunk keys that is not supported")),
    };
    let nested = match encoding.get("separator") {
        None => prefix,
        Some(separator) => match separator.text()? {
            "/" => true,
            "." => false,
            _ => return Err(separator.fault("neither . nor /")),
        },
    };
    Ok(Keys { prefix, nested })
}

/// The codecs of chunks of `shape`; `outer` ones may cut a file into smaller chunks.
fn chain(list: &Json, shape: &[usize], stored: Stored, outer: bool) -> Result<Chain> {
    let mut chain =
        Chain { endian: Endian::Little, order: (0..shape.len()).collect(), chunk_shape: shape.to_vec(), codecs: Vec::new(), shard: None };
    // Codecs of arrays come first, then one that turns the array into bytes, then those of bytes.
    let mut bytes = false;
    for json in list.list()? {
        let codec = Named::new(json)?;
        match codec.name {
            "transpose" if !bytes => {
                let order = permutation(&codec.need("order")?, shape.len())?;
                chain.order = order.iter().map(|&axis| chain.order[axis]).collect();
            }
            "bytes" if !bytes => {
                bytes = true;
                chain.endian = endian(&codec, stored)?;
            }
            "sharding_indexed" if !bytes && outer => {
                if chain.order.iter().enumerate().any(|(i, &axis)| i != axis) {
                    return Err(codec.json.fault("shards of a transposed array are not supported"));
                }
                bytes = true;
                chain = shards(&codec, shape, stored)?;
            }
            "sharding_indexed" if !bytes => return Err(codec.json.fault("shards within shards are not supported")),
            name if bytes && chain.shard.is_none() => {
                let configured = codec.json.get("configuration");
                let configured = configured.as_ref().unwrap_or(&codec.json);
                chain.codecs.push(match name.strip_prefix("numcodecs.") {
                    Some("shuffle") => Codec::filter(&codec.json, "shuffle", configured, stored)?,
                    Some(name) => Codec::compressor(&codec.json, name)?,
                    None => Codec::compressor(&codec.json, name)?,
                });
            }
            _ if chain.shard.is_some() => return Err(codec.json.fault("codecs of whole shards are not supported")),
            _ => return Err(codec.json.fault("a codec that is not supported here")),
        }
    }
    match bytes {
        true => Ok(chain),
        false => Err(list.fault("the codec bytes is missing")),
    }
}

fn endian(codec: &Named, stored: Stored) -> Result<Endian> {
    match codec.get("endian") {
        Some(endian) => Endian::from_name(endian.text()?).ok_or_else(|| endian.fault("neither little nor big")),
        None if stored.bytes() == 1 => Ok(Endian::Little),
        None => Err(codec.json.fault(format!("endian is missing for numbers of {} bytes", stored.bytes()))),
    }
}

fn permutation(json: &Json, count: usize) -> Result<Vec<usize>> {
    match json.value().as_str() {
        Some("C") => return Ok((0..count).collect()),
        Some("F") => return Ok((0..count).rev().collect()),
        _ => {}
    }
    let order = json.list()?.iter().map(Json::count).collect::<Result<Vec<usize>>>()?;
    let mut sorted = order.clone();
    sorted.sort_unstable();
    if !sorted.into_iter().eq(0..count) {
        return Err(json.fault(format!("not the numbers 0 to {} in some order", count - 1)));
    }
    Ok(order)
}

fn shards(codec: &Named, shape: &[usize], stored: Stored) -> Result<Chain> {
    let json = codec.need("chunk_shape")?;
    let chunk_shape = array::chunk_shape(&json, shape)?;
    if let Some(axis) = (0..shape.len()).find(|&axis| shape[axis] % chunk_shape[axis] != 0) {
        return Err(json.fault(format!("a shard of {} is no whole number of chunks of {}", shape[axis], chunk_shape[axis])));
    }
    let at_end = match codec.get("index_location") {
        None => true,
        Some(location) => match location.text()? {
            "end" => true,
            "start" => false,
            _ => return Err(location.fault("neither start nor end")),
        },
    };
    let list = codec.need("index_codecs")?;
    // The index is made of 64-bit integers.
    let index = chain(&list, &[], Stored::U64, false)?;
    let checked = match index.codecs[..] {
        [] => false,
        [Codec::Crc32c] => true,
        _ => return Err(list.fault("an index of shards is read where its codecs are bytes and crc32c alone")),
    };
    let inner = chain(&codec.need("codecs")?, &chunk_shape, stored, false)?;
    Ok(Chain { shard: Some(ShardIndex { at_end, endian: index.endian, checked }), ..inner })
}
