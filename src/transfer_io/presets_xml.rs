//! 3D Slicer's presets: XML whose elements `VolumeProperty` hold in their attributes what a `.vp` holds in its lines.
//!
//! Attributes that say nothing about the picture (`id`, `selectable`, `effectiveRange` and the like) are passed over.

use super::numbers::{colors, counted, curve, gradient, groups, number, some};
use super::vp::{NEAREST, check_material, lists};
use super::{Contents, Material, Parsed, VolumeProperty, choose, number as written};
use roxmltree::{Document, Node, ParsingOptions};

/// Most elements and attributes of a file.
const MAX_NODES: u32 = 1 << 20;

pub(super) fn parse(text: &str, name: Option<&str>) -> Parsed<Contents> {
    // Without a DTD there are no entities to unfold.
    let options = ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|e| format!("not XML: {e}"))?;
    let found: Vec<Node<'_, '_>> = document.descendants().filter(|n| n.tag_name().name() == "VolumeProperty").collect();
    if found.is_empty() {
        return Err("holds no element VolumeProperty".into());
    }
    let names: Vec<String> = found.iter().map(|n| n.attribute("name").unwrap_or("(without a name)").to_owned()).collect();
    let node = found[choose(&names, name)?];
    let line = document.text_pos_at(node.range().start).row;
    property(node).map_err(|what| format!("line {line}: {what}"))
}

fn property(node: Node<'_, '_>) -> Parsed<Contents> {
    let name = node.attribute("name").unwrap_or_default().to_owned();
    let list = |attribute: &str| match node.attribute(attribute) {
        Some(text) => counted(text, attribute),
        None => Ok(Vec::new()),
    };
    let needed = |attribute: &str| match node.has_attribute(attribute) {
        true => Ok(()),
        false => Err(format!("the attribute {attribute} is missing")),
    };
    let given = |attribute: &str| node.attribute(attribute).map(|text| number(text, attribute)).transpose();
    ["scalarOpacity", "colorTransfer"].into_iter().try_for_each(needed)?;
    let opacity = curve(groups(&list("scalarOpacity")?, "scalarOpacity", "value, opacity")?, "scalarOpacity")?;
    let gradient_opacity = gradient(groups(&list("gradientOpacity")?, "gradientOpacity", "magnitude, factor")?, "gradientOpacity")?;
    let color = colors(groups(&list("colorTransfer")?, "colorTransfer", "value, red, green, blue")?, "colorTransfer")?;
    let mut warnings = Vec::new();
    if given("interpolation")? == Some(0.0) {
        warnings.push(NEAREST.into());
    }
    let usual = Material::default();
    let material = Material {
        ambient: given("ambient")?.unwrap_or(usual.ambient),
        diffuse: given("diffuse")?.unwrap_or(usual.diffuse),
        specular: given("specular")?.unwrap_or(usual.specular),
        shininess: given("specularPower")?.unwrap_or(usual.shininess),
    };
    let material = given("shade")?.is_some_and(|shade| shade != 0.0).then_some(material);
    check_material(material.as_ref())?;
    let opacity_unit = given("scalarOpacityUnitDistance")?;
    if let Some(unit) = opacity_unit.filter(|u| *u <= 0.0) {
        return Err(format!("scalarOpacityUnitDistance {unit}: must be positive"));
    }
    let property = VolumeProperty {
        name,
        color: some(color, "colorTransfer")?,
        opacity: some(opacity, "scalarOpacity")?,
        gradient_opacity,
        opacity_unit,
        material,
    };
    Ok(Contents { property, warnings })
}

pub(super) fn write(property: &VolumeProperty) -> String {
    let m = property.material.unwrap_or_default();
    let shade = if property.material.is_some() { "1" } else { "0" };
    let [ambient, diffuse, specular, power] = [m.ambient, m.diffuse, m.specular, m.shininess].map(written);
    let [opacity, factor, color] = lists(property);
    let name = escaped(if property.name.is_empty() { "slicestack" } else { &property.name });
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<MRML>\n  <VolumeProperty name=\"{name}\" interpolation=\"1\" shade=\"{shade}\" \
         ambient=\"{ambient}\" diffuse=\"{diffuse}\" specular=\"{specular}\" specularPower=\"{power}\"\n    \
         scalarOpacity=\"{opacity}\"\n    gradientOpacity=\"{factor}\"\n    colorTransfer=\"{color}\"/>\n</MRML>\n"
    )
}

/// Text for an attribute; what XML has no place for becomes a space.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
