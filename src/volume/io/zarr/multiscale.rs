//! OME-Zarr: images at several levels of detail, with sizes and units of their voxels.
//!
//! Source of the format: "Next-generation file formats (NGFF)", <https://ngff.openmicroscopy.org/latest/>, versions 0.1 to 0.5: "multiscales",
//! "omero", "image-label".

use super::axes::{Axes, Axis, Role};
use super::json::Json;
use super::node::Node;
use crate::Result;
use crate::volume::Segment;
use std::collections::BTreeMap;

/// An image as its group's attributes describe it.
pub(super) struct Multiscale {
    /// What they call it.
    pub(super) name: Option<String>,
    /// How many images the group holds; the first one is this.
    pub(super) images: usize,
    pub(super) axes: Vec<Axis>,
    /// The finest first.
    pub(super) levels: Vec<Level>,
    /// Names of the channels; empty where there are none.
    pub(super) channels: Vec<String>,
    /// The named labels, where voxels are labels.
    pub(super) labels: Option<Vec<Segment>>,
}

/// One level of detail.
pub(super) struct Level {
    /// Its array, as a way from the group.
    pub(super) path: String,
    /// Where the number of index i along an axis is: scale * i + translation; nothing where no scale is given.
    place: Option<(Vec<f64>, Vec<f64>)>,
}

/// Units of length by their names, in metres.
const UNITS: [(&str, f64); 12] = [
    ("angstrom", 1e-10),
    ("picometer", 1e-12),
    ("nanometer", 1e-9),
    ("micrometer", 1e-6),
    ("millimeter", 1e-3),
    ("centimeter", 1e-2),
    ("decimeter", 1e-1),
    ("meter", 1.0),
    ("kilometer", 1e3),
    ("inch", 0.0254),
    ("foot", 0.3048),
    ("yard", 0.9144),
];

/// The attributes in which `node` describes images; `None` where it does not.
fn described<'a>(node: &'a Node) -> Option<Json<'a>> {
    let attributes = Json::new(&node.path, &node.attributes);
    let newer = attributes.get("ome").filter(|ome| ome.get("multiscales").is_some());
    newer.or_else(|| attributes.get("multiscales").is_some().then_some(attributes))
}

/// Whether `node` is an image of several levels.
pub(super) fn is_image(node: &Node) -> bool {
    node.array.is_none() && described(node).is_some()
}

impl Multiscale {
    /// The image that the group `node` holds; `None` where it holds none.
    ///
    /// # Errors
    /// When its description is not as it should be.
    pub(super) fn of(node: &Node) -> Result<Option<Self>> {
        let Some(attributes) = described(node).filter(|_| node.array.is_none()) else { return Ok(None) };
        let list = attributes.need("multiscales")?;
        let images = list.list()?;
        let Some(image) = images.first() else { return Err(list.fault("no image is described")) };
        let axes = match image.get("axes") {
            Some(axes) => axes.list()?.iter().map(axis).collect::<Result<Vec<_>>>()?,
            // Versions 0.1 and 0.2 have five axes.
            None => ["t", "c", "z", "y", "x"].map(Axis::named).to_vec(),
        };
        let datasets = image.need("datasets")?;
        let mut levels = Vec::new();
        for dataset in datasets.list()? {
            let mut place = None;
            for json in [&dataset, image] {
                if let Some(transformations) = json.get("coordinateTransformations") {
                    transform(&transformations, axes.len(), &mut place)?;
                }
            }
            levels.push(Level { path: dataset.need("path")?.text()?.trim_matches('/').to_owned(), place });
        }
        if levels.is_empty() {
            return Err(datasets.fault("no level is described"));
        }
        let name = image.get("name").and_then(|n| n.value().as_str()).filter(|n| !n.is_empty()).map(str::to_owned);
        let labels = attributes.get("image-label").map(|label| segments(&label));
        Ok(Some(Self { name, images: images.len(), axes, levels, channels: channels(&attributes), labels }))
    }

