//! ParaView's colour maps: a list of objects (or one alone) with `Name`, `RGBPoints` [value, red, green, blue, ...], and perhaps `Points`
//! [value, opacity, midpoint, sharpness, ...] and `ColorSpace`.
//!
//! ParaView lays a map over the data's range when it loads one; here its values are the data's own. Maps in another space than RGB get further
//! points, so that they look the same. A midpoint is honoured by a point of its own, a sharpness of 1 by a step; between 0 and 1 lies a curve,
//! of which only the straight line is left.

use super::color_space::{Space, in_rgb};
use super::numbers::{colors, curve, groups, shortened, some};
use super::{Contents, Parsed, Points, VolumeProperty, choose};
use serde_json::{Map, Value, json};

type Object = Map<String, Value>;

/// Whether `text` is a list of maps or one alone, and not a scene in JSON.
pub(super) fn is_map(text: &str) -> bool {
    text.trim_start().starts_with('[') || text.contains("\"RGBPoints\"") || text.contains("\"IndexedColors\"")
}

pub(super) fn parse(text: &str, name: Option<&str>) -> Parsed<Contents> {
    let value: Value = serde_json::from_str(text).map_err(|e| format!("not JSON: {e}"))?;
    let list = match value {
        Value::Array(list) => list,
        object @ Value::Object(_) => vec![object],
        _ => return Err("holds no colour map: a list of objects is expected".into()),
    };
    let maps: Vec<&Object> =
        list.iter().enumerate().map(|(i, v)| v.as_object().ok_or(format!("entry {i} is no object"))).collect::<Parsed<_>>()?;
    let names: Vec<String> = maps.iter().map(|m| name_of(m).unwrap_or("(without a name)").to_owned()).collect();
    let chosen = choose(&names, name)?;
    contents(maps[chosen]).map_err(|what| format!("{}: {what}", names[chosen]))
}

fn name_of(map: &Object) -> Option<&str> {
    map.get("Name").and_then(Value::as_str)
}

fn contents(map: &Object) -> Parsed<Contents> {
    let mut warnings = Vec::new();
    if !map.contains_key("RGBPoints") {
        let kind = if map.contains_key("IndexedColors") { "; IndexedColors are for categories, not for values" } else { "" };
        return Err(format!("RGBPoints are missing{kind}"));
    }
    let what = "RGBPoints";
    let color = some(colors(groups(&numbers(map, what)?, what, "value, red, green, blue")?, what)?, what)?;
    let space = space(map, &mut warnings)?;
    if map.contains_key("NanColor") {
        warnings.push("NanColor is left out: voxels that are NaN are transparent".into());
    }
    for key in ["UseLogScale", "LogScale"] {
        if map.get(key).is_some_and(|v| v.as_bool() == Some(true) || v.as_f64().is_some_and(|x| x != 0.0)) {
            return Err(format!("{key}: logarithmic maps are not read"));
        }
    }
    let opacity = match map.get("Points") {
        Some(_) => opacity(&numbers(map, "Points")?, &mut warnings)?,
        None => {
            let (lo, hi) = (color[0].0, color[color.len() - 1].0);
            warnings.push(format!("holds no opacity (Points): it rises from 0 at {lo} to 1 at {hi}"));
            vec![(lo, 0.0), (hi, 1.0)]
        }
    };
    let name = name_of(map).unwrap_or_default().to_owned();
    let property = VolumeProperty { name, color: in_rgb(&color, space), opacity, ..VolumeProperty::default() };
    Ok(Contents { property, warnings })
}

/// The flat list of numbers at `key`.
fn numbers(map: &Object, key: &str) -> Parsed<Vec<f64>> {
    let list = map.get(key).and_then(Value::as_array).ok_or_else(|| format!("{key}: must be a list of numbers"))?;
    let one = |(i, v): (usize, &Value)| {
        v.as_f64().filter(|x| x.is_finite()).ok_or_else(|| format!("{key}: entry {i}, {}, is no number", shortened(&v.to_string())))
    };
    list.iter().enumerate().map(one).collect()
}

fn space(map: &Object, warnings: &mut Vec<String>) -> Parsed<Space> {
    let wrapped = map.get("HSVWrap").is_some_and(|v| v.as_bool() == Some(true) || v.as_f64().is_some_and(|x| x != 0.0));
    let Some(value) = map.get("ColorSpace") else { return Ok(Space::Rgb) };
    let name = value.as_str().ok_or_else(|| format!("ColorSpace: {} is no name", shortened(&value.to_string())))?;
    match name.to_ascii_lowercase().as_str() {
        "rgb" => Ok(Space::Rgb),
        "hsv" if wrapped => Ok(Space::HsvWrapped),
        "hsv" => Ok(Space::Hsv),
        "lab" | "cielab" => Ok(Space::Lab),
        "diverging" => Ok(Space::Diverging),
        "step" => Ok(Space::Step),
        "lab/ciede2000" | "ciede2000" => {
            warnings.push("ColorSpace Lab/CIEDE2000 is read as Lab: colours between the points differ a little".into());
            Ok(Space::Lab)
        }
        _ => Err(format!("ColorSpace {:?} is unknown; RGB, HSV, Lab, Lab/CIEDE2000, Diverging and Step are read", shortened(name))),
    }
}

/// Opacity from groups of value, opacity, midpoint and sharpness; the last two shape the piece behind their point.
fn opacity(list: &[f64], warnings: &mut Vec<String>) -> Parsed<Points> {
    let what = "Points";
    let nodes: Vec<[f64; 4]> = some(groups(list, what, "value, opacity, midpoint, sharpness")?, what)?;
    let points = curve(nodes.iter().map(|n| [n[0], n[1]]).collect(), what)?;
    let (mut out, mut straightened) = (Vec::with_capacity(points.len()), 0);
    for (i, &(x, a)) in points.iter().enumerate() {
        out.push((x, a));
        let [_, _, midpoint, sharpness] = nodes[i];
        if !(0.0..=1.0).contains(&midpoint) || !(0.0..=1.0).contains(&sharpness) {
            return Err(format!("{what}: midpoint {midpoint} and sharpness {sharpness} at {x}: both must lie in [0,1]"));
        }
        let Some(&(x1, a1)) = points.get(i + 1).filter(|next| next.0 > x && next.1 != a) else { continue };
        let middle = x + (x1 - x) * midpoint;
        if sharpness >= 0.99 {
            out.extend([(middle, a), (middle, a1)]);
        } else {
            straightened += usize::from(sharpness > 0.01);
            if midpoint != 0.5 {
                out.push((middle, 0.5 * (a + a1)));
            }
        }
    }
    if straightened > 0 {
        warnings.push(format!("{what}: a sharpness between 0 and 1 is left out at {straightened} points: lines are straight there"));
    }
    Ok(out)
}

pub(super) fn write(property: &VolumeProperty) -> String {
    let points: Vec<f64> = property.opacity.iter().flat_map(|&(x, a)| [x, a, 0.5, 0.0]).collect();
    let colors: Vec<f64> = property.color.iter().flat_map(|&(x, [r, g, b])| [x, r, g, b]).collect();
    let name = if property.name.is_empty() { "slicestack" } else { &property.name };
    let map = json!([{ "Name": name, "ColorSpace": "RGB", "RGBPoints": colors, "Points": points }]);
    format!("{map:#}\n")
}
