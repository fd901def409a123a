//! 3D Slicer's volume property, `.vp`: nine lines, a number or a counted list on each.
//!
//! ```text
//!  1                                interpolation: 0 nearest, 1 linear
//!  1                                shade: 0 not lit, 1 lit
//!  0.9                              diffuse
//!  0.2                              ambient
//!  0.2                              specular
//!  10                               specular power
//!  4 -100 0 300 0.8                 scalar opacity: count of numbers, then value and opacity of each point
//!  4 0 1 255 1                      gradient opacity: count, then magnitude and factor of each point
//!  8 -100 0 0 0 300 1 1 1           colour: count, then value, red, green and blue of each point
//! ```
//! Files without gradient opacity have eight lines, or none or 0 on its line.

use super::numbers::{colors, counted, curve, gradient, groups, number, shortened, some};
use super::{Contents, Material, Parsed, VolumeProperty, number as written, spaced};

/// The numbers in front of the lists, and where they stand.
const HEAD: [&str; 6] = ["interpolation", "shade", "diffuse", "ambient", "specular", "specular power"];

pub(super) fn parse(text: &str) -> Parsed<Contents> {
    let mut lines: Vec<(usize, &str)> = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim())).collect();
    while lines.last().is_some_and(|l| l.1.is_empty()) {
        lines.pop();
    }
    let mut head = [0.0; 6];
    for (i, what) in HEAD.iter().enumerate() {
        let &(at, line) = lines.get(i).ok_or_else(|| format!("ends at line {}, before {what}", lines.len()))?;
        if line.split_whitespace().count() != 1 {
            return Err(format!("line {at}: {what} is one number, not {:?}", shortened(line)));
        }
        head[i] = number(line, &format!("line {at}: {what}"))?;
    }
    let mut warnings = Vec::new();
    let lists = &lines[HEAD.len()..];
    let (opacity, factor, color, more) = match lists {
        [] => return Err(format!("ends at line {}, before scalar opacity", lines.len())),
        [_] => return Err(format!("ends at line {}, before colour", lines.len())),
        [opacity, color] => (opacity, None, color, &[][..]),
        [opacity, factor, color, more @ ..] => (opacity, Some(factor), color, more),
    };
    if !more.is_empty() {
        warnings.push(format!("line {} and what follows is left out: a volume property has nine lines", more[0].0));
    }
    let place = |&(at, _): &(usize, &str), what: &str| format!("line {at}: {what}");
    let what = place(opacity, "scalar opacity");
    let opacity = some(curve(groups(&counted(opacity.1, &what)?, &what, "value, opacity")?, &what)?, &what)?;
    let gradient_opacity = match factor {
        Some(line) => {
            let what = place(line, "gradient opacity");
            gradient(groups(&counted(line.1, &what)?, &what, "magnitude, factor")?, &what)?
        }
        None => Vec::new(),
    };
    let what = place(color, "colour");
    let color = some(colors(groups(&counted(color.1, &what)?, &what, "value, red, green, blue")?, &what)?, &what)?;
    let [interpolation, shade, diffuse, ambient, specular, power] = head;
    if interpolation == 0.0 {
        warnings.push(NEAREST.into());
    }
    let material = (shade != 0.0).then_some(Material { ambient, diffuse, specular, shininess: power });
    check_material(material.as_ref())?;
    let property = VolumeProperty { color, opacity, gradient_opacity, material, ..VolumeProperty::default() };
    Ok(Contents { property, warnings })
}

pub(super) const NEAREST: &str = "interpolation 0 (the nearest voxel) is left out: it is render.filter = \"nearest\" of a scene";

/// Refuses a material that makes no light.
pub(super) fn check_material(material: Option<&Material>) -> Parsed<()> {
    let Some(m) = material else { return Ok(()) };
    for (what, x) in [("ambient", m.ambient), ("diffuse", m.diffuse), ("specular", m.specular), ("specular power", m.shininess)] {
        if x < 0.0 {
            return Err(format!("{what} {x}: must not be negative"));
        }
    }
    Ok(())
}

/// The three lists as both of Slicer's formats write them: scalar opacity, gradient opacity, colour.
pub(super) fn lists(property: &VolumeProperty) -> [String; 3] {
    let pairs = |points: &[(f64, f64)]| counted_text(apart(points).iter().flat_map(|&(x, y)| [x, y]), 2 * points.len());
    let flat = [(0.0, 1.0), (1.0, 1.0)];
    let factor = if property.gradient_opacity.is_empty() { &flat[..] } else { &property.gradient_opacity };
    let colors = apart(&property.color);
    [
        pairs(&property.opacity),
        pairs(factor),
        counted_text(colors.iter().flat_map(|&(x, [r, g, b])| [x, r, g, b]), 4 * property.color.len()),
    ]
}

fn counted_text(numbers: impl Iterator<Item = f64>, count: usize) -> String {
    format!("{count} {}", spaced(numbers))
}

/// The points with no two at one value: VTK keeps the last of those alone, and a step would be lost. The first ones move down by as little as
/// a number of 32 bits can tell.
fn apart<T: Copy>(points: &[(f64, T)]) -> Vec<(f64, T)> {
    let mut list = points.to_vec();
    for i in (1..list.len()).rev() {
        if list[i - 1].0 >= list[i].0 {
            let x = list[i].0;
            list[i - 1].0 = x - (x.abs() * f64::from(f32::EPSILON)).max(f64::from(f32::MIN_POSITIVE));
        }
    }
    list
}

pub(super) fn write(property: &VolumeProperty) -> String {
    let m = property.material.unwrap_or_default();
    let shade = if property.material.is_some() { "1" } else { "0" };
    let head = [m.diffuse, m.ambient, m.specular, m.shininess].map(written);
    let mut text = format!("1\n{shade}\n");
    for line in head.iter().chain(&lists(property)) {
        text += line;
        text.push('\n');
    }
    text
}