    /// The unit that lengths are given in, and what to multiply those along x, y and z by to have them in it.
    pub(super) fn unit(&self, axes: &Axes) -> (Option<&str>, [f64; 3]) {
        let unit = |axis: usize| axes.find(Role::Space(axis)).and_then(|d| self.axes.get(d)?.unit.as_deref());
        let metres = |unit: &str| UNITS.iter().find(|(name, _)| *name == unit).map(|(_, metres)| *metres);
        let Some(first) = unit(0) else { return (None, [1.0; 3]) };
        let factor = |axis: usize| match unit(axis) {
            // Equal ones need not be known.
            Some(other) if other != first => metres(other).zip(metres(first)).map(|(a, b)| a / b),
            _ => Some(1.0),
        };
        match (factor(1), factor(2)) {
            (Some(y), Some(z)) => (Some(first), [1.0, y, z]),
            _ => (None, [1.0; 3]),
        }
    }
}

impl Level {
    /// Sizes of voxels along x, y and z and the place of the first one, in the axes' own units; `None` where no sizes are given. Along an axis
    /// that is not there the size is that along x.
    pub(super) fn geometry(&self, axes: &Axes) -> Option<([f64; 3], [f64; 3])> {
        let (scale, translation) = self.place.as_ref()?;
        let along = |axis: usize| axes.find(Role::Space(axis));
        let size = |axis: usize| along(axis).or(along(0)).and_then(|d| scale.get(d)).map_or(1.0, |&s| s);
        let place = |axis: usize| along(axis).and_then(|d| translation.get(d)).map_or(0.0, |&t| t);
        Some(([size(0), size(1), size(2)], [place(0), place(1), place(2)]))
    }
}

fn axis(json: &Json) -> Result<Axis> {
    // Version 0.3 has names alone.
    if let Some(name) = json.value().as_str() {
        return Ok(Axis::named(name));
    }
    let text = |key: &str| json.get(key).and_then(|v| v.value().as_str()).map(str::to_owned);
    Ok(Axis { name: json.need("name")?.text()?.to_owned(), kind: text("type").unwrap_or_default(), unit: text("unit") })
}

/// Applies a list of scalings and translations to `place`.
fn transform(list: &Json, count: usize, place: &mut Option<(Vec<f64>, Vec<f64>)>) -> Result<()> {
    for json in list.list()? {
        let kind = json.need("type")?;
        match kind.text()? {
            "identity" => {}
            "scale" => {
                let factors = json.need("scale")?.numbers(count)?;
                let (scale, translation) = place.get_or_insert_with(|| (vec![1.0; count], vec![0.0; count]));
                for (i, factor) in factors.into_iter().enumerate() {
                    scale[i] *= factor;
                    translation[i] *= factor;
                }
            }
            "translation" => {
                let offsets = json.need("translation")?.numbers(count)?;
                let (_, translation) = place.get_or_insert_with(|| (vec![1.0; count], vec![0.0; count]));
                translation.iter_mut().zip(offsets).for_each(|(t, offset)| *t += offset);
            }
            _ => return Err(kind.fault("a transformation that is neither scale nor translation is not supported")),
        }
    }
    Ok(())
}

/// Names of channels by their order; none where one has no name.
fn channels(attributes: &Json) -> Vec<String> {
    let list = attributes.get("omero").and_then(|omero| omero.get("channels")).and_then(|channels| channels.list().ok());
    let label = |json: &Json| json.get("label").and_then(|l| l.value().as_str()).map(str::to_owned);
    list.and_then(|list| list.iter().map(label).collect()).unwrap_or_default()
}

/// The labels that have a colour or a name of their own, sorted.
fn segments(json: &Json) -> Vec<Segment> {
    let entries = |key: &str| json.get(key).and_then(|list| list.list().ok()).unwrap_or_default();
    let value = |entry: &Json| entry.get("label-value").and_then(|v| v.value().as_i64());
    let mut segments = BTreeMap::new();
    for entry in entries("properties") {
        let name = ["name", "label", "class"].iter().find_map(|key| entry.get(key)?.value().as_str());
        if let (Some(value), Some(name)) = (value(&entry), name) {
            segments.insert(value, Segment::new(value, name));
        }
    }
    for entry in entries("colors") {
        let rgba = entry.get("rgba").and_then(|rgba| rgba.numbers(4).ok());
        if let (Some(value), Some(rgba)) = (value(&entry), rgba) {
            let segment = segments.remove(&value).unwrap_or_else(|| Segment::new(value, ""));
            segments.insert(value, segment.with_color([0, 1, 2].map(|i| (rgba[i] / 255.0).clamp(0.0, 1.0))));
        }
    }
    segments.into_values().collect()
}
