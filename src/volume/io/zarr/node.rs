//! The nodes of a hierarchy: groups, and the arrays in them.

use super::array::Array;
use super::json::{self, Json};
use super::tree::Tree;
use super::{v2, v3};
use crate::{Error, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Most nodes that are looked into.
const MOST_NODES: usize = 1 << 12;
/// Most groups in each other.
const DEEPEST: usize = 16;

/// The metadata files, those first that go first where there are several.
pub(super) const FILES: [&str; 4] = ["zarr.json", ".zarray", ".zgroup", ".zattrs"];

/// A group or an array.
pub(super) struct Node {
    /// The file that its attributes stand in, for messages.
    pub(super) path: PathBuf,
    /// Its folder in the folder that was given; empty where it is that one.
    pub(super) way: String,
    /// What others noted about it: an object, or nothing.
    pub(super) attributes: Value,
    /// Nothing where it is a group.
    pub(super) array: Option<Metadata>,
}

/// The metadata of an array, not looked into yet.
pub(super) struct Metadata {
    path: PathBuf,
    value: Value,
    version: u8,
}

/// `name` in the folder at `way`.
pub(super) fn join(way: &str, name: &str) -> String {
    if way.is_empty() { name.to_owned() } else { format!("{way}/{name}") }
}

/// Reads the metadata file `name` of the folder `way`, where there is one.
fn file(tree: &Tree, way: &str, name: &str) -> Result<Option<(PathBuf, Value)>> {
    let Some(source) = tree.at(&join(way, name))? else { return Ok(None) };
    let path = source.path().to_path_buf();
    Ok(Some((path, json::parse(source)?)))
}

impl Node {
    /// What lies in the folder `way`; `None` where that is no node.
    ///
    /// # Errors
    /// When its metadata cannot be read or are no JSON.
    pub(super) fn open(tree: &Tree, way: &str) -> Result<Option<Self>> {
        let way = way.to_owned();
        if let Some((path, mut value)) = file(tree, &way, FILES[0])? {
            let json = Json::new(&path, &value);
            let (version, kind) = (json.need("zarr_format")?, json.need("node_type")?);
            if version.count()? != 3 {
                return Err(version.fault("a zarr.json file is of version 3"));
            }
            let is_array = match kind.text()? {
                "array" => true,
                "group" => false,
                _ => return Err(kind.fault("neither array nor group")),
            };
            let attributes = value.get_mut("attributes").map(Value::take).unwrap_or_default();
            let array = is_array.then(|| Metadata { path: path.clone(), value, version: 3 });
            return Ok(Some(Self { path, way, attributes, array }));
        }
        let array = file(tree, &way, FILES[1])?.map(|(path, value)| Metadata { path, value, version: 2 });
        let group = if array.is_none() { file(tree, &way, FILES[2])? } else { None };
        let attributes = file(tree, &way, FILES[3])?;
        let path = [&attributes, &group].into_iter().flatten().map(|(path, _)| path).chain(array.iter().map(|a| &a.path)).next().cloned();
        let attributes = attributes.map(|(_, value)| value).unwrap_or_default();
        Ok(path.map(|path| Self { path, way, attributes, array }))
    }

    /// The array that this is; `None` for a group.
    pub(super) fn array(&self) -> Option<Result<Array>> {
        let Metadata { path, value, version } = self.array.as_ref()?;
        Some(match version {
            2 => v2::array(path, &self.way, value, &self.attributes),
            _ => v3::array(path, &self.way, value),
        })
    }

    /// Its name for messages and for `volume.array`.
    pub(super) fn name(&self) -> &str {
        if self.way.is_empty() { "." } else { &self.way }
    }
}

/// The nodes directly in the group `way`, sorted by name.
fn children(tree: &Tree, way: &str) -> Result<Vec<String>> {
    let mut names = Vec::new();
    tree.entries(way, |name, is_folder| {
        names.extend(is_folder.then_some(name));
        match names.len() > MOST_NODES {
            true => Err(too_many(tree.path())),
            false => Ok(()),
        }
    })?;
    names.sort_unstable();
    Ok(names.iter().map(|name| join(way, name)).collect())
}

fn too_many(path: &Path) -> Error {
    let what = format!("{}: folders of the Zarr hierarchy", path.display());
    Error::Limit { what, needed: MOST_NODES as u128 + 1, limit: MOST_NODES as u128 }
}

/// Tells `see` each node in the group `way`, a group before what is in it, else sorted by name. What is in a node is passed over where `see`
/// says so.
pub(super) fn walk(tree: &Tree, way: &str, see: &mut dyn FnMut(Node) -> Result<bool>) -> Result<()> {
    let mut open = children(tree, way)?;
    open.reverse();
    let mut seen = open.len();
    while let Some(way) = open.pop() {
        let Some(node) = Node::open(tree, &way)? else { continue };
        let inner = node.array.is_none();
        if !see(node)? || !inner || way.matches('/').count() >= DEEPEST {
            continue;
        }
        let found = children(tree, &way)?;
        seen += found.len();
        if seen > MOST_NODES {
            return Err(too_many(tree.path()));
        }
        open.extend(found.into_iter().rev());
    }
    Ok(())
}
